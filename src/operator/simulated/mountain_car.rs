//! A simulated person who drives the mountain car to its flag.
//!
//! The throttle follows the velocity's sign, which adds energy at every moment and is
//! within 10 % of the fastest way (113 steps of eq. 30–31 against 104 from x = −0.7). The
//! velocity is seen late and blurred; a feeling for the slope makes up for some of it. Now
//! and then the throttle is let go for a moment.
//!
//! Measured: mean steps from (−0.7, 0) to the flag, 500 at most, in the ten drives after
//! 180 s and after 1180 s of practice, 20 operators each, with steps of 40 ms.
//!
//! | kind | naive | average | expert |
//! | --- | --- | --- | --- |
//! | delayed-pd | 191, 142 | 142, 126 | 114, 114 |
//! | intermittent | 210, 157 | 155, 131 | 118, 118 |
//! | bang-bang | 228, 180 | 184, 152 | 123, 123 |
//! | predictor | 174, 137 | 137, 124 | 113, 113 |
//! | mouse-limited | 221, 181 | 183, 149 | 118, 118 |
//! | lapses | 274, 194 | 200, 154 | 119, 119 |

mod params;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

pub use params::Params;

use super::filters::{DelayLine, Wander};
use super::person::{Factors, Foresight, Judgement, Person, at_least_0};
use super::{Kind, Skill};
use crate::operator::{Operator, Practice, View};
use crate::plant::mountain_car;
use crate::random::Place;
use crate::signal::{Intent, Seconds};

/// A simulated operator of the mountain car; the state must be `[x, v]`.
///
/// The habits: `intermittent` holds a throttle; `bang-bang` knows three; `predictor` drives
/// the car in the head on to now, in place of the feeling for the slope; `mouse-limited`
/// cannot sustain a throttle; `lapses` drive the wrong way.
#[derive(Clone, Debug)]
pub struct Driver(Person<2, Driving>);

impl Driver {
    /// An operator of `kind` and `skill` for a mountain car with the parameters `plant`
    /// that makes a step every `tick`. `seed` decides the personal traits and all noise.
    #[must_use]
    pub fn new(
        params: &Params,
        skill: Skill,
        kind: Kind,
        seed: u64,
        tick: Seconds,
        plant: &mountain_car::Params,
    ) -> Self {
        let limit = plant.throttle_limit;
        let character = params.person.character(skill, limit, limit);
        Self(Person::new(character, kind, seed, tick, |factors| {
            Driving::new(params, kind, tick, plant, factors)
        }))
    }
}

impl Operator for Driver {
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
struct Driving {
    params: Params,
    plant: mountain_car::Params,
    model: Option<Foresight<mountain_car::MountainCar>>,
    tick: Seconds,
    v_error: Wander,
    noise_factor: f64,
    lead_factor: f64,
    v_noise: f64,
    rest: f64,
    lead_steps: f64,
    throttle: f64,
    pause_chance: f64,
    /// How long a pause still lasts, s.
    pause_left: f64,
    /// The way of the last clear motion.
    way: f64,
}

impl Driving {
    fn new(
        params: &Params,
        kind: Kind,
        tick: Seconds,
        plant: &mountain_car::Params,
        factors: &mut Factors,
    ) -> Self {
        Self {
            model: (kind == Kind::Predictor).then(|| foresight(Seconds(0.0), tick, plant)),
            tick,
            v_error: Wander::still(params.person.noise_correlation_s, tick),
            noise_factor: factors.next(),
            lead_factor: factors.next(),
            params: params.clone(),
            plant: plant.clone(),
            v_noise: 0.0,
            rest: 0.0,
            lead_steps: 0.0,
            throttle: 0.0,
            pause_chance: 0.0,
            pause_left: 0.0,
            way: 1.0,
        }
    }
}

/// A step of the car's equations is a tick and cannot be divided: the delay is rounded.
fn foresight(
    delay: Seconds,
    tick: Seconds,
    plant: &mountain_car::Params,
) -> Foresight<mountain_car::MountainCar> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small count of ticks, at least 0"
    )]
    let ticks = (delay.0 / tick.0).round() as u32;
    Foresight::over_ticks(ticks, mountain_car::MountainCar::new(plant.clone()))
}

impl Judgement<2> for Driving {
    fn begin(&mut self, rng: &mut ChaCha8Rng) {
        self.v_error.restart(rng);
        self.pause_left = 0.0;
        // The flag is to the right.
        self.way = 1.0;
    }

    fn renew(&mut self, skill: f64, delay: Seconds) {
        let p = &self.params;
        self.v_noise = self.noise_factor * at_least_0(p.v_noise, skill);
        self.rest = at_least_0(p.v_rest, skill);
        self.lead_steps = self.lead_factor * at_least_0(p.lead_s, skill) / self.tick.0;
        self.throttle = at_least_0(p.throttle, skill) * self.plant.throttle_limit;
        self.pause_chance = at_least_0(p.pauses_per_s, skill) * self.tick.0;
        if let Some(model) = &mut self.model {
            *model = foresight(delay, self.tick, &self.plant);
            self.lead_steps = (self.lead_steps - delay.0 / self.tick.0).max(0.0);
        }
    }

    fn numbers(&mut self) -> Vec<&mut f64> {
        vec![self.v_error.number(), &mut self.pause_left, &mut self.way]
    }

    fn wish(&mut self, past: [f64; 2], done: &DelayLine<1>, rng: &mut ChaCha8Rng) -> f64 {
        let mut seen = past;
        seen[1] += self.v_noise * self.v_error.next(rng);
        let [x, v] = match &mut self.model {
            Some(model) => model.foresee(seen, done),
            None => seen,
        };
        // The slope under the car tells how the velocity goes on.
        let v = v - self.lead_steps * self.plant.gravity * (3.0 * x).cos();
        if v.abs() > self.rest {
            self.way = v.signum();
        }
        self.pause_left -= self.tick.0;
        if self.pause_left <= 0.0 && rng.random::<f64>() < self.pause_chance {
            self.pause_left = self.params.pause_s;
        }
        if self.pause_left > 0.0 { 0.0 } else { self.way * self.throttle }
    }
}
