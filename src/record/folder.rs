//! Where sessions are kept: `logs/<subject>/<trial>-<task>-<mode>/`, one folder each.

use std::fs::{self, DirBuilder, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::Deserialize;

use super::Error;
use super::document::{self, Document};
use super::names::{CHECKPOINT, CHECKPOINT_KIND, SESSION, STEPS};
use super::sidecar::{Sidecar, Status, read_sidecar};
use crate::session::{Moment, Phase, Subject, Trial};

/// A session's folder. As long as this lives, no other process records into it.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    _lock: File,
}

/// A folder made for a new session.
#[derive(Debug)]
pub struct Created {
    /// The folder, locked.
    pub folder: Folder,
    /// The trial's number.
    pub trial: Trial,
    /// What to tell the person, when the trial is not the one wanted.
    pub notice: Option<String>,
}

impl Folder {
    /// Makes the folder of a new session in `logs`. A subject's trials count whatever the
    /// task: the `wanted` number, or the first free one after it; the one after the latest
    /// when none is wanted. Safe against other processes that do the same.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn create(
        logs: &Path,
        subject: &Subject,
        wanted: Option<Trial>,
        task: &str,
        mode: &str,
    ) -> Result<Created, Error> {
        let home = logs.join(subject.as_str());
        fs::create_dir_all(&home).map_err(Error::io("make the folder", &home))?;
        // Held until the folder is there, so that two processes never take one number.
        let _counting = counting_lock(&home)?;
        let taken: Vec<u32> = trials(logs, subject)?.iter().map(|kept| kept.trial.0).collect();
        let latest = taken.iter().copied().max().unwrap_or(0);
        let first = wanted.map_or(latest.saturating_add(1), |trial| trial.0.max(1));
        let free = (first..=u32::MAX).find(|number| !taken.contains(number));
        let trial = Trial(free.ok_or_else(|| Error::unfit(&home, "no trial number is left"))?);
        let notice = wanted.filter(|wanted| *wanted != trial).map(|wanted| {
            let why = if wanted.0 == 0 { "does not exist (they count from 1)" } else { "is taken" };
            format!("trial {wanted} of subject {subject} {why}: this is trial {trial}")
        });
        let path = home.join(format!("{trial}-{task}-{mode}"));
        DirBuilder::new().create(&path).map_err(Error::io("make the folder", &path))?;
        let steps = path.join(STEPS);
        let file = File::create_new(&steps).map_err(Error::io("create", &steps))?;
        Ok(Created { folder: Self { _lock: locked(file, &path)?, path }, trial, notice })
    }

    /// Opens an existing session's folder, to resume it.
    ///
    /// # Errors
    /// When there is none, or another process records into it.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let steps = path.join(STEPS);
        let file = OpenOptions::new().append(true).open(&steps).map_err(|cause| {
            if cause.kind() == io::ErrorKind::NotFound {
                Error::unfit(path, "no session to resume is here: steps.csv is missing")
            } else {
                Error::io("open", &steps)(cause)
            }
        })?;
        Ok(Self { _lock: locked(file, path)?, path: path.to_owned() })
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }
}

fn locked(file: File, folder: &Path) -> Result<File, Error> {
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(Error::Busy { path: folder.to_owned() }),
        // Some network disks cannot lock. Folders are still never shared by accident,
        // since making one fails when it is there.
        Err(TryLockError::Error(e)) if e.kind() == io::ErrorKind::Unsupported => Ok(file),
        Err(TryLockError::Error(cause)) => Err(Error::io("lock", folder)(cause)),
    }
}

fn counting_lock(home: &Path) -> Result<File, Error> {
    let path = home.join(".lock");
    let lock = OpenOptions::new().write(true).create(true).truncate(false).open(&path);
    let lock = lock.map_err(Error::io("create", &path))?;
    match lock.lock() {
        Err(cause) if cause.kind() != io::ErrorKind::Unsupported => {
            Err(Error::io("lock", &path)(cause))
        }
        _ => Ok(lock),
    }
}

/// A trial that is in the log folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    /// Its number.
    pub trial: Trial,
    /// Its folder.
    pub path: PathBuf,
}

/// The trials of `subject` in `logs`, by number; none when the folder does not exist.
///
/// # Errors
/// When the folder cannot be read.
pub fn trials(logs: &Path, subject: &Subject) -> Result<Vec<Kept>, Error> {
    let mut trials = trials_in(&logs.join(subject.as_str()))?;
    trials.sort_by(|a, b| (a.trial, &a.path).cmp(&(b.trial, &b.path)));
    Ok(trials)
}

fn trials_in(home: &Path) -> Result<Vec<Kept>, Error> {
    let entries = match fs::read_dir(home) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(Error::io("list", home))?,
    };
    let mut trials = Vec::new();
    for entry in entries {
        let path = entry.map_err(Error::io("list", home))?.path();
        let number = path.file_name().and_then(|name| name.to_str()).and_then(trial_number);
        if let Some(trial) = number {
            trials.push(Kept { trial, path });
        }
    }
    Ok(trials)
}

/// The number that a folder's name begins with.
fn trial_number(name: &str) -> Option<Trial> {
    let (digits, _) = name.split_once('-')?;
    let plain = digits.len() >= 3 && digits.bytes().all(|b| b.is_ascii_digit());
    if plain { digits.parse().ok().map(Trial) } else { None }
}

/// Every session folder in `logs`, in the order of subjects and trials. Whatever cannot be
/// read is left out.
pub(super) fn sessions(logs: &Path) -> Vec<PathBuf> {
    let homes = fs::read_dir(logs).into_iter().flatten().flatten().map(|entry| entry.path());
    let kept = homes.flat_map(|home| trials_in(&home).unwrap_or_default());
    let mut paths: Vec<PathBuf> = kept.map(|kept| kept.path).collect();
    paths.sort();
    paths
}

/// A session that can be resumed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unfinished {
    /// Its folder.
    pub path: PathBuf,
    /// The subject.
    pub subject: Subject,
    /// The trial.
    pub trial: Trial,
    /// The task's name outside.
    pub task: String,
    /// Its preset.
    pub preset: String,
    /// The mode's word.
    pub mode: &'static str,
    /// The phase that it goes on with.
    pub phase: Phase,
    /// The rollout that it goes on with.
    pub episode: u32,
    /// The rollouts of that phase, unless it is planned by time.
    pub of: Option<u32>,
}

/// The part of a checkpoint that tells where the session stands, whatever its learner.
#[derive(Deserialize)]
struct Standing {
    moment: Moment,
    of: Option<u32>,
}

impl Document for Standing {
    const KIND: &'static str = CHECKPOINT_KIND;
}

/// The sessions in `logs` that are not complete, have a readable checkpoint and are not
/// being recorded now, the latest first. Everything else is passed over.
#[must_use]
pub fn unfinished(logs: &Path) -> Vec<Unfinished> {
    let mut found: Vec<(SystemTime, Unfinished)> =
        sessions(logs).into_iter().filter_map(standing).collect();
    found.sort_by(|a, b| (b.0, &b.1.path).cmp(&(a.0, &a.1.path)));
    found.into_iter().map(|(_, unfinished)| unfinished).collect()
}

fn standing(path: PathBuf) -> Option<(SystemTime, Unfinished)> {
    let Sidecar { subject, trial, task, preset, mode, status, .. } =
        read_sidecar(&path.join(SESSION)).ok()?;
    if status == Status::Complete || is_busy(&path) {
        return None;
    }
    let checkpoint = path.join(CHECKPOINT);
    let Standing { moment, of } = document::read(&checkpoint).ok()?;
    let when = fs::metadata(&checkpoint).and_then(|m| m.modified()).ok()?;
    let (mode, phase, episode) = (mode.word(), moment.phase, moment.rollout);
    Some((when, Unfinished { path, subject, trial, task, preset, mode, phase, episode, of }))
}

/// Whether a process records into the folder now.
#[must_use]
pub fn is_busy(path: &Path) -> bool {
    // A shared lock, so that two who look do not see each other.
    File::open(path.join(STEPS))
        .is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}
