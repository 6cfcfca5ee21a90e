//! Limits around every backend.
//!
//! What may go to the plant is decided by a pure function of the limits, what was sensed
//! and what is wanted. A trip is latched: the plant receives 0 until a person begins anew.

pub mod warden;

use super::{Backend, Readiness, Sensed};
use crate::random::Place;
use crate::signal::{Action, Seconds, State};

/// What a plant may be asked, and how old its state may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// The largest action, plant's unit; the smallest is its negative.
    pub action: f64,
    /// A state older than this is stale.
    pub stale: Seconds,
}

/// Why the plant was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Trip {
    /// The wanted action was NaN or infinite.
    #[error("the wanted action is not a finite number")]
    Action,
    /// A state was NaN or infinite.
    #[error("the plant's state is not finite")]
    State,
    /// No fresh state came.
    #[error("the plant's state is stale: no fresh one arrived in time")]
    Stale,
}

/// The action that may be applied, or why none may.
///
/// # Errors
/// A [`Trip`], upon which the plant must receive 0.
pub fn judge(limits: &Limits, sensed: &Sensed, wanted: Action) -> Result<Action, Trip> {
    if !sensed.state.is_finite() {
        return Err(Trip::State);
    }
    // Written so that an age that is not a number is stale, too.
    let fresh = sensed.age <= limits.stale;
    if !fresh {
        return Err(Trip::Stale);
    }
    if !wanted.0.is_finite() {
        return Err(Trip::Action);
    }
    Ok(Action(wanted.0.clamp(-limits.action, limits.action)))
}

/// A backend within its limits.
pub struct Safe {
    inner: Box<dyn Backend>,
    limits: Limits,
    tripped: Option<Trip>,
}

impl Safe {
    /// `inner` within `limits`.
    #[must_use]
    pub fn new(inner: Box<dyn Backend>, limits: Limits) -> Self {
        Self { inner, limits, tripped: None }
    }

    /// A person began anew after a stop: a latched trip is forgotten.
    pub const fn clear(&mut self) {
        self.tripped = None;
    }

    /// Why the plant is stopped, if it is.
    #[must_use]
    pub const fn tripped(&self) -> Option<Trip> {
        self.tripped
    }

    /// Why the plant is stopped, in words: what its own guard says, who knows more and was first,
    /// or the limit that tripped.
    pub fn cause(&mut self) -> Option<String> {
        self.inner.fault().or_else(|| self.tripped.map(|trip| trip.to_string()))
    }
}

impl Backend for Safe {
    fn sense(&mut self) -> Sensed {
        self.inner.sense()
    }

    fn actuate(&mut self, wanted: Action) -> Action {
        let sensed = self.inner.sense();
        let allowed = match self.tripped {
            Some(trip) => Err(trip),
            None => judge(&self.limits, &sensed, wanted),
        };
        match allowed {
            Ok(action) => self.inner.actuate(action),
            Err(trip) => {
                self.tripped = Some(trip);
                self.inner.halt();
                self.inner.actuate(Action(0.0))
            }
        }
    }

    fn halt(&mut self) {
        self.inner.halt();
    }

    fn prepare(&mut self, start: State, place: Place) {
        self.inner.prepare(start, place);
    }

    fn go_on(&mut self, place: Place) {
        self.inner.go_on(place);
    }

    fn readiness(&mut self) -> Readiness {
        self.inner.readiness()
    }

    fn is_at_start(&mut self) -> bool {
        self.inner.is_at_start()
    }

    fn enable(&mut self, is_held: Option<bool>) {
        self.inner.enable(is_held);
    }

    fn stop(&mut self, tripped: Option<Trip>) {
        self.inner.stop(tripped.or(self.tripped));
    }

    fn fault(&mut self) -> Option<String> {
        self.inner.fault()
    }

    fn is_real(&self) -> bool {
        self.inner.is_real()
    }
}

impl Drop for Safe {
    fn drop(&mut self) {
        self.inner.halt();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;
    use proptest::prelude::*;

    const LIMITS: Limits = Limits { action: 10.0, stale: Seconds(0.06) };

    #[derive(Default)]
    struct Plant {
        state: State,
        received: Arc<Mutex<Vec<f64>>>,
        halts: Arc<Mutex<u32>>,
    }

    impl Backend for Plant {
        fn sense(&mut self) -> Sensed {
            Sensed { state: self.state, age: Seconds(0.0) }
        }
        fn actuate(&mut self, wanted: Action) -> Action {
            self.received.lock().unwrap().push(wanted.0);
            wanted
        }
        fn halt(&mut self) {
            *self.halts.lock().unwrap() += 1;
        }
        fn prepare(&mut self, start: State, _place: Place) {
            self.state = start;
        }
        fn go_on(&mut self, _place: Place) {}
    }

    #[test]
    fn a_trip_is_latched_until_a_person_begins_anew() {
        let plant = Plant::default();
        let (received, halts) = (Arc::clone(&plant.received), Arc::clone(&plant.halts));
        let mut safe = Safe::new(Box::new(plant), LIMITS);
        safe.actuate(Action(20.0));
        safe.actuate(Action(f64::NAN));
        safe.actuate(Action(1.0));
        assert_eq!(safe.tripped(), Some(Trip::Action));
        safe.prepare(State::default(), Place::default());
        safe.actuate(Action(2.0));
        safe.clear();
        safe.actuate(Action(-1.0));
        assert_eq!(*received.lock().unwrap(), [10.0, 0.0, 0.0, 0.0, -1.0]);
        drop(safe);
        assert!(*halts.lock().unwrap() >= 3);
    }

    proptest! {
        #[test]
        fn nothing_beyond_the_limits_is_ever_allowed(
            wanted in any::<f64>(), age in any::<f64>(), theta in any::<f64>(),
        ) {
            let sensed = Sensed { state: State::new([0.0, 0.0, theta, 0.0]), age: Seconds(age) };
            match judge(&LIMITS, &sensed, Action(wanted)) {
                Ok(action) => {
                    prop_assert!(action.0.abs() <= 10.0);
                    prop_assert!(theta.is_finite() && age <= 0.06 && wanted.is_finite());
                }
                Err(_) => prop_assert!(
                    !(theta.is_finite() && age <= 0.06 && wanted.is_finite())
                ),
            }
        }
    }
}
