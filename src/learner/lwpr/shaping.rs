//! What eight fields' regressions say about their shapes.

use fearless_simd::prelude::*;

use super::field::{H, LAMBDA, R, SUM_E2, SUM_W};
use super::regression::{Findings, Rows};
use crate::learner::lanes::{Lanes, Row, all};
use crate::learner::metric::Cost;

/// Keeps the transient factor from dividing by 0.
const TINY: f64 = 1e-10;

/// How a sample's cost is reckoned, and room for the memories that it leaves.
#[derive(Clone, Debug)]
pub struct Reckoning {
    /// Whether the second derivative is wanted.
    pub meta: bool,
    /// The least 1 − h. Ours.
    pub min_one_minus_h: Option<f64>,
    /// H after the sample (up to n), not yet taken over,
    pub h: Vec<Row>,
    /// and r.
    pub r: Vec<Row>,
}

impl Reckoning {
    /// How the fields' shapes should change after a sample of the weighted activations `w`,
    /// which took the regressions from `old` to `new` and of which they found `found`.
    ///
    /// Only what a projection has seen enough of is heard; where even the first has not, the
    /// answer means nothing. Leaves the memories H and r with the sample here.
    #[inline(always)]
    pub fn judge<S: Simd>(
        &mut self,
        simd: S,
        (old, new): (&Rows<&[Row]>, &Rows<&[Row]>),
        w: Lanes<S>,
        found: &Findings,
    ) -> Cost<S> {
        let zero = all(simd, 0.0);
        let one = all(simd, 1.0);
        // Σ s²/SSs2, Σ (s/SSs2) H and Σ (s/SSs2)² r.
        let (mut leverage, mut through_slopes, mut through_variances) = (zero, zero, zero);
        for j in 0..old.depth() {
            let before = old.projection(j);
            let s = found.s[j].get(simd);
            let pull = old.knows(simd, j).select(s * found.per_s2[j].get(simd), zero);
            leverage += s * pull;
            through_slopes += pull * before.scalar(simd, H);
            through_variances += pull * pull * before.scalar(simd, R);
        }
        let (e, e_cv) = (found.e.get(simd), found.e_cv.get(simd));
        let share = one / new.first(simd, SUM_W);
        let (spread, _) = new.spread(simd, old);
        let ratio = new.base().scalars[SUM_E2].get(simd) / (spread + TINY);
        let ratio2 = ratio * ratio;
        let transient = ratio2 * ratio2;
        let transient = transient.simd_gt(1.0).select(one, transient);
        let e_cv2 = e_cv * e_cv;
        let j1_slope =
            (e_cv2 - spread * share - (e * through_slopes + through_variances) * 2.0) * share;
        let j1_curvature = if self.meta {
            ((e * e * leverage - e_cv2 * share) * 2.0
                + spread * share * share
                + e * 4.0 * (share + leverage) * through_slopes)
                * share
        } else {
            zero
        };

        let room = one - w * leverage;
        let room = match self.min_one_minus_h {
            Some(least) => room.simd_lt(least).select(all(simd, least), room),
            None => room,
        };
        let credit = w / room * transient;
        for j in 0..old.depth() {
            let before = old.projection(j);
            let known = old.knows(simd, j);
            let (s, lambda) = (found.s[j].get(simd), before.scalar(simd, LAMBDA));
            let (h, r) = (before.scalar(simd, H), before.scalar(simd, R));
            let with = lambda * h + credit * s * e_cv;
            self.h[j].set(known.select(with, h));
            let with = lambda * r + credit * w * e_cv2 * s * s;
            self.r[j].set(known.select(with, r));
        }
        Cost { j1_slope, j1_curvature, share: w * share, transient }
    }
}
