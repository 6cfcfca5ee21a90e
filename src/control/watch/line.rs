//! The lines that go through the socket: JSON objects, one a line.
//!
//! The first is a [`Hello`]; then come rollouts that ended and [`Seen`] ticks. A line of another
//! schema is known by its hello, whatever else that version changed.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::control::snapshot::{MOST_REGIONS, Snapshot};
use crate::record::{EpisodeRow, Sidecar};
use crate::session::machine::Stage;
use crate::sharing::weight::Opened;
use crate::signal::{Action, Intent, Seconds, State, Tallied, Tick};

/// The version of the lines' form.
pub const SCHEMA: u32 = 1;

/// One line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Line {
    /// Which session this is.
    Hello(Box<Hello>),
    /// Rollouts that ended.
    Rollouts(Vec<EpisodeRow>),
    /// The latest tick.
    Seen(Box<Seen>),
}

impl Line {
    /// The line's bytes, its end included; empty for what has no JSON.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = serde_json::to_vec(self).unwrap_or_default();
        if !bytes.is_empty() {
            bytes.push(b'\n');
        }
        bytes
    }

    /// Reads a line.
    ///
    /// # Errors
    /// When it is of another schema, or is no such line.
    pub fn read(text: &str) -> Result<Self, Strange> {
        /// What every version's hello has.
        #[derive(Deserialize)]
        struct Stamped {
            hello: Stamp,
        }
        #[derive(Deserialize)]
        struct Stamp {
            schema: u32,
            version: String,
        }
        if let Ok(Stamped { hello: Stamp { schema, version } }) = serde_json::from_str(text)
            && schema != SCHEMA
        {
            return Err(Strange::Version { schema, version });
        }
        serde_json::from_str(text).map_err(|error| Strange::Text(error.to_string()))
    }
}

/// Why a session, or a line of one, is not understood.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Strange {
    /// Another version wrote it.
    #[error(
        "it is of coadapt {version}, whose lines have schema {schema}, and this one, {}, reads \
         schema {SCHEMA}: use the same version at both terminals",
        crate::record::VERSION
    )]
    Version {
        /// Its schema.
        schema: u32,
        /// Its program's version.
        version: String,
    },
    /// It says nothing.
    #[error("PID {pid} does not answer: is it stopped? `kill -CONT {pid}` lets it go on")]
    Silent {
        /// Its program.
        pid: i32,
    },
    /// It is something else.
    #[error("this is no line of a session: {0}")]
    Text(String),
}

/// Which session speaks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hello {
    /// The version of the lines' form.
    pub schema: u32,
    /// The program's version.
    pub version: String,
    /// The session's folder, from the root.
    pub folder: String,
    /// What `session.json` says.
    pub sidecar: Sidecar,
}

impl Hello {
    /// The hello of the session `sidecar` in `folder`.
    #[must_use]
    pub fn new(folder: String, sidecar: Sidecar) -> Self {
        Self { schema: SCHEMA, version: crate::record::VERSION.to_owned(), folder, sidecar }
    }
}

/// A tick. Numbers are as exact as they were, those that are not finite included.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    tick: u64,
    stage: Stage,
    state: Vec<Number>,
    /// What the person wants, and their device's deflection.
    human: Option<(Number, Option<Number>)>,
    machine: Option<Number>,
    action: Number,
    applied: Number,
    region: usize,
    shares: Vec<Number>,
    successes: Vec<Number>,
    frozen: Vec<bool>,
    tallied: Vec<Number>,
    gate: Option<Opened>,
    reward: Number,
    fields: u32,
    learned: u64,
    late_s: Number,
    missed: u64,
    lost_rows: u64,
    speed: Number,
    /// What the countdown waits for.
    pub waits: Option<String>,
}

impl Seen {
    /// `seen`, where the task has so many `regions`, and what the countdown `waits` for.
    #[must_use]
    pub fn new(seen: &Snapshot, waits: Option<String>) -> Self {
        let human = match seen.human {
            Intent::Present { action, raw, .. } => Some((Number(action.0), raw.map(Number))),
            Intent::Absent => None,
        };
        Self {
            tick: seen.tick.0,
            stage: seen.stage,
            state: numbers(&seen.state),
            human,
            machine: seen.machine.map(Number),
            action: Number(seen.action),
            applied: Number(seen.applied),
            region: seen.region,
            shares: numbers(&seen.shares),
            successes: numbers(&seen.successes),
            frozen: seen.frozen.to_vec(),
            tallied: numbers(&seen.tallied),
            gate: seen.gate,
            reward: Number(seen.reward),
            fields: seen.fields,
            learned: seen.learned,
            late_s: Number(seen.lateness.0),
            missed: seen.missed,
            lost_rows: seen.lost_rows,
            speed: Number(seen.speed),
            waits,
        }
    }

    /// The snapshot that was seen.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        let mut seen = Snapshot::before(self.stage);
        seen.tick = Tick(self.tick);
        seen.state = State::from_slice(&plain(&self.state)).unwrap_or_default();
        seen.human = self.human.map_or(Intent::Absent, |(action, raw)| Intent::Present {
            action: Action(action.0),
            raw: raw.map(|raw| raw.0),
            age: Seconds(0.0),
        });
        seen.machine = self.machine.map(|machine| machine.0);
        seen.action = self.action.0;
        seen.applied = self.applied.0;
        // What is drawn is looked up by it.
        seen.region = self.region.min(MOST_REGIONS - 1);
        fill(&mut seen.shares, self.shares.iter().map(|number| number.0));
        fill(&mut seen.successes, self.successes.iter().map(|number| number.0));
        fill(&mut seen.frozen, self.frozen.iter().copied());
        seen.tallied = Tallied::from_slice(&plain(&self.tallied)).unwrap_or_default();
        seen.gate = self.gate;
        seen.reward = self.reward.0;
        seen.fields = self.fields;
        seen.learned = self.learned;
        seen.lateness = Seconds(self.late_s.0);
        seen.missed = self.missed;
        seen.lost_rows = self.lost_rows;
        seen.speed = self.speed.0;
        seen
    }
}

fn numbers(values: &[f64]) -> Vec<Number> {
    values.iter().copied().map(Number).collect()
}

fn plain(numbers: &[Number]) -> Vec<f64> {
    numbers.iter().map(|number| number.0).collect()
}

fn fill<T>(places: &mut [T], values: impl Iterator<Item = T>) {
    for (place, value) in places.iter_mut().zip(values) {
        *place = value;
    }
}

/// A number; JSON has no word for those that are not finite, so these are texts.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Number(f64);

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0.is_finite() {
            serializer.serialize_f64(self.0)
        } else {
            serializer.collect_str(&self.0)
        }
    }
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Form {
            Finite(f64),
            Word(String),
        }
        match Form::deserialize(deserializer)? {
            Form::Finite(value) => Ok(Self(value)),
            Form::Word(word) => word.parse().map(Self).map_err(D::Error::custom),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::{Moment, Phase};
    use proptest::prelude::*;

    fn seen(value: f64, action: f64) -> Snapshot {
        let moment = Moment { rollout: 12, step: 412, ..Moment::start_of(Phase::Main) };
        let mut seen = Snapshot::before(Stage::Running(moment));
        seen.tick = Tick(90_000);
        seen.state = State::new([value, -value, 0.1, 2.0]);
        seen.human = Intent::fresh(action);
        seen.machine = Some(value);
        (seen.action, seen.applied, seen.reward) = (action, value, action);
        (seen.shares[0], seen.successes[0], seen.frozen[1]) = (0.63, 0.71, true);
        seen.tallied = Tallied::new([value, 0.31]);
        seen.gate = Some(Opened { step: 2413, tau: 2633.4 });
        (seen.fields, seen.learned, seen.speed) = (50, 7000, f64::INFINITY);
        seen
    }

    proptest! {
        #[test]
        fn a_tick_comes_over_to_the_last_bit(value in any::<f64>(), action in -10.0..10.0) {
            let snapshot = seen(value, action);
            let line = Line::Seen(Box::new(Seen::new(&snapshot, Some("the cart".to_owned()))));
            let text = String::from_utf8(line.to_bytes()).unwrap();
            prop_assert!(text.len() < 1000, "{}", text.len());
            let Ok(Line::Seen(read)) = Line::read(&text) else { panic!("{text}") };
            prop_assert_eq!(read.waits.as_deref(), Some("the cart"));
            prop_assert_eq!(format!("{:?}", read.snapshot()), format!("{snapshot:?}"));
            for bits in [read.snapshot().state[0], read.snapshot().applied] {
                prop_assert!(bits.to_bits() == value.to_bits() || value.is_nan());
            }
        }

        #[test]
        fn no_text_breaks_the_reader(text in ".{0,200}") {
            let _ = Line::read(&text);
        }
    }

    #[test]
    fn another_version_is_told_by_its_hello_whatever_else_it_changed() {
        let text = r#"{"hello":{"schema":7,"version":"9.1.0","where":[1]}}"#;
        let strange = Line::read(text).unwrap_err();
        assert_eq!(strange, Strange::Version { schema: 7, version: "9.1.0".to_owned() });
        assert!(strange.to_string().contains("same version"), "{strange}");
        assert!(matches!(Line::read("{\"hello\":1}"), Err(Strange::Text(_))));
    }
}
