//! Exact tests: every arrangement is looked at, none is drawn.

use crate::report::metrics::mean;

/// The most arrangements that are looked at: some milliseconds. Two groups of 11 have 705,432, and
/// 20 pairs 1,048,576.
pub const MOST_ARRANGEMENTS: u32 = 1 << 20;

/// By how much an arrangement may miss what was observed and still count as the same: sums in
/// another order round differently. In parts of the largest deviation.
const TIE: f64 = 1e-9;

/// What looking at every arrangement came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exact {
    /// Arrangements there are,
    pub arrangements: u32,
    /// those whose difference is at least as large as the observed one, in either direction,
    pub as_large: u32,
    /// and the fewest that this can be, with groups of these sizes.
    pub fewest: u32,
}

impl Exact {
    /// The chance of such a difference, if the groups do not differ.
    pub fn p(self) -> f64 {
        f64::from(self.as_large) / f64::from(self.arrangements)
    }

    /// The smallest that this can be, with groups of these sizes.
    pub fn smallest_p(self) -> f64 {
        f64::from(self.fewest) / f64::from(self.arrangements)
    }
}

/// Every way of dealing the values of `a` and `b` to groups of these sizes; none if there are more
/// than [`MOST_ARRANGEMENTS`]. Only groups of equal sizes have to each arrangement its mirror image,
/// which is as extreme.
pub fn of_groups(a: &[f64], b: &[f64]) -> Option<Exact> {
    let (fewer, more) = if a.len() <= b.len() { (a, b) } else { (b, a) };
    let arrangements = ways_to_choose(fewer.len(), fewer.len() + more.len())?;
    // Deviations from the mean of all add up to 0, so that the sum over one group tells the
    // difference of means up to a factor.
    let deviations = standard([fewer, more].concat());
    let observed: f64 = deviations[..fewer.len()].iter().sum();
    let as_large = choices_as_large(&deviations, fewer.len(), 0.0, observed.abs() - TIE);
    let fewest = if a.len() == b.len() { 2 } else { 1 };
    Some(Exact { arrangements, as_large, fewest })
}

/// Every way of turning the signs of `differences`; none if there are more than
/// [`MOST_ARRANGEMENTS`].
pub fn of_signs(differences: &[f64]) -> Option<Exact> {
    let arrangements = 1_u32.checked_shl(u32::try_from(differences.len()).ok()?)?;
    if arrangements > MOST_ARRANGEMENTS {
        return None;
    }
    let sizes = in_parts_of_the_largest(differences.to_vec());
    let observed: f64 = sizes.iter().sum();
    let as_large = signs_as_large(&sizes, 0.0, observed.abs() - TIE);
    Some(Exact { arrangements, as_large, fewest: 2 })
}

/// The number of ways to choose `taken` of `all`, up to [`MOST_ARRANGEMENTS`].
fn ways_to_choose(taken: usize, all: usize) -> Option<u32> {
    let mut ways = 1_usize;
    for k in 0..taken {
        ways = ways.checked_mul(all - k)? / (k + 1);
        if ways > MOST_ARRANGEMENTS as usize {
            return None;
        }
    }
    u32::try_from(ways).ok()
}

/// Deviations from the mean, in parts of the largest.
fn standard(values: Vec<f64>) -> Vec<f64> {
    let centre = mean(&values);
    in_parts_of_the_largest(values.into_iter().map(|value| value - centre).collect())
}

fn in_parts_of_the_largest(mut values: Vec<f64>) -> Vec<f64> {
    let largest = values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    if largest > 0.0 {
        for value in &mut values {
            *value /= largest;
        }
    }
    values
}

/// In how many ways `taken` of `values`, with `sum` on top, reach `bound` in size.
fn choices_as_large(values: &[f64], taken: usize, sum: f64, bound: f64) -> u32 {
    match values {
        _ if taken == 0 => u32::from(sum.abs() >= bound),
        [first, rest @ ..] if taken <= values.len() => {
            choices_as_large(rest, taken - 1, sum + first, bound)
                + choices_as_large(rest, taken, sum, bound)
        }
        _ => 0,
    }
}

/// In how many ways `values` of any sign, with `sum` on top, reach `bound` in size.
fn signs_as_large(values: &[f64], sum: f64, bound: f64) -> u32 {
    match values {
        [] => u32::from(sum.abs() >= bound),
        [first, rest @ ..] => {
            signs_as_large(rest, sum + first, bound) + signs_as_large(rest, sum - first, bound)
        }
    }
}
