//! The return of a cart-pole: the cart to the middle of its track, the pole to its rest.
//!
//! A hanging pole has hardly any friction and would swing for minutes. The cart takes its swing
//! away: where the cart accelerates by a, the pole's energy ½θ̇² + ω²(1 + cos θ) changes by
//! −(3/4l)·a·θ̇·cos θ, l being half the pole and ω² = 3g/4l. A cart with the speed k·sin θ
//! accelerates by k·θ̇·cos θ, so that the energy only falls, of a swinging pole as of a spinning
//! one. Such a cart follows the bob. Its speed is kept by a force, and the delay of all that is
//! made up for by looking ahead.

use serde::{Deserialize, Serialize};

use super::driver;
use crate::check::{Check, Checker};
use crate::plant::cart_pole;
use crate::signal::{Seconds, State, wrapped};

/// The cart goes no faster than this by itself, m/s.
const SLOW: f64 = 0.2;
/// From this part of the soft limit on, the cart is only led inward.
const REACH: f64 = 0.7;
/// The swing of a hanging pole is damped by this part of what would be critical.
const DAMPING: f64 = 0.35;
/// How far the pole is looked ahead: the line's delay, and the cart's until it has its speed.
const AHEAD: Seconds = Seconds(0.1);
/// The cart takes on a speed in about this time.
const SERVO: Seconds = Seconds(0.08);
/// A cart that should go at this speed is helped over all of its friction, m/s.
const CREEP: f64 = 0.02;
/// Velocities are judged over this time: those of counts are rough.
const SMOOTH: Seconds = Seconds(0.1);
/// A cart at rest is slower than this, m/s.
const STANDING: f64 = 0.02;
/// All must be at rest for so long.
const REST: Seconds = Seconds(0.5);

/// The return's parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// The part of the largest action that is never exceeded.
    pub most: f64,
    /// The cart is in the middle within this distance of it, m.
    pub centre_m: f64,
    /// The pole hangs at rest within this angle, degrees,
    pub rest_deg: f64,
    /// and below this speed, degrees per second.
    pub rest_deg_s: f64,
    /// After this time without rest a person is told, s.
    pub patience_s: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self { most: 0.4, centre_m: 0.02, rest_deg: 3.0, rest_deg_s: 8.6, patience_s: 30.0 }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.range("most", self.most, 0.05..=1.0);
        c.range("centre_m", self.centre_m, 0.001..=1.0);
        c.range("rest_deg", self.rest_deg, 0.5..=45.0);
        c.range("rest_deg_s", self.rest_deg_s, 1.0..=180.0);
        c.range("patience_s", self.patience_s, 1.0..=600.0);
    }
}

/// Where the pole must be for the return to be over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pole {
    /// At rest, hanging.
    #[default]
    Hanging,
    /// A person's hand has it: the cart does nothing about it.
    Anywhere,
}

/// What the return wants until the next state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wish {
    /// The action, in the plant's unit.
    pub action: f64,
    /// Whether all is where it should be.
    pub is_there: bool,
}

/// What does not come to rest, and what to do about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unrest {
    /// The cart is not in the middle.
    #[error("the cart does not come to rest in the middle: does it run freely, is it armed?")]
    Cart,
    /// The pole moves.
    #[error("the pole does not come to rest: steady it by hand")]
    Pole,
    /// The states are none.
    #[error("the device's state is no finite number: look at its sensors")]
    State,
}

/// A return under way.
#[derive(Clone, Debug)]
pub struct Centre {
    params: Params,
    pole: Pole,
    /// The largest action, N.
    limit: f64,
    /// From here on the cart is only led inward, m.
    reach: f64,
    /// The cart's speed for a pole that hangs level, m/s: k.
    follow: f64,
    /// The force for a missing speed, N·s/m.
    servo: f64,
    /// The force that starts a standing cart, N.
    friction: f64,
    /// ẋ and θ̇, smoothed.
    velocities: Option<[f64; 2]>,
    rests: Seconds,
    unrest: Option<Unrest>,
    waited: Seconds,
}

impl Centre {
    /// The return of `plant` with actions up to ± `limit` N, at the end of a device's wire.
    #[must_use]
    pub fn new(
        params: &Params,
        pole: Pole,
        limit: f64,
        plant: &cart_pole::Params,
        device: &driver::Params,
    ) -> Self {
        let gravity = plant.gravity_m_s2.max(0.1);
        let omega = (0.75 * gravity / (plant.pole_length_m / 2.0)).sqrt();
        let motor = &device.scales.motor;
        Self {
            params: params.clone(),
            pole,
            limit,
            reach: REACH * device.safety.soft_limit_m,
            follow: 2.0 * DAMPING * gravity / omega,
            servo: (plant.cart_mass_kg + plant.pole_mass_kg) / SERVO.0,
            // The driver makes up for the friction of the motion before: to turn around takes
            // that of both directions.
            friction: (motor.friction_forward + motor.friction_backward) / motor.gain * limit,
            velocities: None,
            rests: Seconds(0.0),
            unrest: None,
            waited: Seconds(0.0),
        }
    }

    /// The plant is in `state`, `dt` after the one before.
    pub fn see(&mut self, state: &State, dt: Seconds) -> Wish {
        let dt = Seconds(if dt.0 > 0.0 { dt.0.min(1.0) } else { 0.0 });
        self.waited = self.waited + dt;
        self.unrest = self.judge(state, dt);
        self.rests = if self.unrest.is_none() { self.rests + dt } else { Seconds(0.0) };
        let is_there = self.rests >= REST;
        let action = if is_there { 0.0 } else { self.action(state) };
        Wish { action, is_there }
    }

    /// What is not where it should be, once that has lasted too long.
    #[must_use]
    pub fn trouble(&self) -> Option<Unrest> {
        self.unrest.filter(|_| self.waited.0 > self.params.patience_s)
    }

    /// What moves, or is in the wrong place.
    fn judge(&mut self, state: &State, dt: Seconds) -> Option<Unrest> {
        let &[x, x_dot, theta, theta_dot] = &state[..] else { return Some(Unrest::State) };
        if !state.is_finite() {
            self.velocities = None;
            return Some(Unrest::State);
        }
        let share = 1.0 - (-dt.0 / SMOOTH.0).exp();
        let before = self.velocities.unwrap_or([x_dot, theta_dot]);
        let smooth = |before: f64, now: f64| before + share * (now - before);
        let [x_dot, theta_dot] = [smooth(before[0], x_dot), smooth(before[1], theta_dot)];
        self.velocities = Some([x_dot, theta_dot]);
        let is_centred = x.abs() < self.params.centre_m && x_dot.abs() < STANDING;
        let hangs = wrapped(theta - std::f64::consts::PI).to_degrees().abs();
        let is_still =
            hangs < self.params.rest_deg && theta_dot.to_degrees().abs() < self.params.rest_deg_s;
        match self.pole {
            _ if !is_centred => Some(Unrest::Cart),
            Pole::Hanging if !is_still => Some(Unrest::Pole),
            _ => None,
        }
    }

    /// The force that gives the cart its speed: towards the middle, and after the bob.
    fn action(&self, state: &State) -> f64 {
        let &[x, x_dot, theta, theta_dot] = &state[..] else { return 0.0 };
        let after_bob = match self.pole {
            Pole::Hanging => self.follow * (theta + AHEAD.0 * theta_dot).sin(),
            Pole::Anywhere => 0.0,
        };
        let speed = after_bob.clamp(-SLOW, SLOW) - SLOW * x / self.reach;
        let push = self.friction * (speed / CREEP).clamp(-1.0, 1.0);
        let force = self.servo * (speed - x_dot) + push;
        let most = self.params.most * self.limit;
        // What is no number moves nothing.
        if force.is_finite() { force.clamp(-most, most) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::backend::emulator::rig;
    use crate::backend::safety::warden::Standing;
    use crate::backend::serial::bench::{Bench, FORMATS, LIMIT, params};
    use crate::backend::wire::Format;
    use proptest::prelude::*;

    fn centre(pole: Pole, format: Format) -> Centre {
        let plant = rig::Params::default().plant;
        Centre::new(&Params::default(), pole, LIMIT, &plant, &params(format))
    }

    /// How long the return of an armed robot takes from a state, at most `patience` s; `None`
    /// for one that is not there by then.
    fn returns(bench: &mut Bench, centre: &mut Centre, patience: f64) -> Option<f64> {
        let (since, mut there, mut farthest) = (bench.now, None, 0.0_f64);
        while there.is_none() && bench.now - since < Seconds(patience) {
            bench.steer(0.02, |driver, now| {
                let wish = centre.see(&driver.latest()?.0, Seconds(0.02));
                assert!(wish.action.abs() <= 0.4 * LIMIT + 1e-12);
                if wish.is_there && there.is_none() {
                    there = Some((now - since).0);
                }
                Some(wish.action)
            });
            farthest = farthest.max(bench.device.state()[0].abs());
            assert_eq!(bench.driver.standing(), Standing::Armed);
        }
        assert!(farthest < 0.18, "{farthest}");
        there
    }

    fn put(bench: &mut Bench, state: [f64; 4]) {
        bench.driver.disarm(bench.now);
        bench.device.put(State::new(state));
        bench.go(0.2);
        bench.driver.arm(bench.now).unwrap();
    }

    fn is_at_rest(state: &State) -> bool {
        state[0].abs() < 0.021
            && state[1].abs() < 0.03
            && wrapped(state[2] - PI).abs() < 0.06
            && state[3].abs() < 0.18
    }

    #[test]
    fn a_swinging_pole_comes_to_rest_in_the_middle_within_15_s() {
        for format in FORMATS {
            let mut bench = Bench::armed(format);
            for degrees in [-90.0_f64, 90.0, 20.0] {
                for x in [-0.15, 0.15] {
                    put(&mut bench, [x, 0.0, PI + degrees.to_radians(), 0.0]);
                    let mut centre = centre(Pole::Hanging, format);
                    let took = returns(&mut bench, &mut centre, 15.0);
                    eprintln!("{format:?} {degrees} {x} {took:?}");
                    let state = bench.device.state();
                    assert!(took.is_some(), "{format:?} {degrees} {x} {state:?}");
                    assert!(is_at_rest(&state), "{format:?} {degrees} {x} {state:?}");
                }
            }
        }
    }

    #[test]
    fn a_spinning_pole_and_one_that_stands_upright_come_to_rest_too() {
        for format in FORMATS {
            let mut bench = Bench::armed(format);
            for [x, theta, theta_dot] in
                [[0.05, 0.0, 14.0], [-0.05, 3.0, -18.0], [0.1, 0.02, 0.0], [0.0, 0.0, 0.0]]
            {
                // A pole that spins shakes its cart: together they stay where they are.
                let x_dot = -0.054 * theta_dot * f64::cos(theta);
                put(&mut bench, [x, x_dot, theta, theta_dot]);
                let mut centre = centre(Pole::Hanging, format);
                let took = returns(&mut bench, &mut centre, 60.0);
                eprintln!("{format:?} {x} {theta} {theta_dot} {took:?}");
                let state = bench.device.state();
                assert!(took.is_some(), "{format:?} {theta} {theta_dot} {state:?}");
                assert!(is_at_rest(&state), "{format:?} {theta} {theta_dot} {state:?}");
            }
        }
    }
}
