//! Sessions that are done once more from what was recorded of them, and compared bit by bit.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

#[path = "program/desk.rs"]
mod desk;

use std::fs;
use std::path::{Path, PathBuf};

use coadapt::clock::{Clock, VirtualClock, WallClock};
use coadapt::control::snapshot::Command;
use coadapt::operator::mouse::Pointer;
use coadapt::operator::terminal::{Hands, Params};
use coadapt::profile::Order;
use coadapt::run::session::{Company, Keys, Session};
use coadapt::session::machine::Stage;
use coadapt::session::{Moment, Phase};
use coadapt::signal::Seconds;
use desk::{Desk, names, text};
use serde_json::Value;

const SHORT: &str = "--set session.introduction_rollouts=2 --set session.autonomous_rollouts=2 \
    --set session.introduction_duration_s=None --set session.main_duration_s=None";

/// A short session of `task` with `more` words.
fn session(desk: &Desk, task: &str, more: &str) -> PathBuf {
    let line = format!("run {task} --headless --seed 7 --json {SHORT} {more}");
    let results: Value = serde_json::from_str(&desk.succeed(&line)).unwrap();
    desk.at(results["session"].as_str().unwrap())
}

/// What `replay --verify` says of the session in `folder`, and its exit code.
fn verdict(desk: &Desk, folder: &Path) -> (Value, Option<i32>) {
    let mut program = desk.program("replay --verify --json");
    let output = program.arg(folder).output().unwrap();
    let verdict = serde_json::from_str(&text(&output.stdout))
        .unwrap_or_else(|_| unreadable(&text(&output.stderr)));
    (verdict, output.status.code())
}

fn unreadable(said: &str) -> Value {
    Value::String(said.to_owned())
}

/// The whole rows of a table, its header left out.
fn rows(folder: &Path, file: &str) -> u64 {
    let text = fs::read_to_string(folder.join(file)).unwrap();
    text.bytes().filter(|byte| *byte == b'\n').count() as u64 - 1
}

fn assert_verified(desk: &Desk, folder: &Path) {
    let (verdict, code) = verdict(desk, folder);
    assert_eq!((&verdict["verified"], code), (&Value::Bool(true), Some(0)), "{verdict}");
    assert_eq!(verdict["schema"], 1);
    assert_eq!(verdict["rows"], rows(folder, "steps.csv"));
    assert!(verdict["difference"].is_null() && verdict["refused"].is_null(), "{verdict}");
}

#[test]
fn sessions_of_every_task_learner_and_mode_are_the_same_once_more() {
    let desk = Desk::new();
    for task in ["balance", "swing-up", "speed-up", "mountain-car"] {
        for (learner, mode) in [("rfwr", "simultaneous"), ("lwpr", "sequential")] {
            let more = format!(
                "--operator simulated:average --rollouts 3 --learner {learner} --mode {mode}"
            );
            let folder = session(&desk, task, &more);
            assert_verified(&desk, &folder);
            let (verdict, _) = verdict(&desk, &folder);
            assert_eq!(verdict["rollouts"], rows(&folder, "episodes.csv"));
            assert_eq!(verdict["partial"], false);
        }
    }
}

#[test]
fn what_our_presets_and_an_agent_do_is_the_same_once_more() {
    let desk = Desk::new();
    for task in ["balance-modern", "swing-up-modern", "speed-up-modern", "mountain-car-modern"] {
        let more = "--operator simulated:expert --rollouts 4 --learner lwpr";
        assert_verified(&desk, &session(&desk, task, more));
    }
    let agent = session(&desk, "mountain-car", "--operator q_learning --rollouts 30");
    assert_verified(&desk, &agent);
    let policy = agent.join("policy.json").display().to_string();
    let alone = format!("--phases autonomous --operator none --policy {policy}");
    assert_verified(&desk, &session(&desk, "mountain-car", &alone));
    let said = text(&desk.run(&format!("replay --verify {}", agent.display())).stdout);
    assert!(said.contains("verified") && said.contains("bit by bit"), "{said}");
}

#[test]
fn a_session_cut_at_any_byte_is_the_same_up_to_there() {
    let desk = Desk::new();
    let whole = session(&desk, "balance", "--operator simulated:average --rollouts 3");
    let steps = fs::read(whole.join("steps.csv")).unwrap();
    let header = steps.iter().position(|byte| *byte == b'\n').unwrap() + 1;
    let cut = desk.at("cut");
    fs::create_dir(&cut).unwrap();
    for file in names(&whole) {
        fs::copy(whole.join(&file), cut.join(&file)).unwrap();
    }
    set_status(&cut, "running");
    let (length, last) = (steps.len(), header + 1);
    let after_a_row = steps[..length / 2].iter().rposition(|byte| *byte == b'\n').unwrap() + 1;
    for bytes in [0, 10, header, last, length / 3, length / 2, after_a_row, length - 1, length] {
        fs::write(cut.join("steps.csv"), &steps[..bytes]).unwrap();
        let (verdict, code) = verdict(&desk, &cut);
        let lines = steps[..bytes].split_inclusive(|byte| *byte == b'\n');
        let kept = lines.filter(|line| line.ends_with(b"\n")).count();
        assert_eq!(code, Some(if kept > 1 { 0 } else { 2 }), "{bytes}: {verdict}");
        assert_eq!(verdict["verified"], kept > 1, "{bytes}: {verdict}");
        assert_eq!(verdict["partial"], true, "{bytes}: {verdict}");
        assert_eq!(verdict["rows"], kept.saturating_sub(1), "{bytes}: {verdict}");
    }
    // The other table may have been cut as well.
    let episodes = fs::read(whole.join("episodes.csv")).unwrap();
    fs::write(cut.join("episodes.csv"), &episodes[..episodes.len() / 2]).unwrap();
    assert_verified(&desk, &cut);
}

/// Changes how the session in `folder` ended.
fn set_status(folder: &Path, status: &str) {
    let sidecar = folder.join("session.json");
    let kept = fs::read_to_string(&sidecar).unwrap();
    let changed = kept.replace("\"status\": \"complete\"", &format!("\"status\": \"{status}\""));
    assert_ne!(changed, kept);
    fs::write(&sidecar, changed).unwrap();
}

/// The first so many lines of `text`.
fn head(text: &str, lines: usize) -> String {
    text.split_inclusive('\n').take(lines).collect()
}

#[test]
fn rows_that_a_complete_session_lacks_or_has_too_many_are_named() {
    let desk = Desk::new();
    let folder = session(&desk, "balance", "--operator simulated:average --rollouts 3");
    let (steps, episodes) = (folder.join("steps.csv"), folder.join("episodes.csv"));
    let whole =
        ["steps.csv", "episodes.csv"].map(|file| fs::read_to_string(folder.join(file)).unwrap());
    let [rows, rollouts] = whole.each_ref().map(|text| text.lines().count());
    let differs = |file: &str, line: usize, status: &str| {
        let (verdict, code) = verdict(&desk, &folder);
        let found = &verdict["difference"];
        assert_eq!((code, &verdict["verified"]), (Some(1), &Value::Bool(false)), "{verdict}");
        assert_eq!((&found["file"], &found["line"]), (&file.into(), &line.into()), "{status}");
        verdict
    };
    // In a rollout, after one, and without the last row of all.
    let after_one = 1 + whole[0].lines().position(|row| row.starts_with("main,2,0,")).unwrap();
    for kept in [2, rows / 2, after_one - 1, rows - 1] {
        fs::write(&steps, head(&whole[0], kept)).unwrap();
        assert_eq!(differs("steps.csv", kept + 1, "complete")["partial"], true);
    }
    fs::write(&steps, "").unwrap();
    let (nothing, code) = verdict(&desk, &folder);
    assert_eq!((code, &nothing["verified"]), (Some(2), &Value::Bool(false)), "{nothing}");
    assert!(nothing["refused"].as_str().unwrap().contains("nothing to compare"), "{nothing}");
    fs::write(&steps, &whole[0]).unwrap();
    for kept in [1, rollouts - 1] {
        fs::write(&episodes, head(&whole[1], kept)).unwrap();
        assert_eq!(differs("episodes.csv", kept + 1, "complete")["partial"], true);
    }
    let last: String = whole[1].split_inclusive('\n').skip(rollouts - 1).collect();
    fs::write(&episodes, format!("{}{last}", whole[1])).unwrap();
    differs("episodes.csv", rollouts + 1, "complete");
    set_status(&folder, "running");
    differs("episodes.csv", rollouts + 1, "running");
    // One that was cut may have kept fewer.
    fs::write(&episodes, head(&whole[1], 2)).unwrap();
    assert_verified(&desk, &folder);
    assert_eq!(verdict(&desk, &folder).0["partial"], true);
}

/// Changes a digit of `column`, the first behind the point, in the row `line` (from 1, the header) of a table, and
/// returns the number before and after.
fn flip(file: &Path, line: usize, column: &str) -> (String, String) {
    let text = fs::read_to_string(file).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let place = lines[0].split(',').position(|name| name == column).unwrap();
    let mut cells: Vec<String> = lines[line - 1].split(',').map(str::to_owned).collect();
    let before = cells[place].clone();
    let at = before.find('.').map_or(before.len() - 1, |point| point + 1);
    let digit = before[at..].chars().next().unwrap().to_digit(10).unwrap();
    let after = format!("{}{}{}", &before[..at], (digit + 1) % 10, &before[at + 1..]);
    cells[place].clone_from(&after);
    lines[line - 1] = cells.join(",");
    fs::write(file, lines.join("\n") + "\n").unwrap();
    (before, after)
}

#[test]
fn a_single_changed_digit_is_named() {
    let desk = Desk::new();
    let folder = session(&desk, "balance", "--operator simulated:average --rollouts 3");
    let steps = folder.join("steps.csv");
    let whole = fs::read_to_string(&steps).unwrap();
    let line = 1 + whole.lines().position(|row| row.starts_with("main,2,30,")).unwrap();
    for column in ["x", "theta_dot", "u_machine", "share", "reward", "success", "u_applied", "t"] {
        let (before, after) = flip(&steps, line, column);
        let (verdict, code) = verdict(&desk, &folder);
        let found = &verdict["difference"];
        assert_eq!((code, &verdict["verified"]), (Some(1), &Value::Bool(false)), "{column}");
        assert_eq!((&found["file"], &found["line"]), (&"steps.csv".into(), &line.into()));
        assert_eq!((&found["phase"], &found["episode"]), (&"main".into(), &2.into()));
        assert_eq!((&found["step"], &found["column"]), (&30.into(), &column.into()), "{found}");
        let same = |cell: &Value, text: &str| {
            let (a, b): (f64, f64) =
                (cell.as_str().unwrap().parse().unwrap(), text.parse().unwrap());
            assert_eq!(a.to_bits(), b.to_bits(), "{cell} {text}");
        };
        same(&found["recorded"], &after);
        same(&found["computed"], &before);
        assert_eq!(verdict["rows"], line - 2);
        fs::write(&steps, &whole).unwrap();
    }
    // What the person did is taken as it stands: its change shows in the action of both.
    flip(&steps, line, "u_human");
    let (changed, _) = verdict(&desk, &folder);
    assert_eq!(changed["difference"]["column"], "u", "{changed}");
    let said = desk.program("replay --verify").arg(&folder).output().unwrap();
    let words = text(&said.stdout);
    assert!(words.contains("main 2, step 30, column u: recorded"), "{words}");
    assert!(words.contains("u_human is taken as recorded"), "{words}");
    fs::write(&steps, &whole).unwrap();

    let episodes = folder.join("episodes.csv");
    let kept = fs::read_to_string(&episodes).unwrap();
    flip(&episodes, 4, "return");
    let (verdict, _) = verdict(&desk, &folder);
    let found = &verdict["difference"];
    assert_eq!((&found["file"], &found["line"]), (&"episodes.csv".into(), &4.into()), "{found}");
    assert_eq!(found["column"], "return");
    fs::write(&episodes, kept.replace("failed", "goal")).unwrap();
    assert_eq!(self::verdict(&desk, &folder).0["difference"]["column"], "end");
}

#[test]
fn a_row_that_is_missing_is_named() {
    let desk = Desk::new();
    let folder = session(&desk, "balance", "--operator simulated:average --rollouts 2");
    let steps = folder.join("steps.csv");
    let whole = fs::read_to_string(&steps).unwrap();
    let kept: Vec<&str> = whole.lines().filter(|row| !row.starts_with("main,1,12,")).collect();
    fs::write(&steps, kept.join("\n") + "\n").unwrap();
    let (verdict, code) = verdict(&desk, &folder);
    let found = &verdict["difference"];
    assert_eq!((code, &found["column"]), (Some(1), &"step".into()), "{verdict}");
    assert_eq!((&found["recorded"], &found["computed"]), (&"13".into(), &"12".into()));
}

#[test]
fn a_resumed_session_is_the_same_once_more() {
    let desk = Desk::new();
    let order = Order {
        profile: "balance".to_owned(),
        operator: "simulated:expert".to_owned(),
        seed: Some(3),
        logs: desk.at("logs"),
        sets: [("session.introduction_rollouts", "2"), ("session.main_rollouts", "8")]
            .map(|(key, value)| (key.to_owned(), value.to_owned()))
            .to_vec(),
        ..Order::default()
    };
    let session = Session::begin(&order, &Company::Headless).unwrap();
    let folder = session.folder().to_owned();
    let watcher = session.watcher.clone();
    let leave_in_the_middle = move || {
        let is_there = |m: Moment| m.phase == Phase::Main && m.rollout >= 2 && m.step > 50;
        if watcher.look().stage.moment().is_some_and(is_there) {
            watcher.insist(Command::Abort("enough".to_owned()));
        }
    };
    session.run(&mut attended(leave_in_the_middle), || None).unwrap();
    assert!(fs::read_to_string(folder.join("episodes.csv")).unwrap().contains("aborted"));
    assert_verified(&desk, &folder);
    let session = Session::resume(&folder, &Company::Headless).unwrap();
    session.run(&mut VirtualClock::default(), || None).unwrap();
    let events = fs::read_to_string(folder.join("events.csv")).unwrap();
    assert!(events.contains("resumed"), "{events}");
    assert_verified(&desk, &folder);
}

/// Virtual time, at each moment of which a person may do something.
struct Attended<F> {
    time: VirtualClock,
    at_each: F,
}

impl<F: FnMut() + Send> Clock for Attended<F> {
    fn now(&self) -> Seconds {
        self.time.now()
    }

    fn wait_until(&mut self, deadline: Seconds) -> Seconds {
        (self.at_each)();
        self.time.wait_until(deadline)
    }

    fn is_wall(&self) -> bool {
        false
    }
}

fn attended<F: FnMut() + Send>(at_each: F) -> Attended<F> {
    Attended { time: VirtualClock::default(), at_each }
}

#[test]
fn a_session_with_pauses_stops_and_discarded_rollouts_is_the_same_once_more() {
    let desk = Desk::new();
    let order = Order {
        profile: "balance".to_owned(),
        operator: "simulated:expert".to_owned(),
        seed: Some(5),
        logs: desk.at("logs"),
        sets: [
            ("session.introduction_rollouts", "3"),
            ("session.main_rollouts", "12"),
            ("session.autonomous_rollouts", "3"),
        ]
        .map(|(key, value)| (key.to_owned(), value.to_owned()))
        .to_vec(),
        ..Order::default()
    };
    let keys = Keys {
        hands: Hands::new(&Params::default()),
        pointer: Pointer::default(),
        clock: WallClock::start(),
    };
    let session = Session::begin(&order, &Company::Attended(keys)).unwrap();
    let (folder, watcher) = (session.folder().to_owned(), session.watcher.clone());
    let mut turn = 0;
    // Who reads nothing, and throws away, stops, pauses or leaves alone one rollout after the other.
    let be_impatient = move || match watcher.look().stage {
        Stage::Running(moment) if moment.step == 21 && turn < 40 => {
            turn += 1;
            let wishes = [None, Some(Command::Discard), Some(Command::Pause), Some(Command::Stop)];
            wishes[turn % 4].clone().map(|wish| watcher.ask(wish));
        }
        Stage::Instruction(_) | Stage::Break { .. } | Stage::Paused(_) | Stage::Stopped(_) => {
            watcher.ask(Command::Begin);
        }
        _ => {}
    };
    session.run(&mut attended(be_impatient), || None).unwrap();
    let episodes = fs::read_to_string(folder.join("episodes.csv")).unwrap();
    let discarded = |phase: &str| {
        let of_phase = episodes.lines().filter(|row| row.starts_with(phase));
        of_phase.filter(|row| row.contains("discarded")).count()
    };
    assert!(discarded("main") >= 2, "{episodes}");
    let events = fs::read_to_string(folder.join("events.csv")).unwrap();
    assert!(events.contains("pause") && events.contains("stop"), "{events}");
    assert_verified(&desk, &folder);
}

#[test]
fn what_cannot_be_done_once_more_is_said() {
    let desk = Desk::new();
    let folder = session(&desk, "balance", "--operator none --rollouts 1");
    let here = folder.display().to_string();
    // Standard output is no terminal here.
    let output = desk.run(&format!("replay {here}"));
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("--verify"), "{}", text(&output.stderr));
    let sidecar = folder.join("session.json");
    let kept = fs::read_to_string(&sidecar).unwrap();
    let real = kept.replace("\"backend\": \"simulated\"", "\"backend\": \"serial:/dev/ttyACM0\"");
    assert_ne!(real, kept);
    fs::write(&sidecar, real).unwrap();
    let (verdict, code) = verdict(&desk, &folder);
    assert_eq!((code, &verdict["verified"]), (Some(2), &Value::Bool(false)));
    assert!(verdict["refused"].as_str().unwrap().contains("real plant"), "{verdict}");
    fs::write(&sidecar, kept.replace("\"schema\": 1", "\"schema\": 9")).unwrap();
    let said = text(&desk.run(&format!("replay {here} --verify")).stderr);
    assert!(said.contains("newer coadapt"), "{said}");
    fs::write(&sidecar, &kept).unwrap();
    fs::write(folder.join("steps.csv"), "a,b\n1,2\n").unwrap();
    let output = desk.run(&format!("replay {here} --verify"));
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("steps.csv, line 1"), "{}", text(&output.stderr));
    for (path, said) in [
        ("nowhere", "no such folder"),
        (".", "session.json is missing"),
        ("logs", "give one of them, such as logs/"),
    ] {
        let output = desk.run(&format!("replay {path} --verify"));
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains(said), "{}", text(&output.stderr));
    }
}
