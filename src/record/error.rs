//! What can go wrong with files, told so that the next step is clear.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Why something could not be kept or read back.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused.
    #[error("cannot {action} {}: {cause}{}", path.display(), advice(cause.kind()))]
    Io {
        /// What was tried, such as `write`.
        action: &'static str,
        /// On which file or folder.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// A cell of a CSV file does not read.
    #[error("{}, line {line}, column {column}: {problem}", path.display())]
    Cell {
        /// The file.
        path: PathBuf,
        /// The line, from 1 (the header).
        line: u64,
        /// The column's name.
        column: String,
        /// What is wrong, and what was expected.
        problem: String,
    },
    /// A file is not what it should be.
    #[error("{}: {problem}", path.display())]
    Unfit {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong, and what to do.
        problem: String,
    },
    /// A folder is no session's.
    #[error("{}: {why}", path.display())]
    NoSession {
        /// The folder.
        path: PathBuf,
        /// What is there instead, and what to give.
        why: String,
    },
    /// An export has no place.
    #[error("cannot export to {}: {cause}; name another place with --out PATH", path.display())]
    NoPlace {
        /// Where it was to be.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// Another process records this session.
    #[error(
        "{} is being recorded by another coadapt; let that one end first, or start a new session",
        path.display()
    )]
    Busy {
        /// The session's folder.
        path: PathBuf,
    },
    /// The writer thread panicked.
    #[error(
        "the writer thread died; rows up to that moment are in {}: resume the session from there",
        path.display()
    )]
    WriterDied {
        /// The session's folder.
        path: PathBuf,
    },
}

impl Error {
    /// For `map_err`: `action` failed on `path`.
    pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |cause| Self::Io { action, path, cause }
    }

    /// What is wrong with the file or folder, without its name.
    #[must_use]
    pub fn why(&self) -> String {
        let whole = self.to_string();
        let rest = whole.strip_prefix(&self.path().display().to_string());
        rest.map_or_else(
            || whole.clone(),
            |rest| rest.trim_start_matches([':', ',', ' ']).to_owned(),
        )
    }

    /// The file or folder that it is about.
    #[must_use]
    pub fn path(&self) -> &Path {
        let (Self::Io { path, .. }
        | Self::Cell { path, .. }
        | Self::Unfit { path, .. }
        | Self::NoSession { path, .. }
        | Self::NoPlace { path, .. }
        | Self::Busy { path }
        | Self::WriterDied { path }) = self;
        path
    }

    pub(super) fn unfit(path: &Path, problem: impl Into<String>) -> Self {
        Self::Unfit { path: path.to_owned(), problem: problem.into() }
    }
}

fn advice(kind: ErrorKind) -> &'static str {
    match kind {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::WriteZero => {
            "; free some space, or choose a folder on another disk with --logs DIR"
        }
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            "; choose a folder that you may write to with --logs DIR"
        }
        ErrorKind::NotADirectory | ErrorKind::AlreadyExists => {
            "; a file stands where a folder should be: move it, or choose another with --logs DIR"
        }
        _ => "",
    }
}
