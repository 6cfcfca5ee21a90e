//! Studies: many sessions, compared.
//!
//! ```text
//! profiles/studies/NAME.ron ─ plan ─▶ runs: setting × operator × seed × arm
//!                                       │ work: as many threads as cores, no order needed
//!                                       ▼
//!     session: the one control cycle on virtual time; policies tested at each tenth of main
//!                                       │
//!                                       ▼ folder: runs/00001.json …, each whole or not there
//!     conclude: results.csv, summary.json (means, intervals, differences), figures, words
//! ```
//!
//! A run depends on nothing but its study and its number. The arms of a seed have the same
//! chance: starts, noise and people are drawn from streams that only the seed names. So results
//! are the same to the last bit with any number of threads, in shards, or taken up again after a
//! kill.

mod check;
mod conclude;
mod fields;
mod figures;
mod folder;
mod identity;
mod library;
mod merge;
mod notes;
mod optimum;
mod params;
mod plan;
mod readout;
mod results;
mod session;
mod shard;
pub mod slurm;
mod summary;
mod sweep;
mod table;
mod tracks;
mod words;
mod work;

use std::io;
use std::path::{Path, PathBuf};

use crate::learner::BuildError;
use crate::profile::{ProfileError, Report};
use crate::record;

pub use conclude::{Conclusion, Manner, conclude};
pub use folder::{Card, Folder, Kept, Outcome, card, read, steps};
pub use library::names;
pub use merge::{Merged, merge};
pub use params::{Params, Readout, Reference};
pub use plan::{Changes, Labels, REFERENCE_ARM, Run, Study, What};
pub use results::{Cells, Done, Point, Row, Table, Trajectory};
pub use session::{Failure, perform, person};
pub use shard::Shard;
pub use work::{Desk, Perform, Progress, Tally, work};

/// Why a study was not done.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// There is no such study or profile, or it cannot be read.
    #[error(transparent)]
    Profile(#[from] ProfileError),
    /// Its text, or that of its profile, is wrong.
    #[error("{0}")]
    Text(Report),
    /// The learner cannot be made.
    #[error("{error}")]
    Learner {
        /// Why.
        error: BuildError,
    },
    /// There is too much of it.
    #[error("{problem}: leave out some seeds, settings or operators")]
    TooMany {
        /// What.
        problem: String,
    },
    /// Changes that do not go with the study, or with each other.
    #[error("{problem}")]
    Sets {
        /// Why, and what to do.
        problem: String,
    },
    /// A signal came.
    #[error("interrupted")]
    Interrupted,
    /// The folder holds something else.
    #[error("{} holds something else: {why}; choose another folder with --out DIR, or take this one away", path.display())]
    OtherStudy {
        /// The folder.
        path: PathBuf,
        /// What.
        why: String,
    },
    /// The folder holds no study.
    #[error("{} holds no study: there is no study.json; name the folder of one, such as logs/studies/balance", path.display())]
    NoStudy {
        /// The folder.
        path: PathBuf,
    },
    /// The folder's card cannot be read.
    #[error(
        "{why}; without it nobody knows of which study its runs are: put study.json back from a copy, \
         or take the folder away"
    )]
    Card {
        /// Which, and why.
        why: record::Error,
    },
    /// Somebody else works in the folder.
    #[error("{} is in use: another coadapt works on this study; let that one end first", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// Shards that do not go together.
    #[error("{} does not go with {}: {why}", path.display(), first.display())]
    Misfit {
        /// The shard,
        path: PathBuf,
        /// the first one,
        first: PathBuf,
        /// and why.
        why: String,
    },
    /// The study of shards cannot be found again.
    #[error("the study of {}, {found}, cannot be read again: {why}; put back where it was what is missing", path.display())]
    Gone {
        /// The first shard,
        path: PathBuf,
        /// the name or path of its study,
        found: String,
        /// and why.
        why: Box<StudyError>,
    },
    /// The study of shards is not what it was.
    #[error("{} is of another study than {found} is now: {why}; put it back as it was, or run the shards anew", path.display())]
    Changed {
        /// The first shard,
        path: PathBuf,
        /// the name or path of its study,
        found: String,
        /// and what has changed.
        why: String,
    },
    /// The disk refused.
    #[error("cannot {action} {}: {cause}{}", path.display(), advice(cause))]
    Disk {
        /// What was tried,
        action: &'static str,
        /// on which file or folder,
        path: PathBuf,
        /// and what the system said.
        cause: io::Error,
    },
    /// A file is not what it should be.
    #[error(transparent)]
    File(record::Error),
}

impl StudyError {
    fn disk(action: &'static str, path: &Path, cause: io::Error) -> Self {
        Self::Disk { action, path: path.to_owned(), cause }
    }

    /// Whether it is what was asked for that is wrong, and not what happened.
    #[must_use]
    pub const fn is_usage(&self) -> bool {
        !matches!(self, Self::Disk { .. } | Self::Busy { .. } | Self::Interrupted)
    }
}

impl From<record::Error> for StudyError {
    fn from(error: record::Error) -> Self {
        match error {
            record::Error::Io { action, path, cause } => Self::Disk { action, path, cause },
            other => Self::File(other),
        }
    }
}

fn advice(cause: &io::Error) -> &'static str {
    match cause.kind() {
        io::ErrorKind::StorageFull
        | io::ErrorKind::QuotaExceeded
        | io::ErrorKind::FileTooLarge
        | io::ErrorKind::WriteZero => "; free some space, or choose another disk with --out DIR",
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; choose a folder that you may write to with --out DIR"
        }
        io::ErrorKind::NotADirectory | io::ErrorKind::AlreadyExists => {
            "; a file stands where a folder should be: choose another with --out DIR"
        }
        _ => "",
    }
}
