//! The set-up screen (thesis fig. 12): everything that a session depends on, in one form
//! that is playable at once with Enter.
//!
//! [`Setup`] owns the [`Order`] and the profile's [`Document`]; every edit goes through
//! them, so a wrong value is told in the very words of `coadapt profile check`, and what
//! [`Reaction::Begin`] carries is what the equal command line would do. Nothing here reads
//! a file: what is on disk comes in with [`Shelf`], and what shall be read or written goes
//! out as a [`Reaction`].

mod edit;
mod field;
mod handle;
pub(super) mod lines;
mod prompt;
mod view;

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::profile::{Document, Listed, Order, Profile, ProfileError, Report};
use crate::record::folder::Unfinished;
use edit::Drafts;
use prompt::Prompt;

pub use field::Field;
pub(super) use handle::type_into;
pub(super) use prompt::file_in;
pub use view::{Extras, draw};

/// What is on disk, as far as the screen shows it; the caller keeps it fresh.
#[derive(Clone, Debug, Default)]
pub struct Shelf {
    /// The numbers of the subject's trials, ascending.
    pub trials: Vec<u32>,
    /// The sessions that can be resumed, the latest first.
    pub unfinished: Vec<Unfinished>,
    /// The policies that an autonomous run may use, besides the last one: files.
    pub policies: Vec<String>,
    /// The known profiles.
    pub profiles: Vec<Listed>,
}

impl Shelf {
    /// The number that the subject's next trial gets, where none is asked for.
    #[must_use]
    pub fn next_trial(&self) -> u32 {
        self.trials.iter().copied().max().unwrap_or(0).saturating_add(1)
    }
}

/// What a key led to, for the caller to carry out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// Nothing more.
    Stay,
    /// Begin this session. The profile with the order's changes reads without faults.
    Begin(Order),
    /// Leave the program.
    Quit,
    /// Show or hide the keys.
    Help,
    /// From now on feed the steering keys to the hands and show their push in
    /// [`Extras::hands`], while [`Setup::is_trying_hands`].
    TryHands,
    /// Find this profile, by name or path; then call [`Setup::open`] or [`Setup::refuse`].
    OpenProfile(String),
    /// Save [`Setup::document`] there; then [`Setup::open`] it or [`Setup::refuse`].
    SaveProfile {
        /// The file.
        path: PathBuf,
        /// Whether an existing file may be replaced: a person has confirmed it.
        overwrite: bool,
    },
    /// Resume this one of [`Shelf::unfinished`].
    Resume(usize),
    /// The order's subject is another one: bring the shelf's trials up to date.
    SubjectChanged,
}

/// The state of the set-up screen.
#[derive(Clone, Debug)]
pub struct Setup {
    order: Order,
    /// The profile's text with the order's changes.
    document: Document,
    /// What the text without them says.
    base: Profile,
    /// What the text with them says; what is wrong, where it is.
    reading: Result<(), Report>,
    /// The profile with all changes that fit.
    profile: Profile,
    /// The allowed pole lengths in words, such as `0.05 to 10`.
    pole_range: String,
    drafts: Drafts,
    focus: Field,
    /// Whether letters go into the focused text.
    typing: bool,
    prompt: Option<Prompt>,
    trying_hands: bool,
    /// Whether Begin was refused and nothing was changed since.
    refused: bool,
    /// What a person should know, until the next key.
    message: Option<String>,
    /// Which of the unfinished sessions is shown.
    cut_off: usize,
    /// The place in the list of the profile that was last asked for.
    asked: Option<String>,
    /// The changes to the profiles that were open before.
    kept: BTreeMap<String, Vec<(String, String)>>,
    /// The folder into which profiles are saved.
    profiles: PathBuf,
}

impl Setup {
    /// The screen with the choices of `order`, whose profile's text is `document`. Profiles
    /// are saved into the folder `profiles`.
    ///
    /// # Errors
    /// The profile has faults before any of the order's changes.
    pub fn new(order: Order, document: &Document, profiles: PathBuf) -> Result<Self, Report> {
        let base = without_sets(document).read()?;
        let mut setup = Self {
            profile: base.clone(),
            drafts: Drafts::new(&order, &base),
            document: document.clone(),
            base,
            reading: Ok(()),
            pole_range: String::new(),
            focus: Field::Profile,
            typing: false,
            prompt: None,
            trying_hands: false,
            refused: false,
            message: None,
            cut_off: 0,
            asked: None,
            kept: BTreeMap::new(),
            profiles,
            order,
        };
        setup.take(document);
        Ok(setup)
    }

    /// Takes `document`, found as the profile `name` or just saved under it. Subject,
    /// operator and the like stay; the changes to the profile before are kept for when it is
    /// opened again.
    pub fn open(&mut self, name: &str, document: &Document) {
        let asked = self.prompt.take();
        let is_saved = matches!(asked, Some(Prompt::Save(_) | Prompt::Overwrite(_)));
        self.refused = false;
        self.drafts.fresh = true;
        self.asked = Some(name.to_owned());
        match without_sets(document).read() {
            Ok(base) => {
                // Saved changes are in the text now.
                let sets = self.kept.remove(name).filter(|_| !is_saved).unwrap_or_default();
                let before = std::mem::replace(&mut self.order.profile, name.to_owned());
                let left = std::mem::replace(&mut self.order.sets, sets);
                if before != name && !left.is_empty() && !is_saved {
                    self.kept.insert(before, left);
                }
                self.base = base;
                self.take(document);
            }
            Err(report) => {
                let first = report.faults().first().map(edit::words).unwrap_or_default();
                self.message = Some(format!(
                    "{first}; `coadapt profile check {name}` shows all; it was not opened"
                ));
            }
        }
    }

    /// Says why a profile was not opened or saved. A file that exists already is asked for
    /// once more.
    pub fn refuse(&mut self, error: &ProfileError) {
        match (self.prompt.take(), error) {
            (Some(Prompt::Save(_)), ProfileError::Exists { path }) => {
                self.prompt = Some(Prompt::Overwrite(path.clone()));
            }
            (prompt, _) => {
                self.prompt = prompt.filter(|prompt| !matches!(prompt, Prompt::Overwrite(_)));
                self.message = Some(error.to_string());
            }
        }
    }

    /// Shows `message` until the next key.
    pub fn tell(&mut self, message: &str) {
        self.message = Some(message.to_owned());
    }

    /// What a person has chosen so far.
    #[must_use]
    pub const fn order(&self) -> &Order {
        &self.order
    }

    /// The profile's text with the changes to it.
    #[must_use]
    pub const fn document(&self) -> &Document {
        &self.document
    }

    /// The profile with all changes that fit.
    #[must_use]
    pub const fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Where the keys go.
    #[must_use]
    pub const fn focus(&self) -> Field {
        self.focus
    }

    /// Whether the steering keys steer the strip.
    #[must_use]
    pub const fn is_trying_hands(&self) -> bool {
        self.trying_hands
    }

    /// Puts the order's changes on top of `document`'s text and shows the result.
    fn take(&mut self, document: &Document) {
        for set in document.sets() {
            self.order.change(&set.key, &set.value);
        }
        self.document = without_sets(document);
        for (key, value) in &self.order.sets {
            self.document.set(key, value);
        }
        self.pole_range = edit::allowed(&self.document, edit::POLE_LENGTH);
        self.read_again();
        self.drafts.show_profile(&self.profile);
        self.drafts.show_sets(&self.order.sets);
        self.order_policy();
    }
}

/// The text of `document` alone.
fn without_sets(document: &Document) -> Document {
    let mut plain = document.clone();
    for key in document.changed() {
        plain.unset(&key);
    }
    plain
}
