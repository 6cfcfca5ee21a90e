//! What a study writes down of a session: the policies when they are due, and how main went.

use std::path::{Path, PathBuf};

use super::results::{Point, Row};
use super::session::measures;
use crate::control::witness::{Happening, Needs, Standing, Witness};
use crate::learner::Model;
use crate::profile::Profile;
use crate::record::{self, EpisodeRow, StepFile, StepRow};
use crate::report::achieved::yardstick;
use crate::report::metrics::{counts, mean};
use crate::session::Phase;

/// Points of a curve, at most about so many.
const POINTS: u32 = 500;

/// The witness of a session in a study.
pub(super) struct Notes {
    task: &'static str,
    /// Policies that wait to be tested, with their percent.
    due: Vec<(u8, Model)>,
    /// The rollouts of main since the tenth before.
    tenth: Vec<EpisodeRow>,
    /// What they measured since the point before.
    values: Vec<f64>,
    curve: Vec<Point>,
    /// A point every so many rollouts.
    every: u32,
    steps: Option<(StepFile, PathBuf)>,
    fault: Option<record::Error>,
}

impl Notes {
    /// A witness that writes step rows to `steps`, if that is wanted.
    pub(super) fn new(profile: &Profile, steps: Option<&Path>) -> Result<Self, record::Error> {
        let file = |path: &Path| {
            let new = path.with_extension("csv.new");
            let _ = std::fs::remove_file(&new);
            Ok((StepFile::create(&new, profile.experiment.columns())?, path.to_owned()))
        };
        Ok(Self {
            task: profile.experiment.name(),
            due: Vec::new(),
            tenth: Vec::new(),
            values: Vec::new(),
            curve: Vec::new(),
            every: profile.session.main_rollouts.unwrap_or(0).div_ceil(POINTS).max(1),
            steps: steps.map(file).transpose()?,
            fault: None,
        })
    }

    /// The next policy to be tested, and after how much of main that is, %.
    pub(super) fn due(&mut self) -> Option<(u8, Model)> {
        (!self.due.is_empty()).then(|| self.due.remove(0))
    }

    /// How main went in the tenth that ended at `percent`.
    pub(super) fn tenth(&mut self, percent: u8) -> Vec<Row> {
        let rows = std::mem::take(&mut self.tenth);
        let rows: Vec<&EpisodeRow> = rows.iter().collect();
        let last = rows.last();
        let ends = [
            ("success", last.and_then(|row| row.success)),
            ("share", last.and_then(|row| row.share)),
            ("receptive_fields", last.and_then(|row| row.receptive_fields).map(f64::from)),
        ];
        let ends = ends.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?)));
        let row = |(measure, value)| Row {
            checkpoint: percent,
            readout: "team".to_owned(),
            start: "main".to_owned(),
            measure,
            value,
        };
        measures(self.task, &rows).into_iter().chain(ends).map(row).collect()
    }

    /// Why a step row could not be kept, if so.
    pub(super) fn refused(&mut self) -> Option<record::Error> {
        self.fault.take()
    }

    /// Closes the file of step rows, and hands out how main went.
    pub(super) fn close(self) -> Result<Vec<Point>, record::Error> {
        if let Some((file, path)) = self.steps {
            file.close(&path)?;
        }
        Ok(self.curve)
    }
}

impl Witness for Notes {
    fn needs(&self) -> Needs {
        Needs { steps: self.steps.is_some(), standings: false, rollouts: false }
    }

    fn allow_waiting(&mut self, _may_wait: bool) {}

    fn step(&mut self, row: &StepRow) {
        if let Some((file, _)) = &mut self.steps
            && let Err(error) = file.append(row)
        {
            self.fault.get_or_insert(error);
        }
    }

    fn episode(&mut self, row: &EpisodeRow) {
        if row.phase != Phase::Main || !counts(row) {
            return;
        }
        self.tenth.push(*row);
        self.values.extend((yardstick(self.task).of)(row));
        if row.episode.is_multiple_of(self.every) {
            let values = std::mem::take(&mut self.values);
            let value = (!values.is_empty()).then(|| mean(&values));
            let (episode, success) = (row.episode, row.success.unwrap_or(0.0));
            self.curve.push(Point { episode, success, share: row.share.unwrap_or(1.0), value });
        }
    }

    fn happening(&mut self, _happening: Happening) {}

    fn standing(&mut self, _standing: Standing) {}

    fn policy(&mut self, percent: Option<u8>, learner: &Model) {
        // The final one is that of the last tenth.
        self.due.extend(percent.map(|percent| (percent, learner.clone())));
    }

    fn lost(&self) -> u64 {
        0
    }

    fn fault(&self) -> Option<String> {
        self.fault.as_ref().map(ToString::to_string)
    }
}
