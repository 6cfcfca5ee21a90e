//! The charts of the results.

use ratatui::style::Style;
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Chart, Dataset, GraphType, Widget};

use super::Info;
use super::measure::{axis_decimals, title, title_alone};
use crate::record::EpisodeRow;
use crate::report::achieved::Yardstick;
use crate::session::Phase;
use crate::tui::palette::{Glyphs, Role};
use crate::tui::pen::{Pen, columns};
use crate::tui::text::{moving_mean, real};

impl Scale {
    /// An axis for `values` of `measure`.
    fn of(measure: &Yardstick, title: String, values: impl Iterator<Item = f64>) -> Self {
        let (from, to) = super::measure::axis(measure, values);
        Self { title, from, to, decimals: axis_decimals(measure) }
    }

    /// An axis of rollouts up to the `last`.
    fn rollouts(title: &str, last: f64) -> Self {
        Self { title: title.to_owned(), from: 1.0, to: last, decimals: 0 }
    }
}

type Points = Vec<(f64, f64)>;

/// A chart narrower than this has another one beside it.
const ROOMY: u16 = 45;

/// One set of points: its name, how it is drawn, its colour.
struct Curve {
    name: &'static str,
    graph: GraphType,
    role: Role,
    points: Points,
}

impl Curve {
    /// What the curve is drawn with.
    const fn marker(&self, glyphs: Glyphs) -> Marker {
        match (self.graph, glyphs) {
            (GraphType::Line, Glyphs::Braille) => Marker::Braille,
            (GraphType::Line, Glyphs::Half) => Marker::HalfBlock,
            _ => Marker::Custom(self.sign()),
        }
    }

    /// The sign in the legend, and of single points: another one for each meaning.
    const fn sign(&self) -> char {
        match (self.graph, self.role) {
            (GraphType::Line, _) => '─',
            (_, Role::Dim) => '·',
            (_, Role::Go) => '+',
            _ => '•',
        }
    }
}

/// An axis: its title, where it begins and ends, decimals of its labels.
struct Scale {
    title: String,
    from: f64,
    to: f64,
    decimals: usize,
}

/// The measure of each rollout and its moving average.
pub fn measured(pen: &mut Pen<'_>, info: &Info) {
    let practice = info.measured(Phase::Introduction);
    let main = info.measured(Phase::Main);
    let first = real(practice.len());
    let count = first + real(main.len());
    let average = moving_mean(&main, 10);
    let curves = [
        Curve {
            name: "practice",
            graph: GraphType::Scatter,
            role: Role::Dim,
            points: numbered(&practice, 0.0),
        },
        Curve {
            name: "main",
            graph: GraphType::Scatter,
            role: Role::Text,
            points: numbered(&main, first),
        },
        Curve {
            name: "mean of 10",
            graph: GraphType::Line,
            role: Role::You,
            points: numbered(&average, first),
        },
    ];
    let x = Scale::rollouts("rollout", count);
    let all = practice.iter().chain(&main).copied();
    let y = Scale::of(&info.measure, title(&info.measure), all);
    chart(pen, &curves, &x, &y);
}

/// Share and success over main's rollouts.
pub fn sharing(pen: &mut Pen<'_>, info: &Info) {
    let points = |value: fn(&EpisodeRow) -> Option<f64>| -> Points {
        info.of(Phase::Main)
            .filter_map(|row| Some((f64::from(row.episode), value(row)? * 100.0)))
            .collect()
    };
    let curves = [
        Curve {
            name: "your share",
            graph: GraphType::Line,
            role: Role::You,
            points: points(|row| row.share),
        },
        Curve {
            name: "success",
            graph: GraphType::Scatter,
            role: Role::Go,
            points: points(|row| row.success),
        },
    ];
    let last = info.of(Phase::Main).map(|row| row.episode).max().unwrap_or(1);
    let x = Scale::rollouts("rollout of main", f64::from(last));
    let y = Scale { title: "%".to_owned(), from: 0.0, to: 100.0, decimals: 0 };
    chart(pen, &curves, &x, &y);
}

/// What the robot and nobody came to, by how it began; beside it, if it was evaluated,
/// how the robot got better through main.
pub fn alone(pen: &mut Pen<'_>, info: &Info) {
    let (width, height) = (pen.width(), pen.height());
    match &info.evaluation {
        Some(tenths) if !tenths.is_empty() => {
            let half = width / 2;
            starts(&mut pen.part(0, 0, half.saturating_sub(2), height), info);
            learning(&mut pen.part(half, 0, width - half, height), &info.measure, tenths);
        }
        _ => starts(pen, info),
    }
}

fn starts(pen: &mut Pen<'_>, info: &Info) {
    let points = |phase| -> Points {
        let at = |row: &EpisodeRow| {
            info.start.map_or_else(|| f64::from(row.episode), |start| (start.value)(row))
        };
        info.of(phase).filter_map(|row| Some((at(row), (info.measure.of)(row)?))).collect()
    };
    let (robot, nobody) = (points(Phase::Autonomous), points(Phase::ZeroControl));
    let all = || robot.iter().chain(&nobody);
    let widest = all().map(|point| point.0.abs()).fold(0.1, f64::max);
    let x = match info.start {
        Some(start) => Scale { title: start.title(), from: -widest, to: widest, decimals: 1 },
        None => Scale::rollouts("rollout", widest),
    };
    let title = title_alone(&info.measure);
    let y = Scale::of(&info.measure, title, all().map(|point| point.1));
    let curves = [
        Curve { name: "nobody", graph: GraphType::Scatter, role: Role::Dim, points: nobody },
        Curve { name: "robot", graph: GraphType::Scatter, role: Role::Robot, points: robot },
    ];
    chart(pen, &curves, &x, &y);
}

fn learning(pen: &mut Pen<'_>, measure: &Yardstick, tenths: &[(u8, f64)]) {
    let points: Points = tenths.iter().map(|(part, value)| (f64::from(*part), *value)).collect();
    let y = Scale::of(measure, title_alone(measure), points.iter().map(|point| point.1));
    let curves = [Curve { name: "robot, mean", graph: GraphType::Line, role: Role::Robot, points }];
    let x = Scale { title: "% of main".to_owned(), from: 0.0, to: 100.0, decimals: 0 };
    chart(pen, &curves, &x, &y);
}

/// `values` as points after the first `before` rollouts.
fn numbered(values: &[f64], before: f64) -> Points {
    values.iter().enumerate().map(|(index, value)| (before + real(index) + 1.0, *value)).collect()
}

fn chart(pen: &mut Pen<'_>, curves: &[Curve], x: &Scale, y: &Scale) {
    let (width, height) = (pen.width(), pen.height());
    if curves.iter().all(|curve| curve.points.is_empty()) {
        pen.centred(height / 2, "nothing here: no rollout came to its end", Role::Dim);
        return;
    }
    let rows = legend(pen, curves, &format!("{} by {}", y.title, x.title));
    let look = pen.look;
    let drawn: Vec<(&Curve, Points)> = curves
        .iter()
        .filter(|curve| !curve.points.is_empty())
        .map(|curve| {
            (curve, curve.points.iter().map(|(x, y)| (drawable(*x), drawable(*y))).collect())
        })
        .collect();
    let data = drawn.iter().map(|(curve, points)| {
        Dataset::default()
            .marker(curve.marker(look.glyphs))
            .graph_type(curve.graph)
            .style(look.palette.style(curve.role))
            .data(points)
    });
    let dim = look.palette.style(Role::Dim);
    let mut part = pen.part(0, rows, width, height.saturating_sub(rows));
    let area = part.area();
    Chart::new(data.collect())
        .x_axis(axis(x, dim))
        .y_axis(axis(y, dim))
        .legend_position(None)
        .render(area, part.buffer());
}

/// The number nearest to `value` that can be scaled to a screen: the differences of larger
/// ones overflow.
const fn drawable(value: f64) -> f64 {
    value.clamp(-1e100, 1e100)
}

/// What the chart shows, and what its marks mean; returns the rows that took. Narrow charts
/// stand beside each other: they take two rows each, so that their axes are level.
fn legend(pen: &mut Pen<'_>, curves: &[Curve], title: &str) -> u16 {
    let entries: Vec<_> = curves
        .iter()
        .filter(|curve| !curve.points.is_empty())
        .map(|curve| (format!("{} {}", curve.sign(), curve.name), curve.role))
        .collect();
    let taken: u16 = entries.iter().map(|(entry, _)| columns(entry) + 2).sum();
    let after_title = pen.text(1, 0, title, Role::Text) + 2;
    let same_row = pen.width() >= ROOMY && after_title + taken <= pen.width();
    let (mut x, y) = if same_row { (pen.width().saturating_sub(taken), 0) } else { (1, 1) };
    for (entry, role) in entries {
        x = pen.text(x, y, &entry, role) + 2;
    }
    y + 1
}

/// An axis with three labels; without the middle one where it would read like an end.
fn axis(scale: &Scale, style: Style) -> Axis<'static> {
    // A single point still needs an axis with a length.
    let (from, to) = (drawable(scale.from), drawable(scale.to));
    let to = if to > from { to } else { from + 1.0 };
    let [first, middle, last] = [from, f64::midpoint(from, to), to]
        .map(|value| format!("{value:.*}", scale.decimals).replace('-', "−"));
    let middle = if middle == first || middle == last { String::new() } else { middle };
    let labels = [first, middle, last].map(Line::raw);
    Axis::default().style(style).bounds([from, to]).labels(labels)
}
