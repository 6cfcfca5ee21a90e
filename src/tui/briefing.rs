//! The pages between phases: what comes next, in words, and the break before it.

use super::help;
use super::keys::{Hand, Screen};
use super::live::{View, phase_word, strip};
use super::palette::Role;
use super::pen::Pen;
use super::text::wrapped;
use crate::session::machine::Stage;
use crate::session::{Moment, Phase};

/// The width of a line that reads well.
const MEASURE: u16 = 56;

/// Draws the instruction or the break that `view` is at.
pub fn draw(pen: &mut Pen<'_>, view: &View<'_>) {
    let last = pen.height().saturating_sub(1);
    if !view.ui.subject_view {
        let width = pen.width();
        strip::header(&mut pen.part(0, 0, width, 1), view);
        strip::phases(&mut pen.part(0, 1, width, 1), view);
    }
    match view.panel.stage {
        Stage::Instruction(moment) => instruction(pen, view, moment),
        Stage::Break { next, ticks_left } => rest(pen, view, next, ticks_left),
        _ => {}
    }
    let screen = if view.ui.seat.has_controls() { Screen::Briefing } else { Screen::Watch };
    view.message_or(pen, last, |pen| help::hints(pen, last, screen, Hand::Absent));
}

fn instruction(pen: &mut Pen<'_>, view: &View<'_>, moment: Moment) {
    let top = pen.height() / 4;
    heading(pen, view, top, moment.phase);
    let text = view.info.instruction(moment.phase);
    let width = MEASURE.min(pen.width());
    let left = (pen.width() - width) / 2;
    let mut y = top + 3;
    for line in wrapped(text, usize::from(width)) {
        pen.text(left, y, &line, Role::Text);
        y += 1;
    }
    y += 1;
    if moment.phase.is_steered() {
        for line in wrapped(&view.info.operator, usize::from(width)) {
            pen.text(left, y, &line, Role::Dim);
            y += 1;
        }
    }
    for line in view.trouble_words(usize::from(width)) {
        pen.text(left, y, &line, Role::Alarm);
        y += 1;
    }
    button(pen, view, y + 1, "Enter   begin");
}

fn rest(pen: &mut Pen<'_>, view: &View<'_>, next: Moment, ticks_left: u32) {
    let top = pen.height() / 4;
    pen.centred(top.saturating_sub(1), "next", Role::Dim);
    heading(pen, view, top, next.phase);
    let seconds = (f64::from(ticks_left) * view.info.tick_s).ceil();
    pen.centred(top + 3, "Take a break.", Role::Text);
    let whole = view.info.break_s.max(seconds).max(1.0);
    let mut line = pen.part((pen.width().saturating_sub(44)) / 2, top + 5, 44, 1);
    strip::countdown(&mut line, ("rest", Role::Text), seconds, whole, 0);
    button(pen, view, top + 8, "Enter   go on now");
}

fn heading(pen: &mut Pen<'_>, view: &View<'_>, y: u16, phase: Phase) {
    pen.centred(y, &phase_word(phase).to_uppercase(), Role::Strong);
    let about = match view.info.rollouts(phase) {
        Some(1) => "1 rollout".to_owned(),
        Some(rollouts) => format!("{rollouts} rollouts"),
        None => "until the time is over".to_owned(),
    };
    pen.centred(y + 1, &about, Role::Dim);
}

/// What to press, for whoever may.
fn button(pen: &mut Pen<'_>, view: &View<'_>, y: u16, words: &str) {
    if !view.ui.seat.has_controls() {
        return;
    }
    let width = super::pen::columns(words) + 6;
    let left = pen.width().saturating_sub(width) / 2;
    let mut button = pen.part(left, y, width, 3);
    button.boxed("", Role::Strong).text(1, 0, words, Role::Strong);
}
