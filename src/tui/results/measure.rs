//! What a task's results are measured by, as plain data.

use crate::record::EpisodeRow;

/// A number of each rollout.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// Its page's title, a word or two, such as "balance".
    pub page: &'static str,
    /// Its name, such as "balance time".
    pub name: &'static str,
    /// Its unit; empty where it has none.
    pub unit: &'static str,
    /// Decimals on axes and, with two more, in words.
    pub decimals: usize,
    /// Where axes begin and end; `None`: at 0 and beyond the largest.
    pub range: Option<(f64, f64)>,
    /// The number.
    pub value: fn(&EpisodeRow) -> f64,
}

/// How rollouts began, for charts of the robot alone.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Its name, such as "release".
    pub name: &'static str,
    /// Its unit; empty where it has none.
    pub unit: &'static str,
    /// The number.
    pub value: fn(&EpisodeRow) -> f64,
}

impl Measure {
    /// Balance: how long the pole stayed up.
    pub const BALANCE_TIME: Self = Self {
        page: "balance",
        name: "balance time",
        unit: "s",
        decimals: 0,
        range: None,
        value: |row| row.duration_s,
    };

    /// Swing-up: how high the pole's tip was, from −1 to 1.
    pub const MEAN_HEIGHT: Self = Self {
        page: "height",
        name: "mean height",
        unit: "",
        decimals: 1,
        range: Some((-1.0, 1.0)),
        value: |row| row.mean_reward,
    };

    /// Speed-up: the ball's speed less what hits cost (eq. 27).
    pub const REWARDED_SPEED: Self = Self {
        page: "speed",
        name: "mean reward",
        unit: "m/s",
        decimals: 2,
        range: None,
        value: |row| row.mean_reward,
    };

    /// Mountain car: how long it took.
    pub const STEPS: Self = Self {
        page: "steps",
        name: "steps to the flag",
        unit: "",
        decimals: 0,
        range: None,
        value: |row| f64::from(row.steps),
    };

    /// Its name and unit, such as "balance time, s".
    #[must_use]
    pub fn title(&self) -> String {
        titled(self.name, self.unit)
    }

    /// The title for what nobody but the robot did, such as "alone, s".
    #[must_use]
    pub fn title_alone(&self) -> String {
        if self.unit.is_empty() { self.title() } else { titled("alone", self.unit) }
    }

    /// Where an axis for `values` begins and ends: at whole numbers of its last digit's twos,
    /// so that the middle has no more digits than the ends.
    #[must_use]
    pub fn axis(&self, values: impl Iterator<Item = f64>) -> (f64, f64) {
        if let Some(range) = self.range {
            return range;
        }
        let scale = 10_f64.powi(i32::try_from(self.decimals).unwrap_or(0));
        let (least, most) = values.fold((0.0, 1.0 / scale), |(least, most): (f64, f64), value| {
            (least.min(value), most.max(value))
        });
        let even = |value: f64| 2.0 * value / scale;
        (even((least * scale / 2.0).floor()), even((most * scale / 2.0).ceil()))
    }
}

impl Default for Measure {
    fn default() -> Self {
        Self::BALANCE_TIME
    }
}

impl Start {
    /// Balance: the angle at which the pole was let go.
    pub const RELEASE: Self =
        Self { name: "release", unit: "°", value: |row| row.start.to_degrees() };

    /// Its name and unit, such as "release, °".
    #[must_use]
    pub fn title(&self) -> String {
        titled(self.name, self.unit)
    }
}

fn titled(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name}, {unit}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_end_beyond_the_largest_at_digits_that_are_shown() {
        let end = |measure: Measure, value: f64| measure.axis([value].into_iter());
        assert_eq!(end(Measure::BALANCE_TIME, 6.63), (0.0, 8.0));
        assert_eq!(end(Measure::BALANCE_TIME, f64::NAN), (0.0, 2.0));
        assert_eq!(end(Measure::REWARDED_SPEED, 0.183), (0.0, 0.2));
        assert_eq!(end(Measure::REWARDED_SPEED, -0.03), (-0.04, 0.02));
        assert_eq!(end(Measure::MEAN_HEIGHT, 7.0), (-1.0, 1.0));
    }

    #[test]
    fn titles_carry_their_units() {
        assert_eq!(Measure::BALANCE_TIME.title(), "balance time, s");
        assert_eq!(Measure::BALANCE_TIME.title_alone(), "alone, s");
        assert_eq!(Measure::MEAN_HEIGHT.title_alone(), "mean height");
        assert_eq!(Start::RELEASE.title(), "release, °");
    }
}
