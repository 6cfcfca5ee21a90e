//! What is in some folders: sessions and studies, and what cannot be used, each with the reason.

mod field;
mod outcome;
mod recorded;
mod trace;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::figure::LeftOut;

pub use field::Field;
pub use outcome::{
    CellDifference, Checkpoint, CurvePoint, Difference, Driven, Outcome, Sides, Value,
};
pub use recorded::{Recorded, read};
pub use trace::{Acted, Moment, Portrait, RegionTrack, Trace};

/// How deep folders are looked through: logs, subject, session, and some for archives.
const DEPTH: u32 = 8;

/// What some folders hold.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// The folders of sessions,
    pub sessions: Vec<PathBuf>,
    /// those of studies,
    pub studies: Vec<PathBuf>,
    /// and what is neither.
    pub left_out: Vec<LeftOut>,
}

/// What a folder is, by the files in it.
enum Kind {
    Session,
    Study,
    /// A session or a study without the file that says what it is.
    Headless(&'static str),
    /// Something with folders in it.
    Shelf(Vec<PathBuf>),
}

/// Looks for sessions and studies in `folders` and below them.
#[must_use]
pub fn find(folders: &[PathBuf]) -> Found {
    let mut found = Found::default();
    for folder in folders {
        let before = (found.sessions.len() + found.studies.len(), found.left_out.len());
        // A folder that was named is looked through, also where another led to it before.
        let is_there = look(folder, DEPTH, &mut BTreeSet::new(), &mut found);
        let after = (found.sessions.len() + found.studies.len(), found.left_out.len());
        if is_there && before == after {
            let why = "there is no session and no study in it; name a session's folder, or one \
                       above some, such as logs";
            found.leave_out(folder, why);
        }
    }
    let once = |paths: &mut Vec<PathBuf>| {
        let mut seen = BTreeSet::new();
        paths.sort();
        // One folder may be named in several ways.
        paths.retain(|path| seen.insert(itself(path)));
    };
    once(&mut found.sessions);
    once(&mut found.studies);
    found
}

/// The folder that `path` leads to, through all links.
fn itself(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

/// Looks at `folder` and below it; whether it could be read. Links may lead round and round: no
/// folder is `seen` twice.
fn look(folder: &Path, depth: u32, seen: &mut BTreeSet<PathBuf>, found: &mut Found) -> bool {
    if !seen.insert(itself(folder)) {
        return true;
    }
    match kind(folder) {
        Ok(Kind::Session) => found.sessions.push(folder.to_owned()),
        Ok(Kind::Study) => found.studies.push(folder.to_owned()),
        Ok(Kind::Headless(missing)) => {
            let why = format!("its {missing} is missing, so nobody knows what its rows are");
            found.leave_out(folder, &why);
        }
        Ok(Kind::Shelf(below)) if below.is_empty() && depth < DEPTH => {
            found.leave_out(folder, "it holds no session and no study");
        }
        Ok(Kind::Shelf(below)) if depth > 0 => {
            for folder in below {
                look(&folder, depth - 1, seen, found);
            }
        }
        Ok(Kind::Shelf(below)) if below.is_empty() => {}
        Ok(Kind::Shelf(_)) => {
            found.leave_out(folder, "folders so deep are not looked through; name it itself");
        }
        Err(error) => {
            let why = format!("it cannot be read ({error}); name the folder of a session or study");
            found.leave_out(folder, &why);
            return false;
        }
    }
    true
}

/// Whether something was recorded in `folder`, which stays as it is, or it is a part of a study.
#[must_use]
pub fn holds_records(folder: &Path) -> bool {
    let is_of_a_study = || matches!(folder.parent().map(recorded), Some(Ok(Some(Kind::Study))));
    matches!(recorded(folder), Ok(Some(_))) || is_of_a_study()
}

fn kind(folder: &Path) -> io::Result<Kind> {
    if let Some(kind) = recorded(folder)? {
        return Ok(kind);
    }
    let mut below = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let is_hidden = entry.file_name().as_encoded_bytes().starts_with(b".");
        if !is_hidden && entry.path().is_dir() {
            below.push(entry.path());
        }
    }
    below.sort();
    Ok(Kind::Shelf(below))
}

/// What was recorded in `folder`, if anything, by the names of its files.
fn recorded(folder: &Path) -> io::Result<Option<Kind>> {
    let has = |name: &str| match fs::metadata(folder.join(name)) {
        Ok(there) => Ok(there.is_file()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    };
    Ok(match () {
        () if has("session.json")? => Some(Kind::Session),
        () if has("study.json")? => Some(Kind::Study),
        () if has("steps.csv")? || has("episodes.csv")? || has("evaluation.csv")? => {
            Some(Kind::Headless("session.json"))
        }
        () if has("results.csv")? && folder.join("runs").is_dir() => {
            Some(Kind::Headless("study.json"))
        }
        () => None,
    })
}

impl Found {
    fn leave_out(&mut self, path: &Path, why: &str) {
        self.left_out.push(LeftOut { path: path.display().to_string(), why: why.to_owned() });
    }
}

/// All that a report is made from.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    /// The sessions, by task, preset, subject and trial.
    pub sessions: Vec<Recorded>,
    /// The studies, by name.
    pub studies: Vec<Outcome>,
    /// What was left out.
    pub left_out: Vec<LeftOut>,
}

/// Reads what was `found`, on as many threads as there are cores; `told` hears of each session
/// read.
#[must_use]
pub fn gather(found: Found, told: &(dyn Fn() + Sync)) -> Gathered {
    let Found { sessions, studies, mut left_out } = found;
    // Many sessions on one page: each may take less of it.
    let points = if sessions.len() > 24 { 1000 } else { 4000 };
    let next = AtomicUsize::new(0);
    let shelf = Mutex::new(Vec::new());
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    std::thread::scope(|scope| {
        for _ in 0..threads.min(sessions.len()) {
            scope.spawn(|| {
                while let Some(path) = sessions.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let outcome = read(path, points).map_err(|error| LeftOut {
                        path: error.path().display().to_string(),
                        why: error.why(),
                    });
                    // A thread that panicked has left what it had.
                    shelf.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(outcome);
                    told();
                }
            });
        }
    });
    let mut read = Vec::new();
    for outcome in shelf.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner) {
        match outcome {
            Ok(session) => read.push(session),
            Err(left) => left_out.push(left),
        }
    }
    let mut sessions = one_of_each_trial(read, &mut left_out);
    left_out.extend(sessions.iter_mut().flat_map(|session| std::mem::take(&mut session.left_out)));
    let mut outcomes: Vec<Outcome> = Vec::new();
    for path in &studies {
        match Outcome::read(path) {
            Ok(outcome) => outcomes.push(outcome),
            Err(why) => left_out.push(LeftOut { path: path.display().to_string(), why }),
        }
    }
    left_out.extend(outcomes.iter_mut().flat_map(|outcome| std::mem::take(&mut outcome.left_out)));
    left_out.sort();
    Gathered { sessions, studies: outcomes, left_out }
}

/// Of several sessions of one trial the one that went farthest; the others are left out.
fn one_of_each_trial(sessions: Vec<Recorded>, left_out: &mut Vec<LeftOut>) -> Vec<Recorded> {
    let mut trials = BTreeMap::<_, Vec<Recorded>>::new();
    for session in sessions {
        // Folders of several experiments count their trials each by itself.
        let Recorded { subject, trial, task, preset, mode, operator, profile, .. } = &session;
        let experiment = (task.clone(), preset.clone(), operator.clone(), profile.clone());
        let key = (experiment, subject.clone(), *trial, mode.word());
        trials.entry(key).or_default().push(session);
    }
    let mut kept = Vec::new();
    for (_, mut same) in trials {
        same.sort_by_cached_key(|session| {
            (!session.is_complete(), usize::MAX - session.rollouts.len(), session.path.clone())
        });
        let mut same = same.into_iter();
        let Some(first) = same.next() else { continue };
        for other in same {
            left_out.push(LeftOut {
                path: other.path.display().to_string(),
                why: format!(
                    "trial {:03} of subject {} is also in {}, which went as far or farther; give \
                     one of the two subjects another name if these are two people",
                    other.trial,
                    other.subject,
                    first.path.display()
                ),
            });
        }
        kept.push(first);
    }
    kept.sort_by(|a, b| {
        (&a.task, &a.preset, &a.subject, a.trial).cmp(&(&b.task, &b.preset, &b.subject, b.trial))
    });
    kept
}
