//! The distance metric D of a receptive field, and how it is learned.
//!
//! `D = MᵀM` with an upper triangular M stays positive whatever M is. M descends the gradient
//! of the field's cost J = J₁ + J₂ with one learning rate per entry; with meta learning the
//! rates themselves follow their own gradient (incremental delta-bar-delta).
//!
//! Of a matrix only what is on and above its diagonal is kept, by rows; of a diagonal one,
//! its diagonal.

use fearless_simd::prelude::*;
use serde::{Deserialize, Serialize};

use super::kernel::Activation;
use super::lanes::{Cut, Lanes, Mask, Row, all, dot, exp, finite, fused, multiply, without};
use super::records::padded;
use super::sample::{all_finite, all_sums};
use super::shapes::{entry, on_diagonal};

/// A step larger than this share of M's largest entry is held back.
const LARGEST_STEP: f64 = 0.1;
/// The largest change of the logarithm of a learning rate.
const LARGEST_RATE_CHANGE: f64 = 0.1;
/// The logarithm of a learning rate stays within ± this.
const LOG_RATE_LIMIT: f64 = 10.0;

/// What one field learns its metric with.
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
#[derive(Clone, Copy, Debug)]
pub struct Cost<S: Simd> {
    /// J₁′: the derivative of the error part of the cost with respect to w, per output.
    pub j1_slope: Lanes<S>,
    /// J₁″, per output; used by meta learning only.
    pub j1_curvature: Lanes<S>,
    /// w/W, the sample's share in the field.
    pub share: Lanes<S>,
    /// T: how far the field's regression is to be believed.
    pub transient: Lanes<S>,
}

/// What one sample says about the shapes of eight fields.
#[derive(Clone, Copy)]
pub struct Descent<'a, S: Simd> {
    /// x − c, normalised.
    pub offset: &'a [Row],
    /// The metrics D before the step.
    pub d: &'a [Row],
    /// The sample's weighted activations and their derivatives.
    pub activation: Activation<S>,
    /// What the regressions think of it.
    pub cost: Cost<S>,
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

    /// The metric with so many entries of these numbers, as many as `height` says.
    pub fn from_column(entries: usize, numbers: &[f64]) -> Self {
        let MetricRows { m, alpha, log_alpha, trace } = cut(entries, numbers);
        let [m, alpha, log_alpha, trace] = [m, alpha, log_alpha, trace].map(<[f64]>::to_vec);
        Self { m, alpha, log_alpha, trace }
    }

    /// The numbers of which [`from_column`](Self::from_column) makes this metric.
    pub fn to_column(&self) -> Vec<f64> {
        let half = height(self.m.len()) / 2;
        let mut numbers = [&self.m[..], &self.alpha].concat();
        numbers.resize(half, 0.0);
        numbers.extend(self.log_alpha.iter().chain(&self.trace));
        numbers.resize(2 * half, 0.0);
        numbers
    }

    /// Whether all vectors have `entries` finite numbers, and no rate is negative.
    pub fn is_sound(&self, entries: usize) -> bool {
        let sound = |values: &[f64]| values.len() == entries && all_finite(values);
        sound(&self.m)
            && sound(&self.alpha)
            && all_sums(&self.alpha)
            && sound(&self.log_alpha)
            && sound(&self.trace)
    }
}

/// The rows of metrics, to be read or written.
struct MetricRows<T> {
    m: T,
    alpha: T,
    log_alpha: T,
    trace: T,
}

/// How many numbers a metric of so many entries has: M and α, filled up to whole chunks, and
/// β and the trace likewise.
pub const fn height(entries: usize) -> usize {
    2 * padded(2 * entries)
}

#[inline(always)]
fn cut<T: Cut>(entries: usize, rows: T) -> MetricRows<T> {
    let (shape, rates) = rows.cut(padded(2 * entries));
    let (m, rest) = shape.cut(entries);
    let (alpha, _) = rest.cut(entries);
    let (log_alpha, rest) = rates.cut(entries);
    let (trace, _) = rest.cut(entries);
    MetricRows { m, alpha, log_alpha, trace }
}

impl Rules {
    /// How many numbers of a metric of so many entries, from the first on, a step may change.
    #[inline(always)]
    pub fn learned(&self, entries: usize) -> usize {
        if self.meta_rate.is_some() { height(entries) } else { height(entries) / 2 }
    }

    /// Takes one step: writes what comes after the metrics `old` into `next`, as far as
    /// [`learned`](Self::learned), and its D into `d`. Returns where, within the mask, all is
    /// sound: finite, with a positive diagonal of D.
    #[inline(always)]
    pub fn descend<S: Simd>(
        &self,
        simd: S,
        (old, next): (&[Row], &mut [Row]),
        d: &mut [Row],
        (by, mask): (&Descent<'_, S>, Mask<S>),
    ) -> Mask<S> {
        let (n, entries) = (by.offset.len(), by.d.len());
        let before = cut(entries, old);
        let mut after = cut(entries, &mut *next);
        let slopes = Slopes { simd, by, gamma: 4.0 * self.gamma };
        // The slopes wait where M will be, and the curvatures where the traces will be.
        let out = (&mut *after.m, &mut *after.trace);
        if entries == n {
            slopes.along_diagonal(before.m, out);
        } else {
            slopes.along_triangle(before.m, out);
        }
        self.step(simd, &before, &mut after, by.cost.transient);
        if let Some(bounds) = self.bounds {
            hold(simd, after.m, n, bounds);
        }
        if entries == n {
            square(simd, after.m, d);
        } else {
            gram(simd, after.m, d, n);
        }
        let mut sound = finite(simd, finite(simd, mask, &next[..self.learned(entries)]), d);
        for a in 0..n {
            let d = d[on_diagonal(n, entries, a)].get(simd);
            sound &= d.simd_ge(f64::MIN_POSITIVE);
        }
        sound
    }

    /// Steps along all entries.
    #[inline(always)]
    fn step<S: Simd>(
        &self,
        simd: S,
        old: &MetricRows<&[Row]>,
        next: &mut MetricRows<&mut [Row]>,
        transient: Lanes<S>,
    ) {
        if let Some(rate) = self.meta_rate {
            learn_rates(simd, old, next, (transient, transient * rate));
        } else {
            next.alpha.copy_from_slice(old.alpha);
        }
        let mut limit = all(simd, 0.0);
        for m in old.m {
            limit = limit.max(m.get(simd).abs());
        }
        limit *= LARGEST_STEP;
        let taken = match self.oversized {
            Oversized::Halved => 0.5,
            Oversized::Skipped => 0.0,
        };
        for ((m, alpha), old) in next.m.iter_mut().zip(&mut *next.alpha).zip(old.m) {
            let rate = alpha.get(simd);
            let step = rate * (m.get(simd) * transient);
            // Signed, as published: only steps that widen the field are held back.
            let too_large = step.simd_gt(limit);
            alpha.set(too_large.select(rate * 0.5, rate));
            m.set(old.get(simd) - too_large.select(step * taken, step));
        }
    }
}

/// Moves the learning rates and the traces. Loops of their own, each without a chain from one
/// entry to the next, let the processor be at several entries at a time.
#[inline(always)]
fn learn_rates<S: Simd>(
    simd: S,
    old: &MetricRows<&[Row]>,
    next: &mut MetricRows<&mut [Row]>,
    (transient, rate): (Lanes<S>, Lanes<S>),
) {
    let before = next.m.iter().zip(old.trace).zip(old.log_alpha);
    for (log_alpha, ((slope, trace), old)) in next.log_alpha.iter_mut().zip(before) {
        let limit = LARGEST_RATE_CHANGE;
        let change = clamp(rate * slope.get(simd) * trace.get(simd), -limit, limit);
        log_alpha.set(clamp(old.get(simd) - change, -LOG_RATE_LIMIT, LOG_RATE_LIMIT));
    }
    for (alpha, log_alpha) in next.alpha.iter_mut().zip(&*next.log_alpha) {
        alpha.set(exp(log_alpha.get(simd)));
    }
    let by = next.m.iter().zip(&*next.alpha).zip(old.trace);
    for (trace, ((slope, alpha), old)) in next.trace.iter_mut().zip(by) {
        let (alpha, curvature) = (alpha.get(simd), trace.get(simd));
        let kept = without(all(simd, 1.0), alpha * transient, curvature);
        let kept = kept.simd_gt(0.0).select(kept, all(simd, 0.0));
        trace.set(without(old.get(simd) * kept, alpha * transient, slope.get(simd)));
    }
}

/// The derivatives of the cost with respect to the entries of M.
struct Slopes<'a, S: Simd> {
    simd: S,
    by: &'a Descent<'a, S>,
    /// Four times the penalty.
    gamma: f64,
}

impl<S: Simd> Slopes<'_, S> {
    /// The first and second derivative with respect to an entry, from the derivatives of q
    /// and J₂.
    #[inline(always)]
    fn of_cost(
        &self,
        (q, offset): (Lanes<S>, Lanes<S>),
        (j2, j2_second): (Lanes<S>, Lanes<S>),
    ) -> (Lanes<S>, Lanes<S>) {
        let Activation { slope, curvature, .. } = self.by.activation;
        let Cost { j1_slope, j1_curvature, share, .. } = self.by.cost;
        let w = slope * q;
        let w_second = fused(curvature * q, q, slope * 2.0 * offset * offset);
        let penalty = share * self.gamma;
        let bent = fused(w * w, j1_curvature, penalty * j2_second);
        (fused(j1_slope, w, penalty * j2), fused(w_second, j1_slope, bent))
    }

    #[inline(always)]
    fn along_diagonal(&self, m: &[Row], (slopes, curvatures): (&mut [Row], &mut [Row])) {
        let simd = self.simd;
        let by = m.iter().zip(self.by.offset).zip(self.by.d);
        for ((slope, curvature), ((m, offset), d)) in slopes.iter_mut().zip(curvatures).zip(by) {
            let (m, offset, d) = (m.get(simd), offset.get(simd), d.get(simd));
            let q = m * 2.0 * offset * offset;
            let (first, second) = self.of_cost((q, offset), (d * m, d + m * m * 2.0));
            slope.set(first);
            curvature.set(second);
        }
    }

    /// Along the entries of a full M, row by row.
    #[inline(always)]
    fn along_triangle(&self, m: &[Row], (slopes, curvatures): (&mut [Row], &mut [Row])) {
        let simd = self.simd;
        let (mut m_rest, mut d_rest, mut offsets) = (m, self.by.d, self.by.offset);
        let (mut slopes, mut curvatures) = (slopes, curvatures);
        while let n @ 1.. = offsets.len() {
            let (m, m_below) = m_rest.split_at(n);
            let (slope, slopes_below) = slopes.split_at_mut(n);
            let (curvature, curvatures_below) = curvatures.split_at_mut(n);
            let (reach, square) = (dot(simd, m, offsets), dot(simd, m, m));
            // Σ_{i≥a} D_ib M_ai, for every b: row a of M times what D is from a on.
            multiply(simd, slope, d_rest, m);
            for (b, ((slope, curvature), (m, offset))) in
                slope.iter_mut().zip(curvature).zip(m.iter().zip(offsets)).enumerate()
            {
                let (m, offset) = (m.get(simd), offset.get(simd));
                let d = d_rest[entry(n, b, b)].get(simd);
                let q = offset * 2.0 * reach;
                let j2 = (slope.get(simd), d + square + m * m);
                let (first, second) = self.of_cost((q, offset), j2);
                slope.set(first);
                curvature.set(second);
            }
            (m_rest, d_rest, offsets) = (m_below, &d_rest[n..], &offsets[1..]);
            (slopes, curvatures) = (slopes_below, curvatures_below);
        }
    }
}

/// Keeps M's diagonal within the bounds, and the other entries within ± the larger one.
#[inline(always)]
fn hold<S: Simd>(simd: S, m: &mut [Row], n: usize, (least, most): (f64, f64)) {
    for m in &mut *m {
        m.set(clamp(m.get(simd), -most, most));
    }
    for a in 0..n {
        let m = &mut m[on_diagonal(n, m.len(), a)];
        m.set(clamp(m.get(simd), least, most));
    }
}

/// From `least` to `most`; what is not a number stays so.
#[inline(always)]
fn clamp<S: Simd>(lanes: Lanes<S>, least: f64, most: f64) -> Lanes<S> {
    let (low, high) = (lanes.simd_lt(least), lanes.simd_gt(most));
    low.select(all(lanes.simd, least), high.select(all(lanes.simd, most), lanes))
}

/// `D = M²` of diagonal M.
#[inline(always)]
fn square<S: Simd>(simd: S, m: &[Row], d: &mut [Row]) {
    for (d, m) in d.iter_mut().zip(m) {
        d.set(m.get(simd) * m.get(simd));
    }
}

/// `D = MᵀM` of upper triangular M: the sum over its rows of what each is times itself.
#[inline(always)]
fn gram<S: Simd>(simd: S, m: &[Row], d: &mut [Row], n: usize) {
    d.fill(Row::ZERO);
    let (mut m_rest, mut d_rest) = (m, d);
    for length in (1..=n).rev() {
        let (m, m_below) = m_rest.split_at(length);
        let mut squares = &mut *d_rest;
        for (a, left) in m.iter().enumerate() {
            let (square, below) = squares.split_at_mut(length - a);
            let left = left.get(simd);
            for (d, right) in square.iter_mut().zip(&m[a..]) {
                d.set(fused(left, right.get(simd), d.get(simd)));
            }
            squares = below;
        }
        (m_rest, d_rest) = (m_below, &mut d_rest[length..]);
    }
}
