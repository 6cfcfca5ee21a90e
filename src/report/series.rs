//! What the thesis does with series of numbers: averages along them.

use super::metrics::mean;

/// The window of figures 15 and 32, rollouts.
pub const WINDOW: usize = 10;
/// The neighbours of figures 18 to 23, the point itself among them.
pub const NEIGHBOURS: usize = 9;

/// At each of `values` from the `window`-th on, the mean of it and those before it: as many as a
/// moving average of that window has. Where there are fewer, nothing.
#[must_use]
pub fn moving_average(values: &[f64], window: usize) -> Vec<(usize, f64)> {
    let means = values.windows(window.max(1)).map(mean);
    (window.max(1)..).zip(means).collect()
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

/// Mean and standard deviation of each place of several rows, over those that reach so far: the
/// place, from 1, the mean, the deviation (0 of a single one), and how many there are.
#[must_use]
pub fn over_rows(rows: &[Vec<f64>]) -> Vec<(usize, f64, f64, usize)> {
    let longest = rows.iter().map(Vec::len).max().unwrap_or(0);
    (0..longest)
        .map(|place| {
            let values: Vec<f64> = rows.iter().filter_map(|row| row.get(place)).copied().collect();
            let spread = super::metrics::deviation(&values).unwrap_or(0.0);
            (place + 1, mean(&values), spread, values.len())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moving_average_begins_when_its_window_is_full() {
        assert_eq!(moving_average(&[1.0, 2.0, 6.0, 4.0], 3), [(3, 3.0), (4, 4.0)]);
        assert_eq!(moving_average(&[1.0], 3), []);
    }

    #[test]
    fn an_average_around_takes_what_there_is_at_the_borders() {
        let points = [(3.0, 9.0), (1.0, 1.0), (2.0, 2.0)];
        assert_eq!(average_around(&points, 3), [(1.0, 1.5), (2.0, 4.0), (3.0, 5.5)]);
    }

    #[test]
    fn rows_end_when_they_end() {
        let rows = over_rows(&[vec![1.0, 5.0], vec![3.0]]);
        assert_eq!((rows[0].1, rows[0].3), (2.0, 2));
        assert!((rows[0].2 - 2.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(rows[1], (2, 5.0, 0.0, 1));
    }
}
