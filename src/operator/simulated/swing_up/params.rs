//! The numbers of those who swing the pole up.

use serde::{Deserialize, Serialize};

use crate::check::{Check, Checker};
use crate::operator::simulated::law::Numbers;
use crate::operator::simulated::{BySkill, growth, person};

/// The swingers' parameters. The law at the top is set for a pole of 0.6 m, by search (ours).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// The person.
    pub person: person::Params,
    /// The force of a full push while pumping, N.
    pub pump_force_n: BySkill,
    /// How far ahead the swing's rhythm is anticipated while pumping, s; below 0 it is not.
    pub pump_lead_s: BySkill,
    /// Pushes fade as the pole's energy nears that of rest at the top: within this distance,
    /// in parts of the energy from the middle height to the top.
    pub energy_band: f64,
    /// Force that keeps the cart near the track's middle while pumping, N/m.
    pub pump_x_gain_n_m: f64,
    /// The same per velocity of the cart, N·s/m.
    pub pump_x_dot_gain_n_s_m: f64,
    /// The pole is balanced within ± this angle, degrees,
    pub catch_deg: BySkill,
    /// and below this angular velocity, degrees/s.
    pub catch_deg_s: BySkill,
    /// Standard deviation of the error in the angle seen, degrees.
    pub theta_noise_deg: BySkill,
    /// Standard deviation of the error in the angular velocity seen, degrees/s.
    pub theta_dot_noise_deg_s: BySkill,
    /// Angles up to this one look upright, degrees.
    pub dead_zone_deg: BySkill,
    /// Force per angle at the top, N/rad.
    pub theta_gain_n_rad: BySkill,
    /// Force per angular velocity at the top, N·s/rad.
    pub theta_dot_gain_n_s_rad: BySkill,
    /// Force per distance from the track's middle at the top, N/m.
    pub x_gain_n_m: BySkill,
    /// Force per velocity of the cart at the top, N·s/m.
    pub x_dot_gain_n_s_m: BySkill,
    /// Standard deviation of the logarithm of the personal factor on `theta_gain_n_rad`.
    pub theta_gain_trait_sd: f64,
    /// How much of what happened since the state was seen, own pushes included, the operator
    /// foresees with a model in the head; a `predictor` all of it, 1.
    pub foresight: BySkill,
    /// The pole's length in this model, as a factor on the true one.
    pub model_length_factor: f64,
    /// `predictor`: factor on what it misperceives of the angle and its velocity.
    pub model_noise_factor: BySkill,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            person: person::Params::default(),
            pump_force_n: (1.5, 5.0),
            pump_lead_s: (-0.08, 0.25),
            energy_band: 0.3,
            pump_x_gain_n_m: 4.0,
            pump_x_dot_gain_n_s_m: 1.0,
            catch_deg: (15.0, 35.0),
            catch_deg_s: (250.0, 250.0),
            theta_noise_deg: (2.0, 0.6),
            theta_dot_noise_deg_s: (20.0, 6.0),
            dead_zone_deg: (2.0, 1.0),
            theta_gain_n_rad: (18.0, 16.0),
            theta_dot_gain_n_s_rad: (2.0, 3.7),
            x_gain_n_m: (0.0, 1.2),
            x_dot_gain_n_s_m: (0.0, 0.8),
            theta_gain_trait_sd: 0.1,
            foresight: (0.0, 0.33),
            model_length_factor: 1.2,
            model_noise_factor: (3.0, 8.0),
        }
    }
}

impl Params {
    /// The part of the law at the top.
    pub(super) const fn law(&self) -> Numbers {
        Numbers {
            theta_noise_deg: self.theta_noise_deg,
            theta_dot_noise_deg_s: self.theta_dot_noise_deg_s,
            dead_zone_deg: self.dead_zone_deg,
            theta_gain_n_rad: self.theta_gain_n_rad,
            theta_dot_gain_n_s_rad: self.theta_dot_gain_n_s_rad,
            x_gain_n_m: self.x_gain_n_m,
            x_dot_gain_n_s_m: self.x_dot_gain_n_s_m,
            model_noise_factor: self.model_noise_factor,
            theta_gain_trait_sd: self.theta_gain_trait_sd,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        self.person.check(&mut c.section("person"));
        c.range("energy_band", self.energy_band, 0.01..=10.0);
        c.range("pump_x_gain_n_m", self.pump_x_gain_n_m, -1000.0..=1000.0);
        c.range("pump_x_dot_gain_n_s_m", self.pump_x_dot_gain_n_s_m, -1000.0..=1000.0);
        c.range("theta_gain_trait_sd", self.theta_gain_trait_sd, 0.0..=1.0);
        c.range("model_length_factor", self.model_length_factor, 0.1..=10.0);
        let pairs = [
            ("foresight", self.foresight, 0.0..=1.0),
            ("pump_force_n", self.pump_force_n, 0.0..=1000.0),
            ("pump_lead_s", self.pump_lead_s, -1.0..=1.0),
            ("catch_deg", self.catch_deg, 0.0..=90.0),
            ("catch_deg_s", self.catch_deg_s, 0.0..=3600.0),
            ("theta_noise_deg", self.theta_noise_deg, 0.0..=45.0),
            ("theta_dot_noise_deg_s", self.theta_dot_noise_deg_s, 0.0..=360.0),
            ("dead_zone_deg", self.dead_zone_deg, 0.0..=45.0),
            ("theta_gain_n_rad", self.theta_gain_n_rad, -1000.0..=1000.0),
            ("theta_dot_gain_n_s_rad", self.theta_dot_gain_n_s_rad, -1000.0..=1000.0),
            ("x_gain_n_m", self.x_gain_n_m, -1000.0..=1000.0),
            ("x_dot_gain_n_s_m", self.x_dot_gain_n_s_m, -1000.0..=1000.0),
            ("model_noise_factor", self.model_noise_factor, 0.0..=100.0),
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
        let wrong =
            Params { person, energy_band: 0.0, catch_deg: (10.0, 91.0), ..Params::default() };
        wrong.check(&mut Checker::new(&mut faults));
        let keys: Vec<&str> = faults.iter().map(|fault| &fault.key[..]).collect();
        assert_eq!(keys, ["person.delay_s", "energy_band", "catch_deg"]);
    }

    #[test]
    fn the_parameters_survive_ron() {
        let text = ron::to_string(&Params::default()).unwrap();
        assert_eq!(ron::from_str::<Params>(&text).unwrap(), Params::default());
        assert!(ron::from_str::<Params>("(person: (delay: 0.2))").is_err());
    }
}
