//! The one list of tasks. A new task is a name, a variant, and a line in each `match`.

use ron::error::SpannedResult;
use serde::de::DeserializeOwned;
use serde::{Serialize, Serializer};

use super::layout::{Layout, Profile};
use super::ron_options;
use crate::check::{Check, Checker};
use crate::operator::{Choice, q_learning, simulated};
use crate::plant::Plant;
use crate::plant::ball_beam::{self, BallBeam};
use crate::plant::cart_pole::{self, CartPole};
use crate::plant::mountain_car as hill;
use crate::signal::Seconds;
use crate::task::Task;
use crate::task::balance::{self, Balance};
use crate::task::mountain_car::{self, MountainCar};
use crate::task::speed_up::{self, SpeedUp};
use crate::task::swing_up::{self, SwingUp};

/// A task with the parameters of its plant and its rules.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[expect(clippy::large_enum_variant, reason = "a profile has one, and a program few profiles")]
pub enum Experiment {
    /// Keep the pole up.
    Balance {
        /// The cart-pole.
        plant: cart_pole::Params,
        /// Release, failure and cap.
        rules: balance::Params,
        /// Who steers where nobody is there.
        simulated: simulated::cart_pole::Params,
    },
    /// Swing the pole up and keep it there.
    SwingUp {
        /// The cart-pole.
        plant: cart_pole::Params,
        /// Times and regions.
        rules: swing_up::Params,
        /// Who steers where nobody is there.
        simulated: simulated::swing_up::Params,
    },
    /// Roll the ball as fast as possible.
    SpeedUp {
        /// The ball and beam.
        plant: ball_beam::Params,
        /// Times, limits and scale.
        rules: speed_up::Params,
        /// Who steers where nobody is there.
        simulated: simulated::ball_beam::Params,
    },
    /// Drive up to the flag.
    MountainCar {
        /// The car on its hill.
        plant: hill::Params,
        /// Start, rewards and scale.
        rules: mountain_car::Params,
        /// Who steers where nobody is there.
        simulated: simulated::mountain_car::Params,
    },
}

/// An operator that does not know a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "q_learning learns the mountain car alone and does not know {task}: choose another operator, \
     such as simulated:average, or a profile of the mountain car"
)]
pub struct Stranger {
    task: &'static str,
}

/// Reads a profile's text for one task.
pub(super) type Reader = fn(&str) -> SpannedResult<Profile>;

impl Experiment {
    /// The names of all tasks.
    pub const NAMES: [&'static str; 4] =
        [Balance::NAME, SwingUp::NAME, SpeedUp::NAME, MountainCar::NAME];

    /// How a profile of `task` is read; `None` when there is no such task.
    pub(super) fn reader(task: &str) -> Option<Reader> {
        match task {
            Balance::NAME => Some(|text| {
                read(text, |plant, rules, simulated| Self::Balance { plant, rules, simulated })
            }),
            SwingUp::NAME => Some(|text| {
                read(text, |plant, rules, simulated| Self::SwingUp { plant, rules, simulated })
            }),
            SpeedUp::NAME => Some(|text| {
                read(text, |plant, rules, simulated| Self::SpeedUp { plant, rules, simulated })
            }),
            MountainCar::NAME => Some(|text| {
                read(text, |plant, rules, simulated| Self::MountainCar { plant, rules, simulated })
            }),
            _ => None,
        }
    }

    /// Every task with the numbers of the rooms.
    #[must_use]
    pub fn all() -> [Self; 4] {
        [
            Self::Balance {
                plant: cart_pole::Params::default(),
                rules: balance::Params::default(),
                simulated: simulated::cart_pole::Params::default(),
            },
            Self::SwingUp {
                plant: cart_pole::Params { pole_length_m: 0.6, ..cart_pole::Params::default() },
                rules: swing_up::Params::default(),
                simulated: simulated::swing_up::Params::default(),
            },
            Self::SpeedUp {
                plant: ball_beam::Params::default(),
                rules: speed_up::Params::default(),
                simulated: simulated::ball_beam::Params::default(),
            },
            Self::MountainCar {
                plant: hill::Params::default(),
                rules: mountain_car::Params::default(),
                simulated: simulated::mountain_car::Params::default(),
            },
        ]
    }

    /// The task's name outside.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Balance { .. } => Balance::NAME,
            Self::SwingUp { .. } => SwingUp::NAME,
            Self::SpeedUp { .. } => SpeedUp::NAME,
            Self::MountainCar { .. } => MountainCar::NAME,
        }
    }

    /// Its plant, if that is a cart-pole.
    #[must_use]
    pub const fn cart_pole(&self) -> Option<&cart_pole::Params> {
        match self {
            Self::Balance { plant, .. } | Self::SwingUp { plant, .. } => Some(plant),
            Self::SpeedUp { .. } | Self::MountainCar { .. } => None,
        }
    }

    /// The names of the state's numbers.
    #[must_use]
    pub const fn columns(&self) -> &'static [&'static str] {
        match self {
            Self::Balance { .. } | Self::SwingUp { .. } => &CartPole::COLUMNS,
            Self::SpeedUp { .. } => &BallBeam::COLUMNS,
            Self::MountainCar { .. } => &hill::MountainCar::COLUMNS,
        }
    }

    /// The unit of the action, one or two characters.
    #[must_use]
    pub const fn action_unit(&self) -> &'static str {
        match self {
            Self::Balance { .. } | Self::SwingUp { .. } => "N",
            Self::SpeedUp { .. } => "V",
            Self::MountainCar { .. } => "",
        }
    }

    /// The task, with control steps of `tick`.
    #[must_use]
    pub fn task(&self, tick: Seconds) -> Box<dyn Task> {
        match self {
            Self::Balance { plant, rules, .. } => Box::new(Balance::new(rules, plant, tick)),
            Self::SwingUp { plant, rules, .. } => Box::new(SwingUp::new(rules, plant, tick)),
            Self::SpeedUp { plant, rules, .. } => Box::new(SpeedUp::new(rules, plant, tick)),
            Self::MountainCar { plant, rules, .. } => Box::new(MountainCar::new(rules, plant)),
        }
    }

    /// The plant, with control steps of `tick`.
    #[must_use]
    pub fn plant(&self, tick: Seconds) -> Box<dyn Plant> {
        match self {
            Self::Balance { plant, .. } | Self::SwingUp { plant, .. } => {
                Box::new(CartPole::new(plant.clone(), tick))
            }
            Self::SpeedUp { plant, .. } => Box::new(BallBeam::new(plant.clone(), tick)),
            Self::MountainCar { plant, .. } => Box::new(hill::MountainCar::new(plant.clone())),
        }
    }

    /// The agent that learns this task in the person's place, knowing nothing yet.
    ///
    /// # Errors
    /// When there is none for this task.
    pub fn agent(&self, seed: u64) -> Result<q_learning::QLearner, Stranger> {
        match self {
            Self::MountainCar { plant, simulated, .. } => {
                Ok(q_learning::QLearner::new(&simulated.q_learning, seed, plant))
            }
            _ => Err(Stranger { task: self.name() }),
        }
    }

    /// That the operator of `choice` knows this task.
    ///
    /// # Errors
    /// When it does not.
    pub const fn knows(&self, choice: &Choice) -> Result<(), Stranger> {
        match (choice, self) {
            (Choice::QLearning, Self::MountainCar { .. }) => Ok(()),
            (Choice::QLearning, _) => Err(Stranger { task: self.name() }),
            _ => Ok(()),
        }
    }

    /// Writes `profile`, whose experiment this is.
    pub(super) fn serialize<S: Serializer>(
        &self,
        profile: &Profile,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        match self {
            Self::Balance { plant, rules, simulated } => {
                profile.layout(plant, rules, simulated).serialize(serializer)
            }
            Self::SwingUp { plant, rules, simulated } => {
                profile.layout(plant, rules, simulated).serialize(serializer)
            }
            Self::SpeedUp { plant, rules, simulated } => {
                profile.layout(plant, rules, simulated).serialize(serializer)
            }
            Self::MountainCar { plant, rules, simulated } => {
                profile.layout(plant, rules, simulated).serialize(serializer)
            }
        }
    }

    /// The task's own sections, with their names.
    fn sections(&self) -> [(&'static str, &dyn Check); 3] {
        let (plant, rules, simulated): (&dyn Check, &dyn Check, &dyn Check) = match self {
            Self::Balance { plant, rules, simulated } => (plant, rules, simulated),
            Self::SwingUp { plant, rules, simulated } => (plant, rules, simulated),
            Self::SpeedUp { plant, rules, simulated } => (plant, rules, simulated),
            Self::MountainCar { plant, rules, simulated } => (plant, rules, simulated),
        };
        [("plant", plant), ("rules", rules), ("simulated", simulated)]
    }
}

impl Check for Experiment {
    fn check(&self, c: &mut Checker<'_>) {
        for (name, section) in self.sections() {
            section.check(&mut c.section(name));
        }
        self.check_fit(&mut c.section("rules"));
    }
}

impl Experiment {
    /// Rules that the plant cannot keep.
    fn check_fit(&self, c: &mut Checker<'_>) {
        match self {
            Self::SpeedUp { plant, rules, .. } => {
                let half = plant.beam_half_length_m;
                let allowed = format!("at most plant.beam_half_length_m, {half}");
                for (key, distance) in
                    [("limit_m", rules.limit_m), ("test_rest_m", rules.test_rest_m)]
                {
                    c.demand(distance <= half, key, distance, &allowed);
                }
            }
            Self::MountainCar { plant, rules, .. } => {
                let hill::Params { left_wall, goal, .. } = *plant;
                c.demand(
                    (left_wall..goal).contains(&rules.start_x),
                    "start_x",
                    rules.start_x,
                    &format!("between plant.left_wall, {left_wall}, and plant.goal, {goal}"),
                );
            }
            Self::Balance { .. } | Self::SwingUp { .. } => {}
        }
    }
}

fn read<P, R, S>(
    text: &str,
    experiment: impl FnOnce(P, R, S) -> Experiment,
) -> SpannedResult<Profile>
where
    P: DeserializeOwned + Default,
    R: DeserializeOwned + Default,
    S: DeserializeOwned + Default,
{
    Ok(ron_options().from_str::<Layout<P, R, S>>(text)?.profile(experiment))
}
