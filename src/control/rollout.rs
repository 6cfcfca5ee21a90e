//! What belongs to the rollout under way, and what a discard restores.

use crate::learner::{Model, Refusal};
use crate::record::Momentum;
use crate::session::Phase;
use crate::sharing::Sharing;
use crate::task::{Nothing, Tally};

/// The learner, the shares and their counts.
#[derive(Clone)]
pub(super) struct Mind {
    pub(super) learner: Model,
    pub(super) sharing: Sharing,
    pub(super) learned: u64,
    pub(super) refused: u64,
    /// Tenths of main whose policies are stored.
    pub(super) tenths: u8,
}

/// What was known before the rollout under way, which a discard restores.
pub(super) struct Before {
    pub(super) mind: Mind,
    /// What the operator had learned.
    pub(super) operator: Vec<f64>,
}

/// The rollout under way.
pub(super) struct Rollout {
    pub(super) start: f64,
    pub(super) total_reward: f64,
    pub(super) total_measure: f64,
    pub(super) tally: Box<dyn Tally>,
    /// Samples that the learner refused, and why.
    pub(super) refused: Option<(u64, Refusal)>,
    /// Ticks at which nobody was there to steer.
    pub(super) absent: u32,
}

impl Default for Rollout {
    fn default() -> Self {
        Self {
            start: 0.0,
            total_reward: 0.0,
            total_measure: 0.0,
            tally: Box::new(Nothing),
            refused: None,
            absent: 0,
        }
    }
}

/// A rollout that does not begin at the task's start, and what it goes on with.
#[derive(Clone)]
pub(super) struct WentOn {
    pub(super) phase: Phase,
    pub(super) rollout: u32,
    pub(super) momentum: Momentum,
}
