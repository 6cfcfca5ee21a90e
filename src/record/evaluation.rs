//! `evaluation.csv`: what each tenth's policy achieves alone.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::names::EVALUATION_COLUMNS;
use super::{EpisodeRow, Error, document};
use crate::signal::{End, Tallied};

/// A row of `evaluation.csv`: one autonomous rollout of one policy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvaluationRow {
    /// The policy's file without its ending, such as `policy-010`.
    pub policy: String,
    /// The rollout, from 1.
    pub episode: u32,
    /// The start state's telling number.
    pub start: f64,
    /// Controlled steps.
    pub steps: u32,
    /// Controlled time, s.
    pub duration_s: f64,
    /// Why it ended.
    pub end: End,
    /// The sum of rewards.
    #[serde(rename = "return")]
    pub total: f64,
    /// The mean of rewards.
    pub mean_reward: f64,
    /// What the task counted, in columns of its own.
    pub tallied: Tallied,
}

impl EvaluationRow {
    /// The row of `rollout`, done by `policy`.
    #[must_use]
    pub fn of(policy: String, rollout: &EpisodeRow) -> Self {
        let EpisodeRow { episode, start, steps, duration_s, end, total, .. } = *rollout;
        let EpisodeRow { mean_reward, tallied, .. } = *rollout;
        Self { policy, episode, start, steps, duration_s, end, total, mean_reward, tallied }
    }
}

/// Writes all rows, with the `tally`'s names, as one file that is there whole or not at all. A resumed session that
/// evaluates once more replaces its own.
///
/// # Errors
/// When the disk refuses.
pub fn write_evaluation(
    path: &Path,
    tally: &[&str],
    rows: &[EvaluationRow],
    durable: bool,
) -> Result<(), Error> {
    let mut table = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    let unfit = |fault: &dyn std::fmt::Display| Error::unfit(path, format!("not written: {fault}"));
    let header = EVALUATION_COLUMNS.iter().chain(tally);
    table.write_record(header).map_err(|fault| unfit(&fault))?;
    for row in rows {
        table.serialize(row).map_err(|fault| unfit(&fault))?;
    }
    let bytes = table.into_inner().map_err(|fault| unfit(&fault))?;
    document::replace(path, &bytes, durable)
}
