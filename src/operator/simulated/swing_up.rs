//! A simulated person who swings the cart-pole's pole up and keeps it there.
//!
//! Below, the pole is pumped: a push in the direction that adds energy until there is
//! enough of it to reach the top, and one that takes energy away beyond (Åström & Furuta
//! 2000, "Swinging up a pendulum by energy control"). The rhythm of the swing lets people
//! anticipate, better with practice. Near the top the pole is balanced by the same late
//! linear law as in the balance task.
//!
//! People foresee some of what their own pushes did since they saw the pole, with a model in
//! the head (Mehta & Schaal 2002, "Forward models in visuomotor control"): by late feedback
//! alone nobody could hold a pole of 0.6 m for more than about two seconds. The values are
//! ours, set so that an expert is up within a few seconds and holds the top for some, an
//! average person reaches it regularly and holds it for about one, and a naive one has to
//! find the swing's rhythm first.
//!
//! Measured: mean height cos θ, and mean time of holds within 30° of upright (of 0.3 s or
//! longer) in s, in two minutes from hanging at rest after 180 s and after 1180 s of practice,
//! 20 operators each, with a pole of 0.6 m.
//!
//! | kind | naive | average | expert |
//! | --- | --- | --- | --- |
//! | delayed-pd | −0.08, 0.36; 0.5, 0.9 | 0.36, 0.50; 0.9, 1.2 | 0.65, 0.65; 2.9, 2.9 |
//! | intermittent | −0.19, 0.03; 0.4, 0.6 | 0.07, 0.18; 0.6, 0.6 | 0.22, 0.22; 0.5, 0.5 |
//! | bang-bang | −0.14, 0.30; 0.3, 0.6 | 0.33, 0.41; 0.6, 0.7 | 0.50, 0.50; 1.0, 1.0 |
//! | predictor | 0.10, 0.16; 0.6, 0.6 | 0.17, 0.21; 0.6, 0.7 | 0.31, 0.31; 1.7, 1.7 |
//! | mouse-limited | −0.06, 0.30; 0.6, 0.9 | 0.31, 0.38; 0.9, 1.0 | 0.19, 0.19; 1.2, 1.2 |
//! | lapses | −0.18, 0.24; 0.6, 0.7 | 0.24, 0.38; 0.8, 0.9 | 0.45, 0.45; 1.4, 1.4 |

mod params;

use rand_chacha::ChaCha8Rng;

pub use params::Params;

use super::cart_pole::Imagined;
use super::filters::DelayLine;
use super::law::Law;
use super::person::{Factors, Judgement, Person, at, at_least_0};
use super::{Kind, Skill};
use crate::operator::{Operator, Practice, View};
use crate::plant::cart_pole;
use crate::random::Place;
use crate::signal::{Intent, Seconds};

/// A simulated operator of the cart-pole's full circle; the state must be `[x, ẋ, θ, θ̇]`.
///
/// All habits apply as in the balance task. A predictor foresees the pole with the cart
/// through the whole circle.
#[derive(Clone, Debug)]
pub struct Swinger(Person<4, Swinging>);

impl Swinger {
    /// An operator of `kind` and `skill` for a cart-pole with the parameters `plant` that
    /// is controlled every `tick`. `seed` decides the personal traits and all noise.
    #[must_use]
    pub fn new(
        params: &Params,
        skill: Skill,
        kind: Kind,
        seed: u64,
        tick: Seconds,
        plant: &cart_pole::Params,
    ) -> Self {
        let person = &params.person;
        let character = person.character(skill, params.pump_force_n.1, plant.force_limit_n);
        Self(Person::new(character, kind, seed, tick, |factors| {
            Swinging::new(params, kind, tick, plant, factors)
        }))
    }
}

impl Operator for Swinger {
    fn begin(&mut self, place: Place, practice: Practice) {
        self.0.begin(place, practice);
    }

    fn intent(&mut self, view: View<'_>) -> Intent {
        self.0.intent(view)
    }

    fn memory(&mut self) -> Vec<f64> {
        self.0.memory()
    }

    fn go_on(&mut self, memory: &[f64]) {
        self.0.go_on(memory);
    }
}

#[derive(Clone, Debug)]
struct Swinging {
    params: Params,
    law: Law,
    model: Imagined,
    is_predictor: bool,
    foresight: f64,
    tick: Seconds,
    /// ω² of the hanging pole, 1/s².
    stiffness: f64,
    force_factor: f64,
    lead_factor: f64,
    force: f64,
    lead_s: f64,
    catch: f64,
    catch_speed: f64,
}

impl Swinging {
    fn new(
        params: &Params,
        kind: Kind,
        tick: Seconds,
        plant: &cart_pole::Params,
        factors: &mut Factors,
    ) -> Self {
        let is_predictor = kind == Kind::Predictor;
        let correlation_s = params.person.noise_correlation_s;
        Self {
            law: Law::draw(params.law(), is_predictor, correlation_s, tick, factors),
            force_factor: factors.next(),
            lead_factor: factors.next(),
            model: Imagined::new(plant, params.model_length_factor, tick),
            is_predictor,
            foresight: 0.0,
            tick,
            stiffness: plant.gravity_m_s2 / (plant.pole_length_m * 2.0 / 3.0),
            params: params.clone(),
            force: 0.0,
            lead_s: 0.0,
            catch: 0.0,
            catch_speed: 0.0,
        }
    }

    /// The push that brings the pole's energy towards that of rest at the top.
    fn pump(&self, [x, x_dot, theta, theta_dot]: [f64; 4]) -> f64 {
        let p = &self.params;
        let (theta, theta_dot) = self.anticipate(theta, theta_dot);
        // 0 for a pole that just reaches the top, −2 for one that hangs.
        let energy = theta_dot * theta_dot / (2.0 * self.stiffness) + theta.cos() - 1.0;
        let effort = (-energy / p.energy_band).clamp(-1.0, 1.0);
        // The cart accelerates with the force and the pole falls behind: dE/dt ~ −F·θ̇·cos θ.
        let helps = -(theta_dot * theta.cos()).signum();
        effort * helps * self.force - p.pump_x_gain_n_m * x - p.pump_x_dot_gain_n_s_m * x_dot
    }

    /// The pole some time later if it swung freely.
    fn anticipate(&self, mut theta: f64, mut theta_dot: f64) -> (f64, f64) {
        let mut left = self.lead_s;
        while left > 0.0 {
            let step = left.min(self.tick.0);
            theta_dot += step * self.stiffness * theta.sin();
            theta += step * theta_dot;
            left -= step;
        }
        (theta, theta_dot)
    }
}

impl Judgement<4> for Swinging {
    fn begin(&mut self, rng: &mut ChaCha8Rng) {
        self.law.begin(rng);
    }

    fn renew(&mut self, skill: f64, delay: Seconds) {
        let p = &self.params;
        self.law.renew(skill);
        self.force = self.force_factor * at_least_0(p.pump_force_n, skill);
        let lead = self.lead_factor * at_least_0(p.pump_lead_s, skill);
        self.foresight =
            if self.is_predictor { 1.0 } else { at(p.foresight, skill).clamp(0.0, 1.0) };
        // Foresight makes up for the delay already.
        self.lead_s = (lead - self.foresight * delay.0).max(0.0);
        self.model.renew(delay);
        self.catch = at(p.catch_deg, skill).to_radians();
        self.catch_speed = at(p.catch_deg_s, skill).to_radians();
    }

    fn numbers(&mut self) -> Vec<&mut f64> {
        self.law.numbers()
    }

    fn wish(&mut self, past: [f64; 4], done: &DelayLine<1>, rng: &mut ChaCha8Rng) -> f64 {
        let seen = self.law.see(past, rng);
        let foreseen = self.model.foresee(seen, done);
        let [x, x_dot, theta, theta_dot] =
            std::array::from_fn(|i| seen[i] + self.foresight * (foreseen[i] - seen[i]));
        let theta = wrapped(theta);
        let state = [x, x_dot, theta, theta_dot];
        if theta.abs() < self.catch && theta_dot.abs() < self.catch_speed {
            self.law.force(state)
        } else {
            self.pump(state)
        }
    }
}

/// An angle within ±π.
fn wrapped(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle + PI).rem_euclid(TAU) - PI
}
