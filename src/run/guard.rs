//! `coadapt guard`: the motor's guard, which only coadapt itself starts.

use std::io::{self, IsTerminal};
use std::process::ExitCode;

use super::RunError;
use crate::backend::guard::Stop;
use crate::backend::guard::child::keep_watch;
use crate::cli;
use crate::signal::Seconds;

/// Watches until the program that started it is gone.
pub(super) fn guard(words: &cli::Guard) -> Result<ExitCode, RunError> {
    if io::stdin().is_terminal() {
        let why = "guard: coadapt starts this by itself when it arms a real plant";
        return Err(RunError::Usage(why.to_owned()));
    }
    let stop = Stop { burst: words.stop.to_vec(), again: words.again.to_vec() };
    keep_watch(&stop, Seconds(words.patience_s))
        .map_err(|error| RunError::Failed(format!("the guard cannot watch: {error}")))?;
    Ok(ExitCode::SUCCESS)
}
