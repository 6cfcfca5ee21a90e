//! Where the plant lives: in the computer or at the end of a wire.

pub mod emulator;
#[cfg(unix)]
pub mod guard;
#[cfg(unix)]
pub mod priority;
pub mod safety;
pub mod serial;
pub mod simulated;
pub mod wire;

use self::safety::Trip;
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

/// Whether a rollout may go on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Readiness {
    /// It may.
    Ready,
    /// It has to wait, and this is why.
    Waits {
        /// In words for the person.
        why: String,
        /// Whether only a person can end the waiting.
        needs_person: bool,
    },
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

    /// Whether a rollout may go on, or its countdown. A plant in the computer is always ready.
    fn readiness(&mut self) -> Readiness {
        Readiness::Ready
    }

    /// Whether the plant is where the rollout that was prepared begins.
    fn is_at_start(&mut self) -> bool {
        true
    }

    /// A hand is on the switch that enables the motor, or is not; `None`: the operator's device has
    /// no such switch.
    fn enable(&mut self, _is_held: Option<bool>) {}

    /// The plant stops at once, and until a person has seen to it: the emergency stop, or a limit
    /// that `tripped` outside of its own guard.
    fn stop(&mut self, _tripped: Option<Trip>) {
        self.halt();
    }

    /// Why the plant has stopped by itself, until a person has seen to it.
    fn fault(&mut self) -> Option<String> {
        None
    }

    /// Whether it is a plant that keeps its own time.
    fn is_real(&self) -> bool {
        false
    }
}
