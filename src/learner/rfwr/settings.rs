//! What Receptive Field Weighted Regression is told beforehand.

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
    /// m, the number of outputs.
    pub outputs: usize,
    /// The shape of the fields' edges; the bi-square kernel ends at q = 2.
    pub kernel: Kernel,
    /// Whether fields are aligned with the axes (diagonal D).
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
    /// Each output is divided by its norm (m).
    pub norm_out: Vec<f64>,
    /// A field is added where no activation exceeds this.
    pub w_gen: f64,
    /// One of two fields is removed where the activations of both exceed this.
    pub w_prune: f64,
    /// The forgetting factor λ of new fields,
    pub init_lambda: f64,
    /// the one it tends to,
    pub final_lambda: f64,
    /// and how slowly: λ ← τλ + final·(1 − τ).
    pub tau_lambda: f64,
    /// The diagonal of P of new fields.
    pub init_p: f64,
    /// A field may speak when all its variance inflation factors are below this.
    pub vif_trust: f64,
    /// D is not learned while all variance inflation factors are above this.
    pub vif_update: f64,
    /// A field may speak when it has seen more than this times n samples.
    pub min_n_data_factor: f64,
    /// Fields with an activation up to this neither learn nor speak.
    pub cutoff: f64,
    /// Ours: with this many fields no further one is added; a sample in empty space is then
    /// learned by the fields it activates at all, and by none if there are none.
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
            penalty: 1e-7,
            init_alpha: 250.0,
            init_d: InitialMetric::Scalar(25.0),
            norm_in: vec![1.0; inputs],
            norm_out: vec![1.0; outputs],
            w_gen: 0.1,
            w_prune: 0.9,
            init_lambda: 0.999,
            final_lambda: 0.9999,
            tau_lambda: 0.99999,
            init_p: 1e10,
            vif_trust: 10.0,
            vif_update: 5.0,
            min_n_data_factor: 2.0,
            cutoff: 0.001,
            max_fields: None,
            output_limit: None,
            d_floor: None,
            d_ceiling: None,
            min_one_minus_h: None,
        }
    }

    /// The sizes of everything.
    pub(super) fn size(&self) -> Size {
        let entries = if self.diag_only { self.inputs } else { triangle(self.inputs) };
        Size { inputs: self.inputs, outputs: self.outputs, entries }
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
            ("init_p", self.init_p, SMALL, 1e100),
            ("vif_trust", self.vif_trust, 0.0, BIG),
            ("vif_update", self.vif_update, 0.0, BIG),
            ("min_n_data_factor", self.min_n_data_factor, 0.0, BIG),
            ("cutoff", self.cutoff, SMALL, 0.5),
        ];
        let mut all = always.into_iter().chain(optional);
        all.try_for_each(|(key, value, from, to)| range(key, value, from, to))
    }
}
