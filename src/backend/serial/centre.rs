//! The return of a cart-pole: the cart to the middle of its track, the pole to its rest.
//!
//! A hanging pole has hardly any friction and would swing for minutes. The cart takes its swing
//! away: where the cart accelerates by a, the pole's energy ½θ̇² + ω²(1 + cos θ) changes by
//! −(3/4l)·a·θ̇·cos θ, l being half the pole and ω² = 3g/4l. A cart with the speed k·sin θ
//! accelerates by k·θ̇·cos θ, so that the energy only falls, of a swinging pole as of a spinning
//! one. Such a cart follows the bob. Its speed is kept by a force, and the delay of all that is
//! made up for by looking ahead.

use serde::{Deserialize, Serialize};

use super::Params as Device;
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
        device: &Device,
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
        // What is no number moves nothing, and what is at rest is left alone.
        let is_moved = !is_there && self.unrest != Some(Unrest::State);
        let action = if is_moved { self.action(state) } else { 0.0 };
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
        // Of states beyond all measure.
        if force.is_nan() { 0.0 } else { force.clamp(-most, most) }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::backend::emulator::faults::Faults;
    use crate::backend::emulator::{self, Emulator, rig};
    use crate::backend::safety::warden::Standing;
    use crate::backend::serial::bench::{Bench, FORMATS, LIMIT, params};
    use crate::backend::wire::Format;
    use proptest::prelude::*;

    /// An armed robot, and what it is led back with.
    struct Robot {
        bench: Bench,
        device: Device,
        period: Seconds,
        plant: cart_pole::Params,
    }

    impl Robot {
        fn new(format: Format, rig: rig::Params, period_ms: u16) -> Self {
            let mut device = params(format);
            let period = Seconds(f64::from(period_ms) * 1e-3);
            // A potentiometer's angle jumps at its gap, which is beside a hanging pole.
            device.safety.jump_deg = 180.0;
            let plant = rig.plant.clone();
            let emulated = emulator::Params { format, rig, ..emulator::Params::default() };
            let emulated = Emulator::new(&emulated, &Faults::default(), 1);
            let mut bench = Bench::of(&device, period, emulated);
            bench.home();
            bench.driver.arm(bench.now).unwrap();
            Self { bench, device, period, plant }
        }

        fn usual(format: Format) -> Self {
            Self::new(format, rig::Params::default(), 20)
        }

        fn centre(&self, pole: Pole) -> Centre {
            Centre::new(&Params::default(), pole, LIMIT, &self.plant, &self.device)
        }

        /// How long the return from `start` takes, at most `patience` s; `None` for one that is
        /// not there by then.
        fn returns(&mut self, start: [f64; 4], pole: Pole, patience: f64) -> Option<f64> {
            let mut centre = self.centre(pole);
            let bench = &mut self.bench;
            bench.driver.disarm(bench.now);
            bench.device.put(State::new(start));
            bench.go(0.2);
            bench.driver.arm(bench.now).unwrap();
            let period = self.period;
            let (since, mut there, mut farthest) = (bench.now, None, 0.0_f64);
            while there.is_none() && bench.now - since < Seconds(patience) {
                bench.steer(period.0, |driver, now| {
                    let wish = centre.see(&driver.latest()?.0, period);
                    assert!(wish.action.abs() <= 0.4 * LIMIT + 1e-12);
                    if wish.is_there && there.is_none() {
                        there = Some((now - since).0);
                    }
                    Some(wish.action)
                });
                farthest = farthest.max(bench.device.state()[0].abs());
                assert_eq!(bench.driver.standing(), Standing::Armed, "{start:?}");
            }
            assert!(farthest < 0.18, "{start:?}: {farthest}");
            there
        }

        fn comes_to_rest(&mut self, start: [f64; 4], patience: f64) {
            let took = self.returns(start, Pole::Hanging, patience);
            // The motor is off: what was taken for rest must be one.
            self.bench.wish = None;
            self.bench.go(0.3);
            let (format, state) = (self.device.format, self.bench.device.state());
            assert!(took.is_some(), "{format:?} {start:?} {state:?}");
            assert!(
                state[0].abs() < 0.025
                    && state[1].abs() < 0.005
                    && wrapped(state[2] - PI).abs() < 0.07
                    && state[3].abs() < 0.3,
                "{format:?} {start:?} {state:?}"
            );
            assert_eq!(self.bench.device.offences(), []);
        }

        fn swings_out(&mut self) {
            for degrees in [-90.0_f64, 90.0, 20.0] {
                for x in [-0.15, 0.15] {
                    self.comes_to_rest([x, 0.0, PI + degrees.to_radians(), 0.0], 15.0);
                }
            }
        }
    }

    #[test]
    fn a_swinging_pole_comes_to_rest_in_the_middle_within_15_s() {
        for format in FORMATS {
            Robot::usual(format).swings_out();
        }
    }

    #[test]
    fn a_robot_at_another_rate_with_more_friction_comes_to_rest_as_well() {
        let mut rig = rig::Params::default();
        (rig.motor.friction_forward, rig.motor.friction_backward) = (0.045, 0.05);
        for format in FORMATS {
            Robot::new(format, rig.clone(), 10).swings_out();
        }
    }

    #[test]
    fn a_short_pole_comes_to_rest_as_well() {
        let mut rig = rig::Params::default();
        (rig.plant.pole_length_m, rig.plant.pole_mass_kg) = (0.092, 0.021);
        Robot::new(Format::Cobs1, rig, 10).swings_out();
    }

    #[test]
    fn a_spinning_pole_and_one_that_stands_upright_come_to_rest_too() {
        for format in FORMATS {
            let mut robot = Robot::usual(format);
            for [x, theta, theta_dot] in
                [[0.05, 0.0, 14.0], [-0.05, 3.0, -18.0], [0.1, 0.02, 0.0], [0.0, 0.002, 0.0]]
            {
                // A pole that spins shakes its cart: together they stay where they are.
                let x_dot = -0.054 * theta_dot * f64::cos(theta);
                robot.comes_to_rest([x, x_dot, theta, theta_dot], 40.0);
            }
        }
    }

    #[test]
    fn a_pole_that_a_hand_has_is_left_to_it() {
        let mut robot = Robot::usual(Format::Cobs1);
        let took = robot.returns([0.15, 0.0, PI + 0.1, 0.0], Pole::Anywhere, 5.0);
        assert!(took.is_some());
        assert!(robot.bench.device.state()[0].abs() < 0.022);
        // Upright, and not moved by the angle.
        let mut centre = robot.centre(Pole::Anywhere);
        let leaning = State::new([0.0, 0.0, 0.3, 1.0]);
        assert_eq!(centre.see(&leaning, Seconds(0.02)).action, 0.0);
        assert!(robot.centre(Pole::Hanging).see(&leaning, Seconds(0.02)).action > 0.0);
    }

    #[test]
    fn what_does_not_come_to_rest_is_told_when_patience_ends() {
        for (state, trouble) in [
            ([0.1, 0.0, PI, 0.0], Some(Unrest::Cart)),
            ([0.0, 0.0, PI, 1.0], Some(Unrest::Pole)),
            ([0.0, 0.0, 0.0, 0.0], Some(Unrest::Pole)),
            ([0.0, 0.0, f64::NAN, 0.0], Some(Unrest::State)),
            ([0.0, 0.0, -PI, 0.0], None),
        ] {
            let (plant, device) = (rig::Params::default().plant, params(Format::Cobs1));
            let mut centre = Centre::new(&Params::default(), Pole::Hanging, LIMIT, &plant, &device);
            let mut last = None;
            for k in 0..1600 {
                let is_patient = k < 1490;
                last = Some(centre.see(&State::new(state), Seconds(0.02)));
                assert!(!is_patient || centre.trouble().is_none());
            }
            assert_eq!(centre.trouble(), trouble);
            assert_eq!(last.unwrap().is_there, trouble.is_none());
        }
    }

    #[test]
    fn the_parameters_have_ranges() {
        let mut faults = Vec::new();
        Params::default().check(&mut Checker::new(&mut faults));
        assert_eq!(faults, []);
        Params { most: 0.0, rest_deg: f64::NAN, ..Params::default() }
            .check(&mut Checker::new(&mut faults));
        assert_eq!(faults.len(), 2);
    }

    fn any_number() -> impl Strategy<Value = f64> {
        prop_oneof![any::<f64>(), -10.0..10.0_f64]
    }

    proptest! {
        #[test]
        fn whatever_the_states_no_action_is_beyond_the_most_or_pushes_further_out(
            states in prop::collection::vec(
                (any_number(), any_number(), any_number(), any_number(), any_number()), 1..40,
            ),
            hangs in any::<bool>(),
        ) {
            let (plant, device) = (rig::Params::default().plant, params(Format::Cobs1));
            let pole = if hangs { Pole::Hanging } else { Pole::Anywhere };
            let mut centre = Centre::new(&Params::default(), pole, LIMIT, &plant, &device);
            for (x, x_dot, theta, theta_dot, dt) in states {
                let state = State::new([x, x_dot, theta, theta_dot]);
                let wish = centre.see(&state, Seconds(dt));
                prop_assert!(wish.action.abs() <= 0.4 * LIMIT);
                if !state.is_finite() {
                    prop_assert_eq!(wish, Wish { action: 0.0, is_there: false });
                }
                // Outward there is only what brakes a cart that goes inward.
                if x.abs() > 0.17 && x * x_dot >= 0.0 {
                    prop_assert!(x * wish.action <= 0.0);
                }
            }
        }
    }
}
