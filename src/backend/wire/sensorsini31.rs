//! The wire format of the physical-cartpole firmware with states of 31 bytes.
//!
//! Source: the protocol notes on github `SensorsINI/physical-cartpole`, master `d658274`
//! (2024-09-14); `tests/data/wire/` holds their frames. A frame is `AA`, command, LEN of the
//! whole frame, payload, CRC-8/MAXIM. Nothing is escaped, numbered or acknowledged, so a reader
//! looks for a known header, waits for LEN bytes, and drops **one** byte whenever something
//! does not fit: a true frame can lie within a false one.
//!
//! # What a host must know
//!
//! - The board holds the last motor command for ever, and checks the track's ends only when a
//!   command arrives.
//! - Two different frames that wait together run with each other's payload: send one command
//!   per state. Copies of one frame are safe; [`Order::Stop`] is three of them, 24 bytes, the
//!   most that may wait.
//! - While it homes it is deaf, and its old command comes back afterwards: stop before and
//!   after.
//! - Stray bytes follow the replies to [`Order::Query`]; they are skipped and counted.
//! - The replies `CA` (no checksum) and `D1` (a length of 32 bits) are never asked for. If
//!   they come they are skipped byte by byte, so that no length in them can hold up a state.

pub mod frames;

use super::{Codec, Config, Counts, Message, Order, Refusal, Unsendable};
use frames::{Reply, Request, START, STATE, STATE_LEN, checksum};

/// The control periods that the firmware can keep, ms: a state of 31 bytes takes 1.35 ms, and
/// beyond 59 ms its timer changes its step.
pub const PERIODS_MS: std::ops::RangeInclusive<u16> = 2..=50;
/// The lengths of states that other firmwares sent.
const OTHER_LAYOUTS: [u8; 7] = [11, 17, 19, 20, 25, 27, 35];
/// How often a stop is said in one burst.
const STOPS: usize = 3;
/// The factory firmware's telemetry: `$`, three floats, 13.
const FACTORY_LEN: usize = 14;
/// So many of its messages in a row are no chance.
const FACTORY_RUN: usize = 3;

/// Whose states are `len` bytes long, for people.
#[must_use]
pub fn whose(len: u8) -> &'static str {
    match len {
        11 => "of 2019",
        17 => "of 2021-12 to 2023-09 (ICRA 2023)",
        19 | 20 => "of late 2021",
        25 => "of 2023-09",
        27 => "of 2023-10 to 2024-07 (IROS 2024)",
        35 => "of 2024-01-01",
        _ => "an unknown one",
    }
}

/// The host's end.
#[derive(Clone, Debug, Default)]
pub struct Host {
    /// Bytes of no message yet; those before `read` are done with.
    bytes: Vec<u8>,
    read: usize,
    /// The number of bytes ever done with.
    position: u64,
    counts: Counts,
    /// Where the last whole state of another layout ended, and its length.
    strange: Option<(u64, u8)>,
    factory: Factory,
}

impl Codec for Host {
    fn take(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.read);
        self.read = 0;
        self.bytes.extend_from_slice(bytes);
    }

    fn hear(&mut self) -> Option<Result<Message, Refusal>> {
        loop {
            let waiting = &self.bytes[self.read..];
            match look(waiting) {
                Look::More => return None,
                Look::Message(message, len) => {
                    self.counts.good += 1;
                    self.factory = Factory::default();
                    self.advance(len);
                    return Some(Ok(message));
                }
                Look::OtherLayout(len) => {
                    let follows = self.strange == Some((self.position, len));
                    self.strange = Some((self.position + u64::from(len), len));
                    self.skip();
                    // A single one may be chance; two that touch are not.
                    if follows {
                        return Some(Err(Refusal::OtherLayout { len }));
                    }
                }
                Look::Wrong { checksum } => {
                    self.counts.checksum_errors += u64::from(checksum);
                    if self.skip() {
                        return Some(Err(Refusal::Factory));
                    }
                }
            }
        }
    }

    fn encode(&mut self, order: &Order, out: &mut Vec<u8>) -> Result<Option<u8>, Unsendable> {
        match *order {
            Order::Command(command) => Request::SetMotor(command).encode(out),
            Order::Stop => (0..STOPS).for_each(|_| Request::SetMotor(0).encode(out)),
            Order::Stream(on) => Request::StreamOn(on).encode(out),
            Order::Home => Request::Calibrate.encode(out),
            Order::Configure(config) => {
                check(&config)?;
                Request::SetControlConfig(config).encode(out);
            }
            Order::Query => Request::GetControlConfig.encode(out),
            // The firmware has no arming and no watchdog.
            Order::Arm { .. } => {}
            Order::Disarm => Request::ControlMode(false).encode(out),
            Order::Ping => Request::Ping.encode(out),
        }
        Ok(None)
    }

    fn counts(&self) -> Counts {
        self.counts
    }

    fn restart(&mut self) {
        *self = Self { counts: self.counts, ..Self::default() };
    }
}

impl Host {
    fn advance(&mut self, bytes: usize) {
        self.read += bytes;
        self.position += bytes as u64;
    }

    /// Drops one byte; whether the dropped ones are the factory firmware's.
    fn skip(&mut self) -> bool {
        let byte = self.bytes[self.read];
        self.counts.skipped += 1;
        self.advance(1);
        self.factory.take(byte)
    }
}

/// What the first bytes that wait are.
enum Look {
    /// Perhaps the beginning of a message.
    More,
    /// A message of this many bytes.
    Message(Message, usize),
    /// A whole state of another firmware.
    OtherLayout(u8),
    /// No message begins with the first byte; `checksum`: it would, but for the checksum.
    Wrong { checksum: bool },
}

fn look(waiting: &[u8]) -> Look {
    const NOTHING: Look = Look::Wrong { checksum: false };
    match waiting {
        [] | [START] => return Look::More,
        [START, ..] => {}
        _ => return NOTHING,
    }
    let expected = match waiting[1] {
        0xC0 => 4,
        0xC2 => 5,
        0xC5 => 28,
        0xC7 => 14,
        0xCE => 6,
        STATE => STATE_LEN,
        _ => return NOTHING,
    };
    let Some(&len) = waiting.get(2) else { return Look::More };
    let is_other = waiting[1] == STATE && OTHER_LAYOUTS.contains(&len);
    if len != expected && !is_other {
        return NOTHING;
    }
    let size = usize::from(len);
    let Some(frame) = waiting.get(..size) else { return Look::More };
    if checksum(&frame[..size - 1]) != frame[size - 1] {
        return Look::Wrong { checksum: !is_other };
    }
    if is_other {
        return Look::OtherLayout(len);
    }
    Reply::decode(frame)
        .as_ref()
        .and_then(message)
        .map_or(NOTHING, |message| Look::Message(message, size))
}

fn message(reply: &Reply) -> Option<Message> {
    match reply {
        Reply::Pong => Some(Message::Pong),
        Reply::State(state) => Some(Message::State(*state)),
        Reply::Calibrated(direction) => Some(Message::Homed(*direction)),
        Reply::Pid(gains) => Some(Message::Gains(*gains)),
        Reply::Config(config) => Some(Message::Config(*config)),
        Reply::Experiment(samples) => Some(Message::Experiment(*samples)),
        Reply::RawAngles(_) => None,
    }
}

/// The firmware checks nothing: a period of 0 stops it, a long median destroys its memory.
fn check(config: &Config) -> Result<(), Unsendable> {
    let firmware = config.firmware.ok_or(Unsendable::NoFirmwareConfig)?;
    if !PERIODS_MS.contains(&config.period_ms) {
        let (least, most) = (*PERIODS_MS.start(), *PERIODS_MS.end());
        return Err(Unsendable::Period { given: config.period_ms, least, most });
    }
    if !(1..=32).contains(&firmware.average) {
        return Err(Unsendable::Average(firmware.average));
    }
    if !(0.0..=4400.0).contains(&firmware.angle_hanging) {
        return Err(Unsendable::AngleHanging(firmware.angle_hanging));
    }
    Ok(())
}

/// Looks for the factory firmware's telemetry among skipped bytes: a `$` at every 14th byte, a
/// 13 before the next, and three finite floats between of which the last is 0.
#[derive(Clone, Copy, Debug, Default)]
struct Factory {
    message: [u8; FACTORY_LEN],
    filled: usize,
    run: usize,
}

impl Factory {
    /// Takes a skipped byte; whether it completes the third message in a row.
    fn take(&mut self, byte: u8) -> bool {
        self.message[self.filled] = byte;
        self.filled += 1;
        while self.filled > 0 && self.message[0] != b'$' {
            self.slip();
        }
        if self.filled < FACTORY_LEN {
            return false;
        }
        if !is_factory(&self.message) {
            self.slip();
            return false;
        }
        self.filled = 0;
        self.run += 1;
        self.run >= FACTORY_RUN
    }

    /// Drops the oldest byte: the run is over.
    fn slip(&mut self) {
        self.message.copy_within(1.., 0);
        self.filled -= 1;
        self.run = 0;
    }
}

fn is_factory(message: &[u8; FACTORY_LEN]) -> bool {
    let mut f = super::Fields(&message[1..]);
    let mut finite = || f.f32().filter(|float| float.is_finite());
    let floats = (finite(), finite(), finite());
    matches!(floats, (Some(_), Some(_), Some(0.0))) && message[FACTORY_LEN - 1] == 13
}

#[cfg(test)]
#[path = "sensorsini31_tests.rs"]
mod tests;
