//! What the keys do on the set-up screen.

use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use tui_input::Input;
use tui_input::backend::crossterm::to_input_request;

use super::edit::{LAST_POLICY, next};
use super::prompt::Prompt;
use super::{Field, Reaction, Setup, Shelf};
use crate::profile::Experiment;
use crate::tui::keys::{self, Action, Screen};

/// No text is longer, characters.
const LONGEST_TEXT: usize = 300;

impl Setup {
    /// Takes a key. In a text letters type, elsewhere they are commands.
    pub fn handle(&mut self, key: KeyEvent, shelf: &Shelf) -> Reaction {
        if key.kind == KeyEventKind::Release {
            return Reaction::Stay;
        }
        self.keep_in_view(shelf);
        let action = keys::action(Screen::Setup, key);
        if action == Some(Action::QuitNow) {
            return Reaction::Quit;
        }
        if self.trying_hands {
            self.trying_hands = key.code != KeyCode::Esc;
            return Reaction::Stay;
        }
        self.message = None;
        if let Some(prompt) = self.prompt.take() {
            return self.answer(prompt, key);
        }
        if let Some(reaction) = self.edit_text(key) {
            return reaction;
        }
        if key.code == KeyCode::Char(' ') && key.kind == KeyEventKind::Press {
            self.switch();
            return Reaction::Stay;
        }
        action.map_or(Reaction::Stay, |action| self.act(action, shelf))
    }

    /// What a field was for may have gone since the last key.
    fn keep_in_view(&mut self, shelf: &Shelf) {
        self.cut_off = self.cut_off.min(shelf.unfinished.len().saturating_sub(1));
        if !self.has(self.focus, shelf) {
            self.go_to(Field::Profile);
        }
    }

    fn act(&mut self, action: Action, shelf: &Shelf) -> Reaction {
        match action {
            Action::Next => self.step(true, shelf),
            Action::Previous => self.step(false, shelf),
            Action::Left => return self.turn(false, shelf),
            Action::Right => return self.turn(true, shelf),
            Action::Begin => return self.begin(),
            Action::Open => self.prompt = Some(Prompt::Open(Input::default())),
            Action::Save => self.ask_for_name(),
            Action::TryHands => {
                self.trying_hands = true;
                return Reaction::TryHands;
            }
            Action::Resume if shelf.unfinished.is_empty() => {
                self.tell("no session was cut off: there is nothing to resume");
            }
            Action::Resume => return Reaction::Resume(self.cut_off),
            Action::Help => return Reaction::Help,
            Action::Quit | Action::QuitNow => return Reaction::Quit,
            _ => {}
        }
        Reaction::Stay
    }

    /// Begins, unless something is wrong; then its field is shown.
    fn begin(&mut self) -> Reaction {
        let Some((field, _)) = self.fault() else { return Reaction::Begin(self.order.clone()) };
        self.refused = true;
        if field != self.focus {
            self.go_to(field);
        }
        Reaction::Stay
    }

    fn ask_for_name(&mut self) {
        match &self.reading {
            Ok(()) => {
                let name = self.document.name();
                let name = if self.file_for(name).is_ok() { name } else { "" };
                self.prompt = Some(Prompt::Save(Input::new(name.to_owned())));
                self.drafts.fresh = true;
            }
            Err(_) => self.refused = true,
        }
    }

    /// The next value of the focused field, or the one before.
    fn turn(&mut self, forward: bool, shelf: &Shelf) -> Reaction {
        self.refused = false;
        match self.focus {
            Field::Task => {
                let task = next(&Experiment::NAMES, &self.profile.experiment.name(), forward);
                self.ask_profile(task, task != self.profile.experiment.name())
            }
            Field::Profile => {
                let names: Vec<&str> = shelf.profiles.iter().map(|p| p.name.as_str()).collect();
                let current = self.asked.as_deref().unwrap_or(&self.order.profile);
                let name = next(&names, &current, forward).to_owned();
                let is_other = name != self.order.profile;
                self.ask_profile(&name, is_other)
            }
            Field::Policy => {
                let last = [LAST_POLICY.to_owned()];
                let policies = [&last[..], &shelf.policies].concat();
                let now = self.drafts.value(Field::Policy).to_owned();
                self.put_text(&next(&policies, &now, forward))
            }
            Field::Unfinished => {
                let all: Vec<usize> = (0..shelf.unfinished.len()).collect();
                self.cut_off = next(&all, &self.cut_off, forward);
                Reaction::Stay
            }
            Field::Trial if self.drafts.value(Field::Trial).is_empty() => {
                self.put_text(&shelf.next_trial().to_string())
            }
            _ => {
                self.change_choice(forward);
                Reaction::Stay
            }
        }
    }

    /// Puts `text` into the focused field.
    fn put_text(&mut self, text: &str) -> Reaction {
        if let Some(draft) = self.drafts.text_mut(self.focus) {
            *draft = Input::new(text.to_owned());
        }
        self.take_text(self.focus);
        Reaction::Stay
    }

    fn ask_profile(&mut self, name: &str, is_other: bool) -> Reaction {
        self.asked = Some(name.to_owned());
        if is_other { Reaction::OpenProfile(name.to_owned()) } else { Reaction::Stay }
    }

    /// Space: on or off.
    fn switch(&mut self) {
        self.refused = false;
        match (self.focus.phase(), self.focus) {
            (Some(phase), _) => self.toggle(phase),
            (None, Field::Progress | Field::SubjectView) => self.change_choice(true),
            _ => {}
        }
    }

    /// Types into the focused text; `None` where the key is no part of typing.
    fn edit_text(&mut self, key: KeyEvent) -> Option<Reaction> {
        if !self.focus.is_text() {
            return None;
        }
        let is_edit =
            matches!(key.code, KeyCode::Backspace | KeyCode::Delete | KeyCode::Home | KeyCode::End)
                || (self.focus.is_line() && matches!(key.code, KeyCode::Left | KeyCode::Right));
        // Digits are no commands: they begin to type by themselves.
        let is_letter = match key.code {
            KeyCode::Char(c) => self.typing || c.is_ascii_digit(),
            _ => false,
        };
        let is_switch = key.code == KeyCode::Char(' ') && self.focus.phase().is_some();
        if self.typing && key.code == KeyCode::Esc {
            self.typing = false;
            self.drafts.fresh = true;
            return Some(Reaction::Stay);
        }
        if is_switch || !(is_edit || is_letter) {
            return None;
        }
        let field = self.focus;
        let subject = self.order.subject.clone();
        let fresh = std::mem::take(&mut self.drafts.fresh);
        self.typing = true;
        self.refused = false;
        type_into(self.drafts.text_mut(field)?, key, fresh);
        self.take_text(field);
        let is_other = self.order.subject != subject;
        Some(if is_other { Reaction::SubjectChanged } else { Reaction::Stay })
    }

    /// Takes a key while `prompt` is asked.
    fn answer(&mut self, mut prompt: Prompt, key: KeyEvent) -> Reaction {
        match (key.code, &mut prompt) {
            // A key held too long confirms nothing.
            (KeyCode::Enter, _) if key.kind != KeyEventKind::Press => {}
            (KeyCode::Esc, _) => {
                self.drafts.fresh = true;
                return Reaction::Stay;
            }
            (KeyCode::Enter, Prompt::Open(name)) if !name.value().trim().is_empty() => {
                let name = name.value().trim().to_owned();
                // Where the profile is refused, the name stays to be corrected.
                self.prompt = Some(prompt);
                return Reaction::OpenProfile(name);
            }
            (KeyCode::Enter, Prompt::Save(name)) => match self.file_for(name.value()) {
                Ok(path) => {
                    self.prompt = Some(prompt);
                    return Reaction::SaveProfile { path, overwrite: false };
                }
                Err(why) => self.message = Some(why),
            },
            (KeyCode::Enter, Prompt::Overwrite(path)) => {
                let path = path.clone();
                self.prompt = Some(prompt);
                return Reaction::SaveProfile { path, overwrite: true };
            }
            _ => {
                let fresh = std::mem::take(&mut self.drafts.fresh);
                if let Some(text) = prompt.text_mut() {
                    type_into(text, key, fresh);
                }
            }
        }
        self.prompt = Some(prompt);
        Reaction::Stay
    }
}

/// Types `key`; into a `fresh` text a letter takes the place of all.
pub(in crate::tui) fn type_into(text: &mut Input, key: KeyEvent, fresh: bool) {
    let key = match key.code {
        // Terminals that tell keys apart may say Shift and the small letter.
        KeyCode::Char(c) if key.modifiers == KeyModifiers::SHIFT => {
            KeyEvent { code: KeyCode::Char(c.to_ascii_uppercase()), ..key }
        }
        _ => key,
    };
    let is_plain = key.modifiers.difference(KeyModifiers::SHIFT).is_empty();
    let is_letter = is_plain && matches!(key.code, KeyCode::Char(_));
    if fresh && is_letter {
        text.reset();
    }
    if is_letter && text.value().chars().count() >= LONGEST_TEXT {
        return;
    }
    if let Some(request) = to_input_request(&Event::Key(key)) {
        text.handle(request);
    }
}
