//! What Locally Weighted Projection Regression is told beforehand.

use serde::{Deserialize, Serialize};

use super::field::Size;
use crate::learner::BuildError;
use crate::learner::growth;
use crate::learner::kernel::Kernel;
use crate::learner::settings::{BIG, InitialMetric, SMALL, check_sizes, range, start};
use crate::learner::shapes::triangle;

/// All settings of the algorithm, named as in the literature. [`Settings::new`] gives the
/// published values; what is marked "ours" is off there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// n, the number of inputs.
    pub inputs: usize,
    /// The number of outputs, each of which has fields of its own.
    pub outputs: usize,
    /// The shape of the fields' edges; the bi-square kernel ends at q = 4.
    pub kernel: Kernel,
    /// Whether only D's diagonal is learned. What `init_d` has off it then stays as it is.
    pub diag_only: bool,
    /// Whether D is learned at all.
    pub update_d: bool,
    /// Whether D's learning rates are learned too.
    pub meta: bool,
    /// The rate of that.
    pub meta_rate: f64,
    /// The penalty on narrow fields: the smaller, the narrower fields may become.
    pub penalty: f64,
    /// The learning rate α of D.
    pub init_alpha: f64,
    /// D of new fields.
    pub init_d: InitialMetric,
    /// Each input is divided by its norm (n).
    pub norm_in: Vec<f64>,
    /// Each output is divided by its norm (one per output).
    pub norm_out: Vec<f64>,
    /// A field is added where no activation exceeds this.
    pub w_gen: f64,
    /// One of two fields is removed where the activations of both exceed this; never at 1.
    pub w_prune: f64,
    /// The forgetting factor λ of new projections,
    pub init_lambda: f64,
    /// the one it tends to,
    pub final_lambda: f64,
    /// and how slowly: λ ← τλ + final·(1 − τ).
    pub tau_lambda: f64,
    /// The variance along a new projection: how strongly its slope is held at 0.
    pub init_s2: f64,
    /// A projection is added once the last one has brought the mean squared error below
    /// this share of what it was without it.
    pub add_threshold: f64,
    /// Fields with an activation up to this neither learn nor speak.
    pub cutoff: f64,
    /// Ours: with this many fields for an output no further one is added to it; a sample in
    /// empty space is then learned by the fields it activates at all, and by none if there
    /// are none.
    #[serde(default)]
    pub max_fields: Option<u32>,
    /// Ours: predictions are clamped to ± this, in the outputs' raw units.
    #[serde(default)]
    pub output_limit: Option<f64>,
    /// Ours: M's diagonal is kept at or above √ of this. Without it a direction that does
    /// not matter may collapse beyond return, since steps on M are proportional to M.
    #[serde(default)]
    pub d_floor: Option<f64>,
    /// Ours: M's diagonal is kept at or below √ of this, and what is off it within ±.
    #[serde(default)]
    pub d_ceiling: Option<f64>,
    /// Ours: 1 − h, by which the metric's memory divides, is at least this.
    #[serde(default)]
    pub min_one_minus_h: Option<f64>,
}

impl Settings {
    /// The published settings for `inputs` and `outputs`, without scaling.
    #[must_use]
    pub fn new(inputs: usize, outputs: usize) -> Self {
        Self {
            inputs,
            outputs,
            kernel: Kernel::Gaussian,
            diag_only: true,
            update_d: true,
            meta: false,
            meta_rate: 250.0,
            penalty: 1e-6,
            init_alpha: 50.0,
            init_d: InitialMetric::Scalar(25.0),
            norm_in: vec![1.0; inputs],
            norm_out: vec![1.0; outputs],
            w_gen: 0.1,
            w_prune: 1.0,
            init_lambda: 0.999,
            final_lambda: 0.99999,
            tau_lambda: 0.9999,
            init_s2: 1e-10,
            add_threshold: 0.5,
            cutoff: 0.001,
            max_fields: None,
            output_limit: None,
            d_floor: None,
            d_ceiling: None,
            min_one_minus_h: None,
        }
    }

    /// How many projections a field starts with.
    pub(super) fn first_projections(&self) -> usize {
        self.inputs.min(2)
    }

    /// How many numbers of each kind a field has.
    pub(super) fn size(&self) -> Size {
        let entries = if self.diag_only { self.inputs } else { triangle(self.inputs) };
        Size { inputs: self.inputs, entries }
    }

    /// When fields come and go.
    pub(super) fn growth(&self) -> growth::Rules {
        let Self { w_gen, w_prune, max_fields, .. } = *self;
        growth::Rules { w_gen, w_prune, max_fields }
    }

    /// γ, the penalty per input.
    pub(super) fn gamma(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "at most 64 inputs")]
        let inputs = self.inputs as f64;
        self.penalty / inputs
    }

    /// The bounds of M's diagonal, if any are set.
    pub(super) fn bounds(&self) -> Option<(f64, f64)> {
        if self.d_floor.is_none() && self.d_ceiling.is_none() {
            return None;
        }
        let floor = self.d_floor.map_or(0.0, f64::sqrt);
        Some((floor, self.d_ceiling.map_or(f64::INFINITY, f64::sqrt)))
    }

    /// D and M of new fields: the diagonal (`diag_only`), or what is on and above it.
    ///
    /// # Errors
    /// When a number of the settings is outside its range, a length does not fit, or
    /// `init_d` is no metric.
    pub(super) fn start(&self) -> Result<(Vec<f64>, Vec<f64>), BuildError> {
        let n = self.inputs;
        check_sizes((n, &self.norm_in), (self.outputs, &self.norm_out))?;
        self.check_ranges()?;
        start(&self.init_d, n, (self.diag_only, self.bounds()))
    }

    fn check_ranges(&self) -> Result<(), BuildError> {
        let optional = [
            ("output_limit", self.output_limit, 0.0, f64::MAX),
            ("d_floor", self.d_floor, SMALL, BIG),
            ("d_ceiling", self.d_ceiling, self.d_floor.unwrap_or(SMALL), BIG),
            ("min_one_minus_h", self.min_one_minus_h, SMALL, 1.0),
        ];
        let optional =
            optional.into_iter().filter_map(|(key, value, from, to)| Some((key, value?, from, to)));
        let always = [
            ("meta_rate", self.meta_rate, 0.0, BIG),
            ("penalty", self.penalty, 0.0, BIG),
            ("init_alpha", self.init_alpha, 0.0, BIG),
            ("w_gen", self.w_gen, 0.0, 1.0),
            ("w_prune", self.w_prune, 0.0, 1.0),
            ("init_lambda", self.init_lambda, 0.5, 1.0),
            ("final_lambda", self.final_lambda, 0.5, 1.0),
            ("tau_lambda", self.tau_lambda, 0.0, 1.0),
            ("init_s2", self.init_s2, 1e-30, BIG),
            ("add_threshold", self.add_threshold, 0.0, BIG),
            ("cutoff", self.cutoff, SMALL, 0.5),
        ];
        let mut all = always.into_iter().chain(optional);
        all.try_for_each(|(key, value, from, to)| range(key, value, from, to))
    }
}
