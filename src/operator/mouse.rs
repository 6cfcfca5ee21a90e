//! Hands on the mouse.

use serde::{Deserialize, Serialize};

use super::shaping::Shape;
use crate::check::{Check, Checker};

/// What of the pointer steers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Steer {
    /// Its velocity is the force, as in the thesis.
    #[default]
    Velocity,
    /// Its position is where the plant is drawn to, by a spring and a damper.
    Position,
}

/// Along which side of the screen the pointer is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Along {
    /// To the right is positive.
    #[default]
    Horizontal,
    /// Up is positive.
    Vertical,
}

/// The mouse's parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// What of the pointer steers.
    pub steer: Steer,
    /// Along which side of the screen.
    pub along: Along,
    /// The velocity that counts as full deflection, in screens per second.
    pub full_speed_screens_s: f64,
    /// The time over which velocity is measured, s.
    pub window_s: f64,
    /// Where the plant is drawn to with the pointer at the screen's edge, in the unit of the
    /// plant's position.
    pub reach: f64,
    /// The spring's part of the largest action per unit of distance,
    pub spring: f64,
    /// and the damper's per unit of velocity.
    pub damper: f64,
    /// Whether the pointer is hidden over the live screen, where the terminal can.
    pub hide_pointer: bool,
    /// From the pointer's velocity or position to the action or place.
    pub shape: Shape,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            steer: Steer::default(),
            along: Along::default(),
            full_speed_screens_s: 1.5,
            window_s: 0.06,
            reach: 1.0,
            spring: 2.0,
            damper: 0.8,
            hide_pointer: true,
            shape: Shape::default(),
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.range("full_speed_screens_s", self.full_speed_screens_s, 0.05..=50.0);
        c.range("window_s", self.window_s, 0.01..=0.5);
        c.range("reach", self.reach, 0.001..=1000.0);
        c.range("spring", self.spring, 0.0..=1000.0);
        c.range("damper", self.damper, 0.0..=1000.0);
        self.shape.check(&mut c.section("shape"));
    }
}
