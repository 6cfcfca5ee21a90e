//! What the screen sees of the control thread, and what it can ask of it.
//!
//! The control thread publishes a copy each tick; the screen copies it out and draws its
//! own copy. The lock is held only for the copy, so drawing never delays a tick.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

use crate::record::EpisodeRow;
use crate::session::machine::Stage;
use crate::sharing::weight::Opened;
use crate::signal::{Intent, Seconds, State, Tallied, Tick};

/// The most regions that a task may have.
pub const MOST_REGIONS: usize = 8;

/// One tick as plain data.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot {
    /// Ticks since control began.
    pub tick: Tick,
    /// What the session is doing, with phase, rollout and step.
    pub stage: Stage,
    /// The plant's state.
    pub state: State,
    /// What the operator wants.
    pub human: Intent,
    /// What the learner would do; `None` where it is not asked.
    pub machine: Option<f64>,
    /// The mixed action.
    pub action: f64,
    /// What the plant received.
    pub applied: f64,
    /// The region of the state, an index into the task's regions.
    pub region: usize,
    /// The person's share in each region; 0 while the robot is alone.
    pub shares: [f64; MOST_REGIONS],
    /// The success of each region.
    pub successes: [f64; MOST_REGIONS],
    /// Whether each region is handed over for good.
    pub frozen: [bool; MOST_REGIONS],
    /// What the task counted so far in the rollout under way.
    pub tallied: Tallied,
    /// Where the gate of the present region opened.
    pub gate: Option<Opened>,
    /// The reward of the state.
    pub reward: f64,
    /// Receptive fields of the learner.
    pub fields: u32,
    /// Samples learned.
    pub learned: u64,
    /// How late the tick began.
    pub lateness: Seconds,
    /// Ticks left out because the machine was busy.
    pub missed: u64,
    /// Rows that could not be written in time.
    pub lost_rows: u64,
    /// How many times faster than the wall the session runs; infinite: as fast as it can.
    pub speed: f64,
}

impl Snapshot {
    /// A session at `stage` before its first tick.
    #[must_use]
    pub fn before(stage: Stage) -> Self {
        Self {
            tick: Tick(0),
            stage,
            state: State::default(),
            human: Intent::Absent,
            machine: None,
            action: 0.0,
            applied: 0.0,
            region: 0,
            shares: [1.0; MOST_REGIONS],
            successes: [0.0; MOST_REGIONS],
            frozen: [false; MOST_REGIONS],
            tallied: Tallied::default(),
            gate: None,
            reward: 0.0,
            fields: 0,
            learned: 0,
            lateness: Seconds(0.0),
            missed: 0,
            lost_rows: 0,
            speed: 1.0,
        }
    }
}

/// What somebody asks of a running session.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Ready: go on from an instruction, a break or a stop.
    Begin,
    /// Pause, or go on.
    Pause,
    /// Throw the rollout away and repeat it.
    Discard,
    /// Emergency stop.
    Stop,
    /// End the session, for this reason.
    Abort(String),
    /// The same, because a signal asked for it or the key that stands for one.
    Interrupt(String),
    /// From now on the device's deflection counts this many times.
    Sensitivity(f64),
    /// Run this many times faster than the wall wherever nobody steers.
    Speed(f64),
}

/// What both ends share.
#[derive(Debug)]
struct Board {
    snapshot: Mutex<Snapshot>,
    rollouts: Mutex<Vec<EpisodeRow>>,
    waits: Mutex<Option<String>>,
}

/// The screen's end: looks and asks.
#[derive(Clone, Debug)]
pub struct Watcher {
    board: Arc<Board>,
    commands: SyncSender<Command>,
}

/// The control thread's end: publishes and obeys.
#[derive(Debug)]
pub struct Publisher {
    board: Arc<Board>,
    commands: Receiver<Command>,
}

/// The two ends of a session that begins at `stage`.
#[must_use]
pub fn channel(stage: Stage) -> (Publisher, Watcher) {
    let board = Arc::new(Board {
        snapshot: Mutex::new(Snapshot::before(stage)),
        rollouts: Mutex::new(Vec::new()),
        waits: Mutex::new(None),
    });
    let (sender, receiver) = sync_channel(64);
    (
        Publisher { board: Arc::clone(&board), commands: receiver },
        Watcher { board, commands: sender },
    )
}

impl Watcher {
    /// A copy of the latest snapshot.
    #[must_use]
    pub fn look(&self) -> Snapshot {
        *self.board.snapshot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Appends to `known` the rollouts that ended since it was filled last.
    pub fn rollouts(&self, known: &mut Vec<EpisodeRow>) {
        let rollouts = self.board.rollouts.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(new) = rollouts.get(known.len()..) {
            known.extend_from_slice(new);
        }
    }

    /// What the countdown waits for, if it waits for the plant.
    #[must_use]
    pub fn waits(&self) -> Option<String> {
        self.board.waits.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Asks for something that must not be passed over; waits while the queue is full.
    /// False when the control thread is gone.
    pub fn insist(&self, command: Command) -> bool {
        self.commands.send(command).is_ok()
    }

    /// Asks for something. False when the control thread is gone or drowned in requests.
    pub fn ask(&self, command: Command) -> bool {
        self.commands.try_send(command).is_ok()
    }
}

impl Publisher {
    /// Shows `snapshot` to whoever looks.
    pub fn publish(&self, snapshot: &Snapshot) {
        *self.board.snapshot.lock().unwrap_or_else(PoisonError::into_inner) = *snapshot;
    }

    /// Says what the countdown waits for, or that it goes on.
    pub fn waits(&self, what: Option<String>) {
        *self.board.waits.lock().unwrap_or_else(PoisonError::into_inner) = what;
    }

    /// Adds a rollout that ended.
    pub fn rollout(&self, row: EpisodeRow) {
        self.board.rollouts.lock().unwrap_or_else(PoisonError::into_inner).push(row);
    }

    /// The next pending request.
    #[must_use]
    pub fn pending(&self) -> Option<Command> {
        self.commands.try_recv().ok()
    }
}
