//! Where a study's results are kept: `study.json`, which says what study it is, and a file in
//! `runs/` for each run, written whole as soon as it is finished.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::StudyError;
use super::plan::{Run, Study};
use super::results::Done;
use super::shard::Shard;
use crate::profile::shell_word;
use crate::record::{self, Document};

/// What study a folder holds.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Card {
    /// The program's version.
    pub version: String,
    /// The study's name.
    pub name: String,
    /// The task,
    pub task: String,
    /// and the preset of its first arm.
    pub preset: String,
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
    /// A word for all that its results depend on: the texts themselves, with a profile for each
    /// arm and setting, may be as long as the results.
    pub identity: String,
}

impl Card {
    /// In what it is another study than `other`.
    pub(super) fn otherness(&self, other: &Self) -> String {
        let sets = |sets: &[(String, String)]| {
            let words: Vec<String> = sets.iter().map(|(k, v)| format!("--set {k}={v}")).collect();
            if words.is_empty() { "no --set".to_owned() } else { words.join(" ") }
        };
        let seeds = |seeds: Option<u32>| {
            seeds.map_or_else(|| "no --seeds".to_owned(), |seeds| format!("--seeds {seeds}"))
        };
        if self.name != other.name {
            format!("it is the study {}, not {}", self.name, other.name)
        } else if self.sets != other.sets {
            format!("it has other settings: {}, not {}", sets(&self.sets), sets(&other.sets))
        } else if self.seeds != other.seeds {
            format!("it has other seeds: {}, not {}", seeds(self.seeds), seeds(other.seeds))
        } else {
            "the study's file or its profile has changed since".to_owned()
        }
    }

    /// The words after `coadapt study` that ask for the same from a shell.
    #[must_use]
    pub fn words(&self) -> String {
        let mut words = vec![shell_word(&self.found)];
        for (key, value) in &self.sets {
            words.extend(["--set".to_owned(), shell_word(&format!("{key}={value}"))]);
        }
        words.extend(self.seeds.map(|seeds| format!("--seeds {seeds}")));
        words.join(" ")
    }
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
        fs::create_dir_all(path).map_err(|error| StudyError::disk("make", path, error))?;
        if !is_new(path)? {
            // Nothing is put into what is somebody else's.
            fits(path, card)?;
        }
        let lock = locked(path)?;
        if is_new(path)? {
            // The card comes first and outlives a loss of power: runs without it would be lost.
            record::write_document(&path.join(CARD), card, true)?;
        } else {
            fits(path, card)?;
        }
        let runs = path.join("runs");
        fs::create_dir_all(&runs).map_err(|error| StudyError::disk("make", &runs, error))?;
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

    /// Makes the folder for step rows.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn make_steps(&self) -> Result<(), StudyError> {
        let steps = self.path.join(STEPS);
        fs::create_dir_all(&steps).map_err(|error| StudyError::disk("make", &steps, error))
    }

    /// Copies the step rows of a run from the folder `other`, if it has them.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn copy_steps(&self, other: &Path, number: u32) -> Result<(), StudyError> {
        let (from, to) = (steps(other, number), steps(&self.path, number));
        if !from.exists() || to.exists() {
            return Ok(());
        }
        self.make_steps()?;
        let new = to.with_extension("csv.new");
        let copied = fs::copy(&from, &new).and_then(|_| fs::rename(&new, &to));
        copied.map_err(|error| {
            let _ = fs::remove_file(&new);
            StudyError::disk("write", &to, error)
        })
    }
}

/// Where the step rows of a run go in `folder`.
#[must_use]
pub fn steps(folder: &Path, number: u32) -> PathBuf {
    folder.join(STEPS).join(format!("{number:05}.csv"))
}

const STEPS: &str = "steps";
const CARD: &str = "study.json";

fn file(folder: &Path, number: u32) -> PathBuf {
    folder.join("runs").join(format!("{number:05}.json"))
}

/// What `folder` holds of the run of that `number`. A file that cannot be read, or is that of
/// another run, counts as none: the run is done once more.
#[must_use]
pub fn read(folder: &Path, number: u32) -> Option<Kept> {
    let kept = record::read_document::<Kept>(&file(folder, number)).ok()?;
    let is_it = match &kept.outcome {
        Outcome::Done(done) => done.labels.run == number,
        Outcome::Failed(_) => true,
    };
    is_it.then_some(kept)
}

/// Whether nothing in the folder `path` is of use: what a study leaves that was ended before it had
/// begun.
fn is_new(path: &Path) -> Result<bool, StudyError> {
    let entries = fs::read_dir(path).map_err(|error| StudyError::disk("list", path, error))?;
    let is_empty = |path: &Path| fs::read_dir(path).is_ok_and(|mut found| found.next().is_none());
    let is_of_no_use = |entry: fs::DirEntry| match entry.file_name().to_str() {
        Some(".lock" | "study.json.new") => true,
        Some("runs") => is_empty(&entry.path()),
        _ => false,
    };
    for entry in entries {
        let entry = entry.map_err(|error| StudyError::disk("list", path, error))?;
        if !is_of_no_use(entry) {
            return Ok(false);
        }
    }
    Ok(true)
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
    record::read_document(&folder.join(CARD)).map_err(|error| match StudyError::from(error) {
        StudyError::File(why) => StudyError::Card { why },
        refused => refused,
    })
}

/// That the folder `path`, which is not empty, holds the study of `wanted`.
fn fits(path: &Path, wanted: &Card) -> Result<(), StudyError> {
    let other = |why: String| StudyError::OtherStudy { path: path.to_owned(), why };
    let found = match card(path) {
        Err(StudyError::NoStudy { .. }) => {
            return Err(other("there is no study.json in it".to_owned()));
        }
        found => found?,
    };
    if found.version != wanted.version {
        return Err(other(format!(
            "its runs are those of coadapt {}, and this is {}",
            found.version, wanted.version
        )));
    }
    if found.identity != wanted.identity {
        return Err(other(found.otherness(wanted)));
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
