//! Texts in RON that are no profiles but stand beside them: studies.

use std::collections::BTreeSet;
use std::path::Path;

use serde::de::DeserializeOwned;

use super::library::{ProfileError, read_text};
use super::reading::{nearest, unreadable};
use super::report::{Fault, Place, Report, clip};
use super::{ron_options, scan};

/// A text, and what messages call it.
#[derive(Clone, Debug)]
pub struct Text {
    name: String,
    shown: String,
    source: String,
}

/// Something wrong with one value of a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wrong {
    /// The key, a dotted path; of a value in a list that of the list.
    pub key: &'static str,
    /// What is wrong.
    pub message: String,
    /// What would be right.
    pub expected: String,
}

impl Text {
    /// The text called `name_or_path`: `NAME.ron` in `folder`, or else the one of that name
    /// among `built_in`; anything with a slash or ending in `.ron` is a path. `what` it is, one
    /// word, for messages.
    ///
    /// # Errors
    /// There is no such text (the known ones are named), or it cannot be read.
    pub fn find(
        what: &'static str,
        name_or_path: &str,
        folder: &Path,
        built_in: &[(&str, &str)],
    ) -> Result<Self, ProfileError> {
        if Self::is_path(name_or_path) {
            return Self::open(Path::new(name_or_path));
        }
        let local = folder.join(format!("{name_or_path}.ron"));
        if !name_or_path.is_empty() && local.exists() {
            return Self::open(&local);
        }
        if let Some((name, source)) = built_in.iter().find(|(name, _)| *name == name_or_path) {
            return Ok(Self {
                name: (*name).to_owned(),
                shown: format!("{name}.ron (built in)"),
                source: (*source).to_owned(),
            });
        }
        let known = Self::names(folder, built_in);
        let near = nearest(name_or_path, known.iter().map(String::as_str));
        Err(ProfileError::Stranger {
            what,
            name: clip(name_or_path),
            hint: near.map(|near| format!(": did you mean `{near}`?")).unwrap_or_default(),
            known: known.join(", "),
        })
    }

    /// The names of all texts: files of `folder`, and those `built_in`.
    #[must_use]
    pub fn names(folder: &Path, built_in: &[(&str, &str)]) -> Vec<String> {
        let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let files = files
            .map(|file| file.path())
            .filter(|path| path.extension().is_some_and(|end| end == "ron") && path.is_file());
        let files = files.filter_map(|path| Some(path.file_stem()?.to_string_lossy().into_owned()));
        let built_in = built_in.iter().map(|(name, _)| (*name).to_owned());
        files.chain(built_in).collect::<BTreeSet<String>>().into_iter().collect()
    }

    /// Whether these words are a path, and no name.
    #[must_use]
    pub fn is_path(words: &str) -> bool {
        words.contains(['/', std::path::MAIN_SEPARATOR])
            || Path::new(words).extension().is_some_and(|end| end == "ron")
    }

    fn open(path: &Path) -> Result<Self, ProfileError> {
        let source = read_text(path)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { name, shown: path.display().to_string(), source })
    }

    /// The text `source`; messages call it `shown`.
    #[must_use]
    pub fn new(shown: &str, source: impl Into<String>) -> Self {
        Self { name: shown.to_owned(), shown: shown.to_owned(), source: source.into() }
    }

    /// The name: a file's without folder and ending.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What messages call it.
    #[must_use]
    pub fn shown(&self) -> &str {
        &self.shown
    }

    /// What the text says.
    ///
    /// # Errors
    /// With the place at which it cannot be understood.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, Report> {
        ron_options()
            .from_str(&self.source)
            .map_err(|error| self.report(vec![unreadable(&self.source, &error)]))
    }

    /// The message for everything that is `wrong`, each with its place.
    #[must_use]
    pub fn refuse(&self, wrong: Vec<Wrong>) -> Report {
        let entries = scan::entries(&self.source).unwrap_or_default();
        let place = |key: &str| match entries.iter().find(|entry| entry.path == key) {
            Some(entry) => Place::Text(entry.value.clone()),
            None => Place::Default,
        };
        let fault = |wrong: Wrong| Fault {
            key: wrong.key.to_owned(),
            message: wrong.message,
            expected: wrong.expected,
            help: None,
            place: place(wrong.key),
        };
        self.report(wrong.into_iter().map(fault).collect())
    }

    fn report(&self, faults: Vec<Fault>) -> Report {
        Report { shown: self.shown.clone(), source: self.source.clone(), faults }
    }
}
