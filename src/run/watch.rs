//! `coadapt watch`: another terminal looks at a session; and the session's side of it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::rc::Rc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

use super::curtain::shown;
use super::session::{Session, usage};
use super::{RunError, screen};
use crate::cli;
use crate::control::watch::line::{Hello, Strange};
use crate::control::watch::{Found, Place, Post, WatchError};
use crate::profile::Document;
use crate::record::{self, Sidecar, Status};
use crate::session::Subject;
use crate::tui::terminal::{KeysFrom, Screen};
use crate::tui::watch::{self, Awaiting, Lookout, Watched};

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
    let mut watcher = Watching::new(wanted, Place::here());
    // Of several one must be named before anything is shown.
    let found = watcher.look_around();
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

/// What a look around finds: the sessions that fit, and the others that are not understood.
type Seen = (Vec<Found>, Vec<Strange>);

/// How long the screen waits for a look around. Sessions that answer do so at once.
const PATIENCE: Duration = Duration::from_millis(20);

struct Watching {
    wanted: Wanted,
    place: Place,
    /// A look around that takes its time, for some session does not answer.
    under_way: Option<Receiver<Seen>>,
    /// What was said last.
    said: Awaiting,
}

impl Watching {
    fn new(wanted: Wanted, place: Place) -> Self {
        let said = Awaiting { title: NOTHING.to_owned(), words: Vec::new() };
        let mut watching = Self { wanted, place, under_way: None, said };
        watching.said.words = watching.awaited();
        watching
    }

    /// The sessions that fit.
    fn look_around(&self) -> Vec<Found> {
        let (mut found, _) = Found::all(&self.place);
        found.retain(|session| self.wanted.is(&session.hello));
        found
    }

    /// The sessions that fit, and those that are not understood; `None` while that is looked for.
    /// A thread of its own does it: nothing that another program does holds up the screen.
    fn glance(&mut self) -> Option<Seen> {
        let under_way = self.under_way.take().or_else(|| {
            let (tell, hear) = mpsc::sync_channel(1);
            let place = self.place.clone();
            let looker = std::thread::Builder::new().name("coadapt-lookout".to_owned());
            looker.spawn(move || tell.send(Found::all(&place))).ok().map(|_| hear)
        })?;
        match under_way.recv_timeout(PATIENCE) {
            Ok((mut found, strange)) => {
                found.retain(|session| self.wanted.is(&session.hello));
                Some((found, strange))
            }
            Err(RecvTimeoutError::Timeout) => {
                self.under_way = Some(under_way);
                None
            }
            Err(RecvTimeoutError::Disconnected) => None,
        }
    }

    /// What is awaited, and where it is looked for.
    fn awaited(&self) -> Vec<String> {
        let folders: Vec<String> =
            self.place.folders().iter().map(|folder| folder.display().to_string()).collect();
        vec![self.wanted.words(), format!("Looked for in {}.", folders.join(", "))]
    }

    /// What to say of sessions of which none can be watched.
    fn words(&self, found: &[Found], strange: &[Strange]) -> Awaiting {
        let mut words: Vec<String> = strange
            .iter()
            .map(|why| match why {
                Strange::Silent { .. } => format!("{why}."),
                _ => format!("A session runs, but {why}."),
            })
            .collect();
        let is_silent = strange.iter().any(|why| matches!(why, Strange::Silent { .. }));
        let title = if found.len() > 1 {
            words.push("Leave with q and name one:".to_owned());
            words.extend(found.iter().map(|session| named(&session.hello)));
            "several sessions run"
        } else {
            words.extend(self.awaited());
            if is_silent { "a session does not answer" } else { NOTHING }
        };
        Awaiting { title: title.to_owned(), words }
    }
}

/// What stands above the words while there is no session.
const NOTHING: &str = "nothing to watch yet";

struct Looking<'a> {
    watching: &'a mut Watching,
    is_over: &'a dyn Fn() -> bool,
}

impl Lookout for Looking<'_> {
    fn find(&mut self) -> Result<Watched, Awaiting> {
        let Some((mut found, strange)) = self.watching.glance() else {
            return Err(self.watching.said.clone());
        };
        self.watching.said = self.watching.words(&found, &strange);
        match found.pop() {
            Some(session) if found.is_empty() => watched(session).map_err(|why| Awaiting {
                title: "a session cannot be shown".to_owned(),
                words: vec![why],
            }),
            _ => Err(self.watching.said.clone()),
        }
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
    let following = Rc::new(session.follow());
    let followed = Rc::clone(&following);
    Ok(Watched {
        info,
        watcher: following.watcher.clone(),
        screen: profile.screen.clone(),
        is_over: Box::new(move || followed.is_over()),
        news: Box::new(move || following.news()),
    })
}
