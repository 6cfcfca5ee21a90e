//! The learner's section of a profile.

use serde::{Deserialize, Serialize};

use super::kernel::Kernel;
use super::lwpr::{self, Lwpr};
use super::rfwr::{self, Rfwr};
use super::settings::InitialMetric;
use super::{BuildError, Model};
use crate::check::{Check, Checker};

/// The most inputs that a profile can name: the task with the most features has 6.
const MOST_INPUTS: usize = 6;

/// Which learner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Receptive Field Weighted Regression, see [`rfwr`](super::rfwr).
    #[default]
    Rfwr,
    /// Locally Weighted Projection Regression, see [`lwpr`](super::lwpr).
    Lwpr,
}

impl Kind {
    /// The word outside: on the command line and in files.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Rfwr => "rfwr",
            Self::Lwpr => "lwpr",
        }
    }

    /// The learner of that word, if there is one.
    #[must_use]
    pub fn from_word(word: &str) -> Option<Self> {
        [Self::Rfwr, Self::Lwpr].into_iter().find(|kind| kind.word() == word)
    }
}

/// What a profile says about the learner. Lengths are in units of the norms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// Which learner.
    pub kind: Kind,
    /// The most receptive fields; then none is added any more.
    pub max_fields: u32,
    /// The shape of the fields' edges.
    pub kernel: Kernel,
    /// The metric D of new fields, on the diagonal.
    pub init_d: f64,
    /// The learning rate of D.
    pub init_alpha: f64,
    /// The penalty on narrow fields.
    pub penalty: f64,
    /// A field is added where no activation exceeds this.
    pub w_gen: f64,
    /// One of two fields is removed where the activations of both exceed this.
    pub w_prune: f64,
    /// The forgetting factor of new fields.
    pub init_lambda: f64,
    /// The forgetting factor it tends to.
    pub final_lambda: f64,
    /// How slowly it does: λ ← τλ + final·(1 − τ).
    pub tau_lambda: f64,
    /// The diagonal of the inverse covariance P of new fields; RFWR only.
    pub init_p: f64,
    /// The variance along a new projection; LWPR only.
    pub init_s2: f64,
    /// A projection is added once the last one has brought the error below this share of
    /// what it was without it; LWPR only.
    pub add_threshold: f64,
    /// Whether fields are aligned with the axes.
    pub diag_only: bool,
    /// Whether D is learned at all.
    pub update_d: bool,
    /// Whether D's learning rates are learned too.
    pub meta: bool,
    /// The rate of that.
    pub meta_rate: f64,
    /// The smallest D: fields are at most 1/√ of this wide.
    pub d_floor: f64,
    /// The largest D.
    pub d_ceiling: f64,
    /// The least 1 − h by which the metric's memory divides.
    pub min_one_minus_h: f64,
    /// Each input is divided by its norm, in the input's own unit.
    pub norm_in: Vec<f64>,
    /// The output is divided by this, in the action's unit.
    pub norm_out: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            kind: Kind::Rfwr,
            max_fields: 100,
            kernel: Kernel::Gaussian,
            init_d: 3.0,
            init_alpha: 50.0,
            penalty: 1e-7,
            w_gen: 0.1,
            w_prune: 0.9,
            init_lambda: 0.999,
            final_lambda: 0.9999,
            tau_lambda: 0.99999,
            init_p: 1e10,
            init_s2: 1e-10,
            add_threshold: 0.5,
            diag_only: true,
            update_d: true,
            meta: false,
            meta_rate: 250.0,
            d_floor: 0.01,
            d_ceiling: 1e4,
            min_one_minus_h: 0.01,
            // Of the cart-pole: 0.5 m, 1 m/s, 30°, 150°/s.
            norm_in: vec![0.5, 1.0, 0.5235987755982988, 2.6179938779914944],
            norm_out: 10.0,
        }
    }
}

impl Params {
    /// A fresh learner of `inputs` numbers and one output, whose predictions stay within
    /// ± `output_limit` (the action's unit).
    ///
    /// # Errors
    /// When `norm_in` has another length than `inputs`, or a value is outside its range.
    pub fn build(&self, inputs: usize, output_limit: f64) -> Result<Model, BuildError> {
        match self.kind {
            Kind::Rfwr => Ok(Model::Rfwr(Rfwr::new(self.rfwr(inputs, output_limit))?)),
            Kind::Lwpr => Ok(Model::Lwpr(Lwpr::new(self.lwpr(inputs, output_limit))?)),
        }
    }

    /// The same as settings of RFWR, whatever the kind.
    #[must_use]
    pub fn rfwr(&self, inputs: usize, output_limit: f64) -> rfwr::Settings {
        rfwr::Settings {
            kernel: self.kernel,
            diag_only: self.diag_only,
            update_d: self.update_d,
            meta: self.meta,
            meta_rate: self.meta_rate,
            penalty: self.penalty,
            init_alpha: self.init_alpha,
            init_d: InitialMetric::Scalar(self.init_d),
            norm_in: self.norm_in.clone(),
            norm_out: vec![self.norm_out],
            w_gen: self.w_gen,
            w_prune: self.w_prune,
            init_lambda: self.init_lambda,
            final_lambda: self.final_lambda,
            tau_lambda: self.tau_lambda,
            init_p: self.init_p,
            max_fields: Some(self.max_fields),
            output_limit: Some(output_limit),
            d_floor: Some(self.d_floor),
            d_ceiling: Some(self.d_ceiling),
            min_one_minus_h: Some(self.min_one_minus_h),
            ..rfwr::Settings::new(inputs, 1)
        }
    }

    /// The same as settings of LWPR, whatever the kind.
    #[must_use]
    pub fn lwpr(&self, inputs: usize, output_limit: f64) -> lwpr::Settings {
        lwpr::Settings {
            kernel: self.kernel,
            diag_only: self.diag_only,
            update_d: self.update_d,
            meta: self.meta,
            meta_rate: self.meta_rate,
            penalty: self.penalty,
            init_alpha: self.init_alpha,
            init_d: InitialMetric::Scalar(self.init_d),
            norm_in: self.norm_in.clone(),
            norm_out: vec![self.norm_out],
            w_gen: self.w_gen,
            w_prune: self.w_prune,
            init_lambda: self.init_lambda,
            final_lambda: self.final_lambda,
            tau_lambda: self.tau_lambda,
            init_s2: self.init_s2,
            add_threshold: self.add_threshold,
            max_fields: Some(self.max_fields),
            output_limit: Some(output_limit),
            d_floor: Some(self.d_floor),
            d_ceiling: Some(self.d_ceiling),
            min_one_minus_h: Some(self.min_one_minus_h),
            ..lwpr::Settings::new(inputs, 1)
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.count("max_fields", self.max_fields, 1..=10_000);
        c.range("init_d", self.init_d, 1e-6..=1e6);
        c.range("init_alpha", self.init_alpha, 0.0..=1e6);
        c.range("penalty", self.penalty, 0.0..=1.0);
        c.range("w_gen", self.w_gen, 0.001..=0.99);
        c.range("w_prune", self.w_prune, 0.001..=1.0);
        let pruned = self.w_prune;
        c.demand(pruned >= self.w_gen, "w_prune", pruned, "w_gen or more");
        c.range("init_lambda", self.init_lambda, 0.5..=1.0);
        c.range("final_lambda", self.final_lambda, 0.5..=1.0);
        c.range("tau_lambda", self.tau_lambda, 0.0..=1.0);
        c.range("init_p", self.init_p, 1e-6..=1e15);
        c.range("init_s2", self.init_s2, 1e-15..=1e6);
        c.range("add_threshold", self.add_threshold, 0.0..=1.0);
        c.range("meta_rate", self.meta_rate, 0.0..=1e6);
        c.range("d_floor", self.d_floor, 1e-6..=1e6);
        c.range("d_ceiling", self.d_ceiling, 1e-6..=1e9);
        let ceiling = self.d_ceiling;
        c.demand(ceiling >= self.d_floor, "d_ceiling", ceiling, "d_floor or more");
        c.range("min_one_minus_h", self.min_one_minus_h, 1e-6..=1.0);
        let given = format_args!("a list of {}", self.norm_in.len());
        let right = (1..=MOST_INPUTS).contains(&self.norm_in.len());
        c.demand(right, "norm_in", given, "1 to 6 numbers");
        for norm in &self.norm_in {
            c.range("norm_in", *norm, 1e-6..=1e6);
        }
        c.range("norm_out", self.norm_out, 1e-6..=1e6);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(params: &Params) -> Vec<String> {
        let mut faults = Vec::new();
        params.check(&mut Checker::new(&mut faults));
        faults.into_iter().map(|fault| fault.key).collect()
    }

    #[test]
    fn the_defaults_pass_and_build() {
        assert_eq!(refused(&Params::default()), [""; 0]);
        assert!(Params::default().build(4, 10.0).is_ok());
    }

    #[test]
    fn norms_are_positive_finite_and_at_most_6() {
        let norms = |norm_in: &[f64]| Params { norm_in: norm_in.to_vec(), ..Params::default() };
        assert_eq!(refused(&norms(&[1.0; 6])), [""; 0]);
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(refused(&norms(&[1.0, wrong])), ["norm_in"], "{wrong}");
            assert_eq!(refused(&Params { norm_out: wrong, ..Params::default() }), ["norm_out"]);
        }
        assert_eq!(refused(&norms(&[1.0; 7])), ["norm_in"]);
        assert_eq!(refused(&norms(&[])), ["norm_in"]);
    }

    #[test]
    fn every_fault_is_named() {
        let wrong = Params {
            max_fields: 0,
            w_gen: 0.5,
            w_prune: 0.4,
            tau_lambda: 1.5,
            init_p: f64::NAN,
            d_floor: 2.0,
            d_ceiling: 1.0,
            ..Params::default()
        };
        let keys = ["max_fields", "w_prune", "tau_lambda", "init_p", "d_ceiling"];
        assert_eq!(refused(&wrong), keys);
    }

    /// Whatever a profile may say, the learner takes.
    #[test]
    fn the_bounds_build() {
        let (least, most) = (
            Params {
                max_fields: 1,
                init_d: 1e-6,
                init_alpha: 0.0,
                penalty: 0.0,
                w_gen: 0.001,
                w_prune: 0.001,
                init_lambda: 0.5,
                final_lambda: 0.5,
                tau_lambda: 0.0,
                init_p: 1e-6,
                init_s2: 1e-15,
                add_threshold: 0.0,
                meta_rate: 0.0,
                d_floor: 1e-6,
                d_ceiling: 1e-6,
                min_one_minus_h: 1e-6,
                norm_in: vec![1e-6],
                norm_out: 1e-6,
                ..Params::default()
            },
            Params {
                max_fields: 10_000,
                init_d: 1e6,
                init_alpha: 1e6,
                penalty: 1.0,
                w_gen: 0.99,
                w_prune: 1.0,
                init_lambda: 1.0,
                final_lambda: 1.0,
                tau_lambda: 1.0,
                init_p: 1e15,
                init_s2: 1e6,
                add_threshold: 1.0,
                meta_rate: 1e6,
                d_floor: 1e6,
                d_ceiling: 1e9,
                min_one_minus_h: 1.0,
                norm_in: vec![1e6; 6],
                norm_out: 1e6,
                ..Params::default()
            },
        );
        for params in [least, most] {
            assert_eq!(refused(&params), [""; 0]);
            for kind in [Kind::Rfwr, Kind::Lwpr] {
                let params = Params { kind, ..params.clone() };
                assert!(params.build(params.norm_in.len(), 10.0).is_ok());
            }
        }
    }
}
