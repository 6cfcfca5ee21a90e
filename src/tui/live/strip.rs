//! The two rows above the scene, and the countdown below it.

use super::{View, phase_word};
use crate::session::machine::{Finish, Stage};
use crate::session::plan::PhasePlan;
use crate::tui::palette::Role;
use crate::tui::pen::{Pen, columns};
use crate::tui::text::{cut, fixed, minutes, place};

/// Task, mode, learner, preset; speed; subject and trial.
pub fn header(pen: &mut Pen<'_>, view: &View<'_>) {
    let info = view.info;
    let end = pen.width() - 1;
    let who = format!("{}   trial {:03}", cut(&info.subject, 16), info.trial);
    let mut free = pen.text_until(end, 0, &who, Role::Text);
    let speed = view.panel.speed;
    if speed != 1.0 {
        let words = if speed.is_finite() {
            format!("{}× faster", fixed(speed, 0, 0))
        } else {
            "as fast as it can".to_owned()
        };
        free = pen.text_until(free.saturating_sub(3), 0, &words, Role::Strong);
    }
    let room = usize::from(free.saturating_sub(14));
    let what = [&info.mode, &info.learner, &info.preset].map(String::as_str).join(" · ");
    let x = pen.text(1, 0, "coadapt", Role::Dim);
    let x = pen.text(x + 3, 0, &cut(&info.task, 14), Role::Strong);
    pen.text(
        x,
        0,
        &cut(&format!(" · {what}"), room.saturating_sub(columns(&info.task).into())),
        Role::Text,
    );
}

/// The phases in order; the present one with its progress.
pub fn phases(pen: &mut Pen<'_>, view: &View<'_>) {
    let info = view.info;
    let is_over = matches!(view.panel.stage, Stage::Finished(Finish::Complete));
    let here = info.phases.iter().position(|plan| plan.phase == view.phase()).unwrap_or(0);
    let words: Vec<String> = info
        .phases
        .iter()
        .enumerate()
        .map(|(index, plan)| match phase_word(plan.phase) {
            word if index < here || is_over => format!("{word} ✓"),
            word if index == here => word.to_uppercase(),
            word => word.to_owned(),
        })
        .collect();
    let (part, count) = info.phases.get(here).map_or((0.0, String::new()), |p| progress(view, p));
    let taken: u16 = words.iter().map(|word| columns(word) + 3).sum();
    let bar = pen.width().saturating_sub(taken + columns(&count) + 2).min(36);
    let mut x = 1;
    for (index, word) in words.iter().enumerate() {
        if index == here && !is_over {
            x = pen.text(x, 0, word, Role::Strong) + 1;
            x = meter(pen, x, bar, part) + 1;
            x = pen.text(x, 0, &count, Role::Strong) + 3;
        } else {
            x = pen.text(x, 0, word, Role::Dim) + 3;
        }
    }
}

/// How far the present phase is, as a part of 1 and in digits of a fixed width.
fn progress(view: &View<'_>, plan: &PhasePlan) -> (f64, String) {
    let Some(moment) = view.panel.stage.moment() else { return (1.0, String::new()) };
    let steps = moment.steps_before.saturating_add(u64::from(moment.step));
    if let Some(all) = plan.rollouts {
        let width = all.to_string().len();
        // The rollout under way counts as far as it came: a single long one, too, gets on.
        let under_way = f64::from(moment.step) / f64::from(view.longest().max(1));
        let before = f64::from(moment.rollout.saturating_sub(1));
        let part = (before + under_way) / f64::from(all.max(1));
        return (part, format!("{:>width$}/{all}", moment.rollout));
    }
    let seconds =
        |steps: u64| f64::from(u32::try_from(steps).unwrap_or(u32::MAX)) * view.info.tick_s;
    let (done, all) = (seconds(steps), seconds(plan.steps.unwrap_or(0)));
    let part = if all > 0.0 { done / all } else { 0.0 };
    (part, format!("{}/{}", minutes(done), minutes(all)))
}

/// A bar of `width` cells of which `part` is filled; returns the column after it.
fn meter(pen: &mut Pen<'_>, x: u16, width: u16, part: f64) -> u16 {
    let halves = place((part.clamp(0.0, 1.0) * f64::from(width) * 2.0).round());
    let next = pen.repeat(x, 0, "█", halves / 2, Role::Strong);
    let next = pen.repeat(next, 0, "▌", halves % 2, Role::Strong);
    pen.repeat(next, 0, "·", (x + width).saturating_sub(next), Role::Dim);
    x + width
}

/// A word, a bar that shrinks, and the seconds left, each in its place.
pub fn countdown(
    pen: &mut Pen<'_>,
    (word, role): (&str, Role),
    left_s: f64,
    whole_s: f64,
    decimals: usize,
) {
    let digits = format!("{} s", fixed(left_s, 5, decimals));
    let x = pen.text(0, 0, word, role) + 2;
    let width = pen.width().saturating_sub(x + columns(&digits));
    let part = if whole_s > 0.0 { (left_s / whole_s).clamp(0.0, 1.0) } else { 0.0 };
    let halves = place((part * f64::from(width) * 2.0).round());
    let next = pen.repeat(x, 0, "█", halves / 2, Role::Countdown);
    pen.repeat(next, 0, "▌", halves % 2, Role::Countdown);
    pen.text_until(pen.width(), 0, &digits, Role::Strong);
}
