//! The first number of a session that another calculation does not give.

use std::fmt::{self, Display};

use serde::Serialize;

use crate::record::{EpisodeRow, StepRow};
use crate::session::Phase;
use crate::signal::End;

/// Where a recorded session differs from its repetition, and how.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// The file.
    pub file: &'static str,
    /// Its line, from 1 (the header).
    pub line: u64,
    /// The phase in the recorded row,
    pub phase: Phase,
    /// its rollout,
    pub episode: u32,
    /// and its step; `None` in `episodes.csv`.
    pub step: Option<u32>,
    /// The column.
    pub column: String,
    /// What stands there; empty for an empty cell.
    pub recorded: String,
    /// What was computed.
    pub computed: String,
}

impl Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown =
            |cell: &str| if cell.is_empty() { "nothing".to_owned() } else { cell.to_owned() };
        write!(f, "{} {}", self.phase, self.episode)?;
        if let Some(step) = self.step {
            write!(f, ", step {step}")?;
        }
        write!(
            f,
            ", column {}: recorded {}, computed {} ({}, line {})",
            self.column,
            shown(&self.recorded),
            shown(&self.computed),
            self.file,
            self.line
        )?;
        // The actions follow from what the person did, which is not computed.
        if self.file == "steps.csv" && ["u", "u_applied", "success"].contains(&self.column.as_str())
        {
            write!(f, " (u_human is taken as recorded: it may be the one that changed)")?;
        }
        Ok(())
    }
}

/// A difference whose line is not known yet.
pub(super) struct Cell(Difference);

impl Cell {
    /// In `steps.csv`, after so many rows.
    pub(super) fn at_row(self, rows: u64) -> Difference {
        Difference { line: rows + 2, ..self.0 }
    }

    /// In `episodes.csv`, after so many rows.
    pub(super) fn at_rollout(self, rows: u64) -> Difference {
        self.at_row(rows)
    }
}

/// Compares what was recorded with what was computed, column by column.
struct Comparison {
    found: Option<(String, String, String)>,
}

impl Comparison {
    fn note(
        &mut self,
        column: &str,
        is_same: bool,
        recorded: impl Display,
        computed: impl Display,
    ) {
        if !is_same && self.found.is_none() {
            self.found = Some((column.to_owned(), recorded.to_string(), computed.to_string()));
        }
    }

    fn same<T: PartialEq + Display>(&mut self, column: &str, recorded: T, computed: T) {
        self.note(column, recorded == computed, recorded, computed);
    }

    fn number(&mut self, column: &str, recorded: f64, computed: f64) {
        self.optional(column, Some(recorded), Some(computed));
    }

    /// Two numbers are the same when all their bits are; what is no number has no bits that a
    /// table keeps.
    fn optional(&mut self, column: &str, recorded: Option<f64>, computed: Option<f64>) {
        let bits =
            |value: Option<f64>| value.map(|v| if v.is_nan() { f64::NAN } else { v }.to_bits());
        let shown = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:?}"));
        self.note(column, bits(recorded) == bits(computed), shown(recorded), shown(computed));
    }

    /// The cell in the row of `phase`, `episode` and `step`.
    fn cell(
        self,
        file: &'static str,
        phase: Phase,
        episode: u32,
        step: Option<u32>,
    ) -> Option<Cell> {
        let (column, recorded, computed) = self.found?;
        let line = 0;
        Some(Cell(Difference { file, line, phase, episode, step, column, recorded, computed }))
    }
}

/// The first difference between two rows of `steps.csv`, whose states have these `columns`. The
/// lateness and the device's deflection are the person's day, not the session's numbers.
pub(super) fn rows(
    recorded: &StepRow<String>,
    computed: Option<&StepRow>,
    columns: &[String],
) -> Option<Cell> {
    let mut compare = Comparison { found: None };
    if let Some(computed) = computed {
        compare.same("phase", recorded.phase, computed.phase);
        compare.same("episode", recorded.episode, computed.episode);
        compare.same("step", recorded.step, computed.step);
        compare.number("t", recorded.t, computed.t);
        for (index, column) in columns.iter().enumerate() {
            let at = |state: &[f64]| state.get(index).copied();
            compare.optional(column, at(&recorded.state), at(&computed.state));
        }
        compare.optional("u_human", recorded.u_human, computed.u_human);
        compare.optional("u_machine", recorded.u_machine, computed.u_machine);
        compare.optional("share", recorded.share, computed.share);
        compare.optional("u", recorded.u, computed.u);
        compare.optional("u_applied", recorded.u_applied, computed.u_applied);
        compare.optional("reward", recorded.reward, computed.reward);
        compare.optional("success", recorded.success, computed.success);
        let region = recorded.region.as_deref().unwrap_or_default();
        compare.same("region", region, computed.region.unwrap_or_default());
    } else {
        compare.note("phase", false, recorded.phase, "the session is over");
    }
    compare.cell("steps.csv", recorded.phase, recorded.episode, Some(recorded.step))
}

/// The first difference between two rows of `episodes.csv`, with the task's own columns `tally`.
pub(super) fn episodes(
    recorded: &EpisodeRow,
    computed: &EpisodeRow,
    tally: &[String],
) -> Option<Cell> {
    let mut compare = Comparison { found: None };
    let count = |fields: Option<u32>| fields.map_or(String::new(), |fields| fields.to_string());
    compare.same("phase", recorded.phase, computed.phase);
    compare.same("episode", recorded.episode, computed.episode);
    compare.number("start", recorded.start, computed.start);
    compare.same("steps", recorded.steps, computed.steps);
    compare.number("duration_s", recorded.duration_s, computed.duration_s);
    compare.same("end", recorded.end.word(), computed.end.word());
    compare.number("return", recorded.total, computed.total);
    compare.number("mean_reward", recorded.mean_reward, computed.mean_reward);
    compare.optional("share", recorded.share, computed.share);
    compare.optional("success", recorded.success, computed.success);
    let fields = (count(recorded.receptive_fields), count(computed.receptive_fields));
    compare.same("receptive_fields", fields.0, fields.1);
    for (index, column) in tally.iter().enumerate() {
        let at = |tallied: &[f64]| tallied.get(index).copied();
        compare.optional(column, at(&recorded.tallied), at(&computed.tallied));
    }
    compare.cell("episodes.csv", recorded.phase, recorded.episode, None)
}

/// A rollout ended by the task, says the table, at `row`, after so many `rows`; but in its
/// repetition it goes on.
pub(super) fn ended_otherwise(row: &StepRow<String>, rows: u64, end: End) -> Difference {
    Difference {
        file: "steps.csv",
        line: rows + 2,
        phase: row.phase,
        episode: row.episode,
        step: Some(row.step),
        column: "reward".to_owned(),
        recorded: format!("the end of the rollout ({})", end.word()),
        computed: "the rollout goes on".to_owned(),
    }
}

/// `steps.csv` ends after so many `rows`; but the session goes on with the step at this place.
pub(super) fn missing_row((phase, episode, step): (Phase, u32, u32), rows: u64) -> Difference {
    Difference {
        file: "steps.csv",
        line: rows + 2,
        phase,
        episode,
        step: Some(step),
        column: "step".to_owned(),
        recorded: "the end of the table".to_owned(),
        computed: "the session goes on".to_owned(),
    }
}

/// `episodes.csv` ends after so many `rows`; but the session has one more rollout, `computed`.
pub(super) fn missing_rollout(computed: &EpisodeRow, rows: u64) -> Difference {
    Difference {
        file: "episodes.csv",
        line: rows + 2,
        phase: computed.phase,
        episode: computed.episode,
        step: None,
        column: "end".to_owned(),
        recorded: "the end of the table".to_owned(),
        computed: computed.end.word().to_owned(),
    }
}

/// `episodes.csv` tells, after so many `rows`, of one more rollout; but the session has none.
pub(super) fn surplus_rollout(recorded: &EpisodeRow, rows: u64) -> Difference {
    Difference {
        file: "episodes.csv",
        line: rows + 2,
        phase: recorded.phase,
        episode: recorded.episode,
        step: None,
        column: "end".to_owned(),
        recorded: recorded.end.word().to_owned(),
        computed: "no such rollout".to_owned(),
    }
}
