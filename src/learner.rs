//! Online learners: what the robot knows of its operator.
//!
//! [`Params`] is a profile's section, from which [`Params::build`] makes a [`Model`].

#![expect(
    clippy::inline_always,
    reason = "only what is inlined is compiled for the vector unit: see `lanes::Work`"
)]

mod columns;
mod growth;
mod kernel;
mod lanes;
pub mod lwpr;
mod metric;
mod near;
mod params;
mod records;
pub mod rfwr;
mod sample;
mod settings;
mod shapes;
mod store;

use serde::{Deserialize, Serialize};

pub use kernel::Kernel;
pub use metric::Metric;
pub use params::{Kind, Params};

/// A learner that takes one sample at a time.
///
/// Inputs and outputs are raw (in the task's units); a learner divides them by its own
/// norms.
pub trait Learner: Send {
    /// The number of inputs n.
    fn inputs(&self) -> usize;

    /// The number of outputs.
    fn outputs(&self) -> usize;

    /// Learns that `x` (length [`inputs`](Self::inputs)) should give `y` (length
    /// [`outputs`](Self::outputs)). `weight` ≥ 0 multiplies a field's activation in
    /// regression and metric, not in the decisions about cutoff, growth and pruning;
    /// 1 is the published algorithm.
    ///
    /// # Errors
    /// The sample is refused, and the learner untouched, when a length is wrong, a number
    /// is not finite (also after division by the norms), or the weight is negative.
    fn update(&mut self, x: &[f64], y: &[f64], weight: f64) -> Result<(), Refusal>;

    /// Writes the prediction for `x` into `y` and returns the largest activation of any
    /// field: 0 where nothing is known. Every written number is finite and within the
    /// output limit, whatever `x` is.
    fn predict(&self, x: &[f64], y: &mut [f64]) -> f64;

    /// The number of receptive fields.
    fn fields(&self) -> usize;
}

/// Why a sample was not learned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// A number is NaN or infinite.
    #[error("the sample holds a number that is not finite")]
    NotFinite,
    /// The weight is below 0.
    #[error("the sample's weight is negative")]
    NegativeWeight,
    /// The sample has another number of inputs or outputs than the learner.
    #[error("the sample has {given} numbers where the learner takes {wanted}")]
    Length {
        /// How many the learner takes.
        wanted: usize,
        /// How many were given.
        given: usize,
    },
}

/// Any of the learners, to be cloned, stored and read back. A model read back is checked,
/// equal to the last bit, and learns on as the stored one would have.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Model {
    /// Receptive Field Weighted Regression.
    Rfwr(rfwr::Rfwr),
    /// Locally Weighted Projection Regression.
    Lwpr(lwpr::Lwpr),
}

impl Learner for Model {
    fn inputs(&self) -> usize {
        match self {
            Self::Rfwr(rfwr) => rfwr.inputs(),
            Self::Lwpr(lwpr) => lwpr.inputs(),
        }
    }

    fn outputs(&self) -> usize {
        match self {
            Self::Rfwr(rfwr) => rfwr.outputs(),
            Self::Lwpr(lwpr) => lwpr.outputs(),
        }
    }

    fn update(&mut self, x: &[f64], y: &[f64], weight: f64) -> Result<(), Refusal> {
        match self {
            Self::Rfwr(rfwr) => rfwr.update(x, y, weight),
            Self::Lwpr(lwpr) => lwpr.update(x, y, weight),
        }
    }

    fn predict(&self, x: &[f64], y: &mut [f64]) -> f64 {
        match self {
            Self::Rfwr(rfwr) => rfwr.predict(x, y),
            Self::Lwpr(lwpr) => lwpr.predict(x, y),
        }
    }

    fn fields(&self) -> usize {
        match self {
            Self::Rfwr(rfwr) => rfwr.fields(),
            Self::Lwpr(lwpr) => lwpr.fields(),
        }
    }
}

/// Why a learner could not be made, from settings or from a file.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BuildError {
    /// A list is too long or too short.
    #[error("the learner's `{key}` has {given} numbers where {wanted} are needed")]
    Length {
        /// The setting.
        key: &'static str,
        /// How many it has.
        given: usize,
        /// How many it needs.
        wanted: usize,
    },
    /// No inputs, no outputs, or too many.
    #[error("the learner cannot have {given} {key}; 1 to 64 are possible")]
    Size {
        /// `inputs` or `outputs`.
        key: &'static str,
        /// How many were asked for.
        given: usize,
    },
    /// A number is outside its range.
    #[error("the learner's `{key}` is {value}; it must be from {from} to {to}")]
    Range {
        /// The setting.
        key: &'static str,
        /// Its value.
        value: f64,
        /// The smallest possible.
        from: f64,
        /// The largest possible.
        to: f64,
    },
    /// A full matrix where only its diagonal would be used.
    #[error("the learner's `init_d` is a full matrix; give its diagonal, or `diag_only: false`")]
    FullMetric,
    /// A matrix that measures no distances.
    #[error("the learner's `init_d` must be symmetric and positive definite")]
    NoMetric,
    /// Stored centres and metrics that cannot be.
    #[error("the stored centres and metrics do not fit {fields} fields, or are no metrics")]
    Shapes {
        /// The number of fields stored.
        fields: usize,
    },
    /// A stored field that cannot be.
    #[error("the stored field {field} has lists of a wrong length or numbers that cannot be")]
    Field {
        /// Its index.
        field: usize,
    },
}
