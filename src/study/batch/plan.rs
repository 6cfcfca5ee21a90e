//! From a study's file to its runs: checked, and always in the same order.

use std::collections::HashMap;
use std::fmt;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use super::check::{faults, misfits};
use super::identity::Fingerprint;
use super::params::{Arm, Pair, Params, Sets, Setting};
use super::shard::Shard;
use super::sweep::sweep;
use super::{StudyError, library};
use crate::operator::Choice;
use crate::profile::{Document, Profile, Text, Wrong};
use crate::session::plan::Wanted;

/// The most runs that a study may have.
const MOST_RUNS: usize = 1_000_000;
/// The word for the runs that are no arm: what arms are compared with.
pub const REFERENCE_ARM: &str = "reference";

/// What a person asks of a study beside its file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// Changes to the profile. Several values, with commas between, are settings of their own.
    pub sets: Vec<(String, String)>,
    /// So many seeds in place of the file's.
    pub seeds: Option<u32>,
}

/// A study, checked, with all its runs.
#[derive(Debug)]
pub struct Study {
    /// Its name.
    pub name: String,
    /// What its file says, with what a person asked for beside.
    pub params: Params,
    /// All its runs, by number.
    pub runs: Vec<Run>,
    /// The profile that all are based on.
    base: Document,
    /// The profile of the first run.
    first: Arc<Profile>,
    /// The profiles of the setting that was asked for last, by arm: those of all settings would
    /// fill the memory.
    latest: Mutex<Option<(usize, Vec<Arc<Profile>>)>>,
    identity: String,
}

/// One run of a study.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// Its number, from 1.
    pub number: u32,
    /// The index of its setting.
    pub setting: usize,
    /// The seed of everything left to chance.
    pub seed: u64,
    /// What is done.
    pub what: What,
}

/// What a run does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum What {
    /// A session of an arm, and tests of its policies.
    Session {
        /// The index of the arm.
        arm: usize,
        /// Who steers.
        operator: Choice,
    },
    /// Tests of what the arms are compared with.
    References,
}

impl Study {
    /// The study called `name_or_path`, with `changes`. `is_enough` says when to give up.
    ///
    /// # Errors
    /// When there is no such study, or with all that is wrong with it.
    pub fn find(
        name_or_path: &str,
        profiles: &Path,
        changes: &Changes,
        is_enough: &dyn Fn() -> bool,
    ) -> Result<Self, StudyError> {
        Self::of(&library::find(name_or_path, profiles)?, profiles, changes, is_enough)
    }

    /// The study of `text`, based on a profile of the folder `profiles`. `is_enough` says when to
    /// give up.
    ///
    /// # Errors
    /// With all that is wrong with it.
    pub fn of(
        text: &Text,
        profiles: &Path,
        changes: &Changes,
        is_enough: &dyn Fn() -> bool,
    ) -> Result<Self, StudyError> {
        let mut params: Params = text.parse().map_err(StudyError::Text)?;
        if let Some(count) = changes.seeds {
            params.seeds.count = count;
        }
        refuse(text, faults(&params))?;
        params.settings = sweep(&params, &changes.sets)?;
        // Counted before they are made.
        let many = count(&params).filter(|many| *many <= MOST_RUNS);
        let problem = || format!("there are more than {MOST_RUNS} runs");
        let many = many.ok_or_else(|| StudyError::TooMany { problem: problem() })?;
        let base = Document::find(&params.profile, profiles)?;
        // Faults of the base are told once, not for every arm.
        let mut plain = base.clone();
        plain.change(params.sets.iter());
        let first = Arc::new(plain.read().map_err(StudyError::Text)?);
        refuse(text, misfits(&params, &first.experiment))?;
        let identity = survey(text, &base, &params, is_enough)?;
        let runs = runs(&params, many);
        let name = text.name().to_owned();
        let latest = Mutex::new(None);
        let mut study = Self { name, params, runs, base, first, latest, identity };
        study.first = study.profile(&study.runs[0])?;
        Ok(study)
    }

    /// A word for everything that its results depend on: two studies with the same give the same
    /// results.
    #[must_use]
    pub fn identity(&self) -> &str {
        &self.identity
    }

    /// The profile of a run; that of references is the first arm's.
    ///
    /// # Errors
    /// None of a study that was found right.
    pub fn profile(&self, run: &Run) -> Result<Arc<Profile>, StudyError> {
        let arm = match run.what {
            What::Session { arm, .. } => arm,
            What::References => 0,
        };
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((setting, profiles)) = &*latest
            && *setting == run.setting
        {
            return Ok(Arc::clone(&profiles[arm]));
        }
        let setting = &self.params.settings[run.setting];
        let of_arm = |arm| read_profile(&self.base, &self.params, setting, arm).map(Arc::new);
        let profiles =
            self.params.arms.iter().map(of_arm).collect::<Result<Vec<_>, StudyError>>()?;
        let profile = Arc::clone(&profiles[arm]);
        *latest = Some((run.setting, profiles));
        Ok(profile)
    }

    /// The name of the task.
    #[must_use]
    pub fn task(&self) -> &'static str {
        self.first.experiment.name()
    }

    /// The preset of the first arm's profile.
    #[must_use]
    pub fn preset(&self) -> &str {
        &self.first.preset
    }

    /// The names of the task's states.
    #[must_use]
    pub fn columns(&self) -> &'static [&'static str] {
        self.first.experiment.columns()
    }

    /// The last checkpoint, %.
    #[must_use]
    pub fn last_checkpoint(&self) -> u8 {
        self.params.checkpoints.last().copied().unwrap_or(100)
    }

    /// How results call a run.
    #[must_use]
    pub fn labels(&self, run: &Run) -> Labels {
        let setting = self.params.settings[run.setting].name.clone();
        let (arm, operator) = match &run.what {
            What::Session { arm, operator } => {
                (self.params.arms[*arm].name.clone(), operator.to_string())
            }
            What::References => (REFERENCE_ARM.to_owned(), String::new()),
        };
        Labels { run: run.number, arm, operator, setting, seed: run.seed }
    }

    /// The runs of `shard`.
    pub fn share(&self, shard: Shard) -> impl Iterator<Item = &Run> {
        self.runs.iter().filter(move |run| shard.holds(run.number))
    }

    /// All pairs to be compared: those that the file names, and each arm with the first.
    #[must_use]
    pub fn pairs(&self) -> Vec<Pair> {
        let Params { arms, readouts, compare, .. } = &self.params;
        let mut pairs = compare.clone();
        let (first, others) = arms.split_at(1);
        for arm in others {
            for readout in readouts {
                let side = |arm: &Arm| (arm.name.clone(), *readout);
                let pair = Pair { of: side(arm), from: side(&first[0]) };
                if !pairs.contains(&pair) {
                    pairs.push(pair);
                }
            }
        }
        pairs
    }

    /// Who steered the runs of the arm `from` that those of the arm `of` with `operator` are
    /// compared with: the same, but where an arm has an operator of its own.
    #[must_use]
    pub fn opposite(&self, of: &str, from: &str, operator: &str) -> Vec<String> {
        let arm = |name: &str| self.params.arms.iter().find(|arm| arm.name == name);
        match (arm(of), arm(from)) {
            (Some(of), Some(from)) if of.operator.is_some() || from.operator.is_some() => {
                choices(&self.params, from).map(|choice| choice.to_string()).collect()
            }
            _ => vec![operator.to_owned()],
        }
    }

    /// Whether two runs, one after the other, may be compared: what such runs came to is held in
    /// memory together.
    #[must_use]
    pub fn are_together(&self, a: &Run, b: &Run) -> bool {
        let is_mixed = self.params.arms.iter().any(|arm| arm.operator.is_some());
        a.setting == b.setting && (is_mixed || a.operator() == b.operator())
    }
}

impl Run {
    /// Who steers.
    fn operator(&self) -> Option<&Choice> {
        match &self.what {
            What::Session { operator, .. } => Some(operator),
            What::References => None,
        }
    }
}

/// How results call a run.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Labels {
    /// Its number.
    pub run: u32,
    /// The arm.
    pub arm: String,
    /// Who steered.
    pub operator: String,
    /// The setting.
    pub setting: String,
    /// The seed.
    pub seed: u64,
}

impl fmt::Display for Labels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { run, arm, operator, setting, seed } = self;
        write!(f, "run {run} ({arm}, ")?;
        if !operator.is_empty() {
            write!(f, "{operator}, ")?;
        }
        write!(f, "{setting}, seed {seed})")
    }
}

/// Who steers in `arm`, in words.
pub(super) fn operators<'a>(params: &'a Params, arm: &'a Arm) -> &'a [String] {
    arm.operator.as_ref().map_or(&params.operators, std::slice::from_ref)
}

/// Who steers in `arm`.
fn choices<'a>(params: &'a Params, arm: &'a Arm) -> impl Iterator<Item = Choice> + use<'a> {
    operators(params, arm).iter().filter_map(|words| words.parse().ok())
}

/// The seeds of references: one, since they learn nothing, but where starts are drawn.
fn reference_seeds(params: &Params) -> u32 {
    match (params.references.is_empty(), params.starts.iter().any(|starts| starts.random)) {
        (true, _) => 0,
        (false, true) => params.seeds.count,
        (false, false) => 1,
    }
}

/// How many runs there are; none if the number is beyond all bounds.
fn count(params: &Params) -> Option<usize> {
    let people: usize = params.arms.iter().map(|arm| operators(params, arm).len()).sum();
    let sessions = people.checked_mul(params.seeds.count as usize)?;
    let of_setting = sessions.checked_add(reference_seeds(params) as usize)?;
    of_setting.checked_mul(params.settings.len())
}

/// The runs, so `many`, the arms of a seed one after the other.
fn runs(params: &Params, many: usize) -> Vec<Run> {
    let mut runs = Vec::with_capacity(many);
    let mut people: Vec<Choice> = Vec::new();
    for choice in params.arms.iter().flat_map(|arm| choices(params, arm)) {
        if !people.contains(&choice) {
            people.push(choice);
        }
    }
    let steers: Vec<Vec<Choice>> =
        params.arms.iter().map(|arm| choices(params, arm).collect()).collect();
    let mut add = |setting, seed: u32, what| {
        let number = u32::try_from(runs.len() + 1).unwrap_or(u32::MAX);
        runs.push(Run { number, setting, seed: params.seeds.first + u64::from(seed), what });
    };
    for setting in 0..params.settings.len() {
        for seed in 0..reference_seeds(params) {
            add(setting, seed, What::References);
        }
        for operator in &people {
            for seed in 0..params.seeds.count {
                for arm in (0..steers.len()).filter(|arm| steers[*arm].contains(operator)) {
                    add(setting, seed, What::Session { arm, operator: operator.clone() });
                }
            }
        }
    }
    runs
}

fn refuse(text: &Text, wrong: Vec<Wrong>) -> Result<(), StudyError> {
    if wrong.is_empty() { Ok(()) } else { Err(StudyError::Text(text.refuse(wrong))) }
}

/// The profile of `arm` under `setting`.
fn read_profile(
    base: &Document,
    params: &Params,
    setting: &Setting,
    arm: &Arm,
) -> Result<Profile, StudyError> {
    let mut document = base.clone();
    let layers = [&params.sets, &setting.sets, &arm.sets];
    document.change(layers.into_iter().flat_map(Sets::iter));
    document.set("mode", arm.mode.word());
    document.read().map_err(StudyError::Text)
}

/// Reads the profile of each setting and arm, and returns the study's identity: its version, what
/// its file says, and all that is in the profiles.
fn survey(
    text: &Text,
    base: &Document,
    params: &Params,
    is_enough: &dyn Fn() -> bool,
) -> Result<String, StudyError> {
    let mut identity = Fingerprint::default();
    identity.take(env!("CARGO_PKG_VERSION"));
    // Numbers, texts and words always have a form in JSON.
    identity.take(&serde_json::to_string(params).unwrap_or_default());
    let mut known: HashMap<String, &str> = HashMap::new();
    for setting in &params.settings {
        let mut of_setting = Fingerprint::default();
        for arm in &params.arms {
            if is_enough() {
                return Err(StudyError::Interrupted);
            }
            let profile = read_profile(base, params, setting, arm)?;
            let task = profile.experiment.task(profile.tick());
            let built = profile.learner.build(task.feature_names().len(), task.action_limit());
            built.map_err(|error| StudyError::Learner { error })?;
            let has_main = profile.session.phases.contains(&Wanted::Main);
            refuse(text, if has_main { Vec::new() } else { vec![without_main()] })?;
            of_setting.take(&profile.to_ron());
        }
        let word = of_setting.word();
        identity.take(&word);
        if let Some(other) = known.insert(word, &setting.name) {
            let problem = format!(
                "the settings `{other}` and `{}` are the same, each value: leave one out",
                setting.name
            );
            return Err(StudyError::Sets { problem });
        }
    }
    Ok(identity.word())
}

fn without_main() -> Wrong {
    Wrong {
        key: "sets",
        message: "session.phases has no main phase".to_owned(),
        expected: "a main phase in every run".to_owned(),
    }
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
