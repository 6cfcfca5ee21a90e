//! The commands without a session: evaluate, simulate, profile.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;
use std::process::ExitCode;

use serde::Serialize;

use super::{RunError, say, wants_colour};
use crate::cli;
use crate::learner::{Learner, Model};
use crate::profile::{self, Document, Profile};
use crate::record::{self, Policy};
use crate::report::metrics::{self, Measures};
use crate::study::{evaluate as evaluation, simulate as simulation};

fn usage(error: impl std::fmt::Display) -> RunError {
    RunError::Usage(error.to_string())
}

fn document(name: &str, sets: &[(String, String)]) -> Result<Document, RunError> {
    let mut document = Document::find(name, Path::new("profiles")).map_err(usage)?;
    for (key, value) in sets {
        document.set(key, value);
    }
    Ok(document)
}

fn read(document: &Document) -> Result<Profile, RunError> {
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

/// What `evaluate --json` prints.
#[derive(Serialize)]
struct Evaluation {
    schema: u32,
    policy: String,
    task: String,
    preset: String,
    seed: u64,
    #[serde(flatten)]
    measures: Measures,
}

/// `coadapt evaluate …`
pub(super) fn evaluate(words: &cli::Evaluate) -> Result<ExitCode, RunError> {
    let (file, recorded) = if words.policy.is_dir() {
        let sidecar = record::read_sidecar(&words.policy.join("session.json")).map_err(usage)?;
        (words.policy.join("policy.json"), Some(sidecar.profile_ron))
    } else {
        (words.policy.clone(), None)
    };
    let policy: Policy<Model> = record::read_policy(&file).map_err(usage)?;
    let mut profile = match (&words.profile, recorded) {
        (Some(name), _) => document(name, &[])?,
        (None, Some(text)) => Document::from_text("session.json", text),
        (None, None) if policy.task == record::policy::TABLE => {
            return Err(usage(format_args!(
                "{} was learned from a table, so no task is known: give --profile",
                file.display()
            )));
        }
        (None, None) => document(&policy.task, &[])?,
    };
    if let Some(starts) = words.starts {
        profile.set("session.autonomous_rollouts", &starts.to_string());
    }
    let profile = read(&profile)?;
    let features = profile.experiment.task(profile.tick()).feature_names();
    let columns = (policy.learner.inputs(), policy.learner.outputs());
    if let Some(misfit) = policy.misfit(profile.experiment.name(), features, columns) {
        return Err(usage(format_args!("{}: {misfit}", file.display())));
    }
    let rows =
        evaluation::autonomous(&profile, &policy.learner, words.seed, || false).unwrap_or_default();
    let Some(measures) = metrics::phases(&policy.task, &rows, None).autonomous else {
        return Err(RunError::Failed("no rollout took place".to_owned()));
    };
    if words.json {
        let evaluation = Evaluation {
            schema: 1,
            policy: file.display().to_string(),
            task: profile.experiment.name().to_owned(),
            preset: policy.preset,
            seed: words.seed,
            measures,
        };
        say(&serde_json::to_string(&evaluation).map_err(|e| RunError::Failed(e.to_string()))?)?;
    } else {
        say(&measures.sentence())?;
    }
    Ok(ExitCode::SUCCESS)
}
