//! The results at work: turns pages.

use std::time::Duration;

use ratatui::crossterm::event::Event;

use super::{Conductor, End, Next, hear};
use crate::profile::{self, Order};
use crate::tui::keys::{self, Action};
use crate::tui::results::{self, Info, State};
use crate::tui::terminal::{Screen, look};

/// Shows the results until the person goes on.
pub(super) fn show(
    screen: &mut Screen,
    conductor: &dyn Conductor,
    info: &Info,
    settings: &profile::Screen,
    order: Order,
) -> Next {
    let mut state = State::new(look(settings.glyphs));
    loop {
        if screen.draw(|frame| results::draw(frame, info, &state)).is_err() {
            return Next::End(End::Lost);
        }
        let event = match hear(screen, conductor, Duration::from_millis(200)) {
            Ok(event) => event,
            Err(end) => return Next::End(end),
        };
        let Some(Event::Key(key)) = event else { continue };
        match keys::action(keys::Screen::Results, key) {
            Some(Action::Next) => state.next(),
            Some(Action::Previous) => state.previous(),
            Some(Action::Help) => state.help_open = !state.help_open,
            Some(Action::Begin) => return Next::Setup(Box::new(order)),
            Some(Action::Quit | Action::QuitNow) => return Next::End(End::Quit),
            _ => {}
        }
    }
}
