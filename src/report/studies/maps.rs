//! Over the plane of the state: value functions (47, 48), differences (49), trajectories (50–53).

use std::collections::{BTreeMap, BTreeSet};

use super::{Part, is_dashed, pair, role};
use crate::report::figure::{Axis, Cells, Content, Figure, Mark, Series};
use crate::report::gather::Driven;
use crate::report::words;

/// Cells along an axis beyond which several are drawn as one.
const MOST_CELLS: usize = 50;

/// A cell by position and velocity, and its number.
type Place = (usize, usize, f64);
/// An arm and its best run.
type Best<'a> = (&'a str, u32);

impl Part<'_> {
    /// The position and the velocity of the mountain car.
    fn plane(&self) -> (Axis, Axis) {
        let plane = words::plane(&self.outcome.task);
        let axis = |quantity: words::Quantity| Axis::new(quantity.label, quantity.unit);
        (axis(plane.x.1), axis(plane.y.1))
    }

    pub(super) fn values(&self) -> Vec<Figure> {
        let here: BTreeSet<u32> = self.curves().map(|point| point.run).collect();
        let mut arms: BTreeMap<Best<'_>, Vec<Place>> = BTreeMap::new();
        for row in &self.outcome.values {
            if row.setting == self.setting && here.contains(&row.run) {
                let cells = arms.entry((&row.arm, row.run)).or_default();
                cells.push((row.position_cell, row.velocity_cell, row.value));
            }
        }
        let figure = |((arm, run), cells): (Best<'_>, Vec<Place>)| {
            let (rows, merged) = raster(&cells);
            let (thesis, name) = match arm {
                "simultaneous" => ("figure 47", "value-simultaneous".to_owned()),
                "sequential" => ("figure 48", "value-sequential".to_owned()),
                other => ("", format!("value-{other}")),
            };
            let together = match merged {
                1 => String::new(),
                n => format!(" Each drawn cell is the largest of {n} × {n}."),
            };
            let sentence = format!(
                "The largest value of the agent's table in each cell of the state space, of the \
                 best {arm} run (run {run} of the plan).{together}"
            );
            let (x, y) = self.plane();
            // The borders of the thesis's car; its table covers them.
            let (x, y) = (x.from(-1.2, 0.5), y.from(-0.07, 0.07));
            let label = "value".to_owned();
            Figure {
                caption: self.caption(&name, thesis, &format!("Q-function, {arm}"), sentence),
                x,
                y,
                content: Content::Cells(Cells { rows, label, diverging: false }),
            }
        };
        let mut figures: Vec<Figure> = arms.into_iter().map(figure).collect();
        figures.sort_by(|a, b| a.caption.thesis.cmp(&b.caption.thesis));
        figures
    }

    /// How the first pair differs from each start.
    pub(super) fn start_by_start(&self) -> Option<Figure> {
        let sides = self.sides.first()?;
        let known: Vec<((f64, f64), f64)> = self
            .outcome
            .cells
            .iter()
            .filter(|cell| cell.sides == **sides)
            .filter_map(|cell| Some((cell.place?, cell.normalised_return?)))
            .collect();
        let along = |of: fn(&(f64, f64)) -> f64| {
            let mut values: Vec<f64> = known.iter().map(|(place, _)| of(place)).collect();
            values.sort_by(f64::total_cmp);
            values.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
            values
        };
        let (xs, ys) = (along(|place| place.0), along(|place| place.1));
        if xs.len() < 2 || ys.len() < 2 {
            return None;
        }
        let mut rows = vec![vec![f64::NAN; xs.len()]; ys.len()];
        for ((x, y), value) in known {
            let at = |values: &[f64], value: f64| {
                values.iter().position(|known| (known - value).abs() < 1e-9)
            };
            if let (Some(column), Some(row)) = (at(&xs, x), at(&ys, y)) {
                rows[row][column] = value;
            }
        }
        let range = |values: &[f64]| {
            let half = (values[1] - values[0]) / 2.0;
            (values[0] - half, values[values.len() - 1] + half)
        };
        let ((least_x, most_x), (least_y, most_y)) = (range(&xs), range(&ys));
        let (x, y) = self.plane();
        let sentence = format!(
            "The difference of normalised rewards from each of {} starts, averaged over the \
             seeds: {}. Above 0 the first of the two is better; the scale ends at ± 1.",
            xs.len() * ys.len(),
            pair(sides)
        );
        let title = "Difference of normalised reward, start by start";
        // Single starts whose best is near 0 would leave the others without colour.
        let rows =
            rows.into_iter().map(|row| row.into_iter().map(|v| v.clamp(-1.0, 1.0)).collect());
        let label = "difference".to_owned();
        Some(Figure {
            caption: self.caption("start-by-start", "figure 49", title, sentence),
            x: x.from(least_x, most_x),
            y: y.from(least_y, most_y),
            content: Content::Cells(Cells { rows: rows.collect(), label, diverging: true }),
        })
    }

    /// Where the best runs of the first pair drive, from each start.
    pub(super) fn driven(&self) -> Vec<Figure> {
        let Some(sides) = self.sides.first() else { return Vec::new() };
        let compared = [(&*sides.arm, &*sides.readout), (&*sides.from_arm, &*sides.from_readout)];
        let best = self.best_runs();
        let mut starts: Vec<(&str, u32)> = Vec::new();
        for row in self.outcome.trajectories.iter().filter(|row| row.setting == self.setting) {
            if !starts.contains(&(&*row.start, row.index)) {
                starts.push((&row.start, row.index));
            }
        }
        // The thesis's figure 51 is of the start that is trained.
        let mut numbers = [50, 52, 53].into_iter();
        let mut figures = Vec::new();
        for (start, index) in starts {
            let is_trained = start == "trained";
            let number = if is_trained { Some(51) } else { numbers.next() };
            let mut series = Vec::new();
            for (at, (arm, readout)) in compared.into_iter().enumerate() {
                let Some(run) = best.get(arm) else { continue };
                let is_this = |row: &&Driven| {
                    (row.run, &*row.readout, &*row.start, row.index)
                        == (*run, readout, start, index)
                };
                let path: Vec<(f64, f64)> = self
                    .outcome
                    .trajectories
                    .iter()
                    .filter(is_this)
                    .filter_map(|row| Some((*row.at.first()?, *row.at.get(1)?)))
                    .collect();
                let steps = path.len().saturating_sub(1);
                let mark = if is_dashed(arm, at) { Mark::Dashed } else { Mark::Line };
                let label = format!("{arm}, {readout}: {steps} steps");
                series.push(Series::new(label, role(arm, at), mark, path));
            }
            series.retain(|one| !one.points.is_empty());
            let Some(&(from_x, from_y)) = series.first().and_then(|one| one.points.first()) else {
                continue;
            };
            let trained = if is_trained { "was trained" } else { "was not trained" };
            let sentence = format!(
                "Where the best simultaneous and the best sequential run drive alone from \
                 ({from_x:.2}, {from_y:.3}), a start that {trained}."
            );
            let thesis = number.map_or(String::new(), |number| format!("figure {number}"));
            let title = if is_trained {
                "Trajectory from the trained start"
            } else {
                "Trajectory from another start"
            };
            let (x, y) = self.plane();
            figures.push((
                number,
                Figure {
                    caption: self.caption(
                        &format!("driven-{start}-{index}"),
                        &thesis,
                        title,
                        sentence,
                    ),
                    x,
                    y,
                    content: Content::Series(series),
                },
            ));
        }
        figures.sort_by_key(|(number, _)| number.unwrap_or(u32::MAX));
        figures.into_iter().map(|(_, figure)| figure).collect()
    }
}

/// The cells as rows from below, several together where they are too many: the largest of them; and
/// how many along each axis.
fn raster(cells: &[Place]) -> (Vec<Vec<f64>>, usize) {
    let columns = cells.iter().map(|cell| cell.0 + 1).max().unwrap_or(0);
    let rows = cells.iter().map(|cell| cell.1 + 1).max().unwrap_or(0);
    let merged = columns.max(rows).div_ceil(MOST_CELLS).max(1);
    let mut raster = vec![vec![f64::NAN; columns.div_ceil(merged)]; rows.div_ceil(merged)];
    for (column, row, value) in cells {
        let cell = &mut raster[row / merged][column / merged];
        *cell = cell.max(*value);
    }
    (raster, merged)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_cells_are_drawn_as_few() {
        assert_eq!(raster(&[(0, 0, 1.0), (1, 0, 2.0)]), (vec![vec![1.0, 2.0]], 1));
        let many: Vec<Place> =
            (0..100).map(|at| (at, 0, crate::report::figure::real(at))).collect();
        let (rows, merged) = raster(&many);
        assert_eq!((merged, rows[0].len(), rows[0][0], rows[0][49]), (2, 50, 1.0, 99.0));
    }
}
