//! A person, whatever is steered: skill that grows, late eyes, a slow and trembling hand.
//!
//! Eyes (delay) → judgement (what the task asks for, with noise of its own) → habit → hand
//! (motor noise, lag, limit). The judgement is a task's; all else is here.

mod foresight;
mod params;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

pub(super) use foresight::Foresight;
pub use params::Params;

use super::filters::{DelayLine, Lag, Wander, normal};
use super::{BySkill, Growth, Kind};
use crate::operator::{Practice, View};
use crate::random::{Place, Purpose, stream};
use crate::signal::{Intent, Seconds};

/// What lies between eyes and hand in one task, for states of `N` numbers.
pub(super) trait Judgement<const N: usize> {
    /// A rollout begins; nothing of the one before is left.
    fn begin(&mut self, rng: &mut ChaCha8Rng);

    /// The skill, and how late the state is seen, from now on.
    fn renew(&mut self, skill: f64, delay: Seconds);

    /// The numbers by which it remembers what was before the rollout, where one goes on
    /// from another.
    fn numbers(&mut self) -> Vec<&mut f64>;

    /// What the person decides on, from the state as it was a delay ago and what the hand
    /// did since. Habits act on this.
    fn wish(&mut self, past: [f64; N], done: &DelayLine<1>, rng: &mut ChaCha8Rng) -> f64;

    /// The action by which the hand follows the decision.
    fn act(&self, wish: f64) -> f64 {
        wish
    }
}

/// After how much steering the distance to the last skill has shrunk to 1/e.
#[derive(Clone, Copy, Debug)]
pub(super) enum Span {
    /// A count of rollouts: the skill is constant within each.
    Rollouts(f64),
    /// Steered time: the skill grows within rollouts, too, once a second.
    Time(Seconds),
}

/// A person's numbers in one task; wishes and actions are in the task's units.
#[derive(Clone, Debug)]
pub(super) struct Character {
    pub(super) growth: Growth,
    pub(super) span: Span,
    pub(super) delay_s: BySkill,
    pub(super) delay_sd_s: f64,
    pub(super) trait_sd: f64,
    pub(super) noise_correlation_s: f64,
    pub(super) lag_s: f64,
    pub(super) motor_noise_fraction: BySkill,
    /// Standard deviation of the wandering motor noise.
    pub(super) motor_noise: BySkill,
    pub(super) decision_hold_s: (f64, f64),
    /// The wish of a bang-bang person's push, and the wishes that are none.
    pub(super) bang: f64,
    pub(super) bang_threshold: f64,
    pub(super) travel_s: f64,
    pub(super) lapses_per_s: BySkill,
    pub(super) lapse_s: f64,
    /// The largest action.
    pub(super) limit: f64,
}

/// What stays the same in a person's life, apart from the judgement's factors.
#[derive(Clone, Debug)]
struct Traits {
    skill_last: f64,
    extra_delay: f64,
    motor_fraction: f64,
    motor_noise: f64,
}

impl Traits {
    /// The skill after `practice`.
    fn skill(&self, practice: Practice, character: &Character) -> f64 {
        let spans = match character.span {
            Span::Rollouts(rollouts) => f64::from(practice.rollouts) / rollouts,
            Span::Time(time) => practice.time.0 / time.0,
        };
        self.skill_last + (character.growth.skill_first - self.skill_last) * (-spans).exp()
    }

    fn delay(&self, skill: f64, character: &Character) -> f64 {
        (at(character.delay_s, skill) + self.extra_delay).max(0.0)
    }
}

/// The line through the values at skill 0 and 1.
pub(super) fn at((first, second): BySkill, skill: f64) -> f64 {
    first + (second - first) * skill
}

/// The same for what cannot be negative.
pub(super) fn at_least_0(values: BySkill, skill: f64) -> f64 {
    at(values, skill).max(0.0)
}

/// Draws a person's factors on the common values.
pub(super) struct Factors {
    rng: ChaCha8Rng,
    spread: f64,
    sd: f64,
}

impl Factors {
    /// A factor whose logarithm has the common standard deviation.
    pub(super) fn next(&mut self) -> f64 {
        self.with(self.sd)
    }

    /// A factor whose logarithm has the standard deviation `sd`.
    pub(super) fn with(&mut self, sd: f64) -> f64 {
        (self.spread * sd * normal(&mut self.rng)).exp()
    }
}

/// Eyes and hand within one rollout.
#[derive(Clone, Debug)]
struct Body {
    rng: ChaCha8Rng,
    delay_ticks: f64,
    motor_fraction: f64,
    motor_noise: f64,
    lapse_chance: f64,
    tremor: Wander,
    hand: Lag,
    sustained: Lag,
    /// Until when a decision (`intermittent`) or a lapse holds, s left.
    left: f64,
    decision: f64,
}

/// A simulated person with the judgement `J`.
///
/// Equal parameters, seed, rollouts and practice give equal actions, bit for bit.
#[derive(Clone, Debug)]
pub(super) struct Person<const N: usize, J> {
    character: Character,
    kind: Kind,
    seed: u64,
    tick: Seconds,
    traits: Traits,
    judgement: J,
    body: Body,
    seen: DelayLine<N>,
    done: DelayLine<1>,
    /// Practice before this rollout, and the whole seconds of this one that count already.
    practice: Practice,
    counted: f64,
}

impl<const N: usize, J: Judgement<N>> Person<N, J> {
    /// A person of `kind` who acts every `tick`. `seed` decides the personal traits and all
    /// noise; `judgement` is made with the factors that it draws.
    pub(super) fn new(
        character: Character,
        kind: Kind,
        seed: u64,
        tick: Seconds,
        judgement: impl FnOnce(&mut Factors) -> J,
    ) -> Self {
        let mut rng = stream(seed, Purpose::OperatorTraits, Place::default());
        let growth = character.growth;
        let spread = growth.trait_spread;
        // The order of these draws is part of what a seed means.
        let skill_last = growth.skill_last + growth.skill_last_sd * normal(&mut rng);
        let extra_delay = spread * character.delay_sd_s * normal(&mut rng);
        let mut factors = Factors { rng, spread, sd: character.trait_sd };
        let judgement = judgement(&mut factors);
        let (motor_fraction, motor_noise) = (factors.next(), factors.next());
        let traits = Traits { skill_last, extra_delay, motor_fraction, motor_noise };
        let longest =
            traits.delay(growth.skill_first, &character).max(traits.delay(skill_last, &character));
        let body = Body {
            rng: stream(seed, Purpose::OperatorNoise, Place::default()),
            delay_ticks: 0.0,
            motor_fraction: 0.0,
            motor_noise: 0.0,
            lapse_chance: 0.0,
            tremor: Wander::still(character.noise_correlation_s, tick),
            hand: Lag::new(character.lag_s, tick),
            sustained: Lag::new(character.travel_s, tick),
            left: 0.0,
            decision: 0.0,
        };
        let mut person = Self {
            character,
            kind,
            seed,
            tick,
            traits,
            judgement,
            body,
            seen: DelayLine::reaching(longest / tick.0),
            done: DelayLine::reaching(longest / tick.0),
            practice: Practice::default(),
            counted: 0.0,
        };
        person.begin(Place::default(), Practice::default());
        person
    }

    /// See [`Operator::begin`](crate::operator::Operator::begin).
    pub(super) fn begin(&mut self, place: Place, practice: Practice) {
        let body = &mut self.body;
        body.rng = stream(self.seed, Purpose::OperatorNoise, place);
        self.judgement.begin(&mut body.rng);
        body.tremor.restart(&mut body.rng);
        body.hand = Lag::new(self.character.lag_s, self.tick);
        body.sustained = Lag::new(self.character.travel_s, self.tick);
        body.left = 0.0;
        body.decision = 0.0;
        self.seen.clear();
        self.done.clear();
        self.practice = practice;
        self.counted = 0.0;
        self.renew(practice);
    }

    /// See [`Operator::intent`](crate::operator::Operator::intent).
    pub(super) fn intent(&mut self, view: View<'_>) -> Intent {
        let Ok(state) = <[f64; N]>::try_from(&view.state[..]) else { return Intent::Absent };
        self.practise(view.rollout_time);
        self.seen.push(state);
        let past = self.seen.at(self.body.delay_ticks);
        let wish = self.judgement.wish(past, &self.done, &mut self.body.rng);
        let wish = self.apply_habit(wish);
        let action = self.hand(self.judgement.act(wish));
        self.done.push([action]);
        Intent::fresh(action)
    }

    /// See [`Operator::memory`](crate::operator::Operator::memory).
    pub(super) fn memory(&mut self) -> Vec<f64> {
        self.numbers().into_iter().map(|number| *number).collect()
    }

    /// See [`Operator::go_on`](crate::operator::Operator::go_on). The chance is that of the
    /// new rollout; a memory of somebody else's is none.
    pub(super) fn go_on(&mut self, memory: &[f64]) {
        let numbers = self.numbers();
        if numbers.len() == memory.len() {
            for (number, remembered) in numbers.into_iter().zip(memory) {
                *number = *remembered;
            }
        }
    }

    /// All that eyes, head and hand remember.
    fn numbers(&mut self) -> Vec<&mut f64> {
        let body = &mut self.body;
        let mut numbers = self.judgement.numbers();
        numbers.extend([
            body.tremor.number(),
            body.hand.number(),
            body.sustained.number(),
            &mut body.left,
            &mut body.decision,
        ]);
        numbers.extend(self.seen.numbers());
        numbers.extend(self.done.numbers());
        numbers
    }

    /// Lets the skill grow with the time steered. It depends on nothing but the practice
    /// before the rollout and the time within, so that a resumed session repeats it.
    fn practise(&mut self, rollout_time: Seconds) {
        let whole = rollout_time.0.floor();
        if matches!(self.character.span, Span::Time(_)) && whole > self.counted {
            self.counted = whole;
            let time = self.practice.time + Seconds(whole);
            self.renew(Practice { time, ..self.practice });
        }
    }

    /// Sets what depends on skill.
    fn renew(&mut self, practice: Practice) {
        let (c, traits, body) = (&self.character, &self.traits, &mut self.body);
        let skill = traits.skill(practice, c);
        let delay = traits.delay(skill, c);
        body.delay_ticks = delay / self.tick.0;
        body.motor_fraction = traits.motor_fraction * at_least_0(c.motor_noise_fraction, skill);
        body.motor_noise = traits.motor_noise * at_least_0(c.motor_noise, skill);
        body.lapse_chance = at_least_0(c.lapses_per_s, skill) * self.tick.0;
        self.judgement.renew(skill, Seconds(delay));
    }

    /// The wish as the kind's habit turns it.
    fn apply_habit(&mut self, wish: f64) -> f64 {
        let (c, body) = (&self.character, &mut self.body);
        match self.kind {
            Kind::DelayedPd | Kind::Predictor | Kind::MouseLimited => wish,
            Kind::Intermittent => {
                body.left -= self.tick.0;
                if body.left <= 0.0 {
                    let (shortest, longest) = c.decision_hold_s;
                    body.left = shortest + (longest - shortest) * body.rng.random::<f64>();
                    body.decision = wish;
                }
                body.decision
            }
            Kind::BangBang if wish.abs() > c.bang_threshold => wish.signum() * c.bang,
            Kind::BangBang => 0.0,
            Kind::Lapses => {
                body.left -= self.tick.0;
                if body.left <= 0.0 && body.rng.random::<f64>() < body.lapse_chance {
                    body.left = c.lapse_s;
                }
                if body.left > 0.0 { -wish } else { wish }
            }
        }
    }

    /// The action that arrives at the device.
    fn hand(&mut self, wanted: f64) -> f64 {
        let body = &mut self.body;
        let noisy = wanted * (1.0 + body.motor_fraction * normal(&mut body.rng))
            + body.motor_noise * body.tremor.next(&mut body.rng);
        let moved = body.hand.follow(noisy);
        let kept = match self.kind {
            Kind::MouseLimited => moved - body.sustained.follow(moved),
            _ => moved,
        };
        kept.clamp(-self.character.limit, self.character.limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::simulated::{Skill, cart_pole};
    use crate::signal::State;

    const TICK: Seconds = Seconds(0.02);

    /// Wishes for its skill, so that a noiseless hand shows it.
    struct Mirror(f64);

    impl Judgement<1> for Mirror {
        fn begin(&mut self, _rng: &mut ChaCha8Rng) {}

        fn renew(&mut self, skill: f64, _delay: Seconds) {
            self.0 = skill;
        }

        fn numbers(&mut self) -> Vec<&mut f64> {
            Vec::new()
        }

        fn wish(&mut self, _: [f64; 1], _: &DelayLine<1>, _: &mut ChaCha8Rng) -> f64 {
            self.0
        }
    }

    fn calm() -> Params {
        Params {
            motor_noise_fraction: (0.0, 0.0),
            motor_noise: (0.0, 0.0),
            lag_s: 0.0,
            skill_last_sd: (0.0, 0.0, 0.0),
            ..Params::default()
        }
    }

    fn mirror(character: Character) -> Person<1, Mirror> {
        Person::new(character, Kind::DelayedPd, 1, TICK, |_| Mirror(0.0))
    }

    fn shown_at(person: &mut Person<1, Mirror>, rollout_time: f64) -> f64 {
        let state = State::new([0.0]);
        let rollout_time = Seconds(rollout_time);
        person.intent(View { state: &state, now: rollout_time, rollout_time }).action().0
    }

    #[test]
    fn skill_grows_with_steered_time_within_a_rollout_and_over_rollouts() {
        let params = calm();
        let mut person = mirror(params.character(Skill::Naive, 1.0, 10.0));
        let skill = |t: f64| 0.7 + (0.05 - 0.7) * (-t / params.practice_s).exp();
        person.begin(Place::default(), Practice { rollouts: 3, time: Seconds(100.0) });
        for (rollout_time, counts) in
            [(-3.0, 100.0), (0.0, 100.0), (0.98, 100.0), (1.0, 101.0), (57.5, 157.0)]
        {
            let shown = shown_at(&mut person, rollout_time);
            assert!((shown - skill(counts)).abs() < 1e-12, "{rollout_time}: {shown}");
        }
        // The next rollout goes on from the practice it is told of, not from memory.
        person.begin(Place::default(), Practice { rollouts: 4, time: Seconds(100.0) });
        assert!((shown_at(&mut person, 0.0) - skill(100.0)).abs() < 1e-12);
    }

    #[test]
    fn skill_by_rollouts_is_constant_within_them() {
        let params = cart_pole::Params {
            motor_noise_fraction: (0.0, 0.0),
            motor_noise_n: (0.0, 0.0),
            lag_s: 0.0,
            skill_last_sd: (0.0, 0.0, 0.0),
            ..cart_pole::Params::default()
        };
        let mut person = mirror(params.character(Skill::Naive, 10.0));
        for (rollouts, left) in [(0, 1.0), (40, (-1.0_f64).exp())] {
            person.begin(Place::default(), Practice { rollouts, time: Seconds(1e4) });
            for rollout_time in [0.0, 500.0] {
                let shown = shown_at(&mut person, rollout_time);
                assert!((shown - (0.7 - 0.65 * left)).abs() < 1e-12, "{rollouts}: {shown}");
            }
        }
    }

    /// Does what it sees, late.
    struct Echo;

    impl Judgement<1> for Echo {
        fn begin(&mut self, _rng: &mut ChaCha8Rng) {}

        fn renew(&mut self, _skill: f64, _delay: Seconds) {}

        fn numbers(&mut self) -> Vec<&mut f64> {
            Vec::new()
        }

        fn wish(&mut self, past: [f64; 1], _: &DelayLine<1>, _: &mut ChaCha8Rng) -> f64 {
            past[0]
        }
    }

    /// Chance apart, nobody could tell from the actions where one rollout ended and the next
    /// one began.
    #[test]
    fn a_person_whose_rollout_goes_on_remembers_what_was_before() {
        let params = Params { lag_s: 0.1, ..calm() };
        for kind in [Kind::DelayedPd, Kind::MouseLimited] {
            let make = || {
                let character = params.character(Skill::Average, 1.0, 1e6);
                let mut person = Person::new(character, kind, 1, TICK, |_| Echo);
                person.begin(Place::default(), Practice::default());
                person
            };
            let act = |person: &mut Person<1, Echo>, k: u32| {
                let state = State::new([f64::from(k * k)]);
                let zero = Seconds(0.0);
                person.intent(View { state: &state, now: zero, rollout_time: zero }).action().0
            };
            let (mut whole, mut first, mut second) = (make(), make(), make());
            for k in 0..31 {
                assert_eq!(act(&mut whole, k), act(&mut first, k));
            }
            second.begin(Place { rollout: 2, ..Place::default() }, Practice::default());
            second.go_on(&first.memory());
            second.go_on(&[1.0, 2.0]); // somebody else's
            for k in 31..60 {
                assert_eq!(act(&mut second, k), act(&mut whole, k), "{kind} {k}");
            }
        }
    }

    #[test]
    fn an_expert_has_nothing_to_learn() {
        let mut person = mirror(calm().character(Skill::Expert, 1.0, 10.0));
        for time in [0.0, 1e6] {
            person.begin(Place::default(), Practice { rollouts: 0, time: Seconds(time) });
            assert!((shown_at(&mut person, 0.0) - 1.2).abs() < 1e-12);
        }
    }

    #[test]
    fn the_defaults_pass() {
        use crate::check::{Check, Checker};
        let mut faults = Vec::new();
        Params::default().check(&mut Checker::new(&mut faults));
        assert_eq!(faults, []);
    }
}
