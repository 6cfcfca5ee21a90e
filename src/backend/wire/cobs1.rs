//! coadapt's own wire format, for the boards that a lab builds itself.
//!
//! `docs/SERIAL-PROTOCOL.md` is its whole description, with the device's side; its frames are
//! checked against this module. Frames are numbered both ways, orders are acknowledged, and a
//! device stops by itself when commands stay away.

pub mod frames;

use super::{Codec, Counts, Message, Order, Refusal, Unsendable};
use frames::{Deframer, Frame, Piece, Reply, Request, after, missing};

/// The version of this description.
pub const VERSION: u16 = 1;
/// The control periods that a device takes, ms.
pub const PERIODS_MS: std::ops::RangeInclusive<u16> = 2..=100;
/// The longest time that a device may go on without a command, ms.
pub const LONGEST_WATCHDOG_MS: u16 = 250;
/// How often a stop is said in one burst.
const STOPS: usize = 3;

/// The host's end.
#[derive(Clone, Debug, Default)]
pub struct Host {
    deframer: Deframer,
    counts: Counts,
    /// The number of the last order.
    sent: u8,
    /// The number of the device's last frame.
    heard: Option<u8>,
}

impl Codec for Host {
    fn take(&mut self, bytes: &[u8]) {
        self.deframer.take(bytes);
    }

    fn hear(&mut self) -> Option<Result<Message, Refusal>> {
        loop {
            match self.deframer.piece()? {
                Piece::Good(frame, len) => match self.understand(&frame) {
                    Some(heard) => return Some(heard),
                    // A later version's message, or a payload that does not fit.
                    None => self.counts.skipped += len as u64,
                },
                Piece::Damaged(len) => {
                    self.counts.checksum_errors += 1;
                    self.counts.skipped += len as u64;
                }
                Piece::Overlong(len) => self.counts.skipped += len as u64,
            }
        }
    }

    fn encode(&mut self, order: &Order, out: &mut Vec<u8>) -> Result<Option<u8>, Unsendable> {
        let request = match *order {
            Order::Command(command) => Request::Command(command),
            Order::Stop => {
                for _ in 1..STOPS {
                    self.send(Request::Stop, out);
                }
                Request::Stop
            }
            Order::Stream(on) => Request::Stream(on),
            Order::Home => Request::Home,
            Order::Configure(config) => {
                if !PERIODS_MS.contains(&config.period_ms) {
                    let (least, most) = (*PERIODS_MS.start(), *PERIODS_MS.end());
                    return Err(Unsendable::Period { given: config.period_ms, least, most });
                }
                Request::Config { period_ms: config.period_ms }
            }
            Order::Query => Request::Query,
            Order::Arm { watchdog_ms } if watchdog_ms > LONGEST_WATCHDOG_MS => {
                return Err(Unsendable::Watchdog(watchdog_ms));
            }
            Order::Arm { watchdog_ms } => Request::Arm { version: VERSION, watchdog_ms },
            Order::Disarm => Request::Disarm,
            Order::Ping => Request::Ping,
        };
        Ok(Some(self.send(request, out)))
    }

    fn counts(&self) -> Counts {
        self.counts
    }

    fn restart(&mut self) {
        *self = Self { counts: self.counts, sent: self.sent, ..Self::default() };
    }
}

impl Host {
    fn send(&mut self, request: Request, out: &mut Vec<u8>) -> u8 {
        self.sent = after(self.sent);
        request.encode(self.sent, out);
        self.sent
    }

    fn understand(&mut self, frame: &Frame) -> Option<Result<Message, Refusal>> {
        let reply = Reply::decode(frame);
        // A device that has just started counts from 1 again.
        let restarts = matches!(reply, Some(Reply::Hello { .. }));
        if let Some(heard) = self.heard.filter(|_| !restarts) {
            self.counts.lost += u64::from(missing(heard, frame.number()));
        }
        self.heard = Some(frame.number());
        let message = match reply? {
            Reply::Hello { version, .. } if version != VERSION => {
                return Some(Err(Refusal::Version { seen: version }));
            }
            Reply::Hello { hello, .. } => Message::Hello(hello),
            Reply::State(state) => Message::State(state),
            Reply::Ack(ack) => Message::Ack(ack),
            Reply::Homed(0) => Message::NotHomed,
            Reply::Homed(direction) => Message::Homed(direction),
        };
        self.counts.good += 1;
        Some(Ok(message))
    }
}

#[cfg(test)]
#[path = "cobs1_tests.rs"]
mod tests;
