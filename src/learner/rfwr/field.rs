//! One receptive field: its local regression and what its shape is learned from.
//!
//! Everything here is computed from the old state into a new one, and the caller keeps the
//! new state only if it is sound: a sample that would overflow leaves no trace.

use serde::{Deserialize, Serialize};

use super::settings::Settings;
use crate::learner::all_finite;
use crate::learner::kernel::Activation;
use crate::learner::metric::{Cost, Metric};
use crate::learner::settings::{MAX_INPUTS, MAX_OUTPUTS};
use crate::learner::shapes::Size;

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

/// What the regression found about the sample, for the metric: room on the stack that each
/// field overwrites, so that the compiler knows it apart from the fields.
#[derive(Clone, Copy, Debug)]
pub struct Findings {
    /// x − x̄ (n).
    pub xz: [f64; MAX_INPUTS],
    /// P (x − x̄) (n).
    pub v: [f64; MAX_INPUTS],
    /// y − b₀ (m).
    pub yz: [f64; MAX_OUTPUTS],
    /// The error before learning the sample (m).
    pub e_cv: [f64; MAX_OUTPUTS],
    /// The error after it (m).
    pub e: [f64; MAX_OUTPUTS],
    /// The field's prediction of the sample (m).
    pub y: [f64; MAX_OUTPUTS],
}

impl Findings {
    /// Nothing yet.
    pub const NONE: Self = Self {
        xz: [0.0; MAX_INPUTS],
        v: [0.0; MAX_INPUTS],
        yz: [0.0; MAX_OUTPUTS],
        e_cv: [0.0; MAX_OUTPUTS],
        e: [0.0; MAX_OUTPUTS],
        y: [0.0; MAX_OUTPUTS],
    };
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
    pub fn is_sound(&self, size: Size) -> bool {
        self.regression.is_sound(size)
            && self.metric.is_sound(size.entries)
            && self.errors.is_sound(size)
    }
}

impl Regression {
    /// The prediction of output `k` at `x`.
    #[inline(always)]
    pub fn predict(&self, size: Size, k: usize, x: &[f64]) -> f64 {
        let n = size.inputs;
        let (slopes, mean, x) = (&self.slopes[k * n..][..n], &self.mean[..n], &x[..n]);
        let mut y = 0.0;
        for i in 0..n {
            y += slopes[i] * (x[i] - mean[i]);
        }
        y + self.offset[k]
    }

    /// Whether all lengths fit, every number is finite and λ is one.
    #[inline(always)]
    pub fn is_sound(&self, size: Size) -> bool {
        let Size { inputs, outputs, .. } = size;
        self.mean.len() == inputs
            && self.var.len() == inputs
            && self.offset.len() == outputs
            && self.slopes.len() == inputs * outputs
            && self.p.len() == inputs * inputs
            && 0.0 < self.lambda
            && self.lambda <= 1.0
            && all_finite(&[self.n_data, self.sum_w])
            && all_finite(&self.mean[..inputs])
            && all_finite(&self.var[..inputs])
            && all_finite(&self.offset[..outputs])
            && all_finite(&self.slopes[..inputs * outputs])
            && all_finite(&self.p[..inputs * inputs])
    }

    /// Whether all variance inflation factors, which tell how badly the field knows each
    /// input direction, pass the `test`.
    #[inline(always)]
    fn inflation(&self, n: usize, test: impl Fn(f64) -> bool) -> bool {
        let (p, var) = (&self.p[..n * n], &self.var[..n]);
        let mut all = true;
        for i in 0..n {
            all &= test(p[i * (n + 1)] * var[i]);
        }
        all
    }

    /// Starts P anew if forgetting has blown it up in a direction that is never seen.
    pub fn mend(&mut self, init_p: f64) {
        if self.p.iter().any(|p| p.abs() > WORN_OUT) {
            let n = self.mean.len();
            self.p.fill(0.0);
            self.p.iter_mut().step_by(n + 1).for_each(|diagonal| *diagonal = init_p);
        }
    }

    /// Becomes equal to `other`, without moving.
    #[inline(always)]
    pub fn copy(&mut self, other: &Self, size: Size) {
        let Size { inputs: n, outputs: m, .. } = size;
        self.trustworthy = other.trustworthy;
        self.n_data = other.n_data;
        self.lambda = other.lambda;
        self.sum_w = other.sum_w;
        self.mean[..n].copy_from_slice(&other.mean[..n]);
        self.var[..n].copy_from_slice(&other.var[..n]);
        self.offset[..m].copy_from_slice(&other.offset[..m]);
        self.slopes[..n * m].copy_from_slice(&other.slopes[..n * m]);
        self.p[..n * n].copy_from_slice(&other.p[..n * n]);
    }

    /// Learns `sample`, and leaves what it found in `found`.
    #[inline(always)]
    pub fn learn(
        &mut self,
        sample: &Sample<'_>,
        (size, found): (Size, &mut Findings),
        rules: &Settings,
    ) {
        let w = sample.activation.w;
        let Size { inputs: n, outputs: m, .. } = size;
        self.move_means(sample, size, found);
        let Findings { xz, v, yz, e_cv, e, y } = found;
        let (xz, v) = (&xz[..n], &mut v[..n]);
        self.shrink_p(w, xz, v);
        for k in 0..m {
            let slopes = &mut self.slopes[k * n..][..n];
            e_cv[k] = yz[k] - dot(slopes, xz);
            add(slopes, w * e_cv[k], v);
            let fitted = dot(slopes, xz);
            e[k] = yz[k] - fitted;
            y[k] = fitted + self.offset[k];
        }
        #[expect(clippy::cast_precision_loss, reason = "a few inputs")]
        let enough = rules.min_n_data_factor * n as f64;
        self.trustworthy = self.trustworthy
            || self.n_data > enough && self.inflation(n, |vif| vif < rules.vif_trust);
        self.n_data = self.lambda * self.n_data + 1.0;
        self.lambda =
            rules.tau_lambda * self.lambda + rules.final_lambda * (1.0 - rules.tau_lambda);
    }

    /// The weighted means and variances with the sample, and the sample relative to them.
    #[inline(always)]
    fn move_means(&mut self, sample: &Sample<'_>, size: Size, found: &mut Findings) {
        let Size { inputs: n, outputs: m, .. } = size;
        let w = sample.activation.w;
        let remembered = self.lambda * self.sum_w;
        self.sum_w = remembered + w;
        // The shares of the past and of the sample.
        let (past, now) = (remembered / self.sum_w, w / self.sum_w);
        let (x, xz) = (&sample.x[..n], &mut found.xz[..n]);
        let (mean, var) = (&mut self.mean[..n], &mut self.var[..n]);
        for i in 0..n {
            mean[i] = past * mean[i] + now * x[i];
            xz[i] = x[i] - mean[i];
        }
        for i in 0..n {
            var[i] = past * var[i] + now * (xz[i] * xz[i]);
        }
        let (y, yz, offset) = (&sample.y[..m], &mut found.yz[..m], &mut self.offset[..m]);
        for k in 0..m {
            offset[k] = past * offset[k] + now * y[k];
            yz[k] = y[k] - offset[k];
        }
    }

    /// P ← (P − P x xᵀP / (λ/w + xᵀP x)) / λ, and v = P x with the new P.
    #[inline(always)]
    fn shrink_p(&mut self, w: f64, xz: &[f64], v: &mut [f64]) {
        let n = xz.len();
        let p = &mut self.p[..n * n];
        multiply(v, p, xz);
        let gain = 1.0 / (self.lambda / w + dot(v, xz));
        let growth = 1.0 / self.lambda;
        for (a, row) in p.chunks_exact_mut(n).enumerate() {
            for b in 0..n {
                row[b] = (row[b] - v[a] * v[b] * gain) * growth;
            }
        }
        multiply(v, p, xz);
    }
}

impl Errors {
    /// Whether all lengths fit and every number is finite.
    #[inline(always)]
    pub fn is_sound(&self, size: Size) -> bool {
        let Size { inputs, outputs, .. } = size;
        self.h.len() == inputs * outputs
            && self.r.len() == inputs * inputs
            && all_finite(&[self.sum_e_cv2, self.sum_e2])
            && all_finite(&self.h[..inputs * outputs])
            && all_finite(&self.r[..inputs * inputs])
    }

    /// Becomes equal to `other`, without moving.
    #[inline(always)]
    pub fn copy(&mut self, other: &Self, size: Size) {
        let Size { inputs: n, outputs: m, .. } = size;
        self.sum_e_cv2 = other.sum_e_cv2;
        self.sum_e2 = other.sum_e2;
        self.h[..n * m].copy_from_slice(&other.h[..n * m]);
        self.r[..n * n].copy_from_slice(&other.r[..n * n]);
    }

    /// Learns from what the regression found, and says how the field's shape should change;
    /// `None`, and nothing is learned, while too little is known in every direction.
    ///
    /// `lambda` is the forgetting factor before, `after` the regression with the sample.
    #[inline(always)]
    pub fn learn(
        &mut self,
        (lambda, after): (f64, &Regression),
        (activation, size, found): (Activation, Size, &Findings),
        rules: &Settings,
    ) -> Option<Cost> {
        let Size { inputs: n, outputs: m, .. } = size;
        if after.inflation(n, |vif| vif > rules.vif_update) {
            return None;
        }
        let (xz, v) = (&found.xz[..n], &found.v[..n]);
        let (e_cv, e) = (&found.e_cv[..m], &found.e[..m]);
        let (h, r) = (&mut self.h[..n * m], &mut self.r[..n * n]);
        let (w, total) = (activation.w, after.sum_w);
        let (e_cv2, e2) = (dot(e_cv, e_cv), dot(e, e));
        self.sum_e_cv2 = lambda * self.sum_e_cv2 + w * e_cv2;
        self.sum_e2 = lambda * self.sum_e2 + w * e2;
        let spread = self.sum_e_cv2;
        let transient = (self.sum_e2 / (spread + TINY)).powi(4);
        let x_v = dot(xz, v);

        // Σ (v eᵀ)∘H, and v R vᵀ.
        let mut through_slopes = 0.0;
        for k in 0..m {
            through_slopes += e[k] * dot(v, &h[k * n..][..n]);
        }
        let mut through_p = 0.0;
        for (a, row) in r.chunks_exact(n).enumerate() {
            through_p += v[a] * dot(row, v);
        }
        let share = 1.0 / total;
        let mean_spread = spread * share * share;
        let j1_slope = (e_cv2 - 2.0 * through_slopes - 2.0 * through_p) * share - mean_spread;
        let j1_curvature = if rules.meta {
            // Σ (−v eᵀ/W − 2 v (xᵀv eᵀ))∘H
            let bent = -through_slopes * share - 2.0 * x_v * through_slopes;
            -e_cv2 * share * share - 2.0 * share * bent + 2.0 * e2 * x_v * share
                - (e_cv2 - 2.0 * through_slopes) * share * share
                + 2.0 * mean_spread * share
        } else {
            0.0
        };

        let room = 1.0 - w * x_v;
        let room = rules.min_one_minus_h.map_or(room, |least| room.max(least));
        let credit = w / room * transient;
        for k in 0..m {
            let gain = credit * e_cv[k];
            for (i, h) in h[k * n..][..n].iter_mut().enumerate() {
                *h = lambda * *h + gain * xz[i];
            }
        }
        let gain = w * e_cv2 * credit;
        for (a, row) in r.chunks_exact_mut(n).enumerate() {
            let gain = gain * xz[a];
            for b in 0..n {
                row[b] = lambda * row[b] + gain * xz[b];
            }
        }
        #[expect(clippy::cast_precision_loss, reason = "a few outputs")]
        let outputs = m as f64;
        Some(Cost {
            j1_slope: j1_slope / outputs,
            j1_curvature: j1_curvature / outputs,
            share: w * share,
            transient,
        })
    }
}

#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a.iter().zip(b) {
        sum += a * b;
    }
    sum
}

/// A symmetric matrix times `x`: column by column, so that all sums grow side by side.
#[inline(always)]
fn multiply(into: &mut [f64], symmetric: &[f64], x: &[f64]) {
    into.fill(0.0);
    for (column, &x) in symmetric.chunks_exact(x.len()).zip(x) {
        add(into, x, column);
    }
}

/// Adds `factor` times `values`.
#[inline(always)]
fn add(to: &mut [f64], factor: f64, values: &[f64]) {
    for (to, value) in to.iter_mut().zip(values) {
        *to += factor * value;
    }
}
