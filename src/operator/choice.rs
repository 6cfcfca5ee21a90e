//! Which operator steers, and the profile's section about operators.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::simulated::{self, Kind, Skill};
use super::terminal;
use crate::check::{Check, Checker};

/// The operators' parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// Hands on the keyboard.
    pub keyboard: terminal::Params,
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        self.keyboard.check(&mut c.section("keyboard"));
    }
}

/// Who steers, as on the command line.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Choice {
    /// Hands on the keyboard.
    #[default]
    Keyboard,
    /// The table in a file, or what was done in a recorded session.
    Script(PathBuf),
    /// A model of a person.
    Simulated(Skill, Kind),
    /// Nobody.
    None,
}

/// Words that choose no operator.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnknownOperator {
    /// No such operator.
    #[error(
        "`{0}` is no operator; choose keyboard, script:FILE (a table, or a session's folder), simulated:SKILL[:TYPE] or none"
    )]
    Operator(String),
    /// No such skill or type.
    #[error(transparent)]
    Simulated(#[from] simulated::UnknownWord),
}

impl FromStr for Choice {
    type Err = UnknownOperator;

    fn from_str(words: &str) -> Result<Self, UnknownOperator> {
        match words.split_once(':') {
            None if words == "keyboard" => Ok(Self::Keyboard),
            None if words == "none" => Ok(Self::None),
            Some(("script", file)) if !file.is_empty() => Ok(Self::Script(file.into())),
            Some(("simulated", model)) => {
                let (skill, kind) = match model.split_once(':') {
                    Some((skill, kind)) => (skill.parse()?, kind.parse()?),
                    None => (model.parse()?, Kind::default()),
                };
                Ok(Self::Simulated(skill, kind))
            }
            _ => Err(UnknownOperator::Operator(words.to_owned())),
        }
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Keyboard => f.write_str("keyboard"),
            Self::Script(file) => write!(f, "script:{}", file.display()),
            Self::Simulated(skill, kind) if *kind == Kind::default() => {
                write!(f, "simulated:{skill}")
            }
            Self::Simulated(skill, kind) => write!(f, "simulated:{skill}:{kind}"),
            Self::None => f.write_str("none"),
        }
    }
}

impl TryFrom<String> for Choice {
    type Error = UnknownOperator;

    fn try_from(words: String) -> Result<Self, UnknownOperator> {
        words.parse()
    }
}

impl From<Choice> for String {
    fn from(choice: Choice) -> Self {
        choice.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_read_back_and_wrong_words_list_them() {
        for words in ["keyboard", "none", "script:a:b.csv", "simulated:naive:lapses"] {
            assert_eq!(words.parse::<Choice>().unwrap().to_string(), words);
        }
        assert_eq!(
            "simulated:expert".parse(),
            Ok(Choice::Simulated(Skill::Expert, Kind::DelayedPd))
        );
        for words in ["gamepad", "script:", "script", "simulated", "", "mouse"] {
            let message = words.parse::<Choice>().unwrap_err().to_string();
            assert!(message.contains("script:FILE"), "{message}");
        }
        let message = "simulated:naive:pd".parse::<Choice>().unwrap_err().to_string();
        assert!(message.contains("bang-bang"), "{message}");
    }
}
