//! How sure a mean is: the median beside it, and a 95 % interval.

use super::metrics::{deviation, mean};
use super::statistics;

/// The fewest values of whose mean an interval is given.
pub const LEAST_VALUES: usize = 5;

/// The most values that are resampled, which takes long: of more the mean is normal.
const MOST_RESAMPLED: usize = 1000;

/// The middle of `values`; none of nothing.
#[must_use]
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let half = sorted.len() / 2;
    let upper = *sorted.get(half)?;
    let is_odd = sorted.len() % 2 == 1;
    Some(if is_odd { upper } else { f64::midpoint(*sorted.get(half - 1)?, upper) })
}

/// The 95 % interval of the mean of `values` by the bootstrap, bias-corrected and accelerated, with
/// chance of its own; of more than a thousand by 1.96 standard errors. None below
/// [`LEAST_VALUES`]: it would be far too narrow.
#[must_use]
pub fn interval95(values: &[f64]) -> Option<(f64, f64)> {
    match values.len() {
        0..LEAST_VALUES => None,
        LEAST_VALUES..=MOST_RESAMPLED => statistics::interval95(values, 0),
        many => {
            #[expect(clippy::cast_precision_loss, reason = "a number of values")]
            let reach = 1.96 * deviation(values)? / (many as f64).sqrt();
            let mean = mean(values);
            reach.is_finite().then_some((mean - reach, mean + reach))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[3.0]), Some(3.0));
        assert_eq!(median(&[9.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 9.0]), Some(3.0));
    }

    /// Of 100 equally spaced values the mean's standard error is 28.87 / 10, so the interval
    /// is about 50.5 ± 5.66.
    #[test]
    fn the_interval_is_that_of_the_mean() {
        let values: Vec<f64> = (1..=100).map(f64::from).collect();
        let (low, high) = interval95(&values).unwrap();
        assert!((low - 44.84).abs() < 0.6 && (high - 56.16).abs() < 0.6, "{low} {high}");
        assert_eq!(interval95(&values), Some((low, high)), "the same each time");
        // Where resampling ends it goes on as it was.
        let many = |n: u32| (0..n).map(|k| f64::from(k % 50)).collect::<Vec<_>>();
        let (resampled, normal) =
            (interval95(&many(1000)).unwrap(), interval95(&many(1050)).unwrap());
        assert!((resampled.0 - normal.0).abs() < 0.05 && (resampled.1 - normal.1).abs() < 0.05);
        assert_eq!(interval95(&[7.0; 5]), Some((7.0, 7.0)));
        assert_eq!(interval95(&[7.0, 8.0, 6.0, 9.0]), None);
    }
}
