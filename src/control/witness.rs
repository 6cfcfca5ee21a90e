//! Who writes down what the cycle does: the recorder, or nobody.

use crate::learner::Model;
use crate::record::{EpisodeRow, Momentum, StepRow};
use crate::session::{Moment, Phase};
use crate::sharing::Sharing;

/// Everything that must be known to go on after a cut, at the start of a rollout.
#[derive(Clone, Debug)]
pub struct Standing {
    /// The rollout to be done next.
    pub moment: Moment,
    /// The learner, while it still learns.
    pub learner: Option<Model>,
    /// Windows, shares and gates.
    pub sharing: Sharing,
    /// Samples learned,
    pub learned: u64,
    /// and refused.
    pub refused: u64,
    /// Rollouts that the operator has steered.
    pub practice: u32,
    /// What the operator has learned, while it steers.
    pub operator: Vec<f64>,
    /// What the rollout goes on with, if it does not begin at the task's start.
    pub momentum: Option<Momentum>,
    /// Tenths of main whose policies are stored.
    pub tenths: u8,
}

/// Something that happened, for `events.csv`.
#[derive(Clone, Debug, PartialEq)]
pub struct Happening {
    /// What, a word.
    pub event: &'static str,
    /// Where, if in a rollout.
    pub moment: Option<Moment>,
    /// Where else.
    pub phase: Option<Phase>,
    /// Why.
    pub cause: String,
}

/// What a witness wants of a session; the rest may be left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Needs {
    /// Whole step rows, with what the robot would have done where it has no part.
    pub steps: bool,
    /// Where a cut session would go on, after every rollout: copies of all that is learned.
    pub standings: bool,
    /// The outcome's list of all rollouts.
    pub rollouts: bool,
}

impl Needs {
    /// All of it.
    pub const ALL: Self = Self { steps: true, standings: true, rollouts: true };
}

/// Writes down what the cycle does. Nothing here may block a live tick.
pub trait Witness: Send {
    /// What it wants; asked once, before the session.
    fn needs(&self) -> Needs {
        Needs::ALL
    }
    /// Whether a full queue may hold up the cycle from now on: not while it keeps pace with
    /// a person or a device.
    fn allow_waiting(&mut self, may_wait: bool);
    /// A control step.
    fn step(&mut self, row: &StepRow);
    /// A rollout.
    fn episode(&mut self, row: &EpisodeRow);
    /// A transition, fault, discard or device change.
    fn happening(&mut self, happening: Happening);
    /// Where a resumed session would go on.
    fn standing(&mut self, standing: Standing);
    /// The learner after a tenth of main (`percent` 10 to 100), or the final one.
    fn policy(&mut self, percent: Option<u8>, learner: &Model);
    /// Step rows that could not be kept.
    fn lost(&self) -> u64;
    /// Why writing failed, if it did.
    fn fault(&self) -> Option<String>;
}

/// Writes nothing down: for evaluations, whose results are the cycle's episodes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Nobody;

impl Witness for Nobody {
    fn needs(&self) -> Needs {
        Needs { steps: false, standings: false, rollouts: true }
    }
    fn allow_waiting(&mut self, _may_wait: bool) {}
    fn step(&mut self, _row: &StepRow) {}
    fn episode(&mut self, _row: &EpisodeRow) {}
    fn happening(&mut self, _happening: Happening) {}
    fn standing(&mut self, _standing: Standing) {}
    fn policy(&mut self, _percent: Option<u8>, _learner: &Model) {}
    fn lost(&self) -> u64 {
        0
    }
    fn fault(&self) -> Option<String> {
        None
    }
}
