//! Where the receptive fields are and how far they reach.
//!
//! Centres and metrics of all fields lie side by side, so that the search for the active
//! ones, the hot loop of every prediction, walks straight through memory.

use serde::{Deserialize, Serialize};

/// How many numbers there are of what. Everything that happens once a field and sample
/// takes this along and is inlined: where it is constant, all loops are unrolled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// n inputs.
    pub inputs: usize,
    /// m outputs.
    pub outputs: usize,
    /// The numbers of a metric: n when diagonal, n × n otherwise.
    pub entries: usize,
}

/// Centres c and distance metrics D of all fields, in normalised coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shapes {
    inputs: usize,
    diagonal: bool,
    /// n numbers a field.
    centres: Vec<f64>,
    /// n numbers a field (the diagonal) or n × n.
    metrics: Vec<f64>,
}

/// The two fields nearest in their own metrics; of equally near ones the earlier is ahead.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Field and q of the nearest.
    pub first: Option<(usize, f64)>,
    /// Field and q of the next.
    pub second: Option<(usize, f64)>,
}

impl Nearest {
    /// Nobody yet.
    pub const NONE: Self = Self { first: None, second: None };

    /// Takes note of `field` at `q`; a NaN distance is no distance.
    pub fn note(&mut self, field: usize, q: f64) {
        let ahead_of = |rival: Option<(usize, f64)>| match rival {
            Some((_, other)) => q < other,
            None => !q.is_nan(),
        };
        if ahead_of(self.first) {
            self.second = self.first;
            self.first = Some((field, q));
        } else if ahead_of(self.second) {
            self.second = Some((field, q));
        }
    }
}

impl Shapes {
    /// No fields yet, over `inputs` dimensions.
    pub fn new(inputs: usize, diagonal: bool) -> Self {
        Self { inputs, diagonal, centres: Vec::new(), metrics: Vec::new() }
    }

    /// The numbers a metric takes: n when diagonal, n × n otherwise.
    pub fn entries(&self) -> usize {
        if self.diagonal { self.inputs } else { self.inputs * self.inputs }
    }

    /// Whether this holds `fields` fields of `inputs` dimensions, all of them usable.
    pub fn holds(&self, inputs: usize, diagonal: bool, fields: usize) -> bool {
        self.inputs == inputs
            && self.diagonal == diagonal
            && Some(self.centres.len()) == fields.checked_mul(inputs)
            && Some(self.metrics.len()) == fields.checked_mul(self.entries())
            && self.centres.iter().chain(&self.metrics).all(|value| value.is_finite())
            && (0..fields).all(|field| is_positive(self.metric(field), inputs))
    }

    /// The centre of `field`.
    pub fn centre(&self, field: usize) -> &[f64] {
        &self.centres[field * self.inputs..][..self.inputs]
    }

    /// The metric D of `field`.
    pub fn metric(&self, field: usize) -> &[f64] {
        &self.metrics[field * self.entries()..][..self.entries()]
    }

    /// The centre of `field`, and its metric to be changed.
    #[inline(always)]
    pub fn place(&mut self, field: usize, size: Size) -> (&[f64], &mut [f64]) {
        let Size { inputs, entries, .. } = size;
        let centre = &self.centres[field * inputs..][..inputs];
        (centre, &mut self.metrics[field * entries..][..entries])
    }

    /// Every field's centre and metric.
    #[inline(always)]
    pub fn each(&self, size: Size) -> impl Iterator<Item = (&[f64], &[f64])> {
        self.centres.chunks_exact(size.inputs).zip(self.metrics.chunks_exact(size.entries))
    }

    /// Appends a field.
    pub fn push(&mut self, centre: &[f64], d: &[f64]) {
        self.centres.extend_from_slice(centre);
        self.metrics.extend_from_slice(d);
    }

    /// Removes `field`; the later ones move down.
    pub fn remove(&mut self, field: usize) {
        let (n, entries) = (self.inputs, self.entries());
        self.centres.drain(field * n..(field + 1) * n);
        self.metrics.drain(field * entries..(field + 1) * entries);
    }

    /// Removes `field`; the last one takes its place.
    pub fn swap_remove(&mut self, field: usize) {
        let entries = self.entries();
        for (values, width) in [(&mut self.centres, self.inputs), (&mut self.metrics, entries)] {
            let last = values.len() - width;
            values.copy_within(last.., field * width);
            values.truncate(last);
        }
    }
}

/// Whether every number on the diagonal of the metric `d` is a normal positive one.
#[inline(always)]
pub fn is_positive(d: &[f64], inputs: usize) -> bool {
    let stride = if d.len() == inputs { 1 } else { inputs + 1 };
    let mut positive = true;
    for i in 0..inputs {
        positive &= d[i * stride] >= f64::MIN_POSITIVE;
    }
    positive
}

/// The squared distance q of `x` from `centre` in `metric`, diagonal or full.
#[inline(always)]
pub fn distance(centre: &[f64], metric: &[f64], x: &[f64]) -> f64 {
    let n = x.len();
    let mut q = 0.0;
    if metric.len() == n {
        for i in 0..n {
            let offset = x[i] - centre[i];
            q += offset * offset * metric[i];
        }
        return q;
    }
    for a in 0..n {
        let mut along = 0.0;
        for b in 0..n {
            along += (x[b] - centre[b]) * metric[a * n + b];
        }
        q += along * (x[a] - centre[a]);
    }
    q
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_keeps_the_two_nearest_and_the_earlier_of_equals() {
        let mut nearest = Nearest::NONE;
        for (field, q) in [(0, 5.0), (1, f64::NAN), (2, 3.0), (3, 3.0), (4, 9.0)] {
            nearest.note(field, q);
        }
        assert_eq!(nearest.first, Some((2, 3.0)));
        assert_eq!(nearest.second, Some((3, 3.0)));
    }

    #[test]
    fn removal_moves_the_later_fields_down() {
        let mut shapes = Shapes::new(2, true);
        for field in 0..3 {
            let at = f64::from(field);
            shapes.push(&[at, -at], &[at + 1.0, at + 2.0]);
        }
        shapes.remove(1);
        assert!(shapes.holds(2, true, 2));
        assert_eq!(shapes.centre(1), [2.0, -2.0]);
        assert_eq!(shapes.metric(1), [3.0, 4.0]);
    }

    #[test]
    fn a_swap_removal_moves_the_last_field_into_the_gap() {
        let mut shapes = Shapes::new(1, true);
        for field in 0..3 {
            shapes.push(&[f64::from(field)], &[f64::from(field) + 1.0]);
        }
        shapes.swap_remove(0);
        assert_eq!((shapes.centre(0), shapes.metric(0)), (&[2.0][..], &[3.0][..]));
        shapes.swap_remove(1);
        assert!(shapes.holds(1, true, 1));
        assert_eq!(shapes.centre(0), [2.0]);
    }

    #[test]
    fn diagonal_and_full_metrics_measure_alike() {
        let (centre, x) = ([1.0, -1.0], [2.0, 1.0]);
        assert_eq!(distance(&centre, &[2.0, 3.0], &x), 14.0);
        assert_eq!(distance(&centre, &[2.0, 0.0, 0.0, 3.0], &x), 14.0);
    }
}
