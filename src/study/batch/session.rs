//! One run: a session on virtual time, and tests of its policies at checkpoints.
//!
//! The session is the one that `coadapt run` would have with the same profile, operator and
//! seed, but for its autonomous phase: policies are tested as `coadapt evaluate` does, while
//! main waits.

use std::path::Path;
use std::sync::Arc;

use super::StudyError;
use super::notes::Notes;
use super::optimum::Optimum;
use super::params::{Reference, Starts};
use super::plan::{Run, Study, What};
use super::readout::{WithMotion, deputy};
use super::results::{Cells, Done, Row, Table, Trajectory};
use super::tracks::Tracks;
use crate::clock::{Pacer, VirtualClock};
use crate::control::cycle::{Crew, Cycle, Rules};
use crate::learner::Model;
use crate::operator::{Choice, Operator, simulated};
use crate::profile::{Experiment, Profile};
use crate::record::{self, EpisodeRow};
use crate::report::achieved::{Achieved, yardstick};
use crate::report::metrics;
use crate::session::Phase;
use crate::session::machine::Finish;
use crate::session::plan::{Plan, Starts as Order, Wanted};
use crate::sharing::{Mode, Sharing};
use crate::study::evaluate::{Driver, driven, simulated_backend};

/// Why a run came to nothing.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Somebody asked for the end.
    #[error("it was interrupted")]
    Interrupted,
    /// It went wrong.
    #[error("{0}")]
    Failed(String),
    /// The disk refused, as it would the next run.
    #[error(transparent)]
    Refused(StudyError),
}

impl From<record::Error> for Failure {
    fn from(error: record::Error) -> Self {
        match StudyError::from(error) {
            refused @ StudyError::Disk { .. } => Self::Refused(refused),
            other => Self::Failed(other.to_string()),
        }
    }
}

/// Carries out `run` of `study`; its step rows go to the file `steps`, if that is wanted.
/// `is_enough` says when to give up.
///
/// # Errors
/// When it was given up or went wrong.
pub fn perform(
    study: &Study,
    run: &Run,
    steps: Option<&Path>,
    is_enough: &dyn Fn() -> bool,
) -> Result<Done, Failure> {
    let mut bench = Bench::new(study, run, is_enough)?;
    match &run.what {
        What::References => bench.references()?,
        What::Session { arm, operator } => {
            bench.session(study.params.arms[*arm].mode, operator, steps)?;
        }
    }
    Ok(bench.done)
}

/// Where a run is carried out.
struct Bench<'a> {
    study: &'a Study,
    profile: Arc<Profile>,
    seed: u64,
    is_enough: &'a dyn Fn() -> bool,
    done: Done,
}

impl<'a> Bench<'a> {
    fn new(study: &'a Study, run: &Run, is_enough: &'a dyn Fn() -> bool) -> Result<Self, Failure> {
        let done = Done {
            labels: study.labels(run),
            rows: Vec::new(),
            cells: Vec::new(),
            curve: Vec::new(),
            table: None,
            trajectories: Vec::new(),
        };
        let profile = study.profile(run).map_err(|error| Failure::Failed(error.to_string()))?;
        Ok(Self { study, profile, seed: run.seed, is_enough, done })
    }

    /// A session, and tests of its policies.
    fn session(
        &mut self,
        mode: Mode,
        operator: &Choice,
        steps: Option<&Path>,
    ) -> Result<(), Failure> {
        let profile = &*Arc::clone(&self.profile);
        let tick = profile.tick();
        let mut phases = profile.session.clone();
        phases.phases.retain(|phase| *phase != Wanted::Autonomous);
        let fresh = self.fresh()?;
        let rules = Rules {
            plan: Plan::new(&phases, tick, self.seed, false),
            tick,
            mode,
            sharing: profile.sharing.clone(),
            teaching: profile.teaching.clone(),
            fresh: fresh.clone(),
        };
        let crew = Crew {
            task: profile.experiment.task(tick),
            backend: simulated_backend(profile, self.seed),
            operator: steer(operator, profile, self.seed)?,
            witness: Notes::new(profile, steps)?,
            publisher: None,
        };
        let mut cycle = Cycle::new(rules, crew, fresh, None);
        let mut clock = VirtualClock::default();
        let mut pacer = Pacer::new(&clock);
        while cycle.step(&mut clock, &mut pacer) {
            if (self.is_enough)() {
                return Err(Failure::Interrupted);
            }
            while let Some((percent, learner)) = cycle.witness().due() {
                self.done.rows.extend(cycle.witness().tenth(percent));
                self.test(percent, &learner, &cycle.operator().learned())?;
            }
        }
        let agent = cycle.operator().learned();
        let mut outcome = cycle.run(&mut clock);
        if let Some(refused) = outcome.witness.refused() {
            return Err(refused.into());
        }
        if let Some(why) = outcome.cause {
            return Err(Failure::Failed(why));
        }
        if outcome.finish != Finish::Complete {
            return Err(Failure::Failed("the session was ended early".to_owned()));
        }
        self.conclude(&outcome.sharing, outcome.learned, outcome.refused);
        self.done.table = self.table(operator, &agent);
        self.done.curve = outcome.witness.close()?;
        Ok(())
    }

    /// What main came to as a whole.
    fn conclude(&mut self, sharing: &Sharing, learned: u64, refused: u64) {
        #[expect(clippy::cast_precision_loss, reason = "counts far below 2^52")]
        let count = |count: u64| count as f64;
        let opened = sharing.gate(0).filter(|_| self.profile.sharing.gate > 0.0);
        let mut numbers = vec![("samples", count(learned)), ("refused", count(refused))];
        if let Some(opened) = opened {
            numbers.extend([("gate", count(opened.step)), ("tau", opened.tau)]);
        }
        let row = |(measure, value): (&str, f64)| Row {
            checkpoint: 100,
            readout: "team".to_owned(),
            start: "main".to_owned(),
            measure: measure.to_owned(),
            value,
        };
        self.done.rows.extend(numbers.into_iter().map(row));
    }

    /// Tests all policies of a checkpoint.
    fn test(&mut self, percent: u8, learner: &Model, agent: &[f64]) -> Result<(), Failure> {
        let params = &self.study.params;
        if !params.checkpoints.contains(&percent) {
            return Ok(());
        }
        for readout in &params.readouts {
            for starts in &params.starts {
                let deputy = deputy(*readout, &self.profile, learner, agent);
                let driver = Driver { learner: learner.clone(), deputy };
                self.drive(percent, readout.word(), starts, driver, Phase::Autonomous)?;
            }
        }
        Ok(())
    }

    /// Tests what the arms are compared with.
    fn references(&mut self) -> Result<(), Failure> {
        let mut optimum: Option<Optimum> = None;
        for reference in &self.study.params.references {
            for starts in &self.study.params.starts {
                let (deputy, phase) = match (reference, &self.profile.experiment) {
                    (Reference::Optimum, Experiment::MountainCar { plant, .. }) => {
                        if optimum.is_none() {
                            optimum = Optimum::find(plant, self.is_enough);
                        }
                        let found = optimum.clone().ok_or(Failure::Interrupted)?;
                        (Some(Box::new(found) as Box<dyn Operator>), Phase::Autonomous)
                    }
                    (Reference::Sign, Experiment::MountainCar { plant, .. }) => {
                        let sign = WithMotion { velocity: 1, limit: plant.throttle_limit };
                        (Some(Box::new(sign) as Box<dyn Operator>), Phase::Autonomous)
                    }
                    _ => (None, Phase::ZeroControl),
                };
                let driver = Driver { learner: self.fresh()?, deputy };
                self.drive(100, reference.word(), starts, driver, phase)?;
            }
        }
        Ok(())
    }

    /// Lets `driver` drive from all of `starts`, and keeps what came of it.
    fn drive(
        &mut self,
        percent: u8,
        readout: &str,
        starts: &Starts,
        driver: Driver,
        phase: Phase,
    ) -> Result<(), Failure> {
        let mut profile = Profile::clone(&self.profile);
        profile.session.autonomous_rollouts = starts.count;
        profile.session.starts = if starts.random { Order::Random } else { Order::Grid };
        let params = &self.study.params;
        let is_last = params.starts.last().is_some_and(|last| last.name == starts.name);
        let is_final = percent >= self.study.last_checkpoint();
        let is_kept = is_final && (is_last || starts.count == 1);
        let kept: &[u32] = match (is_kept, starts.count) {
            (false, _) => &[],
            (true, 1) if !params.trajectories.is_empty() => &[0],
            (true, _) => &params.trajectories,
        };
        let tracks = Tracks::new(kept);
        let outcome = driven(&profile, driver, self.seed, &[phase], tracks, self.is_enough)
            .ok_or(Failure::Interrupted)?;
        let rows: Vec<&EpisodeRow> = outcome.episodes.iter().collect();
        let task = profile.experiment.name();
        for (measure, value) in measures(task, &rows) {
            let (readout, start) = (readout.to_owned(), starts.name.clone());
            self.done.rows.push(Row { checkpoint: percent, readout, start, measure, value });
        }
        if starts.count > 1 {
            self.done.cells.push(Cells {
                checkpoint: percent,
                readout: readout.to_owned(),
                start: starts.name.clone(),
                values: rows.iter().filter_map(|row| (yardstick(task).of)(row)).collect(),
                returns: rows.iter().map(|row| row.total).collect(),
            });
        }
        let tracks = outcome.witness.into_tracks().into_iter();
        self.done.trajectories.extend(tracks.map(|(index, states)| Trajectory {
            readout: readout.to_owned(),
            start: starts.name.clone(),
            index,
            states: states.iter().map(|state| state.to_vec()).collect(),
        }));
        Ok(())
    }

    fn fresh(&self) -> Result<Model, Failure> {
        let task = self.profile.experiment.task(self.profile.tick());
        self.profile
            .learner
            .build(task.feature_names().len(), task.action_limit())
            .map_err(|error| Failure::Failed(error.to_string()))
    }

    /// The agent's table, if an agent steered.
    fn table(&self, operator: &Choice, learned: &[f64]) -> Option<Table> {
        let mut agent = match operator {
            Choice::QLearning => self.profile.experiment.agent(0).ok()?,
            _ => return None,
        };
        agent.recall(learned);
        let row = match &self.profile.experiment {
            Experiment::MountainCar { simulated, .. } => simulated.q_learning.velocity_cells,
            _ => return None,
        };
        let most = |values: &[f64; 3]| values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Some(Table { row, values: agent.agent().values().iter().map(most).collect() })
    }
}

/// What some rollouts of `task` came to: the numbers of its results in JSON, and the mean return.
pub(super) fn measures(task: &str, rows: &[&EpisodeRow]) -> Vec<(String, f64)> {
    if rows.is_empty() {
        return Vec::new();
    }
    let achieved = serde_json::to_value(Achieved::of(task, rows)).unwrap_or_default();
    let numbers = achieved.as_object().into_iter().flatten();
    let returns: Vec<f64> = rows.iter().map(|row| row.total).collect();
    numbers
        .filter_map(|(name, value)| Some((name.clone(), value.as_f64()?)))
        .chain([("mean_return".to_owned(), metrics::mean(&returns))])
        .filter(|(_, value)| value.is_finite())
        .collect()
}

/// Who steers a session that nobody attends.
fn steer(choice: &Choice, profile: &Profile, seed: u64) -> Result<Box<dyn Operator>, Failure> {
    let failed = |why: String| Failure::Failed(why);
    Ok(match choice {
        Choice::None => Box::new(crate::operator::Nobody),
        Choice::QLearning => {
            Box::new(profile.experiment.agent(seed).map_err(|e| failed(e.to_string()))?)
        }
        Choice::Simulated(skill, kind) => person(profile, (*skill, *kind), seed),
        other => return Err(failed(format!("{other} needs a person or a file"))),
    })
}

/// A person who is not there, at the plant of `profile`.
pub fn person(
    profile: &Profile,
    (skill, kind): (simulated::Skill, simulated::Kind),
    seed: u64,
) -> Box<dyn Operator> {
    let tick = profile.tick();
    match &profile.experiment {
        Experiment::Balance { plant, simulated: params, .. } => {
            Box::new(simulated::cart_pole::Balancer::new(params, skill, kind, seed, tick, plant))
        }
        Experiment::SwingUp { plant, simulated: params, .. } => {
            Box::new(simulated::swing_up::Swinger::new(params, skill, kind, seed, tick, plant))
        }
        Experiment::SpeedUp { plant, simulated: params, .. } => {
            Box::new(simulated::ball_beam::Roller::new(params, skill, kind, seed, tick, plant))
        }
        Experiment::MountainCar { plant, simulated: params, .. } => {
            Box::new(simulated::mountain_car::Driver::new(params, skill, kind, seed, tick, plant))
        }
    }
}
