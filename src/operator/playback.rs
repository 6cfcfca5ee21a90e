//! Does at each tick what a person did at the same tick of a recorded session.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{Operator, Practice, View};
use crate::random::Place;
use crate::signal::{Action, Intent, Seconds};

/// The operator that is handed its wishes one by one; clones are the same. What nobody handed
/// it, it does not want.
#[derive(Clone, Debug, Default)]
pub struct Playback(Arc<Mutex<Intent>>);

impl Playback {
    /// From now on it wants `action`, in the plant's unit; `None`: nobody was there.
    pub fn want(&self, action: Option<f64>) {
        *self.wish() = action.map_or(Intent::Absent, |action| Intent::Present {
            action: Action(action),
            raw: None,
            age: Seconds(0.0),
        });
    }

    fn wish(&self) -> MutexGuard<'_, Intent> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Operator for Playback {
    fn begin(&mut self, _place: Place, _practice: Practice) {}

    fn intent(&mut self, _view: View<'_>) -> Intent {
        *self.wish()
    }
}
