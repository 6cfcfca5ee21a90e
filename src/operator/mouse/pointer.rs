//! Where the pointer is and how fast it moves, from its events with their times; no clock in
//! here.

use std::collections::{BTreeSet, VecDeque};
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{Along, Button};
use crate::signal::Seconds;

/// How finely the pointer is known: the screen's width and height, in pixels or cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Pixels or cells across.
    pub width: u32,
    /// Pixels or cells down.
    pub height: u32,
    /// Whether they are pixels.
    pub is_pixels: bool,
}

impl Grid {
    /// A screen of so many columns and rows, its pointer known to the pixel where a cell's
    /// size is given.
    #[must_use]
    pub fn of(columns: u16, rows: u16, cell_px: Option<(u16, u16)>) -> Self {
        let (wide, high) = cell_px.unwrap_or((1, 1));
        Self {
            width: u32::from(columns) * u32::from(wide),
            height: u32::from(rows) * u32::from(high),
            is_pixels: cell_px.is_some(),
        }
    }

    /// The place of a pixel or cell, counted from 0 at the upper left: −1 to 1 to the right,
    /// and up.
    fn place(&self, column: u16, row: u16) -> Place {
        let part = |at: u16, size: u32| {
            // A parser that counts from 1 makes the largest number of a 0.
            let at = if at == u16::MAX { 0.0 } else { f64::from(at) };
            (2.0 * at / f64::from(size.saturating_sub(1).max(1)) - 1.0).clamp(-1.0, 1.0)
        };
        Place { right: part(column, self.width), up: -part(row, self.height) }
    }
}

impl fmt::Display for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = if self.is_pixels { "pixels" } else { "cells" };
        write!(f, "pointer in {unit} ({} × {})", self.width, self.height)
    }
}

/// A place on the screen, −1 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Place {
    right: f64,
    up: f64,
}

impl Place {
    const fn along(&self, along: Along) -> f64 {
        match along {
            Along::Horizontal => self.right,
            Along::Vertical => self.up,
        }
    }
}

/// No window is longer, s; what is older is forgotten.
const LONGEST_WINDOW: Seconds = Seconds(0.5);
/// Events closer than this are one, so that a flood takes no room.
const GRAIN: Seconds = Seconds(0.001);

/// The pointer's way of late. Times must not run backwards.
#[derive(Clone, Debug, Default)]
struct Track {
    grid: Option<Grid>,
    /// Where it is.
    now: Option<(Place, Seconds)>,
    /// Nobody knows where it is since then.
    is_out: bool,
    /// Where it was from when on, as far as it moved without a break; oldest first.
    way: VecDeque<(Place, Seconds)>,
    /// The buttons that are held.
    held: BTreeSet<Button>,
}

impl Track {
    fn moves_to(&mut self, column: u16, row: u16, at: Seconds) {
        let Some(grid) = self.grid else { return };
        let place = grid.place(column, row);
        self.now = Some((place, at));
        self.is_out = false;
        let has_begun = self.way.len() > 1;
        match self.way.back_mut() {
            Some((last, since)) if has_begun && (at - *since).0 < GRAIN.0 => *last = place,
            _ => self.way.push_back((place, at)),
        }
        // One place older than the window says where it began.
        while self.way.get(1).is_some_and(|(_, since)| (at - *since).0 > LONGEST_WINDOW.0) {
            self.way.pop_front();
        }
    }

    /// The way from here on has nothing to do with the way so far.
    fn breaks_off(&mut self) {
        self.way.clear();
    }

    /// How far it moved in the `window` before `now`, screens to the right or up.
    fn moved(&self, along: Along, now: Seconds, window: Seconds) -> f64 {
        let was_there = |(_, since): &&(Place, Seconds)| (now - *since).0 >= window.0;
        let from = self.way.iter().rev().find(was_there).or(self.way.front());
        match (from, self.way.back()) {
            // The screen is 2 wide.
            (Some((from, _)), Some((to, _))) => (to.along(along) - from.along(along)) / 2.0,
            _ => 0.0,
        }
    }
}

/// The pointer, shared by the reader that feeds it and the [`Mouse`](super::Mouse).
#[derive(Clone, Debug, Default)]
pub struct Pointer(Arc<Mutex<Track>>);

impl Pointer {
    /// How finely it is known; `None` before it is read.
    #[must_use]
    pub fn grid(&self) -> Option<Grid> {
        self.track().grid
    }

    /// From now on its events are on `grid`. On another than before, what looks like a
    /// movement is none.
    pub fn set_grid(&self, grid: Option<Grid>) {
        let mut track = self.track();
        if track.grid != grid {
            track.grid = grid;
            track.breaks_off();
        }
    }

    /// It was seen at a pixel or cell, counted from 0 at the upper left; without a
    /// [`Grid`] that says nothing.
    pub fn moves_to(&self, column: u16, row: u16, at: Seconds) {
        self.track().moves_to(column, row, at);
    }

    /// It is out of sight: at rest, and wherever it turns up again, it did not move there. No
    /// hand is on its buttons.
    pub fn rests(&self) {
        let mut track = self.track();
        track.breaks_off();
        track.is_out = true;
        track.held.clear();
    }

    /// A button went down.
    pub fn press(&self, button: Button) {
        self.track().held.insert(button);
    }

    /// A button went up. Old terminals call each one the left, so that with the left all go.
    pub fn release(&self, button: Button) {
        match button {
            Button::Left => self.release_all(),
            other => {
                self.track().held.remove(&other);
            }
        }
    }

    /// No button is held.
    pub fn release_all(&self) {
        self.track().held.clear();
    }

    /// Whether a button is held: it went down, and nothing since tells that it may be up.
    #[must_use]
    pub fn is_held(&self, button: Button) -> bool {
        self.track().held.contains(&button)
    }

    /// The time of its last event, if there was one.
    #[must_use]
    pub fn last_event(&self) -> Option<Seconds> {
        self.track().now.map(|(_, at)| at)
    }

    /// Where it is, −1 to 1; `None` before its first event and while it is out of sight.
    #[must_use]
    pub fn place(&self, along: Along) -> Option<f64> {
        let track = self.track();
        track.now.filter(|_| !track.is_out).map(|(place, _)| place.along(along))
    }

    /// Its mean velocity in the `window` before `now`, screens per second; exactly 0 when it
    /// did not move. A window has at most 0.5 s.
    #[must_use]
    pub fn velocity(&self, along: Along, now: Seconds, window: Seconds) -> f64 {
        self.track().moved(along, now, window) / window.0
    }

    /// The track stays whole even if a thread died holding it.
    fn track(&self) -> MutexGuard<'_, Track> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Along::{Horizontal, Vertical};
    use proptest::prelude::*;

    const WINDOW: Seconds = Seconds(0.06);

    fn on(grid: Grid) -> Pointer {
        let pointer = Pointer::default();
        pointer.set_grid(Some(grid));
        pointer
    }

    #[test]
    fn places_reach_from_edge_to_edge_and_up_is_positive() {
        let pointer = on(Grid::of(81, 25, None));
        assert_eq!(pointer.place(Horizontal), None);
        pointer.moves_to(0, 0, Seconds(0.0));
        assert_eq!((pointer.place(Horizontal), pointer.place(Vertical)), (Some(-1.0), Some(1.0)));
        pointer.moves_to(40, 12, Seconds(0.1));
        assert_eq!((pointer.place(Horizontal), pointer.place(Vertical)), (Some(0.0), Some(0.0)));
        pointer.moves_to(999, 999, Seconds(0.2));
        assert_eq!((pointer.place(Horizontal), pointer.place(Vertical)), (Some(1.0), Some(-1.0)));
        // What a parser makes of pixel 0.
        pointer.moves_to(u16::MAX, 12, Seconds(0.3));
        assert_eq!(pointer.place(Horizontal), Some(-1.0));
        assert_eq!(Grid::of(80, 24, Some((20, 40))).to_string(), "pointer in pixels (1600 × 960)");
        assert_eq!(Grid::of(80, 24, None).to_string(), "pointer in cells (80 × 24)");
    }

    #[test]
    fn a_steady_hand_has_its_velocity_and_a_resting_one_none() {
        // A screen a second, at 1000 events a second.
        let pointer = on(Grid::of(100, 50, Some((10, 20))));
        assert_eq!(pointer.velocity(Horizontal, Seconds(0.0), WINDOW), 0.0);
        for k in 0..500_u16 {
            pointer.moves_to(k, 7, Seconds(f64::from(k) * 0.001));
        }
        let v = pointer.velocity(Horizontal, Seconds(0.499), WINDOW);
        assert!((v - 1.0).abs() < 0.02, "{v}");
        assert_eq!(pointer.velocity(Vertical, Seconds(0.499), WINDOW), 0.0);
        assert_eq!(pointer.velocity(Horizontal, Seconds(0.56), WINDOW), 0.0);
        assert_eq!(pointer.last_event(), Some(Seconds(0.499)));
    }

    #[test]
    fn where_it_turns_up_again_it_did_not_move_to() {
        let pointer = on(Grid::of(80, 24, None));
        pointer.moves_to(0, 0, Seconds(0.0));
        pointer.moves_to(20, 0, Seconds(0.01));
        pointer.rests();
        assert_eq!(pointer.velocity(Horizontal, Seconds(0.01), WINDOW), 0.0);
        pointer.moves_to(79, 0, Seconds(0.02));
        assert_eq!(pointer.velocity(Horizontal, Seconds(0.02), WINDOW), 0.0);
        pointer.set_grid(Some(Grid::of(200, 50, None)));
        pointer.moves_to(100, 0, Seconds(0.03));
        assert_eq!(pointer.velocity(Horizontal, Seconds(0.03), WINDOW), 0.0);
        pointer.moves_to(110, 0, Seconds(0.04));
        assert!(pointer.velocity(Horizontal, Seconds(0.04), WINDOW) > 0.0);
    }

    #[test]
    fn a_flood_takes_no_room() {
        let pointer = on(Grid::of(80, 24, None));
        for k in 0..100_000_u32 {
            let column = u16::try_from(k % 80).unwrap();
            pointer.moves_to(column, 0, Seconds(f64::from(k) * 0.00002));
        }
        assert!(pointer.track().way.len() <= 502, "{}", pointer.track().way.len());
    }

    proptest! {
        /// Over any way, velocity is finite, at most a screen a window, and 0 a window later.
        #[test]
        fn velocity_is_bounded_and_ends(
            events in proptest::collection::vec((any::<u16>(), any::<u16>(), 0.0..0.1_f64), 0..60),
            window in 0.01..0.5_f64,
            size in (0..300_u16, 0..100_u16),
        ) {
            let pointer = on(Grid::of(size.0, size.1, None));
            let mut now = Seconds(0.0);
            for (column, row, wait) in events {
                now = now + Seconds(wait);
                pointer.moves_to(column, row, now);
                for along in [Horizontal, Vertical] {
                    let moved = pointer.velocity(along, now, Seconds(window)) * window;
                    prop_assert!(moved.abs() <= 1.0 + 1e-9);
                }
            }
            let later = now + Seconds(window + 0.002);
            prop_assert_eq!(pointer.velocity(Horizontal, later, Seconds(window)), 0.0);
        }
    }
}
