//! One receptive field as it is stored and shown, and where its numbers are.

use serde::{Deserialize, Serialize};

use super::settings::Settings;
use crate::learner::lanes::Cut;
use crate::learner::metric::{self, Metric};
use crate::learner::records::padded;
use crate::learner::sample::{all_finite, all_sums};

/// What sums that are divided by start with.
pub const NEARLY_NOTHING: f64 = 1e-10;

/// A field without its centre and its D, which lie with those of the other fields.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// The local linear model.
    pub regression: Regression,
    /// The factor M of the metric and its learning rates.
    pub metric: Metric,
}

/// A local linear model, fitted by incremental partial least squares: y ≈ β₀ + Σ βⱼ sⱼ with
/// `sⱼ = Uⱼ·xⱼ`, `x₁ = x − x̄` and `xⱼ₊₁ = xⱼ − Pⱼ sⱼ`.
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
    /// The projections (R, from 1 to n).
    pub projections: Vec<Projection>,
}

/// One projection. Of what it fits, only the sums are kept that the rest follows from: the
/// direction [`u`](Self::u), the slope [`beta`](Self::beta), and [`p`](Self::p).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// H: how changes of w act on the slope.
    pub h: f64,
    /// r: how they act on the variance.
    pub r: f64,
    /// The remembered sum of w s x (n).
    pub ss_x_res: Vec<f64>,
    /// The remembered sum of w x y (n), along which U points.
    pub s_x_res_y_res: Vec<f64>,
    /// What makes a direction of that sum: 1 over its length, or 0 while it has none.
    pub per_length: f64,
    /// The input along which U points until then.
    pub axis: usize,
}

/// How many numbers of each kind a field has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// n.
    pub inputs: usize,
    /// The numbers of M.
    pub entries: usize,
}

/// The rows that come before the projections, to be read or written.
pub struct Base<T> {
    /// The scalars: [`TRUSTWORTHY`], [`OFFSET`], [`SUM_E2`], [`SS_P`] and [`COUNT`].
    pub scalars: T,
    /// x̄ (n).
    pub mean: T,
    /// The variance (n).
    pub var: T,
}

/// The rows of one projection, to be read or written.
pub struct ProjectionRows<T> {
    /// The scalars, [`N_DATA`] to [`R`].
    pub scalars: T,
    /// Σ w x y (n).
    pub s_x_res_y_res: T,
    /// Σ w s x (n).
    pub ss_x_res: T,
}

/// Where 1 says that a field may speak, and 0 that it may not.
pub const TRUSTWORTHY: usize = 0;
/// Where β₀ is.
pub const OFFSET: usize = 1;
/// Where the sum of squared errors is.
pub const SUM_E2: usize = 2;
/// Where `ss_p` is.
pub const SS_P: usize = 3;
/// Where the number of projections is.
pub const COUNT: usize = 4;
/// How many scalars the base has; x̄ comes after them.
pub const BASE_SCALARS: usize = 5;

/// Where a projection's count of samples is.
pub const N_DATA: usize = 0;
/// Where the sum of weights is.
pub const SUM_W: usize = 1;
/// Where the sum of squared errors is.
pub const SUM_E_CV2: usize = 2;
/// Where Σ wsy is.
pub const SS_Y_RES: usize = 3;
/// Where 1 / Σ ws² is.
pub const PER_S2: usize = 4;
/// Where 1 over the length of Σ w x y is, or 0.
pub const PER_LENGTH: usize = 5;
/// Where Σ ws² is.
pub const SS_S2: usize = 6;
/// Where λ is.
pub const LAMBDA: usize = 7;
/// Where H is.
pub const H: usize = 8;
/// Where r is.
pub const R: usize = 9;
const PROJECTION_SCALARS: usize = 10;

impl Size {
    /// The rows of the metric, which come first.
    pub fn metric(self) -> usize {
        metric::height(self.entries)
    }

    /// The rows of the base, which come second.
    pub fn base(self) -> usize {
        padded(BASE_SCALARS + 2 * self.inputs)
    }

    /// As many of them, from the first on, as predictions need.
    pub fn base_to_predict(self) -> usize {
        BASE_SCALARS + self.inputs
    }

    /// The rows of a projection. All projections come last.
    pub fn projection(self) -> usize {
        padded(PROJECTION_SCALARS + 2 * self.inputs)
    }

    /// All rows of a field with so many projections.
    pub fn height(self, projections: usize) -> usize {
        self.metric() + self.base() + projections * self.projection()
    }

    /// Where a scalar of a projection is among all rows.
    pub fn scalar(self, projection: usize, scalar: usize) -> usize {
        self.height(projection) + scalar
    }

    /// Where a scalar of the base is among all rows.
    pub fn base_scalar(self, scalar: usize) -> usize {
        self.metric() + scalar
    }

    /// Cuts all rows into those of metric, base and projections.
    #[inline(always)]
    pub fn cut<T: Cut>(self, rows: T) -> (T, T, T) {
        let (metric, rest) = rows.cut(self.metric());
        let (base, projections) = rest.cut(self.base());
        (metric, base, projections)
    }

    /// Cuts the rows of the base.
    #[inline(always)]
    pub fn cut_base<T: Cut>(self, rows: T) -> Base<T> {
        let (scalars, rest) = rows.cut(BASE_SCALARS);
        let (mean, rest) = rest.cut(self.inputs);
        let (var, _) = rest.cut(self.inputs);
        Base { scalars, mean, var }
    }

    /// Cuts the rows of a projection.
    #[inline(always)]
    pub fn cut_projection<T: Cut>(self, rows: T) -> ProjectionRows<T> {
        let (scalars, rest) = rows.cut(PROJECTION_SCALARS);
        let (s_x_res_y_res, rest) = rest.cut(self.inputs);
        let (ss_x_res, _) = rest.cut(self.inputs);
        ProjectionRows { scalars, s_x_res_y_res, ss_x_res }
    }
}

impl Projection {
    /// A projection at its birth, along `axis`.
    pub fn new(axis: usize, settings: &Settings) -> Self {
        let n = settings.inputs;
        Self {
            n_data: NEARLY_NOTHING,
            lambda: settings.init_lambda,
            sum_w: NEARLY_NOTHING,
            sum_e_cv2: 0.0,
            ss_s2: settings.init_s2,
            ss_y_res: 0.0,
            h: 0.0,
            r: 0.0,
            ss_x_res: vec![0.0; n],
            s_x_res_y_res: vec![0.0; n],
            per_length: 0.0,
            axis,
        }
    }

    /// The direction U (n), of length 1.
    pub fn u(&self) -> Vec<f64> {
        if self.per_length > 0.0 {
            self.s_x_res_y_res.iter().map(|sum| sum * self.per_length).collect()
        } else {
            (0..self.s_x_res_y_res.len()).map(|i| f64::from(u8::from(i == self.axis))).collect()
        }
    }

    /// P (n): what of the inputs the projection accounts for.
    pub fn p(&self) -> Vec<f64> {
        let per_s2 = 1.0 / self.ss_s2;
        self.ss_x_res.iter().map(|sum| sum * per_s2).collect()
    }

    /// The slope β.
    pub fn beta(&self) -> f64 {
        self.ss_y_res / self.ss_s2
    }

    fn from_column((n, axis): (usize, usize), numbers: &[f64]) -> Self {
        let (scalars, vectors) = numbers.split_at(PROJECTION_SCALARS);
        Self {
            n_data: scalars[N_DATA],
            lambda: scalars[LAMBDA],
            sum_w: scalars[SUM_W],
            sum_e_cv2: scalars[SUM_E_CV2],
            ss_s2: scalars[SS_S2],
            ss_y_res: scalars[SS_Y_RES],
            h: scalars[H],
            r: scalars[R],
            ss_x_res: vectors[n..2 * n].to_vec(),
            s_x_res_y_res: vectors[..n].to_vec(),
            per_length: scalars[PER_LENGTH],
            axis,
        }
    }

    /// The numbers of this projection, in the order of its rows.
    pub fn to_column(&self) -> Vec<f64> {
        let Self { n_data, lambda, sum_w, sum_e_cv2, ss_s2, ss_y_res, h, r, per_length, .. } =
            *self;
        let per_s2 = 1.0 / ss_s2;
        let scalars = [n_data, sum_w, sum_e_cv2, ss_y_res, per_s2, per_length, ss_s2, lambda, h, r];
        filled_up([&scalars[..], &self.s_x_res_y_res, &self.ss_x_res].concat())
    }

    fn is_sound(&self, n: usize, axis: usize) -> bool {
        self.ss_x_res.len() == n
            && self.s_x_res_y_res.len() == n
            && all_finite(&self.to_column())
            && all_sums(&[self.n_data, self.sum_w, self.sum_e_cv2, self.ss_s2, self.per_length])
            && self.axis == axis
            && 0.0 < self.lambda
            && self.lambda <= 1.0
    }
}

impl Regression {
    /// A field's regression at its birth, with `projections` along the axes.
    pub fn new(settings: &Settings, offset: f64, projections: usize) -> Self {
        let n = settings.inputs;
        Self {
            trustworthy: false,
            offset,
            mean: vec![0.0; n],
            var: vec![0.0; n],
            sum_e2: 0.0,
            ss_p: 0.0,
            projections: (0..projections).map(|axis| Projection::new(axis, settings)).collect(),
        }
    }

    /// The prediction at `x`, all normalised.
    pub fn predict(&self, x: &[f64]) -> f64 {
        let mut residual: Vec<f64> = x.iter().zip(&self.mean).map(|(x, mean)| x - mean).collect();
        let mut y = self.offset;
        for projection in &self.projections[..self.counting()] {
            let s: f64 = projection.u().iter().zip(&residual).map(|(u, x)| u * x).sum();
            y += projection.beta() * s;
            residual.iter_mut().zip(projection.p()).for_each(|(x, p)| *x -= p * s);
        }
        y
    }

    /// How many projections count in predictions: the last one only if it has seen enough.
    fn counting(&self) -> usize {
        #[expect(clippy::cast_precision_loss, reason = "at most 64 inputs")]
        let enough = 2.0 * self.mean.len() as f64;
        let unripe = self.projections.last().is_none_or(|last| last.n_data <= enough);
        self.projections.len() - usize::from(unripe)
    }
}

impl Field {
    /// The field of these numbers.
    pub fn from_column(size: Size, numbers: &[f64]) -> Self {
        let n = size.inputs;
        let (metric, rest) = numbers.split_at(size.metric());
        let (base, rest) = rest.split_at(size.base());
        let mut projections: Vec<_> = rest
            .chunks_exact(size.projection())
            .enumerate()
            .map(|(axis, numbers)| Projection::from_column((n, axis), numbers))
            .collect();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
        projections.truncate(base[COUNT] as usize);
        let regression = Regression {
            trustworthy: base[TRUSTWORTHY] > 0.0,
            offset: base[OFFSET],
            mean: base[BASE_SCALARS..][..n].to_vec(),
            var: base[BASE_SCALARS + n..][..n].to_vec(),
            sum_e2: base[SUM_E2],
            ss_p: base[SS_P],
            projections,
        };
        Self { regression, metric: Metric::from_column(size.entries, metric) }
    }

    /// The numbers of which [`from_column`](Self::from_column) makes this field.
    pub fn to_column(&self) -> Vec<f64> {
        let Self { regression, metric } = self;
        let trustworthy = f64::from(u8::from(regression.trustworthy));
        #[expect(clippy::cast_precision_loss, reason = "at most 64 projections")]
        let count = regression.projections.len() as f64;
        let base = [trustworthy, regression.offset, regression.sum_e2, regression.ss_p, count];
        let mut numbers = metric.to_column();
        numbers.extend(filled_up([&base[..], &regression.mean, &regression.var].concat()));
        numbers.extend(regression.projections.iter().flat_map(Projection::to_column));
        numbers
    }

    /// Whether all lengths fit, every number is finite and every λ is one.
    pub fn is_sound(&self, size: Size) -> bool {
        let n = size.inputs;
        let Self { regression, metric } = self;
        (1..=n).contains(&regression.projections.len())
            && regression.mean.len() == n
            && regression.var.len() == n
            && all_sums(&regression.var)
            && all_sums(&[regression.sum_e2, regression.ss_p])
            && regression.projections.iter().zip(0..).all(|(one, axis)| one.is_sound(n, axis))
            && metric.is_sound(size.entries)
            && all_finite(&self.to_column())
    }
}

/// Zeros after the numbers, up to a whole chunk.
fn filled_up(mut numbers: Vec<f64>) -> Vec<f64> {
    numbers.resize(padded(numbers.len()), 0.0);
    numbers
}
