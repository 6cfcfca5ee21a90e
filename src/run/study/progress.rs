//! A progress bar on standard error: finished runs, and the time that is left.

use std::io::{self, IsTerminal};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::study::batch::Progress;

/// Shows how far a study is, where somebody looks.
pub(super) struct Bar {
    drawn: Option<ProgressBar>,
}

impl Bar {
    /// A bar of `runs` runs.
    pub(super) fn new(runs: usize) -> Self {
        let is_dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        if !io::stderr().is_terminal() || is_dumb || runs == 0 {
            return Self { drawn: None };
        }
        let target = ProgressDrawTarget::stderr_with_hz(5);
        let bar = ProgressBar::with_draw_target(Some(runs as u64), target);
        let template = "{pos}/{len} runs {wide_bar} {percent:>3} %  {eta:>4} left{msg}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        // Drawn at once: the first run may take minutes.
        bar.tick();
        Self { drawn: Some(bar) }
    }

    /// Shows `progress`.
    pub(super) fn show(&self, progress: &Progress) {
        let failed = progress.failed.as_ref().map(|(run, why)| format!("run {run} failed: {why}"));
        match (&self.drawn, failed) {
            (Some(bar), failed) => {
                if let Some(failed) = failed {
                    bar.println(format!("coadapt: {failed}"));
                }
                bar.set_position(progress.over as u64);
            }
            (None, Some(failed)) => super::super::tell(&failed),
            (None, None) => {}
        }
    }

    /// Takes the bar away, before something else is printed.
    pub(super) fn clear(&self) {
        if let Some(bar) = &self.drawn {
            bar.finish_and_clear();
        }
    }
}
