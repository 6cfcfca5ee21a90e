//! The devices screen: what is plugged in, live, with the profile's response curves, what is
//! in the way, and a pad's map learned by moving it.
//!
//! [`Devices`] hears the pads' events and the keys; what the computer's files say comes in
//! with [`Survey`], and what shall be saved goes out as a [`Reaction`]. So a test needs
//! neither a pad nor a port.

mod curve;
mod page;
mod survey;
mod view;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind};
use tui_input::Input;

use super::keys::{self, Action, Screen};
use super::setup::{file_in, type_into};
use crate::host::About;
use crate::operator::Device;
use crate::operator::gamepad::learn::{Learner, Step};
use crate::operator::gamepad::{Button, Event, Id, Pads};
use crate::profile::{Document, Profile, ProfileError};
use crate::signal::Seconds;

pub use page::{Bench, show};
pub use survey::{Gamepad, Steering, Survey, Terminal, gamepads};
pub use view::{Extras, draw};

/// What is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Page {
    /// Something under the person's hands.
    Hand(Device),
    /// The serial ports.
    Serial,
    /// The terminal.
    Terminal,
}

impl Page {
    /// All pages, from left to right.
    pub const ALL: [Self; 5] = [
        Self::Hand(Device::Gamepad),
        Self::Hand(Device::Keyboard),
        Self::Hand(Device::Mouse),
        Self::Serial,
        Self::Terminal,
    ];

    /// Its tab.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Hand(device) => device.word(),
            Self::Serial => "serial ports",
            Self::Terminal => "terminal",
        }
    }

    /// Which problems belong to it.
    #[must_use]
    pub const fn about(self) -> Option<About> {
        match self {
            Self::Hand(Device::Gamepad) => Some(About::Gamepad),
            Self::Hand(Device::Keyboard | Device::Mouse) => None,
            Self::Serial => Some(About::Serial),
            Self::Terminal => Some(About::Terminal),
        }
    }
}

/// What a key led to, for the caller to carry out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// Nothing more.
    Stay,
    /// Leave the screen.
    Quit,
    /// Save [`Devices::document`] there; then [`Devices::saved`] or [`Devices::refuse`].
    Save {
        /// The file.
        path: PathBuf,
        /// Whether an existing file may be replaced: a person has confirmed it.
        overwrite: bool,
    },
}

/// What is asked about saving.
#[derive(Clone, Debug)]
enum Prompt {
    /// Under which name.
    Name { text: Input, is_fresh: bool },
    /// Whether this file may be replaced.
    Overwrite(PathBuf),
}

/// The state of the screen.
#[derive(Clone, Debug)]
pub struct Devices {
    document: Document,
    profile: Profile,
    /// The folder into which profiles are saved.
    profiles: PathBuf,
    pads: Pads,
    /// The buttons that were pressed so far; most pads tell no others.
    pressed: BTreeMap<Id, BTreeSet<Button>>,
    /// Why no pad is heard.
    no_pads: Option<String>,
    survey: Survey,
    /// Whether the files were looked at.
    is_surveyed: bool,
    page: Page,
    learner: Option<Learner>,
    prompt: Option<Prompt>,
    message: Option<String>,
    help_open: bool,
    /// How many lines of what is to be done are passed over.
    scrolled: u16,
}

impl Devices {
    /// The devices as `document`, which reads as `profile`, shapes and maps them. Profiles
    /// are saved into the folder `profiles`.
    #[must_use]
    pub fn new(document: Document, profile: Profile, profiles: PathBuf) -> Self {
        Self {
            pads: Pads::new(&profile.operator.gamepad),
            document,
            profile,
            profiles,
            pressed: BTreeMap::new(),
            no_pads: None,
            survey: Survey::default(),
            is_surveyed: false,
            page: Page::Hand(Device::Gamepad),
            learner: None,
            prompt: None,
            message: None,
            help_open: false,
            scrolled: 0,
        }
    }

    /// No pad is heard, for the reason `why`.
    pub fn hear_no_pads(&mut self, why: impl Into<String>) {
        self.no_pads = Some(why.into());
    }

    /// Something happened at a pad.
    pub fn hear(&mut self, event: &Event, now: Seconds) {
        self.teach(event);
        if let Event::Button { pad, button, is_pressed: true } = event {
            let pressed = self.pressed.entry(*pad).or_default();
            // As many as the widest pad has; a broken one may name any number.
            if pressed.len() < 64 {
                pressed.insert(*button);
            }
        }
        self.pads.take(event.clone(), now);
        while self.pads.next_news().is_some() {}
        if let Event::Connected(about) = event {
            self.pressed.remove(&about.id);
        }
        if self.learner.is_some() && self.pads.steering().is_none() {
            self.learner = None;
            self.message = Some("the pad is gone: nothing was learned".to_owned());
        }
    }

    /// Lets the learner hear what the steering pad does.
    fn teach(&mut self, event: &Event) {
        let steering = self.pads.steering().map(|pad| pad.about.id);
        let Some(learner) = self.learner.as_mut().filter(|l| l.step() != Step::Done) else {
            return;
        };
        match event {
            Event::Axis { pad, axis, value } if steering == Some(*pad) => {
                learner.moved(*axis, *value);
            }
            Event::Button { pad, button, is_pressed: true } if steering == Some(*pad) => {
                learner.press(*button);
            }
            _ => {}
        }
        self.learned();
    }

    /// What the files say now.
    pub fn take(&mut self, survey: Survey) {
        self.survey = survey;
        self.is_surveyed = true;
    }

    /// The pads that are heard.
    #[must_use]
    pub fn gamepads(&self) -> Vec<Gamepad> {
        let nodes = &self.survey.gamepad_nodes;
        gamepads(&self.pads, &self.pressed, &self.profile.operator, nodes)
    }

    /// How many pads are heard.
    #[must_use]
    pub fn heard(&self) -> usize {
        self.pads.present().len()
    }

    /// The profile's text with what was learned.
    #[must_use]
    pub const fn document(&self) -> &Document {
        &self.document
    }

    /// What it says.
    #[must_use]
    pub const fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The page that is shown.
    #[must_use]
    pub const fn page(&self) -> Page {
        self.page
    }

    /// Takes a key.
    pub fn handle(&mut self, key: KeyEvent) -> Reaction {
        if key.kind == KeyEventKind::Release {
            return Reaction::Stay;
        }
        let action = keys::action(Screen::Devices, key);
        if action == Some(Action::QuitNow) {
            return Reaction::Quit;
        }
        if self.help_open {
            self.help_open = key.kind != KeyEventKind::Press;
            return Reaction::Stay;
        }
        self.message = None;
        if let Some(prompt) = self.prompt.take() {
            return self.answer(prompt, key);
        }
        if let Some(learner) = &mut self.learner
            && learner.step() != Step::Done
            && key.kind == KeyEventKind::Press
        {
            match key.code {
                KeyCode::Esc => learner.keep(),
                KeyCode::Backspace | KeyCode::Delete => learner.leave_out(),
                KeyCode::Char('m') => self.learner = None,
                _ if action == Some(Action::Help) => self.help_open = true,
                _ => {}
            }
            self.learned();
            return Reaction::Stay;
        }
        action.map_or(Reaction::Stay, |action| self.act(action))
    }

    fn act(&mut self, action: Action) -> Reaction {
        match action {
            Action::Next => self.turn(1),
            Action::Previous => self.turn(Page::ALL.len() - 1),
            Action::Down => self.scrolled = self.scrolled.saturating_add(1),
            Action::Up => self.scrolled = self.scrolled.saturating_sub(1),
            Action::Learn => self.learn(),
            Action::Save if self.document.changed().is_empty() => {
                self.message = Some("nothing was learned yet: m learns a pad's map".to_owned());
            }
            Action::Save => {
                let name = self.document.name();
                let name = if file_in(&self.profiles, name).is_ok() { name } else { "" };
                let text = Input::new(name.to_owned());
                self.prompt = Some(Prompt::Name { text, is_fresh: true });
            }
            Action::Help => self.help_open = true,
            Action::Quit | Action::QuitNow => return Reaction::Quit,
            _ => {}
        }
        Reaction::Stay
    }

    fn turn(&mut self, by: usize) {
        let here = Page::ALL.iter().position(|page| *page == self.page).unwrap_or(0);
        if let Some(page) = Page::ALL.get((here + by) % Page::ALL.len()) {
            self.page = *page;
        }
        self.scrolled = 0;
    }

    /// Begins to learn the map of the pad that steers.
    fn learn(&mut self) {
        self.page = Page::Hand(Device::Gamepad);
        let Some(pad) = self.pads.steering() else {
            self.message = Some("no gamepad steers: plug one in, then m".to_owned());
            return;
        };
        let axes = pad.axes.iter().map(|(axis, at)| (*axis, Some(*at)));
        let params = &self.profile.operator.gamepad;
        self.learner = Some(Learner::new(params.map, params.shape.invert, axes));
    }

    /// Brings what was learned into the profile, once it is complete.
    fn learned(&mut self) {
        let Some(learner) = self.learner.as_ref().filter(|l| l.step() == Step::Done) else {
            return;
        };
        for (key, value) in learner.sets() {
            self.document.set(&key, &value);
        }
        match self.document.read() {
            Ok(profile) => {
                self.profile = profile;
                self.pads.remap(&self.profile.operator.gamepad);
            }
            Err(report) => {
                let fault = report.faults().first();
                self.message =
                    fault.map(|fault| format!("not taken: {}; {}", fault.message, fault.expected));
            }
        }
    }

    /// The file was written.
    pub fn saved(&mut self, path: &std::path::Path) {
        self.prompt = None;
        self.learner = None;
        self.message = Some(format!("saved as {}", path.display()));
    }

    /// The file was not written.
    pub fn refuse(&mut self, error: &ProfileError) {
        match (self.prompt.take(), error) {
            (Some(Prompt::Name { .. }), ProfileError::Exists { path }) => {
                self.prompt = Some(Prompt::Overwrite(path.clone()));
            }
            _ => self.message = Some(error.to_string()),
        }
    }

    /// Takes a key while `prompt` is asked.
    fn answer(&mut self, prompt: Prompt, key: KeyEvent) -> Reaction {
        let is_press = key.kind == KeyEventKind::Press;
        let reaction = match (&prompt, key.code) {
            (_, KeyCode::Esc) => return Reaction::Stay,
            (Prompt::Name { text, .. }, KeyCode::Enter) if is_press => {
                match file_in(&self.profiles, text.value()) {
                    Ok(path) => Reaction::Save { path, overwrite: false },
                    Err(why) => {
                        self.message = Some(why);
                        Reaction::Stay
                    }
                }
            }
            (Prompt::Overwrite(path), KeyCode::Enter) if is_press => {
                Reaction::Save { path: path.clone(), overwrite: true }
            }
            _ => Reaction::Stay,
        };
        self.prompt = Some(match prompt {
            Prompt::Name { mut text, is_fresh } if key.code != KeyCode::Enter => {
                type_into(&mut text, key, is_fresh);
                Prompt::Name { text, is_fresh: false }
            }
            prompt => prompt,
        });
        reaction
    }
}
