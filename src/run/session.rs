//! One session, put together from an order or taken up again from its folder.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use serde::Serialize;

use super::RunError;
use super::choose::{Hand, assigned_mode, cut_off_notice, order_policy, steer};
use super::outcome::{Finished, conclude};
use super::plant::{self, Real};
use super::shutdown::Shutdown;
use crate::backend::priority::{self, Urgency};
use crate::clock::{self, Clock, WallClock};
use crate::control::cycle::{Crew, Cycle, Rules};
use crate::control::scribe::{Device, Origin, Scribe, standing_of};
use crate::control::snapshot::{Watcher, channel};
use crate::control::witness::Standing;
use crate::learner::Model;
use crate::operator::mouse::Pointer;
use crate::operator::terminal::Hands;
use crate::operator::{self, Choice, Via};
use crate::profile::{Document, Order, Profile};
use crate::random::draw_seed;
use crate::record::sidecar::{Host, Timing};
use crate::record::{self, Columns, EpisodeRow, Folder, Manner, Recorder, Sidecar, Status, policy};
use crate::session::machine::Stage;
use crate::session::plan::Plan;
use crate::session::{Moment, Phase, Trial};
use crate::study::evaluate::simulated_backend;

/// The largest number that a person may give a trial.
const MOST_TRIALS: u32 = 999_999;

/// Keyboard and mouse as a session needs them: what the terminal's reader feeds, and the clock
/// that both go by.
#[derive(Clone, Debug)]
pub struct Keys {
    /// The steering keys.
    pub hands: Hands,
    /// The mouse's pointer.
    pub pointer: Pointer,
    /// The time of events and ticks.
    pub clock: WallClock,
}

/// A session ready to run.
pub struct Session {
    pub(super) cycle: Cycle<Scribe>,
    pub(super) profile: Profile,
    pub(super) sidecar: Sidecar,
    pub(super) folder: PathBuf,
    pub(super) device: Option<Device>,
    pub(super) real: Option<Real>,
    /// Frames drawn so far, counted by the screen.
    pub frames: Arc<AtomicU64>,
    /// Looks at the session and asks things of it.
    pub watcher: Watcher,
    /// What the person should know before it begins.
    pub notices: Vec<String>,
}

/// How a session's time and people are.
#[derive(Clone, Debug)]
pub enum Company {
    /// Nobody is there; virtual time.
    Headless,
    /// Nobody is at a screen; a real plant, armed by who began it, and the wall's time. A signal
    /// ends it before it has begun.
    Armed(Shutdown),
    /// A person at a screen; the wall's time.
    Attended(Keys),
}

impl Company {
    const fn manner(&self) -> Manner {
        match self {
            Self::Headless => Manner::Virtual,
            Self::Armed(_) | Self::Attended(_) => Manner::Live,
        }
    }

    const fn is_attended(&self) -> bool {
        matches!(self, Self::Attended(_))
    }

    fn stamp(&self) -> fn() -> String {
        match self {
            Self::Headless => String::new,
            Self::Armed(_) | Self::Attended(_) => clock::timestamp,
        }
    }
}

/// Reads the order's profile with its changes.
///
/// # Errors
/// When there is no such profile, or with all its faults.
pub fn profile_of(order: &Order) -> Result<Profile, RunError> {
    let mut document = Document::find(&order.profile, Path::new("profiles"))
        .map_err(|error| RunError::Usage(error.to_string()))?;
    document.change(order.sets.iter().map(|(key, value)| (key.as_str(), value.as_str())));
    document.read().map_err(|report| RunError::Usage(report.render(super::wants_colour())))
}

impl Session {
    /// A new session.
    ///
    /// # Errors
    /// When the order cannot be carried out; nothing is left on the disk then.
    pub fn begin(order: &Order, company: &Company) -> Result<Self, RunError> {
        let profile = profile_of(order)?;
        let seed = match order.seed {
            Some(seed) => seed,
            None => draw_seed().map_err(|error| {
                RunError::Failed(format!("no seed could be drawn ({error}); give one with --seed"))
            })?,
        };
        if let Some(trial) = order.trial
            && !(1..=MOST_TRIALS).contains(&trial)
        {
            return Err(RunError::Usage(format!(
                "--trial {trial}: trials are numbered from 1 to {MOST_TRIALS}"
            )));
        }
        let policy = order_policy(order, &profile)?;
        let (mode, assigned) = match (&policy, profile.mode.fixed()) {
            (Some(policy), _) => (policy.mode, false),
            (None, Some(mode)) => (mode, false),
            (None, None) => (assigned_mode(order, &profile, seed), true),
        };
        let choice: Choice =
            order.operator.parse().map_err(|e: operator::UnknownOperator| usage(&e))?;
        let address = plant::chosen(&order.backend, &profile, &choice, company)?;
        let hand = steer(&choice, &profile, seed, company)?;
        let plan = Plan::new(&profile.session, profile.tick(), seed, company.is_attended());
        let fresh = fresh_learner(&profile)?;
        let real = address
            .map(|address| Real::open(address, &profile, &choice, company, &order.logs))
            .transpose()?;

        let cut_off = cut_off_notice(order, &profile);
        let unpractised = unpractised_notice(&profile, &plan);
        let created = Folder::create(
            &order.logs,
            &order.subject,
            order.trial.map(Trial),
            profile.experiment.name(),
            mode.word(),
        )
        .map_err(|error| RunError::Failed(error.to_string()))?;
        let sidecar = Sidecar {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            task: profile.experiment.name().to_owned(),
            preset: profile.preset.clone(),
            mode,
            assigned,
            learner: word_of(&profile.learner.kind),
            operator: choice.to_string(),
            backend: order.backend.clone(),
            subject: order.subject.clone(),
            trial: created.trial,
            seed,
            status: Status::Running,
            started: clock::timestamp(),
            ended: None,
            key_releases: None,
            devices: std::iter::once(choice.to_string())
                .chain(real.as_ref().map(Real::name))
                .collect(),
            host: host(),
            timing: None,
            planned: plan.phases.iter().map(|phase| phase.phase).collect(),
            profile_ron: profile.to_ron(),
            profile: serde_json::to_value(&profile).unwrap_or_default(),
            phases: std::collections::BTreeMap::new(),
            resumed: Vec::new(),
        };
        let folder = created.folder.path().to_owned();
        let recorder = Recorder::start(
            created.folder,
            &Columns {
                state: profile.experiment.columns(),
                tally: profile.experiment.task(profile.tick()).tally_names(),
            },
            company.manner(),
            &sidecar,
        )
        .map_err(|error| {
            // Nothing was begun: the folder, made a moment ago, holds headers at most.
            let _ = std::fs::remove_dir_all(&folder);
            RunError::Failed(error.to_string())
        })?;
        let learner = policy.map_or_else(|| fresh.clone(), |policy| policy.learner);
        let parts = Parts { profile, sidecar, folder, plan, fresh, hand, real, recorder };
        let notices = cut_off.into_iter().chain(created.notice).chain(unpractised).collect();
        Ok(parts.assemble(learner, None, Vec::new(), company, notices))
    }

    /// Takes up the session in `folder` where it was cut.
    ///
    /// # Errors
    /// When there is none, it is complete, or its files are damaged; they are untouched then.
    pub fn resume(path: &Path, company: &Company) -> Result<Self, RunError> {
        let failed = |error: record::Error| RunError::Usage(error.to_string());
        let sidecar = record::sidecar_of(path).map_err(failed)?;
        let folder = Folder::open(path).map_err(failed)?;
        // Everything that could be refused is looked at before the folder is touched.
        let profile =
            Document::from_text("profile_ron of session.json", sidecar.profile_ron.clone())
                .read()
                .map_err(|report| RunError::Usage(report.to_string()))?;
        let choice: Choice =
            sidecar.operator.parse().map_err(|e: operator::UnknownOperator| usage(&e))?;
        if let Choice::Gamepad(Via::Script(file)) = &choice {
            return Err(RunError::Usage(format!(
                "this session follows the table of events {}, whose times are those of an \
                 unbroken session: run it anew",
                file.display()
            )));
        }
        let address = plant::chosen(&sidecar.backend, &profile, &choice, company)?;
        let mut hand = steer(&choice, &profile, sidecar.seed, company)?;
        let plan = Plan::new(&profile.session, profile.tick(), sidecar.seed, company.is_attended());
        let fresh = fresh_learner(&profile)?;
        let logs = path.ancestors().nth(2).unwrap_or(Path::new("logs"));
        let real = address
            .map(|address| Real::open(address, &profile, &choice, company, logs))
            .transpose()?;
        let frozen = record::read_policy::<Model>(&path.join("policy.json")).ok();
        let resumed =
            folder.resume::<Model>(company.manner(), &(company.stamp())()).map_err(failed)?;
        let tenths: Vec<(u8, Model)> = (1..=resumed.checkpoint.tenths)
            .filter_map(|k| {
                let file = path.join(policy::file_name(Some(k * 10)));
                Some((k * 10, record::read_policy::<Model>(&file).ok()?.learner))
            })
            .collect();
        let moment = resumed.checkpoint.moment;
        let done = resumed.checkpoint.tenths;
        let standing = standing_of(resumed.checkpoint, frozen.map(|policy| policy.learner));
        // A real plant cannot go on in the middle of its motion.
        let standing = standing.map(|mut standing| {
            standing.momentum = standing.momentum.filter(|_| real.is_none());
            standing
        });
        let Some(standing) = standing else {
            return Err(RunError::Failed(format!(
                "{}: what was learned is missing (checkpoint.json and policy.json): this \
                 session cannot be resumed",
                path.display()
            )));
        };
        // The cycle gives it back; that it can is known only here, where it can be refused.
        if moment.phase.is_steered() && !hand.operator.recall(&standing.operator) {
            return Err(RunError::Failed(format!(
                "{}: what the operator {choice} had learned (checkpoint.json) is damaged: this \
                 session cannot be resumed",
                path.display()
            )));
        }
        let mut notice = format!(
            "resumed at {} {}; {} rows of the cut rollout were dropped",
            moment.phase, moment.rollout, resumed.dropped_steps
        );
        let missing = usize::from(done).saturating_sub(tenths.len());
        if missing > 0 {
            let _ = write!(
                notice,
                "; {missing} of the tenths' policies are missing and will not be evaluated"
            );
        }
        let learner = standing.learner.clone().unwrap_or_else(|| fresh.clone());
        let parts = Parts {
            profile,
            sidecar: resumed.sidecar,
            folder: path.to_owned(),
            plan,
            fresh,
            hand,
            real,
            recorder: resumed.recorder,
        };
        let from = Some((standing, resumed.episodes));
        Ok(parts.assemble(learner, from, tenths, company, vec![notice]))
    }

    /// The session's folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The session's facts.
    #[must_use]
    pub const fn sidecar(&self) -> &Sidecar {
        &self.sidecar
    }

    /// The session's profile.
    #[must_use]
    pub const fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Runs it to its end, evaluates its policies and writes its last files. `signal` is
    /// the signal that asked for the end, if one did.
    ///
    /// # Errors
    /// When the session could not be written down whole.
    pub fn run(
        self,
        clock: &mut dyn Clock,
        signal: impl Fn() -> Option<i32>,
    ) -> Result<Finished, RunError> {
        if self.real.is_some() {
            priority::go_first(Urgency::Decision);
        }
        let mut metronome = self.real.as_ref().map(Real::metronome);
        let clock = metronome.as_mut().map_or(clock, |metronome| metronome as &mut dyn Clock);
        let outcome = self.cycle.run(clock);
        // The motor first, then the last files.
        let plant = self.real.map(Real::close);
        priority::go_with_all();
        let mut sidecar = self.sidecar;
        if let Some(device) = &self.device {
            device.tell(&mut sidecar);
        }
        let screen_frames = self.frames.load(Ordering::Relaxed);
        let known = Timing { screen_frames, plant, ..Timing::default() };
        conclude(&self.profile, sidecar, self.folder, outcome, known, signal)
    }
}

/// What a new and a resumed session have in common.
struct Parts {
    profile: Profile,
    sidecar: Sidecar,
    folder: PathBuf,
    plan: Plan,
    fresh: Model,
    hand: Hand,
    real: Option<Real>,
    recorder: Recorder<Model>,
}

impl Parts {
    fn assemble(
        self,
        learner: Model,
        from: Option<(Standing, Vec<EpisodeRow>)>,
        tenths: Vec<(u8, Model)>,
        company: &Company,
        notices: Vec<String>,
    ) -> Session {
        let Self { profile, sidecar, folder, mut plan, fresh, hand, real, recorder } = self;
        if real.is_some() {
            plant::waits_for_the_plant(&mut plan);
        }
        let tick = profile.tick();
        let task = profile.experiment.task(tick);
        let origin = Origin {
            task: sidecar.task.clone(),
            preset: sidecar.preset.clone(),
            mode: sidecar.mode,
            features: task.feature_names().iter().map(|name| (*name).to_owned()).collect(),
            output: profile.teaching.target.column().to_owned(),
            action_limit: task.action_limit(),
        };
        let mut scribe = Scribe::new(recorder, origin, plan.clone(), tenths, company.stamp());
        if let Some(device) = &hand.device {
            scribe.note_device(sidecar.clone(), device.clone());
        }
        let (publisher, watcher) =
            channel(Stage::Instruction(Moment::start_of(Phase::Introduction)));
        let rules = Rules {
            plan,
            tick,
            mode: sidecar.mode,
            sharing: profile.sharing.clone(),
            teaching: profile.teaching.clone(),
            fresh,
        };
        let crew = Crew {
            task,
            backend: real
                .as_ref()
                .map_or_else(|| simulated_backend(&profile, sidecar.seed), Real::backend),
            operator: hand.operator,
            witness: scribe,
            publisher: Some(publisher),
        };
        let cycle = Cycle::new(rules, crew, learner, from);
        let frames = Arc::default();
        let device = hand.device;
        Session { cycle, profile, sidecar, folder, device, real, frames, watcher, notices }
    }
}

/// That success should go by the person's practice, but there is none.
fn unpractised_notice(profile: &Profile, plan: &Plan) -> Option<String> {
    let main = plan.phase(Phase::Main)?;
    let is_practised = plan.phase(Phase::Introduction).is_some();
    let own = profile.experiment.task(profile.tick()).own_scale(None).filter(|_| !is_practised)?;
    Some(format!("{}: {}", main.phase, own.why))
}

pub(super) fn usage(error: &dyn std::fmt::Display) -> RunError {
    RunError::Usage(error.to_string())
}

/// The one word that `value` is written as.
fn word_of(value: &impl Serialize) -> String {
    serde_json::to_value(value)
        .ok()
        .and_then(|word| word.as_str().map(str::to_owned))
        .unwrap_or_default()
}

fn fresh_learner(profile: &Profile) -> Result<Model, RunError> {
    let task = profile.experiment.task(profile.tick());
    profile
        .learner
        .build(task.feature_names().len(), task.action_limit())
        .map_err(|error| usage(&error))
}

fn host() -> Host {
    let release = std::fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    Host {
        os: format!("{} {}", std::env::consts::OS, release.trim()).trim().to_owned(),
        architecture: std::env::consts::ARCH.to_owned(),
        terminal: std::env::var("TERM").ok(),
    }
}
