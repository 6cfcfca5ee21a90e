//! `results.csv`: a row for every number, so that any statistics program can read it.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::StudyError;
use super::plan::Run;
use super::results::Done;

/// The columns of `results.csv`: a contract with whoever reads it.
pub const COLUMNS: [&str; 10] = [
    "run",
    "arm",
    "operator",
    "setting",
    "seed",
    "checkpoint",
    "readout",
    "start",
    "measure",
    "value",
];

/// Writes the numbers of `runs` to `path`, whole or not at all. `read` gives what a run came to,
/// if it did.
///
/// # Errors
/// When the disk refuses.
pub fn write_table<'a>(
    path: &Path,
    runs: impl Iterator<Item = &'a Run>,
    read: &dyn Fn(u32) -> Option<Done>,
) -> Result<(), StudyError> {
    whole(path, |file| {
        let mut table = rows_of(file);
        table.write_record(COLUMNS)?;
        for done in runs.filter_map(|run| read(run.number)) {
            let of = &done.labels;
            for row in &done.rows {
                table.serialize((
                    of.run,
                    &of.arm,
                    &of.operator,
                    &of.setting,
                    of.seed,
                    row.checkpoint,
                    &row.readout,
                    &row.start,
                    &row.measure,
                    row.value,
                ))?;
            }
        }
        Ok(table.flush()?)
    })
}

/// A table in `file`, whose head is written as a row.
pub(super) fn rows_of<W: Write>(file: W) -> csv::Writer<W> {
    csv::WriterBuilder::new().has_headers(false).from_writer(file)
}

/// Writes the file `path` by `write`, whole or not at all.
pub(super) fn whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), csv::Error>,
) -> Result<(), StudyError> {
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    let new = Path::new(&name);
    let written = || -> Result<(), csv::Error> {
        let mut file = BufWriter::new(File::create(new)?);
        write(&mut file)?;
        file.flush()?;
        Ok(fs::rename(new, path)?)
    };
    written().map_err(|error| {
        let _ = fs::remove_file(new);
        let cause = match error.into_kind() {
            csv::ErrorKind::Io(cause) => cause,
            other => io::Error::other(format!("{other:?}")),
        };
        StudyError::disk("write", path, cause)
    })
}

/// The study's folder of figures, made if it is not there.
pub(super) fn folder_in(folder: &Path, name: &str) -> Result<PathBuf, StudyError> {
    let path = folder.join(name);
    fs::create_dir_all(&path).map_err(|error| StudyError::disk("make", &path, error))?;
    Ok(path)
}
