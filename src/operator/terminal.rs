//! Hands on the keyboard.
//!
//! The terminal has one reader, the screen's; it feeds the keys to [`Hands`], and the
//! [`Keyboard`] samples them at each tick. Both must use the same clock.

mod enable;
mod hold;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crossterm::event::{
    KeyCode, KeyEvent, KeyEventKind, KeyModifiers, MouseButton, MouseEvent, MouseEventKind,
};
use serde::{Deserialize, Serialize};

use enable::Enable;
pub use hold::{Direction, Hold, KeyReleases, Timing};

use super::mouse::{Button, Pointer};
use super::shaping::{Shape, Shaper};
use super::{Badge, News, Operator, Practice, Switch, View};
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
    /// The dead-man switch: real hardware moves only while this key is held.
    pub enable: char,
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
            enable: 'e',
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
        let is_free = ENABLE_KEYS.contains(self.enable);
        c.demand(
            is_free,
            "enable",
            self.enable,
            "a letter without another meaning: b, e, g, i, j, k, u, w or z",
        );
        self.shape.check(&mut c.section("shape"));
    }
}

impl Params {
    /// What keeps the dead-man switch held, for people.
    #[must_use]
    pub fn switch_name(&self) -> String {
        format!("hold {}", self.enable)
    }
}

/// The keys that can be the dead-man switch: letters, which are the same with and without
/// Shift, that neither steer nor are a key of a screen.
pub const ENABLE_KEYS: &str = "begijkuwz";

/// What is known of the keys.
#[derive(Clone, Debug)]
struct Keys {
    hold: Hold,
    enable: Enable,
}

impl Keys {
    fn new(params: &Params) -> Self {
        Self { hold: Hold::new(timing(params)), enable: Enable::new(params.enable) }
    }

    fn knows_releases(&self) -> bool {
        self.hold.knowledge() == KeyReleases::Reported
    }
}

/// The steering keys' and the switch's state, shared by the reader that feeds it and the [`Keyboard`].
#[derive(Clone, Debug)]
pub struct Hands {
    keys: Arc<Mutex<Keys>>,
    /// What lies between the person's terminal and this program.
    inside: Option<&'static str>,
}

impl Hands {
    /// Hands that touch no key.
    #[must_use]
    pub fn new(params: &Params) -> Self {
        Self { keys: Arc::new(Mutex::new(Keys::new(params))), inside: None }
    }

    /// The same hands, at a terminal within tmux or screen, which may swallow releases.
    #[must_use]
    pub const fn inside(mut self, between: Option<&'static str>) -> Self {
        self.inside = between;
        self
    }

    /// Lets all keys go and from now on keeps to `params`.
    pub fn set_params(&self, params: &Params) {
        let mut keys = self.keys();
        let known = keys.hold.knowledge();
        *keys = Keys::new(params);
        keys.hold.set_knowledge(known);
    }

    /// Takes a key event if it steers or is the switch's, and says whether it did.
    pub fn feed(&self, key: &KeyEvent, now: Seconds) -> bool {
        {
            let keys = &mut *self.keys();
            if keys.enable.take(key, keys.hold.knowledge()) {
                return true;
            }
        }
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
        self.keys().hold.press(direction, now);
    }

    /// A key is still down at `now`.
    pub fn repeat(&self, direction: Direction, now: Seconds) {
        self.keys().hold.repeat(direction, now);
    }

    /// A key went up at `now`.
    pub fn release(&self, direction: Direction, now: Seconds) {
        self.keys().hold.release(direction, now);
    }

    /// Lets all keys go, since the focus is lost or a new session begins.
    pub fn release_all(&self) {
        let mut keys = self.keys();
        keys.hold.release_all();
        keys.enable.release();
    }

    /// Says whether the terminal reports releases.
    pub fn set_releases_known(&self, known: bool) {
        let mut keys = self.keys();
        keys.hold.set_knowledge(if known { KeyReleases::Reported } else { KeyReleases::Estimated });
        if !known {
            keys.enable.release();
        }
    }

    /// The dead-man switch; none where releases are estimated, for a hand that let go would
    /// seem to hold on.
    #[must_use]
    pub fn switch(&self) -> Switch {
        let keys = self.keys();
        if keys.knows_releases() { Switch::of(keys.enable.is_held()) } else { Switch::None }
    }

    /// How releases are known.
    #[must_use]
    pub fn knowledge(&self) -> KeyReleases {
        self.keys().hold.knowledge()
    }

    /// How releases are known, in words for the person, and how late they may be.
    #[must_use]
    pub fn release_words(&self) -> (String, String) {
        let keys = self.keys();
        let known = keys.hold.knowledge().words();
        let Some(late) = keys.hold.lateness() else { return (known.to_owned(), String::new()) };
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
        self.keys().hold.last_event()
    }

    /// The push at `now`, −1 to 1.
    #[must_use]
    pub fn push(&self, now: Seconds) -> f64 {
        self.keys().hold.push(now)
    }

    /// The keys' state stays whole even if a thread died holding it.
    fn keys(&self) -> MutexGuard<'_, Keys> {
        self.keys.lock().unwrap_or_else(PoisonError::into_inner)
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

/// Feeds `pointer` with a mouse event, whose time is `now`.
pub fn point(pointer: &Pointer, event: &MouseEvent, now: Seconds) {
    pointer.moves_to(event.column, event.row, now);
    match event.kind {
        MouseEventKind::Down(which) => pointer.press(button(which)),
        MouseEventKind::Up(which) => pointer.release(button(which)),
        // It moves with no button held: should one have seemed so, its release was lost.
        MouseEventKind::Moved => pointer.release_all(),
        _ => {}
    }
}

const fn button(which: MouseButton) -> Button {
    match which {
        MouseButton::Left => Button::Left,
        MouseButton::Middle => Button::Middle,
        MouseButton::Right => Button::Right,
    }
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
    switch_name: String,
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
        let (push, switch_name) = (params.push, params.switch_name());
        let mut keyboard = Self { hands, clock, push, switch_name, shaper, badge, told };
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

    fn switch(&mut self, _now: Seconds) -> Switch {
        self.hands.switch()
    }

    fn switch_name(&self) -> Option<String> {
        (self.hands.switch() != Switch::None).then(|| self.switch_name.clone())
    }

    fn intent(&mut self, _view: View<'_>) -> Intent {
        let now = self.clock.now();
        let age = self.hands.last_event().map_or(0.0, |at| (now - at).0.max(0.0));
        let raw = self.push * self.hands.push(now);
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
    use crate::operator::mouse::Mouse;
    use crate::signal::State;
    use proptest::prelude::*;

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

    fn key(letter: char, kind: KeyEventKind) -> KeyEvent {
        KeyEvent::new_with_kind(KeyCode::Char(letter), KeyModifiers::NONE, kind)
    }

    #[test]
    fn the_key_is_a_switch_only_where_releases_are_reported() {
        use KeyEventKind::{Press, Release, Repeat};
        let params = Params::default();
        let hands = Hands::new(&params);
        let clock = WallClock::start();
        let mut keyboard = Keyboard::new(hands.clone(), clock, &params, 10.0, Seconds(0.02));
        assert!(hands.feed(&key('e', Press), Seconds(0.0)));
        assert_eq!(keyboard.switch(Seconds(0.0)), Switch::None);
        assert_eq!(keyboard.switch_name(), None);
        // What went down before has to go down once more.
        hands.set_releases_known(true);
        assert_eq!(keyboard.switch_name().as_deref(), Some("hold e"));
        let mut after = |letter, kind| {
            hands.feed(&key(letter, kind), Seconds(0.0));
            keyboard.switch(Seconds(0.0))
        };
        assert_eq!(after('e', Repeat), Switch::Free);
        assert_eq!(after('e', Press), Switch::Held);
        // Other keys come and go, and Shift makes no other key of it.
        for (letter, kind) in [('a', Press), ('e', Repeat), ('a', Release), ('x', Press)] {
            assert_eq!(after(letter, kind), Switch::Held);
        }
        assert_eq!(after('E', Release), Switch::Free);
        assert_eq!(after('e', Repeat), Switch::Free);
        assert_eq!(after('E', Press), Switch::Held);
        hands.release_all();
        assert_eq!(after('e', Repeat), Switch::Free);
        let ctrl = KeyEvent::new(KeyCode::Char('e'), KeyModifiers::CONTROL);
        assert!(!hands.feed(&ctrl, Seconds(0.0)));
        assert_eq!(hands.switch(), Switch::Free);
        hands.feed(&key('e', Press), Seconds(0.0));
        hands.set_params(&Params { enable: 'j', ..params });
        assert_eq!(hands.switch(), Switch::Free);
        hands.feed(&key('j', Press), Seconds(0.0));
        assert_eq!(hands.switch(), Switch::Held);
    }

    #[test]
    fn a_letter_that_means_something_else_is_no_switch() {
        for (letter, is_free) in [('e', true), ('a', false), ('x', false), ('E', false)] {
            let mut faults = Vec::new();
            Params { enable: letter, ..Params::default() }.check(&mut Checker::new(&mut faults));
            assert_eq!(faults.is_empty(), is_free, "{letter}: {faults:?}");
        }
    }

    fn mouse_event(kind: MouseEventKind) -> MouseEvent {
        MouseEvent { kind, column: 3, row: 4, modifiers: KeyModifiers::NONE }
    }

    const BUTTONS: [MouseButton; 3] = [MouseButton::Left, MouseButton::Middle, MouseButton::Right];

    #[test]
    fn a_mouse_button_is_held_until_it_is_up_or_nobody_knows() {
        use MouseEventKind::{Down, Drag, Moved, ScrollUp, Up};
        let pointer = Pointer::default();
        let params = crate::operator::mouse::Params::default();
        let clock = WallClock::start();
        let mut mouse = Mouse::new(pointer.clone(), clock, &params, 1.0, Seconds(0.02));
        let [left, middle, right] = BUTTONS;
        assert_eq!(mouse.switch(Seconds(0.0)), Switch::Free);
        let mut after = |kind| {
            point(&pointer, &mouse_event(kind), Seconds(0.0));
            mouse.switch(Seconds(0.0))
        };
        assert_eq!(after(Drag(left)), Switch::Free);
        assert_eq!(after(Down(right)), Switch::Free);
        for kind in [Down(left), Drag(left), ScrollUp, Up(right), Down(middle), Up(middle)] {
            assert_eq!(after(kind), Switch::Held, "{kind:?}");
        }
        assert_eq!(after(Up(left)), Switch::Free);
        assert_eq!(after(Down(left)), Switch::Held);
        assert_eq!(after(Moved), Switch::Free);
        assert_eq!(after(Down(left)), Switch::Held);
        pointer.rests();
        assert_eq!(after(Drag(left)), Switch::Free);
        // Where every button that goes up is called the left, none stays held.
        point(&pointer, &mouse_event(Down(right)), Seconds(0.0));
        point(&pointer, &mouse_event(Up(left)), Seconds(0.0));
        assert!(!pointer.is_held(Button::Right));
    }

    proptest! {
        /// After a release, a lost focus or another knowledge of releases, only a new press holds.
        #[test]
        fn no_order_of_keys_leaves_the_switch_held(
            events in proptest::collection::vec((0..10_u8, any::<bool>()), 0..80),
        ) {
            use KeyEventKind::{Press, Release, Repeat};
            let hands = Hands::new(&Params::default());
            let (mut is_down, mut is_known) = (false, false);
            for (event, is_large) in events {
                let e = if is_large { 'E' } else { 'e' };
                match event {
                    0 | 1 => {
                        hands.feed(&key(e, Press), Seconds(0.0));
                        is_down = is_known;
                    }
                    2 | 3 => drop(hands.feed(&key(e, Repeat), Seconds(0.0))),
                    4 => {
                        hands.feed(&key(e, Release), Seconds(0.0));
                        is_down = false;
                    }
                    5 => drop(hands.feed(&key('d', Press), Seconds(0.0))),
                    6 => {
                        // A release of any key tells that they are reported.
                        hands.feed(&key('d', Release), Seconds(0.0));
                        is_known = true;
                    }
                    7 => {
                        hands.release_all();
                        is_down = false;
                    }
                    _ => {
                        is_known = event == 8;
                        is_down &= is_known;
                        hands.set_releases_known(is_known);
                    }
                }
                let expected = if is_known { Switch::of(is_down) } else { Switch::None };
                prop_assert_eq!(hands.switch(), expected);
            }
        }

        /// A button that is up, or whose terminal lost its focus, is never held.
        #[test]
        fn no_order_of_mouse_events_leaves_a_button_held(
            events in proptest::collection::vec((0..6_u8, 0..3_usize), 0..80),
        ) {
            let pointer = Pointer::default();
            let mut down = [false; 3];
            for (event, at) in events {
                let which = BUTTONS[at];
                let kind = match event {
                    0 | 1 => MouseEventKind::Down(which),
                    2 => MouseEventKind::Up(which),
                    3 => MouseEventKind::Drag(which),
                    4 => MouseEventKind::Moved,
                    _ => MouseEventKind::ScrollDown,
                };
                if event == 5 {
                    pointer.rests();
                }
                point(&pointer, &mouse_event(kind), Seconds(0.0));
                match event {
                    0 | 1 => down[at] = true,
                    2 => down[at] = false,
                    4 | 5 => down = [false; 3],
                    _ => {}
                }
                for (which, is_down) in BUTTONS.into_iter().zip(down) {
                    prop_assert!(is_down || !pointer.is_held(button(which)));
                }
                prop_assert!(event > 1 || pointer.is_held(button(which)));
            }
        }
    }
}
