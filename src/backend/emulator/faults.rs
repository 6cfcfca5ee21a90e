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

use rand::RngExt;
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
    /// So many bytes of rubbish come whenever a host opens the port.
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

impl Faults {
    /// Faults as they come within `time_s`, with up to `most` of each noise on either way.
    pub fn random(chance: &mut impl RngExt, most: &Noise, time_s: f64) -> Self {
        let (to_host, to_device) = (most.random(chance), most.random(chance));
        let mut events = Vec::new();
        for _ in 0..chance.random_range(0..3) {
            let what = Fault::random(chance);
            events.push(Timed { at_s: chance.random_range(0.0..time_s), what });
        }
        let garbage_at_connect = chance.random_range(0..50);
        Self { to_host, to_device, garbage_at_connect, version: None, events }
    }
}

impl Noise {
    /// Noise of which each kind is there or not, and at most as much as here.
    fn random(&self, chance: &mut impl RngExt) -> Self {
        let mut rare = |most: f64| {
            if chance.random_bool(0.3) { chance.random_range(0.0..most) } else { 0.0 }
        };
        Self {
            drop: rare(self.drop),
            duplicate: rare(self.duplicate),
            flip: rare(self.flip),
            truncate: rare(self.truncate),
            delay: rare(self.delay),
            longest_delay_s: self.longest_delay_s,
        }
    }
}

impl Fault {
    /// Any fault, short where it lasts.
    fn random(chance: &mut impl RngExt) -> Self {
        let for_s = chance.random_range(0.01..0.3);
        let sensor = if chance.random_bool(0.5) { Sensor::Angle } else { Sensor::Position };
        match chance.random_range(0..7) {
            0 => Self::Stall { for_s },
            1 => Self::Reset,
            2 => Self::Unplug { for_s },
            3 => Self::Stuck { sensor, for_s },
            4 => Self::Jump { sensor, counts: chance.random_range(-2000..2000) },
            5 => Self::Garbage { bytes: chance.random_range(1..200) },
            _ => Self::Estop { for_s },
        }
    }
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
                Fault::Jump { counts, .. } => {
                    let is_allowed = counts.unsigned_abs() <= 1_000_000;
                    c.demand(is_allowed, "events.counts", counts, "-1000000 to 1000000");
                }
                Fault::Reset => {}
            }
        }
    }
}
