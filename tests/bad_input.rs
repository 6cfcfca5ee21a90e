//! Wrong words, wrong files, no disk, no terminal: a clear message, and nothing is lost.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

#[path = "program/desk.rs"]
mod desk;

use std::fs::{self, File};
use std::os::unix::fs::symlink;
use std::process::{Command, Stdio};

use desk::{Desk, names, text};

const RUN: &str = "run balance --headless --operator none --seed 1";

/// The program refuses `line` with exit code 2, prints nothing, says all of `says`, and
/// makes no folder.
fn refuses(desk: &Desk, line: &str, says: &[&str]) {
    let words: Vec<&str> = line.split_whitespace().collect();
    refuses_words(desk, &words, says);
}

/// The same for words that may hold spaces; returns what was said.
fn refuses_words(desk: &Desk, words: &[&str], says: &[&str]) -> String {
    let before = names(&desk.at(""));
    let output = desk.program("").args(words).output().unwrap();
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words:?}: {message}");
    assert_eq!(text(&output.stdout), "", "{words:?}");
    for word in says {
        assert!(message.contains(word), "{words:?}: no {word:?} in {message}");
    }
    assert_eq!(names(&desk.at("")), before, "{words:?} left something behind");
    message
}

#[test]
fn subjects_are_plain_names() {
    let desk = Desk::new();
    let long = "x".repeat(300);
    let names =
        ["a/b", "../up", "..", "a b", " ", "a\tb", "a\u{7}b", "a\nb", "naïve", "", long.as_str()];
    for name in names {
        let mut words: Vec<&str> = RUN.split_whitespace().collect();
        words.extend(["--subject", name]);
        let message = refuses_words(&desk, &words, &["subject", "1 to 64 letters"]);
        assert!(message.len() < 250, "{message}");
        assert!(!message.trim_end().contains(char::is_control), "{message:?}");
    }
}

#[test]
fn counts_and_times_are_within_their_ranges() {
    let desk = Desk::new();
    for count in ["-5", "0", "99999999999", "1000001", "abc", "1.5", "NaN"] {
        let says = ["session.main_rollouts", count];
        refuses(&desk, &format!("{RUN} --rollouts {count}"), &says);
    }
    for duration in ["-1", "0", "NaN", "inf", "1e9"] {
        refuses(&desk, &format!("{RUN} --duration {duration}"), &["session.main_duration_s"]);
    }
    refuses(&desk, &format!("{RUN} --seed -1"), &["-1"]);
    for trial in ["x", "0", "-1", "4294967295", "4294967296"] {
        refuses(&desk, &format!("{RUN} --trial {trial}"), &["--trial", trial]);
    }
}

#[test]
fn wrong_scripts_name_their_line() {
    let desk = Desk::new();
    let run = "run balance --headless --seed 1 --operator";
    for (name, table, says) in [
        ("nan.csv", "t,u\n0,1\n0.1,NaN\n", "nan.csv:3:5"),
        ("order.csv", "t,u\n0,1\n0.2,1\n0.1,2\n", "order.csv:4:"),
        ("columns.csv", "time,force\n0,1\n", "columns.csv:1:1"),
        ("short.csv", "t,u\n0\n", "short.csv:2:"),
        ("empty.csv", "", "empty.csv:1:1"),
        ("nan.ron", "[(t: 0.0, u: 1.0),\n (t: 0.1, u: NaN)]", "nan.ron:2:"),
        ("half.ron", "[(t: 0.0, u: 1.0),\n (t: 0.1,", "half.ron:2:"),
    ] {
        fs::write(desk.at(name), table).unwrap();
        refuses(&desk, &format!("{run} script:{name}"), &[says]);
    }
    fs::write(desk.at("latin.csv"), b"t,u\n0,\xff\n").unwrap();
    refuses(&desk, &format!("{run} script:latin.csv"), &["latin.csv:2:3", "UTF-8"]);
    fs::create_dir(desk.at("folder")).unwrap();
    refuses(
        &desk,
        &format!("{run} script:folder"),
        &["folder", "session.json is missing", "a table"],
    );
    refuses(&desk, &format!("{run} script:/dev/zero"), &["/dev/zero", "not a plain file"]);
    refuses(&desk, &format!("{run} script:missing.csv"), &["missing.csv", "No such file"]);
    refuses(&desk, &format!("{run} script:"), &["script:FILE"]);
}

#[test]
fn a_gigabyte_is_refused_and_not_read() {
    let desk = Desk::new();
    for name in ["big.csv", "big.ron"] {
        File::create(desk.at(name)).unwrap().set_len(1 << 30).unwrap();
    }
    let run = "--headless --seed 1 --operator";
    refuses(&desk, &format!("run balance {run} script:big.csv"), &["big.csv", "1073741824"]);
    refuses(&desk, &format!("run big.ron {run} none"), &["big.ron", "larger than"]);
    let simulate = "simulate balance --start 0,0,0,0 --actions";
    refuses(&desk, &format!("{simulate} big.csv"), &["big.csv", "1 MiB"]);
    refuses(&desk, &format!("{simulate} /dev/zero"), &["/dev/zero", "1 MiB"]);
    refuses(&desk, "evaluate big.csv", &["big.csv"]);
}

#[test]
fn wrong_profiles_are_shown_with_a_caret() {
    let desk = Desk::new();
    let whole = desk.succeed("profile show balance");
    let cut = whole.char_indices().nth(whole.chars().count() / 2).unwrap().0;
    fs::write(desk.at("half.ron"), &whole[..cut]).unwrap();
    refuses(&desk, "run half.ron --headless --operator none", &["half.ron:", "^"]);
    refuses(&desk, "profile check half.ron", &["half.ron:", "^"]);
    refuses(&desk, &format!("{RUN} --set plant.pole_lenght_m=1"), &["did you mean", "^"]);
    let two = format!("{RUN} --set plant.pole_length_m=99 --set sharing.gate=x");
    refuses(&desk, &two, &["0.05 to 10", "sharing.gate", "2 faults"]);
    refuses(&desk, &format!("{RUN} --set nonsense"), &["KEY=VALUE"]);
    refuses(&desk, "run nosuch --headless --operator none", &["nosuch", "balance"]);
    refuses(&desk, "profile show nosuch", &["nosuch", "balance"]);
}

#[test]
fn rules_that_a_plant_cannot_keep_name_both() {
    let desk = Desk::new();
    for (task, set, says) in [
        ("speed-up", "rules.limit_m=0.3", "plant.beam_half_length_m, 0.2125"),
        ("speed-up", "rules.test_rest_m=0.5", "plant.beam_half_length_m"),
        ("mountain-car", "rules.start_x=-1.5", "plant.left_wall, -1.2"),
        ("mountain-car", "rules.start_x=0.5", "plant.goal, 0.5"),
        ("mountain-car", "rules.goal_reward=-2", "above step_reward"),
    ] {
        let key = set.split('=').next().unwrap();
        refuses(&desk, &format!("run {task} --headless --set {set}"), &[key, says]);
    }
    // Without a middle that is the one fault; its goals are not named as well.
    let message = refuses_words(
        &desk,
        &[
            "run",
            "swing-up",
            "--headless",
            "--set",
            "rules.down_deg=60",
            "--set",
            "rules.top_slow_deg=90",
        ],
        &["rules.down_deg", "no middle"],
    );
    assert!(!message.contains("middle_slow_goal_deg"), "{message}");
}

/// The constant stands, and that is said, where a scale should go by a practice that does
/// not take place.
#[test]
fn a_threshold_of_own_practice_without_practice_is_told() {
    let desk = Desk::new();
    let line = "run speed-up-modern --headless --operator none --seed 1 --rollouts 1 --phases main";
    let output = desk.run(line);
    let said = text(&output.stderr);
    assert!(output.status.success() && said.contains("no introduction"), "{said}");
    let events = desk.at("logs/anon/001-speed-up-simultaneous/events.csv");
    let events = fs::read_to_string(events).unwrap();
    assert!(events.contains("threshold") && events.contains("no introduction"), "{events}");
}

#[test]
fn unknown_words_are_told_what_is_known() {
    let desk = Desk::new();
    let run = "run balance --headless --seed 1";
    refuses(&desk, &format!("{run} --operator parrot"), &["parrot", "script:FILE"]);
    let agent = ["q_learning", "does not know balance", "simulated:average"];
    refuses(&desk, &format!("{run} --operator q_learning"), &agent);
    refuses(&desk, &format!("{run} --operator simulated:genius"), &["genius", "naive"]);
    refuses(&desk, &format!("{run} --operator simulated:naive:drunk"), &["drunk", "delayed"]);
    refuses(&desk, &format!("{RUN} --learner perceptron"), &["perceptron", "rfwr"]);
    refuses(&desk, &format!("{RUN} --mode both"), &["both", "sequential"]);
    refuses(
        &desk,
        &format!("{RUN} --backend serial:/dev/x"),
        &["serial:/dev/x", "no section `backend`"],
    );
    refuses(&desk, &format!("{RUN} --backend warp"), &["warp", "simulated", "serial:PORT"]);
    refuses(&desk, &format!("{RUN} --arm"), &["--arm", "--backend serial:PORT"]);
    refuses(&desk, &format!("{RUN} --phases dance"), &["dance", "autonomous"]);
    refuses(&desk, &format!("{RUN} --phases main,introduction"), &["session.phases"]);
    refuses(&desk, run, &["no keyboard", "--operator simulated:average"]);
    let mouse = format!("{run} --operator mouse");
    refuses(&desk, &mouse, &["no mouse", "--operator simulated:average"]);
    refuses(&desk, "run --headless", &["PROFILE"]);
    refuses(&desk, "dance", &["dance"]);
    refuses(&desk, "run --headless --resume nowhere", &["nowhere", "no such folder"]);
    refuses(&desk, "run --headless --resume nowhere --operator none", &["--resume", "--operator"]);
}

#[test]
fn policies_must_be_whole_and_fitting() {
    let desk = Desk::new();
    desk.succeed(
        "run balance --headless --operator simulated:expert --seed 1 --rollouts 3 --phases main \
         --logs kept",
    );
    let file = desk.at("kept/anon/001-balance-simultaneous/policy.json");
    let policy = fs::read_to_string(file).unwrap();
    fs::write(desk.at("half.json"), &policy[..policy.len() / 2]).unwrap();
    fs::write(desk.at("other.json"), policy.replace("\"balance\"", "\"swing-up\"")).unwrap();
    fs::write(desk.at("empty.json"), "{}").unwrap();
    fs::write(desk.at("words.json"), "nonsense").unwrap();
    let alone = format!("{RUN} --phases autonomous");
    for name in ["half.json", "other.json", "empty.json", "words.json", "missing.json"] {
        refuses(&desk, &format!("{alone} --policy {name}"), &[name]);
    }
    for name in ["half.json", "empty.json", "words.json", "missing.json"] {
        refuses(&desk, &format!("evaluate {name}"), &[name]);
    }
    refuses(&desk, &alone, &["--policy FILE"]);
    refuses(&desk, &format!("{alone} --policy last"), &["anon", "no policy"]);
    refuses(&desk, &format!("{RUN} --policy half.json"), &["--phases autonomous"]);
    let other_mode = format!("{alone} --logs kept --policy last --mode sequential");
    refuses(&desk, &other_mode, &["simultaneous", "--mode"]);
    assert_eq!(names(&desk.at("kept/anon")), [".lock", "001-balance-simultaneous"]);
}

#[test]
fn wrong_tables_of_actions_name_their_line() {
    let desk = Desk::new();
    fs::write(desk.at("nan.csv"), "u\n1\nNaN\nx\n").unwrap();
    fs::write(desk.at("columns.csv"), "force\n1\n").unwrap();
    let from =
        |start: &str, table: &str| format!("simulate balance --start {start} --actions {table}");
    refuses(&desk, &from("0,0,0,0", "nan.csv"), &["nan.csv", "line 3", "line 4"]);
    refuses(&desk, &from("0,0,0,0", "columns.csv"), &["columns.csv", "no column u, only force"]);
    refuses(&desk, &from("0,0,0,0", "missing.csv"), &["missing.csv", "No such file"]);
    refuses(&desk, &from("0,0", "nan.csv"), &["2 numbers", "x,x_dot,theta,theta_dot"]);
    refuses(&desk, &from("0,0,NaN,0", "nan.csv"), &["not finite"]);
}

#[test]
fn a_log_folder_that_cannot_be_made_is_said() {
    let desk = Desk::new();
    fs::write(desk.at("file"), "kept").unwrap();
    for logs in ["file", "file/below"] {
        let output = desk.run(&format!("{RUN} --logs {logs}"));
        let message = text(&output.stderr);
        assert_eq!((output.status.code(), text(&output.stdout)), (Some(1), String::new()));
        assert!(message.contains(logs) && message.contains("--logs DIR"), "{message}");
    }
    assert_eq!(fs::read_to_string(desk.at("file")).unwrap(), "kept");
    assert_eq!(names(&desk.at("")), ["file"]);
}

#[test]
fn a_disk_that_is_full_at_the_start_keeps_no_half_made_session() {
    let desk = Desk::new();
    // Ignored, the limit on file sizes is an error of `write`, as a full disk is.
    let line = format!("trap '' XFSZ; ulimit -f 8; exec {} {RUN}", env!("CARGO_BIN_EXE_coadapt"));
    let full = Command::new("sh").args(["-c", &line]).current_dir(desk.at("")).output().unwrap();
    assert_eq!((full.status.code(), text(&full.stdout)), (Some(1), String::new()));
    assert!(text(&full.stderr).contains("session.json"), "{}", text(&full.stderr));
    assert_eq!(names(&desk.at("logs/anon")), [".lock"]);
}

#[test]
fn a_full_standard_output_is_a_failure() {
    let desk = Desk::new();
    symlink("/dev/full", desk.at("full")).unwrap();
    fs::write(desk.at("u.csv"), "u\n1\n").unwrap();
    for line in [
        "profile show balance",
        "simulate balance --start 0,0,0,0 --actions u.csv",
        "run balance --headless --operator none --seed 1 --rollouts 1 --phases main --json",
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_coadapt"))
            .args(line.split_whitespace())
            .current_dir(desk.at(""))
            .stdout(File::options().write(true).open(desk.at("full")).unwrap())
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1), "{line}");
        assert!(text(&output.stderr).contains("No space left"), "{}", text(&output.stderr));
    }
}

#[test]
fn without_a_terminal_it_says_what_to_do() {
    let desk = Desk::new();
    for line in ["", "run balance"] {
        refuses(&desk, line, &["no terminal", "--headless"]);
        let output = Command::new(env!("CARGO_BIN_EXE_coadapt"))
            .args(line.split_whitespace())
            .current_dir(desk.at(""))
            .stdin(Stdio::null())
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(2));
    }
}
