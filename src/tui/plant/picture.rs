//! The plant at a glance: the cart between its limits, the pole's angle, a bar.

use super::Facts;
use crate::signal::State;
use crate::tui::canvas::{Canvas, DOTS_ACROSS, DOTS_DOWN};
use crate::tui::palette::Role;
use crate::tui::pen::Pen;
use crate::tui::text::{fixed, place};

/// The track from end to end, its limits and the cart; below it what the marks mean.
pub(super) fn track(pen: &mut Pen<'_>, facts: &Facts, state: Option<State>) {
    let half_m = facts.half_track_m.unwrap_or(1.1 * facts.hard_limit_m);
    let last = pen.width().saturating_sub(1);
    // A mark is in the cell that its place lies in; the middle one is 0.
    let column = |x_m: f64| {
        let part = (x_m / half_m).clamp(-1.0, 1.0);
        place((f64::midpoint(part, 1.0) * f64::from(last)).round())
    };
    pen.repeat(0, 0, "─", last + 1, Role::Dim);
    pen.text(column(0.0), 0, "┴", Role::Dim);
    for (limit_m, glyph) in [(facts.soft_limit_m, "┊"), (facts.hard_limit_m, "┃")] {
        for side in [-1.0, 1.0] {
            pen.text(column(side * limit_m), 0, glyph, Role::Text);
        }
    }
    if facts.half_track_m.is_some() {
        pen.text(0, 0, "├", Role::Text);
        pen.text(last, 0, "┤", Role::Text);
    }
    let x_m = state.and_then(|state| state.first().copied()).filter(|x| x.is_finite());
    if let Some(x_m) = x_m {
        let role = match x_m.abs() {
            beyond if beyond > facts.hard_limit_m => Role::Wait,
            beyond if beyond > facts.soft_limit_m => Role::Countdown,
            _ => Role::Strong,
        };
        pen.text(column(x_m).saturating_sub(1).min(last.saturating_sub(2)), 0, "███", role);
    }
    let cm = |m: f64| fixed(100.0 * m, 0, 1);
    let marks = format!(
        "┊ ±{} cm: pushes only inward    ┃ ±{} cm: stops",
        cm(facts.soft_limit_m),
        cm(facts.hard_limit_m)
    );
    pen.text(0, 1, &marks, Role::Dim);
    let end = facts.half_track_m.map(|half| format!("ends at ±{} cm", cm(half)));
    pen.text_until(last + 1, 1, end.as_deref().unwrap_or("ends unknown"), Role::Dim);
}

/// The pole as it leans, about the middle of the picture.
pub(super) fn pole(pen: &mut Pen<'_>, state: Option<State>) {
    let mut canvas = Canvas::new(pen.width(), pen.height(), pen.look.glyphs);
    let middle = (canvas.width() / 2.0, canvas.height() / 2.0);
    let length = middle.0.min(middle.1) - 2.0;
    let angle = state.and_then(|state| state.get(2).copied()).filter(|angle| angle.is_finite());
    let Some(angle) = angle else {
        canvas.text(middle.0 / DOTS_ACROSS - 4.0, middle.1 / DOTS_DOWN, "no state", Role::Dim);
        return canvas.draw(pen);
    };
    let tip = (length.mul_add(angle.sin(), middle.0), length.mul_add(-angle.cos(), middle.1));
    canvas.pole(middle, tip, 1.3, Role::Text);
    canvas.disc(tip, 2.2, Role::Text);
    canvas.disc(middle, 1.6, Role::Strong);
    canvas.draw(pen);
}

/// A bar of which `part` is done.
pub(super) fn progress(pen: &mut Pen<'_>, part: f64) {
    let part = part.clamp(0.0, 1.0);
    let percent = format!("{} %", fixed(100.0 * part, 4, 0));
    let width = pen.width().saturating_sub(8);
    let filled = place((part * f64::from(width)).round());
    let x = pen.repeat(0, 0, "█", filled, Role::Countdown);
    pen.repeat(x, 0, "·", width.saturating_sub(x), Role::Dim);
    pen.text_until(pen.width(), 0, &percent, Role::Strong);
}
