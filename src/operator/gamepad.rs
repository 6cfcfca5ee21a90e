//! Hands on a gamepad or joystick.

pub mod learn;
mod map;
pub mod rights;

pub use map::{Axis, Button, Map};

use serde::{Deserialize, Serialize};

use super::shaping::Shape;
use crate::check::{Check, Checker};

/// The gamepad's parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// Which pad steers: a part of its name or its whole GUID; `None`: the first that is there.
    pub pad: Option<String>,
    /// What its axes and buttons are for.
    pub map: Map,
    /// Mappings of pads that the built-in list does not know, a line of SDL's
    /// `gamecontrollerdb.txt` each.
    pub sdl_mappings: Vec<String>,
    /// A pad that was plugged in steers once its deflection has been within this of rest.
    pub centre: f64,
    /// A relayed pad that is silent for longer steers no more, s.
    pub silent_s: f64,
    /// What the pad lets the hand feel.
    pub rumble: Rumble,
    /// From the steering axis to the action.
    pub shape: Shape,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            pad: None,
            map: Map::default(),
            sdl_mappings: Vec::new(),
            centre: 0.15,
            silent_s: 0.2,
            rumble: Rumble::default(),
            shape: Shape { dead_zone: 0.1, outer_zone: 0.02, ..Shape::default() },
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        self.map.check(&mut c.section("map"));
        c.range("centre", self.centre, 0.01..=0.9);
        c.range("silent_s", self.silent_s, 0.05..=5.0);
        c.range("rumble.strength", self.rumble.strength, 0.0..=1.0);
        self.shape.check(&mut c.section("shape"));
    }
}

/// What a pad that can shake lets the hand feel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Rumble {
    /// A short pulse when the plant is let go.
    pub release: bool,
    /// A longer one when the rollout ends by itself.
    pub ends: bool,
    /// The robot's share as a steady shaking.
    pub share: bool,
    /// How strong, as a part of what the pad can do.
    pub strength: f64,
}

impl Default for Rumble {
    fn default() -> Self {
        Self { release: false, ends: false, share: false, strength: 0.5 }
    }
}
