//! Eight fields say what they know.

use fearless_simd::prelude::*;

use super::field::{
    BASE_SCALARS, COUNT, N_DATA, OFFSET, PER_S2, SS_P, SS_Y_RES, SUM_E_CV2, SUM_W, Size,
    TRUSTWORTHY,
};
use crate::learner::lanes::{Lanes, Mask, Row, all, fused};

/// Eight fields on their way to say something about an input, projection after projection.
pub struct Speech<'a, S: Simd> {
    size: Size,
    /// The outputs, normalised.
    pub y: Lanes<S>,
    /// Where fields may speak.
    pub trustworthy: Mask<S>,
    /// How many projections they have.
    count: Lanes<S>,
    ss_p: Lanes<S>,
    /// What is left of x − x̄ (n).
    residual: &'a mut [Row],
    /// Σ s² / Σ ws².
    leverage: Lanes<S>,
    /// The sum of squared errors of the last projection that counts, of the first in any
    /// case, and its sum of weights.
    spread: (Lanes<S>, Lanes<S>),
}

impl<'a, S: Simd> Speech<'a, S> {
    /// Begins with the rows of the base, as many as predictions need. `residual` is room for
    /// n rows.
    #[inline(always)]
    pub fn begin(
        simd: S,
        size: Size,
        base: &[Row],
        (x, residual): (&[f64], &'a mut [Row]),
    ) -> Self {
        for ((residual, mean), &x) in residual.iter_mut().zip(&base[BASE_SCALARS..]).zip(x) {
            residual.set(all(simd, x) - mean.get(simd));
        }
        Self {
            size,
            y: base[OFFSET].get(simd),
            trustworthy: base[TRUSTWORTHY].get(simd).simd_gt(0.0),
            count: base[COUNT].get(simd),
            ss_p: base[SS_P].get(simd),
            residual,
            leverage: all(simd, 0.0),
            spread: (all(simd, 0.0), all(simd, 1.0)),
        }
    }

    /// Adds what projection `j` says, by as many of its rows as predictions need.
    #[inline(always)]
    pub fn hear(&mut self, simd: S, j: usize, rows: &[Row]) {
        let projection = self.size.cut_projection(rows);
        let counts = counts(self.size, self.count - count(j), projection.scalar(simd, N_DATA));
        let s = counts.select(projection.see(simd, j, self.residual), all(simd, 0.0));
        let pull = s * projection.scalar(simd, PER_S2);
        self.y = fused(projection.scalar(simd, SS_Y_RES), pull, self.y);
        self.leverage = fused(s, pull, self.leverage);
        projection.account(simd, pull, self.residual);
        let heard = if j == 0 { Mask::splat(simd, true) } else { counts };
        let (errors, sum_w) = (projection.scalar(simd, SUM_E_CV2), projection.scalar(simd, SUM_W));
        self.spread = (heard.select(errors, self.spread.0), heard.select(sum_w, self.spread.1));
    }

    /// The variances of what was said, where the activations are `w`.
    #[inline(always)]
    pub fn variance(&self, w: Lanes<S>) -> Lanes<S> {
        let noise = self.spread.0 / (self.spread.1 - self.ss_p);
        noise * (w * self.leverage + 1.0)
    }
}

/// Where a projection of so many samples counts in predictions, if there are `after` from it
/// on: the last one only if it has seen enough.
#[inline(always)]
pub fn counts<S: Simd>(size: Size, after: Lanes<S>, n_data: Lanes<S>) -> Mask<S> {
    after.simd_gt(1.0) | after.simd_gt(0.0) & n_data.simd_gt(enough(size))
}

/// So many samples are enough to speak.
pub fn enough(size: Size) -> f64 {
    2.0 * count(size.inputs)
}

/// A small count as a number.
#[expect(clippy::cast_precision_loss, reason = "at most 64")]
pub fn count(j: usize) -> f64 {
    j as f64
}
