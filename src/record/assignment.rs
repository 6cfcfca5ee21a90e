//! The balanced assignment of subjects to modes.

use std::collections::BTreeMap;
use std::path::Path;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::folder;
use super::names::SESSION;
use super::sidecar::{Sidecar, read_sidecar};
use crate::session::{Phase, Subject};
use crate::sharing::Mode;

/// The modes in which subjects were taught `task` with `preset` in the sessions in `logs`:
/// one for each subject, that of the earliest session with a main phase. Presets are
/// different experiments.
#[must_use]
pub fn modes_so_far(logs: &Path, task: &str, preset: &str) -> Vec<Mode> {
    let mut modes = BTreeMap::new();
    for session in taught(logs, task, preset) {
        modes.entry(session.subject.as_str().to_owned()).or_insert(session.mode);
    }
    modes.into_values().collect()
}

/// The mode that `subject` was assigned for `task` with `preset` before. A subject keeps its
/// mode.
#[must_use]
pub fn mode_of(logs: &Path, subject: &Subject, task: &str, preset: &str) -> Option<Mode> {
    taught(logs, task, preset)
        .find(|session| session.assigned && session.subject == *subject)
        .map(|session| session.mode)
}

/// The mode that fewer subjects have; when both have as many, a draw.
#[must_use]
pub fn assign(modes: &[Mode], chance: &mut ChaCha8Rng) -> Mode {
    let simultaneous = modes.iter().filter(|mode| **mode == Mode::Simultaneous).count();
    let sequential = modes.len() - simultaneous;
    // Drawn whether needed or not, so that the stream's use is always the same.
    let draw = chance.random_bool(0.5);
    if simultaneous < sequential || (simultaneous == sequential && draw) {
        Mode::Simultaneous
    } else {
        Mode::Sequential
    }
}

/// The sessions of `task` and `preset` with a main phase, each subject's in the order of
/// trials.
fn taught(logs: &Path, task: &str, preset: &str) -> impl Iterator<Item = Sidecar> {
    let sessions = folder::sessions(logs).into_iter();
    sessions.filter_map(|path| read_sidecar(&path.join(SESSION)).ok()).filter(move |session| {
        (session.task.as_str(), session.preset.as_str()) == (task, preset)
            && session.planned.contains(&Phase::Main)
    })
}
