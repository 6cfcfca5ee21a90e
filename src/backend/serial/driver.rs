//! The host's side of a device, without the port: what to write, and when, from what was read.
//!
//! A pure function of time and bytes. [`Driver`] opens a device step by step, homes it, keeps
//! the [`Warden`] informed, and writes at most one command for each state that came. Whoever
//! owns the port moves bytes between the two, and passes the time on.
//!
//! ```text
//!          opened            the steps of the format          home        homed
//! Closed ─────────▶ Opening ─────────────────────────▶ Ready ──────▶ Homing ─────▶ Ready
//!    ▲                 │ no answer, another device        │  ▲                       (homed)
//!    └──── lost ───────┴──────────────────────────────────┘  └── arm: the warden's affair
//! ```

mod facts;
mod refusal;

use super::Params;
use super::greeting::{Greeting, Progress};
use super::scales::{self, Tracker};
use super::standing::stopped_by;
pub use super::standing::{NotArmed, Received, Stage, Stopped};
use crate::backend::safety::warden::{Fault, Observation, Standing, Wanted, Warden};
use crate::backend::wire::{Codec, Counts, Flags, Format, Message, Order, Outcome, StateFrame};
use crate::signal::Seconds;

/// A device that homes is silent, or says that it does, from this time on.
const HOMING_SHOWS: Seconds = Seconds(0.5);
/// So many states after it tell that it does not: none of them was under way for so long.
const NOT_HOMING: u32 = 5;
/// A stop that the device has not confirmed after so many periods is said to be unconfirmed.
const CONFIRMED_WITHIN: f64 = 3.0;

/// The host's side of one device.
#[expect(
    clippy::struct_excessive_bools,
    reason = "four facts that have nothing to do with another"
)]
pub struct Driver {
    params: Params,
    period: Seconds,
    limit: f64,
    codec: Box<dyn Codec>,
    warden: Warden,
    tracker: Tracker,
    stage: Stage,
    greeting: Greeting,
    /// When the present stage began.
    since: Seconds,
    /// The device has said that it follows commands.
    follows: bool,
    is_homed: bool,
    wants_home: bool,
    /// The last command that was written drives the motor, or lets the device do so.
    drives: bool,
    /// The motor may be on: no state has said that it is off since it was last driven.
    may_move: bool,
    /// What the device answered to the last order to home, if it refused.
    refused: Option<Outcome>,
    /// States that came though the device should home.
    awake: u32,
    wanted: Option<Wanted>,
    /// A state came that has not been answered with a command.
    owes: bool,
    speed: f64,
    /// When a stop was written that is not confirmed yet.
    stopping: Option<Seconds>,
    stopped: Stopped,
    /// When a burst of stops was written, after which nothing was.
    burst: Option<Seconds>,
    damaged: u64,
    /// The latest state as it was on the wire.
    frame: Option<StateFrame>,
    out: Vec<u8>,
    received: Received,
}

impl Driver {
    /// A driver for a device that is not there yet, of a plant with actions up to ± `limit`; it
    /// is to send a state each `period`.
    #[must_use]
    pub fn new(params: &Params, period: Seconds, limit: f64) -> Self {
        Self {
            params: params.clone(),
            period,
            limit,
            codec: params.format.codec(),
            warden: Warden::new(params.safety.clone(), limit, period),
            tracker: Tracker::new(params.scales.clone(), period),
            stage: Stage::Closed("not opened yet".to_owned()),
            greeting: Greeting::default(),
            since: Seconds(0.0),
            follows: false,
            is_homed: false,
            wants_home: false,
            drives: false,
            may_move: false,
            refused: None,
            awake: 0,
            wanted: None,
            owes: false,
            speed: 0.0,
            stopping: None,
            stopped: Stopped::No,
            burst: None,
            damaged: 0,
            received: Received::default(),
            frame: None,
            out: Vec::new(),
        }
    }

    /// The port is open at `now`: the motor is stopped first, then the device is greeted.
    pub fn opened(&mut self, now: Seconds) {
        self.codec.restart();
        self.out.clear();
        self.warden.forget();
        self.tracker.forget();
        self.frame = None;
        self.stage = Stage::Opening;
        self.is_homed = !self.params.homing;
        self.owes = false;
        self.wants_home = false;
        self.wanted = None;
        self.greeting = Greeting::begin(&self.params, self.period, now);
        self.since = now;
        // The first thing that a greeting says is that the motor stops.
        self.drives = false;
        self.stopped = Stopped::No;
        self.stopping = None;
        self.burst = None;
    }

    /// The port is gone: nothing more can be written, and nothing holds any more.
    pub fn lost(&mut self, why: impl Into<String>) {
        self.stage = Stage::Closed(why.into());
        self.out.clear();
        self.owes = false;
        self.is_homed = false;
        self.warden.forget();
        self.frame = None;
    }

    /// Takes bytes that were read at `now`.
    pub fn read(&mut self, bytes: &[u8], now: Seconds) {
        if matches!(self.stage, Stage::Closed(_)) {
            return;
        }
        self.codec.take(bytes);
        while let Some(heard) = self.codec.hear() {
            match heard {
                Ok(message) => self.hear(message, now),
                Err(refusal) => {
                    self.close(now, &refusal.to_string());
                    return;
                }
            }
        }
        let damaged = self.codec.counts().checksum_errors;
        if self.stage == Stage::Ready {
            (self.damaged..damaged).for_each(|_| self.warden.damaged(now));
        }
        self.damaged = damaged;
    }

    /// Time goes on to `now`.
    pub fn pass(&mut self, now: Seconds) {
        match self.stage {
            // Homing is silent, and a board that homes takes no byte, however long it takes.
            Stage::Closed(_) | Stage::Homing => return,
            Stage::Opening => self.greet(now),
            Stage::Ready => self.warden.pass(now),
        }
        self.heed(now);
    }

    /// What the caller wants from now on.
    pub fn want(&mut self, wanted: Wanted) {
        self.wanted = Some(wanted);
    }

    /// Whether a state came that waits for its command.
    pub const fn owes_command(&self) -> bool {
        self.owes
    }

    /// Writes the one command that the latest state allows, if it was not written yet, and
    /// returns the action that it stands for. A burst of stops is the answer to all states that
    /// waited with it.
    pub fn answer(&mut self, now: Seconds) -> Option<f64> {
        if self.stage != Stage::Ready || !std::mem::take(&mut self.owes) {
            return None;
        }
        let action = self.warden.allow(self.wanted, now);
        self.heed(now);
        if self.has_just_stopped(now) {
            return Some(0.0);
        }
        let command = self.params.scales.command(action / self.limit, self.speed);
        let is_followed =
            self.params.format == Format::Sensorsini31 || self.warden.standing() == Standing::Armed;
        if is_followed {
            self.write(&Order::Command(command));
            self.warden.sent(command.into());
            self.drives = command != 0;
            self.may_move |= self.drives;
        }
        Some(action)
    }

    /// A person arms the motor.
    ///
    /// # Errors
    /// Why it stays off, and what to do first.
    pub fn arm(&mut self, now: Seconds) -> Result<(), NotArmed> {
        match self.stage {
            Stage::Ready if self.is_homed => {}
            Stage::Ready => return Err(NotArmed::NotHomed),
            _ => return Err(NotArmed::NotReady),
        }
        if self.is_driven() {
            return Err(NotArmed::Moving);
        }
        self.warden.arm(now)?;
        self.wanted = None;
        self.wants_home = false;
        self.refused = None;
        self.follows = false;
        self.stopped = Stopped::No;
        self.stopping = None;
        self.write(&Order::Arm { watchdog_ms: self.params.watchdog_ms });
        Ok(())
    }

    /// Stops the motor; it must be armed again.
    pub fn disarm(&mut self, now: Seconds) {
        self.warden.disarm();
        self.stop(now);
    }

    /// The emergency stop.
    pub fn emergency(&mut self, now: Seconds) {
        self.latch(Fault::Stopped, now);
    }

    /// Stops the motor for `fault`, which stays until a person has seen it.
    pub fn latch(&mut self, fault: Fault, now: Seconds) {
        self.warden.latch(fault);
        self.stop(now);
    }

    /// A person has seen what was wrong.
    pub fn clear(&mut self) {
        self.warden.clear();
    }

    /// The device looks for its ends, which moves the plant and cannot be stopped.
    ///
    /// # Errors
    /// When the device is not ready for it.
    pub fn home(&mut self, now: Seconds) -> Result<(), NotArmed> {
        if self.stage != Stage::Ready || self.warden.standing() == Standing::Armed {
            return Err(NotArmed::NotReady);
        }
        // A command that is held would come back when homing ends.
        if self.warden.latest().is_none() || self.is_driven() {
            return Err(NotArmed::Moving);
        }
        self.wants_home = true;
        self.since = now;
        Ok(())
    }

    /// Whether the device holds a command, as far as it says.
    fn is_driven(&self) -> bool {
        self.warden.latest().is_some_and(|seen| seen.held.is_some_and(|held| held != 0))
    }

    /// Homing takes the place of a state's command: two different orders between two states
    /// would be mixed up by the board.
    fn begin_homing(&mut self, now: Seconds) {
        self.write(&Order::Home);
        (self.drives, self.may_move) = (true, true);
        self.wants_home = false;
        self.refused = None;
        self.stage = Stage::Homing;
        self.awake = 0;
        self.since = now;
        self.is_homed = false;
        self.owes = false;
    }

    /// What is to be written to the port now.
    pub fn take_output(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.out)
    }

    /// From now on readings mean this. Not for an armed plant, which would jump.
    pub fn set_scales(&mut self, scales: &scales::Params) {
        self.params.scales = scales.clone();
        self.tracker = Tracker::new(scales.clone(), self.period);
        self.warden.forget();
    }

    /// What became of the bytes so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.codec.counts()
    }

    fn hear(&mut self, message: Message, now: Seconds) {
        match message {
            Message::State(frame) => self.see(&frame, now),
            Message::Homed(_) if self.stage == Stage::Homing => {
                self.is_homed = true;
                self.ready(now);
            }
            Message::NotHomed if self.stage == Stage::Homing => self.ready(now),
            Message::Config(told) if self.stage == Stage::Opening => {
                self.greeting.configured(&told, now);
            }
            Message::Hello(_) if self.stage == Stage::Opening => self.greeting.identified(now),
            // A device that says hello in the middle has started anew.
            Message::Hello(_) if self.stage == Stage::Ready => {
                self.warden.latch(Fault::Reset);
                self.is_homed = !self.params.homing;
                self.stop(now);
            }
            Message::Ack(ack) if ack.outcome != Outcome::Done => self.refuse(ack.outcome, now),
            _ => {}
        }
    }

    /// A state came.
    fn see(&mut self, frame: &StateFrame, now: Seconds) {
        let Some((state, device)) = self.tracker.follow(frame) else {
            self.close(
                now,
                "the device's states have no angle and position: two sensors are needed",
            );
            return;
        };
        if matches!(self.stage, Stage::Opening | Stage::Ready) && frame.command == 0 {
            self.may_move &= self.drives;
        }
        match self.stage {
            Stage::Opening => {
                self.greeting.saw(frame.command == 0 && state.is_finite());
                self.greet(now);
            }
            Stage::Ready => {
                self.frame = Some(*frame);
                let before = self.warden.latest().and_then(|seen| seen.device);
                self.received.count(before, device, self.period);
                if before.is_some_and(|before| device < before) {
                    // It started anew, wherever its cart stood.
                    self.is_homed = !self.params.homing;
                }
                self.speed = state.get(1).copied().unwrap_or(0.0);
                let held = Some(i64::from(frame.command));
                let stopped = self.stopped_itself(frame);
                self.warden.observe(Observation {
                    state,
                    at: now,
                    device: Some(device),
                    held,
                    stopped,
                });
                self.confirm(frame.command, now);
                self.owes = true;
                self.heed(now);
                if self.wants_home && self.owes && frame.command == 0 {
                    self.begin_homing(now);
                }
            }
            Stage::Homing => self.doubt_homing(frame, now),
            Stage::Closed(_) => {}
        }
    }

    /// A device that was asked to home, and whose states go on, never began.
    fn doubt_homing(&mut self, frame: &StateFrame, now: Seconds) {
        let is_homing = frame.flags.is_some_and(|flags| flags.has(Flags::HOMING));
        if !is_homing && now - self.since > HOMING_SHOWS {
            self.awake += 1;
        }
        if self.awake >= NOT_HOMING {
            self.ready(now);
        }
    }

    /// That the device stopped following, and why. What it says before it first followed is
    /// of the time before it was armed.
    fn stopped_itself(&mut self, frame: &StateFrame) -> Option<&'static str> {
        let flags = frame.flags?;
        if self.warden.standing() != Standing::Armed {
            return None;
        }
        let is_armed = flags.has(Flags::ARMED);
        let followed = self.follows;
        self.follows |= is_armed;
        let why = stopped_by(flags).or((!is_armed).then_some("it takes no commands any more"));
        why.filter(|_| followed)
    }

    /// The device holds `command`.
    fn confirm(&mut self, command: i32, now: Seconds) {
        let Some(since) = self.stopping else { return };
        if command == 0 {
            self.stopping = None;
            self.stopped = Stopped::Confirmed;
        } else if (now - since).0 > CONFIRMED_WITHIN * self.period.0 {
            self.stopped = Stopped::Unconfirmed;
            // Once more; a copy of what may be waiting is harmless.
            self.write_stops(now);
            self.owes = false;
        }
    }

    /// An armed plant that was just latched is stopped.
    fn heed(&mut self, now: Seconds) {
        let is_latched = matches!(self.warden.standing(), Standing::Latched(_));
        if is_latched && self.stopping.is_none() && self.stopped == Stopped::No {
            self.stop(now);
        }
        if let Some(since) = self.stopping
            && (now - since).0 > 2.0 * CONFIRMED_WITHIN * self.period.0
        {
            self.stopped = Stopped::Unconfirmed;
        }
    }

    fn stop(&mut self, now: Seconds) {
        // The first thing that a greeting says is that the motor stops; more would only get in
        // its way.
        // A board that homes takes no byte: it is stopped once it is done. And one that is gone
        // gets none.
        if self.stage != Stage::Ready {
            return;
        }
        self.wants_home = false;
        self.write_stops(now);
        self.warden.sent(0);
        self.drives = false;
        self.stopping = Some(now);
        self.stopped = Stopped::Told;
        self.owes = false;
        self.wanted = None;
    }

    /// A burst of stops, if one is not the last word already: more would fill the board's buffer.
    fn write_stops(&mut self, now: Seconds) {
        if !self.has_just_stopped(now) {
            // Whatever else waits would only come before it.
            self.out.clear();
            self.write(&Order::Stop);
            self.burst = Some(now);
        }
    }

    fn ready(&mut self, now: Seconds) {
        self.stage = Stage::Ready;
        self.warden.forget();
        self.tracker.forget();
        self.frame = None;
        self.since = now;
        // Homing leaves the old command behind.
        self.stop(now);
    }

    fn close(&mut self, now: Seconds, why: &str) {
        self.warden.disarm();
        self.stop(now);
        self.stage = Stage::Closed(why.to_owned());
    }

    /// Goes on with the greeting.
    fn greet(&mut self, now: Seconds) {
        match self.greeting.pass(now) {
            Progress::Waits => {}
            Progress::Says(order) => self.write(&order),
            Progress::Refused(why) => self.close(now, why),
            Progress::Done => self.ready(now),
        }
    }

    fn write(&mut self, order: &Order) {
        self.burst = None;
        // What cannot be said is refused by the profile's checks long before.
        let _ = self.codec.encode(order, &mut self.out);
    }
}

#[cfg(test)]
#[path = "driver_tests.rs"]
mod tests;
