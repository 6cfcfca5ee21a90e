//! The numbers of those who roll the ball.

use serde::{Deserialize, Serialize};

use crate::check::{Check, Checker};
use crate::operator::simulated::{BySkill, growth, person};

/// The rollers' parameters. All of the task's own numbers are ours, set by search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// The person.
    pub person: person::Params,
    /// The servo's angle for a full swing, rad.
    pub swing_rad: BySkill,
    /// Where the ball will be is judged this far ahead of where it is seen, s.
    pub look_ahead_s: BySkill,
    /// Standard deviation of the logarithm of the personal factor on `look_ahead_s`.
    pub look_ahead_trait_sd: f64,
    /// The swing is full when the ball will be this far from the middle, m.
    pub reach_m: f64,
    /// A ball slower than this is pushed along its way, m/s.
    pub slow_m_s: BySkill,
    /// Voltage per angle between the wanted and the felt angle of the servo, V/rad.
    pub servo_gain_v_rad: BySkill,
    /// Standard deviation of the error in the position seen, m.
    pub x_noise_m: BySkill,
    /// Standard deviation of the error in the velocity seen, m/s.
    pub x_dot_noise_m_s: BySkill,
    /// `predictor`: the ball's acceleration in the head, as a factor on the true one.
    pub model_gain_factor: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            person: person::Params::default(),
            swing_rad: (0.6, 1.2),
            look_ahead_s: (0.58, 0.52),
            look_ahead_trait_sd: 0.05,
            reach_m: 0.04,
            slow_m_s: (0.02, 0.08),
            servo_gain_v_rad: (4.0, 5.0),
            x_noise_m: (0.015, 0.003),
            x_dot_noise_m_s: (0.06, 0.015),
            model_gain_factor: 0.7,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        self.person.check(&mut c.section("person"));
        c.range("look_ahead_trait_sd", self.look_ahead_trait_sd, 0.0..=1.0);
        c.range("reach_m", self.reach_m, 0.001..=10.0);
        c.range("model_gain_factor", self.model_gain_factor, 0.0..=10.0);
        let pairs = [
            ("swing_rad", self.swing_rad, 0.0..=3.1),
            ("look_ahead_s", self.look_ahead_s, 0.0..=2.0),
            ("slow_m_s", self.slow_m_s, 0.0..=10.0),
            ("servo_gain_v_rad", self.servo_gain_v_rad, 0.0..=100.0),
            ("x_noise_m", self.x_noise_m, 0.0..=1.0),
            ("x_dot_noise_m_s", self.x_dot_noise_m_s, 0.0..=10.0),
        ];
        growth::check_pairs(c, pairs);
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
        let wrong = Params { person, reach_m: -1.0, swing_rad: (0.5, 4.0), ..Params::default() };
        wrong.check(&mut Checker::new(&mut faults));
        let keys: Vec<&str> = faults.iter().map(|fault| &fault.key[..]).collect();
        assert_eq!(keys, ["person.delay_s", "reach_m", "swing_rad"]);
    }

    #[test]
    fn the_parameters_survive_ron() {
        let text = ron::to_string(&Params::default()).unwrap();
        assert_eq!(ron::from_str::<Params>(&text).unwrap(), Params::default());
        assert!(ron::from_str::<Params>("(person: (delay: 0.2))").is_err());
    }
}
