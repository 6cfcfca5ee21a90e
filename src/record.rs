//! What is kept of a session: the rows of its CSV files and its JSON files.
//!
//! ```text
//! control ─ rows, checkpoints, policies ─▶ Recorder ─ bounded queue ─▶ writer thread ─▶ folder
//! ```
//!
//! The CSV files are only appended to, whole rows at a time; the JSON files are replaced
//! whole. A kill at any byte therefore leaves every whole row and the latest whole
//! checkpoint readable, and [`Folder::resume`] goes on from there.

pub mod assignment;
pub mod checkpoint;
mod document;
mod error;
pub mod evaluation;
pub mod export;
mod finite;
pub mod folder;
mod layout;
mod names;
pub mod policy;
pub mod reader;
pub mod sidecar;
pub mod skim;
mod steps;
mod table;
pub mod writer;

pub use checkpoint::{Checkpoint, Momentum, Resumed};
pub use document::{Document, read as read_document, write as write_document};
pub use error::{Error, plain};
pub use evaluation::EvaluationRow;
pub use folder::Folder;
pub use policy::{Policy, policy_text, read_policy};
pub use sidecar::{Sidecar, Status, read_sidecar, sidecar_of};
pub use steps::StepFile;
pub use writer::{Columns, Manner, Recorder};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::session::Phase;
use crate::signal::{End, State, Tallied};

/// This program's version, as stored in every JSON file.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A learner that can be stored and sent to the writer.
pub trait Storable: Serialize + DeserializeOwned + Send + 'static {}

impl<T: Serialize + DeserializeOwned + Send + 'static> Storable for T {}

/// A row of `steps.csv`: the state sensed before the action, the actions of the tick, and
/// the reward, share and success used in it. What is missing is an empty cell.
/// The fields are in the order of the columns. Rows read back own their region's name.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StepRow<Name = &'static str> {
    /// The phase.
    pub phase: Phase,
    /// The rollout within the phase, from 1.
    pub episode: u32,
    /// The control step within the rollout, from 0.
    pub step: u32,
    /// step·dt, s.
    pub t: f64,
    /// The state sensed before the action.
    pub state: State,
    /// The operator's action, plant's unit.
    pub u_human: Option<f64>,
    /// The learner's action.
    pub u_machine: Option<f64>,
    /// The person's share w.
    pub share: Option<f64>,
    /// The mixed action.
    pub u: Option<f64>,
    /// The action that the plant received.
    pub u_applied: Option<f64>,
    /// The reward of the state.
    pub reward: Option<f64>,
    /// The success after this reward.
    pub success: Option<f64>,
    /// The name of the state's region.
    pub region: Option<Name>,
    /// How late the tick began, µs; 0 on virtual time.
    pub lateness_us: u32,
    /// The deflection of the operator's device, before it was shaped.
    pub raw: Option<f64>,
}

impl<Name> StepRow<Name> {
    /// The row of a rollout's ending state: no action follows it.
    #[must_use]
    pub const fn ending(phase: Phase, episode: u32, step: u32, t: f64, state: State) -> Self {
        Self {
            phase,
            episode,
            step,
            t,
            state,
            u_human: None,
            u_machine: None,
            share: None,
            u: None,
            u_applied: None,
            reward: None,
            success: None,
            region: None,
            lateness_us: 0,
            raw: None,
        }
    }
}

/// A row of `episodes.csv`: one rollout.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeRow {
    /// The phase.
    pub phase: Phase,
    /// The rollout within the phase, from 1.
    pub episode: u32,
    /// The start state's telling number (release angle, rad).
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
    /// The person's share at its end.
    pub share: Option<f64>,
    /// The success at its end.
    pub success: Option<f64>,
    /// The learner's receptive fields at its end.
    pub receptive_fields: Option<u32>,
    /// What the task counted, in columns of its own.
    pub tallied: Tallied,
}

/// A row of `events.csv`: a transition, fault, discard or change of a device.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EventRow<Word = &'static str> {
    /// The wall's date and time; empty on virtual time.
    pub time: String,
    /// Where in the session, if anywhere.
    pub phase: Option<Phase>,
    /// The rollout.
    pub episode: Option<u32>,
    /// The step.
    pub step: Option<u32>,
    /// What happened, a word.
    pub event: Word,
    /// Why; line breaks become blanks when it is written.
    pub cause: String,
}
