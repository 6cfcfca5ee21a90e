//! Profiles: everything that a session depends on, as a commented RON text.
//!
//! A [`Document`] is the text, with its `--set`s; [`Document::read`] makes a [`Profile`] of
//! it or a [`Report`] of all that is wrong. Keys that a text leaves out have the defaults
//! of the rooms that they belong to.

mod document;
mod edit;
mod experiment;
mod layout;
mod library;
mod order;
mod reading;
mod report;
mod scan;
pub mod settings;
mod show;
mod text;

use serde::{Deserialize, Serialize};

use crate::check::{Check, Checker};
use crate::sharing;
use crate::signal::Seconds;

pub use document::{Document, Origin, Set};
pub use experiment::Experiment;
pub use layout::Profile;
pub use library::{Listed, ProfileError, list};
pub use order::{Order, shell_word};
pub use report::{Fault, Report};
pub use show::show;
pub use text::{Text, Wrong};

/// The mode that a person asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WantedMode {
    /// The robot takes over as success rises.
    #[default]
    Simultaneous,
    /// The robot only watches.
    Sequential,
    /// One of the two, balanced over the subjects of the log folder.
    Assigned,
}

impl WantedMode {
    /// The mode itself; `None` when it is yet to be assigned.
    #[must_use]
    pub const fn fixed(self) -> Option<sharing::Mode> {
        match self {
            Self::Simultaneous => Some(sharing::Mode::Simultaneous),
            Self::Sequential => Some(sharing::Mode::Sequential),
            Self::Assigned => None,
        }
    }
}

/// What a terminal is drawn with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Glyphs {
    /// The finest that the terminal is known to show.
    #[default]
    Auto,
    /// 2 × 4 dots a cell.
    Braille,
    /// 1 × 2 blocks a cell.
    Half,
    /// Letters and signs.
    Ascii,
}

/// What the screen shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Screen {
    /// Whether the panel with success and share is open.
    pub show_progress: bool,
    /// Whether nothing but the scene is shown.
    pub subject_view: bool,
    /// Frames a second.
    pub frames_per_s: u32,
    /// What it is drawn with.
    pub glyphs: Glyphs,
}

impl Default for Screen {
    fn default() -> Self {
        Self { show_progress: true, subject_view: false, frames_per_s: 30, glyphs: Glyphs::Auto }
    }
}

impl Check for Screen {
    fn check(&self, c: &mut Checker<'_>) {
        c.count("frames_per_s", self.frames_per_s, 5..=60);
    }
}

impl Profile {
    /// The control period.
    #[must_use]
    pub fn tick(&self) -> Seconds {
        Seconds(self.tick_ms / 1000.0)
    }

    /// The whole profile as RON, every key on a line of its own.
    #[must_use]
    pub fn to_ron(&self) -> String {
        let pretty = ron::ser::PrettyConfig::new().compact_arrays(true).new_line("\n");
        // Numbers, texts and words always have a form in RON.
        ron_options().to_string_pretty(self, pretty).unwrap_or_default()
    }
}

/// How profiles are read and written: `Some(1.0)` is simply `1.0`.
fn ron_options() -> ron::Options {
    ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
}
