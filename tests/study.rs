//! Studies as a user runs them: the same results however they are carried out.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

#[path = "program/desk.rs"]
mod desk;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use coadapt::clock::{Clock, WallClock};
use coadapt::signal::Seconds;
use desk::{Desk, names, text};
use serde_json::Value;

/// Two arms, two people, two seeds: nine runs with the reference.
const BALANCE: &str = r#"(
    profile: "balance",
    sets: { "session.introduction_rollouts": 2, "session.main_rollouts": 10, "sharing.window_steps": 200 },
    arms: [(name: "seq", mode: sequential), (name: "sim", mode: simultaneous)],
    operators: ["simulated:naive", "simulated:expert"],
    seeds: (first: 3, count: 2),
    starts: [(name: "grid", count: 5)],
    references: [zero],
)"#;

/// An agent that drives a car, long enough for its gate to open.
const CAR: &str = r#"(
    profile: "mountain-car",
    sets: {
        "session.phases": [main], "session.main_rollouts": 40, "session.hold_s": 0.0,
        "rules.cap_steps": 200, "rules.start_x": 0.42, "plant.power": 0.005, "rules.reward_threshold": 1.0,
        "sharing.gate": 0.01, "teaching.from_gate": true,
    },
    arms: [(name: "seq", mode: sequential), (name: "sim", mode: simultaneous)],
    operators: ["q_learning"],
    seeds: (count: 2),
    checkpoints: [50, 100],
    readouts: [agent, continuous, rounded, sign],
    starts: [(name: "trained", count: 1), (name: "grid", count: 12)],
    references: [sign, zero],
    compare: [(of: ("sim", continuous), from: ("seq", agent))],
    trajectories: [4],
)"#;

/// A desk with both studies on it.
fn desk() -> Desk {
    let desk = Desk::new();
    fs::write(desk.at("balance.ron"), BALANCE).unwrap();
    fs::write(desk.at("car.ron"), CAR).unwrap();
    desk
}

/// Everything that must not depend on how a study was carried out.
fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let figures = folder.join("figures");
    let drawn = names(&figures).into_iter().map(|name| format!("figures/{name}"));
    let all: Vec<String> = drawn.chain(["results.csv".into(), "summary.json".into()]).collect();
    all.into_iter().map(|name| (name.clone(), fs::read(folder.join(name)).unwrap())).collect()
}

/// The rows of `results.csv`.
fn rows(folder: &Path) -> Vec<csv::StringRecord> {
    let mut table = csv::Reader::from_path(folder.join("results.csv")).unwrap();
    table.records().map(Result::unwrap).collect()
}

/// The value of the row whose columns begin with and name these.
fn value(rows: &[csv::StringRecord], arm: &str, seed: &str, last: [&str; 4]) -> f64 {
    let is_it = |row: &&csv::StringRecord| {
        &row[1] == arm && &row[4] == seed && (5..9).all(|at| row[at] == *last[at - 5])
    };
    rows.iter().find(is_it).unwrap()[9].parse().unwrap()
}

#[test]
fn results_do_not_depend_on_the_number_of_jobs() {
    let desk = desk();
    for study in ["balance", "car"] {
        desk.succeed(&format!("study ./{study}.ron --jobs 1 --out {study}-1"));
        desk.succeed(&format!("study ./{study}.ron --jobs 5 --out {study}-5"));
        let one = results(&desk.at(&format!("{study}-1")));
        assert_eq!(one, results(&desk.at(&format!("{study}-5"))));
        assert!(one.len() >= 6, "{:?}", one.keys());
    }
}

#[test]
fn shards_joined_are_the_whole_and_missing_ones_are_named() {
    let desk = desk();
    desk.succeed("study ./balance.ron --out whole");
    for shard in [1, 3] {
        desk.succeed(&format!("study ./balance.ron --shard {shard}/3 --out part-{shard}"));
    }
    let output = desk.run("study merge part-1 part-3 --out joined");
    assert_eq!(output.status.code(), Some(1));
    let told = text(&output.stderr);
    for words in
        ["missing shards: 2/3", "missing: run 2 (seq, simulated:naive", "3 of 9 runs are missing"]
    {
        assert!(told.contains(words), "{words}: {told}");
    }
    // Without --out a shard has a folder of its own.
    desk.succeed("study ./balance.ron --shard 2/3");
    desk.succeed("study merge part-1 part-3 logs/studies/balance-2-of-3 --out joined");
    assert_eq!(results(&desk.at("whole")), results(&desk.at("joined")));
}

/// What is told of missing runs is the command that makes them, from any shell.
#[test]
fn the_command_that_goes_on_after_a_merge_is_whole() {
    let desk = desk();
    fs::rename(desk.at("balance.ron"), desk.at("it's mine.ron")).unwrap();
    let study = |words: &str| {
        let mut program = desk.program("study");
        program.arg("./it's mine.ron").args(words.split_whitespace());
        program.output().unwrap()
    };
    study("--seeds 1 --set sharing.gate=0.2,0.3 --shard 1/2 --out half --keep-steps");
    let output = desk.run("study merge half --out joined");
    let told = text(&output.stderr);
    let command = told.lines().last().unwrap().split("go on with: coadapt ").nth(1).unwrap();
    let line = format!("{} {command}", env!("CARGO_BIN_EXE_coadapt"));
    let went_on = std::process::Command::new("bash")
        .args(["-c", &line])
        .current_dir(desk.at(""))
        .output()
        .unwrap();
    assert!(went_on.status.success(), "{line}: {}", text(&went_on.stderr));
    assert!(text(&went_on.stderr).contains("5 of 10 runs are in joined already"));
    // Step rows come along.
    assert_eq!(names(&desk.at("half/steps")), names(&desk.at("joined/steps")));
    assert!(!names(&desk.at("joined/steps")).is_empty());
}

#[test]
fn shards_that_are_not_needed_are_not_missing() {
    let desk = desk();
    desk.succeed("study ./balance.ron --out whole");
    desk.succeed("study ./balance.ron --shard 2/3 --out part");
    let output = desk.run("study merge whole part --out joined");
    assert_eq!(output.status.code(), Some(0));
    assert!(!text(&output.stderr).contains("missing"), "{}", text(&output.stderr));
}

#[test]
fn a_study_that_has_moved_or_changed_is_told_of_at_a_merge() {
    let desk = desk();
    desk.succeed("study ./balance.ron --shard 1/9 --out a");
    fs::rename(desk.at("balance.ron"), desk.at("away.ron")).unwrap();
    let told = text(&desk.run("study merge a --out joined").stderr);
    assert!(told.contains("put back where it was what is missing"), "{told}");
    fs::write(desk.at("balance.ron"), BALANCE.replace("first: 3", "first: 4")).unwrap();
    let told = text(&desk.run("study merge a --out joined").stderr);
    assert!(told.contains("put it back as it was, or run the shards anew"), "{told}");
}

#[test]
fn shards_of_other_studies_seeds_and_versions_are_refused() {
    let desk = desk();
    desk.succeed("study ./balance.ron --shard 1/9 --out a");
    desk.succeed("study ./balance.ron --shard 2/9 --seeds 1 --out fewer");
    desk.succeed("study ./car.ron --shard 9/9 --out car");
    desk.succeed("study ./balance.ron --shard 2/9 --out old");
    let card = fs::read_to_string(desk.at("old/study.json")).unwrap();
    let version = format!("\"version\":\"{}\"", env!("CARGO_PKG_VERSION"));
    assert!(card.contains(&version));
    fs::write(desk.at("old/study.json"), card.replace(&version, "\"version\":\"0.0.1\"")).unwrap();
    desk.succeed("study ./balance.ron --shard 2/9 --out torn");
    fs::write(desk.at("torn/study.json"), "").unwrap();
    for (other, words) in [
        ("fewer", "fewer does not go with a: it has other seeds: --seeds 1, not no --seeds"),
        ("car", "car does not go with a: it is the study car, not balance"),
        ("old", "old does not go with a: it is of coadapt 0.0.1"),
        (".", "holds no study"),
        ("torn", "without it nobody knows of which study its runs are"),
    ] {
        let output = desk.run(&format!("study merge a {other} --out joined"));
        assert_eq!(output.status.code(), Some(2), "{other}");
        assert!(text(&output.stderr).contains(words), "{other}: {}", text(&output.stderr));
    }
    assert!(!desk.at("joined").exists());
}

#[test]
fn a_killed_study_goes_on_where_it_was() {
    let desk = desk();
    desk.succeed("study ./car.ron --out whole");
    let line = "study ./car.ron --jobs 1 --out cut";
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_coadapt"))
        .args(line.split_whitespace())
        .current_dir(desk.at(""))
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let mut clock = WallClock::start();
    let second = desk.at("cut/runs/00002.json");
    while !second.exists() && child.try_wait().unwrap().is_none() {
        clock.wait_until(clock.now() + Seconds(0.002));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let first = fs::read(desk.at("cut/runs/00001.json")).unwrap();
    // A file that was not written whole is no result.
    fs::write(&second, "{\"schema\":1,").unwrap();
    let output = desk.run(line);
    assert!(output.status.success());
    assert!(text(&output.stderr).contains("runs are in cut already"), "{}", text(&output.stderr));
    assert_eq!(fs::read(desk.at("cut/runs/00001.json")).unwrap(), first, "not done again");
    assert_eq!(results(&desk.at("cut")), results(&desk.at("whole")));
}

/// A full disk or a kill before anything is done leaves no more than this.
#[test]
fn what_ended_before_it_began_can_begin_again() {
    let desk = desk();
    fs::create_dir_all(desk.at("half/runs")).unwrap();
    fs::write(desk.at("half/.lock"), "").unwrap();
    fs::write(desk.at("half/study.json.new"), "{\"schema\":").unwrap();
    desk.succeed("study ./balance.ron --shard 1/9 --out half");
    assert_eq!(names(&desk.at("half/runs")), ["00001.json"]);
}

/// A copy of one run is no other run.
#[test]
fn a_run_in_the_file_of_another_is_done_once_more() {
    let desk = desk();
    desk.succeed("study ./balance.ron --out s");
    let before = results(&desk.at("s"));
    fs::copy(desk.at("s/runs/00003.json"), desk.at("s/runs/00004.json")).unwrap();
    let output = desk.run("study ./balance.ron --out s");
    assert!(text(&output.stderr).contains("8 of 9 runs are in s already"));
    assert_eq!(results(&desk.at("s")), before);
}

#[test]
fn steps_that_cannot_be_kept_stop_a_study_at_once() {
    let desk = desk();
    desk.succeed("study ./balance.ron --shard 1/3 --out s");
    let told = text(&desk.run("study ./balance.ron --shard 1/3 --out s --keep-steps").stderr);
    assert!(told.contains("no step rows of 2 runs"), "{told}");
    fs::create_dir(desk.at("t")).unwrap();
    desk.succeed("study ./balance.ron --shard 1/9 --out t");
    fs::remove_file(desk.at("t/runs/00001.json")).unwrap();
    fs::write(desk.at("t/steps"), "").unwrap();
    let output = desk.run("study ./balance.ron --shard 1/9 --out t --keep-steps");
    assert_eq!(output.status.code(), Some(1));
    let told = text(&output.stderr);
    assert!(told.contains("cannot make t/steps") && !told.contains("run 1 failed"), "{told}");
}

#[test]
fn a_folder_with_something_else_is_left_alone() {
    let desk = desk();
    desk.succeed("study ./balance.ron --shard 1/9 --out a");
    let before = fs::read(desk.at("a/study.json")).unwrap();
    fs::create_dir(desk.at("mine")).unwrap();
    fs::write(desk.at("mine/thesis.txt"), "").unwrap();
    for (line, words) in [
        ("study ./car.ron --out a", "it is the study balance"),
        ("study ./balance.ron --out a", "it is the shard 1/9"),
        ("study ./balance.ron --shard 1/9 --set sharing.gate=0.3 --out a", "other settings"),
        (
            "study ./balance.ron --out mine",
            "mine holds something else: there is no study.json in it; choose another folder",
        ),
    ] {
        let output = desk.run(line);
        assert_eq!(output.status.code(), Some(2), "{line}");
        assert!(text(&output.stderr).contains(words), "{line}: {}", text(&output.stderr));
    }
    assert_eq!(fs::read(desk.at("a/study.json")).unwrap(), before);
    assert_eq!(names(&desk.at("mine")), ["thesis.txt"]);
}

#[test]
fn wrong_words_are_told_before_anything_is_done() {
    let desk = desk();
    fs::write(desk.at("none.ron"), BALANCE.replace("count: 2", "count: 0")).unwrap();
    fs::write(desk.at("twice.ron"), BALANCE.replace("\"sim\"", "\"seq\"")).unwrap();
    fs::create_dir_all(desk.at("profiles/studies")).unwrap();
    fs::copy(desk.at("balance.ron"), desk.at("profiles/studies/mine.ron")).unwrap();
    for (line, words) in [
        ("study ./none.ron", "there is nothing to run"),
        ("study ./twice.ron", "two called `seq`"),
        ("study ./balance.ron --set sharing.gat=0.1,0.2", "sharing.gate"),
        ("study ./balance.ron --seeds 0", "there is nothing to run"),
        ("study ./balance.ron --shard 0/3", "K from 1 to N"),
        ("study ./balance.ron --shard 4/3", "K from 1 to N"),
        ("study ./balance.ron --jobs 0", "jobs"),
        ("study balanse", "did you mean `balance`?"),
        ("study ./nowhere.ron", "cannot be read"),
        ("study ./balance.ron --seeds 200000", "that is too many"),
        ("study ./balance.ron --set sharing.gate=0.1,0.2 --set sharing.gate=0.3", "given twice"),
        ("study ./balance.ron --slurm=0", "1..=1000"),
        ("study ./balance.ron --slurm 1001", "1..=1000"),
        ("study --slurm balance", "invalid value 'balance' for '--slurm"),
        ("study mime", "did you mean `mine`?"),
        ("study", "STUDY"),
        ("study merge", "DIR"),
    ] {
        let output = desk.run(line);
        assert_eq!(output.status.code(), Some(2), "{line}");
        assert!(text(&output.stderr).contains(words), "{line}: {}", text(&output.stderr));
    }
    assert!(!desk.at("logs").exists());
    let list = "balance\nmine\nmountain-car\nmountain-car-feasible\nswing-up\n";
    assert_eq!(desk.succeed("study list"), list);
    let json: Value = serde_json::from_str(&desk.succeed("study list --json")).unwrap();
    assert_eq!((&json["schema"], &json["studies"][1]), (&1.into(), &"mine".into()));
}

#[test]
#[cfg(unix)]
fn a_full_disk_loses_nothing_that_is_finished() {
    let desk = desk();
    desk.succeed("study ./car.ron --out whole");
    // Ignored, the limit on file sizes is an error of `write`, as a full disk is. A reference's
    // file is smaller than a session's.
    let program = env!("CARGO_BIN_EXE_coadapt");
    let line =
        format!("trap '' XFSZ; ulimit -f 40; exec {program} study ./car.ron --jobs 1 --out full");
    let output = std::process::Command::new("bash")
        .args(["-c", &line])
        .current_dir(desk.at(""))
        .output()
        .unwrap();
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{told}");
    for words in ["cannot write full/runs/00002.json", "free some space", "goes on from there"] {
        assert!(told.contains(words), "{words}: {told}");
    }
    assert_eq!(names(&desk.at("full/runs")), ["00001.json"]);
    desk.succeed("study ./car.ron --out full");
    assert_eq!(results(&desk.at("full")), results(&desk.at("whole")));
}

#[test]
fn a_run_is_the_session_that_the_same_words_would_run() {
    let desk = desk();
    desk.succeed("study ./balance.ron --out study --keep-steps");
    let session = "run balance --headless --operator simulated:expert --seed 4 --json \
        --set session.introduction_rollouts=2 --rollouts 10 --set sharing.window_steps=200 \
        --set session.autonomous_rollouts=5";
    let rows = rows(&desk.at("study"));
    for (mode, arm) in [("sequential", "seq"), ("simultaneous", "sim")] {
        let printed = desk.succeed(&format!("{session} --mode {mode}"));
        let json: Value = serde_json::from_str(&printed).unwrap();
        let expert: Vec<csv::StringRecord> =
            rows.iter().filter(|row| &row[2] == "simulated:expert").cloned().collect();
        let of = |last| value(&expert, arm, "4", last);
        let phases = &json["phases"];
        let alone = of(["100", "continuous", "grid", "mean_balance_s"]);
        assert_eq!(alone, phases["autonomous"]["mean_balance_s"].as_f64().unwrap());
        let share = of(["100", "team", "main", "share"]);
        assert_eq!(share, phases["main"]["final_share"].as_f64().unwrap());
        let run = expert.iter().find(|row| &row[1] == arm && &row[4] == "4").unwrap()[0].to_owned();
        let number: u32 = run.parse().unwrap();
        let kept = fs::read_to_string(desk.at(&format!("study/steps/{number:05}.csv"))).unwrap();
        let folder = desk.at(json["session"].as_str().unwrap());
        let recorded = fs::read_to_string(folder.join("steps.csv")).unwrap();
        assert!(kept.lines().count() > 100 && recorded.starts_with(&kept));
    }
}

#[test]
fn the_table_the_summary_and_the_figures_hold_what_they_promise() {
    let desk = desk();
    let printed = desk.succeed("study ./car.ron --out car --json");
    let json: Value = serde_json::from_str(&printed).unwrap();
    assert_eq!((json["schema"].as_u64(), json["done"].as_u64()), (Some(1), Some(5)));
    let head = fs::read_to_string(desk.at("car/results.csv")).unwrap();
    let columns = "run,arm,operator,setting,seed,checkpoint,readout,start,measure,value\n";
    assert!(head.starts_with(columns));
    let rows = rows(&desk.at("car"));
    let steps = |seed| value(&rows, "seq", seed, ["100", "agent", "trained", "mean_steps"]);
    let group = json["groups"].as_array().unwrap().iter().find(|group| {
        group["arm"] == "seq"
            && group["readout"] == "agent"
            && group["start"] == "trained"
            && group["checkpoint"] == 100
            && group["measure"] == "mean_steps"
    });
    let group = group.unwrap();
    assert_eq!(group["mean"].as_f64(), Some(f64::midpoint(steps("1"), steps("2"))));
    assert_eq!(group["n"], 2);
    // The arms of a seed are the same until the gate opens: so are what people did.
    let gates = |arm| value(&rows, arm, "1", ["100", "team", "main", "gate"]);
    assert_eq!(gates("seq"), gates("sim"));
    let share = |arm| value(&rows, arm, "1", ["100", "team", "main", "share"]);
    assert!(share("seq") == 1.0 && share("sim") < 0.9);
    assert!(json["differences"].as_array().unwrap().iter().any(|difference| {
        difference["readout"] == "continuous" && difference["from_readout"] == "agent"
    }));
    let expected = [
        "cells.csv",
        "checkpoints.csv",
        "curves.csv",
        "generalisation.csv",
        "q-function.csv",
        "trajectories.csv",
    ];
    assert_eq!(names(&desk.at("car/figures")), expected);
    let count = |name: &str| {
        fs::read_to_string(desk.at(&format!("car/figures/{name}"))).unwrap().lines().count()
    };
    assert_eq!(count("q-function.csv"), 1 + 2 * 100 * 100);
    assert_eq!(count("curves.csv"), 1 + 4 * 40);
    assert_eq!(count("cells.csv"), 1 + 5 * 12);
}

/// Two arms, each with a person of its own.
const OWN: &str = r#"(
    profile: "balance",
    sets: { "session.introduction_rollouts": 2, "session.main_rollouts": 10 },
    arms: [
        (name: "a", mode: sequential, operator: "simulated:naive"),
        (name: "b", mode: sequential, operator: "simulated:expert"),
    ],
    seeds: (count: 5),
    checkpoints: [50],
    starts: [(name: "grid", count: 5)],
    references: [zero],
    compare: [(of: ("b", continuous), from: ("a", continuous))],
    trajectories: [2],
)"#;

#[test]
fn arms_with_people_of_their_own_are_compared() {
    let desk = desk();
    fs::write(desk.at("own.ron"), OWN).unwrap();
    let json: Value =
        serde_json::from_str(&desk.succeed("study ./own.ron --out own --json")).unwrap();
    let rows = rows(&desk.at("own"));
    let balanced =
        |arm, seed: &str| value(&rows, arm, seed, ["50", "continuous", "grid", "mean_balance_s"]);
    let differences = json["differences"].as_array().unwrap();
    let found = differences.iter().find(|difference| {
        difference["measure"] == "mean_balance_s" && difference["start"] == "grid"
    });
    let found = found.unwrap();
    assert_eq!(found["operator"], "simulated:expert");
    assert_eq!(found["from_operator"], "simulated:naive");
    let seeds = ["1", "2", "3", "4", "5"];
    let sum: f64 = seeds.iter().map(|seed| balanced("b", seed) - balanced("a", seed)).sum();
    assert!((found["mean"].as_f64().unwrap() - sum / 5.0).abs() < 1e-9);
    assert!(found["interval95"].is_array());
    assert!(differences.iter().any(|difference| difference["readout"] == "team"));
    // Figures are those of the last checkpoint, whatever it is.
    let lines = |name: &str| {
        let table = fs::read_to_string(desk.at(&format!("own/figures/{name}"))).unwrap();
        table.lines().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(lines("cells.csv").len(), 1 + 5);
    assert!(lines("cells.csv")[1].contains("simulated:naive"), "{:?}", lines("cells.csv"));
    assert!(lines("trajectories.csv")[0].starts_with("setting,operator,arm,run,"));
    assert!(lines("trajectories.csv").len() > 10);
    let table = fs::read_to_string(desk.at("own/table.txt")).unwrap();
    assert!(table.contains("b continuous − a continuous (simulated:naive)"), "{table}");
    assert!(table.lines().all(|line| line.chars().count() <= 80), "{table}");
}

/// With the same arms under all operators, whatever is compared has the same one.
#[test]
fn few_seeds_have_no_interval_and_heights_no_part_of_the_best() {
    let desk = desk();
    let swing = BALANCE
        .replace("\"balance\"", "\"swing-up\"")
        .replace(
            "\"session.introduction_rollouts\": 2, \"session.main_rollouts\": 10",
            "\"session.main_duration_s\": 60",
        )
        .replace("simulated:naive\", \"", "simulated:average\", \"");
    fs::write(desk.at("swing.ron"), swing).unwrap();
    let json: Value =
        serde_json::from_str(&desk.succeed("study ./swing.ron --out swing --json")).unwrap();
    let groups = json["groups"].as_array().unwrap();
    assert!(groups.iter().all(|group| group["interval95"].is_null() && group["n"] != 5));
    assert!(
        json["differences"]
            .as_array()
            .unwrap()
            .iter()
            .all(|difference| { difference["operator"] == difference["from_operator"] })
    );
    let mut table = csv::Reader::from_path(desk.at("swing/figures/generalisation.csv")).unwrap();
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    assert!(!rows.is_empty() && rows.iter().all(|row| row[11].is_empty() && !row[9].is_empty()));
}

/// A rollout that time cut has no steps, and a point of it no value.
#[test]
fn a_curve_is_empty_where_nothing_is_known() {
    let desk = desk();
    let cut = CAR
        .replace(
            "\"session.main_rollouts\": 40",
            "\"session.main_rollouts\": None, \"session.main_duration_s\": 3",
        )
        .replace("\"rules.start_x\": 0.42, \"plant.power\": 0.005, ", "");
    fs::write(desk.at("cut.ron"), cut).unwrap();
    desk.succeed("study ./cut.ron --seeds 1 --out cut");
    let curves = fs::read_to_string(desk.at("cut/figures/curves.csv")).unwrap();
    assert!(curves.lines().count() > 1 && !curves.contains("-0.0"), "{curves}");
    assert!(curves.lines().skip(1).any(|line| line.ends_with(',')), "{curves}");
}

#[test]
fn a_script_for_slurm_asks_for_what_runs_need() {
    let desk = desk();
    let told = desk.succeed("study ./balance.ron --out s --slurm 3");
    assert!(told.contains("3 jobs with 1 core"), "{told}");
    let script = fs::read_to_string(desk.at("s/slurm.sh")).unwrap();
    for words in ["#SBATCH --array=1-3", "--shard \"$SLURM_ARRAY_TASK_ID/3\"", "/balance.ron "] {
        assert!(script.contains(words), "{words}: {script}");
    }
    // It stands on its own, wherever it is run.
    let home = desk.at("").canonicalize().unwrap();
    assert!(script.contains(&format!("cd {} ||", home.display())), "{script}");
    let json = desk.succeed("study ./balance.ron --out s --slurm=3 --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(
        (&json["schema"], &json["jobs"], &json["measured"]),
        (&1.into(), &3.into(), &2.into())
    );
    // What was measured is not done again.
    let output = desk.run("study ./balance.ron --out s");
    assert!(text(&output.stderr).contains("2 of 9 runs are in s already"));
}

/// Each arm and each setting is measured, whoever steers; and a shell reads what was meant.
#[test]
#[cfg(unix)]
fn a_script_for_slurm_is_read_by_a_shell_and_measures_every_arm() {
    let desk = desk();
    fs::create_dir(desk.at("o'neill")).unwrap();
    fs::write(desk.at("o'neill/own.ron"), OWN).unwrap();
    let mut program = desk.program("study ./own.ron --seeds 2 --set sharing.gate=0.2,0.3 --slurm");
    let output = program.current_dir(desk.at("o'neill")).output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let folder = desk.at("o'neill/logs/studies/own");
    // Reference, a 1, a 2, b 1, b 2; and the same once more.
    let measured = ["00002.json", "00004.json", "00007.json", "00009.json"];
    assert_eq!(names(&folder.join("runs")), measured);
    let ran = std::process::Command::new("sh")
        .arg(folder.join("slurm.sh"))
        .env("SLURM_ARRAY_TASK_ID", "1")
        .output()
        .unwrap();
    assert!(ran.status.success(), "{}", text(&ran.stderr));
    assert_eq!(names(&desk.at("o'neill/logs/studies/own-1-of-1/runs")).len(), 10);
}
