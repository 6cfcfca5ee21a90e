//! What a study's file says.

use std::collections::BTreeMap;

use ron::value::RawValue;
use serde::{Deserialize, Deserializer, Serialize};

use crate::sharing::Mode;

/// A study, as its file says it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Params {
    /// The profile that all its runs are based on: a name or a path,
    pub profile: String,
    /// with these changes.
    #[serde(default)]
    pub sets: Sets,
    /// What is compared.
    pub arms: Vec<Arm>,
    /// Who steers, in every arm that does not say it itself.
    #[serde(default)]
    pub operators: Vec<String>,
    /// Under which settings; none: the profile's alone.
    #[serde(default)]
    pub settings: Vec<Setting>,
    /// The seeds, which all arms share.
    pub seeds: Seeds,
    /// After how much of main the policies are tested, %: tenths.
    #[serde(default = "tenths")]
    pub checkpoints: Vec<u8>,
    /// The policies that are tested.
    #[serde(default = "continuous")]
    pub readouts: Vec<Readout>,
    /// Where they start.
    #[serde(default)]
    pub starts: Vec<Starts>,
    /// What they are compared with.
    #[serde(default)]
    pub references: Vec<Reference>,
    /// Pairs of an arm and a readout each, whose difference is taken seed by seed, beside those of
    /// each arm with the first at the same readout.
    #[serde(default)]
    pub compare: Vec<Pair>,
    /// Starts, by their numbers in the last of `starts`, whose final trajectories are kept.
    #[serde(default)]
    pub trajectories: Vec<u32>,
}

/// One of the ways that are compared.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arm {
    /// Its name.
    pub name: String,
    /// Whether the robot takes over while it learns.
    pub mode: Mode,
    /// Who steers, if not the study's operators.
    #[serde(default)]
    pub operator: Option<String>,
    /// Its changes to the profile.
    #[serde(default)]
    pub sets: Sets,
}

/// Changes under which all arms are run.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Setting {
    /// Its name.
    pub name: String,
    /// The changes.
    #[serde(default)]
    pub sets: Sets,
}

/// Seeds one after the other.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Seeds {
    /// The first,
    #[serde(default = "one")]
    pub first: u64,
    /// and how many.
    pub count: u32,
}

/// Which policy is tested, and how its action is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Readout {
    /// What the agent that steered takes for the best.
    Agent,
    /// What the learner says,
    Continuous,
    /// that as the nearest of fully back, none and fully ahead (a third of the range each),
    Rounded,
    /// or its sign, with full effort.
    Sign,
}

impl Readout {
    /// The word in results.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Agent => "agent",
            Self::Continuous => "continuous",
            Self::Rounded => "rounded",
            Self::Sign => "sign",
        }
    }
}

/// Where policies start.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Starts {
    /// The word in results.
    pub name: String,
    /// How many there are. A grid of one is the start that was trained, where there is one.
    pub count: u32,
    /// Whether they are drawn, in place of the task's grid.
    #[serde(default)]
    pub random: bool,
}

/// What policies are compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reference {
    /// The fewest steps that are possible (mountain car).
    Optimum,
    /// Full effort in the direction of motion (mountain car).
    Sign,
    /// No action at all.
    Zero,
}

impl Reference {
    /// The word in results.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Optimum => "optimum",
            Self::Sign => "sign(v)",
            Self::Zero => "zero",
        }
    }
}

/// An arm with a readout, and what it is compared with.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pair {
    /// The arm and its readout,
    pub of: (String, Readout),
    /// and those that are subtracted.
    pub from: (String, Readout),
}

/// Changes to a profile, as `--set` makes them: key and value.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Sets(pub BTreeMap<String, String>);

impl Sets {
    /// The changes, one by one.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.0.iter().map(|(key, value)| (key.as_str(), value.as_str()))
    }
}

impl<'de> Deserialize<'de> for Sets {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = BTreeMap::<String, Box<RawValue>>::deserialize(deserializer)?;
        Ok(Self(
            raw.into_iter().map(|(key, value)| (key, value.get_ron().trim().to_owned())).collect(),
        ))
    }
}

const fn one() -> u64 {
    1
}

fn tenths() -> Vec<u8> {
    (1..=10).map(|tenth| tenth * 10).collect()
}

fn continuous() -> Vec<Readout> {
    vec![Readout::Continuous]
}
