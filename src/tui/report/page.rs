//! The report screen at work: hears keys, hands on what is to be saved.

use std::time::Duration;

use ratatui::crossterm::event::Event;

use super::{Pages, Reaction, draw};
use crate::profile::Glyphs;
use crate::report::figure::Item;
use crate::tui::app::End;
use crate::tui::terminal::{Heard, Screen, look};

/// How long a key is waited for before the picture is drawn anew.
const PATIENCE: Duration = Duration::from_millis(100);

/// Does what the screen cannot: writes files and hears signals.
pub trait Bench {
    /// Saves a figure's picture and data, or a table's data; says where, or why not.
    fn save(&mut self, item: &Item) -> String;

    /// Whether a signal asked the program to end.
    fn is_told_to_end(&self) -> bool;
}

/// Shows the pages until the person leaves.
pub fn show(screen: &mut Screen, bench: &mut dyn Bench, mut pages: Pages) -> End {
    loop {
        let look = look(Glyphs::Auto);
        if screen.draw(|frame| draw(frame, &mut pages, look)).is_err() {
            return End::Lost;
        }
        if bench.is_told_to_end() {
            return End::Signal;
        }
        match screen.hear(PATIENCE) {
            Heard::Event(Event::Key(key)) => match pages.handle(key) {
                Reaction::Stay => {}
                Reaction::Quit => return End::Quit,
                Reaction::Interrupt => return End::Interrupted,
                Reaction::Save(item) => {
                    let message = bench.save(&item);
                    pages.say(message);
                }
            },
            Heard::Event(_) | Heard::Nothing => {}
            Heard::Lost => return End::Lost,
        }
    }
}
