//! Where a study's results are kept: `study.json`, which says what study it is, and a file in
//! `runs/` for each run, written whole as soon as it is finished.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::StudyError;
use super::plan::{Run, Shard, Study};
use super::results::Done;
use crate::record::{self, Document};

/// What study a folder holds.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Card {
    /// The program's version.
    pub version: String,
    /// The study's name.
    pub name: String,
    /// How it can be found again: a name or a path,
    pub found: String,
    /// and with which changes.
    pub sets: Vec<(String, String)>,
    /// The number of seeds, where it is not the file's.
    pub seeds: Option<u32>,
    /// The share of its runs,
    pub shard: u32,
    /// and of how many.
    pub shards: u32,
    /// All that its results depend on.
    pub identity: String,
}

impl Document for Card {
    const KIND: &'static str = "study";
}

/// A run that is over.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Kept {
    /// The program's version.
    pub version: String,
    /// What it came to.
    pub outcome: Outcome,
    /// The processor time that it took, s,
    pub processor_s: Option<f64>,
    /// and the most memory that the program had used until then, MiB.
    pub memory_mib: Option<f64>,
}

/// What came of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It is done.
    Done(Box<Done>),
    /// It went wrong.
    Failed(String),
}

impl Document for Kept {
    const KIND: &'static str = "study run";
}

/// A study's folder. As long as this lives, no other process works in it.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    _lock: File,
}

impl Folder {
    /// Opens or makes the folder `path` for the study of `card`.
    ///
    /// # Errors
    /// When it holds something else, another process works in it, or the disk refuses.
    pub fn open(path: &Path, card: &Card) -> Result<Self, StudyError> {
        let is_new = match fs::read_dir(path) {
            Ok(mut entries) => entries.all(|entry| entry.is_ok_and(|e| e.file_name() == ".lock")),
            Err(error) if error.kind() == io::ErrorKind::NotFound => true,
            Err(error) => return Err(StudyError::disk("list", path, error)),
        };
        if !is_new {
            fits(path, card)?;
        }
        let runs = path.join("runs");
        fs::create_dir_all(&runs).map_err(|error| StudyError::disk("make", &runs, error))?;
        let lock = locked(path)?;
        if is_new {
            record::write_document(&path.join(CARD), card, false)?;
        }
        Ok(Self { path: path.to_owned(), _lock: lock })
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The runs of `shard` that are not done yet, and how many are.
    #[must_use]
    pub fn open_runs<'a>(&self, study: &'a Study, shard: Shard) -> (Vec<&'a Run>, usize) {
        let (done, open): (Vec<&Run>, Vec<&Run>) =
            study.share(shard).partition(|run| is_done(&self.path, run.number));
        (open, done.len())
    }

    /// Keeps what came of the run of that `number`.
    ///
    /// # Errors
    /// When the disk refuses; what was kept before stays.
    pub fn keep(&self, number: u32, kept: &Kept) -> Result<(), StudyError> {
        Ok(record::write_document(&file(&self.path, number), kept, false)?)
    }

    /// Where the step rows of a run go.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn steps(&self, number: u32) -> Result<PathBuf, StudyError> {
        let steps = self.path.join("steps");
        fs::create_dir_all(&steps).map_err(|error| StudyError::disk("make", &steps, error))?;
        Ok(steps.join(format!("{number:05}.csv")))
    }
}

const CARD: &str = "study.json";

fn file(folder: &Path, number: u32) -> PathBuf {
    folder.join("runs").join(format!("{number:05}.json"))
}

/// What `folder` holds of the run of that `number`. A file that cannot be read counts as none:
/// the run is done once more.
#[must_use]
pub fn read(folder: &Path, number: u32) -> Option<Kept> {
    record::read_document::<Kept>(&file(folder, number)).ok()
}

fn is_done(folder: &Path, number: u32) -> bool {
    read(folder, number).is_some_and(|kept| matches!(kept.outcome, Outcome::Done(_)))
}

/// The card of the study in `folder`.
///
/// # Errors
/// When there is none.
pub fn card(folder: &Path) -> Result<Card, StudyError> {
    if !folder.join(CARD).exists() {
        return Err(StudyError::NoStudy { path: folder.to_owned() });
    }
    Ok(record::read_document(&folder.join(CARD))?)
}

/// That the folder `path`, which is not empty, holds the study of `wanted`.
fn fits(path: &Path, wanted: &Card) -> Result<(), StudyError> {
    let found = card(path)?;
    let other = |why: String| StudyError::OtherStudy { path: path.to_owned(), why };
    if found.version != wanted.version {
        return Err(other(format!(
            "its runs are those of coadapt {}, and this is {}",
            found.version, wanted.version
        )));
    }
    if found.identity != wanted.identity {
        return Err(other(if found.name == wanted.name {
            "it was run with other settings or seeds, or its file or profile has changed since"
                .to_owned()
        } else {
            format!("it is the study {}", found.name)
        }));
    }
    if (found.shard, found.shards) != (wanted.shard, wanted.shards) {
        return Err(other(format!("it is the shard {}/{}", found.shard, found.shards)));
    }
    Ok(())
}

fn locked(folder: &Path) -> Result<File, StudyError> {
    let path = folder.join(".lock");
    let lock = OpenOptions::new().write(true).create(true).truncate(false).open(&path);
    let lock = lock.map_err(|error| StudyError::disk("create", &path, error))?;
    match lock.try_lock() {
        Ok(()) => Ok(lock),
        Err(TryLockError::WouldBlock) => Err(StudyError::Busy { path: folder.to_owned() }),
        // Some network disks cannot lock.
        Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => Ok(lock),
        Err(TryLockError::Error(error)) => Err(StudyError::disk("lock", &path, error)),
    }
}
