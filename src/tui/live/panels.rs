//! The numbers below the scene: who has the controls on the left, how it goes on the right.

use super::{View, facts};
use crate::session::Phase;
use crate::session::machine::Stage;
use crate::tui::palette::Role;
use crate::tui::pen::Pen;
use crate::tui::text::{fixed, place, signed, sparkline};

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
    facts::draw(&mut pen.part(left, 0, RIGHT, height), view);
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

/// Success over the session, its value, and where the gate is; of several regions a bar for
/// each.
fn success(pen: &mut Pen<'_>, view: &View<'_>) {
    let now = view.panel.successes.get(view.panel.region).copied().unwrap_or(0.0);
    let is_wide = pen.width() >= 80;
    let end = pen.width().saturating_sub(if is_wide { 37 } else { 19 });
    let spark = end.saturating_sub(VALUES + 7);
    pen.text(1, 0, "success", Role::Text);
    if view.info.regions.is_some() {
        regions(pen, view);
    } else {
        let bars = sparkline(&view.history.success, spark.into(), 1.0);
        pen.text(VALUES, 0, &bars, Role::Text);
    }
    pen.text(VALUES + spark, 0, &format!("{} %", fixed(now * 100.0, 4, 0)), Role::Strong);
    if view.info.robot_watches {
        return;
    }
    let (words, role) = gate(view, is_wide);
    pen.text(end, 0, &words, role);
}

/// The success of each region, a bar of one cell, slow beside fast: top, middle, down.
fn regions(pen: &mut Pen<'_>, view: &View<'_>) {
    let successes = &view.panel.successes;
    let mut x = VALUES;
    for (word, first) in [("T", 4), ("M", 2), ("D", 0)] {
        let pair = successes.get(first..first + 2).unwrap_or_default();
        x = pen.text(x, 0, word, Role::Dim);
        x = pen.text(x, 0, &sparkline(pair, 2, 1.0), Role::Text) + 1;
    }
}

/// Whether the robot may take over here, in words.
fn gate(view: &View<'_>, is_wide: bool) -> (String, Role) {
    let region = view.panel.region;
    if view.panel.frozen.get(region).copied().unwrap_or(false) {
        return ("handed over".to_owned(), Role::Robot);
    }
    if view.info.gate <= 0.0 {
        return (String::new(), Role::Dim);
    }
    let Some(opened) = view.panel.gate else {
        let gate = fixed(view.info.gate * 100.0, 0, 0);
        return (format!("gate {gate} %: not yet"), Role::Dim);
    };
    let tau = fixed(opened.tau, 0, 0);
    let at = opened.step;
    let words = match (is_wide, view.info.by_episode) {
        (true, true) => format!("open at episode {at}, τ {tau} episodes"),
        (true, false) => format!("gate opened at step {at}, τ {tau}"),
        (false, true) => format!("open ep {at}, τ {tau}"),
        (false, false) => format!("open {at}, τ {tau}"),
    };
    (words, Role::Robot)
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
            let decimals = if view.info.action_limit > 5.0 { 1 } else { 2 };
            format!("{} {unit}", signed(value, 6, decimals)).trim_end().to_owned()
        }
        Err(word) => word.to_owned(),
    };
    pen.text_until(pen.width().saturating_sub(2), y, &words, Role::Text);
}
