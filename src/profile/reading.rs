//! From a profile's text to a [`Profile`], or to all of its faults.
//!
//! Each value is read on its own, as if it were the only one in the file: so one bad value
//! hides no other, and each fault is told where it stands. What is bad is then blanked, and
//! the ranges of the rest are checked.

use std::collections::HashMap;

use ron::error::Error;

use super::document::{Document, Set};
use super::edit;
use super::experiment::{Experiment, Reader};
use super::layout::Profile;
use super::library;
use super::report::{Fault, MOST_SHOWN, Place, Report, clip};
use super::ron_options;
use super::scan::{self, Entry, line_of};
use crate::check::{self, Check, Checker};

/// Everything that the profiles of one task may hold.
pub(super) struct Keys {
    reader: Reader,
    /// Each key with its default.
    leaves: Vec<(String, String)>,
    sections: Vec<String>,
    /// The keys whose default is the task's own, not that of the rooms: what its plain
    /// profile says.
    own: Vec<String>,
}

impl Keys {
    /// The keys of `task`, if there is such a task.
    pub fn of(task: &str) -> Option<Self> {
        let reader = Experiment::reader(task)?;
        let text = |profile: &str| reader(profile).map(|profile| profile.to_ron());
        let bare = text("()").unwrap_or_default();
        let plain = library::built_in(task).and_then(|source| text(source).ok());
        let defaults = plain.unwrap_or_else(|| bare.clone());
        let outline = |text: &str| scan::entries(text).unwrap_or_default();
        let bare_values: HashMap<String, &str> = outline(&bare)
            .into_iter()
            .filter_map(|entry| Some((entry.path, bare.get(entry.value)?)))
            .collect();
        let mut keys = Self { reader, leaves: Vec::new(), sections: Vec::new(), own: Vec::new() };
        for entry in outline(&defaults) {
            let value = defaults.get(entry.value).unwrap_or_default();
            if entry.is_section {
                keys.sections.push(entry.path);
                continue;
            }
            if bare_values.get(&entry.path) != Some(&value) {
                keys.own.push(entry.path.clone());
            }
            keys.leaves.push((entry.path, value.to_owned()));
        }
        Some(keys)
    }

    /// With the keys of a real plant, for a profile that has one.
    fn with_plant(mut self) -> Self {
        const SECTION: &str = "backend";
        let text = (self.reader)("(backend: ())").map(|profile| profile.to_ron());
        let text = text.unwrap_or_default();
        self.leaves.retain(|(path, _)| path != SECTION);
        for entry in scan::entries(&text).unwrap_or_default() {
            let is_below =
                entry.path.strip_prefix(SECTION).is_some_and(|rest| rest.starts_with('.'));
            if entry.is_section && (is_below || entry.path == SECTION) {
                self.sections.push(entry.path);
            } else if is_below {
                let value = text.get(entry.value).unwrap_or_default().to_owned();
                self.leaves.push((entry.path, value));
            }
        }
        self
    }

    /// `text` with the task's own defaults for the keys that it leaves out.
    fn complete(&self, mut text: String) -> String {
        let given = scan::entries(&text).unwrap_or_default();
        let is_given = |key: &str| given.iter().any(|entry| entry.path == key);
        for key in self.own.iter().filter(|key| !is_given(key)) {
            let value = self.default(key).unwrap_or_default();
            text = edit::put(&text, key, value).unwrap_or(text);
        }
        text
    }

    /// The paths of all keys that hold a value.
    pub fn paths(&self) -> impl Iterator<Item = &str> {
        self.leaves.iter().map(|(path, _)| path.as_str())
    }

    fn default(&self, path: &str) -> Option<&str> {
        self.leaves.iter().find(|(leaf, _)| leaf == path).map(|(_, value)| value.as_str())
    }

    fn is_section(&self, path: &str) -> bool {
        self.sections.iter().any(|section| section == path)
    }

    /// Reads `value` as the only one of a profile.
    fn read_alone(&self, path: &str, value: &str) -> Result<(), Error> {
        let sections = path.split('.').count() - 1;
        let text = format!("({}: {value}{})", path.replace('.', ":("), ")".repeat(sections));
        (self.reader)(&text).map(drop).map_err(|fault| fault.code)
    }

    /// The value of a `--set` as RON: as given, or else put into quotes.
    pub fn settle(&self, set: &Set) -> Result<String, Box<Fault>> {
        let Set { key, value } = set;
        if self.is_section(key) {
            let message = format!("`{}` is a section, not a key", clip(key));
            let some = self.paths().find(|path| path.starts_with(&format!("{key}.")));
            let expected = format!("set one of its keys, such as {}", some.unwrap_or(key));
            return Err(Box::new(set.fault(true, message, expected, None)));
        }
        if self.default(key).is_none() {
            return Err(Box::new(self.unknown(key, |message, help| {
                set.fault(true, message, "no such key".to_owned(), help)
            })));
        }
        let quoted = ron_options().to_string(value).unwrap_or_default();
        let plain = if scan::is_one_value(value) {
            self.read_alone(key, value)
        } else {
            Err(Error::Message(String::new()))
        };
        match plain {
            Ok(()) => Ok(value.trim().to_owned()),
            Err(_) if self.read_alone(key, &quoted).is_ok() => Ok(quoted),
            Err(error) => {
                let (expected, help) = self.expected(key, &error);
                let message = format!("`{key}` cannot be {}", or_nothing(value));
                Err(Box::new(set.fault(false, message, expected, help)))
            }
        }
    }

    /// What is wrong with the value of `entry`, whose key is known.
    fn misfit(&self, entry: &Entry, source: &str) -> Option<Fault> {
        let key = &entry.path;
        let value = source.get(entry.value.clone()).unwrap_or_default();
        let error = self.read_alone(key, value).err()?;
        let (expected, help) = self.expected(key, &error);
        let message = format!("`{key}` cannot be {}", or_nothing(value));
        let place = Place::Text(entry.value.clone());
        Some(Fault { key: key.clone(), message, expected, help, place })
    }

    fn unknown(&self, key: &str, fault: impl FnOnce(String, Option<String>) -> Fault) -> Fault {
        let known = self.paths().chain(self.sections.iter().map(String::as_str));
        let help = match nearest(key, known) {
            Some(near) => format!("did you mean `{near}`?"),
            None => self.neighbours(key),
        };
        fault(format!("unknown key `{}`", clip(key)), Some(help))
    }

    /// The keys beside which `key` was given.
    fn neighbours(&self, key: &str) -> String {
        let section = key.rsplit_once('.').map_or("", |(section, _)| section);
        let section = if self.is_section(section) { section } else { "" };
        let here = self.paths().chain(self.sections.iter().map(String::as_str));
        let names: Vec<&str> = here
            .filter_map(|path| match path.rsplit_once('.') {
                Some((parent, name)) => (parent == section).then_some(name),
                None => section.is_empty().then_some(path),
            })
            .collect();
        let place =
            if section.is_empty() { "a profile".to_owned() } else { format!("`{section}`") };
        format!("the keys of {place} are {}", names.join(", "))
    }

    /// What should stand in place of a value that was refused with `error`.
    fn expected(&self, key: &str, error: &Error) -> (String, Option<String>) {
        let example = self.default(key).unwrap_or("()");
        let such_as = |what: &str| match example {
            "None" => (format!("expected {what}, or None"), None),
            _ => (format!("expected {what}, such as {}", clip(example)), None),
        };
        match error {
            Error::ExpectedFloat => such_as("a number"),
            Error::ExpectedInteger
            | Error::IntegerOutOfBounds
            | Error::InvalidIntegerDigit { .. } => such_as("a whole number of 0 or more"),
            Error::ExpectedBoolean => ("expected true or false".to_owned(), None),
            Error::ExpectedString => ("expected a text in \"quotes\"".to_owned(), None),
            Error::ExpectedArray => such_as("a list in [brackets]"),
            Error::NoSuchEnumVariant { expected, found, .. } => (
                format!("expected one of {}", expected.join(", ")),
                nearest(found, expected.iter().copied()).map(|n| format!("did you mean `{n}`?")),
            ),
            Error::NoSuchStructField { expected, found, .. } => (
                format!("`{}` is none of {}", clip(found), expected.join(", ")),
                nearest(found, expected.iter().copied()).map(|n| format!("did you mean `{n}`?")),
            ),
            Error::ExpectedStructLike | Error::ExpectedNamedStructLike(_) => {
                ("expected a section, `( key: value, … )`".to_owned(), None)
            }
            _ if example.parse::<u64>().is_ok() => such_as("a whole number of 0 or more"),
            _ if example.parse::<f64>().is_ok() => such_as("a number"),
            _ => such_as("another value"),
        }
    }
}

/// The one of `known` that `given` was probably meant to be.
pub(super) fn nearest<'a>(given: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    const LONGEST: usize = 80;
    if given.len() > LONGEST {
        return None;
    }
    let name = |path: &'a str| path.rsplit_once('.').map_or(path, |(_, name)| name);
    let given_name = given.rsplit_once('.').map_or(given, |(_, name)| name);
    known
        .map(|path| {
            let whole = strsim::normalized_damerau_levenshtein(given, path);
            // The right name in the wrong section.
            let part = strsim::normalized_damerau_levenshtein(given_name, name(path)) - 0.1;
            (whole.max(part), path)
        })
        .filter(|(likeness, _)| *likeness >= 0.6)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, path)| path)
}

/// Reads `document`, with its `--set`s.
pub(super) fn read(document: &Document) -> Result<Profile, Report> {
    let report = |faults: Vec<Fault>| Report {
        shown: document.shown().to_owned(),
        source: document.source().to_owned(),
        faults,
    };
    let source = document.source();
    let entries =
        scan::entries(source).map_err(|broken| report(vec![broken_fault(source, broken)]))?;
    let keys = keys_of(document, &entries).map_err(|fault| report(vec![*fault]))?;

    let mut faults = Vec::new();
    let mut text = source.to_owned();
    for (entry, fault) in faults_of_entries(source, &entries, &keys) {
        edit::blank(&mut text, entry.key.start..entry.end);
        faults.push(fault);
    }
    for set in document.sets() {
        match keys.settle(set) {
            Ok(value) => text = edit::put(&text, &set.key, &value).unwrap_or(text),
            Err(fault) => faults.push(*fault),
        }
    }
    match (keys.reader)(&keys.complete(text)) {
        Ok(profile) => {
            faults.extend(faults_of_ranges(&profile, document, &entries));
            faults.sort_by_key(|fault| fault.place.order());
            if faults.is_empty() { Ok(profile) } else { Err(report(faults)) }
        }
        Err(_) if !faults.is_empty() => Err(report(faults)),
        Err(error) => Err(report(vec![unreadable(source, &error)])),
    }
}

/// The keys of the task that `document` names.
pub(super) fn keys_of(document: &Document, entries: &[Entry]) -> Result<Keys, Box<Fault>> {
    const KEY: &str = "task";
    let tasks = Experiment::NAMES.join(", ");
    let expected = format!("expected one of {tasks}");
    let fault = |message: String, help, place| Fault {
        key: KEY.to_owned(),
        message,
        expected: expected.clone(),
        help,
        place,
    };
    let help = |name: &str| {
        nearest(name, Experiment::NAMES.into_iter()).map(|near| format!("did you mean `{near}`?"))
    };
    let has_plant = entries.iter().any(|entry| entry.path == "backend" && entry.is_section);
    let of =
        |name: &str| Keys::of(name).map(|keys| if has_plant { keys.with_plant() } else { keys });
    if let Some(set) = document.sets().iter().rev().find(|set| set.key == KEY) {
        let name = set.value.trim().trim_matches('"');
        return of(name).ok_or_else(|| {
            let message = format!("unknown task `{}`", clip(name));
            Box::new(fault(message, help(name), set.place(false)))
        });
    }
    let source = document.source();
    let Some(entry) = entries.iter().find(|entry| entry.path == KEY) else {
        let open = source.find('(').unwrap_or(0);
        let place = Place::Text(open..open + 1);
        return Err(Box::new(fault("the profile names no task".to_owned(), None, place)));
    };
    let value = source.get(entry.value.clone()).unwrap_or_default();
    let name = ron_options().from_str::<String>(value);
    let known = name.as_deref().ok().and_then(of);
    known.ok_or_else(|| {
        let place = Place::Text(entry.value.clone());
        Box::new(match name {
            Ok(name) => fault(format!("unknown task {:?}", clip(&name)), help(&name), place),
            Err(_) => fault(format!("`task` is {}", clip(value)), None, place),
        })
    })
}

/// The entries that are unknown, given twice, or of another type than their key's.
fn faults_of_entries<'a>(
    source: &str,
    entries: &'a [Entry],
    keys: &Keys,
) -> Vec<(&'a Entry, Fault)> {
    let mut faults = Vec::new();
    // Where each key was first seen, and in which line.
    let mut seen: HashMap<&str, (usize, usize)> = HashMap::new();
    let (mut line, mut counted) = (1, 0);
    let mut judged = 0;
    for entry in entries {
        // What lies within a bad or indivisible entry was judged with it.
        if entry.key.start < judged {
            continue;
        }
        let at = |range: &std::ops::Range<usize>| Place::Text(range.clone());
        line += line_of(source.get(counted..entry.key.start).unwrap_or_default(), usize::MAX) - 1;
        counted = entry.key.start;
        let (first, first_line) = *seen.entry(&entry.path).or_insert((counted, line));
        let fault = if first != entry.key.start {
            Some(Fault {
                key: entry.path.clone(),
                message: format!("`{}` is given twice", clip(&entry.path)),
                expected: format!("first given in line {first_line}"),
                help: Some("remove one of the two".to_owned()),
                place: at(&entry.key),
            })
        } else if keys.is_section(&entry.path) && entry.is_section {
            continue;
        } else if keys.is_section(&entry.path) || keys.default(&entry.path).is_some() {
            keys.misfit(entry, source)
        } else if faults.len() > MOST_SHOWN {
            // Nobody reads this far: spare the search for what was meant.
            let message = format!("unknown key `{}`", clip(&entry.path));
            let expected = "no such key".to_owned();
            let place = at(&entry.key);
            Some(Fault { key: entry.path.clone(), message, expected, help: None, place })
        } else {
            Some(keys.unknown(&entry.path, |message, help| Fault {
                key: entry.path.clone(),
                message,
                expected: "no such key".to_owned(),
                help,
                place: at(&entry.key),
            }))
        };
        judged = entry.end;
        faults.extend(fault.map(|fault| (entry, fault)));
    }
    faults
}

/// The values that [`Check`] refuses.
fn faults_of_ranges(profile: &Profile, document: &Document, entries: &[Entry]) -> Vec<Fault> {
    let mut refused = Vec::new();
    profile.check(&mut Checker::new(&mut refused));
    let fault = |check::Fault { key, value, allowed }: check::Fault| {
        let place = if let Some(set) = document.sets().iter().find(|set| set.key == key) {
            set.place(false)
        } else {
            let entry = entries.iter().find(|entry| entry.path == key);
            entry.map_or(Place::Default, |entry| Place::Text(entry.value.clone()))
        };
        let message = format!("`{key}` is {}, which is not allowed", clip(&value));
        Fault { key, message, expected: format!("allowed: {allowed}"), help: None, place }
    };
    refused.into_iter().map(fault).collect()
}

fn broken_fault(source: &str, broken: scan::Broken) -> Fault {
    let line = line_of(source, broken.at.start);
    Fault {
        key: String::new(),
        message: format!("the profile cannot be read beyond line {line}"),
        expected: broken.why,
        help: None,
        place: Place::Text(broken.at),
    }
}

/// A fault of the text that no single value is to blame for.
pub(super) fn unreadable(source: &str, error: &ron::error::SpannedError) -> Fault {
    let line = error.span.end.line;
    let start: usize = source.split_inclusive('\n').take(line - 1).map(str::len).sum();
    let rest = source.get(start..).unwrap_or_default();
    let column = rest.char_indices().nth(error.span.end.col - 1).map_or(rest.len(), |(at, _)| at);
    Fault {
        key: String::new(),
        message: format!("the profile cannot be read beyond line {line}"),
        expected: clip(&error.code.to_string()),
        help: None,
        place: Place::Text(start + column..start + column),
    }
}

fn or_nothing(value: &str) -> String {
    if value.trim().is_empty() { "empty".to_owned() } else { clip(value) }
}
