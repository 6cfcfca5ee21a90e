//! How far a plant has come: five steps in a row.

use super::Page;
use crate::backend::safety::warden::Standing;
use crate::backend::serial::standing::Stage;
use crate::backend::serial::station::Duty;
use crate::tui::palette::Role;
use crate::tui::pen::Pen;

/// Each step, to be done and done.
fn steps(page: &Page<'_>) -> [(&'static str, &'static str); 5] {
    // A calibration holds for days; of its device only homing is missing whenever it starts anew.
    let third = if needs_calibration(page) || !needs_homing(page) { "calibrate" } else { "home" };
    [
        ("connect", "connected"),
        ("greet", "greeted"),
        (third, "calibrated"),
        ("arm", "armed"),
        ("run", "running"),
    ]
}

fn needs_calibration(page: &Page<'_>) -> bool {
    let look = &page.view.look;
    look.calibrated.is_err() || matches!(look.duty, Duty::Calibrate(_))
}

fn needs_homing(page: &Page<'_>) -> bool {
    let look = &page.view.look;
    look.stage == Stage::Homing || page.facts.homing && !look.is_homed
}

/// How many steps are done.
fn done(page: &Page<'_>) -> usize {
    let look = &page.view.look;
    match (&look.stage, look.standing) {
        (Stage::Closed(_), _) => 0,
        (Stage::Opening, _) => 1,
        _ if needs_calibration(page) || needs_homing(page) => 2,
        (_, Standing::Disarmed | Standing::Latched(_)) => 3,
        (_, Standing::Armed) if !page.is_running => 4,
        _ => 5,
    }
}

/// Draws the steps: those that are done with a tick, the next one in brackets.
pub(super) fn draw(pen: &mut Pen<'_>, page: &Page<'_>) {
    let done = done(page);
    let mut x = 0;
    for (index, (todo, past)) in steps(page).into_iter().enumerate() {
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
