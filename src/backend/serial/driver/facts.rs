//! What a driver knows of its device.

use super::{Driver, Received, Stage, Stopped};
use crate::backend::safety::warden::Standing;
use crate::backend::wire::StateFrame;
use crate::signal::{Seconds, State};

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

    /// Whether the motor is known to be off after a stop.
    #[must_use]
    pub const fn stopped(&self) -> Stopped {
        self.stopped
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
