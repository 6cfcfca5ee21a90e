//! Hands on a gamepad, the whole way from an event to the plant and the files, on virtual time.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

#[path = "program/desk.rs"]
#[expect(dead_code, reason = "shared with tests that need more of it")]
mod desk;

use std::fs;
use std::path::PathBuf;

use desk::{Desk, text};
use serde_json::Value;

/// A session of three seconds at the ball and beam, after a countdown of two.
const SHORT: &str = "run speed-up --headless --seed 1 --duration 3 --phases main,autonomous \
    --set session.autonomous_rollouts=1 --set session.hold_s=2 --operator gamepad:script=events.csv";

/// What a session left behind.
struct Left {
    _desk: Desk,
    folder: PathBuf,
    stdout: String,
    stderr: String,
    code: i32,
}

impl Left {
    /// A session with these events, and more words.
    fn by(events: &str, words: &str) -> Self {
        let desk = Desk::new();
        let table = format!("t,event,pad,what,value\n{events}");
        fs::write(desk.at("events.csv"), table).unwrap();
        let output = desk.run(&format!("{SHORT} {words}"));
        let folder = desk.at("logs/anon/001-speed-up-simultaneous");
        let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
        let code = output.status.code().unwrap();
        Self { _desk: desk, folder, stdout, stderr, code }
    }

    fn table(&self, name: &str) -> Vec<csv::StringRecord> {
        let mut reader = csv::Reader::from_path(self.folder.join(name)).unwrap();
        reader.records().map(Result::unwrap).collect()
    }

    /// What happened, in order: the event and its cause.
    fn events(&self) -> Vec<String> {
        let row = |row: csv::StringRecord| format!("{} {}", &row[4], &row[5]).trim().to_owned();
        self.table("events.csv").into_iter().map(row).collect()
    }

    /// The columns `u_human` and `raw` of main, empty where nobody was there.
    fn hands(&self) -> Vec<(Option<f64>, Option<f64>)> {
        let mut reader = csv::Reader::from_path(self.folder.join("steps.csv")).unwrap();
        let headers = reader.headers().unwrap().clone();
        let at = |name: &str| headers.iter().position(|column| column == name).unwrap();
        let (human, raw, applied) = (at("u_human"), at("raw"), at("u_applied"));
        reader
            .records()
            .map(Result::unwrap)
            .filter(|row| &row[0] == "main" && !row[applied].is_empty())
            .map(|row| (row[human].parse().ok(), row[raw].parse().ok()))
            .collect()
    }

    fn session(&self) -> Value {
        serde_json::from_slice(&fs::read(self.folder.join("session.json")).unwrap()).unwrap()
    }
}

#[test]
fn a_deflection_goes_through_the_shape_to_the_plant_and_both_are_recorded() {
    let left = Left::by(
        "0,connect,1,Pad,\n0,axis,1,left_stick_x,0\n2,axis,1,left_stick_x,0.55\n\
         3,axis,1,left_stick_x,0.05\n4,axis,1,left_stick_x,-1\n",
        "--set operator.gamepad.shape.outer_zone=0 --set operator.gamepad.shape.exponent=2",
    );
    assert_eq!(left.code, 0, "{}", left.stderr);
    let hands = left.hands();
    assert_eq!(hands.len(), 150);
    // (0.55 − 0.1) / 0.9 = 0.5, squared, of 10 V.
    let (human, raw) = hands[20];
    assert!((human.unwrap() - 2.5).abs() < 1e-9 && raw == Some(0.55), "{human:?} {raw:?}");
    assert_eq!(hands[70], (Some(0.0), Some(0.05)));
    assert_eq!(hands[149], (Some(-10.0), Some(-1.0)));
    let devices = left.session()["devices"].to_string();
    assert!(devices.contains("gamepad Pad, left_stick_x"), "{devices}");
}

#[test]
fn an_unplugged_pad_pauses_the_rollout_at_once_and_the_stick_passes_its_centre_first() {
    let left = Left::by(
        "0,connect,1,Pad,\n0,axis,1,left_stick_x,0\n0,axis,1,left_stick_x,1\n\
         2.5,disconnect,1,,\n\
         10,connect,1,Pad,\n10,axis,1,left_stick_x,1\n10.1,press,1,start,\n\
         10.2,release,1,start,\n11,axis,1,left_stick_x,0\n11.1,axis,1,left_stick_x,-1\n\
         11.2,press,1,start,\n",
        "",
    );
    assert_eq!(left.code, 0, "{}", left.stderr);
    assert_eq!(
        left.events()[1..9],
        [
            "device Pad steers",
            "device_gone Pad was unplugged",
            "pause",
            "device_back Pad is plugged in",
            // The start button at 10.1 s goes on, but not without the stick.
            "begin",
            "pause",
            "begin",
            "phase",
        ]
    );
    // Full to the right until the very tick, then full to the left; nobody in between.
    let hands = left.hands();
    let turn = hands.iter().position(|(human, _)| *human == Some(-10.0)).unwrap();
    assert!(hands[..turn].iter().all(|(human, _)| *human == Some(10.0)), "{hands:?}");
    assert!(hands[turn..].iter().all(|(human, _)| *human == Some(-10.0)));
    assert_eq!((turn, hands.len()), (24, 150));
}

#[test]
fn buttons_pause_stop_discard_and_begin() {
    let press =
        |t: f64, button: &str| format!("{t},press,1,{button},\n{},release,1,{button},\n", t + 0.02);
    let table = ["0,connect,1,Pad,\n".to_owned()]
        .into_iter()
        .chain(
            [(2.2, "select"), (2.4, "select"), (5.0, "east"), (6.0, "start")]
                .map(|(t, b)| press(t, b)),
        )
        .chain([press(8.5, "north")])
        .collect::<String>();
    let left = Left::by(&table, "");
    assert_eq!(left.code, 0, "{}", left.stderr);
    let events = left.events();
    let asked: Vec<&String> =
        events.iter().filter(|e| !e.starts_with("phase") && !e.starts_with("device")).collect();
    assert_eq!(asked, ["pause", "go_on", "stop", "begin", "discard", "complete"]);
    let ends: Vec<String> = left
        .table("episodes.csv")
        .iter()
        .filter(|r| &r[0] == "main")
        .map(|r| r[5].to_owned())
        .collect();
    assert_eq!(ends, ["discarded", "discarded", "time"]);
}

#[test]
fn a_session_that_waits_for_a_pad_for_ever_is_ended_with_the_reason() {
    let left = Left::by("0,connect,1,Pad,\n3,disconnect,1,,\n", "");
    assert_eq!(left.code, 1);
    assert!(left.stdout.contains("ended early: the session waits"), "{}", left.stdout);
    assert_eq!(left.session()["status"], "aborted");
    // Nor does one begin that never had a pad.
    let none = Left::by("99999,connect,1,Pad,\n", "");
    assert!(none.stdout.contains("ended early"), "{}", none.stdout);
    assert!(none.hands().is_empty());
}

#[test]
fn of_two_pads_one_steers_and_the_other_takes_over_with_its_start_button() {
    let left = Left::by(
        "0,connect,1,Red,\n0,connect,2,Blue,\n0,axis,1,left_stick_x,0\n0,axis,2,left_stick_x,0\n\
         0,axis,1,left_stick_x,1\n0,axis,2,left_stick_x,-1\n3.0,axis,2,left_stick_x,0\n\
         3.02,press,2,start,\n3.1,axis,2,left_stick_x,-1\n",
        "",
    );
    let hands = left.hands();
    assert_eq!(hands[0].0, Some(10.0));
    assert_eq!(hands.last().unwrap().0, Some(-10.0));
    let events = left.events().join("\n");
    assert!(events.contains("device Blue is plugged in and waits; Red steers"), "{events}");
    assert!(events.contains("device_back Blue steers from now on"), "{events}");
    // The profile can pick, by name.
    let picked = Left::by(
        "0,connect,1,Red,\n0,connect,2,Blue,\n0,axis,2,left_stick_x,0\n0,axis,2,left_stick_x,-1\n",
        "--set operator.gamepad.pad=blue",
    );
    assert_eq!(picked.hands()[0].0, Some(-10.0), "{}", picked.stderr);
}

#[test]
fn a_pad_that_is_back_within_the_tick_was_gone_all_the_same() {
    let left = Left::by(
        "0,connect,1,Pad,\n0,axis,1,left_stick_x,0\n0,axis,1,left_stick_x,0.9\n\
         2.5,disconnect,1,,\n2.5,connect,1,Pad,\n2.5,axis,1,left_stick_x,0\n\
         2.5,axis,1,left_stick_x,0.9\n9,press,1,start,\n",
        "",
    );
    assert_eq!(left.code, 0, "{}", left.stderr);
    let events = left.events().join("\n");
    assert!(events.contains("device_gone") && events.contains("pause\nbegin"), "{events}");
}

#[test]
fn a_cut_session_of_a_table_is_not_resumed_at_another_time() {
    let left = Left::by("0,connect,1,Pad,\n3,disconnect,1,,\n", "");
    let line = format!("run --headless --resume {}", left.folder.display());
    let output = Desk::new().run(&line);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("run it anew"), "{}", text(&output.stderr));
}

#[test]
fn nonsense_of_a_device_moves_nothing() {
    let left = Left::by(
        "0,connect,1,Pad,\n0,axis,1,left_stick_x,0.1\n2,axis,1,left_stick_x,nan\n\
         2.2,axis,1,left_stick_x,inf\n2.4,axis,1,right_stick_x,1\n",
        "",
    );
    assert_eq!(left.code, 0);
    assert!(left.hands().iter().all(|hand| *hand == (Some(0.0), Some(0.1))));
    assert!(left.events().iter().any(|event| event.contains("no number; passed over")));
}

#[test]
fn wrong_words_start_nothing() {
    let refuse = |words: &str, told: &[&str]| {
        let left = Left::by("0,connect,1,Pad,\n0,axis,1,left_stick,1\n", words);
        assert_eq!(left.code, 2, "{words}: {}", left.stderr);
        assert!(!left.folder.exists(), "{words}");
        for word in told {
            assert!(left.stderr.contains(word), "{words}: {word}: {}", left.stderr);
        }
    };
    refuse("", &["events.csv", "line 3", "left_stick_x"]);
    refuse("--set operator.gamepad.map.steer=left", &["left_stick_x", "d_pad_y"]);
    refuse("--set operator.gamepad.map.stop=Some(start)", &["map.stop", "another button"]);
    refuse("--set operator.gamepad.shape.dead_zone=1", &["dead_zone", "0 to 0.95", "1 fault"]);
    let desk = Desk::new();
    for (operator, told) in [
        ("gamepad", "a headless session has no gamepad"),
        ("gamepad:relay=-", "has no relayed gamepad"),
        ("gamepad:relay=pad", "gamepad:relay=unix:PATH"),
        ("gamepad:script=none.csv", "none.csv"),
    ] {
        let output = desk.run(&format!("run balance --headless --operator {operator}"));
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains(told), "{}", text(&output.stderr));
    }
}
