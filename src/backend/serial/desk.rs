//! Where a station is looked at and wished from: by the control cycle and by screens.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, TryLockError};
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
    /// A calibration could not be kept or read, and why.
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

    /// What was asked since. Whoever asks at this very moment rings afterwards.
    pub(super) fn take_asked(&self) -> Vec<Ask> {
        unless_busy(&self.0.asked).map(|mut asked| std::mem::take(&mut *asked)).unwrap_or_default()
    }

    pub(super) fn hang(&self, bell: Option<Box<dyn Ring>>) {
        *lock(&self.0.bell) = bell;
    }

    /// Shows `view`, unless somebody looks at this very moment: then it is to be shown soon again.
    pub(super) fn show(&self, view: View) -> Shown {
        let Some(mut shown) = unless_busy(&self.0.view) else { return Shown::NotYet };
        *shown = view;
        drop(shown);
        self.0.changed.notify_all();
        Shown::Yes
    }
}

/// Whether others see the latest view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown {
    /// They do.
    Yes,
    /// They still see the one before.
    NotYet,
}

/// What is shared, for the port's thread: it waits for nobody. Who holds it may have to wait for
/// the computer, which is busy with other things, and the motor cannot.
fn unless_busy<T>(shared: &Mutex<T>) -> Option<MutexGuard<'_, T>> {
    match shared.try_lock() {
        Ok(shared) => Some(shared),
        Err(TryLockError::Poisoned(shared)) => Some(shared.into_inner()),
        Err(TryLockError::WouldBlock) => None,
    }
}

/// What was shared outlives a thread that failed.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::serial::bench::view;

    #[test]
    fn the_port_s_thread_waits_for_nobody_who_looks_or_asks() {
        let desk = Desk::new(view().look);
        let fresh = View { is_first: true, ..desk.view() };
        let shown = desk.see(|_| desk.show(fresh.clone()));
        assert_eq!(shown, Shown::NotYet);
        assert!(!desk.view().is_first);
        assert_eq!(desk.show(fresh), Shown::Yes);
        assert!(desk.view().is_first);

        desk.wish(Wish::Stop);
        let asks = lock(&desk.0.asked);
        assert_eq!(desk.take_asked(), []);
        drop(asks);
        assert_eq!(desk.take_asked(), [Ask::Wish(Wish::Stop)]);
    }
}
