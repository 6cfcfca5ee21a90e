//! Who steers: hands on a device, a script, a simulated operator, or nobody.

mod choice;
pub mod script;
pub mod shaping;
pub mod simulated;
pub mod terminal;

pub use choice::{Choice, Params, UnknownOperator};

use crate::random::Place;
use crate::signal::{Action, End, Intent, Seconds, State};

/// What an operator sees at a tick.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// The plant's state now. Operators with slow eyes keep their own past.
    pub state: &'a State,
    /// The time since the session's control began; it runs on through countdowns.
    pub now: Seconds,
    /// The time within the rollout; negative during the countdown before it.
    pub rollout_time: Seconds,
}

/// What came of a tick, told to the operator after it.
#[derive(Clone, Copy, Debug)]
pub struct Feedback<'a> {
    /// The state in which the action was applied.
    pub state: &'a State,
    /// The action that the plant received.
    pub applied: Action,
    /// The reward of `state`.
    pub reward: f64,
    /// The state afterwards.
    pub next: &'a State,
    /// The rollout's end, if it ended here.
    pub end: Option<End>,
}

/// What an operator has steered before a rollout, in introduction and main together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Practice {
    /// Rollouts, without the discarded ones.
    pub rollouts: u32,
    /// The time in them.
    pub time: Seconds,
}

/// Someone or something that wants an action at each tick.
pub trait Operator: Send {
    /// A rollout is about to begin, after that much practice.
    fn begin(&mut self, place: Place, practice: Practice);

    /// From now on the device's deflection counts `sensitivity` times; nonsense is ignored.
    fn tune(&mut self, _sensitivity: f64) {}

    /// The latest wish; never blocks. Called in the countdown too, where it has no effect.
    fn intent(&mut self, view: View<'_>) -> Intent;

    /// What eyes and hand remember at a rollout's end, as numbers of the operator's own.
    /// Empty for one that lives in the present.
    fn memory(&mut self) -> Vec<f64> {
        Vec::new()
    }

    /// The rollout that just began goes on without a pause from one that ended with this
    /// [`memory`](Self::memory).
    fn go_on(&mut self, _memory: &[f64]) {}

    /// What came of the tick.
    fn told(&mut self, _feedback: &Feedback<'_>) {}
}

/// Nobody: an idle hand, the value 0.
#[derive(Clone, Copy, Debug, Default)]
pub struct Nobody;

impl Operator for Nobody {
    fn begin(&mut self, _place: Place, _practice: Practice) {}

    fn intent(&mut self, _view: View<'_>) -> Intent {
        Intent::fresh(0.0)
    }
}
