//! The data of figures, as tables in the folder `figures`.
//!
//! | file | of the thesis |
//! | --- | --- |
//! | `checkpoints.csv` | 45 (and 37, 38): each policy at each tenth, mean and standard error |
//! | `generalisation.csv` | 46: differences over all starts of a set, as the thesis takes them and plainly |
//! | `cells.csv` | 49: the same at the end, start by start |
//! | `q-function.csv` | 47, 48: the largest value in each cell, of each arm's best run |
//! | `trajectories.csv` | 50–53: where the best runs drive |
//! | `curves.csv` | 54, 55 (and 33, 34): success and share over the rollouts, of all runs |

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::StudyError;
use super::params::{Pair, Readout, Starts};
use super::plan::{Labels, Run, Study, What};
use super::results::Done;
use super::summary::{Group, Summary, headlines};
use super::table::{folder_in, rows_of, whole};
use crate::report::achieved::yardstick;
use crate::report::metrics::mean;

/// Writes the data of figures of the `runs` of `study`, whose `summary` is known, into `folder`.
/// `read` gives what a run came to. What the runs of one setting and operator did is held in
/// memory at a time.
///
/// # Errors
/// When the disk refuses.
pub fn draw(
    folder: &Path,
    study: &Study,
    runs: &[&Run],
    summary: &Summary,
    read: &dyn Fn(u32) -> Option<Done>,
) -> Result<(), StudyError> {
    let folder = folder_in(folder, "figures")?;
    let board = Board { folder: &folder, study, runs, read };
    board.checkpoints(summary)?;
    let best = board.curves()?;
    board.tables(&best)?;
    board.trajectories(&best)?;
    board.differences()
}

struct Board<'a> {
    folder: &'a Path,
    study: &'a Study,
    runs: &'a [&'a Run],
    read: &'a dyn Fn(u32) -> Option<Done>,
}

/// Whose the best run of an arm is: setting, operator and arm.
type Whose = (String, String, String);

/// How good a run is, less being better, and its number.
type Score = (Vec<f64>, u32);

impl Board<'_> {
    fn checkpoints(&self, summary: &Summary) -> Result<(), StudyError> {
        whole(&self.folder.join("checkpoints.csv"), |file| {
            let mut table = rows_of(file);
            table.write_record([
                "setting",
                "operator",
                "checkpoint",
                "start",
                "measure",
                "arm",
                "readout",
                "n",
                "mean",
                "standard_error",
            ])?;
            for Group { of, arm, readout, spread } in &summary.groups {
                let (n, mean, error) = (spread.n, spread.mean, spread.standard_error);
                table.serialize((of, arm, readout, n, mean, error))?;
            }
            Ok(table.flush()?)
        })
    }

    /// Writes how all runs went; returns the best run of each arm.
    fn curves(&self) -> Result<BTreeMap<Whose, Score>, StudyError> {
        let mut best: BTreeMap<Whose, Score> = BTreeMap::new();
        whole(&self.folder.join("curves.csv"), |file| {
            let mut table = rows_of(file);
            table.write_record([
                "run", "arm", "operator", "setting", "seed", "episode", "success", "share", "value",
            ])?;
            for done in self.runs.iter().filter_map(|run| (self.read)(run.number)) {
                for point in &done.curve {
                    table.serialize((&done.labels, point))?;
                }
                let Labels { arm, operator, setting, run, .. } = &done.labels;
                if let Some(score) = self.score(&done) {
                    let whose = (setting.clone(), operator.clone(), arm.clone());
                    let score = (score, *run);
                    let known = best.entry(whose).or_insert_with(|| score.clone());
                    if score < *known {
                        *known = score;
                    }
                }
            }
            Ok(table.flush()?)
        })?;
        Ok(best)
    }

    /// The readout by which the runs of `arm` are judged: that of the first pair it is in.
    fn judged(&self, arm: &str) -> Readout {
        let sides = self.study.pairs().into_iter().flat_map(|Pair { of, from }| [of, from]);
        let named = sides.into_iter().find(|(name, _)| name == arm).map(|(_, readout)| readout);
        named.unwrap_or(self.study.params.readouts[0])
    }

    /// What the final policy of a run came to, from each set of starts, less being better; none
    /// of references.
    fn score(&self, done: &Done) -> Option<Vec<f64>> {
        let is_arm = self.study.params.arms.iter().any(|arm| arm.name == done.labels.arm);
        let readout = is_arm.then(|| self.judged(&done.labels.arm))?;
        let task = self.study.task();
        let (headline, _) = headlines(task).first()?;
        let sign = if yardstick(task).more_is_better { -1.0 } else { 1.0 };
        let score = |starts: &Starts| {
            let row = done.rows.iter().find(|row| {
                (row.checkpoint, &*row.readout) == (100, readout.word())
                    && (&row.start, &*row.measure) == (&starts.name, headline)
            });
            row.map(|row| sign * row.value)
        };
        self.study.params.starts.iter().map(score).collect()
    }

    /// The best runs, one after the other.
    fn each<'b>(
        &'b self,
        best: &'b BTreeMap<Whose, Score>,
    ) -> impl Iterator<Item = Done> + use<'b> {
        best.values().filter_map(|(_, run)| (self.read)(*run))
    }

    fn tables(&self, best: &BTreeMap<Whose, Score>) -> Result<(), StudyError> {
        if self.each(best).all(|done| done.table.is_none()) {
            return Ok(());
        }
        whole(&self.folder.join("q-function.csv"), |file| {
            let mut csv = rows_of(file);
            csv.write_record(["setting", "arm", "run", "position_cell", "velocity_cell", "value"])?;
            for done in self.each(best) {
                let Labels { setting, arm, run, .. } = &done.labels;
                let Some(table) = &done.table else { continue };
                for (cell, value) in (0..).zip(&table.values) {
                    let (position, velocity) = (cell / table.row, cell % table.row);
                    csv.serialize((setting, arm, run, position, velocity, value))?;
                }
            }
            Ok(csv.flush()?)
        })
    }

    fn trajectories(&self, best: &BTreeMap<Whose, Score>) -> Result<(), StudyError> {
        if self.each(best).all(|done| done.trajectories.is_empty()) {
            return Ok(());
        }
        whole(&self.folder.join("trajectories.csv"), |file| {
            let mut table = rows_of(file);
            let before = ["setting", "arm", "run", "readout", "start", "index", "step"];
            let columns = self.study.profile(&self.study.runs[0]).experiment.columns();
            table.write_record(before.iter().chain(columns))?;
            for done in self.each(best) {
                let Labels { setting, arm, run, .. } = &done.labels;
                for track in &done.trajectories {
                    for (step, state) in (0_u32..).zip(&track.states) {
                        table.serialize((
                            (setting, arm, run),
                            (&track.readout, &track.start, track.index, step),
                            state,
                        ))?;
                    }
                }
            }
            Ok(table.flush()?)
        })
    }

    /// How arms differ over the starts of a set.
    fn differences(&self) -> Result<(), StudyError> {
        let (mut wholes, mut singles) = (Vec::new(), Vec::new());
        let is_one = |a: &&Run, b: &&Run| a.setting == b.setting && operator(a) == operator(b);
        for chunk in self.runs.chunk_by(is_one) {
            let fields = self.fields(chunk);
            for pair in self.study.pairs() {
                self.compare(&fields, &pair, (&mut wholes, &mut singles));
            }
        }
        if wholes.is_empty() {
            return Ok(());
        }
        self.generalisation(&wholes)?;
        self.cells(&singles)
    }

    /// Adds how the sides of `pair` differ: over all starts, and at the end from each.
    fn compare(
        &self,
        fields: &Fields,
        pair: &Pair,
        (wholes, singles): (&mut Wholes, &mut Singles),
    ) {
        let less_is_better = !yardstick(self.study.task()).more_is_better;
        for (place, arms) in fields {
            let side = |(arm, readout): &(String, Readout)| {
                arms.get(&(arm.clone(), readout.word().to_owned()))
            };
            let (Some(a), Some(b)) = (side(&pair.of), side(&pair.from)) else { continue };
            let starts = a.first().map_or(0, |run| run.values.len());
            let cells: Vec<Cell> =
                (0..starts).filter_map(|index| Cell::of(index, a, b, less_is_better)).collect();
            let labels = (place.clone(), pair.clone());
            if place.2 == 100 {
                singles
                    .extend((0..).zip(&cells).map(|(index, cell)| (labels.clone(), index, *cell)));
            }
            wholes.push((labels, Cell::mean(&cells)));
        }
    }

    fn generalisation(&self, wholes: &[(Compared, Cell)]) -> Result<(), StudyError> {
        whole(&self.folder.join("generalisation.csv"), |file| {
            let mut table = rows_of(file);
            table.write_record(COMPARED.iter().chain(&DIFFERENCES))?;
            for (labels, cell) in wholes {
                table.serialize((flat(labels), cell))?;
            }
            Ok(table.flush()?)
        })
    }

    fn cells(&self, singles: &[(Compared, u32, Cell)]) -> Result<(), StudyError> {
        let profile = self.study.profile(&self.study.runs[0]);
        let task = profile.experiment.task(profile.tick());
        let columns = profile.experiment.columns();
        whole(&self.folder.join("cells.csv"), |file| {
            let mut table = rows_of(file);
            let head = COMPARED.iter().chain(&["index"]).chain(columns).chain(&DIFFERENCES);
            table.write_record(head)?;
            for (labels, index, cell) in singles {
                let set = self.study.params.starts.iter().find(|starts| starts.name == labels.0.3);
                // The places of drawn starts differ from seed to seed.
                let place: Vec<Option<f64>> = match set {
                    Some(set) if !set.random => {
                        task.grid_start(*index, set.count).iter().copied().map(Some).collect()
                    }
                    _ => vec![None; columns.len()],
                };
                table.serialize((flat(labels), index, place, cell))?;
            }
            Ok(table.flush()?)
        })
    }

    /// What the policies of `runs` did from each start, by arm and readout.
    fn fields(&self, runs: &[&Run]) -> Fields {
        let mut fields = Fields::new();
        for done in runs.iter().filter_map(|run| (self.read)(run.number)) {
            let Labels { arm, operator, setting, seed, .. } = done.labels;
            for cells in done.cells {
                let key = (setting.clone(), operator.clone(), cells.checkpoint, cells.start);
                let of = OfRun { seed, values: cells.values, returns: cells.returns };
                let arm = (arm.clone(), cells.readout);
                fields.entry(key).or_default().entry(arm).or_default().push(of);
            }
        }
        fields
    }
}

/// Who steered.
fn operator(run: &Run) -> Option<&crate::operator::Choice> {
    match &run.what {
        What::Session { operator, .. } => Some(operator),
        What::References => None,
    }
}

/// Setting, operator, checkpoint and set of starts.
type Place = (String, String, u8, String);
type Fields = BTreeMap<Place, BTreeMap<(String, String), Vec<OfRun>>>;
/// What is compared, and where.
type Compared = (Place, Pair);
type Wholes = Vec<(Compared, Cell)>;
type Singles = Vec<(Compared, u32, Cell)>;
/// The same as columns.
type Labelled<'a> = (&'a str, &'a str, u8, &'a str, Side<'a>, Side<'a>);
type Side<'a> = (&'a str, &'static str);

const COMPARED: [&str; 8] =
    ["setting", "operator", "checkpoint", "start", "arm", "readout", "from_arm", "from_readout"];
const DIFFERENCES: [&str; 3] = ["difference", "normalised_return", "relative_to_best"];

/// What a run's policy did from each start.
struct OfRun {
    seed: u64,
    values: Vec<f64>,
    returns: Vec<f64>,
}

/// How two arms differ from one start, the mean over the seeds that both have.
#[derive(Clone, Copy, Debug, Serialize)]
struct Cell {
    /// Of what the task is measured by.
    difference: f64,
    /// Of the return over the best of all runs from there, as the thesis takes it; large or upside
    /// down where the best is near 0 or negative.
    normalised: f64,
    /// Of how near each comes to the best of all runs from there, 1 being as good.
    relative: f64,
}

impl Cell {
    /// The mean over starts; numbers that are none are left out.
    fn mean(cells: &[Self]) -> Self {
        let of = |number: fn(&Self) -> f64| {
            let numbers = cells.iter().map(number).filter(|number| number.is_finite());
            mean(&numbers.collect::<Vec<_>>())
        };
        Self {
            difference: of(|cell| cell.difference),
            normalised: of(|cell| cell.normalised),
            relative: of(|cell| cell.relative),
        }
    }

    fn of(index: usize, a: &[OfRun], b: &[OfRun], less_is_better: bool) -> Option<Self> {
        let all = || a.iter().chain(b);
        let returns = all().filter_map(|run| run.returns.get(index)).copied();
        let best_return = returns.fold(f64::NEG_INFINITY, f64::max);
        let values = all().filter_map(|run| run.values.get(index)).copied();
        let best = if less_is_better {
            values.fold(f64::INFINITY, f64::min)
        } else {
            values.fold(f64::NEG_INFINITY, f64::max)
        };
        let near = |value: f64| if less_is_better { best / value } else { value / best };
        let (mut differences, mut normalised, mut relative) = (Vec::new(), Vec::new(), Vec::new());
        for run in a {
            let Some(other) = b.iter().find(|other| other.seed == run.seed) else { continue };
            let (value, from) = (run.values.get(index)?, other.values.get(index)?);
            differences.push(value - from);
            normalised.push((run.returns.get(index)? - other.returns.get(index)?) / best_return);
            relative.push(near(*value) - near(*from));
        }
        (!differences.is_empty()).then(|| Self {
            difference: mean(&differences),
            normalised: mean(&normalised),
            relative: mean(&relative),
        })
    }
}

/// The labels of a row, one after the other.
fn flat(((setting, operator, checkpoint, start), Pair { of, from }): &Compared) -> Labelled<'_> {
    (setting, operator, *checkpoint, start, (&of.0, of.1.word()), (&from.0, from.1.word()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_start_is_judged_by_the_best_from_there() {
        let run =
            |seed, steps: f64| OfRun { seed, values: vec![steps], returns: vec![101.0 - steps] };
        let (a, b) = ([run(1, 50.0), run(2, 100.0)], [run(1, 100.0), run(2, 100.0)]);
        let cell = Cell::of(0, &a, &b, true).unwrap();
        assert_eq!(cell.difference, -25.0);
        assert_eq!(cell.relative, 0.25);
        assert!((cell.normalised - 25.0 / 51.0).abs() < 1e-12);
        assert!(Cell::of(1, &a, &b, true).is_none());
        assert!(Cell::of(0, &a, &[run(3, 1.0)], true).is_none(), "no seed in common");
    }
}
