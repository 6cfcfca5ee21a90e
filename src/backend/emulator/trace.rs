//! What an emulated device received and did.

use serde::Serialize;

use super::oracle::Offence;
use crate::backend::wire::cobs1;
use crate::backend::wire::sensorsini31::frames::Request;
use crate::signal::Seconds;

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entry {
    /// When, s since the start.
    pub at_s: f64,
    /// What.
    #[serde(flatten)]
    pub event: Event,
}

/// What can happen.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "what", rename_all = "snake_case")]
pub enum Event {
    /// The host wrote this; whether it arrives is another matter.
    Written {
        /// What it says.
        order: Written,
    },
    /// The device obeyed this, which need not be what was written.
    Obeyed {
        /// What it took it for.
        order: Written,
    },
    /// The last byte of a message reached the host's end of the wire.
    Delivered {
        /// Which kind.
        message: Kind,
    },
    /// The motor's command changed.
    Motor {
        /// The command, the device's unit.
        command: i32,
        /// The share of full duty.
        duty: f64,
    },
    /// The device looks for its ends.
    HomingBegan,
    /// It has found them, or has given up.
    HomingEnded {
        /// Whether it found them.
        found: bool,
    },
    /// The device follows commands from now on.
    Armed,
    /// The device follows commands no more.
    Disarmed,
    /// Commands stayed away for too long.
    Watchdog,
    /// The firmware has destroyed its memory: no state any more, and the motor goes on.
    Crashed {
        /// By what.
        by: &'static str,
    },
    /// The device has started.
    Started,
    /// A fault of the fault file.
    Fault {
        /// Which.
        fault: super::faults::Fault,
    },
    /// A person's hand is at the plant.
    Hand {
        /// What it does.
        hand: super::hand::Hand,
    },
    /// The host did what it must never do.
    Forbidden {
        /// What.
        offence: Offence,
    },
}

/// Something that the host wrote.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Written {
    /// To the physical-cartpole firmware.
    Sensorsini31(Request),
    /// To a `cobs1` device.
    Cobs1(cobs1::frames::Request),
    /// A whole frame that no device obeys.
    Unknown {
        /// Its command or type byte.
        code: u8,
    },
}

/// The kinds of what a device sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A state.
    State,
    /// The end of homing, or of a measurement: the device hears again.
    Over,
    /// An answer.
    Reply,
}

/// What happened so far, oldest first.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    entries: Vec<Entry>,
    judged: usize,
    now: Seconds,
}

impl Trace {
    /// What is noted from now on happens at `now`.
    pub const fn at(&mut self, now: Seconds) {
        self.now = now;
    }

    /// Notes that something happened.
    pub fn note(&mut self, event: Event) {
        // Whole microseconds: the sums of steps have no more digits that mean anything.
        self.entries.push(Entry { at_s: (self.now.0 * 1e6).round() / 1e6, event });
    }

    /// The oldest entry that was not handed out by this yet.
    pub(super) fn next_to_judge(&mut self) -> Option<Entry> {
        let entry = self.entries.get(self.judged)?.clone();
        self.judged += 1;
        Some(entry)
    }

    /// What happened since this was last asked.
    pub fn take(&mut self) -> Vec<Entry> {
        self.judged = 0;
        std::mem::take(&mut self.entries)
    }
}
