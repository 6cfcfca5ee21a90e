//! What the reader of the terminal feeds: the hands and the pointer of the session under way.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ratatui::crossterm::event::{Event, KeyEventKind};

use super::abilities::Abilities;
use super::{REPORTS_RELEASES, capture, probe};
use crate::clock::{Clock, WallClock};
use crate::operator::mouse::{Grid, Pointer};
use crate::operator::terminal::{Hands, point};

/// The steering keys and the pointer that the reader feeds; a session puts its own in place.
#[derive(Clone, Debug)]
pub struct Feed {
    fed: Arc<Mutex<(Hands, Pointer)>>,
    /// The time of events and ticks.
    pub clock: WallClock,
}

impl Feed {
    /// A feed for `hands`, and a pointer that nobody looks at.
    #[must_use]
    pub fn new(hands: Hands, clock: WallClock) -> Self {
        Self { fed: Arc::new(Mutex::new((hands, Pointer::default()))), clock }
    }

    /// From now on feeds `hands` and `pointer`, which know of the terminal what the ones before
    /// knew.
    pub fn replace(&self, hands: Hands, pointer: Pointer) {
        let mut fed = self.fed();
        hands.set_releases_known(REPORTS_RELEASES.load(Ordering::Relaxed));
        pointer.set_grid(fed.1.grid());
        *fed = (hands, pointer);
    }

    /// The hands that are fed now.
    #[must_use]
    pub fn hands(&self) -> Hands {
        self.fed().0.clone()
    }

    /// The pointer that is fed now.
    #[must_use]
    pub fn pointer(&self) -> Pointer {
        self.fed().1.clone()
    }

    /// Takes an event that was read just now.
    pub(super) fn take(&self, event: &Event) {
        match event {
            Event::Mouse(mouse) => point(&self.pointer(), mouse, self.clock.now()),
            Event::Key(key) => {
                let hands = self.hands();
                if key.kind == KeyEventKind::Release {
                    REPORTS_RELEASES.store(true, Ordering::Relaxed);
                    hands.set_releases_known(true);
                }
                hands.feed(key, self.clock.now());
            }
            Event::FocusLost => self.let_go(),
            Event::Resize(columns, rows) if capture::is_on() => self.fit((*columns, *rows)),
            _ => {}
        }
    }

    /// No hand is on keys or mouse, as far as anyone can tell.
    pub(super) fn let_go(&self) {
        self.hands().release_all();
        self.pointer().rests();
    }

    /// Fits the pointer's places to a screen of `size`, columns and rows.
    pub(super) fn fit(&self, size: (u16, u16)) {
        let known = Abilities::known().unwrap_or_default();
        // A font may have changed with the size; the system knows, if it knows pixels at all.
        let cell = || probe::cell_px().or(known.cell_px);
        let cell_px = if known.has_pixels() { cell() } else { None };
        self.pointer().set_grid(Some(Grid::of(size.0, size.1, cell_px)));
    }

    /// The feed stays whole even if a thread died holding it.
    fn fed(&self) -> MutexGuard<'_, (Hands, Pointer)> {
        self.fed.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
