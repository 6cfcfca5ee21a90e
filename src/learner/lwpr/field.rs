//! One receptive field: its local regression, one projection after the other.
//!
//! Everything here is computed in a copy of the state, which the caller keeps only if it is
//! sound: a sample that would overflow leaves no trace.

use serde::{Deserialize, Serialize};

use super::settings::Settings;
use crate::learner::all_finite;
use crate::learner::metric::Metric;
use crate::learner::settings::MAX_INPUTS;

/// What sums that are divided by start with.
const NEARLY_NOTHING: f64 = 1e-10;
/// The direction of a projection turns only to a vector whose square is larger than this.
const LEAST_SQUARE: f64 = 1e-24;
/// What [`Projection::ripeness`] must exceed for errors to be counted and shapes learned.
pub(super) const RIPE: f64 = 0.1;
/// The same for a projection before the next one is added.
const RIPE_FOR_NEXT: f64 = 0.5;
/// A projection has seen as much as the first one when its count is this share of it.
const AS_MUCH: f64 = 0.99;

/// A field without its centre and metric, which lie with those of the other fields.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// The local linear model.
    pub regression: Regression,
    /// The factor M of the metric and its learning rates.
    pub metric: Metric,
}

/// A local linear model, fitted by incremental partial least squares: y ≈ β₀ + Σ βⱼ sⱼ with
/// `sⱼ = Uⱼ·xⱼ`, `x₁ = x − x̄` and `xⱼ₊₁ = xⱼ − Pⱼ sⱼ`. The vectors of its R projections are
/// stored one after the other, n numbers each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Regression {
    /// Whether the field has seen enough to speak.
    pub trustworthy: bool,
    /// The weighted mean of the outputs β₀.
    pub offset: f64,
    /// The weighted mean x̄ (n).
    pub mean: Vec<f64>,
    /// The weighted variance about it (n).
    pub var: Vec<f64>,
    /// The remembered sum of we², the errors after learning a sample.
    pub sum_e2: f64,
    /// The remembered sum of `w² Σ sⱼ²/SSs2ⱼ`, what the fit has cost in degrees of freedom.
    pub ss_p: f64,
    /// The projections (R).
    pub projections: Vec<Projection>,
    /// The directions U (R × n), of length 1.
    pub u: Vec<f64>,
    /// P (R × n): what of the inputs each projection accounts for.
    pub p: Vec<f64>,
    /// The remembered sums of w s x (R × n).
    pub ss_x_res: Vec<f64>,
    /// The remembered sums of w x y (R × n), along which U points.
    pub s_x_res_y_res: Vec<f64>,
}

/// The numbers of one projection.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Projection {
    /// How many samples it remembers.
    pub n_data: f64,
    /// The forgetting factor λ.
    pub lambda: f64,
    /// The remembered sum of weights.
    pub sum_w: f64,
    /// The remembered sum of `w e_cv²`, the errors before learning a sample, of this
    /// projection and those before it.
    pub sum_e_cv2: f64,
    /// The remembered sum of ws².
    pub ss_s2: f64,
    /// The remembered sum of wsy.
    pub ss_y_res: f64,
    /// The slope β.
    pub beta: f64,
    /// H: how changes of w act on the slope.
    pub h: f64,
    /// r: how they act on the variance.
    pub r: f64,
}

/// A sample as a field sees it, normalised.
pub struct Sample<'a> {
    /// The inputs (n).
    pub x: &'a [f64],
    /// The output.
    pub y: f64,
    /// The field's activation times the sample's weight.
    pub w: f64,
}

/// What the regression found about the sample, for the metric; each field overwrites it.
#[derive(Clone, Debug)]
pub struct Findings {
    /// x₁ to `x_R` (R × n of n × n).
    residuals: Vec<f64>,
    /// s, in the end with the new U and P (R of n).
    pub s: Vec<f64>,
    /// The errors before learning, of projections 1 to j together (R of n).
    e_cvs: Vec<f64>,
    /// H after the sample (R of n), not yet taken over,
    pub h: Vec<f64>,
    /// and r.
    pub r: Vec<f64>,
    /// y − β₀.
    yz: f64,
    /// The error before learning, of the projections that count.
    pub e_cv: f64,
    /// Their error after it.
    pub e: f64,
    /// The field's prediction of the sample.
    pub y: f64,
}

/// What a field says about an input.
#[derive(Clone, Copy, Debug)]
pub struct Opinion {
    /// The output, normalised.
    pub y: f64,
    /// Its variance.
    pub variance: f64,
}

impl Findings {
    /// Room for `n` inputs.
    pub fn new(n: usize) -> Self {
        let room = || vec![0.0; n];
        Self {
            residuals: vec![0.0; n * n],
            s: room(),
            e_cvs: room(),
            h: room(),
            r: room(),
            yz: 0.0,
            e_cv: 0.0,
            e: 0.0,
            y: 0.0,
        }
    }
}

impl Projection {
    fn new(n_data: f64, settings: &Settings) -> Self {
        Self {
            n_data,
            lambda: settings.init_lambda,
            sum_w: NEARLY_NOTHING,
            sum_e_cv2: 0.0,
            ss_s2: settings.init_s2,
            ss_y_res: 0.0,
            beta: 0.0,
            h: 0.0,
            r: 0.0,
        }
    }

    /// How far the count has come, where 1 is as far as a forgetting factor lets it come.
    pub(super) fn ripeness(&self, lambda: f64) -> f64 {
        self.n_data * (1.0 - lambda)
    }

    /// The mean squared error before learning.
    fn mean_e_cv2(&self) -> f64 {
        self.sum_e_cv2 / self.sum_w + NEARLY_NOTHING
    }

    fn is_sound(&self) -> bool {
        let Self { n_data, lambda, sum_w, sum_e_cv2, ss_s2, ss_y_res, beta, h, r } = *self;
        0.0 < lambda
            && lambda <= 1.0
            && all_finite(&[n_data, sum_w, sum_e_cv2, ss_s2, ss_y_res, beta, h, r])
    }
}

impl Regression {
    /// A field's regression at its birth, with `projections` along the axes.
    pub fn new(settings: &Settings, offset: f64, projections: usize) -> Self {
        let n = settings.inputs;
        let mut blank = Self {
            trustworthy: false,
            offset,
            mean: vec![0.0; n],
            var: vec![0.0; n],
            sum_e2: 0.0,
            ss_p: 0.0,
            projections: Vec::new(),
            u: Vec::new(),
            p: Vec::new(),
            ss_x_res: Vec::new(),
            s_x_res_y_res: Vec::new(),
        };
        for _ in 0..projections {
            blank.push(Projection::new(NEARLY_NOTHING, settings));
        }
        blank
    }

    /// Appends a projection along the next axis.
    fn push(&mut self, projection: Projection) {
        let (n, axis) = (self.mean.len(), self.projections.len());
        self.projections.push(projection);
        for along in [&mut self.u, &mut self.p] {
            along.extend((0..n).map(|i| if i == axis { 1.0 } else { 0.0 }));
        }
        for sums in [&mut self.ss_x_res, &mut self.s_x_res_y_res] {
            sums.resize((axis + 1) * n, 0.0);
        }
    }

    /// Becomes equal to `other`, in place where there is room.
    pub fn copy(&mut self, other: &Self) {
        self.trustworthy = other.trustworthy;
        self.offset = other.offset;
        self.mean.clone_from(&other.mean);
        self.var.clone_from(&other.var);
        self.sum_e2 = other.sum_e2;
        self.ss_p = other.ss_p;
        self.projections.clone_from(&other.projections);
        self.u.clone_from(&other.u);
        self.p.clone_from(&other.p);
        self.ss_x_res.clone_from(&other.ss_x_res);
        self.s_x_res_y_res.clone_from(&other.s_x_res_y_res);
    }

    /// Whether all lengths fit `n` inputs, every number is finite and every λ is one.
    pub fn is_sound(&self, n: usize) -> bool {
        let count = self.projections.len();
        let fits = |values: &[f64], length| values.len() == length && all_finite(values);
        (1..=n).contains(&count)
            && all_finite(&[self.offset, self.sum_e2, self.ss_p])
            && fits(&self.mean, n)
            && fits(&self.var, n)
            && fits(&self.u, count * n)
            && fits(&self.p, count * n)
            && fits(&self.ss_x_res, count * n)
            && fits(&self.s_x_res_y_res, count * n)
            && self.projections.iter().all(Projection::is_sound)
    }

    /// How many projections count in predictions: the last one only if it has seen enough.
    fn counting(&self) -> usize {
        let enough = self.twice_inputs();
        let last_counts = self.projections.last().is_some_and(|last| last.n_data > enough);
        if last_counts { self.projections.len() } else { self.projections.len() - 1 }
    }

    /// The last projection that counts; the first in any case.
    pub(super) fn last_counting(&self) -> &Projection {
        &self.projections[self.counting().max(1) - 1]
    }

    fn twice_inputs(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "at most 64 inputs")]
        let inputs = self.mean.len() as f64;
        2.0 * inputs
    }

    /// The prediction at `x`, normalised.
    pub fn predict(&self, x: &[f64]) -> f64 {
        self.opinion(x, 0.0).y
    }

    /// The prediction at `x`, where the field's activation is `w`, and its variance.
    pub fn opinion(&self, x: &[f64], w: f64) -> Opinion {
        let n = self.mean.len();
        let mut room = [0.0; MAX_INPUTS];
        let residual = &mut room[..n];
        for ((residual, x), mean) in residual.iter_mut().zip(x).zip(&self.mean) {
            *residual = x - mean;
        }
        let (mut y, mut leverage) = (self.offset, 0.0);
        let vectors = self.u.chunks_exact(n).zip(self.p.chunks_exact(n));
        for (projection, (u, p)) in self.projections[..self.counting()].iter().zip(vectors) {
            let s = dot(u, residual);
            y += projection.beta * s;
            leverage += s * s / projection.ss_s2;
            add(residual, -s, p);
        }
        let last = self.last_counting();
        let noise = last.sum_e_cv2 / (last.sum_w - self.ss_p);
        Opinion { y, variance: noise * (1.0 + w * leverage) }
    }

    /// Learns `sample`, and leaves what it found in `found`.
    pub fn learn(&mut self, sample: &Sample<'_>, found: &mut Findings) {
        let n = sample.x.len();
        self.move_means(sample, found);
        self.project(found);
        let forgetting = self.projections.last().map_or(1.0, |last| last.lambda);
        let (mut cost, mut fitted, mut target) = (0.0, 0.0, found.yz);
        for (j, projection) in self.projections.iter_mut().enumerate() {
            let (s, at) = (found.s[j], j * n..(j + 1) * n);
            let x = &found.residuals[at.clone()];
            fitted += projection.beta * s;
            let (w, lambda) = (sample.w, projection.lambda);
            turn(
                &mut self.u[at.clone()],
                &mut self.s_x_res_y_res[at.clone()],
                (0.9 + 0.1 * lambda, w * target, x),
            );
            projection.sum_w = lambda * projection.sum_w + w;
            projection.ss_s2 = lambda * projection.ss_s2 + w * s * s;
            projection.ss_y_res = lambda * projection.ss_y_res + w * s * target;
            projection.beta = projection.ss_y_res / projection.ss_s2;
            let sums = &mut self.ss_x_res[at.clone()];
            for ((sum, p), x) in sums.iter_mut().zip(&mut self.p[at]).zip(x) {
                *sum = lambda * *sum + w * s * x;
                *p = *sum / projection.ss_s2;
            }
            cost += w * w * s * s / projection.ss_s2;
            target = found.yz - fitted;
            found.e_cvs[j] = target;
        }
        self.ss_p = forgetting * self.ss_p + cost;
        self.note_errors(sample.w, forgetting, found);
    }

    /// The weighted means and variances with the sample, and the sample relative to them.
    fn move_means(&mut self, sample: &Sample<'_>, found: &mut Findings) {
        let first = &self.projections[0];
        let remembered = first.lambda * first.sum_w;
        let all = 1.0 / (remembered + sample.w);
        let blend = |old: f64, new: f64| (remembered * old + sample.w * new) * all;
        let state = self.mean.iter_mut().zip(&mut self.var);
        for (((mean, var), xz), x) in state.zip(&mut found.residuals).zip(sample.x) {
            *mean = blend(*mean, *x);
            *xz = x - *mean;
            *var = blend(*var, *xz * *xz);
        }
        self.offset = blend(self.offset, sample.y);
        found.yz = sample.y - self.offset;
    }

    /// Splits x₁ into projections s and residuals.
    fn project(&self, found: &mut Findings) {
        let n = self.mean.len();
        let vectors = self.u.chunks_exact(n).zip(self.p.chunks_exact(n));
        for (j, (u, p)) in vectors.enumerate() {
            let (before, after) = found.residuals.split_at_mut((j + 1) * n);
            let x = &before[j * n..];
            let s = dot(u, x);
            found.s[j] = s;
            for ((next, x), p) in after.iter_mut().zip(x).zip(p) {
                *next = x - p * s;
            }
        }
    }

    /// Notes how far off the fit was before and is after the sample.
    fn note_errors(&mut self, w: f64, forgetting: f64, found: &mut Findings) {
        self.project(found);
        let counting = self.counting();
        let mut fitted = 0.0;
        for (projection, s) in self.projections[..counting].iter().zip(&found.s) {
            fitted += projection.beta * s;
        }
        found.e = found.yz - fitted;
        found.y = fitted + self.offset;
        found.e_cv = counting.checked_sub(1).map_or(found.yz, |last| found.e_cvs[last]);
        let first = self.projections[0];
        if first.ripeness(first.lambda) > RIPE {
            self.sum_e2 = forgetting * self.sum_e2 + w * found.e * found.e;
            for (projection, e_cv) in self.projections.iter_mut().zip(&found.e_cvs) {
                projection.sum_e_cv2 = projection.lambda * projection.sum_e_cv2 + w * e_cv * e_cv;
            }
        }
        self.trustworthy = self.trustworthy || first.n_data > self.twice_inputs();
    }

    /// Ends a sample: adds a projection if the last one has paid, counts the sample and lets
    /// the forgetting factors grow.
    pub fn settle(&mut self, settings: &Settings) {
        if self.wants_projection(settings) {
            self.push(Projection::new(0.0, settings));
            self.ss_p = 0.0;
        }
        let (tau, end) = (settings.tau_lambda, settings.final_lambda);
        for projection in &mut self.projections {
            projection.n_data = projection.n_data * projection.lambda + 1.0;
            projection.lambda = tau * projection.lambda + end * (1.0 - tau);
        }
    }

    /// Whether the last projection is well known and has lowered the error enough for
    /// another to be tried.
    fn wants_projection(&self, settings: &Settings) -> bool {
        let [.., before, last] = &self.projections[..] else { return false };
        let first = &self.projections[0];
        self.projections.len() < settings.inputs
            && last.mean_e_cv2() < settings.add_threshold * before.mean_e_cv2()
            && last.n_data > AS_MUCH * first.n_data
            && last.ripeness(last.lambda) > RIPE_FOR_NEXT
    }
}

/// Lets a direction `u` follow the remembered covariance of input and output.
fn turn(u: &mut [f64], sums: &mut [f64], (kept, gain, x): (f64, f64, &[f64])) {
    for (sum, x) in sums.iter_mut().zip(x) {
        *sum = kept * *sum + gain * x;
    }
    let square = dot(sums, sums);
    if square > LEAST_SQUARE {
        let length = square.sqrt();
        for (u, sum) in u.iter_mut().zip(&*sums) {
            *u = sum / length;
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a.iter().zip(b) {
        sum += a * b;
    }
    sum
}

/// Adds `factor` times `values`.
fn add(to: &mut [f64], factor: f64, values: &[f64]) {
    for (to, value) in to.iter_mut().zip(values) {
        *to += factor * value;
    }
}
