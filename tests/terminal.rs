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
fn every_task_is_played_on_a_terminal() {
    for (task, seen) in [("swing-up", "DOWN SLOW"), ("speed-up", "beam"), ("mountain-car", "flags")]
    {
        let line = format!("run {task} --seed 1 --phases main --set session.hold_s=0.1");
        let mut terminal = Seat::default().open(&line);
        terminal.shows("Enter   begin");
        terminal.keys("\r");
        terminal.goes();
        terminal.shows(seen);
        let folder = format!("logs/anon/001-{task}-simultaneous");
        let pushed = |push: f64| terminal.pushes(&folder).contains(&push);
        terminal.keys("\x1b[C");
        let push = if task == "mountain-car" {
            1.0
        } else if task == "speed-up" {
            3.0
        } else {
            5.0
        };
        terminal.shows_that("a push to the right", |_| pushed(push));
        end(&terminal);
        assert_eq!(terminal.code(), 0, "{task}");
        terminal.is_given_back();
        assert_eq!(terminal.session(&folder)["status"], "aborted");
    }
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

#[test]
fn keys_typed_while_the_terminal_is_asked_arrive() {
    // Before the answers, among them and after them: help is opened, closed and opened again.
    let mut terminal = Seat { answers: Answers::Among("?"), ..Seat::default() }.open("");
    terminal.shows("keys: set-up");
    terminal.keys("?");
    terminal.shows_that("no help", |screen| !screen.contains("keys: set-up"));
    terminal.keys("q");
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
}

/// A live session that the mouse steers, on a terminal that answers as `answers` says.
fn moused(answers: Answers, more: &str) -> Terminal {
    let line = format!("{CALM} --operator mouse {more}");
    let terminal = Seat { answers, ..Seat::default() }.open(&line);
    terminal.shows("Enter   begin");
    terminal.keys("\r");
    terminal.goes();
    terminal.shows_that("a mouse that is read", |_| terminal.wrote("\x1b[?1003h\x1b[?1006h"));
    terminal
}

/// The pointer goes along a row, a step a hundredth of a second.
fn sweep(terminal: &Terminal, columns: impl Iterator<Item = u16>) {
    for column in columns {
        terminal.keys(&format!("\x1b[<35;{column};9M"));
        rest(0.01);
    }
}

#[test]
fn the_mouse_pushes_as_it_moves_and_not_when_it_rests() {
    let mut terminal = moused(Answers::Plainly, "");
    assert!(!terminal.wrote("\x1b[?1016h"), "nobody offered pixels");
    terminal.keys("?");
    terminal.shows("Steered by mouse, pointer in cells (80 × 24), not moved yet.");
    terminal.keys("?");
    sweep(&terminal, 10..60);
    terminal.shows_that("no push", |screen| push(screen) == Some(0.0));
    let pushed = |is: fn(f64) -> bool| terminal.pushes(FOLDER).into_iter().any(is);
    terminal.shows_that("a push to the right", |_| pushed(|u| u > 1.0));
    assert!(!pushed(|u| u < 0.0));
    sweep(&terminal, (10..60).rev());
    terminal.shows_that("a push to the left", |_| pushed(|u| u < -1.0));
    // What leaves the window and comes back did not move.
    terminal.keys("\x1b[O");
    terminal.shows_that("no push", |screen| push(screen) == Some(0.0));
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
    let raw = terminal.column(FOLDER, "raw");
    assert!(raw.iter().all(|raw| raw.abs() <= 1.0));
    assert_eq!(raw.last(), Some(&0.0));
    let session = terminal.session(FOLDER);
    assert_eq!(session["devices"][1], "mouse, pointer in cells (80 × 24)");
    assert!(session["key_releases"].is_null());
}

#[test]
fn the_mouse_is_read_in_pixels_where_the_terminal_offers_them() {
    let mut terminal = moused(Answers::WithPixels, "");
    terminal.shows_that("pixels", |_| terminal.wrote("\x1b[?1016h"));
    terminal.shows_that("no pointer", |_| terminal.wrote("\x1b]22;none"));
    sweep(&terminal, 400..440);
    // A cell is 0.14 at least.
    let is_fine = |raw: f64| raw > 0.0 && raw < 0.1;
    terminal
        .shows_that("a small push", |_| terminal.column(FOLDER, "raw").into_iter().any(is_fine));
    terminal.resize(100, 30);
    terminal.keys("?");
    terminal.shows("Steered by mouse, pointer in pixels (1000 × 600).");
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
    let events = fs::read_to_string(terminal.at(FOLDER).join("events.csv")).unwrap();
    for size in ["800 × 480", "1000 × 600"] {
        let words = format!("device,\"mouse, pointer in pixels ({size})\"");
        assert!(events.contains(&words), "{events}");
    }
}

#[test]
fn the_pointers_place_draws_the_plant_where_the_profile_says_so() {
    let more = "--set operator.mouse.steer=position --set operator.mouse.hide_pointer=false";
    let mut terminal = moused(Answers::Plainly, more);
    assert!(!terminal.wrote("\x1b]22;none"));
    terminal.keys("\x1b[<35;80;9M");
    let pushed = || terminal.pushes(FOLDER).into_iter().any(|u| u > 5.0);
    terminal.shows_that("a push to the right", |_| pushed());
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
    assert!(terminal.column(FOLDER, "raw").contains(&1.0));
}

#[test]
fn the_mouse_is_given_back_on_every_way_out() {
    for (signal, code) in [("TERM", 143), ("HUP", 129), ("INT", 130)] {
        let mut terminal = moused(Answers::WithPixels, "");
        terminal.signal(signal);
        assert_eq!(terminal.code(), code, "SIG{signal}");
        terminal.is_given_back();
    }
    let mut terminal = moused(Answers::WithPixels, "");
    terminal.keys("\x03");
    assert_eq!(terminal.code(), 130);
    terminal.is_given_back();
}

#[test]
fn a_flood_of_movements_drowns_no_key() {
    let mut terminal = moused(Answers::WithPixels, "");
    let moves: Vec<String> = (0..10_000).map(|k| format!("\x1b[<35;{};9M", 1 + k % 800)).collect();
    terminal.keys(&moves.concat());
    terminal.keys("p");
    terminal.shows("progress hidden");
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
}

#[test]
fn the_mouse_is_tried_before_a_session_and_only_then_read() {
    let mut terminal = Seat { answers: Answers::WithPixels, ..Seat::default() }.open("");
    terminal.shows("Enter begin");
    // From the profile to the operator, the second after the keyboard.
    terminal.keys(&"\t".repeat(8));
    terminal.keys("\x1b[C\x1b[C");
    terminal.shows("the pointer's velocity is the force");
    assert!(!terminal.wrote("\x1b[?1003h"));
    terminal.keys("t");
    terminal.shows("move the mouse; pointer in pixels (800 × 480)");
    terminal.keys("\x1b[<35;1;1M\x1b[<35;800;1M");
    terminal.keys("\x1b");
    terminal.shows_that("a mouse that is left alone", |_| terminal.wrote("\x1b[?1003l"));
    terminal.keys("q");
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
}

#[test]
fn within_tmux_the_keyboard_says_what_it_costs() {
    let variables = vec![("TMUX", "/tmp/tmux-0/default,1,0"), ("TERM", "tmux-256color")];
    let mut form = Seat { variables: variables.clone(), ..Seat::default() }.open("");
    form.shows("key releases up to 120 ms late inside tmux");
    form.keys("t");
    form.shows("hold the arrows; releases up to 120 ms late inside tmux");
    form.keys("\x03");
    assert_eq!(form.code(), 0);
    let mut terminal = Seat { variables, columns: 120, rows: 40, ..Seat::default() }.open(CALM);
    terminal.shows("Enter   begin");
    // The line is broken where the page is narrow.
    terminal.shows_that("how late", |screen| {
        let words: Vec<&str> = screen.split_whitespace().collect();
        words.join(" ").contains("inside tmux, up to 120 ms late")
    });
    terminal.keys("\r");
    terminal.goes();
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    let session = terminal.session(FOLDER);
    assert_eq!(session["key_releases"], "estimated from key repeats");
    assert_eq!(session["devices"][1], "keyboard, releases estimated from key repeats inside tmux");
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
        assert!(rows.ends_with(",,,,,,,,,0,\n"), "no ending state: {rows}");
    }
}

#[test]
fn a_closed_terminal_ends_a_session_as_a_hang_up_does() {
    let mut terminal = live(Answers::Plainly);
    terminal.shows_that("rows", |_| terminal.pushes(FOLDER).len() > 10);
    terminal.close();
    assert_eq!(terminal.code(), 129);
    assert_eq!(terminal.session(FOLDER)["status"], "interrupted");
    assert!(terminal.pushes(FOLDER).len() > 10);
    let rows = fs::read_to_string(terminal.at(FOLDER).join("steps.csv")).unwrap();
    assert!(rows.ends_with(",,,,,,,,,0,\n"), "no ending state: {rows}");
}

#[test]
fn a_halt_gives_the_terminal_back_and_takes_it_again() {
    let mut terminal = live(Answers::WithKitty);
    terminal.shows_that("the question is over", |_| terminal.wrote("\x1b[>"));
    // Nobody could let a program go on that is alone at its terminal, so that it does at once.
    terminal.signal("TSTP");
    terminal.shows_that("the terminal back", |_| terminal.wrote("\x1b[?1049l"));
    terminal.goes();
    terminal.keys("\x1b[C");
    terminal.shows_that("a push to the right", |screen| push(screen) == Some(5.0));
    terminal.keys("\x1b[1;1:3C");
    terminal.shows_that("no push", |screen| push(screen) == Some(0.0));
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
}

#[test]
fn a_terminal_that_takes_nothing_any_more_does_not_hold_up_the_end() {
    let mut terminal = live(Answers::Plainly);
    terminal.stalls(|terminal| terminal.signal("TERM"));
    assert_eq!(terminal.session(FOLDER)["status"], "interrupted");
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
fn a_killed_session_says_how_releases_were_known() {
    let known = |terminal: &Terminal| terminal.session(FOLDER)["key_releases"].clone();
    let mut terminal = live(Answers::WithKitty);
    assert_eq!(known(&terminal), "estimated from key repeats", "nobody was asked yet");
    terminal.shows_that("the question is over", |_| terminal.wrote("\x1b[>"));
    terminal.shows_that("rows", |_| terminal.pushes(FOLDER).len() > 10);
    terminal.keys("\x1b[120u");
    terminal.shows_that("releases known", |_| known(&terminal) == "reported by the terminal");
    terminal.signal("KILL");
    terminal.code();
    assert_eq!(known(&terminal), "reported by the terminal");
    assert_eq!(terminal.session(FOLDER)["status"], "running");
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

#[test]
fn shifted_keys_arrive_as_typed_where_keys_are_told_apart() {
    let mut terminal = Seat { answers: Answers::WithKitty, ..Seat::default() }.open("");
    terminal.shows_that("the question is over", |_| terminal.wrote("\x1b[>"));
    // 4 of these flags asks for the shifted letters.
    terminal.shows_that("all flags", |_| terminal.wrote("\x1b[>15u"));
    let question_mark = "\x1b[47:63;2u";
    terminal.keys(question_mark);
    terminal.shows("keys: set-up");
    terminal.keys(question_mark);
    terminal.shows_that("no help", |screen| !screen.contains("keys: set-up"));
    // From the profile to the subject.
    for _ in 0..6 {
        terminal.keys("\x1b[9u");
    }
    terminal.keys("\x1b[115:83;2u\x1b[45:95;2u\x1b[97u");
    terminal.shows("--subject S_a");
    terminal.keys("\x03");
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
}

#[test]
fn space_begins_nothing_while_an_instruction_is_read() {
    let mut terminal = Seat::default().open(CALM);
    terminal.shows("Enter   begin");
    terminal.keys("   ");
    // Far longer than a tick and the countdown.
    rest(0.5);
    terminal.shows("Enter   begin");
    assert!(terminal.pushes(FOLDER).is_empty());
    terminal.keys("\r");
    terminal.goes();
    end(&terminal);
    assert_eq!(terminal.code(), 0);
    let events = fs::read_to_string(terminal.at(FOLDER).join("events.csv")).unwrap();
    assert!(!events.contains("stop"), "{events}");
}

#[test]
fn the_next_session_is_the_same_subjects() {
    let line = "run balance --phases main --mode assigned --subject S07 --logs kept";
    let mut terminal = Seat::default().open(line);
    for trial in ["001", "002"] {
        terminal.shows(&format!("S07   trial {trial}"));
        terminal.shows("Enter   begin");
        terminal.keys("qq");
        terminal.shows("new session");
        terminal.keys("\r");
        terminal.shows("the terminal laboratory");
        terminal.shows("--subject S07");
        terminal.shows("--logs kept");
        terminal.keys("\r");
    }
    terminal.shows("S07   trial 003");
    terminal.keys("\x03");
    assert_eq!(terminal.code(), 130);
    let mut sessions: Vec<String> = fs::read_dir(terminal.at("kept/S07"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != ".lock")
        .collect();
    sessions.sort();
    let mode = sessions[0].strip_prefix("001-").unwrap();
    assert_eq!(sessions, ["001", "002", "003"].map(|trial| format!("{trial}-{mode}")));
    for name in &sessions {
        assert_eq!(terminal.session(&format!("kept/S07/{name}"))["assigned"], true);
    }
}

#[test]
fn a_profile_is_saved_where_no_folder_of_profiles_was() {
    let mut terminal = Seat::default().open("");
    terminal.shows("Enter begin");
    terminal.keys("s");
    terminal.shows("save as");
    terminal.keys("mine\r");
    terminal.shows("coadapt run profiles/mine.ron");
    terminal.keys("q");
    assert_eq!(terminal.code(), 0);
    let saved = fs::read_to_string(terminal.at("profiles/mine.ron")).unwrap();
    assert!(saved.contains("task: \"balance\""), "{saved}");
}

#[test]
fn a_broken_profile_is_reported_and_nothing_is_drawn() {
    let desk = tempfile::tempdir().unwrap();
    fs::create_dir(desk.path().join("profiles")).unwrap();
    fs::write(desk.path().join("profiles/balance.ron"), "(task: \"balance\", nonsense: 1)")
        .unwrap();
    let mut terminal = Seat { desk: Some(desk), ..Seat::default() }.open("");
    assert_eq!(terminal.code(), 2);
    assert!(!terminal.wrote("\x1b[?1049h"), "the screen was taken");
    terminal.shows("balance.ron:1:");
    terminal.shows("nonsense");
}

#[test]
fn no_row_is_lost_as_fast_as_it_can() {
    let taught = "run balance --headless --seed 1 --rollouts 5 --phases main \
        --operator simulated:expert";
    let mut teacher = Seat::default().open(taught);
    assert_eq!(teacher.code(), 0);
    let seat = Seat { desk: Some(teacher.into_desk()), ..Seat::default() };
    let alone = format!("run balance --seed 1 --phases autonomous --policy {FOLDER}/policy.json");
    let mut terminal = seat.open(&alone);
    terminal.shows("Enter   begin");
    terminal.keys("\r");
    terminal.goes();
    terminal.keys("fff");
    terminal.shows("new session");
    terminal.keys("q");
    assert_eq!(terminal.code(), 0);
    let folder = "logs/anon/002-balance-simultaneous";
    assert_eq!(terminal.session(folder)["timing"]["lost_rows"], 0);
    let episodes = fs::read_to_string(terminal.at(folder).join("episodes.csv")).unwrap();
    let implied: usize = episodes
        .lines()
        .skip(1)
        .map(|row| row.split(',').nth(3).unwrap().parse::<usize>().unwrap() + 1)
        .sum();
    let rows = fs::read_to_string(terminal.at(folder).join("steps.csv")).unwrap();
    assert_eq!(rows.lines().count() - 1, implied);
    assert_eq!(episodes.lines().count(), 1 + 100 + 100);
}

#[test]
fn the_devices_have_a_screen_that_is_left_with_q() {
    let mut terminal = Seat { answers: Answers::WithKitty, ..Seat::default() }.open("devices");
    terminal.shows("serial ports");
    terminal.keys("\x1b[C");
    terminal.shows("hold a or d");
    terminal.shows("reported by the terminal");
    terminal.keys("\x1b[100u");
    terminal.shows("+0.50");
    terminal.keys("\x1b[100;1:3u");
    terminal.shows_that("the dot came back", |screen| !screen.contains("+0.50"));
    terminal.keys("\x1b[C");
    terminal.shows("pointer in");
    assert!(terminal.wrote("\x1b[?1003h"), "the mouse is not read on its page");
    terminal.keys("\x1b[D\x1b[D\x1b[D");
    terminal.shows("key releases  yes");
    assert!(terminal.wrote("\x1b[?1003l"), "the mouse is still read on other pages");
    terminal.keys("q");
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
}

#[test]
fn questions_to_the_terminal_do_not_get_into_what_is_piped() {
    let seat =
        Seat { answers: Answers::WithKitty, output: Some("devices.json"), ..Seat::default() };
    let mut terminal = seat.open("devices --json");
    assert_eq!(terminal.code(), 0);
    let text = fs::read(terminal.at("devices.json")).unwrap();
    let devices: serde_json::Value = serde_json::from_slice(&text).unwrap();
    assert_eq!(devices["schema"], 1);
    assert_eq!(devices["terminal"]["key_releases"], true);
    assert!(terminal.wrote("\x1b[?u"), "the terminal was not asked");
}

#[test]
fn a_second_terminal_watches_one_session_after_the_other() {
    let run = tempfile::tempdir().unwrap();
    let folder: &'static str = run.path().display().to_string().leak();
    let seat = || Seat { variables: vec![("XDG_RUNTIME_DIR", folder)], ..Seat::default() };
    let mut watcher = seat().open("watch anon");
    watcher.shows("nothing to watch yet");
    for _ in 0..2 {
        let mut session = seat().open(CALM);
        session.shows("Enter   begin");
        watcher.shows_that("the instruction", |screen| {
            screen.contains("MAIN") && !screen.contains("begin") && screen.contains("read-only")
        });
        session.keys("\r");
        session.goes();
        watcher.goes();
        // What is typed there moves nothing here.
        watcher.keys(" x");
        session.keys("\x1b[C");
        watcher.shows_that("a push", |screen| push(screen).is_some_and(|n| n > 0.0));
        end(&session);
        assert_eq!(session.code(), 0);
        watcher.shows("this session is over; the next one is awaited");
    }
    watcher.keys("q");
    assert_eq!(watcher.code(), 0);
    watcher.is_given_back();
}

#[test]
fn a_recorded_session_is_replayed_on_a_terminal() {
    let session = "logs/anon/001-balance-simultaneous";
    let desk = tempfile::tempdir().unwrap();
    let line = "run balance --headless --operator simulated:average --seed 1 --rollouts 2 \
        --set session.introduction_rollouts=1 --set session.autonomous_rollouts=1";
    let mut program = std::process::Command::new(env!("CARGO_BIN_EXE_coadapt"));
    program.args(line.split_whitespace()).current_dir(desk.path());
    assert!(program.output().unwrap().status.success());
    let seat = Seat { desk: Some(desk), ..Seat::default() };
    let mut terminal = seat.open(&format!("replay {session}"));
    terminal.shows("PLAY");
    terminal.keys(" ");
    terminal.shows("PAUSE");
    terminal.keys("N");
    terminal.shows("1/2");
    terminal.keys("2\r");
    terminal.shows("2/2");
    terminal.keys("\x1b[F");
    terminal.shows("ZERO CONTROL");
    terminal.keys("q");
    assert_eq!(terminal.code(), 0);
    terminal.is_given_back();
}
