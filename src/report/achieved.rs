//! What a phase came to, in the measures of its task.

use std::fmt::Write as _;

use serde::Serialize;

use super::metrics::{deviation, mean};
use crate::record::EpisodeRow;
use crate::signal::End;
use crate::task::mountain_car::MountainCar;
use crate::task::speed_up::SpeedUp;
use crate::task::swing_up::SwingUp;

/// The one number by which a rollout of a task is judged, for charts and tables.
#[derive(Clone, Copy, Debug)]
pub struct Yardstick {
    /// It in a word, such as `balance`.
    pub word: &'static str,
    /// What it is, such as `balance time`.
    pub name: &'static str,
    /// Its unit; empty where it has none.
    pub unit: &'static str,
    /// Decimals that can be told apart.
    pub decimals: usize,
    /// Whether more is better.
    pub more_is_better: bool,
    /// The least and the most that it can be, where both are known.
    pub range: Option<(f64, f64)>,
    /// The number of a rollout; none of one that was cut before it could be known.
    pub of: fn(&EpisodeRow) -> Option<f64>,
}

/// The yardstick of `task`: balance time, pseudo-height, speed, or steps to the flag.
#[must_use]
pub fn yardstick(task: &str) -> Yardstick {
    let balance = Yardstick {
        word: "balance",
        name: "balance time",
        unit: "s",
        decimals: 2,
        more_is_better: true,
        range: None,
        of: |row| Some(row.duration_s),
    };
    match task {
        SwingUp::NAME => Yardstick {
            word: "height",
            name: "mean height",
            unit: "",
            range: Some((-1.0, 1.0)),
            of: |row| Some(tallied(row, 0)),
            ..balance
        },
        SpeedUp::NAME => Yardstick {
            word: "speed",
            name: "mean speed",
            unit: "m/s",
            decimals: 3,
            of: |row| Some(tallied(row, 0)),
            ..balance
        },
        MountainCar::NAME => Yardstick {
            word: "steps",
            name: "steps to the flag",
            unit: "",
            decimals: 0,
            more_is_better: false,
            of: |row| (row.end != End::Time).then_some(f64::from(row.steps)),
            ..balance
        },
        _ => balance,
    }
}

/// What the rollouts of a phase came to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Achieved {
    /// The pole was kept up.
    Balance {
        /// The mean time for which it stayed up, s.
        mean_balance_s: f64,
        /// Its standard deviation over the rollouts (n − 1), s; none for a single one.
        sd_balance_s: Option<f64>,
        /// Rollouts that lasted as long as one may.
        full: usize,
    },
    /// The pole was swung up.
    SwingUp {
        /// The mean pseudo-height cos θ over time (Table 2).
        mean_height: f64,
        /// Its standard deviation over the rollouts (n − 1); none for a single one.
        sd_height: Option<f64>,
        /// The part of the time in the regions at the top; passes count.
        top_share: f64,
        /// The longest time without leaving the top, s,
        longest_hold_s: f64,
        /// and the mean over the rollouts of each one's longest, s; where a session runs on, a
        /// hold counts in each rollout that it reaches.
        mean_longest_hold_s: f64,
    },
    /// The ball was sped up.
    SpeedUp {
        /// The mean of |ẋ| over time, m/s.
        mean_speed: f64,
        /// Its standard deviation over the rollouts (n − 1), m/s; none for a single one.
        sd_speed: Option<f64>,
        /// How often the ball ran over a limit.
        end_hits: u64,
        /// The mean of the reward of eq. 27, m/s.
        mean_reward: f64,
    },
    /// The car was driven up.
    MountainCar {
        /// The mean number of steps, the cap where the flag was not reached; none where
        /// the phase's time cut every rollout.
        mean_steps: Option<f64>,
        /// Its standard deviation over the rollouts (n − 1); none for a single one.
        sd_steps: Option<f64>,
        /// The mean over the rollouts of each one's mean reward (eq. 35).
        mean_reward: f64,
        /// Rollouts that reached the flag.
        solved: usize,
        /// Rollouts that the phase's time cut: their steps are not known, so they are not in
        /// the mean.
        #[serde(skip_serializing_if = "is_zero")]
        cut: usize,
    },
}

impl Achieved {
    /// What `rows`, at least one, came to in `task`.
    #[must_use]
    pub fn of(task: &str, rows: &[&EpisodeRow]) -> Self {
        let values: Vec<f64> = rows.iter().filter_map(|row| (yardstick(task).of)(row)).collect();
        let sd = deviation(&values);
        let ended = |end| rows.iter().filter(|row| row.end == end).count();
        match task {
            SwingUp::NAME => {
                let holds: Vec<f64> = rows.iter().map(|row| tallied(row, 2)).collect();
                Self::SwingUp {
                    mean_height: over_time(rows, |row| tallied(row, 0)),
                    sd_height: sd,
                    top_share: over_time(rows, |row| tallied(row, 1)),
                    longest_hold_s: holds.iter().copied().fold(0.0, f64::max),
                    mean_longest_hold_s: mean(&holds),
                }
            }
            SpeedUp::NAME => {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a sum of counts"
                )]
                let end_hits = rows.iter().map(|row| tallied(row, 1)).sum::<f64>() as u64;
                Self::SpeedUp {
                    mean_speed: over_time(rows, |row| tallied(row, 0)),
                    sd_speed: sd,
                    end_hits,
                    mean_reward: over_time(rows, |row| row.mean_reward),
                }
            }
            MountainCar::NAME => Self::MountainCar {
                mean_steps: (!values.is_empty()).then(|| mean(&values)),
                sd_steps: sd,
                mean_reward: mean(&rows.iter().map(|row| row.mean_reward).collect::<Vec<_>>()),
                solved: ended(End::Goal),
                cut: ended(End::Time),
            },
            _ => Self::Balance {
                mean_balance_s: mean(&values),
                sd_balance_s: sd,
                full: ended(End::Cap),
            },
        }
    }

    /// The number that [`yardstick`] names, over all rollouts of which it is known.
    #[must_use]
    pub const fn mean(&self) -> Option<f64> {
        match *self {
            Self::Balance { mean_balance_s, .. } => Some(mean_balance_s),
            Self::SwingUp { mean_height, .. } => Some(mean_height),
            Self::SpeedUp { mean_speed, .. } => Some(mean_speed),
            Self::MountainCar { mean_steps, .. } => mean_steps,
        }
    }

    /// Rollouts whose number is not known.
    const fn cut(&self) -> usize {
        match *self {
            Self::MountainCar { cut, .. } => cut,
            _ => 0,
        }
    }

    /// In a sentence, over `rollouts` of them.
    #[must_use]
    pub fn sentence(&self, rollouts: usize) -> String {
        let spread = |sd: Option<f64>, decimals: usize| {
            sd.map_or(String::new(), |sd| format!(" ± {sd:.decimals$}"))
        };
        // The mean is over those whose number is known.
        let known = match rollouts.saturating_sub(self.cut()) {
            0 => rollouts,
            known => known,
        };
        let over = format!("over {known} rollout{}", if known == 1 { "" } else { "s" });
        let cut = match self.cut() {
            0 => String::new(),
            cut => format!("; {cut} more cut by the time of the phase"),
        };
        let mut line = String::new();
        // Writing to a text cannot fail.
        let _ = match *self {
            Self::Balance { mean_balance_s: mean, sd_balance_s: sd, .. } => {
                write!(line, "{mean:.2}{} s balanced {over}", spread(sd, 2))
            }
            Self::SwingUp {
                mean_height: mean, sd_height: sd, top_share, longest_hold_s, ..
            } => {
                write!(
                    line,
                    "mean height {mean:+.2}{} {over}, {:.0} % of the time at the top, longest \
                     hold {longest_hold_s:.1} s",
                    spread(sd, 2),
                    100.0 * top_share
                )
            }
            Self::SpeedUp { mean_speed: mean, sd_speed: sd, end_hits, .. } => write!(
                line,
                "{mean:.3}{} m/s {over}, the ball ran over a limit {end_hits} time{}",
                spread(sd, 3),
                if end_hits == 1 { "" } else { "s" }
            ),
            Self::MountainCar { mean_steps: Some(mean), sd_steps: sd, solved, .. } => write!(
                line,
                "{mean:.0}{} steps {over}, the flag reached in {solved}{cut}",
                spread(sd, 0)
            ),
            Self::MountainCar { mean_steps: None, .. } => {
                write!(line, "no flag reached {over}, cut by the time of its phase")
            }
        };
        line
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands out references")]
const fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// The number at `index` of what a task counted in a rollout.
fn tallied(row: &EpisodeRow, index: usize) -> f64 {
    row.tallied.get(index).copied().unwrap_or(0.0)
}

/// The mean of a rollout's mean over the time of all rollouts.
fn over_time(rows: &[&EpisodeRow], of: impl Fn(&EpisodeRow) -> f64) -> f64 {
    let steps: f64 = rows.iter().map(|row| f64::from(row.steps)).sum();
    rows.iter().map(|row| of(row) * f64::from(row.steps)).sum::<f64>() / steps.max(1.0)
}
