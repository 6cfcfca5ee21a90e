//! What remains to be done after the last tick: evaluation, measures, last files.

use std::path::PathBuf;

use hdrhistogram::Histogram;
use serde::Serialize;

use super::RunError;
use crate::clock;
use crate::control::cycle::Outcome;
use crate::control::scribe::Scribe;
use crate::control::witness::Witness as _;
use crate::learner::Model;
use crate::profile::Profile;
use crate::record::sidecar::{Lateness, Timing};
use crate::record::{EpisodeRow, EvaluationRow, Sidecar, Status};
use crate::report::achieved::{Achieved, Yardstick, yardstick};
use crate::report::metrics::{self, MainEnd, Phases, RegionEnd};
use crate::session::Phase;
use crate::session::machine::Finish;
use crate::sharing::Sharing;
use crate::study::evaluate;

/// A session that is over.
#[derive(Clone, Debug)]
pub struct Finished {
    /// What `run --json` prints.
    pub results: Results,
    /// Why it ended early.
    pub cause: Option<String>,
    /// Its folder.
    pub folder: PathBuf,
    /// Its rollouts.
    pub episodes: Vec<EpisodeRow>,
    /// What each tenth's policy achieves alone by the task's yardstick, by percent.
    pub tenths: Vec<(u8, f64)>,
    /// The signal that ended it.
    pub signal: Option<i32>,
    /// A real plant's device did not say that its motor is off.
    pub motor_may_be_on: bool,
}

/// The JSON object of a session.
#[derive(Clone, Debug, Serialize)]
pub struct Results {
    schema: u32,
    session: String,
    task: String,
    preset: String,
    mode: &'static str,
    learner: String,
    operator: String,
    seed: u64,
    subject: String,
    trial: u32,
    /// How it ended.
    pub status: Status,
    /// The measures of its phases.
    pub phases: Phases,
}

impl Results {
    /// The session in a line.
    #[must_use]
    pub fn title(&self) -> String {
        let Self { task, mode, learner, preset, subject, trial, .. } = self;
        format!("{task} · {mode} · {learner} · {preset}   {subject} {trial:03}")
    }

    /// Whether this was a session of `task`.
    #[must_use]
    pub fn is_of(&self, task: &str) -> bool {
        self.task == task
    }

    /// The number by which its rollouts are judged.
    #[must_use]
    pub fn yardstick(&self) -> Yardstick {
        yardstick(&self.task)
    }

    /// How it ended, a word.
    #[must_use]
    pub const fn status_word(&self) -> &'static str {
        match self.status {
            Status::Running => "running",
            Status::Complete => "complete",
            Status::Aborted => "ended early",
            Status::Interrupted => "interrupted",
            Status::Failed => "failed",
        }
    }
}

/// Evaluates, measures and writes the last files; of the timing the cycle does not know all.
pub(super) fn conclude(
    profile: &Profile,
    sidecar: Sidecar,
    folder: PathBuf,
    outcome: Outcome<Scribe>,
    known: Timing,
    signal: impl Fn() -> Option<i32>,
) -> Result<Finished, RunError> {
    let Outcome { finish, cause, interrupted, sharing, episodes, learned, refused, .. } = outcome;
    let fault = outcome.witness.fault();
    let lost_rows = outcome.witness.lost();
    let (mut recorder, tenths) = outcome.witness.into_parts();
    let mut status = match (finish, &fault) {
        (_, Some(_)) => Status::Failed,
        (Finish::Complete, None) => Status::Complete,
        // The stop that a signal gives a real plant may end the session before the signal does.
        (Finish::Aborted, None) if interrupted || signal().is_some() => Status::Interrupted,
        (Finish::Aborted, None) => Status::Aborted,
    };
    let mut means = Vec::new();
    if status == Status::Complete && !tenths.is_empty() {
        match evaluation(profile, &tenths, sidecar.seed, &episodes, &signal) {
            Some(rows) => {
                means = tenth_means(&sidecar.task, &tenths, &rows);
                let rows = rows
                    .iter()
                    .map(|(percent, row)| EvaluationRow::of(format!("policy-{percent:03}"), row));
                recorder.evaluation(rows.collect());
            }
            None => status = Status::Interrupted,
        }
    }
    let taught = metrics::rollouts_of(&episodes, Phase::Main).next().is_some();
    let main = taught.then(|| MainEnd {
        regions: regions(profile, &sharing),
        gate: sharing.gate(0),
        has_gate: profile.sharing.gate > 0.0,
        by_episode: profile.sharing.window_episodes.is_some(),
        learned,
        refused,
    });
    let phases = metrics::phases(&sidecar.task, &episodes, main.as_ref());
    let results = Results {
        schema: 1,
        session: folder.display().to_string(),
        task: sidecar.task.clone(),
        preset: sidecar.preset.clone(),
        mode: sidecar.mode.word(),
        learner: sidecar.learner.clone(),
        operator: sidecar.operator.clone(),
        seed: sidecar.seed,
        subject: sidecar.subject.to_string(),
        trial: sidecar.trial.0,
        status,
        phases,
    };
    let timing =
        outcome.lateness_us.filter(|histogram| !histogram.is_empty()).map(|histogram| Timing {
            ticks: histogram.len(),
            missed: outcome.missed,
            lost_rows,
            lateness_us: lateness(&histogram),
            ..known
        });
    let plant = timing.as_ref().and_then(|timing| timing.plant.as_ref());
    let motor_may_be_on = plant.is_some_and(|plant| !plant.motor_is_off);
    let last = Sidecar {
        status,
        ended: Some(clock::timestamp()),
        timing,
        phases: phase_values(&results.phases),
        ..sidecar
    };
    recorder.finish(last).map_err(|error| {
        RunError::Failed(format!(
            "{error}\nall rollouts before that are kept; go on with: coadapt run --resume {}",
            folder.display()
        ))
    })?;
    Ok(Finished {
        results,
        cause,
        folder,
        episodes,
        tenths: means,
        signal: signal(),
        motor_may_be_on,
    })
}

/// How main ended in each region of the task.
fn regions(profile: &Profile, sharing: &Sharing) -> Vec<RegionEnd> {
    let task = profile.experiment.task(profile.tick());
    (0..)
        .zip(task.regions())
        .map(|(index, region)| RegionEnd {
            name: region.name.to_owned(),
            share: sharing.share(index),
            success: sharing.success(index),
        })
        .collect()
}

/// The autonomous rollouts of each tenth's policy; none when a signal came in between, and
/// a resumed session evaluates them. The last tenth is the final policy,
/// whose rollouts the autonomous phase just did, on the same starts and noise.
fn evaluation(
    profile: &Profile,
    tenths: &[(u8, Model)],
    seed: u64,
    episodes: &[EpisodeRow],
    signal: &impl Fn() -> Option<i32>,
) -> Option<Vec<(u8, EpisodeRow)>> {
    let done: Vec<EpisodeRow> =
        metrics::rollouts_of(episodes, Phase::Autonomous).copied().collect();
    let mut rows = Vec::new();
    for (percent, learner) in tenths {
        let rollouts = if *percent == 100 && !done.is_empty() {
            done.clone()
        } else {
            evaluate::autonomous(profile, learner, seed, || signal().is_some())?
        };
        rows.extend(rollouts.iter().map(|row| (*percent, *row)));
    }
    Some(rows)
}

fn tenth_means(task: &str, tenths: &[(u8, Model)], rows: &[(u8, EpisodeRow)]) -> Vec<(u8, f64)> {
    tenths
        .iter()
        .filter_map(|(percent, _)| {
            let of_it: Vec<&EpisodeRow> =
                rows.iter().filter(|(of, _)| of == percent).map(|(_, row)| row).collect();
            Some((*percent, Achieved::of(task, &of_it).mean()?))
        })
        .collect()
}

fn lateness(histogram: &Histogram<u64>) -> Lateness {
    Lateness {
        p50: histogram.value_at_quantile(0.5),
        p99: histogram.value_at_quantile(0.99),
        max: histogram.max(),
    }
}

fn phase_values(phases: &Phases) -> std::collections::BTreeMap<String, serde_json::Value> {
    match serde_json::to_value(phases) {
        Ok(serde_json::Value::Object(phases)) => phases.into_iter().collect(),
        _ => std::collections::BTreeMap::new(),
    }
}
