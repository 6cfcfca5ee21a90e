//! A progress bar on standard error: finished runs, and the time that is left.

use indicatif::ProgressBar;

use crate::run::progress;
use crate::study::batch::Progress;

/// Shows how far a study is, where somebody looks.
pub(super) struct Bar {
    drawn: Option<ProgressBar>,
}

impl Bar {
    /// A bar of `runs` runs.
    pub(super) fn new(runs: usize) -> Self {
        Self { drawn: progress::bar(runs, "runs") }
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
