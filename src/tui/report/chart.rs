//! A figure in the cells of a terminal.

use ratatui::style::Style;
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis as ChartAxis, Chart, Dataset, GraphType, Widget};

use super::heading;
use crate::report::figure::{Axis, Cells, Content, Figure, Mark, Role as Meaning, Series};
use crate::report::text::{short, span};
use crate::tui::palette::{Glyphs, Role};
use crate::tui::pen::{Pen, columns};
use crate::tui::text::{cut, wrapped};

/// Above so many points of a series its spread would hide all else.
const MOST_BARS: usize = 12;
/// Points of a line from one sign of whose it is to the next.
const SIGN_EVERY: usize = 20;
/// What stands for the things of a kind, and beyond them letters.
const SIGNS: [char; 6] = ['o', '^', 'x', '+', '*', '#'];
const LETTERS: &[u8; 24] = b"abcdefghijklmnpqrstuvwyz";
/// Lines of a legend.
const MOST_LINES: usize = 4;
/// What stands for a mean with its spread.
const MEAN: char = '@';

/// Draws `figure` with heading, legend and sentence.
pub(super) fn draw(pen: &mut Pen<'_>, figure: &Figure) {
    let (width, height) = (pen.width(), pen.height());
    pen.text(0, 0, &heading(&figure.caption), Role::Strong);
    let axes = format!("   ↑ {}   → {}", figure.y.title(), figure.x.title());
    let after = pen.text(0, 1, &figure.caption.preset, Role::Dim);
    pen.text(after, 1, &axes, Role::Dim);
    let mut sentence = figure.caption.sentence.clone();
    if hides_spread(figure) {
        sentence.push_str(" The spread is left out here: it is in the file.");
    }
    let sentence = wrapped(&sentence, usize::from(width));
    let legend = match &figure.content {
        Content::Series(series) => legend(pen, series),
        Content::Cells(cells) => vec![vec![(scale(cells), Role::Text)]],
    };
    let words = u16::try_from(sentence.len() + legend.len()).unwrap_or(u16::MAX);
    let top = 2;
    let room = height.saturating_sub(top + words);
    match &figure.content {
        Content::Series(series) => lines(&mut pen.part(0, top, width, room), figure, series),
        Content::Cells(cells) => plane(&mut pen.part(0, top, width, room), figure, cells),
    }
    let mut y = top + room;
    for entries in legend {
        let mut x = 0;
        for (text, role) in entries {
            x = pen.text(x, y, &text, role) + 3;
        }
        y += 1;
    }
    for line in sentence {
        pen.text(0, y, &line, Role::Text);
        y += 1;
    }
}

/// Whether a spread is not drawn.
fn hides_spread(figure: &Figure) -> bool {
    let Content::Series(series) = &figure.content else { return false };
    series.iter().any(|one| one.spread.is_some() && spread_of(one).is_none())
}

/// The spread of a series that is drawn.
fn spread_of(series: &Series) -> Option<&Vec<(f64, f64)>> {
    let is_drawn = |spread: &&Vec<_>| spread.len() == series.points.len();
    series.spread.as_ref().filter(is_drawn).filter(|spread| spread.len() <= MOST_BARS)
}

/// What stands for a series.
struct Sight {
    role: Role,
    /// What it is drawn with.
    marker: Marker,
    /// Its own sign, where it has one: no two series share it.
    sign: Option<char>,
    /// All that as the legend has it.
    legend: String,
}

/// What stands for each of `series`.
fn sights(series: &[Series], glyphs: Glyphs) -> Vec<Sight> {
    let mut taken = Vec::new();
    series
        .iter()
        .map(|one| {
            let sign = wanted_sign(one).map(|first| {
                let free = (first..first + SIGNS.len() + LETTERS.len()).map(sign);
                free.clone().find(|sign| !taken.contains(sign)).unwrap_or_else(|| sign(first))
            });
            let is_mean = matches!(one.mark, Mark::Shape(_)) && one.spread.is_some();
            let sign = if is_mean { Some(MEAN) } else { sign };
            taken.extend(sign);
            sight(one, sign, glyphs)
        })
        .collect()
}

/// The number of the sign that a series would have: of one of many, whose lines colours alone
/// would tell apart, and of shapes.
fn wanted_sign(series: &Series) -> Option<usize> {
    match (series.mark, series.role) {
        (Mark::Shape(shape) | Mark::Linked(shape) | Mark::DashLinked(shape), _) => Some(shape),
        (Mark::Line | Mark::Dashed | Mark::Dotted, Meaning::One(at)) => Some(at),
        _ => None,
    }
}

/// The `at`-th sign.
fn sign(at: usize) -> char {
    let letter = || char::from(LETTERS[(at - SIGNS.len()) % LETTERS.len()]);
    SIGNS.get(at).copied().unwrap_or_else(letter)
}

fn sight(series: &Series, sign: Option<char>, glyphs: Glyphs) -> Sight {
    let role = match series.role {
        Meaning::Simultaneous | Meaning::Machine => Role::Robot,
        Meaning::Sequential | Meaning::Human => Role::You,
        Meaning::Plain => Role::Text,
        Meaning::One(at) => {
            [Role::You, Role::Robot, Role::Go, Role::Countdown, Role::Wait, Role::Text][at % 6]
        }
    };
    let (fine, coarse) = match series.mark {
        Mark::Line => ("──", '.'),
        Mark::Thin => ("─", '.'),
        Mark::Dashed => ("╌╌", '-'),
        Mark::Dotted => ("┈┈", '\''),
        Mark::Shape(_) | Mark::Linked(_) | Mark::DashLinked(_) => {
            let sign = sign.unwrap_or(SIGNS[0]);
            let legend = sign.to_string();
            return Sight { role, marker: Marker::Custom(sign), sign: None, legend };
        }
    };
    let whose = sign.map_or_else(String::new, String::from);
    let (marker, line) = if glyphs == Glyphs::Braille {
        (Marker::Braille, fine.to_owned())
    } else {
        (Marker::Custom(coarse), coarse.to_string())
    };
    Sight { role, marker, sign, legend: line + &whose }
}

/// The legend's entries, line by line.
fn legend(pen: &Pen<'_>, series: &[Series]) -> Vec<Vec<(String, Role)>> {
    let mut lines: Vec<Vec<(String, Role)>> = vec![Vec::new()];
    let mut used = 0;
    for (one, Sight { role, legend, .. }) in series.iter().zip(sights(series, pen.look.glyphs)) {
        let entry = cut(&format!("{legend} {}", one.label), usize::from(pen.width()));
        let length = columns(&entry) + 3;
        if used > 0 && used + length > pen.width() {
            lines.push(Vec::new());
            used = 0;
        }
        used += length;
        if let Some(line) = lines.last_mut() {
            line.push((entry, role));
        }
    }
    // More would leave no room for the picture.
    if lines.len() > MOST_LINES {
        let left = lines.drain(MOST_LINES - 1..).map(|line| line.len()).sum::<usize>();
        lines.push(vec![(format!("and {left} more, which the page and the data name"), Role::Dim)]);
    }
    lines
}

/// What is drawn with one sign.
type Curve = (Role, Marker, GraphType, Vec<(f64, f64)>);

fn lines(pen: &mut Pen<'_>, figure: &Figure, series: &[Series]) {
    let all = || series.iter().flat_map(Series::pieces).flatten();
    let x = bounds(&figure.x, all().map(|point| point.0));
    let spreads = series.iter().filter_map(spread_of).flatten();
    let ys = all().map(|point| point.1).chain(spreads.flat_map(|(a, b)| [*a, *b]));
    let (least, most) = bounds(&figure.y, ys);
    let y = (figure.ground().unwrap_or(least), most);
    let fine = Marker::Braille;
    let dots = |marker: Marker| {
        let (wide, high) = if marker == fine { (2, 4) } else { (1, 1) };
        (f64::from(pen.width() * wide), f64::from(pen.height() * high))
    };
    // What is drawn later covers what was before: spreads lie below, signs above.
    let (mut spreads, mut drawn, mut signs) = (Vec::new(), Vec::<Curve>::new(), Vec::new());
    let sights = sights(series, pen.look.glyphs);
    for (at, (one, Sight { role, marker, sign, .. })) in series.iter().zip(sights).enumerate() {
        let is_line = matches!(one.mark, Mark::Line | Mark::Thin);
        for piece in one.pieces() {
            let (kind, points) = match one.mark {
                _ if is_line => (GraphType::Line, piece.to_vec()),
                Mark::Dashed => (GraphType::Scatter, strokes(piece, (x, y), dots(marker), (4, 3))),
                Mark::Dotted => (GraphType::Scatter, strokes(piece, (x, y), dots(marker), (1, 3))),
                _ => (GraphType::Scatter, piece.to_vec()),
            };
            drawn.push((role, marker, kind, points));
        }
        if let Some(sign) = sign {
            let every = SIGN_EVERY.min(one.points.len()).max(1);
            // One beside the other where lines run together.
            let first = at % SIGNS.len() * every / SIGNS.len();
            let places = one.points.iter().skip(first).step_by(every).copied().collect();
            signs.push((role, Marker::Custom(sign), GraphType::Scatter, places));
        }
        for ((x, _), (a, b)) in one.points.iter().zip(spread_of(one).into_iter().flatten()) {
            let bar = if pen.look.glyphs == Glyphs::Braille { fine } else { Marker::Custom('|') };
            spreads.push((Role::Dim, bar, GraphType::Line, vec![(*x, *a), (*x, *b)]));
        }
    }
    let layers = [&spreads, &drawn, &signs];
    let data = layers.into_iter().flatten().map(|(role, marker, kind, points)| {
        Dataset::default().marker(*marker).graph_type(*kind).style(pen.style(*role)).data(points)
    });
    let area = pen.area();
    let chart = Chart::new(data.collect())
        .x_axis(axis(pen, &figure.x, x))
        .y_axis(axis(pen, &figure.y, y))
        .legend_position(None);
    chart.render(area, pen.buffer());
}

/// The dots of `piece` as strokes of `on` with gaps of `off` between them, where the picture between
/// the `bounds` has so many `dots`.
fn strokes(
    piece: &[(f64, f64)],
    bounds: ((f64, f64), (f64, f64)),
    dots: (f64, f64),
    (on, off): (usize, usize),
) -> Vec<(f64, f64)> {
    let dot = |(least, most): (f64, f64), dots: f64| (most - least) / dots.max(1.0);
    let (wide, high) = (dot(bounds.0, dots.0), dot(bounds.1, dots.1));
    let mut points = Vec::new();
    let mut passed = 0;
    for pair in piece.windows(2) {
        let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
        let steps = ((x1 - x0) / wide).abs().max(((y1 - y0) / high).abs()).ceil().max(1.0);
        let mut step = 0.0;
        while step < steps {
            if passed % (on + off) < on {
                points.push((x0 + (x1 - x0) * step / steps, y0 + (y1 - y0) * step / steps));
            }
            passed += 1;
            step += 1.0;
        }
    }
    points.extend(piece.last());
    points
}

/// What an axis shows: never nothing.
fn bounds(axis: &Axis, values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (least, most) = axis.range.unwrap_or_else(|| span(values));
    if least < most { (least, most) } else { (least - 0.5, most + 0.5) }
}

fn axis<'a>(pen: &Pen<'_>, axis: &'a Axis, (least, most): (f64, f64)) -> ChartAxis<'a> {
    let style: Style = pen.style(Role::Dim);
    let labels: Vec<Line<'_>> = if axis.names.is_empty() {
        let middle = f64::midpoint(least, most);
        if !axis.is_whole {
            [least, middle, most].map(|value| Line::raw(short(value))).to_vec()
        } else if middle.fract() == 0.0 {
            [least, middle, most].map(|value| Line::raw(format!("{value:.0}"))).to_vec()
        } else {
            [least, most].map(|value| Line::raw(format!("{value:.0}"))).to_vec()
        }
    } else {
        let names = axis.names.iter().map(|(_, name)| Line::raw(name.clone()));
        // Labels stand evenly apart: where half a place is left at both ends, so are blanks.
        if axis.range.is_some() {
            let blank = || std::iter::once(Line::default());
            blank().chain(names.flat_map(|name| [name, Line::default()])).collect()
        } else {
            names.collect()
        }
    };
    ChartAxis::default().bounds([least, most]).labels(labels).style(style)
}

/// Signs for cells, from the least to the most.
const SHADES: [char; 5] = [' ', '░', '▒', '▓', '█'];
/// The same where 0 is the middle.
const BELOW_AND_ABOVE: [char; 7] = ['≡', '=', '-', ' ', '░', '▒', '█'];

fn shades(cells: &Cells) -> &'static [char] {
    if cells.diverging { &BELOW_AND_ABOVE } else { &SHADES }
}

/// The least and the most of the cells; around 0 where that is the middle.
fn range(cells: &Cells) -> (f64, f64) {
    let (least, most) = span(cells.rows.iter().flatten().copied());
    let largest = least.abs().max(most.abs());
    if cells.diverging { (-largest, largest) } else { (least, most) }
}

fn scale(cells: &Cells) -> String {
    let (least, most) = range(cells);
    let shades: String = shades(cells).iter().collect();
    format!("{}: {} [{shades}] {}", cells.label, short(least), short(most))
}

/// Each cell of the terminal shows the cell that lies at its place.
fn plane(pen: &mut Pen<'_>, figure: &Figure, cells: &Cells) {
    let (width, height) = (pen.width(), pen.height());
    let (least, most) = range(cells);
    let shades = shades(cells);
    let rows = cells.rows.len();
    let room = height.saturating_sub(2);
    for y in 0..room {
        let row = usize::from(room - 1 - y) * rows / usize::from(room.max(1));
        let Some(values) = cells.rows.get(row) else { continue };
        let line: String = (0..width)
            .map(|x| {
                let value = values[usize::from(x) * values.len() / usize::from(width.max(1))];
                let part = (value - least) / (most - least).max(f64::MIN_POSITIVE);
                let last = crate::report::figure::real(shades.len());
                let level = (0..shades.len())
                    .rev()
                    .find(|at| part * last >= crate::report::figure::real(*at))
                    .unwrap_or(0);
                if value.is_finite() { shades[level] } else { ' ' }
            })
            .collect();
        pen.text(0, y, &line, Role::Text);
    }
    let ends = |axis: &Axis| {
        let (least, most) = axis.range.unwrap_or((0.0, 1.0));
        format!("{} from {} to {}", axis.title(), short(least), short(most))
    };
    pen.text(0, room, &format!("→ {}   ↑ {}", ends(&figure.x), ends(&figure.y)), Role::Dim);
}
