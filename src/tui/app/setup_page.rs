//! The set-up at work: edits the order, and begins.

use std::path::PathBuf;
use std::time::Duration;

use ratatui::crossterm::event::Event;

use super::{Conductor, End, Next, Running, hear};
use crate::clock::Clock;
use crate::operator::Choice;
use crate::profile::Order;
use crate::tui::help;
use crate::tui::keys::{Hand, Screen as Keys};
use crate::tui::palette::Look;
use crate::tui::pen::Pen;
use crate::tui::setup::{self, Extras, Reaction, Setup, Shelf};
use crate::tui::terminal::{Mouse, Screen, look};

/// Where profiles are saved.
const PROFILES: &str = "profiles";
/// The pace of the small picture, and while hands are tried.
const FRAME: Duration = Duration::from_millis(50);

/// Shows the form until the person begins or quits.
pub(super) fn show(
    screen: &mut Screen,
    conductor: &mut dyn Conductor,
    order: Order,
) -> Result<Next, String> {
    let document = conductor.document(&order.profile).map_err(|error| error.to_string())?;
    let shelf = conductor.shelf(&order);
    let setup = Setup::new(order, &document, PathBuf::from(PROFILES))
        .map_err(|report| report.to_string())?;
    let clock = screen.feed().clock;
    let mut page = Page { setup, shelf, help_open: false };
    loop {
        let look = look(page.setup.profile().screen.glyphs);
        let hands = Trial::of(&page.setup, screen);
        let extras = Extras {
            look,
            key_releases: &hands.key_releases,
            pointer: &hands.pointer,
            hands: hands.push,
            time_s: clock.now().0,
        };
        let drawn = screen.draw(|frame| {
            setup::draw(frame, &page.setup, &page.shelf, &extras);
            if page.help_open {
                draw_help(frame, look);
            }
        });
        if drawn.is_err() {
            return Ok(Next::End(End::Lost));
        }
        match hear(screen, conductor, FRAME) {
            Ok(Some(event)) => {
                if let Some(next) = page.take(&event, conductor) {
                    return Ok(next);
                }
            }
            Ok(None) => {}
            Err(end) => return Ok(Next::End(end)),
        }
    }
}

/// The hands, and what they push while they are tried.
struct Trial {
    key_releases: String,
    pointer: String,
    push: Option<f64>,
}

impl Trial {
    /// The device under the hands is the one that is chosen; the mouse is read while it is
    /// tried.
    fn of(setup: &Setup, screen: &mut Screen) -> Self {
        let is_mouse = setup.operator() == Choice::Mouse;
        let is_tried = setup.is_trying_hands();
        screen.keep_mouse(if is_mouse && is_tried { Mouse::Read } else { Mouse::Unread });
        let (hands, pointer) = (screen.feed().hands(), screen.feed().pointer());
        let now = screen.feed().clock.now();
        let push = || {
            if is_mouse {
                setup.profile().operator.mouse.deflection(&pointer, now)
            } else {
                hands.push(now)
            }
        };
        Self {
            key_releases: hands.short_release_words(),
            pointer: pointer.grid().map_or(String::new(), |grid| grid.to_string()),
            push: is_tried.then(push),
        }
    }
}

fn draw_help(frame: &mut ratatui::Frame<'_>, look: Look) {
    let area = frame.area();
    let mut pen = Pen::new(frame.buffer_mut(), area, look);
    help::draw(&mut pen, Keys::Setup, Hand::Absent, &[]);
    look.finish(frame.buffer_mut());
}

struct Page {
    setup: Setup,
    shelf: Shelf,
    help_open: bool,
}

impl Page {
    fn take(&mut self, event: &Event, conductor: &mut dyn Conductor) -> Option<Next> {
        let Event::Key(key) = event else { return None };
        if self.help_open {
            self.help_open = !key.is_press();
            return None;
        }
        match self.setup.handle(*key, &self.shelf) {
            Reaction::Stay | Reaction::TryHands => {}
            Reaction::Begin(order) => return self.start(conductor.begin(&order)),
            Reaction::Quit => return Some(Next::End(End::Quit)),
            Reaction::Help => self.help_open = true,
            Reaction::OpenProfile(name) => self.open(&name, conductor),
            Reaction::SaveProfile { path, overwrite } => {
                match self.setup.document().save(&path, overwrite) {
                    Ok(()) => self.open(&path.display().to_string(), conductor),
                    Err(error) => self.setup.refuse(&error),
                }
            }
            Reaction::Resume(index) => {
                let cut = self.shelf.unfinished.get(index)?.path.clone();
                return self.start(conductor.resume(&cut));
            }
            Reaction::SubjectChanged => self.shelf = conductor.shelf(self.setup.order()),
        }
        None
    }

    fn open(&mut self, name: &str, conductor: &mut dyn Conductor) {
        match conductor.document(name) {
            Ok(document) => self.setup.open(name, &document),
            Err(error) => self.setup.refuse(&error),
        }
        self.shelf = conductor.shelf(self.setup.order());
    }

    fn start(&mut self, started: Result<Running, String>) -> Option<Next> {
        match started {
            Ok(running) => Some(Next::Live(Box::new(running))),
            Err(message) => {
                self.setup.tell(&message);
                None
            }
        }
    }
}
