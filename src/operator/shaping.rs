//! From a device's raw deflection to an action: dead zone, curve, sensitivity, sign, filter.

use serde::{Deserialize, Serialize};

use crate::check::{Check, Checker};
use crate::signal::Seconds;

/// How a device's deflection, −1 to 1, becomes a part of the largest action.
///
/// In this order: the dead zones, the response curve, the sensitivity, the sign, the filter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Shape {
    /// Deflections up to this one count as rest.
    pub dead_zone: f64,
    /// Deflections within this of full count as full.
    pub outer_zone: f64,
    /// The response curve: the deflection between the zones to this power; 1 is a line,
    /// more is finer near rest.
    pub exponent: f64,
    /// Factor on the deflection; full stays full.
    pub sensitivity: f64,
    /// Whether left and right change places.
    pub invert: bool,
    /// Time constant of the low-pass filter, s; 0: none.
    pub filter_s: f64,
}

impl Default for Shape {
    fn default() -> Self {
        Self {
            dead_zone: 0.0,
            outer_zone: 0.0,
            exponent: 1.0,
            sensitivity: 1.0,
            invert: false,
            filter_s: 0.0,
        }
    }
}

/// The least and most that sensitivity can be.
pub const SENSITIVITY: std::ops::RangeInclusive<f64> = 0.05..=20.0;

impl Check for Shape {
    fn check(&self, c: &mut Checker<'_>) {
        c.range("dead_zone", self.dead_zone, 0.0..=0.95);
        c.range("outer_zone", self.outer_zone, 0.0..=0.95);
        let zones = 0.0..=0.95;
        c.demand(
            // One that is beyond its own range is told already.
            self.dead_zone + self.outer_zone < 1.0
                || !zones.contains(&self.dead_zone)
                || !zones.contains(&self.outer_zone),
            "outer_zone",
            self.outer_zone,
            "less than 1 together with dead_zone, or nothing is left between rest and full",
        );
        c.range("exponent", self.exponent, 0.2..=5.0);
        c.range("sensitivity", self.sensitivity, SENSITIVITY);
        c.range("filter_s", self.filter_s, 0.0..=1.0);
    }
}

impl Shape {
    /// The part of the largest action for a deflection, before the filter; what is not a
    /// number counts as rest.
    #[must_use]
    pub fn curve(&self, raw: f64) -> f64 {
        let live = 1.0 - self.dead_zone - self.outer_zone;
        let beyond = (raw.clamp(-1.0, 1.0).abs() - self.dead_zone) / live;
        // Written so that a deflection that is not a number is rest.
        if beyond > 0.0 {
            let bent = beyond.min(1.0).powf(self.exponent).copysign(raw);
            let sign = if self.invert { -1.0 } else { 1.0 };
            sign * (self.sensitivity * bent).clamp(-1.0, 1.0)
        } else {
            0.0
        }
    }
}

/// A [`Shape`] at work, sampled once a tick.
#[derive(Clone, Copy, Debug)]
pub struct Shaper {
    shape: Shape,
    /// The action at full deflection, in the plant's unit.
    limit: f64,
    /// The part of the way to a new value that the filter leaves in a tick.
    kept: f64,
    value: f64,
}

impl Shaper {
    /// A shaper at rest, for ticks of `tick` and actions up to ± `limit`.
    #[must_use]
    pub fn new(shape: Shape, limit: f64, tick: Seconds) -> Self {
        let kept = if shape.filter_s > 0.0 { (-tick.0 / shape.filter_s).exp() } else { 0.0 };
        Self { shape, limit, kept, value: 0.0 }
    }

    /// The action of this tick for a deflection of `raw`.
    pub fn shape(&mut self, raw: f64) -> f64 {
        let wanted = self.shape.curve(raw);
        let left = self.kept * (self.value - wanted);
        // An idle hand comes to rest, not to ever smaller numbers.
        self.value = if left.abs() < 1e-6 { wanted } else { wanted + left };
        self.value * self.limit
    }

    /// The shape in use.
    #[must_use]
    pub const fn current(&self) -> &Shape {
        &self.shape
    }

    /// From now on multiplies by `sensitivity`, within its bounds; nonsense changes nothing.
    pub fn set_sensitivity(&mut self, sensitivity: f64) {
        if sensitivity.is_finite() {
            let (least, most) = (*SENSITIVITY.start(), *SENSITIVITY.end());
            self.shape.sensitivity = sensitivity.clamp(least, most);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TICK: Seconds = Seconds(0.02);

    #[test]
    fn rest_is_0_full_is_the_limit_and_nothing_exceeds_it() {
        let shape = Shape { dead_zone: 0.1, ..Shape::default() };
        let mut shaper = Shaper::new(shape, 10.0, TICK);
        assert_eq!(shaper.shape(0.1), 0.0);
        assert_eq!(shaper.shape(f64::NAN), 0.0);
        assert_eq!(shaper.shape(1.0), 10.0);
        assert_eq!(shaper.shape(-7.0), -10.0);
        assert!((shaper.shape(-0.55) + 5.0).abs() < 1e-12);
        shaper.set_sensitivity(3.0);
        assert_eq!(shaper.shape(0.9), 10.0);
        shaper.set_sensitivity(f64::NAN);
        assert_eq!(shaper.current().sensitivity, 3.0);
    }

    #[test]
    fn every_part_of_the_shape_bends_the_curve_as_named() {
        let curve = |shape: Shape, raw| shape.curve(raw);
        let plain = Shape::default();
        assert_eq!(curve(plain, -0.3), -0.3);
        assert_eq!(curve(Shape { outer_zone: 0.2, ..plain }, 0.8), 1.0);
        assert_eq!(curve(Shape { outer_zone: 0.2, ..plain }, 0.4), 0.5);
        assert_eq!(curve(Shape { exponent: 2.0, ..plain }, -0.5), -0.25);
        assert_eq!(curve(Shape { sensitivity: 0.5, ..plain }, 1.0), 0.5);
        assert_eq!(curve(Shape { invert: true, ..plain }, 0.25), -0.25);
    }

    #[test]
    fn the_filter_covers_63_percent_in_its_time_constant_and_comes_to_rest() {
        let mut shaper = Shaper::new(Shape { filter_s: 0.1, ..Shape::default() }, 10.0, TICK);
        let after = (0..5).map(|_| shaper.shape(1.0)).last().unwrap();
        assert!((after - 10.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-12, "{after}");
        assert_eq!((0..200).map(|_| shaper.shape(0.0)).last(), Some(0.0));
    }

    proptest! {
        /// Whatever a device sends, the action is within the limit, odd and monotonous.
        #[test]
        fn a_curve_is_odd_monotonous_and_within_one(
            dead_zone in 0.0..0.9_f64,
            part in 0.0..0.99_f64,
            exponent in 0.2..5.0_f64,
            sensitivity in 0.05..20.0_f64,
            (a, b) in (-2.0..2.0_f64, -2.0..2.0_f64),
        ) {
            let outer_zone = part * (1.0 - dead_zone);
            let shape = Shape { dead_zone, outer_zone, exponent, sensitivity, ..Shape::default() };
            let (low, high) = (shape.curve(a.min(b)), shape.curve(a.max(b)));
            prop_assert!(low <= high && low >= -1.0 && high <= 1.0);
            prop_assert_eq!(shape.curve(a), -shape.curve(-a));
            prop_assert_eq!(shape.curve(0.0), 0.0);
        }
    }
}
