//! A report as plain text: tables, and a line of bars for each series.

use super::figure::{Cells, Content, Figure, Item, Report, Series, Table, real};

/// Bars in a line.
const WIDTH: usize = 60;
const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// The lines of `report`.
#[must_use]
pub fn lines(report: &Report) -> Vec<String> {
    let mut lines = vec![report.title.clone()];
    for left in &report.left_out {
        lines.push(format!("left out: {}: {}", left.path, left.why));
    }
    for section in &report.sections {
        lines.extend([String::new(), format!("## {}", section.title)]);
        lines.extend(section.notes.iter().cloned());
        for item in &section.items {
            lines.extend(of_item(item));
        }
    }
    lines
}

/// The lines of a figure or table.
#[must_use]
pub fn of_item(item: &Item) -> Vec<String> {
    let caption = item.caption();
    let thesis =
        if caption.thesis.is_empty() { String::new() } else { format!(" ({})", caption.thesis) };
    let mut lines = vec![
        String::new(),
        format!("{}{thesis} · {}", caption.title, caption.preset),
        format!("  {}", caption.sentence),
    ];
    lines.extend(match item {
        Item::Figure(figure) => of_figure(figure),
        Item::Table(table) => columns(table),
    });
    lines.push(format!("  data: {}, which --csv DIR writes", item.data_file()));
    lines
}

fn of_figure(figure: &Figure) -> Vec<String> {
    match &figure.content {
        Content::Series(series) => {
            let width = series.iter().map(|one| one.label.chars().count()).max().unwrap_or(0);
            let mut lines = vec![format!("  {} along {}", figure.y.title(), figure.x.title())];
            let all = || series.iter().flat_map(Series::pieces).flatten();
            let range = figure.x.range.unwrap_or_else(|| span(all().map(|point| point.0)));
            let heights = figure.y.range.unwrap_or_else(|| span(all().map(|point| point.1)));
            for one in series {
                let (least, most) = span(one.pieces().flatten().map(|point| point.1));
                lines.push(format!(
                    "  {:width$}  {}  {} to {}",
                    one.label,
                    bars(one, range, heights),
                    short(least),
                    short(most)
                ));
            }
            lines
        }
        Content::Cells(cells) => of_cells(figure, cells),
    }
}

fn of_cells(figure: &Figure, cells: &Cells) -> Vec<String> {
    let values = cells.rows.iter().flatten().copied().filter(|value| value.is_finite());
    let (least, most) = span(values);
    vec![format!(
        "  {} × {} cells of {} and {}: {} from {} to {}",
        cells.rows.first().map_or(0, Vec::len),
        cells.rows.len(),
        figure.x.title(),
        figure.y.title(),
        cells.label,
        short(least),
        short(most)
    )]
}

/// The least and the most of `values`; 0 and 0 of none.
#[must_use]
pub fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (least, most) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), value| (a.min(value), b.max(value)));
    if least <= most { (least, most) } else { (0.0, 0.0) }
}

/// A number with about three digits.
#[must_use]
pub fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        large if large >= 100.0 => format!("{value:.0}"),
        middle if middle >= 10.0 => format!("{value:.1}"),
        small if small >= 0.1 => format!("{value:.2}"),
        _ => format!("{value:.4}"),
    }
}

/// The means of `series` along `range`, as bars of `heights`.
fn bars(series: &Series, range: (f64, f64), heights: (f64, f64)) -> String {
    let mut sums = [(0.0_f64, 0.0_f64); WIDTH];
    let across = (range.1 - range.0).max(f64::MIN_POSITIVE);
    for (x, y) in series.pieces().flatten() {
        let place = place((x - range.0) / across * real(WIDTH), WIDTH - 1);
        sums[place].0 += y;
        sums[place].1 += 1.0;
    }
    let height = (heights.1 - heights.0).max(f64::MIN_POSITIVE);
    sums.iter()
        .map(|(sum, count)| {
            if *count == 0.0 {
                return ' ';
            }
            BARS[place((sum / count - heights.0) / height * 8.0, 7)]
        })
        .collect()
}

/// `value` as a place from 0 to `last`.
fn place(value: f64, last: usize) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to a small range"
    )]
    let place = value.clamp(0.0, real(last)) as usize;
    place.min(last)
}

/// A table with its columns below each other.
#[must_use]
pub fn columns(table: &Table) -> Vec<String> {
    let all = || std::iter::once(&table.columns).chain(&table.rows);
    let widths: Vec<usize> = (0..table.columns.len())
        .map(|column| {
            let cells = all().filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        })
        .collect();
    all()
        .map(|row| {
            let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:width$}"));
            format!("  {}", cells.collect::<Vec<_>>().join("  ")).trim_end().to_owned()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figure::{Axis, Caption, Mark, Role};

    #[test]
    fn a_series_is_a_line_of_bars() {
        let points = (0..60).map(|at| (f64::from(at), f64::from(at))).collect();
        let figure = Figure {
            caption: Caption::default(),
            x: Axis::new("rollout", ""),
            y: Axis::new("time", "s"),
            content: Content::Series(vec![Series::new("all", Role::Plain, Mark::Line, points)]),
        };
        let lines = of_figure(&figure);
        assert_eq!(lines[0], "  time (s) along rollout");
        assert!(
            lines[1].starts_with("  all  ▁▁▁▁▁▁▁▁▂") && lines[1].ends_with("█  0 to 59.0"),
            "{lines:?}"
        );
    }

    #[test]
    fn columns_stand_below_each_other() {
        let table = Table {
            caption: Caption::default(),
            columns: vec!["who".to_owned(), "s".to_owned()],
            rows: vec![vec!["longer".to_owned(), "1".to_owned()]],
        };
        assert_eq!(columns(&table), ["  who     s", "  longer  1"]);
    }
}
