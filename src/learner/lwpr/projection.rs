//! The projections of eight fields learn a sample.

use fearless_simd::prelude::*;

use super::field::{
    H, LAMBDA, N_DATA, PER_LENGTH, PER_S2, ProjectionRows, R, SS_S2, SS_Y_RES, SUM_W,
};
use super::settings::Settings;
use crate::learner::lanes::{Lanes, Row, all, dot, fused, without};

/// The direction of a projection turns only to a vector whose square is larger than this.
const LEAST_SQUARE: f64 = 1e-24;

impl ProjectionRows<&[Row]> {
    /// One of its scalars.
    #[inline(always)]
    pub fn scalar<S: Simd>(&self, simd: S, at: usize) -> Lanes<S> {
        self.scalars[at].get(simd)
    }

    /// s: what lies along the directions of projection `j`.
    #[inline(always)]
    pub fn see<S: Simd>(&self, simd: S, j: usize, residual: &[Row]) -> Lanes<S> {
        let per_length = self.scalar(simd, PER_LENGTH);
        let along = dot(simd, self.s_x_res_y_res, residual) * per_length;
        per_length.simd_gt(0.0).select(along, residual[j].get(simd))
    }

    /// Takes off `residual` what the projection accounts for, where `pull` is s / Σ ws².
    #[inline(always)]
    pub fn account<S: Simd>(&self, simd: S, pull: Lanes<S>, residual: &mut [Row]) {
        for (residual, sum) in residual.iter_mut().zip(self.ss_x_res) {
            residual.set(without(residual.get(simd), sum.get(simd), pull));
        }
    }
}

impl ProjectionRows<&mut [Row]> {
    /// Becomes what comes after the projection `before`, which saw `s` and should explain
    /// `target`. The residual becomes that of the next projection, still by the old P.
    /// Returns 1 / Σ ws².
    #[inline(always)]
    pub fn learn<S: Simd>(
        self,
        simd: S,
        before: &ProjectionRows<&[Row]>,
        (w, s, target): (Lanes<S>, Lanes<S>, Lanes<S>),
        (residual, settings): (&mut [Row], &Settings),
    ) -> Lanes<S> {
        let lambda = before.scalar(simd, LAMBDA);
        let (turning, pull) = (w * target, w * s);
        let ss_s2 = fused(lambda, before.scalar(simd, SS_S2), pull * s);
        let ss_y_res = fused(lambda, before.scalar(simd, SS_Y_RES), turning * s);
        let per_s2 = all(simd, 1.0) / ss_s2;
        self.scalars[SUM_W].set(fused(lambda, before.scalar(simd, SUM_W), w));
        self.scalars[SS_S2].set(ss_s2);
        self.scalars[SS_Y_RES].set(ss_y_res);
        self.scalars[PER_S2].set(per_s2);
        let (tau, end) = (settings.tau_lambda, settings.final_lambda);
        self.scalars[N_DATA].set(before.scalar(simd, N_DATA) * lambda + 1.0);
        self.scalars[LAMBDA].set(lambda * tau + end * (1.0 - tau));
        (self.scalars[H], self.scalars[R]) = (before.scalars[H], before.scalars[R]);
        let kept = lambda * 0.1 + 0.9;
        let mut square = all(simd, 0.0);
        let passed = s * before.scalar(simd, PER_S2);
        let before_sums = before.s_x_res_y_res.iter().zip(before.ss_x_res);
        let sums = self.s_x_res_y_res.iter_mut().zip(self.ss_x_res);
        for (((turned, sum), (old_turned, old_sum)), residual) in
            sums.zip(before_sums).zip(residual)
        {
            let (x, old_sum) = (residual.get(simd), old_sum.get(simd));
            let along = fused(kept, old_turned.get(simd), turning * x);
            square = fused(along, along, square);
            turned.set(along);
            sum.set(fused(lambda, old_sum, pull * x));
            residual.set(without(x, old_sum, passed));
        }
        let turns = square.simd_gt(LEAST_SQUARE) & square.is_finite();
        let per_length = all(simd, 1.0) / square.sqrt();
        let before = before.scalar(simd, PER_LENGTH);
        self.scalars[PER_LENGTH].set(turns.select(per_length, before));
        per_s2
    }
}
