//! What a profile says of a real plant.

use serde::{Deserialize, Serialize};

use super::{centre, scales};
use crate::backend::emulator::rig;
use crate::backend::safety::warden;
use crate::backend::wire::{Baud, Format};
use crate::check::{Check, Checker};

/// The largest command that a state of [`Format::Sensorsini31`] can repeat, in 16 bits.
const MOST_REPEATED: u32 = 32_767;

/// A cart-pole at the end of a wire.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// What the device speaks.
    pub format: Format,
    /// Bits per second.
    pub baud: Baud,
    /// [`Format::Sensorsini31`]: the number of readings whose median is the angle.
    pub average: u16,
    /// [`Format::Cobs1`]: the device stops by itself when no command came for so long, ms; 0:
    /// five periods.
    pub watchdog_ms: u16,
    /// How long the board starts after its port was opened, s.
    pub start_s: f64,
    /// Whether it must find its ends before it may be armed.
    pub homing: bool,
    /// Whether the motor moves only while a person holds the switch of their device.
    pub hold_to_enable: bool,
    /// A calibration older than this must be done anew, days.
    pub calibration_days: f64,
    /// A test of the robot alone starts with this part of the largest action,
    pub push: f64,
    /// for so long, s.
    pub push_s: f64,
    /// A rollout that begins with the pole upright waits until it is raised to within this angle,
    /// degrees.
    pub upright_deg: f64,
    /// The return to the middle of the track.
    pub centre: centre::Params,
    /// From counts to the plant, and back.
    pub scales: scales::Params,
    /// The plant's limits.
    pub safety: warden::Params,
    /// The device that stands in for it: `coadapt emulate`.
    pub emulated: rig::Params,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            format: Format::default(),
            baud: Baud::default(),
            average: 1,
            watchdog_ms: 0,
            start_s: 0.0,
            homing: true,
            hold_to_enable: true,
            calibration_days: 7.0,
            push: 0.5,
            push_s: 0.2,
            upright_deg: 5.0,
            centre: centre::Params::default(),
            scales: scales::Params::default(),
            safety: warden::Params::default(),
            emulated: rig::Params::default(),
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        self.baud.check(c);
        c.count("average", self.average.into(), 1..=32);
        c.count("watchdog_ms", self.watchdog_ms.into(), 0..=250);
        c.range("start_s", self.start_s, 0.0..=10.0);
        c.range("calibration_days", self.calibration_days, 0.01..=3650.0);
        c.range("push", self.push, 0.0..=1.0);
        c.range("push_s", self.push_s, 0.0..=1.0);
        c.range("upright_deg", self.upright_deg, 0.5..=45.0);
        self.centre.check(&mut c.section("centre"));
        self.scales.check(&mut c.section("scales"));
        let full_scale = self.scales.motor.full_scale;
        c.demand(
            self.format != Format::Sensorsini31 || full_scale <= MOST_REPEATED,
            "scales.motor.full_scale",
            full_scale,
            "at most 32767 with sensorsini31, whose states repeat the command in 16 bits",
        );
        self.safety.check(&mut c.section("safety"));
        self.emulated.check(&mut c.section("emulated"));
    }
}
