//! What can go wrong with files, told so that the next step is clear.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Why something could not be kept or read back.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused.
    #[error("cannot {action} {}: {cause}{}", path.display(), advice(action, cause.kind()))]
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
        match self {
            Self::Io { action, cause, .. } => {
                format!("cannot {action} it: {cause}{}", advice(action, cause.kind()))
            }
            other => {
                let whole = other.to_string();
                let name = other.path().display().to_string();
                let rest = whole.strip_prefix(&name).unwrap_or(&whole);
                rest.trim_start_matches([':', ',', ' ']).to_owned()
            }
        }
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

    pub(crate) fn unfit(path: &Path, problem: impl Into<String>) -> Self {
        Self::Unfit { path: path.to_owned(), problem: problem.into() }
    }
}

/// What to do next; where something cannot be read no other place helps.
fn advice(action: &str, kind: ErrorKind) -> &'static str {
    match kind {
        ErrorKind::PermissionDenied if action == "read" => {
            "; ask its owner, or whom this computer is run by, for the right to read it"
        }
        _ if action == "read" => "",
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

/// What the system said, without the name of a temporary file that nobody asked for.
#[must_use]
pub fn plain(cause: &io::Error) -> io::Error {
    let text = cause.to_string();
    let said = text.split_once(" at path \"").map_or(&*text, |(said, _)| said);
    io::Error::new(cause.kind(), said.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_not_be_read_has_no_advice_for_writers() {
        let denied = || io::Error::from(ErrorKind::PermissionDenied);
        let path = Path::new("logs/S1");
        let read = Error::io("read", path)(denied());
        assert!(read.to_string().contains("right to read") && !read.to_string().contains("--logs"));
        assert!(read.why().starts_with("cannot read it: "), "{}", read.why());
        assert!(Error::io("write", path)(denied()).to_string().contains("--logs"));
        assert_eq!(Error::unfit(path, "it is empty").why(), "it is empty");
    }

    #[test]
    fn the_name_of_a_temporary_file_is_not_told() {
        let nowhere = tempfile::Builder::new().tempdir_in("/nowhere/at/all").unwrap_err();
        assert!(nowhere.to_string().contains(".tmp"), "{nowhere}");
        assert_eq!(plain(&nowhere).to_string(), "No such file or directory (os error 2)");
    }
}
