//! A device without hardware: a board, its wire and the plant behind it.
//!
//! [`Emulator::advance`] is a pure function of time, bytes and a seed: tests run it on virtual
//! time, and `coadapt emulate` in real time on a pseudo-terminal. Bytes take as long as they
//! do at the baud rate. What goes wrong is in [`faults`]; what the host must not do is found
//! by [`oracle`].

mod bench;
mod firmware;

pub mod faults;
pub mod hand;
pub mod homing;
pub mod line;
pub mod oracle;
#[cfg(unix)]
pub mod port;
pub mod rig;
pub mod trace;

use std::collections::VecDeque;

use super::wire::cobs1::frames::{Deframer, Piece};
use super::wire::{Baud, Format, cobs1, sensorsini31};
use crate::random::{Place, Purpose, stream};
use crate::signal::{Seconds, State};
use faults::{Fault, Faults};
use hand::Hand;
use line::Line;
use oracle::{Offence, Oracle};
use rig::Rig;
use sensorsini31::frames::{Request, START, checksum};
use trace::{Entry, Event, Kind, Trace, Written};

/// The board's main loop turns once in this time, µs.
const TURN_US: u64 = 50;

/// An emulated device's parameters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Params {
    /// What it speaks, and with that which board it is.
    pub format: Format,
    /// The wire's speed.
    pub baud: Baud,
    /// What hangs at its pins.
    pub rig: rig::Params,
    /// What the device's clock shows at the start, µs; it wraps at 2³².
    pub clock_us: u32,
}

/// A board: what its main loop does.
trait Board: Send {
    /// It starts, or starts anew.
    fn start(&mut self, now: u64, rig: &mut Rig, out: &mut Outbox);
    /// A byte has arrived.
    fn receive(&mut self, byte: u8);
    /// The main loop turns once, at `now`, µs.
    fn turn(&mut self, now: u64, rig: &mut Rig, out: &mut Outbox, trace: &mut Trace);
    /// The command on the motor's pins.
    fn command(&self) -> i32;
    /// Its clock shows `time_us` now.
    fn set_clock(&mut self, now: u64, time_us: u32);
}

/// What a board has sent in one turn.
#[derive(Default)]
struct Outbox(Vec<(Kind, Vec<u8>)>);

impl Outbox {
    fn send(&mut self, kind: Kind, bytes: Vec<u8>) {
        self.0.push((kind, bytes));
    }
}

/// The command for a share of full duty.
fn duty_command(duty: f64, rig: &Rig) -> i32 {
    #[expect(clippy::cast_possible_truncation, reason = "a share of a command")]
    let command = (duty * f64::from(rig.full_scale())) as i32;
    command
}

/// A device under way.
pub struct Emulator {
    now_us: u64,
    board: Box<dyn Board>,
    rig: Rig,
    to_device: Line,
    to_host: Line,
    /// What is on its way to the host, and when its last byte is through.
    announced: VecDeque<(Seconds, Kind)>,
    garbage_at_connect: u32,
    events: VecDeque<faults::Timed>,
    unplugged_until: Seconds,
    ear: Ear,
    oracle: Option<Oracle>,
    offences: Vec<(Seconds, Offence)>,
    trace: Trace,
    command: i32,
}

impl Emulator {
    /// A device that starts at time 0. `seed` is for the noise of its wire and its plant.
    #[must_use]
    pub fn new(params: &Params, faults: &Faults, seed: u64) -> Self {
        let place = |phase| Place { phase, ..Place::default() };
        let line = |noise: &faults::Noise, phase| {
            Line::new(params.baud.0, noise.clone(), stream(seed, Purpose::Wire, place(phase)))
        };
        let mut events = faults.events.clone();
        events.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        let rig = Rig::new(&params.rig, seed);
        let (board, oracle): (Box<dyn Board>, _) = match params.format {
            Format::Sensorsini31 => {
                let layout = faults.version.map(|len| len.to_le_bytes()[0]);
                let turn = params.rig.angle.counts_per_turn;
                let board = firmware::Stm32::new(turn, params.baud.0, layout);
                (Box::new(board), Some(Oracle::new(rig.full_scale(), params.baud.0)))
            }
            Format::Cobs1 => {
                (Box::new(bench::Bench::new(faults.version.unwrap_or(cobs1::VERSION))), None)
            }
        };
        let mut emulator = Self {
            now_us: 0,
            board,
            rig,
            to_device: line(&faults.to_device, 1),
            to_host: line(&faults.to_host, 2),
            announced: VecDeque::new(),
            garbage_at_connect: faults.garbage_at_connect,
            events: events.into(),
            unplugged_until: Seconds(0.0),
            ear: Ear::new(params.format),
            oracle,
            offences: Vec::new(),
            trace: Trace::default(),
            command: 0,
        };
        emulator.start();
        emulator.board.set_clock(0, params.clock_us);
        emulator
    }

    /// Takes what the host wrote, lets time pass up to `to`, and returns what reached the
    /// host meanwhile.
    pub fn advance(&mut self, to: Seconds, written: &[u8]) -> Vec<u8> {
        let mut read = Vec::new();
        self.write(written);
        while self.now() + micros(TURN_US) <= to {
            self.now_us += TURN_US;
            let now = self.now();
            self.trace.at(now);
            self.misbehave();
            self.rig.go(now);
            while let Some(byte) = self.to_device.receive(now) {
                self.board.receive(byte);
            }
            let mut out = Outbox::default();
            self.board.turn(self.now_us, &mut self.rig, &mut out, &mut self.trace);
            self.send(out);
            self.note_motor();
            while let Some(byte) = self.to_host.receive(now) {
                read.push(byte);
            }
            self.announce();
            self.judge();
        }
        read
    }

    /// A host opens the port.
    pub fn connect(&mut self) {
        self.to_host.send_garbage(self.garbage_at_connect, self.now());
    }

    /// A person does something to the plant by hand. False where the motor does not let them.
    pub fn hand(&mut self, hand: Hand) -> bool {
        let is_done = self.rig.handle(hand);
        if is_done {
            self.trace.note(Event::Hand { hand });
        }
        is_done
    }

    /// A person pulls the cable, and puts it back after `time`.
    pub fn pull(&mut self, time: Seconds) {
        self.trace.note(Event::Fault { fault: Fault::Unplug { for_s: time.0 } });
        self.unplug(self.now() + time);
    }

    /// The time since the start.
    #[must_use]
    pub fn now(&self) -> Seconds {
        micros(self.now_us)
    }

    /// Whether the cable is in.
    #[must_use]
    pub fn is_plugged(&self) -> bool {
        self.now() >= self.unplugged_until
    }

    /// The command on the motor's pins.
    #[must_use]
    pub fn command(&self) -> i32 {
        self.board.command()
    }

    /// The plant's true state.
    #[must_use]
    pub const fn state(&self) -> State {
        self.rig.state()
    }

    /// Somebody moves the plant by hand to `state`.
    #[cfg(test)]
    pub(crate) fn put(&mut self, state: State) {
        self.rig.put(state);
    }

    /// What happened since this was last asked.
    pub fn take_trace(&mut self) -> Vec<Entry> {
        self.trace.take()
    }

    /// All that the host did and must never do.
    #[must_use]
    pub fn offences(&self) -> &[(Seconds, Offence)] {
        &self.offences
    }

    fn write(&mut self, bytes: &[u8]) {
        if bytes.is_empty() || !self.is_plugged() {
            return;
        }
        self.to_device.send(bytes, self.now());
        if let Some(oracle) = &mut self.oracle {
            let offences = oracle.bytes(bytes, micros(self.now_us));
            self.accuse(offences);
        }
        for order in self.ear.hear(bytes) {
            self.trace.note(Event::Written { order });
        }
        self.judge();
    }

    /// Lets the oracle see what happened since it last looked.
    fn judge(&mut self) {
        while let Some(entry) = self.trace.next_to_judge() {
            let offences = self.oracle.as_mut().map(|oracle| oracle.see(&entry));
            self.accuse(offences.unwrap_or_default());
        }
    }

    fn accuse(&mut self, offences: Vec<Offence>) {
        for offence in offences {
            self.offences.push((self.now(), offence));
            self.trace.note(Event::Forbidden { offence });
        }
    }

    fn start(&mut self) {
        let mut out = Outbox::default();
        self.board.start(self.now_us, &mut self.rig, &mut out);
        self.trace.note(Event::Started);
        self.send(out);
    }

    fn send(&mut self, out: Outbox) {
        for (kind, bytes) in out.0 {
            if self.is_plugged() {
                let through = self.to_host.send(&bytes, self.now());
                self.announced.push_back((through, kind));
            }
        }
    }

    /// Notes the messages whose last byte has reached the host.
    fn announce(&mut self) {
        let now = self.now();
        while let Some((_, message)) =
            self.announced.pop_front_if(|(through, _)| self.to_host.is_through(*through, now))
        {
            self.trace.note(Event::Delivered { message });
        }
    }

    fn note_motor(&mut self) {
        let command = self.board.command();
        if command != self.command {
            self.command = command;
            let duty = f64::from(command) / f64::from(self.rig.full_scale());
            self.trace.note(Event::Motor { command, duty });
        }
    }

    /// The faults whose time has come.
    fn misbehave(&mut self) {
        let now = self.now();
        if let Some(faults::Timed { what, .. }) =
            self.events.pop_front_if(|timed| Seconds(timed.at_s) <= now)
        {
            self.trace.note(Event::Fault { fault: what.clone() });
            match what {
                Fault::Stall { for_s } => self.to_host.stall(now + Seconds(for_s)),
                Fault::Reset => self.start(),
                Fault::Unplug { for_s } => self.unplug(now + Seconds(for_s)),
                Fault::Stuck { sensor, for_s } => self.rig.stick(sensor, Seconds(for_s)),
                Fault::Jump { sensor, counts } => self.rig.jump(sensor, counts),
                Fault::Garbage { bytes } => self.to_host.send_garbage(bytes, now),
                Fault::Estop { for_s } => self.rig.press(Seconds(for_s)),
            }
        }
    }

    /// The board keeps its supply and goes on.
    fn unplug(&mut self, until: Seconds) {
        self.to_host.cut();
        self.to_device.cut();
        self.announced.clear();
        self.unplugged_until = until;
    }
}

const fn micros(us: u64) -> Seconds {
    #[expect(clippy::cast_precision_loss, reason = "2^53 µs are 285 years")]
    Seconds(us as f64 * 1e-6)
}

/// Understands what the host writes, as it should be understood.
struct Ear {
    format: Format,
    bytes: Vec<u8>,
    deframer: Deframer,
}

impl Ear {
    fn new(format: Format) -> Self {
        Self { format, bytes: Vec::new(), deframer: Deframer::default() }
    }

    fn hear(&mut self, bytes: &[u8]) -> Vec<Written> {
        match self.format {
            Format::Sensorsini31 => {
                self.bytes.extend_from_slice(bytes);
                std::iter::from_fn(|| self.next_sensorsini31()).collect()
            }
            Format::Cobs1 => {
                self.deframer.take(bytes);
                let piece = std::iter::from_fn(|| self.deframer.piece());
                piece.filter_map(cobs1_order).collect()
            }
        }
    }

    fn next_sensorsini31(&mut self) -> Option<Written> {
        loop {
            let start = self.bytes.iter().position(|byte| *byte == START)?;
            self.bytes.drain(..start);
            let len = usize::from(*self.bytes.get(2)?);
            if (4..=32).contains(&len) {
                let frame = self.bytes.get(..len)?;
                if checksum(&frame[..len - 1]) == frame[len - 1] {
                    let unknown = Written::Unknown { code: frame[1] };
                    let order = Request::decode(frame).map_or(unknown, Written::Sensorsini31);
                    self.bytes.drain(..len);
                    return Some(order);
                }
            }
            self.bytes.drain(..1);
        }
    }
}

fn cobs1_order(piece: Piece) -> Option<Written> {
    let Piece::Good(frame, _) = piece else { return None };
    let unknown = Written::Unknown { code: frame.kind() };
    Some(cobs1::frames::Request::decode(&frame).map_or(unknown, Written::Cobs1))
}

#[cfg(test)]
mod tests;
