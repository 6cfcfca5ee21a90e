//! A simulated person who balances the cart-pole.
//!
//! Eyes (delay, noise, dead zone) → judgement (a linear law, as the kind applies it) →
//! hand (motor noise, lag, limit). Values and spreads: [`Params`].

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::filters::{DelayLine, Lag, Wander, normal};
use super::{BySkill, Kind, Params, Skill};
use crate::operator::{Operator, View};
use crate::plant::{self, Plant};
use crate::random::{Place, Purpose, stream};
use crate::signal::{Action, Intent, Seconds, State};

/// A simulated operator of the cart-pole; the state must be `[x, ẋ, θ, θ̇]`.
///
/// Equal parameters, seed and rollouts give equal actions, bit for bit.
#[derive(Clone, Debug)]
pub struct Simulated {
    params: Params,
    kind: Kind,
    seed: u64,
    tick: Seconds,
    plant: plant::cart_pole::Params,
    traits: Traits,
    mind: Mind,
    seen: DelayLine<4>,
    done: DelayLine<1>,
}

/// What stays the same in an operator's life: factors on the common values.
#[derive(Clone, Debug)]
struct Traits {
    skill_first: f64,
    skill_last: f64,
    extra_delay: f64,
    theta_noise: f64,
    theta_dot_noise: f64,
    dead_zone: f64,
    theta_gain: f64,
    theta_dot_gain: f64,
    x_gain: f64,
    x_dot_gain: f64,
    motor_fraction: f64,
    motor_noise: f64,
}

impl Traits {
    fn draw(params: &Params, skill: Skill, seed: u64) -> Self {
        let mut rng = stream(seed, Purpose::OperatorTraits, Place::default());
        let practice = params.practice(skill);
        let spread = practice.trait_spread;
        let skill_last = practice.skill_last + practice.skill_last_sd * normal(&mut rng);
        let extra_delay = spread * params.delay_sd_s * normal(&mut rng);
        let theta_gain = (spread * params.theta_gain_trait_sd * normal(&mut rng)).exp();
        let mut factor = || (spread * params.trait_sd * normal(&mut rng)).exp();
        Self {
            skill_first: practice.skill_first,
            skill_last,
            extra_delay,
            theta_gain,
            theta_dot_gain: factor(),
            x_gain: factor(),
            x_dot_gain: factor(),
            theta_noise: factor(),
            theta_dot_noise: factor(),
            dead_zone: factor(),
            motor_fraction: factor(),
            motor_noise: factor(),
        }
    }

    /// The skill after `practice` rollouts.
    fn skill(&self, practice: u32, params: &Params) -> f64 {
        let left = (-f64::from(practice) / params.practice_rollouts).exp();
        self.skill_last + (self.skill_first - self.skill_last) * left
    }

    fn delay(&self, skill: f64, params: &Params) -> f64 {
        (at(params.delay_s, skill) + self.extra_delay).max(0.0)
    }
}

/// The line through the values at skill 0 and 1.
fn at((first, second): BySkill, skill: f64) -> f64 {
    first + (second - first) * skill
}

/// The same for what cannot be negative.
fn at_least_0(values: BySkill, skill: f64) -> f64 {
    at(values, skill).max(0.0)
}

/// The operator within one rollout.
#[derive(Clone, Debug)]
struct Mind {
    rng: ChaCha8Rng,
    delay_ticks: f64,
    theta_noise: f64,
    theta_dot_noise: f64,
    dead_zone: f64,
    gains: [f64; 4],
    motor_fraction: f64,
    motor_noise: f64,
    lapse_chance: f64,
    theta_error: Wander,
    theta_dot_error: Wander,
    tremor: Wander,
    hand: Lag,
    sustained: Lag,
    model: Option<Model>,
    /// Until when a decision (`intermittent`) or a lapse holds, s left.
    left: f64,
    decision: f64,
}

impl Mind {
    fn new(operator: &Origin<'_>, place: Place, practice: u32) -> Self {
        let Origin { params: p, traits, kind, seed, tick, plant } = *operator;
        let mut rng = stream(seed, Purpose::OperatorNoise, place);
        let skill = traits.skill(practice, p);
        let delay = traits.delay(skill, p);
        let blur = match kind {
            Kind::Predictor => at_least_0(p.model_noise_factor, skill),
            _ => 1.0,
        };
        Self {
            delay_ticks: delay / tick.0,
            theta_noise: blur
                * traits.theta_noise
                * at_least_0(p.theta_noise_deg, skill).to_radians(),
            theta_dot_noise: blur
                * traits.theta_dot_noise
                * at_least_0(p.theta_dot_noise_deg_s, skill).to_radians(),
            dead_zone: traits.dead_zone * at_least_0(p.dead_zone_deg, skill).to_radians(),
            gains: [
                traits.x_gain * at(p.x_gain_n_m, skill),
                traits.x_dot_gain * at(p.x_dot_gain_n_s_m, skill),
                traits.theta_gain * at(p.theta_gain_n_rad, skill),
                traits.theta_dot_gain * at(p.theta_dot_gain_n_s_rad, skill),
            ],
            motor_fraction: traits.motor_fraction * at_least_0(p.motor_noise_fraction, skill),
            motor_noise: traits.motor_noise * at_least_0(p.motor_noise_n, skill),
            lapse_chance: at_least_0(p.lapses_per_s, skill) * tick.0,
            theta_error: Wander::new(p.noise_correlation_s, tick, &mut rng),
            theta_dot_error: Wander::new(p.noise_correlation_s, tick, &mut rng),
            tremor: Wander::new(p.noise_correlation_s, tick, &mut rng),
            hand: Lag::new(p.lag_s, tick),
            sustained: Lag::new(p.travel_s, tick),
            model: (kind == Kind::Predictor)
                .then(|| Model::new(plant, p.model_length_factor, delay, tick)),
            left: 0.0,
            decision: 0.0,
            rng,
        }
    }
}

/// What a [`Mind`] is made from.
#[derive(Clone, Copy)]
struct Origin<'a> {
    params: &'a Params,
    traits: &'a Traits,
    kind: Kind,
    seed: u64,
    tick: Seconds,
    plant: &'a plant::cart_pole::Params,
}

/// The cart-pole in a predictor's head: it rolls the late state on to now.
#[derive(Clone, Debug)]
struct Model {
    plant: plant::cart_pole::CartPole,
    steps: u32,
    /// A step in ticks; all steps together make the delay.
    step_ticks: f64,
}

impl Model {
    fn new(
        plant: &plant::cart_pole::Params,
        length_factor: f64,
        delay: f64,
        tick: Seconds,
    ) -> Self {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small count of ticks, at least 0"
        )]
        let steps = (delay / tick.0).ceil() as u32;
        let step = delay / f64::from(steps.max(1));
        let imagined = plant::cart_pole::Params {
            pole_length_m: plant.pole_length_m * length_factor,
            friction_noise_per_s: 0.0,
            // Nobody imagines motion finer than they can see it.
            substeps: 1,
            ..plant.clone()
        };
        Self {
            plant: plant::cart_pole::CartPole::new(imagined, Seconds(step)),
            steps,
            step_ticks: step / tick.0,
        }
    }

    /// The state now, from the state as it was and the forces given since.
    fn foresee(&mut self, past: [f64; 4], done: &DelayLine<1>) -> [f64; 4] {
        let mut state = State::new(past);
        for step in 0..self.steps {
            // The newest force acted during the last tick; a step takes the force that
            // acted in its middle.
            let age = (f64::from(self.steps - step) - 0.5) * self.step_ticks;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a small count of ticks, at least 0"
            )]
            let [force] = done.back(age as usize);
            state = self.plant.step(&state, Action(force));
        }
        <[f64; 4]>::try_from(&state[..]).unwrap_or(past)
    }
}

impl Simulated {
    /// An operator of `kind` and `skill` for a cart-pole with the parameters `plant` that
    /// is controlled every `tick`. `seed` decides the personal traits and all noise.
    #[must_use]
    pub fn new(
        params: &Params,
        skill: Skill,
        kind: Kind,
        seed: u64,
        tick: Seconds,
        plant: &plant::cart_pole::Params,
    ) -> Self {
        let traits = Traits::draw(params, skill, seed);
        let longest =
            traits.delay(traits.skill_first, params).max(traits.delay(traits.skill_last, params));
        let origin = Origin { params, traits: &traits, kind, seed, tick, plant };
        Self {
            mind: Mind::new(&origin, Place::default(), 0),
            seen: DelayLine::reaching(longest / tick.0),
            done: DelayLine::reaching(longest / tick.0),
            params: params.clone(),
            kind,
            seed,
            tick,
            plant: plant.clone(),
            traits,
        }
    }

    /// What the operator believes the state to be.
    fn perceive(&mut self) -> [f64; 4] {
        let mind = &mut self.mind;
        let mut state = self.seen.at(mind.delay_ticks);
        state[2] += mind.theta_noise * mind.theta_error.next(&mut mind.rng);
        state[3] += mind.theta_dot_noise * mind.theta_dot_error.next(&mut mind.rng);
        match &mut mind.model {
            Some(model) => model.foresee(state, &self.done),
            None => state,
        }
    }

    /// The force that the operator's law asks for.
    fn judge(&self, [x, x_dot, theta, theta_dot]: [f64; 4]) -> f64 {
        let [x_gain, x_dot_gain, theta_gain, theta_dot_gain] = self.mind.gains;
        let tilt = theta - theta.clamp(-self.mind.dead_zone, self.mind.dead_zone);
        theta_gain * tilt + theta_dot_gain * theta_dot + x_gain * x + x_dot_gain * x_dot
    }

    /// The force as the kind's habit turns it.
    fn apply_habit(&mut self, force: f64) -> f64 {
        let (p, mind) = (&self.params, &mut self.mind);
        match self.kind {
            Kind::DelayedPd | Kind::Predictor | Kind::MouseLimited => force,
            Kind::Intermittent => {
                mind.left -= self.tick.0;
                if mind.left <= 0.0 {
                    let (shortest, longest) = p.decision_hold_s;
                    mind.left = shortest + (longest - shortest) * mind.rng.random::<f64>();
                    mind.decision = force;
                }
                mind.decision
            }
            Kind::BangBang if force.abs() > p.bang_threshold_n => force.signum() * p.bang_force_n,
            Kind::BangBang => 0.0,
            Kind::Lapses => {
                mind.left -= self.tick.0;
                if mind.left <= 0.0 && mind.rng.random::<f64>() < mind.lapse_chance {
                    mind.left = p.lapse_s;
                }
                if mind.left > 0.0 { -force } else { force }
            }
        }
    }

    /// The force that arrives at the device.
    fn hand(&mut self, wanted: f64) -> f64 {
        let mind = &mut self.mind;
        let noisy = wanted * (1.0 + mind.motor_fraction * normal(&mut mind.rng))
            + mind.motor_noise * mind.tremor.next(&mut mind.rng);
        let moved = mind.hand.follow(noisy);
        let kept = match self.kind {
            Kind::MouseLimited => moved - mind.sustained.follow(moved),
            _ => moved,
        };
        kept.clamp(-self.plant.force_limit_n, self.plant.force_limit_n)
    }
}

impl Operator for Simulated {
    fn begin(&mut self, place: Place, practice: u32) {
        let origin = Origin {
            params: &self.params,
            traits: &self.traits,
            kind: self.kind,
            seed: self.seed,
            tick: self.tick,
            plant: &self.plant,
        };
        self.mind = Mind::new(&origin, place, practice);
        self.seen.clear();
        self.done.clear();
    }

    fn intent(&mut self, view: View<'_>) -> Intent {
        let Ok(state) = <[f64; 4]>::try_from(&view.state[..]) else { return Intent::Absent };
        self.seen.push(state);
        let believed = self.perceive();
        let wanted = self.judge(believed);
        let wanted = self.apply_habit(wanted);
        let force = self.hand(wanted);
        self.done.push([force]);
        Intent::fresh(force)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: Seconds = Seconds(0.02);

    /// Balance times in s of `rollouts` rollouts after `practice` others.
    fn balance_times(skill: Skill, kind: Kind, seed: u64, rollouts: u32) -> Vec<f64> {
        let plant = plant::cart_pole::Params::default();
        let mut operator = Simulated::new(&Params::default(), skill, kind, seed, TICK, &plant);
        let mut cart_pole = plant::cart_pole::CartPole::new(plant, TICK);
        (1..=rollouts)
            .map(|rollout| {
                let place = Place { phase: 2, rollout, attempt: 0 };
                cart_pole.reseed(stream(seed, Purpose::Friction, place));
                operator.begin(place, 20 + rollout - 1);
                let release = stream(seed, Purpose::Starts, place).random_range(-5.0..=5.0_f64);
                let mut state = State::new([0.0, 0.0, release.to_radians(), 0.0]);
                for tick in -150..1000 {
                    let view = View {
                        state: &state,
                        now: Seconds(0.0),
                        rollout_time: TICK * f64::from(tick),
                    };
                    let action = operator.intent(view).action();
                    if tick >= 0 {
                        state = cart_pole.step(&state, action);
                    }
                    if state[2].abs() > 30_f64.to_radians() {
                        return f64::from(tick + 1) * TICK.0;
                    }
                }
                20.0
            })
            .collect()
    }

    fn mean(values: &[f64]) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "few values")]
        let count = values.len() as f64;
        values.iter().sum::<f64>() / count
    }

    /// Means of the first and the last ten of 100 rollouts after 20 of practice, over
    /// operators.
    fn first_and_last_ten(skill: Skill, kind: Kind, operators: u64) -> (f64, f64) {
        let (first, last): (Vec<f64>, Vec<f64>) = (1..=operators)
            .map(|seed| balance_times(skill, kind, seed, 100))
            .map(|times| (mean(&times[..10]), mean(&times[90..])))
            .unzip();
        (mean(&first), mean(&last))
    }

    #[test]
    fn balance_times_are_those_of_people() {
        for kind in [Kind::DelayedPd, Kind::Predictor] {
            let (naive_first, naive_last) = first_and_last_ten(Skill::Naive, kind, 8);
            let (_, average_last) = first_and_last_ten(Skill::Average, kind, 8);
            let (_, expert_last) = first_and_last_ten(Skill::Expert, kind, 8);
            assert!((1.0..2.0).contains(&naive_first), "{kind}: {naive_first}");
            assert!((1.5..3.0).contains(&naive_last), "{kind}: {naive_last}");
            assert!((3.5..8.0).contains(&expert_last), "{kind}: {expert_last}");
            assert!(naive_first < naive_last, "practice helps");
            assert!(naive_last < average_last && average_last < expert_last, "{kind}");
        }
    }

    /// The first 400 actions of a rollout with the given seed at `place`.
    fn actions(operator: &mut Simulated, place: Place) -> Vec<f64> {
        operator.begin(place, 30);
        let mut plant = plant::cart_pole::CartPole::new(operator.plant.clone(), TICK);
        let mut state = State::new([0.0, 0.0, 0.05, 0.0]);
        (0..400)
            .map(|_| {
                let view = View { state: &state, now: TICK, rollout_time: TICK };
                let action = operator.intent(view).action();
                state = plant.step(&state, action);
                action.0
            })
            .collect()
    }

    #[test]
    fn actions_repeat_by_seed_and_place_stay_within_the_limit_and_forget_the_rollout_before() {
        let plant = plant::cart_pole::Params { force_limit_n: 2.0, ..Default::default() };
        for kind in Kind::ALL {
            let make =
                |seed| Simulated::new(&Params::default(), Skill::Naive, kind, seed, TICK, &plant);
            let place = |rollout| Place { phase: 1, rollout, attempt: 0 };
            let mut operator = make(5);
            let seventh = actions(&mut operator, place(7));
            assert!(seventh.iter().all(|force| force.abs() <= 2.0), "{kind}");
            assert!(seventh.iter().any(|force| *force != 0.0), "{kind}");
            assert_ne!(seventh, actions(&mut operator, place(8)), "{kind}");
            assert_eq!(seventh, actions(&mut operator, place(7)), "{kind}");
            assert_eq!(seventh, actions(&mut make(5), place(7)), "{kind}");
            assert_ne!(seventh, actions(&mut make(6), place(7)), "{kind}");
        }
    }

    #[test]
    fn a_noiseless_predictor_with_a_true_model_foresees_the_present() {
        let params = plant::cart_pole::Params {
            friction_noise_per_s: 0.0,
            substeps: 1,
            ..Default::default()
        };
        let mut model = Model::new(&params, 1.0, 0.2, TICK);
        let mut plant = plant::cart_pole::CartPole::new(params, TICK);
        let mut done = DelayLine::reaching(10.0);
        let mut seen = DelayLine::reaching(10.0);
        let mut state = State::new([0.0, 0.0, 0.05, 0.0]);
        for k in 0..40 {
            seen.push(<[f64; 4]>::try_from(&state[..]).unwrap());
            if k >= 10 {
                let foreseen = model.foresee(seen.at(10.0), &done);
                for (foreseen, true_value) in foreseen.iter().zip(&state[..]) {
                    assert!((foreseen - true_value).abs() < 1e-12, "{foreseen} {true_value}");
                }
            }
            let force = if k % 7 < 3 { 3.0 } else { -2.0 };
            done.push([force]);
            state = plant.step(&state, Action(force));
        }
    }

    #[test]
    fn a_mouse_cannot_sustain_a_force_and_bang_bang_knows_three() {
        let calm = Params {
            motor_noise_n: (0.0, 0.0),
            motor_noise_fraction: (0.0, 0.0),
            theta_noise_deg: (0.0, 0.0),
            theta_dot_noise_deg_s: (0.0, 0.0),
            lag_s: 0.0,
            ..Params::default()
        };
        let plant = plant::cart_pole::Params::default();
        let held = State::new([0.0, 0.0, 0.3, 0.0]);
        let late_force = |kind| {
            let mut operator = Simulated::new(&calm, Skill::Expert, kind, 3, TICK, &plant);
            operator.begin(Place::default(), 0);
            let view = View { state: &held, now: TICK, rollout_time: TICK };
            (0..500).map(|_| operator.intent(view).action().0).last().unwrap()
        };
        assert!(late_force(Kind::DelayedPd) > 2.0);
        assert!(late_force(Kind::MouseLimited).abs() < 0.01);
        assert_eq!(late_force(Kind::BangBang), 3.0);
    }

    #[test]
    fn practice_moves_skill_from_its_first_to_its_last_value() {
        let params = Params::default();
        let traits = Traits::draw(&params, Skill::Naive, 1);
        assert!((traits.skill(0, &params) - 0.05).abs() < 1e-12);
        let after_40 = traits.skill_last + (0.05 - traits.skill_last) / std::f64::consts::E;
        assert!((traits.skill(40, &params) - after_40).abs() < 1e-12);
        assert!((Traits::draw(&params, Skill::Expert, 1).skill(10, &params) - 1.2).abs() < 1e-12);
    }
}
