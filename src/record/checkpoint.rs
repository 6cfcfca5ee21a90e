//! Checkpoints, and how a session goes on from one.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::document::{self, Document};
use super::folder::Folder;
use super::names::{CHECKPOINT, CHECKPOINT_KIND, EPISODES, EVENTS, SESSION, STEPS};
use super::sidecar::{Resumption, Sidecar, Status};
use super::writer::{Columns, Manner, Recorder};
use super::{EpisodeRow, Error, EventRow, Storable, reader, table};
use crate::session::Moment;
use crate::sharing::Sharing;
use crate::signal::{Features, State, Tallied};

/// All that a session needs to go on with the rollout at `moment`. The random streams
/// follow from the seed and the moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint<M> {
    /// The program's version.
    pub version: String,
    /// The next rollout to be done.
    pub moment: Moment,
    /// The rollouts of its phase, unless that is planned by time.
    pub of: Option<u32>,
    /// What was learned; `None` where the learner is frozen and `policy.json` holds it.
    pub learner: Option<M>,
    /// Windows and shares.
    pub sharing: Option<Sharing>,
    /// Samples learned.
    pub learned: u64,
    /// Samples that the learner refused.
    pub refused: u64,
    /// Rollouts that the operator steered so far.
    pub practice: u32,
    /// What the operator has learned by steering, as numbers of its own; empty for people, and
    /// once nobody steers any more.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub operator: Vec<f64>,
    /// What the next rollout goes on with, if it does not begin at the task's start.
    #[serde(default)]
    pub momentum: Option<Momentum>,
    /// Tenths of main whose policies are written.
    pub tenths: u8,
    /// The length of `steps.csv` that belongs to this checkpoint; the writer fills it in.
    pub steps_bytes: u64,
    /// The length of `episodes.csv`; the writer fills it in.
    pub episodes_bytes: u64,
}

/// What goes over from a rollout into the next one where the plant does not return between
/// them: to the motion the border means nothing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Momentum {
    /// Where the plant goes on.
    pub state: State,
    /// What the tally counts on from.
    pub tally: Tallied,
    /// What was seen of late, the newest last, for lessons with a delay.
    pub seen: Vec<Features>,
    /// What the operator's eyes and hand remember.
    pub operator: Vec<f64>,
}

impl<M> Document for Checkpoint<M> {
    const KIND: &'static str = CHECKPOINT_KIND;
}

/// Reads a checkpoint.
///
/// # Errors
/// When it is missing, damaged, not a checkpoint or of a newer schema.
pub fn read_checkpoint<M: Storable>(path: &Path) -> Result<Checkpoint<M>, Error> {
    document::read(path)
}

/// A session that goes on.
#[derive(Debug)]
pub struct Resumed<M> {
    /// Where it stands.
    pub checkpoint: Checkpoint<M>,
    /// Its sidecar, running again.
    pub sidecar: Sidecar,
    /// The rollouts so far.
    pub episodes: Vec<EpisodeRow>,
    /// Step rows of the cut rollout that were dropped.
    pub dropped_steps: u64,
    /// The recorder that goes on behind the kept rows.
    pub recorder: Recorder<M>,
}

impl Folder {
    /// Takes the session up at its checkpoint: rows after it are dropped, and `events.csv`
    /// and `session.json` say so. `now` is the wall's date and time, empty on virtual time.
    ///
    /// # Errors
    /// When the session is complete, or its checkpoint, `session.json` or tables are
    /// damaged or of a newer schema; the folder is then untouched.
    pub fn resume<M: Storable>(self, manner: Manner, now: &str) -> Result<Resumed<M>, Error> {
        let mut sidecar: Sidecar = document::read(&self.file(SESSION))?;
        if sidecar.status == Status::Complete {
            return Err(Error::unfit(self.path(), "this session is complete: nothing to resume"));
        }
        if !self.file(CHECKPOINT).exists() {
            return Err(Error::unfit(
                self.path(),
                "this session was cut before its first rollout: nothing is there to go on \
                 with, begin a new one",
            ));
        }
        let checkpoint: Checkpoint<M> = document::read(&self.file(CHECKPOINT))?;
        let mut steps = Tail::open(self.file(STEPS), checkpoint.steps_bytes)?;
        let mut episodes = Tail::open(self.file(EPISODES), checkpoint.episodes_bytes)?;
        let kept = reader::Episodes::open_until(&self.file(EPISODES), checkpoint.episodes_bytes)?
            .collect::<Result<Vec<_>, _>>()?;
        let state = reader::Steps::open(&self.file(STEPS))?.columns().to_vec();
        let tally = reader::Episodes::open(&self.file(EPISODES))?.tally().to_vec();
        let columns = Columns { state: &state, tally: &tally };

        let dropped_steps = steps.cut()?;
        let dropped_episodes = episodes.cut()?;
        cut_half_row(&self.file(EVENTS))?;
        let moment = checkpoint.moment;
        sidecar.status = Status::Running;
        sidecar.ended = None;
        sidecar.resumed.push(Resumption {
            at: now.to_owned(),
            version: super::VERSION.to_owned(),
            phase: moment.phase,
            episode: moment.rollout,
            dropped_steps,
        });
        let mut recorder = Recorder::start(self, &columns, manner, &sidecar)?;
        recorder.event(EventRow {
            time: now.to_owned(),
            phase: Some(moment.phase),
            episode: Some(moment.rollout),
            step: None,
            event: "resumed",
            cause: format!(
                "dropped {dropped_steps} step rows and {dropped_episodes} episode rows \
                 after the checkpoint"
            ),
        });
        Ok(Resumed { checkpoint, sidecar, episodes: kept, dropped_steps, recorder })
    }
}

/// What a table holds beyond its checkpoint.
struct Tail {
    path: PathBuf,
    file: File,
    length: u64,
}

impl Tail {
    /// Opens the table and demands that `length` ends a row in it.
    fn open(path: PathBuf, length: u64) -> Result<Self, Error> {
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .open(&path)
            .map_err(Error::io("open", &path))?;
        let ends_row = || -> io::Result<bool> {
            let Some(last) = length.checked_sub(1) else { return Ok(false) };
            let mut byte = [0];
            file.seek(SeekFrom::Start(last))?;
            Ok(file.read(&mut byte)? == 1 && byte == *b"\n")
        }()
        .map_err(Error::io("read", &path))?;
        if !ends_row {
            let problem = format!(
                "its checkpoint belongs to {length} bytes of whole rows, which are not here; \
                 the file was changed or damaged, so the session cannot be resumed"
            );
            return Err(Error::unfit(&path, problem));
        }
        Ok(Self { path, file, length })
    }

    /// Cuts the tail off and returns the number of its rows, half ones included.
    fn cut(&mut self) -> Result<u64, Error> {
        let mut cut = || -> io::Result<u64> {
            let mut tail = Vec::new();
            self.file.seek(SeekFrom::Start(self.length))?;
            self.file.read_to_end(&mut tail)?;
            self.file.set_len(self.length)?;
            Ok(tail.split_inclusive(|byte| *byte == b'\n').count() as u64)
        };
        cut().map_err(Error::io("cut back", &self.path))
    }
}

fn cut_half_row(path: &Path) -> Result<(), Error> {
    let cut = || -> io::Result<()> {
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        let whole = table::whole_length(&mut file)?;
        file.set_len(whole)
    };
    cut().map_err(Error::io("cut back", path))
}
