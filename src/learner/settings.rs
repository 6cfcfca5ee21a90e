//! What the settings of all learners have in common.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::BuildError;
use super::sample::all_finite;

/// The most inputs a learner takes.
pub const MAX_INPUTS: usize = 64;
/// The most outputs.
pub const MAX_OUTPUTS: usize = 64;

/// The least that a width, norm or the like may be,
pub const SMALL: f64 = 1e-12;
/// and the most.
pub const BIG: f64 = 1e12;

/// The metric that new fields start with, in normalised coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InitialMetric {
    /// The same width in all directions: D = d I.
    Scalar(f64),
    /// A width per direction.
    Diagonal(Vec<f64>),
    /// The whole symmetric matrix, by rows. With `diag_only` RFWR refuses it, as it would
    /// ignore what is off the diagonal, and LWPR never changes that part of it.
    Full(Vec<Vec<f64>>),
}

impl InitialMetric {
    /// D over `n` inputs and the upper triangular M of `D = MᵀM`, both whole and by rows.
    ///
    /// # Errors
    /// When a length does not fit, or this is no metric.
    pub fn factorise(&self, n: usize) -> Result<(Vec<f64>, Vec<f64>), BuildError> {
        let matrix = match self {
            Self::Scalar(d) => DMatrix::from_diagonal_element(n, n, *d),
            Self::Diagonal(d) => {
                length("init_d", d.len(), n)?;
                DMatrix::from_diagonal(&d.clone().into())
            }
            Self::Full(rows) => {
                length("init_d", rows.len(), n)?;
                rows.iter().try_for_each(|row| length("init_d", row.len(), n))?;
                DMatrix::from_fn(n, n, |a, b| rows[a][b])
            }
        };
        if matrix != matrix.transpose() {
            return Err(BuildError::NoMetric);
        }
        let lower = matrix.clone().cholesky().ok_or(BuildError::NoMetric)?.unpack();
        // nalgebra stores by columns: Mᵀ by columns is M by rows.
        let (d, m) = (matrix.as_slice().to_vec(), lower.as_slice().to_vec());
        let positive = diagonal(&d, n).iter().all(|&d| d >= f64::MIN_POSITIVE);
        if positive && all_finite(&d) && all_finite(&m) {
            Ok((d, m))
        } else {
            Err(BuildError::NoMetric)
        }
    }
}

/// D and M of new fields over `n` inputs, each as its diagonal (`diag_only`) or what is on
/// and above it.
///
/// # Errors
/// When `d` is no metric, not diagonal where it should be, or outside the bounds of M's
/// diagonal.
pub fn start(
    d: &InitialMetric,
    n: usize,
    (diag_only, bounds): (bool, Option<(f64, f64)>),
) -> Result<(Vec<f64>, Vec<f64>), BuildError> {
    let (d, m) = d.factorise(n)?;
    if let Some((least, most)) = bounds {
        // Told as they are set: as bounds of D.
        let held = |m: f64| range("init_d", m * m, least * least, most * most);
        diagonal(&m, n).into_iter().try_for_each(held)?;
    }
    if !diag_only {
        return Ok((upper(&d, n), upper(&m, n)));
    }
    if d.iter().filter(|&&d| d != 0.0).count() > n {
        return Err(BuildError::FullMetric);
    }
    Ok((diagonal(&d, n), diagonal(&m, n)))
}

/// The diagonal of a square matrix over `n` inputs.
pub fn diagonal(matrix: &[f64], n: usize) -> Vec<f64> {
    matrix.iter().copied().step_by(n + 1).collect()
}

/// What is on and above the diagonal of a square matrix over `n` inputs, by rows.
pub fn upper(matrix: &[f64], n: usize) -> Vec<f64> {
    (0..n).flat_map(|a| &matrix[a * n + a..(a + 1) * n]).copied().collect()
}

/// Demands that there are 1 to 64 inputs and outputs, with a norm each, from 1e-12 to 1e12.
///
/// # Errors
/// Naming the first that is not so.
pub fn check_sizes(
    (inputs, norm_in): (usize, &[f64]),
    (outputs, norm_out): (usize, &[f64]),
) -> Result<(), BuildError> {
    for (key, given, most) in [("inputs", inputs, MAX_INPUTS), ("outputs", outputs, MAX_OUTPUTS)] {
        if !(1..=most).contains(&given) {
            return Err(BuildError::Size { key, given });
        }
    }
    length("norm_in", norm_in.len(), inputs)?;
    length("norm_out", norm_out.len(), outputs)?;
    norm_in.iter().try_for_each(|&norm| range("norm_in", norm, SMALL, BIG))?;
    norm_out.iter().try_for_each(|&norm| range("norm_out", norm, SMALL, BIG))
}

/// Demands that the setting `key` is `from` to `to`.
///
/// # Errors
/// When it is not, or is NaN.
pub fn range(key: &'static str, value: f64, from: f64, to: f64) -> Result<(), BuildError> {
    if (from..=to).contains(&value) {
        Ok(())
    } else {
        Err(BuildError::Range { key, value, from, to })
    }
}

fn length(key: &'static str, given: usize, wanted: usize) -> Result<(), BuildError> {
    if given == wanted { Ok(()) } else { Err(BuildError::Length { key, given, wanted }) }
}
