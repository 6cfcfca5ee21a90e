//! Asks the terminal what it can do.
//!
//! All questions go out in one write. The last one, for the device's attributes, is answered
//! by every terminal, so that its answer ends the wait. The screen asks after its first
//! picture; keys typed meanwhile are handed on at once.

use std::fs::File;
use std::io::{self, Write};
use std::os::fd::{AsFd, BorrowedFd};

use ratatui::crossterm::event::Event;
use ratatui::crossterm::terminal::{disable_raw_mode, enable_raw_mode, window_size};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use super::abilities::Abilities;
use super::answers::Answers;
use super::{NoScreen, is_taken};
use crate::clock::{Clock, WallClock};
use crate::signal::Seconds;

/// How long the terminal may take to answer.
const PATIENCE: Seconds = Seconds(1.0);
/// How long the rest of a key that was cut may take.
const REST: Seconds = Seconds(0.05);
/// How often the one who waits for an answer looks up.
const GLANCE: Seconds = Seconds(0.1);

/// Kitty's keyboard flags; modes 1016 and 2026; a cell's and the area's size in pixels; the
/// attributes.
const QUESTIONS: &[u8] = b"\x1b[?u\x1b[?1016$p\x1b[?2026$p\x1b[16t\x1b[14t\x1b[c";
/// For those that would print the end of a question about modes.
const FEWER_QUESTIONS: &[u8] = b"\x1b[?u\x1b[c";

/// What the terminal can do, for a program that has no screen up: takes the terminal for up
/// to about a second, asks it, and gives it back. What is typed meanwhile is lost.
///
/// # Errors
/// When there is no terminal, or it refuses.
pub fn probe() -> Result<Abilities, NoScreen> {
    if is_taken() {
        return Ok(Abilities::known().unwrap_or_else(of_system));
    }
    let tty = Tty::open().map_err(|_| NoScreen::NoTerminal("input"))?;
    enable_raw_mode()?;
    let found = ask(&tty, WallClock::start(), |_| {}, || false);
    disable_raw_mode()?;
    Ok(found?)
}

/// Asks the terminal on `tty`, which must be in raw mode, and publishes what it says. What is
/// typed meanwhile goes to `typed` as it comes. Ends early when `is_over` says so.
pub(super) fn ask(
    tty: &Tty,
    clock: WallClock,
    mut typed: impl FnMut(Event),
    is_over: impl Fn() -> bool,
) -> io::Result<Abilities> {
    let mut abilities = of_system();
    let questions = if prints_questions(&abilities) { FEWER_QUESTIONS } else { QUESTIONS };
    tty.write(questions)?;
    let asked = clock.now();
    let mut answers = Answers::default();
    let mut bytes = [0; 1024];
    let mut until = asked + PATIENCE;
    while !is_over() && clock.now() < until && (!answers.is_over() || answers.is_cut()) {
        let glance = Seconds((until - clock.now()).0.clamp(0.0, GLANCE.0));
        if let Some(count) = tty.read(&mut bytes, glance)? {
            answers.take(&bytes[..count]).into_iter().for_each(&mut typed);
            if answers.is_over() && abilities.answer_s.is_none() {
                abilities.answer_s = Some((clock.now() - asked).0);
                until = clock.now() + REST;
            }
        }
    }
    answers.finish().into_iter().for_each(&mut typed);
    answers.note(&mut abilities);
    abilities.publish();
    Ok(abilities)
}

/// The program between the person's terminal and this one, by the environment.
#[must_use]
pub fn inside() -> Option<&'static str> {
    of_system().inside()
}

/// What is known without asking.
fn of_system() -> Abilities {
    let get = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    let mut abilities = Abilities::of_environment(get);
    if let Ok(size) = window_size() {
        abilities.size = Some((size.columns, size.rows));
        abilities.cell_px = cell(size.columns, size.rows, size.width, size.height);
    }
    abilities
}

/// A cell's width and height, pixels, of a screen so many cells and pixels wide and high.
fn cell(columns: u16, rows: u16, width: u16, height: u16) -> Option<(u16, u16)> {
    let size = (width.checked_div(columns)?, height.checked_div(rows)?);
    (size.0 > 0 && size.1 > 0).then_some(size)
}

/// A cell's size as the system knows it now, pixels.
pub(super) fn cell_px() -> Option<(u16, u16)> {
    window_size().ok().and_then(|size| cell(size.columns, size.rows, size.width, size.height))
}

/// Apple's Terminal and the console of older Linux print a `p` when asked for a mode.
fn prints_questions(abilities: &Abilities) -> bool {
    let is_apple = abilities.program.as_ref().is_some_and(|name| name.starts_with("Apple_"));
    is_apple || abilities.term.as_deref() == Some("linux")
}

/// The terminal that keys come from: standard input, or the process's own.
pub(super) enum Tty {
    Input,
    Own(File),
}

impl Tty {
    pub(super) fn open() -> io::Result<Self> {
        if rustix::termios::isatty(rustix::stdio::stdin()) {
            return Ok(Self::Input);
        }
        Ok(Self::Own(File::options().read(true).write(true).open("/dev/tty")?))
    }

    fn fd(&self) -> BorrowedFd<'_> {
        match self {
            Self::Input => rustix::stdio::stdin(),
            Self::Own(file) => file.as_fd(),
        }
    }

    /// Writes to standard output, where the pictures go, so that neither cuts the other; where
    /// that is a file or a pipe, to the process's terminal, for questions are no results.
    fn write(&self, bytes: &[u8]) -> io::Result<()> {
        match self {
            _ if rustix::termios::isatty(rustix::stdio::stdout()) => {
                let mut out = io::stdout().lock();
                out.write_all(bytes)?;
                out.flush()
            }
            Self::Own(file) => (&mut &*file).write_all(bytes),
            Self::Input => File::options().write(true).open("/dev/tty")?.write_all(bytes),
        }
    }

    /// Reads what comes within `patience`; `None` when nothing does.
    fn read(&self, bytes: &mut [u8], patience: Seconds) -> io::Result<Option<usize>> {
        #[expect(clippy::cast_possible_truncation, reason = "less than a second")]
        let wait = Timespec { tv_sec: 0, tv_nsec: (patience.0 * 1e9).clamp(0.0, 999e6) as _ };
        let fd = self.fd();
        match poll(&mut [PollFd::new(&fd, PollFlags::IN)], Some(&wait)) {
            Ok(0) | Err(Errno::INTR) => return Ok(None),
            Ok(_) => {}
            Err(error) => return Err(error.into()),
        }
        match rustix::io::read(fd, bytes) {
            Ok(0) => Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => Ok(Some(count)),
            Err(Errno::INTR | Errno::AGAIN) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }
}
