//! The cart-pole: a pole hinged on a cart that a force pushes along a track.
//!
//! Thesis eq. 12–17 with the readings of Florian (2007), "Correct equations for the
//! dynamics of the cart-pole system": the cart's acceleration uses θ̈·cos θ, and l is half
//! the pole (pivot to the centre of mass of a uniform rod). θ = 0 is upright, positive
//! to the right.

use std::ops::RangeInclusive;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::Plant;
use crate::check::{Check, Checker};
use crate::random::{Place, Purpose, stream};
use crate::signal::{Action, Seconds, State};

/// How a step of motion is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    /// Velocities first, then positions with the new velocities (eq. 17).
    #[default]
    SemiImplicit,
    /// Positions with the old velocities, then velocities.
    Euler,
}

/// The cart-pole's parameters, in SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// The whole pole's length, m.
    pub pole_length_m: f64,
    /// The pole's mass, kg.
    pub pole_mass_kg: f64,
    /// The cart's mass, kg.
    pub cart_mass_kg: f64,
    /// Gravity, m/s².
    pub gravity_m_s2: f64,
    /// `σ_θ` of eq. 14, 1/s.
    pub pole_friction_per_s: f64,
    /// `σ_x` of eq. 15, 1/s: slows the cart, but not the pole.
    pub cart_friction_per_s: f64,
    /// What a belt and a motor take from a moving cart, N·s/m: a force as any other, which the
    /// pole feels, too (ours).
    pub cart_drag_n_s_per_m: f64,
    /// ρ of eq. 14–15 is drawn uniformly from ± this each control step, 1/s.
    pub friction_noise_per_s: f64,
    /// The track's length, m, centred on x = 0; `None` for an endless track.
    pub track_length_m: Option<f64>,
    /// The fraction ε of its speed that the cart keeps when it bounces (eq. 16).
    pub bounce: f64,
    /// The largest force, N.
    pub force_limit_n: f64,
    /// Integration steps within one control step.
    pub substeps: u32,
    /// How a step of motion is computed.
    pub integrator: Integrator,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            pole_length_m: 1.0,
            pole_mass_kg: 0.1,
            cart_mass_kg: 1.0,
            gravity_m_s2: 9.8,
            pole_friction_per_s: 0.2,
            cart_friction_per_s: 0.5,
            cart_drag_n_s_per_m: 0.0,
            friction_noise_per_s: 0.05,
            track_length_m: Some(1.0),
            bounce: 0.2,
            force_limit_n: 10.0,
            substeps: 10,
            integrator: Integrator::SemiImplicit,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        const MASS: RangeInclusive<f64> = 1e-3..=100.0;
        c.range("pole_length_m", self.pole_length_m, 0.05..=10.0);
        c.range("pole_mass_kg", self.pole_mass_kg, MASS);
        c.range("cart_mass_kg", self.cart_mass_kg, MASS);
        c.range("gravity_m_s2", self.gravity_m_s2, 0.0..=30.0);
        c.range("pole_friction_per_s", self.pole_friction_per_s, 0.0..=20.0);
        c.range("cart_friction_per_s", self.cart_friction_per_s, 0.0..=20.0);
        c.range("cart_drag_n_s_per_m", self.cart_drag_n_s_per_m, 0.0..=100.0);
        c.range("friction_noise_per_s", self.friction_noise_per_s, 0.0..=5.0);
        if let Some(length) = self.track_length_m {
            c.range("track_length_m", length, 0.1..=100.0);
        }
        c.range("bounce", self.bounce, 0.0..=1.0);
        c.range("force_limit_n", self.force_limit_n, 0.01..=1000.0);
        c.count("substeps", self.substeps, 1..=1000);
    }
}

/// The cart-pole as a [`Plant`]; the state is `[x, ẋ, θ, θ̇]`.
#[derive(Clone, Debug)]
pub struct CartPole {
    params: Params,
    dt: f64,
    noise: ChaCha8Rng,
}

impl CartPole {
    /// The names of the state's numbers.
    pub const COLUMNS: [&'static str; 4] = ["x", "x_dot", "theta", "theta_dot"];

    /// A cart-pole that moves `tick` per control step.
    #[must_use]
    pub fn new(params: Params, tick: Seconds) -> Self {
        Self { params, dt: tick.0, noise: stream(0, Purpose::Friction, Place::default()) }
    }

    /// ẍ and θ̈ without friction, for a force in N (eq. 12–13).
    fn accelerations(&self, force: f64, theta: f64, theta_dot: f64) -> (f64, f64) {
        let p = &self.params;
        let mass = p.cart_mass_kg + p.pole_mass_kg;
        let half = p.pole_length_m / 2.0;
        let (sin, cos) = theta.sin_cos();
        let push = (force + p.pole_mass_kg * half * theta_dot * theta_dot * sin) / mass;
        let theta_acc = (p.gravity_m_s2 * sin - cos * push)
            / (half * (4.0 / 3.0 - p.pole_mass_kg * cos * cos / mass));
        let x_acc = push - p.pole_mass_kg * half * theta_acc * cos / mass;
        (x_acc, theta_acc)
    }

    /// A uniform draw from ±`friction_noise_per_s`.
    fn rho(&mut self) -> f64 {
        let width = self.params.friction_noise_per_s;
        if width > 0.0 { self.noise.random_range(-width..=width) } else { 0.0 }
    }
}

impl Plant for CartPole {
    fn columns(&self) -> &'static [&'static str] {
        &Self::COLUMNS
    }

    fn step(&mut self, state: &State, action: Action) -> State {
        let &[mut x, mut x_dot, mut theta, mut theta_dot] = &state[..] else { return *state };
        let pole_friction = self.params.pole_friction_per_s + self.rho();
        let cart_friction = self.params.cart_friction_per_s + self.rho();
        let h = self.dt / f64::from(self.params.substeps);
        for _ in 0..self.params.substeps {
            let force = action.0 - self.params.cart_drag_n_s_per_m * x_dot;
            let (x_acc, theta_acc) = self.accelerations(force, theta, theta_dot);
            let x_acc = x_acc - cart_friction * x_dot;
            let theta_acc = theta_acc - pole_friction * theta_dot;
            match self.params.integrator {
                Integrator::SemiImplicit => {
                    x_dot += h * x_acc;
                    x += h * x_dot;
                    theta_dot += h * theta_acc;
                    theta += h * theta_dot;
                }
                Integrator::Euler => {
                    x += h * x_dot;
                    x_dot += h * x_acc;
                    theta += h * theta_dot;
                    theta_dot += h * theta_acc;
                }
            }
            if let Some(length) = self.params.track_length_m
                && x.abs() > length / 2.0
            {
                x = x.clamp(-length / 2.0, length / 2.0);
                // Only a cart that moves outward bounces: one at rest on the end stays there.
                if x_dot * x > 0.0 {
                    x_dot *= -self.params.bounce;
                }
            }
        }
        State::new([x, x_dot, theta, theta_dot])
    }

    fn reseed(&mut self, noise: ChaCha8Rng) {
        self.noise = noise;
    }
}
