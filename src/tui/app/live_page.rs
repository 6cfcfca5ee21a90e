//! The live screen at work: draws the latest snapshot, passes keys on.

use std::io;
use std::sync::atomic::Ordering;
use std::time::Duration;

use ratatui::crossterm::event::{Event, KeyEvent};

use super::{Conductor, End, Next, PlantDesk, Running, hear};
use crate::backend::serial::station::Wish;
use crate::clock::Clock;
use crate::control::snapshot::{Command, Snapshot};
use crate::session::Phase;
use crate::session::machine::Stage;
use crate::signal::{Seconds, Tick};
use crate::tui::keys::{self, Action};
use crate::tui::live::{self, History, Ui, View};
use crate::tui::plant::{self, Badge, Pace, Panel};
use crate::tui::sensitivity;
use crate::tui::terminal::{Screen, look};

/// Numbers are renewed this often, so that they can be read.
const PANEL: Seconds = Seconds(0.1);
/// Success is kept for its curve this often.
const SAMPLE: Seconds = Seconds(1.0);
/// The speeds that `f` goes through.
const SPEEDS: [f64; 4] = [1.0, 4.0, 16.0, f64::INFINITY];
/// How many samples of success are kept.
const SAMPLES: usize = 512;

struct Page {
    running: Running,
    ui: Ui,
    history: History,
    panel: Snapshot,
    panel_due: Seconds,
    sample_due: Seconds,
    /// What the page of a real plant remembers.
    plant: Panel,
    /// Whether `q` was pressed once.
    asked_to_end: bool,
    /// How fast the session should run where nobody steers.
    speed: f64,
    /// Why the page is left once the session is over.
    leaving: Option<End>,
}

/// Shows the session until it is over.
pub(super) fn show(
    screen: &mut Screen,
    conductor: &mut dyn Conductor,
    running: Running,
) -> Result<Next, String> {
    let clock = screen.feed().clock;
    let frame_s = 1.0 / f64::from(running.screen.frames_per_s);
    let panel = running.watcher.look();
    let ui = Ui {
        show_progress: running.screen.show_progress,
        subject_view: running.screen.subject_view,
        message: running.notice.clone(),
        look: look(running.screen.glyphs),
        ..Ui::default()
    };
    let history = History::default();
    let (panel_due, sample_due) = (clock.now(), clock.now());
    let mut page = Page {
        running,
        ui,
        history,
        panel,
        panel_due,
        sample_due,
        plant: Panel::default(),
        asked_to_end: false,
        speed: SPEEDS[0],
        leaving: None,
    };
    loop {
        if let Some(over) = conductor.results() {
            let info = over?;
            let Running { screen, order, .. } = page.running;
            let order = Box::new(order);
            return Ok(match page.leaving {
                Some(end) => Next::End(end),
                None => Next::Results { info: Box::new(info), screen, order },
            });
        }
        let due = clock.now() + Seconds(frame_s);
        page.draw(screen, clock.now());
        while clock.now() < due && page.leaving != Some(End::Lost) {
            let patience = Duration::from_secs_f64((due - clock.now()).0.max(0.0));
            match hear(screen, conductor, patience) {
                Ok(Some(event)) => page.take(&event),
                Ok(None) => break,
                // The signal itself has ended the session already; its last file is due.
                Err(end) => {
                    page.leave(end);
                    break;
                }
            }
        }
        if page.leaving.is_some() {
            let mut pause = clock;
            pause.wait_until(due);
        }
    }
}

/// Whether two stages differ in nothing but their counts.
fn is_same_page(a: Stage, b: Stage) -> bool {
    let rollout = |stage: Stage| stage.moment().map(|moment| (moment.phase, moment.rollout));
    std::mem::discriminant(&a) == std::mem::discriminant(&b) && rollout(a) == rollout(b)
}

impl Page {
    fn draw(&mut self, screen: &mut Screen, now: Seconds) {
        let scene = self.running.watcher.look();
        self.running.watcher.rollouts(&mut self.history.rollouts);
        if now >= self.panel_due {
            self.panel = scene;
            self.panel_due = now + PANEL;
        }
        if now >= self.sample_due {
            self.sample_due = now + SAMPLE;
            self.sample(&scene);
        }
        // What changes the layout must not lag behind the scene.
        if !is_same_page(self.panel.stage, scene.stage) {
            self.panel = scene;
        }
        if let Some(badge) = &self.running.badge {
            // A pad that is gone has no words: then the operator's own stay.
            if !badge.words().is_empty() {
                self.running.info.operator = badge.words_now();
            }
            self.running.info.device_state = badge.state();
            self.ui.trouble = badge.trouble();
        }
        screen.keep_mouse(self.running.mouse);
        let drawn = match self.running.plant.clone() {
            Some(plant) => self.draw_at(screen, &plant, &scene),
            None => self.draw_session(screen, &scene),
        };
        if drawn.is_err() {
            self.leave(End::Lost);
        }
        self.running.frames.fetch_add(1, Ordering::Relaxed);
    }

    fn draw_session(&self, screen: &mut Screen, scene: &Snapshot) -> io::Result<()> {
        let view = View {
            info: &self.running.info,
            scene,
            panel: &self.panel,
            history: &self.history,
            ui: &self.ui,
        };
        screen.draw(|frame| live::draw(frame, &view))
    }

    /// The session at a real plant, or the plant's own page over it.
    fn draw_at(
        &mut self,
        screen: &mut Screen,
        plant: &PlantDesk,
        scene: &Snapshot,
    ) -> io::Result<()> {
        let view = plant.desk.view();
        self.plant.see(&view.look);
        self.ui.motor = Some(Badge::of(&view, &plant.facts));
        self.ui.waits = self.running.watcher.waits();
        if !self.plant.is_open() {
            return self.draw_session(screen, scene);
        }
        let ticks = self.panel.tick != Tick(0);
        let page = plant::Page {
            view: &view,
            facts: &plant.facts,
            panel: &self.plant,
            is_running: matches!(scene.stage, Stage::Running(_)),
            pace: ticks.then_some(Pace { late: self.panel.lateness, missed: self.panel.missed }),
            help_open: self.ui.help_open,
            message: self.ui.message.as_deref(),
            look: self.ui.look,
        };
        screen.draw(|frame| plant::draw(frame, &page))
    }

    fn sample(&mut self, scene: &Snapshot) {
        if let Stage::Running(moment) = scene.stage
            && moment.phase == Phase::Main
        {
            if self.history.success.len() == SAMPLES {
                self.history.success.remove(0);
            }
            self.history.success.push(scene.successes.get(scene.region).copied().unwrap_or(0.0));
        }
    }

    fn take(&mut self, event: &Event) {
        if let Event::Key(key) = event {
            self.key(*key);
        }
    }

    /// What is heard on every screen of a session with a real plant: its motor may be armed.
    fn always(&self, key: KeyEvent) -> Option<Action> {
        self.running.plant.as_ref()?;
        keys::action(keys::Screen::Live, key).filter(|action| *action == Action::Stop)
    }

    fn key(&mut self, key: KeyEvent) {
        let stage = self.running.watcher.look().stage;
        let here = match stage {
            _ if self.running.plant.is_some() && self.plant.is_open() => keys::Screen::Plant,
            Stage::Instruction(_) | Stage::Break { .. } => keys::Screen::Briefing,
            _ => keys::Screen::Live,
        };
        let action = keys::action(here, key).or_else(|| self.always(key));
        let Some(action) = action else {
            if key.is_press() {
                self.forget_question();
            }
            return;
        };
        if action != Action::Quit {
            let was_asked = self.asked_to_end;
            self.forget_question();
            if was_asked && action != Action::QuitNow && action != Action::Stop {
                return;
            }
        }
        match action {
            Action::Begin => self.ask(Command::Begin),
            Action::Pause => self.ask(Command::Pause),
            Action::Discard => self.ask(Command::Discard),
            Action::Stop => self.stop(),
            Action::Faster => self.faster(),
            Action::MoreSensitive => self.tune(true),
            Action::LessSensitive => self.tune(false),
            Action::Progress => self.ui.show_progress = !self.ui.show_progress,
            Action::SubjectView => self.ui.subject_view = !self.ui.subject_view,
            Action::Help => self.ui.help_open = !self.ui.help_open,
            Action::Quit if self.asked_to_end => {
                self.forget_question();
                self.ask(Command::Abort("the person ended it".to_owned()));
            }
            Action::Quit => {
                self.asked_to_end = true;
                self.ui.message =
                    Some("q again ends the session; any other key goes on".to_owned());
            }
            Action::QuitNow => self.leave(End::Interrupted),
            _ => self.wish(action),
        }
    }

    /// The emergency stop: a real plant is told first, and not by the next tick.
    fn stop(&mut self) {
        if let Some(plant) = &self.running.plant {
            plant.desk.wish(Wish::Stop);
        }
        self.ask(Command::Stop);
    }

    /// What a key asks of a real plant.
    fn wish(&mut self, action: Action) {
        let Some(plant) = &self.running.plant else { return };
        let look = plant.desk.see(|view| view.look.clone());
        for wish in self.plant.key(action, &look) {
            plant.desk.wish(wish);
        }
    }

    fn forget_question(&mut self) {
        self.asked_to_end = false;
        self.ui.message = None;
        self.ui.tuned = None;
    }

    fn ask(&mut self, command: Command) {
        // A session that hears nothing any more is over; its results come next.
        let _ = self.running.watcher.ask(command);
    }

    /// Turns the sensitivity of the person's device, and shows where it stands until the
    /// next key.
    fn tune(&mut self, more: bool) {
        if self.running.info.device.is_none() {
            self.ui.message = Some("nobody's device steers: no sensitivity to turn".to_owned());
            return;
        }
        let turned = sensitivity::stepped(self.running.info.sensitivity, more);
        self.running.info.sensitivity = turned;
        self.ui.tuned = Some(turned);
        self.ask(Command::Sensitivity(turned));
    }

    fn faster(&mut self) {
        let steered = |stage: Stage| stage.moment().is_none_or(|m| m.phase.is_steered());
        if steered(self.running.watcher.look().stage) {
            return;
        }
        let faster = SPEEDS.iter().copied().find(|speed| *speed > self.speed);
        self.speed = faster.unwrap_or(SPEEDS[0]);
        self.ask(Command::Speed(self.speed));
    }

    /// Ends the session, and then the program.
    fn leave(&mut self, end: End) {
        if self.leaving.is_none() {
            let cause = match end {
                End::Lost => "the terminal is gone",
                End::Signal => "a signal arrived",
                End::Interrupted | End::Quit => "Ctrl-C was pressed",
            };
            self.ask(Command::Interrupt(cause.to_owned()));
        }
        self.leaving = Some(end);
    }
}
