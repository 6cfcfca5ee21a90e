//! What others see of a station.

use super::super::calibration;
use super::super::centre::Unrest;
use super::super::driver::{NotArmed, Stage, Stopped};
use super::super::shelf::Uncalibrated;
use crate::backend::safety::warden::Standing;
use crate::backend::wire::Counts;
use crate::signal::{Seconds, State};

/// What is known of a calibration under way.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibrating {
    /// How far it is.
    pub step: calibration::Step,
    /// How much of the step is done, 0 to 1.
    pub progress: f64,
    /// What the person is told or asked.
    pub prompt: String,
}

/// What is on.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Duty {
    /// Nothing: the motor rests.
    #[default]
    Rest,
    /// The caller drives.
    Follow,
    /// The return to the middle.
    Return {
        /// Whether all is there.
        is_there: bool,
        /// What does not come to rest.
        trouble: Option<Unrest>,
    },
    /// A calibration.
    Calibrate(Calibrating),
}

/// How the switch is held that enables the motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grip {
    /// Not at all.
    Off,
    /// Since before the motor was armed: it counts once it was let go.
    LeftOn,
    /// By a hand, or none is needed.
    On,
}

/// All that others may know of a station.
#[derive(Clone, Debug)]
pub struct Look {
    /// The device's lasting name.
    pub device: String,
    /// How far the device has come.
    pub stage: Stage,
    /// What the guard of the plant allows.
    pub standing: Standing,
    /// Whether the motor is known to be off after a stop.
    pub stopped: Stopped,
    /// Whether the ends of the track are known.
    pub is_homed: bool,
    /// Whether homing takes longer than it can.
    pub is_stuck: bool,
    /// When the device was calibrated, or why that does not count.
    pub calibrated: Result<String, Uncalibrated>,
    /// What is on.
    pub duty: Duty,
    /// How the switch is held that enables the motor.
    pub grip: Grip,
    /// Why the last wish to arm or home was refused.
    pub refused: Option<NotArmed>,
    /// The plant's state, and when it came.
    pub latest: Option<(State, Seconds)>,
    /// States so far,
    pub states: u64,
    /// and the one of them that was answered last,
    pub answered: u64,
    /// with this action.
    pub applied: f64,
    /// States that the device's own time says are missing.
    pub lost: u64,
    /// What became of the bytes.
    pub counts: Counts,
}
