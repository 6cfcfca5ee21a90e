//! A real plant as the control cycle sees it, and the clock that it keeps.

use std::f64::consts::PI;

use super::centre::Pole;
use super::desk::{Ask, Desk, View};
use super::driver::Stage;
use super::station::{Duty, Grip, Look, Wish};
use crate::backend::safety::Trip;
use crate::backend::safety::warden::{Fault, Standing};
use crate::backend::{Backend, Readiness, Sensed};
use crate::clock::{Clock, WallClock};
use crate::random::Place;
use crate::signal::{Action, Seconds, State, wrapped};

/// How a rollout begins on a real plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Manner {
    /// The largest action, in the plant's unit.
    pub limit: f64,
    /// The time between two states.
    pub period: Seconds,
    /// The plant's own guard stops it when no state came for so long.
    pub stale: Seconds,
    /// A test begins with this part of the largest action,
    pub push: f64,
    /// for so long.
    pub push_time: Seconds,
    /// A pole that is to stand upright does so within this angle, rad.
    pub upright: f64,
    /// The switch that enables the motor, in words: `hold L1`. `None`: nobody needs to.
    pub switch: Option<String>,
}

/// A rollout begins with this push.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Push {
    action: f64,
    /// It lasts until then, once it has begun.
    until: Option<Seconds>,
}

/// A real plant.
#[derive(Debug)]
pub struct Wired {
    desk: Desk,
    clock: WallClock,
    manner: Manner,
    /// The rollout that was prepared has not begun: where its pole must be.
    start: Option<Pole>,
    push: Option<Push>,
    /// The operator's device has a switch that enables the motor.
    has_switch: bool,
}

impl Wired {
    /// The plant whose station is at `desk`; `clock` is the one that its port goes by.
    #[must_use]
    pub fn new(desk: Desk, clock: WallClock, manner: Manner) -> Self {
        Self { desk, clock, manner, start: None, push: None, has_switch: true }
    }

    /// The push that the rollout begins with, while it lasts.
    fn pushed(&mut self, now: Seconds) -> Option<f64> {
        let push = self.push.as_mut()?;
        let until = *push.until.get_or_insert(now + self.manner.push_time);
        let action = push.action;
        if now >= until {
            self.push = None;
            return None;
        }
        Some(action)
    }

    /// When this program stood still, its port's thread may go on a little later than the control
    /// cycle: what it finds is the cause of all that follows, and is waited for.
    fn await_verdict(&self) {
        let now = self.clock.now();
        let is_overdue = |view: &View| {
            let latest = view.look.latest;
            view.look.standing == Standing::Armed
                && latest.is_some_and(|(_, at)| now - at > self.manner.stale)
        };
        if self.desk.see(is_overdue) {
            self.desk.wait(VERDICT, |view| (!is_overdue(view)).then_some(()));
        }
    }
}

impl Backend for Wired {
    fn sense(&mut self) -> Sensed {
        let now = self.clock.now();
        match self.desk.see(|view| view.look.latest) {
            Some((state, at)) => Sensed { state, age: now - at },
            None => Sensed { state: State::new([0.0; 4]), age: Seconds(f64::INFINITY) },
        }
    }

    fn actuate(&mut self, wanted: Action) -> Action {
        let now = self.clock.now();
        self.start = None;
        let action = self.pushed(now).unwrap_or(wanted.0);
        let state = self.desk.see(|view| view.look.states);
        self.desk.ask(Ask::Want(action, now));
        // What the plant really gets is known once its port's thread has written it.
        let patience = self.manner.period * 0.5;
        let applied = self
            .desk
            .wait(patience, |view| (view.look.answered >= state).then_some(view.look.applied));
        Action(applied.unwrap_or_else(|| self.desk.see(|view| view.look.applied)))
    }

    fn halt(&mut self) {
        self.push = None;
        self.desk.wish(Wish::Rest);
    }

    fn prepare(&mut self, start: State, _place: Place) {
        let value = |index: usize| start.get(index).copied().unwrap_or(0.0);
        let (theta, turning) = (value(2), value(3));
        let hangs = wrapped(theta - PI).abs() < PI / 2.0;
        let pole = if hangs { Pole::Hanging } else { Pole::Anywhere };
        self.start = Some(pole);
        // A plant cannot be put into motion: what turns is pushed to that side.
        self.push = (hangs && turning != 0.0).then(|| Push {
            action: turning.signum() * self.manner.push * self.manner.limit,
            until: None,
        });
        self.desk.wish(Wish::Return(pole));
    }

    fn go_on(&mut self, _place: Place) {}

    fn readiness(&mut self) -> Readiness {
        let waits = |why: String, needs_person: bool| Readiness::Waits { why, needs_person };
        let (start, switch) = (self.start, self.manner.switch.clone());
        let look = self.desk.see(|view| view.look.clone());
        if let Some(why) = off(&look) {
            return waits(why, true);
        }
        match look.grip {
            Grip::On => {}
            _ if !self.has_switch => return waits(NO_SWITCH.to_owned(), true),
            Grip::LeftOn => {
                return waits("let go of the switch that enables the motor".to_owned(), true);
            }
            Grip::Off => {
                let switch = switch.unwrap_or_else(|| "hold the switch".to_owned());
                return waits(format!("{switch} to enable the motor"), true);
            }
        }
        match look.duty {
            _ if start.is_none() => Readiness::Ready,
            Duty::Return { is_there: true, .. } => Readiness::Ready,
            Duty::Return { trouble: Some(trouble), .. } => waits(trouble.to_string(), true),
            Duty::Return { .. } => {
                waits("the cart returns to the middle, the pole comes to rest".to_owned(), false)
            }
            // It was interrupted: once more.
            _ => {
                self.desk.wish(Wish::Return(start.unwrap_or_default()));
                waits("the cart is about to return".to_owned(), false)
            }
        }
    }

    fn is_at_start(&mut self) -> bool {
        match self.start {
            Some(Pole::Anywhere) => {
                let theta = self.sense().state.get(2).copied().unwrap_or(PI);
                wrapped(theta).abs() <= self.manner.upright
            }
            _ => true,
        }
    }

    fn enable(&mut self, is_held: Option<bool>) {
        self.has_switch = is_held.is_some();
        self.desk.ask(Ask::Enable(is_held == Some(true), self.clock.now()));
    }

    fn stop(&mut self, tripped: Option<Trip>) {
        self.push = None;
        let age = self.sense().age;
        self.desk.wish(match tripped {
            None => Wish::Stop,
            Some(Trip::Action) => Wish::Latch(Fault::Action),
            Some(Trip::State) => Wish::Latch(Fault::State),
            // Of a device that is gone there is nothing to clear once it is back.
            Some(Trip::Stale) if age.0.is_infinite() => Wish::Disarm,
            Some(Trip::Stale) => Wish::Latch(Fault::Stale(age.0 * 1e3)),
        });
    }

    fn fault(&mut self) -> Option<String> {
        self.await_verdict();
        match self.desk.see(|view| view.look.standing) {
            Standing::Latched(fault) => Some(fault.to_string()),
            _ => None,
        }
    }

    fn is_real(&self) -> bool {
        true
    }
}

/// How long a verdict is waited for, while the plant is at rest.
const VERDICT: Seconds = Seconds(0.5);
/// What is said where nobody can hold a switch.
const NO_SWITCH: &str = "this terminal reports no key releases, so that no key can be held to \
    enable the motor: use a gamepad, the mouse, or a terminal such as kitty or foot";

/// Why the motor is off, and what a person can do about it; `None` for one that follows.
fn off(look: &Look) -> Option<String> {
    Some(match (&look.stage, look.standing) {
        (Stage::Closed(why), _) => why.clone(),
        (Stage::Opening, _) => "the device is being greeted".to_owned(),
        (Stage::Homing, _) => "the device looks for its ends".to_owned(),
        (Stage::Ready, Standing::Latched(fault)) => format!("stopped: {fault}"),
        (Stage::Ready, Standing::Disarmed) => "the motor is not armed".to_owned(),
        (Stage::Ready, Standing::Armed) => return None,
    })
}

/// The clock of a real plant: its states are the ticks.
#[derive(Clone, Debug)]
pub struct Metronome {
    desk: Desk,
    clock: WallClock,
    period: Seconds,
    /// States that ticks were made of, or that came too late for one.
    seen: u64,
}

impl Metronome {
    /// The clock of the plant at `desk`, which sends a state each `period`.
    #[must_use]
    pub const fn new(desk: Desk, clock: WallClock, period: Seconds) -> Self {
        Self { desk, clock, period, seen: 0 }
    }
}

impl Clock for Metronome {
    fn now(&self) -> Seconds {
        self.clock.now()
    }

    /// Returns when the next state has come, or half a period after `deadline` without one.
    fn wait_until(&mut self, deadline: Seconds) -> Seconds {
        let seen = self.seen;
        let left = deadline + self.period * 0.5 - self.clock.now();
        let came = self.desk.wait(left, |view| {
            let (_, at) = view.look.latest.filter(|_| view.look.states > seen)?;
            Some((view.look.states, at))
        });
        let Some((states, at)) = came else { return deadline };
        self.seen = states;
        // Of several the first was the one to wait for: the others are missed ticks.
        #[expect(clippy::cast_precision_loss, reason = "a few states")]
        let skipped = if seen == 0 { 0.0 } else { (states - seen - 1).min(50) as f64 };
        at - self.period * skipped
    }

    fn is_wall(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::safety::{Limits, Safe};
    use crate::backend::serial::bench::{LIMIT, PERIOD, params, view};
    use crate::backend::serial::desk::Shown;
    use crate::backend::wire::Format;

    fn manner() -> Manner {
        let params = params(Format::Cobs1);
        Manner {
            limit: LIMIT,
            period: PERIOD,
            stale: PERIOD * 3.0,
            push: params.push,
            push_time: Seconds(params.push_s),
            upright: 0.1,
            switch: None,
        }
    }

    /// A plant that is armed, and whose latest state came `at` that time.
    fn armed(at: Seconds) -> Desk {
        let mut view = view();
        view.look.standing = Standing::Armed;
        view.look.latest = Some((State::new([0.0, 0.0, PI, 0.0]), at));
        let desk = Desk::new(view.look.clone());
        desk.show(view);
        desk
    }

    #[test]
    fn after_a_standstill_the_plants_own_guard_names_the_cause() {
        let desk = armed(Seconds(-1.0));
        let wired = Wired::new(desk.clone(), WallClock::start(), manner());
        let limits = Limits { action: LIMIT, stale: PERIOD * 6.0 };
        let mut safe = Safe::new(Box::new(wired), limits);
        safe.actuate(Action(1.0));
        assert_eq!(safe.tripped(), Some(Trip::Stale));
        // The port's thread goes on a little later.
        let cause = std::thread::scope(|scope| {
            scope.spawn(|| {
                WallClock::start().wait_until(Seconds(0.02));
                let mut view = desk.view();
                view.look.standing = Standing::Latched(Fault::Clock(1.0));
                while desk.show(view.clone()) == Shown::NotYet {}
            });
            safe.cause()
        });
        assert_eq!(cause, Some(Fault::Clock(1.0).to_string()));
    }

    #[test]
    fn a_limit_that_tripped_is_not_called_the_emergency_stop() {
        let desk = armed(Seconds(0.0));
        let mut wired = Wired::new(desk.clone(), WallClock::start(), manner());
        for tripped in [None, Some(Trip::Action), Some(Trip::State)] {
            wired.stop(tripped);
        }
        let latch = |fault| Ask::Wish(Wish::Latch(fault));
        assert_eq!(
            desk.take_asked(),
            [Ask::Wish(Wish::Stop), latch(Fault::Action), latch(Fault::State)]
        );
    }
}
