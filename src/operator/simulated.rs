//! Operators that are not there: models of people with delay, noise and habits.
//!
//! They stand in for subjects in headless sessions and studies. They do not tire, do not
//! adapt to the robot's share and do not exploit its help; a person would.
//!
//! One file a task: [`cart_pole`] (balance), [`swing_up`], [`ball_beam`], [`mountain_car`].
//! They share the [`person`] (delay, hand, habits, practice) and differ in judgement; each
//! file says how well its people do and what the habits mean there.

pub mod ball_beam;
pub mod cart_pole;
mod filters;
mod growth;
mod law;
pub mod mountain_car;
pub mod person;
pub mod swing_up;

use std::fmt;
use std::str::FromStr;

pub use growth::{BySkill, Growth, NaiveAverageExpert};

/// How well an operator steers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Skill {
    /// Has never done it.
    Naive,
    /// Has done such things.
    Average,
    /// Cannot learn much more.
    Expert,
}

/// The habit with which an operator steers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Answers angle and angular velocity, late.
    #[default]
    DelayedPd,
    /// The same, but decides only now and then.
    Intermittent,
    /// Pushes fully or not at all.
    BangBang,
    /// Foresees the motion with a model in the head.
    Predictor,
    /// Runs out of mouse pad: cannot sustain a force.
    MouseLimited,
    /// Sometimes pushes the wrong way.
    Lapses,
}

impl Skill {
    /// Every skill, the least first.
    pub const ALL: [Self; 3] = [Self::Naive, Self::Average, Self::Expert];

    /// The word on the command line.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Naive => "naive",
            Self::Average => "average",
            Self::Expert => "expert",
        }
    }

    /// This skill's value.
    #[must_use]
    pub const fn of(self, (naive, average, expert): NaiveAverageExpert) -> f64 {
        match self {
            Self::Naive => naive,
            Self::Average => average,
            Self::Expert => expert,
        }
    }
}

impl Kind {
    /// Every kind, the default first.
    pub const ALL: [Self; 6] = [
        Self::DelayedPd,
        Self::Intermittent,
        Self::BangBang,
        Self::Predictor,
        Self::MouseLimited,
        Self::Lapses,
    ];

    /// The word on the command line.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::DelayedPd => "delayed-pd",
            Self::Intermittent => "intermittent",
            Self::BangBang => "bang-bang",
            Self::Predictor => "predictor",
            Self::MouseLimited => "mouse-limited",
            Self::Lapses => "lapses",
        }
    }
}

/// A word that names no skill or no kind.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{given}` is no {what} of a simulated operator; choose one of {choices}")]
pub struct UnknownWord {
    given: String,
    what: &'static str,
    choices: String,
}

impl UnknownWord {
    fn new(given: &str, what: &'static str, choices: &[&str]) -> Self {
        Self { given: given.to_owned(), what, choices: choices.join(", ") }
    }
}

impl FromStr for Skill {
    type Err = UnknownWord;

    fn from_str(word: &str) -> Result<Self, UnknownWord> {
        Self::ALL
            .into_iter()
            .find(|skill| skill.word() == word)
            .ok_or_else(|| UnknownWord::new(word, "skill", &Self::ALL.map(Self::word)))
    }
}

impl FromStr for Kind {
    type Err = UnknownWord;

    fn from_str(word: &str) -> Result<Self, UnknownWord> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.word() == word)
            .ok_or_else(|| UnknownWord::new(word, "type", &Self::ALL.map(Self::word)))
    }
}

impl fmt::Display for Skill {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_read_back_and_wrong_ones_list_the_choices() {
        for kind in Kind::ALL {
            assert_eq!(kind.to_string().parse(), Ok(kind));
        }
        for skill in Skill::ALL {
            assert_eq!(skill.to_string().parse(), Ok(skill));
        }
        let message = "pro".parse::<Skill>().unwrap_err().to_string();
        assert!(message.contains("`pro`") && message.contains("naive, average, expert"));
    }
}
