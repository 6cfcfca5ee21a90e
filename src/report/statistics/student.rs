//! The t-tests, for groups too large to look at every arrangement.

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::report::metrics::{deviation, mean};

/// What a t-test came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Student {
    /// The difference over its standard error,
    pub t: f64,
    /// degrees of freedom,
    pub df: f64,
    /// and the chance of such a t, or a larger one of either sign; never quite 0.
    pub p: f64,
}

/// Welch's test (1947) of two groups of at least two values each.
pub fn welch(a: &[f64], b: &[f64]) -> Option<Student> {
    let (free_a, free_b) = (free(a)?, free(b)?);
    let error = |values: &[f64], free: f64| deviation(values).map(|sd| sd.powi(2) / (free + 1.0));
    let (error_a, error_b) = (error(a, free_a)?, error(b, free_b)?);
    let both = error_a + error_b;
    // In parts of both, lest squares of small numbers vanish.
    let parts = |error: f64, free: f64| (error / both).powi(2) / free;
    let satterthwaite = 1.0 / (parts(error_a, free_a) + parts(error_b, free_b));
    let df = if both > 0.0 { satterthwaite } else { free_a + free_b };
    student(mean(a) - mean(b), both.sqrt(), df)
}

/// Student's test of at least two `differences`.
pub fn paired(differences: &[f64]) -> Option<Student> {
    let df = free(differences)?;
    student(mean(differences), deviation(differences)? / (df + 1.0).sqrt(), df)
}

/// Degrees of freedom of the variance of `values`.
fn free(values: &[f64]) -> Option<f64> {
    u32::try_from(values.len().checked_sub(1)?).ok().map(f64::from)
}

fn student(difference: f64, error: f64, df: f64) -> Option<Student> {
    let t = if difference == 0.0 { 0.0 } else { difference / error };
    let beyond = if t.is_finite() { StudentsT::new(0.0, 1.0, df).ok()?.sf(t.abs()) } else { 0.0 };
    Some(Student { t, df, p: (2.0 * beyond).clamp(f64::MIN_POSITIVE, 1.0) })
}
