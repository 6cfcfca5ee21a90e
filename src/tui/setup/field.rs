//! The fields of the form, in the order in which Tab visits them.

use super::edit::sensitivity_key;
use super::{Setup, Shelf};
use crate::operator::{Choice, Device};
use crate::profile::Experiment;
use crate::session::plan::Wanted;

/// A field of the form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// The task's tab.
    Task,
    /// The profile.
    Profile,
    /// What the robot does while it learns.
    Mode,
    /// What learns.
    Learner,
    /// Practice, and its rollouts.
    Introduction,
    /// Teaching, and its rollouts or its duration.
    Main,
    /// The robot alone, and its starts.
    Autonomous,
    /// Who.
    Subject,
    /// The trial's number.
    Trial,
    /// Who or what steers.
    Operator,
    /// How well a simulated operator steers.
    Skill,
    /// The habit with which it does.
    Kind,
    /// The file that steers.
    Script,
    /// The factor on the device's deflection.
    Sensitivity,
    /// The pole's length.
    Pole,
    /// Whether success and share are shown.
    Progress,
    /// Whether nothing but the scene is shown.
    SubjectView,
    /// The policy of an autonomous run.
    Policy,
    /// Where all chance comes from.
    Seed,
    /// The session that was cut off.
    Unfinished,
}

impl Field {
    /// All fields, in the order of the screen.
    pub const ALL: [Self; 20] = [
        Self::Task,
        Self::Profile,
        Self::Mode,
        Self::Learner,
        Self::Introduction,
        Self::Main,
        Self::Autonomous,
        Self::Subject,
        Self::Trial,
        Self::Operator,
        Self::Skill,
        Self::Kind,
        Self::Script,
        Self::Sensitivity,
        Self::Pole,
        Self::Progress,
        Self::SubjectView,
        Self::Policy,
        Self::Seed,
        Self::Unfinished,
    ];

    /// The phase whose field this is.
    pub(super) const fn phase(self) -> Option<Wanted> {
        match self {
            Self::Introduction => Some(Wanted::Introduction),
            Self::Main => Some(Wanted::Main),
            Self::Autonomous => Some(Wanted::Autonomous),
            _ => None,
        }
    }

    /// Whether a text is typed into it.
    pub(super) const fn is_text(self) -> bool {
        self.phase().is_some()
            || self.is_line()
            || matches!(self, Self::Trial | Self::Pole | Self::Policy)
    }

    /// Whether ← and → move within its text, since there is no more and less.
    pub(super) const fn is_line(self) -> bool {
        matches!(self, Self::Subject | Self::Script | Self::Seed)
    }

    /// The field of the profile's `key`.
    pub(super) fn of_key(key: &str) -> Option<Self> {
        match key {
            "task" => Some(Self::Task),
            "mode" => Some(Self::Mode),
            "learner.kind" => Some(Self::Learner),
            "session.phases"
            | "session.introduction_rollouts"
            | "session.introduction_duration_s" => Some(Self::Introduction),
            "session.main_rollouts" | "session.main_duration_s" => Some(Self::Main),
            "session.autonomous_rollouts" => Some(Self::Autonomous),
            super::edit::POLE_LENGTH => Some(Self::Pole),
            key if Device::ALL.map(sensitivity_key).iter().any(|known| known == key) => {
                Some(Self::Sensitivity)
            }
            _ => None,
        }
    }
}

impl Setup {
    /// Whether `field` is on the screen now and can be changed.
    pub(super) fn has(&self, field: Field, shelf: &Shelf) -> bool {
        match field {
            Field::Task => Experiment::NAMES.len() > 1,
            Field::Skill | Field::Kind => matches!(self.operator(), Choice::Simulated(..)),
            Field::Script => matches!(self.operator(), Choice::Script(_)),
            Field::Pole => super::edit::pole_length(&self.profile).is_some(),
            Field::Policy => self.is_autonomous_alone(),
            Field::Unfinished => !shelf.unfinished.is_empty(),
            _ => true,
        }
    }

    /// Moves to the next field, or to the one before.
    pub(super) fn step(&mut self, forward: bool, shelf: &Shelf) {
        let fields = Field::ALL.into_iter().filter(|field| self.has(*field, shelf));
        let fields: Vec<Field> = fields.collect();
        let here = fields.iter().position(|field| *field == self.focus).unwrap_or(0);
        let by = if forward { 1 } else { fields.len().saturating_sub(1) };
        if let Some(next) = fields.get((here + by) % fields.len().max(1)) {
            self.go_to(*next);
        }
    }

    /// Moves to `field`; what is typed there replaces its text.
    pub(super) fn go_to(&mut self, field: Field) {
        self.focus = field;
        self.typing = field.is_text();
        self.drafts.fresh = true;
    }
}
