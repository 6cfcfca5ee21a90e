//! A session's tables for other programs: CSV for all, Parquet for pandas and R, MCAP for Foxglove.
//!
//! ```text
//! steps.csv ─ survey ─▶ rollouts (attempt, end, place in time)
//!     └────────────────────┴─▶ tables: columns with units, rows ─▶ text (CSV) | columnar (Parquet)
//!                          └─▶ timeline (MCAP)
//! ```
//!
//! Whole rows are read, wherever the files were cut. What is missing, or not a number, stays missing.
//! Nothing is replaced: an export takes its place whole, where nothing was, or not at all.

mod columns;
mod survey;
mod tables;
mod text;

#[cfg(feature = "parquet")]
mod columnar;
#[cfg(feature = "mcap")]
mod timeline;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::names::STEPS;
use super::{Error, Sidecar, sidecar_of};
use survey::Rollout;

/// What an export is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A folder of CSV tables, and `columns.csv` with their units.
    Csv,
    /// A folder of Parquet files with units in their schemas.
    Parquet,
    /// One MCAP file with a channel for each kind of message.
    Mcap,
}

impl Form {
    /// The word on the command line.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
            Self::Mcap => "mcap",
        }
    }

    /// Whether this program can write it: Parquet and MCAP are features of the build.
    #[must_use]
    pub const fn is_built_in(self) -> bool {
        match self {
            Self::Csv => true,
            Self::Parquet => cfg!(feature = "parquet"),
            Self::Mcap => cfg!(feature = "mcap"),
        }
    }
}

/// A word that is no form of an export.
#[derive(Debug, thiserror::Error)]
#[error("{0:?} is no form of an export: give csv, parquet or mcap")]
pub struct NoForm(String);

impl FromStr for Form {
    type Err = NoForm;

    fn from_str(word: &str) -> Result<Self, NoForm> {
        [Self::Csv, Self::Parquet, Self::Mcap]
            .into_iter()
            .find(|form| form.word() == word)
            .ok_or_else(|| NoForm(word.to_owned()))
    }
}

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exported {
    /// The folder, or the MCAP file.
    pub path: PathBuf,
    /// The rows of each table, or the messages of each channel, by its name.
    pub counts: Vec<(String, u64)>,
}

/// A session to be exported.
pub(super) struct Recorded {
    folder: PathBuf,
    facts: Sidecar,
    rollouts: Vec<Rollout>,
}

impl Recorded {
    fn open(folder: &Path) -> Result<Self, Error> {
        let facts = sidecar_of(folder)?;
        if !folder.join(STEPS).is_file() {
            return Err(Error::unfit(folder, "steps.csv is missing: there is nothing to export"));
        }
        Ok(Self { rollouts: survey::rollouts(folder)?, folder: folder.to_owned(), facts })
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Of which session a file is.
    #[cfg(any(feature = "parquet", feature = "mcap"))]
    fn facts(&self) -> [(&'static str, String); 10] {
        let facts = &self.facts;
        [
            ("program", format!("coadapt {}", super::VERSION)),
            ("recorded_by", format!("coadapt {}", facts.version)),
            ("subject", facts.subject.as_str().to_owned()),
            ("trial", facts.trial.to_string()),
            ("task", facts.task.clone()),
            ("preset", facts.preset.clone()),
            ("mode", facts.mode.word().to_owned()),
            ("learner", facts.learner.clone()),
            ("operator", facts.operator.clone()),
            ("seed", facts.seed.to_string()),
        ]
    }
}

/// The name that an export of the session in `folder` has unless another is given:
/// `<subject>-<folder's name>-csv`, or `….mcap`.
///
/// # Errors
/// When there is no session.
pub fn usual_name(folder: &Path, form: Form) -> Result<PathBuf, Error> {
    let facts = sidecar_of(folder)?;
    let joint = match form {
        Form::Csv | Form::Parquet => '-',
        Form::Mcap => '.',
    };
    let Sidecar { subject, trial, task, mode, .. } = &facts;
    let (subject, mode) = (subject.as_str(), mode.word());
    Ok(PathBuf::from(format!("{subject}-{trial}-{task}-{mode}{joint}{}", form.word())))
}

/// Writes the session in `folder` to `out` as `form`.
///
/// # Errors
/// When this program was built without `form`, something is at `out` already, a file of the session
/// does not read, or the disk refuses. Nothing is at `out` then that was not there before.
pub fn export(folder: &Path, form: Form, out: &Path) -> Result<Exported, Error> {
    demand_nothing_at(out)?;
    let counts = match form {
        Form::Csv => in_folder(out, |place| text::write(&Recorded::open(folder)?, place)),
        #[cfg(feature = "parquet")]
        Form::Parquet => in_folder(out, |place| columnar::write(&Recorded::open(folder)?, place)),
        #[cfg(feature = "mcap")]
        Form::Mcap => as_file(out, |file| timeline::write(&Recorded::open(folder)?, file, out)),
        #[cfg(not(all(feature = "parquet", feature = "mcap")))]
        _ => Err(Error::unfit(out, format!("this coadapt was built without {}", form.word()))),
    }?;
    Ok(Exported { path: out.to_owned(), counts })
}

fn demand_nothing_at(out: &Path) -> Result<(), Error> {
    match fs::symlink_metadata(out) {
        Ok(_) => {
            Err(Error::unfit(out, "this is there already, and stays; name another with --out PATH"))
        }
        Err(_) => Ok(()),
    }
}

/// The disk refused an export; `cause` may name a place that nobody asked for.
fn no_place(out: &Path, cause: &io::Error) -> Error {
    Error::NoPlace { path: out.to_owned(), cause: super::plain(cause) }
}

/// `error`, of `out` where it was of a file in `place`, which the user does not know.
fn of_place(error: Error, place: &Path, out: &Path) -> Error {
    match error {
        Error::Io { path, cause, .. } if path.starts_with(place) || path == out => {
            no_place(out, &cause)
        }
        other => other,
    }
}

/// The folder that something is to be in.
fn parent(out: &Path) -> &Path {
    out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Lets `write` fill a folder beside `out`, which takes its place when all is well.
fn in_folder<T>(out: &Path, write: impl FnOnce(&Path) -> Result<T, Error>) -> Result<T, Error> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".coadapt-").suffix(".new");
    #[cfg(unix)]
    builder.permissions(usual_rights(0o777));
    let place = builder.tempdir_in(parent(out)).map_err(|cause| no_place(out, &cause))?;
    let written = write(place.path()).map_err(|error| of_place(error, place.path(), out))?;
    demand_nothing_at(out)?;
    fs::rename(place.path(), out).map_err(|cause| no_place(out, &cause))?;
    // It is elsewhere now: there is nothing to clear away.
    let _ = place.keep();
    Ok(written)
}

/// Lets `write` fill a file beside `out`, which takes its place when all is well.
#[cfg(feature = "mcap")]
fn as_file<T>(out: &Path, write: impl FnOnce(&fs::File) -> Result<T, Error>) -> Result<T, Error> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".coadapt-").suffix(".new");
    #[cfg(unix)]
    builder.permissions(usual_rights(0o666));
    let place = builder.tempfile_in(parent(out)).map_err(|cause| no_place(out, &cause))?;
    let written = write(place.as_file()).map_err(|error| of_place(error, place.path(), out))?;
    place.persist_noclobber(out).map_err(|fault| no_place(out, &fault.error))?;
    Ok(written)
}

/// Those of any new file; the system takes away what the user's mask says.
#[cfg(unix)]
fn usual_rights(mode: u32) -> fs::Permissions {
    use std::os::unix::fs::PermissionsExt;
    fs::Permissions::from_mode(mode)
}
