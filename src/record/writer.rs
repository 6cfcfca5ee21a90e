//! The writer thread behind its bounded queue, and the handle that feeds it.
//!
//! Live, the control thread never waits for the disk: a row that finds the queue full is
//! lost and counted. On virtual time it waits instead, and nothing is ever lost.

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread::{self, JoinHandle};

use super::document;
use super::evaluation::write_evaluation;
use super::folder::Folder;
use super::names::{
    CHECKPOINT, EPISODE_COLUMNS, EPISODES, EVALUATION, EVENT_COLUMNS, EVENTS, LATER_STEP_COLUMNS,
    SESSION, STEP_COLUMNS, STEPS,
};
use super::policy;
use super::table::Table;
use super::{
    Checkpoint, EpisodeRow, Error, EvaluationRow, EventRow, Policy, Sidecar, StepRow, Storable,
};

/// Messages that may wait: at 50 steps a second more than two minutes of a stalled disk.
const QUEUE: usize = 8192;

/// How the writer treats the one who feeds it, and the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Manner {
    /// A person takes part: never wait with a step row; rows reach the operating system at
    /// once and outlive a loss of power from each rollout's end on.
    Live,
    /// Virtual time: wait for the writer; one sync at the session's end.
    Virtual,
}

enum Message<M> {
    Step(StepRow),
    Episode(EpisodeRow),
    Event(Box<EventRow>),
    Checkpoint(Box<Checkpoint<M>>),
    Policy(Option<u8>, Box<Policy<M>>),
    Evaluation(Vec<EvaluationRow>),
    Sidecar(Box<Sidecar>),
    Finish(Box<Sidecar>),
}

/// The names of the columns that differ from task to task.
#[derive(Clone, Copy, Debug)]
pub struct Columns<'a, Name> {
    /// Those of the state's numbers, in `steps.csv`.
    pub state: &'a [Name],
    /// Those of what the task counts in a rollout, in `episodes.csv` and `evaluation.csv`.
    pub tally: &'a [Name],
}

/// The handle through which a session is recorded. Dropping it writes what is queued, as
/// [`finish`](Self::finish) does, but leaves the session's status as it is.
pub struct Recorder<M> {
    queue: Option<SyncSender<Message<M>>>,
    thread: Option<JoinHandle<Result<(), Error>>>,
    fault: Arc<OnceLock<String>>,
    lost: u64,
    may_wait: bool,
    path: PathBuf,
}

impl<M> fmt::Debug for Recorder<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Recorder").field("path", &self.path).finish_non_exhaustive()
    }
}

impl<M: Storable> Recorder<M> {
    /// Writes `session.json` and the tables' headers (where they are missing), then starts
    /// the writer thread.
    ///
    /// # Errors
    /// When the disk refuses, so that no session begins that could not be kept.
    pub fn start<Name: AsRef<str>>(
        folder: Folder,
        columns: &Columns<'_, Name>,
        manner: Manner,
        sidecar: &Sidecar,
    ) -> Result<Self, Error> {
        let (before, after) = STEP_COLUMNS;
        let state = columns.state.iter().map(AsRef::as_ref);
        let header: Vec<&str> =
            before.into_iter().chain(state).chain(after).chain(LATER_STEP_COLUMNS).collect();
        let counted = columns.tally.iter().map(AsRef::as_ref);
        let episodes: Vec<&str> = EPISODE_COLUMNS.into_iter().chain(counted).collect();
        let tables = Tables {
            steps: Table::open(folder.file(STEPS), &header)?,
            episodes: Table::open(folder.file(EPISODES), &episodes)?,
            events: Table::open(folder.file(EVENTS), &EVENT_COLUMNS)?,
        };
        document::write(&folder.file(SESSION), sidecar, manner == Manner::Live)?;
        let path = folder.path().to_owned();
        if manner == Manner::Live {
            for folder in path.ancestors().skip(1).take(2) {
                document::sync(folder)?;
            }
        }
        let (queue, messages) = sync_channel(QUEUE);
        let fault = Arc::new(OnceLock::new());
        let writer = Writer {
            folder,
            tally: columns.tally.iter().map(|name| name.as_ref().to_owned()).collect(),
            tables: Some(tables),
            manner,
            fault: Arc::clone(&fault),
            first: None,
        };
        let thread = thread::Builder::new()
            .name("coadapt-writer".to_owned())
            .spawn(move || writer.run(&messages))
            .map_err(Error::io("start the writer thread for", &path))?;
        let may_wait = manner == Manner::Virtual;
        Ok(Self { queue: Some(queue), thread: Some(thread), fault, lost: 0, may_wait, path })
    }

    /// Says whether the one who feeds may be held up when the queue is full: not while it
    /// keeps pace with a person or a device.
    pub const fn allow_waiting(&mut self, may_wait: bool) {
        self.may_wait = may_wait;
    }

    /// Records a control step. A row that would have to wait, but may not, is
    /// [lost](Self::lost).
    pub fn step(&mut self, row: StepRow) {
        let Some(queue) = &self.queue else { return };
        let kept = if self.may_wait {
            queue.send(Message::Step(row)).is_ok()
        } else {
            queue.try_send(Message::Step(row)).is_ok()
        };
        self.lost += u64::from(!kept);
    }

    /// Records a rollout.
    pub fn episode(&mut self, row: EpisodeRow) {
        self.send(Message::Episode(row));
    }

    /// Records an event.
    pub fn event(&mut self, row: EventRow) {
        self.send(Message::Event(Box::new(row)));
    }

    /// Replaces the checkpoint. Its lengths are filled in with those of the rows sent
    /// before it.
    pub fn checkpoint(&mut self, checkpoint: Box<Checkpoint<M>>) {
        self.send(Message::Checkpoint(checkpoint));
    }

    /// Writes `policy-<percent>.json`, or `policy.json` without a percent.
    pub fn policy(&mut self, percent: Option<u8>, policy: Box<Policy<M>>) {
        self.send(Message::Policy(percent, policy));
    }

    /// Writes `evaluation.csv`.
    pub fn evaluation(&mut self, rows: Vec<EvaluationRow>) {
        self.send(Message::Evaluation(rows));
    }

    /// Replaces `session.json`.
    pub fn sidecar(&mut self, sidecar: Box<Sidecar>) {
        self.send(Message::Sidecar(sidecar));
    }

    /// The step rows lost because the queue was full or the writer dead.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// The first thing that went wrong in the writer, for a person to read. A session
    /// should end then: its rows are not kept any more.
    pub fn fault(&self) -> Option<&str> {
        self.fault.get().map(String::as_str)
    }

    /// The session's folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes what is queued, syncs all, writes the last `session.json` and returns.
    ///
    /// # Errors
    /// The first thing that went wrong since the start.
    pub fn finish(mut self, last: Sidecar) -> Result<(), Error> {
        self.may_wait = true;
        self.send(Message::Finish(Box::new(last)));
        self.join()
    }

    /// Only step rows may be lost. A queue without room for anything else, minutes behind,
    /// is a fault that ends the session.
    fn send(&mut self, message: Message<M>) {
        let Some(queue) = &self.queue else { return };
        // A dead writer is told of by `finish`.
        if self.may_wait {
            let _ = queue.send(message);
        } else if let Err(TrySendError::Full(_)) = queue.try_send(message) {
            let _ = self
                .fault
                .set(format!("the disk under {} has not kept up for minutes", self.path.display()));
        }
    }
}

impl<M> Recorder<M> {
    fn join(&mut self) -> Result<(), Error> {
        self.queue = None;
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(result)) => result,
            Some(Err(_)) => Err(Error::WriterDied { path: self.path.clone() }),
            None => Ok(()),
        }
    }
}

impl<M> Drop for Recorder<M> {
    fn drop(&mut self) {
        // Nobody is left to be told; the fault is in `fault`.
        let _ = self.join();
    }
}

struct Tables {
    steps: Table,
    episodes: Table,
    events: Table,
}

impl Tables {
    fn each(&mut self, act: impl Fn(&mut Table) -> Result<(), Error>) -> Result<(), Error> {
        [&mut self.steps, &mut self.episodes, &mut self.events].into_iter().try_for_each(act)
    }
}

struct Writer {
    folder: Folder,
    tally: Vec<String>,
    /// `None` once a table could not be written: what is kept stays whole.
    tables: Option<Tables>,
    manner: Manner,
    fault: Arc<OnceLock<String>>,
    first: Option<Error>,
}

impl Writer {
    fn run<M: Storable>(mut self, messages: &Receiver<Message<M>>) -> Result<(), Error> {
        let mut last = None;
        while let Some(message) = self.next(messages) {
            match message {
                Message::Step(row) => self.rows(|tables| tables.steps.append(&row)),
                Message::Episode(row) => self.rows(|tables| tables.episodes.append(&row)),
                Message::Event(mut row) => {
                    row.cause = row.cause.replace(char::is_control, " ");
                    self.rows(|tables| tables.events.append(&row));
                }
                Message::Finish(sidecar) => last = Some(sidecar),
                other => {
                    let done = self.file(other);
                    self.heed(done);
                }
            }
        }
        let closed = self.close(last.as_deref());
        self.heed(closed);
        self.first.map_or(Ok(()), Err)
    }

    /// The next message. Live, rows are handed to the system before the writer rests.
    fn next<M>(&mut self, messages: &Receiver<Message<M>>) -> Option<Message<M>> {
        if self.manner == Manner::Live {
            match messages.try_recv() {
                Ok(message) => return Some(message),
                Err(TryRecvError::Disconnected) => return None,
                Err(TryRecvError::Empty) => self.rows(|tables| tables.each(Table::flush)),
            }
        }
        messages.recv().ok()
    }

    /// Works on the tables, as long as they can be written.
    fn rows(&mut self, work: impl FnOnce(&mut Tables) -> Result<(), Error>) {
        let Some(tables) = &mut self.tables else { return };
        if let Err(fault) = work(tables) {
            self.tables = None;
            self.heed(Err(fault));
        }
    }

    /// Remembers the first fault.
    fn heed(&mut self, done: Result<(), Error>) {
        if let Err(fault) = done
            && self.first.is_none()
        {
            let _ = self.fault.set(fault.to_string());
            self.first = Some(fault);
        }
    }

    /// Writes one of the files that are replaced whole.
    fn file<M: Storable>(&mut self, message: Message<M>) -> Result<(), Error> {
        let durable = self.manner == Manner::Live;
        match message {
            Message::Checkpoint(mut checkpoint) => {
                let settle = if durable { Table::sync } else { Table::flush };
                self.rows(|tables| tables.each(settle));
                // Without its rows a checkpoint would be a lie: the last good one stays.
                let Some(tables) = &self.tables else { return Ok(()) };
                checkpoint.steps_bytes = tables.steps.length();
                checkpoint.episodes_bytes = tables.episodes.length();
                document::write(&self.folder.file(CHECKPOINT), &*checkpoint, durable)
            }
            Message::Policy(percent, policy) => {
                let path = self.folder.file(&policy::file_name(percent));
                document::write(&path, &*policy, durable)
            }
            Message::Evaluation(rows) => {
                let tally: Vec<&str> = self.tally.iter().map(String::as_str).collect();
                write_evaluation(&self.folder.file(EVALUATION), &tally, &rows, durable)
            }
            Message::Sidecar(sidecar) => {
                document::write(&self.folder.file(SESSION), &*sidecar, durable)
            }
            _ => Ok(()),
        }
    }

    /// Syncs everything; only then does `session.json` say how the session ended.
    fn close(&mut self, last: Option<&Sidecar>) -> Result<(), Error> {
        self.rows(|tables| tables.each(Table::sync));
        if self.manner == Manner::Virtual {
            let sync = || -> io::Result<()> {
                for entry in fs::read_dir(self.folder.path())? {
                    fs::File::open(entry?.path())?.sync_all()?;
                }
                Ok(())
            };
            sync().map_err(Error::io("sync", self.folder.path()))?;
        }
        match last {
            Some(sidecar) => document::write(&self.folder.file(SESSION), sidecar, true),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::Phase;
    use crate::signal::State;

    #[test]
    fn live_rows_that_find_the_queue_full_are_lost_and_counted() {
        let (queue, messages) = sync_channel(2);
        let mut recorder: Recorder<f64> = Recorder {
            queue: Some(queue),
            thread: None,
            fault: Arc::default(),
            lost: 0,
            may_wait: false,
            path: PathBuf::new(),
        };
        for step in 0..5 {
            recorder.step(StepRow::ending(Phase::Main, 1, step, 0.0, State::default()));
        }
        assert_eq!(recorder.lost(), 3);
        drop(recorder);
        assert_eq!(messages.iter().count(), 2);
    }

    #[test]
    fn a_queued_row_stays_small() {
        assert!(size_of::<Message<f64>>() <= 240, "{}", size_of::<Message<f64>>());
    }
}
