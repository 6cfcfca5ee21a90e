//! An emulated device at which the program drives, and the trace of what the device got.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use coadapt::backend::serial::address::Address;
use coadapt::backend::serial::shelf::{self, Calibration, MadeFor};
use coadapt::clock::{Clock, WallClock, today};
use coadapt::host::Host;
use coadapt::profile::Order;
use coadapt::run::session::profile_of;
use coadapt::signal::Seconds;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

/// How long anything may take on a busy machine.
pub const PATIENCE: Seconds = Seconds(60.0);

/// What is set for a device of `profile` that starts in its middle, and for a session that begins
/// at once.
pub fn ready(profile: &str) -> Vec<&'static str> {
    let mut sets = vec![
        "backend.start_s=0.1",
        "backend.emulated.start=(0.0,0.0,3.141592653589793,0.0)",
        "session.hold_s=0.0",
    ];
    // The other one is not armed before it has homed.
    if profile == "physical-cart-pole" {
        sets.push("backend.homing=false");
    }
    sets
}

/// A line of the trace.
#[derive(Clone, Debug)]
pub struct Line {
    /// When it was read, by the machine's monotonic clock, ns.
    pub read_ns: i64,
    /// What it says.
    pub entry: Value,
}

impl Line {
    /// The command that the motor follows from here on.
    pub fn motor(&self) -> Option<i64> {
        (self.entry["what"] == "motor").then(|| self.entry["command"].as_i64().unwrap())
    }
}

/// An emulated device, a folder of its own, and the program that drives there.
pub struct Stand {
    /// Where sessions and calibrations are.
    pub folder: tempfile::TempDir,
    /// The emulated device, whose standard input lends it a hand.
    pub device: Child,
    program: PathBuf,
    /// The name of its profile.
    pub profile: &'static str,
    sets: Vec<String>,
    trace: Arc<Mutex<Vec<Line>>>,
    reader: Option<JoinHandle<()>>,
}

impl Stand {
    /// A calibrated device of `profile` with what is `set`, each `key=value`, and its `faults`.
    pub fn new(program: &Path, profile: &'static str, sets: &[&str], faults: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("faults.ron"), faults).unwrap();
        let mut device = Command::new(program)
            .args(["emulate", profile, "--json", "--port-link", "cp0", "--faults", "faults.ron"])
            .args(sets.iter().flat_map(|set| ["--set", set]))
            .current_dir(folder.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(device.stdout.take().unwrap()).lines();
        let trace = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&trace);
        let reader = std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                let read_ns = monotonic();
                let entry = serde_json::from_str(&line).unwrap();
                kept.lock().unwrap().push(Line { read_ns, entry });
            }
        });
        let mut stand = Self {
            folder,
            program: program.to_owned(),
            profile,
            sets: sets.iter().map(|set| (*set).to_owned()).collect(),
            device,
            trace,
            reader: Some(reader),
        };
        soon("the port", || {
            assert_eq!(stand.device.try_wait().unwrap(), None, "no device");
            stand.trace().iter().any(|line| line.entry["what"] == "port")
        });
        stand.calibrate();
        stand
    }

    /// Where the device is.
    pub fn port(&self) -> String {
        self.folder.path().join("cp0").display().to_string()
    }

    /// Keeps the calibration that the emulated device needs: its profile tells the truth.
    fn calibrate(&self) {
        let sets = self.sets.iter().map(|set| {
            let (key, value) = set.split_once('=').unwrap();
            (key.to_owned(), value.to_owned())
        });
        let order =
            Order { profile: self.profile.to_owned(), sets: sets.collect(), ..Order::default() };
        let params = profile_of(&order).unwrap().backend.unwrap();
        let address: Address = self.port().parse().unwrap();
        let calibration = Calibration {
            device: address.identity(&Host::here(), &self.port()),
            at: today().to_string(),
            made_for: MadeFor::of(&params),
            hanging: params.scales.angle.hanging,
            angle_invert: params.scales.angle.invert,
            position_invert: params.scales.position.invert,
            motor_invert: params.scales.motor.invert,
        };
        shelf::store(&self.folder.path().join("logs/.calibrations"), &calibration).unwrap();
    }

    /// The program with the words of `line`, here.
    pub fn program(&self, line: &str) -> Command {
        let mut command = Command::new(&self.program);
        command.args(line.split_whitespace()).current_dir(self.folder.path());
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// The words of a session with this profile.
    pub fn words(&self) -> Vec<String> {
        let mut words = vec!["run".to_owned(), self.profile.to_owned()];
        words.extend(self.sets.iter().flat_map(|set| ["--set".to_owned(), set.clone()]));
        words.extend(["--operator", "simulated:expert", "--seed", "1"].map(str::to_owned));
        words
    }

    /// A session with this profile, and nobody at a screen.
    pub fn session(&self, more: &str) -> Command {
        let mut command = self.program("");
        command.args(self.words()).arg("--headless").args(more.split_whitespace());
        command
    }

    /// The same at the device.
    pub fn armed_session(&self) -> Command {
        self.session(&format!("--arm --backend serial:{}", self.port()))
    }

    /// The trace so far.
    pub fn trace(&self) -> Vec<Line> {
        self.trace.lock().unwrap().clone()
    }

    /// The motor's command now.
    pub fn motor(&self) -> i64 {
        let trace = self.trace.lock().unwrap();
        trace.iter().rev().find_map(Line::motor).unwrap_or(0)
    }

    /// The trace from `since` on, a time of [`monotonic`].
    pub fn trace_since(&self, since: i64) -> Vec<Line> {
        let mut trace = self.trace();
        trace.retain(|line| line.read_ns >= since);
        trace
    }

    /// Waits until the session of `process` drives the motor; false if it is over before.
    pub fn is_driven_by(&self, process: &mut Child) -> bool {
        let mut is_over = false;
        soon("the motor", || {
            is_over = process.try_wait().unwrap().is_some();
            let commands =
                self.trace().iter().filter_map(Line::motor).filter(|to| *to != 0).count();
            is_over || commands > 5 && self.motor() != 0
        });
        !is_over
    }

    /// The device is switched off: the whole trace.
    pub fn end(mut self) -> Vec<Line> {
        kill_process(Pid::from_child(&self.device), Signal::TERM).unwrap();
        self.device.wait().unwrap();
        self.reader.take().unwrap().join().unwrap();
        self.trace()
    }
}

impl Drop for Stand {
    fn drop(&mut self) {
        let _ = self.device.kill();
        let _ = self.device.wait();
    }
}

/// What the device got that it never must, and that it crashed.
pub fn offences(trace: &[Line]) -> Vec<&Line> {
    let at = |line: &Line| line.entry["at_s"].as_f64().unwrap();
    // What was written apart is read at once by an emulator that the computer kept waiting.
    let was_kept = |index: usize| {
        let before =
            trace[..index].iter().rev().take_while(|line| at(line) > at(&trace[index]) - 0.05);
        before.into_iter().any(|line| line.entry["what"] == "stalled")
    };
    let is_offence = |(index, line): &(usize, &Line)| {
        let what = (&line.entry["what"], &line.entry["offence"]);
        let is_excused = what.1 == "too_many_bytes" && was_kept(*index);
        what.0 == "crashed" || what.0 == "forbidden" && !is_excused
    };
    trace.iter().enumerate().filter(is_offence).map(|(_, line)| line).collect()
}

/// Waits until something is so.
pub fn soon(what: &str, mut is: impl FnMut() -> bool) {
    let mut clock = WallClock::start();
    while !is() {
        let now = clock.now();
        assert!(now < PATIENCE, "{what}: it never came");
        clock.wait_until(now + Seconds(0.002));
    }
}

/// The machine's monotonic clock, ns.
pub fn monotonic() -> i64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}
