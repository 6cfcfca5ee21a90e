//! Watching at work: looks out for sessions, draws the latest tick, hears keys.

use std::time::Duration;

use ratatui::crossterm::event::Event;

use super::{Awaiting, Watched, draw, draw_waiting};
use crate::clock::Clock;
use crate::control::snapshot::Snapshot;
use crate::profile::Glyphs;
use crate::session::Phase;
use crate::session::machine::Stage;
use crate::signal::Seconds;
use crate::tui::app::End;
use crate::tui::keys::{self, Action};
use crate::tui::live::{History, Ui};
use crate::tui::terminal::{Heard, Mouse, Screen, look};

/// The pace of the picture.
const FRAME: Seconds = Seconds(1.0 / 30.0);
/// Numbers are renewed this often, so that they can be read.
const PANEL: Seconds = Seconds(0.1);
/// Success is kept for its curve this often.
const SAMPLE: Seconds = Seconds(1.0);
/// How many samples of success are kept.
const SAMPLES: usize = 512;
/// How often sessions are looked for.
const LOOKOUT: Seconds = Seconds(0.5);
/// A session of which nothing came for so long may be stopped.
const QUIET: Seconds = Seconds(2.0);

/// Does what the screen cannot: finds sessions, hears signals.
pub trait Lookout {
    /// The session to be watched, if exactly one fits; otherwise what to tell the person.
    ///
    /// # Errors
    /// Words for the person: what is awaited, which sessions there are.
    fn find(&mut self) -> Result<Watched, Awaiting>;

    /// Whether a signal asked the program to end.
    fn is_told_to_end(&self) -> bool;
}

/// A session on the screen.
struct Page {
    watched: Watched,
    history: History,
    panel: Snapshot,
    /// How often something came, and when it did last.
    news: (u64, Seconds),
    panel_due: Seconds,
    sample_due: Seconds,
}

/// Shows one session after the other until the person leaves.
pub fn show(screen: &mut Screen, lookout: &mut dyn Lookout) -> End {
    let clock = screen.feed().clock;
    screen.keep_mouse(Mouse::Unread);
    let mut ui = Ui { look: look(Glyphs::Auto), ..Ui::default() };
    let mut page: Option<Page> = None;
    let mut awaiting = Awaiting { title: String::new(), words: Vec::new() };
    let mut lookout_due = clock.now();
    loop {
        let now = clock.now();
        let is_free = page.as_ref().is_none_or(Page::is_over);
        if is_free && now >= lookout_due {
            lookout_due = now + LOOKOUT;
            match lookout.find() {
                Ok(watched) => {
                    ui.look = look(watched.screen.glyphs);
                    page = Some(Page::new(watched, now));
                }
                Err(said) => awaiting = said,
            }
        }
        let drawn = match &mut page {
            Some(page) => page.draw(screen, &mut ui, now),
            None => screen.draw(|frame| {
                let Awaiting { title, words } = &awaiting;
                draw_waiting(frame, title, words, ui.help_open, ui.look);
            }),
        };
        if drawn.is_err() {
            return End::Lost;
        }
        if let Some(end) = hear(screen, lookout, &mut ui, now + FRAME) {
            return end;
        }
    }
}

/// Hears keys until `due`; the reason to end, if one came.
fn hear(screen: &Screen, lookout: &dyn Lookout, ui: &mut Ui, due: Seconds) -> Option<End> {
    let clock = screen.feed().clock;
    loop {
        if lookout.is_told_to_end() {
            return Some(End::Signal);
        }
        match screen.hear(Duration::from_secs_f64((due - clock.now()).0.max(0.0))) {
            Heard::Event(Event::Key(key)) => match keys::action(keys::Screen::Watch, key) {
                Some(Action::Quit) => return Some(End::Quit),
                Some(Action::QuitNow) => return Some(End::Interrupted),
                Some(Action::SubjectView) => ui.subject_view = !ui.subject_view,
                Some(Action::Progress) => ui.show_progress = !ui.show_progress,
                Some(Action::Help) => ui.help_open = !ui.help_open,
                _ => {}
            },
            Heard::Event(_) => {}
            Heard::Nothing => return None,
            Heard::Lost => return Some(End::Lost),
        }
    }
}

impl Page {
    fn new(watched: Watched, now: Seconds) -> Self {
        let panel = watched.watcher.look();
        let (history, news) = (History::default(), (0, now));
        Self { watched, history, panel, news, panel_due: now, sample_due: now }
    }

    fn is_over(&self) -> bool {
        (self.watched.is_over)()
    }

    fn draw(&mut self, screen: &mut Screen, ui: &mut Ui, now: Seconds) -> std::io::Result<()> {
        let Watched { info, watcher, .. } = &self.watched;
        let scene = watcher.look();
        watcher.rollouts(&mut self.history.rollouts);
        let place = |stage: Stage| stage.moment().map(|moment| (moment.phase, moment.rollout));
        let is_same = std::mem::discriminant(&self.panel.stage)
            == std::mem::discriminant(&scene.stage)
            && place(self.panel.stage) == place(scene.stage);
        if now >= self.panel_due || !is_same {
            self.panel = scene;
            self.panel_due = now + PANEL;
        }
        if now >= self.sample_due {
            self.sample_due = now + SAMPLE;
            sample(&mut self.history, &scene);
        }
        ui.waits = watcher.waits();
        let count = (self.watched.news)();
        if count != self.news.0 {
            self.news = (count, now);
        }
        ui.message = if (self.watched.is_over)() {
            Some(over(&scene).to_owned())
        } else {
            quiet(now - self.news.1)
        };
        screen.draw(|frame| draw(frame, info, (&scene, &self.panel), &self.history, ui))
    }
}

/// What is said under the last picture.
const fn over(scene: &Snapshot) -> &'static str {
    match scene.stage {
        Stage::Finished(_) => "this session is over; the next one is awaited",
        _ => "this session's program has ended; the next one is awaited",
    }
}

/// What is said of a session from which nothing came for so long, which may be too long.
fn quiet(since: Seconds) -> Option<String> {
    (since >= QUIET)
        .then(|| format!("no news for {:.0} s: is the session stopped?", since.0.floor()))
}

fn sample(history: &mut History, scene: &Snapshot) {
    if let Stage::Running(moment) = scene.stage
        && moment.phase == Phase::Main
    {
        if history.success.len() == SAMPLES {
            history.success.remove(0);
        }
        history.success.push(scene.successes.get(scene.region).copied().unwrap_or(0.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_of_which_nothing_comes_is_said_to_be_quiet() {
        assert_eq!(quiet(Seconds(1.9)), None);
        let said = quiet(Seconds(65.8));
        assert_eq!(said.as_deref(), Some("no news for 65 s: is the session stopped?"));
    }
}
