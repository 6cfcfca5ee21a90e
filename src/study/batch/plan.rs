//! From a study's file to its runs: checked, and always in the same order.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use super::params::{Arm, Pair, Params, Readout, Reference, Sets, Setting};
use super::{StudyError, library};
use crate::operator::Choice;
use crate::profile::{Document, Profile, Text, Wrong};
use crate::session::plan::Wanted;
use crate::task::mountain_car::MountainCar;

/// The most runs that a study may have.
const MOST_RUNS: usize = 1_000_000;
/// The most seeds.
const MOST_SEEDS: u32 = 100_000;
/// The most starts of a policy.
const MOST_STARTS: u32 = 100_000;
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
#[derive(Clone, Debug)]
pub struct Study {
    /// Its name.
    pub name: String,
    /// What its file says, with what a person asked for beside.
    pub params: Params,
    /// All its runs, by number.
    pub runs: Vec<Run>,
    /// The profile of each setting and arm.
    profiles: Vec<Vec<Profile>>,
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
    /// The study called `name_or_path`, with `changes`.
    ///
    /// # Errors
    /// When there is no such study, or with all that is wrong with it.
    pub fn find(
        name_or_path: &str,
        profiles: &Path,
        changes: &Changes,
    ) -> Result<Self, StudyError> {
        Self::of(&library::find(name_or_path, profiles)?, profiles, changes)
    }

    /// The study of `text`, based on a profile of the folder `profiles`.
    ///
    /// # Errors
    /// With all that is wrong with it.
    pub fn of(text: &Text, profiles: &Path, changes: &Changes) -> Result<Self, StudyError> {
        let mut params: Params = text.parse().map_err(StudyError::Text)?;
        if let Some(count) = changes.seeds {
            params.seeds.count = count;
        }
        let wrong = faults(&params);
        if !wrong.is_empty() {
            return Err(StudyError::Text(text.refuse(wrong)));
        }
        params.settings = sweep(&params.settings, &changes.sets);
        let base = Document::find(&params.profile, profiles)?;
        let profiles = read_profiles(&base, &params)?;
        let wrong = misfits(&params, &profiles);
        if !wrong.is_empty() {
            return Err(StudyError::Text(text.refuse(wrong)));
        }
        let runs = runs(&params);
        if runs.len() > MOST_RUNS {
            let problem = format!("{} runs are more than {MOST_RUNS}", runs.len());
            return Err(StudyError::TooMany { problem });
        }
        let identity = identity(&params, &profiles);
        Ok(Self { name: text.name().to_owned(), params, runs, profiles, identity })
    }

    /// Everything that its results depend on, as one text: two studies with the same give the
    /// same results.
    #[must_use]
    pub fn identity(&self) -> &str {
        &self.identity
    }

    /// The profile of a run; that of references is the first arm's.
    #[must_use]
    pub fn profile(&self, run: &Run) -> &Profile {
        let arm = match run.what {
            What::Session { arm, .. } => arm,
            What::References => 0,
        };
        &self.profiles[run.setting][arm]
    }

    /// The name of the task.
    #[must_use]
    pub fn task(&self) -> &'static str {
        self.profiles[0][0].experiment.name()
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

/// The `number`th of `of` shares of a study's runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    pub number: u32,
    /// How many there are.
    pub of: u32,
}

impl Shard {
    /// The only share: all runs.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Whether the run of that number is in it: they are dealt out one by one.
    #[must_use]
    pub const fn holds(self, run: u32) -> bool {
        run.saturating_sub(1) % self.of == self.number - 1
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(words: &str) -> Result<Self, String> {
        let shard = words.split_once('/').and_then(|(number, of)| {
            Some(Self { number: number.trim().parse().ok()?, of: of.trim().parse().ok()? })
        });
        shard
            .filter(|shard| (1..=shard.of).contains(&shard.number))
            .ok_or_else(|| "give K/N, share K of N, K from 1 to N, such as 1/8".to_owned())
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// Who steers in `arm`.
fn operators<'a>(params: &'a Params, arm: &'a Arm) -> &'a [String] {
    arm.operator.as_ref().map_or(&params.operators, std::slice::from_ref)
}

/// The runs, the arms of a seed one after the other.
fn runs(params: &Params) -> Vec<Run> {
    let mut runs = Vec::new();
    let mut add = |setting, seed, what| {
        let number = u32::try_from(runs.len() + 1).unwrap_or(u32::MAX);
        runs.push(Run { number, setting, seed, what });
    };
    for setting in 0..params.settings.len() {
        if !params.references.is_empty() {
            add(setting, params.seeds.first, What::References);
        }
        let mut choices: Vec<&String> = Vec::new();
        for operator in params.arms.iter().flat_map(|arm| operators(params, arm)) {
            if !choices.contains(&operator) {
                choices.push(operator);
            }
        }
        for operator in choices {
            for seed in 0..u64::from(params.seeds.count) {
                for (arm, of) in params.arms.iter().enumerate() {
                    if let Ok(choice) = operator.parse()
                        && operators(params, of).contains(operator)
                    {
                        let what = What::Session { arm, operator: choice };
                        add(setting, params.seeds.first + seed, what);
                    }
                }
            }
        }
    }
    runs
}

/// What is wrong with `params` whatever the profile.
fn faults(params: &Params) -> Vec<Wrong> {
    let mut wrong = Vec::new();
    let mut demand = |holds: bool, key, message: String, expected: &str| {
        if !holds {
            wrong.push(Wrong { key, message, expected: expected.to_owned() });
        }
    };
    let named = "one or more, each with a name of its own: 1 to 64 letters, digits, - _ . =";
    for (key, names) in [
        ("arms", params.arms.iter().map(|arm| &arm.name).collect::<Vec<_>>()),
        ("settings", params.settings.iter().map(|setting| &setting.name).collect()),
        ("starts", params.starts.iter().map(|starts| &starts.name).collect()),
    ] {
        for (index, name) in names.iter().enumerate() {
            let twice = names[..index].contains(name);
            demand(!twice, key, format!("`{key}` has two called `{name}`"), named);
            demand(is_name(name), key, format!("`{name}` is no name in `{key}`"), named);
            let is_free = key != "arms" || *name != REFERENCE_ARM;
            demand(is_free, key, format!("no arm can be called `{REFERENCE_ARM}`"), named);
        }
    }
    demand(!params.arms.is_empty(), "arms", "there are no arms".to_owned(), named);
    demand(!params.starts.is_empty(), "starts", "policies have no `starts`".to_owned(), named);
    let seeds = params.seeds;
    let allowed = format!("1 to {MOST_SEEDS}");
    let message = format!("`seeds.count` is {}: there is nothing to run", seeds.count);
    demand((1..=MOST_SEEDS).contains(&seeds.count), "seeds.count", message, &allowed);
    let last = seeds.first.saturating_add(u64::from(seeds.count));
    let message = format!("`seeds.first` is {}", seeds.first);
    demand(last <= 1 << 53, "seeds.first", message, "below 2^53, which every JSON reader knows");
    for starts in &params.starts {
        let allowed = format!("1 to {MOST_STARTS}");
        let message = format!("`{}` has {} starts", starts.name, starts.count);
        demand((1..=MOST_STARTS).contains(&starts.count), "starts", message, &allowed);
    }
    let points = &params.checkpoints;
    let are_tenths = points.iter().all(|point| *point % 10 == 0 && (10..=100).contains(point));
    demand(
        are_tenths && points.is_sorted_by(|a, b| a < b) && !points.is_empty(),
        "checkpoints",
        format!("`checkpoints` is {points:?}"),
        "some of 10, 20, … 100, in order",
    );
    let readouts = &params.readouts;
    let twice = (1..readouts.len()).any(|at| readouts[..at].contains(&readouts[at]));
    demand(
        !twice && !readouts.is_empty(),
        "readouts",
        format!("`readouts` is {readouts:?}"),
        "some of agent, continuous, rounded, sign, each once",
    );
    for pair in &params.compare {
        for (arm, readout) in [&pair.of, &pair.from] {
            let is_known =
                params.arms.iter().any(|known| known.name == *arm) && readouts.contains(readout);
            let message = format!("there is no arm `{arm}` with the readout {}", readout.word());
            demand(is_known, "compare", message, "arms and readouts of this study");
        }
    }
    let last = params.starts.last().map_or(0, |starts| starts.count);
    let beyond = params.trajectories.iter().find(|start| **start >= last);
    demand(
        beyond.is_none(),
        "trajectories",
        format!("there is no start {}", beyond.unwrap_or(&0)),
        "numbers of the last of `starts`, from 0",
    );
    wrong
}

/// What does not go with the task, or with who steers.
fn misfits(params: &Params, profiles: &[Vec<Profile>]) -> Vec<Wrong> {
    let mut wrong = Vec::new();
    let experiment = &profiles[0][0].experiment;
    let mut refuse = |key, message: String, expected: &str| {
        let fault = Wrong { key, message, expected: expected.to_owned() };
        if !wrong.contains(&fault) {
            wrong.push(fault);
        }
    };
    let expected = "simulated:SKILL[:TYPE], q_learning (mountain car) or none: nobody is there";
    for arm in &params.arms {
        let words = operators(params, arm);
        if words.is_empty() {
            let message = format!("nobody steers in the arm `{}`", arm.name);
            refuse("arms", message, "an `operator` of its own, or `operators` of the study");
        }
        let key = if arm.operator.is_some() { "arms" } else { "operators" };
        for word in words {
            match word.parse::<Choice>() {
                Ok(choice @ (Choice::Simulated(..) | Choice::QLearning | Choice::None)) => {
                    if let Err(stranger) = experiment.knows(&choice) {
                        refuse(key, stranger.to_string(), expected);
                    }
                    if params.readouts.contains(&Readout::Agent) && choice != Choice::QLearning {
                        let message = format!("{word} is no agent whose policy could be tested");
                        refuse("readouts", message, "agent only where q_learning steers alone");
                    }
                }
                Ok(_) => refuse(key, format!("{word} needs a person or a file"), expected),
                Err(unknown) => refuse(key, unknown.to_string(), expected),
            }
        }
    }
    for reference in &params.references {
        if *reference != Reference::Zero && experiment.name() != MountainCar::NAME {
            let message = format!("{} is known of the mountain car only", reference.word());
            refuse("references", message, "zero");
        }
    }
    let teaches = |profile: &Profile| profile.session.phases.contains(&Wanted::Main);
    if !profiles.iter().flatten().all(teaches) {
        refuse("sets", "session.phases has no main phase".to_owned(), "a main phase in every run");
    }
    wrong
}

/// The profile of each setting and arm.
fn read_profiles(base: &Document, params: &Params) -> Result<Vec<Vec<Profile>>, StudyError> {
    let read = |layers: &[&Sets], mode: Option<&Arm>| {
        let mut document = base.clone();
        document.change(layers.iter().flat_map(|sets| sets.iter()));
        if let Some(arm) = mode {
            document.set("mode", arm.mode.word());
        }
        let profile = document.read().map_err(StudyError::Text)?;
        let task = profile.experiment.task(profile.tick());
        let built = profile.learner.build(task.feature_names().len(), task.action_limit());
        built.map_err(|error| StudyError::Learner { error })?;
        Ok(profile)
    };
    // Faults of the base are told once, not for every arm.
    read(&[&params.sets], None)?;
    let of_setting = |setting: &Setting| {
        let of_arm = |arm: &Arm| read(&[&params.sets, &setting.sets, &arm.sets], Some(arm));
        params.arms.iter().map(of_arm).collect()
    };
    params.settings.iter().map(of_setting).collect()
}

/// The settings, or the one without changes, each with each of the values that are swept over.
fn sweep(settings: &[Setting], sets: &[(String, String)]) -> Vec<Setting> {
    let plain = Setting { name: "profile".to_owned(), sets: Sets::default() };
    let mut swept = if settings.is_empty() { vec![plain] } else { settings.to_vec() };
    for (key, words) in sets {
        let values = values(words);
        swept = swept
            .iter()
            .flat_map(|setting| {
                values.iter().map(|value| {
                    let mut with = setting.clone();
                    with.sets.0.insert(key.clone(), (*value).to_owned());
                    if values.len() > 1 {
                        let is_plain = settings.is_empty() && with.name == "profile";
                        let before = if is_plain { String::new() } else { with.name + " " };
                        with.name = format!("{before}{key}={value}");
                    }
                    with
                })
            })
            .collect();
    }
    swept
}

/// The values between the commas that stand in no bracket and no quotes.
fn values(words: &str) -> Vec<&str> {
    let (mut depth, mut quoted, mut from) = (0_i32, false, 0);
    let mut values = Vec::new();
    for (at, c) in words.char_indices() {
        match c {
            '"' => quoted = !quoted,
            _ if quoted => {}
            '[' | '(' | '{' => depth += 1,
            ']' | ')' | '}' => depth -= 1,
            ',' if depth == 0 => {
                values.push(words[from..at].trim());
                from = at + 1;
            }
            _ => {}
        }
    }
    values.push(words[from..].trim());
    values
}

fn is_name(name: &str) -> bool {
    let is_plain = |b: u8| b.is_ascii_alphanumeric() || b"-_.=".contains(&b);
    (1..=64).contains(&name.len()) && name.bytes().all(is_plain)
}

fn identity(params: &Params, profiles: &[Vec<Profile>]) -> String {
    let profiles: Vec<String> = profiles.iter().flatten().map(Profile::to_ron).collect();
    // Numbers, texts and words always have a form in JSON.
    serde_json::to_string(&(env!("CARGO_PKG_VERSION"), params, profiles)).unwrap_or_default()
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
