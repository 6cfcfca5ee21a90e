//! The numbers of those who drive the mountain car.

use serde::{Deserialize, Serialize};

use crate::check::{Check, Checker};
use crate::operator::simulated::{BySkill, growth, person};

/// The drivers' parameters; velocities are the problem's own, a step's. All of the task's
/// own numbers are ours.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// The person.
    pub person: person::Params,
    /// The throttle, as a part of the largest one.
    pub throttle: BySkill,
    /// How far ahead the slope lets the velocity be foreseen, s.
    pub lead_s: BySkill,
    /// Standard deviation of the error in the velocity seen.
    pub v_noise: BySkill,
    /// Velocities up to this one look like rest: the throttle stays as it is.
    pub v_rest: BySkill,
    /// How often the throttle is let go, 1/s.
    pub pauses_per_s: BySkill,
    /// For how long it is, s.
    pub pause_s: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            person: person::Params::default(),
            throttle: (0.8, 1.0),
            lead_s: (0.0, 0.25),
            v_noise: (0.01, 0.004),
            v_rest: (0.006, 0.002),
            pauses_per_s: (0.5, 0.1),
            pause_s: 0.3,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        self.person.check(&mut c.section("person"));
        c.range("pause_s", self.pause_s, 0.0..=10.0);
        let pairs = [
            ("throttle", self.throttle, 0.0..=1.0),
            ("lead_s", self.lead_s, 0.0..=2.0),
            ("v_noise", self.v_noise, 0.0..=1.0),
            ("v_rest", self.v_rest, 0.0..=1.0),
            ("pauses_per_s", self.pauses_per_s, 0.0..=100.0),
        ];
        growth::check_pairs(c, pairs);
    }
}
