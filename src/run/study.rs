//! `coadapt study`: many sessions, compared.

mod progress;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::shutdown::Shutdown;
use super::{RunError, say, signal_code, tell};
use crate::cli;
use crate::host;
use crate::profile::Text;
use crate::record;
use crate::study::batch::slurm::{Array, Need, script};
use crate::study::batch::{
    Card, Changes, Desk, Done, Folder, Kept, Outcome, Run, Shard, Study, StudyError, Summary,
    Tally, What, draw, merge, names, perform, read, summarise, work, write_table,
};
use progress::Bar;

/// Where profiles and studies are looked for.
const PROFILES: &str = "profiles";

pub(super) fn study(words: &cli::Study) -> Result<ExitCode, RunError> {
    match &words.command {
        Some(cli::StudyCommand::Merge(words)) => join(words),
        Some(cli::StudyCommand::List) => {
            say(&names().collect::<Vec<_>>().join("\n"))?;
            Ok(ExitCode::SUCCESS)
        }
        None => carry_out(&words.words),
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

fn carry_out(words: &cli::StudyWords) -> Result<ExitCode, RunError> {
    let shutdown = Shutdown::listen();
    let name = words.study.as_deref().unwrap_or_default();
    let changes = Changes { sets: words.set.clone(), seeds: words.seeds };
    let study = Study::find(name, Path::new(PROFILES), &changes)?;
    let shard = words.shard.unwrap_or(Shard::WHOLE);
    let card = Card {
        version: record::VERSION.to_owned(),
        name: study.name.clone(),
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
        return array(words, &study, &folder, &shutdown);
    }
    let (open, done) = folder.open_runs(&study, shard);
    if done > 0 {
        let all = done + open.len();
        tell(&format!("{done} of {all} runs are in {} already", path.display()));
    }
    let tally = run_all(&open, &folder, words, &study, &shutdown)?;
    if let Some(signal) = shutdown.signal() {
        tell(&format!(
            "interrupted: {} of {} runs are kept in {}; the same command goes on from there",
            done + tally.done,
            done + open.len(),
            path.display()
        ));
        return Ok(signal_code(signal));
    }
    let runs: Vec<&Run> = study.share(shard).collect();
    let summary = conclude(&study, &runs, &path, &|number| read(&path, number))?;
    tell(&cost(&runs, &|number| read(&path, number)));
    print(&summary, &study, &path, words.json)?;
    Ok(if summary.failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
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

/// Carries out `runs` on as many threads as wanted.
fn run_all(
    runs: &[&Run],
    folder: &Folder,
    words: &cli::StudyWords,
    study: &Study,
    shutdown: &Shutdown,
) -> Result<Tally, RunError> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let bar = Bar::new(runs.len());
    let desk = Desk {
        folder,
        jobs: words.jobs.map_or(cores, |jobs| jobs as usize),
        memory: &host::most_memory_mib,
        told: &|progress| bar.show(&progress),
        is_enough: &|| shutdown.signal().is_some(),
    };
    let keeps_steps = words.keep_steps;
    let tally = work(runs, &desk, &|run, is_enough| {
        let steps = (keeps_steps && run.what != What::References)
            .then(|| folder.steps(run.number))
            .transpose()
            .map_err(|error| crate::study::batch::Failure::Failed(error.to_string()))?;
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

/// Writes what `runs` came to, as tables and figures, and returns their summary.
fn conclude(
    study: &Study,
    runs: &[&Run],
    folder: &Path,
    read: &dyn Fn(u32) -> Option<Kept>,
) -> Result<Summary, RunError> {
    let done = |number| done(read(number)?).ok();
    write_table(&folder.join("results.csv"), runs.iter().copied(), &done)?;
    let summary = summarise(study, runs.iter().copied(), &|number| read(number).map(self::done));
    draw(folder, study, runs, &summary, &done)?;
    summary.write(&folder.join("summary.json"))?;
    Ok(summary)
}

/// What a run came to, or why it went wrong.
fn done(kept: Kept) -> Result<Done, String> {
    match kept.outcome {
        Outcome::Done(done) => Ok(*done),
        Outcome::Failed(why) => Err(why),
    }
}

fn print(summary: &Summary, study: &Study, folder: &Path, json: bool) -> Result<(), RunError> {
    if json {
        let json = serde_json::to_string(summary);
        return say(&json.map_err(|error| RunError::Failed(error.to_string()))?);
    }
    let mut lines = summary.sentences(&study.params);
    lines.push(format!("\nfiles in {}", folder.display()));
    say(&lines.join("\n"))
}

/// What `runs` cost.
fn cost(runs: &[&Run], read: &dyn Fn(u32) -> Option<Kept>) -> String {
    let (mut seconds, mut memory, mut count) = (0.0, 0.0_f64, 0_usize);
    for kept in runs.iter().filter_map(|run| read(run.number)) {
        seconds += kept.processor_s.unwrap_or(0.0);
        memory = memory.max(kept.memory_mib.unwrap_or(0.0));
        count += 1;
    }
    format!("{count} runs took {seconds:.1} s of processor time and at most {memory:.0} MiB")
}

/// `study merge`: joins shards.
fn join(words: &cli::Merge) -> Result<ExitCode, RunError> {
    let merged = merge(&words.folders, Path::new(PROFILES))?;
    let study = &merged.study;
    let path = words.out.clone().unwrap_or_else(|| usual_folder(study, Shard::WHOLE));
    let folder = Folder::open(&path, &merged.card)?;
    let has = |number: u32| read(&path, number).is_some_and(|kept| done(kept).is_ok());
    for run in study.runs.iter().filter(|run| !has(run.number)) {
        if let Some(kept) = merged.read(run.number) {
            folder.keep(run.number, &kept)?;
        }
    }
    let runs: Vec<&Run> = study.runs.iter().collect();
    let summary = conclude(study, &runs, &path, &|number| read(&path, number))?;
    for (of, shards) in merged.absent() {
        let list: Vec<String> = shards.iter().take(20).map(|s| format!("{s}/{of}")).collect();
        let more = if shards.len() > list.len() { ", …" } else { "" };
        tell(&format!("missing shards: {}{more}", list.join(", ")));
    }
    for number in summary.missing.iter().take(20) {
        if let Some(run) = study.runs.get(*number as usize - 1) {
            tell(&format!("missing: {}", study.labels(run)));
        }
    }
    print(&summary, study, &path, words.json)?;
    let missing = summary.missing.len();
    if missing > 0 {
        tell(&format!(
            "{missing} of {} runs are missing: run their shards, or go on with: coadapt study {} \
             --out {}",
            summary.runs,
            merged.card.found,
            path.display()
        ));
    }
    let is_whole = missing == 0 && summary.failed.is_empty();
    Ok(if is_whole { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// `--slurm`: writes the script of an array job.
fn array(
    words: &cli::StudyWords,
    study: &Study,
    folder: &Folder,
    shutdown: &Shutdown,
) -> Result<ExitCode, RunError> {
    let kept = || study.runs.iter().filter_map(|run| read(folder.path(), run.number));
    let sessions =
        |kept: &Kept| matches!(&kept.outcome, Outcome::Done(done) if !done.curve.is_empty());
    if kept().filter(sessions).count() == 0 {
        // One session of each arm tells what they need.
        let arms = study.params.arms.len();
        let is_session = |run: &&Run| run.what != What::References;
        let first: Vec<&Run> = study.runs.iter().filter(is_session).take(arms).collect();
        tell("no run is finished yet: measuring one of each arm");
        run_all(&first, folder, words, study, shutdown)?;
        if let Some(signal) = shutdown.signal() {
            return Ok(signal_code(signal));
        }
    }
    let seconds: Vec<f64> = kept().filter(sessions).filter_map(|kept| kept.processor_s).collect();
    if seconds.is_empty() {
        return Err(RunError::Failed("what a run needs could not be measured".to_owned()));
    }
    let need = Need {
        mean_s: crate::report::metrics::mean(&seconds),
        most_s: seconds.iter().copied().fold(0.0, f64::max),
        memory_mib: kept().filter_map(|kept| kept.memory_mib).fold(0.0, f64::max),
        measured: seconds.len(),
    };
    let runs = u32::try_from(study.runs.len()).unwrap_or(u32::MAX);
    let array = Array::of(runs, &need, words.slurm.flatten());
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let program = std::env::current_exe().unwrap_or_else(|_| PathBuf::from("coadapt"));
    let text = script(
        (&study.name, &program.display().to_string()),
        &said(words),
        &absolute(folder.path()).display().to_string(),
        array,
        &need,
    );
    let path = folder.path().join("slurm.sh");
    std::fs::write(&path, text)
        .map_err(|error| RunError::Failed(format!("cannot write {}: {error}", path.display())))?;
    say(&format!(
        "{}: {} jobs with 1 core, {} MiB and {} minutes each; submit it with sbatch",
        path.display(),
        array.jobs,
        array.memory_mib,
        array.minutes
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// The words that say the same study to a shell.
fn said(words: &cli::StudyWords) -> String {
    let quoted = |word: &str| format!("'{}'", word.replace('\'', r"'\''"));
    let mut said = vec![quoted(&found_again(words.study.as_deref().unwrap_or_default()))];
    for (key, value) in &words.set {
        said.extend(["--set".to_owned(), quoted(&format!("{key}={value}"))]);
    }
    if let Some(seeds) = words.seeds {
        said.extend(["--seeds".to_owned(), seeds.to_string()]);
    }
    if words.keep_steps {
        said.push("--keep-steps".to_owned());
    }
    said.join(" ")
}
