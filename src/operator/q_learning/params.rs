//! The numbers of Q-learning.

use serde::{Deserialize, Serialize};

use super::table::Throttle;
use crate::check::{Check, Checker};

/// The parameters of the agent that learns the mountain car; the defaults are the thesis's
/// (4.2.1, 4.3).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// Cells along the position,
    pub position_cells: u32,
    /// and along the velocity.
    pub velocity_cells: u32,
    /// The part of the steps whose throttle is drawn, ε.
    pub epsilon: f64,
    /// What a step later counts less, γ of eq. 33.
    pub gamma: f64,
    /// The learning rate is this
    pub beta_scale: f64,
    /// over (episode + this)
    pub beta_delay: f64,
    /// to this power, and 1 at most: β(episode) of 4.3.
    pub beta_power: f64,
    /// Every value at first, Q₀.
    pub q_initial: f64,
    /// The λ of Watkins' Q(λ); `None` is plain Q-learning, which is λ = 0.
    pub lambda: Option<f64>,
    /// Whose value a step moves where control is shared.
    pub updates: Updates,
    /// What the robot is given to learn.
    pub shows: Shows,
}

/// The throttle whose value a step moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Updates {
    /// What the agent wanted, as the thesis's text reads.
    #[default]
    Own,
    /// What the plant received, or the nearest to it that the agent knows.
    Executed,
}

/// What an agent shows the robot that learns from it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shows {
    /// What it does, tries included.
    #[default]
    Tried,
    /// What it takes for the best (eq. 34), whatever it tries.
    Best,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            position_cells: 100,
            velocity_cells: 100,
            epsilon: 0.1,
            gamma: 0.99,
            beta_scale: 10.0,
            beta_delay: 100.0,
            beta_power: 0.51,
            q_initial: 0.0,
            lambda: None,
            updates: Updates::default(),
            shows: Shows::default(),
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.count("position_cells", self.position_cells, 1..=1000);
        c.count("velocity_cells", self.velocity_cells, 1..=1000);
        c.range("epsilon", self.epsilon, 0.0..=1.0);
        c.range("gamma", self.gamma, 0.0..=1.0);
        c.range("beta_scale", self.beta_scale, 0.0..=1e6);
        c.range("beta_delay", self.beta_delay, 1.0..=1e9);
        c.range("beta_power", self.beta_power, 0.0..=10.0);
        c.range("q_initial", self.q_initial, -1e6..=1e6);
        if let Some(lambda) = self.lambda {
            c.range("lambda", lambda, 0.0..=1.0);
        }
    }
}

impl Params {
    /// The learning rate of the episode after that many (4.3).
    pub(super) fn beta(&self, episodes: u32) -> f64 {
        let age = f64::from(episodes) + self.beta_delay;
        (self.beta_scale / age.powf(self.beta_power)).min(1.0)
    }

    /// The number of the table's values.
    pub(super) const fn values(&self) -> usize {
        self.position_cells as usize * self.velocity_cells as usize * Throttle::ALL.len()
    }
}
