//! A table of events, to put the whole way from a pad to the plant to the test without one.
//!
//! ```csv
//! t,event,pad,what,value
//! 0.0,connect,1,Xbox Pad,
//! 0.5,axis,1,left_stick_x,0.3
//! 2.0,press,1,start,
//! 2.1,release,1,start,
//! 3.0,disconnect,1,,
//! ```
//!
//! `t` is the time since the session's control began, s, and must not fall; `pad` a number
//! that tells pads apart; `what` the pad's name, the axis or the button; `value` an axis'
//! deflection, −1 to 1. Lines that begin with `#` are passed over.

use std::collections::{BTreeSet, VecDeque};
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::pads::{About, Event, Id};
use crate::signal::Seconds;

/// The largest table that is read, bytes.
const MOST_BYTES: u64 = 16 << 20;
/// How many faults are listed.
const MOST_FAULTS: usize = 20;

/// Why a table of events cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BadEvents {
    /// The file cannot be read.
    #[error("cannot read the events {file}: {cause}")]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// The reason.
        cause: std::io::Error,
    },
    /// It is too large.
    #[error("the events {0} are more than 16 MiB: split them")]
    TooLarge(PathBuf),
    /// It has faults.
    #[error("the events {file}:{faults}")]
    Faults {
        /// The file.
        file: PathBuf,
        /// What is wrong, and where.
        faults: Faults,
    },
}

/// Faults with their lines.
#[derive(Debug, Default)]
pub struct Faults(Vec<(u64, String)>);

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (line, what) in self.0.iter().take(MOST_FAULTS) {
            write!(f, "\n  line {line}: {what}")?;
        }
        match self.0.len().saturating_sub(MOST_FAULTS) {
            0 => Ok(()),
            more => write!(f, "\n  and {more} more"),
        }
    }
}

#[derive(Deserialize)]
struct Row {
    t: f64,
    event: String,
    pad: u32,
    what: String,
    value: Option<f64>,
}

/// Events with their times, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Events(VecDeque<(Seconds, Event)>);

impl Events {
    /// Reads the table in `file`.
    ///
    /// # Errors
    /// When it cannot be read, is too large, or has faults: all of them, with their lines.
    pub fn load(file: &Path) -> Result<Self, BadEvents> {
        let unreadable = |cause| BadEvents::Unreadable { file: file.to_owned(), cause };
        if fs::metadata(file).map_err(unreadable)?.len() > MOST_BYTES {
            return Err(BadEvents::TooLarge(file.to_owned()));
        }
        let text = fs::read_to_string(file).map_err(unreadable)?;
        Self::parse(&text).map_err(|faults| BadEvents::Faults { file: file.to_owned(), faults })
    }

    /// Reads the table `text`.
    ///
    /// # Errors
    /// All its faults.
    pub fn parse(text: &str) -> Result<Self, Faults> {
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let mut present = BTreeSet::new();
        let (mut events, mut faults, mut latest) = (VecDeque::new(), Faults::default(), 0.0);
        let headers = reader.headers().cloned().unwrap_or_default();
        if headers != vec!["t", "event", "pad", "what", "value"] {
            let what = "the first line must be t,event,pad,what,value";
            faults.0.push((1, what.to_owned()));
            return Err(faults);
        }
        for record in reader.records() {
            let read = record.map_err(|error| (line_of(&error), error.to_string())).and_then(|r| {
                let line = r.position().map_or(0, csv::Position::line);
                let row: Row = r.deserialize(Some(&headers)).map_err(|e| (line, words(&e)))?;
                event(&row, latest)
                    .and_then(|event| known(event, &mut present))
                    .map(|event| (row.t, event))
                    .map_err(|what| (line, what))
            });
            match read {
                Ok((t, event)) => {
                    latest = t;
                    events.push_back((Seconds(t), event));
                }
                Err(fault) => faults.0.push(fault),
            }
        }
        if faults.0.is_empty() { Ok(Self(events)) } else { Err(faults) }
    }

    /// The events with their times, in order.
    #[must_use]
    pub fn into_queue(self) -> VecDeque<(Seconds, Event)> {
        self.0
    }
}

fn line_of(error: &csv::Error) -> u64 {
    error.position().map_or(0, csv::Position::line)
}

/// What the CSV reader says, without the line, which is told already.
fn words(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::Deserialize { err, .. } => {
            format!("{err}; a row is t,event,pad,what,value such as 0.5,axis,1,left_stick_x,0.3")
        }
        _ => error.to_string(),
    }
}

fn event(row: &Row, latest: f64) -> Result<Event, String> {
    if !(row.t >= latest && row.t.is_finite()) {
        return Err(format!("t is {}; times must not fall, and are finite from 0 on", row.t));
    }
    let pad = Id(row.pad);
    match row.event.as_str() {
        "connect" => Ok(Event::Connected(About {
            id: pad,
            name: row.what.clone(),
            guid: format!("{:032x}", row.pad),
            mapping: "a table of events".to_owned(),
        })),
        "disconnect" => Ok(Event::Disconnected(pad)),
        "axis" => {
            let axis = named(&row.what)?;
            let value = row.value.ok_or("an axis needs a value, such as 0.3")?;
            Ok(Event::Axis { pad, axis, value })
        }
        "press" | "release" => {
            let button = named(&row.what)?;
            Ok(Event::Button { pad, button, is_pressed: row.event == "press" })
        }
        other => Err(format!(
            "event `{other}` is unknown; allowed are connect, disconnect, axis, press, release"
        )),
    }
}

/// An event of a pad that is there.
fn known(event: Event, present: &mut BTreeSet<Id>) -> Result<Event, String> {
    let (id, is_there) = match &event {
        Event::Connected(about) => {
            present.insert(about.id);
            return Ok(event);
        }
        Event::Disconnected(id) => (*id, present.remove(id)),
        Event::Axis { pad, .. } | Event::Button { pad, .. } => (*pad, present.contains(pad)),
    };
    if is_there { Ok(event) } else { Err(format!("pad {} is not connected then", id.0)) }
}

/// The axis or button of that name.
fn named<T: for<'de> Deserialize<'de>>(name: &str) -> Result<T, String> {
    ron::from_str(name).map_err(|error| match error.code {
        ron::Error::NoSuchEnumVariant { expected, found, .. } => {
            format!("`{found}` is unknown; allowed are {}", expected.join(", "))
        }
        _ => format!("`{name}` is no name; give one such as left_stick_x, start or code(29)"),
    })
}

#[cfg(test)]
mod tests {
    use super::super::map::{Axis, Button};
    use super::*;

    #[test]
    fn every_event_is_read() {
        let text = "t,event,pad,what,value\n# a comment\n0.0,connect,1,\"Pad, big\",\n\
                    0.5, axis, 1, left_stick_x, -0.3\n0.5,axis,1,code(29),nan\n\
                    2,press,1,start,\n2.1,release,1,code(7),\n3,disconnect,1,,\n";
        let events: Vec<_> = Events::parse(text).unwrap().into_queue().into();
        let pad = Id(1);
        assert!(matches!(&events[0].1, Event::Connected(about) if about.name == "Pad, big"));
        assert_eq!(
            events[1],
            (Seconds(0.5), Event::Axis { pad, axis: Axis::LeftStickX, value: -0.3 })
        );
        assert!(
            matches!(events[2].1, Event::Axis { axis: Axis::Code(29), value, .. } if value.is_nan())
        );
        let start = Event::Button { pad, button: Button::Start, is_pressed: true };
        assert_eq!(events[3].1, start);
        assert_eq!(events[5], (Seconds(3.0), Event::Disconnected(pad)));
    }

    #[test]
    fn every_fault_is_told_with_its_line() {
        let text = "t,event,pad,what,value\n0.5,axis,1,left_stick,0.3\n0.4,axis,1,left_stick_x,\n\
                    1.0,connect,1,A,\n0.9,release,1,start,\n1.0,jump,1,,\nx,press,1,start,\n1,press\n\
                    2,press,3,start,\n";
        let told = Events::parse(text).unwrap_err().to_string();
        for (line, word) in [
            (2, "left_stick_x"),
            (3, "needs a value"),
            (5, "must not fall"),
            (6, "connect, disconnect"),
            (7, "0.5,axis,1"),
            (8, "2 fields"),
            (9, "pad 3 is not connected"),
        ] {
            let found = told.lines().find(|told| told.contains(&format!("line {line}:")));
            assert!(found.is_some_and(|found| found.contains(word)), "{line} {word}: {told}");
        }
        assert!(Events::parse("time,axis\n").unwrap_err().to_string().contains("line 1"));
    }
}
