//! Does a recorded session once more, from its profile, its seed and what its person did, and
//! compares every number of its rows bit by bit.
//!
//! The one control cycle does it, with an operator that is handed what was recorded. What the
//! rows do not tell does not matter to them: countdowns, breaks and pauses. A rollout that
//! somebody ended is known by a last row that the task did not ask for.

mod difference;

use std::iter::Peekable;
use std::path::{Path, PathBuf};

use crate::clock::{Pacer, VirtualClock};
use crate::control::cycle::{Crew, Cycle, Rules};
use crate::control::snapshot::{Command, Watcher, channel};
use crate::control::witness::{Happening, Needs, Standing, Witness};
use crate::learner::Model;
use crate::operator::Operator;
use crate::operator::playback::Playback;
use crate::profile::Profile;
use crate::record::reader::{Episodes, Steps};
use crate::record::{self, EpisodeRow, Sidecar, Status, StepRow, policy};
use crate::session::machine::Stage;
use crate::session::plan::Plan;
use crate::session::{Moment, Phase};
use crate::signal::End;

pub use difference::Difference;
use difference::{
    ended_otherwise, episodes as compare_episodes, missing_rollout, missing_row,
    rows as compare_rows, surplus_rollout,
};

/// What came of doing a session once more.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Rows of `steps.csv` that are the same,
    pub rows: u64,
    /// and of `episodes.csv`.
    pub rollouts: u64,
    /// Whether a table ends before the session does.
    pub partial: bool,
    /// The first number that is not.
    pub difference: Option<Difference>,
}

/// Why a session cannot be done once more.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// Its plant is no equation.
    #[error(
        "this session ran on a real plant ({backend}), which cannot be simulated once more: its \
         rows are the only witness; `coadapt replay` shows them"
    )]
    RealPlant {
        /// The plant, as on the command line.
        backend: String,
    },
    /// Not one whole row is in it.
    #[error("{path}: there is nothing to compare: not one step was recorded")]
    NoRows {
        /// The table.
        path: String,
    },
    /// A file does not read.
    #[error(transparent)]
    Record(#[from] record::Error),
    /// The rows have other states than the profile's task.
    #[error(
        "{path}: its states are {found}, but those of {task} are {expected}: this file belongs \
         to another session"
    )]
    OtherTask {
        /// The table.
        path: String,
        /// The columns in it.
        found: String,
        /// The task.
        task: String,
        /// The columns that it has.
        expected: String,
    },
    /// No learner has these settings.
    #[error("the learner cannot be made: {0}")]
    Learner(String),
}

/// Does the session in `folder` once more. `agent` is its operator where that shows the robot
/// something else than it does, which no row tells.
///
/// # Errors
/// When that is impossible, or a file cannot be read.
pub fn verify(
    folder: &Path,
    profile: &Profile,
    sidecar: &Sidecar,
    agent: Option<Box<dyn Operator>>,
) -> Result<Verdict, VerifyError> {
    if sidecar.backend != "simulated" {
        return Err(VerifyError::RealPlant { backend: sidecar.backend.clone() });
    }
    let verdict = Retrial::begin(folder, profile, sidecar, agent)?.carry_out()?;
    if verdict.rows == 0 && verdict.difference.is_none() {
        return Err(VerifyError::NoRows { path: folder.join("steps.csv").display().to_string() });
    }
    Ok(verdict)
}

/// The files of the recorded session.
struct Evidence {
    steps: Peekable<Steps>,
    episodes: Peekable<Episodes>,
    columns: Vec<String>,
    tally: Vec<String>,
}

impl Evidence {
    fn open(folder: &Path, profile: &Profile) -> Result<Self, VerifyError> {
        let path = folder.join("steps.csv");
        let steps = Steps::open(&path)?;
        let episodes = Episodes::open(&folder.join("episodes.csv"))?;
        let (columns, expected) = (steps.columns().to_vec(), profile.experiment.columns());
        // A file without a whole header has no rows either.
        if !columns.is_empty() && columns != expected {
            return Err(VerifyError::OtherTask {
                path: path.display().to_string(),
                found: columns.join(","),
                task: profile.experiment.name().to_owned(),
                expected: expected.join(","),
            });
        }
        let tally = episodes.tally().to_vec();
        Ok(Self { steps: steps.peekable(), episodes: episodes.peekable(), columns, tally })
    }

    /// How the recorded rollout ended whose last row comes next; `None` where the table was cut
    /// before it says so.
    fn end(&mut self) -> Option<End> {
        self.episodes.peek()?.as_ref().ok().map(|row| row.end)
    }
}

/// The session as it goes once more.
struct Retrial {
    cycle: Cycle<Notes>,
    watcher: Watcher,
    playback: Playback,
    clock: VirtualClock,
    pacer: Pacer,
    evidence: Evidence,
    status: Status,
    /// The last row that was compared,
    last: Option<StepRow<String>>,
    /// and the next one, where the tick that led to it led to one more.
    next: Option<StepRow>,
    verdict: Verdict,
}

impl Retrial {
    fn begin(
        folder: &Path,
        profile: &Profile,
        sidecar: &Sidecar,
        agent: Option<Box<dyn Operator>>,
    ) -> Result<Self, VerifyError> {
        let evidence = Evidence::open(folder, profile)?;
        let tick = profile.tick();
        let task = profile.experiment.task(tick);
        // Attended, so that rollouts can be thrown away; but nothing is waited for.
        let mut plan = Plan::new(&profile.session, tick, sidecar.seed, true);
        (plan.hold_ticks, plan.autonomous_hold_ticks, plan.break_ticks) = (0, 0, 0);
        let fresh = profile
            .learner
            .build(task.feature_names().len(), task.action_limit())
            .map_err(|error| VerifyError::Learner(error.to_string()))?;
        let learner = first_learner(folder, &plan, &fresh)?;
        let playback = Playback::default();
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
            backend: super::evaluate::simulated_backend(profile, sidecar.seed),
            operator: agent.unwrap_or_else(|| Box::new(playback.clone())),
            witness: Notes::default(),
            publisher: Some(publisher),
        };
        let cycle = Cycle::new(rules, crew, learner, None);
        let clock = VirtualClock::default();
        let pacer = Pacer::new(&clock);
        let verdict = Verdict { rows: 0, rollouts: 0, partial: false, difference: None };
        let (status, last, next) = (sidecar.status, None, None);
        Ok(Self { cycle, watcher, playback, clock, pacer, evidence, status, last, next, verdict })
    }

    /// Does tick after tick, up to the last recorded row or the first difference.
    fn carry_out(mut self) -> Result<Verdict, VerifyError> {
        while self.verdict.difference.is_none()
            && let Some(row) = self.evidence.steps.next()
        {
            self.verdict.difference = self.redo(&row?)?;
        }
        if self.verdict.difference.is_none() && self.last.is_some() {
            self.verdict.difference = self.ending()?;
        }
        Ok(self.verdict)
    }

    /// What does not fit where `steps.csv` ends: a complete session goes on, or `episodes.csv`
    /// tells of rollouts that did not take place.
    fn ending(&mut self) -> Result<Option<Difference>, VerifyError> {
        let stage = self.watcher.look().stage;
        let is_whole = self.next.is_none() && matches!(stage, Stage::Finished(_));
        self.verdict.partial |= !is_whole;
        if !is_whole && self.status == Status::Complete {
            let place = match &self.next {
                Some(row) => Some((row.phase, row.episode, row.step)),
                None => stage.moment().map(|next| (next.phase, next.rollout, next.step)),
            };
            return Ok(place.map(|place| missing_row(place, self.verdict.rows)));
        }
        let Some(surplus) = self.evidence.episodes.next().transpose()? else { return Ok(None) };
        // Whoever was killed may have kept more of one table than of the other.
        let order = |phase| Phase::ALL.iter().position(|one| *one == phase);
        let comes_later = self.last.as_ref().is_some_and(|last| {
            (order(surplus.phase), surplus.episode) >= (order(last.phase), last.episode)
        });
        if self.status == Status::Running && !is_whole && comes_later {
            return Ok(None);
        }
        Ok(Some(surplus_rollout(&surplus, self.verdict.rollouts)))
    }

    /// Does once more what led to `row`, and compares.
    fn redo(&mut self, row: &StepRow<String>) -> Result<Option<Difference>, VerifyError> {
        let stage = self.watcher.look().stage;
        if row.u.is_none() && matches!(stage, Stage::Running(_)) {
            // The task would go on here: somebody ended the rollout.
            let command = match self.evidence.end() {
                None | Some(End::Discarded) => Command::Stop,
                Some(End::Aborted) => Command::Abort(String::new()),
                Some(end) => return Ok(Some(ended_otherwise(row, self.verdict.rows, end))),
            };
            self.watcher.ask(command);
        } else {
            self.playback.want(row.u_human);
            if !matches!(stage, Stage::Running(_)) {
                self.watcher.ask(Command::Begin);
            }
        }
        self.cycle.step(&mut self.clock, &mut self.pacer);
        let notes = std::mem::take(self.cycle.witness());
        self.compare(row, &notes)
    }

    /// Compares what a tick led to with `row` and what was recorded after it.
    fn compare(
        &mut self,
        row: &StepRow<String>,
        notes: &Notes,
    ) -> Result<Option<Difference>, VerifyError> {
        let mut computed = notes.steps.iter();
        let mut recorded = Some(Ok(row.clone()));
        while let Some(row) = recorded.take() {
            let row = row?;
            let found = compare_rows(&row, computed.next(), &self.evidence.columns);
            if let Some(cell) = found {
                return Ok(Some(cell.at_row(self.verdict.rows)));
            }
            self.verdict.rows += 1;
            self.last = Some(row);
            // The last state of a rollout comes with the tick that ended it.
            if computed.len() > 0 {
                recorded = self.evidence.steps.next();
            }
        }
        self.next = computed.next().copied();
        for computed in &notes.episodes {
            let Some(recorded) = self.evidence.episodes.next() else {
                self.verdict.partial = true;
                if self.status == Status::Complete {
                    return Ok(Some(missing_rollout(computed, self.verdict.rollouts)));
                }
                break;
            };
            let found = compare_episodes(&recorded?, computed, &self.evidence.tally);
            if let Some(cell) = found {
                return Ok(Some(cell.at_rollout(self.verdict.rollouts)));
            }
            self.verdict.rollouts += 1;
        }
        Ok(None)
    }
}

/// What the robot knows where no main phase teaches it: the session's own copy of the policy
/// that it was given.
fn first_learner(folder: &Path, plan: &Plan, fresh: &Model) -> Result<Model, record::Error> {
    let is_given = plan.phase(Phase::Main).is_none() && plan.phase(Phase::Autonomous).is_some();
    if !is_given {
        return Ok(fresh.clone());
    }
    let path: PathBuf = folder.join(policy::file_name(None));
    Ok(record::read_policy::<Model>(&path)?.learner)
}

/// The rows that one tick led to.
#[derive(Default)]
struct Notes {
    steps: Vec<StepRow>,
    episodes: Vec<EpisodeRow>,
}

impl Witness for Notes {
    fn needs(&self) -> Needs {
        Needs { steps: true, standings: false, rollouts: false }
    }
    fn allow_waiting(&mut self, _may_wait: bool) {}
    fn step(&mut self, row: &StepRow) {
        self.steps.push(*row);
    }
    fn episode(&mut self, row: &EpisodeRow) {
        self.episodes.push(*row);
    }
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
