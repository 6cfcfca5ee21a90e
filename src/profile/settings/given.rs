//! The entries of a settings file, RON or JSON, with the places of their values.

use std::fmt;
use std::ops::Range;

use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

use crate::profile::report::{Fault, Place};
use crate::profile::{ron_options, scan};

/// How a settings file is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Manner {
    /// `(key: value, …)`.
    Ron,
    /// `{"key": value, …}`.
    Json,
}

/// One `key: value`.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// The key as given.
    pub key: String,
    /// Where the value stands.
    pub at: Range<usize>,
    /// The value.
    pub value: Given,
}

/// A value as it was given.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub(super) enum Given {
    /// `true` or `false`.
    Flag(bool),
    /// A number.
    Number(f64),
    /// A word or text.
    Word(String),
    /// Numbers, such as a diagonal.
    List(Vec<f64>),
    /// Rows of numbers.
    Matrix(Vec<Vec<f64>>),
    /// As a policy's settings have it.
    Tagged(Tagged),
    /// `None` or `null`.
    Nothing,
    /// What no setting can be.
    #[serde(skip)]
    Other,
}

impl Given {
    /// Whether two values say the same; the case of words does not matter.
    pub(super) fn says_as(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Word(one), Self::Word(other)) => one.eq_ignore_ascii_case(other),
            _ => self == other,
        }
    }
}

/// A metric as a policy's settings have it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Tagged {
    Scalar(f64),
    Diagonal(Vec<f64>),
    Full(Vec<Vec<f64>>),
}

impl Given {
    /// The same without a tag.
    fn plain(self) -> Self {
        match self {
            Self::Tagged(Tagged::Scalar(number)) => Self::Number(number),
            Self::Tagged(Tagged::Diagonal(list)) => Self::List(list),
            Self::Tagged(Tagged::Full(rows)) => Self::Matrix(rows),
            other => other,
        }
    }
}

/// The entries of `source`.
///
/// # Errors
/// Where it cannot be read any further.
pub(super) fn entries(source: &str, manner: Manner) -> Result<Vec<Entry>, Box<Fault>> {
    match manner {
        Manner::Ron => ron_entries(source),
        Manner::Json => json_entries(source),
    }
}

fn ron_entries(source: &str) -> Result<Vec<Entry>, Box<Fault>> {
    let outline = scan::entries(source).map_err(|broken| {
        let why = broken.why.replace("the profile", "the file").replace("profile", "settings file");
        unreadable(source, broken.at, why)
    })?;
    // Of a whole profile only the learner's section counts.
    let is_profile = outline.iter().any(|entry| entry.path == "learner" && entry.is_section);
    let mut entries = Vec::new();
    let mut end = 0;
    for mut entry in outline {
        if is_profile {
            match entry.path.strip_prefix("learner.") {
                Some(key) => {
                    let key = key.to_owned();
                    entry.path = key;
                }
                None => continue,
            }
        }
        // What lies within a section belongs to its value.
        if entry.key.start < end {
            continue;
        }
        end = entry.end;
        let text = source.get(entry.value.clone()).unwrap_or_default();
        entries.push(Entry { key: entry.path, value: ron_value(text), at: entry.value });
    }
    Ok(entries)
}

fn ron_value(text: &str) -> Given {
    let text = text.trim();
    let inner = text.strip_prefix("Some(").and_then(|rest| rest.strip_suffix(')'));
    let text = inner.unwrap_or(text).trim();
    let is_word = text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    match text {
        "None" => Given::Nothing,
        word if is_word && !["true", "false", "inf", "NaN"].contains(&word) => {
            Given::Word(word.to_owned())
        }
        _ => ron_options().from_str(text).unwrap_or(Given::Other),
    }
}

fn json_entries(source: &str) -> Result<Vec<Entry>, Box<Fault>> {
    let Raw(entries) = serde_json::from_str(source).map_err(|error| {
        let line: usize =
            source.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum();
        let at = (line + error.column().saturating_sub(1)).min(source.len());
        unreadable(source, at..at, error.to_string())
    })?;
    let entry = |(key, raw): (String, &RawValue)| {
        let text = raw.get();
        // The text is a part of the source: how far it is from its start is its place.
        let start = (text.as_ptr() as usize).saturating_sub(source.as_ptr() as usize);
        let value = serde_json::from_str(text).unwrap_or(Given::Other).plain();
        Entry { key, at: start..start + text.len(), value }
    };
    Ok(entries.into_iter().map(entry).collect())
}

fn unreadable(source: &str, at: Range<usize>, why: String) -> Box<Fault> {
    let line = scan::line_of(source, at.start);
    Box::new(Fault {
        key: String::new(),
        message: format!("the settings cannot be read beyond line {line}"),
        expected: why,
        help: None,
        place: Place::Text(at),
    })
}

/// An object's entries in order, a doubled key twice.
struct Raw<'a>(Vec<(String, &'a RawValue)>);

impl<'de> Deserialize<'de> for Raw<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries;

        impl<'de> Visitor<'de> for Entries {
            type Value = Raw<'de>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object of settings, {\"init_d\": 25.0, …}")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Raw<'de>, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(Raw(entries))
            }
        }

        deserializer.deserialize_map(Entries)
    }
}
