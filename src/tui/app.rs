//! The screens in turn: set-up, live, results.

mod live_page;
mod results_page;
mod setup_page;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use ratatui::crossterm::event::Event;

use super::terminal::{Heard, Mouse, Screen};
use super::{live, plant, results, setup};
use crate::backend::serial::desk::Desk;
use crate::control::snapshot::Watcher;
use crate::operator::Badge;
use crate::profile::{self, Document, Order, ProfileError};

/// A session that was started.
pub struct Running {
    /// Its unchanging facts.
    pub info: live::Info,
    /// Looks and asks.
    pub watcher: Watcher,
    /// Counts the frames drawn.
    pub frames: Arc<AtomicU64>,
    /// What the person's device says of itself, where there is one.
    pub badge: Option<Badge>,
    /// How the mouse is to be read.
    pub mouse: Mouse,
    /// What the profile says about the screen.
    pub screen: profile::Screen,
    /// What the set-up shows after it: the same choices, the next trial.
    pub order: Order,
    /// What the person should know before it begins.
    pub notice: Option<String>,
    /// Its plant, where that is a real one.
    pub plant: Option<PlantDesk>,
}

/// A session's real plant.
#[derive(Clone, Debug)]
pub struct PlantDesk {
    /// Looks and wishes.
    pub desk: Desk,
    /// What stays the same.
    pub facts: plant::Facts,
}

/// Does what the screens cannot: starts sessions, looks at the disk, hears signals.
pub trait Conductor {
    /// What is on disk for the order's subject.
    fn shelf(&mut self, order: &Order) -> setup::Shelf;

    /// Finds a profile by name or path.
    ///
    /// # Errors
    /// When there is none.
    fn document(&mut self, name: &str) -> Result<Document, ProfileError>;

    /// Starts the session of `order`.
    ///
    /// # Errors
    /// A message for the person; the screen stays.
    fn begin(&mut self, order: &Order) -> Result<Running, String>;

    /// Takes up a session that was cut.
    ///
    /// # Errors
    /// A message for the person; the screen stays.
    fn resume(&mut self, folder: &Path) -> Result<Running, String>;

    /// The results of the running session, once it is over with its last file written; a
    /// message when it failed.
    fn results(&mut self) -> Option<Result<results::Info, String>>;

    /// Whether a signal asked the program to end.
    fn is_told_to_end(&self) -> bool;
}

/// Where the screens begin.
pub enum Start {
    /// With a form to fill in.
    Setup(Box<Order>),
    /// With a session under way.
    Live(Box<Running>),
}

/// How the screens ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The person is done.
    Quit,
    /// The person pressed Ctrl-C during a session.
    Interrupted,
    /// The terminal is gone.
    Lost,
    /// A signal came.
    Signal,
}

/// Where to go after a page.
enum Next {
    Setup(Box<Order>),
    Live(Box<Running>),
    Results { info: Box<results::Info>, screen: profile::Screen, order: Box<Order> },
    End(End),
}

/// Shows the screens until the person is done.
///
/// # Errors
/// A message, when the profile to begin with cannot be shown or a session failed.
pub fn run(
    screen: &mut Screen,
    conductor: &mut dyn Conductor,
    start: Start,
) -> Result<End, String> {
    let mut next = match start {
        Start::Setup(order) => Next::Setup(order),
        Start::Live(running) => Next::Live(running),
    };
    loop {
        screen.keep_mouse(Mouse::Unread);
        next = match next {
            Next::Setup(order) => setup_page::show(screen, conductor, *order)?,
            Next::Live(running) => live_page::show(screen, conductor, *running)?,
            Next::Results { info, screen: settings, order } => {
                results_page::show(screen, conductor, &info, &settings, *order)
            }
            Next::End(end) => return Ok(end),
        };
    }
}

/// Hears within `patience`, or the reason to end.
fn hear(
    screen: &Screen,
    conductor: &dyn Conductor,
    patience: Duration,
) -> Result<Option<Event>, End> {
    if conductor.is_told_to_end() {
        return Err(End::Signal);
    }
    match screen.hear(patience) {
        Heard::Event(event) => Ok(Some(event)),
        Heard::Nothing => Ok(None),
        Heard::Lost => Err(End::Lost),
    }
}
