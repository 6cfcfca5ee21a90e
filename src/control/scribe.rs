//! The witness that records a session into its folder.

use super::witness::{Happening, Standing, Witness};
use crate::learner::Model;
use crate::operator::Badge;
use crate::operator::terminal::Hands;
use crate::record::checkpoint::Checkpoint;
use crate::record::policy::Policy;
use crate::record::{EpisodeRow, EventRow, Recorder, Sidecar, StepRow};
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
    /// The names of the learner's inputs,
    pub features: Vec<String>,
    /// and of its output.
    pub output: String,
    /// The largest action.
    pub action_limit: f64,
}

/// The device under the person's hands, as `session.json` tells of it.
#[derive(Clone, Debug)]
pub struct Device {
    /// What it says of itself.
    pub badge: Badge,
    /// The keys, where it is the keyboard.
    pub hands: Option<Hands>,
}

/// Descriptions of devices that a session keeps; a plug that is loose makes no more.
const MOST_DEVICES: usize = 16;

impl Device {
    /// Tells `sidecar` what is known now, and returns whether that was news.
    pub fn tell(&self, sidecar: &mut Sidecar) -> bool {
        let words = self.badge.words();
        let devices = &mut sidecar.devices;
        let is_new = !words.is_empty() && devices.len() < MOST_DEVICES && !devices.contains(&words);
        if is_new {
            devices.push(words);
        }
        let known = self.hands.as_ref().map(|hands| hands.knowledge().words().to_owned());
        let is_learned = known.is_some() && known != sidecar.key_releases;
        if is_learned {
            sidecar.key_releases = known;
        }
        is_new || is_learned
    }
}

/// Passes rows on to the recorder.
#[derive(Debug)]
pub struct Scribe {
    recorder: Recorder<Model>,
    origin: Origin,
    plan: Plan,
    /// The learners after the tenths of main, by percent.
    tenths: Vec<(u8, Model)>,
    /// The facts of a session with a device, and what is to be known of that.
    device: Option<(Sidecar, Device)>,
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
        Self { recorder, origin, plan, tenths, device: None, stamp }
    }

    /// From now on `session.json` says what `device` says of itself, as soon as it does.
    pub fn note_device(&mut self, sidecar: Sidecar, device: Device) {
        self.device = Some((sidecar, device));
    }

    fn renew_sidecar(&mut self) {
        let Some((sidecar, device)) = &mut self.device else { return };
        if device.tell(sidecar) {
            self.recorder.sidecar(Box::new(sidecar.clone()));
        }
    }

    /// The recorder, for what comes after the last tick, and the learners after the tenths
    /// of main, by percent.
    #[must_use]
    pub fn into_parts(self) -> (Recorder<Model>, Vec<(u8, Model)>) {
        (self.recorder, self.tenths)
    }
}

impl Witness for Scribe {
    fn allow_waiting(&mut self, may_wait: bool) {
        self.recorder.allow_waiting(may_wait);
    }

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
        self.renew_sidecar();
        let Standing { moment, learner, sharing, learned, refused, .. } = standing;
        self.recorder.checkpoint(Box::new(Checkpoint {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            moment,
            of: self.plan.phase(moment.phase).and_then(|phase| phase.rollouts),
            learner,
            sharing: Some(sharing),
            learned,
            refused,
            practice: standing.practice,
            operator: standing.operator,
            momentum: standing.momentum,
            tenths: standing.tenths,
            steps_bytes: 0,
            episodes_bytes: 0,
        }));
    }

    fn policy(&mut self, percent: Option<u8>, learner: &Model) {
        if let Some(percent) = percent {
            // A repeated rollout may reach a tenth once more.
            self.tenths.retain(|(stored, _)| *stored != percent);
            self.tenths.push((percent, learner.clone()));
        }
        let Origin { task, preset, mode, features, output, action_limit } = self.origin.clone();
        let policy = Policy {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            task,
            preset,
            mode,
            percent: percent.unwrap_or(100),
            features,
            outputs: vec![output],
            action_limit: Some(action_limit),
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
        operator: checkpoint.operator,
        momentum: checkpoint.momentum,
        tenths: checkpoint.tenths,
    })
}
