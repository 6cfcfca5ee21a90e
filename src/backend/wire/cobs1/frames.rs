//! `cobs1`'s frames: type, number, payload, CRC-16, stuffed so that 0 only ends a frame.

use crc::{CRC_16_IBM_3740, Crc};
use serde::Serialize;

use super::super::{Ack, Fields, Flags, Hello, MOST_SENSORS, Outcome, Readings, StateFrame};

/// The checksum over type, number and payload; also known as CRC-16/CCITT-FALSE.
const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);
/// The longest body, bytes: type, number, payload and checksum.
pub const LONGEST_BODY: usize = 64;
/// The longest frame without its delimiter: one byte of stuffing serves up to 254 bytes.
pub const LONGEST: usize = LONGEST_BODY + 1;
/// What a frame has besides its payload: type, number, checksum.
const OVERHEAD: usize = 4;

/// What a host says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Request {
    /// Who are you? Answered by [`Reply::Hello`].
    Query,
    /// The time between two states, ms.
    Config {
        /// 2 to 100.
        period_ms: u16,
    },
    /// Send states, or stop.
    Stream(bool),
    /// Look for the ends of the track.
    Home,
    /// Follow commands.
    Arm {
        /// The host's version.
        version: u16,
        /// The watchdog's time, ms; 0: the device's default.
        watchdog_ms: u16,
    },
    /// Follow no commands any more.
    Disarm,
    /// Drive the motor; also the sign of life.
    Command(i32),
    /// Stop everything, at any time.
    Stop,
    /// Answer with an acknowledgement.
    Ping,
}

impl Request {
    /// The type byte.
    #[must_use]
    pub const fn kind(&self) -> u8 {
        match self {
            Self::Query => 0x10,
            Self::Config { .. } => 0x11,
            Self::Stream(_) => 0x12,
            Self::Home => 0x13,
            Self::Arm { .. } => 0x14,
            Self::Disarm => 0x15,
            Self::Command(_) => 0x16,
            Self::Stop => 0x17,
            Self::Ping => 0x18,
        }
    }

    /// Appends the frame with the number `number`, delimiter included.
    pub fn encode(&self, number: u8, out: &mut Vec<u8>) {
        let mut body = Body::new(self.kind(), number);
        match self {
            Self::Query | Self::Home | Self::Disarm | Self::Stop | Self::Ping => {}
            Self::Config { period_ms } => body.put(&period_ms.to_le_bytes()),
            Self::Stream(on) => body.put(&[u8::from(*on)]),
            Self::Arm { version, watchdog_ms } => {
                body.put(&version.to_le_bytes());
                body.put(&watchdog_ms.to_le_bytes());
            }
            Self::Command(command) => body.put(&command.to_le_bytes()),
        }
        body.send(out);
    }

    /// What `frame` says.
    ///
    /// # Errors
    /// The outcome to acknowledge it with: the type is unknown, or the payload does not fit.
    pub fn decode(frame: &Frame) -> Result<Self, Outcome> {
        let mut f = Fields(frame.payload());
        let request = match frame.kind() {
            0x10 => Some(Self::Query),
            0x11 => f.u16().map(|period_ms| Self::Config { period_ms }),
            0x12 => f.flag().map(Self::Stream),
            0x13 => Some(Self::Home),
            0x14 => f
                .u16()
                .and_then(|version| f.u16().map(|watchdog_ms| Self::Arm { version, watchdog_ms })),
            0x15 => Some(Self::Disarm),
            0x16 => f.i32().map(Self::Command),
            0x17 => Some(Self::Stop),
            0x18 => Some(Self::Ping),
            _ => return Err(Outcome::Unknown),
        };
        request.and_then(|request| f.end(request)).ok_or(Outcome::BadValue)
    }
}

/// What a device says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reply {
    /// Who it is, unasked after every start.
    Hello {
        /// The device's version.
        version: u16,
        /// The rest, as of version 1.
        hello: Hello,
    },
    /// The plant's state.
    State(StateFrame),
    /// What became of an order.
    Ack(Ack),
    /// Homing has ended: +1 or −1, the encoder's sense; 0, it failed.
    Homed(i8),
}

impl Reply {
    /// The type byte.
    #[must_use]
    pub const fn kind(&self) -> u8 {
        match self {
            Self::Hello { .. } => 0x81,
            Self::State(_) => 0x82,
            Self::Ack(_) => 0x83,
            Self::Homed(_) => 0x84,
        }
    }

    /// Appends the frame with the number `number`, delimiter included.
    pub fn encode(&self, number: u8, out: &mut Vec<u8>) {
        let mut body = Body::new(self.kind(), number);
        match self {
            Self::Hello { version, hello } => {
                body.put(&version.to_le_bytes());
                body.put(&[hello.sensors]);
                body.put(&hello.period_ms.to_le_bytes());
                body.put(&hello.watchdog_ms.to_le_bytes());
                body.put(&hello.full_scale.to_le_bytes());
                body.put(&hello.name);
            }
            Self::State(state) => {
                body.put(&state.time_us.to_le_bytes());
                for reading in state.sensors.iter() {
                    body.put(&reading.to_le_bytes());
                }
                body.put(&state.command.to_le_bytes());
                body.put(&[state.applied.unwrap_or(0)]);
                body.put(&state.flags.unwrap_or_default().0.to_le_bytes());
            }
            Self::Ack(ack) => body.put(&[ack.of, ack.outcome as u8]),
            Self::Homed(direction) => body.put(&direction.to_le_bytes()),
        }
        body.send(out);
    }

    /// What `frame` says, or `None` when the type is unknown or the payload does not fit. Of
    /// another version's hello only the version is read.
    #[must_use]
    pub fn decode(frame: &Frame) -> Option<Self> {
        let mut f = Fields(frame.payload());
        match frame.kind() {
            0x81 => {
                let version = f.u16()?;
                if version != super::VERSION {
                    return Some(Self::Hello { version, hello: Hello::default() });
                }
                let hello = hello(&mut f)?;
                f.end(Self::Hello { version, hello })
            }
            0x82 => {
                let state = state(&mut f)?;
                f.end(Self::State(state))
            }
            0x83 => {
                let (of, outcome) = (f.u8()?, usize::from(f.u8()?));
                // A later device may know more reasons to refuse.
                let outcome = Outcome::ALL.get(outcome).copied().unwrap_or(Outcome::Unknown);
                f.end(Self::Ack(Ack { of, outcome }))
            }
            0x84 => {
                let direction = f.u8()?.cast_signed();
                f.end(Self::Homed(direction))
            }
            _ => None,
        }
    }
}

fn hello(f: &mut Fields<'_>) -> Option<Hello> {
    Some(Hello {
        sensors: f.u8()?,
        period_ms: f.u16()?,
        watchdog_ms: f.u16()?,
        full_scale: f.i32()?,
        name: f.take()?,
    })
}

/// The number of sensors is what the length leaves room for.
fn state(f: &mut Fields<'_>) -> Option<StateFrame> {
    const REST: usize = 11;
    let room = f.0.len().checked_sub(REST)?;
    if room % 4 != 0 || room / 4 > MOST_SENSORS {
        return None;
    }
    let time_us = f.u32()?;
    let mut readings = [0; MOST_SENSORS];
    let readings = &mut readings[..room / 4];
    for reading in readings.iter_mut() {
        *reading = f.i32()?;
    }
    Some(StateFrame {
        sensors: Readings::new(readings)?,
        time_us,
        time_difference_us: None,
        command: f.i32()?,
        applied: Some(f.u8()?),
        flags: Some(Flags(f.u16()?)),
        firmware: None,
    })
}

/// A frame under construction.
struct Body {
    bytes: [u8; LONGEST_BODY],
    len: usize,
}

impl Body {
    fn new(kind: u8, number: u8) -> Self {
        let mut body = Self { bytes: [0; LONGEST_BODY], len: 0 };
        body.put(&[kind, number]);
        body
    }

    fn put(&mut self, field: &[u8]) {
        self.bytes[self.len..self.len + field.len()].copy_from_slice(field);
        self.len += field.len();
    }

    fn send(mut self, out: &mut Vec<u8>) {
        let crc = CRC.checksum(&self.bytes[..self.len]);
        self.put(&crc.to_le_bytes());
        let mut stuffed = [0; LONGEST];
        let len = cobs::encode(&self.bytes[..self.len], &mut stuffed);
        out.extend_from_slice(&stuffed[..len]);
        out.push(0);
    }
}

/// A whole frame with a right checksum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    body: [u8; LONGEST],
    len: usize,
}

impl Frame {
    /// The frame in `stuffed`, which has no delimiter.
    fn open(stuffed: &[u8]) -> Option<Self> {
        let mut body = [0; LONGEST];
        body.get_mut(..stuffed.len())?.copy_from_slice(stuffed);
        let len = cobs::decode_in_place(&mut body[..stuffed.len()]).ok()?;
        if len < OVERHEAD {
            return None;
        }
        let (told, crc) = body[..len].split_last_chunk::<2>()?;
        (CRC.checksum(told) == u16::from_le_bytes(*crc)).then_some(Self { body, len })
    }

    /// The type.
    #[must_use]
    pub const fn kind(&self) -> u8 {
        self.body[0]
    }

    /// The sender's number, 1 to 255.
    #[must_use]
    pub const fn number(&self) -> u8 {
        self.body[1]
    }

    /// The payload.
    #[must_use]
    pub fn payload(&self) -> &[u8] {
        &self.body[2..self.len - 2]
    }
}

/// Cuts bytes into frames.
#[derive(Clone, Debug, Default)]
pub struct Deframer {
    bytes: Vec<u8>,
    read: usize,
    /// The frame under way is longer than any; what came of it is done with.
    is_overlong: bool,
}

/// What lay between two delimiters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Piece {
    /// A frame, and its bytes on the wire, delimiter included.
    Good(Frame, usize),
    /// So many bytes of a damaged frame, delimiter included.
    Damaged(usize),
    /// So many bytes of what is too long for a frame.
    Overlong(usize),
}

impl Deframer {
    /// Takes bytes as they came.
    pub fn take(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.read);
        self.read = 0;
        self.bytes.extend_from_slice(bytes);
    }

    /// What comes next among the bytes taken so far; delimiters alone are nothing.
    pub fn piece(&mut self) -> Option<Piece> {
        loop {
            let waiting = &self.bytes[self.read..];
            let end = waiting.iter().position(|byte| *byte == 0);
            let len = end.map_or(waiting.len(), |end| end + 1);
            let is_overlong = self.is_overlong || end.unwrap_or(len) > LONGEST;
            let piece = match end {
                _ if is_overlong && len > 0 => Some(Piece::Overlong(len)),
                None => return None,
                Some(0) => None,
                Some(end) => {
                    let good = |frame| Piece::Good(frame, len);
                    Some(Frame::open(&waiting[..end]).map_or(Piece::Damaged(len), good))
                }
            };
            self.read += len;
            self.is_overlong = is_overlong && end.is_none();
            if piece.is_some() {
                return piece;
            }
        }
    }
}

/// The number after `number`: 255 is followed by 1, as 0 means none.
#[must_use]
pub const fn after(number: u8) -> u8 {
    if number == u8::MAX { 1 } else { number + 1 }
}

/// How many numbers lie between two that follow each other, `before` and `now`; of the same
/// number twice none.
#[must_use]
pub const fn missing(before: u8, now: u8) -> u8 {
    let ring = u8::MAX as u16;
    let steps = (now as u16 + ring - before as u16) % ring;
    #[expect(clippy::cast_possible_truncation, reason = "less than 255")]
    let missing = steps.saturating_sub(1) as u8;
    missing
}
