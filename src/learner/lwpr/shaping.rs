//! What a field's regression says about its shape.

use super::field::{Findings, RIPE, Regression};
use crate::learner::metric::Cost;

/// Keeps the transient factor from dividing by 0.
const TINY: f64 = 1e-10;

/// How a sample's cost is reckoned.
#[derive(Clone, Copy, Debug)]
pub struct Reckoning {
    /// Whether the second derivative is wanted.
    pub meta: bool,
    /// The least 1 − h. Ours.
    pub min_one_minus_h: Option<f64>,
}

impl Regression {
    /// How the field's shape should change after a sample of the weighted activation `w`, of
    /// which the regression has just found `found`; `None` while too little is known.
    ///
    /// Leaves the memories H and r with the sample in `found`, to be taken over by
    /// [`remember`](Self::remember).
    pub fn judge(&self, w: f64, found: &mut Findings, rules: Reckoning) -> Option<Cost> {
        let first = &self.projections[0];
        if first.ripeness(first.lambda) <= RIPE {
            return None;
        }
        let known = || {
            let all = self.projections.iter().enumerate();
            all.filter(|(_, projection)| projection.ripeness(first.lambda) > RIPE)
        };
        // Σ s²/SSs2, Σ (s/SSs2) H and Σ (s/SSs2)² r.
        let (mut leverage, mut through_slopes, mut through_variances) = (0.0, 0.0, 0.0);
        for (j, projection) in known() {
            let pull = found.s[j] / projection.ss_s2;
            leverage += found.s[j] * pull;
            through_slopes += pull * projection.h;
            through_variances += pull * pull * projection.r;
        }
        let Findings { e, e_cv, .. } = *found;
        let share = 1.0 / first.sum_w;
        let spread = self.last_counting().sum_e_cv2;
        let transient = (self.sum_e2 / (spread + TINY)).powi(4).min(1.0);
        let e_cv2 = e_cv * e_cv;
        let j1_slope =
            (-spread * share + e_cv2 - 2.0 * (e * through_slopes + through_variances)) * share;
        let j1_curvature = if rules.meta {
            (2.0 * (e * e * leverage - e_cv2 * share)
                + spread * share * share
                + 4.0 * e * (share + leverage) * through_slopes)
                * share
        } else {
            0.0
        };

        let room = 1.0 - w * leverage;
        let room = rules.min_one_minus_h.map_or(room, |least| room.max(least));
        let credit = w / room * transient;
        for (memory, projection) in self.projections.iter().enumerate() {
            (found.h[memory], found.r[memory]) = (projection.h, projection.r);
        }
        for (j, projection) in known() {
            let s = found.s[j];
            found.h[j] = projection.lambda * projection.h + credit * s * e_cv;
            found.r[j] = projection.lambda * projection.r + credit * w * e_cv2 * s * s;
        }
        Some(Cost { j1_slope, j1_curvature, share: w * share, transient })
    }

    /// Takes over the memories that [`judge`](Self::judge) left in `found`.
    pub fn remember(&mut self, found: &Findings) {
        let memories = found.h.iter().zip(&found.r);
        for (projection, (&h, &r)) in self.projections.iter_mut().zip(memories) {
            (projection.h, projection.r) = (h, r);
        }
    }
}
