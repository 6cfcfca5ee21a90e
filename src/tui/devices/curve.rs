//! A response curve, and where the deflection is on it.

use crate::operator::shaping::Shape;
use crate::tui::canvas::Canvas;
use crate::tui::palette::Role;
use crate::tui::pen::Pen;
use crate::tui::text::signed;

/// Draws the curve of `shape` in a frame, with a dot at the deflection `raw`; below it both
/// numbers, and the shape in words where there is room.
pub fn draw(pen: &mut Pen<'_>, shape: &Shape, raw: Option<f64>) {
    const WORDS: u16 = 4;
    let (width, height) = (pen.width(), pen.height().saturating_sub(WORDS));
    if width < 8 || height < 5 {
        return;
    }
    let mut plot = pen.part(0, 0, width, height);
    let mut inside = frame(&mut plot);
    plotted(&mut inside, shape, raw);
    words(&mut pen.part(0, height, width, WORDS), shape, raw);
}

/// A frame with the names of its sides; a pen for its inside.
fn frame<'a>(pen: &'a mut Pen<'_>) -> Pen<'a> {
    let (width, height) = (pen.width(), pen.height());
    let bar = "─".repeat(usize::from(width.saturating_sub(2)));
    pen.text(0, 0, &format!("┌{bar}┐"), Role::Dim);
    for y in 1..height - 1 {
        pen.text(0, y, "│", Role::Dim);
        pen.text(width - 1, y, "│", Role::Dim);
    }
    pen.text(0, height - 1, &format!("└{bar}┘"), Role::Dim);
    pen.text(2, 0, " action ", Role::Dim);
    pen.text_until(width - 2, height - 1, " deflection ", Role::Dim);
    pen.part(1, 1, width - 2, height - 2)
}

fn plotted(pen: &mut Pen<'_>, shape: &Shape, raw: Option<f64>) {
    let (width, height) = (pen.width(), pen.height());
    pen.repeat(0, height / 2, "·", width, Role::Dim);
    for y in 0..height {
        pen.text(width / 2, y, "·", Role::Dim);
    }
    let mut canvas = Canvas::new(width, height, pen.look.glyphs);
    // A dot's own size keeps it within the frame.
    let reach = ((canvas.width() - 2.0) / 2.0, (canvas.height() - 2.0) / 2.0);
    let middle = (canvas.width() / 2.0, canvas.height() / 2.0);
    let place = |x: f64| (middle.0 + x * reach.0, middle.1 - shape.curve(x) * reach.1);
    let steps = u32::from(width) * 2;
    let points = (0..=steps).map(|n| place(2.0 * f64::from(n) / f64::from(steps) - 1.0));
    let mut before = None;
    for point in points {
        canvas.capsule(before.unwrap_or(point), point, 0.6, Role::Text);
        before = Some(point);
    }
    if let Some(raw) = raw.filter(|raw| raw.is_finite()) {
        let here = place(raw.clamp(-1.0, 1.0));
        canvas.clear(here, here, 2.6);
        canvas.disc(here, 1.9, Role::You);
    }
    canvas.draw(pen);
}

fn words(pen: &mut Pen<'_>, shape: &Shape, raw: Option<f64>) {
    let end = pen.text(0, 0, "raw ", Role::Dim);
    let end = pen.text(end, 0, &raw.map_or("    –".to_owned(), |r| signed(r, 5, 2)), Role::You);
    let end = pen.text(end, 0, "   shaped ", Role::Dim);
    let shaped = raw.map_or("    –".to_owned(), |raw| signed(shape.curve(raw), 5, 2));
    pen.text(end, 0, &shaped, Role::Strong);
    let zones = format!("dead {}  outer {}", shape.dead_zone, shape.outer_zone);
    let bend = format!("exponent {}  sensitivity {}", shape.exponent, shape.sensitivity);
    let sign = if shape.invert { "inverted" } else { "not inverted" };
    let filter = match shape.filter_s {
        0.0 => "no filter".to_owned(),
        filter_s => format!("filter {filter_s} s"),
    };
    for (line, y) in [zones, bend, format!("{sign}, {filter}")].iter().zip(1..) {
        pen.text(0, y, line, Role::Dim);
    }
}
