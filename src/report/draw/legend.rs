//! The legend under a figure. kuva's own is cut off where it has more than two rows.

use std::fmt::Write as _;

use super::{TEXT, WIDTH, colour, dashes};
use crate::report::figure::{Mark, SHAPES, Series, real};

/// Height of a row.
const ROW: f64 = 20.0;
/// Where the first column begins,
const LEFT: f64 = 58.0;
/// how long a sample is,
const SAMPLE: f64 = 26.0;
/// and how wide a letter is about.
const LETTER: f64 = 6.9;

/// The legend of `series`, to be put `top` below the figure's upper edge, and its height.
pub(super) fn legend(series: &[Series], top: f64) -> (String, f64) {
    let longest = series.iter().map(|one| one.label.chars().count()).max().unwrap_or(0);
    let column = SAMPLE + 8.0 + real(longest) * LETTER + 14.0;
    let room = WIDTH - LEFT;
    let columns = (1..=4_u8).rev().find(|n| f64::from(*n) * column <= room).unwrap_or(1);
    let mut svg = String::new();
    for (at, one) in series.iter().enumerate() {
        let (row, place) = (at / usize::from(columns), at % usize::from(columns));
        let x = LEFT + real(place) * column;
        let y = top + (real(row) + 0.5) * ROW;
        sample(&mut svg, one, x, y);
        let label = escaped(&one.label);
        // Writing to a text cannot fail.
        let _ = write!(
            svg,
            "<text class=\"legend\" x=\"{:.1}\" y=\"{:.1}\" font-size=\"{TEXT}\">{label}</text>",
            x + SAMPLE + 8.0,
            y + 4.5
        );
    }
    (svg, real(series.len().div_ceil(usize::from(columns))) * ROW + 6.0)
}

/// How `series` is drawn, at (x, y).
fn sample(svg: &mut String, series: &Series, x: f64, y: f64) {
    let ink = colour(series.role);
    if !matches!(series.mark, Mark::Shape(_)) {
        let (dashes, width) = dashes(series.mark);
        let dashes = dashes.map_or(String::new(), |d| format!(" stroke-dasharray=\"{d}\""));
        let _ = write!(
            svg,
            "<path d=\"M{x:.1} {y:.1}h{SAMPLE}\" stroke=\"{ink}\" stroke-width=\"{width}\"{dashes}/>"
        );
    }
    if let Mark::Shape(shape) | Mark::Linked(shape) | Mark::DashLinked(shape) = series.mark {
        let (x, y) = (x + SAMPLE / 2.0, y);
        if series.spread.is_some() {
            let _ = write!(
                svg,
                "<path d=\"M{x:.1} {:.1}v16\" stroke=\"{ink}\" stroke-width=\"1\"/>",
                y - 8.0
            );
        }
        let _ = match shape % SHAPES {
            0 => write!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{ink}\"/>"),
            1 => path(svg, &ink, x, y, "m0 -4.5l4 8h-8z", true),
            2 => path(svg, &ink, x, y, "m-3.5 -3.5h7v7h-7z", true),
            3 => path(svg, &ink, x, y, "m-4 0h8m-4 -4v8", false),
            4 => path(svg, &ink, x, y, "m0 -4.5l4 4.5l-4 4.5l-4 -4.5z", true),
            _ => path(svg, &ink, x, y, "m-3.5 -3.5l7 7m-7 0l7 -7", false),
        };
    }
}

fn path(
    svg: &mut String,
    ink: &str,
    x: f64,
    y: f64,
    shape: &str,
    is_filled: bool,
) -> std::fmt::Result {
    if is_filled {
        write!(svg, "<path d=\"M{x:.1} {y:.1}{shape}\" fill=\"{ink}\"/>")
    } else {
        write!(svg, "<path d=\"M{x:.1} {y:.1}{shape}\" stroke=\"{ink}\" stroke-width=\"1.5\"/>")
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figure::Role;

    fn series(label: &str, mark: Mark) -> Series {
        Series::new(label, Role::Human, mark, vec![])
    }

    #[test]
    fn every_series_has_its_sample_and_its_name() {
        let marks = [Mark::Line, Mark::Dashed, Mark::Shape(0), Mark::DashLinked(1), Mark::Shape(3)];
        let all: Vec<Series> = marks.iter().map(|mark| series("S<01>", *mark)).collect();
        let (svg, height) = legend(&all, 300.0);
        assert_eq!(svg.matches("S&lt;01&gt;").count(), 5);
        assert_eq!(svg.matches("stroke-dasharray").count(), 2, "{svg}");
        assert!((height - (2.0 * ROW + 6.0)).abs() < 1e-9, "four beside each other: {height}");
    }

    #[test]
    fn long_names_stand_below_each_other() {
        let long = series(&"a".repeat(60), Mark::Line);
        assert!((legend(&[long.clone(), long], 0.0).1 - 46.0).abs() < 1e-9);
    }
}
