//! What a run comes to.

use serde::{Deserialize, Serialize};

use super::plan::Labels;

/// What a run came to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Done {
    /// Which run it was.
    pub labels: Labels,
    /// Its numbers.
    pub rows: Vec<Row>,
    /// What the task is measured by, start by start, of the sets with several.
    pub cells: Vec<Cells>,
    /// How main went, thinned out.
    pub curve: Vec<Point>,
    /// The largest value in each cell of the agent's table at the end, by position, then velocity.
    pub table: Option<Table>,
    /// Where the final policies drove.
    pub trajectories: Vec<Trajectory>,
}

/// One number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// After how much of main, %.
    pub checkpoint: u8,
    /// Whose policy: a readout's word, that of a reference, or `team` for main itself.
    pub readout: String,
    /// From where: the name of a set of starts, or `main`.
    pub start: String,
    /// What was measured,
    pub measure: String,
    /// and what came out.
    pub value: f64,
}

/// What a policy did from each start of a set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cells {
    /// After how much of main, %.
    pub checkpoint: u8,
    /// Whose policy.
    pub readout: String,
    /// The set of starts.
    pub start: String,
    /// What the task is measured by, in their order,
    pub values: Vec<f64>,
    /// and the returns.
    pub returns: Vec<f64>,
}

/// A moment of main, at a rollout's end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The rollout, from 1.
    pub episode: u32,
    /// The success,
    pub success: f64,
    /// the person's share,
    pub share: f64,
    /// and what the task is measured by, the mean since the point before; none where it is not
    /// known of any rollout since.
    pub value: Option<f64>,
}

/// The values of an agent's table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Cells along the velocity: those of one position stand together.
    pub row: u32,
    /// The values.
    pub values: Vec<f64>,
}

/// Where a policy drove from one start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trajectory {
    /// Whose policy.
    pub readout: String,
    /// The set of starts.
    pub start: String,
    /// The start in it, from 0.
    pub index: u32,
    /// The states, step by step.
    pub states: Vec<Vec<f64>>,
}
