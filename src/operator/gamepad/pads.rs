//! Which pad steers, and how far its stick is out: a pure function of events and their times.
//!
//! ```text
//!             first event      at the centre
//! plugged in ────────────▶ off ─────────────▶ on ── unplugged ──▶ gone
//!  (idle: 0)                ▲                                      │
//!                           └───────────── plugged in again ───────┘
//! ```
//!
//! The first pad that fits steers. Others are named, and one of them takes over when its
//! button `begin` is pressed. The emergency stop counts on every pad that fits.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

use serde::{Deserialize, Serialize};

use super::Params;
use super::map::{Axis, Button, Map};
use crate::operator::{News, Request, Switch};
use crate::signal::Seconds;

/// The number of a pad, for as long as it is plugged in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Id(pub u32);

/// What a pad is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct About {
    /// Its number.
    pub id: Id,
    /// Its name.
    pub name: String,
    /// SDL's GUID of it, 32 hexadecimal digits.
    pub guid: String,
    /// Where the names of its axes and buttons come from.
    pub mapping: String,
}

/// What happens at pads.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// One was plugged in, or was there from the start.
    Connected(About),
    /// One was unplugged.
    Disconnected(Id),
    /// An axis moved.
    Axis {
        /// Of which pad.
        pad: Id,
        /// Which.
        axis: Axis,
        /// To where, −1 to 1.
        value: f64,
    },
    /// A button was pressed or let go.
    Button {
        /// Of which pad.
        pad: Id,
        /// Which.
        button: Button,
        /// Pressed?
        is_pressed: bool,
    },
}

impl Event {
    /// Whether it says that a hand let go of something, or that its pad is gone: lost, it would
    /// leave a button held.
    const fn lets_go(&self) -> bool {
        matches!(self, Self::Disconnected(_) | Self::Button { is_pressed: false, .. })
    }
}

/// Makes room in a queue that nobody empties: which of the `waiting` events is to be given up
/// first. The newest matter most, and what lets go matters more than what does not.
pub(super) fn least<'a>(waiting: impl IntoIterator<Item = &'a Event>) -> usize {
    waiting.into_iter().position(|event| !event.lets_go()).unwrap_or(0)
}

/// Axes and buttons of one pad that are kept; no pad has more, but a broken one may say so.
pub(super) const MOST_CONTROLS: usize = 64;
/// Comings, goings and remarks that a session is told of.
const MOST_TOLD: u32 = 500;

/// A pad that is plugged in.
#[derive(Clone, Debug, PartialEq)]
pub struct Pad {
    /// What it is.
    pub about: About,
    /// Where its axes are that have moved.
    pub axes: BTreeMap<Axis, f64>,
    /// The buttons that are held.
    pub pressed: BTreeSet<Button>,
}

/// Whether the steering axis can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Grip {
    /// It has not moved: an idle hand.
    Idle,
    /// It was not at its centre since the pad was plugged in.
    Off,
    /// It steers.
    On,
}

/// All pads, and the one that steers.
#[derive(Clone, Debug)]
pub struct Pads {
    wanted: Option<String>,
    map: Map,
    centre: f64,
    present: Vec<Pad>,
    steering: Option<Id>,
    grip: Grip,
    /// The time of the steering pad's last event.
    last: Option<Seconds>,
    /// The pad that steered and is gone.
    gone: Option<String>,
    /// Whether a value that is no number was told already.
    told_nonsense: bool,
    news: VecDeque<News>,
    /// Comings, goings and remarks told so far.
    told: u32,
}

impl Pads {
    /// No pad yet.
    #[must_use]
    pub fn new(params: &Params) -> Self {
        Self {
            wanted: params.pad.clone(),
            map: params.map,
            centre: params.centre,
            present: Vec::new(),
            steering: None,
            grip: Grip::Idle,
            last: None,
            gone: None,
            told_nonsense: false,
            news: VecDeque::new(),
            told: 0,
        }
    }

    /// Takes what happened at `now`.
    pub fn take(&mut self, event: Event, now: Seconds) {
        match event {
            Event::Connected(about) => self.connect(about),
            Event::Disconnected(id) => self.disconnect(id),
            Event::Axis { pad, axis, value } => self.move_axis((pad, axis), value, now),
            Event::Button { pad, button, is_pressed } => {
                self.press((pad, button), is_pressed, now);
            }
        }
    }

    /// From now on keeps to the map in `params`; who steers stays.
    pub fn remap(&mut self, params: &Params) {
        (self.map, self.centre) = (params.map, params.centre);
        let held = self.steering().and_then(|pad| pad.axes.get(&self.map.steer).copied());
        self.grip = held.map_or(Grip::Idle, |value| self.grip_at(value));
    }

    /// Takes what happened long ago, and is heard only now. Where a stick is counts, but of
    /// what buttons ask for only the emergency stop: the hand meant that moment.
    pub fn take_late(&mut self, event: Event, now: Seconds) {
        let before = self.news.len();
        self.take(event, now);
        let late = self.news.split_off(before);
        let counts =
            |news: &News| !matches!(news, News::Asks(request) if *request != Request::Stop);
        self.news.extend(late.into_iter().filter(counts));
    }

    /// The hand is believed again once the stick was at its centre.
    pub fn lose_grip(&mut self) {
        self.grip = Grip::Off;
    }

    /// The pads that are plugged in, in the order in which they came.
    #[must_use]
    pub fn present(&self) -> &[Pad] {
        &self.present
    }

    /// The pad that steers.
    #[must_use]
    pub fn steering(&self) -> Option<&Pad> {
        self.present.iter().find(|pad| Some(pad.about.id) == self.steering)
    }

    /// How far the steering axis is out, −1 to 1; 0 while the hand is idle. `None` where
    /// nobody steers: there is no pad, or it was not at its centre yet.
    #[must_use]
    pub fn deflection(&self) -> Option<f64> {
        let pad = self.steering()?;
        match self.grip {
            Grip::Idle => Some(0.0),
            Grip::Off => None,
            Grip::On => pad.axes.get(&self.map.steer).copied(),
        }
    }

    /// The dead-man switch of the pad that steers; a hand at another pad does not count.
    #[must_use]
    pub fn switch(&self) -> Switch {
        let Some(enable) = self.map.enable else { return Switch::None };
        Switch::of(self.steering().is_some_and(|pad| pad.pressed.contains(&enable)))
    }

    /// The map of axes and buttons.
    #[must_use]
    pub const fn map(&self) -> &Map {
        &self.map
    }

    /// The time of the steering pad's last event, if it had one.
    #[must_use]
    pub const fn last_event(&self) -> Option<Seconds> {
        self.last
    }

    /// What is to be told, oldest first.
    pub fn next_news(&mut self) -> Option<News> {
        self.news.pop_front()
    }

    /// Which pad steers, with what, and who else is there.
    #[must_use]
    pub fn words(&self) -> String {
        let Some(pad) = self.steering() else { return String::new() };
        let About { name, mapping, .. } = &pad.about;
        let mapping = if mapping.is_empty() { String::new() } else { format!(", {mapping}") };
        let others = match self.present.len() {
            0 | 1 => String::new(),
            all => format!("; {} more", all - 1),
        };
        format!("gamepad {name}, {}{mapping}{others}", self.map.steer)
    }

    /// What keeps the person from steering, and what to do about it.
    #[must_use]
    pub fn trouble(&self) -> Option<String> {
        if self.steering.is_some() {
            return (self.grip == Grip::Off)
                .then(|| format!("move {} through its centre to steer", self.map.steer));
        }
        let missing = match (&self.gone, &self.wanted) {
            (Some(name), _) => format!("{name} is unplugged: plug it in"),
            (None, Some(wanted)) => format!("no gamepad `{wanted}`: plug it in"),
            (None, None) => "no gamepad: plug one in".to_owned(),
        };
        let other = self.present.iter().find(|pad| self.fits(&pad.about));
        Some(match (other, self.map.begin) {
            (Some(other), Some(begin)) => {
                format!("{missing}, or press {begin} on {}", other.about.name)
            }
            _ => format!("{missing} (coadapt devices shows what is there)"),
        })
    }

    fn connect(&mut self, about: About) {
        self.present.retain(|pad| pad.about.id != about.id);
        let (id, name, fits) = (about.id, about.name.clone(), self.fits(&about));
        self.present.push(Pad { about, axes: BTreeMap::new(), pressed: BTreeSet::new() });
        if self.steering == Some(id) || (self.steering.is_none() && fits) {
            // Only one that was here before may have been let go off its centre.
            self.grip = if self.gone.is_some() { Grip::Off } else { Grip::Idle };
            self.steering = Some(id);
            self.last = None;
            let was_gone = self.gone.take().is_some();
            self.tell(if was_gone {
                News::Back(format!("{name} is plugged in"))
            } else {
                News::Remark(format!("{name} steers"))
            });
        } else if let Some(steering) = self.steering() {
            let waits = if fits { "waits" } else { "is not the wanted one" };
            let remark =
                format!("{name} is plugged in and {waits}; {} steers", steering.about.name);
            self.tell(News::Remark(remark));
        }
    }

    /// Tells of a coming or going, unless a loose plug has filled the files with them already.
    fn tell(&mut self, news: News) {
        self.told = self.told.saturating_add(1);
        match self.told.cmp(&MOST_TOLD) {
            Ordering::Less => self.news.push_back(news),
            Ordering::Equal => {
                let words = "pads come and go without end; this is told no more".to_owned();
                self.news.push_back(News::Remark(words));
            }
            Ordering::Greater => {}
        }
    }

    fn disconnect(&mut self, id: Id) {
        let Some(at) = self.present.iter().position(|pad| pad.about.id == id) else { return };
        let name = self.present.remove(at).about.name;
        if self.steering == Some(id) {
            self.steering = None;
            self.grip = Grip::Off;
            self.tell(News::Gone(format!("{name} was unplugged")));
            self.gone = Some(name);
        } else {
            self.tell(News::Remark(format!("{name}, which did not steer, was unplugged")));
        }
    }

    fn move_axis(&mut self, (id, axis): (Id, Axis), value: f64, now: Seconds) {
        let Some(pad) = self.present.iter_mut().find(|pad| pad.about.id == id) else { return };
        if !value.is_finite() {
            if !self.told_nonsense {
                self.told_nonsense = true;
                let name = &pad.about.name;
                let remark = format!("{name}: {axis} sent {value}, no number; passed over");
                self.news.push_back(News::Remark(remark));
            }
            return;
        }
        let is_known = axis == self.map.steer || pad.axes.contains_key(&axis);
        if is_known || pad.axes.len() < MOST_CONTROLS {
            pad.axes.insert(axis, value);
        }
        if self.steering != Some(id) {
            return;
        }
        self.last = Some(now);
        if axis == self.map.steer && self.grip != Grip::On {
            self.grip = self.grip_at(value);
        }
    }

    fn press(&mut self, (id, button): (Id, Button), is_pressed: bool, now: Seconds) {
        let Some(pad) = self.present.iter_mut().find(|pad| pad.about.id == id) else { return };
        if !is_pressed {
            pad.pressed.remove(&button);
            return;
        }
        if pad.pressed.len() >= MOST_CONTROLS || !pad.pressed.insert(button) {
            return;
        }
        let about = pad.about.clone();
        let asked = self.request(button);
        if self.steering == Some(id) {
            self.last = Some(now);
            self.news.extend(asked.map(News::Asks));
        } else if self.fits(&about) {
            match asked {
                Some(Request::Stop) => self.news.push_back(News::Asks(Request::Stop)),
                Some(Request::Begin) => self.hand_over(&about),
                _ => {}
            }
        }
    }

    /// From now on the pad `about` steers.
    fn hand_over(&mut self, about: &About) {
        self.steering = Some(about.id);
        self.last = None;
        let held = self.steering().and_then(|pad| pad.axes.get(&self.map.steer).copied());
        self.grip = held.map_or(Grip::Idle, |value| self.grip_at(value));
        self.gone = None;
        self.tell(News::Back(format!("{} steers from now on", about.name)));
    }

    fn grip_at(&self, value: f64) -> Grip {
        if value.abs() <= self.centre { Grip::On } else { Grip::Off }
    }

    /// What `button` asks for.
    fn request(&self, button: Button) -> Option<Request> {
        let Map { begin, pause, discard, stop, .. } = self.map;
        [
            (stop, Request::Stop),
            (begin, Request::Begin),
            (pause, Request::Pause),
            (discard, Request::Discard),
        ]
        .into_iter()
        .find_map(|(mapped, request)| (mapped == Some(button)).then_some(request))
    }

    /// Whether the profile allows this pad to steer.
    fn fits(&self, about: &About) -> bool {
        self.wanted.as_ref().is_none_or(|wanted| {
            about.guid.eq_ignore_ascii_case(wanted)
                || about.name.to_lowercase().contains(&wanted.to_lowercase())
        })
    }
}

#[cfg(test)]
#[path = "pads_tests.rs"]
mod tests;
