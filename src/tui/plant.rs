//! The page of a session's real plant: how far its device has come, what to do next, and how it
//! does.
//!
//! ```text
//! connect ─▶ greet ─▶ calibrate ─▶ arm ─▶ run
//! ```
//!
//! What is to be done stands in the middle in plain words; below it the track, the pole and the
//! numbers are live. The page lies over the session's screen, which goes on under it.

mod advice;
mod ladder;
mod panel;
mod picture;

use ratatui::Frame;

pub use panel::Panel;

use super::keys::{Hand, Screen};
use super::palette::{Look, Role};
use super::pen::Pen;
use super::text::{count, cut, fixed, signed, wrapped};
use super::{help, small};
use crate::backend::safety::warden::Standing;
use crate::backend::serial::desk::View;
use crate::backend::serial::shelf::Uncalibrated;
use crate::backend::serial::standing::{Stage, Stopped};
use crate::backend::serial::station::Grip;
use crate::backend::wire::Format;
use crate::signal::{Seconds, State, wrapped as around};

/// What stays the same of a real plant during a session.
#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    /// The port, such as `/dev/ttyUSB0`.
    pub port: String,
    /// What the device speaks.
    pub format: Format,
    /// What enables the motor, such as "hold L1"; `None` where nothing has to be held.
    pub switch: Option<String>,
    /// Whether the device must find its ends before it may be armed.
    pub homing: bool,
    /// From here on the motor only pushes inward, m from the middle;
    pub soft_limit_m: f64,
    /// from here on it is stopped.
    pub hard_limit_m: f64,
    /// From the middle to the ends of the track, m, where it is known.
    pub half_track_m: Option<f64>,
}

/// How the session's own clock does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// How late the latest tick began.
    pub late: Seconds,
    /// Ticks left out because the computer was busy.
    pub missed: u64,
}

/// All that one picture shows.
#[derive(Clone, Debug)]
pub struct Page<'a> {
    /// What the port's thread tells.
    pub view: &'a View,
    /// What stays the same.
    pub facts: &'a Facts,
    /// What the page itself remembers.
    pub panel: &'a Panel,
    /// Whether a rollout is under way.
    pub is_running: bool,
    /// The session's clock, once it ticks.
    pub pace: Option<Pace>,
    /// Whether the keys are shown.
    pub help_open: bool,
    /// A word to the person, in place of the line of keys.
    pub message: Option<&'a str>,
    /// Glyphs and colours.
    pub look: Look,
}

/// The motor in a few words, for the session's own screen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Badge {
    /// The words.
    pub words: String,
    /// How they look.
    pub role: Role,
    /// Whether the motor may follow.
    pub is_armed: bool,
}

impl Badge {
    /// What the session's screen says of a plant.
    #[must_use]
    pub fn of(view: &View, facts: &Facts) -> Self {
        let look = &view.look;
        let (words, role) = match (look.standing, &facts.switch) {
            _ if look.stopped == Stopped::Unconfirmed => {
                ("STOP NOT CONFIRMED: switch the motor's supply off".to_owned(), Role::Alarm)
            }
            (Standing::Latched(_), _) => ("motor STOPPED: o tells why".to_owned(), Role::Alarm),
            (Standing::Disarmed, _) => ("motor off: o arms it".to_owned(), Role::Strong),
            (Standing::Armed, Some(_)) if look.grip == Grip::LeftOn => {
                ("motor ARMED: let go of the switch".to_owned(), Role::Strong)
            }
            (Standing::Armed, Some(switch)) if look.grip == Grip::Off => {
                (format!("motor ARMED: {switch}"), Role::Strong)
            }
            (Standing::Armed, Some(_)) => ("motor ARMED, hand on".to_owned(), Role::Go),
            (Standing::Armed, None) => ("motor ARMED".to_owned(), Role::Go),
        };
        Self { words, role, is_armed: look.standing == Standing::Armed }
    }
}

/// The columns of labels and values.
const LABEL: u16 = 1;
const VALUE: u16 = 13;
/// The widest line of advice.
const MEASURE: u16 = 76;
/// The least width of the picture of the pole.
const DIAL: u16 = 16;
/// Rows of numbers.
const NUMBERS: u16 = 9;

/// Draws the page.
pub fn draw(frame: &mut Frame<'_>, page: &Page<'_>) {
    let area = frame.area();
    let mut pen = Pen::new(frame.buffer_mut(), area, page.look);
    if small::is_too_small(&pen) {
        small::draw(&mut pen, None);
    } else {
        page.draw(&mut pen);
    }
    if page.help_open {
        let notes = [format!("The device {}.", page.facts.port)];
        help::draw(&mut pen, Screen::Plant, Hand::Absent, &notes);
    }
    page.look.finish(frame.buffer_mut());
}

impl Page<'_> {
    fn draw(&self, pen: &mut Pen<'_>) {
        let (width, height) = (pen.width(), pen.height());
        // Advice, track and numbers share what a tall terminal has more.
        let gap = (height - small::LEAST_HEIGHT) / 4;
        self.head(pen);
        ladder::draw(&mut pen.part(LABEL, 1, width - 2 * LABEL, 1), self);
        pen.rule(2);
        let advice = 6 + gap;
        self.advice(&mut pen.part(LABEL, 3, width - 2 * LABEL, advice));
        pen.rule(3 + advice);
        let top = 4 + advice;
        picture::track(&mut pen.part(LABEL, top, width - 2 * LABEL, 2), self.facts, self.state());
        let top = top + 3 + gap / 2;
        let rows = height - 1 - top;
        let dial = DIAL + 2 * gap.min(8);
        self.numbers(&mut pen.part(LABEL, top, width - dial - 2, NUMBERS.min(rows)));
        let mut dial = pen.part(width - dial - 1, top, dial, rows.min(NUMBERS + gap));
        picture::pole(&mut dial, self.state());
        match self.message {
            Some(message) => {
                let room = usize::from(width - 2 * LABEL);
                pen.text(LABEL, height - 1, &cut(message, room), Role::Alarm);
            }
            None => help::hints(pen, height - 1, Screen::Plant, Hand::Nobody),
        }
    }

    /// The plant's state, while it is one of now.
    fn state(&self) -> Option<State> {
        let is_live = self.view.look.stage == Stage::Ready;
        self.view.look.latest.filter(|_| is_live).map(|(state, _)| state)
    }

    fn head(&self, pen: &mut Pen<'_>) {
        let format = match self.facts.format {
            Format::Sensorsini31 => "sensorsini31",
            Format::Cobs1 => "cobs1",
        };
        let end = pen.width() - 1;
        let port = format!("{} {format}", cut(&self.facts.port, 40));
        let free = pen.text_until(end, 0, &port, Role::Text);
        let x = pen.text(1, 0, "coadapt", Role::Dim);
        let x = pen.text(x + 3, 0, "plant", Role::Strong);
        let room = usize::from(free.saturating_sub(x + 4));
        pen.text(x + 2, 0, &cut(&self.view.look.device, room), Role::Text);
    }

    /// What is to be done, in the middle of its rows, and how far it is.
    fn advice(&self, pen: &mut Pen<'_>) {
        let advice = advice::of(self);
        let measure = usize::from(pen.width().min(MEASURE));
        let first = wrapped(&advice.first, measure);
        let more = advice.more.iter().flat_map(|line| wrapped(line, measure));
        let more = more.map(|line| (line, Role::Text));
        let lines: Vec<_> = first.into_iter().map(|line| (line, advice.role)).chain(more).collect();
        let rest = u16::from(advice.progress.is_some()) + u16::from(!advice.keys.is_empty());
        let used = u16::try_from(lines.len()).unwrap_or(u16::MAX).saturating_add(rest);
        let mut y = pen.height().saturating_sub(used) / 2;
        for (line, role) in lines {
            pen.text(1, y, &line, role);
            y += 1;
        }
        if let Some(part) = advice.progress {
            picture::progress(&mut pen.part(1, y, 44, 1), part);
            y += 1;
        }
        let mut x = 1;
        for (key, word) in advice.keys {
            x = pen.text(x, y, key, Role::Strong);
            x = pen.text(x + 2, y, word, Role::Text) + 5;
        }
    }

    fn numbers(&self, pen: &mut Pen<'_>) {
        let look = &self.view.look;
        let state = self.state();
        let number = |index: usize| state.and_then(|s| s.get(index).copied()).unwrap_or(f64::NAN);
        let of_cart = format!(
            "{} cm   moves {} cm/s",
            signed(100.0 * number(0), 6, 1),
            signed(100.0 * number(1), 6, 1)
        );
        let of_pole = format!(
            "{}°     turns {} °/s",
            signed(around(number(2)).to_degrees(), 6, 1),
            signed(number(3).to_degrees(), 6, 0)
        );
        let mut y = 0;
        let mut row = |label: &str, value: &str, role: Role| {
            pen.text(0, y, label, Role::Dim);
            let room = usize::from(pen.width().saturating_sub(VALUE));
            pen.text(VALUE, y, &cut(value, room), role);
            y += 1;
        };
        row("cart", &of_cart, Role::Text);
        row("pole", &of_pole, Role::Text);
        let (hand, role) = self.hand();
        row("hand", &hand, role);
        let (motor, role) = self.motor();
        row("motor", &motor, role);
        let (calibrated, role) = self.calibrated();
        row("calibrated", &calibrated, role);
        let damaged = look.counts.checksum_errors;
        let received = format!(
            "{} states   {} lost   {} damaged",
            count(look.states, 7),
            count(look.lost, 4),
            count(damaged, 4)
        );
        let is_well = look.lost == 0 && damaged == 0;
        row("received", &received, if is_well { Role::Text } else { Role::Strong });
        let latency = self.view.latency;
        let answered = if look.answered == 0 {
            "nothing yet".to_owned()
        } else {
            let [half, most, all] =
                [latency.p50_us, latency.p99_us, latency.max_us].map(milliseconds);
            format!("p50 {half} ms   p99 {most} ms   max {all} ms")
        };
        row("answered in", &answered, Role::Text);
        let pace = self.pace.map_or_else(
            || "not yet".to_owned(),
            |pace| {
                let late = fixed(pace.late.0 * 1e3, 6, 2);
                format!("late {late} ms  {} missed", count(pace.missed, 7))
            },
        );
        row("tick", &pace, Role::Text);
        let (first, role) = if self.view.is_first {
            ("goes before all else here", Role::Text)
        } else {
            ("shares this computer: README", Role::Strong)
        };
        row("port", first, role);
    }

    /// Whether a hand enables the motor.
    fn hand(&self) -> (String, Role) {
        match (&self.facts.switch, self.view.look.grip) {
            (None, _) => ("needs to hold nothing".to_owned(), Role::Text),
            (Some(switch), Grip::On) => (format!("ON the switch ({switch})"), Role::Go),
            (Some(_), Grip::LeftOn) => {
                ("ON the switch since before arming: let go".to_owned(), Role::Strong)
            }
            (Some(switch), Grip::Off) => (format!("off the switch ({switch})"), Role::Text),
        }
    }

    /// Whether the motor may move, and whether it is known that it does not.
    fn motor(&self) -> (String, Role) {
        let look = &self.view.look;
        let (standing, role) = match look.standing {
            _ if look.stage == Stage::Homing => {
                return ("MOVES by itself".to_owned(), Role::Strong);
            }
            Standing::Armed => return ("ARMED".to_owned(), Role::Go),
            Standing::Disarmed => ("off", Role::Text),
            Standing::Latched(_) => ("STOPPED", Role::Wait),
        };
        let (known, role) = match look.stopped {
            Stopped::Unconfirmed => {
                return ("may be ON: stop NOT CONFIRMED".to_owned(), Role::Alarm);
            }
            Stopped::No => ("", role),
            Stopped::Told => (", not confirmed yet", role),
            Stopped::Confirmed => (", stop confirmed", role),
        };
        (format!("{standing}{known}"), role)
    }

    /// When the device was calibrated, or why that does not count.
    fn calibrated(&self) -> (String, Role) {
        match &self.view.look.calibrated {
            Ok(at) => {
                // The date and the minute of "2026-03-14T09:26:53Z".
                let (date, time) = at.split_once('T').unwrap_or((at, ""));
                let minute: String = time.chars().take(5).collect();
                let kept = if self.view.not_kept.is_some() { ", NOT KEPT" } else { "" };
                let utc = if at.ends_with('Z') { " UTC" } else { "" };
                (format!("{date} {minute}{utc}{kept}"), Role::Text)
            }
            Err(why) => {
                let why = match why {
                    Uncalibrated::Never => "NO: it never was",
                    Uncalibrated::Stale => "NO: too long ago",
                    Uncalibrated::Changed => "NO: for other scales or limits",
                };
                (why.to_owned(), Role::Wait)
            }
        }
    }
}

/// Microseconds in milliseconds.
fn milliseconds(us: u64) -> String {
    fixed(f64::from(u32::try_from(us).unwrap_or(u32::MAX)) / 1e3, 6, 2)
}
