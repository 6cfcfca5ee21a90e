//! Everything that is wrong with a profile, at once and where it stands.

use std::fmt;
use std::ops::Range;

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};

use super::scan::line_of;

/// Faults beyond this many are counted, not shown.
pub(super) const MOST_SHOWN: usize = 40;

/// Where a fault comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// These bytes of the profile's text.
    Text(Range<usize>),
    /// These bytes of a `--set`.
    Set {
        /// `key=value` as given.
        text: String,
        /// The bytes at fault.
        at: Range<usize>,
    },
    /// A default that does not go with the other values.
    Default,
}

impl Place {
    /// The text's faults in its order, then those of `--set`s, then those of defaults.
    pub(super) fn order(&self) -> (u8, usize) {
        match self {
            Self::Text(at) => (0, at.start),
            Self::Set { .. } => (1, 0),
            Self::Default => (2, 0),
        }
    }
}

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The dotted path of the key; empty when no key can be told.
    pub key: String,
    /// What is wrong.
    pub message: String,
    /// What would be right, shown below the caret.
    pub expected: String,
    /// What to do instead, where that can be guessed.
    pub help: Option<String>,
    pub(super) place: Place,
}

/// Everything that is wrong with one profile.
#[derive(Clone, Debug)]
pub struct Report {
    pub(super) shown: String,
    pub(super) source: String,
    pub(super) faults: Vec<Fault>,
}

impl Report {
    /// The faults: those of the text in its order, then those of `--set`s.
    #[must_use]
    pub fn faults(&self) -> &[Fault] {
        &self.faults
    }

    /// The message for a person: each fault with file, line, column and caret, and a last
    /// line that counts them. `colour` adds the terminal's colours.
    #[must_use]
    pub fn render(&self, colour: bool) -> String {
        let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
        let shown = self.faults.iter().take(MOST_SHOWN);
        let mut parts: Vec<String> =
            shown.map(|fault| self.render_one(fault, &renderer) + "\n").collect();
        let hidden = self.faults.len().saturating_sub(MOST_SHOWN);
        if hidden > 0 {
            parts.push(format!("… and {hidden} more"));
        }
        let count = self.faults.len();
        let word = if count == 1 { "fault" } else { "faults" };
        parts.push(format!("{count} {word} in {}; nothing was started", self.shown));
        parts.join("\n")
    }

    fn render_one(&self, fault: &Fault, renderer: &Renderer) -> String {
        let title = Level::ERROR.primary_title(fault.message.as_str());
        let caret =
            |at: Range<usize>| AnnotationKind::Primary.span(at).label(fault.expected.as_str());
        let group = match &fault.place {
            Place::Text(at) => {
                let (line, excerpt, at) = excerpt(&self.source, at);
                title.element(
                    Snippet::source(excerpt)
                        .line_start(line)
                        .path(self.shown.as_str())
                        .annotation(caret(at)),
                )
            }
            Place::Set { text, at } => title.element(
                Snippet::source(text.as_str()).path("--set").annotation(caret(at.clone())),
            ),
            Place::Default => title.element(
                Level::NOTE.message(format!("{}, by default; {}", fault.key, fault.expected)),
            ),
        };
        let group = match &fault.help {
            Some(help) => group.element(Level::HELP.message(help.as_str())),
            None => group,
        };
        renderer.render(&[group])
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for Report {}

/// The line, from 1, and its text that `at` begins in, with `at` counted from its start.
fn excerpt<'a>(source: &'a str, at: &Range<usize>) -> (usize, &'a str, Range<usize>) {
    let start = source.get(..at.start).and_then(|t| t.rfind('\n')).map_or(0, |newline| newline + 1);
    let rest = source.get(start..).unwrap_or_default();
    let line = rest.lines().next().unwrap_or_default();
    let from = (at.start - start).min(line.len());
    let to = (at.end.max(at.start) - start).min(line.len());
    (line_of(source, start), line, from..to)
}

/// `text` made fit for a message: one line of at most 60 characters.
pub(super) fn clip(text: &str) -> String {
    let mut shown: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    if let Some((end, _)) = shown.char_indices().nth(60) {
        shown.truncate(end);
        shown.push('…');
    }
    shown.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}
