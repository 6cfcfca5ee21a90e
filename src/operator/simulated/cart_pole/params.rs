//! The numbers of the cart-pole's balancers.

use serde::{Deserialize, Serialize};

use crate::check::{Check, Checker};
use crate::operator::simulated::growth::{self, Growth};
use crate::operator::simulated::law::Numbers;
use crate::operator::simulated::person::{Character, Span};
use crate::operator::simulated::{BySkill, NaiveAverageExpert, Skill};

/// The balancers' parameters: a person at a cart-pole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// Skill before the first rollout.
    pub skill_first: NaiveAverageExpert,
    /// Skill after endless practice.
    pub skill_last: NaiveAverageExpert,
    /// Standard deviation of `skill_last` over operators.
    pub skill_last_sd: NaiveAverageExpert,
    /// Factor on the spread of all personal traits.
    pub trait_spread: NaiveAverageExpert,
    /// Rollouts in which the distance to the last skill shrinks to 1/e.
    pub practice_rollouts: f64,
    /// How old the state is that the operator acts on, s.
    pub delay_s: BySkill,
    /// Standard deviation of the delay over operators, s.
    pub delay_sd_s: f64,
    /// Standard deviation of the error in the angle seen, degrees.
    pub theta_noise_deg: BySkill,
    /// Standard deviation of the error in the angular velocity seen, degrees/s.
    pub theta_dot_noise_deg_s: BySkill,
    /// Correlation time of both errors and of `motor_noise_n`, s.
    pub noise_correlation_s: f64,
    /// Angles up to this one look upright, degrees.
    pub dead_zone_deg: BySkill,
    /// Force per angle, N/rad.
    pub theta_gain_n_rad: BySkill,
    /// Force per angular velocity, N·s/rad.
    pub theta_dot_gain_n_s_rad: BySkill,
    /// Force per distance from the track's middle, N/m.
    pub x_gain_n_m: BySkill,
    /// Force per velocity of the cart, N·s/m.
    pub x_dot_gain_n_s_m: BySkill,
    /// Standard deviation of the logarithm of the personal factor on each gain, noise and
    /// dead zone.
    pub trait_sd: f64,
    /// The same for the factor on `theta_gain_n_rad`.
    pub theta_gain_trait_sd: f64,
    /// Time constant of the hand, s.
    pub lag_s: f64,
    /// White motor noise before the lag, as a fraction of the wanted force.
    pub motor_noise_fraction: BySkill,
    /// Wandering motor noise, N.
    pub motor_noise_n: BySkill,
    /// `intermittent`: a decision is held for a time drawn between these, s.
    pub decision_hold_s: (f64, f64),
    /// `bang-bang`: the force of a push, N.
    pub bang_force_n: f64,
    /// `bang-bang`: wanted forces up to this one are no push, N.
    pub bang_threshold_n: f64,
    /// `predictor`: the pole's length in the operator's head, as a factor on the true one.
    pub model_length_factor: f64,
    /// `predictor`: factor on what it misperceives of the angle and its velocity.
    pub model_noise_factor: BySkill,
    /// `mouse-limited`: time constant with which a sustained force fades, s.
    pub travel_s: f64,
    /// `lapses`: how often a push goes the wrong way, 1/s.
    pub lapses_per_s: BySkill,
    /// `lapses`: how long it does, s.
    pub lapse_s: f64,
}

impl Params {
    /// The law's part.
    pub(in crate::operator::simulated) const fn law(&self) -> Numbers {
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

    /// The numbers of a person with `skill` whose force is limited.
    pub(in crate::operator::simulated) fn character(&self, skill: Skill, limit: f64) -> Character {
        Character {
            growth: Growth {
                skill_first: skill.of(self.skill_first),
                skill_last: skill.of(self.skill_last),
                skill_last_sd: skill.of(self.skill_last_sd),
                trait_spread: skill.of(self.trait_spread),
            },
            span: Span::Rollouts(self.practice_rollouts),
            delay_s: self.delay_s,
            delay_sd_s: self.delay_sd_s,
            trait_sd: self.trait_sd,
            noise_correlation_s: self.noise_correlation_s,
            lag_s: self.lag_s,
            motor_noise_fraction: self.motor_noise_fraction,
            motor_noise: self.motor_noise_n,
            decision_hold_s: self.decision_hold_s,
            bang: self.bang_force_n,
            bang_threshold: self.bang_threshold_n,
            travel_s: self.travel_s,
            lapses_per_s: self.lapses_per_s,
            lapse_s: self.lapse_s,
            limit,
        }
    }
}

impl Default for Params {
    fn default() -> Self {
        Self {
            skill_first: (0.05, 0.4, 1.2),
            skill_last: (0.7, 0.9, 1.2),
            skill_last_sd: (0.1, 0.1, 0.0),
            trait_spread: (1.0, 1.0, 0.5),
            practice_rollouts: 40.0,
            delay_s: (0.22, 0.18),
            delay_sd_s: 0.015,
            theta_noise_deg: (0.6, 0.4),
            theta_dot_noise_deg_s: (8.0, 5.0),
            noise_correlation_s: 0.15,
            dead_zone_deg: (2.0, 1.0),
            theta_gain_n_rad: (14.0, 11.5),
            theta_dot_gain_n_s_rad: (2.5, 6.0),
            x_gain_n_m: (0.0, 1.6),
            x_dot_gain_n_s_m: (0.0, 0.5),
            trait_sd: 0.2,
            theta_gain_trait_sd: 0.1,
            lag_s: 0.1,
            motor_noise_fraction: (0.5, 0.25),
            motor_noise_n: (1.0, 0.5),
            decision_hold_s: (0.2, 0.3),
            bang_force_n: 3.0,
            bang_threshold_n: 0.6,
            model_length_factor: 1.5,
            model_noise_factor: (4.0, 4.0),
            travel_s: 1.0,
            lapses_per_s: (1.0, 0.5),
            lapse_s: 0.2,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        growth::check(
            c,
            [self.skill_first, self.skill_last, self.skill_last_sd, self.trait_spread],
        );
        c.range("practice_rollouts", self.practice_rollouts, 0.1..=10_000.0);
        c.range("delay_sd_s", self.delay_sd_s, 0.0..=0.2);
        c.range("noise_correlation_s", self.noise_correlation_s, 0.0..=10.0);
        c.range("trait_sd", self.trait_sd, 0.0..=1.0);
        c.range("theta_gain_trait_sd", self.theta_gain_trait_sd, 0.0..=1.0);
        c.range("lag_s", self.lag_s, 0.0..=2.0);
        c.range("bang_force_n", self.bang_force_n, 0.0..=1000.0);
        c.range("bang_threshold_n", self.bang_threshold_n, 0.0..=1000.0);
        c.range("model_length_factor", self.model_length_factor, 0.1..=10.0);
        c.range("travel_s", self.travel_s, 0.01..=100.0);
        c.range("lapse_s", self.lapse_s, 0.0..=10.0);
        let pairs = [
            ("delay_s", self.delay_s, 0.0..=1.0),
            ("theta_noise_deg", self.theta_noise_deg, 0.0..=45.0),
            ("theta_dot_noise_deg_s", self.theta_dot_noise_deg_s, 0.0..=360.0),
            ("dead_zone_deg", self.dead_zone_deg, 0.0..=45.0),
            ("theta_gain_n_rad", self.theta_gain_n_rad, -1000.0..=1000.0),
            ("theta_dot_gain_n_s_rad", self.theta_dot_gain_n_s_rad, -1000.0..=1000.0),
            ("x_gain_n_m", self.x_gain_n_m, -1000.0..=1000.0),
            ("x_dot_gain_n_s_m", self.x_dot_gain_n_s_m, -1000.0..=1000.0),
            ("motor_noise_fraction", self.motor_noise_fraction, 0.0..=5.0),
            ("motor_noise_n", self.motor_noise_n, 0.0..=1000.0),
            ("model_noise_factor", self.model_noise_factor, 0.0..=100.0),
            ("lapses_per_s", self.lapses_per_s, 0.0..=100.0),
        ];
        growth::check_pairs(c, pairs);
        growth::check_hold(c, self.decision_hold_s);
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
        let wrong = Params {
            skill_first: (9.0, 0.4, 1.2),
            lag_s: f64::NAN,
            delay_s: (0.2, -1.0),
            ..Params::default()
        };
        wrong.check(&mut Checker::new(&mut faults));
        let keys: Vec<&str> = faults.iter().map(|fault| &fault.key[..]).collect();
        assert_eq!(keys, ["skill_first", "lag_s", "delay_s"]);
    }

    #[test]
    fn the_parameters_survive_ron() {
        let text = ron::to_string(&Params::default()).unwrap();
        assert_eq!(ron::from_str::<Params>(&text).unwrap(), Params::default());
    }
}
