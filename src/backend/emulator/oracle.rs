//! What a host must never do, judged by what it wrote and what it could know.

use serde::Serialize;

use super::faults::Fault;
use super::trace::{Entry, Event, Kind, Written};
use crate::backend::wire::on_the_wire;
use crate::backend::wire::sensorsini31::frames::{Request, SET_PID_CONFIG};
use crate::signal::Seconds;

/// The most bytes that may be under way to the firmware, whose buffer holds 32.
pub const MOST_OUTSTANDING: usize = 24;
/// With a burst of stops, which may follow a motor command at once: an emergency does not wait.
pub const MOST_WITH_STOPS: usize = 32;
/// The largest share of full duty.
pub const MOST_DUTY: f64 = 0.95;
/// Two different commands keep this distance if the device says nothing between them: it is
/// never busy for longer.
const DISTANCE: Seconds = Seconds(0.003);
/// So many commands a late host may have in store: one for the state that it answers late, and
/// one for the next.
const STORE: u32 = 2;
/// A board that was asked to home and has not begun for so long never got the order.
const HOMING_SHOWS: Seconds = Seconds(0.1);

/// What a host must never do to the physical-cartpole firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum Offence {
    /// More different commands than states, or two that are close without a state or an answer
    /// between them: the first may run with the second's payload.
    #[error("two different commands without a state between them")]
    TwoCommands,
    /// More than [`MOST_OUTSTANDING`] bytes under way: they may overrun the buffer.
    #[error("more than 24 bytes under way")]
    TooManyBytes,
    /// Bytes while the board is deaf.
    #[error("bytes while the board homes or measures")]
    WhileDeaf,
    /// More than [`MOST_DUTY`].
    #[error("more than 95 % duty")]
    Duty,
    /// The setting of the gains, which waits in the buffer and is never obeyed.
    #[error("SET_PID_CONFIG, which no firmware obeys")]
    SetPid,
}

/// Judges a host of the physical-cartpole firmware. A `cobs1` device looks after itself: there
/// is nothing that a host could do to it.
#[derive(Clone, Debug, Default)]
pub struct Oracle {
    full_scale: i32,
    baud: u32,
    /// When all that was written would be through on a line that holds nothing up: of delays the
    /// host knows nothing.
    through: Seconds,
    /// The last command, and when it was written.
    last: Option<(Seconds, Written)>,
    /// The device has said something since.
    is_answered: bool,
    /// States that no command has answered yet, at most [`STORE`].
    unanswered: u32,
    stream: Stream,
    /// When the board was asked to do what makes it deaf.
    deaf: Option<Seconds>,
    /// It has begun.
    is_homing: bool,
}

/// What the host knows of the stream.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Stream {
    /// No state came yet.
    #[default]
    Awaited,
    /// States come.
    Running,
    /// It was asked to stop; what still comes was under way.
    Stopped,
}

impl Oracle {
    /// A judge over a board at `baud` whose motor is fully driven by `full_scale`.
    #[must_use]
    pub fn new(full_scale: i32, baud: u32) -> Self {
        Self { full_scale, baud, ..Self::default() }
    }

    /// Judges the bytes `written` at once at `now`.
    pub fn bytes(&mut self, written: &[u8], now: Seconds) -> Vec<Offence> {
        let mut offences = Vec::new();
        let start = if self.through > now { self.through } else { now };
        self.through = start + on_the_wire(written.len(), self.baud);
        let outstanding = self.through - now;
        let is_asked = self.deaf.is_some_and(|since| now < since + HOMING_SHOWS);
        if is_asked || self.is_homing {
            offences.push(Offence::WhileDeaf);
        }
        let most = if end_in_stops(written) { MOST_WITH_STOPS } else { MOST_OUTSTANDING };
        // Half a byte more than the most is none.
        if outstanding > on_the_wire(2 * most + 1, self.baud) * 0.5 {
            offences.push(Offence::TooManyBytes);
        }
        offences
    }

    /// Takes notice of what happened, and judges it.
    pub fn see(&mut self, entry: &Entry) -> Vec<Offence> {
        let now = Seconds(entry.at_s);
        match &entry.event {
            Event::Written { order } => self.written(*order, now),
            other => {
                match other {
                    Event::Delivered { message } => self.delivered(*message),
                    Event::HomingBegan => self.is_homing = true,
                    Event::HomingEnded { .. } => self.is_homing = false,
                    // Whoever comes after a pulled cable begins anew, too.
                    Event::Started | Event::Fault { fault: Fault::Unplug { .. } } => {
                        let fresh = Self::new(self.full_scale, self.baud);
                        *self = Self { through: self.through, ..fresh };
                    }
                    _ => {}
                }
                Vec::new()
            }
        }
    }

    fn written(&mut self, order: Written, now: Seconds) -> Vec<Offence> {
        let mut offences = Vec::new();
        if self.is_too_soon(order, now) {
            offences.push(Offence::TwoCommands);
        }
        match order {
            Written::Unknown { code: SET_PID_CONFIG } => offences.push(Offence::SetPid),
            Written::Sensorsini31(Request::SetMotor(command))
                if f64::from(command).abs() > MOST_DUTY * f64::from(self.full_scale) =>
            {
                offences.push(Offence::Duty);
            }
            Written::Sensorsini31(Request::StreamOn(on)) => {
                self.stream = if on { Stream::Awaited } else { Stream::Stopped };
            }
            Written::Sensorsini31(Request::Calibrate | Request::CollectRawAngle { .. }) => {
                self.deaf = Some(now);
                self.stream = Stream::Awaited;
            }
            _ => {}
        }
        self.last = Some((now, order));
        self.is_answered = false;
        offences
    }

    /// Whether `order` may meet another one in the board's buffer. Copies of one frame are
    /// safe, and a stop is safe after any motor command.
    fn is_too_soon(&mut self, order: Written, now: Seconds) -> bool {
        const STOP: Written = Written::Sensorsini31(Request::SetMotor(0));
        let Some((at, last)) = self.last else { return false };
        let is_motor = matches!(last, Written::Sensorsini31(Request::SetMotor(_)));
        if order == last || (order == STOP && is_motor) {
            return false;
        }
        let is_close = !self.is_answered && now < at + DISTANCE;
        let is_one_too_many = self.stream == Stream::Running && self.unanswered == 0;
        self.unanswered = self.unanswered.saturating_sub(1);
        is_close || is_one_too_many
    }

    fn delivered(&mut self, message: Kind) {
        self.is_answered = true;
        self.unanswered = STORE.min(self.unanswered + 1);
        match message {
            Kind::State if self.stream == Stream::Stopped => {}
            Kind::State => self.stream = Stream::Running,
            Kind::Over => self.deaf = None,
            Kind::Reply => {}
        }
    }
}

/// Whether these are stops and nothing else, but for one motor command before them, which an
/// emulator that looks late reads together with them.
fn end_in_stops(written: &[u8]) -> bool {
    let mut stop = Vec::new();
    Request::SetMotor(0).encode(&mut stop);
    let mut frames = written.chunks(stop.len());
    let is_command = frames.next().is_some_and(|first| first.starts_with(&stop[..3]));
    is_command && frames.all(|frame| frame == stop)
}
