//! What a plant's device and this program say to each other over a wire.
//!
//! A [`Codec`] is the host's end of one wire format: bytes in, [`Message`]s out; [`Order`]s
//! in, bytes out. It does no I/O and reads no clock. Numbers stay as they are on the wire:
//! counts, ticks and microseconds; whoever knows the plant scales them.
//!
//! A message that a codec hands out was whole and its checksum was right. Whether its numbers
//! make sense for the plant, such as a cart beyond its track, is for the caller to judge; a
//! checksum of 8 bits lets one in 256 chance frames pass, and a float in one may be NaN.
//!
//! | format | device | numbered | acknowledged | the device's watchdog |
//! | --- | --- | --- | --- | --- |
//! | [`sensorsini31`] | the physical-cartpole firmware, 2024-07 and later | no | no | none |
//! | [`cobs1`] | anything a lab builds itself: `docs/SERIAL-PROTOCOL.md` | yes | yes | latched |

pub mod cobs1;
pub mod sensorsini31;

use serde::{Deserialize, Serialize};

use crate::check::{Check, Checker};
use crate::signal::Seconds;

/// A wire format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// The physical-cartpole firmware's.
    #[default]
    Sensorsini31,
    /// coadapt's own.
    Cobs1,
}

impl Format {
    /// The host's end of this format.
    #[must_use]
    pub fn codec(self) -> Box<dyn Codec> {
        match self {
            Self::Sensorsini31 => Box::<sensorsini31::Host>::default(),
            Self::Cobs1 => Box::<cobs1::Host>::default(),
        }
    }
}

/// The host's end of a wire format.
pub trait Codec: Send {
    /// Takes bytes as they came, in pieces of any size.
    fn take(&mut self, bytes: &[u8]);

    /// The next message of the bytes taken so far, or `None` when more bytes are needed.
    ///
    /// # Errors
    /// When the device is one that this format cannot drive. The codec goes on after it: the
    /// bytes of the strange message are skipped.
    fn hear(&mut self) -> Option<Result<Message, Refusal>>;

    /// Appends the bytes of `order` to `out`, and returns the number that the order carries
    /// if the format numbers them. What a format has no words for, such as arming a device
    /// that cannot be disarmed, takes no bytes.
    ///
    /// # Errors
    /// When the device would do harm or nothing with it; `out` is left as it was.
    fn encode(&mut self, order: &Order, out: &mut Vec<u8>) -> Result<Option<u8>, Unsendable>;

    /// What became of the bytes so far.
    fn counts(&self) -> Counts;

    /// Forgets half a message and the peer's numbers, as after a new connection. The counts
    /// go on.
    fn restart(&mut self);
}

/// What became of the bytes that a device sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Messages that were whole and right.
    pub good: u64,
    /// Messages that were damaged: their checksum or their stuffing was wrong.
    pub checksum_errors: u64,
    /// Bytes that belonged to no good message.
    pub skipped: u64,
    /// Messages that never came, by their numbers; 0 where a format has none.
    pub lost: u64,
}

/// What a device says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Message {
    /// The plant's state.
    State(StateFrame),
    /// Homing has ended: +1, the encoder counts up where the motor pushes forward; −1, it
    /// counted down, and the device turns the sign.
    Homed(i8),
    /// Homing found no ends.
    NotHomed,
    /// The device's configuration.
    Config(Config),
    /// Who the device is.
    Hello(Hello),
    /// What became of an order.
    Ack(Ack),
    /// The device is there.
    Pong,
    /// The device's own PID gains: position P, I, D, then angle P, I, D.
    Gains([f32; 6]),
    /// The device's own experiment has ended with so many samples.
    Experiment(u16),
}

/// The most sensors of a device.
pub const MOST_SENSORS: usize = 8;

/// Up to [`MOST_SENSORS`] raw readings; behaves like a slice of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Readings {
    values: [i32; MOST_SENSORS],
    len: usize,
}

impl Readings {
    /// These readings, or `None` when they are more than [`MOST_SENSORS`].
    #[must_use]
    pub fn new(readings: &[i32]) -> Option<Self> {
        let mut values = [0; MOST_SENSORS];
        values.get_mut(..readings.len())?.copy_from_slice(readings);
        Some(Self { values, len: readings.len() })
    }
}

impl std::ops::Deref for Readings {
    type Target = [i32];
    fn deref(&self) -> &[i32] {
        &self.values[..self.len]
    }
}

/// A state as it was on the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StateFrame {
    /// The sensors' readings, counts: the angle, then the position.
    pub sensors: Readings,
    /// The device's clock at the measurement, µs; wraps at 2³².
    pub time_us: u32,
    /// The time since the measurement before, µs, if the device tells.
    pub time_difference_us: Option<u32>,
    /// The motor command that the device now holds, its unit. [`sensorsini31`] keeps its low
    /// 16 bits only.
    pub command: i32,
    /// The number of the order that set that command, if orders are numbered; 0: none did.
    pub applied: Option<u8>,
    /// What the device says of itself, if it does.
    pub flags: Option<Flags>,
    /// What only the [`sensorsini31`] firmware tells.
    pub firmware: Option<Firmware>,
}

/// The part of a state that only the physical-cartpole firmware tells.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Firmware {
    /// The angle's change, counts per control period.
    pub angle_change: f32,
    /// The target of the controllers on the board, m.
    pub target_position_m: f32,
    /// Jumps among the averaged angle readings.
    pub invalid_steps: u8,
    /// From the measurement to the motor command, units of 10 µs; wraps at 2¹⁶.
    pub latency_10us: u16,
    /// 1: no motor command came since the last state.
    pub latency_violation: u16,
}

/// What a [`cobs1`] device says of itself; the bits of the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags(pub u16);

impl Flags {
    /// The motor follows commands.
    pub const ARMED: Self = Self(1);
    /// The encoder's zero is known.
    pub const HOMED: Self = Self(1 << 1);
    /// Commands stayed away while armed: latched until the next arming.
    pub const WATCHDOG: Self = Self(1 << 2);
    /// The switch at the negative end is pressed.
    pub const LIMIT_LEFT: Self = Self(1 << 3);
    /// The switch at the positive end is pressed.
    pub const LIMIT_RIGHT: Self = Self(1 << 4);
    /// The emergency stop is pressed.
    pub const ESTOP: Self = Self(1 << 5);
    /// A sensor does not answer or makes no sense: latched until the next arming.
    pub const SENSOR_FAULT: Self = Self(1 << 6);
    /// The device has received damaged frames since it started.
    pub const CRC_ERRORS_SEEN: Self = Self(1 << 7);
    /// The device is looking for its ends.
    pub const HOMING: Self = Self(1 << 8);

    /// Whether all of `flags` are set.
    #[must_use]
    pub const fn has(self, flags: Self) -> bool {
        self.0 & flags.0 == flags.0
    }

    /// These flags with `flags` set or cleared.
    #[must_use]
    pub const fn with(self, flags: Self, set: bool) -> Self {
        Self(if set { self.0 | flags.0 } else { self.0 & !flags.0 })
    }
}

/// Who a device is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hello {
    /// The number of sensors in its states.
    pub sensors: u8,
    /// The time between two states, ms.
    pub period_ms: u16,
    /// The watchdog's time, ms.
    pub watchdog_ms: u16,
    /// The command that drives the motor fully.
    pub full_scale: i32,
    /// Its name, UTF-8, filled up with zeros.
    pub name: [u8; 16],
}

impl Hello {
    /// The device's name, for people.
    #[must_use]
    pub fn name(&self) -> String {
        let end = self.name.iter().position(|byte| *byte == 0).unwrap_or(self.name.len());
        String::from_utf8_lossy(&self.name[..end]).into_owned()
    }

    /// The field for `name`, cut to what fits.
    #[must_use]
    pub fn named(name: &str) -> [u8; 16] {
        let mut field = [0; 16];
        let mut end = name.len().min(field.len());
        while !name.is_char_boundary(end) {
            end -= 1;
        }
        field[..end].copy_from_slice(&name.as_bytes()[..end]);
        field
    }
}

/// What became of an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ack {
    /// The order's number.
    pub of: u8,
    /// What became of it.
    pub outcome: Outcome,
}

/// What a device answers to an order; the numbers of the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Done, or begun.
    #[error("done")]
    Done = 0,
    /// The host speaks another version.
    #[error("the device speaks another version of the format: re-flash it or update coadapt")]
    WrongVersion = 1,
    /// The device does not know its zero.
    #[error("the device is not homed: home it first")]
    NotHomed = 2,
    /// A value is outside what the device allows.
    #[error("a value is outside what the device allows")]
    BadValue = 3,
    /// The device is armed or homing.
    #[error("the device is busy: disarm it or let it end homing first")]
    Busy = 4,
    /// The emergency stop is pressed.
    #[error("the emergency stop is pressed: release it first")]
    Estop = 5,
    /// A sensor does not answer.
    #[error("a sensor does not answer: look at its cable")]
    SensorFault = 6,
    /// The device has no such order.
    #[error("the device does not know this order")]
    Unknown = 7,
}

impl Outcome {
    /// Every outcome, in the order of its number.
    pub const ALL: [Self; 8] = [
        Self::Done,
        Self::WrongVersion,
        Self::NotHomed,
        Self::BadValue,
        Self::Busy,
        Self::Estop,
        Self::SensorFault,
        Self::Unknown,
    ];
}

/// What a host asks of a device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Drive the motor with this command, the device's unit.
    Command(i32),
    /// Stop the motor, several times over; always allowed.
    Stop,
    /// Send states, or stop sending them.
    Stream(bool),
    /// Look for the ends of the track, which moves the plant.
    Home,
    /// Set the period, and how the angle is measured.
    Configure(Config),
    /// Tell the configuration, or who you are.
    Query,
    /// Follow commands, and stop when none comes for this long, ms; 0: the device's default.
    Arm {
        /// The watchdog's time, ms.
        watchdog_ms: u16,
    },
    /// Follow no commands any more. [`sensorsini31`]: the board's own controllers leave the
    /// motor to the host; this stops no motor.
    Disarm,
    /// Answer.
    Ping,
}

/// A device's configuration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Config {
    /// The control period, ms.
    pub period_ms: u16,
    /// How the angle is measured and commands are applied; only [`sensorsini31`] has this.
    pub firmware: Option<FirmwareConfig>,
}

/// The part of a configuration that only the physical-cartpole firmware has.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FirmwareConfig {
    /// Commands act at the start of the next period, not at once.
    pub sync: bool,
    /// The angle's reading when the pole hangs at rest, counts.
    pub angle_hanging: f32,
    /// The number of readings whose median is the angle.
    pub average: u16,
    /// The board's own controllers make up for the motor's friction. A reply repeats `sync`
    /// here: see [`sensorsini31`].
    pub correct_dynamics: bool,
}

impl Config {
    /// Whether a device that was told this, and then replied `told`, took it.
    #[must_use]
    pub fn is_taken(&self, told: &Self) -> bool {
        let firmware = match (self.firmware, told.firmware) {
            (Some(wanted), Some(told)) => {
                let correct_dynamics = told.correct_dynamics;
                FirmwareConfig { correct_dynamics, ..wanted } == told
            }
            (wanted, told) => wanted.is_none() && told.is_none(),
        };
        firmware && self.period_ms == told.period_ms
    }
}

/// Why a device cannot be driven in this format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// States of another firmware.
    #[error(
        "the board sends states of {len} bytes, this program reads those of 31: its firmware is \
         {}; flash the physical-cartpole firmware of 2024-07-09 or later",
        sensorsini31::whose(*len)
    )]
    OtherLayout {
        /// The LEN byte that was seen.
        len: u8,
    },
    /// The firmware that the robot is sold with.
    #[error(
        "the board runs the firmware it was sold with, which only tells its sensors and takes no \
         commands: flash the physical-cartpole firmware with an ST-Link or J-Link"
    )]
    Factory,
    /// Another version of coadapt's own format.
    #[error(
        "the device speaks version {seen} of cobs1, this program version {}: re-flash the device \
         or take the coadapt that fits it",
        cobs1::VERSION
    )]
    Version {
        /// The version that was seen.
        seen: u16,
    },
}

/// Why an order was not turned into bytes.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unsendable {
    /// The device does not check the period.
    #[error("a control period of {given} ms: give {least} to {most} ms, the device checks nothing")]
    Period {
        /// The period as given, ms.
        given: u16,
        /// The shortest, ms.
        least: u16,
        /// The longest, ms.
        most: u16,
    },
    /// The board writes beyond its memory.
    #[error("the median of {0} angle readings: give 1 to 32, more destroy the board's memory")]
    Average(u16),
    /// The board would compute with it.
    #[error("the hanging angle is {0}: give the reading of the resting pole, 0 to 4400 counts")]
    AngleHanging(f32),
    /// The configuration lacks what this device needs.
    #[error("this board's configuration needs sync, the hanging angle and the median's length")]
    NoFirmwareConfig,
    /// The device would refuse it.
    #[error("a watchdog of {0} ms: give at most {most} ms, or 0 for five periods", most = cobs1::LONGEST_WATCHDOG_MS)]
    Watchdog(u16),
}

/// Bits a second on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Baud(pub u32);

impl Default for Baud {
    fn default() -> Self {
        Self(230_400)
    }
}

impl Check for Baud {
    fn check(&self, c: &mut Checker<'_>) {
        c.count("baud", self.0, 9600..=4_000_000);
    }
}

/// How long `bytes` bytes take at `baud` with 8 data bits, no parity and 1 stop bit.
#[must_use]
pub fn on_the_wire(bytes: usize, baud: u32) -> Seconds {
    #[expect(clippy::cast_precision_loss, reason = "a few bytes")]
    Seconds(bytes as f64 * 10.0 / f64::from(baud.max(1)))
}

/// Reads little-endian fields from the front of bytes.
#[derive(Clone, Copy, Debug)]
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (field, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*field)
    }

    fn u8(&mut self) -> Option<u8> {
        self.take().map(u8::from_le_bytes)
    }

    /// A byte that is 0 or 1.
    fn flag(&mut self) -> Option<bool> {
        self.u8().and_then(|byte| [false, true].get(usize::from(byte)).copied())
    }

    fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    fn i16(&mut self) -> Option<i16> {
        self.take().map(i16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn i32(&mut self) -> Option<i32> {
        self.take().map(i32::from_le_bytes)
    }

    fn f32(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes)
    }

    /// `value`, provided that every field was read.
    fn end<T>(&self, value: T) -> Option<T> {
        self.0.is_empty().then_some(value)
    }
}
