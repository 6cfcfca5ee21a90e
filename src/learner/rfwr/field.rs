//! One receptive field as it is stored and shown, and where its numbers are.

use serde::{Deserialize, Serialize};

use super::settings::Settings;
use crate::learner::lanes::Cut;
use crate::learner::metric::{self, Metric};
use crate::learner::records::padded;
use crate::learner::sample::{all_finite, all_sums};
use crate::learner::shapes::{entry, triangle};

/// A field without its centre and its D, which lie with those of the other fields.
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

/// A local linear model y ≈ Bᵀ(x − x̄) + b₀, fitted by recursive least squares; n inputs, m
/// outputs. Of symmetric matrices what is on and above the diagonal is kept, by rows.
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
    /// Bᵀ (m × n, by rows): the slopes of each output.
    pub slopes: Vec<f64>,
    /// P (n × n, symmetric): the inverse of the weighted covariance of the inputs.
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
    /// Hᵀ (m × n, by rows): how changes of w act on the slopes.
    pub h: Vec<f64>,
    /// R (n × n, symmetric): how they act on P.
    pub r: Vec<f64>,
}

/// How many numbers of each kind a field has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// n.
    pub inputs: usize,
    /// m.
    pub outputs: usize,
    /// The numbers of M.
    pub entries: usize,
}

/// The regressions' rows, to be read or written.
pub struct RegressionRows<T> {
    /// The scalars: [`TRUSTWORTHY`], [`N_DATA`], [`LAMBDA`] and [`SUM_W`].
    pub scalars: T,
    /// x̄ (n).
    pub mean: T,
    /// The linear models of all outputs, to be cut by [`Size::cut_output`].
    pub outputs: T,
    /// The variance (n).
    pub var: T,
    /// P, on and above its diagonal.
    pub p: T,
}

/// The errors' rows, to be read or written.
pub struct ErrorRows<T> {
    /// The scalars: [`SUM_E_CV2`] and [`SUM_E2`].
    pub scalars: T,
    /// Hᵀ (m × n).
    pub h: T,
    /// R, on and above its diagonal.
    pub r: T,
}

/// Where 1 says that a field may speak, and 0 that it may not.
pub const TRUSTWORTHY: usize = 0;
/// Where the count of samples is.
pub const N_DATA: usize = 1;
/// Where λ is.
pub const LAMBDA: usize = 2;
/// Where the sum of weights is.
pub const SUM_W: usize = 3;
/// Where the sum of squared errors before learning is.
pub const SUM_E_CV2: usize = 0;
/// Where the sum of squared errors after it is.
pub const SUM_E2: usize = 1;

/// The scalars of a regression.
const REGRESSION_SCALARS: usize = 4;
/// The scalars of the errors.
const ERROR_SCALARS: usize = 2;

impl Size {
    /// The rows of scalars and means, which come first.
    pub fn head(self) -> usize {
        padded(REGRESSION_SCALARS + self.inputs)
    }

    /// The rows of the linear model of one output. All models come second.
    pub fn output(self) -> usize {
        padded(1 + self.inputs)
    }

    /// All rows of the regression.
    pub fn regression(self) -> usize {
        let Self { inputs: n, outputs: m, .. } = self;
        self.head() + m * self.output() + padded(n + triangle(n))
    }

    /// The rows of the errors, which come after those.
    pub fn errors(self) -> usize {
        padded(ERROR_SCALARS + self.outputs * self.inputs + triangle(self.inputs))
    }

    /// All rows; those of the metric come last.
    pub fn height(self) -> usize {
        self.regression() + self.errors() + metric::height(self.entries)
    }

    /// Where P begins.
    pub fn p(self) -> usize {
        self.head() + self.outputs * self.output() + self.inputs
    }

    /// P of which nothing is known.
    pub fn fresh_p(self, init_p: f64) -> Vec<f64> {
        let n = self.inputs;
        let mut p = vec![0.0; triangle(n)];
        (0..n).for_each(|a| p[entry(n, a, a)] = init_p);
        p
    }

    /// Cuts all rows into those of regression, errors and metric.
    #[inline(always)]
    pub fn cut<T: Cut>(self, rows: T) -> (T, T, T) {
        let (regression, rest) = rows.cut(self.regression());
        let (errors, metric) = rest.cut(self.errors());
        (regression, errors, metric)
    }

    /// Cuts the rows of a regression.
    #[inline(always)]
    pub fn cut_regression<T: Cut>(self, rows: T) -> RegressionRows<T> {
        let (head, rest) = rows.cut(self.head());
        let (scalars, mean) = self.cut_head(head);
        let (outputs, rest) = rest.cut(self.outputs * self.output());
        let (var, rest) = rest.cut(self.inputs);
        let (p, _) = rest.cut(triangle(self.inputs));
        RegressionRows { scalars, mean, outputs, var, p }
    }

    /// Cuts the first rows of a regression into its scalars and x̄.
    #[inline(always)]
    pub fn cut_head<T: Cut>(self, rows: T) -> (T, T) {
        let (scalars, rest) = rows.cut(REGRESSION_SCALARS);
        (scalars, rest.cut(self.inputs).0)
    }

    /// Cuts the rows of an output into b₀ (1) and Bᵀ (n).
    #[inline(always)]
    pub fn cut_output<T: Cut>(self, rows: T) -> (T, T) {
        let (offset, rest) = rows.cut(1);
        (offset, rest.cut(self.inputs).0)
    }

    /// Cuts the rows of errors.
    #[inline(always)]
    pub fn cut_errors<T: Cut>(self, rows: T) -> ErrorRows<T> {
        let (scalars, rest) = rows.cut(ERROR_SCALARS);
        let (h, rest) = rest.cut(self.outputs * self.inputs);
        let (r, _) = rest.cut(triangle(self.inputs));
        ErrorRows { scalars, h, r }
    }
}

impl Field {
    /// A field at its birth: nothing learned but the given offset and metric.
    pub fn new(settings: &Settings, offset: Vec<f64>, metric: Metric) -> Self {
        let (n, m) = (settings.inputs, settings.outputs);
        let regression = Regression {
            trustworthy: false,
            n_data: 0.0,
            lambda: settings.init_lambda,
            sum_w: 0.0,
            mean: vec![0.0; n],
            var: vec![0.0; n],
            offset,
            slopes: vec![0.0; n * m],
            p: settings.size().fresh_p(settings.init_p),
        };
        let errors =
            Errors { sum_e_cv2: 0.0, sum_e2: 0.0, h: vec![0.0; n * m], r: vec![0.0; triangle(n)] };
        Self { regression, metric, errors }
    }

    /// The field of these numbers.
    pub fn from_column(size: Size, numbers: &[f64]) -> Self {
        let (regression, errors, metric) = size.cut(numbers);
        let RegressionRows { scalars, mean, outputs, var, p } = size.cut_regression(regression);
        let models = outputs.chunks_exact(size.output()).map(|rows| size.cut_output(rows));
        let regression = Regression {
            trustworthy: scalars[TRUSTWORTHY] > 0.0,
            n_data: scalars[N_DATA],
            lambda: scalars[LAMBDA],
            sum_w: scalars[SUM_W],
            mean: mean.to_vec(),
            var: var.to_vec(),
            offset: models.clone().flat_map(|(offset, _)| offset).copied().collect(),
            slopes: models.flat_map(|(_, slopes)| slopes).copied().collect(),
            p: p.to_vec(),
        };
        let ErrorRows { scalars, h, r } = size.cut_errors(errors);
        let (sum_e_cv2, sum_e2) = (scalars[SUM_E_CV2], scalars[SUM_E2]);
        let errors = Errors { sum_e_cv2, sum_e2, h: h.to_vec(), r: r.to_vec() };
        Self { regression, metric: Metric::from_column(size.entries, metric), errors }
    }

    /// The numbers of which [`from_column`](Self::from_column) makes this field.
    pub fn to_column(&self) -> Vec<f64> {
        let Self { regression, metric, errors } = self;
        let Regression { mean, var, offset, slopes, p, .. } = regression;
        let trustworthy = f64::from(u8::from(regression.trustworthy));
        let scalars = [trustworthy, regression.n_data, regression.lambda, regression.sum_w];
        let mut numbers = Vec::new();
        let mut append = |parts: &[&[f64]]| {
            numbers.extend(parts.concat());
            numbers.resize(padded(numbers.len()), 0.0);
        };
        append(&[&scalars, mean]);
        for (offset, slopes) in offset.iter().zip(slopes.chunks_exact(mean.len())) {
            append(&[&[*offset], slopes]);
        }
        append(&[var, p]);
        append(&[&[errors.sum_e_cv2, errors.sum_e2], &errors.h, &errors.r]);
        append(&[&metric.to_column()]);
        numbers
    }

    /// Whether all lengths fit, every number is finite and λ is one.
    pub fn is_sound(&self, size: Size) -> bool {
        let Size { inputs: n, outputs: m, entries } = size;
        let Self { regression, metric, errors } = self;
        let lists = [
            (&regression.mean, n),
            (&regression.var, n),
            (&regression.offset, m),
            (&regression.slopes, m * n),
            (&regression.p, triangle(n)),
            (&errors.h, m * n),
            (&errors.r, triangle(n)),
        ];
        lists.into_iter().all(|(list, length)| list.len() == length && all_finite(list))
            && all_sums(&[regression.n_data, regression.sum_w])
            && all_sums(&[errors.sum_e_cv2, errors.sum_e2])
            && all_sums(&regression.var)
            && 0.0 < regression.lambda
            && regression.lambda <= 1.0
            && metric.is_sound(entries)
    }
}
