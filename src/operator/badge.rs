//! What a device says of itself, for the screen and for `session.json`.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A sign that the operator writes and others read; clones are the same sign.
#[derive(Clone, Debug, Default)]
pub struct Badge(Arc<Mutex<Signs>>);

#[derive(Debug, Default)]
struct Signs {
    words: String,
    state: String,
    trouble: Option<String>,
}

impl Badge {
    /// A badge that reads `words`.
    #[must_use]
    pub fn new(words: impl Into<String>) -> Self {
        let badge = Self::default();
        badge.say(words);
        badge
    }

    /// From now on says `words`: which device it is, and how it is known.
    pub fn say(&self, words: impl Into<String>) {
        self.signs().words = words.into();
    }

    /// Says how the device does at the moment, such as how old its last line is.
    pub fn set_state(&self, state: impl Into<String>) {
        self.signs().state = state.into();
    }

    /// Says all at once.
    pub fn update(&self, words: String, state: String, trouble: Option<String>) {
        *self.signs() = Signs { words, state, trouble };
    }

    /// Which device it is, and how it is known.
    #[must_use]
    pub fn words(&self) -> String {
        self.signs().words.clone()
    }

    /// Both: which device it is, and how it does at the moment.
    #[must_use]
    pub fn words_now(&self) -> String {
        let Signs { words, state, .. } = &*self.signs();
        if state.is_empty() { words.clone() } else { format!("{words}, {state}") }
    }

    /// How the device does at the moment; mostly empty.
    #[must_use]
    pub fn state(&self) -> String {
        self.signs().state.clone()
    }

    /// What is wrong and what to do about it; `None` while all is well.
    #[must_use]
    pub fn trouble(&self) -> Option<String> {
        self.signs().trouble.clone()
    }

    /// The signs stay whole even if a thread died holding them.
    fn signs(&self) -> MutexGuard<'_, Signs> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
