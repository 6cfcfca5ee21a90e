//! Draws figures as SVG. The only place that names kuva.
//!
//! kuva knows one theme at a time. A page is read by day and by night, so colours are written as
//! CSS variables ([`style`]), which the page sets for both; a figure that stands alone gets the
//! colours of paper. Colours are those of Okabe and Ito (2008), which people with any colour
//! vision tell apart, and each has a dash or a shape of its own beside it.

mod legend;

use std::borrow::Cow;
use std::sync::Arc;

use kuva::plot::Heatmap;
use kuva::plot::colormap::ColorMap;
use kuva::plot::line::{LinePlot, LineStyle};
use kuva::plot::scatter::{MarkerShape, ScatterPlot};
use kuva::render::layout::{Layout, TickFormat};
use kuva::render::plots::Plot;
use kuva::render::theme::Theme;

use super::figure::{Axis, Cells, Content, Figure, Mark, Role, SHAPES, Series};

/// Width of a figure: small enough that its text is legible on a phone.
const WIDTH: f64 = 480.0;
/// Height of a figure without its legend.
const HEIGHT: f64 = 300.0;
/// Height of a figure of cells, with its scale beside it.
const CELLS_HEIGHT: f64 = 330.0;
/// Size of all text.
const TEXT: u32 = 13;
/// The most ticks of an axis of whole numbers.
const MOST_TICKS: f64 = 7.0;
/// Above so many points of a series its spread is a band, not bars.
const MOST_BARS: usize = 12;

/// A variable of the style: its name, and its colours on paper and in the dark.
type Ink = (&'static str, &'static str, &'static str);

/// The variables, those of subjects and such first.
const INKS: [Ink; 12] = [
    ("--ink-0", "#0072b2", "#56b4e9"),
    ("--ink-1", "#d55e00", "#ff8a3c"),
    ("--ink-2", "#009e73", "#2fd0a2"),
    ("--ink-3", "#a8527f", "#e39cc3"),
    ("--ink-4", "#2a8fc9", "#9ad4f5"),
    ("--ink-5", "#b07700", "#f0b429"),
    ("--ink-6", "#5c5c5c", "#c4c4c4"),
    ("--text", "#1a1a1a", "#e6e6e6"),
    ("--axis", "#4a4a4a", "#a8a8a8"),
    ("--grid", "#e2e2e2", "#3a3a3a"),
    ("--paper", "#ffffff", "#16181c"),
    ("--faint", "#6a6a6a", "#9a9a9a"),
];

/// The colours of a page, by day and by night; print has those of paper.
#[must_use]
pub fn style() -> String {
    let set = |of: fn(&Ink) -> &'static str| {
        let inks = INKS.iter().map(|ink| format!("{}:{};", ink.0, of(ink)));
        inks.collect::<Vec<_>>().concat()
    };
    let (light, dark) = (set(|ink| ink.1), set(|ink| ink.2));
    format!(
        ":root{{color-scheme:light dark;{light}}}\
         @media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}"
    )
}

/// The figure for a page that has the [`style`].
#[must_use]
pub fn for_page(figure: &Figure) -> String {
    trimmed(&drawn(figure))
}

/// The figure for a file of its own, on paper.
#[must_use]
pub fn alone(figure: &Figure) -> String {
    let mut svg = for_page(figure);
    for (name, light, _) in INKS {
        svg = svg.replace(&format!("var({name})"), light);
    }
    // The ground comes first.
    let ground = r##"<rect width="100%" height="100%" fill="#ffffff"/>"##;
    match svg.find('>') {
        Some(end) => format!("{}{ground}{}\n", &svg[..=end], &svg[end + 1..]),
        None => svg,
    }
}

fn colour(role: Role) -> String {
    let name = match role {
        Role::Sequential => INKS[0].0,
        Role::Simultaneous => INKS[1].0,
        Role::Human => INKS[2].0,
        Role::Machine => INKS[3].0,
        Role::Plain => "--text",
        Role::One(at) => INKS[at % 7].0,
    };
    format!("var({name})")
}

/// The dashes and the width of a line, in the picture and in its legend.
const fn dashes(mark: Mark) -> (Option<&'static str>, f64) {
    match mark {
        Mark::DashLinked(_) => (Some("7 4"), 1.6),
        Mark::Line | Mark::Shape(_) => (None, 1.8),
        Mark::Linked(_) => (None, 1.6),
        Mark::Dashed => (Some("7 4"), 1.8),
        Mark::Dotted => (Some("2 3"), 2.0),
        Mark::Thin => (None, 0.6),
    }
}

const fn marker(shape: usize) -> MarkerShape {
    match shape % SHAPES {
        0 => MarkerShape::Circle,
        1 => MarkerShape::Triangle,
        2 => MarkerShape::Square,
        3 => MarkerShape::Plus,
        4 => MarkerShape::Diamond,
        _ => MarkerShape::Cross,
    }
}

fn theme() -> Theme {
    let ink = |name: &str| format!("var({name})");
    Theme {
        background: "none".to_owned(),
        axis_color: ink("--axis"),
        grid_color: ink("--grid"),
        tick_color: ink("--axis"),
        text_color: ink("--text"),
        legend_bg: "none".to_owned(),
        legend_border: "none".to_owned(),
        colorbar_border: ink("--axis"),
        font_family: Some("system-ui, sans-serif".to_owned()),
        ..Theme::light()
    }
}

fn drawn(figure: &Figure) -> String {
    let plots = match &figure.content {
        Content::Series(series) => series.iter().flat_map(plots).collect(),
        Content::Cells(cells) => vec![Plot::Heatmap(heatmap(figure, cells))],
    };
    let height = match &figure.content {
        Content::Series(_) => HEIGHT,
        Content::Cells(_) => CELLS_HEIGHT,
    };
    let mut layout = Layout::auto_from_plots(&plots)
        .with_theme(theme())
        .with_width(WIDTH)
        .with_height(height)
        .with_x_label(figure.x.title())
        .with_y_label(figure.y.title())
        .with_label_size(TEXT)
        .with_tick_size(TEXT)
        .with_body_size(TEXT)
        .with_legend_box(false);
    if let Some((least, most)) = figure.x.range {
        // Room for a shape at the end.
        let is_plane = matches!(figure.content, Content::Cells(_));
        let beyond = if is_plane { 0.0 } else { 0.02 * (most - least) };
        layout = layout.with_x_axis_min(least).with_x_axis_max(most + beyond);
    }
    if let Some((least, most)) = figure.y.range {
        // Room for a line along the upper end.
        let is_plane = matches!(figure.content, Content::Cells(_));
        let beyond = if is_plane { 0.0 } else { 0.02 * (most - least) };
        layout = layout.with_y_axis_min(least).with_y_axis_max(most + beyond);
    }
    if let Some(ground) = figure.ground() {
        layout = layout.with_y_axis_min(ground);
    }
    if let Some(step) = whole_step(&figure.x, layout.x_range) {
        layout = layout.with_x_tick_step(step);
    }
    if let Some(step) = whole_step(&figure.y, layout.y_range) {
        layout = layout.with_y_tick_step(step);
    }
    if !figure.x.names.is_empty() {
        layout = layout.with_x_tick_step(1.0).with_x_tick_format(names(&figure.x));
    }
    let svg = kuva::render_to_svg(plots, layout);
    match &figure.content {
        Content::Series(series) => with_legend(&svg, series),
        Content::Cells(_) => svg,
    }
}

/// The picture with a legend below it.
fn with_legend(svg: &str, series: &[Series]) -> String {
    let (legend, more) = legend::legend(series, HEIGHT);
    let taller =
        svg.replacen(&format!("height=\"{HEIGHT}\""), &format!("height=\"{}\"", HEIGHT + more), 1);
    taller.replacen("</svg>", &format!("{legend}</svg>"), 1)
}

/// How far the ticks of an axis of whole numbers are apart: 1, 2 or 5 times a power of ten.
fn whole_step(axis: &Axis, (least, most): (f64, f64)) -> Option<f64> {
    let powers = (0..9).map(|power| 10_f64.powi(power));
    let mut steps = powers.flat_map(|power| [1.0, 2.0, 5.0].map(|step| step * power));
    let is_wide_enough = |step: &f64| *step * MOST_TICKS >= most - least;
    steps.find(is_wide_enough).filter(|_| axis.is_whole)
}

/// Words at the places of the axis that have one.
fn names(axis: &Axis) -> TickFormat {
    let names = axis.names.clone();
    TickFormat::Custom(Arc::new(move |value| {
        let here = names.iter().find(|(place, _)| (place - value).abs() < 1e-6);
        here.map_or_else(String::new, |(_, name)| name.clone())
    }))
}

/// A series as what kuva draws: a line for each unbroken part, and shapes.
fn plots(series: &Series) -> Vec<Plot> {
    let (dashes, width) = dashes(series.mark);
    let style = dashes.map_or(LineStyle::Solid, |dashes| LineStyle::Custom(dashes.to_owned()));
    let shape = match series.mark {
        Mark::Shape(shape) | Mark::Linked(shape) | Mark::DashLinked(shape) => Some(shape),
        _ => None,
    };
    let mut plots = Vec::new();
    if !matches!(series.mark, Mark::Shape(_)) {
        for (piece, spread) in series.pieces_within() {
            let mut line = LinePlot::new()
                .with_data(piece.iter().copied())
                .with_color(colour(series.role))
                .with_stroke_width(width)
                .with_line_style(style.clone());
            if let Some(spread) = spread
                && series.points.len() > MOST_BARS
            {
                line = line
                    .with_band(spread.iter().map(|pair| pair.0), spread.iter().map(|pair| pair.1));
            }
            plots.push(Plot::Line(line));
        }
    }
    if let Some(shape) = shape {
        plots.push(Plot::Scatter(shapes(series, shape)));
    }
    plots
}

fn shapes(series: &Series, shape: usize) -> ScatterPlot {
    let points: Vec<(f64, f64)> = series.pieces().flatten().copied().collect();
    let mut scatter = ScatterPlot::new()
        .with_data(points.iter().copied())
        .with_color(colour(series.role))
        .with_size(if points.len() <= 2 { 5.0 } else { 3.0 })
        .with_marker(marker(shape));
    let spread: Vec<(f64, f64)> =
        series.pieces_within().into_iter().filter_map(|piece| piece.1).flatten().copied().collect();
    if spread.len() == points.len() && series.points.len() <= MOST_BARS {
        let around = points.iter().zip(&spread);
        let errors: Vec<(f64, f64)> =
            around.map(|((_, y), (least, most))| (y - least, most - y)).collect();
        scatter = scatter.with_y_err_asymmetric(errors);
    }
    scatter
}

fn heatmap(figure: &Figure, cells: &Cells) -> Heatmap {
    let known = || cells.rows.iter().flatten().copied().filter(|value| value.is_finite());
    let (least, most) =
        (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
    let middle = if cells.diverging { 0.0 } else { least };
    let rows = cells.rows.iter().map(|row| {
        row.iter().map(|value| if value.is_finite() { *value } else { middle }).collect::<Vec<_>>()
    });
    let mut heatmap = Heatmap::new().with_data(rows).with_legend(&*cells.label);
    if let Some((least, most)) = figure.x.range {
        heatmap = heatmap.with_x_range(least, most);
    }
    if let Some((least, most)) = figure.y.range {
        heatmap = heatmap.with_y_range(least, most);
    }
    heatmap.with_color_map(if cells.diverging {
        let largest = least.abs().max(most.abs()).max(f64::MIN_POSITIVE);
        ColorMap::Custom(Arc::new(move |part| diverging((least + part * (most - least)) / largest)))
    } else {
        ColorMap::Cividis
    })
}

/// Blue below 0, white there, vermillion above; `value` from −1 to 1.
fn diverging(value: f64) -> String {
    const WHITE: [f64; 3] = [247.0, 247.0, 247.0];
    let end = if value < 0.0 { [0.0, 114.0, 178.0] } else { [213.0, 94.0, 0.0] };
    let part = value.abs().min(1.0);
    let mixed: Vec<String> = WHITE
        .iter()
        .zip(end)
        .map(|(white, end)| format!("{:.0}", white + part * (end - white)))
        .collect();
    format!("rgb({})", mixed.join(","))
}

/// The SVG that fits the width of its page, without what nobody sees: the second decimal of
/// places, a tenth of a pixel.
fn trimmed(svg: &str) -> String {
    let svg = scaled(svg);
    let mut out = String::with_capacity(svg.len());
    let mut rest: &str = &svg;
    // Only what stands between angles are places; texts stay.
    while let Some(start) = rest.find('<') {
        let (text, tag) = rest.split_at(start);
        out.push_str(text);
        let end = tag.find('>').map_or(tag.len(), |end| end + 1);
        shortened(&tag[..end], &mut out);
        rest = &tag[end..];
    }
    out.push_str(rest);
    out
}

/// Numbers of a tag with one decimal at most.
fn shortened(tag: &str, out: &mut String) {
    let mut decimals: Option<u32> = None;
    for letter in tag.chars() {
        match (letter, decimals) {
            ('.', None) => decimals = Some(0),
            ('0'..='9', Some(n)) => {
                decimals = Some(n + 1);
                if n >= 1 {
                    continue;
                }
            }
            _ => decimals = None,
        }
        out.push(letter);
    }
}

/// With a view box in place of a size.
fn scaled(svg: &str) -> Cow<'_, str> {
    let size = |name: &str| {
        let (_, rest) = svg.split_once(&format!(" {name}=\""))?;
        rest.split_once('"').map(|(value, _)| value)
    };
    match (size("width"), size("height")) {
        (Some(width), Some(height)) => Cow::Owned(svg.replacen(
            &format!("width=\"{width}\" height=\"{height}\""),
            &format!("viewBox=\"0 0 {width} {height}\" role=\"img\""),
            1,
        )),
        _ => Cow::Borrowed(svg),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figure::Caption;

    fn figure() -> Figure {
        let points = vec![(0.0, 1.0), (1.0, 2.0), (f64::NAN, f64::NAN), (2.0, 1.234567)];
        Figure {
            caption: Caption::default(),
            x: Axis::new("rollout", ""),
            y: Axis::new("time <of & balance>", "s"),
            content: Content::Series(vec![
                Series::new("a", Role::Human, Mark::Dashed, points),
                Series::new("b", Role::Plain, Mark::Shape(1), vec![(0.5, 1.5)]),
            ]),
        }
    }

    #[test]
    fn a_page_sets_the_colours_and_a_file_has_its_own() {
        let page = for_page(&figure());
        assert!(page.contains("var(--ink-2)") && page.contains("viewBox=\"0 0 480"), "{page}");
        assert!(page.contains("time &lt;of &amp; balance&gt; (s)"));
        assert!(!page.contains("NaN"));
        let alone = alone(&figure());
        assert!(!alone.contains("var(") && alone.contains("#009e73"), "{alone}");
        assert!(
            style().contains("--ink-2:#009e73") && style().contains("prefers-color-scheme:dark")
        );
    }

    #[test]
    fn places_have_one_decimal_and_texts_all_of_theirs() {
        let mut out = String::new();
        shortened("<path d=\"M 1.25 -3.75L10 2\"/>", &mut out);
        assert_eq!(out, "<path d=\"M 1.2 -3.7L10 2\"/>");
        assert!(trimmed("<svg><text x=\"1.25\">1.25</text></svg>").contains(">1.25<"));
    }

    #[test]
    fn counts_have_whole_ticks() {
        let step = |most: f64| whole_step(&Axis::whole("rollout"), (0.0, most));
        assert_eq!([3.0, 14.0, 25.0, 100.0].map(step), [1.0, 2.0, 5.0, 20.0].map(Some));
        assert_eq!(whole_step(&Axis::new("time", "s"), (0.0, 3.0)), None);
    }

    #[test]
    fn no_difference_is_white() {
        assert_eq!(diverging(0.0), "rgb(247,247,247)");
        assert_eq!(diverging(-1.0), "rgb(0,114,178)");
        assert_eq!(diverging(7.0), "rgb(213,94,0)");
    }
}
