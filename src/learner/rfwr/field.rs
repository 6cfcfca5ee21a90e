//! One receptive field: its local regression and what its shape is learned from.
//!
//! Everything here is computed from the old state into a new one, and the caller keeps the
//! new state only if it is sound: a sample that would overflow leaves no trace.

use serde::{Deserialize, Serialize};

use super::settings::Settings;
use crate::learner::kernel::Activation;
use crate::learner::metric::{Cost, Metric};

/// P beyond this is no knowledge but the outcome of forgetting without new directions.
const WORN_OUT: f64 = 1e100;

/// Keeps the transient factor from dividing by 0.
const TINY: f64 = 1e-10;

/// A field without its centre and metric, which lie with those of the other fields.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// The local linear model.
    pub regression: Regression,
    /// The factor M of the metric and its learning rates.
    pub metric: Metric,
    /// The memory from which the metric is learned.
    pub errors: Errors,
}

/// A local linear model y ≈ Bᵀ(x − x̄) + b₀, fitted by recursive least squares. Matrices are
/// stored row by row; n inputs, m outputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Regression {
    /// Whether the field has seen enough, in enough directions, to speak.
    pub trustworthy: bool,
    /// How many samples it remembers.
    pub n_data: f64,
    /// The forgetting factor λ.
    pub lambda: f64,
    /// The remembered sum of weights.
    pub sum_w: f64,
    /// The weighted mean x̄ (n).
    pub mean: Vec<f64>,
    /// The weighted variance about it (n).
    pub var: Vec<f64>,
    /// The weighted mean of the outputs b₀ (m).
    pub offset: Vec<f64>,
    /// Bᵀ (m × n): the slopes of each output.
    pub slopes: Vec<f64>,
    /// P (n × n): the inverse of the weighted covariance of the inputs.
    pub p: Vec<f64>,
}

/// The memory of a field's errors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Errors {
    /// The remembered sum of `w|e_cv|²`, the errors before learning a sample.
    pub sum_e_cv2: f64,
    /// The remembered sum of w|e|², the errors after it.
    pub sum_e2: f64,
    /// Hᵀ (m × n): how changes of w act on the slopes.
    pub h: Vec<f64>,
    /// R (n × n): how they act on P.
    pub r: Vec<f64>,
}

/// A sample as a field sees it, normalised.
pub struct Sample<'a> {
    /// The inputs (n).
    pub x: &'a [f64],
    /// The outputs (m).
    pub y: &'a [f64],
    /// The field's activation times the sample's weight.
    pub activation: Activation,
}

/// What the regression found about the sample, for the metric: scratch that is overwritten
/// by each field.
#[derive(Clone, Debug)]
pub struct Findings {
    /// x − x̄ (n).
    pub xz: Vec<f64>,
    /// y − b₀ (m).
    pub yz: Vec<f64>,
    /// P (x − x̄) (n).
    pub v: Vec<f64>,
    /// The error before learning the sample (m).
    pub e_cv: Vec<f64>,
    /// The error after it (m).
    pub e: Vec<f64>,
    /// The field's prediction of the sample (m).
    pub y: Vec<f64>,
}

impl Findings {
    /// Room for `inputs` and `outputs`.
    pub fn new(inputs: usize, outputs: usize) -> Self {
        let (in_zeros, out_zeros) = (vec![0.0; inputs], vec![0.0; outputs]);
        Self {
            xz: in_zeros.clone(),
            yz: out_zeros.clone(),
            v: in_zeros,
            e_cv: out_zeros.clone(),
            e: out_zeros.clone(),
            y: out_zeros,
        }
    }
}

impl Field {
    /// A field at its birth: nothing learned but the given offset and metric.
    pub fn new(settings: &Settings, offset: Vec<f64>, metric: Metric) -> Self {
        let (n, m) = (settings.inputs, settings.outputs);
        let mut p = vec![0.0; n * n];
        p.iter_mut().step_by(n + 1).for_each(|diagonal| *diagonal = settings.init_p);
        let regression = Regression {
            trustworthy: false,
            n_data: 0.0,
            lambda: settings.init_lambda,
            sum_w: 0.0,
            mean: vec![0.0; n],
            var: vec![0.0; n],
            offset,
            slopes: vec![0.0; n * m],
            p,
        };
        let errors =
            Errors { sum_e_cv2: 0.0, sum_e2: 0.0, h: vec![0.0; n * m], r: vec![0.0; n * n] };
        Self { regression, metric, errors }
    }

    /// Whether all lengths fit and every number is finite.
    pub fn is_sound(&self, inputs: usize, outputs: usize, entries: usize) -> bool {
        self.regression.is_sound(inputs, outputs)
            && self.metric.is_sound(entries)
            && self.errors.is_sound(inputs, outputs)
    }
}

impl Regression {
    /// The prediction of output `k` at `x`.
    #[inline]
    pub fn predict(&self, k: usize, x: &[f64]) -> f64 {
        let n = x.len();
        let slopes = &self.slopes[k * n..][..n];
        let mean = &self.mean[..n];
        let mut y = 0.0;
        for i in 0..n {
            y += slopes[i] * (x[i] - mean[i]);
        }
        y + self.offset[k]
    }

    /// Whether all lengths fit, every number is finite and λ is one.
    pub fn is_sound(&self, inputs: usize, outputs: usize) -> bool {
        self.mean.len() == inputs
            && self.var.len() == inputs
            && self.offset.len() == outputs
            && self.slopes.len() == inputs * outputs
            && self.p.len() == inputs * inputs
            && 0.0 < self.lambda
            && self.lambda <= 1.0
            && all_finite(&[self.n_data, self.sum_w])
            && [&self.mean, &self.var, &self.offset, &self.slopes, &self.p]
                .into_iter()
                .all(|values| all_finite(values))
    }

    /// The variance inflation factors: how badly the field knows each input direction.
    fn inflation(&self) -> impl Iterator<Item = f64> {
        let n = self.mean.len();
        self.p.iter().step_by(n + 1).zip(&self.var).map(|(p, var)| p * var)
    }

    /// Starts P anew if forgetting has blown it up in a direction that is never seen.
    pub fn mend(&mut self, init_p: f64) {
        if self.p.iter().any(|p| p.abs() > WORN_OUT) {
            let n = self.mean.len();
            self.p.fill(0.0);
            self.p.iter_mut().step_by(n + 1).for_each(|diagonal| *diagonal = init_p);
        }
    }

    /// Learns `sample`, from `self` into `next`, and leaves what it found in `found`.
    pub fn learn(
        &self,
        next: &mut Self,
        sample: &Sample<'_>,
        found: &mut Findings,
        rules: &Settings,
    ) {
        let w = sample.activation.w;
        self.move_means(next, sample, found);
        let n = found.xz.len();
        for (k, e_cv) in found.e_cv.iter_mut().enumerate() {
            *e_cv = found.yz[k] - dot(&self.slopes[k * n..][..n], &found.xz);
        }
        self.shrink_p(next, w, found);
        for k in 0..found.yz.len() {
            let slopes = &mut next.slopes[k * n..][..n];
            for (i, slope) in slopes.iter_mut().enumerate() {
                *slope = self.slopes[k * n + i] + w * found.v[i] * found.e_cv[k];
            }
            let fitted = dot(slopes, &found.xz);
            found.e[k] = found.yz[k] - fitted;
            found.y[k] = fitted + next.offset[k];
        }
        #[expect(clippy::cast_precision_loss, reason = "a few inputs")]
        let enough = rules.min_n_data_factor * n as f64;
        next.trustworthy = self.trustworthy
            || self.n_data > enough && next.inflation().all(|vif| vif < rules.vif_trust);
        next.sum_w = self.lambda * self.sum_w + w;
        next.n_data = self.lambda * self.n_data + 1.0;
        next.lambda =
            rules.tau_lambda * self.lambda + rules.final_lambda * (1.0 - rules.tau_lambda);
    }

    /// The weighted means and variances with the sample, and the sample relative to them.
    fn move_means(&self, next: &mut Self, sample: &Sample<'_>, found: &mut Findings) {
        let w = sample.activation.w;
        let total = self.sum_w * self.lambda + w;
        for (i, x) in sample.x.iter().enumerate() {
            next.mean[i] = (self.sum_w * self.mean[i] * self.lambda + w * x) / total;
            let xz = x - next.mean[i];
            next.var[i] = (self.sum_w * self.var[i] * self.lambda + w * xz * xz) / total;
            found.xz[i] = xz;
        }
        for (k, y) in sample.y.iter().enumerate() {
            next.offset[k] = (self.sum_w * self.offset[k] * self.lambda + w * y) / total;
            found.yz[k] = y - next.offset[k];
        }
    }

    /// P ← (P − P x xᵀP / (λ/w + xᵀP x)) / λ, and v = P x with the new P.
    fn shrink_p(&self, next: &mut Self, w: f64, found: &mut Findings) {
        let n = found.xz.len();
        let Findings { xz, v, .. } = found;
        for (v, row) in v.iter_mut().zip(self.p.chunks_exact(n)) {
            *v = dot(row, xz);
        }
        let gain = self.lambda / w + dot(v, xz);
        for a in 0..n {
            for b in a..n {
                let p = (self.p[a * n + b] - v[a] * v[b] / gain) / self.lambda;
                next.p[a * n + b] = p;
                next.p[b * n + a] = p;
            }
        }
        for (v, row) in v.iter_mut().zip(next.p.chunks_exact(n)) {
            *v = dot(row, xz);
        }
    }
}

impl Errors {
    /// Whether all lengths fit and every number is finite.
    pub fn is_sound(&self, inputs: usize, outputs: usize) -> bool {
        self.h.len() == inputs * outputs
            && self.r.len() == inputs * inputs
            && all_finite(&[self.sum_e_cv2, self.sum_e2])
            && all_finite(&self.h)
            && all_finite(&self.r)
    }

    /// Learns from what the regression found, from `self` into `next`, and says how the
    /// field's shape should change; `None` while too little is known in every direction.
    ///
    /// `before` and `after` are the regression without and with the sample.
    pub fn learn(
        &self,
        next: &mut Self,
        (before, after): (&Regression, &Regression),
        (activation, found): (Activation, &Findings),
        rules: &Settings,
    ) -> Option<Cost> {
        if after.inflation().all(|vif| vif > rules.vif_update) {
            return None;
        }
        let Findings { xz, v, e_cv, e, .. } = found;
        let n = xz.len();
        let (w, lambda, total) = (activation.w, before.lambda, after.sum_w);
        let (e_cv2, e2) = (dot(e_cv, e_cv), dot(e, e));
        next.sum_e_cv2 = lambda * self.sum_e_cv2 + w * e_cv2;
        next.sum_e2 = lambda * self.sum_e2 + w * e2;
        let spread = next.sum_e_cv2;
        let transient = (next.sum_e2 / (spread + TINY)).powi(4);
        let h = w * dot(v, xz);

        // Σ (v eᵀ)∘H, and v R vᵀ.
        let mut through_slopes = 0.0;
        for (e, h) in e.iter().zip(self.h.chunks_exact(n)) {
            through_slopes += e * dot(v, h);
        }
        let mut through_p = 0.0;
        for (v_a, r) in v.iter().zip(self.r.chunks_exact(n)) {
            through_p += v_a * dot(r, v);
        }
        let j1_slope =
            -spread / (total * total) + (e_cv2 - 2.0 * through_slopes - 2.0 * through_p) / total;
        let j1_curvature = if rules.meta {
            let x_v = dot(xz, v);
            // Σ (−v eᵀ/W − 2 v (xᵀv eᵀ))∘H
            let bent = -through_slopes / total - 2.0 * x_v * through_slopes;
            -e_cv2 / (total * total) - 2.0 / total * bent + 2.0 * e2 * h / (total * w)
                - (e_cv2 - 2.0 * through_slopes) / (total * total)
                + 2.0 * spread / (total * total * total)
        } else {
            0.0
        };

        let room = rules.min_one_minus_h.map_or(1.0 - h, |least| (1.0 - h).max(least));
        for (k, e_cv) in e_cv.iter().enumerate() {
            let gain = w / room * transient * e_cv;
            for (i, xz) in xz.iter().enumerate() {
                next.h[k * n + i] = lambda * self.h[k * n + i] + gain * xz;
            }
        }
        let gain = w * w * e_cv2 / room * transient;
        for a in 0..n {
            for b in 0..n {
                next.r[a * n + b] = lambda * self.r[a * n + b] + gain * xz[a] * xz[b];
            }
        }
        #[expect(clippy::cast_precision_loss, reason = "a few outputs")]
        let outputs = e_cv.len() as f64;
        Some(Cost {
            j1_slope: j1_slope / outputs,
            j1_curvature: j1_curvature / outputs,
            share: w / total,
            transient,
        })
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a.iter().zip(b) {
        sum += a * b;
    }
    sum
}

fn all_finite(values: &[f64]) -> bool {
    // Without an early exit the check is cheap: the compiler compares several at a time.
    values.iter().fold(true, |all, value| all & value.is_finite())
}
