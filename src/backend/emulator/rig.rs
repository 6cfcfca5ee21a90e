//! The cart-pole at the device's pins: a motor driver, an angle sensor and an encoder.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::hand::{Hand, Hold};
use crate::check::{Check, Checker};
use crate::plant::Plant;
use crate::plant::cart_pole::{self, CartPole};
use crate::random::{Place, Purpose, stream};
use crate::signal::{Action, Seconds, State};

/// The plant moves in steps of this.
const STEP: Seconds = Seconds(0.001);
/// Slower than this a cart stands, and friction holds it, m/s.
const STANDSTILL: f64 = 0.002;
/// The switches close this far before the ends of the track, m.
const SWITCH: f64 = 0.002;

/// How a command becomes a force.
///
/// The inverse of the correction in the robot's driver: a duty d moves the cart like the
/// friction-free action Q = (d − friction in the direction of motion) / gain, and Q = 1 is
/// `force_n`, less what the speed takes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Motor {
    /// The command for full duty.
    pub full_scale: i32,
    /// The force at Q = 1, N.
    pub force_n: f64,
    /// The duty per Q.
    pub gain: f64,
    /// The duty that friction takes when the cart moves forward.
    pub friction_forward: f64,
    /// The same, backward.
    pub friction_backward: f64,
    /// What the belt and the motor take from a moving cart, N·s/m.
    pub viscous_n_s_per_m: f64,
    /// From the command at the pins to the force, s.
    pub delay_s: f64,
}

impl Default for Motor {
    fn default() -> Self {
        Self {
            full_scale: 7200,
            force_n: 1.77,
            gain: 0.595228,
            friction_forward: 0.0323188,
            friction_backward: 0.0385016,
            viscous_n_s_per_m: 3.22,
            delay_s: 0.0,
        }
    }
}

impl Motor {
    /// The force of `command` on a cart that moves with `speed`, N.
    fn force(&self, command: i32, speed: f64) -> f64 {
        let duty = self.duty(command).clamp(-1.0, 1.0);
        let way = if speed.abs() > STANDSTILL { speed } else { duty };
        let friction = if way > 0.0 { self.friction_forward } else { -self.friction_backward };
        let is_held = speed.abs() <= STANDSTILL && duty.abs() <= friction.abs();
        let driven = if is_held { 0.0 } else { self.force_n * (duty - friction) / self.gain };
        driven - self.viscous_n_s_per_m * speed
    }

    /// The share of full duty, more than 1 for what no motor driver can do.
    #[must_use]
    pub fn duty(&self, command: i32) -> f64 {
        f64::from(command) / f64::from(self.full_scale)
    }
}

/// How the pole's angle becomes a reading.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Angle {
    /// Counts of a full turn.
    pub counts_per_turn: f64,
    /// The reading of the pole that hangs at rest.
    pub hanging: f64,
    /// The largest reading: a potentiometer reads it all through its gap.
    pub largest: i32,
    /// −1 where the reading falls while the plant's angle grows.
    pub sign: i32,
}

impl Default for Angle {
    fn default() -> Self {
        Self { counts_per_turn: 4271.34, hanging: 1028.579, largest: 4095, sign: -1 }
    }
}

impl Angle {
    /// The reading for the plant's angle θ, rad, 0 upright.
    fn reading(&self, theta: f64) -> i32 {
        let from_hanging = f64::from(self.sign) * theta / TAU + 0.5;
        let counts =
            (self.hanging + from_hanging * self.counts_per_turn).rem_euclid(self.counts_per_turn);
        #[expect(clippy::cast_possible_truncation, reason = "0 to the counts of a turn")]
        let counts = counts as i32;
        counts.min(self.largest)
    }
}

/// The rig's parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// The cart-pole.
    pub plant: cart_pole::Params,
    /// Where it stands at the start: x, ẋ, θ, θ̇ in SI units, θ = 0 upright.
    pub start: [f64; 4],
    /// The motor and its driver.
    pub motor: Motor,
    /// The angle sensor.
    pub angle: Angle,
    /// The encoder's count, m; negative where it counts down as the cart goes forward.
    pub m_per_count: f64,
}

impl Default for Params {
    /// The physical-cartpole robot with the STM32 board, the Pololu motor and the long pole:
    /// the protocol notes, and the `cartpole_physical_parameters.yml` of github
    /// `SensorsINI/CartPoleSimulation` at `6d8b1f8`. The pivot's friction, 5e-5 N·m·s/rad, is
    /// divided by the pole's inertia about it; the cart's is the motor's.
    fn default() -> Self {
        Self {
            plant: cart_pole::Params {
                pole_length_m: 0.395,
                pole_mass_kg: 0.087,
                cart_mass_kg: 0.23,
                gravity_m_s2: 9.81,
                pole_friction_per_s: 0.011,
                cart_friction_per_s: 0.0,
                friction_noise_per_s: 0.0,
                track_length_m: Some(0.396),
                bounce: 0.0,
                force_limit_n: 3.0,
                substeps: 2,
                ..cart_pole::Params::default()
            },
            start: [0.05, 0.0, std::f64::consts::PI, 0.0],
            motor: Motor::default(),
            angle: Angle::default(),
            m_per_count: 9.5101e-5,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        self.plant.check(&mut c.section("plant"));
        let finite = self.start.iter().all(|value| value.is_finite());
        c.demand(finite, "start", format!("{:?}", self.start), "four finite numbers");
        c.demand(
            self.m_per_count.is_normal() && self.m_per_count.abs() < 0.1,
            "m_per_count",
            self.m_per_count,
            "not 0, and less than 0.1",
        );
        let mut motor = c.section("motor");
        let Motor {
            full_scale,
            force_n,
            gain,
            friction_forward,
            friction_backward,
            viscous_n_s_per_m,
            delay_s,
        } = self.motor;
        motor.demand((1..=1_000_000).contains(&full_scale), "full_scale", full_scale, "1 to 1e6");
        motor.range("force_n", force_n, 0.01..=1000.0);
        motor.range("gain", gain, 0.01..=10.0);
        motor.range("friction_forward", friction_forward, 0.0..=0.5);
        motor.range("friction_backward", friction_backward, 0.0..=0.5);
        motor.range("viscous_n_s_per_m", viscous_n_s_per_m, 0.0..=100.0);
        motor.range("delay_s", delay_s, 0.0..=0.5);
        let mut angle = c.section("angle");
        angle.range("counts_per_turn", self.angle.counts_per_turn, 100.0..=30_000.0);
        angle.range("hanging", self.angle.hanging, 0.0..=self.angle.counts_per_turn);
        let most = 1_000_000;
        angle.demand(
            (1..=most).contains(&self.angle.largest),
            "largest",
            self.angle.largest,
            "1 to 1e6",
        );
        angle.demand(self.angle.sign.abs() == 1, "sign", self.angle.sign, "-1 or 1");
    }
}

/// The rig under way.
pub struct Rig {
    hand: Hold,
    params: Params,
    plant: CartPole,
    state: State,
    now: Seconds,
    command: i32,
    /// Commands on their way to the motor, and when they get there.
    coming: VecDeque<(Seconds, i32)>,
    /// A reading that does not change until a time.
    stuck: [Option<(Seconds, i32)>; 2],
    /// What is added to the true readings.
    jumped: [i32; 2],
    /// The emergency stop is pressed until then.
    estop_until: Seconds,
}

/// A sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// The pole's angle.
    Angle,
    /// The cart's position.
    Position,
}

impl Rig {
    /// A rig at its start; `seed` is for the noise of its friction.
    #[must_use]
    pub fn new(params: &Params, seed: u64) -> Self {
        let mut plant = CartPole::new(params.plant.clone(), STEP);
        plant.reseed(stream(seed, Purpose::Friction, Place::default()));
        Self {
            hand: Hold::default(),
            plant,
            state: State::new(params.start),
            params: params.clone(),
            now: Seconds(0.0),
            command: 0,
            coming: VecDeque::new(),
            stuck: [None; 2],
            jumped: [0; 2],
            estop_until: Seconds(0.0),
        }
    }

    /// The command for full duty.
    #[must_use]
    pub const fn full_scale(&self) -> i32 {
        self.params.motor.full_scale
    }

    /// The plant's true state.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }

    /// Somebody moves the plant by hand to `state`.
    #[cfg(test)]
    pub(super) fn put(&mut self, state: State) {
        self.state = state;
    }

    /// A hand does something to the plant. False where it cannot: nobody moves the cart against
    /// a motor that is on.
    pub fn handle(&mut self, hand: Hand) -> bool {
        if matches!(hand, Hand::Push { .. }) && self.is_driven() {
            return false;
        }
        self.hand.take(hand);
        true
    }

    /// Whether the motor is on, or is about to be.
    fn is_driven(&self) -> bool {
        self.command != 0 || self.coming.iter().any(|(_, command)| *command != 0)
    }

    /// Puts `command` on the motor's pins from now on.
    pub fn drive(&mut self, command: i32) {
        self.coming.push_back((self.now + Seconds(self.params.motor.delay_s), command));
    }

    /// Lets time pass.
    pub fn go(&mut self, to: Seconds) {
        while self.now + STEP <= to {
            while let Some((_, command)) = self.coming.pop_front_if(|(due, _)| *due <= self.now) {
                self.command = command;
            }
            let force = self.params.motor.force(self.command, self.state[1]);
            self.state = self.plant.step(&self.state, Action(force));
            let reach = self.params.plant.track_length_m.map_or(f64::INFINITY, |m| m / 2.0);
            let is_driven = self.is_driven();
            self.state = self.hand.guide(self.state, self.now, reach, is_driven);
            self.now = self.now + STEP;
        }
    }

    /// A sensor's reading, counts: the angle as the sensor gives it, the position from the
    /// middle of the track.
    #[must_use]
    pub fn read(&self, sensor: Sensor) -> i32 {
        match self.stuck[sensor as usize] {
            Some((until, reading)) if self.now < until => reading,
            _ => self.truth(sensor).saturating_add(self.jumped[sensor as usize]),
        }
    }

    fn truth(&self, sensor: Sensor) -> i32 {
        #[expect(clippy::cast_possible_truncation, reason = "a track has fewer counts")]
        match sensor {
            Sensor::Angle => self.params.angle.reading(self.state[2]),
            Sensor::Position => (self.state[0] / self.params.m_per_count).floor() as i32,
        }
    }

    /// A sensor's reading stays as it is for some time.
    pub fn stick(&mut self, sensor: Sensor, time: Seconds) {
        self.stuck[sensor as usize] = Some((self.now + time, self.read(sensor)));
    }

    /// A sensor's readings are off by `counts` from now on.
    pub const fn jump(&mut self, sensor: Sensor, counts: i32) {
        self.jumped[sensor as usize] = self.jumped[sensor as usize].saturating_add(counts);
    }

    /// Somebody presses the emergency stop for some time.
    pub fn press(&mut self, time: Seconds) {
        self.estop_until = self.now + time;
    }

    /// Whether the emergency stop is pressed.
    #[must_use]
    pub fn is_pressed(&self) -> bool {
        self.now < self.estop_until
    }

    /// Whether the switches at the negative and the positive end are closed.
    #[must_use]
    pub fn switches(&self) -> (bool, bool) {
        let end = self.params.plant.track_length_m.map_or(f64::INFINITY, |m| m / 2.0 - SWITCH);
        (self.state[0] <= -end, self.state[0] >= end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The speed that a rig reaches with `duty`, m/s.
    fn speed(duty: f64) -> f64 {
        let mut params =
            Params { start: [0.0, 0.0, std::f64::consts::PI, 0.0], ..Params::default() };
        params.plant.track_length_m = None;
        let mut rig = Rig::new(&params, 1);
        #[expect(clippy::cast_possible_truncation, reason = "a duty")]
        rig.drive((duty * 7200.0) as i32);
        rig.go(Seconds(20.0));
        rig.state()[1]
    }

    #[test]
    fn a_duty_moves_the_cart_like_the_robots_correction_says() {
        // Q = 1 saturates at 0.55 m/s, and its duty is gain + friction.
        assert!((speed(0.595228 + 0.0323188) - 0.55).abs() < 0.02, "{}", speed(0.6275));
        assert!((speed(-0.595228 - 0.0385016) + 0.55).abs() < 0.02);
        assert!(speed(0.03).abs() < 1e-3, "{}", speed(0.03));
        assert!(speed(0.06) > 0.01);
    }

    #[test]
    fn the_angle_is_read_with_its_gap() {
        let angle = Angle::default();
        assert_eq!(angle.reading(std::f64::consts::PI), 1028);
        assert_eq!(angle.reading(0.0), 3164);
        let readings: Vec<i32> =
            (0..10_000).map(|k| angle.reading(f64::from(k) / 10_000.0 * TAU)).collect();
        let in_gap = readings.iter().filter(|reading| **reading == 4095).count();
        // 176 counts of 4271.
        assert!((390..440).contains(&in_gap), "{in_gap}");
        assert!(readings.iter().all(|reading| (0..=4095).contains(reading)));
    }

    #[test]
    fn a_hanging_pole_swings_at_the_robots_frequency() {
        let mut params = Params { start: [0.0, 0.0, 3.0, 0.0], ..Params::default() };
        params.plant.cart_mass_kg = 100.0;
        let mut rig = Rig::new(&params, 1);
        let mut crossings = Vec::new();
        for k in 1..5000 {
            let before = rig.state()[3];
            rig.go(Seconds(f64::from(k) * 0.001 + 1e-9));
            if before > 0.0 && rig.state()[3] <= 0.0 {
                crossings.push(f64::from(k) * 0.001);
            }
        }
        let period = crossings[1] - crossings[0];
        assert!((TAU / period - 6.10).abs() < 0.05, "{}", TAU / period);
    }
}
