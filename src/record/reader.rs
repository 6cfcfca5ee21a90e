//! Reads tables back: every whole row, wherever the file was cut.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use csv::StringRecord;
use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::Error as WordError;

use super::names::{
    EPISODE_COLUMNS, EVALUATION_COLUMNS, EVENT_COLUMNS, LATER_STEP_COLUMNS, STEP_COLUMNS,
};
use super::{EpisodeRow, Error, EvaluationRow, EventRow, StepRow, table};
use crate::signal::{State, Tallied};

/// The rows of `steps.csv`, one at a time.
pub struct Steps {
    lines: Lines,
    columns: Vec<String>,
    /// Whether the deflections of the device were recorded already.
    has_raw: bool,
}

impl Steps {
    /// Opens a `steps.csv`.
    ///
    /// # Errors
    /// When it cannot be read, or is another kind of table.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let lines = Lines::open(path, u64::MAX)?;
        let (before, after) = STEP_COLUMNS;
        let state = lines.header.iter().skip(before.len()).take_while(|name| *name != after[0]);
        let columns: Vec<String> = state.map(str::to_owned).collect();
        let expected: Vec<&str> =
            before.into_iter().chain(columns.iter().map(String::as_str)).chain(after).collect();
        lines.demand(&expected)?;
        let has_raw =
            lines.header.iter().nth(expected.len()) == LATER_STEP_COLUMNS.first().copied();
        Ok(Self { lines, columns, has_raw })
    }

    /// The names of the state's numbers.
    #[must_use]
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    fn row(&self) -> Result<StepRow<String>, Error> {
        let mut cells = self.lines.cells();
        let (phase, episode, step, t) =
            (cells.word()?, cells.value()?, cells.value()?, cells.value()?);
        let mut state = Vec::with_capacity(self.columns.len());
        for _ in &self.columns {
            state.push(cells.value()?);
        }
        let state = State::from_slice(&state)
            .ok_or_else(|| Error::unfit(&self.lines.path, "it has too many state columns"))?;
        Ok(StepRow {
            phase,
            episode,
            step,
            t,
            state,
            u_human: cells.optional()?,
            u_machine: cells.optional()?,
            share: cells.optional()?,
            u: cells.optional()?,
            u_applied: cells.optional()?,
            reward: cells.optional()?,
            success: cells.optional()?,
            region: cells.optional()?,
            lateness_us: cells.value()?,
            raw: if self.has_raw { cells.optional()? } else { None },
        })
    }
}

impl Iterator for Steps {
    type Item = Result<StepRow<String>, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        self.lines.advance().map(|read| read.and_then(|()| self.row()))
    }
}

/// The rows of `episodes.csv`, one at a time.
pub struct Episodes {
    lines: Lines,
    tally: Vec<String>,
}

impl Episodes {
    /// Opens an `episodes.csv`.
    ///
    /// # Errors
    /// When it cannot be read, or is another kind of table.
    pub fn open(path: &Path) -> Result<Self, Error> {
        Self::open_until(path, u64::MAX)
    }

    /// Opens the first `length` bytes of an `episodes.csv`.
    pub(super) fn open_until(path: &Path, length: u64) -> Result<Self, Error> {
        let lines = Lines::open(path, length)?;
        lines.demand(&EPISODE_COLUMNS)?;
        let tally = lines.header.iter().skip(EPISODE_COLUMNS.len()).map(str::to_owned).collect();
        Ok(Self { lines, tally })
    }

    /// The names of what the task counted.
    #[must_use]
    pub fn tally(&self) -> &[String] {
        &self.tally
    }

    fn row(&self) -> Result<EpisodeRow, Error> {
        let mut cells = self.lines.cells();
        Ok(EpisodeRow {
            phase: cells.word()?,
            episode: cells.value()?,
            start: cells.value()?,
            steps: cells.value()?,
            duration_s: cells.value()?,
            end: cells.word()?,
            total: cells.value()?,
            mean_reward: cells.value()?,
            share: cells.optional()?,
            success: cells.optional()?,
            receptive_fields: cells.optional()?,
            tallied: cells.tallied(self.tally.len())?,
        })
    }
}

impl Iterator for Episodes {
    type Item = Result<EpisodeRow, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        self.lines.advance().map(|read| read.and_then(|()| self.row()))
    }
}

/// Reads an `events.csv` whole.
///
/// # Errors
/// When it cannot be read, is another kind of table, or a cell is wrong.
pub fn read_events(path: &Path) -> Result<Vec<EventRow<String>>, Error> {
    // A cause is a sentence, and may hold commas.
    let mut lines = Lines::open_as(path, u64::MAX, true)?;
    lines.demand(&EVENT_COLUMNS)?;
    let mut rows = Vec::new();
    while let Some(read) = lines.advance() {
        read?;
        let mut cells = lines.cells();
        rows.push(EventRow {
            time: cells.value()?,
            phase: cells.optional_word()?,
            episode: cells.optional()?,
            step: cells.optional()?,
            event: cells.value()?,
            cause: cells.value()?,
        });
    }
    Ok(rows)
}

/// Reads an `evaluation.csv` whole.
///
/// # Errors
/// When it cannot be read, is another kind of table, or a cell is wrong.
pub fn read_evaluation(path: &Path) -> Result<Vec<EvaluationRow>, Error> {
    Evaluations::open(path)?.collect()
}

/// The rows of `evaluation.csv`, one at a time.
pub struct Evaluations {
    lines: Lines,
    counted: usize,
}

impl Evaluations {
    /// Opens an `evaluation.csv`.
    ///
    /// # Errors
    /// When it cannot be read, or is another kind of table.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let lines = Lines::open(path, u64::MAX)?;
        lines.demand(&EVALUATION_COLUMNS)?;
        let counted = lines.header.len().saturating_sub(EVALUATION_COLUMNS.len());
        Ok(Self { lines, counted })
    }

    fn row(&self) -> Result<EvaluationRow, Error> {
        let mut cells = self.lines.cells();
        Ok(EvaluationRow {
            policy: cells.value()?,
            episode: cells.value()?,
            start: cells.value()?,
            steps: cells.value()?,
            duration_s: cells.value()?,
            end: cells.word()?,
            total: cells.value()?,
            mean_reward: cells.value()?,
            tallied: cells.tallied(self.counted)?,
        })
    }
}

impl Iterator for Evaluations {
    type Item = Result<EvaluationRow, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        self.lines.advance().map(|read| read.and_then(|()| self.row()))
    }
}

/// Whether the table at `path` ends in the middle of a row.
///
/// # Errors
/// When it cannot be read.
pub fn ends_in_half_a_row(path: &Path) -> Result<bool, Error> {
    let whole = table::open_whole(path)?.limit();
    let length = std::fs::metadata(path).map_err(Error::io("read", path))?.len();
    Ok(whole < length)
}

/// The whole lines of a table.
struct Lines {
    path: PathBuf,
    table: csv::Reader<io::Take<File>>,
    /// Empty when not even the header is whole.
    header: StringRecord,
    record: StringRecord,
}

impl Lines {
    /// Opens the first `length` bytes of a table of numbers and words, where nothing is quoted: a
    /// quotation mark would take in all that follows.
    fn open(path: &Path, length: u64) -> Result<Self, Error> {
        Self::open_as(path, length, false)
    }

    fn open_as(path: &Path, length: u64, quoting: bool) -> Result<Self, Error> {
        let mut file = table::open_whole(path)?;
        file.set_limit(file.limit().min(length));
        let mut table = csv::ReaderBuilder::new().flexible(true).quoting(quoting).from_reader(file);
        let header = table.headers().cloned().map_err(|fault| misread(path, fault))?;
        Ok(Self { path: path.to_owned(), table, header, record: StringRecord::new() })
    }

    /// Demands these columns; later ones may follow.
    fn demand(&self, expected: &[&str]) -> Result<(), Error> {
        let wrong = expected.iter().zip(&self.header).find(|(expected, name)| **expected != *name);
        if let Some((expected, name)) = wrong {
            return Err(Error::Cell {
                path: self.path.clone(),
                line: 1,
                column: name.to_owned(),
                problem: format!("the column {expected} is expected here"),
            });
        }
        match expected.get(self.header.len()) {
            Some(missing) if !self.header.is_empty() => {
                Err(Error::unfit(&self.path, format!("the column {missing} is missing")))
            }
            _ => Ok(()),
        }
    }

    /// Reads the next line.
    fn advance(&mut self) -> Option<Result<(), Error>> {
        match self.table.read_record(&mut self.record) {
            Ok(true) => Some(Ok(())),
            Ok(false) => None,
            Err(fault) => Some(Err(misread(&self.path, fault))),
        }
    }

    fn cells(&self) -> Cells<'_> {
        Cells { lines: self, index: 0 }
    }
}

fn misread(path: &Path, fault: csv::Error) -> Error {
    match fault.into_kind() {
        csv::ErrorKind::Io(cause) => Error::Io { action: "read", path: path.to_owned(), cause },
        csv::ErrorKind::Utf8 { pos, err } => Error::Cell {
            path: path.to_owned(),
            line: pos.map_or(1, |pos| pos.line()),
            column: (err.field() + 1).to_string(),
            problem: "this is not text (UTF-8)".to_owned(),
        },
        other => Error::unfit(path, format!("this is not a readable table: {other:?}")),
    }
}

/// Letters of a problem that are told.
const LONGEST: usize = 300;

/// The cells of a line, from left to right.
struct Cells<'a> {
    lines: &'a Lines,
    index: usize,
}

impl<'a> Cells<'a> {
    fn next(&mut self) -> Result<&'a str, Error> {
        let cell = self.lines.record.get(self.index);
        self.index += 1;
        cell.ok_or_else(|| self.wrong("the line ends before this column"))
    }

    /// A fault of the cell taken last.
    fn wrong(&self, problem: impl Into<String>) -> Error {
        let column = self.lines.header.get(self.index - 1).unwrap_or("?");
        let problem: String = problem.into();
        // A spoilt cell may be as long as the file.
        let told: String = problem.chars().take(LONGEST).collect();
        let more = if told.len() < problem.len() { "…" } else { "" };
        Error::Cell {
            path: self.lines.path.clone(),
            line: self.lines.record.position().map_or(0, csv::Position::line),
            column: column.to_owned(),
            problem: format!("{told}{more}"),
        }
    }

    /// Whether the next cell is empty; it is then taken.
    fn skip_empty(&mut self) -> bool {
        let empty = self.lines.record.get(self.index) == Some("");
        self.index += usize::from(empty);
        empty
    }

    fn value<T: Kind>(&mut self) -> Result<T, Error> {
        let cell = self.next()?;
        cell.parse().map_err(|_| self.wrong(format!("{cell:?} is not {}", T::WORD)))
    }

    fn optional<T: Kind>(&mut self) -> Result<Option<T>, Error> {
        if self.skip_empty() { Ok(None) } else { self.value().map(Some) }
    }

    /// One of the words of `T`.
    fn word<T: Deserialize<'a>>(&mut self) -> Result<T, Error> {
        let cell = self.next()?;
        let word: Result<T, WordError> = T::deserialize(cell.into_deserializer());
        word.map_err(|fault| self.wrong(fault.to_string()))
    }

    /// The `count` numbers that a task counted; beyond what is kept, later columns.
    fn tallied(&mut self, count: usize) -> Result<Tallied, Error> {
        let mut numbers = Vec::with_capacity(count);
        for _ in 0..count.min(Tallied::CAPACITY) {
            numbers.push(self.value()?);
        }
        Ok(Tallied::from_slice(&numbers).unwrap_or_default())
    }

    fn optional_word<T: Deserialize<'a>>(&mut self) -> Result<Option<T>, Error> {
        if self.skip_empty() { Ok(None) } else { self.word().map(Some) }
    }
}

/// What a cell can hold.
trait Kind: std::str::FromStr {
    const WORD: &'static str;
}

impl Kind for f64 {
    const WORD: &'static str = "a number";
}

impl Kind for u32 {
    const WORD: &'static str = "a whole number from 0 to 4294967295";
}

impl Kind for String {
    const WORD: &'static str = "a text";
}
