//! Hands on a gamepad or joystick: here, at another computer, or in a table of events.
//!
//! Every pad goes the same way: its events, with their times, through [`Pads`], which knows
//! who steers, then through the shape. Only where they come from differs: [`Source`].

pub mod events;
pub mod feel;
pub mod hub;
pub mod inbox;
pub mod learn;
pub mod link;
mod map;
pub mod pads;
pub mod relay;
pub mod rights;
mod source;

pub use map::{Axis, Button, Map};
pub use pads::{About, Event, Id, Pad, Pads};
pub use source::Source;

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::shaping::{Shape, Shaper};
use super::{Badge, Feedback, News, Operator, Practice, Switch, View};
use crate::check::{Check, Checker};
use crate::random::Place;
use crate::signal::{Action, Intent, Seconds};
use feel::Touch;

/// The gamepad's parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// Which pad steers: a part of its name or its whole GUID; `None`: the first that is there.
    pub pad: Option<String>,
    /// What its axes and buttons are for.
    pub map: Map,
    /// Mappings of pads that the built-in list does not know, a line of SDL's
    /// `gamecontrollerdb.txt` each.
    pub sdl_mappings: Vec<String>,
    /// A pad that was plugged in steers once its deflection has been within this of rest.
    pub centre: f64,
    /// A relayed pad that is silent for longer steers no more, and its switch is free, s;
    pub silent_s: f64,
    /// for longer than this, and the rollout waits, as without a pad.
    pub lost_s: f64,
    /// What the pad lets the hand feel.
    pub rumble: Rumble,
    /// From the steering axis to the action.
    pub shape: Shape,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            pad: None,
            map: Map::default(),
            sdl_mappings: Vec::new(),
            centre: 0.15,
            silent_s: 0.2,
            lost_s: 1.0,
            rumble: Rumble::default(),
            shape: Shape { dead_zone: 0.1, outer_zone: 0.02, ..Shape::default() },
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        self.map.check(&mut c.section("map"));
        for line in self.sdl_mappings.iter().filter(|line| !is_sdl_mapping(line)) {
            c.demand(
                false,
                "sdl_mappings",
                line,
                "lines of gamecontrollerdb.txt: a GUID of 32 hexadecimal digits, a name, then \
                 pairs such as leftx:a0, all with commas between",
            );
        }
        c.range("centre", self.centre, 0.01..=0.9);
        c.range("silent_s", self.silent_s, 0.05..=5.0);
        c.range("lost_s", self.lost_s, 0.05..=60.0);
        c.range("rumble.strength", self.rumble.strength, 0.0..=1.0);
        self.shape.check(&mut c.section("shape"));
    }
}

/// What a pad that can shake lets the hand feel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Rumble {
    /// A short pulse when the plant is let go.
    pub release: bool,
    /// A longer one when the plant runs into the end of its track.
    pub track_end: bool,
    /// The robot's share as a steady shaking.
    pub share: bool,
    /// How strong, as a part of what the pad can do.
    pub strength: f64,
}

impl Default for Rumble {
    fn default() -> Self {
        Self { release: false, track_end: false, share: false, strength: 0.5 }
    }
}

/// Whether `line` looks as SDL writes mappings; others would be passed over without a word.
fn is_sdl_mapping(line: &str) -> bool {
    let mut parts = line.trim().trim_end_matches(',').split(',');
    let is_guid =
        |guid: &str| guid.len() == 32 && guid.chars().all(|digit| digit.is_ascii_hexdigit());
    let has_guid = parts.next().is_some_and(is_guid);
    let has_name = parts.next().is_some_and(|name| !name.is_empty());
    let pairs: Vec<&str> = parts.collect();
    has_guid && has_name && !pairs.is_empty() && pairs.iter().all(|pair| pair.contains(':'))
}

/// The operator at a gamepad.
#[derive(Debug)]
pub struct Gamepad {
    pads: Pads,
    source: Source,
    /// A relayed pad that is silent for longer is nobody's wish, nor is a hand on its switch,
    silent: Seconds,
    /// and for longer than this it is lost.
    lost_after: Seconds,
    is_lost: bool,
    shaper: Shaper,
    touch: Touch,
    badge: Badge,
    /// When events were taken last.
    heard_at: Option<Seconds>,
    news: VecDeque<News>,
}

impl Gamepad {
    /// The pad whose events come from `source`, for ticks of `tick` and actions up to
    /// ± `limit`.
    #[must_use]
    pub fn new(source: Source, params: &Params, limit: f64, tick: Seconds) -> Self {
        let gamepad = Self {
            pads: Pads::new(params),
            source,
            silent: Seconds(params.silent_s),
            lost_after: Seconds(params.silent_s.max(params.lost_s)),
            is_lost: false,
            shaper: Shaper::new(params.shape, limit, tick),
            touch: Touch::new(params.rumble),
            badge: Badge::default(),
            heard_at: None,
            news: VecDeque::new(),
        };
        gamepad.tell(Seconds(0.0));
        gamepad
    }

    /// What the gamepad says of itself.
    #[must_use]
    pub fn badge(&self) -> Badge {
        self.badge.clone()
    }

    /// Takes all events up to `now`, the session's time, once a tick.
    fn hear(&mut self, now: Seconds) {
        if self.heard_at.replace(now) == Some(now) {
            return;
        }
        self.source.drain(now, self.silent, &mut self.pads);
        self.news.extend(std::iter::from_fn(|| self.pads.next_news()));
        self.news.extend(self.source.news());
        self.notice_silence(now);
        self.tell(now);
    }

    /// A relay that is silent for too long is lost; back, the stick passes its centre first.
    fn notice_silence(&mut self, now: Seconds) {
        let is_lost = self.source.age(now).is_some_and(|age| age > self.lost_after);
        if is_lost != self.is_lost {
            self.is_lost = is_lost;
            self.news.push_back(if is_lost {
                News::Gone("the relay is silent".to_owned())
            } else {
                News::Back("the relay is heard again".to_owned())
            });
        }
        if is_lost {
            self.pads.lose_grip();
        }
    }

    /// Says what became of the device.
    fn tell(&self, now: Seconds) {
        let silent = self.silence(now).map(|silence| {
            format!("the relay is silent for {:.1} s: its network is slow or down", silence.0)
        });
        let trouble = self.source.trouble().or(silent).or_else(|| self.pads.trouble());
        self.badge.update(self.pads.words(), self.source.words(now), trouble);
    }

    /// For how long a relay has been silent, if that is too long.
    fn silence(&self, now: Seconds) -> Option<Seconds> {
        self.source.age(now).filter(|age| *age > self.silent)
    }

    fn feel(&self, feel: Option<feel::Feel>) {
        if let (Some(feel), Some(pad)) = (feel, self.pads.steering()) {
            self.source.feel(pad.about.id, feel);
        }
    }
}

impl Operator for Gamepad {
    fn begin(&mut self, _place: Place, _practice: Practice) {
        self.touch.begin();
        let still = self.touch.rest();
        self.feel(still);
    }

    fn tune(&mut self, sensitivity: f64) {
        self.shaper.set_sensitivity(sensitivity);
    }

    fn news(&mut self, now: Seconds) -> Option<News> {
        self.hear(now);
        self.news.pop_front()
    }

    fn is_gone(&self) -> bool {
        self.is_lost || self.pads.deflection().is_none()
    }

    fn is_over(&self) -> bool {
        self.source.is_over()
    }

    fn switch(&mut self, now: Seconds) -> Switch {
        self.hear(now);
        match self.pads.switch() {
            Switch::Held => Switch::of(self.source.is_heard(self.silent)),
            other => other,
        }
    }

    fn switch_name(&self) -> Option<String> {
        self.pads.map().switch_name()
    }

    fn intent(&mut self, view: View<'_>) -> Intent {
        let released = self.touch.released(view.rollout_time);
        self.feel(released);
        let there = self.pads.deflection().filter(|_| self.silence(view.now).is_none());
        // A hand that comes back after a while comes back from rest.
        let action = Action(self.shaper.shape(there.unwrap_or(0.0)));
        let Some(raw) = there else { return Intent::Absent };
        let age = self.source.age(view.now).unwrap_or_else(|| {
            let now = self.source.now(view.now);
            self.pads.last_event().map_or(Seconds(0.0), |at| Seconds((now - at).0.max(0.0)))
        });
        Intent::Present { action, raw: Some(raw), age }
    }

    fn told(&mut self, feedback: &Feedback<'_>) {
        for feel in self.touch.told(feedback) {
            self.feel(feel);
        }
    }
}

impl Drop for Gamepad {
    /// No pad goes on shaking after the session.
    fn drop(&mut self) {
        let still = self.touch.rest();
        self.feel(still);
    }
}

#[cfg(test)]
#[path = "gamepad_tests.rs"]
mod tests;
