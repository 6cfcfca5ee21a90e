//! The data of figures, as tables in the folder `figures`.
//!
//! | file | of the thesis |
//! | --- | --- |
//! | `checkpoints.csv` | 45 (and 37, 38): each policy at each tenth, mean and standard error |
//! | `generalisation.csv` | 46: differences over all starts of a set, as the thesis takes them and plainly |
//! | `cells.csv` | 49: the same at the last checkpoint, start by start |
//! | `q-function.csv` | 47, 48: the largest value in each cell, of each arm's best run |
//! | `trajectories.csv` | 50–53: where the best runs drive |
//! | `curves.csv` | 54, 55 (and 33, 34): success and share over the rollouts, of all runs |

use std::collections::BTreeMap;
use std::path::Path;

use super::StudyError;
use super::fields::{Cell, Fields, Place};
use super::params::{Pair, Readout, Starts};
use super::plan::{Labels, Run, Study};
use super::results::Done;
use super::summary::{Group, Part};
use super::table::{Sheet, folder_in};
use super::words::headlines;
use crate::report::achieved::yardstick;
use crate::task::Task;

/// What two sides are, in tables of differences.
const COMPARED: [&str; 9] = [
    "setting",
    "operator",
    "checkpoint",
    "start",
    "arm",
    "readout",
    "from_arm",
    "from_readout",
    "from_operator",
];
const DIFFERENCES: [&str; 3] = ["difference", "normalised_return", "relative_to_best"];

/// The tables, while runs are read.
pub(super) struct Figures<'a> {
    study: &'a Study,
    checkpoints: Sheet,
    curves: Sheet,
    generalisation: Sheet,
    cells: Sheet,
    values: Sheet,
    trajectories: Sheet,
}

impl<'a> Figures<'a> {
    /// Begins them in `folder`.
    pub(super) fn begin(folder: &Path, study: &'a Study) -> Result<Self, StudyError> {
        let folder = folder_in(folder, "figures")?;
        let at = |name: &str| folder.join(name);
        let of_group = ["setting", "operator", "checkpoint", "start", "measure", "arm", "readout"];
        let of_run = ["setting", "operator", "arm", "run"];
        let columns = study.columns();
        Ok(Self {
            study,
            checkpoints: Sheet::begin(
                at("checkpoints.csv"),
                of_group.iter().chain(&["n", "mean", "standard_error"]),
            )?,
            curves: Sheet::begin(
                at("curves.csv"),
                &[
                    "run", "arm", "operator", "setting", "seed", "episode", "success", "share",
                    "value",
                ],
            )?,
            generalisation: Sheet::begin(
                at("generalisation.csv"),
                COMPARED.iter().chain(&DIFFERENCES),
            )?,
            cells: Sheet::begin(
                at("cells.csv"),
                COMPARED.iter().chain(&["index"]).chain(columns).chain(&DIFFERENCES),
            )?,
            values: Sheet::begin(
                at("q-function.csv"),
                of_run.iter().chain(&["position_cell", "velocity_cell", "value"]),
            )?,
            trajectories: Sheet::begin(
                at("trajectories.csv"),
                of_run.iter().chain(&["readout", "start", "index", "step"]).chain(columns),
            )?,
        })
    }

    /// Puts them in their places; those without a row are left out.
    pub(super) fn keep(self) -> Result<(), StudyError> {
        self.checkpoints.keep()?;
        self.curves.keep()?;
        self.generalisation.keep_if_filled()?;
        self.cells.keep_if_filled()?;
        self.values.keep_if_filled()?;
        self.trajectories.keep_if_filled()
    }

    /// Takes in how the main phase of a run went.
    pub(super) fn curve(&mut self, done: &Done) -> Result<(), StudyError> {
        done.curve.iter().try_for_each(|point| self.curves.row((&done.labels, point)))
    }

    /// Takes in what the policies of runs came to.
    pub(super) fn parts(&mut self, parts: &[Part]) -> Result<(), StudyError> {
        for Group { of, arm, readout, spread } in parts.iter().flat_map(|part| &part.groups) {
            let (n, mean, error) = (spread.n, spread.mean, spread.standard_error);
            self.checkpoints.row((of, arm, readout, n, mean, error))?;
        }
        Ok(())
    }

    /// Takes in how arms differ over the starts of each set; `run` is one of the runs.
    pub(super) fn fields(&mut self, fields: &Fields, run: &Run) -> Result<(), StudyError> {
        let profile = self.study.profile(run)?;
        let task = profile.experiment.task(profile.tick());
        let yardstick = yardstick(self.study.task());
        for pair in self.study.pairs() {
            for (place, field) in fields.of(&pair.of) {
                for operator in self.study.opposite(&pair.of.0, &pair.from.0, &place.operator) {
                    let across = Place { operator, ..place.clone() };
                    let cells = fields
                        .at(&across, &pair.from)
                        .map_or_else(Vec::new, |from| field.against(from, &yardstick));
                    if !cells.is_empty() {
                        self.compared(&(place, &pair, &across.operator), &cells, &*task)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Takes in how the sides of a pair differ: over all starts, and at the end from each.
    fn compared(
        &mut self,
        compared: &Compared<'_>,
        cells: &[(u32, Cell)],
        task: &dyn Task,
    ) -> Result<(), StudyError> {
        self.generalisation.row((flat(compared), Cell::mean(cells)))?;
        let (place, ..) = compared;
        if place.checkpoint != self.study.last_checkpoint() {
            return Ok(());
        }
        let set = self.study.params.starts.iter().find(|starts| starts.name == place.start);
        for (index, cell) in cells {
            // The places of drawn starts differ from seed to seed.
            let start: Vec<Option<f64>> = match set {
                Some(set) if !set.random => {
                    task.grid_start(*index, set.count).iter().copied().map(Some).collect()
                }
                _ => vec![None; self.study.columns().len()],
            };
            self.cells.row((flat(compared), index, start, cell))?;
        }
        Ok(())
    }

    /// Takes in what the best runs learned and where they drive. `read` gives what a run came to.
    pub(super) fn best(
        &mut self,
        best: Best,
        read: &dyn Fn(u32) -> Option<Done>,
    ) -> Result<(), StudyError> {
        for done in best.0.into_values().filter_map(|(_, run)| read(run)) {
            let Labels { setting, operator, arm, run, .. } = &done.labels;
            let labels = (setting, operator, arm, run);
            if let Some(table) = &done.table {
                for (cell, value) in (0..).zip(&table.values) {
                    let (position, velocity) = (cell / table.row, cell % table.row);
                    self.values.row((labels, position, velocity, value))?;
                }
            }
            for track in &done.trajectories {
                for (step, state) in (0_u32..).zip(&track.states) {
                    let of_track = (&track.readout, &track.start, track.index, step);
                    self.trajectories.row((labels, of_track, state))?;
                }
            }
        }
        Ok(())
    }
}

/// The best run of each operator and arm: its score, less being better, and its number.
#[derive(Default)]
pub(super) struct Best(BTreeMap<(String, String), (Vec<f64>, u32)>);

impl Best {
    /// Takes in what a run of `study` came to.
    pub(super) fn take(&mut self, study: &Study, done: &Done) {
        let Labels { arm, operator, run, .. } = &done.labels;
        if let Some(score) = score(study, done) {
            let score = (score, *run);
            let known =
                self.0.entry((operator.clone(), arm.clone())).or_insert_with(|| score.clone());
            if score < *known {
                *known = score;
            }
        }
    }
}

/// What the last policy of a run came to, from each set of starts, less being better; none of
/// references.
fn score(study: &Study, done: &Done) -> Option<Vec<f64>> {
    let is_arm = study.params.arms.iter().any(|arm| arm.name == done.labels.arm);
    let readout = is_arm.then(|| judged(study, &done.labels.arm))?;
    let (headline, _) = headlines(study.task()).first()?;
    let sign = if yardstick(study.task()).more_is_better { -1.0 } else { 1.0 };
    let score = |starts: &Starts| {
        let row = done.rows.iter().find(|row| {
            (row.checkpoint, &*row.readout) == (study.last_checkpoint(), readout.word())
                && (&row.start, &*row.measure) == (&starts.name, headline)
        });
        row.map(|row| sign * row.value)
    };
    study.params.starts.iter().map(score).collect()
}

/// The readout by which the runs of `arm` are judged: that of the first pair it is in.
fn judged(study: &Study, arm: &str) -> Readout {
    let sides = study.pairs().into_iter().flat_map(|Pair { of, from }| [of, from]);
    let named = sides.into_iter().find(|(name, _)| name == arm).map(|(_, readout)| readout);
    named.unwrap_or(study.params.readouts[0])
}

/// What is compared: where, which sides, and who steered the second one.
type Compared<'a> = (&'a Place, &'a Pair, &'a str);
/// The same as columns.
type Columns<'a> = ((&'a str, &'a str, u8, &'a str), Side<'a>, Side<'a>, &'a str);
type Side<'a> = (&'a str, &'static str);

/// The labels of a row, one after the other.
fn flat<'a>((place, Pair { of, from }, operator): &Compared<'a>) -> Columns<'a> {
    let Place { setting, operator: steered, checkpoint, start } = place;
    let place = (&**setting, &**steered, *checkpoint, &**start);
    (place, (&of.0, of.1.word()), (&from.0, from.1.word()), operator)
}
