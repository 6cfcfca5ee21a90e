//! The memory of eight fields' errors learns a sample, and tells how their shapes should
//! change.

use fearless_simd::prelude::*;

use super::field::{ErrorRows, SUM_E_CV2, SUM_E2};
use super::regression::Findings;
use super::settings::Settings;
use crate::learner::lanes::{Lanes, Row, all, dot, fused};
use crate::learner::metric::Cost;

/// Keeps the transient factor from dividing by 0.
const TINY: f64 = 1e-10;

/// What the regressions say after a sample.
#[derive(Clone, Copy)]
pub struct Heard<'a, S: Simd> {
    /// The forgetting factors λ before it.
    pub lambda: Lanes<S>,
    /// The sums of weights with it.
    pub sum_w: Lanes<S>,
    /// The weighted activations.
    pub w: Lanes<S>,
    /// What they found.
    pub found: &'a Findings,
}

impl ErrorRows<&mut [Row]> {
    /// Becomes what comes after the `old` errors and the sample.
    #[inline(always)]
    pub fn learn<S: Simd>(
        &mut self,
        simd: S,
        old: &ErrorRows<&[Row]>,
        heard: Heard<'_, S>,
        rules: &Settings,
    ) -> Cost<S> {
        let Heard { lambda, sum_w, w, found } = heard;
        let Findings { xz, v, e_cv, e, .. } = found;
        let n = xz.len();
        let (e_cv2, e2) = (dot(simd, e_cv, e_cv), dot(simd, e, e));
        let spread = lambda * old.scalars[SUM_E_CV2].get(simd) + w * e_cv2;
        let sum_e2 = lambda * old.scalars[SUM_E2].get(simd) + w * e2;
        self.scalars[SUM_E_CV2].set(spread);
        self.scalars[SUM_E2].set(sum_e2);
        let ratio = sum_e2 / (spread + TINY);
        let ratio2 = ratio * ratio;
        let transient = ratio2 * ratio2;
        let x_v = dot(simd, xz, v);
        let one = all(simd, 1.0);
        let room = one - w * x_v;
        let room = match rules.min_one_minus_h {
            Some(least) => room.simd_lt(least).select(all(simd, least), room),
            None => room,
        };
        let credit = w / room * transient;

        // Σ (v eᵀ)∘H, with the old H.
        let mut through_slopes = all(simd, 0.0);
        for k in 0..e.len() {
            let at = k * n..(k + 1) * n;
            let gain = credit * e_cv[k].get(simd);
            let mut pull = all(simd, 0.0);
            let rows = self.h[at.clone()].iter_mut().zip(&old.h[at]);
            for (((next, h), xz), v) in rows.zip(xz).zip(v) {
                let h = h.get(simd);
                pull = fused(v.get(simd), h, pull);
                next.set(fused(lambda, h, gain * xz.get(simd)));
            }
            through_slopes += e[k].get(simd) * pull;
        }
        let through_p = self.learn_r(simd, old.r, (lambda, w * e_cv2 * credit), found);
        let share = one / sum_w;
        let mean_spread = spread * share * share;
        let past = e_cv2 - through_slopes * 2.0;
        let j1_slope = (past - through_p * 2.0) * share - mean_spread;
        let j1_curvature = if rules.meta {
            // Σ (−v eᵀ/W − 2 v (xᵀv eᵀ))∘H
            let bent = -through_slopes * share - x_v * 2.0 * through_slopes;
            -e_cv2 * share * share - share * 2.0 * bent + e2 * 2.0 * x_v * share
                - past * share * share
                + mean_spread * 2.0 * share
        } else {
            one
        };
        #[expect(clippy::cast_precision_loss, reason = "at most 64 outputs")]
        let outputs = e.len() as f64;
        Cost {
            j1_slope: j1_slope / outputs,
            j1_curvature: j1_curvature / outputs,
            share: w * share,
            transient,
        }
    }

    /// R with the sample; returns vᵀRv with the old one.
    #[inline(always)]
    fn learn_r<S: Simd>(
        &mut self,
        simd: S,
        old: &[Row],
        (lambda, gain): (Lanes<S>, Lanes<S>),
        Findings { xz, v, .. }: &Findings,
    ) -> Lanes<S> {
        let n = xz.len();
        let mut through = all(simd, 0.0);
        let (mut old, mut new) = (old, &mut *self.r);
        for a in 0..n {
            let ((row, rest), (next, next_rest)) = (old.split_at(n - a), new.split_at_mut(n - a));
            (old, new) = (rest, next_rest);
            let pull = gain * xz[a].get(simd);
            let mut off = all(simd, 0.0);
            for (((next, r), xz), v) in next.iter_mut().zip(row).zip(&xz[a..]).zip(&v[a..]) {
                let r = r.get(simd);
                off = fused(r, v.get(simd), off);
                next.set(fused(lambda, r, pull * xz.get(simd)));
            }
            // Each entry off the diagonal stands for two.
            let v = v[a].get(simd);
            through += (off + off - row[0].get(simd) * v) * v;
        }
        through
    }
}
