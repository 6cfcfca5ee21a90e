//! What a device refuses, and what its driver makes of it.

use super::{Driver, NotArmed, Stage};
use crate::backend::safety::warden::{Fault, Standing};
use crate::backend::wire::Outcome;
use crate::signal::Seconds;

impl Driver {
    /// Why the device did not home, when it was asked to.
    #[must_use]
    pub fn refused(&self) -> Option<NotArmed> {
        self.refused.map(NotArmed::Device)
    }

    /// The device refuses an order.
    pub(super) fn refuse(&mut self, outcome: Outcome, now: Seconds) {
        match self.stage {
            Stage::Opening => self.close(now, &outcome.to_string()),
            Stage::Homing => {
                self.refused = Some(outcome);
                self.ready(now);
            }
            // Only what arms matters: of anything else the states tell.
            Stage::Ready if self.warden.standing() == Standing::Armed => {
                self.latch(self.not_armed(outcome), now);
            }
            Stage::Ready | Stage::Closed(_) => {}
        }
    }

    /// Why the device does not let itself be armed.
    const fn not_armed(&self, outcome: Outcome) -> Fault {
        match outcome {
            Outcome::NotHomed if !self.params.homing => Fault::DemandsHoming,
            outcome => Fault::Refused(outcome),
        }
    }
}
