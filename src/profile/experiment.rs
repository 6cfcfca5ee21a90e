//! The one list of tasks. A new task is a name, a variant, and a line in each `match`.

use ron::error::SpannedResult;
use serde::de::DeserializeOwned;
use serde::{Serialize, Serializer};

use super::layout::{Layout, Profile};
use super::ron_options;
use crate::check::{Check, Checker};
use crate::plant::Plant;
use crate::plant::cart_pole::{self, CartPole};
use crate::signal::Seconds;
use crate::task::Task;
use crate::task::balance::{self, Balance};

/// A task with the parameters of its plant and its rules.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Experiment {
    /// Keep the pole up.
    Balance {
        /// The cart-pole.
        plant: cart_pole::Params,
        /// Release, failure and cap.
        rules: balance::Params,
    },
}

/// Reads a profile's text for one task.
pub(super) type Reader = fn(&str) -> SpannedResult<Profile>;

impl Experiment {
    /// The names of all tasks.
    pub const NAMES: [&'static str; 1] = [Balance::NAME];

    /// How a profile of `task` is read; `None` when there is no such task.
    pub(super) fn reader(task: &str) -> Option<Reader> {
        match task {
            Balance::NAME => Some(|text| read(text, |plant, rules| Self::Balance { plant, rules })),
            _ => None,
        }
    }

    /// The task's name outside.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Balance { .. } => Balance::NAME,
        }
    }

    /// The names of the state's numbers.
    #[must_use]
    pub const fn columns(&self) -> &'static [&'static str] {
        match self {
            Self::Balance { .. } => &CartPole::COLUMNS,
        }
    }

    /// The task, with control steps of `tick`.
    #[must_use]
    pub fn task(&self, tick: Seconds) -> Box<dyn Task> {
        match self {
            Self::Balance { plant, rules } => Box::new(Balance::new(rules, plant, tick)),
        }
    }

    /// The plant, with control steps of `tick`.
    #[must_use]
    pub fn plant(&self, tick: Seconds) -> Box<dyn Plant> {
        match self {
            Self::Balance { plant, .. } => Box::new(CartPole::new(plant.clone(), tick)),
        }
    }

    /// Writes `profile`, whose experiment this is.
    pub(super) fn serialize<S: Serializer>(
        &self,
        profile: &Profile,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        match self {
            Self::Balance { plant, rules } => profile.layout(plant, rules).serialize(serializer),
        }
    }

    fn sections(&self) -> (&dyn Check, &dyn Check) {
        match self {
            Self::Balance { plant, rules } => (plant, rules),
        }
    }
}

impl Check for Experiment {
    fn check(&self, c: &mut Checker<'_>) {
        let (plant, rules) = self.sections();
        plant.check(&mut c.section("plant"));
        rules.check(&mut c.section("rules"));
    }
}

fn read<P, R>(text: &str, experiment: impl FnOnce(P, R) -> Experiment) -> SpannedResult<Profile>
where
    P: DeserializeOwned + Default,
    R: DeserializeOwned + Default,
{
    Ok(ron_options().from_str::<Layout<P, R>>(text)?.profile(experiment))
}
