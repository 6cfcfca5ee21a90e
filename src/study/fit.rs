//! A learner on a table of samples, offline.
//!
//! The table is gone through twice: once to learn, each sample predicted just before it is
//! learned (the error one step ahead), and once to see what the final learner makes of the
//! same samples.

pub mod predictions;
pub mod session;

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::table::{Table, TableError};
use crate::clock::Clock;
use crate::learner::{Learner, Model, Refusal};

/// Samples between two looks at the clock and at whoever wants to stop.
const STRIDE: u64 = 256;

/// Why there is no fit.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// The table of samples.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The recorded session.
    #[error(transparent)]
    Record(#[from] crate::record::Error),
    /// The recorded session's profile.
    #[error(transparent)]
    Profile(#[from] crate::profile::Report),
    /// What was asked for is not there.
    #[error("{0}")]
    Unfit(String),
    /// Writing failed.
    #[error("the predictions could not be written: {0}")]
    Write(io::Error),
}

/// Where samples come from.
#[derive(Debug)]
pub enum Source {
    /// A file, which is read twice and never held whole.
    File {
        /// The file.
        path: PathBuf,
        /// The inputs' columns, then the outputs'.
        columns: Vec<String>,
        /// Its length, bytes.
        length: u64,
    },
    /// Samples in memory.
    Kept(Kept),
}

/// Samples in memory: inputs, outputs and weight, one sample after another.
#[derive(Debug, Default)]
pub struct Kept {
    numbers: Vec<f64>,
    /// The line of each sample; its number from 1 where there are no lines.
    lines: Vec<u64>,
}

impl Kept {
    /// Adds the sample `x` → `y`, which weighs `weight` and stood in `line`.
    pub fn push(&mut self, (x, y, weight): (&[f64], &[f64], f64), line: u64) {
        self.numbers.extend_from_slice(x);
        self.numbers.extend_from_slice(y);
        self.numbers.push(weight);
        self.lines.push(line);
    }

    /// How many samples there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.lines.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }
}

impl Source {
    /// The samples in the table at `path`, whose `columns` are the inputs', then the
    /// outputs'. What is no plain file, such as a pipe, is read at once.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn open(path: &Path, columns: &[String]) -> Result<Self, FitError> {
        let name = path.display().to_string();
        let refused = |cause| TableError::Io { name: name.clone(), cause };
        let file = File::open(path).map_err(refused)?;
        let about = file.metadata().map_err(refused)?;
        if !about.is_file() {
            return Ok(Self::Kept(keep(&name, file, columns)?));
        }
        // A wrong head is told before anything else is done.
        Table::open(&name, file, columns)?;
        let columns = columns.to_vec();
        Ok(Self::File { path: path.to_owned(), columns, length: about.len() })
    }

    fn pass(&self) -> Result<Pass<'_>, FitError> {
        match self {
            Self::File { path, columns, length } => {
                let name = path.display().to_string();
                let file = File::open(path)
                    .map_err(|cause| TableError::Io { name: name.clone(), cause })?;
                let file = io::BufReader::with_capacity(1 << 17, file);
                Ok(Pass::File(Box::new(Table::open(&name, file, columns)?), (*length).max(1)))
            }
            Self::Kept(kept) => Ok(Pass::Kept(kept, 0)),
        }
    }
}

/// Reads the whole `table`, whose `columns` are the inputs', then the outputs'.
///
/// # Errors
/// With all that is wrong with it.
pub fn keep(name: &str, table: impl Read, columns: &[String]) -> Result<Kept, TableError> {
    let mut table = Table::open(name, table, columns)?;
    let mut row = vec![0.0; columns.len()];
    let mut kept = Kept::default();
    while table.next(&mut row)? {
        kept.push((&row[..], &[], 1.0), table.line());
    }
    Ok(kept)
}

/// One way through the samples.
enum Pass<'a> {
    File(Box<Table<io::BufReader<File>>>, u64),
    Kept(&'a Kept, usize),
}

impl Pass<'_> {
    /// Puts the next sample into `row` (inputs, outputs, weight); false after the last.
    fn next(&mut self, row: &mut [f64]) -> Result<bool, FitError> {
        match self {
            Self::File(table, _) => {
                let [numbers @ .., weight] = row else { return Ok(false) };
                *weight = 1.0;
                Ok(table.next(numbers)?)
            }
            Self::Kept(kept, next) => {
                let numbers = kept.numbers.get(*next * row.len()..(*next + 1) * row.len());
                if let Some(numbers) = numbers {
                    row.copy_from_slice(numbers);
                    *next += 1;
                }
                Ok(numbers.is_some())
            }
        }
    }

    /// The line of the sample that came last.
    fn line(&self) -> u64 {
        match self {
            Self::File(table, _) => table.line(),
            Self::Kept(kept, next) => kept.lines.get(next.saturating_sub(1)).copied().unwrap_or(0),
        }
    }

    /// How much is done, from 0 to 1.
    #[expect(clippy::cast_precision_loss, reason = "a share for a progress bar")]
    fn done(&self) -> f64 {
        match self {
            Self::File(table, length) => (table.bytes() as f64 / *length as f64).min(1.0),
            Self::Kept(kept, next) => *next as f64 / kept.len().max(1) as f64,
        }
    }
}

/// What a fit is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// It learns.
    Learning,
    /// It looks at what was learned.
    Checking,
    /// It answers queries.
    Predicting,
}

/// How far a fit is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// What it is doing,
    pub stage: Stage,
    /// and how much of that is done, from 0 to 1.
    pub done: f64,
    /// Receptive fields so far.
    pub fields: usize,
}

/// Is told now and then how far a fit is; false ends it.
pub type Watch<'a> = &'a mut dyn FnMut(Progress) -> bool;

/// What came of a fit.
#[derive(Clone, Debug, Default)]
pub struct Fitted {
    /// Samples learned,
    pub samples: u64,
    /// and refused.
    pub refused: u64,
    /// The line of the first refused one, and why.
    pub first_refused: Option<(u64, Refusal)>,
    /// For each output the mean squared error over its variance, each sample predicted
    /// before it was learned; `None` where the output does not vary.
    pub one_step: Vec<Option<f64>>,
    /// The same of the final learner.
    pub last: Vec<Option<f64>>,
    /// How long the learning pass took, s.
    pub seconds: f64,
}

/// The mean over the outputs that vary.
#[must_use]
pub fn mean(errors: &[Option<f64>]) -> Option<f64> {
    let known: Vec<f64> = errors.iter().flatten().copied().collect();
    #[expect(clippy::cast_precision_loss, reason = "at most 64 outputs")]
    (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
}

/// Lets `learner` learn all samples of `source` in order; none is returned when `watch`
/// ended it.
///
/// # Errors
/// When the table has faults, or no sample in it could be learned.
pub fn fit(
    learner: &mut Model,
    source: &Source,
    clock: &dyn Clock,
    watch: Watch<'_>,
) -> Result<Option<Fitted>, FitError> {
    let inputs = learner.inputs();
    let mut row = vec![0.0; inputs + learner.outputs() + 1];
    let mut guess = vec![0.0; learner.outputs()];
    let mut errors = Errors::of(learner.outputs());
    let mut fitted = Fitted::default();
    let start = clock.now();
    let mut pass = source.pass()?;
    while pass.next(&mut row)? {
        let (x, y, weight) = parts(&row, inputs);
        learner.predict(x, &mut guess);
        match learner.update(x, y, weight) {
            Ok(()) => {
                errors.note(y, &guess);
                fitted.samples += 1;
            }
            Err(refusal) => {
                fitted.first_refused.get_or_insert((pass.line(), refusal));
                fitted.refused += 1;
            }
        }
        if (fitted.samples + fitted.refused).is_multiple_of(STRIDE)
            && !watch(Progress {
                stage: Stage::Learning,
                done: pass.done(),
                fields: learner.fields(),
            })
        {
            return Ok(None);
        }
    }
    fitted.seconds = (clock.now() - start).0;
    fitted.one_step = errors.normalised();
    if fitted.samples == 0 {
        return Err(FitError::Unfit(match fitted.first_refused {
            Some((line, why)) => {
                format!("no sample could be learned; the first, in line {line}: {why}")
            }
            None => "there are no samples: no line follows the first one".to_owned(),
        }));
    }
    fitted.last = match check(learner, source, watch)? {
        Some(errors) => errors,
        None => return Ok(None),
    };
    Ok(Some(fitted))
}

/// The errors of `learner`, which stays as it is, on all samples of `source`.
fn check(
    learner: &Model,
    source: &Source,
    watch: Watch<'_>,
) -> Result<Option<Vec<Option<f64>>>, FitError> {
    let inputs = learner.inputs();
    let mut row = vec![0.0; inputs + learner.outputs() + 1];
    let mut guess = vec![0.0; learner.outputs()];
    let mut errors = Errors::of(learner.outputs());
    let mut pass = source.pass()?;
    let mut seen = 0_u64;
    while pass.next(&mut row)? {
        let (x, y, _) = parts(&row, inputs);
        if row.iter().all(|number| number.is_finite()) {
            learner.predict(x, &mut guess);
            errors.note(y, &guess);
        }
        seen += 1;
        let fields = learner.fields();
        if seen.is_multiple_of(STRIDE)
            && !watch(Progress { stage: Stage::Checking, done: pass.done(), fields })
        {
            return Ok(None);
        }
    }
    Ok(Some(errors.normalised()))
}

/// The inputs, outputs and weight of a sample.
fn parts(row: &[f64], inputs: usize) -> (&[f64], &[f64], f64) {
    let (weight, numbers) = row.split_last().unwrap_or((&1.0, &[]));
    let (x, y) = numbers.split_at(inputs.min(numbers.len()));
    (x, y, *weight)
}

/// Squared errors and variances.
struct Errors {
    count: f64,
    outputs: Vec<OutputErrors>,
}

#[derive(Clone, Copy, Default)]
struct OutputErrors {
    mean: f64,
    /// Σ (y − ȳ)².
    scatter: f64,
    /// Σ (y − ŷ)².
    squared: f64,
}

impl Errors {
    fn of(outputs: usize) -> Self {
        Self { count: 0.0, outputs: vec![OutputErrors::default(); outputs] }
    }

    fn note(&mut self, y: &[f64], guess: &[f64]) {
        self.count += 1.0;
        for ((errors, y), guess) in self.outputs.iter_mut().zip(y).zip(guess) {
            let off = y - errors.mean;
            errors.mean += off / self.count;
            errors.scatter += off * (y - errors.mean);
            errors.squared += (y - guess) * (y - guess);
        }
    }

    fn normalised(&self) -> Vec<Option<f64>> {
        let share = |errors: &OutputErrors| {
            Some(errors.squared / errors.scatter).filter(|share| share.is_finite())
        };
        self.outputs.iter().map(share).collect()
    }
}
