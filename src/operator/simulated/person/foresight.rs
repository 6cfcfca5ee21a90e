//! A plant in the head: it rolls the late state on to now.

use crate::operator::simulated::filters::DelayLine;
use crate::plant::Plant;
use crate::signal::{Action, Seconds, State};

/// A predictor's imagined plant.
#[derive(Clone, Debug)]
pub(in crate::operator::simulated) struct Foresight<P> {
    plant: P,
    steps: u32,
    /// A step in ticks; all steps together make the delay.
    step_ticks: f64,
}

impl<P: Plant> Foresight<P> {
    /// Foresight over `delay`, with the plant that `imagine` makes for steps of the given
    /// length: at most a tick, and the delay is a whole number of them.
    pub(in crate::operator::simulated) fn new(
        delay: Seconds,
        tick: Seconds,
        imagine: impl FnOnce(Seconds) -> P,
    ) -> Self {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small count of ticks, at least 0"
        )]
        let steps = (delay.0 / tick.0).ceil() as u32;
        let step = delay.0 / f64::from(steps.max(1));
        Self { plant: imagine(Seconds(step)), steps, step_ticks: step / tick.0 }
    }

    /// Foresight over a whole number of ticks.
    pub(in crate::operator::simulated) const fn over_ticks(steps: u32, plant: P) -> Self {
        Self { plant, steps, step_ticks: 1.0 }
    }

    /// The state now, from the state as it was and the actions given since.
    pub(in crate::operator::simulated) fn foresee<const N: usize>(
        &mut self,
        past: [f64; N],
        done: &DelayLine<1>,
    ) -> [f64; N] {
        let Some(mut state) = State::from_slice(&past) else { return past };
        for step in 0..self.steps {
            // The newest action worked during the last tick; a step takes the action that
            // worked in its middle.
            let age = (f64::from(self.steps - step) - 0.5) * self.step_ticks;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a small count of ticks, at least 0"
            )]
            let [action] = done.back(age as usize);
            state = self.plant.step(&state, Action(action));
        }
        <[f64; N]>::try_from(&state[..]).unwrap_or(past)
    }
}
