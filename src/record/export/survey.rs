//! The rollouts of a session as its rows tell: which attempt, how it ended, when it was.

use std::collections::HashMap;
use std::path::Path;

use crate::record::names::{EPISODES, STEPS};
use crate::record::reader::{Episodes, Steps};
use crate::record::{Error, StepRow};
use crate::session::Phase;
use crate::signal::End;

/// A rollout that has rows in `steps.csv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rollout {
    /// Its phase,
    pub phase: Phase,
    /// its number in the phase,
    pub episode: u32,
    /// and how often it was thrown away before.
    pub attempt: u32,
    /// How it ended; nothing of one that was cut off.
    pub end: Option<End>,
    /// The controlled time of all rollouts before, s.
    pub begins_s: f64,
    /// The time of its last row, s since it began,
    pub lasts_s: f64,
    /// and that row's step.
    pub last_step: u32,
}

/// The rollouts of the session in `folder`, in order.
///
/// # Errors
/// When a table does not read.
pub fn rollouts(folder: &Path) -> Result<Vec<Rollout>, Error> {
    let mut ends: HashMap<(Phase, u32), Vec<End>> = HashMap::new();
    for row in Episodes::open(&folder.join(EPISODES))? {
        let row = row?;
        ends.entry((row.phase, row.episode)).or_default().push(row.end);
    }
    let mut rollouts: Vec<Rollout> = Vec::new();
    let mut attempts: HashMap<(Phase, u32), u32> = HashMap::new();
    let (mut walk, mut tick_s) = (Walk::default(), 0.0);
    for row in Steps::open(&folder.join(STEPS))? {
        let row = row?;
        if row.step > 0 {
            tick_s = row.t / f64::from(row.step);
        }
        if walk.begins(&row) {
            let key = (row.phase, row.episode);
            let counted = attempts.entry(key).or_default();
            let attempt = *counted;
            *counted += 1;
            let end = ends.get(&key).and_then(|ends| ends.get(attempt as usize)).copied();
            // A tick after the last row of the one before.
            let begins_s =
                rollouts.last().map_or(0.0, |last| last.begins_s + last.lasts_s + tick_s);
            let (phase, episode) = key;
            rollouts.push(Rollout {
                phase,
                episode,
                attempt,
                end,
                begins_s,
                lasts_s: 0.0,
                last_step: 0,
            });
        }
        if let Some(rollout) = rollouts.last_mut() {
            (rollout.lasts_s, rollout.last_step) = (row.t, row.step);
        }
    }
    Ok(rollouts)
}

/// Tells where in `steps.csv` one rollout ends and the next begins.
#[derive(Clone, Copy, Debug, Default)]
pub struct Walk {
    before: Option<(Phase, u32, u32)>,
}

impl Walk {
    /// Whether `row`, which follows the one asked for last, begins a rollout: another, or the same
    /// once more after it was thrown away.
    pub fn begins<Name>(&mut self, row: &StepRow<Name>) -> bool {
        let before = self.before.replace((row.phase, row.episode, row.step));
        before.is_none_or(|(phase, episode, step)| {
            (phase, episode) != (row.phase, row.episode) || row.step <= step
        })
    }
}
