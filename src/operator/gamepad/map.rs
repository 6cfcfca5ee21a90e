//! The names of axes and buttons, and what each is for.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::check::{Check, Checker};

/// An axis of a gamepad, named as in SDL's mappings; the right and the top are positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// The left stick, left to right,
    LeftStickX,
    /// and bottom to top.
    LeftStickY,
    /// The left trigger, where it is an axis.
    LeftZ,
    /// The right stick, left to right,
    RightStickX,
    /// and bottom to top.
    RightStickY,
    /// The right trigger, where it is an axis.
    RightZ,
    /// The directional pad, where it is an axis: left to right,
    DPadX,
    /// and bottom to top.
    DPadY,
    /// An axis without a name, by the number that `coadapt devices` shows.
    Code(u32),
}

/// A button of a gamepad, named by its place as in SDL's mappings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Button {
    /// A on an Xbox pad, the cross on Sony's.
    South,
    /// B, circle.
    East,
    /// Y, triangle.
    North,
    /// X, square.
    West,
    /// The third button of a row of six.
    C,
    /// The sixth.
    Z,
    /// The upper left shoulder button,
    LeftTrigger,
    /// and the lower, where it is a button.
    LeftTrigger2,
    /// The upper right shoulder button,
    RightTrigger,
    /// and the lower, where it is a button.
    RightTrigger2,
    /// Back, share, −.
    Select,
    /// Start, options, +.
    Start,
    /// The maker's button in the middle.
    Mode,
    /// The left stick pressed down.
    LeftThumb,
    /// The right stick pressed down.
    RightThumb,
    /// The directional pad, where it is four buttons: up,
    DPadUp,
    /// down,
    DPadDown,
    /// left
    DPadLeft,
    /// and right.
    DPadRight,
    /// A button without a name, by the number that `coadapt devices` shows.
    Code(u32),
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        word(self, f)
    }
}

impl fmt::Display for Button {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        word(self, f)
    }
}

impl Button {
    /// What people call it: by what is printed on most pads, or else by its place.
    fn printed(self) -> String {
        match self {
            Self::LeftTrigger => "L1".to_owned(),
            Self::LeftTrigger2 => "L2".to_owned(),
            Self::LeftThumb => "L3".to_owned(),
            Self::RightTrigger => "R1".to_owned(),
            Self::RightTrigger2 => "R2".to_owned(),
            Self::RightThumb => "R3".to_owned(),
            other => other.to_string(),
        }
    }
}

/// The word that a profile writes for `name`.
fn word(name: &impl Serialize, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    f.write_str(&ron::to_string(name).map_err(|_| fmt::Error)?)
}

/// What a gamepad's axes and buttons are for. Buttons may be left out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Map {
    /// The axis that steers.
    pub steer: Axis,
    /// Goes on from an instruction, a break, a pause or a stop; on a waiting pad it takes
    /// over the steering.
    pub begin: Option<Button>,
    /// Pauses, or goes on.
    pub pause: Option<Button>,
    /// Throws the rollout away and repeats it.
    pub discard: Option<Button>,
    /// The emergency stop.
    pub stop: Option<Button>,
    /// The dead-man switch: real hardware moves only while it is held.
    pub enable: Option<Button>,
}

impl Default for Map {
    fn default() -> Self {
        Self {
            steer: Axis::LeftStickX,
            begin: Some(Button::Start),
            pause: Some(Button::Select),
            discard: Some(Button::North),
            stop: Some(Button::East),
            enable: Some(Button::LeftTrigger),
        }
    }
}

impl Map {
    /// The buttons with what they are for, as a profile names it.
    #[must_use]
    pub const fn buttons(&self) -> [(&'static str, Option<Button>); 5] {
        [
            ("begin", self.begin),
            ("pause", self.pause),
            ("discard", self.discard),
            ("stop", self.stop),
            ("enable", self.enable),
        ]
    }
}

impl Map {
    /// What the buttons do, for people.
    #[must_use]
    pub fn sentence(&self) -> String {
        let does = [
            (self.begin, "goes on"),
            (self.pause, "pauses"),
            (self.discard, "throws the rollout away"),
            (self.stop, "is the emergency stop"),
        ];
        let parts: Vec<String> = does
            .iter()
            .filter_map(|(button, does)| button.map(|button| format!("{button} {does}")))
            .collect();
        if parts.is_empty() { String::new() } else { format!("On the pad {}.", parts.join(", ")) }
    }
}

impl Map {
    /// What keeps the dead-man switch held, for people; `None` without one.
    #[must_use]
    pub fn switch_name(&self) -> Option<String> {
        self.enable.map(|button| format!("hold {}", button.printed()))
    }
}

impl Check for Map {
    fn check(&self, c: &mut Checker<'_>) {
        let buttons = self.buttons();
        for (at, (name, button)) in buttons.iter().enumerate() {
            let same = buttons[..at].iter().find(|(_, other)| button.is_some() && other == button);
            if let (Some(button), Some((other, _))) = (button, same) {
                c.demand(
                    false,
                    name,
                    button,
                    &format!(
                        "another button than that of {other}, for one press cannot mean two things"
                    ),
                );
            }
        }
    }
}
