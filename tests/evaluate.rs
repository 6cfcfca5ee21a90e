//! `coadapt evaluate` as a user runs it: which rules it takes, what it leaves out, and what it
//! says when it cannot.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

#[path = "program/desk.rs"]
mod desk;

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use coadapt::clock::{Clock, WallClock};
use coadapt::signal::Seconds;
use desk::{Desk, names, text};
use serde_json::Value;

/// A small session of `profile` in the folder `s`, quick to teach and to evaluate.
fn taught(profile: &str) -> (Desk, PathBuf) {
    let desk = Desk::new();
    desk.succeed(&format!(
        "run {profile} --headless --operator simulated:average --seed 1 --rollouts 10 \
         --phases main,autonomous --set session.autonomous_rollouts=3 --logs ."
    ));
    let sessions = names(&desk.at("anon"));
    let session = sessions.iter().find(|name| name.starts_with("001-")).unwrap();
    let folder = desk.at("s");
    fs::rename(desk.at("anon").join(session), &folder).unwrap();
    (desk, folder)
}

/// The program refuses `line` as wrong usage; returns what it said.
fn refusal(desk: &Desk, line: &str) -> String {
    let output = desk.run(line);
    let message = text(&output.stderr);
    assert_eq!((output.status.code(), text(&output.stdout)), (Some(2), String::new()), "{message}");
    message
}

/// Checks that `message` holds each of `words`.
fn says(message: &str, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "no {word:?} in {message}");
    }
}

#[test]
fn a_cut_session_is_told_how_to_go_on() {
    let (desk, folder) = taught("balance");
    let sidecar = fs::read_to_string(folder.join("session.json")).unwrap();
    let stands = |status: &str| {
        let other = sidecar.replace("\"status\": \"complete\"", &format!("\"status\": {status:?}"));
        fs::write(folder.join("session.json"), other).unwrap();
    };
    fs::remove_file(folder.join("policy.json")).unwrap();
    for percent in [40, 50, 60, 70, 80, 90, 100] {
        fs::remove_file(folder.join(format!("policy-{percent:03}.json"))).unwrap();
    }
    stands("interrupted");
    let message = refusal(&desk, "evaluate s");
    says(&message, &["s: ", "not finished", "coadapt run --resume s\n"]);
    says(&message, &["coadapt evaluate s/policy-030.json"]);
    desk.succeed("evaluate s/policy-030.json");

    stands("complete");
    says(&refusal(&desk, "evaluate s"), &["policy.json is missing", "s/policy-030.json"]);

    for percent in [10, 20, 30] {
        fs::remove_file(folder.join(format!("policy-{percent:03}.json"))).unwrap();
    }
    stands("running");
    let message = refusal(&desk, "evaluate s");
    says(&message, &["coadapt run --resume s"]);
    assert!(!message.contains("policy-0"), "{message}");
    let recorder = fs::File::open(folder.join("steps.csv")).unwrap();
    recorder.lock().unwrap();
    let message = refusal(&desk, "evaluate s");
    says(&message, &["still being recorded", "let it end first"]);
    assert!(!message.contains("--resume"), "{message}");
    drop(recorder);
    fs::remove_file(folder.join("session.json")).unwrap();
    says(&refusal(&desk, "evaluate s"), &["s is not the folder of a session", "session.json"]);

    desk.succeed(
        "run balance --headless --operator none --seed 1 --phases introduction --logs practice",
    );
    let message = refusal(&desk, "evaluate practice/anon/001-balance-simultaneous");
    says(&message, &["no main phase"]);
    assert!(!message.contains("--resume"), "{message}");
}

#[test]
fn a_wrong_number_of_starts_blames_its_own_word() {
    let desk = Desk::new();
    for starts in ["0", "-1", "1000001", "many"] {
        let message = refusal(&desk, &format!("evaluate p.json --starts {starts}"));
        says(&message, &["--starts", starts]);
        assert!(!message.contains("autonomous_rollouts"), "{message}");
    }
}

#[test]
fn a_policy_of_another_task_names_its_own() {
    let (desk, _) = taught("speed-up");
    let message = refusal(&desk, "evaluate s/policy.json --profile balance");
    says(&message, &["for speed-up, not for balance", "leave --profile out"]);
    says(&message, &["--profile speed-up\n"]);
    desk.succeed("evaluate s/policy.json --profile speed-up --starts 2");
}

/// Every remedy that is named is one: it is tried here.
#[test]
fn a_policy_with_other_inputs_names_the_key_that_helps() {
    let (desk, folder) = taught("speed-up-modern");
    fs::copy(folder.join("policy.json"), desk.at("p.json")).unwrap();
    let message = refusal(&desk, "evaluate p.json --profile speed-up --starts 2");
    let sets = ["rules.use_theta_dot=true", "learner.norm_in=[0.1, 0.15, 1.0, 8.0]"];
    says(&message, &["4 inputs", "speed-up has 3", "leave --profile out"]);
    says(&message, &[&format!("--set {} --set '{}'", sets[0], sets[1])]);
    says(&message, &["--profile speed-up-modern\n"]);
    let both = ["--set", sets[0], "--set", sets[1]];
    desk.program("evaluate p.json --profile speed-up --starts 2").args(both).assert().success();
    desk.succeed("evaluate p.json --profile speed-up-modern --starts 2");
    desk.succeed("evaluate p.json --starts 2");
}

/// What is said on the way, when all goes well.
fn notices(desk: &Desk, line: &str) -> String {
    let output = desk.run(line);
    assert!(output.status.success(), "{}", text(&output.stderr));
    text(&output.stderr)
}

#[test]
fn a_tenth_that_cannot_be_tried_is_named_with_its_reason() {
    let (desk, folder) = taught("balance");
    let tenth = |percent: u8| folder.join(format!("policy-{percent:03}.json"));
    assert_eq!(notices(&desk, "evaluate s"), "");

    // Missing at the end: a session without main has none at all.
    fs::remove_file(tenth(100)).unwrap();
    assert_eq!(notices(&desk, "evaluate s"), "");
    fs::remove_file(tenth(30)).unwrap();
    let said = notices(&desk, "evaluate s");
    says(&said, &["s/policy-030.json is missing; this tenth is left out"]);
    assert_eq!(said.lines().count(), 1, "{said}");

    let whole = fs::read_to_string(tenth(50)).unwrap();
    fs::write(tenth(50), &whole[..whole.len() / 2]).unwrap();
    fs::write(tenth(60), whole.replace("\"balance\"", "\"swing-up\"")).unwrap();
    let said = notices(&desk, "evaluate s");
    says(
        &said,
        &["policy-050.json: this policy is cut off", "policy-060.json: this policy is for"],
    );
    assert_eq!(said.lines().count(), 3, "{said}");
    let printed = desk.succeed("evaluate s");
    for percent in [10, 20, 40, 70, 80, 90] {
        says(&printed, &[&format!("\n   {percent} % ")]);
    }
    for percent in [30, 50, 60, 100] {
        assert!(!printed.contains(&format!("{percent} %  ")), "{printed}");
    }
}

fn evaluated(desk: &Desk, words: &str) -> Value {
    serde_json::from_str(&desk.succeed(&format!("evaluate {words} --json"))).unwrap()
}

/// The first line that people are shown.
fn first_line(desk: &Desk, words: &str) -> String {
    desk.succeed(&format!("evaluate {words}")).lines().next().unwrap().to_owned()
}

#[test]
fn the_rules_that_were_used_are_named() {
    let (desk, folder) = taught("balance-modern");
    assert_eq!(evaluated(&desk, "s")["profile"], "s/session.json");
    assert_eq!(evaluated(&desk, "s/policy-010.json")["profile"], "s/session.json");
    let line = first_line(&desk, "s");
    assert_eq!(
        line,
        "s/policy.json by the rules of s/session.json: balance, 3 grid starts, seed 1"
    );
    let longer = "s --starts 1 --random --seed 4 --set plant.pole_length_m=0.7";
    says(&first_line(&desk, longer), &["1 random start, seed 4, plant.pole_length_m=0.7"]);
    assert_eq!(evaluated(&desk, longer)["set"][0], "plant.pole_length_m=0.7");

    // Away from its session a policy brings its preset's rules.
    fs::copy(folder.join("policy.json"), desk.at("p.json")).unwrap();
    assert_eq!(evaluated(&desk, "p.json")["profile"], "balance-modern.ron (built in)");
    says(&first_line(&desk, "p.json"), &["p.json by the rules of balance-modern.ron (built in)"]);
    // Of an unknown preset it brings the task's.
    let own = fs::read_to_string(desk.at("p.json")).unwrap().replace("\"modern\"", "\"own\"");
    fs::write(desk.at("p.json"), own).unwrap();
    assert_eq!(evaluated(&desk, "p.json")["profile"], "balance.ron (built in)");
}

/// A single start has no interval, least of all one without width.
#[test]
fn few_starts_have_no_interval() {
    let (desk, _) = taught("balance");
    let printed = desk.succeed("evaluate s --starts 4");
    let tenth = printed.lines().find(|line| line.trim_start().starts_with("10 %")).unwrap();
    assert!(!tenth.contains(" to "), "{printed}");
    assert!(desk.succeed("evaluate s --starts 5").lines().any(|line| line.contains(" to ")));
}

#[test]
fn random_starts_go_by_the_seed() {
    let (desk, _) = taught("balance");
    let starts = |words: &str| -> Vec<f64> {
        let json = evaluated(&desk, words);
        let rollouts = json["rollouts"].as_array().unwrap();
        rollouts.iter().map(|rollout| rollout["start"].as_f64().unwrap()).collect()
    };
    let random = starts("s --random --starts 4 --seed 3");
    assert_eq!(random, starts("s --random --starts 4 --seed 3"));
    assert_ne!(random, starts("s --random --starts 4 --seed 4"));
    let grid = starts("s --starts 4");
    assert_ne!(random, grid);
    assert!(grid.is_sorted() && !random.is_sorted(), "{random:?}");
}

/// Mean, median and interval of the yardstick, which for swing-up is a height: it may be
/// negative, so nothing is better by so many percent.
#[test]
fn all_that_act_alone_have_mean_median_and_interval() {
    for (task, yardstick) in [("balance", "mean_balance_s"), ("swing-up", "mean_height")] {
        let (desk, _) = taught(&format!("{task} --set session.main_duration_s=None"));
        let json = evaluated(&desk, "s --starts 6");
        let tenths = json["tenths"].as_array().unwrap();
        assert_eq!(tenths.len(), 10);
        for alone in tenths.iter().chain([&json, &json["zero_control"]]) {
            let number = |value: &Value| value.as_f64().unwrap();
            let mean = number(&alone["mean"]);
            assert!((mean - number(&alone[yardstick])).abs() < 1e-9, "{task}: {alone}");
            let (low, high) = (number(&alone["interval95"][0]), number(&alone["interval95"][1]));
            assert!(low <= mean + 1e-9 && mean <= high + 1e-9 && alone["median"].is_number());
        }
        for tenth in tenths {
            let improvement = &tenth["improvement_percent"];
            assert_eq!(improvement.is_null(), task == "swing-up", "{improvement}");
        }
        let printed = desk.succeed("evaluate s");
        assert_eq!(printed.contains("% on the first"), task == "balance", "{printed}");
    }
}

#[test]
fn a_signal_is_answered_with_what_was_done() {
    let (desk, _) = taught("balance");
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        // So many starts take minutes.
        let child = Command::new(env!("CARGO_BIN_EXE_coadapt"))
            .current_dir(desk.at(""))
            .args("evaluate s --starts 1000000 --json".split(' '))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let listens = || {
            let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
            let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
            u64::from_str_radix(caught.trim(), 16).unwrap() & (1 << 14) != 0
        };
        let mut clock = WallClock::start();
        while !listens() {
            assert!(clock.now() < Seconds(60.0), "it does not listen to signals");
            clock.wait_until(clock.now() + Seconds(0.005));
        }
        let kill = format!("-{signal}");
        Command::new("kill").args([&kill, &child.id().to_string()]).status().unwrap();
        let output = child.wait_with_output().unwrap();
        assert_eq!((output.status.code(), text(&output.stdout)), (Some(code), String::new()));
        assert_eq!(text(&output.stderr), "coadapt: interrupted: nothing was evaluated\n");
    }
}
