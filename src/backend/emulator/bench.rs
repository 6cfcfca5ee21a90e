//! A well-behaved board that speaks `cobs1`, as `docs/SERIAL-PROTOCOL.md` asks of one.

use super::homing::{Homing, Step};
use super::rig::{Rig, Sensor};
use super::trace::{Event, Kind, Trace, Written};
use super::{Board, Outbox};
use crate::backend::wire::cobs1::frames::{Deframer, Frame, Piece, Reply, Request, after};
use crate::backend::wire::cobs1::{LONGEST_WATCHDOG_MS, PERIODS_MS};
use crate::backend::wire::{Ack, Flags, Hello, Outcome, Readings, StateFrame};

/// Homing that takes longer has failed, µs.
const HOMING_US: u64 = 30_000_000;
/// The watchdog's time where the host names none, periods.
const WATCHDOG_PERIODS: u16 = 5;

#[derive(Clone, Debug)]
enum Mode {
    Disarmed,
    Homing { run: Homing, since: u64 },
    Armed,
}

/// The board.
pub(super) struct Bench {
    /// The version it says it has.
    version: u16,
    mode: Mode,
    period_ms: u16,
    watchdog_ms: u16,
    is_streaming: bool,
    is_homed: bool,
    latched: Flags,
    command: i32,
    applied: u8,
    commanded_at: u64,
    number: u8,
    epoch: u64,
    next_state: u64,
    middle: i32,
    direction: i32,
    deframer: Deframer,
}

impl Bench {
    /// A board with power but not started: see [`Board::start`].
    pub(super) fn new(version: u16) -> Self {
        Self {
            version,
            mode: Mode::Disarmed,
            period_ms: 20,
            watchdog_ms: 100,
            is_streaming: false,
            is_homed: false,
            latched: Flags::default(),
            command: 0,
            applied: 0,
            commanded_at: 0,
            number: 0,
            epoch: 0,
            next_state: 0,
            middle: 0,
            direction: 1,
            deframer: Deframer::default(),
        }
    }

    fn say(&mut self, reply: &Reply, kind: Kind, out: &mut Outbox) {
        self.number = after(self.number);
        let mut bytes = Vec::new();
        reply.encode(self.number, &mut bytes);
        out.send(kind, bytes);
    }

    fn ack(&mut self, of: u8, outcome: Outcome, out: &mut Outbox) {
        self.say(&Reply::Ack(Ack { of, outcome }), Kind::Reply, out);
    }

    fn hello(&mut self, rig: &Rig, out: &mut Outbox) {
        let hello = Hello {
            sensors: 2,
            period_ms: self.period_ms,
            watchdog_ms: self.watchdog_ms,
            full_scale: rig.full_scale(),
            name: Hello::named("emulated"),
        };
        self.say(&Reply::Hello { version: self.version, hello }, Kind::Reply, out);
    }

    fn default_watchdog_ms(&self) -> u16 {
        (WATCHDOG_PERIODS * self.period_ms).min(LONGEST_WATCHDOG_MS)
    }

    fn drive(&mut self, command: i32, rig: &mut Rig) {
        if command != self.command {
            self.command = command;
            rig.drive(command);
        }
    }

    fn disarm(&mut self, rig: &mut Rig, trace: &mut Trace) {
        self.drive(0, rig);
        match self.mode {
            Mode::Disarmed => {}
            Mode::Homing { .. } => {
                self.is_homed = false;
                trace.note(Event::HomingEnded { found: false });
            }
            Mode::Armed => trace.note(Event::Disarmed),
        }
        self.mode = Mode::Disarmed;
    }

    fn obey(
        &mut self,
        frame: &Frame,
        now: u64,
        rig: &mut Rig,
        out: &mut Outbox,
        trace: &mut Trace,
    ) {
        let of = frame.number();
        let request = match Request::decode(frame) {
            Ok(request) => request,
            Err(outcome) => return self.ack(of, outcome, out),
        };
        trace.note(Event::Obeyed { order: Written::Cobs1(request) });
        let is_disarmed = matches!(self.mode, Mode::Disarmed);
        let outcome = match request {
            Request::Query => return self.hello(rig, out),
            Request::Command(command) => {
                if matches!(self.mode, Mode::Armed) {
                    let full = rig.full_scale();
                    self.drive(inward(command.clamp(-full, full), rig), rig);
                    self.applied = of;
                    self.commanded_at = now;
                }
                return;
            }
            Request::Ping => Outcome::Done,
            Request::Stream(on) => {
                self.is_streaming = on;
                Outcome::Done
            }
            Request::Disarm if matches!(self.mode, Mode::Homing { .. }) => Outcome::Busy,
            Request::Stop | Request::Disarm => {
                self.disarm(rig, trace);
                self.applied = of;
                Outcome::Done
            }
            Request::Home | Request::Config { .. } if !is_disarmed => Outcome::Busy,
            Request::Home if rig.is_pressed() => Outcome::Estop,
            Request::Home => {
                let run = Homing::new(now, rig.read(Sensor::Position));
                self.mode = Mode::Homing { run, since: now };
                self.is_homed = false;
                trace.note(Event::HomingBegan);
                Outcome::Done
            }
            Request::Config { period_ms } if !PERIODS_MS.contains(&period_ms) => Outcome::BadValue,
            Request::Config { period_ms } => {
                self.period_ms = period_ms;
                self.watchdog_ms = self.default_watchdog_ms();
                Outcome::Done
            }
            Request::Arm { version, watchdog_ms } => {
                self.arm(version, watchdog_ms, now, rig, trace)
            }
        };
        self.ack(of, outcome, out);
    }

    fn arm(
        &mut self,
        version: u16,
        watchdog_ms: u16,
        now: u64,
        rig: &Rig,
        trace: &mut Trace,
    ) -> Outcome {
        let wanted = if watchdog_ms == 0 { self.default_watchdog_ms() } else { watchdog_ms };
        let is_allowed = (2 * self.period_ms..=LONGEST_WATCHDOG_MS).contains(&wanted);
        match self.mode {
            Mode::Homing { .. } => return Outcome::Busy,
            _ if version != self.version => return Outcome::WrongVersion,
            _ if !self.is_homed => return Outcome::NotHomed,
            _ if !is_allowed => return Outcome::BadValue,
            _ if rig.is_pressed() => return Outcome::Estop,
            Mode::Disarmed => trace.note(Event::Armed),
            Mode::Armed => {}
        }
        self.watchdog_ms = wanted;
        self.latched = self.latched.with(Flags::WATCHDOG, false).with(Flags::SENSOR_FAULT, false);
        self.commanded_at = now;
        self.mode = Mode::Armed;
        Outcome::Done
    }

    fn home(&mut self, now: u64, rig: &mut Rig, out: &mut Outbox, trace: &mut Trace) {
        let Mode::Homing { run, since } = &mut self.mode else { return };
        if now > *since + HOMING_US {
            self.disarm(rig, trace);
            return self.say(&Reply::Homed(0), Kind::Over, out);
        }
        match run.step(now, rig.read(Sensor::Position)) {
            Step::Drive(duty) => self.drive(super::duty_command(duty, rig), rig),
            Step::Done(ends) => {
                self.mode = Mode::Disarmed;
                self.drive(0, rig);
                (self.middle, self.direction) = (ends.middle, i32::from(ends.direction));
                self.is_homed = true;
                trace.note(Event::HomingEnded { found: true });
                self.say(&Reply::Homed(ends.direction), Kind::Over, out);
            }
        }
    }

    fn state(&self, now: u64, rig: &Rig) -> StateFrame {
        let (left, right) = rig.switches();
        let flags = self
            .latched
            .with(Flags::ARMED, matches!(self.mode, Mode::Armed))
            .with(Flags::HOMED, self.is_homed)
            .with(Flags::HOMING, matches!(self.mode, Mode::Homing { .. }))
            .with(Flags::LIMIT_LEFT, left)
            .with(Flags::LIMIT_RIGHT, right)
            .with(Flags::ESTOP, rig.is_pressed());
        let position = (rig.read(Sensor::Position) - self.middle) * self.direction;
        #[expect(clippy::cast_possible_truncation, reason = "it wraps after 71.6 min")]
        let time_us = now.wrapping_sub(self.epoch) as u32;
        StateFrame {
            sensors: Readings::new(&[rig.read(Sensor::Angle), position]).unwrap_or_default(),
            time_us,
            time_difference_us: None,
            command: self.command,
            applied: Some(self.applied),
            flags: Some(flags),
            firmware: None,
        }
    }
}

impl Board for Bench {
    fn start(&mut self, now: u64, rig: &mut Rig, out: &mut Outbox) {
        *self = Self { epoch: now, next_state: now, ..Self::new(self.version) };
        self.middle = rig.read(Sensor::Position);
        rig.drive(0);
        out.send(Kind::Reply, vec![0]);
        self.hello(rig, out);
    }

    fn receive(&mut self, byte: u8) {
        self.deframer.take(&[byte]);
    }

    fn turn(&mut self, now: u64, rig: &mut Rig, out: &mut Outbox, trace: &mut Trace) {
        while let Some(piece) = self.deframer.piece() {
            match piece {
                Piece::Good(frame, _) => self.obey(&frame, now, rig, out, trace),
                Piece::Damaged(_) | Piece::Overlong(_) => {
                    self.latched = self.latched.with(Flags::CRC_ERRORS_SEEN, true);
                }
            }
        }
        let patience = u64::from(self.watchdog_ms) * 1000;
        if matches!(self.mode, Mode::Armed) && now > self.commanded_at + patience {
            trace.note(Event::Watchdog);
            self.disarm(rig, trace);
            self.latched = self.latched.with(Flags::WATCHDOG, true);
        }
        if rig.is_pressed() {
            self.disarm(rig, trace);
        }
        self.home(now, rig, out, trace);
        if matches!(self.mode, Mode::Armed) {
            self.drive(inward(self.command, rig), rig);
        }
        while self.next_state <= now {
            self.next_state += u64::from(self.period_ms) * 1000;
            if self.is_streaming {
                let state = self.state(now, rig);
                self.say(&Reply::State(state), Kind::State, out);
            }
        }
    }

    fn command(&self) -> i32 {
        self.command
    }

    fn set_clock(&mut self, now: u64, time_us: u32) {
        self.epoch = now.wrapping_sub(u64::from(time_us));
    }
}

/// `command`, but nothing outward at a pressed switch.
fn inward(command: i32, rig: &Rig) -> i32 {
    match rig.switches() {
        (true, _) if command < 0 => 0,
        (_, true) if command > 0 => 0,
        _ => command,
    }
}
