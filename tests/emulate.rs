//! An emulated device on a pseudo-terminal, from the outside.

#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

use std::fs::{self, File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use coadapt::backend::wire::{Codec, Format, Message, Order};
use rustix::fs::OFlags;
use serde_json::Value;

fn coadapt(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_coadapt"));
    command.arg("emulate").args(words).stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// An emulated device and the lines of its trace.
struct Device {
    process: Child,
    trace: BufReader<std::process::ChildStdout>,
    folder: tempfile::TempDir,
}

impl Device {
    fn start(profile: &str, faults: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (link, file) = (folder.path().join("cp0"), folder.path().join("faults.ron"));
        fs::write(&file, faults).unwrap();
        let words = [profile, "--json", "--port-link", link.to_str().unwrap(), "--faults"];
        let mut process = coadapt(&words).arg(file).spawn().unwrap();
        let trace = BufReader::new(process.stdout.take().unwrap());
        Self { process, trace, folder }
    }

    fn link(&self) -> PathBuf {
        self.folder.path().join("cp0")
    }

    /// Reads the trace up to the next entry of this kind.
    fn trace_to(&mut self, what: &str) -> Value {
        loop {
            let mut line = String::new();
            assert!(self.trace.read_line(&mut line).unwrap() > 0, "no {what} in the trace");
            let entry: Value = serde_json::from_str(&line).unwrap();
            if entry["what"] == what {
                return entry;
            }
        }
    }

    fn end(mut self) {
        let pid = rustix::process::Pid::from_child(&self.process);
        rustix::process::kill_process(pid, rustix::process::Signal::TERM).unwrap();
        assert_eq!(self.process.wait().unwrap().code(), Some(143));
        assert!(fs::symlink_metadata(self.link()).is_err(), "the link stays behind");
    }
}

/// A host at the port.
struct Host {
    port: File,
    codec: Box<dyn Codec>,
}

impl Host {
    fn open(path: &Path, format: Format) -> Self {
        let flags = OFlags::NOCTTY.bits().cast_signed();
        let port =
            OpenOptions::new().read(true).write(true).custom_flags(flags).open(path).unwrap();
        let mut settings = rustix::termios::tcgetattr(&port).unwrap();
        settings.make_raw();
        let now = rustix::termios::OptionalActions::Now;
        rustix::termios::tcsetattr(&port, now, &settings).unwrap();
        Self { port, codec: format.codec() }
    }

    fn order(&mut self, order: Order) {
        self.orders(&[order]);
    }

    fn orders(&mut self, orders: &[Order]) {
        let mut bytes = Vec::new();
        for order in orders {
            self.codec.encode(order, &mut bytes).unwrap();
        }
        self.port.write_all(&bytes).unwrap();
    }

    /// Listens until a message is what is waited for.
    fn hear<T>(&mut self, what: impl Fn(Message) -> Option<T>) -> T {
        loop {
            while let Some(heard) = self.codec.hear() {
                if let Some(found) = heard.ok().and_then(&what) {
                    return found;
                }
            }
            let mut bytes = [0; 512];
            let len = self.port.read(&mut bytes).unwrap();
            self.codec.take(&bytes[..len]);
        }
    }

    /// The command that the device holds, once it is `wanted`.
    fn sees_command(&mut self, wanted: i32) {
        self.hear(|message| {
            matches!(message, Message::State(state) if state.command == wanted).then_some(())
        });
    }
}

#[test]
fn it_halts_as_any_program_does() {
    use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};
    let mut command = coadapt(&["cobs-cart-pole"]);
    // As a shell starts it: a job of its own, which the one who started it can let go on.
    let mut process =
        std::os::unix::process::CommandExt::process_group(&mut command, 0).spawn().unwrap();
    let mut port = String::new();
    BufReader::new(process.stdout.take().unwrap()).read_line(&mut port).unwrap();
    let pid = Pid::from_child(&process);
    kill_process(pid, Signal::TSTP).unwrap();
    let (_, status) = waitpid(Some(pid), WaitOptions::UNTRACED).unwrap().unwrap();
    assert!(status.stopped(), "{status:?}");
    kill_process(pid, Signal::CONT).unwrap();
    kill_process(pid, Signal::TERM).unwrap();
    assert_eq!(process.wait().unwrap().code(), Some(143));
}

#[test]
fn the_physical_cart_pole_streams_obeys_and_holds_when_its_host_is_gone() {
    let mut device = Device::start("physical-cart-pole", "(garbage_at_connect: 50)");
    device.trace_to("port");
    let mut host = Host::open(&device.link(), Format::Sensorsini31);
    host.order(Order::Stream(true));
    host.sees_command(0);
    host.order(Order::Command(900));
    host.sees_command(900);
    // The last words of a host that leaves are heard.
    host.order(Order::Command(-700));
    drop(host);
    while device.trace_to("motor")["command"] != -700 {}
    let mut host = Host::open(&device.link(), Format::Sensorsini31);
    host.sees_command(-700);
    host.order(Order::Stop);
    host.sees_command(0);
    device.end();
}

#[test]
fn a_cobs1_device_stops_when_its_host_falls_silent() {
    let mut device = Device::start("cobs-cart-pole", "()");
    device.trace_to("port");
    let mut host = Host::open(&device.link(), Format::Cobs1);
    host.order(Order::Query);
    let hello = host.hear(|message| match message {
        Message::Hello(hello) => Some(hello),
        _ => None,
    });
    assert_eq!((hello.sensors, hello.full_scale), (2, 1000));
    host.order(Order::Home);
    host.hear(|message| matches!(message, Message::Homed(1)).then_some(()));
    host.orders(&[Order::Arm { watchdog_ms: 250 }, Order::Command(100)]);
    device.trace_to("armed");
    assert_eq!(device.trace_to("motor")["command"], 100);
    device.trace_to("watchdog");
    assert_eq!(device.trace_to("motor")["command"], 0);
    device.end();
}

#[test]
fn a_cable_that_was_pulled_comes_back_under_the_same_link() {
    let faults = "(events: [(at_s: 3.0, what: Unplug(for_s: 0.5))])";
    let mut device = Device::start("physical-cart-pole", faults);
    device.trace_to("port");
    let mut host = Host::open(&device.link(), Format::Sensorsini31);
    host.order(Order::Stream(true));
    host.sees_command(0);
    device.trace_to("gone");
    // What is left can be read, and then there is nothing.
    let mut bytes = [0; 512];
    while host.port.read(&mut bytes).is_ok_and(|len| len > 0) {}
    drop(host);
    device.trace_to("port");
    Host::open(&device.link(), Format::Sensorsini31).sees_command(0);
    device.end();
}

#[test]
fn a_hand_is_lent_on_standard_input() {
    let mut command = coadapt(&["cobs-cart-pole", "--json"]);
    let mut process = command.stdin(Stdio::piped()).spawn().unwrap();
    let lines = b"\nraise\npush -5\nfly\nunplug 0.1\n";
    process.stdin.take().unwrap().write_all(lines).unwrap();
    let mut trace = BufReader::new(process.stdout.take().unwrap()).lines();
    let mut hands = Vec::new();
    // The cable that comes back after the end of input: that has ended nothing.
    let mut ports = 0;
    while ports < 2 {
        let entry: Value = serde_json::from_str(&trace.next().unwrap().unwrap()).unwrap();
        match entry["what"].as_str().unwrap() {
            "hand" => hands.push(entry["hand"].to_string()),
            "port" => ports += 1,
            _ => {}
        }
    }
    assert_eq!(hands, ["\"steady\"", "\"raise\"", "{\"push\":{\"by_m\":-0.05}}"]);
    process.kill().unwrap();
    let mut told = String::new();
    process.stderr.take().unwrap().read_to_string(&mut told).unwrap();
    process.wait().unwrap();
    assert!(told.contains("`fly` is nothing that a hand can do"), "{told}");
}

#[test]
fn wrong_words_are_explained() {
    let folder = tempfile::tempdir().unwrap();
    let faults = folder.path().join("faults.ron");
    fs::write(&faults, "(to_host: (flip: 2.0))").unwrap();
    let faults = faults.to_str().unwrap();
    for (words, told) in [
        (&["hovercraft"][..], "there is no profile `hovercraft`"),
        (&["balance"], "balance has no section `backend`, and so no device"),
        (&["cobs-cart-pole", "--faults", faults], "to_host.flip is 2, allowed: 0 to 1"),
        (&["cobs-cart-pole", "--faults", "/nonexistent"], "cannot read /nonexistent"),
    ] {
        let output = coadapt(words).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let shown = String::from_utf8(output.stderr).unwrap();
        assert!(shown.contains(told), "{shown}");
    }
}
