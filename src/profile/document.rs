//! A profile as a text, with the changes made to it.

use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::library::{self, ProfileError};
use super::report::{Fault, Place, Report};
use super::scan::line_of;
use super::{Profile, edit, reading, scan};

/// A profile's text, where it came from, and the `--set`s on top of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Document {
    name: String,
    shown: String,
    source: String,
    sets: Vec<Set>,
}

/// One `--set KEY=VALUE`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Set {
    /// The dotted path.
    pub key: String,
    /// The value, as given.
    pub value: String,
}

impl Set {
    /// The place of the key, or else of the value.
    pub(super) fn place(&self, key: bool) -> Place {
        let text = format!("{}={}", self.key, self.value);
        let split = self.key.len();
        let at: Range<usize> = if key { 0..split } else { split + 1..text.len() };
        Place::Set { text, at }
    }

    pub(super) fn fault(
        &self,
        at_key: bool,
        message: String,
        expected: String,
        help: Option<String>,
    ) -> Fault {
        Fault { key: self.key.clone(), message, expected, help, place: self.place(at_key) }
    }
}

/// Where a value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// No text says it: the built-in default.
    Default,
    /// The profile's text.
    File {
        /// From 1.
        line: usize,
    },
    /// A `--set`.
    Set,
}

impl Document {
    /// The profile called `name_or_path`.
    ///
    /// A plain name stands for `NAME.ron` in the folder `profiles`, or else for the
    /// built-in profile of that name; anything with a slash or ending in `.ron` is a path.
    ///
    /// # Errors
    /// There is no such profile (the known ones are named), it cannot be read, is a folder,
    /// larger than 1 MiB, or no UTF-8.
    pub fn find(name_or_path: &str, profiles: &Path) -> Result<Self, ProfileError> {
        let is_path = name_or_path.contains(['/', std::path::MAIN_SEPARATOR])
            || Path::new(name_or_path).extension().is_some_and(|end| end == "ron");
        if is_path {
            return Self::open(Path::new(name_or_path));
        }
        let local = profiles.join(format!("{name_or_path}.ron"));
        if !name_or_path.is_empty() && local.exists() {
            return Self::open(&local);
        }
        match library::built_in(name_or_path) {
            Some(text) => Ok(Self {
                name: name_or_path.to_owned(),
                shown: format!("{name_or_path}.ron (built in)"),
                source: text.to_owned(),
                sets: Vec::new(),
            }),
            None => Err(library::no_such(name_or_path, profiles)),
        }
    }

    fn open(path: &Path) -> Result<Self, ProfileError> {
        let source = library::read_text(path)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { name, ..Self::from_text(&path.display().to_string(), source) })
    }

    /// The profile with this text; messages call it `shown`.
    #[must_use]
    pub fn from_text(shown: &str, source: impl Into<String>) -> Self {
        let shown = shown.to_owned();
        Self { name: shown.clone(), shown, source: source.into(), sets: Vec::new() }
    }

    /// The name: a file's without folder and ending.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How messages call it: the path as given.
    #[must_use]
    pub fn shown(&self) -> &str {
        &self.shown
    }

    /// The text without the changes.
    #[must_use]
    pub fn source(&self) -> &str {
        &self.source
    }

    /// The changes, in the order of their first [`set`](Self::set).
    #[must_use]
    pub fn sets(&self) -> &[Set] {
        &self.sets
    }

    /// Changes `key`, a dotted path such as `plant.pole_length_m`, to `value`.
    ///
    /// Quotes around a text may be left out. A key or value that does not fit is reported
    /// by [`read`](Self::read), together with everything else.
    pub fn set(&mut self, key: &str, value: &str) {
        let value = value.to_owned();
        match self.sets.iter_mut().find(|set| set.key == key) {
            Some(set) => set.value = value,
            None => self.sets.push(Set { key: key.to_owned(), value }),
        }
    }

    /// Makes all the changes of `sets`. A number of rollouts stands in place of the profile's
    /// duration.
    pub fn change<'a>(&mut self, sets: impl IntoIterator<Item = (&'a str, &'a str)>) {
        for (key, value) in sets {
            self.set(key, value);
        }
        let is_set = |key: &str| self.sets.iter().any(|set| set.key == key);
        if is_set("session.main_rollouts") && !is_set("session.main_duration_s") {
            self.set("session.main_duration_s", "None");
        }
    }

    /// Takes back the change of `key`, if there is one.
    pub fn unset(&mut self, key: &str) {
        self.sets.retain(|set| set.key != key);
    }

    /// The profile that this text and its changes stand for.
    ///
    /// # Errors
    /// Everything that is wrong with it, all at once.
    pub fn read(&self) -> Result<Profile, Report> {
        reading::read(self)
    }

    /// The text with every change that fits put into its place; comments are kept.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = self.source.clone();
        let entries = scan::entries(&self.source).unwrap_or_default();
        if let Ok(keys) = reading::keys_of(self, &entries) {
            for set in &self.sets {
                if let Ok(value) = keys.settle(set) {
                    text = edit::put(&text, &set.key, &value).unwrap_or(text);
                }
            }
        }
        text
    }

    /// Where the value of `key` comes from.
    #[must_use]
    pub fn origin(&self, key: &str) -> Origin {
        if self.sets.iter().any(|set| set.key == key) {
            return Origin::Set;
        }
        let entries = scan::entries(&self.source).unwrap_or_default();
        entries.iter().find(|entry| entry.path == key).map_or(Origin::Default, |entry| {
            Origin::File { line: line_of(&self.source, entry.key.start) }
        })
    }

    /// The keys that were [`set`](Self::set).
    #[must_use]
    pub fn changed(&self) -> Vec<String> {
        self.sets.iter().map(|set| set.key.clone()).collect()
    }

    /// Writes [`text`](Self::text) to `path`, whole or not at all.
    ///
    /// # Errors
    /// The file exists and `overwrite` is false, or the system refuses.
    pub fn save(&self, path: &Path, overwrite: bool) -> Result<(), ProfileError> {
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        let refused = |error| ProfileError::Unwritable { path: path.to_owned(), error };
        std::fs::create_dir_all(&folder).map_err(refused)?;
        let mut file =
            tempfile::Builder::new().prefix(".profile-").tempfile_in(&folder).map_err(refused)?;
        file.write_all(self.text().as_bytes()).map_err(refused)?;
        file.as_file().sync_all().map_err(refused)?;
        let persisted = if overwrite { file.persist(path) } else { file.persist_noclobber(path) };
        match persisted {
            Ok(_) => Ok(()),
            Err(fault) if fault.error.kind() == std::io::ErrorKind::AlreadyExists => {
                Err(ProfileError::Exists { path: path.to_owned() })
            }
            Err(fault) => Err(refused(fault.error)),
        }
    }
}
