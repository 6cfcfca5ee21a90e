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
    /// The task's name outside.
    pub task: String,
    /// The profile's name.
    pub preset: String,
    /// What the robot did while it learned.
    pub mode: Mode,
    /// After which part of main, in percent.
    pub percent: u8,
    /// The names of the learner's inputs, in order.
    pub features: Vec<String>,
    /// The largest action, in the plant's unit.
    pub action_limit: f64,
    /// What it has learned, with its settings.
    pub learner: M,
}

impl<M> Document for Policy<M> {
    const KIND: &'static str = "policy";
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

/// Writes a policy to `path`, whole and synced.
///
/// # Errors
/// When it holds a number that is not finite, or the disk refuses.
pub fn write_policy<M: Storable>(path: &Path, policy: &Policy<M>) -> Result<(), Error> {
    document::write(path, policy, true)
}
