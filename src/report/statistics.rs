//! Whether two groups differ, by how much, and how sure that is.
//!
//! A value is what one independent unit came to: a subject, or a seed of a study. Rollouts of one
//! subject are no units of their own: take their mean first.
//!
//! | question | groups of their own | paired values |
//! | --- | --- | --- |
//! | difference or chance? few values | exact permutation test | exact sign-flip test |
//! | many values | Welch's t-test | paired t-test |
//! | how much? | Hedges' g | the same, over the mean of both variances |
//! | how sure? | BCa bootstrap of the difference of means | of the mean difference |
//!
//! All tests ask for a difference in either direction. Few means at most
//! [`MOST_ARRANGEMENTS`] arrangements: two groups of 11, or 20 pairs.

mod bootstrap;
mod permutation;
mod sentence;
mod student;
#[cfg(test)]
mod tests;

use serde::Serialize;
use statrs::function::gamma::ln_gamma;

use super::metrics::{deviation, mean};
use super::spread::median;
pub use bootstrap::interval95;
use permutation::Exact;
pub use permutation::MOST_ARRANGEMENTS;
use student::Student;

/// Two groups of values beside each other: (a, b).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// How many values there are,
    pub n: (usize, usize),
    /// their means,
    pub mean: (f64, f64),
    /// medians,
    pub median: (f64, f64),
    /// and standard deviations (n − 1).
    pub sd: (f64, f64),
    /// The mean of a less that of b.
    pub difference: f64,
    /// The 95 % interval of the difference (BCa bootstrap); of no width where no value differs
    /// from its group's others (paired: where all differences are equal).
    pub interval95: Option<(f64, f64)>,
    /// The difference in standard deviations, corrected for small samples; none where no value
    /// differs from its group's others.
    pub hedges_g: Option<f64>,
    /// How p was found.
    pub test: Test,
    /// The chance of such a difference, or a larger one in either direction, if the groups did not
    /// differ: above 0, at most 1.
    pub p: f64,
    /// The smallest p that an exact test of groups of these sizes can come to.
    pub smallest_p: Option<f64>,
}

/// How the chance of a difference is found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Test {
    /// Every way of dealing the values to the groups.
    Permutation {
        /// How many there are.
        arrangements: u64,
    },
    /// Welch's t-test, for variances that differ.
    Welch {
        /// The difference over its standard error; infinite where no value differs from its
        /// group's others but the means do.
        t: f64,
        /// Degrees of freedom (Welch–Satterthwaite).
        df: f64,
    },
    /// Every way of turning the signs of the differences.
    PairedPermutation {
        /// How many there are.
        arrangements: u64,
    },
    /// Student's t-test of the differences.
    PairedT {
        /// The mean difference over its standard error; infinite where all differences are equal
        /// and not 0.
        t: f64,
        /// Degrees of freedom.
        df: f64,
    },
}

/// What is told of a group.
struct Group {
    mean: f64,
    median: f64,
    sd: f64,
}

impl Group {
    /// None below two values, and where a value, or what is made of them, is not finite.
    fn of(values: &[f64]) -> Option<Self> {
        let group = Self { mean: mean(values), median: median(values)?, sd: deviation(values)? };
        let is_finite = values.iter().all(|value| value.is_finite())
            && group.mean.is_finite()
            && group.sd.is_finite();
        is_finite.then_some(group)
    }
}

/// How group `a` differs from group `b`. `seed` is that of the bootstrap: the same gives the same.
///
/// None where a group has fewer than two values, or a value is not finite, or so large that
/// variances are not: leave such values out beforehand, and say so. The order within a group means
/// nothing.
#[must_use]
pub fn compare(a: &[f64], b: &[f64], seed: u64) -> Option<Comparison> {
    let groups = (Group::of(a)?, Group::of(b)?);
    let found = match permutation::of_groups(a, b) {
        Some(exact) => {
            Found::exactly(Test::Permutation { arrangements: exact.arrangements.into() }, exact)
        }
        None => Found::by(student::welch(a, b)?, |t, df| Test::Welch { t, df }),
    };
    found.between((a, b), &groups, bootstrap::of_difference(a, b, seed))
}

/// How the values `a` differ from the values `b` that belong to the same units (subjects or seeds),
/// in the same order.
///
/// None where their numbers differ, and as with [`compare`].
#[must_use]
pub fn compare_paired(a: &[f64], b: &[f64], seed: u64) -> Option<Comparison> {
    if a.len() != b.len() {
        return None;
    }
    let groups = (Group::of(a)?, Group::of(b)?);
    let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    Group::of(&differences)?;
    let found = match permutation::of_signs(&differences) {
        Some(exact) => Found::exactly(
            Test::PairedPermutation { arrangements: exact.arrangements.into() },
            exact,
        ),
        None => Found::by(student::paired(&differences)?, |t, df| Test::PairedT { t, df }),
    };
    found.between((a, b), &groups, interval95(&differences, seed))
}

/// What a test came to.
struct Found {
    test: Test,
    p: f64,
    smallest_p: Option<f64>,
}

impl Found {
    fn exactly(test: Test, exact: Exact) -> Self {
        Self { test, p: exact.p(), smallest_p: Some(exact.smallest_p()) }
    }

    fn by(Student { t, df, p }: Student, test: fn(f64, f64) -> Test) -> Self {
        Self { test: test(t, df), p, smallest_p: None }
    }

    fn between(
        self,
        (a, b): (&[f64], &[f64]),
        (of_a, of_b): &(Group, Group),
        interval95: Option<(f64, f64)>,
    ) -> Option<Comparison> {
        let difference = of_a.mean - of_b.mean;
        difference.is_finite().then(|| Comparison {
            n: (a.len(), b.len()),
            mean: (of_a.mean, of_b.mean),
            median: (of_a.median, of_b.median),
            sd: (of_a.sd, of_b.sd),
            difference,
            interval95,
            hedges_g: hedges_g(difference, (a.len(), of_a.sd), (b.len(), of_b.sd)),
            test: self.test,
            p: self.p,
            smallest_p: self.smallest_p,
        })
    }
}

/// A difference of means in standard deviations: Hedges' g with the exact correction for small
/// samples, Γ(df/2) / (√(df/2) Γ((df − 1)/2)) with df = `n_a` + `n_b` − 2 (Hedges 1981). Of pairs it is
/// the `g_av` of Lakens (2013), by which paired and unpaired results can be compared.
fn hedges_g(difference: f64, a: (usize, f64), b: (usize, f64)) -> Option<f64> {
    let free = |n: usize| u32::try_from(n.saturating_sub(1)).map_or(f64::INFINITY, f64::from);
    let (of_a, of_b) = (free(a.0), free(b.0));
    let df = of_a + of_b;
    let pooled = ((of_a * a.1.powi(2) + of_b * b.1.powi(2)) / df).sqrt();
    let correction = (ln_gamma(df / 2.0) - ln_gamma((df - 1.0) / 2.0)).exp() / (df / 2.0).sqrt();
    let g = difference / pooled * correction;
    g.is_finite().then_some(g)
}
