//! MCAP: all that happened on one line of time, for Foxglove and its like.
//!
//! | channel | a message holds | when |
//! | --- | --- | --- |
//! | `/state` | the state | each step |
//! | `/action` | human, machine, mixed and applied action, deflection | each step but the last |
//! | `/sharing` | share, success, reward, region | each step but the last |
//! | `/place` | phase, rollout, attempt, step | each step |
//! | `/episode` | how a rollout came out, as in `episodes.csv` | at its end |
//! | `/event` | what happened and why, as a `foxglove.Log` | where it happened |
//!
//! Messages are JSON with a JSON Schema; what is missing, or no finite number, is left out. The time
//! is controlled time since the session began: countdowns and breaks have none, and rollouts follow
//! each other by one tick.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use mcap::records::{MessageHeader, Metadata};
use serde_json::{Map, Number, Value, json};

use super::Recorded;
use super::columns::{Kind, column};
use super::survey::{Rollout, Walk};
use crate::record::names::{EPISODE_COLUMNS, EPISODES, EVENT_COLUMNS, EVENTS, STEPS};
use crate::record::reader::{Episodes, Steps, read_events};
use crate::record::{EpisodeRow, Error, EventRow, StepRow, VERSION};
use crate::session::Phase;

/// Writes `session` to `file`, which is to become `out`, and tells the messages of each channel.
pub fn write(session: &Recorded, file: &File, out: &Path) -> Result<Vec<(String, u64)>, Error> {
    let mut line = Timeline::begin(session, file, out)?;
    let mut later = line.episodes(session)?;
    later.extend(line.events(session)?);
    later.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    line.steps(session, later)?;
    line.end()
}

/// A channel and the names of what its messages hold.
struct Channel {
    id: u16,
    topic: &'static str,
    names: Vec<String>,
    messages: u32,
}

/// A message that is to be written when its time has come.
struct Later {
    at_s: f64,
    channel: u16,
    body: Value,
}

struct Timeline<'a> {
    writer: mcap::Writer<BufWriter<&'a File>>,
    task: &'a str,
    out: &'a Path,
    channels: BTreeMap<u16, Channel>,
}

impl<'a> Timeline<'a> {
    fn begin(session: &'a Recorded, file: &'a File, out: &'a Path) -> Result<Self, Error> {
        let options = mcap::WriteOptions::new().compression(None).profile("");
        let options = options.library(format!("coadapt {VERSION}"));
        let mut writer = options.create(BufWriter::new(file)).map_err(refused(out))?;
        let facts = session.facts().map(|(name, value)| (name.to_owned(), value));
        let facts = Metadata { name: "session".to_owned(), metadata: facts.into() };
        writer.write_metadata(&facts).map_err(refused(out))?;
        Ok(Self { writer, task: &session.facts.task, out, channels: BTreeMap::new() })
    }

    /// A channel whose messages hold `names`, columns of the session's tables.
    fn channel<'n>(
        &mut self,
        topic: &'static str,
        names: impl IntoIterator<Item = &'n str>,
    ) -> Result<u16, Error> {
        let names: Vec<String> = names.into_iter().map(str::to_owned).collect();
        let properties = self.properties(&names);
        let title = format!("coadapt{}", topic.replace('/', "."));
        self.register(topic, &title, names, &properties)
    }

    fn properties(&self, names: &[String]) -> Map<String, Value> {
        names.iter().map(|name| (name.clone(), property(self.task, name))).collect()
    }

    fn register(
        &mut self,
        topic: &'static str,
        title: &str,
        names: Vec<String>,
        properties: &Map<String, Value>,
    ) -> Result<u16, Error> {
        let schema = json!({ "type": "object", "title": title, "properties": properties });
        let schema = self.writer.add_schema(title, "jsonschema", schema.to_string().as_bytes());
        let schema = schema.map_err(refused(self.out))?;
        let id = self.writer.add_channel(schema, topic, "json", &BTreeMap::new());
        let id = id.map_err(refused(self.out))?;
        self.channels.insert(id, Channel { id, topic, names, messages: 0 });
        Ok(id)
    }

    /// The message of `channel` that holds `values`, in the order of its names.
    fn body(&self, channel: u16, values: impl IntoIterator<Item = Option<Value>>) -> Value {
        let names = self.channels.get(&channel).into_iter().flat_map(|channel| &channel.names);
        let known = names.zip(values).filter_map(|(name, value)| Some((name.clone(), value?)));
        Value::Object(known.collect())
    }

    fn put(&mut self, channel: u16, at_s: f64, body: &Value) -> Result<(), Error> {
        let Some(channel) = self.channels.get_mut(&channel) else { return Ok(()) };
        let (log_time, sequence) = (nanoseconds(at_s), channel.messages);
        let header =
            MessageHeader { channel_id: channel.id, sequence, log_time, publish_time: log_time };
        channel.messages += 1;
        let text = body.to_string();
        let written = self.writer.write_to_known_channel(&header, text.as_bytes());
        written.map_err(refused(self.out))
    }

    /// The messages that tell how the rollouts came out.
    fn episodes(&mut self, session: &Recorded) -> Result<Vec<Later>, Error> {
        let episodes = Episodes::open(&session.file(EPISODES))?;
        let tally: Vec<String> = episodes.tally().to_vec();
        let names = EPISODE_COLUMNS.into_iter().chain(tally.iter().map(String::as_str));
        let channel = self.channel("/episode", names.chain(["attempt"]))?;
        let mut places = Places::of(&session.rollouts);
        let mut messages = Vec::new();
        for row in episodes {
            let row = row?;
            let (at_s, attempt) = places.end_of(row.phase, row.episode);
            let body = self.body(channel, episode(&row, attempt));
            messages.push(Later { at_s, channel, body });
        }
        Ok(messages)
    }

    /// The messages that tell what happened.
    fn events(&mut self, session: &Recorded) -> Result<Vec<Later>, Error> {
        let names: Vec<String> = EVENT_COLUMNS.iter().map(|name| (*name).to_owned()).collect();
        let mut properties = self.properties(&names);
        properties.extend(log_properties());
        let channel = self.register("/event", "foxglove.Log", names, &properties)?;
        let mut places = Places::of(&session.rollouts);
        let rows = read_events(&session.file(EVENTS))?;
        let messages = rows.into_iter().map(|row| {
            let at_s = places.of_event(&row);
            let mut body = self.body(channel, event(&row));
            if let Value::Object(body) = &mut body {
                body.extend(log(&row, at_s));
            }
            Later { at_s, channel, body }
        });
        Ok(messages.collect())
    }

    /// Writes the steps, and between them what is to come `later` in its time.
    fn steps(&mut self, session: &Recorded, later: Vec<Later>) -> Result<(), Error> {
        let steps = Steps::open(&session.file(STEPS))?;
        let state = self.channel("/state", steps.columns().iter().map(String::as_str))?;
        let action = self.channel("/action", ["u_human", "u_machine", "u", "u_applied", "raw"])?;
        let sharing = self.channel("/sharing", ["share", "success", "reward", "region"])?;
        let names = ["phase", "episode", "attempt", "step", "t", "lateness_us"];
        let place = self.channel("/place", names)?;
        let (mut walk, mut rollouts) = (Walk::default(), session.rollouts.iter());
        let mut later = later.into_iter().peekable();
        let mut current = None;
        for row in steps {
            let row = row?;
            if walk.begins(&row) {
                current = rollouts.next();
            }
            let Some(rollout) = current else { break };
            let at_s = rollout.begins_s + row.t;
            while let Some(message) = later.next_if(|message| message.at_s < at_s) {
                self.put(message.channel, message.at_s, &message.body)?;
            }
            let body = self.body(state, row.state.iter().map(|value| number(*value)));
            self.put(state, at_s, &body)?;
            self.put(place, at_s, &self.body(place, placed(&row, rollout)))?;
            if row.u_applied.is_some() {
                let actions = [row.u_human, row.u_machine, row.u, row.u_applied, row.raw];
                let body = self.body(action, actions.map(|value| value.and_then(number)));
                self.put(action, at_s, &body)?;
                self.put(sharing, at_s, &self.body(sharing, shared(row)))?;
            }
        }
        later.try_for_each(|message| self.put(message.channel, message.at_s, &message.body))
    }

    fn end(mut self) -> Result<Vec<(String, u64)>, Error> {
        self.writer.finish().map_err(refused(self.out))?;
        let channels = self.channels.values();
        Ok(channels.map(|channel| (channel.topic.to_owned(), channel.messages.into())).collect())
    }
}

/// What a JSON Schema says of a column of the tables.
fn property(task: &str, name: &str) -> Value {
    let column = column(task, name);
    let kind = match column.kind {
        Kind::Text => "string",
        Kind::Whole => "integer",
        Kind::Number => "number",
    };
    let description = match column.unit {
        "" => column.meaning.to_owned(),
        unit => format!("{} [{unit}]", column.meaning),
    };
    json!({ "type": kind, "description": description })
}

fn number(value: f64) -> Option<Value> {
    Number::from_f64(value).map(Value::Number)
}

fn placed(row: &StepRow<String>, rollout: &Rollout) -> [Option<Value>; 6] {
    [
        Some(row.phase.word().into()),
        Some(row.episode.into()),
        Some(rollout.attempt.into()),
        Some(row.step.into()),
        number(row.t),
        Some(row.lateness_us.into()),
    ]
}

fn shared(row: StepRow<String>) -> [Option<Value>; 4] {
    let [share, success, reward] =
        [row.share, row.success, row.reward].map(|value| value.and_then(number));
    [share, success, reward, row.region.map(Value::String)]
}

fn episode(row: &EpisodeRow, attempt: u32) -> Vec<Option<Value>> {
    let mut values = vec![
        Some(row.phase.word().into()),
        Some(row.episode.into()),
        number(row.start),
        Some(row.steps.into()),
        number(row.duration_s),
        Some(row.end.word().into()),
        number(row.total),
        number(row.mean_reward),
        row.share.and_then(number),
        row.success.and_then(number),
        row.receptive_fields.map(Into::into),
    ];
    values.extend(row.tallied.iter().map(|value| number(*value)));
    values.push(Some(attempt.into()));
    values
}

fn event(row: &EventRow<String>) -> [Option<Value>; 6] {
    let text = |text: &str| (!text.is_empty()).then(|| text.into());
    [
        text(&row.time),
        row.phase.map(|phase| phase.word().into()),
        row.episode.map(Into::into),
        row.step.map(Into::into),
        text(&row.event),
        text(&row.cause),
    ]
}

/// What Foxglove's panel of messages wants beside.
fn log_properties() -> Map<String, Value> {
    let whole = json!({ "type": "integer" });
    let time = json!({ "sec": whole, "nsec": whole });
    let time = json!({ "type": "object", "title": "time", "properties": time });
    let text = json!({ "type": "string" });
    let properties = [
        ("timestamp", time),
        ("level", whole.clone()),
        ("message", text.clone()),
        ("name", text.clone()),
        ("file", text),
        ("line", whole),
    ];
    properties.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

fn log(row: &EventRow<String>, at_s: f64) -> Map<String, Value> {
    /// The level of what is good to know.
    const INFO: u8 = 2;
    let message = match (row.event.as_str(), row.cause.as_str()) {
        (event, "") => event.to_owned(),
        (event, cause) => format!("{event}: {cause}"),
    };
    let at = nanoseconds(at_s);
    let fields = [
        ("timestamp", json!({ "sec": at / 1_000_000_000, "nsec": at % 1_000_000_000 })),
        ("level", INFO.into()),
        ("message", message.into()),
        ("name", "coadapt".into()),
        ("file", "".into()),
        ("line", 0.into()),
    ];
    fields.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "from 0; `as` keeps it"
)]
fn nanoseconds(seconds: f64) -> u64 {
    (seconds * 1e9).round() as u64
}

/// Where rows that name a rollout are on the line of time.
struct Places<'a> {
    rollouts: HashMap<(Phase, u32), Vec<&'a Rollout>>,
    first_of: HashMap<Phase, f64>,
    /// How often each rollout was thrown away so far.
    attempts: HashMap<(Phase, u32), u32>,
    end_s: f64,
    /// The time of the row before.
    latest_s: f64,
}

impl<'a> Places<'a> {
    fn of(all: &'a [Rollout]) -> Self {
        let mut rollouts: HashMap<_, Vec<&Rollout>> = HashMap::new();
        let mut first_of = HashMap::new();
        for rollout in all {
            rollouts.entry((rollout.phase, rollout.episode)).or_default().push(rollout);
            first_of.entry(rollout.phase).or_insert(rollout.begins_s);
        }
        let end_s = all.last().map_or(0.0, |last| last.begins_s + last.lasts_s);
        Self { rollouts, first_of, attempts: HashMap::new(), end_s, latest_s: 0.0 }
    }

    fn attempt(&self, phase: Phase, episode: u32, attempt: u32) -> Option<&'a Rollout> {
        self.rollouts.get(&(phase, episode))?.get(attempt as usize).copied()
    }

    /// When the next attempt at a rollout ended, and which it was.
    fn end_of(&mut self, phase: Phase, episode: u32) -> (f64, u32) {
        let counted = self.attempts.entry((phase, episode)).or_default();
        let attempt = *counted;
        *counted += 1;
        if let Some(rollout) = self.attempt(phase, episode, attempt) {
            self.latest_s = rollout.begins_s + rollout.lasts_s;
        }
        (self.latest_s, attempt)
    }

    /// When an event took place: no earlier than those before it.
    fn of_event(&mut self, event: &EventRow<String>) -> f64 {
        let at_s = match (event.phase, event.episode) {
            (Some(phase), Some(episode)) => self.of_step(phase, episode, event.step.unwrap_or(0)),
            (Some(phase), None) => self.first_of.get(&phase).copied(),
            _ if matches!(event.event.as_str(), "complete" | "aborted") => Some(self.end_s),
            _ => None,
        };
        if let (Some(phase), Some(episode), "discard") =
            (event.phase, event.episode, event.event.as_str())
        {
            *self.attempts.entry((phase, episode)).or_default() += 1;
        }
        self.latest_s = self.latest_s.max(at_s.unwrap_or(0.0));
        self.latest_s
    }

    fn of_step(&self, phase: Phase, episode: u32, step: u32) -> Option<f64> {
        let attempt = self.attempts.get(&(phase, episode)).copied().unwrap_or(0);
        let rollout = self.attempt(phase, episode, attempt)?;
        let part = f64::from(step.min(rollout.last_step)) / f64::from(rollout.last_step.max(1));
        Some(rollout.begins_s + part * rollout.lasts_s)
    }
}

/// For `map_err`: what could not be written to `path`.
fn refused(path: &Path) -> impl Fn(mcap::McapError) -> Error + use<'_> {
    move |fault| Error::Io {
        action: "write",
        path: path.to_owned(),
        cause: io::Error::other(fault),
    }
}
