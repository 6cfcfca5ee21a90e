//! The measures of a session, as `run --json` prints them and as sentences for people.

use std::fmt::Write as _;

use serde::Serialize;

use crate::record::EpisodeRow;
use crate::session::Phase;
use crate::sharing::weight::Opened;
use crate::signal::End;

/// The number of rollouts in the means at main's beginning and end (3.2.4.1).
const FEW: usize = 10;

/// How main ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MainEnd {
    /// The person's share.
    pub share: f64,
    /// The success.
    pub success: f64,
    /// Where the gate opened.
    pub gate: Option<Opened>,
    /// Samples learned,
    pub learned: u64,
    /// and refused.
    pub refused: u64,
}

/// The measures of all phases that took place.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Phases {
    /// Practice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub introduction: Option<Measures>,
    /// Teaching.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub main: Option<MainMeasures>,
    /// The robot alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub autonomous: Option<Measures>,
    /// Nobody.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zero_control: Option<Measures>,
}

/// The measures of one phase of balance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measures {
    /// Rollouts, without discarded and aborted ones.
    pub episodes: usize,
    /// Their controlled steps.
    pub steps: u64,
    /// The mean time that the pole stayed up, s.
    pub mean_balance_s: f64,
    /// Its standard deviation over the rollouts (n − 1), s; none for a single one.
    pub sd_balance_s: Option<f64>,
    /// Rollouts that lasted as long as one may.
    pub full: usize,
}

/// The measures of main.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MainMeasures {
    /// What every phase has.
    #[serde(flatten)]
    pub common: Measures,
    /// The mean of the first ten rollouts, s.
    pub first10_mean_balance_s: f64,
    /// The mean of the last ten, s.
    pub last10_mean_balance_s: f64,
    /// The person's share at the end.
    pub final_share: f64,
    /// The success at the end.
    pub final_success: f64,
    /// The learner's fields at the end.
    pub receptive_fields: u32,
    /// Samples learned,
    pub samples: u64,
    /// and refused because they were not finite.
    pub refused: u64,
    /// The rollout in which the gate opened.
    pub gate_episode: Option<u32>,
    /// The time constant of w found there, steps.
    pub tau_steps: Option<f64>,
}

/// Whether a rollout counts: those thrown away or cut off do not.
#[must_use]
pub const fn counts(row: &EpisodeRow) -> bool {
    !matches!(row.end, End::Discarded | End::Aborted)
}

/// The counted rollouts of `phase`, in order.
pub fn rollouts_of(rows: &[EpisodeRow], phase: Phase) -> impl Iterator<Item = &EpisodeRow> {
    rows.iter().filter(move |row| row.phase == phase && counts(row))
}

/// The measures of a session's rollouts; `main` is how main ended, if it took place.
#[must_use]
pub fn phases(rows: &[EpisodeRow], main: Option<&MainEnd>) -> Phases {
    Phases {
        introduction: measures(rows, Phase::Introduction),
        main: main.and_then(|end| main_measures(rows, end)),
        autonomous: measures(rows, Phase::Autonomous),
        zero_control: measures(rows, Phase::ZeroControl),
    }
}

fn measures(rows: &[EpisodeRow], phase: Phase) -> Option<Measures> {
    let durations = durations(rows, phase);
    if durations.is_empty() {
        return None;
    }
    Some(Measures {
        episodes: durations.len(),
        steps: rollouts_of(rows, phase).map(|row| u64::from(row.steps)).sum(),
        mean_balance_s: mean(&durations),
        sd_balance_s: deviation(&durations),
        full: rollouts_of(rows, phase).filter(|row| row.end == End::Cap).count(),
    })
}

fn main_measures(rows: &[EpisodeRow], end: &MainEnd) -> Option<MainMeasures> {
    let durations = durations(rows, Phase::Main);
    let fields = rollouts_of(rows, Phase::Main).last()?.receptive_fields;
    Some(MainMeasures {
        common: measures(rows, Phase::Main)?,
        first10_mean_balance_s: mean(&durations[..durations.len().min(FEW)]),
        last10_mean_balance_s: mean(&durations[durations.len().saturating_sub(FEW)..]),
        final_share: end.share,
        final_success: end.success,
        receptive_fields: fields.unwrap_or(0),
        samples: end.learned,
        refused: end.refused,
        gate_episode: end.gate.and_then(|gate| episode_of_step(rows, gate.step)),
        tau_steps: end.gate.map(|gate| gate.tau_steps),
    })
}

/// The rollout of main in which controlled step `step`, from 1, took place.
fn episode_of_step(rows: &[EpisodeRow], step: u64) -> Option<u32> {
    let mut steps = 0;
    rollouts_of(rows, Phase::Main)
        .find(|row| {
            steps += u64::from(row.steps);
            steps >= step
        })
        .map(|row| row.episode)
}

fn durations(rows: &[EpisodeRow], phase: Phase) -> Vec<f64> {
    rollouts_of(rows, phase).map(|row| row.duration_s).collect()
}

/// The arithmetic mean; 0 of nothing.
#[must_use]
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / count(values).max(1.0)
}

/// The standard deviation with n − 1; none below two values.
#[must_use]
pub fn deviation(values: &[f64]) -> Option<f64> {
    let centre = mean(values);
    let squares: f64 = values.iter().map(|value| (value - centre).powi(2)).sum();
    (values.len() > 1).then(|| (squares / (count(values) - 1.0)).sqrt())
}

fn count(values: &[f64]) -> f64 {
    u32::try_from(values.len()).map_or(f64::INFINITY, f64::from)
}

impl Phases {
    /// The measures as sentences, one a phase.
    #[must_use]
    pub fn sentences(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if let Some(introduction) = &self.introduction {
            lines.push(format!("introduction  {}", introduction.sentence()));
        }
        if let Some(main) = &self.main {
            let mut line = format!("main          {}", main.common.sentence());
            let _ = write!(
                line,
                ", first 10 {:.2} s, last 10 {:.2} s; your share {:.0} %, {} fields",
                main.first10_mean_balance_s,
                main.last10_mean_balance_s,
                100.0 * main.final_share,
                main.receptive_fields,
            );
            lines.push(line);
        }
        if let Some(autonomous) = &self.autonomous {
            lines.push(format!("robot alone   {}", autonomous.sentence()));
        }
        if let Some(zero) = &self.zero_control {
            lines.push(format!("nobody        {}", zero.sentence()));
        }
        lines
    }
}

impl Measures {
    /// The measures in a sentence.
    #[must_use]
    pub fn sentence(&self) -> String {
        let spread = self.sd_balance_s.map_or(String::new(), |sd| format!(" ± {sd:.2}"));
        let plural = if self.episodes == 1 { "" } else { "s" };
        let Self { mean_balance_s, episodes, .. } = self;
        format!("{mean_balance_s:.2}{spread} s balanced over {episodes} rollout{plural}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(phase: Phase, episode: u32, steps: u32, end: End) -> EpisodeRow {
        EpisodeRow {
            phase,
            episode,
            start: 0.0,
            steps,
            duration_s: f64::from(steps) * 0.02,
            end,
            total: 0.0,
            mean_reward: 0.0,
            share: None,
            success: None,
            receptive_fields: Some(7),
        }
    }

    #[test]
    fn means_leave_out_what_was_thrown_away_and_find_the_gate() {
        let mut rows = vec![row(Phase::Main, 1, 9000, End::Discarded)];
        rows.extend((1..=30).map(|k| row(Phase::Main, k, k * 10, End::Failed)));
        rows.push(row(Phase::Main, 31, 4, End::Aborted));
        let end = MainEnd {
            share: 0.5,
            success: 0.6,
            gate: Some(Opened { step: 61, tau_steps: 66.6 }),
            learned: 1,
            refused: 0,
        };
        let main = phases(&rows, Some(&end)).main.unwrap();
        assert_eq!(main.common.episodes, 30);
        assert!((main.common.mean_balance_s - 3.1).abs() < 1e-12);
        assert!((main.first10_mean_balance_s - 1.1).abs() < 1e-12);
        assert!((main.last10_mean_balance_s - 5.1).abs() < 1e-12);
        assert_eq!(main.gate_episode, Some(4), "10 + 20 + 30 = 60 steps come before");
        assert!((main.common.sd_balance_s.unwrap() - 1.7606816861659).abs() < 1e-9);
    }

    #[test]
    fn a_phase_that_did_not_take_place_has_no_measures() {
        assert_eq!(phases(&[], None), Phases::default());
    }
}
