//! What a plant is used for: where rollouts start and end, what counts as good, what the
//! learner sees, and where regions of the state space begin.

pub mod balance;
pub mod mountain_car;
pub mod speed_up;
pub mod swing_up;

use rand_chacha::ChaCha8Rng;

use crate::sharing::region::{Region, Scale};
use crate::signal::{End, Features, State, Tallied};

/// What a rollout is for: some tasks let the robot alone for longer than a person teaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occasion {
    /// A person steers: introduction and main.
    Taught,
    /// A test of the robot alone, or of nobody.
    Tested,
}

/// The purpose of a plant. Everything here is a pure function of its arguments.
pub trait Task: Send + Sync {
    /// The name outside: `balance`, `swing-up`, ….
    fn name(&self) -> &'static str;

    /// The names of the state's numbers, as in the CSV files.
    fn columns(&self) -> &'static [&'static str];

    /// What the learner sees of a state.
    fn features(&self, state: &State) -> Features;

    /// The names of the features, in order.
    fn feature_names(&self) -> &'static [&'static str];

    /// A start drawn at random for `occasion`.
    fn random_start(&self, occasion: Occasion, chance: &mut ChaCha8Rng) -> State;

    /// Start `index` of `count` on the regular grid over all starts of a test, `index`
    /// from 0.
    fn grid_start(&self, index: u32, count: u32) -> State;

    /// The number that tells starts apart (the release angle, a position).
    fn start_value(&self, start: &State) -> f64;

    /// The reward of the step from `state` to `next`.
    fn reward(&self, state: &State, next: &State) -> f64;

    /// What the success of `state`'s region is the average of; `reward`, that of the step,
    /// unless a task says otherwise.
    fn measure(&self, _state: &State, reward: f64) -> f64 {
        reward
    }

    /// How far `state` is from what the task wants, with no unit: it falls while things get
    /// better. Outcome weighting goes by its change.
    fn cost(&self, state: &State) -> f64;

    /// The most control steps that a rollout for `occasion` lasts.
    fn longest(&self, occasion: Occasion) -> u32;

    /// Whether a rollout that is in `state` after `steps` control steps is over.
    fn end(&self, state: &State, steps: u32, occasion: Occasion) -> Option<End>;

    /// The regions of the state space.
    fn regions(&self) -> &[Region];

    /// The region of `state`, an index into [`regions`](Self::regions).
    fn region(&self, state: &State) -> usize;

    /// The scale that success has in main where it goes by what the person achieved in
    /// introduction, as a mean reward (`None`: there was none); `None` where it does not.
    fn own_scale(&self, _practised: Option<f64>) -> Option<OwnScale> {
        None
    }

    /// The names of what [`tally`](Self::tally) counts.
    fn tally_names(&self) -> &'static [&'static str] {
        &[]
    }

    /// Counts what the task wants to know of a rollout beyond its time and reward.
    fn tally(&self) -> Box<dyn Tally> {
        Box::new(Nothing)
    }

    /// Where the plant's track ends, as values of the state's first number; `None` for one
    /// without an end.
    fn ends(&self) -> Option<(f64, f64)>;

    /// The largest action, in the plant's unit; the smallest is its negative.
    fn action_limit(&self) -> f64;
}

/// A scale of success that goes by the person's own practice.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnScale {
    /// The scale in main.
    pub scale: Scale,
    /// How it was found, for `events.csv`.
    pub why: String,
}

/// Counts through one rollout.
pub trait Tally: Send {
    /// A control step from `state` to `next`.
    fn step(&mut self, state: &State, next: &State);

    /// What was counted so far, in the order of [`Task::tally_names`].
    fn tallied(&self) -> Tallied;

    /// What is under way and could go on in the next rollout.
    fn unfinished(&self) -> Tallied {
        Tallied::default()
    }

    /// Counts on from what was [`unfinished`](Self::unfinished) before.
    fn go_on(&mut self, _unfinished: &Tallied) {}
}

/// The tally of a task whose time and reward say all.
#[derive(Clone, Copy, Debug, Default)]
pub struct Nothing;

impl Tally for Nothing {
    fn step(&mut self, _state: &State, _next: &State) {}

    fn tallied(&self) -> Tallied {
        Tallied::default()
    }
}

/// `seconds` as control steps of `tick`, at least one.
#[must_use]
pub fn steps_of(seconds: f64, tick: crate::signal::Seconds) -> u32 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "checked: at most an hour of ticks of a millisecond"
    )]
    let steps = (seconds / tick.0).round() as u32;
    steps.max(1)
}
