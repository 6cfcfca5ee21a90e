//! Pictures of the square [−1, 1]² as text: shaded maps and outlines. x₁ grows to the right
//! and x₂ upwards; a letter is about twice as high as wide.

use std::f64::consts::TAU;

/// The ink of a map, from the smallest value to the largest.
const INK: [char; 10] = [' ', '.', ':', '-', '=', '+', '*', '#', '%', '@'];
/// A map's letters.
const MAP: (u32, u32) = (38, 19);
/// The outlines' letters,
const LETTERS: (usize, usize) = (76, 38);
/// and the dots of one, as Braille has them.
const DOTS: (usize, usize) = (2, 4);

/// A function of the square and what it is called.
pub type Named<'a> = (&'a str, &'a dyn Fn([f64; 2]) -> f64);

/// Functions of the square, each under its name, side by side from 0 (blank) to 1.25 (@).
pub fn maps(functions: &[Named<'_>]) -> String {
    let width = MAP.0 as usize;
    let names: Vec<_> = functions.iter().map(|(name, _)| format!(" {name:<width$} ")).collect();
    let mut text = names.concat().trim_end().to_owned() + "\n";
    for row in 0..MAP.1 {
        let mut line = String::new();
        for (_, shade) in functions {
            let x = |column| [centre(column, MAP.0), -centre(row, MAP.1)];
            line.push(' ');
            line.extend((0..MAP.0).map(|column| ink(shade(x(column)))));
            line.push(' ');
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

/// The middle of cell `at` of `count` that share [−1, 1].
fn centre(at: u32, count: u32) -> f64 {
    (2.0 * f64::from(at) + 1.0) / f64::from(count) - 1.0
}

fn ink(value: f64) -> char {
    let share = value / 1.25;
    let above = (1..10_u8).filter(|&step| share * 10.0 >= f64::from(step)).count();
    INK[above]
}

/// Where a field's activation has one value.
pub struct Ellipse {
    centre: [f64; 2],
    /// L⁻ᵀ of D = L Lᵀ, times the radius: what turns the unit circle into the outline.
    stretch: [[f64; 2]; 2],
}

impl Ellipse {
    /// The outline of the Gaussian field at `centre` with the metric D, given as its diagonal
    /// or by rows, where its activation is `w`.
    pub fn new(centre: impl AsRef<[f64]>, d: impl AsRef<[f64]>, w: f64) -> Self {
        let (centre, d) = (centre.as_ref(), d.as_ref());
        let (a, b, c) = if d.len() == 2 { (d[0], 0.0, d[1]) } else { (d[0], d[1], d[3]) };
        let radius = (-2.0 * w.ln()).sqrt();
        let l = a.sqrt();
        let across = b / l;
        let rest = (c - across * across).max(f64::MIN_POSITIVE).sqrt();
        let stretch = [[radius / l, -radius * across / (l * rest)], [0.0, radius / rest]];
        Self { centre: [centre[0], centre[1]], stretch }
    }

    /// Its point at `angle`.
    fn at(&self, angle: f64) -> [f64; 2] {
        let (y, x) = angle.sin_cos();
        let [[a, b], [_, c]] = self.stretch;
        [self.centre[0] + a * x + b * y, self.centre[1] + c * y]
    }
}

/// A sheet for outlines.
pub struct Canvas {
    /// Row by row, the dots of every letter as bits, in Braille's order.
    letters: Vec<u8>,
    /// Which letters hold a centre.
    centres: Vec<bool>,
}

impl Canvas {
    /// An empty one.
    pub fn new() -> Self {
        let count = LETTERS.0 * LETTERS.1;
        Self { letters: vec![0; count], centres: vec![false; count] }
    }

    /// Draws an outline and its centre.
    pub fn draw(&mut self, ellipse: &Ellipse) {
        const POINTS: u32 = 1200;
        for point in 0..POINTS {
            let angle = f64::from(point) / f64::from(POINTS) * TAU;
            if let Some((letter, bit)) = place(ellipse.at(angle)) {
                self.letters[letter] |= bit;
            }
        }
        if let Some((letter, _)) = place(ellipse.centre) {
            self.centres[letter] = true;
        }
    }

    /// As dots, eight to a letter; centres are `o`.
    pub fn dotted(&self) -> String {
        self.text(|dots| char::from_u32(0x2800 + u32::from(dots)).unwrap_or(' '))
    }

    /// As plain letters; centres are `o`.
    pub fn plain(&self) -> String {
        self.text(|dots| match dots.count_ones() {
            1 => '.',
            2..=3 => ':',
            _ => '#',
        })
    }

    fn text(&self, letter: impl Fn(u8) -> char) -> String {
        let rows = self.letters.chunks(LETTERS.0).zip(self.centres.chunks(LETTERS.0));
        let edge = format!(" +{}+", "-".repeat(LETTERS.0));
        let mut text = edge.clone();
        for (dots, centres) in rows {
            text.push_str("\n |");
            text.extend(dots.iter().zip(centres).map(|(&dots, &centre)| match (dots, centre) {
                (_, true) => 'o',
                (0, false) => ' ',
                _ => letter(dots),
            }));
            text.push('|');
        }
        text + "\n" + &edge
    }
}

/// The letter and dot at a point of the square.
fn place([x, y]: [f64; 2]) -> Option<(usize, u8)> {
    let column = dot(x, LETTERS.0 * DOTS.0)?;
    let row = dot(-y, LETTERS.1 * DOTS.1)?;
    let letter = row / DOTS.1 * LETTERS.0 + column / DOTS.0;
    let bit = match (column % DOTS.0, row % DOTS.1) {
        (0, 3) => 6,
        (_, 3) => 7,
        (0, row) => row,
        (_, row) => row + 3,
    };
    Some((letter, 1 << bit))
}

/// Which of `count` dots along [−1, 1] the coordinate falls on.
fn dot(at: f64, count: usize) -> Option<usize> {
    if !(-1.0..=1.0).contains(&at) {
        return None;
    }
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "some hundred dots, and the coordinate lies on them"
    )]
    let dot = (f64::midpoint(at, 1.0) * count as f64) as usize;
    Some(dot.min(count - 1))
}
