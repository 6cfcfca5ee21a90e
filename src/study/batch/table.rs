//! Files that are written bit by bit and take their place whole, and tables in them.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::StudyError;

/// A file that is `NAME.new` until it is kept; one that is not kept leaves nothing behind.
pub(super) struct NewFile {
    path: PathBuf,
    new: PathBuf,
    file: BufWriter<File>,
    is_kept: bool,
}

impl NewFile {
    /// Begins the file that is to be `path`.
    pub(super) fn begin(path: PathBuf) -> Result<Self, StudyError> {
        let mut new = path.as_os_str().to_owned();
        new.push(".new");
        let new = PathBuf::from(new);
        let file = File::create(&new).map_err(|error| StudyError::disk("write", &path, error))?;
        Ok(Self { path, new, file: BufWriter::new(file), is_kept: false })
    }

    /// Writes `text`.
    pub(super) fn put(&mut self, text: &str) -> Result<(), StudyError> {
        self.file.write_all(text.as_bytes()).map_err(|error| self.refused(error))
    }

    /// That `error` came of writing it.
    pub(super) fn refused(&self, error: io::Error) -> StudyError {
        StudyError::disk("write", &self.path, error)
    }

    /// Puts it in its place.
    pub(super) fn keep(mut self) -> Result<(), StudyError> {
        let written = self.file.flush().and_then(|()| fs::rename(&self.new, &self.path));
        written.map_err(|error| self.refused(error))?;
        self.is_kept = true;
        Ok(())
    }
}

impl Drop for NewFile {
    fn drop(&mut self) {
        if !self.is_kept {
            // That it may stay does no harm.
            let _ = fs::remove_file(&self.new);
        }
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// A table in a new file.
pub(super) struct Sheet {
    path: PathBuf,
    table: csv::Writer<NewFile>,
    is_empty: bool,
}

impl Sheet {
    /// Begins the table `path` with these columns.
    pub(super) fn begin<'a>(
        path: PathBuf,
        columns: impl IntoIterator<Item = &'a &'a str>,
    ) -> Result<Self, StudyError> {
        let file = NewFile::begin(path.clone())?;
        let table = csv::WriterBuilder::new().has_headers(false).from_writer(file);
        let mut sheet = Self { path, table, is_empty: true };
        sheet.row(columns.into_iter().collect::<Vec<_>>())?;
        sheet.is_empty = true;
        Ok(sheet)
    }

    /// Writes a row.
    pub(super) fn row(&mut self, row: impl Serialize) -> Result<(), StudyError> {
        self.is_empty = false;
        self.table.serialize(row).map_err(|error| {
            let cause = match error.into_kind() {
                csv::ErrorKind::Io(cause) => cause,
                other => io::Error::other(format!("{other:?}")),
            };
            StudyError::disk("write", &self.path, cause)
        })
    }

    /// Puts it in its place.
    pub(super) fn keep(self) -> Result<(), StudyError> {
        let file = self.table.into_inner().map_err(|error| {
            let cause = io::Error::new(error.error().kind(), error.error().to_string());
            StudyError::disk("write", &self.path, cause)
        })?;
        file.keep()
    }

    /// Puts it in its place if it has a row.
    pub(super) fn keep_if_filled(self) -> Result<(), StudyError> {
        if self.is_empty { Ok(()) } else { self.keep() }
    }
}

/// The study's folder of that name, made if it is not there.
pub(super) fn folder_in(folder: &Path, name: &str) -> Result<PathBuf, StudyError> {
    let path = folder.join(name);
    fs::create_dir_all(&path).map_err(|error| StudyError::disk("make", &path, error))?;
    Ok(path)
}
