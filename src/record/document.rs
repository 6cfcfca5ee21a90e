//! JSON files: stamped with what they are, written whole, read with a reason or not at all.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::error::Category;

use super::{Error, finite, layout};

/// The version of the files' form. A newer one is refused.
const SCHEMA: u32 = 1;

/// What one of this program's JSON files holds.
pub trait Document {
    /// The word that tells the kinds of files apart.
    const KIND: &'static str;
    /// Whether people are expected to read it.
    const PRETTY: bool = false;
}

#[derive(Serialize)]
struct Stamped<'a, T> {
    schema: u32,
    program: &'static str,
    kind: &'static str,
    #[serde(flatten)]
    body: &'a T,
}

#[derive(Deserialize)]
struct Stamp {
    schema: Option<u32>,
    program: Option<String>,
    kind: Option<String>,
}

/// The text of `document`, which is to stand in `path`.
///
/// # Errors
/// When it holds a number that is not finite.
pub(super) fn text<T: Document + Serialize>(path: &Path, document: &T) -> Result<Vec<u8>, Error> {
    finite::check(document)
        .map_err(|fault| Error::unfit(path, format!("not written, since {fault}")))?;
    let stamped = Stamped { schema: SCHEMA, program: "coadapt", kind: T::KIND, body: document };
    let text = if T::PRETTY { layout::to_vec(&stamped) } else { serde_json::to_vec(&stamped) };
    let mut text = text.map_err(|e| Error::unfit(path, format!("not written: {e}")))?;
    text.push(b'\n');
    Ok(text)
}

/// Replaces `path` whole by `document`: a reader, or a resume after a kill, finds the old
/// file or the new one. `durable` also outlives a loss of power.
///
/// # Errors
/// When the document holds a number that is not finite, or the disk refuses; the old file
/// is then untouched.
pub fn write<T: Document + Serialize>(
    path: &Path,
    document: &T,
    durable: bool,
) -> Result<(), Error> {
    replace(path, &text(path, document)?, durable)
}

/// Replaces the file at `path` whole by `bytes`.
///
/// # Errors
/// When the disk refuses; the old file is then untouched.
pub(super) fn replace(path: &Path, bytes: &[u8], durable: bool) -> Result<(), Error> {
    let new = beside(path);
    let write = || {
        let mut file = File::create(&new)?;
        file.write_all(bytes)?;
        if durable { file.sync_all() } else { Ok(()) }
    };
    if let Err(cause) = write().and_then(|()| fs::rename(&new, path)) {
        // What was begun is of no use; that it may stay does no harm either.
        let _ = fs::remove_file(&new);
        return Err(Error::Io { action: "write", path: path.to_owned(), cause });
    }
    match path.parent() {
        Some(folder) if durable => sync(folder),
        _ => Ok(()),
    }
}

/// The name under which a new file is written before it takes its place.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    name.into()
}

/// Waits until a file's content, or a folder's list of files, outlives a loss of power.
pub(super) fn sync(path: &Path) -> Result<(), Error> {
    File::open(path).and_then(|file| file.sync_all()).map_err(Error::io("sync", path))
}

/// Reads a document.
///
/// # Errors
/// When the file is missing, is not JSON, is cut off, is another program's or another kind
/// of file, has a newer form or holds a wrong value: each with its own message.
pub fn read<T: Document + DeserializeOwned>(path: &Path) -> Result<T, Error> {
    let text = fs::read_to_string(path).map_err(Error::io("read", path))?;
    let kind = T::KIND;
    let stamp: Stamp = serde_json::from_str(&text).map_err(|e| misread(path, kind, &e))?;
    if stamp.program.as_deref() != Some("coadapt") {
        return Err(Error::unfit(path, format!("this JSON file is not a {kind} of coadapt's")));
    }
    match stamp.kind {
        Some(other) if other != kind => {
            return Err(Error::unfit(path, format!("this is a {other}, not a {kind}")));
        }
        _ => {}
    }
    match stamp.schema {
        Some(SCHEMA) => {}
        Some(other) if other > SCHEMA => {
            let problem = format!(
                "this {kind} has schema {other}, written by a newer coadapt; \
                 version {} reads up to schema {SCHEMA}: update coadapt",
                super::VERSION
            );
            return Err(Error::unfit(path, problem));
        }
        _ => return Err(Error::unfit(path, format!("this {kind} lacks a valid `schema`"))),
    }
    serde_json::from_str(&text).map_err(|e| misread(path, kind, &e))
}

fn misread(path: &Path, kind: &str, fault: &serde_json::Error) -> Error {
    let problem = match fault.classify() {
        Category::Eof => format!("this {kind} is cut off: {fault}"),
        Category::Syntax => format!("this is not a valid JSON file: {fault}"),
        Category::Data | Category::Io => format!("this {kind} holds a wrong value: {fault}"),
    };
    Error::unfit(path, problem)
}
