//! Speed-up: roll the ball back and forth as fast as possible without running over the ends
//! (thesis 3.3).

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::{Occasion, OwnScale, Tally, Task, steps_of};
use crate::check::{Check, Checker};
use crate::plant::ball_beam::{self, BallBeam};
use crate::sharing::region::{Region, Scale};
use crate::signal::{End, Features, Seconds, State, Tallied};

/// The rules of the speed-up task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// A steered rollout is this long, s.
    pub rollout_s: f64,
    /// A test of the robot alone, or of nobody, is this long, s.
    pub test_s: f64,
    /// Beyond ± this distance the ball has run over a limit: `x_max` of eq. 27, m.
    pub limit_m: f64,
    /// A mean reward of this is success 0: `R_min` of eq. 28, m/s,
    pub reward_min_m_s: f64,
    /// and one of this is success 1: `R_threshold`, m/s.
    pub reward_threshold_m_s: f64,
    /// `R_threshold` as a part of the operator's own mean reward in introduction, where
    /// there was one; `None`: the constant above (ours).
    pub threshold_of_own: Option<f64>,
    /// But `R_threshold` is at least this, m/s.
    pub threshold_least_m_s: f64,
    /// Whether the learner sees θ̇, too (eq. 26).
    pub use_theta_dot: bool,
    /// Every other test begins with the ball rolling this fast, to one side and the other
    /// in turn, m/s;
    pub test_push_m_s: f64,
    /// the rest begin with it at rest this far from the middle, m.
    pub test_rest_m: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            rollout_s: 20.0,
            test_s: 30.0,
            limit_m: 0.17,
            reward_min_m_s: 0.0,
            reward_threshold_m_s: 0.10,
            threshold_of_own: None,
            threshold_least_m_s: 0.05,
            use_theta_dot: false,
            test_push_m_s: 0.05,
            test_rest_m: 0.02,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.range("rollout_s", self.rollout_s, 1.0..=3600.0);
        c.range("test_s", self.test_s, 1.0..=3600.0);
        c.range("limit_m", self.limit_m, 0.001..=10.0);
        c.range("reward_min_m_s", self.reward_min_m_s, -10.0..=10.0);
        c.range("reward_threshold_m_s", self.reward_threshold_m_s, -10.0..=10.0);
        c.demand(
            self.reward_threshold_m_s > self.reward_min_m_s,
            "reward_threshold_m_s",
            self.reward_threshold_m_s,
            "above reward_min_m_s, where success is 0",
        );
        if let Some(part) = self.threshold_of_own {
            c.range("threshold_of_own", part, 0.01..=10.0);
            c.demand(
                self.threshold_least_m_s > self.reward_min_m_s,
                "threshold_least_m_s",
                self.threshold_least_m_s,
                "above reward_min_m_s, where success is 0",
            );
        }
        c.range("threshold_least_m_s", self.threshold_least_m_s, -10.0..=10.0);
        c.range("test_push_m_s", self.test_push_m_s, 0.0..=1.0);
        c.range("test_rest_m", self.test_rest_m, 0.0..=1.0);
    }
}

/// The speed-up task on a ball and beam.
#[derive(Clone, Debug)]
pub struct SpeedUp {
    rules: Params,
    rollout_steps: u32,
    test_steps: u32,
    region: [Region; 1],
    half_length: f64,
    voltage_limit: f64,
}

impl SpeedUp {
    /// The name outside.
    pub const NAME: &'static str = "speed-up";
    /// The names of what a rollout is measured by.
    pub const TALLY: [&'static str; 2] = ["mean_speed", "end_hits"];

    /// The task with ticks of `tick` on the given plant.
    #[must_use]
    pub fn new(rules: &Params, plant: &ball_beam::Params, tick: Seconds) -> Self {
        let scale = Scale { minimum: rules.reward_min_m_s, threshold: rules.reward_threshold_m_s };
        Self {
            rules: rules.clone(),
            rollout_steps: steps_of(rules.rollout_s, tick),
            test_steps: steps_of(rules.test_s, tick),
            region: [Region { name: "all", scale }],
            half_length: plant.beam_half_length_m,
            voltage_limit: plant.voltage_limit_v,
        }
    }

    /// The ball at `x` with the speed `x_dot` on a level beam.
    fn level(x: f64, x_dot: f64) -> State {
        State::new([x, x_dot, 0.0, 0.0])
    }
}

impl Task for SpeedUp {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn columns(&self) -> &'static [&'static str] {
        &BallBeam::COLUMNS
    }

    /// Without θ̇, unless it is asked for: the servo follows faster than a control step.
    fn features(&self, state: &State) -> Features {
        let seen = self.feature_names().len().min(state.len());
        Features::from_slice(&state[..seen]).unwrap_or_default()
    }

    fn feature_names(&self) -> &'static [&'static str] {
        let all = &BallBeam::COLUMNS;
        if self.rules.use_theta_dot { all } else { &all[..3] }
    }

    /// A person starts with the ball at rest in the middle; a test with a push drawn within
    /// ± the set one.
    fn random_start(&self, occasion: Occasion, chance: &mut ChaCha8Rng) -> State {
        let push = self.rules.test_push_m_s;
        Self::level(
            0.0,
            match occasion {
                Occasion::Tested if push > 0.0 => chance.random_range(-push..=push),
                _ => 0.0,
            },
        )
    }

    /// With a push and from rest in turn, each to one side and the other in turn: many
    /// policies never start from rest.
    fn grid_start(&self, index: u32, _count: u32) -> State {
        let side = if (index / 2).is_multiple_of(2) { 1.0 } else { -1.0 };
        if index.is_multiple_of(2) {
            Self::level(0.0, side * self.rules.test_push_m_s)
        } else {
            Self::level(side * self.rules.test_rest_m, 0.0)
        }
    }

    /// The push, m/s: 0 for a start from rest.
    fn start_value(&self, start: &State) -> f64 {
        start.get(1).copied().unwrap_or(0.0)
    }

    /// Eq. 27: the ball's speed, less one for each limit it is beyond.
    fn reward(&self, state: &State, _next: &State) -> f64 {
        let outside = is_outside(state, self.rules.limit_m);
        speed(state) - if outside { 1.0 } else { 0.0 }
    }

    /// The reward in units of the threshold, the wrong way round.
    fn cost(&self, state: &State) -> f64 {
        let unit = self.rules.reward_threshold_m_s - self.rules.reward_min_m_s;
        -self.reward(state, state) / unit
    }

    fn longest(&self, occasion: Occasion) -> u32 {
        match occasion {
            Occasion::Taught => self.rollout_steps,
            Occasion::Tested => self.test_steps,
        }
    }

    fn end(&self, state: &State, steps: u32, occasion: Occasion) -> Option<End> {
        let all = self.longest(occasion);
        if state.is_finite() { (steps >= all).then_some(End::Cap) } else { Some(End::Failed) }
    }

    fn regions(&self) -> &[Region] {
        &self.region
    }

    fn region(&self, _state: &State) -> usize {
        0
    }

    fn own_scale(&self, practised: Option<f64>) -> Option<OwnScale> {
        let rules = &self.rules;
        let part = rules.threshold_of_own?;
        let (threshold, why) = match practised {
            None => {
                let constant = rules.reward_threshold_m_s;
                (constant, "the constant: there was no introduction".to_owned())
            }
            // Else who hardly moved the ball in practice would hand over at once, for good.
            Some(mean) if part * mean < rules.threshold_least_m_s => {
                let least = rules.threshold_least_m_s;
                (least, format!("the least: introduction's was {mean}"))
            }
            Some(mean) => (part * mean, format!("{part} of introduction's, which was {mean}")),
        };
        let scale = Scale { minimum: rules.reward_min_m_s, threshold };
        Some(OwnScale {
            scale,
            why: format!("full success is a mean reward of {threshold} m/s, {why}"),
        })
    }

    fn tally_names(&self) -> &'static [&'static str] {
        &Self::TALLY
    }

    fn tally(&self) -> Box<dyn Tally> {
        Box::new(Speeds { limit: self.rules.limit_m, ..Speeds::default() })
    }

    fn ends(&self) -> Option<(f64, f64)> {
        Some((-self.half_length, self.half_length))
    }

    fn action_limit(&self) -> f64 {
        self.voltage_limit
    }
}

/// How fast the ball was, and how often it ran over a limit.
#[derive(Clone, Copy, Debug, Default)]
struct Speeds {
    limit: f64,
    steps: u32,
    sum: f64,
    hits: u32,
}

impl Tally for Speeds {
    fn step(&mut self, state: &State, next: &State) {
        self.steps += 1;
        self.sum += speed(state);
        let crosses = !is_outside(state, self.limit) && is_outside(next, self.limit);
        self.hits += u32::from(crosses);
    }

    fn tallied(&self) -> Tallied {
        Tallied::new([self.sum / f64::from(self.steps.max(1)), f64::from(self.hits)])
    }
}

/// |ẋ|, m/s.
fn speed(state: &State) -> f64 {
    state.get(1).copied().unwrap_or(0.0).abs()
}

/// Whether the ball is beyond a limit.
fn is_outside(state: &State, limit: f64) -> bool {
    state.first().copied().unwrap_or(0.0).abs() > limit
}

#[cfg(test)]
mod tests {
    use super::*;

    fn task(rules: &Params) -> SpeedUp {
        SpeedUp::new(rules, &ball_beam::Params::default(), Seconds(0.02))
    }

    fn at(x: f64, x_dot: f64) -> State {
        SpeedUp::level(x, x_dot)
    }

    #[test]
    fn reward_is_equation_27() {
        let task = task(&Params::default());
        let reward = |x, x_dot| task.reward(&at(x, x_dot), &at(0.0, 0.0));
        assert_eq!(reward(0.0, -0.2), 0.2);
        assert_eq!(reward(0.17, 0.2), 0.2);
        assert!((reward(-0.18, 0.2) + 0.8).abs() < 1e-15);
    }

    #[test]
    fn tests_begin_with_a_push_and_from_rest_on_both_sides() {
        let task = task(&Params::default());
        let starts: Vec<[f64; 2]> =
            (0..4).map(|k| task.grid_start(k, 4)).map(|s| [s[0], s[1]]).collect();
        assert_eq!(starts, [[0.0, 0.05], [0.02, 0.0], [0.0, -0.05], [-0.02, 0.0]]);
    }

    #[test]
    fn running_over_a_limit_counts_once_a_time() {
        let mut tally = task(&Params::default()).tally();
        for (from, to) in [(0.1, 0.18), (0.18, 0.2), (0.2, 0.1), (0.1, -0.2)] {
            tally.step(&at(from, 0.1), &at(to, 0.1));
        }
        assert_eq!(tally.tallied(), Tallied::new([0.1, 2.0]));
    }

    #[test]
    fn the_threshold_can_follow_the_operators_own_practice() {
        assert_eq!(task(&Params::default()).own_scale(Some(0.2)), None);
        let own = task(&Params { threshold_of_own: Some(0.8), ..Params::default() });
        for (practised, threshold, why) in [
            (Some(0.2), 0.16, "0.8 of introduction's"),
            (Some(0.001), 0.05, "the least"),
            (Some(-0.3), 0.05, "the least"),
            (None, 0.1, "no introduction"),
        ] {
            let found = own.own_scale(practised).unwrap();
            assert!((found.scale.threshold - threshold).abs() < 1e-15, "{found:?}");
            assert!(found.scale.minimum == 0.0 && found.why.contains(why), "{found:?}");
        }
    }

    #[test]
    fn the_servos_velocity_is_seen_on_request() {
        let state = State::new([0.1, 0.2, 0.3, 0.4]);
        let names = |use_theta_dot| {
            let task = task(&Params { use_theta_dot, ..Params::default() });
            (task.feature_names().len(), task.features(&state).len())
        };
        assert_eq!((names(false), names(true)), ((3, 3), (4, 4)));
    }
}
