//! `coadapt report`: what came out of sessions and studies, as a page, files, text or JSON.

use std::fs;
use std::io::{self, Write as _};
use std::path::Path;
use std::process::ExitCode;

use serde::Serialize;

use super::curtain::shown;
use super::{RunError, progress, say, tell};
use crate::cli;
use crate::record::{self, VERSION};
use crate::report::compose::compose;
use crate::report::figure::{Item, Report};
use crate::report::gather::{Gathered, find, gather, holds_records};
use crate::report::{draw, html, text};
use crate::tui::report::{Bench, Pages, show};
use crate::tui::terminal::{KeysFrom, Screen};

/// Of the JSON object.
const SCHEMA: u32 = 1;

/// `coadapt report …`
pub(super) fn report(words: &cli::Report) -> Result<ExitCode, RunError> {
    let gathered = read(words);
    for left in &gathered.left_out {
        tell(&format!("left out: {}: {}", left.path, left.why));
    }
    if gathered.sessions.is_empty() && gathered.studies.is_empty() {
        let hint = "nothing to report: no session and no study can be used; name the folder of \
                    one, or one above some, such as logs";
        return Err(RunError::Usage(hint.to_owned()));
    }
    let report = compose(&gathered);
    if let Some(folder) = &words.csv {
        write_files(&report, folder)?;
        let items = report.items().count();
        tell(&format!("the data of {items} figures and tables are in {}", folder.display()));
    }
    if let Some(path) = &words.out {
        write_whole(path, html::page(&report, VERSION).as_bytes())?;
        tell(&format!("the report is in {}", path.display()));
    }
    if words.json {
        say(&json(&report, &gathered)?)?;
    } else if words.out.is_none() && words.csv.is_none() {
        if Screen::check(KeysFrom::Input).is_ok() {
            let pages = Pages::new(&report);
            return shown(|screen, is_over| show(screen, &mut Desk { is_over }, pages));
        }
        say(&text::lines(&report).join("\n"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Does what the screen cannot.
struct Desk<'a> {
    is_over: &'a dyn Fn() -> bool,
}

impl Bench for Desk<'_> {
    fn save(&mut self, item: &Item) -> String {
        let (data, name) = (item.data_file(), &item.caption().name);
        match (write_item(item, Path::new(".")), item) {
            (Ok(()), Item::Figure(_)) => format!("saved {name}.svg and {data} here"),
            (Ok(()), Item::Table(_)) => format!("saved {data} here"),
            (Err(error), _) => error.to_string(),
        }
    }

    fn is_told_to_end(&self) -> bool {
        (self.is_over)()
    }
}

fn read(words: &cli::Report) -> Gathered {
    let found = find(&words.folders);
    let bar = progress::bar(found.sessions.len(), "sessions");
    let gathered = gather(found, &|| {
        if let Some(bar) = &bar {
            bar.inc(1);
        }
    });
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    gathered
}

/// Writes the data of all figures and tables, and the figures themselves, into `folder`.
fn write_files(report: &Report, folder: &Path) -> Result<(), RunError> {
    fs::create_dir_all(folder).map_err(|error| failed("make the folder", folder, &error))?;
    report.items().try_for_each(|item| write_item(item, folder))
}

/// Writes the data of `item`, and the figure itself, into `folder`.
fn write_item(item: &Item, folder: &Path) -> Result<(), RunError> {
    write_whole(&folder.join(item.data_file()), item.csv().as_bytes())?;
    if let Item::Figure(figure) = item {
        let path = folder.join(format!("{}.svg", figure.caption.name));
        write_whole(&path, draw::alone(figure).as_bytes())?;
    }
    Ok(())
}

/// Writes a file that is there whole or not at all; where something that is no file is there, as
/// a pipe, to that. What was recorded is not written over.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), RunError> {
    // A link that leads somewhere stays one.
    let path = &fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if holds_records(folder) {
        return Err(RunError::Usage(format!(
            "{} holds a session or a study, whose files stay as they are: choose another place",
            folder.display()
        )));
    }
    let write = || -> io::Result<()> {
        if fs::metadata(path).is_ok_and(|there| !there.is_file()) {
            return fs::OpenOptions::new().write(true).open(path)?.write_all(bytes);
        }
        let mut file = for_all(&mut tempfile::Builder::new()).tempfile_in(folder)?;
        file.write_all(bytes)?;
        file.persist(path).map_err(|error| error.error)?;
        Ok(())
    };
    write().map_err(|error| failed("write", path, &error))
}

/// A temporary file is for its owner only; a report is for whom the user's mask says.
fn for_all<'a, 'b, 'c>(
    builder: &'c mut tempfile::Builder<'a, 'b>,
) -> &'c mut tempfile::Builder<'a, 'b> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder
}

fn failed(action: &str, path: &Path, error: &io::Error) -> RunError {
    let error = record::plain(error);
    let hint = "choose a place that is there and that you may write to";
    RunError::Failed(format!("cannot {action} {}: {error}; {hint}", path.display()))
}

/// The report as one JSON object.
fn json(report: &Report, gathered: &Gathered) -> Result<String, RunError> {
    #[derive(Serialize)]
    struct Session<'a> {
        path: String,
        subject: &'a str,
        trial: u32,
        task: &'a str,
        preset: &'a str,
        mode: &'static str,
        learner: &'a str,
        operator: &'a str,
        backend: &'a str,
        seed: u64,
        status: crate::record::Status,
    }
    #[derive(Serialize)]
    struct Object<'a> {
        schema: u32,
        version: &'static str,
        sessions: Vec<Session<'a>>,
        studies: Vec<String>,
        #[serde(flatten)]
        report: &'a Report,
    }
    let sessions = gathered.sessions.iter().map(|session| Session {
        path: session.path.display().to_string(),
        subject: &session.subject,
        trial: session.trial,
        task: &session.task,
        preset: &session.preset,
        mode: session.mode.word(),
        learner: &session.learner,
        operator: &session.operator,
        backend: &session.backend,
        seed: session.seed,
        status: session.status,
    });
    let studies = gathered.studies.iter().map(|study| study.path.display().to_string());
    let object = Object {
        schema: SCHEMA,
        version: VERSION,
        sessions: sessions.collect(),
        studies: studies.collect(),
        report,
    };
    serde_json::to_string(&object)
        .map_err(|error| RunError::Failed(format!("the report has no JSON: {error}")))
}
