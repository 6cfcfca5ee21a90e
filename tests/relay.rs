//! A gamepad on the live screen: none, one at another computer, one that goes and comes back.

#![cfg(unix)]
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking, helpers too")]

#[path = "terminal/desk.rs"]
#[expect(dead_code, reason = "shared with tests that need more of it")]
mod desk;

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use desk::{Seat, Terminal};

/// A pole that hangs about, as long as the test lasts.
const CALM: &str = "run balance --seed 1 --set plant.gravity_m_s2=0 --set rules.fail_deg=90 \
    --set rules.cap_s=600 --set plant.pole_friction_per_s=20 --set session.hold_s=0.1 \
    --phases main --operator";
const FOLDER: &str = "logs/anon/001-balance-simultaneous";

fn coadapt() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_coadapt"));
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// A relay that plays `events` into the session at `socket`: both ends of the pipe.
fn relay(folder: &Path, events: &str) -> [Child; 2] {
    let table = folder.join("events.csv");
    fs::write(&table, format!("t,event,pad,what,value\n{events}")).unwrap();
    let mut near = coadapt().arg("pad-relay").arg("--events").arg(table).spawn().unwrap();
    let socket = format!("unix:{}", folder.join("pad").display());
    let lines = near.stdout.take().unwrap();
    let far = coadapt().args(["pad-relay", "--forward", &socket]).stdin(lines).spawn().unwrap();
    [near, far]
}

fn events(terminal: &Terminal) -> String {
    fs::read_to_string(terminal.at(FOLDER).join("events.csv")).unwrap()
}

fn end(terminal: &mut Terminal) {
    terminal.keys("q");
    terminal.shows("q again ends the session");
    terminal.keys("q");
    terminal.shows("new session");
    terminal.keys("q");
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
}

#[test]
fn without_a_pad_the_session_begins_and_says_what_is_missing() {
    for variables in [vec![], vec![("COADAPT_LIBUDEV", "/nonexistent")]] {
        let mut terminal = Seat { variables, ..Seat::default() }.open(&format!("{CALM} gamepad"));
        terminal.shows("Enter   begin");
        terminal.shows_that("the trouble", |screen| {
            ["no gamepad: plug one in", "gamepads cannot be reached", "built without gamepads"]
                .iter()
                .any(|words| screen.contains(words))
        });
        terminal.keys("\r");
        terminal.shows("PAUSED");
        end(&mut terminal);
    }
}

#[test]
fn a_relayed_pad_steers_and_its_end_pauses_until_another_comes() {
    let mut terminal = Seat::default().open(&format!("{CALM} gamepad:relay=unix:pad"));
    terminal.shows("no relay yet");
    let desk = terminal.at("");
    // The pad's own button begins.
    let mut first = relay(
        &desk,
        "0,connect,0,Far Pad,\n0,axis,0,left_stick_x,0\n0.5,press,0,start,\n\
         0.6,axis,0,left_stick_x,-1\n4,disconnect,0,,\n",
    );
    terminal.goes();
    terminal.shows("relay");
    terminal.shows("−10.0 N");
    terminal.shows("PAUSED");
    terminal.shows("the relay has ended");
    for end in &mut first {
        assert!(end.wait().unwrap().success());
    }
    let mut second = relay(
        &desk,
        "0,connect,0,Far Pad,\n0.1,axis,0,left_stick_x,1\n1,axis,0,left_stick_x,0\n\
         1.1,press,0,start,\n1.2,axis,0,left_stick_x,1\n30,disconnect,0,,\n",
    );
    terminal.shows("through its centre");
    terminal.goes();
    terminal.shows("+10.0 N");
    end(&mut terminal);
    for end in &mut second {
        let _ = end.kill();
        end.wait().unwrap();
    }
    let told = events(&terminal);
    let order = ["Far Pad steers", "begin", "device_gone", "pause", "device_back", "begin"];
    let mut from = 0;
    for word in order {
        from += told[from..].find(word).unwrap_or_else(|| panic!("{word} in {told}"));
    }
    let pushes = terminal.pushes(FOLDER);
    assert!(pushes.contains(&-10.0) && pushes.contains(&10.0));
    let raw = terminal.column(FOLDER, "raw");
    assert!(raw.contains(&-1.0) && raw.contains(&1.0));
    assert!(terminal.session(FOLDER)["devices"].to_string().contains("gamepad Far Pad"));
    assert!(!terminal.at("pad").exists());
}

#[test]
fn a_stalled_link_is_nobodys_wish_until_lines_come_again() {
    let mut terminal = Seat::default().open(&format!("{CALM} gamepad:relay=unix:pad"));
    terminal.shows("no relay yet");
    let mut ends = relay(
        &terminal.at(""),
        "0,connect,0,Far Pad,\n0,axis,0,left_stick_x,0\n0.5,press,0,start,\n\
         0.6,axis,0,left_stick_x,1\n60,disconnect,0,,\n",
    );
    terminal.goes();
    terminal.shows("+10.0 N");
    let signal = |name: &str| {
        let line = format!("kill -{name} {}", ends[0].id());
        assert!(Command::new("sh").args(["-c", &line]).status().unwrap().success());
    };
    signal("STOP");
    // Nobody steers at once; after a second the rollout waits.
    terminal.shows("away");
    terminal.shows("PAUSED");
    terminal.shows("the relay is silent");
    signal("CONT");
    // Its stick is still out.
    terminal.shows("through its centre");
    end(&mut terminal);
    for end in &mut ends {
        let _ = end.kill();
        end.wait().unwrap();
    }
    let told = events(&terminal);
    assert!(told.contains("device_gone,the relay is silent"), "{told}");
    assert!(told.contains("device_back,the relay is heard again"), "{told}");
}

#[test]
fn a_tap_is_never_swallowed_and_a_second_relay_is_told_so() {
    // Pressed and let go at the same time, before any line goes out.
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("events.csv");
    let taps = "0,connect,0,Pad,\n0.5,press,0,east,\n0.5,release,0,east,\n";
    fs::write(&table, format!("t,event,pad,what,value\n{taps}")).unwrap();
    let output = coadapt().args(["pad-relay", "--events"]).arg(table).output().unwrap();
    let lines = String::from_utf8(output.stdout).unwrap();
    assert_eq!(lines.matches("\"pressed\":[\"east\"]").count(), 1, "{lines}");

    let mut terminal = Seat::default().open(&format!("{CALM} gamepad:relay=unix:pad"));
    terminal.shows("no relay yet");
    let quiet = "0,connect,0,First,\n0,axis,0,left_stick_x,0\n60,disconnect,0,,\n";
    let mut first = relay(&terminal.at(""), quiet);
    terminal.shows("gamepad First");
    let loud = quiet.replace("First", "Second").replace("stick_x,0", "stick_x,1");
    let [mut near, far] = relay(&terminal.at(""), &loud);
    let told = far.wait_with_output().unwrap();
    assert_eq!(told.status.code(), Some(1));
    let words = String::from_utf8(told.stderr).unwrap();
    assert!(words.contains("another relay steers this session already"), "{words}");
    near.kill().unwrap();
    near.wait().unwrap();
    terminal.shows("gamepad First");
    end(&mut terminal);
    for end in &mut first {
        let _ = end.kill();
        end.wait().unwrap();
    }
}

#[test]
fn wrong_words_and_missing_ends_are_told() {
    let run = |words: &[&str]| {
        let output = coadapt().arg("pad-relay").args(words).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (code, told) = run(&["--forward", "tcp:1"]);
    assert!(code == Some(2) && told.contains("unix:PATH"), "{told}");
    let (code, told) = run(&["--forward", "unix:/nonexistent/pad"]);
    assert!(code == Some(1) && told.contains("first start coadapt run"), "{told}");
    let (code, told) = run(&["--events", "/nonexistent.csv"]);
    assert!(code == Some(2) && told.contains("cannot read the events"), "{told}");
    // A reader that has seen enough is no fault.
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("events.csv");
    fs::write(&table, "t,event,pad,what,value\n0,connect,0,Pad,\n60,disconnect,0,,\n").unwrap();
    let mut relay = coadapt().args(["pad-relay", "--events"]).arg(table).spawn().unwrap();
    drop(relay.stdout.take());
    assert!(relay.wait().unwrap().success());
    // Lines on a terminal are keys.
    let mut terminal = Seat::default().open("run balance --operator gamepad:relay=-");
    assert_eq!(terminal.code(), 2);
    assert!(terminal.wrote("which is a terminal here"));
}
