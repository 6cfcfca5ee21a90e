//! The local regressions of eight fields learn a sample, or predict.

use fearless_simd::prelude::*;

use super::field::{LAMBDA, N_DATA, RegressionRows, SUM_W, Size, TRUSTWORTHY};
use super::settings::Settings;
use crate::learner::lanes::{Lanes, Mask, Row, all, dot, fused, multiply, without};
use crate::learner::shapes::entry;

/// What the regressions found about a sample, for the errors: rows that each
/// eight fields overwrite.
#[derive(Clone, Debug)]
pub struct Findings {
    /// x − x̄ (n).
    pub xz: Vec<Row>,
    /// P (x − x̄) (n).
    pub v: Vec<Row>,
    /// The errors before learning the sample (m).
    pub e_cv: Vec<Row>,
    /// The errors after it (m).
    pub e: Vec<Row>,
    /// The fields' predictions of the sample (m).
    pub y: Vec<Row>,
}

/// A normalised sample and the activations of eight fields times its weight.
#[derive(Clone, Copy)]
pub struct Given<'a, S: Simd> {
    /// The inputs (n).
    pub x: &'a [f64],
    /// The outputs (m).
    pub y: &'a [f64],
    /// The weighted activations.
    pub w: Lanes<S>,
}

type Old<'a> = RegressionRows<&'a [Row]>;
type Next<'a> = RegressionRows<&'a mut [Row]>;

impl Findings {
    /// Room for the findings of this size.
    pub fn new(size: Size) -> Self {
        let room = |count| vec![Row::ZERO; count];
        let Size { inputs: n, outputs: m, .. } = size;
        Self { xz: room(n), v: room(n), e_cv: room(m), e: room(m), y: room(m) }
    }
}

impl Old<'_> {
    /// Where fields may speak.
    #[inline(always)]
    pub fn trustworthy<S: Simd>(&self, simd: S) -> Mask<S> {
        self.scalars[TRUSTWORTHY].get(simd).simd_gt(0.0)
    }
}

/// What linear models with these means, offsets and slopes say at `x`.
#[inline(always)]
pub fn predict<S: Simd>(
    simd: S,
    mean: &[Row],
    (offset, slopes): (&[Row], &[Row]),
    x: &[f64],
) -> Lanes<S> {
    let mut y = offset[0].get(simd);
    for ((slope, mean), &x) in slopes.iter().zip(mean).zip(x) {
        y = fused(slope.get(simd), all(simd, x) - mean.get(simd), y);
    }
    y
}

impl<T: AsRef<[Row]>> RegressionRows<T> {
    /// The smallest and the largest of the variance inflation factors, which tell how badly a
    /// field knows each input direction.
    #[inline(always)]
    pub fn inflation<S: Simd>(&self, simd: S) -> (Lanes<S>, Lanes<S>) {
        let (var, p) = (self.var.as_ref(), self.p.as_ref());
        let n = var.len();
        let (mut least, mut most) = (all(simd, f64::INFINITY), all(simd, 0.0));
        for (a, var) in var.iter().enumerate() {
            let here = p[entry(n, a, a)].get(simd) * var.get(simd);
            (least, most) = (least.min(here), most.max(here));
        }
        (least, most)
    }
}

impl Next<'_> {
    /// Becomes what comes after the `old` regressions and the sample. What was found on the
    /// way is left in `found`.
    #[inline(always)]
    pub fn learn<S: Simd>(
        &mut self,
        simd: S,
        size: Size,
        old: &Old<'_>,
        given: Given<'_, S>,
        (found, rules): (&mut Findings, &Settings),
    ) {
        let n = size.inputs;
        let lambda = old.scalars[LAMBDA].get(simd);
        let (past, now) = self.move_means(simd, old, given, found);
        let w = given.w;
        self.shrink_p(simd, old.p, (lambda, w), found);
        let stride = size.output();
        let models = self.outputs.chunks_exact_mut(stride).zip(old.outputs.chunks_exact(stride));
        for (k, ((after, before), &y)) in models.zip(given.y).enumerate() {
            let (old_offset, before) = size.cut_output(before);
            let (offset, after) = size.cut_output(after);
            let mean_y = past * old_offset[0].get(simd) + now * all(simd, y);
            offset[0].set(mean_y);
            let yz = all(simd, y) - mean_y;
            let e_cv = yz - dot(simd, before, &found.xz);
            let gain = w * e_cv;
            let mut fitted = all(simd, 0.0);
            for (((after, before), v), xz) in
                after.iter_mut().zip(before).zip(&found.v).zip(&found.xz)
            {
                let slope = fused(gain, v.get(simd), before.get(simd));
                after.set(slope);
                fitted = fused(slope, xz.get(simd), fitted);
            }
            found.e_cv[k].set(e_cv);
            found.e[k].set(yz - fitted);
            found.y[k].set(fitted + mean_y);
        }
        #[expect(clippy::cast_precision_loss, reason = "at most 64 inputs")]
        let enough = rules.min_n_data_factor * n as f64;
        let n_data = old.scalars[N_DATA].get(simd);
        let known = self.inflation(simd).1.simd_lt(rules.vif_trust);
        let trustworthy = old.trustworthy(simd) | n_data.simd_gt(enough) & known;
        let tau = rules.tau_lambda;
        self.scalars[TRUSTWORTHY].set(trustworthy.select(all(simd, 1.0), all(simd, 0.0)));
        self.scalars[N_DATA].set(lambda * n_data + 1.0);
        self.scalars[LAMBDA].set(lambda * tau + rules.final_lambda * (1.0 - tau));
    }

    /// The weighted means and variances with the sample, and the sample relative to them.
    /// Returns the shares of the past and of the sample.
    #[inline(always)]
    fn move_means<S: Simd>(
        &mut self,
        simd: S,
        old: &Old<'_>,
        given: Given<'_, S>,
        found: &mut Findings,
    ) -> (Lanes<S>, Lanes<S>) {
        let remembered = old.scalars[LAMBDA].get(simd) * old.scalars[SUM_W].get(simd);
        let sum_w = remembered + given.w;
        self.scalars[SUM_W].set(sum_w);
        let (past, now) = (remembered / sum_w, given.w / sum_w);
        let before = old.mean.iter().zip(old.var);
        let after = self.mean.iter_mut().zip(&mut *self.var);
        for ((before, after), (xz, &x)) in before.zip(after).zip(found.xz.iter_mut().zip(given.x)) {
            let x = all(simd, x);
            let mean = fused(past, before.0.get(simd), now * x);
            let z = x - mean;
            after.0.set(mean);
            after.1.set(fused(past, before.1.get(simd), now * (z * z)));
            xz.set(z);
        }
        (past, now)
    }

    /// P ← (P − P x xᵀP / (λ/w + xᵀP x)) / λ, and v = P x / (λ + w xᵀP x), which is P x with
    /// the new P.
    #[inline(always)]
    fn shrink_p<S: Simd>(
        &mut self,
        simd: S,
        old: &[Row],
        (lambda, w): (Lanes<S>, Lanes<S>),
        found: &mut Findings,
    ) {
        let v_x = multiply(simd, &mut found.v, old, &found.xz);
        // v with the new P, by what the equation above says of P x.
        let known = all(simd, 1.0) / (lambda + w * v_x);
        let gain = w * known;
        let growth = all(simd, 1.0) / lambda;
        let n = found.v.len();
        let (mut old, mut new) = (old, &mut *self.p);
        for a in 0..n {
            let ((row, rest), (next, next_rest)) = (old.split_at(n - a), new.split_at_mut(n - a));
            (old, new) = (rest, next_rest);
            let pull = found.v[a].get(simd) * gain;
            for ((next, p), v) in next.iter_mut().zip(row).zip(&found.v[a..]) {
                next.set(without(p.get(simd), pull, v.get(simd)) * growth);
            }
        }
        for v in &mut found.v {
            v.set(v.get(simd) * known);
        }
    }
}
