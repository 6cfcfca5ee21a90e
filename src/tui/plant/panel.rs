//! What the plant's page remembers, and what its keys wish for.

use crate::backend::safety::warden::Standing;
use crate::backend::serial::calibration::Step;
use crate::backend::serial::standing::Stage;
use crate::backend::serial::station::{Calibrating, Duty, Look, Wish};
use crate::tui::keys::Action;

/// The page's own state.
#[derive(Clone, Debug, PartialEq, Eq)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "four facts that have nothing to do with another"
)]
pub struct Panel {
    is_open: bool,
    asks_home: bool,
    was_latched: bool,
    was_gone: bool,
}

impl Default for Panel {
    /// A page that is open: a session at a real plant begins with it.
    fn default() -> Self {
        Self { is_open: true, asks_home: false, was_latched: false, was_gone: false }
    }
}

impl Panel {
    /// Whether it is shown.
    #[must_use]
    pub const fn is_open(&self) -> bool {
        self.is_open
    }

    /// Whether a person is asked if the device may home.
    #[must_use]
    pub const fn asks_home(&self) -> bool {
        self.asks_home
    }

    /// Opens it by itself where a fault latches or the device goes.
    pub fn see(&mut self, look: &Look) {
        let is_latched = matches!(look.standing, Standing::Latched(_));
        let is_gone = matches!(look.stage, Stage::Closed(_));
        self.is_open |= is_latched && !self.was_latched || is_gone && !self.was_gone;
        (self.was_latched, self.was_gone) = (is_latched, is_gone);
        self.asks_home &= may_home(look);
    }

    /// What a key wishes for, in this order.
    pub fn key(&mut self, action: Action, look: &Look) -> Vec<Wish> {
        let asked = std::mem::take(&mut self.asks_home);
        match (action, under_way(look)) {
            (Action::Plant, _) => {
                self.is_open = !self.is_open;
                Vec::new()
            }
            (Action::Arm, _) if look.standing == Standing::Armed => vec![Wish::Disarm],
            // One that has failed must not keep the motor from what follows it.
            (Action::Arm, Some(Calibrating { step: Step::Failed, .. })) => {
                vec![Wish::Disarm, Wish::Arm]
            }
            (Action::Arm, _) => vec![Wish::Arm],
            (Action::Home, _) => {
                self.asks_home = may_home(look);
                Vec::new()
            }
            (Action::Calibrate, None | Some(Calibrating { step: Step::Failed, .. })) => {
                vec![Wish::Calibrate]
            }
            (Action::Yes, _) if asked => vec![Wish::Home],
            (Action::No, _) if asked => Vec::new(),
            (Action::Yes, Some(on)) if on.step.asks() => vec![Wish::Yes],
            (Action::No, Some(on)) if on.step.asks() => vec![Wish::No],
            (Action::Clear, _) if matches!(look.standing, Standing::Latched(_)) => {
                vec![Wish::Clear]
            }
            (Action::Clear, Some(Calibrating { step: Step::Failed, .. })) => vec![Wish::Disarm],
            (Action::Clear, Some(_)) => vec![Wish::Cancel],
            _ => Vec::new(),
        }
    }
}

/// The calibration that is on.
const fn under_way(look: &Look) -> Option<&Calibrating> {
    match &look.duty {
        Duty::Calibrate(calibrating) => Some(calibrating),
        _ => None,
    }
}

/// Whether a person may be asked for homing: the device would begin it.
fn may_home(look: &Look) -> bool {
    look.stage == Stage::Ready && look.standing == Standing::Disarmed && under_way(look).is_none()
}
