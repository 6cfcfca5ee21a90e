//! The wire formats against frames from outside this program.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking, helpers too")]

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::Path;

use coadapt::backend::emulator::faults::Faults;
use coadapt::backend::emulator::rig;
use coadapt::backend::wire::cobs1::frames as cobs1;
use coadapt::backend::wire::sensorsini31::frames::{Reply, Request, raw_angles};
use coadapt::backend::wire::{
    Ack, Codec, Config, Firmware, FirmwareConfig, Flags, Format, Hello, Message, Outcome, Readings,
    Refusal, StateFrame, sensorsini31,
};
use coadapt::check::{Check, Checker};
use coadapt::profile::Document;
use serde_json::Value;

/// A row of `tests/data/wire/sensorsini31.csv`.
struct Row {
    to_device: bool,
    name: String,
    fields: Value,
    bytes: Vec<u8>,
    valid: bool,
}

fn rows() -> Vec<Row> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/wire/sensorsini31.csv");
    let row = |record: Result<csv::StringRecord, csv::Error>| {
        let record = record.unwrap();
        Row {
            to_device: &record[0] == "host_to_device",
            name: record[1].to_owned(),
            fields: serde_json::from_str(&record[2]).unwrap(),
            bytes: from_hex(&record[3]),
            valid: &record[4] == "yes",
        }
    };
    csv::Reader::from_path(path).unwrap().records().map(row).collect()
}

fn from_hex(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> =
        hex.chars().filter_map(|c| c.to_digit(16)).map(|digit| digit.try_into().unwrap()).collect();
    digits.chunks_exact(2).map(|pair| pair[0] << 4 | pair[1]).collect()
}

fn int<T: TryFrom<i64, Error: std::fmt::Debug>>(fields: &Value, key: &str) -> T {
    fields[key].as_i64().unwrap_or_else(|| panic!("no {key} in {fields}")).try_into().unwrap()
}

#[expect(clippy::cast_possible_truncation, reason = "the exact double of a float")]
fn float(fields: &Value, key: &str) -> f32 {
    fields[key].as_f64().unwrap_or_else(|| panic!("no {key} in {fields}")) as f32
}

fn config(fields: &Value, last: &str) -> Config {
    let firmware = FirmwareConfig {
        sync: fields["sync"] == true,
        angle_hanging: float(fields, "angle_hanging"),
        average: int(fields, "avg_len"),
        correct_dynamics: fields[last] == true,
    };
    Config { period_ms: int(fields, "period_ms"), firmware: Some(firmware) }
}

fn state(fields: &Value) -> StateFrame {
    StateFrame {
        sensors: Readings::new(&[int(fields, "angle"), int(fields, "position")]).unwrap(),
        time_us: int(fields, "time_us"),
        time_difference_us: Some(int(fields, "time_difference_us")),
        command: int(fields, "command"),
        applied: None,
        flags: None,
        firmware: Some(Firmware {
            angle_change: float(fields, "angle_d"),
            target_position_m: float(fields, "target_position"),
            invalid_steps: int(fields, "invalid_steps"),
            latency_10us: int(fields, "latency_10us"),
            latency_violation: int(fields, "latency_violation"),
        }),
    }
}

fn request(name: &str, fields: &Value) -> Request {
    match name {
        "PING" => Request::Ping,
        "STREAM_ON" => Request::StreamOn(fields["enable"] == true),
        "CALIBRATE" => Request::Calibrate,
        "CONTROL_MODE" => Request::ControlMode(fields["enable"] == true),
        "SET_MOTOR" => Request::SetMotor(int(fields, "command")),
        "SET_TARGET_POSITION" => Request::SetTargetPosition(float(fields, "position_m")),
        "SET_TARGET_EQUILIBRIUM" => Request::SetTargetEquilibrium(float(fields, "equilibrium")),
        "SET_CONTROL_CONFIG" => Request::SetControlConfig(config(fields, "correct_motor_dynamics")),
        "GET_CONTROL_CONFIG" => Request::GetControlConfig,
        "GET_PID_CONFIG" => Request::GetPidConfig,
        "COLLECT_RAW_ANGLE" => Request::CollectRawAngle {
            count: int(fields, "count"),
            interval_us: int(fields, "interval_us"),
        },
        "RUN_HARDWARE_EXPERIMENT" => Request::RunHardwareExperiment,
        "TRANSFER_BUFFERS" => Request::TransferBuffers,
        _ => panic!("an unknown request {name}"),
    }
}

fn reply(name: &str, fields: &Value) -> Reply {
    let gain = |key| float(fields, key);
    match name {
        "PING_reply" => Reply::Pong,
        "CALIBRATE_reply" => Reply::Calibrated(int(fields, "encoder_direction")),
        "RUN_HARDWARE_EXPERIMENT_reply" => Reply::Experiment(int(fields, "length")),
        "GET_CONTROL_CONFIG_reply" => Reply::Config(config(fields, "byte12_is_sync_again")),
        "GET_PID_CONFIG_reply" => Reply::Pid([
            gain("position_kp"),
            gain("position_ki"),
            gain("position_kd"),
            gain("angle_kp"),
            gain("angle_ki"),
            gain("angle_kd"),
        ]),
        "COLLECT_RAW_ANGLE_reply" => {
            let readings = fields["samples"].as_array().unwrap();
            Reply::RawAngles(
                readings.iter().map(|r| r.as_i64().unwrap().try_into().unwrap()).collect(),
            )
        }
        _ if name.starts_with("STATE") => Reply::State(state(fields)),
        _ => panic!("an unknown reply {name}"),
    }
}

/// What the host hears, in pieces of `chunk` bytes, and the bytes that it skipped.
fn hear(bytes: &[u8], chunk: usize) -> (Vec<Result<Message, Refusal>>, u64) {
    let mut host = sensorsini31::Host::default();
    let mut heard = Vec::new();
    for piece in bytes.chunks(chunk) {
        host.take(piece);
        heard.extend(std::iter::from_fn(|| host.hear()));
    }
    (heard, host.counts().skipped)
}

#[test]
fn every_request_of_the_driver_is_encoded_and_decoded() {
    let mut tried = 0;
    for Row { name, fields, bytes, valid, .. } in rows().iter().filter(|row| row.to_device) {
        tried += 1;
        if !valid {
            assert_eq!(Request::decode(bytes), None, "{name}");
            continue;
        }
        let request = request(name, fields);
        let mut encoded = Vec::new();
        request.encode(&mut encoded);
        assert_eq!((&encoded, Request::decode(bytes)), (bytes, Some(request)), "{name}");
    }
    assert_eq!(tried, 31);
}

#[test]
fn every_reply_of_the_firmware_is_encoded_and_decoded() {
    let mut tried = 0;
    for Row { name, fields, bytes, valid, .. } in
        rows().iter().filter(|row| !row.to_device && !row.name.starts_with("stream_"))
    {
        tried += 1;
        if !valid {
            assert_eq!(Reply::decode(bytes), None, "{name}");
            continue;
        }
        let reply = reply(name, fields);
        let mut encoded = Vec::new();
        reply.encode(&mut encoded);
        assert_eq!(&encoded, bytes, "{name}");
        if let Reply::RawAngles(readings) = &reply {
            let count = readings.len().try_into().unwrap();
            assert_eq!(raw_angles(bytes, count).as_ref(), Some(readings));
            assert_eq!(hear(bytes, 1), (vec![], bytes.len() as u64));
            continue;
        }
        let stray = fields["trailing_bytes"].as_u64().unwrap_or(0);
        let frame = &bytes[..bytes.len() - usize::try_from(stray).unwrap()];
        assert_eq!(Reply::decode(frame), Some(reply), "{name}");
        let (heard, skipped) = hear(bytes, 3);
        assert!(matches!(heard[..], [Ok(_)]), "{name}: {heard:?}");
        assert_eq!(skipped, stray, "{name}");
    }
    assert_eq!(tried, 21);
}

#[test]
fn what_is_no_valid_message_is_refused() {
    for row in rows().iter().filter(|row| !row.to_device && !row.valid) {
        let expected = match row.name.as_str() {
            "STATE_old_firmware_27" => vec![Err(Refusal::OtherLayout { len: 27 })],
            "STATE_old_firmware_17" => vec![Err(Refusal::OtherLayout { len: 17 })],
            _ => vec![],
        };
        assert_eq!(hear(&row.bytes, 5).0, expected, "{}", row.name);
    }
}

#[test]
fn streams_yield_their_frames_and_skip_the_rest() {
    let mut tried = 0;
    for Row { name, fields, bytes, .. } in
        rows().iter().filter(|row| row.name.starts_with("stream_"))
    {
        tried += 1;
        let frames = fields["frames"].as_array().unwrap();
        let expected: Vec<_> = frames.iter().map(|f| Ok(Message::State(state(f)))).collect();
        for chunk in [1, 7, 4096] {
            let (heard, skipped) = hear(bytes, chunk);
            assert_eq!(heard, expected, "{name}");
            assert_eq!(Some(skipped), fields["discarded_bytes"].as_u64(), "{name}");
        }
    }
    assert_eq!(tried, 5);
}

/// The message that `words` of the document stand for, such as `CMD u=-3600`.
fn cobs1_message(words: &str) -> Result<cobs1::Request, cobs1::Reply> {
    let mut words = words.split(' ');
    let name = words.next().unwrap();
    let fields: HashMap<&str, &str> = words.map(|word| word.split_once('=').unwrap()).collect();
    let field = |key: &str| -> i64 { fields[key].parse().unwrap() };
    let narrow = |key: &str| -> u16 { field(key).try_into().unwrap() };
    let byte = |key: &str| -> u8 { field(key).try_into().unwrap() };
    let wide = |key: &str| -> i32 { field(key).try_into().unwrap() };
    Ok(match name {
        "QUERY" => cobs1::Request::Query,
        "CONFIG" => cobs1::Request::Config { period_ms: narrow("period_ms") },
        "STREAM" => cobs1::Request::Stream(field("on") == 1),
        "HOME" => cobs1::Request::Home,
        "ARM" => {
            cobs1::Request::Arm { version: narrow("version"), watchdog_ms: narrow("watchdog_ms") }
        }
        "DISARM" => cobs1::Request::Disarm,
        "CMD" => cobs1::Request::Command(wide("u")),
        "STOP" => cobs1::Request::Stop,
        "PING" => cobs1::Request::Ping,
        "HELLO" => {
            let hello = Hello {
                sensors: byte("n"),
                period_ms: narrow("period_ms"),
                watchdog_ms: narrow("watchdog_ms"),
                full_scale: wide("full_scale"),
                name: Hello::named(fields["name"]),
            };
            return Err(cobs1::Reply::Hello { version: narrow("version"), hello });
        }
        "STATE" => {
            let sensors: Vec<i32> =
                fields["sensors"].split(',').map(|sensor| sensor.parse().unwrap()).collect();
            return Err(cobs1::Reply::State(StateFrame {
                sensors: Readings::new(&sensors).unwrap(),
                time_us: field("t_us").try_into().unwrap(),
                time_difference_us: None,
                command: wide("u"),
                applied: Some(byte("applied")),
                flags: Some(Flags(narrow("flags"))),
                firmware: None,
            }));
        }
        "ACK" => {
            let outcome = Outcome::ALL[usize::from(byte("result"))];
            return Err(cobs1::Reply::Ack(Ack { of: byte("of"), outcome }));
        }
        "HOMED" => return Err(cobs1::Reply::Homed(field("direction").try_into().unwrap())),
        _ => panic!("an unknown message {name}"),
    })
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

#[test]
fn the_frames_of_the_document_are_those_of_the_codec() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/SERIAL-PROTOCOL.md");
    let document = fs::read_to_string(path).unwrap();
    let rows = document.lines().skip_while(|line| *line != "| message | number | frame |");
    let mut kinds = HashSet::new();
    for row in rows.skip(2).take_while(|line| line.starts_with('|')) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let &[words, number, shown] = &cells[..] else { panic!("{row}") };
        let number: u8 = number.parse().unwrap();
        let mut encoded = Vec::new();
        let message = cobs1_message(words.trim_matches('`'));
        match &message {
            Ok(request) => request.encode(number, &mut encoded),
            Err(reply) => reply.encode(number, &mut encoded),
        }
        assert_eq!(hex(&encoded), shown.trim_matches('`'), "{words}");
        let mut deframer = cobs1::Deframer::default();
        deframer.take(&from_hex(shown));
        let Some(cobs1::Piece::Good(frame, _)) = deframer.piece() else { panic!("{words}") };
        assert_eq!(frame.number(), number);
        let decoded = match message {
            Ok(_) => Ok(cobs1::Request::decode(&frame).unwrap()),
            Err(_) => Err(cobs1::Reply::decode(&frame).unwrap()),
        };
        assert_eq!(decoded, message, "{words}");
        kinds.insert(frame.kind());
    }
    assert_eq!(kinds.len(), 13, "the document shows {kinds:?}");
}

#[test]
fn the_fault_file_of_the_document_is_one() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/SERIAL-PROTOCOL.md");
    let document = fs::read_to_string(path).unwrap();
    let (_, file) = document.split_once("```ron\n").unwrap();
    let (file, _) = file.split_once("```").unwrap();
    let options =
        ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    let faults: Faults = options.from_str(file).unwrap();
    let mut wrong = Vec::new();
    faults.check(&mut Checker::new(&mut wrong));
    assert_eq!((wrong, faults.events.len()), (Vec::new(), 7));
}

#[test]
fn the_devices_that_come_along_are_right_and_the_robot_is_the_default() {
    let [robot, board] = ["physical-cart-pole", "cobs-cart-pole"].map(|name| {
        let nowhere = Path::new("no such folder");
        Document::find(name, nowhere).unwrap().read().unwrap().backend.unwrap()
    });
    assert_eq!(robot.emulated, rig::Params::default());
    assert_eq!((robot.format, board.format), (Format::Sensorsini31, Format::Cobs1));
}
