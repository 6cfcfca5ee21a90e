//! A plant in the computer.

use super::{Backend, Sensed};
use crate::plant::Plant;
use crate::random::{Place, Purpose, stream};
use crate::signal::{Action, Seconds, State};

/// A plant that moves by one control step each time it is actuated, and rests otherwise.
pub struct Simulated {
    plant: Box<dyn Plant>,
    state: State,
    seed: u64,
}

impl Simulated {
    /// `plant`, with the noise of the session seeded with `seed`.
    #[must_use]
    pub fn new(plant: Box<dyn Plant>, seed: u64) -> Self {
        Self { plant, state: State::default(), seed }
    }
}

impl Backend for Simulated {
    fn sense(&mut self) -> Sensed {
        Sensed { state: self.state, age: Seconds(0.0) }
    }

    fn actuate(&mut self, wanted: Action) -> Action {
        self.state = self.plant.step(&self.state, wanted);
        wanted
    }

    fn halt(&mut self) {}

    fn prepare(&mut self, start: State, place: Place) {
        self.state = start;
        self.go_on(place);
    }

    fn go_on(&mut self, place: Place) {
        self.plant.reseed(stream(self.seed, Purpose::Friction, place));
    }
}
