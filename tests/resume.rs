//! Sessions that were killed, told to end or short of disk, and go on where they stood.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

#[path = "program/desk.rs"]
mod desk;

use std::cell::Cell;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::LazyLock;

use coadapt::clock::{Clock, VirtualClock, WallClock};
use coadapt::profile::Order;
use coadapt::record::Status;
use coadapt::run::outcome::Finished;
use coadapt::run::session::{Company, Session};
use coadapt::signal::Seconds;
use desk::{Desk, names, text};
use serde_json::Value;

/// Long enough to be killed in every phase: experts keep the pole up for the full 20 s.
const LONG: &str = "run balance --headless --operator simulated:expert --seed 5 --json \
    --rollouts 40 --set session.introduction_rollouts=6 --set session.autonomous_rollouts=10";
const FOLDER: &str = "logs/anon/001-balance-simultaneous";
const RESUME: &str = "run --headless --json --resume logs/anon/001-balance-simultaneous";

/// The same session, never cut.
static UNBROKEN: LazyLock<(Desk, Value)> = LazyLock::new(|| {
    let desk = Desk::new();
    let results = serde_json::from_str(&desk.succeed(LONG)).unwrap();
    (desk, results)
});

fn unbroken() -> PathBuf {
    UNBROKEN.0.at(FOLDER)
}

/// The program at work; killed if a test fails.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Running {
    /// The long session, as soon as its `steps.csv` holds `bytes`.
    fn until(desk: &Desk, bytes: u64) -> Self {
        Self::start(desk, LONG).once("steps.csv", bytes, desk)
    }

    fn start(desk: &Desk, line: &str) -> Self {
        let mut program = Command::new(env!("CARGO_BIN_EXE_coadapt"));
        program.args(line.split_whitespace()).current_dir(desk.at(""));
        Self(program.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap())
    }

    /// The same, as soon as `file` of the session holds `bytes`.
    fn once(self, file: &str, bytes: u64, desk: &Desk) -> Self {
        self.once_in(&desk.at(FOLDER).join(file), bytes)
    }

    fn once_in(mut self, file: &Path, bytes: u64) -> Self {
        let mut clock = WallClock::start();
        while fs::metadata(file).map_or(0, |file| file.len()) < bytes {
            assert_eq!(self.0.try_wait().unwrap(), None, "over before {bytes} bytes");
            assert!(clock.now() < Seconds(60.0), "no {bytes} bytes in a minute");
            clock.wait_until(clock.now() + Seconds(0.001));
        }
        self
    }

    fn killed(mut self) {
        self.0.kill().unwrap();
        assert_eq!(self.0.wait().unwrap().signal(), Some(9), "over before it was killed");
    }

    fn signalled(mut self, signal: &str) -> ExitStatus {
        let line = format!("kill -{signal} {}", self.0.id());
        assert!(Command::new("sh").args(["-c", &line]).status().unwrap().success());
        self.0.wait().unwrap()
    }
}

/// The part of the unbroken session's rows at which one may be cut.
fn bytes(part: f64) -> u64 {
    let all = fs::metadata(unbroken().join("steps.csv")).unwrap().len();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        clippy::cast_sign_loss,
        reason = "a file's size"
    )]
    let bytes = (all as f64 * part) as u64;
    bytes
}

fn assert_whole_rows(folder: &Path) {
    for (file, columns) in [("steps.csv", 18), ("episodes.csv", 11), ("events.csv", 6)] {
        let text = fs::read_to_string(folder.join(file)).unwrap();
        // What comes after the last line's end is the cut row.
        let whole = &text[..=text.rfind('\n').unwrap()];
        let mut rows = csv::ReaderBuilder::new().has_headers(false).from_reader(whole.as_bytes());
        for row in rows.records() {
            assert_eq!(row.unwrap().len(), columns, "{file}");
        }
    }
}

/// Goes on with the session on `desk`, which then is the unbroken one.
fn assert_goes_on(desk: &Desk) {
    let mut results: Value = serde_json::from_str(&desk.succeed(RESUME)).unwrap();
    results["session"] = UNBROKEN.1["session"].clone();
    assert_eq!(results, UNBROKEN.1);
    let (folder, expected) = (desk.at(FOLDER), unbroken());
    assert_eq!(names(&folder), names(&expected));
    let replaced = ["session.json", "events.csv", "checkpoint.json"];
    for name in names(&expected).iter().filter(|name| !replaced.contains(&name.as_str())) {
        let same = fs::read(folder.join(name)).unwrap() == fs::read(expected.join(name)).unwrap();
        assert!(same, "{name} differs after a resume");
    }
    let events = fs::read_to_string(folder.join("events.csv")).unwrap();
    assert!(events.contains("resume"), "{events}");
    assert_eq!(status(&folder), "complete");
}

fn status(folder: &Path) -> String {
    let text = fs::read_to_string(folder.join("session.json")).unwrap();
    let session: Value = serde_json::from_str(&text).unwrap();
    session["status"].as_str().unwrap().to_owned()
}

fn is_killed_and_goes_on(part: f64) {
    let desk = Desk::new();
    Running::until(&desk, bytes(part)).killed();
    assert_whole_rows(&desk.at(FOLDER));
    assert_goes_on(&desk);
}

/// A session of `words` that is killed with half of its rows and goes on has the rows and
/// policies of one that was never cut.
fn goes_on_like_unbroken(task: &str, words: &str) {
    let (whole, cut) = (Desk::new(), Desk::new());
    let line = format!("run {task} --headless --seed 5 --json {words}");
    let expected: Value = serde_json::from_str(&whole.succeed(&line)).unwrap();
    let folder = format!("logs/anon/001-{task}-simultaneous");
    let steps = |desk: &Desk| desk.at(&folder).join("steps.csv");
    let half = fs::metadata(steps(&whole)).unwrap().len() / 2;
    Running::start(&cut, &line).once_in(&steps(&cut), half).killed();
    let resumed = cut.succeed(&format!("run --headless --json --resume {folder}"));
    let mut resumed: Value = serde_json::from_str(&resumed).unwrap();
    resumed["session"] = expected["session"].clone();
    assert_eq!(resumed, expected, "{task}");
    let replaced = ["session.json", "events.csv", "checkpoint.json"];
    for name in names(&whole.at(&folder)).iter().filter(|n| !replaced.contains(&n.as_str())) {
        let read = |desk: &Desk| fs::read(desk.at(&folder).join(name)).unwrap();
        assert!(read(&whole) == read(&cut), "{task}: {name} differs after a resume");
    }
}

#[test]
fn a_swing_up_that_runs_on_goes_on_after_a_kill() {
    goes_on_like_unbroken(
        "swing-up",
        "--operator simulated:average:mouse-limited --set session.main_duration_s=900 \
         --set teaching.delay_s=0.1",
    );
}

#[test]
fn a_threshold_found_in_practice_survives_a_kill() {
    goes_on_like_unbroken(
        "speed-up",
        "--operator simulated:average --set session.main_duration_s=1200 \
         --set rules.threshold_of_own=0.8 --set sharing.freeze=share_and_learner",
    );
}

#[test]
fn shares_that_move_each_episode_survive_a_kill() {
    goes_on_like_unbroken("mountain-car", "--operator simulated:naive --rollouts 250");
}

#[test]
fn what_the_agent_learned_survives_a_kill() {
    goes_on_like_unbroken(
        "mountain-car",
        "--operator q_learning --rollouts 60 --set simulated.q_learning.lambda=Some(0.9)",
    );
}

#[test]
fn a_damaged_table_of_the_agent_is_refused() {
    let desk = Desk::new();
    let line = "run mountain-car --headless --operator q_learning --seed 5 --rollouts 2000";
    let folder = desk.at("logs/anon/001-mountain-car-simultaneous");
    Running::start(&desk, line).once_in(&folder.join("steps.csv"), 1_000_000).killed();
    let file = folder.join("checkpoint.json");
    let mut checkpoint: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    let table = checkpoint["operator"].as_array_mut().unwrap();
    assert!(table.len() > 100);
    table[0] = 0.5.into();
    fs::write(&file, checkpoint.to_string()).unwrap();
    let resume = "run --headless --resume logs/anon/001-mountain-car-simultaneous";
    let refused = desk.run(resume);
    assert_eq!(refused.status.code(), Some(1));
    assert!(text(&refused.stderr).contains("q_learning had learned"), "{}", text(&refused.stderr));
}

#[test]
fn a_session_killed_at_its_beginning_goes_on() {
    let desk = Desk::new();
    Running::start(&desk, LONG).once("checkpoint.json", 1, &desk).killed();
    assert_goes_on(&desk);
}

#[test]
fn a_session_killed_in_practice_goes_on() {
    is_killed_and_goes_on(0.03);
}

#[test]
fn a_session_killed_early_in_main_goes_on() {
    is_killed_and_goes_on(0.2);
}

#[test]
fn a_session_killed_late_in_main_goes_on() {
    is_killed_and_goes_on(0.6);
}

#[test]
fn a_session_killed_while_the_robot_is_alone_goes_on() {
    is_killed_and_goes_on(0.85);
}

#[test]
fn a_session_killed_twice_goes_on() {
    let desk = Desk::new();
    Running::until(&desk, bytes(0.1)).killed();
    Running::start(&desk, RESUME).once("steps.csv", bytes(0.4), &desk).killed();
    assert_goes_on(&desk);
}

#[test]
fn rows_cut_at_any_byte_after_the_checkpoint_are_dropped() {
    let killed = Desk::new();
    Running::until(&killed, bytes(0.3)).killed();
    let folder = killed.at(FOLDER);
    let checkpoint: Value =
        serde_json::from_slice(&fs::read(folder.join("checkpoint.json")).unwrap()).unwrap();
    let kept = checkpoint["steps_bytes"].as_u64().unwrap();
    let written = fs::metadata(folder.join("steps.csv")).unwrap().len();
    assert!(written >= kept);
    for length in [kept, kept + 1, kept.midpoint(written), written.max(kept + 1) - 1] {
        let desk = Desk::new();
        fs::create_dir_all(desk.at(FOLDER)).unwrap();
        for name in names(&folder) {
            fs::copy(folder.join(&name), desk.at(FOLDER).join(&name)).unwrap();
        }
        let steps = fs::File::options().write(true).open(desk.at(FOLDER).join("steps.csv"));
        steps.unwrap().set_len(length).unwrap();
        assert_goes_on(&desk);
    }
}

#[test]
fn a_signal_ends_a_session_that_says_so_and_goes_on() {
    for (signal, code) in [("TERM", 143), ("INT", 130), ("HUP", 129)] {
        let desk = Desk::new();
        let status_code = Running::until(&desk, bytes(0.2)).signalled(signal);
        assert_eq!(status_code.code(), Some(code), "SIG{signal}");
        assert_eq!(status(&desk.at(FOLDER)), "interrupted");
        assert_whole_rows(&desk.at(FOLDER));
        let events = fs::read_to_string(desk.at(FOLDER).join("events.csv")).unwrap();
        assert!(events.contains(&format!("SIG{signal}")), "{events}");
        assert_goes_on(&desk);
    }
}

#[test]
fn a_session_that_filled_its_disk_goes_on() {
    let desk = Desk::new();
    // Ignored, the limit on file sizes is an error of `write`, as a full disk is.
    let line =
        format!("trap '' XFSZ; ulimit -f 4000; exec {} {LONG}", env!("CARGO_BIN_EXE_coadapt"));
    let full = Command::new("sh").args(["-c", &line]).current_dir(desk.at("")).output().unwrap();
    assert_eq!((full.status.code(), text(&full.stdout)), (Some(1), String::new()));
    let message = text(&full.stderr);
    assert!(message.contains("steps.csv") && message.contains("--resume"), "{message}");
    assert_eq!(status(&desk.at(FOLDER)), "failed");
    assert_goes_on(&desk);
}

#[test]
fn a_complete_session_is_refused_and_left_alone() {
    let desk = Desk::new();
    desk.succeed("run balance --headless --operator none --seed 1 --rollouts 2 --phases main");
    let folder = desk.at(FOLDER);
    let contents = || -> Vec<Vec<u8>> {
        names(&folder).iter().map(|name| fs::read(folder.join(name)).unwrap()).collect()
    };
    let before = contents();
    let refused = desk.run(RESUME);
    assert_eq!((refused.status.code(), text(&refused.stdout)), (Some(2), String::new()));
    assert!(text(&refused.stderr).contains("complete"), "{}", text(&refused.stderr));
    assert!(before == contents(), "a refused session was changed");
}

#[test]
fn a_session_that_still_runs_is_not_taken_over() {
    let desk = Desk::new();
    let running = Running::until(&desk, bytes(0.05));
    let refused = desk.run(RESUME);
    assert_eq!((refused.status.code(), text(&refused.stdout)), (Some(2), String::new()));
    running.killed();
    assert_goes_on(&desk);
}

/// A small session into `logs`, which hears of a signal when it has asked for one often.
fn evaluated(logs: PathBuf, asks_until_signal: u32) -> (Finished, u32) {
    let operator = "simulated:expert".to_owned();
    let mut order = Order { logs, operator, seed: Some(5), ..Order::default() };
    order.change("session.phases", "[main, autonomous]");
    order.change("session.main_rollouts", "10");
    order.change("session.autonomous_rollouts", "5");
    let asked = Cell::new(0);
    let signal = || {
        asked.set(asked.get() + 1);
        (asked.get() > asks_until_signal).then_some(15)
    };
    let session = Session::begin(&order, &Company::Headless).unwrap();
    let finished = session.run(&mut VirtualClock::default(), signal).unwrap();
    (finished, asked.get())
}

#[test]
fn a_signal_ends_the_evaluation_at_once_and_a_resume_completes_it() {
    let desk = Desk::new();
    let (whole, asked) = evaluated(desk.at("whole"), u32::MAX);
    assert_eq!((whole.results.status, whole.signal), (Status::Complete, None));
    let soon = asked / 2;
    let (cut, asked) = evaluated(desk.at("cut"), soon);
    assert_eq!((cut.results.status, cut.signal), (Status::Interrupted, Some(15)));
    assert!(asked <= soon + 2, "{asked} looks for a signal that came after {soon}");
    let read = |finished: &Finished, name: &str| fs::read(finished.folder.join(name)).unwrap();
    assert_eq!(text(&read(&whole, "evaluation.csv")).lines().count(), 1 + 10 * 5);
    assert!(!cut.folder.join("evaluation.csv").exists(), "half an evaluation");
    assert_eq!(status(&cut.folder), "interrupted");

    let session = Session::resume(&cut.folder, &Company::Headless).unwrap();
    let resumed = session.run(&mut VirtualClock::default(), || None).unwrap();
    assert_eq!(resumed.results.status, Status::Complete);
    for name in ["evaluation.csv", "steps.csv", "episodes.csv", "policy.json"] {
        assert!(read(&resumed, name) == read(&whole, name), "{name} differs after a resume");
    }
}
