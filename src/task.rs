//! What a plant is used for: where rollouts start and end, what counts as good, what the
//! learner sees, and where regions of the state space begin.

pub mod balance;

use rand_chacha::ChaCha8Rng;

use crate::sharing::region::Region;
use crate::signal::{End, Features, State};

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

    /// A start drawn at random.
    fn random_start(&self, chance: &mut ChaCha8Rng) -> State;

    /// Start `index` of `count` on the regular grid over all starts, `index` from 0.
    fn grid_start(&self, index: u32, count: u32) -> State;

    /// The number that tells starts apart (the release angle, a position).
    fn start_value(&self, start: &State) -> f64;

    /// The reward of being in `state`.
    fn reward(&self, state: &State) -> f64;

    /// What the success of `state`'s region is the average of; the reward unless a task
    /// says otherwise.
    fn measure(&self, state: &State) -> f64 {
        self.reward(state)
    }

    /// Whether a rollout that is in `state` after `steps` control steps is over.
    fn end(&self, state: &State, steps: u32) -> Option<End>;

    /// The regions of the state space.
    fn regions(&self) -> &[Region];

    /// The region of `state`, an index into [`regions`](Self::regions).
    fn region(&self, state: &State) -> usize;

    /// The largest action, in the plant's unit; the smallest is its negative.
    fn action_limit(&self) -> f64;
}
