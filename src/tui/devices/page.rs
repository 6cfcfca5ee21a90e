//! The devices screen at work: hears pads and keys, looks at the files now and then, saves.

use std::time::Duration;

use ratatui::crossterm::event::Event as Heard;

use super::{Devices, Extras, Page, Reaction, Survey, draw};
use crate::clock::Clock;
use crate::operator::Device;
use crate::operator::gamepad::Event;
use crate::signal::Seconds;
use crate::tui::app::End;
use crate::tui::terminal::{self, Mouse, Screen, look};

/// The pace of the picture.
const FRAME: Duration = Duration::from_millis(33);
/// How often the files are looked at.
const SURVEY: Seconds = Seconds(1.0);

/// How long pads may take to say that they are there.
const SETTLING: Seconds = Seconds(0.3);

/// Does what the screen cannot: looks at the computer and listens to its pads.
pub trait Bench {
    /// What is plugged in now, where `heard` pads are heard.
    fn survey(&mut self, heard: usize) -> Survey;

    /// What happened at the pads since it was asked last.
    fn events(&mut self) -> Vec<(Event, Seconds)>;

    /// Whether a signal asked the program to end.
    fn is_told_to_end(&self) -> bool;
}

/// Shows the devices until the person leaves.
pub fn show(screen: &mut Screen, bench: &mut dyn Bench, mut devices: Devices) -> End {
    let clock = screen.feed().clock;
    // Pads that are there need a moment to say so.
    let mut due = clock.now() + SETTLING;
    loop {
        for (event, at) in bench.events() {
            devices.hear(&event, at);
        }
        if clock.now() >= due {
            devices.take(bench.survey(devices.heard()));
            due = clock.now() + SURVEY;
        }
        let is_mouse = devices.page() == Page::Hand(Device::Mouse);
        // Elsewhere the mouse selects text, such as the lines that mend something.
        screen.keep_mouse(if is_mouse { Mouse::Read } else { Mouse::Unread });
        let (hands, pointer) = (screen.feed().hands(), screen.feed().pointer());
        let (operator, now) = (&devices.profile().operator, clock.now());
        let (releases, late) = hands.release_words();
        let extras = Extras {
            look: look(devices.profile().screen.glyphs),
            key_releases: &if late.is_empty() { releases } else { format!("{releases}, {late}") },
            push: operator.keyboard.push * hands.push(now),
            pointer: pointer
                .grid()
                .filter(|_| is_mouse)
                .map(|grid| (grid.to_string(), operator.mouse.deflection(&pointer, now))),
        };
        if screen.draw(|frame| draw(frame, &devices, &extras)).is_err() {
            return End::Lost;
        }
        if bench.is_told_to_end() {
            return End::Signal;
        }
        match screen.hear(FRAME) {
            terminal::Heard::Event(Heard::Key(key)) => match devices.handle(key) {
                Reaction::Stay => {}
                Reaction::Quit => return End::Quit,
                Reaction::Save { path, overwrite } => {
                    match devices.document().save(&path, overwrite) {
                        Ok(()) => devices.saved(&path),
                        Err(error) => devices.refuse(&error),
                    }
                }
            },
            terminal::Heard::Event(_) | terminal::Heard::Nothing => {}
            terminal::Heard::Lost => return End::Lost,
        }
    }
}
