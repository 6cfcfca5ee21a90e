//! Equations of motion, one file a plant.
//!
//! A plant holds parameters and scratch only; the state is handed in and out, so that it
//! can be saved, compared and restored.

pub mod ball_beam;
pub mod cart_pole;
pub mod mountain_car;

use rand_chacha::ChaCha8Rng;

use crate::signal::{Action, State};

/// Something that moves under an action.
pub trait Plant: Send {
    /// The names of the state's numbers, as in the CSV files.
    fn columns(&self) -> &'static [&'static str];

    /// The state one control step after `state` under the constant `action`.
    fn step(&mut self, state: &State, action: Action) -> State;

    /// Draws the plant's noise from `noise` from now on.
    fn reseed(&mut self, noise: ChaCha8Rng);
}
