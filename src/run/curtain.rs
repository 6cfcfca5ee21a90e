//! A screen from its beginning to its end, whatever ends it.

use std::panic::{self, AssertUnwindSafe};
use std::process::ExitCode;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use super::session::usage;
use super::shutdown::Shutdown;
use super::{RunError, panics, signal_code};
use crate::clock::WallClock;
use crate::operator::terminal::{Hands, Params};
use crate::tui::app::End;
use crate::tui::terminal::{Feed, KeysFrom, Screen, give_back};

/// Takes the terminal, lets `show` draw there until it says how it ended, and gives it back. `show`
/// can ask whether a signal came.
pub(super) fn shown(
    show: impl FnOnce(&mut Screen, &dyn Fn() -> bool) -> End,
) -> Result<ExitCode, RunError> {
    shown_to(Feed::new(Hands::new(&Params::default()), WallClock::start()), show)
}

/// The same, with the keys that come from `feed`.
pub(super) fn shown_to(
    feed: Feed,
    show: impl FnOnce(&mut Screen, &dyn Fn() -> bool) -> End,
) -> Result<ExitCode, RunError> {
    let shutdown = Shutdown::listen();
    let mut screen = Screen::take(feed, KeysFrom::Input).map_err(|error| usage(&error))?;
    let is_over = || shutdown.signal().is_some();
    let ended = panic::catch_unwind(AssertUnwindSafe(|| show(&mut screen, &is_over)));
    fall(screen);
    match ended {
        Ok(end) => Ok(code_of(end, &shutdown).unwrap_or(ExitCode::SUCCESS)),
        Err(_) => Err(RunError::Failed("the screen failed".to_owned())),
    }
}

/// Gives the terminal back, and tells what could not be told while the screen was up.
pub(super) fn fall(screen: Screen) {
    // A terminal that is gone lets even its farewell fail.
    let _ = panic::catch_unwind(AssertUnwindSafe(|| drop(screen)));
    give_back();
    panics::tell_last_words();
}

/// What a screen that did not end by itself says to the shell.
pub(super) fn code_of(end: End, shutdown: &Shutdown) -> Option<ExitCode> {
    match end {
        End::Quit => None,
        End::Interrupted => Some(signal_code(SIGINT)),
        End::Signal => Some(signal_code(shutdown.signal().unwrap_or(SIGTERM))),
        End::Lost => Some(signal_code(SIGHUP)),
    }
}
