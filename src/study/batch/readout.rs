//! Policies that drive in the learner's place where the robot is alone.

use super::params::Readout;
use crate::learner::{Learner, Model};
use crate::operator::{Operator, Practice, View};
use crate::profile::{Experiment, Profile};
use crate::random::Place;
use crate::signal::Intent;
use crate::task::Task;

/// Who drives for `readout` of what was learned; nobody but the learner itself where it is
/// followed as it is. `agent` is what the operator has learned.
pub(super) fn deputy(
    readout: Readout,
    profile: &Profile,
    learner: &Model,
    agent: &[f64],
) -> Option<Box<dyn Operator>> {
    match readout {
        Readout::Continuous => None,
        Readout::Agent => Some(greedy(profile, agent)),
        Readout::Rounded => Some(Box::new(Reader::new(profile, learner, 1.0 / 3.0))),
        Readout::Sign => Some(Box::new(Reader::new(profile, learner, 0.0))),
    }
}

/// The agent that knows `learned` and tries nothing any more.
fn greedy(profile: &Profile, learned: &[f64]) -> Box<dyn Operator> {
    let mut experiment = profile.experiment.clone();
    if let Experiment::MountainCar { simulated, .. } = &mut experiment {
        simulated.q_learning.epsilon = 0.0;
    }
    match experiment.agent(0) {
        Ok(mut agent) => {
            agent.recall(learned);
            Box::new(agent)
        }
        // Studies with such a readout are refused.
        Err(_) => Box::new(crate::operator::Nobody),
    }
}

/// The learner, of which only the sign is taken where it is far enough from 0.
struct Reader {
    learner: Model,
    task: Box<dyn Task>,
    /// The part of the largest action beyond which it is.
    cut: f64,
}

impl Reader {
    fn new(profile: &Profile, learner: &Model, cut: f64) -> Self {
        Self { learner: learner.clone(), task: profile.experiment.task(profile.tick()), cut }
    }
}

impl Operator for Reader {
    fn begin(&mut self, _place: Place, _practice: Practice) {}

    fn intent(&mut self, view: View<'_>) -> Intent {
        let mut action = [0.0];
        self.learner.predict(&self.task.features(view.state), &mut action);
        Intent::fresh(full(action[0], self.cut, self.task.action_limit()))
    }
}

/// Full effort in the direction of motion: u = sign(v).
pub(super) struct WithMotion {
    /// The index of the velocity in the state,
    pub(super) velocity: usize,
    /// and the largest action.
    pub(super) limit: f64,
}

impl Operator for WithMotion {
    fn begin(&mut self, _place: Place, _practice: Practice) {}

    fn intent(&mut self, view: View<'_>) -> Intent {
        let velocity = view.state.get(self.velocity).copied().unwrap_or(0.0);
        Intent::fresh(full(velocity, 0.0, self.limit))
    }
}

/// Full effort `limit` in the direction of `number`, where that is beyond `cut` of it; else none.
fn full(number: f64, cut: f64, limit: f64) -> f64 {
    if number.abs() > cut * limit { limit.copysign(number) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirds_of_the_range_are_rounded_and_signs_are_full() {
        let rounded = |u| full(u, 1.0 / 3.0, 3.0);
        assert_eq!(
            [-3.0, -1.1, -0.9, 0.0, 1.0, 1.1].map(rounded),
            [-3.0, -3.0, 0.0, 0.0, 0.0, 3.0]
        );
        let sign = |u| full(u, 0.0, 3.0);
        assert_eq!([-0.1, 0.0, 1e-9].map(sign), [-3.0, 0.0, 3.0]);
    }
}
