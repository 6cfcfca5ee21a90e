//! A session: one subject's way through introduction, main and autonomous phase.

pub mod machine;
pub mod plan;

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::random::Place;

/// A part of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// The person practises; recorded, neither learned nor counted.
    Introduction,
    /// The person teaches and the robot learns.
    Main,
    /// The robot alone, with main's final learner, frozen.
    Autonomous,
    /// Nobody: no action at all, on the starts and the noise of the autonomous phase.
    ZeroControl,
}

impl Phase {
    /// All phases, in the order of a session.
    pub const ALL: [Self; 4] =
        [Self::Introduction, Self::Main, Self::Autonomous, Self::ZeroControl];

    /// The word in files and on the screen.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Introduction => "introduction",
            Self::Main => "main",
            Self::Autonomous => "autonomous",
            Self::ZeroControl => "zero_control",
        }
    }

    /// The phase with this word.
    #[must_use]
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|phase| phase.word() == word)
    }

    /// Whether a person's hand is on the controls.
    #[must_use]
    pub const fn is_steered(self) -> bool {
        matches!(self, Self::Introduction | Self::Main)
    }
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// A moment of a session: phase, rollout and step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Moment {
    /// The phase.
    pub phase: Phase,
    /// The rollout within the phase, from 1.
    pub rollout: u32,
    /// How often this rollout was discarded before.
    pub attempt: u16,
    /// The controlled steps of this rollout so far.
    pub step: u32,
    /// The controlled steps of this phase in the rollouts before.
    pub steps_before: u64,
}

impl Moment {
    /// The beginning of `phase`.
    #[must_use]
    pub const fn start_of(phase: Phase) -> Self {
        Self { phase, rollout: 1, attempt: 0, step: 0, steps_before: 0 }
    }

    /// The place whose random streams belong to this rollout. Zero control shares those of
    /// the autonomous phase.
    #[must_use]
    pub const fn place(&self) -> Place {
        let phase = match self.phase {
            Phase::Introduction => 1,
            Phase::Main => 2,
            Phase::Autonomous | Phase::ZeroControl => 3,
        };
        // A repeated rollout has the same chance again where nobody steers.
        let attempt = if self.phase.is_steered() { self.attempt } else { 0 };
        Place { phase, rollout: self.rollout, attempt }
    }
}

/// A subject's identifier: letters, digits, `-`, `_`, 1 to 64 of them, since it names a
/// folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Subject(String);

impl Subject {
    /// The identifier.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Default for Subject {
    fn default() -> Self {
        Self("anon".to_owned())
    }
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Why a text is no subject identifier.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "subject {shown:?}: {reason}; use 1 to 64 letters (a-z, A-Z), digits, '-' and '_', such as S07"
)]
pub struct BadSubject {
    shown: String,
    reason: String,
}

impl FromStr for Subject {
    type Err = BadSubject;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let foreign = text.chars().find(|c| !(c.is_ascii_alphanumeric() || *c == '-' || *c == '_'));
        let reason = match (text.chars().count(), foreign) {
            (0, _) => "it is empty".to_owned(),
            (_, Some(c)) => format!("it holds {c:?}"),
            (1..=64, None) => return Ok(Self(text.to_owned())),
            (length, None) => format!("it has {length} characters"),
        };
        let mut shown: String = text.chars().take(40).collect();
        if shown.len() < text.len() {
            shown.push('…');
        }
        Err(BadSubject { shown, reason })
    }
}

impl TryFrom<String> for Subject {
    type Error = BadSubject;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        text.parse()
    }
}

impl From<Subject> for String {
    fn from(subject: Subject) -> Self {
        subject.0
    }
}

/// A subject's trials count from 1, whatever the task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Trial(pub u32);

impl fmt::Display for Trial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:03}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn subjects_are_safe_file_names_or_refused_with_a_reason() {
        for good in ["S07", "anon", "a-b_c", &"x".repeat(64)] {
            assert_eq!(good.parse::<Subject>().unwrap().as_str(), good);
        }
        for (bad, reason) in [
            ("", "empty"),
            ("a/b", "'/'"),
            ("..", "'.'"),
            ("a b", "' '"),
            ("a\u{7}", "'\\u{7}'"),
            ("ö", "'ö'"),
            (&"x".repeat(300), "300 characters"),
        ] {
            let message = bad.parse::<Subject>().unwrap_err().to_string();
            assert!(message.contains(reason), "{message}");
            assert!(message.len() < 250);
        }
    }

    proptest! {
        #[test]
        fn an_accepted_subject_is_one_plain_path_component(text in ".{0,80}") {
            if let Ok(subject) = text.parse::<Subject>() {
                let path = std::path::Path::new(subject.as_str());
                let mut parts = path.components();
                prop_assert!(matches!(parts.next(), Some(std::path::Component::Normal(_))));
                prop_assert_eq!(parts.next(), None);
            }
        }
    }
}
