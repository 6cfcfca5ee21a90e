//! The sections of a profile, listed once.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize, Serializer};

use super::experiment::Experiment;
use super::{Screen, WantedMode};
use crate::backend::serial;
use crate::check::{Check, Checker};
use crate::{learner, operator, session, sharing, teaching};

/// Writes the two forms of a profile from one list of sections: [`Layout`], as it stands in
/// a file, with the plant and rules of a task not yet known; and [`Profile`], as the
/// program uses it.
macro_rules! sections {
    ($($(#[$about:meta])* $section:ident: $params:ty,)*) => {
        /// A profile as it stands in a file, for a task with plant parameters `P`, rules `R`
        /// and simulated operators `S`.
        #[derive(Clone, Debug, Serialize, Deserialize)]
        #[serde(
            rename = "Profile",
            deny_unknown_fields,
            default,
            bound(deserialize = "P: DeserializeOwned + Default, R: DeserializeOwned + Default, \
                S: DeserializeOwned + Default")
        )]
        pub(super) struct Layout<P, R, S> {
            task: String,
            preset: String,
            mode: WantedMode,
            tick_ms: f64,
            plant: P,
            rules: R,
            $($section: $params,)*
            simulated: S,
        }

        impl<P: Default, R: Default, S: Default> Default for Layout<P, R, S> {
            fn default() -> Self {
                Self {
                    task: String::new(),
                    preset: "thesis".to_owned(),
                    mode: WantedMode::default(),
                    tick_ms: 20.0,
                    plant: P::default(),
                    rules: R::default(),
                    $($section: <$params>::default(),)*
                    simulated: S::default(),
                }
            }
        }

        impl<P, R, S> Layout<P, R, S> {
            /// The profile of this layout, whose plant, rules and simulated operators make
            /// an `experiment`.
            pub(super) fn profile(
                self,
                experiment: impl FnOnce(P, R, S) -> Experiment,
            ) -> Profile {
                Profile {
                    experiment: experiment(self.plant, self.rules, self.simulated),
                    preset: self.preset,
                    mode: self.mode,
                    tick_ms: self.tick_ms,
                    $($section: self.$section,)*
                }
            }
        }

        /// Everything that a session's plan and behaviour depend on, subject and devices
        /// aside.
        #[derive(Clone, Debug, PartialEq)]
        pub struct Profile {
            /// The task with its plant, rules and simulated operators: the keys `task`, `plant`,
            /// `rules` and `simulated`.
            pub experiment: Experiment,
            /// Whose settings these are: `thesis` for the published experiments.
            pub preset: String,
            /// What the robot does while it learns.
            pub mode: WantedMode,
            /// The control period, ms.
            pub tick_ms: f64,
            $($(#[$about])* pub $section: $params,)*
        }

        impl Profile {
            /// The layout of this profile for its task's own sections.
            pub(super) fn layout<P, R, S>(&self, plant: P, rules: R, simulated: S) -> Layout<P, R, S> {
                Layout {
                    task: self.experiment.name().to_owned(),
                    preset: self.preset.clone(),
                    mode: self.mode,
                    tick_ms: self.tick_ms,
                    plant,
                    rules,
                    $($section: self.$section.clone(),)*
                    simulated,
                }
            }
        }

        impl Check for Profile {
            fn check(&self, c: &mut Checker<'_>) {
                c.demand(
                    is_plain_name(&self.preset),
                    "preset",
                    format_args!("{:?}", self.preset),
                    "a name of 1 to 32 small letters, digits and `-`",
                );
                c.range("tick_ms", self.tick_ms, 1.0..=1000.0);
                self.experiment.check(c);
                let task = self.experiment.task(self.tick());
                let features = task.feature_names();
                let (given, wanted) = (self.learner.norm_in.len(), features.len());
                c.demand(
                    given == wanted,
                    "learner.norm_in",
                    format_args!("a list of {given}"),
                    &format!("a list of {wanted}, for {}", features.join(", ")),
                );
                let regions: Vec<&str> = task.regions().iter().map(|r| r.name).collect();
                for name in &self.teaching.delay_regions {
                    c.demand(
                        regions.contains(&name.as_str()),
                        "teaching.delay_regions",
                        format_args!("{name:?}"),
                        &format!("regions of this task: {}", regions.join(", ")),
                    );
                }
                c.demand(
                    self.backend.is_none() || self.experiment.cart_pole().is_some(),
                    "backend",
                    "a real plant",
                    "None: only the cart-pole's tasks have one",
                );
                c.demand(
                    self.backend.is_none()
                        || (self.tick_ms.fract() == 0.0 && (2.0..=50.0).contains(&self.tick_ms)),
                    "tick_ms",
                    self.tick_ms,
                    "a whole number of 2 to 50 with a real plant, whose states come each",
                );
                if let (Some(real), Some((_, end))) = (&self.backend, task.ends()) {
                    let limit = real.safety.hard_limit_m;
                    c.demand(
                        limit < end,
                        "backend.safety.hard_limit_m",
                        limit,
                        &format!(
                            "less than {end}, half of the plant's track, or the cart runs into \
                             its end before it is stopped"
                        ),
                    );
                }
                $(self.$section.check(&mut c.section(stringify!($section)));)*
            }
        }
    };
}

sections! {
    /// What learns, and how.
    learner: learner::Params,
    /// What the learner is given.
    teaching: teaching::Params,
    /// Who has how much of the controls.
    sharing: sharing::Params,
    /// Phases, rollouts and instructions.
    session: session::plan::Params,
    /// Hands on a device.
    operator: operator::Params,
    /// The real plant, where there is one.
    backend: Option<serial::Params>,
    /// What is drawn, and how often.
    screen: Screen,
}

impl Serialize for Profile {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.experiment.serialize(self, serializer)
    }
}

fn is_plain_name(name: &str) -> bool {
    (1..=32).contains(&name.len())
        && name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-')
}
