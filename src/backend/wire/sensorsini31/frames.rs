//! The firmware's frames: `AA`, command, LEN of the whole frame, payload, CRC-8.

use crc::{CRC_8_MAXIM_DOW, Crc};
use serde::Serialize;

use super::super::{Config, Fields, Firmware, FirmwareConfig, Readings, StateFrame};

/// The checksum over all bytes of a frame but the last.
const CRC: Crc<u8> = Crc::<u8>::new(&CRC_8_MAXIM_DOW);
/// The first byte of every frame.
pub const START: u8 = 0xAA;
/// The command byte of the gains' setting, which no firmware obeys.
pub const SET_PID_CONFIG: u8 = 0xC4;
/// The command byte of a state.
pub const STATE: u8 = 0xCC;
/// The length of a state, bytes.
pub const STATE_LEN: u8 = 31;

/// What the firmware obeys. It has a command more, `C4` for the gains, of which it obeys no
/// length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Request {
    /// Answer.
    Ping,
    /// Send states, or stop.
    StreamOn(bool),
    /// Look for the ends of the track.
    Calibrate,
    /// Let the board's own controller drive, or the host.
    ControlMode(bool),
    /// Tell the gains.
    GetPidConfig,
    /// Set the period, and how the angle is measured.
    SetControlConfig(Config),
    /// Tell the configuration.
    GetControlConfig,
    /// Drive the motor: PWM clock counts.
    SetMotor(i32),
    /// The target of the board's own controller, m.
    SetTargetPosition(f32),
    /// Its equilibrium: +1 up, −1 down.
    SetTargetEquilibrium(f32),
    /// Measure the angle `count` times, `interval_us` apart, and do nothing else.
    CollectRawAngle {
        /// The number of readings.
        count: u16,
        /// The time between two, µs.
        interval_us: u16,
    },
    /// Run the experiment on the board.
    RunHardwareExperiment,
    /// Send the recording.
    TransferBuffers,
}

impl Request {
    /// The command byte.
    #[must_use]
    pub const fn code(&self) -> u8 {
        match self {
            Self::Ping => 0xC0,
            Self::StreamOn(_) => 0xC1,
            Self::Calibrate => 0xC2,
            Self::ControlMode(_) => 0xC3,
            Self::GetPidConfig => 0xC5,
            Self::SetControlConfig(_) => 0xC6,
            Self::GetControlConfig => 0xC7,
            Self::SetMotor(_) => 0xC8,
            Self::SetTargetPosition(_) => 0xC9,
            Self::SetTargetEquilibrium(_) => 0xCD,
            Self::CollectRawAngle { .. } => 0xCA,
            Self::RunHardwareExperiment => 0xCE,
            Self::TransferBuffers => 0xD1,
        }
    }

    /// Appends the frame.
    pub fn encode(&self, out: &mut Vec<u8>) {
        frame(self.code(), out, |out| match self {
            Self::Ping
            | Self::Calibrate
            | Self::GetPidConfig
            | Self::GetControlConfig
            | Self::RunHardwareExperiment
            | Self::TransferBuffers => {}
            Self::StreamOn(on) | Self::ControlMode(on) => out.push(u8::from(*on)),
            Self::SetControlConfig(config) => put_config(config, out),
            Self::SetMotor(command) => out.extend(command.to_le_bytes()),
            Self::SetTargetPosition(target) | Self::SetTargetEquilibrium(target) => {
                out.extend(target.to_le_bytes());
            }
            Self::CollectRawAngle { count, interval_us } => {
                out.extend(count.to_le_bytes());
                out.extend(interval_us.to_le_bytes());
            }
        });
    }

    /// The request in `frame`, or `None` when it is no whole frame with a right checksum, or
    /// has a length that the command does not have.
    #[must_use]
    pub fn decode(frame: &[u8]) -> Option<Self> {
        let (code, payload) = open(frame)?;
        Self::read(code, payload)
    }

    /// The request with the command byte `code` and this payload.
    #[must_use]
    pub fn read(code: u8, payload: &[u8]) -> Option<Self> {
        let mut f = Fields(payload);
        let request = match code {
            0xC0 => Self::Ping,
            0xC1 => Self::StreamOn(f.u8()? != 0),
            0xC2 => Self::Calibrate,
            0xC3 => Self::ControlMode(f.u8()? != 0),
            0xC5 => Self::GetPidConfig,
            0xC6 => Self::SetControlConfig(config(&mut f)?),
            0xC7 => Self::GetControlConfig,
            0xC8 => Self::SetMotor(f.i32()?),
            0xC9 => Self::SetTargetPosition(f.f32()?),
            0xCD => Self::SetTargetEquilibrium(f.f32()?),
            0xCA => Self::CollectRawAngle { count: f.u16()?, interval_us: f.u16()? },
            0xCE => Self::RunHardwareExperiment,
            0xD1 => Self::TransferBuffers,
            _ => return None,
        };
        // The firmware echoes a ping with whatever it carries.
        if code == 0xC0 { Some(request) } else { f.end(request) }
    }
}

/// What the firmware says.
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// A ping's echo.
    Pong,
    /// The plant's state, after each control period.
    State(StateFrame),
    /// The run to the track's ends has ended: +1 Pololu motor, −1 original motor.
    Calibrated(i8),
    /// The gains. Six stray bytes follow.
    Pid([f32; 6]),
    /// The configuration, whose last byte repeats `sync`. Two stray bytes follow.
    Config(Config),
    /// The experiment on the board has ended with so many samples.
    Experiment(u16),
    /// Raw readings of the angle, without a checksum; LEN keeps only its low byte.
    RawAngles(Vec<u16>),
}

impl Reply {
    /// Appends the bytes that the firmware really sends, stray ones included.
    pub fn encode(&self, out: &mut Vec<u8>) {
        match self {
            Self::Pong => frame(0xC0, out, |_| {}),
            Self::State(state) => frame(STATE, out, |out| put_state(state, out)),
            Self::Calibrated(direction) => {
                frame(0xC2, out, |out| out.extend(direction.to_le_bytes()));
            }
            Self::Pid(gains) => {
                frame(0xC5, out, |out| put_floats(gains, out));
                out.extend([0; 6]);
            }
            Self::Config(config) => {
                frame(0xC7, out, |out| put_config(config, out));
                out.extend([0; 2]);
            }
            Self::Experiment(samples) => {
                frame(0xCE, out, |out| out.extend(samples.to_le_bytes()));
            }
            Self::RawAngles(readings) => {
                // `(4 + 2n) & 0xFF`, as the firmware computes it.
                let len = (4 + 2 * readings.len()).to_le_bytes()[0];
                out.extend([START, 0xCA, len]);
                out.extend(readings.iter().flat_map(|reading| reading.to_le_bytes()));
                out.push(0);
            }
        }
    }

    /// The reply in `frame`, stray bytes left out, or `None` when it is no whole reply with a
    /// right checksum. [`Self::RawAngles`] has none: see [`raw_angles`].
    #[must_use]
    pub fn decode(frame: &[u8]) -> Option<Self> {
        let (code, payload) = open(frame)?;
        let mut f = Fields(payload);
        let reply = match code {
            0xC0 => Self::Pong,
            STATE => Self::State(state(&mut f)?),
            0xC2 => Self::Calibrated(f.u8()?.cast_signed()),
            0xC5 => Self::Pid(floats(&mut f)?),
            0xC7 => Self::Config(config(&mut f)?),
            0xCE => Self::Experiment(f.u16()?),
            _ => return None,
        };
        f.end(reply)
    }
}

/// The readings of a reply to a request for `count` raw angles.
#[must_use]
pub fn raw_angles(frame: &[u8], count: u16) -> Option<Vec<u16>> {
    let body = frame.strip_prefix(&[START, 0xCA, (4 + 2 * usize::from(count)).to_le_bytes()[0]])?;
    let mut f = Fields(body);
    let readings = (0..count).map(|_| f.u16()).collect::<Option<Vec<u16>>>()?;
    // The place of the checksum, which the firmware leaves empty.
    f.u8()?;
    f.end(readings)
}

/// Appends `state` in the layout of another firmware: 17 bytes (2021-12 to 2023-09) or 27
/// (2024-01 to 2024-07); any other length is filled with zeros.
pub fn other_layout(state: &StateFrame, len: u8, out: &mut Vec<u8>) {
    const AROUND: usize = 4;
    frame(STATE, out, |out| {
        let start = out.len();
        let sensor = |index: usize| low(state.sensors.get(index).copied().unwrap_or(0));
        let firmware = state.firmware.unwrap_or_default();
        out.extend([sensor(0), sensor(1)].concat());
        if len == 27 {
            out.extend(firmware.target_position_m.to_le_bytes());
        }
        out.extend(low(state.command));
        out.push(firmware.invalid_steps);
        if len == 27 {
            out.extend(state.time_difference_us.unwrap_or(0).to_le_bytes());
        }
        out.extend(state.time_us.to_le_bytes());
        out.extend(firmware.latency_10us.to_le_bytes());
        out.resize(start + usize::from(len).saturating_sub(AROUND), 0);
    });
}

/// The low 16 bits: what does not fit loses the others, as on the board.
fn low(reading: i32) -> [u8; 2] {
    [reading.to_le_bytes()[0], reading.to_le_bytes()[1]]
}

/// The checksum of all bytes of a frame but the last.
#[must_use]
pub fn checksum(bytes: &[u8]) -> u8 {
    CRC.checksum(bytes)
}

/// Appends a frame with what `payload` writes.
fn frame(code: u8, out: &mut Vec<u8>, payload: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    out.extend([START, code, 0]);
    payload(out);
    // No frame is longer than 35 bytes.
    out[start + 2] = (out.len() - start + 1).to_le_bytes()[0];
    let crc = checksum(&out[start..]);
    out.push(crc);
}

/// The command byte and the payload of a whole frame with a right checksum.
fn open(frame: &[u8]) -> Option<(u8, &[u8])> {
    let (crc, rest) = frame.split_last()?;
    let [START, code, len, payload @ ..] = rest else { return None };
    let is_whole = usize::from(*len) == frame.len() && checksum(rest) == *crc;
    is_whole.then_some((*code, payload))
}

fn put_floats(floats: &[f32; 6], out: &mut Vec<u8>) {
    out.extend(floats.iter().flat_map(|float| float.to_le_bytes()));
}

fn floats(f: &mut Fields<'_>) -> Option<[f32; 6]> {
    let mut floats = [0.0; 6];
    for float in &mut floats {
        *float = f.f32()?;
    }
    Some(floats)
}

fn put_config(config: &Config, out: &mut Vec<u8>) {
    let firmware = config.firmware.unwrap_or(FirmwareConfig {
        sync: true,
        angle_hanging: 0.0,
        average: 1,
        correct_dynamics: true,
    });
    out.extend(config.period_ms.to_le_bytes());
    out.push(u8::from(firmware.sync));
    out.extend(firmware.angle_hanging.to_le_bytes());
    out.extend(firmware.average.to_le_bytes());
    out.push(u8::from(firmware.correct_dynamics));
}

fn config(f: &mut Fields<'_>) -> Option<Config> {
    let period_ms = f.u16()?;
    let firmware = FirmwareConfig {
        sync: f.u8()? != 0,
        angle_hanging: f.f32()?,
        average: f.u16()?,
        correct_dynamics: f.u8()? != 0,
    };
    Some(Config { period_ms, firmware: Some(firmware) })
}

fn put_state(state: &StateFrame, out: &mut Vec<u8>) {
    let firmware = state.firmware.unwrap_or_default();
    let sensor = |index: usize| low(state.sensors.get(index).copied().unwrap_or(0));
    out.extend(sensor(0));
    out.extend(firmware.angle_change.to_le_bytes());
    out.extend(sensor(1));
    out.extend(firmware.target_position_m.to_le_bytes());
    out.extend(low(state.command));
    out.push(firmware.invalid_steps);
    out.extend(state.time_difference_us.unwrap_or(0).to_le_bytes());
    out.extend(state.time_us.to_le_bytes());
    out.extend(firmware.latency_10us.to_le_bytes());
    out.extend(firmware.latency_violation.to_le_bytes());
}

fn state(f: &mut Fields<'_>) -> Option<StateFrame> {
    let angle = f.i16()?;
    let angle_change = f.f32()?;
    let position = f.i16()?;
    let target_position_m = f.f32()?;
    let command = i32::from(f.i16()?);
    let invalid_steps = f.u8()?;
    let time_difference_us = Some(f.u32()?);
    let time_us = f.u32()?;
    let (latency_10us, latency_violation) = (f.u16()?, f.u16()?);
    Some(StateFrame {
        sensors: Readings::new(&[i32::from(angle), i32::from(position)])?,
        time_us,
        time_difference_us,
        command,
        applied: None,
        flags: None,
        firmware: Some(Firmware {
            angle_change,
            target_position_m,
            invalid_steps,
            latency_10us,
            latency_violation,
        }),
    })
}
