//! What a fit led to, as JSON and as sentences.

use std::fmt::Write as _;
use std::path::PathBuf;

use serde::Serialize;

use crate::learner::lwpr::Submodel;
use crate::learner::{Kind, Learner, Model};
use crate::run::RunError;
use crate::study::fit::{Fitted, mean};

/// What `fit --json` prints.
#[derive(Debug, Serialize)]
pub(super) struct Results {
    schema: u32,
    learner: &'static str,
    inputs: Vec<String>,
    samples: u64,
    refused: u64,
    /// Of all outputs together.
    fields: usize,
    pruned: u64,
    /// Of several outputs the mean; null where no output varies.
    nmse_one_step: Option<f64>,
    nmse_final: Option<f64>,
    samples_per_s: Option<f64>,
    outputs: Vec<OutputResults>,
}

#[derive(Debug, Serialize)]
struct OutputResults {
    name: String,
    nmse_one_step: Option<f64>,
    nmse_final: Option<f64>,
}

impl Results {
    pub(super) fn new(
        kind: Kind,
        learner: &Model,
        fitted: &Fitted,
        (inputs, outputs): (&[String], &[String]),
    ) -> Self {
        let errors = fitted.one_step.iter().zip(&fitted.last);
        let output = |(name, (one_step, last)): (&String, (&Option<f64>, &Option<f64>))| {
            OutputResults { name: name.clone(), nmse_one_step: *one_step, nmse_final: *last }
        };
        #[expect(clippy::cast_precision_loss, reason = "a count of samples")]
        let rate = fitted.samples as f64 / fitted.seconds;
        Self {
            schema: 1,
            learner: kind.word(),
            inputs: inputs.to_vec(),
            samples: fitted.samples,
            refused: fitted.refused,
            fields: learner.fields(),
            pruned: match learner {
                Model::Rfwr(rfwr) => rfwr.pruned(),
                Model::Lwpr(lwpr) => lwpr.submodels().iter().map(Submodel::pruned).sum(),
            },
            nmse_one_step: mean(&fitted.one_step),
            nmse_final: mean(&fitted.last),
            samples_per_s: Some(rate).filter(|rate| rate.is_finite()),
            outputs: outputs.iter().zip(errors).map(output).collect(),
        }
    }

    pub(super) fn json(&self) -> Result<String, RunError> {
        serde_json::to_string(self)
            .map_err(|error| RunError::Failed(format!("the results have no JSON: {error}")))
    }

    /// For people; `files` are what was written, with their kinds.
    pub(super) fn sentences(&self, files: &[(&str, PathBuf)], queries: Option<u64>) -> String {
        let Self { learner, samples, refused, fields, pruned, .. } = self;
        let mut text = format!("{learner}  {samples} samples learned, {refused} refused");
        let _ = write!(text, "\nfields  {fields}, {pruned} pruned");
        let _ = write!(
            text,
            "\nnmse  one step {}, final {}",
            percent(self.nmse_one_step),
            percent(self.nmse_final)
        );
        if self.outputs.len() > 1 {
            for output in &self.outputs {
                let (one_step, last) = (percent(output.nmse_one_step), percent(output.nmse_final));
                let _ = write!(text, "\n  {}  one step {one_step}, final {last}", output.name);
            }
        }
        if let Some(rate) = self.samples_per_s {
            let _ = write!(text, "\nspeed  {rate:.0} samples/s");
        }
        for (what, path) in files {
            let _ = write!(text, "\n{what}  {}", path.display());
            if let (&"predictions", Some(queries)) = (what, queries) {
                let _ = write!(text, ", {queries} of them");
            }
        }
        text
    }
}

fn percent(error: Option<f64>) -> String {
    error.map_or_else(
        || "none (the output does not vary, or its squares overflow)".to_owned(),
        |nmse| format!("{nmse:.4}"),
    )
}
