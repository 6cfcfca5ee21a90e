//! Filled shapes out of dots, 2×4 to a cell.
//!
//! A cell is about twice as high as wide, so the dots are square and a length is as long in
//! x as in y. A dot is lit when its middle lies inside a shape: edges of thick shapes then
//! move dot by dot, smoothly, and only cells at an edge change from one frame to the next.

use super::palette::{Glyphs, Role};
use super::pen::Pen;
use super::text::place;

/// Dots in a cell, across.
pub const DOTS_ACROSS: f64 = 2.0;
/// Dots in a cell, down.
pub const DOTS_DOWN: f64 = 4.0;

/// A point in dots from the canvas' upper left corner.
pub type Point = (f64, f64);

#[derive(Clone, Copy, Default)]
struct Cell {
    /// Lit dots, a bit each in the order of the braille block.
    lit: u8,
    /// A character in place of dots.
    glyph: Option<char>,
    role: Option<Role>,
}

/// A picture of dots.
pub struct Canvas {
    columns: u16,
    rows: u16,
    glyphs: Glyphs,
    cells: Vec<Cell>,
}

impl Canvas {
    /// An empty canvas of `columns` × `rows` cells.
    #[must_use]
    pub fn new(columns: u16, rows: u16, glyphs: Glyphs) -> Self {
        let count = usize::from(columns) * usize::from(rows);
        Self { columns, rows, glyphs, cells: vec![Cell::default(); count] }
    }

    /// The width in dots.
    #[must_use]
    pub fn width(&self) -> f64 {
        f64::from(self.columns) * DOTS_ACROSS
    }

    /// The height in dots.
    #[must_use]
    pub fn height(&self) -> f64 {
        f64::from(self.rows) * DOTS_DOWN
    }

    /// Lights the dots between two corners whose middles are `inside`.
    pub fn fill(&mut self, from: Point, to: Point, role: Role, inside: impl Fn(Point) -> bool) {
        self.visit(from, to, inside, |cell, bit| {
            cell.lit |= bit;
            cell.role = Some(role);
        });
    }

    /// Calls `change` for the dots between two corners whose middles are `inside`.
    fn visit(
        &mut self,
        from: Point,
        to: Point,
        inside: impl Fn(Point) -> bool,
        change: impl Fn(&mut Cell, u8),
    ) {
        if !(from.0 + from.1 + to.0 + to.1).is_finite() {
            return;
        }
        let right = place(to.0.ceil().min(self.width()));
        let bottom = place(to.1.ceil().min(self.height()));
        for y in place(from.1.floor())..bottom {
            for x in place(from.0.floor())..right {
                if inside((f64::from(x) + 0.5, f64::from(y) + 0.5))
                    && let Some((cell, bit)) = self.dot(x, y)
                {
                    change(cell, bit);
                }
            }
        }
    }

    /// The cell that a dot lies in, and the dot's bit there.
    fn dot(&mut self, x: u16, y: u16) -> Option<(&mut Cell, u8)> {
        const BITS: [[u8; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];
        let index = usize::from(y / 4) * usize::from(self.columns) + usize::from(x / 2);
        let bit = BITS[usize::from(x % 2)][usize::from(y % 4)];
        self.cells.get_mut(index).map(|cell| (cell, bit))
    }

    /// A filled rectangle.
    pub fn rectangle(&mut self, from: Point, to: Point, role: Role) {
        self.fill(from, to, role, |p| p.0 >= from.0 && p.0 < to.0 && p.1 >= from.1 && p.1 < to.1);
    }

    /// A filled disc; where there are no dots a small one is a pair of letters.
    pub fn disc(&mut self, middle: Point, radius: f64, role: Role) {
        if self.glyphs == Glyphs::Ascii && radius < 3.0 {
            let (column, row) = in_cells(middle);
            self.glyph(column - 0.5, row, 'O', role);
            self.glyph(column + 0.5, row, 'O', role);
            return;
        }
        self.capsule(middle, middle, radius, role);
    }

    /// A small round dot, such as one of a trail; where there are no dots a full stop.
    pub fn mote(&mut self, middle: Point, radius: f64, role: Role) {
        if self.glyphs == Glyphs::Ascii {
            let (column, row) = in_cells(middle);
            self.glyph(column, row, '.', role);
            return;
        }
        self.capsule(middle, middle, radius, role);
    }

    /// Puts out the dots at most `radius` away from a segment, so that what is drawn there
    /// next stands in front of what was there before.
    pub fn clear(&mut self, from: Point, to: Point, radius: f64) {
        let (low, high) = around(from, to, radius);
        let inside = |p| distance(p, from, to) <= radius;
        self.visit(low, high, inside, |cell, bit| cell.lit &= !bit);
    }

    /// A thick line with round ends: all that is at most `radius` away from a segment.
    pub fn capsule(&mut self, from: Point, to: Point, radius: f64, role: Role) {
        let (low, high) = around(from, to, radius);
        self.fill(low, high, role, |p| distance(p, from, to) <= radius);
    }

    /// A pole: a capsule, or where there are no dots a line of the characters that lean
    /// most alike.
    pub fn pole(&mut self, from: Point, to: Point, radius: f64, role: Role) {
        if self.glyphs != Glyphs::Ascii {
            self.capsule(from, to, radius, role);
            return;
        }
        let (a, b) = (in_cells(from), in_cells(to));
        let (across, down) = (b.0 - a.0, b.1 - a.1);
        if !(across.is_finite() && down.is_finite()) {
            return;
        }
        let lean = across / down;
        if lean.abs() > 2.5 || down == 0.0 {
            let (low, high) = (a.0.min(b.0).max(0.0), a.0.max(b.0).min(f64::from(self.columns)));
            for column in place(low.floor())..place(high.ceil()) {
                let middle = (f64::from(column) + 0.5).clamp(a.0.min(b.0), a.0.max(b.0));
                let row = if across == 0.0 { a.1 } else { a.1 + (middle - a.0) / lean };
                self.glyph(middle, row, '-', role);
            }
            return;
        }
        let glyph = match lean {
            _ if lean > 0.35 => '\\',
            _ if lean < -0.35 => '/',
            _ => '|',
        };
        let (low, high) = (a.1.min(b.1).max(0.0), a.1.max(b.1).min(f64::from(self.rows)));
        for row in place(low.floor())..place(high.ceil()) {
            let middle = (f64::from(row) + 0.5).clamp(a.1.min(b.1), a.1.max(b.1));
            let column = a.0 + (middle - a.1) * lean;
            // Two characters wide where one would be too thin: left and right of the middle.
            if radius > 1.0 {
                self.glyph(column - 0.5, middle, glyph, role);
                self.glyph(column + 0.5, middle, glyph, role);
            } else {
                self.glyph(column, middle, glyph, role);
            }
        }
    }

    /// One character in the cell at (`column`, `row`).
    pub fn glyph(&mut self, column: f64, row: f64, glyph: char, role: Role) {
        if column >= 0.0 && row >= 0.0 && column < f64::from(self.columns) {
            let index =
                usize::from(place(row)) * usize::from(self.columns) + usize::from(place(column));
            if let Some(cell) = self.cells.get_mut(index) {
                *cell = Cell { lit: 0, glyph: Some(glyph), role: Some(role) };
            }
        }
    }

    /// Text from the cell at (`column`, `row`) on.
    pub fn text(&mut self, column: f64, row: f64, text: &str, role: Role) {
        for (glyph, offset) in text.chars().zip(0_u16..) {
            self.glyph(column.floor() + f64::from(offset), row, glyph, role);
        }
    }

    /// Puts the picture on the screen; cells without dots stay as they are.
    pub fn draw(&self, pen: &mut Pen<'_>) {
        for (cell, index) in self.cells.iter().zip(0_u32..) {
            let Some(role) = cell.role else { continue };
            if cell.lit == 0 && cell.glyph.is_none() {
                continue;
            }
            let glyph = cell.glyph.unwrap_or_else(|| self.shown(cell.lit));
            let columns = u32::from(self.columns);
            let at = |place: u32| u16::try_from(place).unwrap_or(u16::MAX);
            pen.text(
                at(index % columns),
                at(index / columns),
                glyph.encode_utf8(&mut [0; 4]),
                role,
            );
        }
    }

    fn shown(&self, lit: u8) -> char {
        const QUARTERS: [char; 16] =
            [' ', '▘', '▝', '▀', '▖', '▌', '▞', '▛', '▗', '▚', '▐', '▜', '▄', '▙', '▟', '█'];
        const UPPER: u8 = 0x01 | 0x02 | 0x08 | 0x10;
        match self.glyphs {
            Glyphs::Braille => char::from_u32(0x2800 + u32::from(lit)).unwrap_or('#'),
            Glyphs::Half => {
                let quarters = [0x03, 0x18, 0x44, 0xa0];
                let index: usize = quarters
                    .iter()
                    .enumerate()
                    .filter(|(_, dots)| lit & **dots != 0)
                    .map(|(bit, _)| 1 << bit)
                    .sum();
                QUARTERS[index]
            }
            Glyphs::Ascii => match (lit & UPPER != 0, lit & !UPPER != 0) {
                _ if lit.count_ones() >= 4 && lit & UPPER != lit => '#',
                (true, true) => '+',
                (true, false) => '-',
                (false, _) => '_',
            },
        }
    }
}

/// The corners of the rectangle around all that is at most `radius` away from a segment.
fn around(from: Point, to: Point, radius: f64) -> (Point, Point) {
    (
        (from.0.min(to.0) - radius, from.1.min(to.1) - radius),
        (from.0.max(to.0) + radius, from.1.max(to.1) + radius),
    )
}

/// A point in dots as columns and rows.
fn in_cells(point: Point) -> Point {
    (point.0 / DOTS_ACROSS, point.1 / DOTS_DOWN)
}

/// The distance of `p` from the segment between `a` and `b`.
fn distance(p: Point, a: Point, b: Point) -> f64 {
    let (along, to_p) = ((b.0 - a.0, b.1 - a.1), (p.0 - a.0, p.1 - a.1));
    let length2 = along.0 * along.0 + along.1 * along.1;
    let part = if length2 > 0.0 {
        ((to_p.0 * along.0 + to_p.1 * along.1) / length2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (to_p.0 - part * along.0).hypot(to_p.1 - part * along.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lit(canvas: &Canvas) -> u32 {
        canvas.cells.iter().map(|cell| cell.lit.count_ones()).sum()
    }

    #[test]
    fn a_capsule_has_its_area_wherever_it_lies() {
        for tenth in 0..10_u8 {
            let mut canvas = Canvas::new(40, 20, Glyphs::Braille);
            let x = 30.0 + f64::from(tenth) / 10.0;
            canvas.capsule((x, 60.0), (x + 10.0, 10.0), 2.0, Role::Text);
            let area = 4.0 * 50.99 + std::f64::consts::PI * 4.0;
            assert!((f64::from(lit(&canvas)) - area).abs() < 0.06 * area, "{}", lit(&canvas));
        }
    }

    #[test]
    fn what_is_cleared_is_dark_and_the_rest_stays() {
        let mut canvas = Canvas::new(10, 5, Glyphs::Braille);
        canvas.rectangle((0.0, 0.0), (20.0, 20.0), Role::Text);
        canvas.clear((10.0, 10.0), (10.0, 10.0), 2.0);
        assert_eq!(lit(&canvas), 400 - 12);
        canvas.clear((-50.0, f64::NAN), (1e300, 3.0), 9.0);
        canvas.clear((0.0, 10.0), (20.0, 10.0), 99.0);
        assert_eq!(lit(&canvas), 0);
    }

    #[test]
    fn shapes_outside_or_without_place_light_nothing() {
        for glyphs in [Glyphs::Braille, Glyphs::Half, Glyphs::Ascii] {
            let mut canvas = Canvas::new(10, 5, glyphs);
            for bad in [f64::NAN, f64::INFINITY, 1e300, -1e300] {
                canvas.pole((bad, 1.0), (bad, 2.0), 2.0, Role::Text);
                canvas.disc((bad, bad), 3.0, Role::Text);
                canvas.text(bad, 0.0, "x", Role::Text);
            }
            assert!(canvas.cells.iter().all(|cell| cell.role.is_none()));
        }
    }

    #[test]
    fn dots_become_the_terminals_glyphs() {
        for (glyphs, whole, upper) in
            [(Glyphs::Braille, '⣿', '⠛'), (Glyphs::Half, '█', '▀'), (Glyphs::Ascii, '#', '-')]
        {
            let mut canvas = Canvas::new(2, 1, glyphs);
            canvas.rectangle((0.0, 0.0), (2.0, 4.0), Role::Text);
            canvas.rectangle((2.0, 0.0), (4.0, 2.0), Role::Text);
            assert_eq!(canvas.shown(canvas.cells[0].lit), whole);
            assert_eq!(canvas.shown(canvas.cells[1].lit), upper);
        }
    }
}
