//! The samples that a recorded session's learner was given, from its rows.

use std::path::Path;

use super::{FitError, Kept};
use crate::control::scale;
use crate::learner;
use crate::profile::{Document, Profile};
use crate::record::{self, EpisodeRow, Sidecar, StepRow, reader};
use crate::session::Phase;
use crate::sharing::Sharing;
use crate::signal::{End, Intent};
use crate::task::Task;
use crate::teaching::{Lesson, Sight, Teacher};

/// The actions that a row holds.
const ACTIONS: [&str; 4] = ["u_human", "u_machine", "u", "u_applied"];

/// A recorded session as a table of samples.
#[derive(Debug)]
pub struct Recorded {
    /// What is known of it.
    pub sidecar: Sidecar,
    /// Its learner's parameters, the norms those of the inputs.
    pub learner: learner::Params,
    /// The largest action.
    pub action_limit: f64,
    /// The names of the inputs,
    pub inputs: Vec<String>,
    /// and of the outputs.
    pub outputs: Vec<String>,
    /// The samples of its main phase, in order. Those of discarded rollouts were taken back,
    /// and are not here.
    pub samples: Kept,
    /// What the person should know.
    pub notices: Vec<String>,
}

/// Reads the session in `folder`. The inputs and outputs are those that its learner had,
/// unless given: inputs may be the task's features and the state's columns, outputs the
/// actions of a row.
///
/// # Errors
/// When its files cannot be read, do not belong together, or lack what was asked for.
pub fn read(
    folder: &Path,
    inputs: Option<&[String]>,
    outputs: Option<&[String]>,
) -> Result<Recorded, FitError> {
    let sidecar = record::sidecar_of(folder).map_err(|error| match error {
        record::Error::NoSession { .. } => FitError::Unfit(format!("{error}, or a table")),
        other => other.into(),
    })?;
    let profile =
        Document::from_text("profile_ron of session.json", sidecar.profile_ron.clone()).read()?;
    let mut steps = reader::Steps::open(&folder.join("steps.csv"))?;
    let episodes =
        reader::Episodes::open(&folder.join("episodes.csv"))?.collect::<Result<Vec<_>, _>>()?;
    let task = profile.experiment.task(profile.tick());
    let asked = Asked::of(&*task, &profile, steps.columns(), inputs, outputs)?;
    let main: Vec<EpisodeRow> =
        episodes.iter().filter(|row| row.phase == Phase::Main).copied().collect();
    let mut attempts = Attempts { episodes: &main, begun: 0, last: None, rows: 0, lost: 0 };
    let mut replay = Replay::new(&*task, &profile, &sidecar, &episodes);
    let mut samples = Kept::default();
    for (line, row) in (2..).zip(&mut steps) {
        let row = row?;
        let Some(end) = attempts.keeps(&row).transpose()? else { continue };
        if asked.is_lesson {
            replay.take(&row, end, |lesson| asked.keep(&lesson, line, &mut samples));
        } else {
            asked.take(&*task, &row, line, &mut samples);
        }
    }
    attempts.close();
    if samples.is_empty() {
        return Err(FitError::Unfit(format!(
            "{} holds no samples: nobody steered in a whole rollout of its main phase",
            folder.display()
        )));
    }
    let mut notices = Vec::new();
    if attempts.lost > 0 {
        notices.push(format!(
            "{} step rows of this session are missing: the fit may differ from what the session \
             learned",
            attempts.lost
        ));
    }
    let mut learner = profile.learner.clone();
    learner.norm_in = asked.norms(&*task, &learner.norm_in);
    Ok(Recorded {
        sidecar,
        learner,
        action_limit: task.action_limit(),
        inputs: asked.inputs.into_iter().map(|(name, _)| name).collect(),
        outputs: asked.outputs,
        samples,
        notices,
    })
}

/// Where an input is found.
#[derive(Clone, Copy, Debug)]
enum Place {
    /// Among the task's features,
    Feature(usize),
    /// or the state's numbers.
    State(usize),
}

/// What is to be taken from each row.
struct Asked {
    inputs: Vec<(String, Place)>,
    outputs: Vec<String>,
    /// Whether the inputs are features and the output is the learner's own target: then the
    /// samples are the lessons that the session's learner was given.
    is_lesson: bool,
}

impl Asked {
    fn of(
        task: &dyn Task,
        profile: &Profile,
        columns: &[String],
        inputs: Option<&[String]>,
        outputs: Option<&[String]>,
    ) -> Result<Self, FitError> {
        let features = task.feature_names();
        let place = |name: &String| {
            let feature = features.iter().position(|feature| feature == name);
            let state = || columns.iter().position(|column| column == name);
            feature.map(Place::Feature).or_else(|| state().map(Place::State))
        };
        let all: Vec<String> = features.iter().map(|name| (*name).to_owned()).collect();
        let inputs = inputs.unwrap_or(&all);
        let target = profile.teaching.target.column();
        let given = outputs.map(<[String]>::to_vec);
        let outputs = given.unwrap_or_else(|| vec![target.to_owned()]);
        let mut faults = Vec::new();
        for name in inputs.iter().filter(|name| place(name).is_none()) {
            let known = all.join(",");
            faults.push(format!("--inputs: this session has no {name}; it has {known}"));
        }
        for name in outputs.iter().filter(|name| !ACTIONS.contains(&name.as_str())) {
            let known = ACTIONS.join(",");
            faults.push(format!("--outputs: this session has no {name}; it has {known}"));
        }
        if !faults.is_empty() {
            return Err(FitError::Unfit(faults.join("\n")));
        }
        let inputs: Vec<(String, Place)> =
            inputs.iter().filter_map(|name| Some((name.clone(), place(name)?))).collect();
        let are_features = inputs.iter().all(|(_, place)| matches!(place, Place::Feature(_)));
        let is_lesson = outputs == [target] && are_features;
        Ok(Self { inputs, outputs, is_lesson })
    }

    /// Adds a lesson that was ripe at the row in `line`.
    fn keep(&self, lesson: &Lesson, line: u64, samples: &mut Kept) {
        let input = |(_, place): &(String, Place)| match *place {
            Place::Feature(index) => lesson.x.get(index).copied(),
            Place::State(_) => None,
        };
        let inputs: Option<Vec<f64>> = self.inputs.iter().map(input).collect();
        if let Some(x) = inputs {
            samples.push((&x, &[lesson.y], lesson.weight), line);
        }
    }

    /// Adds the sample in `row`, if it holds one.
    fn take(&self, task: &dyn Task, row: &StepRow<String>, line: u64, samples: &mut Kept) {
        let features = task.features(&row.state);
        let input = |(_, place): &(String, Place)| match *place {
            Place::Feature(index) => features.get(index).copied(),
            Place::State(index) => row.state.get(index).copied(),
        };
        let inputs: Option<Vec<f64>> = self.inputs.iter().map(input).collect();
        let outputs: Option<Vec<f64>> = self.outputs.iter().map(|name| action(row, name)).collect();
        if let (Some(x), Some(y)) = (inputs, outputs) {
            samples.push((&x, &y, 1.0), line);
        }
    }

    /// The norms of the inputs: the profile's for features, 1 for others.
    fn norms(&self, task: &dyn Task, norms: &[f64]) -> Vec<f64> {
        let features = task.feature_names().len();
        let norm = |(_, place): &(String, Place)| match *place {
            Place::Feature(index) if norms.len() == features => norms.get(index).copied(),
            _ => None,
        };
        self.inputs.iter().map(|input| norm(input).unwrap_or(1.0)).collect()
    }
}

fn action(row: &StepRow<String>, name: &str) -> Option<f64> {
    match name {
        "u_human" => row.u_human,
        "u_machine" => row.u_machine,
        "u" => row.u,
        _ => row.u_applied,
    }
}

/// Main once more, as far as its lessons go: the teacher, and the shares that may freeze
/// what is learned.
struct Replay<'a> {
    task: &'a dyn Task,
    teacher: Teacher,
    sharing: Sharing,
    by_episode: bool,
    from_gate: bool,
    returns: bool,
    /// How the rollout before ended.
    before: Option<End>,
    total_measure: f64,
}

impl<'a> Replay<'a> {
    fn new(
        task: &'a dyn Task,
        profile: &Profile,
        sidecar: &Sidecar,
        episodes: &[EpisodeRow],
    ) -> Self {
        let (regions, _) = scale::regions(task, episodes);
        let names: Vec<&str> = regions.iter().map(|region| region.name).collect();
        Self {
            task,
            teacher: Teacher::new(&profile.teaching, profile.tick(), &names),
            sharing: Sharing::new(&profile.sharing, sidecar.mode, &regions),
            by_episode: profile.sharing.window_episodes.is_some(),
            from_gate: profile.teaching.from_gate,
            returns: profile.session.returns,
            before: None,
            total_measure: 0.0,
        }
    }

    /// Hands out the lessons that were ripe at `row`, as the control tick did. A row without
    /// an action is the last one of its rollout, which ended with `end`.
    fn take(&mut self, row: &StepRow<String>, end: End, mut learn: impl FnMut(Lesson)) {
        let cost = self.task.cost(&row.state);
        let region = self.task.region(&row.state);
        if row.step == 0 {
            let seen = self.teacher.seen();
            self.teacher.begin();
            if self.before == Some(End::Cap) && !self.returns {
                self.teacher.go_on(&seen);
            }
            self.total_measure = 0.0;
        }
        let (Some(applied), Some(reward)) = (row.u_applied, row.reward) else {
            self.before = Some(end);
            if end == End::Aborted {
                return;
            }
            while let Some(lesson) = self.teacher.close(end == End::Failed, cost) {
                learn(lesson);
            }
            if self.by_episode && row.step > 0 && end != End::Time {
                self.sharing.observe(region, self.total_measure / f64::from(row.step));
            }
            return;
        };
        let measure = self.task.measure(&row.state, reward);
        self.total_measure += measure;
        if !self.by_episode {
            self.sharing.observe(region, measure);
        }
        let lesson = self.teacher.see(&Sight {
            features: self.task.features(&row.state),
            region,
            cost,
            human: row.u_human.map_or(Intent::Absent, Intent::fresh),
            applied,
            teaches: self.sharing.teaches(region, self.from_gate),
        });
        lesson.into_iter().for_each(learn);
    }
}

/// The rollouts of main as `episodes.csv` lists them, repeated ones each on their own,
/// beside the rows of `steps.csv`.
struct Attempts<'a> {
    episodes: &'a [EpisodeRow],
    /// How many were begun.
    begun: usize,
    /// The episode and step of the last row.
    last: Option<(u32, u32)>,
    /// Rows of the one under way.
    rows: u32,
    /// Rows that should be there.
    lost: u64,
}

impl Attempts<'_> {
    /// How the rollout of `row`, the next one of the session, ended, if the learner kept what
    /// it learned from it. Rows of a rollout that was cut are not in the learner that would
    /// go on, nor here.
    fn keeps(&mut self, row: &StepRow<String>) -> Option<Result<End, FitError>> {
        if row.phase != Phase::Main {
            return None;
        }
        let goes_on =
            self.last.is_some_and(|(episode, step)| episode == row.episode && step < row.step);
        if !goes_on {
            self.close();
            self.begun += 1;
            self.rows = 0;
        }
        self.last = Some((row.episode, row.step));
        self.rows += u32::from(row.u_applied.is_some());
        match self.episodes.get(self.begun - 1) {
            None => None,
            Some(episode) if episode.episode == row.episode => {
                (episode.end != End::Discarded).then_some(Ok(episode.end))
            }
            Some(episode) => Some(Err(FitError::Unfit(format!(
                "steps.csv has rows of rollout {} of main where episodes.csv lists rollout {}; \
                 the files do not belong together",
                row.episode, episode.episode
            )))),
        }
    }

    /// The rollout under way has no further rows.
    fn close(&mut self) {
        let episode = self.begun.checked_sub(1).and_then(|index| self.episodes.get(index));
        self.lost += episode.map_or(0, |e| u64::from(e.steps.saturating_sub(self.rows)));
    }
}
