//! A pad at another computer: its state as lines of text, through any pipe.
//!
//! `coadapt pad-relay` writes a line whenever something moved, and at least every
//! [`HEARTBEAT`]. A line holds the whole state, so that a lost one does no harm:
//!
//! ```text
//! {"coadapt_pad":1,"run":8675309,"seq":12,"t":0.26,"pads":[{"id":0,"name":"Xbox Pad",
//!  "guid":"0300…","mapping":"SDL mapping","axes":[["left_stick_x",-0.25]],"pressed":["south"]}]}
//! ```
//!
//! (on one line). `run` tells one start of the relay from another, `seq` counts its lines,
//! `t` is the relay's own time, s. Axes that never moved are left out.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::map::{Axis, Button};
use super::pads::{About, Event, Id, MOST_CONTROLS, Pad, Pads};
use crate::signal::Seconds;

/// The version that this program writes and understands.
pub const VERSION: u32 = 1;
/// The longest time between two lines.
pub const HEARTBEAT: Seconds = Seconds(0.02);
/// The longest line that is read, bytes: no state of pads is as long.
pub const LONGEST_LINE: usize = 64 << 10;
/// How fast two computers' clocks may drift apart.
const DRIFT: f64 = 1e-4;
/// Lines that are all late by more than this, and equally so within [`STEADY`], for
/// [`SETTLED`], are not late: a computer slept, and its clock with it.
const SLEPT: f64 = 2.0;
const STEADY: f64 = 0.05;
const SETTLED: f64 = 1.0;
/// More pads than anybody holds, and more lines than any link loses at once.
const MOST_PADS: usize = 8;
const LONGEST_GAP: u64 = 1_000_000;

/// The version of a line, whatever else it holds.
#[derive(Deserialize)]
struct Version {
    coadapt_pad: u32,
}

/// A line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Line {
    coadapt_pad: u32,
    run: u64,
    seq: u64,
    t: f64,
    pads: Vec<Relayed>,
}

/// A pad in a line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Relayed {
    #[serde(flatten)]
    about: About,
    axes: Vec<(Axis, f64)>,
    pressed: Vec<Button>,
}

/// The relay's end: from pads to lines.
#[derive(Clone, Debug)]
pub struct Outlet {
    run: u64,
    seq: u64,
}

impl Outlet {
    /// An outlet that is told from others by `run`.
    #[must_use]
    pub const fn new(run: u64) -> Self {
        Self { run, seq: 0 }
    }

    /// The next line, without its end: the state of `pads` at `t`.
    pub fn line(&mut self, pads: &Pads, t: Seconds) -> String {
        self.seq += 1;
        let relayed = |pad: &Pad| Relayed {
            about: pad.about.clone(),
            axes: pad.axes.iter().map(|(axis, value)| (*axis, *value)).collect(),
            pressed: pad.pressed.iter().copied().collect(),
        };
        let pads = pads.present().iter().map(relayed).collect();
        let line = Line { coadapt_pad: VERSION, run: self.run, seq: self.seq, t: t.0, pads };
        // Plain numbers and words: there is nothing in it that JSON could not hold.
        serde_json::to_string(&line).unwrap_or_default()
    }
}

/// What became of the lines so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Lines that were taken.
    pub taken: u64,
    /// Lines that never came.
    pub lost: u64,
    /// Lines that came twice or after a later one: passed over.
    pub stale: u64,
    /// Lines that could not be read: cut in half, or no line of a relay.
    pub damaged: u64,
}

/// The receiver's end: from lines to events.
#[derive(Clone, Debug, Default)]
pub struct Inlet {
    counts: Counts,
    run: Option<u64>,
    seq: u64,
    pads: BTreeMap<Id, Pad>,
    /// When the last line came, and the relay's time in it.
    last: Option<(Seconds, f64)>,
    /// The relay's clock is this far behind ours, as the fastest line showed it.
    offset: f64,
    /// Since when all lines are late, and by how much.
    late: Option<(Seconds, f64)>,
    /// The version of a relay that is newer than this program.
    newer: Option<u32>,
    /// The beginning of the last line that could not be read, until one can.
    strange: Option<String>,
}

/// A line as it was understood.
#[derive(Clone, Debug)]
pub struct Understood(Result<Line, Strange>);

#[derive(Clone, Debug)]
enum Strange {
    Newer(u32),
    Damaged(String),
}

/// Understands a line; the [`Inlet`] makes something of it.
#[must_use]
pub fn understand(line: &str) -> Understood {
    let read = serde_json::from_str::<Line>(line).ok().filter(|line| line.t.is_finite());
    Understood(match read {
        Some(read) if read.coadapt_pad <= VERSION => Ok(read),
        Some(newer) => Err(Strange::Newer(newer.coadapt_pad)),
        None => Err(match serde_json::from_str::<Version>(line) {
            Ok(Version { coadapt_pad }) if coadapt_pad > VERSION => Strange::Newer(coadapt_pad),
            _ => Strange::Damaged(line.chars().filter(|c| !c.is_control()).take(40).collect()),
        }),
    })
}

impl Inlet {
    /// Takes a line that came at `now`, and returns what happened since the one before.
    pub fn take(&mut self, line: Understood, now: Seconds) -> Vec<Event> {
        let line = match line.0 {
            Ok(line) => line,
            Err(Strange::Newer(version)) => {
                self.newer = Some(version);
                return Vec::new();
            }
            Err(Strange::Damaged(beginning)) => {
                self.counts.damaged += 1;
                self.strange = Some(beginning);
                return Vec::new();
            }
        };
        let is_same_run = self.run == Some(line.run);
        if is_same_run && line.seq <= self.seq {
            self.counts.stale += 1;
            return Vec::new();
        }
        let gap = if is_same_run { line.seq - self.seq - 1 } else { 0 };
        if gap > LONGEST_GAP {
            self.counts.damaged += 1;
            return Vec::new();
        }
        self.counts.lost += gap;
        let behind = now.0 - line.t;
        self.offset = match self.last.filter(|_| is_same_run) {
            // The fastest line so far tells the clocks' difference, unless they drift.
            Some((at, _)) => behind.min(self.offset + DRIFT * (now - at).0),
            None => behind,
        };
        self.notice_sleep(behind, now);
        self.counts.taken += 1;
        self.newer = None;
        self.strange = None;
        self.run = Some(line.run);
        self.seq = line.seq;
        self.last = Some((now, line.t));
        self.changes(line.pads)
    }

    /// Lines that are `behind` the relay's clock by much and equally may be late no more.
    fn notice_sleep(&mut self, behind: f64, now: Seconds) {
        let is_late = behind > self.offset + SLEPT;
        self.late = match self.late.filter(|_| is_late) {
            Some((since, level)) if (behind - level).abs() < STEADY => {
                if (now - since).0 >= SETTLED {
                    self.offset = behind;
                    None
                } else {
                    Some((since, level))
                }
            }
            _ => is_late.then_some((now, behind)),
        };
    }

    /// The beginning of a line that could not be read, if the last one could not.
    #[must_use]
    pub fn strange(&self) -> Option<&str> {
        self.strange.as_deref()
    }

    /// The link has ended: every pad is gone.
    pub fn end(&mut self) -> Vec<Event> {
        self.last = None;
        self.changes(Vec::new())
    }

    /// How old the newest state is at `now`: since it left the relay, but for the time that
    /// the fastest line took. `None` before the first line.
    #[must_use]
    pub fn age(&self, now: Seconds) -> Option<Seconds> {
        let (_, t) = self.last?;
        Some(Seconds((now.0 - t - self.offset).max(0.0)))
    }

    /// The pads that are there now.
    pub fn present(&self) -> impl Iterator<Item = About> {
        self.pads.values().map(|pad| pad.about.clone())
    }

    /// What became of the lines so far.
    #[must_use]
    pub const fn counts(&self) -> Counts {
        self.counts
    }

    /// The version of the relay, if it is newer than this program's.
    #[must_use]
    pub const fn newer(&self) -> Option<u32> {
        self.newer
    }

    /// What leads from the known pads to those of a line.
    fn changes(&mut self, mut relayed: Vec<Relayed>) -> Vec<Event> {
        let mut events = Vec::new();
        relayed.truncate(MOST_PADS);
        let is_there = |pad: &Pad| relayed.iter().any(|relayed| relayed.about == pad.about);
        for pad in self.pads.values().filter(|pad| !is_there(pad)) {
            events.push(Event::Disconnected(pad.about.id));
        }
        self.pads.retain(|_, pad| is_there(pad));
        for Relayed { about, axes, pressed } in relayed {
            let id = about.id;
            let known = self.pads.entry(id).or_insert_with(|| {
                events.push(Event::Connected(about.clone()));
                Pad { about, axes: BTreeMap::new(), pressed: BTreeSet::new() }
            });
            for (axis, value) in axes.into_iter().take(MOST_CONTROLS) {
                if known.axes.insert(axis, value) != Some(value) {
                    events.push(Event::Axis { pad: id, axis, value });
                }
            }
            // A pad that invents axes begins anew.
            if known.axes.len() > MOST_CONTROLS {
                known.axes.clear();
            }
            let pressed: BTreeSet<Button> = pressed.into_iter().take(MOST_CONTROLS).collect();
            for button in known.pressed.symmetric_difference(&pressed) {
                let is_pressed = pressed.contains(button);
                events.push(Event::Button { pad: id, button: *button, is_pressed });
            }
            known.pressed = pressed;
        }
        events
    }
}

#[cfg(test)]
#[path = "relay_tests.rs"]
mod tests;
