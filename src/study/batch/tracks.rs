//! Where a policy drives: the states of some rollouts.

use crate::control::witness::{Happening, Needs, Standing, Witness};
use crate::learner::Model;
use crate::record::{EpisodeRow, StepRow};
use crate::signal::State;

/// A witness that keeps the states of some rollouts.
pub(super) struct Tracks {
    tracks: Vec<(u32, Vec<State>)>,
}

impl Tracks {
    /// Keeps those from the starts with the numbers `kept`, from 0.
    pub(super) fn new(kept: &[u32]) -> Self {
        Self { tracks: kept.iter().map(|index| (*index, Vec::new())).collect() }
    }

    /// What was kept, by the start's number.
    pub(super) fn into_tracks(self) -> Vec<(u32, Vec<State>)> {
        self.tracks
    }
}

impl Witness for Tracks {
    fn needs(&self) -> Needs {
        Needs { steps: !self.tracks.is_empty(), standings: false, rollouts: true }
    }

    fn allow_waiting(&mut self, _may_wait: bool) {}

    fn step(&mut self, row: &StepRow) {
        if let Some((_, states)) =
            self.tracks.iter_mut().find(|(index, _)| index + 1 == row.episode)
        {
            states.push(row.state);
        }
    }

    fn episode(&mut self, _row: &EpisodeRow) {}

    fn happening(&mut self, _happening: Happening) {}

    fn standing(&mut self, _standing: Standing) {}

    fn policy(&mut self, _percent: Option<u8>, _learner: &Model) {}

    fn lost(&self) -> u64 {
        0
    }

    fn fault(&self) -> Option<String> {
        None
    }
}
