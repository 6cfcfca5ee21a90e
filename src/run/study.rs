//! `coadapt study`: many sessions, compared.

mod join;
mod progress;
mod slurm;

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::shutdown::Shutdown;
use super::{RunError, say, signal_code, tell};
use crate::cli;
use crate::host;
use crate::profile::Text;
use crate::record;
use crate::study::batch::{
    Card, Changes, Conclusion, Desk, Folder, Manner, Run, Shard, Study, StudyError, Tally, What,
    conclude, names, perform, read, steps, work,
};
use progress::Bar;

/// Where profiles and studies are looked for.
const PROFILES: &str = "profiles";

pub(super) fn study(words: &cli::Study) -> Result<ExitCode, RunError> {
    let shutdown = Shutdown::listen();
    let outcome = match &words.command {
        Some(cli::StudyCommand::Merge(words)) => join::join(words, &shutdown),
        Some(cli::StudyCommand::List(words)) => list(words),
        None => carry_out(&words.words, &shutdown),
    };
    match (outcome, shutdown.signal()) {
        // Whatever could not be done: it was asked to end.
        (Err(error), Some(signal)) => {
            tell(&error.to_string());
            Ok(signal_code(signal))
        }
        (outcome, _) => outcome,
    }
}

impl From<StudyError> for RunError {
    fn from(error: StudyError) -> Self {
        let words = match &error {
            StudyError::Text(report) => report.render(super::wants_colour()),
            other => other.to_string(),
        };
        if error.is_usage() { Self::Usage(words) } else { Self::Failed(words) }
    }
}

/// `study list`.
fn list(words: &cli::StudyList) -> Result<ExitCode, RunError> {
    let names = names(Path::new(PROFILES));
    if words.json {
        say(&serde_json::json!({ "schema": 1, "studies": names }).to_string())?;
    } else {
        say(&names.join("\n"))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn carry_out(words: &cli::StudyWords, shutdown: &Shutdown) -> Result<ExitCode, RunError> {
    let name = words.study.as_deref().unwrap_or_default();
    let changes = Changes { sets: words.set.clone(), seeds: words.seeds };
    let is_enough = || shutdown.signal().is_some();
    let study = Study::find(name, Path::new(PROFILES), &changes, &is_enough)?;
    let shard = words.shard.unwrap_or(Shard::WHOLE);
    let card = Card {
        version: record::VERSION.to_owned(),
        name: study.name.clone(),
        task: study.task().to_owned(),
        preset: study.preset().to_owned(),
        found: found_again(name),
        sets: changes.sets,
        seeds: changes.seeds,
        shard: shard.number,
        shards: shard.of,
        identity: study.identity().to_owned(),
    };
    let path = words.out.clone().unwrap_or_else(|| usual_folder(&study, shard));
    let folder = Folder::open(&path, &card)?;
    if words.slurm.is_some() {
        return slurm::array(words, &study, &folder, &card, shutdown);
    }
    let (open, done) = folder.open_runs(&study, shard);
    let all = done + open.len();
    if done > 0 {
        tell(&format!("{done} of {all} runs are in {} already", path.display()));
    }
    let tally = run_all(&open, &folder, words, &study, shutdown)?;
    if let Some(signal) = shutdown.signal() {
        tell(&format!(
            "interrupted: {} of {all} runs are kept in {}; the same command goes on from there",
            done + tally.done,
            path.display()
        ));
        return Ok(signal_code(signal));
    }
    let runs: Vec<&Run> = study.share(shard).collect();
    if words.keep_steps {
        tell_without_steps(&runs, &path);
    }
    let read = |number| read(&path, number);
    let manner = Manner { jobs: jobs(words.jobs), read: &read, is_enough: &is_enough };
    let conclusion = conclude(&path, &study, &runs, &manner)?;
    tell(&cost(&conclusion));
    print(&conclusion, &study, &path, words.json)?;
    Ok(if conclusion.failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The study's name, or its path as it is from everywhere.
fn found_again(name: &str) -> String {
    match std::path::absolute(name) {
        Ok(absolute) if Text::is_path(name) => absolute.display().to_string(),
        _ => name.to_owned(),
    }
}

fn usual_folder(study: &Study, shard: Shard) -> PathBuf {
    let folder = Path::new("logs").join("studies");
    if shard == Shard::WHOLE {
        folder.join(&study.name)
    } else {
        folder.join(format!("{}-{}-of-{}", study.name, shard.number, shard.of))
    }
}

/// As many threads as wanted, or as there are cores.
fn jobs(wanted: Option<u32>) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    wanted.map_or_else(cores, |jobs| jobs as usize)
}

/// Carries out `runs` on as many threads as wanted.
fn run_all(
    runs: &[&Run],
    folder: &Folder,
    words: &cli::StudyWords,
    study: &Study,
    shutdown: &Shutdown,
) -> Result<Tally, RunError> {
    if words.keep_steps {
        folder.make_steps()?;
    }
    let bar = Bar::new(runs.len());
    let desk = Desk {
        folder,
        jobs: jobs(words.jobs),
        memory: &host::most_memory_mib,
        told: &|progress| bar.show(&progress),
        is_enough: &|| shutdown.signal().is_some(),
    };
    let tally = work(runs, &desk, &|run, is_enough| {
        let is_kept = words.keep_steps && run.what != What::References;
        let steps = is_kept.then(|| steps(folder.path(), run.number));
        perform(study, run, steps.as_deref(), is_enough)
    });
    bar.clear();
    tally.map_err(|error| {
        let kept = "finished runs are kept: the same command goes on from there";
        match RunError::from(error) {
            RunError::Failed(words) => RunError::Failed(format!("{words}\n{kept}")),
            other => other,
        }
    })
}

/// Tells of sessions that were finished before their steps were asked for.
fn tell_without_steps(runs: &[&Run], folder: &Path) {
    let is_without =
        |run: &&&Run| run.what != What::References && !steps(folder, run.number).exists();
    let without = runs.iter().filter(is_without).count();
    if without > 0 {
        tell(&format!(
            "no step rows of {without} runs: they were finished without --keep-steps, or went wrong; \
             for those of all give a new folder with --out DIR"
        ));
    }
}

/// Prints what is shown: `table.txt`, or `summary.json`, which may be longer than the memory.
fn print(
    conclusion: &Conclusion,
    study: &Study,
    folder: &Path,
    json: bool,
) -> Result<(), RunError> {
    if json {
        return copy(&folder.join("summary.json"));
    }
    let Conclusion { runs, done, failed, remarks, .. } = conclusion;
    let (name, task) = (&study.name, study.task());
    say(&format!("{name} ({task}): {done} of {runs} runs done, {} failed", failed.len()))?;
    copy(&folder.join("table.txt"))?;
    let failed = failed.iter().map(|(run, why)| format!("run {run} failed: {why}"));
    let files = format!("\nfiles in {}", folder.display());
    let lines: Vec<String> = remarks.iter().cloned().chain(failed).chain([files]).collect();
    say(&lines.join("\n"))
}

/// Copies a file to standard output.
fn copy(path: &Path) -> Result<(), RunError> {
    let copied =
        File::open(path).and_then(|mut file| io::copy(&mut file, &mut io::stdout().lock()));
    match copied {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(RunError::Failed(format!(
            "cannot copy {} to standard output: {error}",
            path.display()
        ))),
        _ => Ok(()),
    }
}

/// What runs cost.
fn cost(conclusion: &Conclusion) -> String {
    let Conclusion { done, failed, processor_s, memory_mib, .. } = conclusion;
    let count = done + failed.len();
    format!(
        "{count} runs took {processor_s:.1} s of processor time and at most {memory_mib:.0} MiB"
    )
}
