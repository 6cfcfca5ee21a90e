//! Intervals by the bootstrap, bias-corrected and accelerated (BCa; Efron 1987).

use std::cmp::Ordering;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::random::{Place, Purpose, stream};
use crate::report::metrics::mean;

/// Resamples: enough that another seed moves an end by about a hundredth of the interval.
const RESAMPLES: u32 = 10_000;

/// The half of what a 95 % interval leaves out.
const TAIL: f64 = 0.025;

/// What counts as equal among means of resamples: sums in another order round differently. In
/// parts of the largest.
const TIE: f64 = 1e-9;

/// The 95 % interval of the mean of `values`, whose order means nothing; none below two values, or
/// where one is not finite.
#[must_use]
pub fn interval95(values: &[f64], seed: u64) -> Option<(f64, f64)> {
    let turned: Vec<f64> = values.iter().map(|value| -value).collect();
    if order(&sorted(&turned), &sorted(values)) == Ordering::Less {
        return interval95(&turned, seed).map(|(low, high)| (-high, -low));
    }
    let sample = Sample::of(values)?;
    let mut chance = stream(seed, Purpose::Bootstrap, Place::default());
    let means = (0..RESAMPLES).map(|_| sample.drawn_mean(&mut chance)).collect();
    let (cubes, squares) = sample.moments();
    bca(sample.mean, means, acceleration(cubes, squares))
}

/// The 95 % interval of the mean of `a` less that of `b`. What it is from `b` to `a` is its mirror
/// image: chance always begins with the same group.
pub fn of_difference(a: &[f64], b: &[f64], seed: u64) -> Option<(f64, f64)> {
    if order(&sorted(b), &sorted(a)) == Ordering::Less {
        return of_difference(b, a, seed).map(|(low, high)| (-high, -low));
    }
    let (a, b) = (Sample::of(a)?, Sample::of(b)?);
    let mut chance = stream(seed, Purpose::Bootstrap, Place::default());
    let differences =
        (0..RESAMPLES).map(|_| a.drawn_mean(&mut chance) - b.drawn_mean(&mut chance)).collect();
    let ((cubes_a, squares_a), (cubes_b, squares_b)) = (a.moments(), b.moments());
    let acceleration = acceleration(cubes_a - cubes_b, squares_a + squares_b);
    bca(a.mean - b.mean, differences, acceleration)
}

/// Values to draw from, as deviations from their mean.
struct Sample {
    mean: f64,
    deviations: Vec<f64>,
}

impl Sample {
    fn of(values: &[f64]) -> Option<Self> {
        let mean = mean(values);
        let deviations: Vec<f64> = sorted(values).iter().map(|value| value - mean).collect();
        let is_sound = values.len() > 1 && deviations.iter().all(|value| value.is_finite());
        is_sound.then_some(Self { mean, deviations })
    }

    fn size(&self) -> f64 {
        u32::try_from(self.deviations.len()).map_or(f64::INFINITY, f64::from)
    }

    /// The mean of as many values as there are, drawn with replacement.
    fn drawn_mean(&self, chance: &mut ChaCha8Rng) -> f64 {
        let count = self.deviations.len();
        let drawn = (0..count).filter_map(|_| self.deviations.get(chance.random_range(0..count)));
        drawn.sum::<f64>() / self.size()
    }

    /// The sums of the cubes and squares of each value's influence on the mean, which leaving it
    /// out tells (the jackknife).
    fn moments(&self) -> (f64, f64) {
        let influence = self.deviations.iter().map(|value| value / self.size());
        influence.fold((0.0, 0.0), |(cubes, squares), of_one| {
            (cubes + of_one.powi(3), squares + of_one.powi(2))
        })
    }
}

/// How fast the standard error changes with what is estimated.
fn acceleration(cubes: f64, squares: f64) -> f64 {
    let acceleration = cubes / (6.0 * squares.powf(1.5));
    if acceleration.is_finite() { acceleration } else { 0.0 }
}

/// The interval of what was `observed`, when resamples lay as far from it as `distances` tell.
fn bca(observed: f64, mut distances: Vec<f64>, acceleration: f64) -> Option<(f64, f64)> {
    distances.sort_by(f64::total_cmp);
    let normal = Normal::standard();
    let bias = normal.inverse_cdf(part_below(&distances));
    let at = |tail: f64| {
        let z = bias + normal.inverse_cdf(tail);
        let level = normal.cdf(bias + z / (1.0 - acceleration * z));
        quantile(&distances, level).map(|distance| observed + distance)
    };
    Some((at(TAIL)?, at(1.0 - TAIL)?))
}

/// The part of the sorted `distances` below 0; what is 0 counts half. Never quite 0 or 1, where the
/// correction would be infinite.
fn part_below(distances: &[f64]) -> f64 {
    let largest = distances.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let below = distances.partition_point(|value| *value < -TIE * largest);
    let up_to = distances.partition_point(|value| *value <= TIE * largest);
    let count = |number: usize| u32::try_from(number).map_or(f64::INFINITY, f64::from);
    let least = 0.5 / f64::from(RESAMPLES);
    (0.5 * (count(below) + count(up_to)) / f64::from(RESAMPLES)).clamp(least, 1.0 - least)
}

/// The value below which the part `level` of the sorted `values` lies, between its neighbours.
fn quantile(values: &[f64], level: f64) -> Option<f64> {
    let last = f64::from(RESAMPLES - 1);
    let place = (level * last).clamp(0.0, last);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0 to last")]
    let below = place.floor() as usize;
    let low = *values.get(below)?;
    let high = *values.get(below + 1).unwrap_or(&low);
    Some(low + (high - low) * place.fract())
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values
}

/// Which of two sorted lists comes first.
fn order(a: &[f64], b: &[f64]) -> Ordering {
    a.partial_cmp(b).unwrap_or(Ordering::Equal)
}
