//! Asking for the name of a profile.

use std::path::{Path, PathBuf};

use tui_input::Input;

use super::Setup;

/// What is asked.
#[derive(Clone, Debug)]
pub(super) enum Prompt {
    /// Which profile to open: a name or a path.
    Open(Input),
    /// Under which name to save.
    Save(Input),
    /// Whether this file may be replaced.
    Overwrite(PathBuf),
}

impl Prompt {
    /// The text to type into.
    pub const fn text_mut(&mut self) -> Option<&mut Input> {
        match self {
            Self::Open(input) | Self::Save(input) => Some(input),
            Self::Overwrite(_) => None,
        }
    }
}

impl Setup {
    /// The file for a profile called `name`.
    ///
    /// # Errors
    /// What is wrong with the name.
    pub(super) fn file_for(&self, name: &str) -> Result<PathBuf, String> {
        file_in(&self.profiles, name)
    }
}

/// The file for a profile called `name` in the folder `profiles`.
///
/// # Errors
/// What is wrong with the name.
pub(in crate::tui) fn file_in(profiles: &Path, name: &str) -> Result<PathBuf, String> {
    let name = name.trim();
    let name = name.strip_suffix(".ron").unwrap_or(name);
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if (1..=64).contains(&name.len()) && name.chars().all(is_plain) {
        Ok(profiles.join(format!("{name}.ron")))
    } else {
        Err("a profile's name has 1 to 64 letters (a-z, A-Z), digits, '-' and '_'".to_owned())
    }
}
