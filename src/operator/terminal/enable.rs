//! The key that is the dead-man switch: held from its press to its release, as reported.
//!
//! Whatever leaves doubt lets it go, and only a new press holds it again: a repeat does not, for
//! it may come from before.

use crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use super::KeyReleases;

/// The key's state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Enable {
    letter: char,
    is_held: bool,
}

impl Enable {
    /// The key of `letter`, which nobody holds.
    pub(super) const fn new(letter: char) -> Self {
        Self { letter, is_held: false }
    }

    /// Takes `key` if it is this one, and says whether it is. Without `releases` that are
    /// reported nobody holds it.
    pub(super) fn take(&mut self, key: &KeyEvent, releases: KeyReleases) -> bool {
        let KeyCode::Char(letter) = key.code else { return false };
        if !letter.eq_ignore_ascii_case(&self.letter) {
            return false;
        }
        // With Ctrl or Alt it is a shortcut; a release counts whatever else is held.
        let is_shortcut = !KeyModifiers::SHIFT.contains(key.modifiers);
        match key.kind {
            KeyEventKind::Press if is_shortcut => return false,
            KeyEventKind::Press => self.is_held = releases == KeyReleases::Reported,
            KeyEventKind::Repeat => {}
            KeyEventKind::Release => self.is_held = false,
        }
        true
    }

    /// Nobody holds it any more.
    pub(super) const fn release(&mut self) {
        self.is_held = false;
    }

    /// Whether it is held.
    pub(super) const fn is_held(self) -> bool {
        self.is_held
    }
}
