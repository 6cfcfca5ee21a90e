//! Where the plant lives: in the computer or at the end of a wire.

pub mod emulator;
#[cfg(unix)]
pub mod guard;
pub mod safety;
pub mod serial;
pub mod simulated;
pub mod wire;

use crate::random::Place;
use crate::signal::{Action, Seconds, State};

/// What a backend knows of its plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensed {
    /// The plant's state.
    pub state: State,
    /// How old that knowledge is.
    pub age: Seconds,
}

/// A plant that can be sensed and driven.
pub trait Backend: Send {
    /// The latest state; never blocks.
    fn sense(&mut self) -> Sensed;

    /// Applies `wanted` for one control step and returns what the plant really received.
    fn actuate(&mut self, wanted: Action) -> Action;

    /// Stops the plant's motor at once.
    fn halt(&mut self);

    /// Brings the plant to `start` and holds it there. `place` names the rollout, whose
    /// chance a simulated plant draws from.
    fn prepare(&mut self, start: State, place: Place);

    /// The plant goes on where it is, but its chance is that of the rollout `place` from
    /// now on.
    fn go_on(&mut self, place: Place);
}
