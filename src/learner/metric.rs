//! The shape of a receptive field, learned by gradient descent.
//!
//! The metric is kept as `D = MᵀM` with M upper triangular, so that D stays positive
//! whatever the steps on M are. The cost of a field is `J = J₁ + J₂`: the mean squared
//! leave-one-out error within the field, and γ Σ D², which keeps fields from shrinking to
//! nothing. A step follows
//!
//! G = J₁′ ∂w/∂M / outputs + (w/W) ∂J₂/∂M,  M ← M − α T G
//!
//! with one learning rate α per entry of M, which may be learned in turn (meta = true;
//! the incremental delta-bar-delta of Sutton 1992, with second derivatives).

use serde::{Deserialize, Serialize};

use super::all_finite;
use super::kernel::Activation;

/// No step on an entry of M is larger than this share of the largest entry.
const LARGEST_STEP: f64 = 0.1;
/// The log of a rate changes by at most this in one step,
const LARGEST_RATE_CHANGE: f64 = 0.1;
/// and stays within ± this.
const LOG_RATE_LIMIT: f64 = 10.0;

/// The factor M of a field's metric with its learning rates. All vectors hold n numbers (the
/// diagonal) or n × n, row by row, of which those below the diagonal do not matter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Metric {
    /// M of `D = MᵀM`.
    pub m: Vec<f64>,
    /// The learning rates α.
    pub alpha: Vec<f64>,
    /// The rates' logarithms β, which meta learning moves.
    pub log_alpha: Vec<f64>,
    /// The decaying trace of past steps by which meta learning judges the rates.
    pub trace: Vec<f64>,
}

/// How a sample changes the cost of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// J₁′: the derivative of the error part of the cost with respect to w, per output.
    pub j1_slope: f64,
    /// J₁″, per output; used by meta learning only.
    pub j1_curvature: f64,
    /// w/W, the sample's share in the field.
    pub share: f64,
    /// T: how far the field's regression is to be believed.
    pub transient: f64,
}

/// What one sample says about a field's shape.
pub struct Descent<'a> {
    /// x − c.
    pub offset: &'a [f64],
    /// The metric D before the step.
    pub d: &'a [f64],
    /// The sample's weighted activation and its derivatives.
    pub activation: Activation,
    /// What the regression thinks of it.
    pub cost: Cost,
}

/// The rules of descent that hold for all fields.
#[derive(Clone, Copy, Debug)]
pub struct Rules {
    /// γ: the penalty per input.
    pub gamma: f64,
    /// The meta learning rate; `None` keeps the rates.
    pub meta_rate: Option<f64>,
    /// What becomes of a step that is too large.
    pub oversized: Oversized,
    /// The smallest and largest entry of M's diagonal; entries off it stay within ± the
    /// largest. Ours.
    pub bounds: Option<(f64, f64)>,
}

/// What becomes of a step beyond the largest allowed, besides halving its learning rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Oversized {
    /// Half of it is taken (RFWR).
    Halved,
    /// None of it is (LWPR).
    Skipped,
}

/// The derivatives of w and J₂ with respect to one entry of M.
#[derive(Clone, Copy)]
struct Derivatives {
    w: f64,
    w_second: f64,
    j2: f64,
    j2_second: f64,
}

impl Metric {
    /// A field's start: M, one rate for all entries.
    pub fn new(m: Vec<f64>, alpha: f64) -> Self {
        let entries = m.len();
        Self::inheriting(m, vec![alpha; entries])
    }

    /// A field that starts with another's M and rates, but not with its meta state.
    pub fn inheriting(m: Vec<f64>, alpha: Vec<f64>) -> Self {
        let log_alpha = alpha.iter().map(|rate| (rate + 1e-10).ln()).collect();
        let trace = vec![0.0; m.len()];
        Self { m, alpha, log_alpha, trace }
    }

    /// Whether all vectors have `entries` finite numbers.
    #[inline(always)]
    pub fn is_sound(&self, entries: usize) -> bool {
        let sound = |values: &[f64]| values.len() == entries && all_finite(&values[..entries]);
        sound(&self.m) && sound(&self.alpha) && sound(&self.log_alpha) && sound(&self.trace)
    }

    /// Takes one step from `self` to `next`, and writes its D to `d_next`. The number of
    /// inputs n is that of `by`.
    #[inline(always)]
    pub fn descend(&self, next: &mut Self, d_next: &mut [f64], by: &Descent<'_>, rules: &Rules) {
        let n = by.offset.len();
        let limit = LARGEST_STEP * self.m.iter().fold(0.0, |most: f64, m| most.max(m.abs()));
        if self.m.len() == n {
            for (a, d) in d_next[..n].iter_mut().enumerate() {
                let derivatives = self.along_diagonal(a, by, rules.gamma);
                self.step(next, a, derivatives, by, (limit, rules));
                bound(&mut next.m[a], true, rules);
                *d = next.m[a] * next.m[a];
            }
            return;
        }
        for a in 0..n {
            let row = &self.m[a * n..][..n];
            let mut reach = 0.0;
            let mut square = 0.0;
            for (offset, m) in by.offset[a..].iter().zip(&row[a..]) {
                reach += offset * m;
                square += m * m;
            }
            for b in a..n {
                let derivatives = self.along_entry((a, b), (reach, square), by, rules.gamma);
                self.step(next, a * n + b, derivatives, by, (limit, rules));
                bound(&mut next.m[a * n + b], a == b, rules);
            }
        }
        gram(&next.m, d_next, n);
    }

    #[inline(always)]
    fn along_diagonal(&self, a: usize, by: &Descent<'_>, gamma: f64) -> Derivatives {
        let (m, d, offset) = (self.m[a], by.d[a], by.offset[a]);
        let q = 2.0 * m * offset * offset;
        Derivatives {
            w: by.activation.slope * q,
            w_second: by.activation.curvature * q * q + 2.0 * by.activation.slope * offset * offset,
            j2: 4.0 * gamma * d * m,
            j2_second: 4.0 * gamma * (d + 2.0 * m * m),
        }
    }

    /// The derivatives along `M_ab`, given `Σ_{i≥a} d_i M_ai` and `Σ_{i≥a} M_ai²`.
    #[inline(always)]
    fn along_entry(
        &self,
        (a, b): (usize, usize),
        (reach, square): (f64, f64),
        by: &Descent<'_>,
        gamma: f64,
    ) -> Derivatives {
        let n = by.offset.len();
        let offset = by.offset[b];
        let m = self.m[a * n + b];
        let q = 2.0 * offset * reach;
        let mut spread = 0.0;
        for i in a..n {
            spread += by.d[i * n + b] * self.m[a * n + i];
        }
        Derivatives {
            w: by.activation.slope * q,
            w_second: by.activation.curvature * q * q + 2.0 * by.activation.slope * offset * offset,
            j2: 4.0 * gamma * spread,
            j2_second: 4.0 * gamma * (by.d[b * n + b] + square + m * m),
        }
    }

    #[inline(always)]
    fn step(
        &self,
        next: &mut Self,
        at: usize,
        along: Derivatives,
        by: &Descent<'_>,
        (limit, rules): (f64, &Rules),
    ) {
        let Cost { j1_slope, j1_curvature, share, transient } = by.cost;
        let gradient = j1_slope * along.w + share * along.j2;
        if let Some(rate) = rules.meta_rate {
            let change = rate * transient * gradient * self.trace[at];
            let log_alpha =
                self.log_alpha[at] - change.clamp(-LARGEST_RATE_CHANGE, LARGEST_RATE_CHANGE);
            let log_alpha = log_alpha.clamp(-LOG_RATE_LIMIT, LOG_RATE_LIMIT);
            let alpha = log_alpha.exp();
            let curvature = along.w_second * j1_slope
                + along.w * along.w * j1_curvature
                + share * along.j2_second;
            let kept = (1.0 - alpha * curvature * transient).max(0.0);
            next.trace[at] = self.trace[at] * kept - alpha * transient * gradient;
            next.log_alpha[at] = log_alpha;
            next.alpha[at] = alpha;
        } else {
            next.alpha[at] = self.alpha[at];
            next.log_alpha[at] = self.log_alpha[at];
            next.trace[at] = self.trace[at];
        }
        let mut step = next.alpha[at] * transient * gradient;
        // Signed, as published: only steps that widen the field are held back.
        if step > limit {
            next.alpha[at] /= 2.0;
            step = match rules.oversized {
                Oversized::Halved => step / 2.0,
                Oversized::Skipped => 0.0,
            };
        }
        next.m[at] = self.m[at] - step;
    }
}

/// Keeps an entry of M within the bounds, if there are any.
#[inline(always)]
fn bound(m: &mut f64, on_diagonal: bool, rules: &Rules) {
    if let Some((least, most)) = rules.bounds {
        *m = m.clamp(if on_diagonal { least } else { -most }, most);
    }
}

/// `D = MᵀM` of an upper triangular M.
#[inline(always)]
pub fn gram(m: &[f64], d: &mut [f64], n: usize) {
    for a in 0..n {
        for b in a..n {
            let mut sum = 0.0;
            for i in 0..=a {
                sum += m[i * n + a] * m[i * n + b];
            }
            d[a * n + b] = sum;
            d[b * n + a] = sum;
        }
    }
}
