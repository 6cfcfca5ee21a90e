//! `coadapt watch`: another terminal looks at a session; and the session's side of it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::replay::shown;
use super::session::{Session, usage};
use super::{RunError, screen};
use crate::cli;
use crate::control::watch::line::Hello;
use crate::control::watch::{Found, Place, Post, WatchError};
use crate::profile::Document;
use crate::record::{self, Sidecar, Status};
use crate::session::Subject;
use crate::tui::terminal::{KeysFrom, Screen};
use crate::tui::watch::{self, Lookout, Watched};

/// Lets others of this user watch `session`, for as long as the post is kept.
///
/// # Errors
/// When there is no safe place for its socket; the session goes on without.
pub(super) fn post(session: &Session) -> Result<Post, WatchError> {
    let folder = absolute(session.folder()).display().to_string();
    let hello = Hello::new(folder, session.sidecar().clone());
    Post::open(&Place::here(), hello, session.watcher.clone())
}

/// `coadapt watch …`
pub(super) fn watch(words: &cli::Watch) -> Result<ExitCode, RunError> {
    let wanted = Wanted::of(words.session.as_deref())?;
    Screen::check(KeysFrom::Input).map_err(|error| usage(&error))?;
    let mut watcher = Watching { wanted, place: Place::here() };
    // Of several one must be named before anything is shown.
    let (found, _) = watcher.look_around();
    if found.len() > 1 {
        let mut lines = vec!["several sessions run; name one:".to_owned()];
        lines.extend(found.iter().map(|session| named(&session.hello)));
        return Err(RunError::Usage(lines.join("\n")));
    }
    drop(found);
    shown(|screen, is_over| {
        let mut lookout = Looking { watching: &mut watcher, is_over };
        watch::show(screen, &mut lookout)
    })
}

/// How a session is named on the command line, and what it is.
fn named(hello: &Hello) -> String {
    let Sidecar { task, mode, subject, trial, .. } = &hello.sidecar;
    format!("  coadapt watch {}   {subject}, trial {trial}: {task}, {}", hello.folder, mode.word())
}

/// Which session is wanted.
enum Wanted {
    /// Any.
    Any,
    /// One of this subject.
    Of(Subject),
    /// The one in this folder.
    In(PathBuf),
}

impl Wanted {
    fn of(words: Option<&str>) -> Result<Self, RunError> {
        let Some(words) = words else { return Ok(Self::Any) };
        let path = Path::new(words);
        let file = path.join("session.json");
        if file.exists() {
            let sidecar = record::read_sidecar(&file).map_err(|error| usage(&error))?;
            if sidecar.status == Status::Complete {
                return Err(RunError::Usage(format!(
                    "{words}: this session is complete; see it again with coadapt replay {words}"
                )));
            }
            return Ok(Self::In(absolute(path)));
        }
        words.parse().map(Self::Of).map_err(|error| {
            if words.contains('/') {
                RunError::Usage(format!(
                    "{words}: no session is there; name a subject to wait for their next one"
                ))
            } else {
                usage(&error)
            }
        })
    }

    fn is(&self, hello: &Hello) -> bool {
        match self {
            Self::Any => true,
            Self::Of(subject) => hello.sidecar.subject == *subject,
            Self::In(folder) => Path::new(&hello.folder) == folder,
        }
    }

    /// What is awaited, in words.
    fn words(&self) -> String {
        match self {
            Self::Any => "The first session to begin is shown here.".to_owned(),
            Self::Of(subject) => format!("The next session of subject {subject} is shown here."),
            Self::In(folder) => {
                format!("The session in {} is shown here once it goes on.", folder.display())
            }
        }
    }
}

/// `folder` from the root, through no links.
fn absolute(folder: &Path) -> PathBuf {
    fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned())
}

struct Watching {
    wanted: Wanted,
    place: Place,
}

impl Watching {
    /// The sessions that fit, and what is said of those that are not understood.
    fn look_around(&self) -> (Vec<Found>, Vec<String>) {
        let (mut found, strange) = Found::all(&self.place);
        found.retain(|session| self.wanted.is(&session.hello));
        (found, strange.iter().map(|why| format!("A session runs, but {why}.")).collect())
    }
}

struct Looking<'a> {
    watching: &'a mut Watching,
    is_over: &'a dyn Fn() -> bool,
}

impl Lookout for Looking<'_> {
    fn find(&mut self) -> Result<Watched, Vec<String>> {
        let (mut found, mut words) = self.watching.look_around();
        if found.len() > 1 {
            words.push("Several sessions run. Leave with q and name one:".to_owned());
            words.extend(found.iter().map(|session| named(&session.hello)));
            return Err(words);
        }
        let Some(session) = found.pop() else {
            words.push(self.watching.wanted.words());
            return Err(words);
        };
        watched(session).map_err(|why| vec![why])
    }

    fn is_told_to_end(&self) -> bool {
        (self.is_over)()
    }
}

/// Begins to watch `session`.
fn watched(session: Found) -> Result<Watched, String> {
    let sidecar = &session.hello.sidecar;
    let profile = Document::from_text("session", sidecar.profile_ron.clone())
        .read()
        .map_err(|report| report.to_string())?;
    let info = screen::info_of(&profile, sidecar);
    let following = session.follow();
    Ok(Watched {
        info,
        watcher: following.watcher.clone(),
        screen: profile.screen.clone(),
        is_over: Box::new(move || following.is_over()),
    })
}
