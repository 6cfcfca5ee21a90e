//! `coadapt evaluate`: policies alone over many starts, beside nobody on the same ones.

mod trial;

use std::fmt::Write as _;
use std::process::ExitCode;

use serde::Serialize;

use super::shutdown::Shutdown;
use super::{RunError, say, signal_code, tell};
use crate::cli;
use crate::profile::Profile;
use crate::record::EpisodeRow;
use crate::report::achieved::{Yardstick, yardstick};
use crate::report::metrics::{self, Measures};
use crate::report::spread::{interval95, median};
use crate::session::Phase;
use crate::study::evaluate as evaluation;
use trial::Trial;

/// What `evaluate --json` prints.
#[derive(Serialize)]
struct Evaluation {
    schema: u32,
    /// The file of the policy,
    policy: String,
    /// and of the rules: a profile, or the `session.json` of the policy's session,
    profile: String,
    /// with these changes, as given by `--set`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    set: Vec<String>,
    task: String,
    preset: String,
    seed: u64,
    /// `grid` or `random`.
    starts: String,
    #[serde(flatten)]
    alone: Alone,
    /// Nobody, on the same starts and noise.
    zero_control: Alone,
    /// The policies of a session's tenths (figs 37 and 38).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    tenths: Vec<Tenth>,
    rollouts: Vec<serde_json::Value>,
}

/// What a policy, or nobody, came to.
#[derive(Serialize)]
struct Alone {
    #[serde(flatten)]
    measures: Measures,
    /// The mean of the task's yardstick over the rollouts, each counting the same,
    mean: Option<f64>,
    /// the median,
    median: Option<f64>,
    /// and the 95 % interval of the mean (BCa bootstrap over the rollouts); none of fewer than five.
    interval95: Option<(f64, f64)>,
}

/// What the policy after a tenth of main came to.
#[derive(Serialize)]
struct Tenth {
    percent: u8,
    #[serde(flatten)]
    alone: Alone,
    /// By how much it is better than the first, in percent of the first; none where the
    /// yardstick may be negative.
    improvement_percent: Option<f64>,
}

pub(super) fn evaluate(words: &cli::Evaluate) -> Result<ExitCode, RunError> {
    let shutdown = Shutdown::listen();
    let trial = Trial::of(words)?;
    let is_enough = || shutdown.signal().is_some();
    let profile = &trial.profile;
    let learner = &trial.policy.learner;
    let tried = evaluation::autonomous_and_nobody(profile, learner, words.seed, is_enough);
    let Some(rows) = tried else {
        return Ok(interrupted(&shutdown, "nothing was evaluated"));
    };
    let tenths = match tenths(&trial, words.seed, is_enough) {
        Ok(tenths) => tenths,
        Err(done) => {
            let what = format!(
                "the policy, nobody and {done} of the tenths were evaluated; results are printed \
                 whole or not at all, and sooner with fewer --starts"
            );
            return Ok(interrupted(&shutdown, &what));
        }
    };
    let task = profile.experiment.name();
    let alone = Alone::of(task, &rows, Phase::Autonomous);
    let nobody = Alone::of(task, &rows, Phase::ZeroControl);
    let (Some(alone), Some(zero_control)) = (alone, nobody) else {
        return Err(RunError::Failed("no rollout took place".to_owned()));
    };
    let evaluation = Evaluation {
        schema: 1,
        policy: trial.file.display().to_string(),
        profile: trial.shown.clone(),
        set: words.set.iter().map(|(key, value)| format!("{key}={value}")).collect(),
        task: task.to_owned(),
        preset: trial.policy.preset.clone(),
        seed: words.seed,
        starts: format!("{:?}", profile.session.starts).to_lowercase(),
        alone,
        zero_control,
        tenths,
        rollouts: rollouts(profile, &rows),
    };
    if words.json {
        let json = serde_json::to_string(&evaluation);
        say(&json.map_err(|error| RunError::Failed(error.to_string()))?)?;
    } else {
        say(&evaluation.sentences().join("\n"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// What the tenths' policies come to on the same starts; only how many were tried, where
/// that is enough.
fn tenths(trial: &Trial, seed: u64, is_enough: impl Fn() -> bool) -> Result<Vec<Tenth>, usize> {
    let task = trial.profile.experiment.name();
    let held = trial.tenths();
    for notice in &held.notices {
        tell(notice);
    }
    let mut tenths: Vec<Tenth> = Vec::new();
    for (percent, learner) in held.learners {
        let tried = evaluation::autonomous(&trial.profile, &learner, seed, &is_enough);
        let rows = tried.ok_or(tenths.len())?;
        let Some(alone) = Alone::of(task, &rows, Phase::Autonomous) else { continue };
        let mean = |alone: &Alone| alone.measures.achieved.mean();
        let first = mean(tenths.first().map_or(&alone, |tenth| &tenth.alone));
        let improvement_percent = first
            .zip(mean(&alone))
            .and_then(|(first, value)| improvement(&yardstick(task), first, value));
        tenths.push(Tenth { percent, alone, improvement_percent });
    }
    Ok(tenths)
}

fn interrupted(shutdown: &Shutdown, what: &str) -> ExitCode {
    tell(&format!("interrupted: {what}"));
    shutdown.signal().map_or(ExitCode::FAILURE, signal_code)
}

/// The robot's rollouts, the task's own measures by their names.
fn rollouts(profile: &Profile, rows: &[EpisodeRow]) -> Vec<serde_json::Value> {
    let names = profile.experiment.task(profile.tick()).tally_names();
    metrics::rollouts_of(rows, Phase::Autonomous)
        .filter_map(|row| {
            let mut rollout = serde_json::to_value(row).ok()?;
            let object = rollout.as_object_mut()?;
            object.remove("tallied");
            for (name, number) in names.iter().zip(row.tallied.iter()) {
                object.insert((*name).to_owned(), (*number).into());
            }
            Some(rollout)
        })
        .collect()
}

impl Alone {
    fn of(task: &str, rows: &[EpisodeRow], phase: Phase) -> Option<Self> {
        let phases = metrics::phases(task, rows, None);
        let measures = match phase {
            Phase::ZeroControl => phases.zero_control,
            _ => phases.autonomous,
        }?;
        let values: Vec<f64> =
            metrics::rollouts_of(rows, phase).filter_map(yardstick(task).of).collect();
        Some(Self {
            measures,
            mean: (!values.is_empty()).then(|| metrics::mean(&values)),
            median: median(&values),
            interval95: interval95(&values),
        })
    }

    /// In a sentence.
    fn sentence(&self, yardstick: &Yardstick) -> String {
        let decimals = yardstick.decimals;
        let mut words = self.measures.sentence();
        if let Some(median) = self.median {
            // Writing to a text cannot fail.
            let _ = write!(words, "; median {median:.decimals$}");
        }
        if let Some((low, high)) = self.interval95 {
            let _ = write!(words, ", 95 % of the mean {low:.decimals$} to {high:.decimals$}");
        }
        words
    }
}

impl Evaluation {
    fn sentences(&self) -> Vec<String> {
        let yardstick = yardstick(&self.task);
        let Yardstick { name, unit, decimals, .. } = yardstick;
        let Self { policy, profile, task, starts, seed, .. } = self;
        let episodes = self.alone.measures.episodes;
        let s = if episodes == 1 { "" } else { "s" };
        let mut given = format!(
            "{policy} by the rules of {profile}: {task}, {episodes} {starts} start{s}, seed {seed}"
        );
        if !self.set.is_empty() {
            // Writing to a text cannot fail.
            let _ = write!(given, ", {}", self.set.join(", "));
        }
        let mut lines = vec![
            given,
            format!("robot alone  {}", self.alone.sentence(&yardstick)),
            format!("nobody       {}", self.zero_control.sentence(&yardstick)),
        ];
        if !self.tenths.is_empty() {
            let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
            lines.push(format!("after each tenth of main: {name}{unit}"));
        }
        for tenth in &self.tenths {
            let mean = tenth.alone.measures.achieved.mean().unwrap_or(f64::NAN);
            let interval = tenth.alone.interval95.map_or(String::new(), |(low, high)| {
                format!("   {low:.decimals$} to {high:.decimals$}")
            });
            let better = tenth
                .improvement_percent
                .map_or(String::new(), |percent| format!("   {percent:+.0} % on the first"));
            lines.push(format!("{:>5} %  {mean:8.decimals$}{interval}{better}", tenth.percent));
        }
        lines
    }
}

/// By how much `value` is better than `first`, in percent of it.
fn improvement(yardstick: &Yardstick, first: f64, value: f64) -> Option<f64> {
    let gain = if yardstick.more_is_better { value - first } else { first - value };
    (yardstick.range.is_none() && first > 0.0).then(|| 100.0 * gain / first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_steps_are_better_and_heights_have_no_percent() {
        let of = |task, first, value| improvement(&yardstick(task), first, value);
        assert_eq!(of("balance", 2.0, 5.0), Some(150.0));
        assert_eq!(of("mountain-car", 200.0, 100.0), Some(50.0));
        assert_eq!(of("swing-up", 0.5, 0.9), None);
        assert_eq!(of("speed-up", 0.0, 0.1), None);
    }
}
