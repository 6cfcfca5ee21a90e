//! What the thesis does with series of numbers: averages along them.

use std::collections::BTreeMap;

use super::metrics::{deviation, mean};

/// A number of each rollout, by the rollout's own number: what is missing has none.
pub type ByRollout = BTreeMap<u32, f64>;

/// The window of figures 15 and 32, rollouts.
pub const WINDOW: usize = 10;
/// The neighbours of figures 18 to 23, the point itself among them.
pub const NEIGHBOURS: usize = 9;

/// The numbers, in the order of the rollouts.
#[must_use]
pub fn numbers(values: &ByRollout) -> Vec<f64> {
    values.values().copied().collect()
}

/// The rollouts in order; where some are missing, one of them, with nothing.
#[must_use]
pub fn with_gaps<T>(values: &BTreeMap<u32, T>) -> Vec<(f64, Option<&T>)> {
    let mut all = Vec::new();
    let mut next = None;
    for (&rollout, value) in values {
        if let Some(missing) = next
            && missing < rollout
        {
            all.push((f64::from(missing), None));
        }
        all.push((f64::from(rollout), Some(value)));
        next = rollout.checked_add(1);
    }
    all
}

/// The points of a line along the rollouts, which breaks where some are missing.
#[must_use]
pub fn along(values: &ByRollout) -> Vec<(f64, f64)> {
    let all = with_gaps(values).into_iter();
    all.map(|(rollout, value)| (rollout, value.copied().unwrap_or(f64::NAN))).collect()
}

/// At each rollout from the `window`-th on, the mean of it and those before it: as many as a
/// moving average of that window has, missing ones passed over. Where there are fewer, nothing.
#[must_use]
pub fn moving_average(values: &ByRollout, window: usize) -> ByRollout {
    let known: Vec<(u32, f64)> = values.iter().map(|(rollout, v)| (*rollout, *v)).collect();
    let windows = known.windows(window.max(1));
    let means = windows.filter_map(|part| {
        let numbers: Vec<f64> = part.iter().map(|(_, value)| *value).collect();
        Some((part.last()?.0, mean(&numbers)))
    });
    means.collect()
}

/// At each point the mean of the values around it, `neighbours` together, fewer at the borders;
/// by x.
#[must_use]
pub fn average_around(points: &[(f64, f64)], neighbours: usize) -> Vec<(f64, f64)> {
    let sorted = by_x(points);
    let half = neighbours / 2;
    (0..sorted.len())
        .map(|at| {
            let around = &sorted[at.saturating_sub(half)..(at + half + 1).min(sorted.len())];
            (sorted[at].0, mean(&around.iter().map(|(_, y)| *y).collect::<Vec<_>>()))
        })
        .collect()
}

/// The points by x.
#[must_use]
pub fn by_x(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    sorted
}

/// The least and the most x.
#[must_use]
pub fn extent(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let xs = || points.iter().map(|point| point.0).filter(|x| x.is_finite());
    let (least, most) =
        (xs().fold(f64::INFINITY, f64::min), xs().fold(f64::NEG_INFINITY, f64::max));
    (least <= most).then_some((least, most))
}

/// Mean and standard deviation (0 of a single one) of each rollout of several rows, over those that
/// have it.
#[must_use]
pub fn over_rows(rows: &[ByRollout]) -> BTreeMap<u32, (f64, f64)> {
    let mut rollouts: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
    for (rollout, value) in rows.iter().flatten() {
        rollouts.entry(*rollout).or_default().push(*value);
    }
    let spread = |values: &[f64]| deviation(values).unwrap_or(0.0);
    rollouts.into_iter().map(|(rollout, v)| (rollout, (mean(&v), spread(&v)))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moving_average_begins_when_its_window_is_full() {
        let values = ByRollout::from([(1, 1.0), (2, 2.0), (3, 6.0), (5, 4.0)]);
        assert_eq!(moving_average(&values, 3), ByRollout::from([(3, 3.0), (5, 4.0)]));
        assert_eq!(moving_average(&ByRollout::from([(1, 1.0)]), 3), ByRollout::new());
    }

    #[test]
    fn a_line_breaks_where_rollouts_are_missing() {
        let points = along(&ByRollout::from([(2, 1.0), (3, 2.0), (6, 3.0)]));
        assert_eq!(points.iter().map(|point| point.0).collect::<Vec<_>>(), [2.0, 3.0, 4.0, 6.0]);
        assert!(points[2].1.is_nan() && points[3].1 == 3.0, "{points:?}");
    }

    #[test]
    fn an_average_around_takes_what_there_is_at_the_borders() {
        let points = [(3.0, 9.0), (1.0, 1.0), (2.0, 2.0)];
        assert_eq!(average_around(&points, 3), [(1.0, 1.5), (2.0, 4.0), (3.0, 5.5)]);
    }

    #[test]
    fn rows_are_averaged_by_their_rollouts() {
        let rows = [ByRollout::from([(1, 1.0), (3, 5.0)]), ByRollout::from([(1, 3.0), (2, 7.0)])];
        let over = over_rows(&rows);
        assert_eq!(over[&1].0, 2.0);
        assert!((over[&1].1 - 2.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!((over[&2], over[&3]), ((7.0, 0.0), (5.0, 0.0)));
    }
}
