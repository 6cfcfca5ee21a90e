//! Boxes over the scene while the session stands still: what is the matter, what to press.

use super::View;
use crate::session::machine::{Finish, Stage};
use crate::tui::palette::Role;
use crate::tui::pen::{Pen, columns};

/// The widest line of a box.
const MEASURE: usize = 44;

/// Draws the box that belongs to the stage, if one does.
pub fn draw(pen: &mut Pen<'_>, view: &View<'_>) {
    let (title, role, lines): (_, _, &[&str]) = match view.panel.stage {
        // Whoever only looks on has nothing to press.
        Stage::Paused(_) if !view.ui.seat.has_controls() => ("PAUSED", Role::Strong, &[]),
        Stage::Stopped(_) if !view.ui.seat.has_controls() => ("EMERGENCY STOP", Role::Alarm, &[]),
        Stage::Finished(_) if !view.ui.seat.has_controls() => {
            ("OVER", Role::Strong, &["This session is over."])
        }
        Stage::Paused(moment) if moment.phase.is_steered() && moment.step > 0 => {
            ("PAUSED", Role::Strong, &["P or Enter   go on", "x            discard rollout"])
        }
        Stage::Paused(_) => ("PAUSED", Role::Strong, &["P or Enter   go on"]),
        Stage::Stopped(_) => ("EMERGENCY STOP", Role::Alarm, after_a_stop(view)),
        Stage::Finished(Finish::Complete) => {
            ("COMPLETE", Role::Strong, &["All phases are over.", "Saving; results follow."])
        }
        Stage::Finished(Finish::Aborted) => {
            ("ENDED", Role::Strong, &["The session was ended early.", "Saving; results follow."])
        }
        _ => return,
    };
    draw_box(pen, view, (title, role, lines));
}

/// What goes on after a stop. A real motor was told to, and is armed anew at its own page.
fn after_a_stop(view: &View<'_>) -> &'static [&'static str] {
    match &view.ui.motor {
        None => &["The motor is off.", "Enter   repeat the rollout", "q       end the session"],
        Some(motor) if motor.is_armed => {
            &["The motor is armed again.", "Enter   repeat the rollout", "q       end the session"]
        }
        Some(_) => &[
            "Its page tells whether it is off.",
            "o       open the plant's page; there",
            "x       clears what stopped it, and",
            "m       arms the motor",
            "Enter   then repeats the rollout",
            "q       end the session",
        ],
    }
}

fn draw_box(pen: &mut Pen<'_>, view: &View<'_>, (title, role, lines): (&str, Role, &[&str])) {
    let room = usize::from(pen.width().saturating_sub(8)).min(MEASURE);
    let trouble = view.trouble_words(room);
    let lines: Vec<&str> =
        trouble.iter().map(String::as_str).chain(lines.iter().copied()).collect();
    let widest = lines.iter().map(|line| columns(line)).max().unwrap_or(0);
    let (width, height) =
        (widest.max(columns(title) + 2) + 4, u16::try_from(lines.len()).unwrap_or(0) + 2);
    let x = pen.width().saturating_sub(width) / 2;
    let mut page = pen.part(x, 1, width, height);
    let mut page = page.boxed(title, role);
    for (line, y) in lines.iter().zip(0..) {
        let is_trouble = usize::from(y) < trouble.len();
        page.text(0, y, line, if is_trouble { Role::Alarm } else { Role::Text });
    }
}
