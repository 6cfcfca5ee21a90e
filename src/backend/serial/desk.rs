//! Where a station is looked at and wished from: by the control cycle and by screens.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::driver::Stage;
use super::station::{Look, Wish};
use crate::signal::Seconds;

/// How long from a state until its command was written.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Latency {
    /// Half of all, µs;
    pub p50_us: u64,
    /// all but one in a hundred;
    pub p99_us: u64,
    /// all.
    pub max_us: u64,
}

/// What the port's thread tells.
#[derive(Clone, Debug)]
pub struct View {
    /// The station.
    pub look: Look,
    /// From a state to its command.
    pub latency: Latency,
    /// A calibration could not be kept, for this reason.
    pub not_kept: Option<String>,
    /// The port's thread goes before all others of the computer: the system permits it.
    pub is_first: bool,
}

/// What somebody wants of the port's thread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Ask {
    /// A wish for the station.
    Wish(Wish),
    /// The caller wants this action since then.
    Want(f64, Seconds),
    /// A hand is on the switch, or is not.
    Enable(bool, Seconds),
    /// The end: the motor stops first.
    Close,
}

/// What is shared.
#[derive(Debug)]
struct Shared {
    view: Mutex<View>,
    changed: Condvar,
    asked: Mutex<Vec<Ask>>,
    bell: Mutex<Option<Box<dyn Ring>>>,
}

/// What wakes the port's thread.
pub(super) trait Ring: Send + std::fmt::Debug {
    fn ring(&self);
}

/// Looks at a station and wishes things of it. Copies are of the same one.
#[derive(Clone, Debug)]
pub struct Desk(Arc<Shared>);

impl Desk {
    pub(super) fn new(look: Look) -> Self {
        let view = View { look, latency: Latency::default(), not_kept: None, is_first: false };
        Self(Arc::new(Shared {
            view: Mutex::new(view),
            changed: Condvar::new(),
            asked: Mutex::new(Vec::new()),
            bell: Mutex::new(None),
        }))
    }

    /// What is known of the station.
    #[must_use]
    pub fn view(&self) -> View {
        lock(&self.0.view).clone()
    }

    /// Something of it, without a copy of all.
    pub fn see<T>(&self, what: impl FnOnce(&View) -> T) -> T {
        what(&lock(&self.0.view))
    }

    /// Wishes something.
    pub fn wish(&self, wish: Wish) {
        self.ask(Ask::Wish(wish));
    }

    /// Waits at most `patience` until `what` finds something.
    pub fn wait<T>(
        &self,
        patience: Seconds,
        mut what: impl FnMut(&View) -> Option<T>,
    ) -> Option<T> {
        let mut found = None;
        let patience = Duration::from_secs_f64(patience.0.clamp(0.0, 3600.0));
        let view = lock(&self.0.view);
        let _ = self.0.changed.wait_timeout_while(view, patience, |view| {
            found = what(view);
            found.is_none()
        });
        found
    }

    /// Whether there is a device that sends states.
    #[must_use]
    pub fn is_ready(&self) -> bool {
        self.see(|view| view.look.stage == Stage::Ready)
    }

    pub(super) fn ask(&self, ask: Ask) {
        lock(&self.0.asked).push(ask);
        if let Some(bell) = &*lock(&self.0.bell) {
            bell.ring();
        }
    }

    pub(super) fn take_asked(&self) -> Vec<Ask> {
        std::mem::take(&mut *lock(&self.0.asked))
    }

    pub(super) fn hang(&self, bell: Option<Box<dyn Ring>>) {
        *lock(&self.0.bell) = bell;
    }

    pub(super) fn show(&self, view: View) {
        *lock(&self.0.view) = view;
        self.0.changed.notify_all();
    }
}

/// What was shared outlives a thread that failed.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}
