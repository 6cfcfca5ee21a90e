//! Goes through `steps.csv` fast: for readers of many sessions who need a few of its columns.
//!
//! [`Steps`](super::reader::Steps) reads every cell and says exactly what is wrong with one; this
//! reads cells when they are asked for, and passes over rows that cannot be used.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use csv::ByteRecord;

use super::names::STEP_COLUMNS;
use super::{Error, table};
use crate::session::Phase;

/// The rows of a `steps.csv`, one at a time.
pub struct Skim {
    path: PathBuf,
    table: csv::Reader<io::Take<File>>,
    record: ByteRecord,
    state: usize,
    columns: usize,
    spoilt: Spoilt,
}

/// Rows that were passed over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Spoilt {
    /// How many.
    pub rows: u64,
    /// The line of the first of them, from 1 (the header).
    pub first_line: u64,
}

impl Spoilt {
    /// That in words, where there are some.
    #[must_use]
    pub fn told(self) -> Option<String> {
        let (rows, verb) = match self.rows {
            0 => return None,
            1 => ("a row".to_owned(), "is"),
            rows => (format!("{rows} rows"), "are"),
        };
        let line = self.first_line;
        Some(format!(
            "{rows} {verb} cut off or not of finite numbers, from line {line} on: left out"
        ))
    }
}

/// A number of a row, beside its state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    /// The person's action, plant's unit.
    Human,
    /// The robot's.
    Machine,
    /// The person's share.
    Share,
    /// The mixed action.
    Mixed,
    /// The success.
    Success,
}

impl Number {
    /// Its place among the columns after the state.
    const fn place(self) -> usize {
        match self {
            Self::Human => 0,
            Self::Machine => 1,
            Self::Share => 2,
            Self::Mixed => 3,
            Self::Success => 6,
        }
    }
}

/// The place of the region among the columns after the state.
const REGION: usize = 7;

impl Skim {
    /// Opens a `steps.csv`.
    ///
    /// # Errors
    /// When it cannot be read, or is another kind of table.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let file = table::open_whole(path)?;
        let mut table = csv::ReaderBuilder::new()
            .flexible(true)
            // Nothing in it is quoted: a quotation mark would take in all that follows.
            .quoting(false)
            .buffer_capacity(1 << 17)
            .from_reader(file);
        let header = table.byte_headers().map_err(|fault| misread(path, fault))?;
        let (before, after) = STEP_COLUMNS;
        let head: Vec<&[u8]> = header.iter().collect();
        let is_named = |at: usize, names: &[&str]| {
            names.iter().enumerate().all(|(n, name)| head.get(at + n) == Some(&name.as_bytes()))
        };
        let state = head.iter().skip(before.len()).take_while(|name| **name != after[0].as_bytes());
        let state = state.count();
        let columns = head.len();
        // A file that was cut in its header has no rows either.
        let is_empty = head.is_empty();
        if !(is_empty || is_named(0, &before) && is_named(before.len() + state, &after)) {
            return Err(Error::unfit(path, "its columns are not those of a session's steps"));
        }
        let record = ByteRecord::new();
        Ok(Self { path: path.to_owned(), table, record, state, columns, spoilt: Spoilt::default() })
    }

    /// The next row that can be used.
    ///
    /// # Errors
    /// When the file cannot be read on.
    pub fn next_row(&mut self) -> Result<Option<Row<'_>>, Error> {
        loop {
            match self.table.read_byte_record(&mut self.record) {
                Ok(true) if self.is_sound() => break,
                Ok(true) => {
                    let line = self.record.position().map_or(0, csv::Position::line);
                    self.spoilt.rows += 1;
                    if self.spoilt.first_line == 0 {
                        self.spoilt.first_line = line;
                    }
                }
                Ok(false) => return Ok(None),
                Err(fault) => return Err(misread(&self.path, fault)),
            }
        }
        Ok(Some(Row { cells: &self.record, state: self.state }))
    }

    /// The rows passed over so far.
    #[must_use]
    pub const fn spoilt(&self) -> Spoilt {
        self.spoilt
    }

    /// Whether the row is whole and each of its numbers is finite, or missing where it may be.
    fn is_sound(&self) -> bool {
        let before = STEP_COLUMNS.0.len();
        let region = before + self.state + REGION;
        let row = Row { cells: &self.record, state: self.state };
        self.record.len() == self.columns
            && row.phase().is_some()
            && self.record.iter().enumerate().skip(1).all(|(place, cell)| match cell {
                _ if place == region => true,
                [] => place >= before + self.state,
                // The rollout and the step.
                whole if place < 3 => whole.iter().all(u8::is_ascii_digit),
                number => is_finite(number),
            })
    }
}

/// Whether `cell` is a finite number. Most are digits with a point, which are quickly told.
fn is_finite(cell: &[u8]) -> bool {
    let digits = cell.strip_prefix(b"-").unwrap_or(cell);
    let mut points = 0;
    let is_plain = digits.len() < 300
        && digits.first().is_some_and(u8::is_ascii_digit)
        && digits.iter().all(|byte| {
            points += usize::from(*byte == b'.');
            byte.is_ascii_digit() || *byte == b'.'
        })
        && points < 2;
    let number = || std::str::from_utf8(cell).ok()?.parse::<f64>().ok();
    is_plain || number().is_some_and(f64::is_finite)
}

fn misread(path: &Path, fault: csv::Error) -> Error {
    let cause = match fault.into_kind() {
        csv::ErrorKind::Io(cause) => cause,
        other => io::Error::other(format!("{other:?}")),
    };
    Error::Io { action: "read", path: path.to_owned(), cause }
}

/// A row.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    cells: &'a ByteRecord,
    state: usize,
}

impl<'a> Row<'a> {
    fn text(&self, place: usize) -> &'a str {
        self.cells.get(place).and_then(|cell| std::str::from_utf8(cell).ok()).unwrap_or_default()
    }

    /// The phase.
    #[must_use]
    pub fn phase(&self) -> Option<Phase> {
        Phase::from_word(self.text(0))
    }

    /// The rollout, from 1.
    #[must_use]
    pub fn episode(&self) -> u32 {
        self.text(1).parse().unwrap_or(0)
    }

    /// The step, from 0.
    #[must_use]
    pub fn step(&self) -> u32 {
        self.text(2).parse().unwrap_or(0)
    }

    /// The time in the rollout, s.
    #[must_use]
    pub fn t(&self) -> f64 {
        self.text(3).parse().unwrap_or(f64::NAN)
    }

    /// A number of the state.
    #[must_use]
    pub fn state(&self, index: usize) -> f64 {
        let is_there = index < self.state;
        let text = if is_there { self.text(STEP_COLUMNS.0.len() + index) } else { "" };
        text.parse().unwrap_or(f64::NAN)
    }

    /// Another number; none where the cell is empty.
    #[must_use]
    pub fn number(&self, number: Number) -> Option<f64> {
        self.text(STEP_COLUMNS.0.len() + self.state + number.place()).parse().ok()
    }

    /// The state's region; empty in a rollout's last row.
    #[must_use]
    pub fn region(&self) -> &'a str {
        self.text(STEP_COLUMNS.0.len() + self.state + REGION)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "phase,episode,step,t,x,v,u_human,u_machine,share,u,u_applied,reward,\
                        success,region,lateness_us,raw\n";

    fn skim(rows: &str) -> (tempfile::TempDir, Result<Skim, Error>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("steps.csv");
        std::fs::write(&path, rows).unwrap();
        let skim = Skim::open(&path);
        (folder, skim)
    }

    #[test]
    fn the_columns_asked_for_are_read() {
        let row = "main,3,7,0.14,-0.5,0.01,1.5,,0.75,1.125,1.125,-1.0,0.2,all,0,\n";
        let (_folder, skim) = skim(&format!("{HEAD}{row}main,3,8,0.16,1.0,2.0,,,,,,,,,0,\n"));
        let mut skim = skim.unwrap();
        let row = skim.next_row().unwrap().unwrap();
        assert_eq!((row.phase(), row.episode(), row.step()), (Some(Phase::Main), 3, 7));
        assert_eq!((row.t(), row.state(0), row.state(1)), (0.14, -0.5, 0.01));
        let numbers =
            [Number::Human, Number::Machine, Number::Share, Number::Mixed, Number::Success];
        let read = numbers.map(|number| row.number(number));
        assert_eq!(read, [Some(1.5), None, Some(0.75), Some(1.125), Some(0.2)]);
        assert_eq!(row.region(), "all");
        assert!(row.state(2).is_nan());
        assert_eq!(skim.next_row().unwrap().unwrap().region(), "");
        assert!(skim.next_row().unwrap().is_none());
    }

    #[test]
    fn what_cannot_be_used_is_passed_over_and_counted() {
        let good = "main,1,0,0.0,1.0,2.0,,,,,,,,,0,\n";
        let rows = [
            "main,1,1,0.02,NaN,2.0,,,,,,,,,0,\n",
            "main,1,2,0.04,1.0\n",
            "lunch,1,2,0.04,1.0,2.0,,,,,,,,,0,\n",
            "main,1,3,0.06,1.0,-inf,,,,,,,,,0,\n",
            "main,1,4,0.08,,2.0,,,,,,,,,0,\n",
            "main,1x,4,0.08,1.0,2.0,,,,,,,,,0,\n",
            "main,1,4,0.0.8,1.0,2.0,,,,,,,,,0,\n",
            "main,1,4,9e999,1.0,2.0,,,,,,,,,0,\n",
            "main,1,4,1-2,1.0,2.0,,,,,,,,,0,\n",
            "\"main,1,4,0.08,1.0,2.0,,,,,,,,,0,\n",
        ];
        let (_folder, skim) = skim(&format!("{HEAD}{good}{}{good}main,1,5,0.1,1.", rows.concat()));
        let mut skim = skim.unwrap();
        let mut good_rows = 0;
        while skim.next_row().unwrap().is_some() {
            good_rows += 1;
        }
        assert_eq!((good_rows, skim.spoilt()), (2, Spoilt { rows: 10, first_line: 3 }));
    }

    #[test]
    fn another_table_is_refused() {
        let (_folder, skim) = skim("a,b,c\n1,2,3\n");
        assert!(skim.err().unwrap().to_string().contains("not those of a session's steps"));
        let (_folder, empty) = self::skim("");
        assert!(empty.unwrap().next_row().unwrap().is_none());
    }
}
