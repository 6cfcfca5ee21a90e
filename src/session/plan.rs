//! The plan of a session: which phases, how many rollouts, from which starts.

use serde::{Deserialize, Serialize};

use super::{Moment, Phase};
use crate::check::{Check, Checker};
use crate::random::{Purpose, stream};
use crate::signal::Seconds;

/// A phase as a person asks for it; the autonomous one comes with zero control.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Wanted {
    /// Practice.
    Introduction,
    /// Teaching.
    Main,
    /// The robot alone, then nobody.
    Autonomous,
}

impl Wanted {
    /// All of them, in order.
    pub const ALL: [Self; 3] = [Self::Introduction, Self::Main, Self::Autonomous];

    /// The word on the command line.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Introduction => "introduction",
            Self::Main => "main",
            Self::Autonomous => "autonomous",
        }
    }
}

/// Where autonomous rollouts start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Starts {
    /// On a regular grid over all starts.
    #[default]
    Grid,
    /// At random, seeded.
    Random,
}

/// What a person is told before a phase.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Instructions {
    /// Before the introduction.
    pub introduction: String,
    /// Before main in the simultaneous mode.
    pub simultaneous: String,
    /// Before main in the sequential mode.
    pub sequential: String,
    /// Before the autonomous phase.
    pub autonomous: String,
}

impl Default for Instructions {
    fn default() -> Self {
        Self {
            introduction: "Practice. Keep the pole up by pushing the cart left and right. \
                           Wait while it says WAIT; push when it says GO. \
                           The rollout ends when the pole falls."
                .to_owned(),
            simultaneous: "Now you teach. Keep the pole up as long as you can. \
                           The computer learns from you and will help you more and more."
                .to_owned(),
            sequential: "Now you teach. Keep the pole up as long as you can. \
                         The computer watches and learns from you."
                .to_owned(),
            autonomous: "Thank you. Now the computer balances the pole alone. \
                         You can let go and watch."
                .to_owned(),
        }
    }
}

/// The parameters of a session's plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// Which phases take place.
    pub phases: Vec<Wanted>,
    /// Rollouts of practice; `None` when only the duration counts.
    pub introduction_rollouts: Option<u32>,
    /// Controlled time of practice, s; `None` when only the rollouts count.
    pub introduction_duration_s: Option<f64>,
    /// Rollouts of teaching; `None` when only the duration counts.
    pub main_rollouts: Option<u32>,
    /// Controlled time of teaching, s; `None` when only the rollouts count.
    pub main_duration_s: Option<f64>,
    /// Starts of the robot alone, and of zero control.
    pub autonomous_rollouts: u32,
    /// Where autonomous rollouts start.
    pub starts: Starts,
    /// Whether each steered rollout begins at the task's start. If not, one that was over
    /// only because its time was goes on where it ended, without a countdown.
    pub returns: bool,
    /// The countdown before a steered rollout, s.
    pub hold_s: f64,
    /// The countdown before a rollout that nobody steers, s.
    pub autonomous_hold_s: f64,
    /// The break between phases, s.
    pub break_s: f64,
    /// What a person is told before each phase.
    pub instructions: Instructions,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            phases: Wanted::ALL.to_vec(),
            introduction_rollouts: Some(20),
            introduction_duration_s: None,
            main_rollouts: Some(100),
            main_duration_s: None,
            autonomous_rollouts: 100,
            starts: Starts::Grid,
            returns: true,
            hold_s: 3.0,
            autonomous_hold_s: 0.5,
            break_s: 60.0,
            instructions: Instructions::default(),
        }
    }
}

/// The most rollouts that a phase may have.
pub const MOST_ROLLOUTS: u32 = 1_000_000;

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.demand(
            !self.phases.is_empty() && self.phases.is_sorted_by_key(|p| *p as u8) && {
                let mut once = self.phases.clone();
                once.dedup();
                once.len() == self.phases.len()
            },
            "phases",
            format_args!("{:?}", self.phases),
            "one or more of introduction, main, autonomous, in this order, each once",
        );
        let practice = (self.introduction_rollouts, self.introduction_duration_s);
        extent(c, ["introduction_rollouts", "introduction_duration_s"], practice);
        let main = (self.main_rollouts, self.main_duration_s);
        extent(c, ["main_rollouts", "main_duration_s"], main);
        c.count("autonomous_rollouts", self.autonomous_rollouts, 1..=MOST_ROLLOUTS);
        c.range("hold_s", self.hold_s, 0.0..=60.0);
        c.range("autonomous_hold_s", self.autonomous_hold_s, 0.0..=60.0);
        c.range("break_s", self.break_s, 0.0..=3600.0);
    }
}

/// Checks what ends a phase: rollouts, a duration in s, or whichever comes first.
fn extent(
    c: &mut Checker<'_>,
    [rollouts_key, duration_key]: [&str; 2],
    (rollouts, duration): (Option<u32>, Option<f64>),
) {
    if let Some(rollouts) = rollouts {
        c.count(rollouts_key, rollouts, 1..=MOST_ROLLOUTS);
    }
    match duration {
        Some(duration) => c.range(duration_key, duration, 1.0..=86_400.0),
        None => c.demand(
            rollouts.is_some(),
            rollouts_key,
            "None",
            &format!(
                "a number of rollouts, or set {duration_key}: one of the two must end the phase"
            ),
        ),
    }
}

/// Where a rollout starts, as the task is asked for it.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "one at a time, made once a rollout and used up")]
pub enum Start {
    /// At random, from this stream.
    Random(rand_chacha::ChaCha8Rng),
    /// At a point of a regular grid.
    Grid {
        /// From 0.
        index: u32,
        /// The number of points.
        count: u32,
    },
}

/// One phase of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhasePlan {
    /// Which phase.
    pub phase: Phase,
    /// It ends after this many rollouts,
    pub rollouts: Option<u32>,
    /// or after this many controlled steps.
    pub steps: Option<u64>,
}

/// Everything the session machine needs to know beforehand.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The phases in order.
    pub phases: Vec<PhasePlan>,
    /// Ticks of countdown before a steered rollout,
    pub hold_ticks: u32,
    /// and before one that nobody steers.
    pub autonomous_hold_ticks: u32,
    /// Ticks of break between phases.
    pub break_ticks: u32,
    /// Whether a person is there to read instructions, rest and press keys.
    pub attended: bool,
    /// The session's seed.
    pub seed: u64,
    /// Whether each steered rollout begins at the task's start.
    pub returns: bool,
    starts: Starts,
}

impl Plan {
    /// The plan that `params` describe, with ticks of `tick`.
    #[must_use]
    pub fn new(params: &Params, tick: Seconds, seed: u64, attended: bool) -> Self {
        let ticks = |seconds: f64| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "checked: at most a day of ticks of a millisecond"
            )]
            let ticks = (seconds / tick.0).round() as u32;
            ticks
        };
        let phases = params.phases.iter().flat_map(|wanted| match wanted {
            Wanted::Introduction => vec![PhasePlan {
                phase: Phase::Introduction,
                rollouts: params.introduction_rollouts,
                steps: params.introduction_duration_s.map(|s| u64::from(ticks(s))),
            }],
            Wanted::Main => vec![PhasePlan {
                phase: Phase::Main,
                rollouts: params.main_rollouts,
                steps: params.main_duration_s.map(|s| u64::from(ticks(s))),
            }],
            Wanted::Autonomous => [Phase::Autonomous, Phase::ZeroControl]
                .map(|phase| PhasePlan {
                    phase,
                    rollouts: Some(params.autonomous_rollouts),
                    steps: None,
                })
                .to_vec(),
        });
        Self {
            phases: phases.collect(),
            hold_ticks: ticks(params.hold_s),
            autonomous_hold_ticks: ticks(params.autonomous_hold_s),
            break_ticks: ticks(params.break_s),
            attended,
            seed,
            returns: params.returns,
            starts: params.starts,
        }
    }

    /// The plan of `phase`, if it takes place.
    #[must_use]
    pub fn phase(&self, phase: Phase) -> Option<&PhasePlan> {
        self.phases.iter().find(|plan| plan.phase == phase)
    }

    /// The phase after `phase`.
    #[must_use]
    pub fn after(&self, phase: Phase) -> Option<Phase> {
        let here = self.phases.iter().position(|plan| plan.phase == phase)?;
        self.phases.get(here + 1).map(|plan| plan.phase)
    }

    /// Ticks of countdown before a rollout of `phase`.
    #[must_use]
    pub const fn hold_ticks(&self, phase: Phase) -> u32 {
        if phase.is_steered() { self.hold_ticks } else { self.autonomous_hold_ticks }
    }

    /// Where the rollout of `moment` starts: the same at every attempt.
    #[must_use]
    pub fn start(&self, moment: &Moment) -> Start {
        match (moment.phase.is_steered(), self.starts) {
            (false, Starts::Grid) => Start::Grid {
                index: moment.rollout - 1,
                count: self.phase(moment.phase).and_then(|plan| plan.rollouts).unwrap_or(1),
            },
            (false, Starts::Random) => Start::Random(stream(
                self.seed,
                Purpose::EvaluationStarts,
                Moment { attempt: 0, ..*moment }.place(),
            )),
            (true, _) => Start::Random(stream(
                self.seed,
                Purpose::Starts,
                Moment { attempt: 0, ..*moment }.place(),
            )),
        }
    }

    /// How many tenths of `phase` are over after `rollouts` finished rollouts and `steps`
    /// controlled steps: a tenth k is ⌈kN/10⌉ rollouts, or k/10 of a set duration. When
    /// both are set, whichever is further.
    #[must_use]
    pub fn tenths(&self, phase: Phase, rollouts: u32, steps: u64) -> u8 {
        let Some(plan) = self.phase(phase) else { return 0 };
        let part =
            |done: u64, all: u64| u8::try_from((done * 10 / all.max(1)).min(10)).unwrap_or(10);
        let by_rollouts = plan.rollouts.map(|all| part(u64::from(rollouts), u64::from(all)));
        let by_steps = plan.steps.map(|all| part(steps, all));
        by_rollouts.max(by_steps).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_is_reached_after_the_ceiling_of_kn_over_ten_rollouts() {
        for n in [1, 3, 7, 10, 23, 100] {
            let params = Params { main_rollouts: Some(n), ..Params::default() };
            let plan = Plan::new(&params, Seconds(0.02), 1, false);
            for k in 1..=10_u32 {
                let needed = (k * n).div_ceil(10);
                assert!(u32::from(plan.tenths(Phase::Main, needed, 0)) >= k);
                assert!(u32::from(plan.tenths(Phase::Main, needed - 1, 0)) < k, "{n} {k}");
            }
        }
        let params =
            Params { main_rollouts: None, main_duration_s: Some(60.0), ..Params::default() };
        let plan = Plan::new(&params, Seconds(0.02), 1, false);
        assert_eq!(plan.tenths(Phase::Main, 99, 299), 0);
        assert_eq!(plan.tenths(Phase::Main, 99, 300), 1);
        assert_eq!(plan.tenths(Phase::Main, 99, 3000), 10);
    }

    #[test]
    fn a_repeated_rollout_has_the_same_start() {
        use rand::Rng;
        let plan = Plan::new(&Params::default(), Seconds(0.02), 1, false);
        let draw = |moment: Moment| match plan.start(&moment) {
            Start::Random(mut chance) => chance.next_u64(),
            Start::Grid { .. } => 0,
        };
        let first = Moment::start_of(Phase::Main);
        assert_eq!(draw(first), draw(Moment { attempt: 3, ..first }));
        assert_ne!(draw(first), draw(Moment { rollout: 2, ..first }));
    }
}
