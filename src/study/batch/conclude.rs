//! The end of a study: every run is read once, in the order of the plan, and all that it came to is
//! written as it is read. What runs came to that are compared with each other is in memory at a
//! time, and of the others nothing but their number.

use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

use serde::Serialize;

use super::StudyError;
use super::fields::Fields;
use super::figures::{Best, Figures};
use super::folder::{Kept, Outcome};
use super::plan::{Run, Study, What};
use super::results::Done;
use super::summary::{Numbers, Part};
use super::table::{NewFile, Sheet};
use super::words::{Words, beyond_the_optimum};

/// The columns of `results.csv`: a contract with whoever reads it.
const COLUMNS: [&str; 10] = [
    "run",
    "arm",
    "operator",
    "setting",
    "seed",
    "checkpoint",
    "readout",
    "start",
    "measure",
    "value",
];

/// How the runs of a study ended, and what they cost.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Conclusion {
    /// Runs that were planned,
    pub runs: usize,
    /// and those of which there are results.
    pub done: usize,
    /// Runs that went wrong, and why.
    pub failed: Vec<(u32, String)>,
    /// Runs of which there is nothing.
    pub missing: Vec<u32>,
    /// What a reader should know.
    pub remarks: Vec<String>,
    /// Processor time, s,
    #[serde(skip)]
    pub processor_s: f64,
    /// and the most memory, MiB.
    #[serde(skip)]
    pub memory_mib: f64,
}

/// How a conclusion is drawn.
pub struct Manner<'a> {
    /// Threads that work out intervals.
    pub jobs: usize,
    /// Gives what a run came to; nothing of one that was not done.
    pub read: &'a dyn Fn(u32) -> Option<Kept>,
    /// Says when to give up.
    pub is_enough: &'a (dyn Fn() -> bool + Sync),
}

/// Writes what the `runs` of `study` came to into `folder`: `results.csv`, `summary.json`,
/// `table.txt` for people, and the data of figures.
///
/// # Errors
/// When the disk refuses, or the end was asked for; the files are then as they were.
pub fn conclude(
    folder: &Path,
    study: &Study,
    runs: &[&Run],
    manner: &Manner<'_>,
) -> Result<Conclusion, StudyError> {
    let mut pages = Pages::begin(folder, study)?;
    for block in runs.chunk_by(|a, b| study.are_together(a, b)) {
        pages.take(block, manner)?;
    }
    pages.keep()
}

/// All files while they are written.
struct Pages<'a> {
    study: &'a Study,
    conclusion: Conclusion,
    results: Sheet,
    figures: Figures<'a>,
    summary: Summary,
    words: Words,
    table: NewFile,
}

impl<'a> Pages<'a> {
    fn begin(folder: &Path, study: &'a Study) -> Result<Self, StudyError> {
        Ok(Self {
            study,
            conclusion: Conclusion::default(),
            results: Sheet::begin(folder.join("results.csv"), &COLUMNS)?,
            figures: Figures::begin(folder, study)?,
            summary: Summary::begin(folder, study)?,
            words: Words::new(study),
            table: NewFile::begin(folder.join("table.txt"))?,
        })
    }

    /// Takes in runs that are compared with each other.
    fn take(&mut self, runs: &[&Run], manner: &Manner<'_>) -> Result<(), StudyError> {
        let mut numbers = Numbers::default();
        let mut fields = Fields::default();
        let mut best = Best::default();
        for run in runs {
            if (manner.is_enough)() {
                return Err(StudyError::Interrupted);
            }
            let Some(done) = self.count(run, (manner.read)(run.number)) else { continue };
            self.row(&done)?;
            self.figures.curve(&done)?;
            numbers.take(&done);
            best.take(self.study, &done);
            fields.take(done);
        }
        let parts = numbers.show(self.study, manner.jobs, manner.is_enough);
        if (manner.is_enough)() {
            return Err(StudyError::Interrupted);
        }
        self.summary.take(&parts)?;
        self.figures.parts(&parts)?;
        for line in self.words.of(&parts) {
            self.table.put(&line)?;
            self.table.put("\n")?;
        }
        self.figures.fields(&fields, runs[0])?;
        self.figures.best(best, &|run| match (manner.read)(run)?.outcome {
            Outcome::Done(done) => Some(*done),
            Outcome::Failed(_) => None,
        })
    }

    /// Counts what came of a run, and returns what it came to, if it did.
    fn count(&mut self, run: &Run, kept: Option<Kept>) -> Option<Done> {
        let conclusion = &mut self.conclusion;
        conclusion.runs += 1;
        let Some(kept) = kept else {
            conclusion.missing.push(run.number);
            return None;
        };
        conclusion.processor_s += kept.processor_s.unwrap_or(0.0);
        conclusion.memory_mib = conclusion.memory_mib.max(kept.memory_mib.unwrap_or(0.0));
        match kept.outcome {
            Outcome::Failed(why) => {
                conclusion.failed.push((run.number, why));
                None
            }
            Outcome::Done(done) => {
                conclusion.done += 1;
                let remark = (run.what == What::References)
                    .then(|| beyond_the_optimum(self.study, run, &done))
                    .flatten();
                if conclusion.remarks.last() != remark.as_ref() {
                    conclusion.remarks.extend(remark);
                }
                Some(*done)
            }
        }
    }

    /// Writes the numbers of a run.
    fn row(&mut self, done: &Done) -> Result<(), StudyError> {
        let of = &done.labels;
        done.rows.iter().try_for_each(|row| {
            let of_run = (of.run, &of.arm, &of.operator, &of.setting, of.seed);
            let of_row = (row.checkpoint, &row.readout, &row.start, &row.measure, row.value);
            self.results.row((of_run, of_row))
        })
    }

    fn keep(self) -> Result<Conclusion, StudyError> {
        self.results.keep()?;
        self.figures.keep()?;
        self.table.keep()?;
        self.summary.keep(&self.conclusion)?;
        Ok(self.conclusion)
    }
}

/// `summary.json`, group by group; differences wait in a file without a name.
struct Summary {
    file: NewFile,
    later: BufWriter<File>,
    groups: usize,
    differences: usize,
}

/// What stands at its head.
#[derive(Serialize)]
struct Head<'a> {
    schema: u32,
    version: &'a str,
    study: &'a str,
    task: &'a str,
}

impl Summary {
    fn begin(folder: &Path, study: &Study) -> Result<Self, StudyError> {
        let refused = |error| StudyError::disk("write a temporary file in", folder, error);
        let later = BufWriter::new(tempfile::tempfile_in(folder).map_err(refused)?);
        let file = NewFile::begin(folder.join("summary.json"))?;
        let mut summary = Self { file, later, groups: 0, differences: 0 };
        let version = env!("CARGO_PKG_VERSION");
        let head = Head { schema: 1, version, study: &study.name, task: study.task() };
        let head = json(&head);
        summary.file.put(head.trim_end_matches('}'))?;
        summary.file.put(",\"groups\":[")?;
        Ok(summary)
    }

    fn take(&mut self, parts: &[Part]) -> Result<(), StudyError> {
        for part in parts {
            for group in &part.groups {
                self.file.put(if self.groups == 0 { "" } else { "," })?;
                self.file.put(&json(group))?;
                self.groups += 1;
            }
            for difference in &part.differences {
                let comma = if self.differences == 0 { "" } else { "," };
                write!(self.later, "{comma}{}", json(difference))
                    .map_err(|error| self.file.refused(error))?;
                self.differences += 1;
            }
        }
        Ok(())
    }

    fn keep(mut self, conclusion: &Conclusion) -> Result<(), StudyError> {
        self.file.put("],\"differences\":[")?;
        let copied = self.later.flush().and_then(|()| {
            let later = self.later.get_mut();
            later.rewind()?;
            io::copy(later, &mut self.file)
        });
        copied.map_err(|error| self.file.refused(error))?;
        self.file.put("],")?;
        self.file.put(json(conclusion).trim_start_matches('{'))?;
        self.file.put("\n")?;
        self.file.keep()
    }
}

/// Numbers, texts and words always have a form in JSON.
fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::collections::BTreeMap;
    use std::fs;

    use super::*;
    use crate::profile::Text;
    use crate::study::batch::{Changes, Row};

    /// Two settings, two people, two arms and seeds, and a reference of each setting.
    fn study() -> Study {
        let text = "(profile: \"balance\", starts: [(name: \"g\", count: 1)], references: [zero], \
                    arms: [(name: \"a\", mode: sequential), (name: \"b\", mode: simultaneous)], \
                    operators: [\"simulated:naive\", \"simulated:expert\"], seeds: (count: 5))";
        let sets = vec![("sharing.gate".to_owned(), "0.2,0.3".to_owned())];
        let changes = Changes { sets, seeds: None };
        Study::of(&Text::new("x", text), Path::new("none"), &changes, &|| false).unwrap()
    }

    /// What balances as long as its number says; run 3 went wrong, and there is no run 4.
    fn kept(study: &Study, number: u32) -> Option<Kept> {
        let run = &study.runs[number as usize - 1];
        let readout = if run.what == What::References { "zero" } else { "continuous" };
        let row = Row {
            checkpoint: 100,
            readout: readout.to_owned(),
            start: "g".to_owned(),
            measure: "mean_balance_s".to_owned(),
            value: f64::from(number),
        };
        let done = Done {
            labels: study.labels(run),
            rows: vec![row],
            cells: Vec::new(),
            curve: Vec::new(),
            table: None,
            trajectories: Vec::new(),
        };
        let outcome = match number {
            3 => Outcome::Failed("it fell".to_owned()),
            _ => Outcome::Done(Box::new(done)),
        };
        let version = String::new();
        let kept = Kept { version, outcome, processor_s: Some(0.5), memory_mib: None };
        (number != 4).then_some(kept)
    }

    #[test]
    fn each_run_is_read_once_and_the_best_once_more() {
        let (home, study) = (tempfile::tempdir().unwrap(), study());
        let runs: Vec<&Run> = study.runs.iter().collect();
        let times: RefCell<BTreeMap<u32, u32>> = RefCell::default();
        let read = |number| {
            *times.borrow_mut().entry(number).or_default() += 1;
            kept(&study, number)
        };
        let manner = Manner { jobs: 3, read: &read, is_enough: &|| false };
        let conclusion = conclude(home.path(), &study, &runs, &manner).unwrap();
        assert_eq!((conclusion.runs, conclusion.done, conclusion.processor_s), (42, 40, 20.5));
        assert_eq!(conclusion.missing, [4]);
        assert_eq!(conclusion.failed, [(3, "it fell".to_owned())]);
        let often: Vec<u32> =
            times.borrow().iter().filter(|(_, times)| **times > 1).map(|(run, _)| *run).collect();
        // The longest balance of each setting, person and arm.
        assert_eq!(often, [10, 11, 20, 21, 31, 32, 41, 42]);
        assert!(times.borrow().values().all(|times| *times <= 2));
        let text = |name: &str| fs::read_to_string(home.path().join(name)).unwrap();
        assert_eq!(text("results.csv").lines().count(), 1 + 40);
        let summary: serde_json::Value = serde_json::from_str(&text("summary.json")).unwrap();
        assert_eq!(summary["groups"].as_array().unwrap().len(), 2 * (1 + 2 * 2));
        assert_eq!(summary["differences"].as_array().unwrap().len(), 2 * 2);
        assert_eq!((&summary["schema"], &summary["missing"][0]), (&1.into(), &4.into()));
        // Each table of a setting has its own reference.
        let table = text("table.txt");
        let references: Vec<&str> =
            table.lines().filter(|line| line.contains("reference")).collect();
        assert_eq!(references.len(), 4);
        assert!(
            references[0].contains("    1.00") && references[3].contains("   22.00"),
            "{table}"
        );
    }

    #[test]
    fn a_conclusion_that_is_broken_off_leaves_what_was_there() {
        let (home, study) = (tempfile::tempdir().unwrap(), study());
        let runs: Vec<&Run> = study.runs.iter().collect();
        fs::write(home.path().join("results.csv"), "before").unwrap();
        let read = |number| kept(&study, number);
        let manner = Manner { jobs: 1, read: &read, is_enough: &|| true };
        let broken = conclude(home.path(), &study, &runs, &manner);
        assert!(matches!(broken, Err(StudyError::Interrupted)));
        let mut names: Vec<_> =
            fs::read_dir(home.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["figures", "results.csv"]);
        assert_eq!(fs::read_to_string(home.path().join("results.csv")).unwrap(), "before");
    }
}
