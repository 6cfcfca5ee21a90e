//! Progress on standard error: a bar where somebody looks, a line now and then where it is a file.

use std::sync::{Mutex, PoisonError};

use indicatif::ProgressBar;

use super::super::{progress, tell};
use crate::clock::{Clock, WallClock};
use crate::signal::Seconds;
use crate::study::batch::Progress;

/// Without a bar a line is told after so long, s, and then
const FIRST_WORD: Seconds = Seconds(10.0);
/// each time so many times later, so that a night has no more than a page.
const PATIENCE: f64 = 1.5;

/// Shows how far a study is.
pub(super) enum Bar {
    /// A bar.
    Drawn(ProgressBar),
    /// Lines.
    Told(Lines),
}

/// What decides when a line is due.
pub(super) struct Lines {
    clock: WallClock,
    due: Mutex<Seconds>,
}

impl Bar {
    /// A bar of `runs` runs.
    pub(super) fn new(runs: usize) -> Self {
        let lines = || Lines { clock: WallClock::start(), due: Mutex::new(FIRST_WORD) };
        progress::bar(runs, "runs").map_or_else(|| Self::Told(lines()), Self::Drawn)
    }

    /// Shows `progress`.
    pub(super) fn show(&self, progress: &Progress) {
        let failed = progress.failed.as_ref().map(|(run, why)| format!("run {run} failed: {why}"));
        match self {
            Self::Drawn(bar) => {
                if let Some(failed) = failed {
                    bar.println(format!("coadapt: {failed}"));
                }
                bar.set_position(progress.over as u64);
            }
            Self::Told(lines) => {
                if let Some(failed) = failed {
                    tell(&failed);
                }
                if let Some(line) = lines.line(lines.clock.now(), progress) {
                    tell(&line);
                }
            }
        }
    }

    /// Takes the bar away, before something else is printed.
    pub(super) fn clear(&self) {
        if let Self::Drawn(bar) = self {
            bar.finish_and_clear();
        }
    }
}

impl Lines {
    /// The line about `progress` at the time `now`, if one is due.
    fn line(&self, now: Seconds, progress: &Progress) -> Option<String> {
        let mut due = self.due.lock().unwrap_or_else(PoisonError::into_inner);
        let Progress { over, of, .. } = *progress;
        if now.0 < due.0 || over == 0 || over >= of {
            return None;
        }
        *due = Seconds(now.0 * PATIENCE);
        #[expect(clippy::cast_precision_loss, reason = "a number of runs")]
        let left = now.0 / over as f64 * (of - over) as f64;
        Some(format!("{over} of {of} runs are over, about {} left", span(left)))
    }
}

/// A span of time in words.
fn span(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_comes_now_and_then_and_says_what_is_left() {
        let lines = Lines { clock: WallClock::start(), due: Mutex::new(FIRST_WORD) };
        let at = |now, over| lines.line(Seconds(now), &Progress { over, of: 40, failed: None });
        assert_eq!(at(9.0, 9), None);
        assert_eq!(at(10.0, 10).as_deref(), Some("10 of 40 runs are over, about 30 s left"));
        assert_eq!(at(14.0, 12), None);
        assert_eq!(at(600.0, 20).as_deref(), Some("20 of 40 runs are over, about 10 min left"));
        assert_eq!(at(899.0, 21), None);
        assert_eq!(at(90000.0, 30).as_deref(), Some("30 of 40 runs are over, about 8.3 h left"));
        assert_eq!(at(1e6, 40), None, "the end is told otherwise");
    }
}
