//! The composition root: the one room that knows every other.

mod choose;
mod curtain;
mod devices;
#[cfg(unix)]
mod emulate;
mod evaluate;
mod export;
mod fit;
#[cfg(unix)]
mod guard;
#[cfg(unix)]
mod hands_on;
pub mod outcome;
mod pad_relay;
mod panics;
mod plant;
mod progress;
mod replay;
mod report;
mod screen;
pub mod session;
mod shutdown;
mod study;
#[cfg(unix)]
mod watch;
mod words;

use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;

use crate::cli::{Cli, Command};
use crate::clock::VirtualClock;
use crate::report::achieved::Yardstick;
use outcome::Finished;
use session::{Company, Session};
use shutdown::Shutdown;

/// Why something was not done.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Wrong words or a wrong input: exit code 2.
    #[error("{0}")]
    Usage(String),
    /// It went wrong: exit code 1.
    #[error("{0}")]
    Failed(String),
    /// A signal ended it before it began: exit code 128 + n.
    #[error("ended by a signal before it began; the motor is off")]
    Signal(i32),
}

/// Does what the command line says and returns the exit code: 0 done, 1 failed, 2 wrong
/// usage or input, 128 + n ended by signal n.
#[must_use]
pub fn run() -> ExitCode {
    panics::stop_the_plant_first();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are asked for; everything else is wrong usage.
            let asked = matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion);
            let _ = error.print();
            return ExitCode::from(if asked { 0 } else { 2 });
        }
    };
    match obey(&cli) {
        Ok(code) => code,
        Err(error) => {
            tell(&error.to_string());
            match error {
                RunError::Usage(_) => ExitCode::from(2),
                RunError::Failed(_) => ExitCode::from(1),
                RunError::Signal(signal) => signal_code(signal),
            }
        }
    }
}

fn obey(cli: &Cli) -> Result<ExitCode, RunError> {
    match &cli.command {
        None => screen::screen(None),
        Some(Command::Run(run)) if run.headless => headless(run),
        Some(Command::Run(run)) => screen::screen(Some(run)),
        Some(Command::Evaluate(words)) => evaluate::evaluate(words),
        Some(Command::Fit(words)) => fit::fit(words),
        Some(Command::Study(words)) => study::study(words),
        Some(Command::Replay(words)) => replay::replay(words),
        #[cfg(unix)]
        Some(Command::Watch(words)) => watch::watch(words),
        #[cfg(not(unix))]
        Some(Command::Watch(_)) => {
            Err(RunError::Usage("this system has no Unix sockets to watch through".to_owned()))
        }
        Some(Command::Export(words)) => export::export(words),
        Some(Command::Report(words)) => report::report(words),
        Some(Command::Simulate(simulate)) => words::simulate(simulate),
        Some(Command::PadRelay(words)) => pad_relay::pad_relay(words),
        #[cfg(unix)]
        Some(Command::Emulate(words)) => emulate::emulate(words),
        #[cfg(not(unix))]
        Some(Command::Emulate(_)) => {
            Err(RunError::Usage("this system has no pseudo-terminals".to_owned()))
        }
        #[cfg(unix)]
        Some(Command::Guard(words)) => guard::guard(words),
        #[cfg(not(unix))]
        Some(Command::Guard(_)) => {
            Err(RunError::Usage("this system has no port to guard".to_owned()))
        }
        Some(Command::Profile(profile)) => words::profile(profile),
        Some(Command::Devices(words)) => devices::devices(words),
    }
}

/// A whole session on virtual time.
fn headless(run: &crate::cli::Run) -> Result<ExitCode, RunError> {
    let shutdown = Shutdown::listen();
    let company = if run.arm { Company::Armed(shutdown.clone()) } else { Company::Headless };
    let session = if let Some(folder) = &run.resume {
        Session::resume(folder, &company)?
    } else {
        let order = run.order().map_err(|error| RunError::Usage(error.to_string()))?;
        Session::begin(&order, &company)?
    };
    for notice in &session.notices {
        tell(notice);
    }
    shutdown.abort_on_signal(session.watcher.clone());
    // That nobody can watch ends no session.
    #[cfg(unix)]
    let _post = watch::post(&session).inspect_err(|error| tell(&format!("{error}"))).ok();
    let finished = session.run(&mut VirtualClock::default(), || shutdown.signal())?;
    if run.json {
        let json = serde_json::to_string(&finished.results)
            .map_err(|error| RunError::Failed(format!("the results have no JSON: {error}")))?;
        say(&json)?;
    } else {
        say(&sentences(&finished).join("\n"))?;
    }
    // Nobody was there to end it: something went wrong.
    let is_cut =
        finished.results.status == crate::record::Status::Aborted && finished.signal.is_none();
    Ok(if is_cut { ExitCode::from(1) } else { exit_code(&finished) })
}

/// What came out, for people.
fn sentences(finished: &Finished) -> Vec<String> {
    let mut lines = finished.results.phases.sentences();
    if !finished.tenths.is_empty() {
        let Yardstick { name, unit, decimals, .. } = finished.results.yardstick();
        let tenths: Vec<String> = finished
            .tenths
            .iter()
            .map(|(percent, mean)| format!("{percent} %: {mean:.decimals$}"))
            .collect();
        let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
        lines.push(format!("after each tenth  {name}{unit}: {}", tenths.join(", ")));
    }
    if let Some(cause) = &finished.cause {
        lines.push(format!("ended early: {cause}"));
    }
    lines.push(format!("files in {}", finished.folder.display()));
    lines
}

fn exit_code(finished: &Finished) -> ExitCode {
    use crate::record::Status;
    match (finished.results.status, finished.signal) {
        (Status::Failed, _) => ExitCode::from(1),
        (_, Some(signal)) => signal_code(signal),
        _ => ExitCode::SUCCESS,
    }
}

/// The exit code of a program that signal `signal` ended.
fn signal_code(signal: i32) -> ExitCode {
    ExitCode::from(128_u8.saturating_add(u8::try_from(signal).unwrap_or(0)))
}

/// A message for a person, on standard error.
fn tell(message: &str) {
    let mut out = io::stderr().lock();
    let _ = writeln!(out, "coadapt: {}", message.trim_end());
}

/// A result, on standard output.
fn say(result: &str) -> Result<(), RunError> {
    let mut out = io::stdout().lock();
    match writeln!(out, "{result}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(RunError::Failed(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Whether messages on standard error may be coloured.
fn wants_colour() -> bool {
    io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty())
}
