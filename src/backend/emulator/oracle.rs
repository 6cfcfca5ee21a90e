//! What a host must never do, judged by what it wrote and what it could know.

use serde::Serialize;

use super::trace::{Entry, Event, Kind, Written};
use crate::backend::wire::sensorsini31::frames::{Request, SET_PID_CONFIG};
use crate::signal::Seconds;

/// The most bytes that may be under way to the firmware, whose buffer holds 32.
pub const MOST_OUTSTANDING: usize = 24;
/// The largest share of full duty.
pub const MOST_DUTY: f64 = 0.95;
/// Two different commands keep this distance while no states come.
const DISTANCE: Seconds = Seconds(0.003);
/// A board that was asked to home and has not begun for so long never got the order.
const HOMING_SHOWS: Seconds = Seconds(0.1);

/// What a host must never do to the physical-cartpole firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Offence {
    /// Two different commands without a state or an answer between them: the first may run
    /// with the second's payload.
    TwoCommands,
    /// More than [`MOST_OUTSTANDING`] bytes under way: they may overrun the buffer.
    TooManyBytes,
    /// Bytes while the board is deaf.
    WhileDeaf,
    /// More than [`MOST_DUTY`].
    Duty,
    /// The setting of the gains, which waits in the buffer and is never obeyed.
    SetPid,
}

/// Judges a host of the physical-cartpole firmware. A `cobs1` device looks after itself: there
/// is nothing that a host could do to it.
#[derive(Clone, Debug, Default)]
pub struct Oracle {
    full_scale: i32,
    /// The last command, and when it was written.
    last: Option<(Seconds, Written)>,
    /// The device has said something since.
    is_answered: bool,
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
    /// A judge over a board whose motor is fully driven by `full_scale`.
    #[must_use]
    pub fn new(full_scale: i32) -> Self {
        Self { full_scale, ..Self::default() }
    }

    /// Judges the bytes of one write at `now`: `outstanding` are under way with them.
    pub fn bytes(&mut self, outstanding: usize, now: Seconds) -> Vec<Offence> {
        let mut offences = Vec::new();
        let is_asked = self.deaf.is_some_and(|since| now < since + HOMING_SHOWS);
        if is_asked || self.is_homing {
            offences.push(Offence::WhileDeaf);
        }
        if outstanding > MOST_OUTSTANDING {
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
                    Event::Started => *self = Self::new(self.full_scale),
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
    fn is_too_soon(&self, order: Written, now: Seconds) -> bool {
        const STOP: Written = Written::Sensorsini31(Request::SetMotor(0));
        let Some((at, last)) = self.last.filter(|_| !self.is_answered) else { return false };
        let is_motor = matches!(last, Written::Sensorsini31(Request::SetMotor(_)));
        let is_safe = order == last || (order == STOP && is_motor);
        !is_safe && (self.stream == Stream::Running || now < at + DISTANCE)
    }

    fn delivered(&mut self, message: Kind) {
        self.is_answered = true;
        match message {
            Kind::State if self.stream == Stream::Stopped => {}
            Kind::State => self.stream = Stream::Running,
            Kind::Over => self.deaf = None,
            Kind::Reply => {}
        }
    }
}
