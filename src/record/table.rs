//! A CSV file that is appended to, whole rows at a time.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::Error;

/// Bytes kept in memory before they are written.
const BUFFER_BYTES: usize = 1 << 16;

/// A CSV file open for appending.
pub(super) struct Table {
    rows: csv::Writer<Sink>,
    path: PathBuf,
}

impl Table {
    /// Opens the file for appending; a new or empty one gets the header.
    pub(super) fn open(path: PathBuf, header: &[&str]) -> Result<Self, Error> {
        let file = OpenOptions::new().append(true).create(true).open(&path);
        let file = file.map_err(Error::io("open", &path))?;
        let length = file.metadata().map_err(Error::io("open", &path))?.len();
        let sink = Sink { file, length, whole: length, broken: false };
        let rows = csv::WriterBuilder::new()
            .has_headers(false)
            .buffer_capacity(BUFFER_BYTES)
            .from_writer(sink);
        let mut table = Self { rows, path };
        if length == 0 {
            let written = table.rows.write_record(header);
            written.map_err(|fault| table.fault(fault))?;
            table.flush()?;
        }
        Ok(table)
    }

    /// Appends a row. Floats take the shortest form that reads back to the same bits,
    /// `None` is an empty cell.
    pub(super) fn append(&mut self, row: &impl Serialize) -> Result<(), Error> {
        self.rows.serialize(row).map_err(|fault| self.fault(fault))
    }

    /// Hands all rows to the operating system: they now outlive this process.
    pub(super) fn flush(&mut self) -> Result<(), Error> {
        self.rows.flush().map_err(Error::io("write", &self.path))
    }

    /// Waits until all rows outlive a loss of power.
    pub(super) fn sync(&mut self) -> Result<(), Error> {
        self.flush()?;
        self.rows.get_ref().file.sync_data().map_err(Error::io("sync", &self.path))
    }

    /// The file's length in bytes, as of the last flush.
    pub(super) fn length(&self) -> u64 {
        self.rows.get_ref().length
    }

    fn fault(&self, fault: csv::Error) -> Error {
        let cause = match fault.into_kind() {
            csv::ErrorKind::Io(cause) => cause,
            other => io::Error::other(format!("{other:?}")),
        };
        Error::Io { action: "write", path: self.path.clone(), cause }
    }
}

/// The file behind a table. When a write fails, half a row is taken back and nothing is
/// written any more, so that what is kept stays whole.
struct Sink {
    file: File,
    length: u64,
    /// The length up to the last whole row. No cell holds a line break.
    whole: u64,
    broken: bool,
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.broken {
            return Err(io::Error::other("an earlier write failed"));
        }
        match self.file.write(bytes) {
            Ok(count) if count > 0 => {
                if let Some(end) = bytes[..count].iter().rposition(|byte| *byte == b'\n') {
                    self.whole = self.length + end as u64 + 1;
                }
                self.length += count as u64;
                Ok(count)
            }
            Err(fault) if fault.kind() == ErrorKind::Interrupted => Err(fault),
            other => {
                self.broken = true;
                // The reader leaves half a row out as well, should this fail too.
                if self.whole < self.length && self.file.set_len(self.whole).is_ok() {
                    self.length = self.whole;
                }
                other
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The length of `file` up to the end of its last whole row.
pub(super) fn whole_length(file: &mut File) -> io::Result<u64> {
    let mut end = file.seek(SeekFrom::End(0))?;
    let mut block = [0; 4096];
    while end > 0 {
        let start = end.saturating_sub(block.len() as u64);
        // At most a block: it fits.
        let length = usize::try_from(end - start).unwrap_or(block.len());
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(&mut block[..length])?;
        if let Some(last) = block[..length].iter().rposition(|byte| *byte == b'\n') {
            return Ok(start + last as u64 + 1);
        }
        end = start;
    }
    Ok(0)
}

/// Opens `path` for reading up to the end of its last whole row.
pub(super) fn open_whole(path: &Path) -> Result<io::Take<File>, Error> {
    let open = || {
        let mut file = File::open(path)?;
        let whole = whole_length(&mut file)?;
        file.seek(SeekFrom::Start(0))?;
        Ok(file.take(whole))
    };
    open().map_err(Error::io("read", path))
}
