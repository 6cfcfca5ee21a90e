//! What the learner is given of a tick: which action is the target.

use serde::{Deserialize, Serialize};

use crate::check::{Check, Checker};
use crate::signal::{Features, Intent};

/// Which action is the learner's target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// What the person did, u_h: the thesis's.
    #[default]
    Human,
    /// What the plant received, u.
    Executed,
}

impl Target {
    /// The column of a session's rows that holds it.
    #[must_use]
    pub const fn column(self) -> &'static str {
        match self {
            Self::Human => "u_human",
            Self::Executed => "u_applied",
        }
    }
}

/// The parameters of teaching.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// Which action is the learner's target.
    pub target: Target,
}

impl Check for Params {
    fn check(&self, _checker: &mut Checker<'_>) {}
}

/// One sample for the learner: at `x` do `y`, weighing `weight`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lesson {
    /// The features of the state that the action belongs to.
    pub x: Features,
    /// The action to be learned.
    pub y: f64,
    /// How much the sample counts; 1 is the thesis's.
    pub weight: f64,
}

/// The lesson of a tick, or none when the operator was absent.
#[must_use]
pub fn lesson(params: &Params, x: Features, human: Intent, applied: f64) -> Option<Lesson> {
    let Intent::Present { action, .. } = human else { return None };
    let y = match params.target {
        Target::Human => action.0,
        Target::Executed => applied,
    };
    Some(Lesson { x, y, weight: 1.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_idle_hand_teaches_zero_and_an_absent_one_nothing() {
        let x = Features::new([0.1, 0.2]);
        let thesis = Params::default();
        let idle = lesson(&thesis, x, Intent::fresh(0.0), 3.0).unwrap();
        assert_eq!((idle.y, idle.weight), (0.0, 1.0));
        assert_eq!(lesson(&thesis, x, Intent::Absent, 3.0), None);
        let executed = Params { target: Target::Executed };
        assert_eq!(lesson(&executed, x, Intent::fresh(0.0), 3.0).unwrap().y, 3.0);
    }
}
