//! The program on a terminal, as a person meets it: keys, sizes, signals, and the terminal
//! given back.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking, helpers too")]

#[path = "terminal/desk.rs"]
mod desk;

use std::fs;

use desk::{Answers, Seat, Terminal, rest};

/// A pole that hangs about: nothing falls, so that a rollout lasts as long as the test.
const CALM: &str = "run balance --seed 1 --set plant.gravity_m_s2=0 --set rules.fail_deg=90 \
    --set rules.cap_s=600 --set plant.pole_friction_per_s=20 --set session.hold_s=0.1 --phases main";
const FOLDER: &str = "logs/anon/001-balance-simultaneous";

/// A live session under way, on a terminal that answers as `answers` says.
fn live(answers: Answers) -> Terminal {
    let terminal = Seat { answers, ..Seat::default() }.open(CALM);
    terminal.shows("Enter   begin");
    terminal.keys("\r");
    terminal.goes();
    terminal
}

fn end(terminal: &Terminal) {
    terminal.keys("q");
    terminal.shows("q again ends the session");
    terminal.keys("q");
    terminal.shows("new session");
    terminal.keys("q");
}

#[test]
fn enter_plays_at_once_and_q_leaves() {
    let mut terminal = Seat::default().open("");
    terminal.shows("the terminal laboratory");
    terminal.shows("Enter begin");
    terminal.keys("\r");
    terminal.shows("Practice.");
    terminal.shows("Enter   begin");
    terminal.keys("\r");
    terminal.waits();
    terminal.goes();
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
    let session = terminal.session(FOLDER);
    assert_eq!(session["status"], "aborted");
    assert_eq!(session["key_releases"], "estimated from key repeats");
    assert!(session["timing"]["ticks"].as_u64().unwrap() > 100);
}

#[test]
fn arrow_keys_push_for_a_while_where_releases_are_not_reported() {
    let mut terminal = live(Answers::Plainly);
    for _ in 0..25 {
        terminal.keys("\x1b[C");
        rest(0.03);
    }
    terminal.shows_that("the push ended", |screen| push(screen) == Some(0.0));
    terminal.keys("\x1b[D");
    terminal.shows_that("a push to the left", |screen| push(screen).is_some_and(|n| n < 0.0));
    terminal.shows_that("the push ended", |screen| push(screen) == Some(0.0));
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    let pushes = terminal.pushes(FOLDER);
    assert!(pushes.iter().filter(|u| **u == 5.0).count() > 10, "{pushes:?}");
    assert!(pushes.iter().all(|u| u.abs() <= 5.0), "{pushes:?}");
    assert_eq!(pushes.last(), Some(&0.0));
}

#[test]
fn a_key_pushes_until_its_reported_release() {
    let mut terminal = live(Answers::WithKitty);
    terminal.shows_that("the question is over", |_| terminal.wrote("\x1b[>"));
    terminal.keys("\x1b[C");
    // Far longer than a tap without releases would push.
    rest(1.0);
    terminal.shows_that("a push to the right", |screen| push(screen) == Some(5.0));
    terminal.keys("\x1b[1;1:3C");
    terminal.shows_that("no push", |screen| push(screen) == Some(0.0));
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
    assert!(terminal.wrote("\x1b[<1u"), "the reports are not switched off");
    assert_eq!(terminal.session(FOLDER)["key_releases"], "reported by the terminal");
}

#[test]
fn a_terminal_that_never_answers_is_served_all_the_same() {
    let mut terminal = live(Answers::Never);
    terminal.keys("\x1b[C");
    terminal.shows_that("a push to the right", |screen| push(screen).is_some_and(|n| n > 0.0));
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
}

/// The number beside the bar `you`, N.
fn push(screen: &str) -> Option<f64> {
    let row = screen.lines().find(|line| line.starts_with(" you") && line.contains(" N "))?;
    let words: Vec<&str> = row.split_whitespace().collect();
    let unit = words.iter().position(|word| *word == "N")?;
    words[unit - 1].replace('−', "-").trim_start_matches(['█', '│']).parse().ok()
}

#[test]
fn keys_change_the_view() {
    let mut terminal = live(Answers::Plainly);
    terminal.shows(" success");
    terminal.keys("p");
    terminal.shows("progress hidden");
    terminal.keys("p");
    terminal.shows(" success");
    terminal.keys("?");
    terminal.shows("keys: live");
    terminal.keys("?");
    terminal.shows_that("no help", |screen| !screen.contains("keys: live"));
    terminal.keys("v");
    terminal.shows_that("the scene only", |screen| !screen.contains("coadapt"));
    terminal.keys("v");
    terminal.shows("coadapt");
    terminal.keys("P");
    terminal.shows("PAUSED");
    terminal.keys("P");
    terminal.shows_that("no pause", |screen| !screen.contains("PAUSED"));
    terminal.keys("\x03");
    assert_eq!(terminal.code(), 130);
    terminal.is_given_back();
}

#[test]
fn signals_end_a_session_and_give_the_terminal_back() {
    for (signal, code) in [("TERM", 143), ("HUP", 129), ("INT", 130)] {
        let mut terminal = live(Answers::Plainly);
        terminal.shows_that("rows", |_| terminal.pushes(FOLDER).len() > 10);
        terminal.signal(signal);
        assert_eq!(terminal.code(), code, "SIG{signal}");
        terminal.is_given_back();
        assert_eq!(terminal.session(FOLDER)["status"], "interrupted", "SIG{signal}");
        let rows = fs::read_to_string(terminal.at(FOLDER).join("steps.csv")).unwrap();
        assert!(rows.ends_with(",,,,,,,,,0\n"), "no ending state: {rows}");
    }
}

#[test]
fn signals_end_the_set_up_too() {
    for (signal, code) in [("TERM", 143), ("HUP", 129), ("INT", 130)] {
        let mut terminal = Seat::default().open("");
        terminal.shows("Enter begin");
        terminal.signal(signal);
        assert_eq!(terminal.code(), code, "SIG{signal}");
        terminal.is_given_back();
    }
}

#[test]
fn a_killed_session_is_offered_and_resumed() {
    let mut killed = live(Answers::Plainly);
    // Rows reach the disk within a second.
    killed.shows_that("rows", |_| killed.pushes(FOLDER).len() > 10);
    killed.signal("KILL");
    killed.code();
    let mut terminal = Seat { desk: Some(killed.into_desk()), ..Seat::default() }.open("");
    terminal.shows("trial 001 was cut at main");
    terminal.keys("r");
    terminal.shows("trial 001");
    terminal.shows("begin");
    terminal.keys("\r");
    terminal.goes();
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
    let events = fs::read_to_string(terminal.at(FOLDER).join("events.csv")).unwrap();
    assert!(events.contains("resume"), "{events}");
}

#[test]
fn a_resumed_session_keeps_its_keyboard() {
    let line = format!("{CALM} --set operator.keyboard.tap_hold_s=1");
    let mut killed = Seat::default().open(&line);
    killed.shows_that("a checkpoint", |_| killed.at(FOLDER).join("checkpoint.json").exists());
    killed.signal("KILL");
    killed.code();
    let seat = Seat { desk: Some(killed.into_desk()), ..Seat::default() };
    let mut terminal = seat.open(&format!("run --resume {FOLDER}"));
    terminal.shows("Enter   begin");
    terminal.keys("\r");
    terminal.goes();
    terminal.keys("\x1b[C");
    terminal.shows_that("a push to the right", |screen| push(screen).is_some_and(|n| n > 0.0));
    terminal.shows_that("no push", |screen| push(screen) == Some(0.0));
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    let pushes = terminal.pushes(FOLDER);
    assert!(pushes.iter().filter(|u| **u > 0.0).count() > 30, "{pushes:?}");
}

#[test]
fn no_color_means_no_colour() {
    let seat = Seat { variables: vec![("NO_COLOR", "1")], ..Seat::default() };
    let mut terminal = seat.open(CALM);
    terminal.shows("Enter   begin");
    terminal.keys("\r");
    terminal.goes();
    terminal.keys("\x1b[C");
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    assert_eq!(terminal.colours(), Vec::<String>::new());
}

#[test]
fn colours_are_there_otherwise() {
    let mut terminal = live(Answers::Plainly);
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    assert!(!terminal.colours().is_empty());
}

#[test]
fn the_console_gets_seven_bits() {
    let seat = Seat { variables: vec![("TERM", "linux")], ..Seat::default() };
    let mut terminal = seat.open("");
    terminal.shows("Enter begin");
    terminal.keys("?");
    terminal.shows("keys: set-up");
    terminal.keys("?");
    terminal.keys("\r");
    terminal.shows("Practice.");
    terminal.keys("\r");
    terminal.waits();
    terminal.goes();
    terminal.keys("\x1b[C");
    terminal.keys("?");
    terminal.shows("keys: live");
    terminal.keys("?");
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    terminal.is_ascii();
}

#[test]
fn a_tiny_terminal_asks_for_room_and_the_session_goes_on() {
    let seat = Seat { columns: 10, rows: 3, ..Seat::default() };
    let mut terminal = seat.open(CALM);
    terminal.shows("coadapt ne");
    terminal.keys("\r");
    terminal.shows("GO: main");
    terminal.shows_that("rows", |_| terminal.pushes(FOLDER).len() > 10);
    terminal.resize(80, 24);
    terminal.shows("motor");
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
}

#[test]
fn a_storm_of_sizes_never_disturbs_the_session() {
    let mut terminal = live(Answers::Plainly);
    let before = terminal.pushes(FOLDER).len();
    let sizes = [(1, 1), (200, 60), (10, 3), (79, 24), (80, 23), (300, 2), (2, 100), (120, 40)];
    for (columns, rows) in sizes.into_iter().cycle().take(80) {
        terminal.resize(columns, rows);
        rest(0.005);
    }
    terminal.resize(80, 24);
    terminal.shows("motor");
    terminal.shows_that("more rows", |_| terminal.pushes(FOLDER).len() > before + 30);
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
}
