//! The motor's guard as a process: what it writes to the port, and when it goes.

#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

use std::io::{PipeReader, Read, Write, pipe};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use coadapt::backend::emulator::port::{self, Port};
use coadapt::backend::guard::{Guard, Stop, Watch};
use coadapt::backend::wire::Format;
use coadapt::clock::{Clock, WallClock};
use coadapt::signal::Seconds;
use rustix::fs::{Mode, OFlags};
use rustix::process::{Pid, Signal, WaitOptions, getsid, kill_process, test_kill_process, waitpid};

/// How long anything may take on a busy machine.
const PATIENCE: Seconds = Seconds(20.0);
/// So patient that only the line's end counts.
const PATIENT: &str = "10";
/// What stops the motor here.
const STOP: [u8; 3] = [0xaa, 0x00, 0x01];
/// And this once more.
const AGAIN: [u8; 2] = [0xaa, 0x02];

fn stop() -> Stop {
    Stop { burst: STOP.to_vec(), again: AGAIN.to_vec() }
}

fn program() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_coadapt"))
}

fn soon(what: &str, mut is: impl FnMut() -> bool) {
    let mut clock = WallClock::start();
    while !is() {
        let now = clock.now();
        assert!(now < PATIENCE, "{what}: it never came");
        clock.wait_until(now + Seconds(0.005));
    }
}

/// A guard, the line to it, and what it writes.
struct Watched {
    process: Child,
    line: UnixStream,
    port: PipeReader,
}

impl Watched {
    /// Starts a guard and waits until it watches.
    fn by(patience_s: &str) -> Self {
        let (mut line, its_end) = UnixStream::pair().unwrap();
        let (port, its_port) = pipe().unwrap();
        let process = Command::new(program())
            .args(["guard", "--stop", "aa0001", "--again", "aa02", "--patience-s", patience_s])
            .stdin(Stdio::from(std::os::fd::OwnedFd::from(its_end)))
            .stdout(its_port)
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        line.set_read_timeout(Some(Duration::from_secs_f64(PATIENCE.0))).unwrap();
        line.read_exact(&mut [0]).unwrap();
        Self { process, line, port }
    }

    fn beat(&mut self, watch: Watch) {
        self.line.write_all(&[watch.byte()]).unwrap();
    }

    fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.process), signal).unwrap();
    }

    /// Waits for a stop.
    fn stops(&mut self) {
        let mut heard = Vec::new();
        while !heard.ends_with(&STOP) {
            let mut byte = [0];
            self.port.read_exact(&mut byte).unwrap();
            heard.extend(byte);
        }
    }

    /// The line ends: how the guard ends, and what else it wrote until then.
    fn end(self) -> (ExitStatus, Vec<u8>) {
        let Self { mut process, line, mut port } = self;
        drop(line);
        let mut bytes = Vec::new();
        port.read_to_end(&mut bytes).unwrap();
        (process.wait().unwrap(), bytes)
    }
}

#[test]
fn a_program_that_is_gone_while_armed_is_followed_by_stops() {
    let mut watched = Watched::by(PATIENT);
    watched.beat(Watch::Idle);
    watched.beat(Watch::Armed);
    let (status, bytes) = watched.end();
    assert!(status.success());
    let (first, more) = bytes.split_at(STOP.len());
    assert_eq!(first, STOP);
    assert!(!more.is_empty(), "said once only");
    assert!(more.chunks(AGAIN.len()).all(|stop| stop == AGAIN), "{bytes:x?}");
}

#[test]
fn a_program_that_is_silent_while_armed_is_stopped_and_watched_on() {
    let mut watched = Watched::by("0.1");
    for _ in 0..2 {
        watched.beat(Watch::Armed);
        watched.stops();
        watched.beat(Watch::Idle);
    }
    let (status, _) = watched.end();
    assert!(status.success());
}

#[test]
fn an_orderly_end_needs_no_stop_and_a_homing_device_bears_none() {
    for last in [Watch::Idle, Watch::Mute] {
        let mut watched = Watched::by(PATIENT);
        for watch in [Watch::Armed, last] {
            watched.beat(watch);
        }
        let (status, bytes) = watched.end();
        assert!(status.success());
        assert!(bytes.is_empty(), "{last:?}: {bytes:x?}");
    }
    let (status, bytes) = Watched::by("0.01").end();
    assert!(status.success());
    assert!(bytes.is_empty(), "nobody ever beat: {bytes:x?}");
}

#[test]
fn what_ends_the_program_does_not_end_its_guard() {
    let mut watched = Watched::by(PATIENT);
    let process = Pid::from_child(&watched.process);
    assert_eq!(getsid(Some(process)).unwrap(), process, "not a session of its own");
    watched.beat(Watch::Armed);
    for signal in [Signal::INT, Signal::TERM, Signal::HUP, Signal::QUIT, Signal::TSTP, Signal::PIPE]
    {
        watched.signal(signal);
    }
    let (status, bytes) = watched.end();
    assert!(status.success(), "{status}");
    assert!(bytes.starts_with(&STOP), "{bytes:x?}");
}

#[test]
fn a_port_that_is_gone_holds_up_no_guard() {
    let mut watched = Watched::by(PATIENT);
    watched.beat(Watch::Armed);
    let Watched { mut process, line, port } = watched;
    drop((line, port));
    assert!(process.wait().unwrap().success());
}

/// What the device hears, once it is as many bytes as `wanted`.
fn heard(device: &Port, wanted: usize) -> Vec<u8> {
    let mut heard = Vec::new();
    let mut buffer = [0; 512];
    soon("the stop", || {
        if let port::Read::Bytes(len) = device.read(&mut buffer, Duration::from_millis(5)).unwrap()
        {
            heard.extend_from_slice(&buffer[..len]);
        }
        heard.len() >= wanted
    });
    heard
}

#[test]
fn a_guard_dropped_while_armed_stops_the_device_at_the_port() {
    let device = Port::open(None).unwrap();
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
    let port = rustix::fs::open(device.name(), flags, Mode::empty()).unwrap();
    device.make_raw().unwrap();
    let stop = Stop::of(Format::Sensorsini31);
    let mut guard = Guard::start_program(program(), &port, &stop, Seconds(10.0)).unwrap();
    soon("the guard", || guard.is_watching());
    guard.beat(Watch::Armed);
    // The guard has a copy of its own.
    drop(port);
    drop(guard);
    assert!(heard(&device, stop.burst.len()).starts_with(&stop.burst));
    soon("the port's end", || {
        matches!(device.read(&mut [0; 512], Duration::ZERO).unwrap(), port::Read::Nobody)
    });
}

#[test]
fn a_guard_that_is_not_needed_any_more_goes_and_leaves_nothing() {
    let (mut port, its_port) = pipe().unwrap();
    let mut guard = Guard::start_program(program(), &its_port, &stop(), Seconds(10.0)).unwrap();
    drop(its_port);
    soon("the guard", || guard.is_watching());
    guard.beat(Watch::Armed);
    guard.beat(Watch::Idle);
    let process = Pid::from_raw(guard.process().unwrap().cast_signed()).unwrap();
    drop(guard);
    let mut bytes = Vec::new();
    port.read_to_end(&mut bytes).unwrap();
    assert!(bytes.is_empty(), "{bytes:x?}");
    // Not even a dead process in the table.
    soon("its burial", || test_kill_process(process).is_err());
}

#[test]
fn the_program_sees_whether_its_guard_is_there_and_listens_and_never_waits() {
    let (_port, its_port) = pipe().unwrap();
    let mut guard = Guard::start_program(program(), &its_port, &stop(), Seconds(10.0)).unwrap();
    soon("the guard", || guard.is_watching());
    let process = Pid::from_raw(guard.process().unwrap().cast_signed()).unwrap();
    kill_process(process, Signal::STOP).unwrap();
    for _ in 0..10_000 {
        guard.beat(Watch::Idle);
    }
    assert!(!guard.is_watching(), "it takes no beats");
    kill_process(process, Signal::CONT).unwrap();
    soon("the guard, once more", || {
        guard.beat(Watch::Idle);
        guard.is_watching()
    });
    kill_process(process, Signal::KILL).unwrap();
    soon("its end", || !guard.is_watching());
    guard.beat(Watch::Armed);
    assert!(!guard.is_watching());
}

#[test]
fn a_program_that_is_no_guard_never_watches() {
    let (_port, its_port) = pipe().unwrap();
    let nothing = Path::new("/nonexistent");
    assert!(Guard::start_program(nothing, &its_port, &stop(), Seconds(0.1)).is_err());
    let mut guard =
        Guard::start_program(Path::new("/bin/sh"), &its_port, &stop(), Seconds(0.1)).unwrap();
    guard.beat(Watch::Idle);
    let process = Pid::from_raw(guard.process().unwrap().cast_signed()).unwrap();
    waitpid(Some(process), WaitOptions::empty()).unwrap();
    assert!(!guard.is_watching());
}

#[test]
fn wrong_words_are_refused_and_none_is_shown() {
    for words in [
        ["--stop", "aa0", "--patience-s", "0.1"],
        ["--stop", "+aa0", "--patience-s", "0.1"],
        ["--stop", "", "--patience-s", "0.1"],
        ["--stop", "aa00", "--patience-s", "nan"],
        ["--stop", "aa00", "--patience-s", "0"],
    ] {
        let mut command = Command::new(program());
        command.arg("guard").args(words).args(["--again", "aa00"]).stdin(Stdio::null());
        assert_eq!(command.output().unwrap().status.code(), Some(2), "{words:?}");
    }
    let help = Command::new(program()).arg("--help").output().unwrap();
    assert!(!String::from_utf8(help.stdout).unwrap().contains("guard"));
}
