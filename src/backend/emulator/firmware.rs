//! The physical-cartpole firmware on its STM32 board, with its defects.
//!
//! Written after the protocol notes on `SensorsINI/physical-cartpole`, not after its source. A
//! host that is tried against a better board than the real one is not tried at all, so this
//! one holds its last command for ever, runs a command with the payload of the next, and so
//! on: each defect is named where it is.
//!
//! Not emulated: `C4` (obeyed by no firmware), `CE` (only the stream goes off) and `D1`
//! (nothing is answered). Where the notes are silent this is a guess: the angle in the
//! potentiometer's gap (it reads its largest), the length of a freeze (45 ms, never 90), a
//! loop of the main program (50 µs), and what a board with destroyed memory does (nothing).

use super::homing::{Ends, Homing, Step};
use super::rig::{Rig, Sensor};
use super::trace::{Event, Kind, Trace, Written};
use super::{Board, Outbox};
use crate::backend::wire::sensorsini31::frames::{Reply, Request, START, checksum, other_layout};
use crate::backend::wire::{Config, Firmware, FirmwareConfig, Readings, StateFrame};

/// The parser's buffer, bytes, which nobody checks.
const BUFFER: usize = 32;
/// What the UART keeps for the main loop, bytes.
const PENDING: usize = 256;
/// The most raw readings that fit into the board's buffer.
const MOST_RAW: u16 = 98;
/// A command towards an end that is closer than this is refused, counts.
const MARGIN: i32 = 20;
/// The ends before calibration, counts from where the cart was at the start.
const UNCALIBRATED: i32 = 2400;
/// Readings this close to 0 may be the potentiometer's gap.
const NEAR_GAP: i32 = 500;
/// A jump of the angle's change by more than this a millisecond of the period freezes it.
const JUMP_PER_MS: f32 = 2.4;
/// How long the angle is guessed after such a jump, µs.
const FREEZE_US: u64 = 45_000;

/// The board.
pub(super) struct Stm32 {
    config: Config,
    firmware: FirmwareConfig,
    counts_per_turn: f32,
    byte_us: f64,
    /// A state's length, if it is another firmware's.
    layout: Option<u8>,
    is_streaming: bool,
    is_controller_on: bool,
    is_crashed: bool,
    target_position_m: f32,
    /// The command that is held, and the one on the motor's pins.
    held: i32,
    applied: i32,
    pending: Vec<u8>,
    buffer: [u8; BUFFER],
    filled: usize,
    homing: Option<Homing>,
    ends: Ends,
    /// The clock's zero, µs; restarts with every period.
    epoch: u64,
    next_tick: u64,
    busy_until: u64,
    last_time_us: u32,
    measured_at: u64,
    latency_10us: Option<u16>,
    angle: i32,
    angle_change: f32,
    frozen_until: u64,
}

impl Stm32 {
    /// A board with power but not started: see [`Board::start`].
    pub(super) fn new(counts_per_turn: f64, baud: u32, layout: Option<u8>) -> Self {
        let firmware = FirmwareConfig {
            sync: true,
            angle_hanging: 1055.5,
            average: 1,
            correct_dynamics: true,
        };
        #[expect(clippy::cast_possible_truncation, reason = "some thousand counts")]
        Self {
            config: Config { period_ms: 20, firmware: None },
            firmware,
            counts_per_turn: counts_per_turn as f32,
            byte_us: 1e7 / f64::from(baud),
            layout,
            is_streaming: false,
            is_controller_on: false,
            is_crashed: false,
            target_position_m: 0.0,
            held: 0,
            applied: 0,
            pending: Vec::new(),
            buffer: [0; BUFFER],
            filled: 0,
            homing: None,
            ends: Ends { direction: 1, middle: 0, reach: UNCALIBRATED },
            epoch: 0,
            next_tick: 0,
            busy_until: 0,
            last_time_us: 0,
            measured_at: 0,
            latency_10us: None,
            angle: 0,
            angle_change: 0.0,
            frozen_until: 0,
        }
    }

    const fn period_us(&self) -> u64 {
        self.config.period_ms as u64 * 1000
    }

    fn position(&self, rig: &Rig) -> i32 {
        rig.read(Sensor::Position)
            .saturating_sub(self.ends.middle)
            .saturating_mul(i32::from(self.ends.direction))
    }

    fn apply(&mut self, command: i32, rig: &mut Rig) {
        self.applied = command;
        rig.drive(command);
    }

    fn crash(&mut self, by: &'static str, trace: &mut Trace) {
        self.is_crashed = true;
        trace.note(Event::Crashed { by });
    }

    /// Sends and waits until it is sent: defect, the main loop does nothing else meanwhile.
    fn say(&mut self, reply: &Reply, kind: Kind, now: u64, out: &mut Outbox) {
        let mut bytes = Vec::new();
        match (reply, self.layout) {
            (Reply::State(state), Some(len)) => other_layout(state, len, &mut bytes),
            _ => reply.encode(&mut bytes),
        }
        #[expect(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "some hundred bytes take some thousand microseconds"
        )]
        let takes = (bytes.len() as f64 * self.byte_us) as u64;
        self.busy_until = now.max(self.busy_until) + takes;
        out.send(kind, bytes);
    }

    /// A control period begins.
    fn tick(&mut self, now: u64, rig: &mut Rig, out: &mut Outbox) {
        while self.next_tick <= now {
            self.next_tick += self.period_us();
        }
        if self.is_controller_on {
            // The compiled controller is a stub: it commands 0, whatever the host says.
            self.held = 0;
        }
        if self.firmware.sync || self.is_controller_on {
            self.apply(self.held, rig);
        }
        let time_us = self.time(now);
        let time_difference = time_us.wrapping_sub(self.last_time_us);
        self.last_time_us = time_us;
        self.measured_at = now;
        self.measure(now, rig);
        let period_10us = u16::try_from(self.period_us() / 10).unwrap_or(u16::MAX);
        let state = StateFrame {
            sensors: Readings::new(&[self.angle, self.position(rig)]).unwrap_or_default(),
            time_us,
            time_difference_us: Some(time_difference),
            command: self.held,
            applied: None,
            flags: None,
            firmware: Some(Firmware {
                angle_change: self.angle_change,
                target_position_m: self.target_position_m,
                // Always 0 with a median of 1.
                invalid_steps: 0,
                latency_10us: self.latency_10us.unwrap_or(period_10us),
                latency_violation: u16::from(self.latency_10us.is_none()),
            }),
        };
        self.latency_10us = None;
        if self.is_streaming {
            self.say(&Reply::State(state), Kind::State, now, out);
        }
    }

    /// The clock's low 32 bits, µs.
    #[expect(clippy::cast_possible_truncation, reason = "it wraps after 71.6 min")]
    const fn time(&self, now: u64) -> u32 {
        now.wrapping_sub(self.epoch) as u32
    }

    /// Reads the angle; defect: near the potentiometer's gap a jump freezes its change, and the
    /// angle is guessed, without a word about it. The reading after a freeze is always taken.
    #[expect(clippy::cast_possible_truncation, reason = "as in the firmware")]
    #[expect(clippy::cast_precision_loss, reason = "some thousand counts")]
    fn measure(&mut self, now: u64, rig: &Rig) {
        let read = self.read_angle(rig);
        let change = self.wrap((read - self.angle) as f32);
        let jump = (change - self.angle_change).abs();
        let is_near = read.abs() < NEAR_GAP || self.angle.abs() < NEAR_GAP;
        let was_frozen = self.frozen_until > 0;
        if now >= self.frozen_until {
            let freezes =
                is_near && !was_frozen && jump > JUMP_PER_MS * f32::from(self.config.period_ms);
            self.frozen_until = if freezes { now + FREEZE_US } else { 0 };
        }
        if self.frozen_until > 0 {
            self.angle = self.wrap(self.angle as f32 + self.angle_change) as i32;
        } else {
            self.angle = read;
            // From the guess before to this reading is no motion of the pole.
            if !was_frozen {
                self.angle_change = change;
            }
        }
    }

    /// The angle's reading, wrapped to half a turn and cut towards 0.
    #[expect(clippy::cast_possible_truncation, reason = "as in the firmware")]
    #[expect(clippy::cast_precision_loss, reason = "some thousand counts")]
    fn read_angle(&self, rig: &Rig) -> i32 {
        self.wrap(rig.read(Sensor::Angle) as f32) as i32
    }

    fn wrap(&self, counts: f32) -> f32 {
        let turn = self.counts_per_turn;
        if counts > turn / 2.0 {
            counts - turn
        } else if counts <= -turn / 2.0 {
            counts + turn
        } else {
            counts
        }
    }

    /// Moves what came into the parser's buffer; defect: without looking whether it fits.
    fn collect(&mut self, trace: &mut Trace) {
        let end = self.filled + self.pending.len();
        if end > BUFFER {
            self.pending.clear();
            return self.crash("more than 32 bytes in the parser's buffer", trace);
        }
        self.buffer[self.filled..end].copy_from_slice(&self.pending);
        self.filled = end;
        self.pending.clear();
    }

    /// Drops bytes from the front; what was there stays in memory beyond the end.
    fn drop_front(&mut self, bytes: usize) {
        self.buffer.copy_within(bytes..self.filled, 0);
        self.filled -= bytes;
    }

    /// The command byte and the payload's length of the next frame, which is already dropped.
    fn parse(&mut self) -> Option<(u8, usize)> {
        loop {
            while self.filled > 0 && self.buffer[0] != START {
                self.drop_front(1);
            }
            if self.filled < 3 {
                return None;
            }
            let len = usize::from(self.buffer[2]);
            if (4..=BUFFER).contains(&len) {
                // Defect: a damaged LEN waits for bytes that are other commands.
                if self.filled < len {
                    return None;
                }
                let frame = &self.buffer[..len];
                if checksum(&frame[..len - 1]) == frame[len - 1] {
                    let code = self.buffer[1];
                    self.drop_front(len);
                    return Some((code, len - 4));
                }
            }
            self.drop_front(1);
        }
    }

    /// Obeys the next command; defect: its payload is read where it was, and there the next
    /// command may be by now.
    fn obey(&mut self, now: u64, rig: &mut Rig, out: &mut Outbox, trace: &mut Trace) {
        let Some((code, len)) = self.parse() else { return };
        // A LEN that the command does not have: dropped without a word.
        let Some(request) = Request::read(code, &self.buffer[3..3 + len]) else { return };
        trace.note(Event::Obeyed { order: Written::Sensorsini31(request) });
        match request {
            Request::Ping => self.say(&Reply::Pong, Kind::Reply, now, out),
            Request::StreamOn(on) => self.is_streaming = on,
            Request::Calibrate => {
                self.homing = Some(Homing::new(now, rig.read(Sensor::Position)));
                trace.note(Event::HomingBegan);
            }
            Request::ControlMode(on) => {
                // Defect: from the host's control it stops nothing.
                if self.is_controller_on && !on {
                    self.held = 0;
                    self.apply(0, rig);
                }
                self.is_controller_on = on;
            }
            Request::GetPidConfig => {
                let gains = [22.0, 1.0, 12.0, 18.0, 38.0, 4.0];
                self.say(&Reply::Pid(gains), Kind::Reply, now, out);
            }
            Request::SetControlConfig(config) => self.configure(config, now, trace),
            Request::GetControlConfig => {
                // Defect: the last byte repeats `sync`.
                let firmware =
                    FirmwareConfig { correct_dynamics: self.firmware.sync, ..self.firmware };
                let config = Config { firmware: Some(firmware), ..self.config };
                self.say(&Reply::Config(config), Kind::Reply, now, out);
            }
            Request::SetMotor(command) => self.set_motor(command, now, rig),
            Request::SetTargetPosition(target) => self.target_position_m = target,
            Request::RunHardwareExperiment => self.is_streaming = false,
            Request::CollectRawAngle { count, .. } if count > MOST_RAW => {
                self.crash("more than 98 raw readings", trace);
            }
            Request::CollectRawAngle { count, interval_us } => {
                self.apply(0, rig);
                self.busy_until = now + u64::from(count) * u64::from(interval_us);
                let reading = u16::try_from(rig.read(Sensor::Angle)).unwrap_or(0);
                let readings = vec![reading; usize::from(count)];
                self.say(&Reply::RawAngles(readings), Kind::Over, now, out);
            }
            Request::SetTargetEquilibrium(_) | Request::TransferBuffers => {}
        }
    }

    /// Defect: nothing is checked.
    fn configure(&mut self, config: Config, now: u64, trace: &mut Trace) {
        let Some(firmware) = config.firmware else { return };
        if config.period_ms == 0 {
            return self.crash("a period of 0 ms", trace);
        }
        if !(1..=32).contains(&firmware.average) {
            return self.crash("a median that its memory has no room for", trace);
        }
        self.config.period_ms = config.period_ms;
        self.firmware = firmware;
        // The timer starts anew: the next time difference is huge.
        self.epoch = now;
        self.next_tick = now + self.period_us();
    }

    /// Defect: the ends are looked at only now, not while the command is held.
    fn set_motor(&mut self, command: i32, now: u64, rig: &mut Rig) {
        let position = self.position(rig);
        let is_outward = (command > 0 && position >= self.ends.reach - MARGIN)
            || (command < 0 && position <= MARGIN - self.ends.reach);
        self.held = if is_outward { 0 } else { command };
        if !self.firmware.sync {
            self.apply(self.held, rig);
        }
        #[expect(clippy::cast_possible_truncation, reason = "it wraps after 655 ms")]
        let latency_10us = ((now - self.measured_at) / 10) as u16;
        self.latency_10us = Some(latency_10us);
    }

    /// Defect: the interrupts are off. Nothing is heard, said or checked until it is over.
    fn home(&mut self, now: u64, rig: &mut Rig, out: &mut Outbox, trace: &mut Trace) {
        // About one byte survives.
        self.pending.truncate(1);
        let Some(homing) = &mut self.homing else { return };
        match homing.step(now, rig.read(Sensor::Position)) {
            Step::Drive(duty) => {
                let command = super::duty_command(duty, rig);
                if command != self.applied {
                    self.apply(command, rig);
                }
            }
            Step::Done(ends) => {
                self.homing = None;
                self.ends = ends;
                self.apply(0, rig);
                trace.note(Event::HomingEnded { found: true });
                self.say(&Reply::Calibrated(ends.direction), Kind::Over, now, out);
                // Defect: the held command is not cleared, and acts again in a period.
                self.next_tick = now + self.period_us();
            }
        }
    }
}

impl Board for Stm32 {
    fn start(&mut self, now: u64, rig: &mut Rig, _out: &mut Outbox) {
        let turn = f64::from(self.counts_per_turn);
        let baud = 1e7 / self.byte_us;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a baud rate")]
        let fresh = Self::new(turn, baud.round() as u32, self.layout);
        *self = Self { epoch: now, measured_at: now, next_tick: now + 20_000, ..fresh };
        self.ends.middle = rig.read(Sensor::Position);
        self.apply(0, rig);
        self.angle = self.read_angle(rig);
    }

    fn receive(&mut self, byte: u8) {
        if self.pending.len() < PENDING && !self.is_crashed {
            self.pending.push(byte);
        }
    }

    fn turn(&mut self, now: u64, rig: &mut Rig, out: &mut Outbox, trace: &mut Trace) {
        if self.is_crashed || now < self.busy_until {
            return;
        }
        if self.homing.is_some() {
            self.home(now, rig, out, trace);
        } else if now >= self.next_tick {
            self.tick(now, rig, out);
        } else {
            self.collect(trace);
            if !self.is_crashed {
                self.obey(now, rig, out, trace);
            }
        }
    }

    fn command(&self) -> i32 {
        self.applied
    }

    fn set_clock(&mut self, now: u64, time_us: u32) {
        // The clock shows `now - epoch`.
        self.epoch = now.wrapping_sub(u64::from(time_us));
        self.last_time_us = time_us;
    }
}
