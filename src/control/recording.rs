//! A recorded session as the snapshots that a screen would have seen.
//!
//! All rows are in memory, so that any moment is at hand. What no row tells (the learner's inside,
//! countdowns, missed ticks) is not made up: the receptive fields are those at the end of the
//! rollout before.

use std::path::Path;

use super::snapshot::{MOST_REGIONS, Snapshot};
use crate::record::reader::{Episodes, Steps, read_events};
use crate::record::{self, EpisodeRow, EventRow, StepRow};
use crate::session::machine::Stage;
use crate::session::{Moment, Phase};
use crate::sharing::weight::Opened;
use crate::signal::{Action, End, Intent, Seconds, Tallied, Tick};
use crate::task::Task;

/// A row with its region's index in place of the name.
type Row = StepRow<u8>;

/// A recorded session.
pub struct Recording {
    rows: Vec<Row>,
    spans: Vec<Span>,
    episodes: Vec<EpisodeRow>,
    /// In each region the row at which the gate opened for good, and where that was.
    gates: [Option<(usize, Opened)>; MOST_REGIONS],
    /// In each region the row at which it was handed over for good.
    frozen: [Option<usize>; MOST_REGIONS],
    /// Success in main now and then, with the rows.
    successes: Vec<(usize, f64)>,
    task: Box<dyn Task>,
    trouble: Option<String>,
}

/// The rows of one rollout, at one attempt.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// Its first row.
    pub first: usize,
    /// How many rows it has.
    pub rows: usize,
    /// Where in the session it begins.
    pub moment: Moment,
    /// How it ended; `None` where the recording breaks off.
    pub end: Option<End>,
    /// The rollouts in `episodes.csv` that were over before it.
    pub rollouts_before: usize,
    /// Shares and successes that it begins with.
    regions: Regions,
    /// What the task's tally goes on from, where the plant did not return.
    unfinished: Tallied,
    /// The learner's receptive fields at its beginning.
    fields: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Regions {
    shares: [f64; MOST_REGIONS],
    successes: [f64; MOST_REGIONS],
}

impl Regions {
    const FULL: Self = Self { shares: [1.0; MOST_REGIONS], successes: [0.0; MOST_REGIONS] };

    fn see(&mut self, row: &Row) {
        let Some(region) = row.region.map(usize::from) else { return };
        if let (Some(share), Some(known)) = (row.share, self.shares.get_mut(region)) {
            *known = share;
        }
        if let (Some(success), Some(known)) = (row.success, self.successes.get_mut(region)) {
            *known = success;
        }
    }
}

impl Recording {
    /// Reads the rows of the session in `folder`, in which `task` was done; `returns`: each
    /// steered rollout began at the task's start. Reading ends at the first row that does not
    /// read, and [`trouble`](Self::trouble) says so.
    ///
    /// # Errors
    /// When a table is missing, is none of a session's, or has states of another task.
    pub fn read(folder: &Path, task: Box<dyn Task>, returns: bool) -> Result<Self, record::Error> {
        let steps = Steps::open(&folder.join("steps.csv"))?;
        let mut trouble = None;
        let episodes = whole(Episodes::open(&folder.join("episodes.csv"))?, &mut trouble);
        let columns = steps.columns().to_vec();
        let mut rows = Vec::new();
        if columns.is_empty() || columns == task.columns() {
            let names: Vec<&str> = task.regions().iter().map(|region| region.name).collect();
            rows = whole(steps.map(|row| row.map(|row| numbered(&row, &names))), &mut trouble);
        } else {
            trouble = Some(format!(
                "the states in steps.csv are {}, those of {} are {}: it is of another session",
                columns.join(","),
                task.name(),
                task.columns().join(",")
            ));
        }
        // Without events gates are not known; all else is.
        let events = read_events(&folder.join("events.csv")).unwrap_or_default();
        let mut recording = Self {
            spans: Vec::new(),
            gates: [None; MOST_REGIONS],
            frozen: [None; MOST_REGIONS],
            successes: Vec::new(),
            rows,
            episodes,
            task,
            trouble,
        };
        recording.find_spans(returns);
        recording.find_gates(&events);
        recording.sample();
        Ok(recording)
    }

    /// How many rows it has.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether it has none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Why not everything could be read.
    #[must_use]
    pub fn trouble(&self) -> Option<&str> {
        self.trouble.as_deref()
    }

    /// Its rollouts in order, each attempt for itself.
    #[must_use]
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// The index of the rollout to which row `at` belongs.
    #[must_use]
    pub fn span_at(&self, at: usize) -> usize {
        self.spans.partition_point(|span| span.first <= at).saturating_sub(1)
    }

    /// The rows of a rollout; none where there is no such.
    #[must_use]
    pub fn rows_of(&self, span: &Span) -> &[Row] {
        self.rows.get(span.first..span.first + span.rows).unwrap_or_default()
    }

    /// The rollouts that were over at row `at`, as `episodes.csv` has them.
    #[must_use]
    pub fn rollouts(&self, at: usize) -> &[EpisodeRow] {
        let over = self.spans.get(self.span_at(at)).map_or(0, |span| {
            span.rollouts_before
                + usize::from(span.end.is_some() && at + 1 == span.first + span.rows)
        });
        self.episodes.get(..over).unwrap_or(&self.episodes)
    }

    /// Success in main up to row `at`, now and then, oldest first.
    pub fn successes(&self, at: usize) -> impl Iterator<Item = f64> {
        let known = self.successes.partition_point(|(row, _)| *row <= at);
        self.successes[..known].iter().map(|(_, success)| *success)
    }

    /// What a screen would have seen at row `at`; of the last row where there are fewer.
    #[must_use]
    pub fn snapshot(&self, at: usize) -> Snapshot {
        let mut seen = Snapshot::before(Stage::Instruction(Moment::start_of(Phase::Introduction)));
        let at = at.min(self.rows.len().saturating_sub(1));
        let (Some(row), Some(span)) = (self.rows.get(at), self.spans.get(self.span_at(at))) else {
            return seen;
        };
        let past = self.rows.get(span.first..=at).unwrap_or_default();
        let mut regions = span.regions;
        for row in past {
            regions.see(row);
        }
        let region = row.region.map_or_else(|| self.task.region(&row.state), usize::from);
        let moment = Moment { step: row.step, ..span.moment };
        let is_ending = row.u.is_none();
        seen.tick = Tick(at as u64);
        // The plant is held once a rollout is over.
        seen.stage =
            if is_ending { Stage::Hold { moment, ticks_left: 0 } } else { Stage::Running(moment) };
        seen.state = row.state;
        seen.human = row.u_human.map_or(Intent::Absent, |action| Intent::Present {
            action: Action(action),
            raw: row.raw,
            age: Seconds(0.0),
        });
        seen.machine = row.u_machine;
        seen.action = row.u.unwrap_or(0.0);
        seen.applied = row.u_applied.unwrap_or(0.0);
        seen.region = region;
        seen.reward = row.reward.unwrap_or(0.0);
        seen.lateness = Seconds(f64::from(row.lateness_us) * 1e-6);
        seen.fields = span.fields;
        seen.tallied = self.tallied(span, past);
        seen.successes = regions.successes;
        seen.shares = match moment.phase {
            Phase::Introduction => [1.0; MOST_REGIONS],
            Phase::Main => regions.shares,
            Phase::Autonomous | Phase::ZeroControl => [0.0; MOST_REGIONS],
        };
        for (frozen, since) in seen.frozen.iter_mut().zip(&self.frozen) {
            *frozen = since.is_some_and(|since| since <= at);
        }
        let gate = self.gates.get(region).copied().flatten();
        seen.gate = gate.filter(|(since, _)| *since <= at).map(|(_, opened)| opened);
        seen
    }

    /// What the task counted in the rows `past` of the rollout `span`.
    fn tallied(&self, span: &Span, past: &[Row]) -> Tallied {
        let mut tally = self.task.tally();
        tally.go_on(&span.unfinished);
        for pair in past.windows(2) {
            tally.step(&pair[0].state, &pair[1].state);
        }
        tally.tallied()
    }

    /// Finds where rollouts begin and end, and what each begins with.
    fn find_spans(&mut self, returns: bool) {
        let mut over = self.episodes.iter().peekable();
        let mut known = Known::default();
        let mut first = 0;
        while let Some(row) = self.rows.get(first) {
            let rest = &self.rows[first..];
            let rows = 1 + rest.windows(2).take_while(|pair| goes_on(&pair[0], &pair[1])).count();
            let span_rows = &rest[..rows];
            known.enter(row);
            let is_over = span_rows.last().is_some_and(|row| row.u.is_none());
            let mut end = None;
            if is_over && over.peek().is_some_and(|next| is_of(next, row)) {
                end = over.next().map(|row| row.end);
            }
            let span = Span {
                first,
                rows,
                moment: known.moment,
                end,
                rollouts_before: known.rollouts,
                regions: known.regions,
                unfinished: known.unfinished,
                fields: known.fields,
            };
            known.unfinished = Tallied::default();
            if !returns && end == Some(End::Cap) {
                let mut tally = self.task.tally();
                tally.go_on(&span.unfinished);
                span_rows.windows(2).for_each(|pair| tally.step(&pair[0].state, &pair[1].state));
                known.unfinished = tally.unfinished();
            }
            let fields = end
                .and_then(|_| self.episodes.get(known.rollouts))
                .and_then(|episode| episode.receptive_fields);
            known.leave(span_rows, end, fields);
            self.spans.push(span);
            first += rows;
        }
    }

    /// Finds the rows at which gates opened and regions were handed over. What a discard took
    /// back happened once more, so that in each region the last time counts.
    fn find_gates(&mut self, events: &[EventRow<String>]) {
        for event in events {
            let Some((at, region)) = self.place_of(event) else { continue };
            match event.event.as_str() {
                "gate_opened" => {
                    if let Some(opened) = opened(&event.cause) {
                        self.gates[region] = Some((at, opened));
                    }
                }
                "frozen" => self.frozen[region] = Some(at),
                _ => {}
            }
        }
    }

    /// The row at which `event` happened in main, and the region of its state.
    fn place_of(&self, event: &EventRow<String>) -> Option<(usize, usize)> {
        let (phase, episode, step) = (event.phase?, event.episode?, event.step?);
        let is_it = |span: &&Span| (span.moment.phase, span.moment.rollout) == (phase, episode);
        let span = self.spans.iter().rev().find(is_it)?;
        let at = span.first + usize::try_from(step).ok().filter(|step| *step < span.rows)?;
        let row = self.rows.get(at)?;
        let region = row.region.map_or_else(|| self.task.region(&row.state), usize::from);
        (region < MOST_REGIONS).then_some((at, region))
    }

    /// Keeps success every so often.
    fn sample(&mut self) {
        /// Rows between two samples: a second of the thesis's ticks.
        const EVERY: usize = 50;
        let taught = self.rows.iter().enumerate();
        self.successes =
            taught.filter_map(|(at, row)| Some((at, row.success?))).step_by(EVERY).collect();
    }
}

/// The rows of a table up to the first that does not read.
fn whole<T>(
    rows: impl Iterator<Item = Result<T, record::Error>>,
    trouble: &mut Option<String>,
) -> Vec<T> {
    rows.map_while(|row| {
        row.map_err(|error| *trouble = Some(format!("{error}; what comes after it is left out")))
            .ok()
    })
    .collect()
}

fn numbered(row: &StepRow<String>, names: &[&str]) -> Row {
    let index = |name: &String| names.iter().position(|known| known == name);
    let region = row.region.as_ref().and_then(index).and_then(|index| u8::try_from(index).ok());
    StepRow {
        phase: row.phase,
        episode: row.episode,
        step: row.step,
        t: row.t,
        state: row.state,
        u_human: row.u_human,
        u_machine: row.u_machine,
        share: row.share,
        u: row.u,
        u_applied: row.u_applied,
        reward: row.reward,
        success: row.success,
        region,
        lateness_us: row.lateness_us,
        raw: row.raw,
    }
}

/// Whether the rollout of `row` goes on with `next`.
fn goes_on(row: &Row, next: &Row) -> bool {
    let is_same = (row.phase, row.episode) == (next.phase, next.episode);
    is_same && row.step < next.step && row.u.is_some()
}

fn is_of(episode: &EpisodeRow, row: &Row) -> bool {
    (episode.phase, episode.episode) == (row.phase, row.episode)
}

/// Where a gate opened, from the words of the event.
fn opened(cause: &str) -> Option<Opened> {
    let mut numbers = cause.split_whitespace().filter_map(|word| {
        word.trim_end_matches(';').parse::<f64>().ok().map(|_| word.trim_end_matches(';'))
    });
    let step = numbers.next()?.parse().ok()?;
    Some(Opened { step, tau: numbers.next()?.parse().ok()? })
}

/// What is known on the way from rollout to rollout.
struct Known {
    moment: Moment,
    regions: Regions,
    unfinished: Tallied,
    fields: u32,
    /// Rollouts in `episodes.csv` so far.
    rollouts: usize,
}

impl Default for Known {
    fn default() -> Self {
        Self {
            moment: Moment { rollout: 0, ..Moment::start_of(Phase::Introduction) },
            regions: Regions::FULL,
            unfinished: Tallied::default(),
            fields: 0,
            rollouts: 0,
        }
    }
}

impl Known {
    /// A rollout begins with `row`.
    fn enter(&mut self, row: &Row) {
        let Moment { phase, rollout, attempt, .. } = self.moment;
        if row.phase != phase {
            self.moment = Moment::start_of(row.phase);
            if row.phase == Phase::Main {
                (self.regions, self.fields) = (Regions::FULL, 0);
            }
        }
        let is_again = (phase, rollout) == (row.phase, row.episode);
        self.moment.attempt = if is_again { attempt.saturating_add(1) } else { 0 };
        (self.moment.rollout, self.moment.step) = (row.episode, row.step);
    }

    /// It is over, or breaks off, after these `rows`.
    fn leave(&mut self, rows: &[Row], end: Option<End>, fields: Option<u32>) {
        self.rollouts += usize::from(end.is_some());
        // A discard takes back all that came of the rollout.
        if end == Some(End::Discarded) {
            return;
        }
        for row in rows {
            self.regions.see(row);
        }
        self.fields = fields.unwrap_or(self.fields);
        let steps = rows.last().map_or(0, |row| row.step);
        self.moment.steps_before += u64::from(steps);
    }
}
