//! What a driver knows of its device.

use super::{Driver, Received, Stage, Stopped};
use crate::backend::safety::warden::Standing;
use crate::backend::wire::StateFrame;
use crate::signal::{Seconds, State};

/// Within this time a burst of stops is enough.
const BURST: Seconds = Seconds(0.005);
/// How long homing may take.
const HOMING: Seconds = Seconds(30.0);

impl Driver {
    /// How far the device has come.
    #[must_use]
    pub const fn stage(&self) -> &Stage {
        &self.stage
    }

    /// What the guard allows.
    #[must_use]
    pub const fn standing(&self) -> Standing {
        self.warden.standing()
    }

    /// Whether the ends of the track are known.
    #[must_use]
    pub const fn is_homed(&self) -> bool {
        self.is_homed
    }

    /// Whether the motor is known to be off after a stop. Nobody can stop that of a device that
    /// is gone or was not greeted yet: it is off if it was before, as far as is known.
    #[must_use]
    pub const fn stopped(&self) -> Stopped {
        match (&self.stage, self.stopped) {
            (Stage::Closed(_) | Stage::Opening, _) if self.may_move => Stopped::Unconfirmed,
            (Stage::Closed(_), Stopped::Told | Stopped::Unconfirmed) => Stopped::Confirmed,
            (_, stopped) => stopped,
        }
    }

    /// Whether a burst of stops is the last word, and enough.
    pub(super) fn has_just_stopped(&self, now: Seconds) -> bool {
        self.burst.is_some_and(|at| now - at < BURST)
    }

    /// Whether the device homes for longer than any track is long: its cart may be stuck, and
    /// the motor pushes on.
    #[must_use]
    pub fn is_stuck(&self, now: Seconds) -> bool {
        self.stage == Stage::Homing && now - self.since > HOMING
    }

    /// The latest state, and when it came.
    #[must_use]
    pub fn latest(&self) -> Option<(State, Seconds)> {
        self.warden.latest().map(|seen| (seen.state, seen.at))
    }

    /// The latest state as it was on the wire, in counts: what a calibration looks at.
    #[must_use]
    pub const fn frame(&self) -> Option<&StateFrame> {
        self.frame.as_ref()
    }

    /// The states that came, and those that did not, of this and earlier connections.
    #[must_use]
    pub const fn received(&self) -> Received {
        self.received
    }
}
