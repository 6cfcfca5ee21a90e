//! The measures of a session, as `run --json` prints them and as sentences for people.

use std::fmt::Write as _;

use serde::Serialize;

use super::achieved::Achieved;
use crate::record::EpisodeRow;
use crate::session::Phase;
use crate::sharing::weight::Opened;
use crate::signal::End;

/// The number of rollouts in the means at main's beginning and end (3.2.4.1).
const FEW: usize = 10;

/// How main ended.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MainEnd {
    /// The regions, in order.
    pub regions: Vec<RegionEnd>,
    /// Where the first region's gate opened.
    pub gate: Option<Opened>,
    /// Whether there is a gate to open; without one its step means nothing.
    pub has_gate: bool,
    /// Whether shares move once an episode: the gate's numbers count episodes then.
    pub by_episode: bool,
    /// Samples learned,
    pub learned: u64,
    /// and refused.
    pub refused: u64,
}

/// How main ended in one region.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RegionEnd {
    /// The region.
    pub name: String,
    /// The person's share there.
    pub share: f64,
    /// The success there.
    pub success: f64,
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

/// The measures of one phase.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measures {
    /// Rollouts, without discarded and aborted ones.
    pub episodes: usize,
    /// Their controlled steps.
    pub steps: u64,
    /// What they came to.
    #[serde(flatten)]
    pub achieved: Achieved,
}

/// The measures of main.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MainMeasures {
    /// What every phase has.
    #[serde(flatten)]
    pub common: Measures,
    /// What balance reports of main beside.
    #[serde(flatten)]
    pub progress: Option<Progress>,
    /// The person's share at the end; of several regions the mean.
    pub final_share: f64,
    /// The success at the end; of several regions the mean.
    pub final_success: f64,
    /// The regions, where there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub regions: Vec<RegionEnd>,
    /// The learner's fields at the end.
    pub receptive_fields: u32,
    /// Samples learned,
    pub samples: u64,
    /// and refused because they were not finite.
    pub refused: u64,
    /// When the gate opened; of a task with several regions nothing.
    #[serde(flatten)]
    pub gate: Option<Gate>,
}

/// How balance went at main's beginning and end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Progress {
    /// The mean of the first ten rollouts, s.
    pub first10_mean_balance_s: f64,
    /// The mean of the last ten, s.
    pub last10_mean_balance_s: f64,
}

/// When the gate opened, and what followed from that.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Gate {
    /// Shares move each step.
    Steps {
        /// The rollout in which it opened.
        gate_episode: Option<u32>,
        /// The time constant of w, steps.
        tau_steps: Option<f64>,
    },
    /// Shares move each episode.
    Episodes {
        /// The rollout after which it opened.
        gate_episode: Option<u64>,
        /// The time constant of w, episodes.
        tau_episodes: Option<f64>,
    },
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

/// The measures of the rollouts of a session of `task`; `main` is how main ended, if it took
/// place.
#[must_use]
pub fn phases(task: &str, rows: &[EpisodeRow], main: Option<&MainEnd>) -> Phases {
    Phases {
        introduction: measures(task, rows, Phase::Introduction),
        main: main.and_then(|end| main_measures(task, rows, end)),
        autonomous: measures(task, rows, Phase::Autonomous),
        zero_control: measures(task, rows, Phase::ZeroControl),
    }
}

fn measures(task: &str, rows: &[EpisodeRow], phase: Phase) -> Option<Measures> {
    let rows: Vec<&EpisodeRow> = rollouts_of(rows, phase).collect();
    (!rows.is_empty()).then(|| Measures {
        episodes: rows.len(),
        steps: rows.iter().map(|row| u64::from(row.steps)).sum(),
        achieved: Achieved::of(task, &rows),
    })
}

fn main_measures(task: &str, rows: &[EpisodeRow], end: &MainEnd) -> Option<MainMeasures> {
    let fields = rollouts_of(rows, Phase::Main).last()?.receptive_fields;
    let common = measures(task, rows, Phase::Main)?;
    let progress = matches!(common.achieved, Achieved::Balance { .. }).then(|| {
        let times: Vec<f64> = rollouts_of(rows, Phase::Main).map(|row| row.duration_s).collect();
        Progress {
            first10_mean_balance_s: mean(&times[..times.len().min(FEW)]),
            last10_mean_balance_s: mean(&times[times.len().saturating_sub(FEW)..]),
        }
    });
    let over_regions =
        |of: fn(&RegionEnd) -> f64| mean(&end.regions.iter().map(of).collect::<Vec<_>>());
    let has_regions = end.regions.len() > 1;
    Some(MainMeasures {
        common,
        progress,
        final_share: over_regions(|region| region.share),
        final_success: over_regions(|region| region.success),
        regions: if has_regions { end.regions.clone() } else { Vec::new() },
        receptive_fields: fields.unwrap_or(0),
        samples: end.learned,
        refused: end.refused,
        gate: (!has_regions).then(|| gate(rows, end)),
    })
}

fn gate(rows: &[EpisodeRow], end: &MainEnd) -> Gate {
    let opened = end.gate.filter(|_| end.has_gate);
    if end.by_episode {
        Gate::Episodes {
            gate_episode: opened.map(|gate| gate.step),
            tau_episodes: end.gate.map(|gate| gate.tau),
        }
    } else {
        Gate::Steps {
            gate_episode: opened.and_then(|gate| episode_of_step(rows, gate.step)),
            tau_steps: end.gate.map(|gate| gate.tau),
        }
    }
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
            if let Some(progress) = &main.progress {
                let _ = write!(
                    line,
                    ", first 10 {:.2} s, last 10 {:.2} s",
                    progress.first10_mean_balance_s, progress.last10_mean_balance_s
                );
            }
            let share = 100.0 * main.final_share;
            let _ = write!(line, "; your share {share:.0} %, {} fields", main.receptive_fields);
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
        self.achieved.sentence(self.episodes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::Tallied;

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
            tallied: Tallied::default(),
        }
    }

    #[test]
    fn means_leave_out_what_was_thrown_away_and_find_the_gate() {
        let mut rows = vec![row(Phase::Main, 1, 9000, End::Discarded)];
        rows.extend((1..=30).map(|k| row(Phase::Main, k, k * 10, End::Failed)));
        rows.push(row(Phase::Main, 31, 4, End::Aborted));
        let end = MainEnd {
            regions: vec![RegionEnd { name: "all".to_owned(), share: 0.5, success: 0.6 }],
            gate: Some(Opened { step: 61, tau: 66.6 }),
            has_gate: true,
            ..MainEnd::default()
        };
        let main = phases("balance", &rows, Some(&end)).main.unwrap();
        assert_eq!(main.common.episodes, 30);
        let Achieved::Balance { mean_balance_s, sd_balance_s, full } = main.common.achieved else {
            unreachable!()
        };
        assert!((mean_balance_s - 3.1).abs() < 1e-12);
        assert!((sd_balance_s.unwrap() - 1.7606816861659).abs() < 1e-9);
        assert_eq!(full, 0);
        let progress = main.progress.unwrap();
        assert!((progress.first10_mean_balance_s - 1.1).abs() < 1e-12);
        assert!((progress.last10_mean_balance_s - 5.1).abs() < 1e-12);
        let gate = Gate::Steps { gate_episode: Some(4), tau_steps: Some(66.6) };
        assert_eq!(main.gate, Some(gate), "10 + 20 + 30 = 60 steps come before");
        assert_eq!((main.final_share, main.regions), (0.5, Vec::new()));
        let end = MainEnd { has_gate: false, ..end };
        let gate = Gate::Steps { gate_episode: None, tau_steps: Some(66.6) };
        assert_eq!(phases("balance", &rows, Some(&end)).main.unwrap().gate, Some(gate));
    }

    #[test]
    fn a_phase_that_did_not_take_place_has_no_measures() {
        assert_eq!(phases("balance", &[], None), Phases::default());
    }
}
