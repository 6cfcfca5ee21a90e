//! The law by which people balance a pole on a cart: late, blurred and linear.
//!
//! Delayed proportional–derivative feedback with a dead zone is the usual model of people
//! who balance a stick (Milton et al. 2009). The values are the parameters' (see
//! [`cart_pole::Params`](super::cart_pole::Params) and
//! [`swing_up::Params`](super::swing_up::Params)).

use rand_chacha::ChaCha8Rng;

use super::BySkill;
use super::filters::Wander;
use super::person::{Factors, at, at_least_0};
use crate::signal::Seconds;

/// The law's numbers by skill, with units as in the parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Numbers {
    pub(super) theta_noise_deg: BySkill,
    pub(super) theta_dot_noise_deg_s: BySkill,
    pub(super) dead_zone_deg: BySkill,
    pub(super) theta_gain_n_rad: BySkill,
    pub(super) theta_dot_gain_n_s_rad: BySkill,
    pub(super) x_gain_n_m: BySkill,
    pub(super) x_dot_gain_n_s_m: BySkill,
    /// `predictor`: factor on both noises.
    pub(super) model_noise_factor: BySkill,
    pub(super) theta_gain_trait_sd: f64,
}

/// One person's law and sight.
#[derive(Clone, Debug)]
pub(super) struct Law {
    numbers: Numbers,
    factors: Personal,
    is_predictor: bool,
    theta_error: Wander,
    theta_dot_error: Wander,
    theta_noise: f64,
    theta_dot_noise: f64,
    dead_zone: f64,
    gains: [f64; 4],
}

/// A person's factors on the common values.
#[derive(Clone, Copy, Debug)]
struct Personal {
    theta_gain: f64,
    theta_dot_gain: f64,
    x_gain: f64,
    x_dot_gain: f64,
    theta_noise: f64,
    theta_dot_noise: f64,
    dead_zone: f64,
}

impl Law {
    /// The law of a person with the given factors; errors in what is seen have the
    /// correlation time `correlation_s`.
    pub(super) fn draw(
        numbers: Numbers,
        is_predictor: bool,
        correlation_s: f64,
        tick: Seconds,
        factors: &mut Factors,
    ) -> Self {
        Self {
            numbers,
            factors: Personal {
                theta_gain: factors.with(numbers.theta_gain_trait_sd),
                theta_dot_gain: factors.next(),
                x_gain: factors.next(),
                x_dot_gain: factors.next(),
                theta_noise: factors.next(),
                theta_dot_noise: factors.next(),
                dead_zone: factors.next(),
            },
            is_predictor,
            theta_error: Wander::still(correlation_s, tick),
            theta_dot_error: Wander::still(correlation_s, tick),
            theta_noise: 0.0,
            theta_dot_noise: 0.0,
            dead_zone: 0.0,
            gains: [0.0; 4],
        }
    }

    pub(super) fn begin(&mut self, rng: &mut ChaCha8Rng) {
        self.theta_error.restart(rng);
        self.theta_dot_error.restart(rng);
    }

    /// All that it remembers.
    pub(super) fn numbers(&mut self) -> Vec<&mut f64> {
        vec![self.theta_error.number(), self.theta_dot_error.number()]
    }

    pub(super) fn renew(&mut self, skill: f64) {
        let (n, own) = (&self.numbers, &self.factors);
        let blur = if self.is_predictor { at_least_0(n.model_noise_factor, skill) } else { 1.0 };
        self.theta_noise =
            blur * own.theta_noise * at_least_0(n.theta_noise_deg, skill).to_radians();
        self.theta_dot_noise =
            blur * own.theta_dot_noise * at_least_0(n.theta_dot_noise_deg_s, skill).to_radians();
        self.dead_zone = own.dead_zone * at_least_0(n.dead_zone_deg, skill).to_radians();
        self.gains = [
            own.x_gain * at(n.x_gain_n_m, skill),
            own.x_dot_gain * at(n.x_dot_gain_n_s_m, skill),
            own.theta_gain * at(n.theta_gain_n_rad, skill),
            own.theta_dot_gain * at(n.theta_dot_gain_n_s_rad, skill),
        ];
    }

    /// The state as it is seen: the pole's angle and velocity with wandering errors.
    pub(super) fn see(&mut self, mut state: [f64; 4], rng: &mut ChaCha8Rng) -> [f64; 4] {
        state[2] += self.theta_noise * self.theta_error.next(rng);
        state[3] += self.theta_dot_noise * self.theta_dot_error.next(rng);
        state
    }

    /// The force that the law asks for, N.
    pub(super) fn force(&self, [x, x_dot, theta, theta_dot]: [f64; 4]) -> f64 {
        let [x_gain, x_dot_gain, theta_gain, theta_dot_gain] = self.gains;
        let tilt = theta - theta.clamp(-self.dead_zone, self.dead_zone);
        theta_gain * tilt + theta_dot_gain * theta_dot + x_gain * x + x_dot_gain * x_dot
    }
}
