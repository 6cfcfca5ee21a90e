//! Where the receptive fields are and how far they reach.

use fearless_simd::prelude::*;
use serde::{Deserialize, Serialize};

use super::columns::Columns;
use super::lanes::{Eight, Lanes, Mask, Row, all, fused};

/// Centres c and distance metrics D of all fields, in normalised coordinates. They lie
/// apart from all else: the search for the active fields, the hot loop of every prediction,
/// walks straight through them.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct Shapes {
    inputs: usize,
    /// Whether of the metrics only the diagonal is kept.
    diagonal_only: bool,
    /// A field's centre (n), then its D: the diagonal (n) or what is on and above it, by rows.
    columns: Columns,
}

/// Shapes as in a file: the numbers of one field after those of another.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    inputs: usize,
    diagonal: bool,
    /// n numbers a field.
    centres: Vec<f64>,
    /// n numbers a field (the diagonal) or n (n + 1) / 2.
    metrics: Vec<f64>,
}

/// How many numbers are on and above the diagonal of an `n` × `n` matrix.
pub const fn triangle(n: usize) -> usize {
    n * (n + 1) / 2
}

/// Where the entry of row `a` and column `b` ≥ `a` is among those on and above the diagonal
/// of an `n` × `n` matrix.
#[inline(always)]
pub const fn entry(n: usize, a: usize, b: usize) -> usize {
    a * (2 * n - a - 1) / 2 + b
}

/// Where the diagonal's entry `a` is in `length` numbers: the diagonal alone, or all on and
/// above it.
#[inline(always)]
pub const fn on_diagonal(n: usize, length: usize, a: usize) -> usize {
    if length == n { a } else { entry(n, a, a) }
}

impl Shapes {
    /// No fields yet, over `inputs` dimensions.
    pub fn new(inputs: usize, diagonal: bool) -> Self {
        let entries = if diagonal { inputs } else { triangle(inputs) };
        // Nothing is near a centre that is nowhere.
        Self {
            inputs,
            diagonal_only: diagonal,
            columns: Columns::new(vec![f64::NAN; inputs + entries]),
        }
    }

    /// Whether this holds `fields` fields of `inputs` dimensions.
    pub fn holds(&self, inputs: usize, diagonal: bool, fields: usize) -> bool {
        self.inputs == inputs && self.diagonal_only == diagonal && self.fields() == fields
    }

    /// The number of fields.
    pub fn fields(&self) -> usize {
        self.columns.fields()
    }

    /// The number of blocks of eight fields.
    pub fn blocks(&self) -> usize {
        self.columns.blocks()
    }

    /// The centre of `field`.
    pub fn centre(&self, field: usize) -> Vec<f64> {
        self.columns.column(field)[..self.inputs].to_vec()
    }

    /// What is kept of the metric D of `field`: its diagonal, or all on and above it.
    pub fn kept(&self, field: usize) -> Vec<f64> {
        self.columns.column(field)[self.inputs..].to_vec()
    }

    /// The metric D of `field`: its diagonal, or the whole matrix by rows.
    pub fn metric(&self, field: usize) -> Vec<f64> {
        let (n, kept) = (self.inputs, self.kept(field));
        if kept.len() == n {
            return kept;
        }
        let whole = (0..n * n).map(|at| (at / n, at % n));
        whole.map(|(a, b)| kept[entry(n, a.min(b), a.max(b))]).collect()
    }

    /// The diagonal of D of `field`.
    pub fn diagonal(&self, field: usize) -> Vec<f64> {
        let kept = self.kept(field);
        (0..self.inputs).map(|a| kept[on_diagonal(self.inputs, kept.len(), a)]).collect()
    }

    /// Fills `offset` with x − c of eight fields, and `d` with what is kept of their metrics.
    #[inline(always)]
    pub fn gather<S: Simd>(
        &self,
        simd: S,
        (eight, x): (&Eight, &[f64]),
        (offset, d): (&mut [Row], &mut [Row]),
    ) {
        self.columns.gather(eight, 0, offset);
        for (offset, &x) in offset.iter_mut().zip(x) {
            offset.set(all(simd, x) - offset.get(simd));
        }
        self.columns.gather(eight, self.inputs, d);
    }

    /// Replaces the metrics of those of eight fields that the mask names.
    #[inline(always)]
    pub fn scatter<S: Simd>(&mut self, simd: S, named: (&Eight, Mask<S>), d: &[Row]) {
        self.columns.scatter(simd, named, self.inputs, d);
    }

    /// The squared distance q of `x` from the centres of a block.
    #[inline(always)]
    pub fn distance<S: Simd>(&self, simd: S, block: usize, x: &[f64]) -> Lanes<S> {
        distance(simd, self.columns.block(block).split_at(self.inputs), x)
    }

    /// Appends a field; `d` is what is kept of its metric.
    pub fn push(&mut self, centre: &[f64], d: &[f64]) {
        self.columns.push(&[centre, d].concat());
    }

    /// Removes `field`; the later ones move down.
    pub fn remove(&mut self, field: usize) {
        self.columns.remove(field);
    }

    /// Removes `field`; the last one takes its place.
    pub fn swap_remove(&mut self, field: usize) {
        self.columns.swap_remove(field);
    }
}

impl From<Shapes> for Stored {
    fn from(shapes: Shapes) -> Self {
        let fields = 0..shapes.fields();
        Self {
            inputs: shapes.inputs,
            diagonal: shapes.diagonal_only,
            centres: fields.clone().flat_map(|field| shapes.centre(field)).collect(),
            metrics: fields.flat_map(|field| shapes.kept(field)).collect(),
        }
    }
}

/// Stored centres and metrics that cannot be.
#[derive(Debug, thiserror::Error)]
#[error("the stored centres and metrics do not fit each other, or are no metrics")]
pub struct Misshapen;

impl TryFrom<Stored> for Shapes {
    type Error = Misshapen;

    fn try_from(stored: Stored) -> Result<Self, Misshapen> {
        let Stored { inputs, diagonal, centres, metrics } = stored;
        let mut shapes = Self::new(inputs, diagonal);
        let entries = shapes.columns.height() - inputs;
        let fields = centres.len() / inputs.max(1);
        let fits = centres.len() == fields * inputs && metrics.len() == fields * entries;
        let finite = centres.iter().chain(&metrics).all(|value| value.is_finite());
        if inputs == 0 || !fits || !finite {
            return Err(Misshapen);
        }
        for (centre, d) in centres.chunks_exact(inputs).zip(metrics.chunks_exact(entries)) {
            shapes.push(centre, d);
        }
        let positive = |field| shapes.diagonal(field).iter().all(|&d| d >= f64::MIN_POSITIVE);
        if (0..fields).all(positive) { Ok(shapes) } else { Err(Misshapen) }
    }
}

/// q = (x − c)ᵀ D (x − c), with D's diagonal or all on and above it.
#[inline(always)]
fn distance<S: Simd>(simd: S, (centre, metric): (&[Row], &[Row]), x: &[f64]) -> Lanes<S> {
    let mut q = all(simd, 0.0);
    if metric.len() == x.len() {
        for ((d, centre), &x) in metric.iter().zip(centre).zip(x) {
            let offset = all(simd, x) - centre.get(simd);
            q = fused(offset * offset, d.get(simd), q);
        }
        return q;
    }
    let (mut rest, mut x_rest, mut centres) = (metric, x, centre);
    while let ([x, x_after @ ..], [centre, centres_after @ ..]) = (x_rest, centres) {
        let (row, below) = rest.split_at(x_after.len() + 1);
        let mut along = all(simd, 0.0);
        for ((d, centre), &x) in row[1..].iter().zip(centres_after).zip(x_after) {
            along = fused(d.get(simd), all(simd, x) - centre.get(simd), along);
        }
        let offset = all(simd, *x) - centre.get(simd);
        q = fused(fused(row[0].get(simd), offset, along + along), offset, q);
        (rest, x_rest, centres) = (below, x_after, centres_after);
    }
    q
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learner::lanes::{LANES, Work, run};
    use fearless_simd::Level;

    struct Measure<'a>(&'a Shapes, &'a [f64]);

    impl Work for Measure<'_> {
        type Output = [f64; LANES];

        #[inline(always)]
        fn with<S: Simd>(self, simd: S) -> [f64; LANES] {
            self.0.distance(simd, 0, self.1).into()
        }
    }

    #[test]
    fn diagonal_and_full_metrics_measure_alike() {
        let (centre, x) = ([1.0, -1.0, 0.0], [2.0, 1.0, 2.0]);
        let q = |diagonal, d: &[f64]| {
            let mut shapes = Shapes::new(3, diagonal);
            shapes.push(&centre, d);
            run(Level::new(), Measure(&shapes, &x))
        };
        assert_eq!(q(true, &[2.0, 3.0, 0.5])[0], 16.0);
        assert_eq!(q(false, &[2.0, 0.0, 0.0, 3.0, 0.0, 0.5])[0], 16.0);
        let tilted = q(false, &[2.0, 1.0, 0.0, 3.0, -1.0, 0.5]);
        assert_eq!(tilted[0], 16.0 + 4.0 - 8.0);
        assert!(tilted[1..].iter().all(|q| q.is_nan()), "nobody is nowhere");
    }

    #[test]
    fn a_metric_is_kept_as_what_is_on_and_above_its_diagonal() {
        let mut shapes = Shapes::new(2, false);
        shapes.push(&[0.0, 0.0], &[1.0, 2.0, 5.0]);
        assert_eq!(shapes.metric(0), [1.0, 2.0, 2.0, 5.0]);
        assert_eq!(shapes.diagonal(0), [1.0, 5.0]);
    }
}
