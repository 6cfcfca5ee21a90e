//! What a replay has beside the session's screen: a line of time, and the three actions as curves.

use super::Seat;
use crate::tui::canvas::Canvas;
use crate::tui::palette::Role;
use crate::tui::pen::{Pen, columns};
use crate::tui::text::{fixed, minutes, place, real};

/// Columns before a curve, for its name: those of the bars below the scene.
const NAMES: u16 = 9;
/// The least rows of a curve, and the most.
const LEAST: u16 = 2;
const MOST: u16 = 5;

/// Where a recording stands, as far as it is drawn.
#[derive(Clone, Debug, Default)]
pub struct Film {
    /// Whether time passes.
    pub is_playing: bool,
    /// How many times faster than the wall.
    pub speed: f64,
    /// The controlled time so far, s,
    pub position_s: f64,
    /// and of the whole recording.
    pub length_s: f64,
    /// Where phases begin, as parts of the whole.
    pub borders: Vec<f64>,
    /// The curves that are shown, from above.
    pub lanes: Vec<Lane>,
    /// The rows that a curve has room for.
    pub window: usize,
    /// How the rollout ended, at its last state.
    pub end: Option<String>,
    /// The number of a rollout that is being typed.
    pub typed: String,
}

/// One action over the latest time.
#[derive(Clone, Debug)]
pub struct Lane {
    /// Whose.
    pub label: &'static str,
    /// Its colour's role.
    pub role: Role,
    /// Row by row up to now; `None` where there was none.
    pub values: Vec<Option<f64>>,
}

/// The rows that the curves take of `rows` above the scene.
pub fn height(seat: &Seat, rows: u16) -> u16 {
    let Seat::Replay(film) = seat else { return 0 };
    lane_height(rows) * u16::try_from(film.lanes.len()).unwrap_or(0)
}

/// Half of the room is the scene's, whatever curves are shown.
fn lane_height(rows: u16) -> u16 {
    (rows / 6).clamp(LEAST, MOST)
}

/// Draws the curves between ± `limit`, one below the other.
pub fn lanes(pen: &mut Pen<'_>, seat: &Seat, limit: f64, unit: &str) {
    let Seat::Replay(film) = seat else { return };
    let count = u16::try_from(film.lanes.len()).unwrap_or(0).max(1);
    let (width, height) = (pen.width(), pen.height() / count);
    for (shown, index) in film.lanes.iter().zip(0..) {
        let mut part = pen.part(0, index * height, width, height);
        part.text(1, 0, shown.label, shown.role);
        let scale = format!("±{} {unit}", fixed(limit, 0, 0));
        part.text(1, 1, scale.trim_end(), Role::Dim);
        curve(
            &mut part.part(NAMES, 0, width.saturating_sub(NAMES + 2), height),
            shown,
            film,
            limit,
        );
    }
}

fn curve(pen: &mut Pen<'_>, lane: &Lane, film: &Film, limit: f64) {
    let mut canvas = Canvas::new(pen.width(), pen.height(), pen.look.glyphs);
    let (right, bottom) = (canvas.width(), canvas.height());
    // A dot has room above and below the limits.
    let y_of = |value: f64| (bottom - 1.0) / 2.0 * (1.0 - (value / limit).clamp(-1.0, 1.0));
    let (mut dot, zero) = (0.0, y_of(0.0).floor());
    while dot < right {
        canvas.rectangle((dot, zero), (dot + 1.0, zero + 1.0), Role::Dim);
        dot += 4.0;
    }
    let step = right / real(film.window.max(1));
    let mut before: Option<f64> = None;
    for (value, at) in lane.values.iter().zip(0_u32..) {
        let Some(y) = value.filter(|value| value.is_finite()).map(y_of) else {
            before = None;
            continue;
        };
        let x = f64::from(at) * step;
        let (top, low) = before.map_or((y, y), |before| (y.min(before), y.max(before)));
        canvas.rectangle(
            (x.floor(), top.floor()),
            ((x + step).ceil(), low.floor() + 1.0),
            lane.role,
        );
        before = Some(y);
    }
    canvas.draw(pen);
}

/// The line of time: whether it plays, how fast, where.
pub fn timeline(pen: &mut Pen<'_>, film: &Film) {
    let word = if film.is_playing { ("PLAY ", Role::Go) } else { ("PAUSE", Role::Strong) };
    let x = pen.text(1, 0, word.0, word.1);
    let decimals = usize::from(film.speed < 1.0);
    let x = pen.text(x + 1, 0, &format!("{}×", fixed(film.speed, 3, decimals)), Role::Text) + 1;
    let times = format!("{}/{}", minutes(film.position_s), minutes(film.length_s));
    let end = pen.width().saturating_sub(columns(&times) + 2);
    pen.text(end + 1, 0, &times, Role::Text);
    let room = end.saturating_sub(x);
    let at =
        |part: f64| x + place((part.clamp(0.0, 1.0) * f64::from(room.saturating_sub(1))).round());
    let part = if film.length_s > 0.0 { film.position_s / film.length_s } else { 0.0 };
    let head = at(part);
    let rest = pen.repeat(x, 0, "━", head - x, Role::Text);
    pen.repeat(rest, 0, "─", (x + room).saturating_sub(rest), Role::Dim);
    for border in &film.borders {
        pen.text(at(*border), 0, "┬", Role::Dim);
    }
    pen.text(head, 0, "█", Role::Strong);
}
