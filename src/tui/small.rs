//! A terminal too small for the screens: it says so, and that control is safe.

use super::live::View;
use super::palette::Role;
use super::pen::Pen;
use super::text::{fixed, signed};

/// The least width of a screen.
pub const LEAST_WIDTH: u16 = 80;
/// The least height of a screen.
pub const LEAST_HEIGHT: u16 = 24;

/// Whether the pen's rectangle is too small for a screen.
#[must_use]
pub const fn is_too_small(pen: &Pen<'_>) -> bool {
    pen.width() < LEAST_WIDTH || pen.height() < LEAST_HEIGHT
}

/// Says how much room is needed; during a session also the little that fits.
pub fn draw(pen: &mut Pen<'_>, view: Option<&View<'_>>) {
    let (width, height) = (pen.width(), pen.height());
    let size = format!("coadapt needs {LEAST_WIDTH}×{LEAST_HEIGHT}, this is {width}×{height}");
    let mut lines = vec![(size, Role::Strong)];
    if let Some(view) = view {
        let snapshot = view.panel;
        let has_controls = view.ui.seat.has_controls();
        if has_controls {
            lines.push(("control goes on and is safe".to_owned(), Role::Text));
        }
        lines.push((view.stage_words(), Role::Text));
        if let Some(angle) = snapshot.state.get(2) {
            lines.push((format!("pole {}°", signed(angle.to_degrees(), 6, 1)), Role::Text));
        }
        if view.ui.show_progress {
            let share = fixed(view.share() * 100.0, 3, 0);
            lines.push((format!("your share {share} %"), Role::You));
        }
        let keys = if has_controls { "space stop   q end" } else { "q quit" };
        lines.push((keys.to_owned(), Role::Dim));
    }
    let shown = u16::try_from(lines.len()).unwrap_or(u16::MAX).min(height);
    let top = (height - shown) / 2;
    for ((line, role), row) in lines.iter().zip(0..shown) {
        pen.centred(top + row, line, *role);
    }
}
