//! The ball and beam: a servo tilts a beam on which a ball rolls.
//!
//! Thesis eq. 24–25: θ(s)/V(s) = K/(s(τs + 1)) and X(s)/θ(s) = `K_bb`/s², with the numbers
//! of the Quanser unit that the thesis names. θ is the servo's angle; the lever makes of it
//! the much smaller angle of the beam. A positive θ rolls the ball towards positive x.

use std::ops::RangeInclusive;

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::Plant;
use crate::check::{Check, Checker};
use crate::signal::{Action, Seconds, State};

/// The ball and beam's parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// K of eq. 24: the servo's final angular velocity per volt, rad/(V·s).
    pub servo_gain_rad_s_v: f64,
    /// τ of eq. 24: how fast the servo reaches it, s.
    pub servo_time_constant_s: f64,
    /// `K_bb` of eq. 25: the ball's acceleration per angle of the servo, m/s² per rad.
    pub ball_gain_m_s2_rad: f64,
    /// The servo stops at ± this angle, rad.
    pub servo_limit_rad: f64,
    /// The beam's angle when the servo is at its limit, degrees. It is for the eye only:
    /// the ball's acceleration follows the servo's angle.
    pub beam_limit_deg: f64,
    /// The ball stops at ± this distance from the beam's middle, m.
    pub beam_half_length_m: f64,
    /// The largest voltage, V.
    pub voltage_limit_v: f64,
    /// Integration steps within one control step.
    pub substeps: u32,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            servo_gain_rad_s_v: 1.53,
            servo_time_constant_s: 0.0248,
            ball_gain_m_s2_rad: 0.418,
            servo_limit_rad: 1.46,
            beam_limit_deg: 5.0,
            beam_half_length_m: 0.2125,
            voltage_limit_v: 10.0,
            substeps: 10,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        const GAIN: RangeInclusive<f64> = 1e-3..=100.0;
        c.range("servo_gain_rad_s_v", self.servo_gain_rad_s_v, GAIN);
        c.range("servo_time_constant_s", self.servo_time_constant_s, 1e-4..=10.0);
        c.range("ball_gain_m_s2_rad", self.ball_gain_m_s2_rad, GAIN);
        c.range("servo_limit_rad", self.servo_limit_rad, 0.01..=3.1);
        c.range("beam_limit_deg", self.beam_limit_deg, 0.1..=45.0);
        c.range("beam_half_length_m", self.beam_half_length_m, 0.01..=10.0);
        c.range("voltage_limit_v", self.voltage_limit_v, 0.01..=1000.0);
        c.count("substeps", self.substeps, 1..=1000);
    }
}

impl Params {
    /// The beam's angle when the servo is at `theta`, rad.
    #[must_use]
    pub fn beam_angle(&self, theta: f64) -> f64 {
        theta * self.beam_limit_deg.to_radians() / self.servo_limit_rad
    }
}

/// The ball and beam as a [`Plant`]; the state is `[x, ẋ, θ, θ̇]`.
///
/// A control step of 20 ms is about as long as the servo's time constant, so that stepping
/// the servo's lag by its slope would err by tens of percent. The voltage is constant within
/// a control step, and then the lag has an exact solution, which is used. The ball follows
/// in sub-steps, velocity first and then position with the new velocity as in the cart-pole;
/// they also find when the servo's limit or the beam's end is reached.
#[derive(Clone, Debug)]
pub struct BallBeam {
    params: Params,
    /// The length of a sub-step, s.
    h: f64,
    /// What a sub-step leaves of the servo's distance to its final velocity.
    kept: f64,
}

impl BallBeam {
    /// The names of the state's numbers.
    pub const COLUMNS: [&'static str; 4] = ["x", "x_dot", "theta", "theta_dot"];

    /// A ball and beam that moves `tick` per control step.
    #[must_use]
    pub fn new(params: Params, tick: Seconds) -> Self {
        let h = tick.0 / f64::from(params.substeps);
        let kept = (-h / params.servo_time_constant_s).exp();
        Self { params, h, kept }
    }
}

impl Plant for BallBeam {
    fn columns(&self) -> &'static [&'static str] {
        &Self::COLUMNS
    }

    fn step(&mut self, state: &State, action: Action) -> State {
        let &[mut x, mut x_dot, mut theta, mut theta_dot] = &state[..] else { return *state };
        let p = &self.params;
        let final_velocity = p.servo_gain_rad_s_v * action.0;
        for _ in 0..p.substeps {
            let behind = theta_dot - final_velocity;
            theta_dot = final_velocity + behind * self.kept;
            theta += final_velocity * self.h + p.servo_time_constant_s * behind * (1.0 - self.kept);
            stop_at(p.servo_limit_rad, &mut theta, &mut theta_dot);
            x_dot += self.h * p.ball_gain_m_s2_rad * theta;
            x += self.h * x_dot;
            stop_at(p.beam_half_length_m, &mut x, &mut x_dot);
        }
        State::new([x, x_dot, theta, theta_dot])
    }

    /// Nothing: the ball and beam has no noise.
    fn reseed(&mut self, _noise: ChaCha8Rng) {}
}

/// Holds a position within ± `limit`; what runs into the limit stops there.
fn stop_at(limit: f64, position: &mut f64, velocity: &mut f64) {
    if position.abs() > limit {
        *position = position.clamp(-limit, limit);
        if *velocity * *position > 0.0 {
            *velocity = 0.0;
        }
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
        let wrong = Params { servo_time_constant_s: 0.0, substeps: 0, ..Params::default() };
        wrong.check(&mut Checker::new(&mut faults));
        let keys: Vec<&str> = faults.iter().map(|fault| &fault.key[..]).collect();
        assert_eq!(keys, ["servo_time_constant_s", "substeps"]);
    }

    #[test]
    fn the_servo_at_its_limit_tilts_the_beam_by_five_degrees() {
        let params = Params::default();
        assert!((params.beam_angle(1.46).to_degrees() - 5.0).abs() < 1e-12);
        assert!((params.beam_angle(-0.73).to_degrees() + 2.5).abs() < 1e-12);
    }
}
