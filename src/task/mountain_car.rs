//! Mountain car: an engine too weak for the hill must swing up to the flag (thesis 4.2.1).

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::{Occasion, Task};
use crate::check::{Check, Checker};
use crate::plant::mountain_car::{self, MountainCar as Plant};
use crate::sharing::region::{Region, Scale};
use crate::signal::{End, Features, State};

/// The rules of the mountain car, in the problem's own units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// A rollout that lasts this long is given up, steps.
    pub cap_steps: u32,
    /// Where the car starts, at rest.
    pub start_x: f64,
    /// A person's starts are drawn uniformly within ± this of it.
    pub start_spread: f64,
    /// The reward of a step,
    pub step_reward: f64,
    /// and of the one that reaches the flag in its place.
    pub goal_reward: f64,
    /// An episode whose mean reward is this is success 0 (eq. 35),
    pub reward_min: f64,
    /// and one whose mean reward is this is success 1.
    pub reward_threshold: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            cap_steps: 500,
            start_x: -0.7,
            start_spread: 0.0,
            step_reward: -1.0,
            goal_reward: 100.0,
            reward_min: -1.0,
            reward_threshold: 0.05,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.count("cap_steps", self.cap_steps, 1..=1_000_000);
        c.range("start_x", self.start_x, -10.0..=10.0);
        c.range("start_spread", self.start_spread, 0.0..=1.0);
        c.range("step_reward", self.step_reward, -1000.0..=1000.0);
        c.range("goal_reward", self.goal_reward, -1e6..=1e6);
        c.demand(
            self.goal_reward > self.step_reward,
            "goal_reward",
            self.goal_reward,
            "above step_reward, or the flag would be nothing to reach for",
        );
        c.range("reward_min", self.reward_min, -1000.0..=1000.0);
        c.range("reward_threshold", self.reward_threshold, -1000.0..=1000.0);
        c.demand(
            self.reward_threshold > self.reward_min,
            "reward_threshold",
            self.reward_threshold,
            "above reward_min, where success is 0",
        );
    }
}

/// The mountain-car task.
#[derive(Clone, Debug)]
pub struct MountainCar {
    rules: Params,
    plant: mountain_car::Params,
    region: [Region; 1],
}

impl MountainCar {
    /// The name outside.
    pub const NAME: &'static str = "mountain-car";

    /// The task on the given plant.
    #[must_use]
    pub fn new(rules: &Params, plant: &mountain_car::Params) -> Self {
        let scale = Scale { minimum: rules.reward_min, threshold: rules.reward_threshold };
        Self { rules: rules.clone(), plant: plant.clone(), region: [Region { name: "all", scale }] }
    }

    fn is_at_goal(&self, state: &State) -> bool {
        position(state) >= self.plant.goal
    }
}

impl Task for MountainCar {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn columns(&self) -> &'static [&'static str] {
        &Plant::COLUMNS
    }

    fn features(&self, state: &State) -> Features {
        Features::from_slice(state).unwrap_or_default()
    }

    fn feature_names(&self) -> &'static [&'static str] {
        &Plant::COLUMNS
    }

    /// A person's start is at rest near the set one; a test's is anywhere, at any speed.
    fn random_start(&self, occasion: Occasion, chance: &mut ChaCha8Rng) -> State {
        let mountain_car::Params { left_wall, goal, speed_limit, .. } = self.plant;
        match occasion {
            Occasion::Tested => State::new([
                chance.random_range(left_wall..goal),
                chance.random_range(-speed_limit..=speed_limit),
            ]),
            Occasion::Taught => {
                let spread = self.rules.start_spread;
                let aside = if spread > 0.0 { chance.random_range(-spread..=spread) } else { 0.0 };
                // Not beyond the wall, nor where the rollout would be over already.
                let x = (self.rules.start_x + aside).clamp(left_wall, goal - 0.01);
                State::new([x, 0.0])
            }
        }
    }

    /// The centres of as many cells of position × velocity: 15 × 16 for 240 (4.3). A single
    /// test is from the start that was trained.
    fn grid_start(&self, index: u32, count: u32) -> State {
        if count <= 1 {
            return State::new([self.rules.start_x, 0.0]);
        }
        let mountain_car::Params { left_wall, goal, speed_limit, .. } = self.plant;
        let across = (f64::from(count) * 15.0 / 16.0).sqrt().ceil();
        let up = (f64::from(count) / across).ceil();
        let (column, row) = (f64::from(index) % across, (f64::from(index) / across).floor());
        let centre =
            |cell: f64, cells: f64, from: f64, to: f64| from + (to - from) * (cell + 0.5) / cells;
        State::new([
            centre(column, across, left_wall, goal),
            centre(row, up, -speed_limit, speed_limit),
        ])
    }

    /// The position.
    fn start_value(&self, start: &State) -> f64 {
        position(start)
    }

    fn reward(&self, _state: &State, next: &State) -> f64 {
        if self.is_at_goal(next) { self.rules.goal_reward } else { self.rules.step_reward }
    }

    /// The energy that is missing to rest at the height of the hill's top, in heights of
    /// sin 3x.
    fn cost(&self, state: &State) -> f64 {
        let speed = state.get(1).copied().unwrap_or(0.0);
        let height = (3.0 * position(state)).sin();
        1.0 - height - speed * speed / (2.0 * self.plant.gravity / 3.0).max(1e-12)
    }

    fn longest(&self, _occasion: Occasion) -> u32 {
        self.rules.cap_steps
    }

    fn end(&self, state: &State, steps: u32, _occasion: Occasion) -> Option<End> {
        if !state.is_finite() {
            Some(End::Failed)
        } else if self.is_at_goal(state) {
            Some(End::Goal)
        } else {
            (steps >= self.rules.cap_steps).then_some(End::Cap)
        }
    }

    fn regions(&self) -> &[Region] {
        &self.region
    }

    fn region(&self, _state: &State) -> usize {
        0
    }

    fn ends(&self) -> Option<(f64, f64)> {
        // To the right it ends at the goal, which is no wall.
        Some((self.plant.left_wall, f64::INFINITY))
    }

    fn action_limit(&self) -> f64 {
        self.plant.throttle_limit
    }
}

fn position(state: &State) -> f64 {
    state.first().copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn task() -> MountainCar {
        MountainCar::new(&Params::default(), &mountain_car::Params::default())
    }

    #[test]
    fn an_episode_of_n_steps_returns_101_minus_n() {
        let task = task();
        let (valley, flag) = (State::new([-0.5, 0.0]), State::new([0.5, 0.03]));
        let n = 120;
        let total: f64 =
            (1..=n).map(|k| task.reward(&valley, if k == n { &flag } else { &valley })).sum();
        assert_eq!(total, 101.0 - f64::from(n));
    }

    #[test]
    fn rollouts_end_at_the_flag_or_after_500_steps() {
        let task = task();
        let end = |x, steps| task.end(&State::new([x, 0.0]), steps, Occasion::Taught);
        assert_eq!(end(0.499, 499), None);
        assert_eq!(end(0.5, 500), Some(End::Goal));
        assert_eq!(end(0.4, 500), Some(End::Cap));
        assert_eq!(end(f64::NAN, 1), Some(End::Failed));
    }

    #[test]
    fn the_grid_of_240_is_15_by_16_cell_centres_and_a_single_test_the_trained_start() {
        let task = task();
        assert_eq!(task.grid_start(0, 1), State::new([-0.7, 0.0]));
        let starts: Vec<State> = (0..240).map(|k| task.grid_start(k, 240)).collect();
        let count = |axis: usize| {
            let mut values: Vec<u64> = starts.iter().map(|s| s[axis].to_bits()).collect();
            values.sort_unstable();
            values.dedup();
            values.len()
        };
        assert_eq!((count(0), count(1)), (15, 16));
        let first = starts[0];
        assert!((first[0] - (-1.2 + 1.7 / 30.0)).abs() < 1e-12);
        assert!((first[1] - (-0.07 + 0.14 / 32.0)).abs() < 1e-12);
        for count in 2..300 {
            let last = task.grid_start(count - 1, count);
            assert!(last[0] < 0.5 && last[1] < 0.07, "{count}: {last:?}");
        }
    }

    #[test]
    fn the_cost_falls_with_height_and_speed() {
        let cost = |x, v| task().cost(&State::new([x, v]));
        assert!(cost(-0.5, 0.03) < cost(-0.5, 0.0));
        assert!(cost(0.4, 0.0) < cost(-0.5, 0.0));
    }
}
