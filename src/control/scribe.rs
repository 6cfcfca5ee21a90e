//! The witness that records a session into its folder.

use super::witness::{Happening, Standing, Witness};
use crate::learner::Model;
use crate::record::checkpoint::Checkpoint;
use crate::record::policy::Policy;
use crate::record::{EpisodeRow, EventRow, Recorder, StepRow};
use crate::session::Phase;
use crate::session::plan::Plan;
use crate::sharing::Mode;

/// What every policy of a session says about where it comes from.
#[derive(Clone, Debug)]
pub struct Origin {
    /// The task's name outside.
    pub task: String,
    /// The profile's preset.
    pub preset: String,
    /// What the robot does while it learns.
    pub mode: Mode,
    /// The names of the learner's inputs.
    pub features: Vec<String>,
    /// The largest action.
    pub action_limit: f64,
}

/// Passes rows on to the recorder.
#[derive(Debug)]
pub struct Scribe {
    recorder: Recorder<Model>,
    origin: Origin,
    plan: Plan,
    /// The learners after the tenths of main, by percent.
    tenths: Vec<(u8, Model)>,
    /// Stamps happenings with the wall's time, in sessions on the wall's time.
    stamp: fn() -> String,
}

impl Scribe {
    /// A scribe for the session of `plan`, of which the policies of some `tenths` may be
    /// stored already; `stamp` gives the date and time of events.
    #[must_use]
    pub fn new(
        recorder: Recorder<Model>,
        origin: Origin,
        plan: Plan,
        tenths: Vec<(u8, Model)>,
        stamp: fn() -> String,
    ) -> Self {
        Self { recorder, origin, plan, tenths, stamp }
    }

    /// The recorder, for what comes after the last tick, and the learners after the tenths
    /// of main, by percent.
    #[must_use]
    pub fn into_parts(self) -> (Recorder<Model>, Vec<(u8, Model)>) {
        (self.recorder, self.tenths)
    }
}

impl Witness for Scribe {
    fn step(&mut self, row: &StepRow) {
        self.recorder.step(*row);
    }

    fn episode(&mut self, row: &EpisodeRow) {
        self.recorder.episode(*row);
    }

    fn happening(&mut self, happening: Happening) {
        let Happening { event, moment, phase, cause } = happening;
        self.recorder.event(EventRow {
            time: (self.stamp)(),
            phase: phase.or(moment.map(|moment| moment.phase)),
            episode: moment.map(|moment| moment.rollout),
            step: moment.map(|moment| moment.step),
            event,
            cause,
        });
    }

    fn standing(&mut self, standing: Standing) {
        let Standing { moment, learner, sharing, learned, refused, practice, tenths } = standing;
        self.recorder.checkpoint(Box::new(Checkpoint {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            moment,
            of: self.plan.phase(moment.phase).and_then(|phase| phase.rollouts),
            learner,
            sharing: Some(sharing),
            learned,
            refused,
            practice,
            tenths,
            steps_bytes: 0,
            episodes_bytes: 0,
        }));
    }

    fn policy(&mut self, percent: Option<u8>, learner: &Model) {
        if let Some(percent) = percent {
            self.tenths.push((percent, learner.clone()));
        }
        let Origin { task, preset, mode, features, action_limit } = self.origin.clone();
        let policy = Policy {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            task,
            preset,
            mode,
            percent: percent.unwrap_or(100),
            features,
            action_limit,
            learner: learner.clone(),
        };
        self.recorder.policy(percent, Box::new(policy));
    }

    fn lost(&self) -> u64 {
        self.recorder.lost()
    }

    fn fault(&self) -> Option<String> {
        self.recorder.fault().map(str::to_owned)
    }
}

/// Where a recorded session goes on. `frozen` is the final policy's learner, which a
/// checkpoint after main leaves out.
#[must_use]
pub fn standing_of(checkpoint: Checkpoint<Model>, frozen: Option<Model>) -> Option<Standing> {
    let learner = checkpoint.learner.or(frozen);
    let needs_learner = matches!(checkpoint.moment.phase, Phase::Main | Phase::Autonomous);
    if needs_learner && learner.is_none() {
        return None;
    }
    Some(Standing {
        moment: checkpoint.moment,
        learner,
        sharing: checkpoint.sharing?,
        learned: checkpoint.learned,
        refused: checkpoint.refused,
        practice: checkpoint.practice,
        tenths: checkpoint.tenths,
    })
}
