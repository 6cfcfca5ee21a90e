//! Online learners: what the robot knows of its operator.

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
    /// The sample is refused, and the learner untouched, when a length is wrong or a number
    /// is not finite.
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
    /// The sample has another number of inputs or outputs than the learner.
    #[error("the sample has {given} numbers where the learner takes {wanted}")]
    Length {
        /// How many the learner takes.
        wanted: usize,
        /// How many were given.
        given: usize,
    },
}
