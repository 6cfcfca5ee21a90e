//! How far a plant has come: five steps in a row.

use super::Page;
use crate::backend::safety::warden::Standing;
use crate::backend::serial::standing::Stage;
use crate::backend::serial::station::Duty;
use crate::tui::palette::Role;
use crate::tui::pen::Pen;

/// Each step, to be done and done.
const STEPS: [(&str, &str); 5] = [
    ("connect", "connected"),
    ("greet", "greeted"),
    ("calibrate", "calibrated"),
    ("arm", "armed"),
    ("run", "running"),
];

/// How many steps are done.
fn done(page: &Page<'_>) -> usize {
    let look = &page.view.look;
    let is_homed = look.is_homed || !page.facts.homing;
    let is_calibrating = matches!(look.duty, Duty::Calibrate(_));
    match (&look.stage, look.standing) {
        (Stage::Closed(_), _) => 0,
        (Stage::Opening, _) => 1,
        (Stage::Homing, _) => 2,
        _ if look.calibrated.is_err() || !is_homed || is_calibrating => 2,
        (_, Standing::Disarmed | Standing::Latched(_)) => 3,
        (_, Standing::Armed) if !page.is_running => 4,
        _ => 5,
    }
}

/// Draws the steps: those that are done with a tick, the next one in brackets.
pub(super) fn draw(pen: &mut Pen<'_>, page: &Page<'_>) {
    let done = done(page);
    let mut x = 0;
    for (index, (todo, past)) in STEPS.into_iter().enumerate() {
        let (words, role) = match index {
            _ if index < done => (format!("{past} ✓"), Role::Go),
            _ if index == done => (format!("[{}]", todo.to_uppercase()), Role::Strong),
            _ => (todo.to_owned(), Role::Dim),
        };
        if index > 0 {
            x = pen.text(x + 1, 0, "→", Role::Dim) + 1;
        }
        x = pen.text(x, 0, &words, role);
    }
}
