//! From a device's counts to the plant's state, and from an action to the motor's command.

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

use crate::backend::wire::StateFrame;
use crate::check::{Check, Checker};
use crate::signal::{Seconds, State, wrapped};

/// How a cart-pole's counts are read and its motor is driven.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// The pole's angle.
    pub angle: Angle,
    /// The cart's position.
    pub position: Position,
    /// The velocities, which no device tells.
    pub velocity: Velocity,
    /// The motor.
    pub motor: Motor,
}

/// The angle sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Angle {
    /// Counts of a full turn.
    pub counts_per_turn: f64,
    /// The reading of the pole that hangs at rest, counts.
    pub hanging: f64,
    /// Where the pole stands upright, away from half a turn from there, degrees.
    pub upright_deg: f64,
    /// Whether the reading falls while the angle grows.
    pub invert: bool,
}

impl Default for Angle {
    fn default() -> Self {
        Self { counts_per_turn: 4271.34, hanging: 1028.579, upright_deg: 0.0, invert: false }
    }
}

/// The position sensor, whose zero is the track's middle after homing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Position {
    /// The way of a count, m.
    pub m_per_count: f64,
    /// Whether the reading falls while the position grows.
    pub invert: bool,
}

impl Default for Position {
    fn default() -> Self {
        Self { m_per_count: 9.5101e-5, invert: false }
    }
}

/// How velocities are found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Velocity {
    /// Differences are smoothed by a first-order filter of this cut-off, Hz.
    pub cutoff_hz: f64,
}

impl Default for Velocity {
    fn default() -> Self {
        Self { cutoff_hz: 20.0 }
    }
}

/// How an action becomes a command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Motor {
    /// The command that drives the motor fully.
    pub full_scale: u32,
    /// The part of it that is never exceeded.
    pub most: f64,
    /// The part of it that the largest action is, without friction.
    pub gain: f64,
    /// What is added while the cart moves forward, to make up for its friction,
    pub friction_forward: f64,
    /// and taken away while it moves backward.
    pub friction_backward: f64,
    /// Whether a positive command pushes to the left.
    pub invert: bool,
}

impl Default for Motor {
    fn default() -> Self {
        Self {
            full_scale: 7200,
            most: 0.95,
            gain: 0.595228,
            friction_forward: 0.0323188,
            friction_backward: 0.0385016,
            invert: false,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.range("angle.counts_per_turn", self.angle.counts_per_turn, 16.0..=1e7);
        c.range("angle.hanging", self.angle.hanging, -1e7..=1e7);
        c.range("angle.upright_deg", self.angle.upright_deg, -45.0..=45.0);
        c.range("position.m_per_count", self.position.m_per_count, 1e-9..=0.1);
        c.range("velocity.cutoff_hz", self.velocity.cutoff_hz, 0.5..=500.0);
        c.count("motor.full_scale", self.motor.full_scale, 1..=2_000_000_000);
        c.range("motor.most", self.motor.most, 0.01..=0.95);
        c.range("motor.gain", self.motor.gain, 0.01..=1.0);
        c.range("motor.friction_forward", self.motor.friction_forward, 0.0..=0.5);
        c.range("motor.friction_backward", self.motor.friction_backward, 0.0..=0.5);
    }
}

impl Params {
    /// The pole's angle at a reading, rad, within half a turn of upright.
    #[must_use]
    pub fn angle(&self, reading: i32) -> f64 {
        let Angle { counts_per_turn, hanging, upright_deg, invert } = self.angle;
        let turned = (f64::from(reading) - hanging) / counts_per_turn * TAU;
        let turned = if invert { -turned } else { turned };
        wrapped(turned + PI - upright_deg.to_radians())
    }

    /// The cart's position at a reading, m.
    #[must_use]
    pub fn position(&self, reading: i32) -> f64 {
        let sign = if self.position.invert { -1.0 } else { 1.0 };
        sign * self.position.m_per_count * f64::from(reading)
    }

    /// The command for `part` of the largest action, on a cart that moves with `speed`.
    #[must_use]
    pub fn command(&self, part: f64, speed: f64) -> i32 {
        let Motor { full_scale, most, gain, friction_forward, friction_backward, invert } =
            self.motor;
        // What is no number moves nothing.
        if part == 0.0 || part.is_nan() {
            return 0;
        }
        let friction = if speed > 0.0 {
            friction_forward
        } else if speed < 0.0 {
            -friction_backward
        } else {
            0.0
        };
        let duty = (part.clamp(-1.0, 1.0) * gain + friction).clamp(-most, most);
        // What makes up for friction turns no push around.
        let duty = if duty * part > 0.0 { duty } else { 0.0 };
        let duty = if invert { -duty } else { duty };
        #[expect(clippy::cast_possible_truncation, reason = "within the full scale")]
        let command = (duty * f64::from(full_scale)) as i32;
        command
    }
}

/// Follows the plant from frame to frame.
#[derive(Clone, Debug)]
pub struct Tracker {
    params: Params,
    period: Seconds,
    state: Option<[f64; 4]>,
    /// The device's clock, unwrapped.
    device: Option<(u32, Seconds)>,
}

impl Tracker {
    /// Nothing is known yet of a device that sends a state each `period`.
    #[must_use]
    pub fn new(params: Params, period: Seconds) -> Self {
        Self { params, period, state: None, device: None }
    }

    /// Forgets the plant, as after a new connection.
    pub fn forget(&mut self) {
        self.state = None;
        self.device = None;
    }

    /// The state `[x, ẋ, θ, θ̇]` at `frame`, and the device's own time; `None` for a frame
    /// that has no angle and position. Turns of the pole are counted on.
    pub fn follow(&mut self, frame: &StateFrame) -> Option<(State, Seconds)> {
        let &[angle, position, ..] = &frame.sensors[..] else { return None };
        let (angle, x) = (self.params.angle(angle), self.params.position(position));
        let (device, passed) = self.clock(frame);
        let state = match self.state {
            None => [x, 0.0, angle, 0.0],
            Some([x_before, x_dot, theta, theta_dot]) => {
                let turned = wrapped(angle - wrapped(theta));
                // One period's share of the way to a new velocity.
                let omega = TAU * self.params.velocity.cutoff_hz;
                let share = 1.0 - (-omega * passed.0).exp();
                let smooth = |before: f64, way: f64| before + share * (way / passed.0 - before);
                [x, smooth(x_dot, x - x_before), theta + turned, smooth(theta_dot, turned)]
            }
        };
        self.state = Some(state);
        Some((State::new(state), device))
    }

    /// The device's own time, and the time since the frame before: the device's, if that is
    /// sensible, for its clock may start anew.
    fn clock(&mut self, frame: &StateFrame) -> (Seconds, Seconds) {
        let Some((before_us, before)) = self.device else {
            let at = Seconds(f64::from(frame.time_us) * 1e-6);
            self.device = Some((frame.time_us, at));
            return (at, self.period);
        };
        let passed = Seconds(f64::from(frame.time_us.wrapping_sub(before_us)) * 1e-6);
        let is_sensible = (0.5 * self.period.0..=20.0 * self.period.0).contains(&passed.0);
        // A clock that went back, or far ahead, is a device that started anew: its time falls.
        let at = if is_sensible || passed.0 < 60.0 {
            before + passed
        } else {
            Seconds(f64::from(frame.time_us) * 1e-6 - 1e6)
        };
        self.device = Some((frame.time_us, at));
        (at, if is_sensible { passed } else { self.period })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::wire::Readings;
    use proptest::prelude::*;

    const PERIOD: Seconds = Seconds(0.02);

    fn frame(angle: i32, position: i32, time_us: u32) -> StateFrame {
        let sensors = Readings::new(&[angle, position]).unwrap();
        StateFrame { sensors, time_us, ..StateFrame::default() }
    }

    /// Computed with the driver of github `SensorsINI/physical-cartpole`, master `d658274`: the
    /// STM32 board with the Pololu motor, then the Zynq board.
    #[test]
    fn readings_become_the_angles_and_positions_of_the_robots_own_driver() {
        let stm = Params::default();
        let zynq = Params {
            angle: Angle { counts_per_turn: 4069.05, hanging: 1005.5, ..Angle::default() },
            position: Position { m_per_count: 0.396 / 4695.0, ..Position::default() },
            ..Params::default()
        };
        for (angle, position, stm_rad, stm_m, zynq_rad, zynq_m) in [
            (0, 0, 1.628542, 0.0, 1.588959, 0.0),
            (1000, 100, 3.099553, 0.009510, 3.133100, 0.008435),
            (1029, -100, -3.140973, -0.009510, -3.105305, -0.008435),
            (2135, 2082, -1.514036, 0.198000, -1.397486, 0.175606),
            (-2135, -2082, -1.512065, -0.198000, -1.707781, -0.175606),
            (-1107, -1978, 0.000134, -0.188110, -0.120404, -0.166835),
            (-176, 2347, 1.369644, 0.223202, 1.317191, 0.197958),
            (-1030, 0, 0.113402, 0.0, -0.001506, 0.0),
        ] {
            for (params, rad, m) in [(&stm, stm_rad, stm_m), (&zynq, zynq_rad, zynq_m)] {
                let (angle, x) = (params.angle(angle), params.position(position));
                assert!(
                    (angle - rad).abs() < 1e-5 && (x - m).abs() < 1e-5,
                    "{angle} {rad} {x} {m}"
                );
            }
        }
    }

    #[test]
    fn an_action_becomes_the_robots_command_and_never_more_than_its_most() {
        let params = Params::default();
        // int(7200 × (0.5 × 0.595228 ± friction)).
        assert_eq!(params.command(0.5, 0.0), 2142);
        assert_eq!(params.command(0.5, 0.1), 2375);
        assert_eq!(params.command(-0.5, -0.1), -2420);
        assert_eq!(params.command(0.0, 0.1), 0);
        assert_eq!(params.command(f64::NAN, 0.1), 0);
        let full = Params { motor: Motor { gain: 1.0, ..Motor::default() }, ..params };
        assert_eq!((full.command(9.0, 1.0), full.command(-9.0, -1.0)), (6840, -6840));
    }

    #[test]
    fn turns_are_counted_on_and_velocities_settle() {
        let mut tracker = Tracker::new(Params::default(), PERIOD);
        let mut last = (State::default(), Seconds(0.0));
        // Five turns a second forward: 427.134 counts a frame, read as within a turn.
        for k in 0..200_u32 {
            let counts = (427.134 * f64::from(k)) % 4271.34;
            #[expect(clippy::cast_possible_truncation, reason = "within a turn")]
            let reading = counts.round() as i32;
            last =
                tracker.follow(&frame(reading, 5 * i32::try_from(k).unwrap(), k * 20_000)).unwrap();
        }
        let (state, device) = last;
        assert!((state[2] - (1.628542 + 199.0 * TAU / 10.0)).abs() < 0.01, "{state:?}");
        assert!(
            (state[3] - TAU * 5.0).abs() < 0.1 && (state[1] - 5.0 * 9.5101e-5 / 0.02).abs() < 1e-6
        );
        assert!((device.0 - 3.98).abs() < 1e-9);
        // The clock wraps, and starts anew.
        let wrapping = tracker.follow(&frame(0, 0, 4_000_000)).unwrap().1;
        assert!((wrapping.0 - 4.0).abs() < 1e-9);
        assert!(tracker.follow(&frame(0, 0, 100)).unwrap().1 < wrapping);
    }

    #[test]
    fn the_devices_clock_may_wrap() {
        let mut tracker = Tracker::new(Params::default(), PERIOD);
        let before = tracker.follow(&frame(0, 0, u32::MAX - 9_999)).unwrap().1;
        let after = tracker.follow(&frame(0, 0, 10_000)).unwrap().1;
        assert!(((after - before).0 - 0.02).abs() < 1e-6);
    }

    proptest! {
        #[test]
        fn whatever_is_read_the_state_is_finite_and_no_command_is_beyond_the_most(
            frames in prop::collection::vec((any::<i16>(), any::<i16>(), any::<u32>()), 1..40),
            part in any::<f64>(), speed in any::<f64>(),
        ) {
            let mut tracker = Tracker::new(Params::default(), PERIOD);
            for (angle, position, time_us) in frames {
                let (state, device) =
                    tracker.follow(&frame(angle.into(), position.into(), time_us)).unwrap();
                prop_assert!(state.is_finite() && device.0.is_finite());
            }
            let command = Params::default().command(part, speed);
            prop_assert!(command.abs() <= 6840);
        }
    }
}
