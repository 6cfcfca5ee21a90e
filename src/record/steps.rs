//! Step rows in a file of their own, without a session around them.

use std::fs;
use std::path::{Path, PathBuf};

use super::names::{LATER_STEP_COLUMNS, STEP_COLUMNS};
use super::table::Table;
use super::{Error, StepRow};

/// A file with the columns of `steps.csv`.
pub struct StepFile {
    table: Table,
    path: PathBuf,
}

impl StepFile {
    /// Begins the file at `path`, whose states have the columns `state`.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn create(path: &Path, state: &[&str]) -> Result<Self, Error> {
        let (before, after) = STEP_COLUMNS;
        let state = state.iter().copied();
        let header: Vec<&str> =
            before.into_iter().chain(state).chain(after).chain(LATER_STEP_COLUMNS).collect();
        Ok(Self { table: Table::open(path.to_owned(), &header)?, path: path.to_owned() })
    }

    /// Appends a row.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn append(&mut self, row: &StepRow) -> Result<(), Error> {
        self.table.append(row)
    }

    /// Writes what is left and gives the file the name `path`.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn close(mut self, path: &Path) -> Result<(), Error> {
        self.table.flush()?;
        fs::rename(&self.path, path).map_err(Error::io("rename", &self.path))
    }
}
