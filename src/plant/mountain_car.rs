//! The mountain car: too weak to drive up the hill, it must swing.
//!
//! Thesis eq. 30–31, the problem of Moore (1990) in the form of Sutton and Barto. Units are
//! the problem's own: one control step is one step of the equations, however long it lasts.

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::Plant;
use crate::check::{Check, Checker};
use crate::signal::{Action, State};

/// The mountain car's parameters, in the problem's own units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// What full throttle adds to the velocity in a step (eq. 30).
    pub power: f64,
    /// The most that the slope adds to the velocity in a step (eq. 30).
    pub gravity: f64,
    /// The velocity stays within ± this.
    pub speed_limit: f64,
    /// An inelastic wall: a car that reaches this position stops.
    pub left_wall: f64,
    /// The flag, and the largest position.
    pub goal: f64,
    /// The largest throttle.
    pub throttle_limit: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            power: 0.001,
            gravity: 0.0025,
            speed_limit: 0.07,
            left_wall: -1.2,
            goal: 0.5,
            throttle_limit: 1.0,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.range("power", self.power, 1e-6..=0.1);
        c.range("gravity", self.gravity, 0.0..=0.1);
        c.range("speed_limit", self.speed_limit, 1e-3..=1.0);
        // The valley's bottom is at −π/6 and its hilltops at −π/2 and π/6.
        c.range("left_wall", self.left_wall, -1.57..=-0.6);
        c.range("goal", self.goal, -0.4..=0.6);
        c.range("throttle_limit", self.throttle_limit, 0.01..=100.0);
    }
}

/// The mountain car as a [`Plant`]; the state is `[x, v]`.
#[derive(Clone, Debug)]
pub struct MountainCar {
    params: Params,
}

impl MountainCar {
    /// The names of the state's numbers.
    pub const COLUMNS: [&'static str; 2] = ["x", "v"];

    /// A mountain car.
    #[must_use]
    pub const fn new(params: Params) -> Self {
        Self { params }
    }

    /// What the slope at `x` takes from v in a step.
    #[inline]
    #[must_use]
    pub fn pull(&self, x: f64) -> f64 {
        self.params.gravity * (3.0 * x).cos()
    }

    /// A step from position `x`, where the slope's pull is `pull`, and velocity `v` with the
    /// throttle `u`.
    #[inline]
    #[must_use]
    pub fn roll(&self, pull: f64, x: f64, v: f64, u: f64) -> (f64, f64) {
        let p = &self.params;
        let v = v + p.power * u - pull;
        let v = v.clamp(-p.speed_limit, p.speed_limit);
        let x = x + v;
        if x <= p.left_wall { (p.left_wall, 0.0) } else { (x.min(p.goal), v) }
    }
}

impl Plant for MountainCar {
    fn columns(&self) -> &'static [&'static str] {
        &Self::COLUMNS
    }

    #[inline]
    fn step(&mut self, state: &State, action: Action) -> State {
        let &[x, v] = &state[..] else { return *state };
        let (x, v) = self.roll(self.pull(x), x, v, action.0);
        State::new([x, v])
    }

    /// Nothing: the mountain car has no noise.
    fn reseed(&mut self, _noise: ChaCha8Rng) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_pass_and_every_fault_is_named() {
        let mut faults = Vec::new();
        Params::default().check(&mut Checker::new(&mut faults));
        assert_eq!(faults, []);
        let wrong = Params { power: f64::NAN, goal: 0.7, ..Params::default() };
        wrong.check(&mut Checker::new(&mut faults));
        let keys: Vec<&str> = faults.iter().map(|fault| &fault.key[..]).collect();
        assert_eq!(keys, ["power", "goal"]);
    }
}
