//! Where a gamepad's events come from.

use std::collections::VecDeque;
use std::fmt;

use super::events::Events;
use super::feel::Feel;
use super::hub::Hub;
use super::inbox::Inbox;
#[cfg(unix)]
use super::link::Socket;
use super::link::{Link, Relayed};
use super::pads::{Event, Id, Pads};
use super::relay::Counts;
use crate::clock::{Clock, WallClock};
use crate::operator::News;
use crate::signal::Seconds;

/// Times such as 0.06 are not sums of ticks to the last bit.
const ROUNDING: Seconds = Seconds(1e-9);

/// Where a gamepad's events come from.
pub struct Source {
    kind: Kind,
    /// What became of a relay's lines, as far as it was told.
    told: Counts,
    /// The latest time of the session that this was asked at.
    now: Seconds,
}

enum Kind {
    Here {
        hub: Hub,
        heard: Inbox,
        clock: WallClock,
    },
    Relay {
        link: Link,
        clock: WallClock,
        /// What the link lives in, if that is not the whole program.
        _socket: Option<Box<dyn Send>>,
    },
    Script(VecDeque<(Seconds, Event)>),
    Nothing(String),
}

impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match &self.kind {
            Kind::Here { .. } => "Here",
            Kind::Relay { .. } => "Relay",
            Kind::Script(_) => "Script",
            Kind::Nothing(_) => "Nothing",
        })
    }
}

impl Source {
    /// The pads at this computer, whose events carry times of `clock`.
    #[must_use]
    pub fn here(hub: &Hub, clock: WallClock) -> Self {
        let heard = hub.listen(clock.now());
        Self::of(Kind::Here { hub: hub.clone(), heard, clock })
    }

    /// A relay's lines, which are stamped with `clock`.
    #[must_use]
    pub fn relay(link: Link, clock: WallClock) -> Self {
        Self::of(Kind::Relay { link, clock, _socket: None })
    }

    /// The lines of a relay that connects to `socket`.
    #[cfg(unix)]
    #[must_use]
    pub fn socket(socket: Socket, clock: WallClock) -> Self {
        let link = socket.link().clone();
        Self::of(Kind::Relay { link, clock, _socket: Some(Box::new(socket)) })
    }

    /// A table of events, in the session's time.
    #[must_use]
    pub fn script(events: Events) -> Self {
        Self::of(Kind::Script(events.into_queue()))
    }

    /// No pad can be heard, for the reason `why`.
    #[must_use]
    pub fn nothing(why: impl Into<String>) -> Self {
        Self::of(Kind::Nothing(why.into()))
    }

    fn of(kind: Kind) -> Self {
        let mut source = Self { kind, told: Counts::default(), now: Seconds(0.0) };
        // What an earlier session lost is not this one's.
        source.told = source.link().map(Link::counts).unwrap_or_default();
        source
    }

    /// The time that events are stamped with, at the session's time `now`.
    pub(super) fn now(&self, now: Seconds) -> Seconds {
        match &self.kind {
            Kind::Here { clock, .. } | Kind::Relay { clock, .. } => clock.now(),
            Kind::Script(_) | Kind::Nothing(_) => now,
        }
    }

    /// Lets `pads` take all events up to `now`; relayed ones that are older than `old` are
    /// late.
    pub(super) fn drain(&mut self, now: Seconds, old: Seconds, pads: &mut Pads) {
        self.now = now;
        match &mut self.kind {
            Kind::Here { heard, .. } => {
                while let Some((event, at)) = heard.next() {
                    pads.take(event, at);
                }
            }
            Kind::Relay { link, .. } => {
                for Relayed { event, at, age } in link.drain() {
                    if age > old { pads.take_late(event, at) } else { pads.take(event, at) }
                }
            }
            Kind::Script(events) => {
                while let Some((at, event)) = events.pop_front_if(|(at, _)| *at <= now + ROUNDING) {
                    pads.take(event, at);
                }
            }
            Kind::Nothing(_) => {}
        }
    }

    /// The age of a relayed state; `None` where silence means rest.
    pub(super) fn age(&self, now: Seconds) -> Option<Seconds> {
        self.link()?.age(self.now(now))
    }

    /// Whether what happens at the pads is still told: neither a relay nor the thread
    /// that hears them has been silent for longer than `patience`.
    pub(super) fn is_heard(&self, patience: Seconds) -> bool {
        let age = match &self.kind {
            Kind::Here { hub, clock, .. } => Some(hub.age(clock.now())),
            Kind::Relay { link, clock, .. } => link.age(clock.now()),
            Kind::Script(_) => Some(Seconds(0.0)),
            Kind::Nothing(_) => None,
        };
        age.is_some_and(|age| age <= patience)
    }

    /// How the link does.
    pub(super) fn words(&self, now: Seconds) -> String {
        let (Some(link), Some(age)) = (self.link(), self.age(now)) else { return String::new() };
        let Counts { lost, damaged, .. } = link.counts();
        format!("relay {:.0} ms old, {lost} lost, {damaged} bad", age.0 * 1e3)
    }

    /// Why no events come, and what to do about it.
    pub(super) fn trouble(&self) -> Option<String> {
        match &self.kind {
            Kind::Nothing(why) => Some(why.clone()),
            _ => self.link()?.trouble(),
        }
    }

    /// That lines of a relay were lost since this was told last.
    pub(super) fn news(&mut self) -> Option<News> {
        let counts = self.link()?.counts();
        let new = |now: u64, told: u64| now.saturating_sub(told);
        let (taken, lost, damaged) = (
            new(counts.taken, self.told.taken),
            new(counts.lost, self.told.lost),
            new(counts.damaged, self.told.damaged),
        );
        let all = taken + lost + damaged;
        if all < TOLD_EVERY || lost + damaged == 0 {
            return None;
        }
        self.told = counts;
        Some(News::Remark(format!("of {all} relayed lines {lost} were lost, {damaged} damaged")))
    }

    /// Whether no event will come for longer than anybody waits.
    pub(super) fn is_over(&self) -> bool {
        let is_far = |(at, _): &(Seconds, Event)| *at > self.now + LONGEST_WAIT;
        matches!(&self.kind, Kind::Script(events) if events.front().is_none_or(is_far))
    }

    /// Lets the hand at `pad` feel something, where that is possible.
    pub(super) fn feel(&self, pad: Id, feel: Feel) {
        if let Kind::Here { hub, .. } = &self.kind {
            hub.feel(pad, feel);
        }
    }

    fn link(&self) -> Option<&Link> {
        match &self.kind {
            Kind::Relay { link, .. } => Some(link),
            Kind::Here { .. } | Kind::Script(_) | Kind::Nothing(_) => None,
        }
    }
}

/// A table whose next event is later than this has nothing to say.
const LONGEST_WAIT: Seconds = Seconds(3600.0);
/// Losses are told once in so many lines, about every ten seconds.
const TOLD_EVERY: u64 = 500;
