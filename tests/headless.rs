//! Headless sessions and the other commands, as a user runs them.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking, helpers too")]

#[path = "program/desk.rs"]
mod desk;

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use coadapt::plant::Plant;
use coadapt::plant::cart_pole::{CartPole, Params};
use coadapt::signal::{Action, Seconds, State};
use desk::{Desk, names, text};
use serde_json::Value;

/// A session small enough to be looked through, in which the gate opens.
const SMALL: &str = "run balance --headless --operator simulated:average --seed 7 --json \
    --set session.introduction_rollouts=2 --rollouts 12 --set session.autonomous_rollouts=5 \
    --set sharing.window_steps=200";
const WINDOW: usize = 200;

const STEPS: &str = "phase,episode,step,t,x,x_dot,theta,theta_dot,u_human,u_machine,share,u,\
    u_applied,reward,success,region,lateness_us,raw";
const EPISODES: &str = "phase,episode,start,steps,duration_s,end,return,mean_reward,share,\
    success,receptive_fields";

/// A row of a CSV file, by column.
struct Row(HashMap<String, String>);

impl Row {
    fn word(&self, column: &str) -> &str {
        &self.0[column]
    }

    fn number(&self, column: &str) -> f64 {
        self.maybe(column).unwrap_or_else(|| panic!("no {column} in {:?}", self.0))
    }

    fn maybe(&self, column: &str) -> Option<f64> {
        let word = self.word(column);
        (!word.is_empty()).then(|| word.parse().unwrap())
    }

    fn state(&self) -> State {
        State::new(["x", "x_dot", "theta", "theta_dot"].map(|column| self.number(column)))
    }

    fn is_ending(&self) -> bool {
        self.word("u_applied").is_empty()
    }

    fn rollout(&self) -> (&str, &str) {
        (self.word("phase"), self.word("episode"))
    }
}

fn rows(file: &Path) -> Vec<Row> {
    let mut reader = csv::Reader::from_path(file).unwrap();
    let header = reader.headers().unwrap().clone();
    let row = |record: csv::StringRecord| {
        Row(header.iter().map(str::to_owned).zip(record.iter().map(str::to_owned)).collect())
    };
    reader.records().map(|record| row(record.unwrap())).collect()
}

fn of_phase<'a>(rows: &'a [Row], phase: &str) -> Vec<&'a Row> {
    rows.iter().filter(|row| row.word("phase") == phase).collect()
}

/// The rows of a phase under control, without the ending states.
fn controlled<'a>(rows: &'a [Row], phase: &str) -> Vec<&'a Row> {
    of_phase(rows, phase).into_iter().filter(|row| !row.is_ending()).collect()
}

/// A desk on which the small session was run, with more words and into `logs`.
fn small(more: &str) -> (Desk, Value) {
    let desk = Desk::new();
    let printed = desk.succeed(&format!("{SMALL} {more}"));
    let json = serde_json::from_str(&printed).unwrap();
    (desk, json)
}

const SIMULTANEOUS: &str = "logs/anon/001-balance-simultaneous";
const SEQUENTIAL: &str = "logs/anon/001-balance-sequential";

fn assert_keys(value: &Value, keys: &[&str]) {
    for key in keys {
        assert!(!value[key].is_null(), "{key} is missing in {value}");
    }
}

#[test]
fn the_other_learner_learns_too() {
    let (desk, json) = small("--mode simultaneous --learner lwpr");
    assert_eq!(json["learner"], "lwpr");
    let policy = fs::read_to_string(desk.at(SIMULTANEOUS).join("policy.json")).unwrap();
    let policy: Value = serde_json::from_str(&policy).unwrap();
    let learned = &policy["learner"]["lwpr"];
    assert!(learned["samples"].as_u64().unwrap() > 100, "{policy}");
}

#[test]
fn a_default_session_prints_one_object_with_the_contracts_keys() {
    let desk = Desk::new();
    let printed = desk.succeed(
        "run balance --headless --operator simulated:average --mode simultaneous --seed 1 --json",
    );
    assert_eq!(printed.lines().count(), 1);
    let json: Value = serde_json::from_str(&printed).unwrap();
    assert_eq!(json["schema"], 1);
    assert_eq!(json["session"], SIMULTANEOUS);
    assert_eq!((&json["task"], &json["preset"]), (&"balance".into(), &"thesis".into()));
    assert_eq!((&json["mode"], &json["learner"]), (&"simultaneous".into(), &"rfwr".into()));
    assert_eq!((&json["operator"], &json["seed"]), (&"simulated:average".into(), &1.into()));
    let phases = &json["phases"];
    for (phase, episodes) in
        [("introduction", 20), ("main", 100), ("autonomous", 100), ("zero_control", 100)]
    {
        assert_eq!(phases[phase]["episodes"], episodes);
        assert_keys(&phases[phase], &["steps", "mean_balance_s", "sd_balance_s"]);
    }
    let main = [
        "final_share",
        "final_success",
        "receptive_fields",
        "first10_mean_balance_s",
        "last10_mean_balance_s",
        "gate_episode",
        "tau_steps",
    ];
    assert_keys(&phases["main"], &main);
    assert_eq!(
        names(&desk.at(SIMULTANEOUS)),
        [
            "checkpoint.json",
            "episodes.csv",
            "evaluation.csv",
            "events.csv",
            "policy-010.json",
            "policy-020.json",
            "policy-030.json",
            "policy-040.json",
            "policy-050.json",
            "policy-060.json",
            "policy-070.json",
            "policy-080.json",
            "policy-090.json",
            "policy-100.json",
            "policy.json",
            "session.json",
            "steps.csv",
        ]
    );
}

#[test]
fn equal_seeds_give_equal_files_in_any_place_and_trial() {
    let desk = Desk::new();
    for logs in ["here", "here", "there"] {
        desk.succeed(&format!("{SMALL} --logs {logs}"));
    }
    let first = desk.at("here/anon/001-balance-simultaneous");
    for other in ["here/anon/002-balance-simultaneous", "there/anon/001-balance-simultaneous"] {
        let other = desk.at(other);
        assert_eq!(names(&first), names(&other));
        for name in names(&first).iter().filter(|name| *name != "session.json") {
            let same = fs::read(first.join(name)).unwrap() == fs::read(other.join(name)).unwrap();
            assert!(same, "{name} differs in {}", other.display());
        }
    }
}

#[test]
fn another_seed_gives_other_files() {
    let desk = Desk::new();
    desk.succeed(SMALL);
    desk.succeed(&SMALL.replace("--seed 7", "--seed 8"));
    let steps = |trial: &str| {
        fs::read(desk.at(&format!("logs/anon/{trial}-balance-simultaneous/steps.csv"))).unwrap()
    };
    assert_ne!(steps("001"), steps("002"));
}

#[test]
fn columns_are_the_contracts() {
    let (desk, _) = small("");
    for (file, columns) in [("steps.csv", STEPS), ("episodes.csv", EPISODES)] {
        let text = fs::read_to_string(desk.at(SIMULTANEOUS).join(file)).unwrap();
        assert_eq!(text.lines().next(), Some(columns));
    }
}

#[test]
fn the_action_is_the_mix_and_the_reward_is_equation_18() {
    let (desk, _) = small("");
    let rows = rows(&desk.at(SIMULTANEOUS).join("steps.csv"));
    let main = controlled(&rows, "main");
    let mut shared = 0;
    for row in &main {
        let (w, human, machine) =
            (row.number("share"), row.number("u_human"), row.number("u_machine"));
        assert_eq!(row.number("u"), w * human + (1.0 - w) * machine);
        assert_eq!(row.number("u_applied"), row.number("u").clamp(-10.0, 10.0));
        shared += u32::from(w < 1.0);
    }
    assert!(shared > 100, "the gate opened for {shared} steps");
    for row in rows.iter().filter(|row| !row.is_ending()) {
        let expected = 1.0 - row.number("theta").abs() / 30_f64.to_radians();
        assert!((row.number("reward") - expected).abs() < 1e-15, "{:?}", row.0);
        assert_eq!((row.word("region"), row.word("lateness_us")), ("all", "0"));
    }
}

#[test]
fn success_gate_and_share_follow_from_the_rows() {
    let (desk, json) = small("");
    let rows = rows(&desk.at(SIMULTANEOUS).join("steps.csv"));
    let main = controlled(&rows, "main");
    let rewards: Vec<f64> = main.iter().map(|row| row.number("reward")).collect();
    let mut w = 1.0;
    let mut tau = None;
    for (k, row) in main.iter().enumerate() {
        assert!((row.number("share") - w).abs() < 1e-12, "step {k}: {w}, {:?}", row.0);
        let window = &rewards[(k + 1).saturating_sub(WINDOW)..=k];
        #[expect(clippy::cast_precision_loss, reason = "a small count")]
        let success = window.iter().sum::<f64>() / WINDOW as f64;
        assert!((row.number("success") - success).abs() < 1e-12, "step {k}: {success}");
        match tau {
            Some(tau) => w += (1.0 - row.number("success") - w) / tau,
            None if row.number("success") >= 0.4 => {
                #[expect(clippy::cast_precision_loss, reason = "a small count")]
                let found = -((k + 1) as f64) / 0.4_f64.ln();
                tau = Some(found);
                assert_eq!(json["phases"]["main"]["gate_episode"].to_string(), row.word("episode"));
            }
            None => {}
        }
    }
    let told = |key: &str| json["phases"]["main"][key].as_f64().unwrap();
    assert!((told("tau_steps") - tau.unwrap()).abs() < 1e-9);
    assert!((told("final_share") - w).abs() < 1e-12);
    assert_eq!(told("final_success"), main.last().unwrap().number("success"));
}

#[test]
fn the_next_state_is_the_plants_step_under_the_applied_action() {
    let (desk, _) = small("--set plant.friction_noise_per_s=0");
    let rows = rows(&desk.at(SIMULTANEOUS).join("steps.csv"));
    let params = Params { friction_noise_per_s: 0.0, ..Params::default() };
    let mut plant = CartPole::new(params, Seconds(0.02));
    let mut compared = 0;
    for pair in rows.windows(2).filter(|pair| pair[0].rollout() == pair[1].rollout()) {
        let applied = Action(pair[0].number("u_applied"));
        assert_eq!(plant.step(&pair[0].state(), applied), pair[1].state(), "{:?}", pair[1].0);
        compared += 1;
    }
    assert!(compared > 1000, "{compared} steps");
}

#[test]
fn every_rollout_ends_with_its_ending_state_and_has_a_row() {
    let (desk, json) = small("");
    let steps = rows(&desk.at(SIMULTANEOUS).join("steps.csv"));
    let episodes = rows(&desk.at(SIMULTANEOUS).join("episodes.csv"));
    let mut rollouts: Vec<Vec<&Row>> = Vec::new();
    for row in &steps {
        match rollouts.last_mut() {
            Some(rollout) if rollout[0].rollout() == row.rollout() => rollout.push(row),
            _ => rollouts.push(vec![row]),
        }
    }
    assert_eq!(rollouts.len(), 2 + 12 + 5 + 5);
    assert_eq!(episodes.len(), rollouts.len());
    for (rollout, episode) in rollouts.iter().zip(&episodes) {
        assert_eq!(rollout[0].rollout(), episode.rollout());
        assert_rollout(rollout, episode);
    }
    for phase in ["introduction", "main", "autonomous", "zero_control"] {
        let count = controlled(&steps, phase).len();
        assert_eq!(json["phases"][phase]["steps"], count);
    }
}

fn assert_rollout(rollout: &[&Row], episode: &Row) {
    let (last, before) = rollout.split_last().unwrap();
    for (k, row) in (0_u32..).zip(rollout) {
        assert_eq!(row.number("step"), f64::from(k));
        assert_eq!(row.number("t"), f64::from(k) * 0.02);
    }
    for column in ["u_human", "u_machine", "share", "u", "u_applied", "reward", "success", "region"]
    {
        assert_eq!(last.word(column), "", "{column} of {:?}", last.0);
    }
    assert!(before.iter().all(|row| !row.is_ending()));
    assert_eq!(episode.number("steps"), last.number("step"));
    assert_eq!(episode.number("duration_s"), last.number("t"));
    assert_eq!(episode.number("start"), rollout[0].number("theta"));
    let fell = last.number("theta").abs() > 30_f64.to_radians();
    assert_eq!(episode.word("end"), if fell { "failed" } else { "cap" });
    let total: f64 = before.iter().map(|row| row.number("reward")).sum();
    assert!((episode.number("return") - total).abs() < 1e-9);
}

#[test]
fn introduction_teaches_nothing_and_main_begins_fresh() {
    let (desk, _) = small("");
    let rows = rows(&desk.at(SIMULTANEOUS).join("steps.csv"));
    for row in controlled(&rows, "introduction") {
        assert_eq!((row.word("u_machine"), row.word("success")), ("", ""));
        assert_eq!((row.number("share"), row.number("u")), (1.0, row.number("u_human")));
    }
    let main = controlled(&rows, "main");
    assert_eq!((main[0].number("u_machine"), main[0].number("share")), (0.0, 1.0));
}

#[test]
fn a_sequential_session_leaves_the_person_in_control() {
    let (desk, json) = small("--mode sequential");
    let rows = rows(&desk.at(SEQUENTIAL).join("steps.csv"));
    let main = controlled(&rows, "main");
    for row in &main {
        assert_eq!((row.number("share"), row.number("u")), (1.0, row.number("u_human")));
    }
    assert!(main.iter().any(|row| row.number("u_machine") != 0.0), "the learner watches");
    assert!(main.last().unwrap().number("success") > 0.4);
    assert_eq!(json["phases"]["main"]["final_share"], 1.0);
}

#[test]
fn the_robot_alone_and_zero_control_have_the_same_starts() {
    let (desk, _) = small("");
    let folder = desk.at(SIMULTANEOUS);
    let steps = rows(&folder.join("steps.csv"));
    for row in controlled(&steps, "autonomous") {
        assert_eq!((row.number("share"), row.word("u_human")), (0.0, ""));
        assert_eq!(row.number("u"), row.number("u_machine"));
    }
    for row in controlled(&steps, "zero_control") {
        assert_eq!((row.number("u_applied"), row.word("u_machine")), (0.0, ""));
    }
    let episodes = rows(&folder.join("episodes.csv"));
    let starts = |phase: &str| -> Vec<f64> {
        of_phase(&episodes, phase).iter().map(|row| row.number("start")).collect()
    };
    let release = 5_f64.to_radians();
    assert_eq!(starts("autonomous"), starts("zero_control"));
    assert_eq!(starts("autonomous"), [-release, -release / 2.0, 0.0, release / 2.0, release]);
    let fields: Vec<&str> =
        of_phase(&episodes, "autonomous").iter().map(|row| row.word("receptive_fields")).collect();
    assert!(fields.iter().all(|count| *count == fields[0]), "frozen: {fields:?}");
}

#[test]
fn the_last_tenth_is_the_final_policy_and_its_evaluation_the_autonomous_phase() {
    let (desk, _) = small("");
    let folder = desk.at(SIMULTANEOUS);
    let read = |name: &str| fs::read(folder.join(name)).unwrap();
    assert_eq!(read("policy-100.json"), read("policy.json"));
    let evaluation = rows(&folder.join("evaluation.csv"));
    assert_eq!(evaluation.len(), 10 * 5);
    let last: Vec<&str> = evaluation[45..].iter().map(|row| row.word("duration_s")).collect();
    assert!(evaluation[45..].iter().all(|row| row.word("policy") == "policy-100"));
    let episodes = rows(&folder.join("episodes.csv"));
    let alone: Vec<&str> =
        of_phase(&episodes, "autonomous").iter().map(|row| row.word("duration_s")).collect();
    assert_eq!(last, alone);
}

#[test]
fn assigned_modes_are_balanced_and_a_subject_keeps_its_mode() {
    let desk = Desk::new();
    let mode = |subject: u32, seed: u32| -> String {
        let printed = desk.succeed(&format!(
            "run balance --headless --operator none --mode assigned --subject S{subject:02} \
             --seed {seed} --json --rollouts 1 --phases main"
        ));
        let json: Value = serde_json::from_str(&printed).unwrap();
        json["mode"].as_str().unwrap().to_owned()
    };
    let first: Vec<String> = (0..10).map(|subject| mode(subject, subject)).collect();
    assert_eq!(first.iter().filter(|mode| *mode == "simultaneous").count(), 5, "{first:?}");
    let again: Vec<String> = (0..10).map(|subject| mode(subject, 100 + subject)).collect();
    assert_eq!(first, again);
}

#[test]
fn a_policy_serves_an_autonomous_session_by_file_or_as_the_last() {
    let (desk, json) = small("");
    let alone = "run balance --headless --operator none --seed 7 --json --phases autonomous \
        --set session.autonomous_rollouts=5";
    for policy in ["last", "logs/anon/001-balance-simultaneous/policy.json"] {
        let printed = desk.succeed(&format!("{alone} --policy {policy}"));
        let again: Value = serde_json::from_str(&printed).unwrap();
        for phase in ["autonomous", "zero_control"] {
            assert_eq!(again["phases"][phase], json["phases"][phase], "{policy}");
        }
        assert!(again["phases"]["main"].is_null());
    }
    assert_eq!(names(&desk.at("logs/anon")).len(), 4, "three trials and the lock");
}

#[test]
fn a_duration_counts_controlled_time_of_main() {
    let desk = Desk::new();
    desk.succeed(
        "run balance --headless --operator simulated:average --seed 3 --phases main --duration 20",
    );
    let rows = rows(&desk.at(SIMULTANEOUS).join("steps.csv"));
    assert_eq!(controlled(&rows, "main").len(), 1000);
    let episodes = self::rows(&desk.at(SIMULTANEOUS).join("episodes.csv"));
    assert_eq!(episodes.last().unwrap().word("end"), "time");
    assert_eq!(
        names(&desk.at(SIMULTANEOUS)).iter().filter(|n| n.starts_with("policy-")).count(),
        10
    );
}

/// The steps of an episode that the phase's time cut are not known: the mean is without it,
/// and says so.
#[test]
fn a_mean_of_steps_says_which_episodes_it_is_over() {
    let run = "run mountain-car --headless --operator script:still.csv --phases main --duration 30 \
               --seed 1 --logs .";
    let desk = Desk::new();
    std::fs::write(desk.at("still.csv"), "t,u\n0,0\n").unwrap();
    let printed = desk.succeed(run);
    assert!(
        printed.contains("500 steps over 1 rollout, the flag reached in 0; 1 more cut"),
        "{printed}"
    );
    let json: Value = serde_json::from_str(&desk.succeed(&format!("{run} --json"))).unwrap();
    let main = &json["phases"]["main"];
    assert_eq!((main["episodes"].as_u64(), main["cut"].as_u64()), (Some(2), Some(1)), "{main}");
    assert_eq!(main["mean_steps"], 500.0);
}

/// A cut session of another preset is another experiment, so going on with it is not offered.
#[test]
fn only_a_cut_session_of_the_same_preset_is_offered() {
    let desk = Desk::new();
    let run = |profile: &str| {
        let line = format!("run {profile} --headless --operator none --phases main --rollouts 1");
        text(&desk.run(&line).stderr)
    };
    run("balance");
    let sidecar = desk.at(SIMULTANEOUS).join("session.json");
    let session = std::fs::read_to_string(&sidecar).unwrap();
    let cut = session.replace("\"status\": \"complete\"", "\"status\": \"interrupted\"");
    assert_ne!(cut, session);
    std::fs::write(&sidecar, cut).unwrap();
    assert!(!run("balance-modern").contains("--resume"));
    assert!(run("balance").contains("--resume"));
}

#[test]
fn a_taken_trial_goes_to_the_next_free_one_and_that_is_said() {
    let desk = Desk::new();
    let line = "run balance --headless --operator none --seed 1 --rollouts 1 --phases main \
        --trial 4 --json";
    assert_eq!(text(&desk.run(line).stderr), "");
    let second = desk.run(line);
    assert!(text(&second.stderr).contains("trial 004 of subject anon is taken"));
    assert!(text(&second.stdout).contains("logs/anon/005-balance-simultaneous"));
}

#[test]
fn evaluate_repeats_the_autonomous_phase_and_takes_other_starts() {
    let (desk, json) = small("");
    let evaluate = |words: &str| -> Value {
        serde_json::from_str(&desk.succeed(&format!("evaluate {words} --json"))).unwrap()
    };
    let session = evaluate(&format!("{SIMULTANEOUS} --seed 7"));
    for key in ["episodes", "steps", "mean_balance_s", "sd_balance_s"] {
        assert_eq!(session[key], json["phases"]["autonomous"][key]);
    }
    let file = evaluate(&format!("{SIMULTANEOUS}/policy-010.json --starts 9"));
    assert_eq!((&file["schema"], &file["episodes"]), (&1.into(), &9.into()));
    assert_eq!(file.get("tenths"), None);
    let sentence = desk.succeed(&format!("evaluate {SIMULTANEOUS} --starts 3"));
    assert!(sentence.contains("3 rollouts"), "{sentence}");

    // Nobody on the same starts, and every tenth, as the session itself had them.
    let zero = &session["zero_control"]["mean_balance_s"];
    assert_eq!(zero, &json["phases"]["zero_control"]["mean_balance_s"]);
    let tenths = session["tenths"].as_array().unwrap();
    assert_eq!(tenths.len(), 10);
    assert_eq!(tenths[9]["mean_balance_s"], session["mean_balance_s"]);
    assert_eq!(tenths[0]["improvement_percent"], 0.0);
    let interval: Vec<f64> =
        session["interval95"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    let mean = session["mean_balance_s"].as_f64().unwrap();
    assert!(interval[0] <= mean && mean <= interval[1]);
    let random = evaluate(&format!("{SIMULTANEOUS} --starts 9 --random --seed 3"));
    assert_eq!(random["starts"], "random");
    let start = |k: usize| random["rollouts"][k]["start"].as_f64().unwrap();
    assert!(start(0) != start(1) && start(0).abs() < 0.0873);
}

/// HOUSE's keys of every task, the tables' columns, and that rollouts can replace a duration.
#[test]
fn every_task_reports_its_own_measures() {
    for (task, each, main) in [
        ("swing-up", &["mean_height", "top_share", "longest_hold_s"][..], "regions"),
        ("speed-up", &["mean_speed", "end_hits"], "tau_steps"),
        ("mountain-car", &["mean_steps", "mean_reward", "solved"], "tau_episodes"),
    ] {
        let desk = Desk::new();
        let json: Value = serde_json::from_str(&desk.succeed(&format!(
            "run {task} --headless --operator simulated:average --seed 1 --json --rollouts 3 \
             --set session.introduction_rollouts=1 --set session.introduction_duration_s=None \
             --set session.autonomous_rollouts=2"
        )))
        .unwrap();
        assert_eq!(json["task"], task);
        for phase in ["introduction", "main", "autonomous", "zero_control"] {
            for key in each {
                let value = &json["phases"][phase][*key];
                assert!(value.is_number(), "{task} {phase} {key}: {value}");
            }
        }
        assert_eq!(json["phases"]["main"]["episodes"], 3);
        assert!(!json["phases"]["main"][main].is_null(), "{task}: {main}");
        if task == "swing-up" {
            let regions = json["phases"]["main"]["regions"].as_array().unwrap();
            let names: Vec<&str> = regions.iter().map(|r| r["name"].as_str().unwrap()).collect();
            let expected =
                ["down_slow", "down_fast", "middle_slow", "middle_fast", "top_slow", "top_fast"];
            assert_eq!(names, expected);
            assert!(regions.iter().all(|r| r["share"].is_number() && r["success"].is_number()));
        }
        let folder = desk.at(&format!("logs/anon/001-{task}-simultaneous"));
        let header = |file: &str| -> String {
            fs::read_to_string(folder.join(file)).unwrap().lines().next().unwrap().to_owned()
        };
        let own = match task {
            "swing-up" => ",mean_height,top_share,longest_hold_s",
            "speed-up" => ",mean_speed,end_hits",
            _ => "",
        };
        assert!(header("episodes.csv").ends_with(&format!("receptive_fields{own}")), "{task}");
        assert!(header("evaluation.csv").ends_with(&format!("mean_reward{own}")), "{task}");
        let steps = header("steps.csv");
        let state = if task == "mountain-car" { ",t,x,v,u_human" } else { ",t,x,x_dot,theta" };
        assert!(steps.contains(state), "{steps}");
    }
}

/// A rollout of a session that runs on begins where the one before ended.
#[test]
fn a_swing_up_runs_on_without_a_return() {
    let desk = Desk::new();
    desk.succeed(
        "run swing-up --headless --operator simulated:average --seed 2 --rollouts 3 \
         --phases main --set rules.rollout_s=2.0",
    );
    let steps = rows(&desk.at("logs/anon/001-swing-up-simultaneous/steps.csv"));
    let state = |row: &Row| ["x", "x_dot", "theta", "theta_dot"].map(|c| row.word(c).to_owned());
    let of = |episode: &str| -> Vec<&Row> {
        steps.iter().filter(|row| row.word("episode") == episode).collect()
    };
    for (before, after) in [("1", "2"), ("2", "3")] {
        let (before, after) = (of(before), of(after));
        assert_eq!(before.len(), 101, "a hundred steps and the ending state");
        assert_eq!(state(before[100]), state(after[0]));
        assert_eq!(after[0].word("t"), "0.0");
        assert_ne!(state(after[0]), state(of("1")[0]), "it moves");
    }
}

/// A hold does not end because a rollout's time does.
#[test]
fn a_hold_counts_on_where_a_swing_up_runs_on() {
    let desk = Desk::new();
    desk.succeed(
        "run swing-up --headless --operator simulated:expert --seed 3 --duration 120 \
         --phases main --set rules.rollout_s=2.0",
    );
    let folder = desk.at("logs/anon/001-swing-up-simultaneous");
    let upright = 30_f64.to_radians().cos();
    let (mut held, mut longest) = (0_u32, 0);
    for row in rows(&folder.join("steps.csv")).iter().filter(|row| !row.is_ending()) {
        held = if row.number("theta").cos() >= upright { held + 1 } else { 0 };
        longest = longest.max(held);
    }
    let episodes = rows(&folder.join("episodes.csv"));
    let told = episodes.iter().map(|row| row.number("longest_hold_s")).fold(0.0, f64::max);
    assert!((told - f64::from(longest) * 0.02).abs() < 1e-9, "{told} is not {longest} steps");
    assert!(told > 4.0, "{told} s: too short to go over a border for sure");
}

#[test]
fn simulate_prints_the_plants_own_steps() {
    let desk = Desk::new();
    let forces: Vec<f64> = (0..60).map(|k| 4.0 * (f64::from(k) * 0.3).sin()).collect();
    let table: String = forces.iter().fold("u\n".to_owned(), |all, u| format!("{all}{u}\n"));
    fs::write(desk.at("forces.csv"), &table).unwrap();
    let printed = desk.succeed(
        "simulate balance --start 0,0,0.05,0 --actions forces.csv \
         --set plant.friction_noise_per_s=0 --set plant.pole_length_m=0.6",
    );
    let params = Params { friction_noise_per_s: 0.0, pole_length_m: 0.6, ..Params::default() };
    let mut plant = CartPole::new(params, Seconds(0.02));
    let mut state = State::new([0.0, 0.0, 0.05, 0.0]);
    let mut lines = printed.lines();
    assert_eq!(lines.next(), Some("step,t,x,x_dot,theta,theta_dot"));
    for (step, line) in lines.enumerate() {
        let numbers: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        assert_eq!(State::from_slice(&numbers[2..]), Some(state), "step {step}");
        if let Some(force) = forces.get(step) {
            state = plant.step(&state, Action(*force));
        }
    }
    assert_eq!(printed.lines().count(), 1 + 1 + forces.len());
}

#[test]
fn profiles_are_listed_shown_and_checked() {
    let desk = Desk::new();
    assert!(desk.succeed("profile list").lines().any(|line| line.starts_with("balance ")));
    let shown = desk.succeed("profile show balance --set plant.pole_length_m=0.6");
    assert!(shown.contains("pole_length_m: 0.6"), "{shown}");
    fs::write(desk.at("own.ron"), &shown).unwrap();
    assert!(desk.succeed("profile check own.ron").contains("own.ron is a good profile"));
    desk.succeed("run own.ron --headless --operator none --rollouts 1 --phases main --seed 1");
}

/// A recorded session as a script: the same seed gives the same session, to the byte.
#[test]
fn a_recorded_session_steers_once_more() {
    let desk = Desk::new();
    let line = "run swing-up --headless --seed 4 --duration 60 --mode simultaneous";
    desk.succeed(&format!("{line} --operator simulated:average --subject S01"));
    let first = "logs/S01/001-swing-up-simultaneous";
    desk.succeed(&format!("{line} --operator script:{first} --subject S02"));
    for name in ["steps.csv", "episodes.csv", "policy.json"] {
        let read = |folder: &str| fs::read(desk.at(folder).join(name)).unwrap();
        let second = first.replace("S01", "S02");
        assert!(read(first) == read(&second), "{name} differs");
    }
    // Nobody is there in a rollout that was not recorded: that is counted, and not learned.
    let line = line.replace("--duration 60", "--rollouts 5 --phases main");
    let more = desk.succeed(&format!("{line} --json --operator script:{first} --subject S03"));
    let more: Value = serde_json::from_str(&more).unwrap();
    assert_eq!(more["phases"]["main"]["samples"], 3000, "60 s of 100 were steered");
    let events = desk.at("logs/S03/001-swing-up-simultaneous/events.csv");
    let events = fs::read_to_string(events).unwrap();
    for rollout in [4, 5] {
        assert!(
            events.contains(&format!(
                "main,{rollout},1000,operator_absent,nobody steered at 1000 of 1000 ticks"
            )),
            "{events}"
        );
    }
    assert_eq!(events.matches("operator_absent").count(), 2, "{events}");
    let refused = desk.run(&format!("run balance --headless --operator script:{first}"));
    let message = text(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2));
    assert!(message.contains("a session of swing-up, not of balance"), "{message}");
    let refused = desk.run("run balance --headless --operator script:logs");
    assert_eq!(refused.status.code(), Some(2));
    let message = text(&refused.stderr);
    assert!(message.contains("such as logs/") && message.contains("or a table"), "{message}");
}

#[test]
fn a_script_steers_by_its_table() {
    let desk = Desk::new();
    fs::write(desk.at("pushes.csv"), "t,u,phase,episode\n0,1.5,,\n0.1,-2,,\n0,3,main,2\n").unwrap();
    desk.succeed(
        "run balance --headless --operator script:pushes.csv --seed 1 --rollouts 2 \
         --set session.introduction_rollouts=1 --phases introduction,main",
    );
    let rows = rows(&desk.at(SIMULTANEOUS).join("steps.csv"));
    for row in rows.iter().filter(|row| !row.is_ending()) {
        let expected = match (row.rollout(), row.number("step")) {
            (("main", "2"), _) => 3.0,
            (_, step) if step < 5.0 => 1.5,
            _ => -2.0,
        };
        assert_eq!(row.number("u_human"), expected, "{:?}", row.0);
    }
}
