//! How two arms differ from start to start.

use std::collections::BTreeMap;

use serde::Serialize;

use super::params::Readout;
use super::results::{Cells, Done};
use crate::report::achieved::Yardstick;
use crate::report::metrics::mean;

/// What policies did from each start, of runs that are compared.
#[derive(Default)]
pub(super) struct Fields(BTreeMap<Place, BTreeMap<(String, String), Field>>);

/// When and where policies were tested.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place {
    /// The setting,
    pub(super) setting: String,
    /// who steered,
    pub(super) operator: String,
    /// after how much of main, %,
    pub(super) checkpoint: u8,
    /// and the set of starts.
    pub(super) start: String,
}

impl Fields {
    /// Takes in what a run came to.
    pub(super) fn take(&mut self, done: Done) {
        let labels = done.labels;
        for Cells { checkpoint, readout, start, values, returns } in done.cells {
            let (setting, operator) = (labels.setting.clone(), labels.operator.clone());
            let arms = self.0.entry(Place { setting, operator, checkpoint, start }).or_default();
            let field = arms.entry((labels.arm.clone(), readout)).or_default();
            field.0.insert(labels.seed, OfRun { values, returns });
        }
    }

    /// The fields of `side`, each with its place.
    pub(super) fn of(&self, side: &(String, Readout)) -> impl Iterator<Item = (&Place, &Field)> {
        let key = (side.0.clone(), side.1.word().to_owned());
        self.0.iter().filter_map(move |(place, arms)| Some((place, arms.get(&key)?)))
    }

    /// The field of `side` at `place`.
    pub(super) fn at(&self, place: &Place, side: &(String, Readout)) -> Option<&Field> {
        self.0.get(place)?.get(&(side.0.clone(), side.1.word().to_owned()))
    }
}

/// What the policies of an arm did from each start, by seed.
#[derive(Default)]
pub(super) struct Field(BTreeMap<u64, OfRun>);

/// What a run's policy did from each start.
struct OfRun {
    values: Vec<f64>,
    returns: Vec<f64>,
}

/// How two arms differ from one start, the mean over the seeds that both have.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Cell {
    /// Of what the task is measured by.
    difference: f64,
    /// Of the return over the best of all runs of both arms from there, as the thesis takes it;
    /// large or upside down where that best is near 0 or negative.
    normalised: Option<f64>,
    /// Of how near each comes to the best of all runs of both arms from there, 1 being as good;
    /// none where the measure may be negative.
    relative: Option<f64>,
}

impl Field {
    /// How it differs from the field `from`, start by start.
    pub(super) fn against(&self, from: &Self, yardstick: &Yardstick) -> Vec<(u32, Cell)> {
        let pairs: Vec<(&OfRun, &OfRun)> =
            self.0.iter().filter_map(|(seed, run)| Some((run, from.0.get(seed)?))).collect();
        let starts = self.0.values().next().map_or(0, |run| run.values.len());
        let runs: Vec<&OfRun> = self.0.values().chain(from.0.values()).collect();
        (0_u32..)
            .zip(0..starts)
            .filter_map(|(number, index)| {
                Some((number, Cell::of(index, &pairs, &runs, yardstick)?))
            })
            .collect()
    }
}

impl Cell {
    /// The mean over starts; numbers that are none are left out.
    pub(super) fn mean(cells: &[(u32, Self)]) -> Self {
        let of = |number: fn(&Self) -> Option<f64>| {
            mean_of(&cells.iter().filter_map(|(_, cell)| number(cell)).collect::<Vec<_>>())
        };
        Self {
            difference: of(|cell| Some(cell.difference)).unwrap_or_default(),
            normalised: of(|cell| cell.normalised),
            relative: of(|cell| cell.relative),
        }
    }

    /// How the `pairs` differ from the start `index`; `runs` are all of both sides.
    fn of(
        index: usize,
        pairs: &[(&OfRun, &OfRun)],
        runs: &[&OfRun],
        yardstick: &Yardstick,
    ) -> Option<Self> {
        let returns = runs.iter().filter_map(|run| run.returns.get(index)).copied();
        let best_return = returns.fold(f64::NEG_INFINITY, f64::max);
        let values = runs.iter().filter_map(|run| run.values.get(index)).copied();
        let best = if yardstick.more_is_better {
            values.fold(f64::NEG_INFINITY, f64::max)
        } else {
            values.fold(f64::INFINITY, f64::min)
        };
        let near = |value: f64| if yardstick.more_is_better { value / best } else { best / value };
        let (mut differences, mut normalised, mut relative) = (Vec::new(), Vec::new(), Vec::new());
        for (run, other) in pairs {
            let (value, from) = (run.values.get(index)?, other.values.get(index)?);
            differences.push(value - from);
            normalised.push((run.returns.get(index)? - other.returns.get(index)?) / best_return);
            relative.push(near(*value) - near(*from));
        }
        Some(Self {
            difference: mean_of(&differences)?,
            normalised: mean_of(&normalised).filter(|number| number.is_finite()),
            relative: mean_of(&relative)
                .filter(|number| yardstick.range.is_none() && number.is_finite()),
        })
    }
}

/// The mean; none of nothing.
fn mean_of(numbers: &[f64]) -> Option<f64> {
    (!numbers.is_empty()).then(|| mean(numbers))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::achieved::yardstick;

    fn field(runs: &[(u64, f64, f64)]) -> Field {
        let of =
            |&(seed, value, total)| (seed, OfRun { values: vec![value], returns: vec![total] });
        Field(runs.iter().map(of).collect())
    }

    #[test]
    fn a_start_is_judged_by_the_best_from_there() {
        let car = yardstick("mountain-car");
        let (a, b) = (
            field(&[(1, 50.0, 51.0), (2, 100.0, 1.0)]),
            field(&[(1, 100.0, 1.0), (2, 100.0, 1.0)]),
        );
        let cells = a.against(&b, &car);
        let (0, cell) = cells[0] else { panic!("{cells:?}") };
        assert_eq!((cells.len(), cell.difference, cell.relative), (1, -25.0, Some(0.25)));
        assert!((cell.normalised.unwrap() - 25.0 / 51.0).abs() < 1e-12);
        assert!(a.against(&field(&[(3, 1.0, 1.0)]), &car).is_empty(), "no seed in common");
    }

    /// -0.2 is higher than -0.8, but four times as near to the best would be four times as low.
    #[test]
    fn heights_which_may_be_negative_have_no_part_of_the_best() {
        let (a, b) = (field(&[(1, -0.2, -2.0)]), field(&[(1, -0.8, -8.0)]));
        let (_, cell) = a.against(&b, &yardstick("swing-up"))[0];
        assert_eq!(cell.relative, None);
        assert!((cell.difference - 0.6).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_divided_is_left_out() {
        let (a, b) = (field(&[(1, 0.0, 0.0)]), field(&[(1, 0.0, 0.0)]));
        let (_, cell) = a.against(&b, &yardstick("speed-up"))[0];
        assert_eq!((cell.normalised, cell.relative, cell.difference), (None, None, 0.0));
    }
}
