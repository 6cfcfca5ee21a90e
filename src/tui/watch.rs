//! A session at another terminal: its screen, read-only; and what is shown while there is none.

mod page;

use ratatui::Frame;

use super::help;
use super::keys::{Hand, Screen};
use super::live::{self, History, Info, Seat, Ui, View};
use super::palette::{Look, Role};
use super::pen::Pen;
use super::small;
use super::text::wrapped;
use crate::control::snapshot::{Snapshot, Watcher};
use crate::profile;

pub use page::{Lookout, show};

/// A session that is watched.
pub struct Watched {
    /// Its unchanging facts.
    pub info: Info,
    /// Looks at it.
    pub watcher: Watcher,
    /// What its profile says about the screen.
    pub screen: profile::Screen,
    /// Whether nothing more will come.
    pub is_over: Box<dyn Fn() -> bool>,
    /// How often something came so far.
    pub news: Box<dyn Fn() -> u64>,
}

/// What is said while nothing is watched.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Awaiting {
    /// In one line.
    pub title: String,
    /// What is awaited, which sessions there are, what is wrong with them.
    pub words: Vec<String>,
}

/// The widest line of what is said while nothing is watched.
const MEASURE: u16 = 72;

/// Draws what is said while there is nothing to watch.
pub fn draw_waiting(
    frame: &mut Frame<'_>,
    title: &str,
    words: &[String],
    help_open: bool,
    look: Look,
) {
    let area = frame.area();
    let mut pen = Pen::new(frame.buffer_mut(), area, look);
    if small::is_too_small(&pen) {
        small::draw(&mut pen, None);
    } else {
        let (width, last) = (MEASURE.min(pen.width()), pen.height() - 1);
        let mut y = pen.height() / 3;
        pen.centred(y, title, Role::Strong);
        y += 2;
        let left = (pen.width() - width) / 2;
        for line in words.iter().flat_map(|words| wrapped(words, usize::from(width))) {
            pen.text(left, y, &line, Role::Text);
            y += 1;
        }
        help::hints(&mut pen, last, Screen::Watch, Hand::Nobody);
        if help_open {
            help::draw(&mut pen, Screen::Watch, Hand::Nobody, &[]);
        }
    }
    look.finish(frame.buffer_mut());
}

/// Draws the session `info`: the plant from `scene`, numbers from the calmer `panel`.
pub fn draw(
    frame: &mut Frame<'_>,
    info: &Info,
    (scene, panel): (&Snapshot, &Snapshot),
    history: &History,
    ui: &Ui,
) {
    let ui = Ui { seat: Seat::Beside, ..ui.clone() };
    live::draw(frame, &View { info, scene, panel, history, ui: &ui });
}
