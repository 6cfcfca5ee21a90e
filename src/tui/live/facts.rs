//! Labelled numbers at the right below the scene: how the task goes, the state, the learner
//! and the clock.

use super::{Seat, View};
use crate::report::achieved::yardstick;
use crate::report::metrics::rollouts_of;
use crate::signal::End;
use crate::task::mountain_car::MountainCar;
use crate::task::speed_up::SpeedUp;
use crate::task::swing_up::SwingUp;
use crate::tui::palette::Role;
use crate::tui::pen::{Pen, columns};
use crate::tui::scene::Scene;
use crate::tui::text::{count, cut, fixed, mean, signed, sparkline};

/// Draws two columns of numbers into five rows.
pub fn draw(pen: &mut Pen<'_>, view: &View<'_>) {
    match view.info.task.as_str() {
        SwingUp::NAME => swing_up(pen, view),
        SpeedUp::NAME => speed_up(pen, view),
        MountainCar::NAME => mountain_car(pen, view),
        _ => balance(pen, view),
    }
    learner_and_clock(pen, view);
}

fn balance(pen: &mut Pen<'_>, view: &View<'_>) {
    let durations = view.history.durations(view.phase());
    let now = view.panel.stage.moment().map_or(0.0, |m| f64::from(m.step) * view.info.tick_s);
    let best = durations.iter().copied().fold(f64::NAN, f64::max);
    left(pen, 0, "balance", &format!("{} s", fixed(now, 6, 2)), Role::Strong);
    right(pen, 0, "best", &format!("{} s", fixed(best, 6, 2)));
    last_ten(pen, &durations, 1.0, 2);
    left(pen, 2, "angle", &format!("{}°", signed(state(view, 2).to_degrees(), 6, 1)), Role::Text);
    right(pen, 2, "speed", &format!("{} °/s", signed(state(view, 3).to_degrees(), 4, 0)));
}

/// Height now and on average in this rollout, time at the top and the longest hold of it.
fn swing_up(pen: &mut Pen<'_>, view: &View<'_>) {
    let theta = state(view, 2);
    left(pen, 0, "height", &signed(theta.cos(), 6, 2), Role::Strong);
    right(pen, 0, "mean", &signed(tallied(view, 0), 6, 2));
    left(pen, 1, "at the top", &format!("{} %", fixed(100.0 * tallied(view, 1), 0, 0)), Role::Text);
    right(pen, 1, "held", &format!("{} s", fixed(tallied(view, 2), 5, 1)));
    let turn = std::f64::consts::TAU;
    let angle = (theta - turn * (theta / turn).round()).to_degrees();
    left(pen, 2, "angle", &format!("{}°", signed(angle, 6, 0)), Role::Text);
    right(pen, 2, "ω", &format!("{} rad/s", signed(state(view, 3), 5, 1)));
}

/// The ball's speed now and on average in this rollout, and how often it ran over a limit.
fn speed_up(pen: &mut Pen<'_>, view: &View<'_>) {
    left(pen, 0, "speed", &format!("{} m/s", fixed(state(view, 1).abs(), 4, 2)), Role::Strong);
    right(pen, 0, "mean", &format!("{} m/s", fixed(tallied(view, 0), 4, 2)));
    let speeds = measured(view);
    last_ten(pen, &speeds, 0.05, 2);
    left(pen, 2, "ball", &format!("{} cm", signed(100.0 * state(view, 0), 5, 1)), Role::Text);
    let hits = fixed(tallied(view, 1), 0, 0);
    let beam = match view.info.scene {
        Scene::BallBeam(beam) => beam.beam_limit_rad / beam.servo_limit_rad * state(view, 2),
        _ => f64::NAN,
    };
    if tallied(view, 1) > 0.0 {
        right(pen, 2, "ends hit", &hits);
    } else {
        right(pen, 2, "beam", &format!("{}°", signed(beam.to_degrees(), 5, 1)));
    }
}

/// The step of how many, the best rollout so far, the latest ones, and how many of them
/// reached the flag.
fn mountain_car(pen: &mut Pen<'_>, view: &View<'_>) {
    let step = view.panel.stage.moment().map_or(0, |moment| moment.step);
    let steps = measured(view);
    let reached: Vec<f64> = rollouts_of(&view.history.rollouts, view.phase())
        .filter(|row| row.end == End::Goal)
        .map(|row| f64::from(row.steps))
        .collect();
    let best = reached.iter().copied().fold(f64::NAN, f64::min);
    let of = view.longest();
    left(pen, 0, "step", &format!("{}/{of}", count(step.into(), 3)), Role::Strong);
    right(pen, 0, "best", &fixed(best, 5, 0));
    last_ten(pen, &steps, 1.0, 0);
    left(pen, 2, "flags", &format!("{}/{}", reached.len(), steps.len()), Role::Text);
    right(pen, 2, "speed", &signed(state(view, 1), 6, 3));
}

/// The yardstick of the latest ten rollouts, and its mean.
fn last_ten(pen: &mut Pen<'_>, values: &[f64], least: f64, decimals: usize) {
    let last = &values[values.len().saturating_sub(10)..];
    let longest = last.iter().copied().fold(least, f64::max);
    pen.text(0, 1, "last 10", Role::Dim);
    pen.text(8, 1, &sparkline(last, 10, longest), Role::Text);
    let recent = mean(last).unwrap_or(f64::NAN);
    pen.text_until(30, 1, &format!("mean {}", fixed(recent, 5, decimals)), Role::Text);
}

fn learner_and_clock(pen: &mut Pen<'_>, view: &View<'_>) {
    let seen = view.panel;
    let fields = format!("{:>4}/{}", seen.fields, view.info.field_cap);
    left(pen, 3, "fields", &fields, Role::Text);
    // No row tells how many samples the learner took.
    if !matches!(view.ui.seat, Seat::Replay(_)) {
        right(pen, 3, "learned", &count(seen.learned, 6));
    }
    let has_trouble = seen.lost_rows > 0 || seen.missed > 0;
    if !has_trouble && !view.info.device_state.is_empty() && view.phase().is_steered() {
        pen.text(0, 4, &cut(&view.info.device_state, 30), Role::Text);
        return;
    }
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

/// A number of the state.
fn state(view: &View<'_>, index: usize) -> f64 {
    view.panel.state.get(index).copied().unwrap_or(f64::NAN)
}

/// A number that the task counted in the rollout under way.
fn tallied(view: &View<'_>, index: usize) -> f64 {
    view.panel.tallied.get(index).copied().unwrap_or(0.0)
}

/// The yardstick of each rollout of the phase so far.
fn measured(view: &View<'_>) -> Vec<f64> {
    let of = yardstick(&view.info.task).of;
    rollouts_of(&view.history.rollouts, view.phase()).filter_map(of).collect()
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
