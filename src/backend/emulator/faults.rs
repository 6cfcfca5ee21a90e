//! What goes wrong on purpose, from a RON file.
//!
//! ```ron
//! (
//!     to_host: (flip: 0.001, delay: 0.01, longest_delay_s: 0.05),
//!     garbage_at_connect: 40,
//!     events: [
//!         (at_s: 5.0, what: Unplug(for_s: 1.0)),
//!         (at_s: 9.0, what: Jump(sensor: position, counts: 500)),
//!     ],
//! )
//! ```

use serde::{Deserialize, Serialize};

use super::rig::Sensor;
use crate::check::{Check, Checker};

/// What goes wrong on purpose.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Faults {
    /// On the way to the host.
    pub to_host: Noise,
    /// On the way to the device.
    pub to_device: Noise,
    /// So many bytes of rubbish come whenever the device is plugged in.
    pub garbage_at_connect: u32,
    /// `sensorsini31`: states of this length, such as 17 or 27; `cobs1`: this version.
    pub version: Option<u16>,
    /// What happens at a time.
    pub events: Vec<Timed>,
}

/// What a wire does to bytes, each by its probability.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Noise {
    /// A byte is lost.
    pub drop: f64,
    /// A byte comes twice.
    pub duplicate: f64,
    /// A byte has a bit turned.
    pub flip: f64,
    /// What is sent at once is cut off somewhere.
    pub truncate: f64,
    /// What is sent at once comes late.
    pub delay: f64,
    /// At most this late, s.
    pub longest_delay_s: f64,
}

/// A fault and its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Timed {
    /// When, s since the start.
    pub at_s: f64,
    /// What.
    pub what: Fault,
}

/// Something that goes wrong.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Fault {
    /// What the device sends is held back, and then comes all at once.
    Stall {
        /// How long, s.
        for_s: f64,
    },
    /// The device starts anew.
    Reset,
    /// The cable is pulled and put back. The board keeps its supply.
    Unplug {
        /// How long, s.
        for_s: f64,
    },
    /// A sensor's reading does not change.
    Stuck {
        /// Which.
        sensor: Sensor,
        /// How long, s.
        for_s: f64,
    },
    /// A sensor's readings are off from now on.
    Jump {
        /// Which.
        sensor: Sensor,
        /// By how much.
        counts: i32,
    },
    /// Rubbish for the host.
    Garbage {
        /// How many bytes.
        bytes: u32,
    },
    /// Somebody presses the emergency stop; only `cobs1` has one.
    Estop {
        /// How long, s.
        for_s: f64,
    },
}

impl Check for Faults {
    fn check(&self, c: &mut Checker<'_>) {
        for (name, noise) in [("to_host", &self.to_host), ("to_device", &self.to_device)] {
            let mut c = c.section(name);
            for (key, probability) in [
                ("drop", noise.drop),
                ("duplicate", noise.duplicate),
                ("flip", noise.flip),
                ("truncate", noise.truncate),
                ("delay", noise.delay),
            ] {
                c.range(key, probability, 0.0..=1.0);
            }
            c.range("longest_delay_s", noise.longest_delay_s, 0.0..=10.0);
        }
        c.count("garbage_at_connect", self.garbage_at_connect, 0..=4096);
        for timed in &self.events {
            c.range("events.at_s", timed.at_s, 0.0..=1e6);
            match timed.what {
                Fault::Stall { for_s }
                | Fault::Unplug { for_s }
                | Fault::Stuck { for_s, .. }
                | Fault::Estop { for_s } => c.range("events.for_s", for_s, 0.0..=1e6),
                Fault::Garbage { bytes } => c.count("events.bytes", bytes, 0..=4096),
                Fault::Reset | Fault::Jump { .. } => {}
            }
        }
    }
}
