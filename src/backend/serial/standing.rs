//! How a device stands: how far it has come, whether its motor is off, and why it stays off.

use super::shelf::Uncalibrated;
use crate::backend::safety::warden::Fault;
use crate::backend::wire::{Flags, Outcome};
use crate::signal::Seconds;

/// How far a device has come.
#[derive(Clone, Debug, PartialEq)]
pub enum Stage {
    /// No device, for this reason.
    Closed(String),
    /// It is being greeted.
    Opening,
    /// It sends states and takes commands, if armed.
    Ready,
    /// It looks for its ends, deaf and dumb.
    Homing,
}

/// Whether the device has said that its motor is off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// Nobody asked.
    No,
    /// It was told, and may not have answered yet.
    Told,
    /// It holds 0.
    Confirmed,
    /// It was told and does not say so.
    Unconfirmed,
}

/// States that came, and those that did not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Received {
    /// Those that came.
    pub states: u64,
    /// Those that, by the device's own time, it sent and we did not get.
    pub lost: u64,
}

impl Received {
    /// A state came, of the device's time `at`; the one `before` it was `period` earlier, or some
    /// are missing.
    pub(super) fn count(&mut self, before: Option<Seconds>, at: Seconds, period: Seconds) {
        self.states += 1;
        let periods = before.map_or(1.0, |before| ((at - before).0 / period.0).round());
        // Of longer gaps the device knows nothing: it started anew, or its clock did.
        if (2.0..=50.0).contains(&periods) {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "2 to 50")]
            let missing = periods as u64 - 1;
            self.lost += missing;
        }
    }
}

/// Why the motor stays off.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NotArmed {
    /// No device, or one that is busy.
    #[error("the device is not ready")]
    NotReady,
    /// It does not know its ends.
    #[error("the device is not homed: home it first")]
    NotHomed,
    /// Its motor is on.
    #[error("the motor is not off yet")]
    Moving,
    /// It says no.
    #[error(transparent)]
    Device(Outcome),
    /// Its readings mean nothing yet.
    #[error(transparent)]
    Uncalibrated(#[from] Uncalibrated),
    /// Nobody would stop the motor if this program died.
    #[error("the motor's guard is not there: wait a moment, or start coadapt anew")]
    Unguarded,
    /// Something is wrong.
    #[error(transparent)]
    Fault(#[from] Fault),
}

/// That a device stopped by itself, and why.
pub(super) fn stopped_by(flags: Flags) -> Option<&'static str> {
    [
        (Flags::WATCHDOG, "its watchdog missed our commands"),
        (Flags::ESTOP, "its emergency stop is pressed"),
        (Flags::SENSOR_FAULT, "a sensor does not answer"),
    ]
    .into_iter()
    .find_map(|(flag, why)| flags.has(flag).then_some(why))
}
