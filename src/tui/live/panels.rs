//! The numbers below the scene: who has the controls on the left, how it goes on the right.

use super::View;
use crate::session::Phase;
use crate::session::machine::Stage;
use crate::tui::palette::Role;
use crate::tui::pen::{Pen, columns};
use crate::tui::text::{count, fixed, mean, place, signed, sparkline};

/// The right part's width.
const RIGHT: u16 = 31;
/// Where values begin, after the longest label.
const VALUES: u16 = 9;

/// Draws both parts into five rows.
pub fn draw(pen: &mut Pen<'_>, view: &View<'_>) {
    let (width, height) = (pen.width(), pen.height());
    let left = width.saturating_sub(RIGHT);
    sharing(&mut pen.part(0, 0, left, height), view);
    actions(&mut pen.part(0, 2, left, height), view);
    facts(&mut pen.part(left, 0, RIGHT, height), view);
}

/// The share's bar, and success with the gate.
fn sharing(pen: &mut Pen<'_>, view: &View<'_>) {
    let phase = view.phase();
    let words = match phase {
        Phase::Introduction => "you alone",
        Phase::Main if view.info.robot_watches => "robot watches",
        Phase::Main => "",
        Phase::Autonomous => "robot alone",
        Phase::ZeroControl => "nobody steers",
    };
    if !view.ui.show_progress {
        pen.text(1, 0, "progress hidden (p)", Role::Dim);
        return;
    }
    // "you ▐…▌ robot  63:37"
    let bar_end = pen.width().saturating_sub(18);
    pen.text(1, 0, "you", if phase.is_steered() { Role::You } else { Role::Dim });
    pen.text(VALUES - 1, 0, "▐", Role::Dim);
    pen.text(bar_end, 0, "▌", Role::Dim);
    let bar = bar_end.saturating_sub(VALUES);
    let share = view.share();
    let yours = place((share.clamp(0.0, 1.0) * f64::from(bar)).round());
    if phase != Phase::ZeroControl {
        let x = pen.repeat(VALUES, 0, "█", yours, Role::You);
        pen.repeat(x, 0, "▒", bar.saturating_sub(yours), Role::Robot);
    }
    if words.is_empty() {
        let percent = (share * 100.0).round();
        let ratio = format!("{}:{}", fixed(percent, 3, 0), fixed(100.0 - percent, 0, 0));
        pen.text(bar_end + 2, 0, "robot", Role::Robot);
        pen.text(bar_end + 8, 0, &ratio, Role::Strong);
    } else {
        let role = if phase == Phase::Autonomous { Role::Robot } else { Role::Text };
        pen.text(bar_end + 2, 0, words, role);
    }
    if phase == Phase::Main {
        success(&mut pen.part(0, 1, pen.width(), 1), view);
    }
}

/// Success over the session, its value, and where the gate is.
fn success(pen: &mut Pen<'_>, view: &View<'_>) {
    let now = view.panel.successes.get(view.panel.region).copied().unwrap_or(0.0);
    let is_wide = pen.width() >= 80;
    let end = pen.width().saturating_sub(if is_wide { 37 } else { 19 });
    let spark = end.saturating_sub(VALUES + 7);
    pen.text(1, 0, "success", Role::Text);
    let bars = sparkline(&view.history.success, spark.into(), 1.0);
    pen.text(VALUES, 0, &bars, Role::Text);
    pen.text(VALUES + spark, 0, &format!("{} %", fixed(now * 100.0, 4, 0)), Role::Strong);
    if view.info.robot_watches {
        return;
    }
    let (words, role) = match view.panel.gate {
        Some(opened) => {
            let tau = fixed(opened.tau, 0, 0);
            let words = if is_wide { "gate opened at step" } else { "open" };
            (format!("{words} {}, τ {tau}", opened.step), Role::Robot)
        }
        None => (format!("gate {} %: not yet", fixed(view.info.gate * 100.0, 0, 0)), Role::Dim),
    };
    pen.text(end, 0, &words, role);
}

/// Three bars around zero: what you want, what the robot wants, what the motor gets.
fn actions(pen: &mut Pen<'_>, view: &View<'_>) {
    let seen = view.panel;
    let is_running = matches!(seen.stage, Stage::Running(_));
    let steered = view.phase().is_steered();
    let you = (steered && seen.human.is_present()).then(|| seen.human.action().0);
    let robot = seen.machine;
    let motor = is_running.then_some(seen.applied);
    let absent = if steered { "away" } else { "–" };
    action(pen, view, 0, ("you", "█", Role::You), you.ok_or(absent));
    action(pen, view, 1, ("robot", "▒", Role::Robot), robot.ok_or("–"));
    action(pen, view, 2, ("motor", "━", Role::Motor), motor.ok_or("held"));
}

/// One bar: its label, what it is drawn with, and its value or a word in its place.
fn action(
    pen: &mut Pen<'_>,
    view: &View<'_>,
    y: u16,
    (label, glyph, role): (&str, &str, Role),
    value: Result<f64, &str>,
) {
    let unit = &view.info.action_unit;
    let end = pen.width().saturating_sub(10);
    // An odd number of cells: zero has one of its own.
    let half = end.saturating_sub(VALUES + 1) / 2;
    let zero = VALUES + half;
    pen.text(1, y, label, role);
    pen.text(zero, y, "│", Role::Dim);
    let words = match value {
        Ok(value) => {
            let part = (value / view.info.action_limit).clamp(-1.0, 1.0);
            let cells = place((part.abs() * f64::from(half)).round());
            let from = if part < 0.0 { zero.saturating_sub(cells) } else { zero + 1 };
            pen.repeat(from, y, glyph, cells, role);
            format!("{} {unit}", signed(value, 6, 1))
        }
        Err(word) => word.to_owned(),
    };
    pen.text_until(pen.width().saturating_sub(2), y, &words, Role::Text);
}

/// Two columns of labelled numbers.
fn facts(pen: &mut Pen<'_>, view: &View<'_>) {
    let seen = view.panel;
    let durations = view.history.durations(view.phase());
    let now = seen.stage.moment().map_or(0.0, |m| f64::from(m.step) * view.info.tick_s);
    let best = durations.iter().copied().fold(f64::NAN, f64::max);
    let last = &durations[durations.len().saturating_sub(10)..];
    let longest = last.iter().copied().fold(1.0, f64::max);
    left(pen, 0, "balance", &format!("{} s", fixed(now, 6, 2)), Role::Strong);
    right(pen, 0, "best", &format!("{} s", fixed(best, 6, 2)));
    pen.text(0, 1, "last 10", Role::Dim);
    pen.text(8, 1, &sparkline(last, 10, longest), Role::Text);
    let recent = mean(last).unwrap_or(f64::NAN);
    pen.text_until(30, 1, &format!("mean {}", fixed(recent, 5, 2)), Role::Text);

    let number = |index: usize| seen.state.get(index).copied().unwrap_or(f64::NAN).to_degrees();
    left(pen, 2, "angle", &format!("{}°", signed(number(2), 6, 1)), Role::Text);
    right(pen, 2, "speed", &format!("{} °/s", signed(number(3), 4, 0)));
    let fields = format!("{:>4}/{}", seen.fields, view.info.field_cap);
    left(pen, 3, "fields", &fields, Role::Text);
    right(pen, 3, "learned", &count(seen.learned, 6));
    let tick = view.info.tick_s * 1e3;
    left(pen, 4, "tick", &format!("{} ms", fixed(tick, 5, 0)), Role::Text);
    if seen.lost_rows > 0 {
        right_as(pen, "rows lost", &count(seen.lost_rows, 5));
    } else if seen.missed > 0 {
        right_as(pen, "missed", &count(seen.missed, 6));
    } else {
        right(pen, 4, "late", &format!("{} ms", fixed(seen.lateness.0 * 1e3, 5, 1)));
    }
}

fn left(pen: &mut Pen<'_>, y: u16, label: &str, value: &str, role: Role) {
    pen.text(0, y, label, Role::Dim);
    pen.text_until(15, y, value, role);
}

fn right(pen: &mut Pen<'_>, y: u16, label: &str, value: &str) {
    pen.text(17, y, label, Role::Dim);
    pen.text_until(30, y, value, Role::Text);
}

/// Trouble, in the place of the lateness.
fn right_as(pen: &mut Pen<'_>, label: &str, value: &str) {
    let label = format!("{label} {value}");
    let x = 30_u16.saturating_sub(columns(&label));
    pen.text(x, 4, &label, Role::Alarm);
}
