//! The mouse: read while hands are on it, and always given back.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

use ratatui::crossterm::terminal::size;

use super::abilities::Abilities;
use super::feed::Feed;
use super::is_taken;

/// How the mouse is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mouse {
    /// Not at all: it selects text, as ever.
    #[default]
    Unread,
    /// Every movement is read.
    Read,
    /// The same, and the pointer is hidden, where the terminal can.
    Hidden,
}

/// Whether the terminal was told to report the mouse,
static READ: AtomicBool = AtomicBool::new(false);
/// and to hide its pointer.
static HIDDEN: AtomicBool = AtomicBool::new(false);

/// Any movement, in decimal numbers: in cells,
const IN_CELLS: &[u8] = b"\x1b[?1003h\x1b[?1006h";
/// or in pixels.
const IN_PIXELS: &[u8] = b"\x1b[?1003h\x1b[?1006h\x1b[?1016h";
/// No movement; where a mode is not known, nothing happens.
const UNREAD: &[u8] = b"\x1b[?1016l\x1b[?1006l\x1b[?1003l";
/// No pointer: for xterm, and for those that know shapes.
const HIDE: &[u8] = b"\x1b[>3p\x1b]22;none\x1b\\";
/// The pointer as it is by default.
const SHOW: &[u8] = b"\x1b[>1p\x1b]22;\x1b\\";

/// Whether the mouse is read now.
pub(super) fn is_on() -> bool {
    READ.load(Ordering::SeqCst)
}

/// Has the mouse read as `wanted`, once it is known whether in pixels. A terminal that does not
/// take it will fail at the next picture.
pub(super) fn keep(out: &mut impl Write, wanted: Mouse, feed: &Feed) {
    let is_read = wanted != Mouse::Unread;
    if is_read && !is_on() {
        let (Some(abilities), Ok(size)) = (Abilities::known(), size()) else { return };
        READ.store(true, Ordering::SeqCst);
        feed.fit(size);
        say(out, if abilities.has_pixels() { IN_PIXELS } else { IN_CELLS });
    }
    let is_hidden = wanted == Mouse::Hidden;
    if is_hidden && !HIDDEN.swap(true, Ordering::SeqCst) {
        say(out, HIDE);
    }
    if !is_hidden && HIDDEN.swap(false, Ordering::SeqCst) {
        say(out, SHOW);
    }
    if !is_read && READ.swap(false, Ordering::SeqCst) {
        say(out, UNREAD);
        feed.pointer().rests();
    }
    // Whoever gave the terminal back meanwhile may have missed what was switched on just now.
    if !is_taken() {
        give_back(out);
    }
}

/// Gives the mouse and its pointer back, if they were taken.
pub(super) fn give_back(out: &mut impl Write) {
    if HIDDEN.swap(false, Ordering::SeqCst) {
        say(out, SHOW);
    }
    if READ.swap(false, Ordering::SeqCst) {
        say(out, UNREAD);
    }
}

fn say(out: &mut impl Write, words: &[u8]) {
    let _ = out.write_all(words).and_then(|()| out.flush());
}
