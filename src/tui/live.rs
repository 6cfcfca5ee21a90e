//! The live screen: the plant at a glance, the session's state in fixed places below it.

mod facts;
pub mod film;
mod map;
mod overlay;
mod panels;
pub mod strip;

use ratatui::Frame;

use super::keys::{Hand, Screen};
use super::palette::{Look, Role};
use super::pen::Pen;
use super::scene::{Light, Scene, regions};
use super::{briefing, help, plant, small};
use crate::control::snapshot::Snapshot;
use crate::operator::Device;
use crate::record::EpisodeRow;
use crate::report::metrics;
use crate::session::Phase;
use crate::session::machine::{Finish, Stage};
use crate::session::plan::PhasePlan;
use film::Film;

/// What stays the same during a session.
#[derive(Clone, Debug, PartialEq)]
pub struct Info {
    /// The task's name.
    pub task: String,
    /// The profile's preset.
    pub preset: String,
    /// The mode's word.
    pub mode: String,
    /// Whether the robot only watches in main (sequential mode).
    pub robot_watches: bool,
    /// The learner's name.
    pub learner: String,
    /// The subject's identifier.
    pub subject: String,
    /// The trial's number.
    pub trial: u32,
    /// The phases in order.
    pub phases: Vec<PhasePlan>,
    /// What a person is told before each phase; missing ones are empty.
    pub instructions: Vec<(Phase, String)>,
    /// The control tick, s.
    pub tick_s: f64,
    /// The countdown before a steered rollout, s.
    pub hold_s: f64,
    /// The countdown before a rollout that nobody steers, s.
    pub autonomous_hold_s: f64,
    /// The break between phases, s.
    pub break_s: f64,
    /// The success at which the robot begins to take over; 0 where there is no gate.
    pub gate: f64,
    /// Whether the gate is but a timer: success counts from nothing over a window that is
    /// longer than any rollout.
    pub gate_is_timer: bool,
    /// Whether shares move once an episode.
    pub by_episode: bool,
    /// The most steps that a steered rollout lasts,
    pub longest_taught: u32,
    /// and one that nobody steers.
    pub longest_tested: u32,
    /// The largest action.
    pub action_limit: f64,
    /// The action's unit, one or two characters.
    pub action_unit: String,
    /// The picture.
    pub scene: Scene,
    /// Where the regions meet, for the map beside the picture; `None` where there is none.
    pub regions: Option<regions::Borders>,
    /// The most receptive fields.
    pub field_cap: u32,
    /// The operator and how it is known, such as "keyboard, releases reported".
    pub operator: String,
    /// What the device's buttons do, in a sentence; empty where it has none.
    pub buttons: String,
    /// How the operator's device does at the moment, in a few words; mostly none.
    pub device_state: String,
    /// The device that the operator's hand is on; `None` where there is none.
    pub device: Option<Device>,
    /// Its sensitivity.
    pub sensitivity: f64,
}

impl Info {
    /// What a person is told before `phase`.
    #[must_use]
    pub fn instruction(&self, phase: Phase) -> &str {
        self.instructions.iter().find(|(of, _)| *of == phase).map_or("", |(_, text)| text)
    }

    /// The plan of `phase`, if it takes place.
    #[must_use]
    pub fn phase(&self, phase: Phase) -> Option<&PhasePlan> {
        self.phases.iter().find(|plan| plan.phase == phase)
    }

    /// How many rollouts `phase` has, when that is what ends it.
    #[must_use]
    pub fn rollouts(&self, phase: Phase) -> Option<u32> {
        self.phase(phase).and_then(|plan| plan.rollouts)
    }
}

/// What happened in the session so far.
#[derive(Clone, Debug, Default)]
pub struct History {
    /// The rollouts that ended.
    pub rollouts: Vec<EpisodeRow>,
    /// Success, sampled now and then, oldest first.
    pub success: Vec<f64>,
}

impl History {
    /// The durations of the rollouts of `phase` that count, s.
    #[must_use]
    pub fn durations(&self, phase: Phase) -> Vec<f64> {
        metrics::rollouts_of(&self.rollouts, phase).map(|row| row.duration_s).collect()
    }
}

/// From where a session is seen.
#[derive(Clone, Debug, Default)]
pub enum Seat {
    /// At its controls.
    #[default]
    Controls,
    /// At another terminal, while it runs.
    Beside,
    /// Afterwards, from what was recorded.
    Replay(Film),
}

impl Seat {
    /// Whose keys are heard there.
    const fn screen(&self) -> Screen {
        match self {
            Self::Controls => Screen::Live,
            Self::Beside => Screen::Watch,
            Self::Replay(_) => Screen::Replay,
        }
    }

    /// Whether what is pressed there moves the session.
    #[must_use]
    pub const fn has_controls(&self) -> bool {
        matches!(self, Self::Controls)
    }
}

/// The state of the screen itself.
#[derive(Clone, Debug)]
pub struct Ui {
    /// Who looks.
    pub seat: Seat,
    /// Whether share and success are shown.
    pub show_progress: bool,
    /// Whether only the scene is shown.
    pub subject_view: bool,
    /// Whether the keys are shown.
    pub help_open: bool,
    /// A word to the person, in place of the line of keys.
    pub message: Option<String>,
    /// What is wrong with the person's device and what to do, in the same place.
    pub trouble: Option<String>,
    /// The sensitivity that was just turned, in the same place.
    pub tuned: Option<f64>,
    /// The motor of a real plant; `None` where there is none.
    pub motor: Option<plant::Badge>,
    /// What the countdown waits for, in its place.
    pub waits: Option<String>,
    /// Glyphs and colours.
    pub look: Look,
}

impl Default for Ui {
    fn default() -> Self {
        Self {
            seat: Seat::Controls,
            show_progress: true,
            subject_view: false,
            help_open: false,
            message: None,
            trouble: None,
            tuned: None,
            motor: None,
            waits: None,
            look: Look::default(),
        }
    }
}

/// All that one picture shows.
///
/// The scene is drawn from the latest snapshot; numbers from one that is refreshed about
/// ten times a second, so that they can be read.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// What stays the same.
    pub info: &'a Info,
    /// The latest snapshot, for what moves.
    pub scene: &'a Snapshot,
    /// A calmer one, for what is read.
    pub panel: &'a Snapshot,
    /// What happened so far.
    pub history: &'a History,
    /// The state of the screen.
    pub ui: &'a Ui,
}

impl View<'_> {
    /// The most steps that a rollout of the present phase lasts.
    #[must_use]
    pub fn longest(&self) -> u32 {
        let Info { longest_taught, longest_tested, .. } = *self.info;
        if self.phase().is_steered() { longest_taught } else { longest_tested }
    }

    /// The phase that the session is at; the plan's last once it is finished.
    #[must_use]
    pub fn phase(&self) -> Phase {
        let last = || self.info.phases.last().map(|plan| plan.phase);
        self.panel
            .stage
            .moment()
            .map(|moment| moment.phase)
            .or_else(last)
            .unwrap_or(Phase::Introduction)
    }

    /// The person's share in the present region, as the present phase has it.
    #[must_use]
    pub fn share(&self) -> f64 {
        match self.phase() {
            Phase::Introduction => 1.0,
            Phase::Main => self.panel.shares.get(self.panel.region).copied().unwrap_or(1.0),
            Phase::Autonomous | Phase::ZeroControl => 0.0,
        }
    }

    /// Who steers now.
    #[must_use]
    pub fn hand(&self) -> Hand {
        match self.info.device {
            _ if !self.ui.seat.has_controls() => Hand::Nobody,
            _ if !self.phase().is_steered() => Hand::Nobody,
            Some(device) => Hand::On(device),
            None => Hand::Absent,
        }
    }

    /// The stage in a few words.
    #[must_use]
    pub fn stage_words(&self) -> String {
        let at = self.panel.stage.moment().map_or(String::new(), |moment| {
            format!("{}, rollout {}", phase_word(moment.phase), moment.rollout)
        });
        let doing = match self.panel.stage {
            Stage::Instruction(_) => "instruction: ",
            Stage::Break { .. } => "break before ",
            Stage::Hold { .. } => "WAIT: ",
            Stage::Running(_) => "GO: ",
            Stage::Paused(_) => "PAUSED: ",
            Stage::Stopped(_) => "STOPPED: ",
            Stage::Finished(Finish::Complete) => "the session is complete",
            Stage::Finished(Finish::Aborted) => "the session was ended",
        };
        format!("{doing}{at}")
    }

    /// What is wrong with the person's device, in lines of at most `width`.
    pub(super) fn trouble_words(&self, width: usize) -> Vec<String> {
        let trouble = self.ui.trouble.as_deref().filter(|_| self.phase().is_steered());
        trouble.map(|words| super::text::wrapped(words, width)).unwrap_or_default()
    }

    /// Writes the message, if there is one, into row `y`, or does `otherwise`.
    pub(super) fn message_or(
        &self,
        pen: &mut Pen<'_>,
        y: u16,
        otherwise: impl FnOnce(&mut Pen<'_>),
    ) {
        let room = usize::from(pen.width().saturating_sub(2));
        // A page or a box says what is wrong already, and its keys are wanted.
        let steered = self.phase().is_steered();
        let has_box =
            steered && matches!(self.panel.stage, Stage::Paused(_) | Stage::Instruction(_));
        let trouble = self.ui.trouble.as_ref().filter(|_| !has_box);
        if let Seat::Replay(Film { typed, .. }) = &self.ui.seat
            && !typed.is_empty()
        {
            let line = format!("to rollout {typed}_   Enter goes there, Esc does not");
            pen.text(1, y, &line, Role::Strong);
            return;
        }
        match (self.ui.message.as_ref().or(trouble), self.ui.tuned) {
            (Some(message), _) => {
                // Only who has the controls can do something about it.
                let role = if self.ui.seat.has_controls() { Role::Alarm } else { Role::Strong };
                pen.text(1, y, &super::text::cut(message, room), role);
            }
            (None, Some(sensitivity)) => {
                let line = super::sensitivity::line(sensitivity, pen.look.glyphs);
                pen.text(1, y, &super::text::cut(&line, room), Role::Strong);
            }
            (None, None) => otherwise(pen),
        }
        if matches!(self.ui.seat, Seat::Beside) {
            pen.text_until(pen.width().saturating_sub(1), y, "read-only", Role::Dim);
        }
    }
}

/// A phase's name as people say it.
#[must_use]
pub const fn phase_word(phase: Phase) -> &'static str {
    match phase {
        Phase::ZeroControl => "zero control",
        other => other.word(),
    }
}

/// Rows below the scene: rule, five rows of numbers, line of keys.
const PANEL_ROWS: u16 = 7;

/// Draws the screen.
pub fn draw(frame: &mut Frame<'_>, view: &View<'_>) {
    let area = frame.area();
    let mut pen = Pen::new(frame.buffer_mut(), area, view.ui.look);
    if small::is_too_small(&pen) {
        small::draw(&mut pen, Some(view));
    } else {
        page(&mut pen, view);
    }
    view.ui.look.finish(frame.buffer_mut());
}

fn page(pen: &mut Pen<'_>, view: &View<'_>) {
    let is_briefing = matches!(view.panel.stage, Stage::Instruction(_) | Stage::Break { .. });
    if is_briefing {
        briefing::draw(pen, view);
    } else if view.ui.subject_view {
        subject(pen, view);
    } else {
        everything(pen, view);
    }
    if view.ui.help_open {
        let screen = match &view.ui.seat {
            Seat::Controls if is_briefing => Screen::Briefing,
            seat => seat.screen(),
        };
        help::draw(pen, screen, view.hand(), &notes(view));
    }
}

fn everything(pen: &mut Pen<'_>, view: &View<'_>) {
    let (width, height) = (pen.width(), pen.height());
    strip::header(&mut pen.part(0, 0, width, 1), view);
    strip::phases(&mut pen.part(0, 1, width, 1), view);
    let rows = height - 2 - PANEL_ROWS;
    let beside = map::width(view.info, width);
    let (seat, info) = (&view.ui.seat, view.info);
    let lanes = film::height(seat, rows);
    film::lanes(&mut pen.part(0, 2, width, lanes), seat, info.action_limit, &info.action_unit);
    scene(&mut pen.part(0, 2 + lanes, width - beside, rows - lanes), view);
    map::draw(&mut pen.part(width - beside, 2 + lanes, beside, rows - lanes), view);
    match seat {
        Seat::Replay(film) => film::timeline(&mut pen.part(0, 2 + rows, width, 1), film),
        Seat::Controls | Seat::Beside => pen.rule(2 + rows),
    }
    panels::draw(&mut pen.part(0, 3 + rows, width, PANEL_ROWS - 2), view);
    let last = height - 1;
    view.message_or(pen, last, |pen| help::hints(pen, last, seat.screen(), view.hand()));
    overlay::draw(&mut pen.part(0, 2, width, rows), view);
}

/// Scene, countdown, number of the rollout and the instruction; nothing else.
fn subject(pen: &mut Pen<'_>, view: &View<'_>) {
    let (width, height) = (pen.width(), pen.height());
    if let Some(moment) = view.panel.stage.moment() {
        pen.text_until(width - 1, 0, &format!("rollout {:>3}", moment.rollout), Role::Text);
    }
    let measure = usize::from(width.min(76));
    let lines = super::text::wrapped(view.info.instruction(view.phase()), measure);
    let shown: u16 = 3;
    scene(&mut pen.part(0, 1, width, height - 2 - shown), view);
    for (line, row) in lines.iter().zip(0..shown) {
        pen.centred(height - shown + row, line, Role::Text);
    }
    view.message_or(pen, height - 1, |_| {});
    overlay::draw(&mut pen.part(0, 1, width, height - 2 - shown), view);
}

/// The plant, and in the row below it the countdown.
fn scene(pen: &mut Pen<'_>, view: &View<'_>) {
    let (width, height) = (pen.width(), pen.height());
    let is_running = matches!(view.scene.stage, Stage::Running(_));
    let light = if is_running { Light::Go } else { Light::Wait };
    view.info.scene.draw(&mut pen.part(0, 0, width, height - 1), &view.scene.state, light);
    if let Some(motor) = &view.ui.motor {
        pen.text(1, 0, &motor.words, motor.role);
    }
    if let Seat::Replay(film) = &view.ui.seat {
        if let Some(end) = &film.end {
            pen.centred(height - 1, end, Role::Strong);
        }
        return;
    }
    if let Stage::Hold { moment, ticks_left } = view.scene.stage {
        if let Some(waits) = &view.ui.waits {
            let line = super::text::cut(&format!("WAIT  {waits}"), usize::from(width));
            return pen.centred(height - 1, &line, Role::Wait);
        }
        let info = view.info;
        let whole = if moment.phase.is_steered() { info.hold_s } else { info.autonomous_hold_s };
        let left = f64::from(ticks_left) * info.tick_s;
        let bar = width.min(64);
        let mut row = pen.part((width - bar) / 2, height - 1, bar, 1);
        strip::countdown(&mut row, ("WAIT", Role::Wait), left, whole, 1);
    }
}

/// What the help says beside the keys.
fn notes(view: &View<'_>) -> Vec<String> {
    let info = view.info;
    let gate = super::text::fixed(info.gate * 100.0, 0, 0);
    let mut notes = Vec::new();
    match view.ui.seat {
        Seat::Controls => {}
        Seat::Beside => {
            return vec!["You only look on: nothing here moves the session.".to_owned()];
        }
        Seat::Replay(_) => {
            return vec!["Countdowns, breaks and pauses are not recorded.".to_owned()];
        }
    }
    if view.ui.motor.is_some() {
        notes.push("o opens the page of the plant: arm, home, calibrate.".to_owned());
    }
    if !info.robot_watches && info.gate > 0.0 {
        let timer = if info.gate_is_timer {
            " With the thesis's window of 4000 steps that is a timer of about 2,300–2,600 steps \
             rather than a test of skill."
        } else {
            ""
        };
        notes.push(format!("The robot begins to take over when success reaches {gate} %.{timer}"));
    }
    if !info.operator.is_empty() {
        notes.push(format!("Steered by {}.", info.operator));
    }
    if !info.buttons.is_empty() {
        notes.push(info.buttons.clone());
    }
    notes
}
