//! A recorded session on the screen: the same pictures as live, at any time and any speed.
//!
//! [`Player`] is where the recording stands and what keys do to it: a pure function of keys and of
//! the time that passes, so that a test needs neither a terminal nor a clock.

mod page;

use ratatui::Frame;
use ratatui::crossterm::event::{KeyCode, KeyEvent};

use super::keys::{self, Action};
use super::live::film::{Film, Lane};
use super::live::{self, History, Info, Seat, Ui, View, phase_word};
use super::palette::{Look, Role};
use super::text::{fixed, place, real};
use crate::control::recording::{Recording, Span};
use crate::control::snapshot::Snapshot;
use crate::signal::{End, Seconds};

pub use page::show;

/// The speeds that `+` and `-` go through.
const SPEEDS: [f64; 10] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
/// Where they begin.
const REAL_TIME: usize = 3;
/// What an arrow key goes on or back, s.
const SCRUB_S: f64 = 1.0;
/// Whoever presses a key again within this time means it twice, s.
const AGAIN_S: f64 = 0.5;
/// What a curve has room for, s.
const WINDOW_S: f64 = 10.0;
/// The longest number of a rollout.
const MOST_DIGITS: usize = 7;

/// What a key led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// Nothing more.
    Stay,
    /// Leave the screen.
    Quit,
    /// Leave it as Ctrl-C does.
    Interrupt,
}

/// Which curves are shown.
#[derive(Clone, Copy, Debug)]
struct Shown {
    human: bool,
    machine: bool,
    net: bool,
}

/// A recording and where it stands.
pub struct Player {
    recording: Recording,
    info: Info,
    /// The row that is shown, and how much of its tick has passed.
    position: f64,
    is_playing: bool,
    speed: usize,
    typed: String,
    shown: Shown,
    ui: Ui,
}

impl Player {
    /// `recording` at its beginning, playing in real time; `info` are the session's facts.
    #[must_use]
    pub fn new(recording: Recording, info: Info, look: Look) -> Self {
        let message = recording.trouble().map(str::to_owned);
        Self {
            recording,
            info,
            position: 0.0,
            is_playing: true,
            speed: REAL_TIME,
            typed: String::new(),
            shown: Shown { human: true, machine: true, net: true },
            ui: Ui { message, look, ..Ui::default() },
        }
    }

    /// The row that is shown.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and the number of rows"
    )]
    pub const fn row(&self) -> usize {
        self.position as usize
    }

    /// Whether time passes.
    #[must_use]
    pub const fn is_playing(&self) -> bool {
        self.is_playing
    }

    /// How many times faster than the wall.
    #[must_use]
    pub fn speed(&self) -> f64 {
        SPEEDS.get(self.speed).copied().unwrap_or(1.0)
    }

    /// So much time of the wall has passed.
    pub fn pass(&mut self, time: Seconds) {
        if self.is_playing {
            self.go_to(self.position + time.0 * self.speed() / self.info.tick_s);
            self.is_playing = self.row() + 1 < self.recording.len();
        }
    }

    /// A key was pressed.
    pub fn key(&mut self, key: KeyEvent) -> Reaction {
        let action = keys::action(keys::Screen::Replay, key);
        if action.is_some() || key.is_press() {
            self.ui.message = None;
        }
        let Some(action) = action else { return Reaction::Stay };
        match action {
            Action::Quit => return Reaction::Quit,
            Action::QuitNow => return Reaction::Interrupt,
            Action::Digit => self.digit(key),
            Action::Begin => self.jump(),
            Action::Forget => self.typed.clear(),
            Action::Pause => self.pause(),
            Action::StepOn => self.step(1.0),
            Action::StepBack => self.step(-1.0),
            Action::Right => self.scrub(SCRUB_S),
            Action::Left => self.scrub(-SCRUB_S),
            Action::First => self.go_to(0.0),
            Action::Last => self.go_to(real(self.recording.len())),
            Action::Faster => self.speed = (self.speed + 1).min(SPEEDS.len() - 1),
            Action::Slower => self.speed = self.speed.saturating_sub(1),
            Action::Next => self.turn(|here, span| span.first > here),
            Action::Previous => self.turn_back(),
            Action::Down => self.turn_phase(),
            Action::Up => self.turn_phase_back(),
            Action::Human => self.shown.human = !self.shown.human,
            Action::Machine => self.shown.machine = !self.shown.machine,
            Action::Net => self.shown.net = !self.shown.net,
            Action::SubjectView => self.ui.subject_view = !self.ui.subject_view,
            Action::Help => self.ui.help_open = !self.ui.help_open,
            _ => {}
        }
        Reaction::Stay
    }

    fn go_to(&mut self, position: f64) {
        let last = real(self.recording.len().saturating_sub(1));
        self.position = position.clamp(0.0, last.max(0.0));
    }

    /// To the first row of a rollout.
    fn go_to_span(&mut self, index: usize) {
        if let Some(span) = self.recording.spans().get(index) {
            self.go_to(real(span.first));
        }
    }

    /// Pauses or goes on; from the end, from the beginning on.
    fn pause(&mut self) {
        self.is_playing = !self.is_playing;
        if self.is_playing && self.row() + 1 >= self.recording.len() {
            self.go_to(0.0);
        }
    }

    /// Whole steps; whoever counts them does not want it to play on.
    fn step(&mut self, rows: f64) {
        self.is_playing = false;
        self.go_to(self.position.floor() + rows);
    }

    fn scrub(&mut self, time_s: f64) {
        self.go_to(self.position + time_s / self.info.tick_s);
    }

    /// To the first rollout of which `is` says so, where this one begins.
    fn turn(&mut self, is: impl Fn(usize, &Span) -> bool) {
        let here = self.row();
        if let Some(index) = self.recording.spans().iter().position(|span| is(here, span)) {
            self.go_to_span(index);
        }
    }

    /// To this rollout's beginning; from there, to the one before.
    fn turn_back(&mut self) {
        let index = self.recording.span_at(self.row());
        let first = self.recording.spans().get(index).map_or(0, |span| span.first);
        // While it plays on, nobody can press twice at the very first row.
        let grace_s = if self.is_playing { AGAIN_S * self.speed().max(1.0) } else { 0.0 };
        let begins = (self.position.floor() - real(first)) * self.info.tick_s <= grace_s;
        self.go_to_span(if begins { index.saturating_sub(1) } else { index });
    }

    fn turn_phase(&mut self) {
        let spans = self.recording.spans();
        let Some(phase) = spans.get(self.recording.span_at(self.row())).map(|s| s.moment.phase)
        else {
            return;
        };
        self.turn(|here, span| span.first > here && span.moment.phase != phase);
    }

    /// To this phase's beginning; from its first rollout, to that of the one before.
    fn turn_phase_back(&mut self) {
        let spans = self.recording.spans();
        let here = self.recording.span_at(self.row());
        let first_of = |index: usize| {
            let phase = spans.get(index).map(|span| span.moment.phase);
            spans.iter().position(|span| Some(span.moment.phase) == phase).unwrap_or(0)
        };
        let first = first_of(here);
        let target = if here > first { first } else { first_of(first.saturating_sub(1)) };
        self.go_to_span(target);
    }

    fn digit(&mut self, key: KeyEvent) {
        if let KeyCode::Char(digit) = key.code
            && self.typed.len() < MOST_DIGITS
        {
            self.typed.push(digit);
        }
    }

    /// To the rollout whose number was typed, in this phase: its last attempt.
    fn jump(&mut self) {
        let Ok(wanted) = std::mem::take(&mut self.typed).parse::<u32>() else { return };
        let spans = self.recording.spans();
        let here = self.recording.span_at(self.row());
        let Some(phase) = spans.get(here).map(|span| span.moment.phase) else { return };
        let is_it = |span: &Span| span.moment.phase == phase && span.moment.rollout == wanted;
        if let Some(index) = spans.iter().rposition(is_it) {
            return self.go_to_span(index);
        }
        let of_phase = spans.iter().filter(|span| span.moment.phase == phase);
        let most = of_phase.map(|span| span.moment.rollout).max().unwrap_or(0);
        self.ui.message =
            Some(format!("no rollout {wanted} in {}: 1 to {most} are there", phase_word(phase)));
    }

    /// The film as it stands.
    fn film(&self) -> Film {
        let row = self.row();
        let here = self.recording.span_at(row);
        let Some(span) = self.recording.spans().get(here) else { return Film::default() };
        let seconds = |rows: usize| real(rows) * self.info.tick_s;
        let rows = self.recording.len();
        Film {
            is_playing: self.is_playing,
            speed: self.speed(),
            position_s: seconds(row),
            length_s: seconds(rows.saturating_sub(1)),
            borders: self.borders(),
            lanes: self.lanes(span, row),
            window: self.window(),
            end: (row + 1 == span.first + span.rows).then(|| self.ending(span)),
            typed: self.typed.clone(),
        }
    }

    /// How a rollout ended, in words.
    fn ending(&self, span: &Span) -> String {
        let time = fixed(real(span.rows.saturating_sub(1)) * self.info.tick_s, 0, 2);
        let how = match span.end {
            None => "the recording breaks off",
            Some(End::Failed) => "failed",
            Some(End::Cap) => "the longest time",
            Some(End::Goal) => "the goal",
            Some(End::Time) => "the phase's time is over",
            Some(End::Aborted) => "the session was ended",
            Some(End::Discarded) => "discarded, and repeated",
        };
        format!("{how}, after {time} s")
    }

    /// Where phases begin after the first, as parts of the whole.
    fn borders(&self) -> Vec<f64> {
        let all = real(self.recording.len().max(2) - 1);
        let pairs = self.recording.spans().windows(2);
        let begins = pairs.filter(|pair| pair[0].moment.phase != pair[1].moment.phase);
        begins.map(|pair| real(pair[1].first) / all).collect()
    }

    /// The rows that a curve has room for.
    fn window(&self) -> usize {
        usize::from(place((WINDOW_S / self.info.tick_s).round()).max(1))
    }

    /// The curves of a rollout from the latest ten seconds' mark up to `row`: what was drawn stays
    /// where it is.
    fn lanes(&self, span: &Span, row: usize) -> Vec<Lane> {
        let (window, within) = (self.window(), row - span.first.min(row));
        let rows = self.recording.rows_of(span);
        let rows = rows.get(within / window * window..=within).unwrap_or_default();
        let Shown { human, machine, net } = self.shown;
        let mut lanes = Vec::new();
        if human {
            let values = rows.iter().map(|row| row.u_human).collect();
            lanes.push(Lane { label: "you", role: Role::You, values });
        }
        if machine {
            let values = rows.iter().map(|row| row.u_machine).collect();
            lanes.push(Lane { label: "robot", role: Role::Robot, values });
        }
        if net {
            let values = rows.iter().map(|row| row.u_applied).collect();
            lanes.push(Lane { label: "motor", role: Role::Motor, values });
        }
        lanes
    }

    /// What happened up to the row that is shown.
    fn history(&self, history: &mut History) {
        let (row, known) = (self.row(), self.recording.rollouts(self.row()));
        // Only what is new is copied while it plays on.
        history.rollouts.truncate(known.len());
        history.rollouts.extend_from_slice(&known[history.rollouts.len()..]);
        history.success.clear();
        history.success.extend(self.recording.successes(row));
    }
}

/// Draws the recording where `player` stands; numbers from `panel`, which may be a little older.
pub fn draw(frame: &mut Frame<'_>, player: &Player, panel: &Snapshot, history: &mut History) {
    player.history(history);
    let scene = player.recording.snapshot(player.row());
    let ui = Ui { seat: Seat::Replay(player.film()), ..player.ui.clone() };
    // While it stands still, or in another rollout, numbers must be those of the picture.
    let place = |seen: &Snapshot| seen.stage.moment().map(|m| (m.phase, m.rollout, m.attempt));
    let is_calm = player.is_playing && place(panel) == place(&scene);
    let panel = if is_calm { panel } else { &scene };
    live::draw(frame, &View { info: &player.info, scene: &scene, panel, history, ui: &ui });
}
