//! The map of the regions beside the scene, where a task has it.

use super::{Info, View};
use crate::control::snapshot::MOST_REGIONS;
use crate::session::Phase;
use crate::tui::pen::Pen;
use crate::tui::scene::regions::{self, Map};

/// The map's columns on a screen of `width`, with a gap before it: 0 where there is none.
pub fn width(info: &Info, width: u16) -> u16 {
    match info.regions {
        None => 0,
        Some(_) if width >= 112 => 48,
        Some(_) => 28,
    }
}

/// Draws the map; the dot from what moves, the shares from what is read.
pub fn draw(pen: &mut Pen<'_>, view: &View<'_>) {
    let Some(borders) = &view.info.regions else { return };
    let phase = view.phase();
    let shares = match phase {
        Phase::Introduction => [1.0; MOST_REGIONS],
        Phase::Main => view.panel.shares,
        Phase::Autonomous | Phase::ZeroControl => [0.0; MOST_REGIONS],
    };
    let is_shown = view.ui.show_progress && phase != Phase::ZeroControl;
    let at = |index: usize| view.scene.state.get(index).copied().unwrap_or(f64::NAN);
    let seen = Map {
        borders,
        names: &regions::NAMES,
        shares: is_shown.then_some(&shares[..]),
        successes: (is_shown && phase == Phase::Main).then_some(&view.panel.successes[..]),
        frozen: (is_shown && phase == Phase::Main).then_some(&view.panel.frozen[..]),
        current: view.scene.region,
        theta: at(2),
        theta_dot: at(3),
    };
    let (width, height) = (pen.width(), pen.height());
    regions::draw(&mut pen.part(1, 0, width.saturating_sub(1), height), &seen);
}
