//! A study's folder read back: the data of its figures, see `docs/STUDIES.md`.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::record::{Document, read_document};
use crate::report::figure::LeftOut;

/// What a study came to.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Its folder.
    pub path: PathBuf,
    /// Its name.
    pub name: String,
    /// The task.
    pub task: String,
    /// The preset of its profile.
    pub preset: String,
    /// Numbers at each tenth.
    pub checkpoints: Vec<Checkpoint>,
    /// How arms differ over all starts of a set.
    pub generalisation: Vec<Difference>,
    /// How they differ from each start at the end.
    pub cells: Vec<CellDifference>,
    /// The largest values in an agent's table.
    pub values: Vec<Value>,
    /// Where the best runs drive.
    pub trajectories: Vec<Driven>,
    /// How all runs went.
    pub curves: Vec<CurvePoint>,
    /// What of it was left out.
    pub left_out: Vec<LeftOut>,
}

/// A row of `checkpoints.csv`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[expect(missing_docs, reason = "the columns are told in docs/STUDIES.md")]
pub struct Checkpoint {
    pub setting: String,
    pub operator: String,
    pub checkpoint: u8,
    pub start: String,
    pub measure: String,
    pub arm: String,
    pub readout: String,
    pub n: usize,
    pub mean: f64,
    pub standard_error: Option<f64>,
}

/// Which sides of which numbers are compared.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[expect(missing_docs, reason = "the columns are told in docs/STUDIES.md")]
pub struct Sides {
    pub setting: String,
    pub operator: String,
    pub start: String,
    pub arm: String,
    pub readout: String,
    pub from_arm: String,
    pub from_readout: String,
}

/// A row of `generalisation.csv`.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "the columns are told in docs/STUDIES.md")]
pub struct Difference {
    pub sides: Sides,
    pub checkpoint: u8,
    /// None where the best is 0.
    pub normalised_return: Option<f64>,
    /// None where the best is no yardstick: not above 0.
    pub relative_to_best: Option<f64>,
}

/// A row of `cells.csv`.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "the columns are told in docs/STUDIES.md")]
pub struct CellDifference {
    pub sides: Sides,
    pub place: Option<(f64, f64)>,
    pub normalised_return: Option<f64>,
}

/// A row of `q-function.csv`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[expect(missing_docs, reason = "the columns are told in docs/STUDIES.md")]
pub struct Value {
    pub setting: String,
    pub arm: String,
    pub run: u32,
    pub position_cell: usize,
    pub velocity_cell: usize,
    pub value: f64,
}

/// A row of `trajectories.csv`, in the first two numbers of the state.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "the columns are told in docs/STUDIES.md")]
pub struct Driven {
    pub setting: String,
    pub arm: String,
    pub run: u32,
    pub readout: String,
    pub start: String,
    pub index: u32,
    pub step: u32,
    pub at: Vec<f64>,
}

/// A row of `curves.csv`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[expect(missing_docs, reason = "the columns are told in docs/STUDIES.md")]
pub struct CurvePoint {
    pub run: u32,
    pub arm: String,
    pub operator: String,
    pub setting: String,
    pub seed: u64,
    pub episode: u32,
    pub success: f64,
    pub share: f64,
    /// None of a rollout that nothing ended but time.
    pub value: Option<f64>,
}

#[derive(Deserialize)]
struct Card {
    name: String,
    task: String,
    preset: String,
}

impl Document for Card {
    const KIND: &'static str = "study";
}

impl Outcome {
    /// Reads the study in `folder`; tables that cannot be read are left out and named.
    pub(super) fn read(folder: &Path) -> Result<Self, String> {
        let card: Card = read_document(&folder.join("study.json")).map_err(|error| error.why())?;
        let mut outcome = Self {
            path: folder.to_owned(),
            name: card.name,
            task: card.task,
            preset: card.preset,
            ..Self::default()
        };
        let figures = folder.join("figures");
        if !figures.is_dir() {
            let again = "carry it out to its end (the same command goes on), or join its shards \
                         with coadapt study merge";
            return Err(format!("the study has no figures yet: {again}"));
        }
        outcome.checkpoints = outcome.rows(&figures.join("checkpoints.csv"), typed);
        outcome.generalisation = outcome.rows(&figures.join("generalisation.csv"), difference);
        outcome.cells = outcome.rows(&figures.join("cells.csv"), cell);
        outcome.values = outcome.rows(&figures.join("q-function.csv"), typed);
        outcome.trajectories = outcome.rows(&figures.join("trajectories.csv"), driven);
        outcome.curves = outcome.rows(&figures.join("curves.csv"), typed);
        Ok(outcome)
    }

    /// The rows of the table at `path`; none where there is no such table.
    fn rows<T>(&mut self, path: &Path, row: Reading<T>) -> Vec<T> {
        let mut leave_out =
            |why: String| self.left_out.push(LeftOut { path: path.display().to_string(), why });
        let file = match File::open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Vec::new(),
            Err(error) => {
                leave_out(format!("cannot read it: {error}"));
                return Vec::new();
            }
        };
        let mut table = csv::ReaderBuilder::new().flexible(true).from_reader(file);
        let head = table.headers().cloned().unwrap_or_default();
        if head.is_empty() {
            leave_out("it is empty, or no table".to_owned());
            return Vec::new();
        }
        let mut rows = Vec::new();
        let mut first: Option<(u64, String)> = None;
        let mut bad = 0_usize;
        let mut records = table.into_records();
        while let Some(record) = records.next() {
            let line = records.reader().position().line().saturating_sub(1);
            let (line, read) = match record {
                // What the disk does not give now it will not give later.
                Err(error) if error.is_io_error() => {
                    leave_out(format!("it cannot be read beyond line {line}: {error}"));
                    break;
                }
                Err(error) => (line, Err(told(&error, &head))),
                Ok(record) => {
                    let line = record.position().map_or(line, csv::Position::line);
                    let is_whole = record.len() == head.len();
                    let read = if is_whole {
                        row(&record, &head).map_err(|error| told(&error, &head))
                    } else {
                        Err("it is not whole".to_owned())
                    };
                    (line, read)
                }
            };
            match read {
                Ok(read) => rows.push(read),
                Err(why) => {
                    bad += 1;
                    first.get_or_insert((line, why));
                }
            }
        }
        if let Some((line, why)) = first {
            leave_out(format!(
                "{bad} of its rows cannot be used, the first in line {line} ({why}): left out"
            ));
        }
        rows
    }
}

/// What is wrong with a row, in a reader's words.
fn told(error: &csv::Error, head: &csv::StringRecord) -> String {
    match error.kind() {
        csv::ErrorKind::Io(error) => error.to_string(),
        csv::ErrorKind::Utf8 { .. } => "it is not text (UTF-8)".to_owned(),
        csv::ErrorKind::Deserialize { err, .. } => {
            let place = err.field().and_then(|at| head.get(usize::try_from(at).ok()?));
            format!("{}: {}", place.unwrap_or("a column"), err.kind())
        }
        _ => error.to_string(),
    }
}

type Reading<T> = fn(&csv::StringRecord, &csv::StringRecord) -> csv::Result<T>;

fn typed<T: DeserializeOwned>(
    record: &csv::StringRecord,
    head: &csv::StringRecord,
) -> csv::Result<T> {
    record.deserialize(Some(head))
}

/// A row of a table, by the names of its columns.
struct Row<'a> {
    head: &'a csv::StringRecord,
    record: &'a csv::StringRecord,
}

impl Row<'_> {
    fn place(&self, name: &str) -> csv::Result<usize> {
        let missing = || io::Error::other(format!("the table has no column {name}")).into();
        self.head.iter().position(|column| column == name).ok_or_else(missing)
    }

    fn text(&self, name: &str) -> csv::Result<String> {
        let place = self.place(name)?;
        let cut = || io::Error::other(format!("{name} is cut off")).into();
        self.record.get(place).map(str::to_owned).ok_or_else(cut)
    }

    fn number<T: FromStr>(&self, name: &str) -> csv::Result<T> {
        let text = self.text(name)?;
        let none = |_| io::Error::other(format!("{name} is no number: {text:?}")).into();
        text.parse().map_err(none)
    }

    /// None of an empty cell.
    fn number_or_none(&self, name: &str) -> csv::Result<Option<f64>> {
        if self.text(name)?.is_empty() { Ok(None) } else { self.number(name).map(Some) }
    }

    fn sides(&self) -> csv::Result<Sides> {
        Ok(Sides {
            setting: self.text("setting")?,
            operator: self.text("operator")?,
            start: self.text("start")?,
            arm: self.text("arm")?,
            readout: self.text("readout")?,
            from_arm: self.text("from_arm")?,
            from_readout: self.text("from_readout")?,
        })
    }
}

fn difference(record: &csv::StringRecord, head: &csv::StringRecord) -> csv::Result<Difference> {
    let row = Row { head, record };
    Ok(Difference {
        sides: row.sides()?,
        checkpoint: row.number("checkpoint")?,
        normalised_return: row.number_or_none("normalised_return")?,
        relative_to_best: row.number_or_none("relative_to_best")?,
    })
}

/// The two columns after the start's number are the state there.
fn cell(record: &csv::StringRecord, head: &csv::StringRecord) -> csv::Result<CellDifference> {
    let row = Row { head, record };
    let first = row.place("index")? + 1;
    let number = |at: usize| record.get(at).and_then(|cell| cell.parse().ok());
    Ok(CellDifference {
        sides: row.sides()?,
        place: number(first).zip(number(first + 1)),
        normalised_return: row.number_or_none("normalised_return")?,
    })
}

/// All columns after the step are the state.
fn driven(record: &csv::StringRecord, head: &csv::StringRecord) -> csv::Result<Driven> {
    let row = Row { head, record };
    let state = row.place("step")? + 1;
    Ok(Driven {
        setting: row.text("setting")?,
        arm: row.text("arm")?,
        run: row.number("run")?,
        readout: row.text("readout")?,
        start: row.text("start")?,
        index: row.number("index")?,
        step: row.number("step")?,
        at: record.iter().skip(state).filter_map(|cell| cell.parse().ok()).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_are_not_whole_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("curves.csv");
        let head = "run,arm,operator,setting,seed,episode,success,share,value\n";
        let row = "2,sequential,q_learning,profile,1,120,0.5,1.0,500.0\n";
        std::fs::write(&path, format!("{head}{row}2,seq\n{row}2,a,b,c,d,e,f,g,h\n")).unwrap();
        let mut outcome = Outcome::default();
        let rows: Vec<CurvePoint> = outcome.rows(&path, typed);
        assert_eq!(rows.len(), 2);
        assert!(outcome.left_out[0].why.starts_with("2 of its rows"), "{:?}", outcome.left_out);
        assert!(outcome.left_out[0].why.contains("line 3"));
    }
}
