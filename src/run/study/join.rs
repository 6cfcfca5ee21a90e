//! `study merge`: joins shards.

use std::path::Path;
use std::process::ExitCode;

use super::super::shutdown::Shutdown;
use super::super::{RunError, tell};
use super::{PROFILES, jobs, print, usual_folder};
use crate::cli;
use crate::profile::shell_word;
use crate::study::batch::{
    Conclusion, Folder, Manner, Merged, Outcome, Run, Shard, StudyError, conclude, merge, read,
};

/// The most missing runs and shards that are named.
const MOST_NAMED: usize = 20;

pub(super) fn join(words: &cli::Merge, shutdown: &Shutdown) -> Result<ExitCode, RunError> {
    let is_enough = || shutdown.signal().is_some();
    let merged = merge(&words.folders, Path::new(PROFILES), &is_enough)?;
    let study = &merged.study;
    let path = words.out.clone().unwrap_or_else(|| usual_folder(study, Shard::WHOLE));
    let folder = Folder::open(&path, &merged.card)?;
    for run in &study.runs {
        if is_enough() {
            return Err(StudyError::Interrupted.into());
        }
        bring(&merged, &folder, run)?;
    }
    let runs: Vec<&Run> = study.runs.iter().collect();
    let read = |number| read(&path, number);
    let manner = Manner { jobs: jobs(None), read: &read, is_enough: &is_enough };
    let conclusion = conclude(&path, study, &runs, &manner)?;
    let Conclusion { missing, failed, .. } = &conclusion;
    let shards: Vec<String> = merged.absent(missing).iter().map(ToString::to_string).collect();
    if !shards.is_empty() {
        let named = shards.iter().take(MOST_NAMED).cloned().collect::<Vec<_>>().join(", ");
        let more = if shards.len() > MOST_NAMED { ", …" } else { "" };
        tell(&format!("missing shards: {named}{more}"));
    }
    for number in missing.iter().take(MOST_NAMED) {
        if let Some(run) = study.runs.get(*number as usize - 1) {
            tell(&format!("missing: {}", study.labels(run)));
        }
    }
    print(&conclusion, study, &path, words.json)?;
    if !missing.is_empty() {
        tell(&format!(
            "{} of {} runs are missing: run their shards, or go on with: coadapt study {} --out {}",
            missing.len(),
            conclusion.runs,
            merged.card.words(),
            shell_word(&path.display().to_string())
        ));
    }
    let is_whole = missing.is_empty() && failed.is_empty();
    Ok(if is_whole { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Brings what came of `run` into `folder`, unless it is done there already.
fn bring(merged: &Merged, folder: &Folder, run: &Run) -> Result<(), StudyError> {
    let known = read(folder.path(), run.number);
    if known.is_some_and(|kept| matches!(kept.outcome, Outcome::Done(_))) {
        return Ok(());
    }
    match merged.read(run.number) {
        Some((from, kept)) => {
            folder.copy_steps(from, run.number)?;
            folder.keep(run.number, &kept)
        }
        None => Ok(()),
    }
}
