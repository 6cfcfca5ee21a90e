//! The numbers of those who drive the mountain car where no hand is there.

use serde::{Deserialize, Serialize};

use crate::check::{Check, Checker};
use crate::operator::q_learning;
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
    /// The agent that learns to drive, in the person's place.
    pub q_learning: q_learning::Params,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            person: person::Params::default(),
            throttle: (0.8, 1.0),
            lead_s: (0.0, 0.2),
            v_noise: (0.02, 0.005),
            v_rest: (0.012, 0.002),
            pauses_per_s: (1.5, 0.2),
            pause_s: 0.3,
            q_learning: q_learning::Params::default(),
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
        self.q_learning.check(&mut c.section("q_learning"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_pass_and_every_fault_is_named() {
        let mut faults = Vec::new();
        Params::default().check(&mut Checker::new(&mut faults));
        assert_eq!(faults, []);
        let person = person::Params { delay_s: (0.2, -1.0), ..person::Params::default() };
        let wrong = Params { person, pause_s: f64::NAN, throttle: (0.5, 1.5), ..Params::default() };
        wrong.check(&mut Checker::new(&mut faults));
        let keys: Vec<&str> = faults.iter().map(|fault| &fault.key[..]).collect();
        assert_eq!(keys, ["person.delay_s", "pause_s", "throttle"]);
    }

    #[test]
    fn the_parameters_survive_ron() {
        let text = ron::to_string(&Params::default()).unwrap();
        assert_eq!(ron::from_str::<Params>(&text).unwrap(), Params::default());
        assert!(ron::from_str::<Params>("(person: (delay: 0.2))").is_err());
    }
}
