//! Stops the motor at once from wherever something goes wrong: a panic in any thread, a signal.
//!
//! Whoever pulls it may have died while holding any lock, so it waits for none, and it needs
//! nothing of whoever owns the port but what was laid ready at arming.
//!
//! ```text
//! port's owner ── arm(port, stop) ──▶ ready ◀── stop() ── panic hook, signals
//!      ▲                                             │
//!      └─────────────── was_pulled() ◀───────────────┴──▶ port
//! ```
//!
//! The owner of the port may be writing a command at that very moment. It says so by
//! [`writing`], and a stop waits a moment for the end of it: no command comes after a stop, and
//! a board's buffer holds what came before it. Then the owner stops by its own means as well.

use std::os::fd::OwnedFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError, TryLockError};

use super::write_stop;
use crate::clock::{Clock, WallClock};
use crate::signal::Seconds;

/// A command takes no longer to be written. Whoever died over it is waited for no longer.
const LONGEST: Seconds = Seconds(0.001);
/// How often it is looked whether it is written.
const LOOK: Seconds = Seconds(0.000_05);

/// The program's one last resort.
static HERE: LastResort = LastResort::new();

/// Lays `stop` ready for `port`, in place of what was ready before, and forgets that it was
/// pulled. `port` is a copy of the owner's.
pub fn arm(port: OwnedFd, stop: &[u8]) {
    HERE.arm(port, stop);
}

/// Nothing is left to stop: the port is closed, once its owner closes it too.
pub fn disarm() {
    HERE.disarm();
}

/// While the device homes it must get no byte at all, not even a stop.
pub fn set_mute(is_mute: bool) {
    HERE.set_mute(is_mute);
}

/// Stops the motor at once, if one is armed. Returns whether the stop was written.
pub fn stop() -> bool {
    HERE.stop()
}

/// A person arms the motor anew: that it was pulled is forgotten.
pub fn forget() {
    HERE.was_pulled.store(false, Ordering::SeqCst);
}

/// Whether somebody pulled it since it was armed: its owner must not drive on.
#[must_use]
pub fn was_pulled() -> bool {
    HERE.was_pulled()
}

/// The owner writes to its port until this is dropped. Whether it may drive it asks after this.
#[must_use]
pub fn writing() -> Writing<'static> {
    HERE.writing()
}

/// That a command is being written.
#[derive(Debug)]
pub struct Writing<'a>(&'a AtomicBool);

impl Drop for Writing<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::SeqCst);
    }
}

/// A port, and what stops the motor there.
#[derive(Debug)]
struct Ready {
    port: OwnedFd,
    stop: Vec<u8>,
}

/// A stop that is ready to be written from any thread.
#[derive(Debug)]
struct LastResort {
    ready: Mutex<Option<Ready>>,
    is_mute: AtomicBool,
    was_pulled: AtomicBool,
    is_writing: AtomicBool,
    /// How long a command may take to be written.
    patience: Seconds,
}

impl LastResort {
    const fn new() -> Self {
        Self {
            ready: Mutex::new(None),
            is_mute: AtomicBool::new(false),
            was_pulled: AtomicBool::new(false),
            is_writing: AtomicBool::new(false),
            patience: LONGEST,
        }
    }

    fn arm(&self, port: OwnedFd, stop: &[u8]) {
        let ready = Ready { port, stop: stop.to_owned() };
        self.is_mute.store(false, Ordering::SeqCst);
        // Before the lock is taken: whoever finds it taken leaves word here.
        self.was_pulled.store(false, Ordering::SeqCst);
        let before = self.ready.lock().unwrap_or_else(PoisonError::into_inner).replace(ready);
        drop(before);
    }

    fn disarm(&self) {
        let before = self.ready.lock().unwrap_or_else(PoisonError::into_inner).take();
        drop(before);
    }

    fn set_mute(&self, is_mute: bool) {
        self.is_mute.store(is_mute, Ordering::SeqCst);
    }

    fn was_pulled(&self) -> bool {
        self.was_pulled.load(Ordering::SeqCst)
    }

    fn writing(&self) -> Writing<'_> {
        self.is_writing.store(true, Ordering::SeqCst);
        Writing(&self.is_writing)
    }

    /// Waits until no command is being written, but not for a writer that failed.
    fn wait_for_writer(&self) {
        let mut clock = WallClock::start();
        while self.is_writing.load(Ordering::SeqCst) && clock.now() < self.patience {
            clock.wait_until(clock.now() + LOOK);
        }
    }

    fn stop(&self) -> bool {
        let ready = match self.ready.try_lock() {
            Ok(ready) => ready,
            Err(TryLockError::Poisoned(ready)) => ready.into_inner(),
            // Somebody else is stopping the motor right now, or it is being armed: then its
            // owner sees the flag.
            Err(TryLockError::WouldBlock) => {
                self.was_pulled.store(true, Ordering::SeqCst);
                return false;
            }
        };
        let Some(ready) = &*ready else { return false };
        // First, so that its owner writes no further command.
        self.was_pulled.store(true, Ordering::SeqCst);
        self.wait_for_writer();
        !self.is_mute.load(Ordering::SeqCst) && write_stop(&ready.port, &ready.stop).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use std::io::{PipeReader, Read, Write, pipe};

    use super::*;

    fn armed() -> (LastResort, PipeReader) {
        let (heard, port) = pipe().unwrap();
        let resort = LastResort::new();
        resort.arm(port.into(), b"stop");
        (resort, heard)
    }

    /// All that came, once nobody can write any more.
    fn all(resort: &LastResort, mut heard: PipeReader) -> String {
        resort.disarm();
        let mut bytes = String::new();
        heard.read_to_string(&mut bytes).unwrap();
        bytes
    }

    #[test]
    fn it_stops_the_motor_and_its_owner_learns_of_it() {
        let (resort, heard) = armed();
        assert!(!resort.was_pulled());
        assert!(resort.stop() && resort.stop());
        assert!(resort.was_pulled());
        assert_eq!(all(&resort, heard), "stopstop");
        assert!(resort.was_pulled(), "disarming is not looking");
        let (_, port) = pipe().unwrap();
        resort.arm(port.into(), b"stop");
        assert!(!resort.was_pulled());
    }

    #[test]
    fn a_command_that_is_being_written_comes_before_the_stop() {
        let (heard, mut port) = pipe().unwrap();
        let resort = LastResort { patience: Seconds(60.0), ..LastResort::new() };
        resort.arm(port.try_clone().unwrap().into(), b"stop");
        std::thread::scope(|scope| {
            let writing = resort.writing();
            assert!(!resort.was_pulled(), "it may drive");
            let stop = scope.spawn(|| resort.stop());
            while !resort.was_pulled() {
                std::thread::yield_now();
            }
            port.write_all(b"drive").unwrap();
            drop(writing);
            assert!(stop.join().unwrap());
        });
        drop(port);
        assert_eq!(all(&resort, heard), "drivestop");
    }

    #[test]
    fn a_writer_that_never_ends_does_not_keep_the_stop() {
        let (resort, heard) = armed();
        let _stuck = resort.writing();
        assert!(resort.stop());
        assert_eq!(all(&resort, heard), "stop");
    }

    #[test]
    fn without_a_motor_nothing_is_pulled() {
        let resort = LastResort::new();
        assert!(!resort.stop());
        assert!(!resort.was_pulled());
    }

    #[test]
    fn a_homing_device_gets_no_byte_but_its_owner_learns_of_it() {
        let (resort, heard) = armed();
        resort.set_mute(true);
        assert!(!resort.stop());
        assert!(resort.was_pulled());
        resort.set_mute(false);
        assert!(resort.stop());
        assert_eq!(all(&resort, heard), "stop");
    }

    #[test]
    fn it_waits_for_no_lock_and_shrugs_off_a_poisoned_one() {
        let (resort, heard) = armed();
        let held = resort.ready.lock().unwrap();
        assert!(!resort.stop());
        assert!(resort.was_pulled());
        drop(held);
        let died = std::thread::scope(|scope| {
            let holder = scope.spawn(|| {
                let _held = resort.ready.lock().unwrap();
                panic!("while it holds the lock");
            });
            holder.join().is_err()
        });
        assert!(died && resort.ready.is_poisoned());
        assert!(resort.stop());
        assert_eq!(all(&resort, heard), "stop");
    }

    #[test]
    fn a_device_that_is_gone_is_no_stop() {
        let (resort, heard) = armed();
        drop(heard);
        assert!(!resort.stop());
        assert!(resort.was_pulled());
    }
}
