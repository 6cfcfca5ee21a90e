//! A sample on its way into a learner.

use super::Refusal;

/// A sample, normalised.
#[derive(Clone, Debug)]
pub struct Sample {
    /// The inputs (n).
    pub x: Vec<f64>,
    /// The outputs.
    pub y: Vec<f64>,
}

impl Sample {
    /// Room for one.
    pub fn new(inputs: usize, outputs: usize) -> Self {
        Self { x: vec![0.0; inputs], y: vec![0.0; outputs] }
    }

    /// Checks a raw sample and takes it in, divided by the norms.
    ///
    /// # Errors
    /// When a length is wrong, a number is not finite, also after the division, or the
    /// weight is negative.
    #[inline]
    pub fn admit(
        &mut self,
        (x, norm_in): (&[f64], &[f64]),
        (y, norm_out): (&[f64], &[f64]),
        weight: f64,
    ) -> Result<(), Refusal> {
        for (given, wanted) in [(x.len(), norm_in.len()), (y.len(), norm_out.len())] {
            if given != wanted {
                return Err(Refusal::Length { wanted, given });
            }
        }
        divide(&mut self.x, x, norm_in);
        divide(&mut self.y, y, norm_out);
        // A number that is not finite stays so.
        if !weight.is_finite() || !all_finite(&self.x) || !all_finite(&self.y) {
            return Err(Refusal::NotFinite);
        }
        if weight < 0.0 { Err(Refusal::NegativeWeight) } else { Ok(()) }
    }
}

/// Whether every number is finite.
#[inline]
pub fn all_finite(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite())
}

/// Whether every number may be a sum of weights or squares: finite, and not negative.
pub fn all_sums(values: &[f64]) -> bool {
    values.iter().all(|&value| (0.0..=f64::MAX).contains(&value))
}

/// Divides each value by its norm.
#[inline]
pub fn divide(into: &mut [f64], values: &[f64], norms: &[f64]) {
    for ((into, value), norm) in into.iter_mut().zip(values).zip(norms) {
        *into = value / norm;
    }
}

/// A prediction in raw units: within ± `limit`, if any, and always finite.
#[inline]
pub fn settled(mean: f64, limit: Option<f64>) -> f64 {
    let limit = limit.unwrap_or(f64::MAX);
    if mean.is_nan() { 0.0 } else { mean.clamp(-limit, limit) }
}
