//! The map of swing-up's six regions, height of the pole by speed (thesis table 1), and who
//! has the controls in each.

use crate::tui::canvas::{Canvas, DOTS_ACROSS, DOTS_DOWN};
use crate::tui::palette::{Glyphs, Role};
use crate::tui::pen::{Pen, columns};
use crate::tui::text::{cut, fixed, place};

/// The names of the regions in the order of their indices.
pub const NAMES: [&str; 6] =
    ["down slow", "down fast", "middle slow", "middle fast", "top slow", "top fast"];

/// The borders between the regions. Angles are from upright, rad; speeds in rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Borders {
    /// Farther down than this the pole is *down*.
    pub down_rad: f64,
    /// Higher than this a slow pole is at the *top*.
    pub top_slow_rad: f64,
    /// Higher than this a fast pole is at the *top*.
    pub top_fast_rad: f64,
    /// From this speed on a pole that is down is *fast*.
    pub down_fast: f64,
    /// From this speed on a pole in the middle is *fast*.
    pub middle_fast: f64,
    /// From this speed on a pole at the top is *fast*.
    pub top_fast: f64,
    /// The right edge of the map.
    pub fastest: f64,
}

impl Borders {
    /// Where in its region a state is: the part of the way from slow to fast, and of the way
    /// from above to below.
    fn part(&self, region: usize, theta: f64, theta_dot: f64) -> (f64, f64) {
        let (level, is_fast) = (region / 2, region % 2 == 1);
        let fast = [self.down_fast, self.middle_fast, self.top_fast][level.min(2)];
        let (slowest, fastest) = if is_fast { (fast, self.fastest) } else { (0.0, fast) };
        let top = if is_fast { self.top_fast_rad } else { self.top_slow_rad };
        let (high, low) = match level {
            0 => (self.down_rad, std::f64::consts::PI),
            1 => (top, self.down_rad),
            _ => (0.0, top),
        };
        // The angle from upright, whichever way round.
        let angle = theta.cos().acos();
        (within(theta_dot.abs(), slowest, fastest), within(angle, high, low))
    }
}

/// The part of the way from `from` to `to` at `value`; half-way where there is no way.
fn within(value: f64, from: f64, to: f64) -> f64 {
    let part = (value - from) / (to - from);
    if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.5 }
}

/// All that the map shows.
#[derive(Clone, Copy, Debug)]
pub struct Map<'a> {
    /// Where the regions meet.
    pub borders: &'a Borders,
    /// What the regions are called, in the order of their indices: down, middle, top, of each
    /// slow and fast.
    pub names: &'a [&'a str],
    /// The person's share in each; `None` where it is not to be seen.
    pub shares: Option<&'a [f64]>,
    /// The success of each; `None` where there is none or it is not to be seen.
    pub successes: Option<&'a [f64]>,
    /// Whether each is handed over for good; `None` where it is not to be seen.
    pub frozen: Option<&'a [bool]>,
    /// The region of the state.
    pub current: usize,
    /// The pole's angle from upright, rad.
    pub theta: f64,
    /// Its speed, rad/s.
    pub theta_dot: f64,
}

impl Map<'_> {
    fn name(&self, region: usize) -> String {
        self.names.get(region).map_or_else(String::new, |name| name.replace('_', " "))
    }

    fn share(&self, region: usize) -> Option<f64> {
        self.shares.and_then(|shares| shares.get(region)).copied()
    }

    /// Whether the share of `region` no longer moves.
    fn is_frozen(&self, region: usize) -> bool {
        self.frozen.and_then(|frozen| frozen.get(region)).copied().unwrap_or(false)
    }

    fn success(&self, region: usize) -> Option<f64> {
        self.successes.and_then(|successes| successes.get(region)).copied()
    }
}

/// The word for a region that is handed over: its share moves no more.
const FROZEN: &str = "fixed";

/// The smallest map, in cells.
pub const LEAST: (u16, u16) = (19, 8);
/// The list's width at least, in cells, and its rows.
pub const LIST: (u16, u16) = (38, 7);

/// The map; the list below it where there is room for both; where there is no room for the
/// map, the list alone or what fits of it.
pub fn draw(pen: &mut Pen<'_>, seen: &Map<'_>) {
    let (width, height) = (pen.width(), pen.height());
    if width < LEAST.0 || height < LEAST.1 {
        list(pen, seen);
        return;
    }
    if width >= LIST.0 && height >= LIST.1 + 1 + 12 {
        let upper = height - LIST.1 - 1;
        map(&mut pen.part(0, 0, width, upper), seen);
        let taken = Grid::new(width, upper).rows() + 3;
        list(&mut pen.part(0, taken.min(upper + 1), width, LIST.1), seen);
    } else {
        map(pen, seen);
    }
}

/// Rows and columns of the map's cells, without the borders.
#[derive(Clone, Copy)]
struct Grid {
    across: u16,
    down: u16,
}

impl Grid {
    /// As large as `width` × `height` allow, for at least [`LEAST`].
    fn new(width: u16, height: u16) -> Self {
        Self {
            across: (width.saturating_sub(3) / 2).min(18),
            down: (height.saturating_sub(5) / 3).min(4),
        }
    }

    /// The columns of a cell's words; right of them moves the dot.
    const fn words(self) -> u16 {
        match self {
            Self { down: 1, .. } => 6,
            Self { across: ..=10, .. } => 7,
            _ => 8,
        }
    }

    /// The rows of the heads, the cells and their borders.
    const fn rows(self) -> u16 {
        3 * (self.down + 1) + 2
    }

    /// The upper left corner of a region's border.
    fn corner(self, region: usize) -> (u16, u16) {
        let column = if region % 2 == 1 { self.across + 1 } else { 0 };
        let row = [2, 1, 0][(region / 2).min(2)];
        (column, 1 + row * (self.down + 1))
    }
}

/// The six regions as a map: the pole's height upwards, its speed to the right.
pub fn map(pen: &mut Pen<'_>, seen: &Map<'_>) {
    let (width, height) = (pen.width(), pen.height());
    if width < LEAST.0 || height < LEAST.1 {
        return;
    }
    let grid = Grid::new(width, height);
    let whole = 2 * grid.across + 3;
    for (word, column) in [("slow", 1), ("fast", grid.across + 2)] {
        let x = column + grid.across.saturating_sub(columns(word)) / 2;
        pen.text(x, 0, word, Role::Dim);
    }
    lattice(pen, grid);
    for region in 0..6 {
        cell(pen, seen, grid, region);
    }
    if seen.current < 6 {
        here(pen, seen, grid);
    }
    let below = grid.rows();
    if height > below {
        let name = seen.name(seen.current).to_uppercase();
        pen.part(0, below, whole, 1).centred(0, &cut(&name, whole.into()), Role::Strong);
    }
    if height > below + 1 && seen.shares.is_some() {
        pen.part(0, below + 1, whole, 1).centred(0, "you: %   ▒ robot", Role::Dim);
    }
}

/// The lines between the regions.
fn lattice(pen: &mut Pen<'_>, grid: Grid) {
    let bar = "─".repeat(grid.across.into());
    for line in 0..4 {
        let (left, middle, right) = match line {
            0 => ("┌", "┬", "┐"),
            3 => ("└", "┴", "┘"),
            _ => ("├", "┼", "┤"),
        };
        let y = 1 + line * (grid.down + 1);
        pen.text(0, y, &format!("{left}{bar}{middle}{bar}{right}"), Role::Dim);
        for y in (y + 1..=y + grid.down).take_while(|_| line < 3) {
            for x in [0, grid.across + 1, 2 * grid.across + 2] {
                pen.text(x, y, "│", Role::Dim);
            }
        }
    }
}

/// A region: filled from below as the robot takes over, its name, the person's share.
fn cell(pen: &mut Pen<'_>, seen: &Map<'_>, grid: Grid, region: usize) {
    let (x, y) = grid.corner(region);
    let mut part = pen.part(x + 1, y + 1, grid.across, grid.down);
    let is_here = region == seen.current;
    let share = seen.share(region);
    if let Some(share) = share {
        let all = grid.across * grid.down;
        let robot = if share.is_finite() { (1.0 - share).clamp(0.0, 1.0) } else { 0.0 };
        let mut left = place((robot * f64::from(all)).round());
        for row in (0..grid.down).rev() {
            let here = left.min(grid.across);
            part.repeat(0, row, "▒", here, Role::Robot);
            left -= here;
        }
    }
    // The column says slow or fast: the first word is enough, and leaves room for the dot.
    let name = seen.name(region);
    let word = name.split(' ').next().unwrap_or_default();
    let word = if is_here { word.to_uppercase() } else { word.to_owned() };
    let role = if is_here { Role::Strong } else { Role::Text };
    let fixed = if seen.is_frozen(region) { FROZEN } else { "" };
    let words = [word, share.map_or_else(String::new, yours), fixed.to_owned()];
    if grid.down == 1 {
        // One row: the share says more than a name that the eye finds by place.
        let number = share.map(percent);
        part.text(0, 0, &format!(" {} ", number.as_ref().unwrap_or(&words[0]).trim()), role);
        return;
    }
    let first = (grid.down - 2) / 2;
    // What does not fit is what comes last.
    for (word, row) in words.iter().zip(first..grid.down) {
        if !word.is_empty() {
            let width = usize::from(grid.words());
            part.text(0, row, &format!("{:<width$}", cut(word, 7)), role);
        }
    }
}

/// The region of the state: its border doubled, and in it the state as a dot.
fn here(pen: &mut Pen<'_>, seen: &Map<'_>, grid: Grid) {
    let (x, y) = grid.corner(seen.current);
    let bar = "═".repeat(grid.across.into());
    pen.text(x, y, &format!("╔{bar}╗"), Role::Strong);
    pen.text(x, y + grid.down + 1, &format!("╚{bar}╝"), Role::Strong);
    for row in y + 1..=y + grid.down {
        pen.text(x, row, "║", Role::Strong);
        pen.text(x + grid.across + 1, row, "║", Role::Strong);
    }
    if !(seen.theta.is_finite() && seen.theta_dot.is_finite()) {
        return;
    }
    // Right of the words, so that it hides none.
    let words = grid.words();
    let (width, height) = (grid.across.saturating_sub(words), grid.down);
    let mut field = pen.part(x + 1 + words, y + 1, width, height);
    let glyphs = field.look.glyphs;
    let mut canvas = Canvas::new(width, height, glyphs);
    let (right, down) = seen.borders.part(seen.current, seen.theta, seen.theta_dot);
    let radius = 2.0;
    // On the border of dots, where the disc is round.
    let along = |part: f64, dots: f64| (radius + part * (dots - 2.0 * radius).max(0.0)).round();
    let middle = (along(right, canvas.width()), along(down, canvas.height()));
    if glyphs == Glyphs::Ascii {
        canvas.glyph(middle.0 / DOTS_ACROSS, middle.1 / DOTS_DOWN, 'O', Role::Strong);
    } else {
        canvas.disc(middle, radius, Role::Strong);
    }
    // A gap keeps it apart from what fills the region.
    let (from, to) = (place((middle.0 - radius) / DOTS_ACROSS), middle.0 + radius - 1.0);
    let blanks = place(to / DOTS_ACROSS) + 2 - from.saturating_sub(1);
    let rows =
        place((middle.1 - radius) / DOTS_DOWN)..=place((middle.1 + radius - 1.0) / DOTS_DOWN);
    for row in rows {
        field.repeat(from.saturating_sub(1), row, " ", blanks, Role::Text);
    }
    canvas.draw(&mut field);
}

/// A region a row, as in the map from the top down: its name, whose it is, how it goes.
pub fn list(pen: &mut Pen<'_>, seen: &Map<'_>) {
    let (width, height) = (pen.width(), pen.height());
    // Where all would not fit, the region of the state is what matters.
    let order = [4, 5, 2, 3, 0, 1];
    let shown: Vec<usize> = if height >= 6 {
        order.to_vec()
    } else {
        let others = order.into_iter().filter(|region| *region != seen.current);
        std::iter::once(seen.current).chain(others).take(height.into()).collect()
    };
    let has_head = height > 6;
    let bars = Bars::new(width, seen.successes.is_some());
    if has_head && seen.shares.is_some() {
        bars.head(&mut pen.part(0, 0, width, 1), seen);
    }
    for (region, y) in shown.into_iter().zip(u16::from(has_head)..) {
        bars.row(&mut pen.part(0, y, width, 1), seen, region);
    }
}

/// Where the parts of the list's rows begin and end, in columns.
struct Bars {
    share: (u16, u16),
    success: Option<(u16, u16)>,
}

impl Bars {
    /// The name's columns, with the mark before it.
    const NAME: u16 = 14;
    /// A number and a blank.
    const NUMBER: u16 = 6;

    fn new(width: u16, has_success: bool) -> Self {
        let room = width.saturating_sub(Self::NAME);
        if has_success && room >= 2 * (Self::NUMBER + 5) {
            // The share's bar is the longer one.
            let success = Self::NUMBER + (room - 2 * Self::NUMBER) * 2 / 5;
            let middle = width - success;
            Self { share: (Self::NAME, middle - 1), success: Some((middle, width)) }
        } else {
            Self { share: (Self::NAME, width), success: None }
        }
    }

    fn head(&self, pen: &mut Pen<'_>, seen: &Map<'_>) {
        let end = self.share.1.saturating_sub(Self::NUMBER);
        pen.text(self.share.0, 0, "you", Role::You);
        if end.saturating_sub(self.share.0) >= 10 {
            pen.text_until(end, 0, "robot", Role::Robot);
        }
        if let Some((from, _)) = self.success.filter(|_| seen.successes.is_some()) {
            pen.text(from, 0, "success", Role::Go);
        }
    }

    fn row(&self, pen: &mut Pen<'_>, seen: &Map<'_>, region: usize) {
        let is_here = region == seen.current;
        let (mark, role) = if is_here { ("→", Role::Strong) } else { (" ", Role::Text) };
        let name = seen.name(region);
        let name = if is_here { name.to_uppercase() } else { name };
        pen.text(0, 0, mark, Role::Strong);
        pen.text(2, 0, &cut(&name, usize::from(Self::NAME - 3)), role);
        if let Some(share) = seen.share(region) {
            bar(pen, self.share, share, ("█", Role::You), ("▒", Role::Robot), role);
        }
        if let (Some(at), Some(success)) = (self.success, seen.success(region)) {
            bar(pen, at, success, ("■", Role::Go), ("·", Role::Dim), role);
            // Success moves nothing any more: a word in place of its bar.
            if seen.is_frozen(region) {
                let room = at.1.saturating_sub(at.0 + Self::NUMBER);
                pen.repeat(at.0, 0, " ", room, Role::Text);
                pen.text(at.0, 0, &cut(FROZEN, room.into()), Role::Robot);
            }
        }
    }
}

/// A bar of two parts between two columns, and the first part's percent after it.
fn bar(
    pen: &mut Pen<'_>,
    (from, to): (u16, u16),
    part: f64,
    (done, done_role): (&str, Role),
    (rest, rest_role): (&str, Role),
    role: Role,
) {
    let end = to.saturating_sub(Bars::NUMBER);
    let length = end.saturating_sub(from);
    let known = if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.0 };
    let first = place((known * f64::from(length)).round());
    let x = pen.repeat(from, 0, done, first, done_role);
    if end > from {
        pen.repeat(x, 0, rest, length - first, rest_role);
    }
    pen.text_until(to, 0, &percent(part), role);
}

/// A part of 1 in percent, of a fixed width.
fn percent(part: f64) -> String {
    format!("{} %", fixed(part * 100.0, 3, 0))
}

/// The person's share in percent, of the width that is free of the dot.
fn yours(share: f64) -> String {
    format!("you{}", fixed(share * 100.0, 4, 0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::scene::tests::{in_all_glyphs, picture};

    /// Table 1 of the thesis.
    const BORDERS: Borders = Borders {
        down_rad: 120_f64.to_radians(),
        top_slow_rad: 30_f64.to_radians(),
        top_fast_rad: 40_f64.to_radians(),
        down_fast: 8.0,
        middle_fast: 3.0,
        top_fast: 1.0,
        fastest: 20.0,
    };

    fn seen(current: usize, theta: f64, theta_dot: f64) -> Map<'static> {
        Map {
            borders: &BORDERS,
            names: &NAMES,
            shares: Some(&[0.03, 0.05, 0.22, 0.48, 0.74, 1.0]),
            successes: Some(&[0.97, 0.95, 0.74, 0.5, 0.3, 0.1]),
            frozen: None,
            current,
            theta,
            theta_dot,
        }
    }

    #[test]
    fn the_map_at_all_its_sizes() {
        let at = |size, map: Map<'_>| picture(size, Glyphs::Braille, |pen| draw(pen, &map));
        insta::assert_snapshot!("regions_24x11", at((24, 11), seen(2, 1.2, 2.0)));
        insta::assert_snapshot!("regions_24x15", at((24, 15), seen(5, 0.6, -15.0)));
        insta::assert_snapshot!("regions_48x30", at((48, 30), seen(0, 3.1, 1.0)));
        insta::assert_snapshot!("regions_19x8", at((19, 8), seen(3, -1.0, -9.0)));
        insta::assert_snapshot!("regions_70x2", at((70, 2), seen(3, -1.0, -9.0)));
        let glyphs = in_all_glyphs((48, 30), |pen| draw(pen, &seen(3, -1.0, -9.0)));
        insta::assert_snapshot!("regions_glyphs", glyphs);
    }

    #[test]
    fn what_is_hidden_is_not_shown() {
        let frozen = Some(&[true; 6][..]);
        let told = picture((48, 30), Glyphs::Braille, |pen| {
            draw(pen, &Map { frozen, ..seen(4, 0.1, 0.2) });
        });
        assert!(told.matches(FROZEN).count() == 12, "{told}");
        let hidden = Map { shares: None, successes: None, ..seen(4, 0.1, 0.2) };
        let drawn = picture((48, 30), Glyphs::Braille, |pen| draw(pen, &hidden));
        assert!(!drawn.contains('%') && !drawn.contains('▒') && drawn.contains("TOP SLOW"));
    }

    #[test]
    fn the_dot_goes_with_height_and_speed() {
        let part = |region, degrees: f64, speed| BORDERS.part(region, degrees.to_radians(), speed);
        let near = |(x, y): (f64, f64), (a, b): (f64, f64)| {
            assert!((x - a).abs() < 1e-9 && (y - b).abs() < 1e-6, "{x} {y}");
        };
        near(part(0, 180.0, 0.0), (0.0, 1.0));
        near(part(0, -120.0, 4.0), (0.5, 0.0));
        near(part(2, 75.0, -1.5), (0.5, 0.5));
        near(part(3, 400.0, 11.5), (0.5, 0.0));
        near(part(5, 20.0, 99.0), (1.0, 0.5));
    }
}
