//! Short commands without a session: simulate, profile.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;
use std::process::ExitCode;

use super::{RunError, say, wants_colour};
use crate::cli;
use crate::profile::{self, Document, Profile};
use crate::study::simulate as simulation;

pub(super) fn usage(error: impl std::fmt::Display) -> RunError {
    RunError::Usage(error.to_string())
}

pub(super) fn document(name: &str, sets: &[(String, String)]) -> Result<Document, RunError> {
    let mut document = Document::find(name, Path::new("profiles")).map_err(usage)?;
    for (key, value) in sets {
        document.set(key, value);
    }
    Ok(document)
}

pub(super) fn read(document: &Document) -> Result<Profile, RunError> {
    document.read().map_err(|report| RunError::Usage(report.render(wants_colour())))
}

/// `coadapt profile …`
pub(super) fn profile(command: &cli::Profile) -> Result<ExitCode, RunError> {
    match command {
        cli::Profile::List => {
            let listed = profile::list(Path::new("profiles"));
            let width = listed.iter().map(|l| l.name.len()).max().unwrap_or(0);
            let lines: Vec<String> =
                listed.iter().map(|l| format!("{:width$}  {}", l.name, l.title)).collect();
            say(&lines.join("\n"))?;
        }
        cli::Profile::Show(looked) => {
            let shown = profile::show(&document(&looked.profile, &looked.set)?, true)
                .map_err(|report| RunError::Usage(report.render(wants_colour())))?;
            say(shown.trim_end())?;
        }
        cli::Profile::Check(looked) => {
            let document = document(&looked.profile, &looked.set)?;
            read(&document)?;
            say(&format!("{} is a good profile", document.shown()))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// `coadapt simulate …`
pub(super) fn simulate(words: &cli::Simulate) -> Result<ExitCode, RunError> {
    let profile = read(&document(&words.profile, &words.set)?)?;
    let start = simulation::start(&profile, &words.start).map_err(usage)?;
    let name = words.actions.display().to_string();
    let actions = if words.actions == Path::new("-") {
        simulation::actions("standard input", io::stdin().lock())
    } else {
        let file = File::open(&words.actions).map_err(|error| {
            usage(format_args!("cannot read the table of actions {name}: {error}"))
        })?;
        simulation::actions(&name, file)
    };
    let out = BufWriter::new(io::stdout().lock());
    match simulation::simulate(&profile, start, &actions.map_err(usage)?, words.seed, out) {
        Err(simulation::SimulateError::Io(error)) if error.kind() == io::ErrorKind::BrokenPipe => {}
        done => done.map_err(|error| RunError::Failed(error.to_string()))?,
    }
    Ok(ExitCode::SUCCESS)
}
