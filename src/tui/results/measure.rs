//! Axes and titles for what a task's rollouts are judged by.

use crate::record::EpisodeRow;
use crate::report::achieved::Yardstick;

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

/// Name and unit of `yardstick`, such as "balance time, s".
pub(super) fn title(yardstick: &Yardstick) -> String {
    titled(yardstick.name, yardstick.unit)
}

/// The title for what nobody but the robot did, such as "alone, s", short enough for half a
/// column.
pub(super) fn title_alone(yardstick: &Yardstick) -> String {
    let name = if yardstick.unit.is_empty() { yardstick.word } else { "alone" };
    titled(name, yardstick.unit)
}

/// Decimals on axes: numbers there are rounder than those in words.
pub(super) const fn axis_decimals(yardstick: &Yardstick) -> usize {
    match yardstick.range {
        Some(_) => 1,
        None => yardstick.decimals.saturating_sub(if yardstick.decimals > 2 { 1 } else { 2 }),
    }
}

/// Where an axis for `values` begins and ends: at whole numbers of its last digit's twos, so
/// that the middle has no more digits than the ends.
pub(super) fn axis(yardstick: &Yardstick, values: impl Iterator<Item = f64>) -> (f64, f64) {
    if let Some(range) = yardstick.range {
        return range;
    }
    let scale = 10_f64.powi(i32::try_from(axis_decimals(yardstick)).unwrap_or(0));
    let (least, most) = values.fold((0.0, 1.0 / scale), |(least, most): (f64, f64), value| {
        (least.min(value), most.max(value))
    });
    let even = |value: f64| 2.0 * value / scale;
    (even((least * scale / 2.0).floor()), even((most * scale / 2.0).ceil()))
}

fn titled(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name}, {unit}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::achieved::yardstick;

    #[test]
    fn axes_end_at_round_numbers() {
        let end = |task: &str, value: f64| axis(&yardstick(task), [value].into_iter());
        assert_eq!(end("balance", 6.63), (0.0, 8.0));
        assert_eq!(end("balance", f64::NAN), (0.0, 2.0));
        assert_eq!(end("speed-up", 0.183), (0.0, 0.2));
        assert_eq!(end("speed-up", -0.03), (-0.04, 0.02));
        assert_eq!(end("swing-up", 7.0), (-1.0, 1.0));
    }

    #[test]
    fn titles_name_the_unit() {
        assert_eq!(title(&yardstick("balance")), "balance time, s");
        assert_eq!(title_alone(&yardstick("balance")), "alone, s");
        assert_eq!(title_alone(&yardstick("swing-up")), "height");
        assert_eq!(title_alone(&yardstick("mountain-car")), "steps");
        assert_eq!(Start::RELEASE.title(), "release, °");
    }
}
