//! The shipped profiles, those of a folder, and reading their files.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::reading::nearest;

/// The profiles built into the program.
const BUILT_IN: [(&str, &str); 12] = [
    ("balance", include_str!("../../profiles/balance.ron")),
    ("balance-modern", include_str!("../../profiles/balance-modern.ron")),
    ("cobs-cart-pole", include_str!("../../profiles/cobs-cart-pole.ron")),
    ("mountain-car", include_str!("../../profiles/mountain-car.ron")),
    ("mountain-car-modern", include_str!("../../profiles/mountain-car-modern.ron")),
    ("physical-balance", include_str!("../../profiles/physical-balance.ron")),
    ("physical-cart-pole", include_str!("../../profiles/physical-cart-pole.ron")),
    ("physical-cart-pole-short", include_str!("../../profiles/physical-cart-pole-short.ron")),
    ("speed-up", include_str!("../../profiles/speed-up.ron")),
    ("speed-up-modern", include_str!("../../profiles/speed-up-modern.ron")),
    ("swing-up", include_str!("../../profiles/swing-up.ron")),
    ("swing-up-modern", include_str!("../../profiles/swing-up-modern.ron")),
];

/// No profile is longer than this, bytes.
const LONGEST: u64 = 1 << 20;

/// Why there is no profile's text, or it could not be kept.
#[derive(Debug, thiserror::Error)]
pub enum ProfileError {
    /// Neither the folder nor the program has it.
    #[error("there is no profile `{name}`{hint}; the known ones are {known}")]
    Unknown {
        /// As asked for.
        name: String,
        /// `: did you mean …?`, or nothing.
        hint: String,
        /// The names of all profiles.
        known: String,
    },
    /// Another kind of text, which neither a folder nor the program has.
    #[error("there is no {what} `{name}`{hint}; the known ones are {known}, or give a path")]
    Stranger {
        /// What it should be.
        what: &'static str,
        /// As asked for.
        name: String,
        /// `: did you mean …?`, or nothing.
        hint: String,
        /// The names of all.
        known: String,
    },
    /// The path leads to a folder.
    #[error("{} is a folder, not a profile; name a file in it, such as {}", path.display(), path.join("balance.ron").display())]
    Folder {
        /// The folder.
        path: PathBuf,
    },
    /// More than 1 MiB.
    #[error("{} is larger than 1 MiB: that is no profile", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// Bytes that are no UTF-8.
    #[error("{} is no text: byte {at} is not UTF-8; save it as UTF-8", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// The first such byte, from 0.
        at: usize,
    },
    /// The system does not give it.
    #[error("profile {} cannot be read: {error}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// A profile is not replaced unless asked for.
    #[error("{} exists already and was left as it is; choose another name", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The system does not take it.
    #[error("profile {} cannot be written: {error}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
}

/// One line of `profile list`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listed {
    /// The name.
    pub name: String,
    /// Its first comment line.
    pub title: String,
    /// Its file; `None` when it is built in.
    pub path: Option<PathBuf>,
}

/// All profiles by name: those of the folder `profiles`, then the built-in ones that it
/// does not replace. Files that cannot be read are listed with the reason as their title.
#[must_use]
pub fn list(profiles: &Path) -> Vec<Listed> {
    let files = std::fs::read_dir(profiles).into_iter().flatten().flatten();
    let mut listed: Vec<Listed> = files
        .map(|file| file.path())
        .filter(|path| path.extension().is_some_and(|end| end == "ron") && path.is_file())
        .map(|path| {
            let title = read_text(&path).map_or_else(|error| error.to_string(), |t| title(&t));
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            Listed { name, title, path: Some(path) }
        })
        .collect();
    for (name, text) in BUILT_IN {
        if !listed.iter().any(|local| local.name == name) {
            listed.push(Listed { name: name.to_owned(), title: title(text), path: None });
        }
    }
    listed.sort_by(|a, b| a.name.cmp(&b.name));
    listed
}

/// The text of the built-in profile `name`.
pub(super) fn built_in(name: &str) -> Option<&'static str> {
    BUILT_IN.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// The message for a name that no profile has.
pub(super) fn no_such(name: &str, profiles: &Path) -> ProfileError {
    let known: Vec<String> = list(profiles).into_iter().map(|listed| listed.name).collect();
    let near = nearest(name, known.iter().map(String::as_str));
    ProfileError::Unknown {
        name: super::report::clip(name),
        hint: near.map(|near| format!(": did you mean `{near}`?")).unwrap_or_default(),
        known: known.join(", "),
    }
}

/// The text of the file `path`, of which no more than the allowed length is ever read.
pub(super) fn read_text(path: &Path) -> Result<String, ProfileError> {
    let path = path.to_owned();
    let opened = File::open(&path).and_then(|file| Ok((file.metadata()?, file)));
    let (about, file) = match opened {
        Ok(opened) => opened,
        Err(error) => return Err(ProfileError::Unreadable { path, error }),
    };
    if about.is_dir() {
        return Err(ProfileError::Folder { path });
    }
    let mut bytes = Vec::new();
    if about.len() <= LONGEST
        && let Err(error) = file.take(LONGEST + 1).read_to_end(&mut bytes)
    {
        return Err(ProfileError::Unreadable { path, error });
    }
    if about.len() > LONGEST || bytes.len() as u64 > LONGEST {
        return Err(ProfileError::TooLarge { path });
    }
    String::from_utf8(bytes)
        .map_err(|error| ProfileError::NotText { path, at: error.utf8_error().valid_up_to() })
}

/// The first comment line, without its slashes.
fn title(text: &str) -> String {
    let comment = text.lines().find_map(|line| line.trim().strip_prefix("//"));
    comment.unwrap_or("").trim_start_matches(['/', '!']).trim().to_owned()
}
