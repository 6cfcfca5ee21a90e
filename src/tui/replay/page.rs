//! The replay at work: lets time pass, hears keys.

use std::time::Duration;

use ratatui::crossterm::event::Event;

use super::{Player, Reaction, draw};
use crate::clock::Clock;
use crate::signal::Seconds;
use crate::tui::app::End;
use crate::tui::live::History;
use crate::tui::terminal::{Heard, Mouse, Screen};

/// Numbers are renewed this often, so that they can be read.
const PANEL: Seconds = Seconds(0.1);
/// A picture is drawn this often while nothing plays.
const REST: Seconds = Seconds(0.25);

/// Shows the recording, `frames_per_s` pictures a second, until the person leaves or `is_over`
/// says that a signal came.
pub fn show(
    screen: &mut Screen,
    mut player: Player,
    frames_per_s: u32,
    is_over: impl Fn() -> bool,
) -> End {
    let clock = screen.feed().clock;
    let frame = Seconds(1.0 / f64::from(frames_per_s.max(1)));
    let mut history = History::default();
    let mut panel = player.recording.snapshot(player.row());
    let (mut before, mut panel_due) = (clock.now(), clock.now());
    screen.keep_mouse(Mouse::Unread);
    loop {
        let now = clock.now();
        player.pass(now - before);
        before = now;
        if now >= panel_due {
            panel = player.recording.snapshot(player.row());
            panel_due = now + PANEL;
        }
        if screen.draw(|frame| draw(frame, &player, &panel, &mut history)).is_err() {
            return End::Lost;
        }
        let due = now + if player.is_playing() { frame } else { REST };
        loop {
            if is_over() {
                return End::Signal;
            }
            let patience = Duration::from_secs_f64((due - clock.now()).0.max(0.0));
            match screen.hear(patience) {
                Heard::Event(Event::Key(key)) => {
                    // Time that passed before the key passed as it was.
                    let now = clock.now();
                    player.pass(now - before);
                    before = now;
                    match player.key(key) {
                        Reaction::Stay => {}
                        Reaction::Quit => return End::Quit,
                        Reaction::Interrupt => return End::Interrupted,
                    }
                    if !player.is_playing() {
                        break;
                    }
                }
                Heard::Event(_) | Heard::Nothing => break,
                Heard::Lost => return End::Lost,
            }
        }
    }
}
