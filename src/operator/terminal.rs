//! Hands on the keyboard.
//!
//! The terminal has one reader, the screen's; it feeds the keys to [`Hands`], and the
//! [`Keyboard`] samples them at each tick. Both must use the same clock.

mod hold;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers, MouseEvent};
use serde::{Deserialize, Serialize};

pub use hold::{Direction, Hold, KeyReleases, Timing};

use super::mouse::Pointer;
use super::shaping::{Shape, Shaper};
use super::{Badge, News, Operator, Practice, View};
use crate::check::{Check, Checker};
use crate::clock::{Clock, WallClock};
use crate::random::Place;
use crate::signal::{Action, Intent, Seconds};

/// The keyboard's parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// A held key's push, as a fraction of the force limit.
    pub push: f64,
    /// The time in which a push grows to its full strength, s; 0: at once.
    pub rise_s: f64,
    /// The time in which a full push falls to nothing once its key is let go, s.
    pub fall_s: f64,
    /// How long a single press pushes where the terminal reports no releases, s.
    pub tap_hold_s: f64,
    /// How long a key repeat pushes there, s; `None`: 1.6 times the measured interval.
    pub repeat_hold_s: Option<f64>,
    /// From the keys' push to the action.
    pub shape: Shape,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            push: 0.5,
            rise_s: 0.06,
            fall_s: 0.0,
            tap_hold_s: 0.12,
            repeat_hold_s: None,
            shape: Shape::default(),
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.range("push", self.push, 0.01..=1.0);
        c.range("rise_s", self.rise_s, 0.0..=2.0);
        c.range("fall_s", self.fall_s, 0.0..=2.0);
        c.range("tap_hold_s", self.tap_hold_s, 0.02..=1.0);
        if let Some(hold) = self.repeat_hold_s {
            c.range("repeat_hold_s", hold, 0.02..=1.0);
        }
        self.shape.check(&mut c.section("shape"));
    }
}

/// The steering keys' state, shared by the reader that feeds it and the [`Keyboard`].
#[derive(Clone, Debug)]
pub struct Hands {
    hold: Arc<Mutex<Hold>>,
    /// What lies between the person's terminal and this program.
    inside: Option<&'static str>,
}

impl Hands {
    /// Hands that touch no key.
    #[must_use]
    pub fn new(params: &Params) -> Self {
        Self { hold: Arc::new(Mutex::new(Hold::new(timing(params)))), inside: None }
    }

    /// The same hands, at a terminal within tmux or screen, which may swallow releases.
    #[must_use]
    pub const fn inside(mut self, between: Option<&'static str>) -> Self {
        self.inside = between;
        self
    }

    /// Lets all keys go and from now on keeps the times of `params`.
    pub fn set_timing(&self, params: &Params) {
        let mut hold = self.hold();
        let known = hold.knowledge();
        *hold = Hold::new(timing(params));
        hold.set_knowledge(known);
    }

    /// Takes a key event if it steers, and says whether it did.
    pub fn feed(&self, key: &KeyEvent, now: Seconds) -> bool {
        let Some(direction) = direction(key) else { return false };
        match key.kind {
            KeyEventKind::Press => self.press(direction, now),
            KeyEventKind::Repeat => self.repeat(direction, now),
            KeyEventKind::Release => self.release(direction, now),
        }
        true
    }

    /// A key went down at `now`.
    pub fn press(&self, direction: Direction, now: Seconds) {
        self.hold().press(direction, now);
    }

    /// A key is still down at `now`.
    pub fn repeat(&self, direction: Direction, now: Seconds) {
        self.hold().repeat(direction, now);
    }

    /// A key went up at `now`.
    pub fn release(&self, direction: Direction, now: Seconds) {
        self.hold().release(direction, now);
    }

    /// Lets all keys go, since the focus is lost or a new session begins.
    pub fn release_all(&self) {
        self.hold().release_all();
    }

    /// Says whether the terminal reports releases.
    pub fn set_releases_known(&self, known: bool) {
        self.hold().set_knowledge(if known {
            KeyReleases::Reported
        } else {
            KeyReleases::Estimated
        });
    }

    /// How releases are known.
    #[must_use]
    pub fn knowledge(&self) -> KeyReleases {
        self.hold().knowledge()
    }

    /// How releases are known, in words for the person, and how late they may be.
    #[must_use]
    pub fn release_words(&self) -> (String, String) {
        let hold = self.hold();
        let known = hold.knowledge().words();
        let Some(late) = hold.lateness() else { return (known.to_owned(), String::new()) };
        let inside = self.inside.map_or(String::new(), |inside| format!(" inside {inside}"));
        (format!("{known}{inside}"), format!("up to {:.0} ms late", late.0 * 1000.0))
    }

    /// The same in few words, after "releases"; what lies between and what it costs comes first.
    #[must_use]
    pub fn short_release_words(&self) -> String {
        match (self.release_words(), self.inside) {
            ((_, late), Some(inside)) if !late.is_empty() => format!("{late} inside {inside}"),
            ((known, _), _) => known,
        }
    }

    /// The time of the last steering key's event, if there was one.
    #[must_use]
    pub fn last_event(&self) -> Option<Seconds> {
        self.hold().last_event()
    }

    /// The push at `now`, −1 to 1.
    #[must_use]
    pub fn push(&self, now: Seconds) -> f64 {
        self.hold().push(now)
    }

    /// The keys' state stays whole even if a thread died holding it.
    fn hold(&self) -> MutexGuard<'_, Hold> {
        self.hold.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn timing(params: &Params) -> Timing {
    Timing {
        tap_hold_s: params.tap_hold_s,
        repeat_hold_s: params.repeat_hold_s,
        rise_s: params.rise_s,
        fall_s: params.fall_s,
    }
}

/// Feeds `pointer` with a mouse event, whose time is `now`; a button moves nothing.
pub fn point(pointer: &Pointer, event: &MouseEvent, now: Seconds) {
    pointer.moves_to(event.column, event.row, now);
}

/// The direction of a steering key: arrows, h/l, a/d; stop is down or s.
#[must_use]
pub fn direction(key: &KeyEvent) -> Option<Direction> {
    // A release counts whatever else is held by then, or the key would stay down.
    let shortcut = key.modifiers.difference(KeyModifiers::SHIFT) != KeyModifiers::NONE;
    if shortcut && key.kind != KeyEventKind::Release {
        return None;
    }
    match key.code {
        KeyCode::Left | KeyCode::Char('h' | 'H' | 'a' | 'A') => Some(Direction::Left),
        KeyCode::Right | KeyCode::Char('l' | 'L' | 'd' | 'D') => Some(Direction::Right),
        KeyCode::Down | KeyCode::Char('s' | 'S') => Some(Direction::Stop),
        _ => None,
    }
}

/// The operator at the keyboard: the push of [`Hands`], sampled at each tick.
#[derive(Clone, Debug)]
pub struct Keyboard {
    hands: Hands,
    clock: WallClock,
    push: f64,
    shaper: Shaper,
    badge: Badge,
    /// What the badge says of releases.
    told: (String, String),
}

impl Keyboard {
    /// The keyboard under `hands`, whose events carry times of `clock`, for ticks of `tick`
    /// and actions up to ± `limit`.
    #[must_use]
    pub fn new(hands: Hands, clock: WallClock, params: &Params, limit: f64, tick: Seconds) -> Self {
        let shaper = Shaper::new(params.shape, limit, tick);
        let badge = Badge::default();
        let told = Default::default();
        let mut keyboard = Self { hands, clock, push: params.push, shaper, badge, told };
        keyboard.tell();
        keyboard
    }

    /// What the keyboard says of itself.
    #[must_use]
    pub fn badge(&self) -> Badge {
        self.badge.clone()
    }

    /// Says how releases are known, if that is new.
    fn tell(&mut self) {
        let words = self.hands.release_words();
        if self.told != words {
            self.badge.say(format!("keyboard, releases {}", words.0));
            self.badge.set_state(&words.1);
            self.told = words;
        }
    }
}

impl Operator for Keyboard {
    /// A key that is held through the countdown goes on pushing.
    fn begin(&mut self, _place: Place, _practice: Practice) {}

    fn news(&mut self, _now: Seconds) -> Option<News> {
        self.tell();
        None
    }

    fn intent(&mut self, _view: View<'_>) -> Intent {
        let now = self.clock.now();
        let hold = self.hands.hold();
        let age = hold.last_event().map_or(0.0, |at| (now - at).0.max(0.0));
        let raw = self.push * hold.push(now);
        let action = Action(self.shaper.shape(raw));
        Intent::Present { action, raw: Some(raw), age: Seconds(age) }
    }

    fn tune(&mut self, sensitivity: f64) {
        self.shaper.set_sensitivity(sensitivity);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::State;

    #[test]
    fn a_held_arrow_pushes_half_the_limit() {
        let params = Params { rise_s: 0.0, ..Params::default() };
        let hands = Hands::new(&params);
        let clock = WallClock::start();
        let tick = Seconds(0.02);
        let mut keyboard = Keyboard::new(hands.clone(), clock, &params, 10.0, tick);
        let state = State::default();
        let view = View { state: &state, now: Seconds(0.0), rollout_time: Seconds(0.0) };
        hands.set_releases_known(true);
        assert!(hands.feed(&KeyEvent::new(KeyCode::Left, KeyModifiers::NONE), clock.now()));
        assert_eq!(keyboard.intent(view).action(), Action(-5.0));
        hands.release_all();
        assert_eq!(keyboard.intent(view).action(), Action(0.0));
    }

    #[test]
    fn the_badge_says_how_late_estimated_releases_are_and_where_they_were_lost() {
        let params = Params::default();
        let hands = Hands::new(&params).inside(Some("tmux"));
        let clock = WallClock::start();
        let mut keyboard = Keyboard::new(hands.clone(), clock, &params, 10.0, Seconds(0.02));
        let badge = keyboard.badge();
        assert_eq!(badge.words(), "keyboard, releases estimated from key repeats inside tmux");
        assert!(badge.words_now().ends_with("inside tmux, up to 120 ms late"));
        assert_eq!(hands.short_release_words(), "up to 120 ms late inside tmux");
        for k in 0..20 {
            hands.press(Direction::Left, Seconds(f64::from(k) * 0.04));
        }
        keyboard.news(Seconds(0.0));
        assert!(badge.words_now().ends_with(", up to 64 ms late"), "{}", badge.words_now());
        hands.set_releases_known(true);
        keyboard.news(Seconds(0.0));
        assert_eq!(badge.words_now(), "keyboard, releases reported by the terminal");
        assert_eq!(hands.short_release_words(), "reported by the terminal");
    }

    #[test]
    fn shortcuts_do_not_steer_but_releases_always_count() {
        let mut key = KeyEvent::new(KeyCode::Char('h'), KeyModifiers::CONTROL);
        assert_eq!(direction(&key), None);
        key.kind = KeyEventKind::Release;
        assert_eq!(direction(&key), Some(Direction::Left));
        assert_eq!(direction(&KeyEvent::new(KeyCode::Char('q'), KeyModifiers::NONE)), None);
    }
}
