//! Balance: keep the pole up as long as possible (thesis 3.2.2).

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::{Occasion, Task, steps_of};
use crate::check::{Check, Checker};
use crate::plant::cart_pole::{self, CartPole};
use crate::sharing::region::{Region, Scale};
use crate::signal::{End, Features, Seconds, State};

/// The rules of the balance task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// The pole is released uniformly within ± this angle, degrees.
    pub release_deg: f64,
    /// A rollout fails when the pole passes ± this angle, degrees; θ_max of eq. 18.
    pub fail_deg: f64,
    /// A rollout that lasts this long is a full success and ends, s.
    pub cap_s: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self { release_deg: 5.0, fail_deg: 30.0, cap_s: 20.0 }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.range("release_deg", self.release_deg, 0.0..=89.0);
        c.range("fail_deg", self.fail_deg, 1.0..=90.0);
        c.range("cap_s", self.cap_s, 0.1..=3600.0);
        c.demand(
            self.release_deg < self.fail_deg,
            "release_deg",
            self.release_deg,
            "below fail_deg, or every rollout would end at its release",
        );
    }
}

/// The balance task on a cart-pole.
#[derive(Clone, Debug)]
pub struct Balance {
    release: f64,
    fail: f64,
    cap_steps: u32,
    omega_squared: f64,
    force_limit: f64,
    track_length: Option<f64>,
}

impl Balance {
    /// The name outside.
    pub const NAME: &'static str = "balance";
    const REGIONS: [Region; 1] =
        [Region { name: "all", scale: Scale { minimum: 0.0, threshold: 1.0 } }];

    /// The task with ticks of `tick` on the given plant.
    #[must_use]
    pub fn new(params: &Params, plant: &cart_pole::Params, tick: Seconds) -> Self {
        Self {
            release: params.release_deg.to_radians(),
            fail: params.fail_deg.to_radians(),
            cap_steps: steps_of(params.cap_s, tick),
            // ω² = g / (1.24 l) of a pole on a cart that is not held; l is half the pole.
            omega_squared: plant.gravity_m_s2 / (1.24 * plant.pole_length_m / 2.0),
            force_limit: plant.force_limit_n,
            track_length: plant.track_length_m,
        }
    }

    /// θ_max, rad.
    #[must_use]
    pub const fn fail_angle(&self) -> f64 {
        self.fail
    }

    fn released_at(angle: f64) -> State {
        State::new([0.0, 0.0, angle, 0.0])
    }
}

impl Task for Balance {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn columns(&self) -> &'static [&'static str] {
        &CartPole::COLUMNS
    }

    fn features(&self, state: &State) -> Features {
        Features::from_slice(state).unwrap_or_default()
    }

    /// The state itself: θ is continuous as far as balancing goes (3.2.1).
    fn feature_names(&self) -> &'static [&'static str] {
        &CartPole::COLUMNS
    }

    fn random_start(&self, _occasion: Occasion, chance: &mut ChaCha8Rng) -> State {
        Self::released_at(if self.release > 0.0 {
            chance.random_range(-self.release..=self.release)
        } else {
            0.0
        })
    }

    fn grid_start(&self, index: u32, count: u32) -> State {
        let steps = f64::from(count.saturating_sub(1)).max(1.0);
        let part = if count > 1 { f64::from(index) / steps } else { 0.5 };
        Self::released_at(self.release * (2.0 * part - 1.0))
    }

    fn start_value(&self, start: &State) -> f64 {
        angle(start)
    }

    /// Eq. 18: 1 upright, 0 at θ_max.
    fn reward(&self, state: &State, _next: &State) -> f64 {
        (self.fail - angle(state).abs()) / self.fail
    }

    /// θ² + (θ̇/ω)²: the squared distance from upright at rest, rad².
    fn cost(&self, state: &State) -> f64 {
        let speed = state.get(3).copied().unwrap_or(0.0);
        angle(state).powi(2) + speed.powi(2) / self.omega_squared.max(1e-9)
    }

    fn longest(&self, _occasion: Occasion) -> u32 {
        self.cap_steps
    }

    fn end(&self, state: &State, steps: u32, _occasion: Occasion) -> Option<End> {
        // Written so that an angle that is not a number has failed, too.
        let upright = angle(state).abs() <= self.fail;
        if !upright || !state.is_finite() {
            Some(End::Failed)
        } else if steps >= self.cap_steps {
            Some(End::Cap)
        } else {
            None
        }
    }

    fn regions(&self) -> &[Region] {
        &Self::REGIONS
    }

    fn region(&self, _state: &State) -> usize {
        0
    }

    fn ends(&self) -> Option<(f64, f64)> {
        self.track_length.map(|length| (-length / 2.0, length / 2.0))
    }

    fn action_limit(&self) -> f64 {
        self.force_limit
    }
}

/// The pole's angle, rad.
fn angle(state: &State) -> f64 {
    state.get(2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Place, Purpose, stream};

    fn balance() -> Balance {
        Balance::new(&Params::default(), &cart_pole::Params::default(), Seconds(0.02))
    }

    #[test]
    fn reward_is_equation_18() {
        let task = balance();
        let at = |deg: f64| {
            let state = Balance::released_at(deg.to_radians());
            task.reward(&state, &state)
        };
        assert!((at(0.0) - 1.0).abs() < 1e-15);
        assert!((at(-15.0) - 0.5).abs() < 1e-15);
        assert!(at(30.0).abs() < 1e-15);
    }

    #[test]
    fn rollouts_end_beyond_thirty_degrees_and_at_twenty_seconds() {
        let task = balance();
        let at = |deg: f64, steps| {
            task.end(&Balance::released_at(deg.to_radians()), steps, Occasion::Taught)
        };
        assert_eq!(at(29.9, 999), None);
        assert_eq!(at(-30.1, 1), Some(End::Failed));
        assert_eq!(at(0.0, 1000), Some(End::Cap));
        assert_eq!(at(f64::NAN, 1), Some(End::Failed));
    }

    #[test]
    fn the_grid_covers_all_starts_and_random_ones_stay_inside() {
        let task = balance();
        let deg = |i, n| task.grid_start(i, n)[2].to_degrees();
        assert!((deg(0, 100) + 5.0).abs() < 1e-12 && (deg(99, 100) - 5.0).abs() < 1e-12);
        assert_eq!(deg(0, 1), 0.0);
        let mut chance = stream(1, Purpose::Starts, Place::default());
        let starts: Vec<f64> = (0..1000)
            .map(|_| task.random_start(Occasion::Taught, &mut chance)[2].to_degrees())
            .collect();
        assert!(starts.iter().all(|a| a.abs() <= 5.0));
        assert!(starts.iter().any(|a| *a < -4.5) && starts.iter().any(|a| *a > 4.5));
    }
}
