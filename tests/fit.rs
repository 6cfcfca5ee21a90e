//! `coadapt fit` as a user runs it: golden runs, recorded sessions, wrong inputs, signals.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking, helpers too")]

#[path = "program/desk.rs"]
mod desk;
#[path = "learner/feed.rs"]
mod feed;
#[path = "learner/golden.rs"]
#[allow(dead_code, reason = "other tests use the rest")]
mod golden;

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use coadapt::clock::{Clock, VirtualClock, WallClock};
use coadapt::control::snapshot::{Command as WatcherCommand, Watcher};
use coadapt::learner::{Learner, Model, lwpr, rfwr};
use coadapt::operator::mouse::Pointer;
use coadapt::operator::terminal::{self, Hands};
use coadapt::profile::Order;
use coadapt::profile::settings::{LearnerFile, build};
use coadapt::record::{Policy, read_policy};
use coadapt::run::session::{Company, Keys, Session};
use coadapt::session::Phase;
use coadapt::session::machine::Stage;
use coadapt::signal::Seconds;
use desk::{Desk, names, text};
use golden::{agree, read, table};
use serde_json::Value;

/// The JSON object that the program prints.
fn results(printed: &str) -> Value {
    assert_eq!(printed.lines().count(), 1, "{printed}");
    serde_json::from_str(printed).unwrap()
}

/// The names of the columns of a case that begin with `letter`, with commas.
fn columns(case: &str, letter: char) -> String {
    let head = read(case, "train.csv.gz").lines().next().unwrap().to_owned();
    let names: Vec<&str> = head.split(',').filter(|name| name.starts_with(letter)).collect();
    names.join(",")
}

/// Puts a case's files here, and returns the words that fit it.
fn set_out(desk: &Desk, case: &str) -> String {
    for file in ["train.csv", "predict.csv"] {
        fs::write(desk.at(file), read(case, &format!("{file}.gz"))).unwrap();
    }
    fs::write(desk.at("case.json"), read(case, "case.json")).unwrap();
    let (inputs, outputs) = (columns(case, 'x'), columns(case, 'y'));
    format!("fit train.csv --settings case.json --inputs {inputs} --outputs {outputs}")
}

fn rows(path: &Path) -> (String, Vec<Vec<f64>>) {
    let text = fs::read_to_string(path).unwrap();
    let (head, body) = text.split_once('\n').unwrap();
    let number = |cell: &str| cell.parse().unwrap();
    (head.to_owned(), body.lines().map(|l| l.split(',').map(number).collect()).collect())
}

/// Fits a golden run through the binary, and compares predictions and fields.
fn follows(case: &str, tolerance: f64, head: &str) {
    let desk = Desk::new();
    let line = set_out(&desk, case);
    let printed = desk.succeed(&format!("{line} --query predict.csv --predictions out.csv --json"));
    let results = results(&printed);
    let (ours_head, ours) = rows(&desk.at("out.csv"));
    assert_eq!(ours_head, head);
    agree(case, &table(case, "predict.csv.gz"), &ours, tolerance);
    let trace = read(case, "trace.csv.gz");
    let heads: Vec<&str> = trace.lines().next().unwrap().split(',').collect();
    let column = |name: &str| heads.iter().position(|head| *head == name).unwrap();
    let outputs = columns(case, 'y').split(',').count();
    let last: Vec<Vec<&str>> = trace.lines().map(|line| line.split(',').collect()).collect();
    let rows_at_end = if case.starts_with("lwpr") { outputs } else { 1 };
    let sum = |name: &str| -> u64 {
        let ends = last.iter().rev().take(rows_at_end);
        ends.map(|row| row[column(name)].parse::<u64>().unwrap()).sum()
    };
    assert_eq!(results["fields"], sum("num_rfs"), "{case}");
    assert_eq!(results["pruned"], sum("n_pruned"), "{case}");
    assert_eq!(results["samples"], table(case, "train.csv.gz").len(), "{case}");
    assert_eq!(results["refused"], 0, "{case}");
    assert_eq!(results["schema"], 1);
    for key in ["nmse_one_step", "nmse_final", "samples_per_s"] {
        let value = results[key].as_f64().unwrap();
        assert!(value > 0.0, "{case}: {key} {value}");
    }
    let each: Vec<f64> = results["outputs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|output| output["nmse_final"].as_f64().unwrap())
        .collect();
    assert_eq!(each.len(), outputs);
    let mean = each.iter().sum::<f64>() / if outputs == 2 { 2.0 } else { 1.0 };
    assert_eq!(results["nmse_final"], mean);
}

#[test]
fn lwpr_follows_its_golden_runs() {
    for (case, inputs) in [
        ("a_1d_fixed_d", "x1"),
        ("b_2d_cross_diag", "x1,x2"),
        ("c_2d_cross_full_meta", "x1,x2"),
        ("d_4d_cartpole", "x1,x2,x3,x4"),
        ("f_2d_bisquare_meta", "x1,x2"),
        ("g_4d_cartpole_traj", "x1,x2,x3,x4"),
        ("h_5d_projections", "x1,x2,x3,x4,x5"),
        ("i_1d_rate_halving", "x1"),
    ] {
        let head = format!("{inputs},pred_y1,conf_y1,max_w_y1");
        follows(&format!("lwpr/{case}"), 1e-9, &head);
    }
    let head = "x1,x2,pred_y1,conf_y1,max_w_y1,pred_y2,conf_y2,max_w_y2";
    follows("lwpr/e_2d_2out", 1e-9, head);
}

#[test]
fn rfwr_follows_its_golden_runs() {
    for (case, inputs) in [
        ("a_1d", "x1"),
        ("b_2d_cross_diag", "x1,x2"),
        ("c_2d_cross_full_meta", "x1,x2"),
        ("d_4d_cartpole", "x1,x2,x3,x4"),
        ("f_1d_rate_halving", "x1"),
    ] {
        follows(&format!("rfwr/{case}"), 1e-6, &format!("{inputs},pred_y1,max_w"));
    }
    follows("rfwr/e_2d_2out_bisquare", 1e-6, "x1,x2,pred_y1,pred_y2,max_w");
}

/// A table with a bent function of two inputs.
fn bent(rows: u32) -> String {
    let mut table = "a,b,u\n".to_owned();
    for k in 0..rows {
        let ([a, b], [u]) = feed::sample(k);
        writeln!(table, "{a},{b},{u}").unwrap();
    }
    table
}

const BENT: &str = "fit bent.csv --inputs a,b --outputs u";

#[test]
fn the_errors_are_those_of_each_sample_before_it_is_learned_and_of_the_final_learner() {
    let desk = Desk::new();
    fs::write(desk.at("bent.csv"), bent(1000)).unwrap();
    let results = results(&desk.succeed(&format!("{BENT} --json")));
    let mut model = Model::Rfwr(rfwr::Rfwr::new(rfwr::Settings::new(2, 1)).unwrap());
    let samples: Vec<_> = (0..1000).map(feed::sample).collect();
    let mut squared = 0.0;
    for (x, y) in &samples {
        let mut guess = [0.0];
        model.predict(x, &mut guess);
        squared += (guess[0] - y[0]).powi(2);
        model.update(x, y, 1.0).unwrap();
    }
    let mean = samples.iter().map(|(_, y)| y[0]).sum::<f64>() / 1000.0;
    let scatter: f64 = samples.iter().map(|(_, y)| (y[0] - mean).powi(2)).sum();
    let last: f64 = samples
        .iter()
        .map(|(x, y)| {
            let mut guess = [0.0];
            model.predict(x, &mut guess);
            (guess[0] - y[0]).powi(2)
        })
        .sum();
    let close = |key: &str, value: f64| {
        let ours = results[key].as_f64().unwrap();
        assert!((ours - value).abs() < 1e-9 * value, "{key}: {ours} for {value}");
    };
    close("nmse_one_step", squared / scatter);
    close("nmse_final", last / scatter);
    assert_eq!(results["outputs"][0]["nmse_final"], results["nmse_final"]);
}

#[test]
fn a_pipe_is_read_as_a_file_is() {
    let desk = Desk::new();
    fs::write(desk.at("bent.csv"), bent(500)).unwrap();
    desk.succeed(&format!("{BENT} --out file.json"));
    let piped = desk
        .program("fit - --inputs a,b --outputs u --out pipe.json")
        .write_stdin(bent(500))
        .output()
        .unwrap();
    assert!(piped.status.success(), "{}", text(&piped.stderr));
    let said = text(&piped.stdout);
    assert!(said.contains("500 samples learned") && said.contains("pipe.json"), "{said}");
    assert_eq!(fs::read(desk.at("file.json")).unwrap(), fs::read(desk.at("pipe.json")).unwrap());
}

#[test]
fn samples_that_are_not_finite_are_refused_counted_and_change_nothing() {
    let desk = Desk::new();
    fs::write(desk.at("bent.csv"), bent(400)).unwrap();
    let mut spoilt = String::new();
    for (k, line) in bent(400).lines().enumerate() {
        writeln!(spoilt, "{line}").unwrap();
        if k % 100 == 7 {
            spoilt += "NaN,0,1\n0.5,-inf,1\n0,0,inf\n";
        }
    }
    fs::write(desk.at("spoilt.csv"), spoilt).unwrap();
    for learner in ["rfwr", "lwpr"] {
        let line = format!("{BENT} --learner {learner}");
        let whole = results(&desk.succeed(&format!("{line} --out whole.json --json")));
        let spoilt = line.replace("bent.csv", "spoilt.csv");
        let output = desk.run(&format!("{spoilt} --out spoilt.json --json"));
        let said = text(&output.stderr);
        assert!(said.contains("12 samples were refused") && said.contains("line 9"), "{said}");
        let spoilt = results(&text(&output.stdout));
        assert_eq!((&whole["refused"], &spoilt["refused"]), (&0.into(), &12.into()));
        for key in ["samples", "nmse_one_step", "nmse_final", "fields", "outputs"] {
            assert_eq!(whole[key], spoilt[key], "{key}");
        }
        let [whole, spoilt] =
            ["whole.json", "spoilt.json"].map(|file| fs::read(desk.at(file)).unwrap());
        assert_eq!(whole, spoilt);
    }
}

/// A session of the simulated person; the folder it left.
fn play(desk: &Desk, mode: &str, learner: &str, more: &str) -> String {
    desk.succeed(&format!(
        "run balance --headless --operator simulated:average --seed 5 --mode {mode} --learner \
         {learner} --phases introduction,main --set session.introduction_rollouts=2 {more}"
    ));
    let trial = names(&desk.at("logs/anon")).into_iter().rfind(|n| n.ends_with(mode)).unwrap();
    format!("logs/anon/{trial}")
}

#[test]
fn a_session_refitted_with_its_own_settings_gives_its_policy_to_the_byte() {
    let desk = Desk::new();
    for (mode, learner, more) in [
        ("simultaneous", "rfwr", "--rollouts 12"),
        ("sequential", "lwpr", "--duration 20"),
        ("simultaneous", "lwpr", "--rollouts 8 --set teaching.target=executed"),
    ] {
        let folder = play(&desk, mode, learner, more);
        let results = results(&desk.succeed(&format!("fit {folder} --out again.json --json")));
        assert_eq!(results["learner"], learner);
        let recorded = fs::read(desk.at(&folder).join("policy.json")).unwrap();
        assert_eq!(text(&fs::read(desk.at("again.json")).unwrap()), text(&recorded), "{mode}");
    }
}

/// Delayed and weighted lessons, executed actions and frozen regions are found again in the
/// rows of every task.
#[test]
fn modern_sessions_of_every_task_are_refitted_to_the_byte() {
    for (profile, task, more) in [
        ("balance-modern", "balance", "--rollouts 12"),
        ("swing-up-modern", "swing-up", "--duration 90 --set teaching.outcome_s=0.3"),
        (
            "swing-up",
            "swing-up",
            "--duration 90 --set sharing.freeze=share_and_learner --set sharing.tau_steps=50 \
             --set sharing.window_steps=50 --set teaching.target=executed \
             --set teaching.delay_s=0.2 --set rules.rollout_s=5.0",
        ),
        (
            "speed-up-modern",
            "speed-up",
            "--duration 90 --set sharing.freeze=share_and_learner --set sharing.tau_steps=50",
        ),
        (
            "mountain-car-modern",
            "mountain-car",
            "--rollouts 12 --set sharing.freeze=share_and_learner --set sharing.freeze_share=0.9 \
             --set sharing.window_episodes=3 --set sharing.tau_floor_episodes=1",
        ),
    ] {
        let desk = Desk::new();
        desk.succeed(&format!(
            "run {profile} --headless --operator simulated:average --seed 5 \
             --phases introduction,main {more}"
        ));
        let folder = format!("logs/anon/001-{task}-simultaneous");
        let events = fs::read_to_string(desk.at(&folder).join("events.csv")).unwrap();
        assert!(events.contains("frozen") || !more.contains("freeze"), "{profile}: {events}");
        desk.succeed(&format!("fit {folder} --out again.json --json"));
        let recorded = fs::read(desk.at(&folder).join("policy.json")).unwrap();
        assert_eq!(text(&fs::read(desk.at("again.json")).unwrap()), text(&recorded), "{profile}");
    }
}

#[test]
fn a_session_is_refitted_with_other_settings_and_without_its_discarded_rollouts() {
    let desk = Desk::new();
    let folder = play(&desk, "sequential", "rfwr", "--rollouts 6");
    fs::write(desk.at("other.ron"), "(kind: lwpr, init_d: 1.0)").unwrap();
    let fit = format!("fit {folder} --json");
    let whole = results(&desk.succeed(&format!("{fit} --settings other.ron --out other.json")));
    assert_eq!(whole["learner"], "lwpr");
    let policy: Policy<Model> = read_policy(&desk.at("other.json")).unwrap();
    let Model::Lwpr(lwpr) = &policy.learner else { panic!("{:?}", policy.learner) };
    assert_eq!(lwpr.settings().init_d, lwpr::InitialMetric::Scalar(1.0));
    assert_eq!(lwpr.settings().norm_out, [10.0], "what the file leaves out is the session's");
    let seen = results(&desk.succeed(&format!("{fit} --inputs theta,theta_dot --outputs u")));
    assert_eq!(seen["inputs"], serde_json::json!(["theta", "theta_dot"]));
    desk.succeed("evaluate other.json --starts 3");
    refuses(&desk, &format!("{fit} --out {folder}/policy.json"), &["stays as it is"]);

    // The third rollout of main, as if its person had thrown it away and repeated it.
    let episodes = desk.at(&folder).join("episodes.csv");
    let table = fs::read_to_string(&episodes).unwrap();
    let third = table.lines().find(|line| line.starts_with("main,3,")).unwrap();
    let cells: Vec<&str> = third.split(',').collect();
    let discarded = third.replace(&format!(",{},", cells[5]), ",discarded,");
    fs::write(&episodes, table.replace(third, &discarded)).unwrap();
    let steps: u64 = cells[3].parse().unwrap();
    let rest = results(&desk.succeed(&fit));
    assert_eq!(rest["samples"].as_u64().unwrap(), whole["samples"].as_u64().unwrap() - steps);
    // A rollout that was cut is in no learner that goes on.
    fs::write(&episodes, table.lines().take(6).collect::<Vec<_>>().join("\n") + "\n").unwrap();
    let cut = results(&desk.succeed(&fit));
    assert!(cut["samples"].as_u64() < whole["samples"].as_u64());
}

/// Virtual time, with a person at the keys who begins every phase, and discards the second
/// rollout of main after its twentieth step.
struct Person {
    clock: VirtualClock,
    watcher: Watcher,
    discarded: bool,
}

impl Clock for Person {
    fn now(&self) -> Seconds {
        self.clock.now()
    }

    fn wait_until(&mut self, deadline: Seconds) -> Seconds {
        let due = self.clock.wait_until(deadline);
        match self.watcher.look().stage {
            Stage::Instruction(_) | Stage::Break { .. } => {
                assert!(self.watcher.ask(WatcherCommand::Begin));
            }
            Stage::Running(moment)
                if moment.phase == Phase::Main && moment.rollout == 2 && moment.step == 20 =>
            {
                let ask = !std::mem::replace(&mut self.discarded, true);
                assert!(!ask || self.watcher.ask(WatcherCommand::Discard));
            }
            _ => {}
        }
        due
    }

    fn is_wall(&self) -> bool {
        false
    }
}

#[test]
fn a_discarded_rollout_is_in_no_refit() {
    let desk = Desk::new();
    let mut order = Order { logs: desk.at("logs"), seed: Some(3), ..Order::default() };
    order.operator = "simulated:average".to_owned();
    for (key, value) in [
        ("session.phases", "[main]"),
        ("session.main_rollouts", "5"),
        ("session.break_s", "0.0"),
        ("rules.fail_deg", "60.0"),
    ] {
        order.change(key, value);
    }
    let hands = Hands::new(&terminal::Params::default());
    let pointer = Pointer::default();
    let keys = Keys { hands, pointer, clock: WallClock::start() };
    let session = Session::begin(&order, &Company::Attended(keys)).unwrap();
    let folder = session.folder().to_owned();
    let watcher = session.watcher.clone();
    let mut person = Person { clock: VirtualClock::default(), watcher, discarded: false };
    session.run(&mut person, || None).unwrap();
    let episodes = fs::read_to_string(folder.join("episodes.csv")).unwrap();
    assert_eq!(episodes.matches(",discarded,").count(), 1, "{episodes}");
    desk.succeed("fit logs/anon/001-balance-simultaneous --out again.json");
    let recorded = fs::read_to_string(folder.join("policy.json")).unwrap();
    assert_eq!(fs::read_to_string(desk.at("again.json")).unwrap(), recorded);
}

/// The program refuses `line` with exit code 2, prints nothing, says all of `says`, and
/// leaves nothing behind.
fn refuses(desk: &Desk, line: &str, says: &[&str]) {
    let before = names(&desk.at(""));
    let output = desk.run(line);
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{line}: {message}");
    assert_eq!(text(&output.stdout), "", "{line}");
    for word in says {
        assert!(message.contains(word), "{line}: no {word:?} in {message}");
    }
    assert_eq!(names(&desk.at("")), before, "{line} left something behind");
}

#[test]
fn wrong_words_and_tables_are_refused_with_their_place() {
    let desk = Desk::new();
    fs::write(desk.at("bent.csv"), bent(20)).unwrap();
    fs::write(desk.at("bad.csv"), "a,b,u\n1,2,3\n1,,x\n1,2\n").unwrap();
    fs::write(desk.at("empty.csv"), "a,b,u\n").unwrap();
    fs::write(desk.at("nan.csv"), "a,b,u\nNaN,1,1\n").unwrap();
    fs::create_dir(desk.at("folder")).unwrap();
    refuses(&desk, "fit none.csv", &["none.csv", "cannot be read"]);
    refuses(&desk, "fit none.csv --inputs a --outputs u", &["none.csv cannot be read"]);
    refuses(&desk, "fit bent.csv", &["--inputs", "its columns are a,b,u"]);
    refuses(&desk, "fit bent.csv --inputs a,, --outputs u", &["--inputs: a name is empty"]);
    refuses(
        &desk,
        "fit bent.csv --inputs a,c --outputs v",
        &["line 1: there are no columns c,v, only a,b,u"],
    );
    refuses(&desk, "fit bent.csv --inputs a --outputs a", &["a is asked for twice"]);
    refuses(&desk, "fit folder", &["folder is no recorded session"]);
    refuses(&desk, &format!("{BENT} --learner net"), &["--learner \"net\"", "rfwr or lwpr"]);
    let bad = BENT.replace("bent.csv", "bad.csv");
    let places =
        ["bad.csv, line 3, column b: the cell is empty", "line 3, column u: \"x\"", "line 4: it"];
    refuses(&desk, &bad, &places);
    refuses(&desk, &BENT.replace("bent.csv", "empty.csv"), &["no samples"]);
    refuses(&desk, &BENT.replace("bent.csv", "nan.csv"), &["no sample could be learned", "line 2"]);
    refuses(&desk, &format!("{BENT} --query bent.csv"), &["--predictions"]);
    let ask = format!("{BENT} --query none.csv --predictions out.csv");
    refuses(&desk, &ask, &["the query none.csv cannot be read"]);
    let ask = format!("{BENT} --query bad.csv --predictions out.csv");
    refuses(&desk, &ask, &["bad.csv, line 3, column b"]);
    refuses(&desk, &format!("{BENT} --out none/p.json"), &["--out none/p.json", "choose a folder"]);
    refuses(&desk, &format!("{BENT} --out folder"), &["this is a folder"]);
    refuses(&desk, &format!("{BENT} --out ./bent.csv"), &["read by this very command"]);
    refuses(
        &desk,
        &format!("{BENT} --out x --query bent.csv --predictions ./x"),
        &["name the same file"],
    );
}

#[test]
fn wrong_settings_are_refused_all_at_once_with_their_place() {
    let desk = Desk::new();
    fs::write(desk.at("bent.csv"), bent(20)).unwrap();
    let refused = |file: &str, content: &str, says: &[&str]| {
        fs::write(desk.at(file), content).unwrap();
        refuses(&desk, &format!("{BENT} --settings {file}"), says);
    };
    refused(
        "s.ron",
        "(\n  w_gne: 0.1,\n  penalty: -1,\n  kernel: box,\n  init_D: 1, init_d: 2,\n  meta: 2,\n)",
        &[
            "s.ron:2:",
            "did you mean `w_gen`?",
            "s.ron:3:",
            "`penalty` is -1",
            "0.0 to",
            "gaussian or bi_square",
            "`init_d` is 2, which is given twice",
            "true or false",
            "5 faults in s.ron",
        ],
    );
    refused("s.json", "{\n \"init_D\": [[1, 0],,\n", &["s.json:2:", "cannot be read"]);
    refused("s.json", "[1]", &["s.json:1:"]);
    refused("s.ron", "", &["empty"]);
    refused("s.json", "{\"n_in\": 3}", &["`n_in` is 3", "--inputs names 2"]);
    refused("s.json", "{\"norm_in\": [1, 2, 3]}", &["s.json, line 1", "`norm_in` has 3"]);
    refused("s.json", "{\"init_d\": [[1, 2], [2, 1]], \"diag_only\": 0}", &["positive definite"]);
    refused("s.json", "{\"init_d\": [[2, 1], [1, 2]]}", &["full matrix", "diag_only: false"]);
    refused("s.json", "{\"init_alpha\": [50, 60]}", &["one number serves all"]);
    refused("s.ron", "(kind: rfwr, init_p: [1e10, 5.0])", &["init_p", "one number serves all"]);
    refused("s.json", "{\"cutoff_predict\": 0.1, \"cutoff_update\": 0.01}", &["one cutoff"]);
    refused("s.json", "{\"algorithm\": \"mlp\"}", &["rfwr or lwpr"]);
    refused("s.ron", "(kind: lwpr, learner: rfwr)", &["`kind` is lwpr", "another learner"]);
    refused("s.ron", "(init_d: NaN)", &["`init_d` is NaN"]);
    fs::write(desk.at("s.ron"), "(learner: lwpr)").unwrap();
    refuses(&desk, &format!("{BENT} --settings s.ron --learner rfwr"), &["these are settings for"]);
    refuses(&desk, &format!("{BENT} --settings none.ron"), &["none.ron cannot be read"]);
    // A key of the other learner is left out, and that is said.
    fs::write(desk.at("s.ron"), "(init_s2: 1e-9, max_fields: Some(3), norm_in: 2)").unwrap();
    let output = desk.run(&format!("{BENT} --settings s.ron --json"));
    assert!(text(&output.stderr).contains("rfwr has no init_s2"), "{}", text(&output.stderr));
    assert_eq!(results(&text(&output.stdout))["fields"], 3);
}

#[test]
fn every_form_of_a_setting_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    let model = |file: &str, content: &str| {
        let path = folder.path().join(file);
        fs::write(&path, content).unwrap();
        let file = LearnerFile::open(&path).unwrap();
        build(file.kind().unwrap_or_default(), (2, 1), None, Some(&file)).unwrap()
    };
    let settings = |model: Model| match model {
        Model::Rfwr(rfwr) => rfwr.settings().clone(),
        Model::Lwpr(_) => panic!("not asked for"),
    };
    let scalar = settings(model("s.ron", "(init_d: 9, norm_in: [2, 3], INIT_ALPHA: 7.0)"));
    assert_eq!(scalar.init_d, rfwr::InitialMetric::Scalar(9.0));
    assert_eq!((&scalar.norm_in[..], scalar.init_alpha), (&[2.0, 3.0][..], 7.0));
    let text = "\u{feff}{\"init_D\": [[9, 0], [0, 4]], \"init_alpha\": [[7, 7], [7, 7]],
        \"max_fields\": null, \"kernel\": \"BiSquare\", \"init_P\": [1e9, 1e9], \"meta\": 1}";
    let diagonal = settings(model("s.json", text));
    assert_eq!(diagonal.init_d, rfwr::InitialMetric::Diagonal(vec![9.0, 4.0]));
    assert_eq!((diagonal.init_alpha, diagonal.init_p, diagonal.meta), (7.0, 1e9, true));
    let text = "(task: \"balance\", learner: (kind: rfwr, init_d: 2.0), sharing: (gate: 0.1))";
    let section = settings(model("profile.ron", text));
    assert_eq!(section.init_d, rfwr::InitialMetric::Scalar(2.0));
    let text = "(init_d: [[9.0, 1.0], [1.0, 4.0]], diag_only: false, d_floor: 0.5)";
    let full = settings(model("s.ron", text));
    let rows = vec![vec![9.0, 1.0], vec![1.0, 4.0]];
    assert_eq!((&full.init_d, full.d_floor), (&rfwr::InitialMetric::Full(rows), Some(0.5)));
    // The settings of a policy, as they stand there.
    let settings_of = |settings: &rfwr::Settings| serde_json::to_string(settings).unwrap();
    for before in [&full, &diagonal, &scalar] {
        assert_eq!(&settings(model("s.json", &settings_of(before))), before);
    }
}

#[test]
fn the_shipped_settings_hold_every_key_at_its_published_value() {
    let shipped = |name: &str| {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("profiles/learners");
        let path = root.join(format!("{name}.ron"));
        let file = LearnerFile::open(&path).unwrap();
        assert_eq!(file.kind().unwrap().word(), name);
        assert_eq!(file.unused(file.kind().unwrap()), [""; 0]);
        let text = fs::read_to_string(&path).unwrap();
        (build(file.kind().unwrap(), (3, 2), None, Some(&file)).unwrap(), text)
    };
    let (Model::Rfwr(rfwr), rfwr_text) = shipped("rfwr") else { panic!("not RFWR") };
    assert_eq!(rfwr.settings(), &rfwr::Settings::new(3, 2));
    let (Model::Lwpr(lwpr), lwpr_text) = shipped("lwpr") else { panic!("not LWPR") };
    assert_eq!(lwpr.settings(), &lwpr::Settings::new(3, 2));
    let keys = |settings: Value| settings.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    let of = |text: &str, settings: Value| {
        for key in keys(settings).iter().filter(|key| !["inputs", "outputs"].contains(&&***key)) {
            assert!(text.contains(&format!("\n    {key}: ")), "{key} is missing");
        }
    };
    of(&rfwr_text, serde_json::to_value(rfwr.settings()).unwrap());
    of(&lwpr_text, serde_json::to_value(lwpr.settings()).unwrap());
}

#[test]
fn a_signal_ends_a_fit_with_its_code_and_leaves_nothing_behind() {
    for (signal, code) in [("INT", 130), ("TERM", 143)] {
        let desk = Desk::new();
        fs::write(desk.at("q.csv"), "a,b\n0,0\n").unwrap();
        fs::write(desk.at("p.json"), "the old one").unwrap();
        // The pipe stays open: the program waits for more when the signal comes.
        let mut child = Command::new(env!("CARGO_BIN_EXE_coadapt"))
            .current_dir(desk.at(""))
            .args("fit - --inputs a,b --outputs u --out p.json".split(' '))
            .args("--query q.csv --predictions out.csv".split(' '))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut pipe = child.stdin.take().unwrap();
        pipe.write_all(bent(200).as_bytes()).unwrap();
        let listens = || {
            let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
            let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
            u64::from_str_radix(caught.trim(), 16).unwrap() & (1 << 14) != 0
        };
        wait_until(listens);
        let kill = format!("-{signal}");
        Command::new("kill").args([&kill, &child.id().to_string()]).status().unwrap();
        let output = child.wait_with_output().unwrap();
        drop(pipe);
        assert_eq!(output.status.code(), Some(code), "{}", text(&output.stderr));
        assert!(text(&output.stderr).contains("nothing was written"));
        assert_eq!(names(&desk.at("")), ["p.json", "q.csv"]);
        assert_eq!(fs::read_to_string(desk.at("p.json")).unwrap(), "the old one");
    }
}

#[test]
fn a_signal_in_the_middle_of_learning_leaves_nothing_behind() {
    let desk = Desk::new();
    // Far too many fields: this takes minutes.
    fs::write(desk.at("bent.csv"), bent(60_000)).unwrap();
    fs::write(desk.at("slow.ron"), "(init_d: 1e6)").unwrap();
    let child = Command::new(env!("CARGO_BIN_EXE_coadapt"))
        .current_dir(desk.at(""))
        .args(BENT.split(' '))
        .args("--settings slow.ron --out p.json".split(' '))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Its file in the making says that it has begun.
    wait_until(|| names(&desk.at("")).len() == 3);
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    assert_eq!(names(&desk.at("")), ["bent.csv", "slow.ron"]);
}

fn wait_until(mut holds: impl FnMut() -> bool) {
    let mut clock = WallClock::start();
    while !holds() {
        assert!(clock.now() < Seconds(60.0), "waited for a minute in vain");
        clock.wait_until(clock.now() + Seconds(0.005));
    }
}

#[test]
fn policies_are_readable_and_damaged_foreign_and_newer_ones_are_refused() {
    let desk = Desk::new();
    fs::write(desk.at("bent.csv"), bent(300)).unwrap();
    for learner in ["rfwr", "lwpr"] {
        desk.succeed(&format!("{BENT} --learner {learner} --out p.json"));
        let good = fs::read_to_string(desk.at("p.json")).unwrap();
        for line in ["  \"task\": \"table\",", "  \"features\": [\"a\", \"b\"],"] {
            assert!(good.lines().any(|l| l == line), "{good}");
        }
        assert!(good.contains("\"w_gen\": 0.1,\n") && good.lines().count() > 60);
        let evaluate = "evaluate p.json --profile balance";
        refuses(&desk, evaluate, &["2 inputs, a,b, where balance has 4, x,x_dot,theta"]);
        refuses(&desk, "evaluate p.json", &["learned from a table", "--profile"]);
        let refused = |content: &str, says: &str| {
            fs::write(desk.at("p.json"), content).unwrap();
            refuses(&desk, evaluate, &["p.json", says]);
        };
        refused(&good[..good.len() / 2], "cut off");
        refused(&good.replace("\"samples\": 300", "\"samples\": -3"), "wrong value");
        refused(&good.replace("\"w_gen\": 0.1", "\"w_gen\": 1e999"), "number out of range");
        refused(&good.replace("\"w_gen\": 0.1", "\"w_gen\": NaN"), "not a valid JSON");
        refused(&good.replace("\"w_gen\": 0.1", "\"w_gen\": 7.5"), "`w_gen` is 7.5");
        refused(&good.replace("\"program\": \"coadapt\"", "\"program\": \"x\""), "not a policy");
        refused(&good.replace("\"schema\": 1", "\"schema\": 2"), "newer coadapt");
        refused(&good.replace("\"kind\": \"policy\"", "\"kind\": \"checkpoint\""), "checkpoint");
        refused("\u{0}\u{1}", "not a valid JSON");
    }
}

#[test]
fn a_table_with_a_tasks_columns_gives_a_policy_for_it() {
    let desk = Desk::new();
    let mut table = "x,x_dot,theta,theta_dot,force\n".to_owned();
    for k in 0..2000_u32 {
        let t = f64::from(k) * 0.02;
        let (x, v) = (0.3 * t.sin(), (1.7 * t).cos());
        let (theta, omega) = (0.4 * (2.3 * t).sin(), 2.0 * (3.1 * t).cos());
        let force = 2.4 * x + 5.4 * v + 52.5 * theta + 13.5 * omega;
        writeln!(table, "{x},{v},{theta},{omega},{force}").unwrap();
    }
    fs::write(desk.at("table.csv"), table).unwrap();
    fs::write(desk.at("s.ron"), "(init_d: 0.5, norm_in: [0.5, 1, 0.5, 2.6], norm_out: 10)")
        .unwrap();
    desk.succeed(
        "fit table.csv --settings s.ron --inputs x,x_dot,theta,theta_dot --outputs force --out \
         p.json",
    );
    let said = desk.succeed("evaluate p.json --profile balance --starts 3 --json");
    assert_eq!(results(&said)["episodes"], 3);
    assert_eq!(results(&said)["preset"], "table");
    let edited =
        fs::read_to_string(desk.at("p.json")).unwrap().replace("[\"force\"]", "[\"u\", \"v\"]");
    fs::write(desk.at("p.json"), edited).unwrap();
    let evaluate = "evaluate p.json --profile balance --starts 3";
    refuses(&desk, evaluate, &["names the outputs u,v, but its learner has 1"]);
}

#[test]
fn a_link_is_followed_even_where_it_leads_to_nothing_yet() {
    let desk = Desk::new();
    fs::write(desk.at("bent.csv"), bent(300)).unwrap();
    std::os::unix::fs::symlink("there.json", desk.at("link.json")).unwrap();
    desk.succeed(&format!("{BENT} --out link.json"));
    assert!(desk.at("link.json").is_symlink() && desk.at("there.json").is_file());
}
