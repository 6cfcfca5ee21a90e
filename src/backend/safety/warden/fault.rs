//! What stops a real plant.

use crate::backend::wire::Outcome;

/// Why the plant was stopped, and what to do about it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// A person asked for it.
    #[error("the emergency stop was pressed")]
    Stopped,
    /// A signal came, or a part of this program failed.
    #[error("this program was interrupted or failed, and stopped the motor first")]
    Interrupted,
    /// The wanted action is no number.
    #[error("the wanted action is no finite number: a fault of this program")]
    Action,
    /// A state has something in it that is no number.
    #[error("the device's state is no finite number: look at its sensors")]
    State,
    /// No state came in time.
    #[error("no state came for {0:.0} ms: look at the cable and the device's power")]
    Stale(f64),
    /// The plant is beyond the hard limit.
    #[error("the position is {0:+.3} m, beyond the hard limit: push the plant back by hand")]
    Position(f64),
    /// The angle is beyond its limit.
    #[error("the angle is {0:+.0}°, beyond its limit: set the pole up again")]
    Angle(f64),
    /// The position moved further than anything could.
    #[error("the position jumped by {0:.3} m between two states: look at the encoder")]
    PositionJump(f64),
    /// The angle moved further than anything could.
    #[error("the angle jumped by {0:.0}° between two states: look at the angle sensor")]
    AngleJump(f64),
    /// The position is exactly the same for long, though the cart is pushed.
    #[error(
        "the cart does not move though it is pushed: look at the encoder, the belt and the supply"
    )]
    PositionStuck,
    /// The angle is exactly the same, though the cart has moved far.
    #[error("the angle does not change though the cart moves: look at the angle sensor")]
    AngleStuck,
    /// The device holds another command than was sent.
    #[error("the device holds the command {held} in place of {sent}: look at its firmware")]
    Echo {
        /// What it holds.
        held: i64,
        /// What was sent.
        sent: i64,
    },
    /// Too many frames are damaged.
    #[error("{0} damaged frames within a second: look at the cable and its shielding")]
    Checksums(u32),
    /// The device started anew.
    #[error("the device was reset: calibrate it again")]
    Reset,
    /// This computer's clock jumped, as after a sleep, or this program got no time.
    #[error(
        "this program stood still for {0:.1} s: keep the computer from sleeping and from other work"
    )]
    Clock(f64),
    /// Nobody would stop the motor if this program died.
    #[error("the motor's guard is gone: start coadapt anew")]
    Unguarded,
    /// The device does not let itself be armed.
    #[error("the device refused to be armed: {0}")]
    Refused(Outcome),
    /// The device has ends to find, though the profile says that it has none.
    #[error("the device demands homing before it is armed: set backend.homing to true")]
    DemandsHoming,
    /// The device stopped by itself.
    #[error("the device stopped by itself: {0}")]
    Device(&'static str),
}
