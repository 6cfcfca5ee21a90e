//! The tables of a session: their columns, and their rows one at a time.

use std::borrow::Cow;
use std::collections::HashMap;

use serde::Serialize;

use super::Recorded;
use super::columns::{Column, column};
use super::survey::Walk;
use crate::record::names::{
    EPISODE_COLUMNS, EPISODES, EVALUATION, EVALUATION_COLUMNS, EVENT_COLUMNS, EVENTS,
    LATER_STEP_COLUMNS, STEP_COLUMNS, STEPS,
};
use crate::record::reader::{Episodes, Steps, read_evaluation, read_events};
use crate::record::{EpisodeRow, Error, EvaluationRow, EventRow, StepRow};
use crate::session::Phase;
use crate::signal::End;

/// A cell of a row.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Cell<'a> {
    /// Nothing is known.
    Missing,
    /// A word or text.
    Text(Cow<'a, str>),
    /// A number without fraction.
    Whole(u32),
    /// Any number.
    Number(f64),
}

impl From<f64> for Cell<'_> {
    fn from(number: f64) -> Self {
        if number.is_nan() { Self::Missing } else { Self::Number(number) }
    }
}

impl From<u32> for Cell<'_> {
    fn from(number: u32) -> Self {
        Self::Whole(number)
    }
}

impl<'a> From<&'a str> for Cell<'a> {
    fn from(text: &'a str) -> Self {
        if text.is_empty() { Self::Missing } else { Self::Text(Cow::Borrowed(text)) }
    }
}

impl From<String> for Cell<'_> {
    fn from(text: String) -> Self {
        if text.is_empty() { Self::Missing } else { Self::Text(Cow::Owned(text)) }
    }
}

impl<T: Into<Self>> From<Option<T>> for Cell<'_> {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Missing, Into::into)
    }
}

/// The cells of a row, in the order of the columns.
pub type Cells<'a> = Vec<Cell<'a>>;

/// A table.
pub struct Table<'a> {
    /// Its name: `steps`, `episodes`, `events` or `evaluation`.
    pub name: &'static str,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Its rows.
    pub rows: Box<dyn Iterator<Item = Result<Cells<'a>, Error>> + 'a>,
}

/// The columns that say in every table of which session a row is.
const SESSION_COLUMNS: [&str; 5] = ["subject", "trial", "task", "preset", "mode"];

/// All tables of `session`.
///
/// # Errors
/// When a table cannot be opened.
pub fn tables(session: &Recorded) -> Result<Vec<Table<'_>>, Error> {
    let mut tables = vec![steps(session)?, episodes(session)?, events(session)?];
    tables.extend(evaluation(session)?);
    Ok(tables)
}

impl Recorded {
    /// The columns of every table, then `names`.
    fn columns<'n>(&self, names: impl IntoIterator<Item = &'n str>) -> Vec<Column> {
        let names = SESSION_COLUMNS.into_iter().chain(names);
        names.map(|name| column(&self.facts.task, name)).collect()
    }

    /// The cells of every row.
    fn cells(&self) -> Cells<'_> {
        let facts = &self.facts;
        vec![
            facts.subject.as_str().into(),
            facts.trial.0.into(),
            facts.task.as_str().into(),
            facts.preset.as_str().into(),
            facts.mode.word().into(),
        ]
    }
}

fn steps(session: &Recorded) -> Result<Table<'_>, Error> {
    let steps = Steps::open(&session.file(STEPS))?;
    let (before, after) = STEP_COLUMNS;
    let state: Vec<String> = steps.columns().to_vec();
    let names = before.into_iter().chain(state.iter().map(String::as_str));
    let names = names.chain(after).chain(LATER_STEP_COLUMNS).chain(["attempt", "end"]);
    let (mut walk, mut rollouts, mut current) = (Walk::default(), session.rollouts.iter(), None);
    let rows = steps.map(move |row| {
        let row = row?;
        if walk.begins(&row) {
            current = rollouts.next();
        }
        let mut cells = session.cells();
        put_step(&mut cells, row);
        cells.push(current.map(|rollout| rollout.attempt).into());
        cells.push(current.and_then(|rollout| rollout.end).map(End::word).into());
        Ok(cells)
    });
    Ok(Table { name: "steps", columns: session.columns(names), rows: Box::new(rows) })
}

fn put_step(cells: &mut Cells<'_>, row: StepRow<String>) {
    cells.extend([row.phase.word().into(), row.episode.into(), row.step.into(), row.t.into()]);
    cells.extend(row.state.iter().map(|number| Cell::from(*number)));
    cells.extend([
        row.u_human.into(),
        row.u_machine.into(),
        row.share.into(),
        row.u.into(),
        row.u_applied.into(),
        row.reward.into(),
        row.success.into(),
        row.region.into(),
        row.lateness_us.into(),
        row.raw.into(),
    ]);
}

fn episodes(session: &Recorded) -> Result<Table<'_>, Error> {
    let episodes = Episodes::open(&session.file(EPISODES))?;
    let tally: Vec<String> = episodes.tally().to_vec();
    let names = EPISODE_COLUMNS.into_iter().chain(tally.iter().map(String::as_str));
    let mut attempts = HashMap::new();
    let rows = episodes.map(move |row| {
        let row = row?;
        let counted: &mut u32 = attempts.entry((row.phase, row.episode)).or_default();
        let mut cells = session.cells();
        put_episode(&mut cells, &row);
        cells.push((*counted).into());
        *counted += 1;
        Ok(cells)
    });
    let columns = session.columns(names.chain(["attempt"]));
    Ok(Table { name: "episodes", columns, rows: Box::new(rows) })
}

fn put_episode(cells: &mut Cells<'_>, row: &EpisodeRow) {
    cells.extend([
        row.phase.word().into(),
        row.episode.into(),
        row.start.into(),
        row.steps.into(),
        row.duration_s.into(),
        row.end.word().into(),
        row.total.into(),
        row.mean_reward.into(),
        row.share.into(),
        row.success.into(),
        row.receptive_fields.into(),
    ]);
    cells.extend(row.tallied.iter().map(|number| Cell::from(*number)));
}

fn events(session: &Recorded) -> Result<Table<'_>, Error> {
    let rows = read_events(&session.file(EVENTS))?.into_iter().map(move |row| {
        let EventRow { time, phase, episode, step, event, cause } = row;
        let mut cells = session.cells();
        cells.extend([
            time.into(),
            phase.map(Phase::word).into(),
            episode.into(),
            step.into(),
            event.into(),
            cause.into(),
        ]);
        Ok(cells)
    });
    Ok(Table { name: "events", columns: session.columns(EVENT_COLUMNS), rows: Box::new(rows) })
}

/// The policies of the tenths, where they were tested.
fn evaluation(session: &Recorded) -> Result<Option<Table<'_>>, Error> {
    let path = session.file(EVALUATION);
    if !path.exists() {
        return Ok(None);
    }
    let read = read_evaluation(&path)?;
    // Tested by the task's own measures, as the rollouts are.
    let tally: Vec<String> = Episodes::open(&session.file(EPISODES))?.tally().to_vec();
    let names = EVALUATION_COLUMNS.into_iter().chain(tally.iter().map(String::as_str));
    let columns = session.columns(names);
    let rows = read.into_iter().map(move |row| {
        let mut cells = session.cells();
        put_evaluation(&mut cells, row);
        Ok(cells)
    });
    Ok(Some(Table { name: "evaluation", columns, rows: Box::new(rows) }))
}

fn put_evaluation(cells: &mut Cells<'_>, row: EvaluationRow) {
    cells.extend([
        row.policy.into(),
        row.episode.into(),
        row.start.into(),
        row.steps.into(),
        row.duration_s.into(),
        row.end.word().into(),
        row.total.into(),
        row.mean_reward.into(),
    ]);
    cells.extend(row.tallied.iter().map(|number| Cell::from(*number)));
}
