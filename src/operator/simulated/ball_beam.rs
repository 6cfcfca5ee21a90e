//! A simulated person who rolls the ball on its beam as fast as the ends allow.
//!
//! The beam is swung against where the ball will be, and along with a slow ball to get it
//! going. The servo has to be placed by hand: the voltage follows the distance between the
//! wanted angle and the one that is felt.
//!
//! Measured: mean R of eq. 27 in m/s, and how often a minute an end stops the ball, in two
//! minutes from rest after 180 s and after 1180 s of practice, 20 operators each.
//!
//! | kind | naive | average | expert |
//! | --- | --- | --- | --- |
//! | delayed-pd | 0.083, 0.110; 0.2, 0.1 | 0.108, 0.122; 0.1, 0.1 | 0.149, 0.149; 0, 0 |
//! | intermittent | 0.043, 0.073; 0.4, 0.6 | 0.064, 0.084; 0.6, 0.5 | 0.118, 0.118; 0.2, 0.2 |
//! | bang-bang | 0.073, 0.093; 0.2, 0.1 | 0.095, 0.105; 0.1, 0 | 0.102, 0.102; 0, 0 |
//! | predictor | 0.072, 0.083; 0, 0 | 0.083, 0.091; 0, 0 | 0.105, 0.105; 0, 0 |
//! | mouse-limited | 0.078, 0.103; 0, 0 | 0.100, 0.115; 0, 0 | 0.127, 0.127; 0, 0 |
//! | lapses | −0.009, 0.012; 3.0, 3.2 | 0.018, 0.040; 2.8, 2.6 | 0.087, 0.087; 1.4, 1.4 |

mod params;

use rand_chacha::ChaCha8Rng;

pub use params::Params;

use super::filters::{DelayLine, Wander};
use super::person::{Factors, Foresight, Judgement, Person, at_least_0};
use super::{Kind, Skill};
use crate::operator::{Operator, Practice, View};
use crate::plant::ball_beam;
use crate::random::Place;
use crate::signal::{Intent, Seconds};

/// A simulated operator of the ball and beam; the state must be `[x, ẋ, θ, θ̇]`.
///
/// A decision is an angle of the servo. The habits: `intermittent` holds it, and looks
/// farther ahead by as much; `bang-bang` knows three angles; `predictor` foresees ball and
/// servo with a model in the head, whose look-ahead then spans only what is left of it;
/// `mouse-limited` cannot sustain a voltage; `lapses` tilt the wrong way.
#[derive(Clone, Debug)]
pub struct Roller(Person<4, Rolling>);

impl Roller {
    /// An operator of `kind` and `skill` for a ball and beam with the parameters `plant`
    /// that is controlled every `tick`. `seed` decides the personal traits and all noise.
    #[must_use]
    pub fn new(
        params: &Params,
        skill: Skill,
        kind: Kind,
        seed: u64,
        tick: Seconds,
        plant: &ball_beam::Params,
    ) -> Self {
        let character = params.person.character(skill, params.swing_rad.1, plant.voltage_limit_v);
        Self(Person::new(character, kind, seed, tick, |factors| {
            Rolling::new(params, kind, tick, plant, factors)
        }))
    }
}

impl Operator for Roller {
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
struct Rolling {
    params: Params,
    model: Option<Foresight<ball_beam::BallBeam>>,
    imagined: ball_beam::Params,
    /// The time for which a decision holds: it has to suit the ball at its end, too, s.
    hold: f64,
    tick: Seconds,
    x_error: Wander,
    x_dot_error: Wander,
    factors: Personal,
    x_noise: f64,
    x_dot_noise: f64,
    swing: f64,
    look_ahead: f64,
    slow: f64,
    gain: f64,
    delay_ticks: usize,
    /// The servo's angle as it is felt.
    theta: f64,
    /// The way of the last push of a slow ball.
    way: f64,
}

/// A person's factors on the common values.
#[derive(Clone, Copy, Debug)]
struct Personal {
    noise: f64,
    swing: f64,
    look_ahead: f64,
    gain: f64,
}

impl Rolling {
    fn new(
        params: &Params,
        kind: Kind,
        tick: Seconds,
        plant: &ball_beam::Params,
        factors: &mut Factors,
    ) -> Self {
        let imagined = ball_beam::Params {
            ball_gain_m_s2_rad: plant.ball_gain_m_s2_rad * params.model_gain_factor,
            substeps: 1,
            ..plant.clone()
        };
        let correlation_s = params.person.noise_correlation_s;
        let (shortest, longest) = params.person.decision_hold_s;
        Self {
            model: (kind == Kind::Predictor).then(|| foresight(Seconds(0.0), tick, &imagined)),
            imagined,
            hold: match kind {
                Kind::Intermittent => f64::midpoint(shortest, longest),
                _ => 0.0,
            },
            tick,
            x_error: Wander::still(correlation_s, tick),
            x_dot_error: Wander::still(correlation_s, tick),
            factors: Personal {
                noise: factors.next(),
                swing: factors.next(),
                look_ahead: factors.with(params.look_ahead_trait_sd),
                gain: factors.next(),
            },
            params: params.clone(),
            x_noise: 0.0,
            x_dot_noise: 0.0,
            swing: 0.0,
            look_ahead: 0.0,
            slow: 0.0,
            gain: 0.0,
            delay_ticks: 0,
            theta: 0.0,
            way: 1.0,
        }
    }
}

impl Rolling {
    /// The servo's angle now: as it was seen, and moved on by what the hand has given since.
    fn feel(&self, theta: f64, done: &DelayLine<1>) -> f64 {
        let given: f64 = (0..self.delay_ticks).map(|age| done.back(age)[0]).sum();
        let limit = self.imagined.servo_limit_rad;
        (theta + self.imagined.servo_gain_rad_s_v * self.tick.0 * given).clamp(-limit, limit)
    }
}

fn foresight(
    delay: Seconds,
    tick: Seconds,
    plant: &ball_beam::Params,
) -> Foresight<ball_beam::BallBeam> {
    Foresight::new(delay, tick, |step| ball_beam::BallBeam::new(plant.clone(), step))
}

impl Judgement<4> for Rolling {
    fn begin(&mut self, rng: &mut ChaCha8Rng) {
        self.x_error.restart(rng);
        self.x_dot_error.restart(rng);
        self.theta = 0.0;
        self.way = 1.0;
    }

    fn renew(&mut self, skill: f64, delay: Seconds) {
        let (p, own) = (&self.params, &self.factors);
        self.x_noise = own.noise * at_least_0(p.x_noise_m, skill);
        self.x_dot_noise = own.noise * at_least_0(p.x_dot_noise_m_s, skill);
        self.swing = own.swing * at_least_0(p.swing_rad, skill);
        self.slow = at_least_0(p.slow_m_s, skill);
        self.gain = own.gain * at_least_0(p.servo_gain_v_rad, skill);
        let ahead = own.look_ahead * at_least_0(p.look_ahead_s, skill) + self.hold;
        self.look_ahead = ahead;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small count of ticks, at least 0"
        )]
        let delay_ticks = (delay.0 / self.tick.0).round() as usize;
        self.delay_ticks = delay_ticks;
        if let Some(model) = &mut self.model {
            *model = foresight(delay, self.tick, &self.imagined);
            self.look_ahead = (ahead - delay.0).max(0.0);
        }
    }

    fn numbers(&mut self) -> Vec<&mut f64> {
        vec![self.x_error.number(), self.x_dot_error.number(), &mut self.theta, &mut self.way]
    }

    fn wish(&mut self, past: [f64; 4], done: &DelayLine<1>, rng: &mut ChaCha8Rng) -> f64 {
        let mut seen = past;
        seen[0] += self.x_noise * self.x_error.next(rng);
        seen[1] += self.x_dot_noise * self.x_dot_error.next(rng);
        let [x, x_dot, theta, _] = match &mut self.model {
            Some(model) => model.foresee(seen, done),
            None => seen,
        };
        self.theta = if self.model.is_some() { theta } else { self.feel(theta, done) };
        if x_dot.abs() < self.slow && x.abs() < self.params.reach_m {
            if x_dot != 0.0 {
                self.way = x_dot.signum();
            }
            return self.way * self.swing;
        }
        let coming = x + x_dot * self.look_ahead;
        -self.swing * (coming / self.params.reach_m).clamp(-1.0, 1.0)
    }

    fn act(&self, wish: f64) -> f64 {
        self.gain * (wish - self.theta)
    }
}
