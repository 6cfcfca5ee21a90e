//! A study's folder read back: the data of its figures, see `docs/STUDIES.md`.

use std::fs::File;
use std::path::{Path, PathBuf};

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
    pub normalised_return: f64,
    pub relative_to_best: f64,
}

/// A row of `cells.csv`.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "the columns are told in docs/STUDIES.md")]
pub struct CellDifference {
    pub sides: Sides,
    pub place: Option<(f64, f64)>,
    pub normalised_return: f64,
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
    pub value: f64,
}

#[derive(Deserialize)]
struct Card {
    name: String,
    identity: String,
}

impl Document for Card {
    const KIND: &'static str = "study";
}

/// The columns of `generalisation.csv`, in order.
type DifferenceRow = (String, String, u8, String, String, String, String, String, f64, f64, f64);
/// Those of `trajectories.csv` before the state.
type DrivenHead = (String, String, u32, String, String, u32, u32);

impl Outcome {
    /// Reads the study in `folder`; tables that cannot be read are left out and named.
    pub(super) fn read(folder: &Path) -> Result<Self, String> {
        let card: Card =
            read_document(&folder.join("study.json")).map_err(|error| error.to_string())?;
        let told = |key: &str| after(&card.identity, key).unwrap_or_default();
        let mut outcome = Self {
            path: folder.to_owned(),
            name: card.name.clone(),
            task: told("task"),
            preset: told("preset"),
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
        let Ok(file) = File::open(path) else { return Vec::new() };
        let mut table = csv::ReaderBuilder::new().flexible(true).from_reader(file);
        let mut rows = Vec::new();
        let mut faults: Option<(u64, String)> = None;
        let mut bad = 0_usize;
        let head = table.headers().cloned().unwrap_or_default();
        for record in table.records() {
            let read = record.and_then(|record| {
                let whole = record.len() == head.len();
                let line = record.position().map_or(0, csv::Position::line);
                Ok((line, if whole { Some(row(&record, &head)?) } else { None }))
            });
            match read {
                Ok((_, Some(read))) => rows.push(read),
                Ok((line, None)) => {
                    bad += 1;
                    faults.get_or_insert((line, "it is not whole".to_owned()));
                }
                Err(error) => {
                    let line = error.position().map_or(0, csv::Position::line);
                    bad += 1;
                    faults.get_or_insert((line, error.to_string()));
                    // What the disk does not give now it will not give later.
                    if error.is_io_error() {
                        break;
                    }
                }
            }
        }
        if let Some((line, why)) = faults {
            let why = format!(
                "{bad} of its rows cannot be used, the first in line {line} ({why}): left out"
            );
            self.left_out.push(LeftOut { path: path.display().to_string(), why });
        }
        rows
    }
}

type Reading<T> = fn(&csv::StringRecord, &csv::StringRecord) -> csv::Result<T>;

fn typed<T: DeserializeOwned>(
    record: &csv::StringRecord,
    head: &csv::StringRecord,
) -> csv::Result<T> {
    record.deserialize(Some(head))
}

fn difference(record: &csv::StringRecord, _: &csv::StringRecord) -> csv::Result<Difference> {
    let row: DifferenceRow = record.deserialize(None)?;
    let (setting, operator, checkpoint, start, arm, readout, from_arm, from_readout, ..) = row;
    let sides = Sides { setting, operator, start, arm, readout, from_arm, from_readout };
    Ok(Difference { sides, checkpoint, normalised_return: row.9, relative_to_best: row.10 })
}

/// The labels are those of `generalisation.csv`; then come the start's number, its state, and
/// three differences.
fn cell(record: &csv::StringRecord, head: &csv::StringRecord) -> csv::Result<CellDifference> {
    let text = |name: &str| {
        let at = head.iter().position(|column| column == name);
        at.and_then(|at| record.get(at)).unwrap_or_default().to_owned()
    };
    let number = |at: usize| record.get(at).and_then(|cell| cell.parse().ok());
    let normalised_return: f64 = match text("normalised_return").parse() {
        Ok(value) => value,
        Err(_) => return Err(std::io::Error::other("normalised_return is no number").into()),
    };
    let sides = Sides {
        setting: text("setting"),
        operator: text("operator"),
        start: text("start"),
        arm: text("arm"),
        readout: text("readout"),
        from_arm: text("from_arm"),
        from_readout: text("from_readout"),
    };
    let first = head.iter().position(|column| column == "index").map_or(0, |index| index + 1);
    Ok(CellDifference { sides, place: number(first).zip(number(first + 1)), normalised_return })
}

fn driven(record: &csv::StringRecord, _: &csv::StringRecord) -> csv::Result<Driven> {
    let labels: csv::StringRecord = record.iter().take(7).collect();
    let (setting, arm, run, readout, start, index, step): DrivenHead = labels.deserialize(None)?;
    let at = record.iter().skip(7).filter_map(|cell| cell.parse().ok()).collect();
    Ok(Driven { setting, arm, run, readout, start, index, step, at })
}

/// The first text that `key` has in the profiles that `identity` holds.
fn after(identity: &str, key: &str) -> Option<String> {
    // The profiles stand in a JSON text, so that their quotes are escaped.
    let (_, rest) = identity.split_once(&format!("{key}: \\\""))?;
    rest.split_once("\\\"").map(|(value, _)| value.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn task_and_preset_are_found_in_the_profile() {
        let identity =
            r#"["0.1.0",{},["(\n    task: \"mountain-car\",\n    preset: \"thesis\",\n"]]"#;
        assert_eq!(after(identity, "preset").as_deref(), Some("thesis"));
        assert_eq!(after(identity, "task").as_deref(), Some("mountain-car"));
        assert_eq!(after(identity, "mode"), None);
    }

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
