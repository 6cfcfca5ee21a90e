//! Policies: what a robot has learned, exact to the last bit.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::document::{self, Document};
use super::{Error, Storable};
use crate::sharing::Mode;

/// A learner with what is needed to let it act.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Policy<M> {
    /// The program's version.
    pub version: String,
    /// The task's name outside; [`TABLE`] where it was learned from a table.
    pub task: String,
    /// The profile's name.
    pub preset: String,
    /// What the robot did while it learned.
    pub mode: Mode,
    /// After which part of main, in percent.
    pub percent: u8,
    /// The names of the learner's inputs, in order.
    pub features: Vec<String>,
    /// The names of its outputs, in order.
    #[serde(default = "human_action")]
    pub outputs: Vec<String>,
    /// The largest action, in the plant's unit; none for a table's.
    pub action_limit: Option<f64>,
    /// What it has learned, with its settings.
    pub learner: M,
}

/// What stands for task and preset of a policy that was learned from a table.
pub const TABLE: &str = "table";

fn human_action() -> Vec<String> {
    vec!["u_human".to_owned()]
}

impl<M> Document for Policy<M> {
    const KIND: &'static str = "policy";
    const PRETTY: bool = true;
}

impl<M> Policy<M> {
    /// Why this policy cannot act in `task`, which shows a learner these `features`; none
    /// when it can. `columns` are the numbers of inputs and outputs that its learner has.
    /// A table's policy serves any task whose features are its inputs.
    #[must_use]
    pub fn misfit(&self, task: &str, features: &[&str], columns: (usize, usize)) -> Option<String> {
        if self.task != task && self.task != TABLE {
            return Some(format!("this policy is for {}, not for {task}", self.task));
        }
        if self.features != features || columns.0 != features.len() {
            let (given, wanted) = (self.features.join(","), features.join(","));
            return Some(format!(
                "this policy has {} inputs, {given}, where {task} has {}, {wanted}",
                columns.0,
                features.len()
            ));
        }
        if self.outputs.len() != columns.1 {
            let (named, has) = (self.outputs.join(","), columns.1);
            return Some(format!(
                "this policy names the outputs {named}, but its learner has {has}"
            ));
        }
        (columns.1 != 1)
            .then(|| format!("this policy has {} outputs where {task} takes one action", columns.1))
    }
}

/// The name of the policy's file: `policy-010.json` after 10 % of main, `policy.json` for
/// the final one.
#[must_use]
pub fn file_name(percent: Option<u8>) -> String {
    percent.map_or_else(|| "policy.json".to_owned(), |p| format!("policy-{p:03}.json"))
}

/// Reads a policy.
///
/// # Errors
/// When the file is missing, is not JSON, is cut off, is something else than a policy of
/// this program, has a newer schema, or holds a value that the learner cannot take.
pub fn read_policy<M: Storable>(path: &Path) -> Result<Policy<M>, Error> {
    document::read(path)
}

/// The text of a policy that is to stand in `path`.
///
/// # Errors
/// When it holds a number that is not finite.
pub fn policy_text<M: Storable>(path: &Path, policy: &Policy<M>) -> Result<Vec<u8>, Error> {
    document::text(path, policy)
}

/// Writes a policy to `path`, whole and synced.
///
/// # Errors
/// When it holds a number that is not finite, or the disk refuses.
pub fn write_policy<M: Storable>(path: &Path, policy: &Policy<M>) -> Result<(), Error> {
    document::write(path, policy, true)
}
