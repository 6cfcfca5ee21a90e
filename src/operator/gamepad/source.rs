//! Where a gamepad's events come from.

use std::collections::VecDeque;
use std::fmt;
use std::sync::mpsc::Receiver;

use super::events::Events;
use super::feel::Feel;
use super::hub::{Heard, Hub};
use super::link::Link;
#[cfg(unix)]
use super::link::Socket;
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
}

enum Kind {
    Here {
        hub: Hub,
        heard: Receiver<Heard>,
        clock: WallClock,
    },
    Relay {
        link: Link,
        clock: WallClock,
    },
    #[cfg(unix)]
    Socket {
        socket: Socket,
        clock: WallClock,
    },
    Script(VecDeque<(Seconds, Event)>),
    Nothing(String),
}

impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match &self.kind {
            Kind::Here { .. } => "Here",
            Kind::Relay { .. } => "Relay",
            #[cfg(unix)]
            Kind::Socket { .. } => "Socket",
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
        Self::of(Kind::Relay { link, clock })
    }

    /// The lines of a relay that connects to `socket`.
    #[cfg(unix)]
    #[must_use]
    pub fn socket(socket: Socket, clock: WallClock) -> Self {
        Self::of(Kind::Socket { socket, clock })
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
        Self { kind, told: Counts::default() }
    }

    /// The time that events are stamped with, at the session's time `now`.
    pub(super) fn now(&self, now: Seconds) -> Seconds {
        match &self.kind {
            Kind::Here { clock, .. } | Kind::Relay { clock, .. } => clock.now(),
            #[cfg(unix)]
            Kind::Socket { clock, .. } => clock.now(),
            Kind::Script(_) | Kind::Nothing(_) => now,
        }
    }

    /// Lets `pads` take all events up to `now`.
    pub(super) fn drain(&mut self, now: Seconds, pads: &mut Pads) {
        if let Some(link) = self.link() {
            for (event, at) in link.drain() {
                pads.take(event, at);
            }
        }
        match &mut self.kind {
            Kind::Here { heard, .. } => {
                while let Ok((event, at)) = heard.try_recv() {
                    pads.take(event, at);
                }
            }
            Kind::Script(events) => {
                while let Some((at, event)) = events.pop_front_if(|(at, _)| *at <= now + ROUNDING) {
                    pads.take(event, at);
                }
            }
            _ => {}
        }
    }

    /// The age of a relayed state; `None` where silence means rest.
    pub(super) fn age(&self, now: Seconds) -> Option<Seconds> {
        self.link()?.age(self.now(now))
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
        let (lost, damaged) = (counts.lost - self.told.lost, counts.damaged - self.told.damaged);
        let is_due = counts.taken >= self.told.taken + TOLD_EVERY;
        if !is_due || lost + damaged == 0 {
            return None;
        }
        let all = counts.taken - self.told.taken + lost + damaged;
        self.told = counts;
        Some(News::Remark(format!("of {all} relayed lines {lost} were lost, {damaged} damaged")))
    }

    /// Whether no event will ever come again.
    pub(super) fn is_over(&self) -> bool {
        matches!(&self.kind, Kind::Script(events) if events.is_empty())
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
            #[cfg(unix)]
            Kind::Socket { socket, .. } => Some(socket.link()),
            Kind::Here { .. } | Kind::Script(_) | Kind::Nothing(_) => None,
        }
    }
}

/// Losses are told once in so many lines, about every ten seconds.
const TOLD_EVERY: u64 = 500;
