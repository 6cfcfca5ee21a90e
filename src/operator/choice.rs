//! Which operator steers, and the profile's section about operators.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::shaping::Shape;
use super::simulated::{self, Kind, Skill};
use super::{gamepad, mouse, terminal};
use crate::check::{Check, Checker};

/// The operators' parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// Hands on the keyboard.
    pub keyboard: terminal::Params,
    /// Hands on a gamepad.
    pub gamepad: gamepad::Params,
    /// Hands on the mouse.
    pub mouse: mouse::Params,
}

impl Params {
    /// How the deflection of `device` becomes an action.
    #[must_use]
    pub const fn shape(&self, device: Device) -> &Shape {
        match device {
            Device::Keyboard => &self.keyboard.shape,
            Device::Gamepad => &self.gamepad.shape,
            Device::Mouse => &self.mouse.shape,
        }
    }

    /// What the person does to keep the dead-man switch of `device` held, in ASCII, such as
    /// "hold L1"; `None` where the profile gives it none. A keyboard has one only where the
    /// terminal reports releases.
    #[must_use]
    pub fn switch_name(&self, device: Device) -> Option<String> {
        match device {
            Device::Keyboard => Some(self.keyboard.switch_name()),
            Device::Gamepad => self.gamepad.map.switch_name(),
            Device::Mouse => Some(self.mouse.enable.switch_name()),
        }
    }
}

/// What a hand can be on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Device {
    /// The arrows and their like.
    Keyboard,
    /// A gamepad or joystick.
    Gamepad,
    /// The terminal's mouse.
    Mouse,
}

impl Device {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Keyboard, Self::Gamepad, Self::Mouse];

    /// Its name, on the command line and as the profile's section.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Keyboard => "keyboard",
            Self::Gamepad => "gamepad",
            Self::Mouse => "mouse",
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        self.keyboard.check(&mut c.section("keyboard"));
        self.gamepad.check(&mut c.section("gamepad"));
        self.mouse.check(&mut c.section("mouse"));
    }
}

/// Who steers, as on the command line.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Choice {
    /// Hands on the keyboard.
    #[default]
    Keyboard,
    /// Hands on a gamepad.
    Gamepad(Via),
    /// Hands on the mouse.
    Mouse,
    /// The table in a file, or what was done in a recorded session.
    Script(PathBuf),
    /// A model of a person.
    Simulated(Skill, Kind),
    /// The agent that learns the mountain car.
    QLearning,
    /// Nobody.
    None,
}

/// Where a gamepad's events come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Via {
    /// A pad at this computer.
    Here,
    /// Lines of `coadapt pad-relay` on standard input.
    RelayInput,
    /// The same from whoever connects to the Unix socket at this path.
    RelaySocket(PathBuf),
    /// A table of events in a file, in the session's time.
    Script(PathBuf),
}

impl Choice {
    /// The device under the person's hands, if there is one.
    #[must_use]
    pub const fn device(&self) -> Option<Device> {
        match self {
            Self::Keyboard => Some(Device::Keyboard),
            Self::Gamepad(_) => Some(Device::Gamepad),
            Self::Mouse => Some(Device::Mouse),
            Self::Script(_) | Self::Simulated(..) | Self::QLearning | Self::None => None,
        }
    }
}

/// Words that choose no operator.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnknownOperator {
    /// No such operator.
    #[error(
        "`{0}` is no operator; choose keyboard, gamepad (or gamepad:relay=-, gamepad:relay=unix:PATH, gamepad:script=FILE), mouse, script:FILE (a table, or a session's folder), simulated:SKILL[:TYPE], q_learning (mountain car only) or none"
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
            None if words == "gamepad" => Ok(Self::Gamepad(Via::Here)),
            None if words == "mouse" => Ok(Self::Mouse),
            None if words == "q_learning" => Ok(Self::QLearning),
            Some(("gamepad", via)) => match via.split_once('=') {
                Some(("relay", "-")) => Ok(Self::Gamepad(Via::RelayInput)),
                Some(("relay", socket)) => socket_path(socket)
                    .map(|path| Self::Gamepad(Via::RelaySocket(path)))
                    .ok_or_else(|| UnknownOperator::Operator(words.to_owned())),
                Some(("script", file)) if !file.is_empty() => {
                    Ok(Self::Gamepad(Via::Script(file.into())))
                }
                _ => Err(UnknownOperator::Operator(words.to_owned())),
            },
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

/// The path of a socket that is written as `unix:PATH`.
#[must_use]
pub fn socket_path(socket: &str) -> Option<PathBuf> {
    socket.strip_prefix("unix:").filter(|path| !path.is_empty()).map(PathBuf::from)
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Keyboard => f.write_str("keyboard"),
            Self::Gamepad(Via::Here) => f.write_str("gamepad"),
            Self::Gamepad(Via::RelayInput) => f.write_str("gamepad:relay=-"),
            Self::Gamepad(Via::RelaySocket(path)) => {
                write!(f, "gamepad:relay=unix:{}", path.display())
            }
            Self::Gamepad(Via::Script(file)) => write!(f, "gamepad:script={}", file.display()),
            Self::Mouse => f.write_str("mouse"),
            Self::Script(file) => write!(f, "script:{}", file.display()),
            Self::Simulated(skill, kind) if *kind == Kind::default() => {
                write!(f, "simulated:{skill}")
            }
            Self::Simulated(skill, kind) => write!(f, "simulated:{skill}:{kind}"),
            Self::QLearning => f.write_str("q_learning"),
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
    fn the_switch_is_named_after_the_profile_and_in_ascii() {
        let mut params = Params::default();
        let names = |params: &Params| Device::ALL.map(|device| params.switch_name(device));
        let told = |names: [&str; 3]| names.map(|name| Some(name.to_owned()));
        assert_eq!(names(&params), told(["hold e", "hold L1", "hold the left mouse button"]));
        params.keyboard.enable = 'j';
        params.gamepad.map.enable = Some(gamepad::Button::Code(7));
        params.mouse.enable = mouse::Button::Middle;
        let others = told(["hold j", "hold code(7)", "hold the middle mouse button"]);
        assert_eq!(names(&params), others);
        params.gamepad.map.enable = None;
        assert_eq!(params.switch_name(Device::Gamepad), None);
    }

    #[test]
    fn choices_read_back_and_wrong_words_list_them() {
        for words in [
            "keyboard",
            "none",
            "script:a:b.csv",
            "simulated:naive:lapses",
            "gamepad",
            "gamepad:relay=-",
            "gamepad:relay=unix:/run/pad=1",
            "gamepad:script=events.csv",
            "mouse",
            "q_learning",
        ] {
            assert_eq!(words.parse::<Choice>().unwrap().to_string(), words);
        }
        assert_eq!(
            "simulated:expert".parse(),
            Ok(Choice::Simulated(Skill::Expert, Kind::DelayedPd))
        );
        for words in [
            "gamepad:",
            "gamepad:relay=",
            "gamepad:relay=unix:",
            "gamepad:relay=tcp",
            "script:",
            "script",
            "simulated",
            "",
            "mouse:1",
            "q_learning:1",
        ] {
            let message = words.parse::<Choice>().unwrap_err().to_string();
            assert!(message.contains("script:FILE"), "{message}");
        }
        let message = "simulated:naive:pd".parse::<Choice>().unwrap_err().to_string();
        assert!(message.contains("bang-bang"), "{message}");
    }
}
