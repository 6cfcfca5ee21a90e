//! A progress bar on standard error, for fits that take long.

use std::io::{self, IsTerminal};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::clock::{Clock, WallClock};
use crate::study::fit::{Progress, Stage};

/// A fit that is over sooner shows no bar, s.
const PATIENCE: f64 = 0.5;
/// The bar's length: permille.
const WHOLE: f64 = 1000.0;

/// Shows how far a fit is, where somebody looks.
pub(super) struct Bar {
    clock: WallClock,
    stage: Option<Stage>,
    drawn: Option<ProgressBar>,
}

impl Bar {
    pub(super) fn new(clock: WallClock) -> Self {
        Self { clock, stage: None, drawn: None }
    }

    /// Shows `progress`.
    pub(super) fn show(&mut self, progress: Progress) {
        if self.stage.is_none() && self.clock.now().0 < PATIENCE {
            return;
        }
        if self.stage != Some(progress.stage) {
            self.begin(progress.stage);
        }
        if let Some(bar) = &self.drawn {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 1")]
            bar.set_position((progress.done * WHOLE) as u64);
            bar.set_message(format!("{} fields", progress.fields));
        }
    }

    fn begin(&mut self, stage: Stage) {
        self.clear();
        self.stage = Some(stage);
        let is_dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        if !io::stderr().is_terminal() || is_dumb {
            return;
        }
        let word = match stage {
            Stage::Learning => "learning",
            Stage::Checking => "checking",
            Stage::Predicting => "predicting",
        };
        let template = format!("{word:10} {{wide_bar}} {{percent:>3}} %  {{eta:>4}}  {{msg}}");
        let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr_with_hz(5));
        if let Ok(style) = ProgressStyle::with_template(&template) {
            bar.set_style(style.progress_chars("=> "));
        }
        self.drawn = Some(bar);
    }

    /// Takes the bar away, before something else is printed.
    pub(super) fn clear(&mut self) {
        if let Some(bar) = self.drawn.take() {
            bar.finish_and_clear();
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.clear();
    }
}
