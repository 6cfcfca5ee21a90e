//! `study --slurm`: writes the script of an array job.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::super::shutdown::Shutdown;
use super::super::{RunError, say, tell};
use super::run_all;
use crate::cli;
use crate::report::metrics::mean;
use crate::study::batch::slurm::{Array, Job, Need, script};
use crate::study::batch::{Card, Folder, Outcome, Run, Study, StudyError, What, read};

/// What runs needed that are over, by setting and arm: processor time, s, and memory, MiB.
type Measured = BTreeMap<(usize, usize), Vec<(f64, f64)>>;

pub(super) fn array(
    words: &cli::StudyWords,
    study: &Study,
    folder: &Folder,
    card: &Card,
    shutdown: &Shutdown,
) -> Result<ExitCode, RunError> {
    let first = unmeasured(study, &measured(study, folder));
    if !first.is_empty() {
        tell(&format!(
            "measuring one run of each arm under each setting of which none is finished: {}",
            first.len()
        ));
        run_all(&first, folder, words, study, shutdown)?;
        if shutdown.signal().is_some() {
            return Err(StudyError::Interrupted.into());
        }
    }
    let need = need(&measured(study, folder)).ok_or_else(|| {
        RunError::Failed("what a run needs could not be measured: no run went well".to_owned())
    })?;
    let runs = u32::try_from(study.runs.len()).unwrap_or(u32::MAX);
    let array = Array::of(runs, &need, words.slurm.flatten());
    let path = folder.path().join("slurm.sh");
    std::fs::write(&path, text(words, study, folder, card, (array, &need)))
        .map_err(|error| RunError::Failed(format!("cannot write {}: {error}", path.display())))?;
    let Array { jobs, memory_mib, minutes } = array;
    if words.json {
        let json = serde_json::json!({
            "schema": 1,
            "script": path,
            "runs": runs,
            "jobs": jobs,
            "memory_mib": memory_mib,
            "minutes": minutes,
            "measured": need.measured,
            "mean_s": need.mean_s,
            "most_s": need.most_s,
        });
        say(&json.to_string())?;
    } else {
        say(&format!(
            "{}: {jobs} jobs with 1 core, {memory_mib} MiB and {minutes} minutes each; submit it \
             with sbatch",
            path.display()
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn measured(study: &Study, folder: &Folder) -> Measured {
    let mut measured = Measured::new();
    for run in &study.runs {
        let What::Session { arm, .. } = run.what else { continue };
        if let Some(kept) = read(folder.path(), run.number)
            && let (Outcome::Done(_), Some(seconds)) = (kept.outcome, kept.processor_s)
        {
            let memory = kept.memory_mib.unwrap_or(0.0);
            measured.entry((run.setting, arm)).or_default().push((seconds, memory));
        }
    }
    measured
}

/// The first run of each setting and arm of which none was measured.
fn unmeasured<'a>(study: &'a Study, measured: &Measured) -> Vec<&'a Run> {
    let mut first: BTreeMap<(usize, usize), &Run> = BTreeMap::new();
    for run in &study.runs {
        if let What::Session { arm, .. } = run.what
            && !measured.contains_key(&(run.setting, arm))
        {
            first.entry((run.setting, arm)).or_insert(run);
        }
    }
    first.into_values().collect()
}

/// What runs need; settings and arms count the same, however many of each were measured.
fn need(measured: &Measured) -> Option<Need> {
    let seconds = |runs: &Vec<(f64, f64)>| {
        mean(&runs.iter().map(|(seconds, _)| *seconds).collect::<Vec<_>>())
    };
    let most = |of: fn(&(f64, f64)) -> f64| measured.values().flatten().map(of).fold(0.0, f64::max);
    (!measured.is_empty()).then(|| Need {
        mean_s: mean(&measured.values().map(seconds).collect::<Vec<_>>()),
        most_s: most(|(seconds, _)| *seconds),
        memory_mib: most(|(_, memory)| *memory),
        measured: measured.values().map(Vec::len).sum(),
    })
}

/// The script's text.
fn text(
    words: &cli::StudyWords,
    study: &Study,
    folder: &Folder,
    card: &Card,
    (array, need): (Array, &Need),
) -> String {
    let absolute = |path: &Path| {
        std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string()
    };
    let program = std::env::current_exe().unwrap_or_else(|_| PathBuf::from("coadapt"));
    let desk = std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."));
    let said = card.words() + if words.keep_steps { " --keep-steps" } else { "" };
    let job = Job {
        study: &study.name,
        desk: &absolute(&desk),
        program: &program.display().to_string(),
        words: &said,
        folder: &absolute(folder.path()),
    };
    script(&job, array, need)
}
