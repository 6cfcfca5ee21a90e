//! Files that are there whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::run::RunError;

/// A file in the making. Until it is kept, nothing of it is seen in its place.
pub(super) struct Whole {
    option: String,
    /// As given, for messages.
    shown: PathBuf,
    form: Form,
}

enum Form {
    /// Beside its place, which it takes at the end.
    Beside(NamedTempFile, PathBuf),
    /// A pipe or device, which cannot be replaced.
    Direct(File),
}

impl Whole {
    /// Makes sure that `path`, which `option` names, can be written. It may be none of the
    /// files that are `read`.
    pub(super) fn prepare(option: &str, path: &Path, read: &[&Path]) -> Result<Self, RunError> {
        let refuse = |why: String| RunError::Usage(format!("{option} {}: {why}", path.display()));
        let refused = |cause: io::Error| {
            refuse(format!("cannot be written: {cause}; choose a folder that is there and yours"))
        };
        let (option, shown) = (option.to_owned(), path.to_owned());
        // A link is followed, so that what it leads to is replaced and not the link.
        let beside = |to| path.parent().unwrap_or(Path::new("")).join::<PathBuf>(to);
        let place = fs::canonicalize(path)
            .or_else(|_| fs::read_link(path).map(beside))
            .unwrap_or_else(|_| path.to_owned());
        match fs::metadata(&place) {
            Ok(about) if about.is_dir() => {
                return Err(refuse("this is a folder; name a file in it".to_owned()));
            }
            Ok(about) if !about.is_file() => {
                let file = OpenOptions::new().write(true).open(&place).map_err(refused)?;
                return Ok(Self { option, shown, form: Form::Direct(file) });
            }
            _ => {}
        }
        if read.iter().any(|other| fs::canonicalize(other).is_ok_and(|other| other == place)) {
            return Err(refuse("this file is read by this very command; name another".to_owned()));
        }
        let is_within = |folder: &&Path| {
            folder.is_dir()
                && fs::canonicalize(folder).is_ok_and(|folder| place.starts_with(folder))
        };
        if place.exists() && read.iter().any(is_within) {
            let why = "this file is a part of the session, which stays as it is; name another";
            return Err(refuse(why.to_owned()));
        }
        let folder = match place.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".coadapt-").suffix(".new");
        #[cfg(unix)]
        let builder = {
            use std::os::unix::fs::PermissionsExt;
            // As any new file; the system takes away what the user's mask says.
            builder.permissions(fs::Permissions::from_mode(0o666))
        };
        let file = builder.tempfile_in(folder).map_err(refused)?;
        Ok(Self { option, shown, form: Form::Beside(file, place) })
    }

    /// Whether both would take the same place.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        let is_same = |a: &Path, b: &Path| {
            a.file_name() == b.file_name() && folder_of(a).ok() == folder_of(b).ok()
        };
        matches!((&self.form, &other.form),
            (Form::Beside(_, a), Form::Beside(_, b)) if is_same(a, b))
    }

    /// What is to be written into.
    pub(super) fn file(&mut self) -> &mut File {
        match &mut self.form {
            Form::Beside(file, _) => file.as_file_mut(),
            Form::Direct(file) => file,
        }
    }

    /// Writes all `bytes`.
    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<(), RunError> {
        self.file().write_all(bytes).map_err(|cause| self.failed(&cause))
    }

    /// Puts the file into its place, to outlive a loss of power, and returns its name.
    pub(super) fn keep(self) -> Result<PathBuf, RunError> {
        let Self { option, shown, form } = self;
        let Form::Beside(file, place) = form else { return Ok(shown) };
        let kept = file
            .as_file()
            .sync_all()
            .and_then(|()| file.persist(&place).map_err(|fault| fault.error))
            .and_then(|_| folder_of(&place))
            .and_then(|folder| File::open(folder)?.sync_all());
        match kept {
            Ok(()) => Ok(shown),
            Err(cause) => Err(failed(&option, &shown, &cause)),
        }
    }

    fn failed(&self, cause: &io::Error) -> RunError {
        failed(&self.option, &self.shown, cause)
    }
}

fn failed(option: &str, shown: &Path, cause: &io::Error) -> RunError {
    RunError::Failed(format!("{option} {} could not be written: {cause}", shown.display()))
}

/// The folder of a file, as the system knows it.
fn folder_of(path: &Path) -> io::Result<PathBuf> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => fs::canonicalize(folder),
        _ => fs::canonicalize("."),
    }
}
