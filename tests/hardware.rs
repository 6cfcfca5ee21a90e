//! Whole sessions of the program at an emulated device, and all that may end them.

#![cfg(unix)]
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking, helpers too")]

#[path = "program/stand.rs"]
mod stand;

use std::fs;
use std::io::Write as _;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output, Stdio};

use coadapt::clock::{Clock, WallClock};
use coadapt::signal::Seconds;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use stand::{Line, Stand, monotonic, offences, ready, soon};

const PROFILES: [&str; 2] = ["physical-cart-pole", "cobs-cart-pole"];

/// A machine with other things to do must not look like a device that is gone.
const PATIENT: [&str; 3] = [
    "backend.safety.echo_states=50",
    "backend.safety.stale_periods=10.0",
    "backend.watchdog_ms=250",
];
/// All phases, each short, and a pole that need not hang still in between.
const SHORT: [&str; 10] = [
    "session.hold_s=0.0",
    "session.introduction_duration_s=2.0",
    "session.main_duration_s=2.0",
    "session.autonomous_rollouts=2",
    "session.autonomous_hold_s=0.0",
    "session.break_s=0.0",
    "rules.test_s=1.0",
    "backend.centre.centre_m=0.1",
    "backend.centre.rest_deg=45.0",
    "backend.centre.rest_deg_s=180.0",
];
/// How long a session may take on a busy machine.
const SESSION: Seconds = Seconds(300.0);
/// So often a session may be stopped because this machine was too busy for it.
const TRIES: usize = 4;

fn program() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_coadapt"))
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn session_folder(stand: &Stand) -> PathBuf {
    let entries = fs::read_dir(stand.folder.path().join("logs/anon")).unwrap();
    let mut folders = entries.map(|entry| entry.unwrap().path()).filter(|path| path.is_dir());
    let folder = folders.next().unwrap();
    assert!(folders.next().is_none(), "more than one session");
    folder
}

fn status(folder: &Path) -> Value {
    sidecar(folder)["status"].clone()
}

fn sidecar(folder: &Path) -> Value {
    let text = fs::read_to_string(folder.join("session.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// The first line of each table.
fn headers(folder: &Path) -> Vec<String> {
    let tables = ["steps.csv", "episodes.csv", "events.csv", "evaluation.csv"];
    tables
        .map(|name| {
            let table = fs::read_to_string(folder.join(name)).unwrap();
            table.lines().next().unwrap().to_owned()
        })
        .to_vec()
}

/// Runs a command to its end.
fn ended(mut command: Command) -> Output {
    let mut process = command.spawn().unwrap();
    let mut clock = WallClock::start();
    while process.try_wait().unwrap().is_none() {
        if clock.now() > SESSION {
            process.kill().unwrap();
            panic!("it never ended: {:?}", process.wait_with_output());
        }
        let soon = clock.now() + Seconds(0.005);
        clock.wait_until(soon);
    }
    // What is told fits into a pipe.
    process.wait_with_output().unwrap()
}

/// Goes on with the session until it is complete.
fn completes(stand: &Stand) -> PathBuf {
    let folder = session_folder(stand);
    let line = format!("run --headless --arm --resume {}", folder.display());
    let mut told = String::new();
    for _ in 0..TRIES {
        if status(&folder) == "complete" {
            return folder;
        }
        let output = ended(stand.program(&line));
        told = text(&output.stderr) + &text(&output.stdout);
        // A motor that nobody could stop has driven the cart to the end of its track.
        if told.contains("push the plant back by hand") {
            let way = if told.contains("position is +") { -10 } else { 10 };
            writeln!(stand.device.stdin.as_ref().unwrap(), "push {way}").unwrap();
        }
    }
    assert_eq!(status(&folder), "complete", "{told}");
    folder
}

/// Nothing that the device must never get, and a motor that is off at the end.
fn assert_peaceful(trace: &[Line]) {
    let found = offences(trace);
    let first = found.first().map_or(i64::MAX, |line| line.read_ns);
    let before = |line: &&Line| (first.saturating_sub(50_000_000)..=first).contains(&line.read_ns);
    let story: Vec<_> = trace.iter().filter(before).map(|line| line.entry.to_string()).collect();
    assert!(found.is_empty(), "{}", story.join("\n"));
    assert_eq!(trace.iter().rev().find_map(Line::motor), Some(0), "the motor's last command");
}

/// Both at once: they wait more than they work.
fn with_both(test: impl Fn(&'static str) + Sync) {
    all_at_once(
        PROFILES.map(|profile| (profile, &test)).map(|(profile, test)| move || test(profile)),
    );
}

fn all_at_once(cases: impl IntoIterator<Item = impl FnOnce() + Send>) {
    std::thread::scope(|scope| {
        let cases: Vec<_> = cases.into_iter().map(|case| scope.spawn(case)).collect();
        for case in cases {
            if let Err(panic) = case.join() {
                std::panic::resume_unwind(panic);
            }
        }
    });
}

#[test]
fn a_whole_session_at_a_device_keeps_what_one_at_the_model_keeps() {
    with_both(|profile| {
        let sets = [&PATIENT[..], &SHORT[..]].concat();
        let stand = Stand::new(program(), profile, &sets, "()");
        let output = ended(stand.armed_session());
        let folder = session_folder(&stand);
        // It says by its code whether it is complete.
        let is_complete = status(&folder) == "complete";
        assert_eq!(output.status.code(), Some(i32::from(!is_complete)), "{output:?}");
        completes(&stand);

        let timing = &sidecar(&folder)["timing"];
        assert!(timing["plant"]["states"].as_u64().unwrap() > 50, "{timing}");
        assert!(timing["plant"]["latency_us"]["p50"].as_u64().unwrap() > 0, "{timing}");
        let simulated = ended(stand.session("--logs simulated --json"));
        let simulated: Value = serde_json::from_slice(&simulated.stdout).unwrap();
        let simulated = stand.folder.path().join(simulated["session"].as_str().unwrap());
        assert!(sidecar(&simulated)["timing"].is_null());
        assert_eq!(names(&folder), names(&simulated));
        assert_eq!(headers(&folder), headers(&simulated));
        let rollouts = |folder: &Path| {
            let table = fs::read_to_string(folder.join("episodes.csv")).unwrap();
            let phases = table.lines().map(|line| line.split(',').next().unwrap().to_owned());
            let mut phases: Vec<_> = phases.collect();
            phases.dedup();
            phases
        };
        assert_eq!(rollouts(&folder), rollouts(&simulated));
        let trace = stand.end();
        assert_peaceful(&trace);
        let homed = trace.iter().filter(|line| line.entry["what"] == "homing_ended");
        assert!(homed.count() > 0, "it never homed");
    });
}

/// Nothing but teaching, for so long.
fn main_for<'a>(profile: &str, duration: &'a str) -> Vec<&'a str> {
    [&PATIENT[..], &ready(profile), &["session.phases=[main]", duration]].concat()
}

/// A session at a device, with its motor on.
struct Driving {
    stand: Stand,
    process: Child,
}

impl Driving {
    /// Begins a session, and waits until its motor is on.
    fn start(profile: &'static str) -> Self {
        Self::with(profile, &main_for(profile, "session.main_duration_s=4.0"))
    }

    fn with(profile: &'static str, sets: &[&str]) -> Self {
        for _ in 0..TRIES {
            let stand = Stand::new(program(), profile, sets, "()");
            let mut command = stand.armed_session();
            // A job of its own, as a shell starts it: what stops it can let it go on.
            command.process_group(0);
            let mut process = command.spawn().unwrap();
            if stand.is_driven_by(&mut process) {
                return Self { stand, process };
            }
        }
        panic!("{profile}: no session came as far as to drive");
    }

    /// Sends the session a signal while its motor is on, and tells when.
    fn signal(&self, signal: Signal) -> i64 {
        soon("a moment with the motor on", || self.stand.motor() != 0);
        let now = monotonic();
        kill_process(Pid::from_child(&self.process), signal).unwrap();
        now
    }

    /// Waits until the motor is off, and has been for a while by the device's own time: it may be off
    /// for a moment only.
    fn stops(&self, since: i64, while_s: f64) {
        soon("the stop", || {
            let trace = self.stand.trace_since(since);
            let at =
                |line: Option<&Line>| line.map_or(0.0, |line| line.entry["at_s"].as_f64().unwrap());
            self.stand.motor() == 0 && at(trace.last()) - at(trace.first()) > while_s
        });
    }

    /// How the session ends, and what it says.
    fn over(&mut self) -> (ExitStatus, String) {
        soon("the session's end", || self.process.try_wait().unwrap().is_some());
        let status = self.process.wait().unwrap();
        let mut told = String::new();
        for pipe in [
            &mut self.process.stdout.take().unwrap() as &mut dyn std::io::Read,
            &mut self.process.stderr.take().unwrap(),
        ] {
            // The guard may still hold the session's port, but no pipe of it.
            pipe.read_to_string(&mut told).unwrap();
        }
        (status, told)
    }
}

impl Drop for Driving {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// From the signal on the motor is stopped, but for a command that was on its way meanwhile.
fn assert_stays_off(trace: &[Line]) {
    let commands: Vec<i64> = trace.iter().filter_map(Line::motor).collect();
    let Some(first) = commands.iter().position(|command| *command == 0) else {
        panic!("it was never stopped: {commands:?}")
    };
    let after = commands[first..].iter().filter(|command| **command != 0).count();
    assert!(after <= 1 && commands.last() == Some(&0), "it drove on: {commands:?}");
}

#[test]
fn a_signal_that_ends_the_session_stops_the_motor_and_the_session_can_go_on() {
    let signals = [(Signal::INT, 130), (Signal::TERM, 143), (Signal::HUP, 129)];
    let cases = PROFILES.iter().flat_map(|profile| signals.map(|signal| (*profile, signal)));
    all_at_once(cases.map(|(profile, (signal, code))| {
        move || {
            let mut driving = Driving::start(profile);
            let since = driving.signal(signal);
            let (ended, told) = driving.over();
            assert_eq!(ended.code(), Some(code), "{profile}: {told}");
            assert_stays_off(&driving.stand.trace_since(since));
            assert_eq!(status(&session_folder(&driving.stand)), "interrupted");
            completes(&driving.stand);
            assert_peaceful(&driving.stand.trace());
        }
    }));
}

#[test]
fn a_session_that_is_killed_or_stands_still_has_a_guard_that_stops_the_motor() {
    let signals = [Signal::KILL, Signal::STOP, Signal::TSTP];
    let cases = PROFILES.iter().flat_map(|profile| signals.map(|signal| (*profile, signal)));
    all_at_once(cases.map(|(profile, signal)| {
        move || {
            let mut driving = Driving::start(profile);
            let since = driving.signal(signal);
            // The guard writes its stops for a second: one that goes on meets it or does not.
            driving.stops(since, if signal == Signal::STOP { 0.5 } else { 2.0 });
            if signal == Signal::KILL {
                assert_eq!(driving.over().0.signal(), Some(9));
            } else {
                // Whatever it was about to do, it finds out that it was stopped.
                let let_go = monotonic();
                kill_process(Pid::from_child(&driving.process), Signal::CONT).unwrap();
                let (ended, told) = driving.over();
                assert_eq!(ended.code(), Some(1), "{profile} {signal:?}: {told}");
                assert!(told.contains("ended early: "), "{told}");
                let is_misnamed = told.contains("is stale") || told.contains("emergency stop");
                assert!(!is_misnamed, "{profile} {signal:?}: {told}");
                let trace = driving.stand.trace_since(let_go);
                let drove = trace.iter().filter_map(Line::motor).filter(|to| *to != 0);
                assert!(drove.count() <= 1, "{profile} {signal:?}: it drove on");
            }
            assert_stays_off(&driving.stand.trace_since(since));
            assert_peaceful(&driving.stand.trace());
        }
    }));
}

/// Longer than states may stay away, and about as long as the guard is patient.
#[test]
fn a_session_that_stands_still_for_a_moment_writes_no_more_than_a_board_holds() {
    let cases = [65, 80, 95, 110].map(|pause_ms| {
        move || {
            // Without the patience of the other tests: a state may be 60 ms late.
            let sets = [
                &ready("physical-cart-pole")[..],
                &["session.phases=[main]", "session.main_duration_s=8.0"],
            ]
            .concat();
            let mut driving = Driving::with("physical-cart-pole", &sets);
            driving.signal(Signal::STOP);
            let mut clock = WallClock::start();
            clock.wait_until(Seconds(f64::from(pause_ms) * 1e-3));
            kill_process(Pid::from_child(&driving.process), Signal::CONT).unwrap();
            let (ended, told) = driving.over();
            assert_eq!(ended.code(), Some(1), "{pause_ms} ms: {told}");
            assert_peaceful(&driving.stand.trace());
        }
    });
    all_at_once(cases);
}

#[test]
fn a_cable_that_is_pulled_ends_the_session_which_goes_on_once_it_is_back() {
    with_both(|profile| {
        let sets = main_for(profile, "session.main_duration_s=10.0");
        for _ in 0..TRIES {
            let faults = "(events: [(at_s: 9.0, what: Unplug(for_s: 1.0))])";
            let stand = Stand::new(program(), profile, &sets, faults);
            let output = ended(stand.armed_session());
            let trace = stand.trace();
            let pulled = trace.iter().position(|line| line.entry["what"] == "gone");
            let was_driving = pulled.is_some_and(|at| {
                trace[..at].iter().rev().find_map(Line::motor).is_some_and(|to| to != 0)
            });
            if !was_driving {
                continue;
            }
            assert_eq!(output.status.code(), Some(1), "{output:?}");
            let told = text(&output.stdout);
            assert!(told.contains("look at the cable"), "{told}");
            assert_eq!(status(&session_folder(&stand)), "aborted");
            soon("the cable", || {
                stand.trace().iter().filter(|line| line.entry["what"] == "port").count() == 2
            });
            completes(&stand);
            assert_peaceful(&stand.end());
            return;
        }
        panic!("{profile}: no session drove when the cable was pulled");
    });
}

/// What the program did with these words.
fn refused(mut command: Command) -> (Option<i32>, String) {
    command.stdin(Stdio::null());
    let Output { status, stderr, .. } = ended(command);
    (status.code(), text(&stderr))
}

fn assert_refused(command: Command, code: i32, words: &str) {
    let (ended, told) = refused(command);
    assert!(ended == Some(code) && told.contains(words), "{ended:?}, not {words:?}: {told}");
}

#[test]
fn wrong_words_are_refused_before_anything_is_touched() {
    let stand = Stand::new(program(), "cobs-cart-pole", &ready("cobs-cart-pole"), "()");
    let serial = format!("--backend serial:{}", stand.port());
    assert_refused(stand.session(&serial), 2, "has to be armed by --arm");
    assert_refused(stand.session("--arm"), 2, "--arm is for a real plant");
    let line = format!("run swing-up --headless --operator simulated:expert --arm {serial}");
    assert_refused(stand.program(&line), 2, "has no section `backend`");
    assert_refused(stand.session("--arm --backend usb"), 2, "is not known");
    assert_eq!(names(&stand.folder.path().join("logs")), [".calibrations"]);
    assert!(stand.end().iter().all(|line| line.entry["what"] != "written"));
}

#[test]
fn a_device_that_cannot_be_driven_is_refused_and_never_moves() {
    let nowhere = |stand: &Stand| stand.session("--arm --backend serial:/dev/nowhere");
    let cases: [(_, _, Begin, _); 6] = [
        ("physical-cart-pole", "()", nowhere, "/dev/nowhere is not there"),
        ("physical-cart-pole", "()", uncalibrated, "never calibrated"),
        ("cobs-cart-pole", "()", uncalibrated, "never calibrated"),
        ("physical-cart-pole", "(version: 17)", Stand::armed_session, "firmware"),
        ("physical-cart-pole", "(version: 27)", Stand::armed_session, "firmware"),
        ("cobs-cart-pole", "(version: 2)", Stand::armed_session, "re-flash the device"),
    ];
    all_at_once(cases.map(|(profile, faults, command, words)| {
        move || {
            let stand = Stand::new(program(), profile, &ready(profile), faults);
            assert_refused(command(&stand), 1, words);
            let trace = stand.end();
            assert!(trace.iter().filter_map(Line::motor).all(|command| command == 0));
        }
    }));
}

#[test]
fn a_board_that_demands_homing_of_a_profile_without_it_is_quoted() {
    let profile = "cobs-cart-pole";
    let sets = [&ready(profile)[..], &["backend.homing=false"]].concat();
    let stand = Stand::new(program(), profile, &sets, "()");
    let output = stand.armed_session().output().unwrap();
    let told = text(&output.stderr) + &text(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("set backend.homing to true"), "{told}");
    assert!(stand.end().iter().filter_map(Line::motor).all(|command| command == 0));
}

/// Begins a session.
type Begin = fn(&Stand) -> Command;

/// A session at a device that nobody has calibrated.
fn uncalibrated(stand: &Stand) -> Command {
    fs::remove_dir_all(stand.folder.path().join("logs")).unwrap();
    stand.armed_session()
}
