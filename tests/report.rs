//! Reports as a user makes them, of sessions that went well and of what else lies in folders.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

#[path = "program/desk.rs"]
mod desk;

use std::fs;
use std::path::Path;

use desk::{Desk, names, text};
use serde_json::Value;

/// A short session of `subject`.
fn session(desk: &Desk, profile: &str, subject: &str, mode: &str, seed: u32) {
    desk.succeed(&format!(
        "run {profile} --headless --operator simulated:naive --subject {subject} --mode {mode} \
         --seed {seed} --rollouts 14 --set session.introduction_rollouts=1 --set \
         session.autonomous_rollouts=12"
    ));
}

/// Three subjects in each mode, and one of them in both.
fn group(desk: &Desk) {
    for (subject, mode, seed) in [
        ("A1", "sequential", 1),
        ("A2", "sequential", 2),
        ("A3", "sequential", 3),
        ("B1", "simultaneous", 4),
        ("B2", "simultaneous", 5),
        ("A1", "simultaneous", 6),
    ] {
        session(desk, "balance", subject, mode, seed);
    }
}

fn json(desk: &Desk, line: &str) -> Value {
    serde_json::from_str(&desk.succeed(line)).unwrap()
}

/// What the figures and tables of a report are in the thesis.
fn thesis(report: &Value) -> Vec<String> {
    let sections = report["sections"].as_array().unwrap();
    let items = sections.iter().flat_map(|section| section["items"].as_array().unwrap());
    items.map(|item| item["thesis"].as_str().unwrap().to_owned()).collect()
}

/// What was left out: file and reason.
fn left_out(report: &Value) -> Vec<String> {
    let each = |left: &Value| {
        format!("{}: {}", left["path"].as_str().unwrap(), left["why"].as_str().unwrap())
    };
    report["left_out"].as_array().unwrap().iter().map(each).collect()
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}

#[test]
fn a_group_becomes_the_figures_of_the_thesis() {
    let desk = Desk::new();
    group(&desk);
    let report = json(&desk, "report logs --json");
    assert_eq!(report["schema"], 1);
    assert_eq!(report["sessions"].as_array().unwrap().len(), 6);
    assert_eq!(report["left_out"].as_array().unwrap().len(), 0);
    let figures = thesis(&report);
    for number in (14..=38).filter(|number| !(10..14).contains(number)) {
        let name = format!("figure {number}");
        assert!(figures.contains(&name), "{name}: {figures:?}");
    }
    // Every figure says what, of what, and where its data are.
    for section in report["sections"].as_array().unwrap() {
        for item in section["items"].as_array().unwrap() {
            assert_eq!(item["preset"], "balance · thesis", "{item}");
            assert!(item["sentence"].as_str().unwrap().ends_with('.'), "{item}");
        }
    }
    let groups = report["sections"].as_array().unwrap().iter();
    let titles: Vec<&str> = groups.map(|section| section["title"].as_str().unwrap()).collect();
    assert_eq!(titles.iter().filter(|title| title.starts_with("Group")).count(), 1, "{titles:?}");
}

#[test]
fn a_page_and_its_files_are_written_whole() {
    let desk = Desk::new();
    session(&desk, "balance", "S1", "simultaneous", 1);
    let output = desk.run("report logs --out page.html --csv data");
    assert!(output.status.success() && output.stdout.is_empty(), "{}", text(&output.stderr));
    let page = fs::read_to_string(desk.at("page.html")).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
    assert!(page.len() < 3_000_000, "{}", page.len());
    // Each figure names a data file that is there, and has a picture beside it.
    let named: Vec<&str> = page
        .split("Data: <code>")
        .skip(1)
        .map(|rest| rest.split("</code>").next().unwrap())
        .collect();
    assert!(named.len() > 10, "{named:?}");
    for name in &named {
        assert!(desk.at("data").join(name).is_file(), "{name}");
    }
    let files = names(&desk.at("data"));
    let pictures =
        files.iter().filter(|name| Path::new(name).extension().is_some_and(|e| e == "svg")).count();
    assert_eq!(pictures, page.matches("<button data-save").count());
    let csv =
        fs::read_to_string(desk.at("data/S1-001-balance-simultaneous-per-rollout.csv")).unwrap();
    assert!(csv.starts_with("series,rollout,balance_time_s,least,most\nsimultaneous,1,"), "{csv}");
    assert_eq!(csv.lines().filter(|line| line.starts_with("simultaneous,")).count(), 14);
    let svg = fs::read_to_string(desk.at("data/S1-001-balance-simultaneous-share.svg")).unwrap();
    assert!(svg.starts_with("<svg") && !svg.contains("var("));
}

#[test]
fn what_was_recorded_is_never_written_over() {
    let desk = Desk::new();
    session(&desk, "balance", "S1", "simultaneous", 1);
    let rows = "logs/S1/001-balance-simultaneous/steps.csv";
    let before = fs::read(desk.at(rows)).unwrap();
    let output = desk.run(&format!("report logs --out {rows}"));
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("choose another place"), "{}", text(&output.stderr));
    assert_eq!(fs::read(desk.at(rows)).unwrap(), before);
    // Not even where the file that says what the rows are is gone.
    fs::remove_file(desk.at("logs/S1/001-balance-simultaneous/session.json")).unwrap();
    session(&desk, "balance", "S2", "simultaneous", 2);
    let output = desk.run(&format!("report logs --out {rows}"));
    assert_eq!((output.status.code(), fs::read(desk.at(rows)).unwrap()), (Some(2), before));
    // A page goes where it is sent, and a device stays one.
    assert!(desk.succeed("report logs --out /dev/stdout").contains("</html>"));
    desk.succeed("report logs --out page.html");
    desk.succeed("report logs --out page.html");
}

/// Each folder counts its trials by itself.
#[test]
fn experiments_in_two_folders_may_have_the_same_subjects_and_trials() {
    let desk = Desk::new();
    session(&desk, "balance --logs a", "S1", "simultaneous", 1);
    session(&desk, "balance-modern --logs b", "S1", "simultaneous", 1);
    let report = json(&desk, "report a b --json");
    assert_eq!(report["sessions"].as_array().unwrap().len(), 2);
    assert_eq!(report["left_out"].as_array().unwrap().len(), 0);
}

#[test]
fn subjects_in_both_modes_are_paired_and_the_others_left_out_of_it() {
    let desk = Desk::new();
    for (subject, seed) in [("A1", 1), ("A2", 2), ("A3", 3)] {
        session(&desk, "balance", subject, "sequential", seed);
        session(&desk, "balance", subject, "simultaneous", seed + 10);
    }
    session(&desk, "balance", "C1", "sequential", 4);
    let report = json(&desk, "report logs --json");
    // The comparisons are there as numbers, too.
    let comparisons = report["comparisons"].as_array().unwrap();
    assert_eq!(comparisons.len(), 3, "{comparisons:?}");
    assert!(comparisons[0]["p"].as_f64().unwrap() > 0.0, "{comparisons:?}");
    let report = report.to_string();
    assert!(report.contains("n = 3 pairs"), "{report}");
    assert!(report.contains("in one mode only: C1"), "{report}");
    assert!(!report.contains("BCa interval"), "three pairs are too few for one");
}

#[test]
fn one_person_in_both_modes_does_not_undo_the_comparison_of_the_others() {
    let desk = Desk::new();
    for (subject, mode, seed) in [
        ("A1", "sequential", 1),
        ("A2", "sequential", 2),
        ("B1", "simultaneous", 3),
        ("B2", "simultaneous", 4),
        ("C1", "sequential", 5),
        ("C1", "simultaneous", 6),
    ] {
        session(&desk, "balance", subject, mode, seed);
    }
    let report = json(&desk, "report logs --json").to_string();
    assert!(report.contains("n = 2 and 2"), "{report}");
    assert!(report.contains("in both modes, the others in one: C1"), "{report}");
}

#[test]
fn figures_go_by_the_rollouts_own_numbers() {
    let desk = Desk::new();
    session(&desk, "balance", "S1", "simultaneous", 1);
    let path = desk.at("logs/S1/001-balance-simultaneous/episodes.csv");
    let rows = fs::read_to_string(&path).unwrap();
    let lost = |row: &&str| !row.starts_with("main,5,");
    let kept: Vec<&str> = rows.lines().filter(lost).collect();
    assert_eq!(kept.len() + 1, rows.lines().count());
    fs::write(&path, kept.join("\n") + "\n").unwrap();
    desk.succeed("report logs --csv data");
    let read = |name: &str| {
        let file = desk.at(&format!("data/S1-001-balance-simultaneous-{name}.csv"));
        fs::read_to_string(file).unwrap()
    };
    for name in ["per-rollout", "success", "share"] {
        let csv = read(name);
        assert!(csv.contains("\nsimultaneous,5,,,\n"), "a gap in {name}: {csv}");
        assert!(csv.contains("\nsimultaneous,14,"), "{name}: {csv}");
    }
}

#[test]
fn without_a_terminal_the_report_is_text() {
    let desk = Desk::new();
    session(&desk, "balance", "S1", "sequential", 1);
    let printed = desk.succeed("report logs/S1");
    for wanted in ["figure 24", "balance · thesis", "▁", "robot alone"] {
        assert!(printed.contains(wanted), "{wanted}: {printed}");
    }
}

#[test]
fn presets_and_profiles_are_never_pooled() {
    let desk = Desk::new();
    session(&desk, "balance", "S1", "simultaneous", 1);
    session(&desk, "balance", "S2", "simultaneous", 2);
    session(&desk, "balance-modern", "S3", "simultaneous", 3);
    session(&desk, "balance --set plant.pole_length_m=0.6", "S4", "simultaneous", 4);
    let report = json(&desk, "report logs --json");
    let sections = report["sections"].as_array().unwrap();
    let mut groups: Vec<&str> =
        sections.iter().filter_map(|s| s["title"].as_str()?.strip_prefix("Group: ")).collect();
    groups.sort_unstable();
    assert_eq!(
        groups,
        ["balance · modern", "balance · thesis", "balance · thesis · plant.pole_length_m 0.6"]
    );
}

#[test]
fn what_cannot_be_used_is_named_and_the_rest_reported() {
    let desk = Desk::new();
    session(&desk, "balance", "S1", "simultaneous", 1);
    let good = desk.at("logs/S1/001-balance-simultaneous");
    let spoil = |name: &str, change: &dyn Fn(&Path)| {
        let folder = desk.at(&format!("logs/{name}/001-balance-simultaneous"));
        copy(&good, &folder);
        let sidecar = folder.join("session.json");
        let renamed =
            fs::read_to_string(&sidecar).unwrap().replace("\"S1\"", &format!("\"{name}\""));
        fs::write(&sidecar, renamed).unwrap();
        change(&folder);
    };
    let edit = |path: std::path::PathBuf, from: &str, to: &str| {
        let changed = fs::read_to_string(&path).unwrap().replacen(from, to, 1);
        fs::write(path, changed).unwrap();
    };
    spoil("NEWER", &|folder| edit(folder.join("session.json"), "\"schema\": 1", "\"schema\": 99"));
    spoil("HEADLESS", &|folder| fs::remove_file(folder.join("session.json")).unwrap());
    spoil("HALF", &|folder| {
        let path = folder.join("steps.csv");
        let rows = fs::read(&path).unwrap();
        fs::write(&path, &rows[..rows.len() - 7]).unwrap();
    });
    spoil("NAN", &|folder| {
        edit(folder.join("steps.csv"), "main,1,1,0.02,", "main,1,1,NaN,");
        edit(folder.join("episodes.csv"), "failed,", "failed,NaN");
    });
    copy(&good, &desk.at("logs/again/001-balance-simultaneous"));
    fs::create_dir_all(desk.at("logs/empty")).unwrap();
    fs::create_dir_all(desk.at("other/src")).unwrap();
    fs::write(desk.at("other/src/main.c"), "int main;").unwrap();
    let report = json(&desk, "report logs logs/empty other nowhere --json");
    let left = left_out(&report);
    for (place, why) in [
        ("NEWER", "update coadapt"),
        ("HEADLESS", "session.json is missing"),
        ("HALF/001-balance-simultaneous/steps.csv", "half a row"),
        ("NAN/001-balance-simultaneous/steps.csv", "line"),
        ("NAN/001-balance-simultaneous/episodes.csv", "NaN"),
        ("001-balance-simultaneous", "trial 001 of subject S1 is also in"),
        ("logs/empty", "no session and no study"),
        ("other", "no session and no study"),
        ("nowhere", "cannot be read"),
    ] {
        let is_told = |line: &&String| line.contains(place) && line.contains(why);
        assert!(left.iter().any(|line| is_told(&line)), "{place}, {why}: {left:#?}");
    }
    let subjects: Vec<&str> = report["sessions"]
        .as_array()
        .unwrap()
        .iter()
        .map(|session| session["subject"].as_str().unwrap())
        .collect();
    assert_eq!(subjects, ["HALF", "NAN", "S1"]);
}

#[test]
fn nothing_to_report_is_wrong_usage() {
    let desk = Desk::new();
    fs::create_dir_all(desk.at("logs")).unwrap();
    let output = desk.run("report logs --out page.html");
    assert_eq!(output.status.code(), Some(2));
    let told = text(&output.stderr);
    assert!(told.contains("left out: logs") && told.contains("nothing to report"), "{told}");
    assert!(!desk.at("page.html").exists());
}

#[test]
fn a_session_that_was_cut_is_shown_but_counts_in_no_group() {
    let desk = Desk::new();
    session(&desk, "balance", "S1", "simultaneous", 1);
    let folder = desk.at("logs/S1/001-balance-simultaneous");
    let sidecar = folder.join("session.json");
    let text = fs::read_to_string(&sidecar).unwrap();
    fs::write(&sidecar, text.replace("\"complete\"", "\"running\"")).unwrap();
    let report = json(&desk, "report logs --json");
    let sections = report["sections"].as_array().unwrap();
    assert_eq!(sections.len(), 1, "{sections:?}");
    assert!(sections[0]["notes"].to_string().contains("counts in no group"));
    assert!(thesis(&report).contains(&"figure 14".to_owned()));
}

#[test]
fn a_complete_session_with_lost_rollouts_counts_in_no_group() {
    let desk = Desk::new();
    session(&desk, "balance", "S1", "simultaneous", 1);
    let folder = desk.at("logs/S1/001-balance-simultaneous");
    let (episodes, steps) = (folder.join("episodes.csv"), folder.join("steps.csv"));
    let (whole, ticks) =
        (fs::read_to_string(&episodes).unwrap(), fs::read_to_string(&steps).unwrap());
    let counts = |report: &Value| report["sections"].to_string().contains("A subject counts once");
    let keep = |text: &str, is_kept: fn(&str) -> bool| {
        text.split_inclusive('\n').filter(|row| is_kept(row)).collect::<String>()
    };
    // Cut at a row's end, in one table or both, or without a row at all: session.json knows better.
    let early = |row: &str| !row.starts_with("main,9,") && !row.starts_with("main,1");
    let cut = |row: &str| !row.starts_with("autonomous") && !row.starts_with("zero_control");
    for (broken, steps_too, lost) in [
        (keep(&whole, cut), true, "12 of 12 of autonomous"),
        (keep(&whole, early), false, "of 14 of main"),
        (keep(&whole, |row| row.starts_with("phase")), true, "14 of 14 of main"),
    ] {
        fs::write(&episodes, broken).unwrap();
        fs::write(&steps, if steps_too { keep(&ticks, cut) } else { ticks.clone() }).unwrap();
        let report = json(&desk, "report logs --json");
        assert!(!counts(&report), "{report}");
        let left = left_out(&report);
        assert!(left.iter().any(|left| left.contains(lost)), "{lost}: {left:?}");
    }
    // Nothing of a rollout is lost here; what is wrong is named all the same.
    for (broken, said) in [
        (format!("{whole}?"), "half a row"),
        (format!("{whole}@#\n"), "the row is left out"),
        (format!("{whole}{}\n", whole.lines().last().unwrap()), "stands there twice"),
    ] {
        fs::write(&episodes, broken).unwrap();
        fs::write(&steps, &ticks).unwrap();
        let report = json(&desk, "report logs --json");
        assert!(counts(&report), "{said}: {report}");
        assert!(left_out(&report).concat().contains(said), "{said}: {:?}", left_out(&report));
    }
}

/// Rows of single ticks are not what a subject is counted by.
#[test]
fn spoilt_and_missing_ticks_are_named_and_the_session_counts() {
    let desk = Desk::new();
    session(&desk, "balance", "S1", "simultaneous", 1);
    let steps = desk.at("logs/S1/001-balance-simultaneous/steps.csv");
    let whole = fs::read_to_string(&steps).unwrap();
    let middle = whole.match_indices('\n').nth(400).unwrap().0 + 1;
    for (broken, said) in [
        (String::new(), "no step of its rollouts is there"),
        (whole[..middle].to_owned(), "steps of its rollouts are not there"),
        (whole.replacen("\nmain,3,5,", "\nmain,3x,5,", 1), "a row is cut off"),
        (whole.replacen("\nmain,3,5,", "\n\"main,3,5,", 1), "a row is cut off"),
        (whole.replacen("\nmain,3,5,0.1,", "\nmain,3,5,0.1\u{e9},", 1), "a row is cut off"),
    ] {
        assert_ne!(broken, whole, "{said}");
        fs::write(&steps, broken).unwrap();
        let report = json(&desk, "report logs --json");
        assert!(report["sections"].to_string().contains("A subject counts once"), "{report}");
        let left = left_out(&report);
        assert_eq!(left.len(), 1, "{left:?}");
        assert!(left[0].contains(said), "{said}: {left:?}");
    }
}

#[test]
fn a_tenth_that_was_tried_from_few_starts_is_left_out() {
    let desk = Desk::new();
    session(&desk, "balance", "S1", "simultaneous", 1);
    let table = desk.at("logs/S1/001-balance-simultaneous/evaluation.csv");
    let whole = fs::read_to_string(&table).unwrap();
    let last = whole.trim_end().rfind('\n').unwrap() + 1;
    fs::write(&table, &whole[..last]).unwrap();
    let report = json(&desk, "report logs --json");
    assert!(left_out(&report)[0].contains("after 100 % of main have fewer rows"), "{report}");
    // A row twice counts once, and one that cannot be used costs its tenth alone.
    let twice = format!("{whole}{}\n", whole.lines().last().unwrap());
    fs::write(&table, twice.replacen("failed,", "failed,x", 1)).unwrap();
    let left = left_out(&json(&desk, "report logs --json")).join("; ");
    assert!(left.contains("1 row of starts that were there already"), "{left}");
    assert!(left.contains("is not a number") && left.contains("after 10 % of main"), "{left}");
    assert!(!left.contains("20 %"), "{left}");
    fs::write(&table, "").unwrap();
    let report = json(&desk, "report logs --json");
    assert!(left_out(&report)[0].contains("no row that can be used"), "{:?}", left_out(&report));
    assert!(!thesis(&report).contains(&"figure 37".to_owned()));
}

#[cfg(unix)]
#[test]
fn links_lead_to_sessions_once_and_never_round() {
    use std::os::unix::fs::symlink;
    let desk = Desk::new();
    session(&desk, "balance", "S1", "simultaneous", 1);
    fs::create_dir(desk.at("mine")).unwrap();
    symlink(desk.at("logs/S1"), desk.at("mine/first")).unwrap();
    symlink(desk.at("logs/S1"), desk.at("mine/again")).unwrap();
    symlink(desk.at("mine"), desk.at("mine/round")).unwrap();
    let report = json(&desk, "report mine --json");
    assert_eq!(report["sessions"].as_array().unwrap().len(), 1, "{report}");
    assert_eq!(left_out(&report), [] as [String; 0]);
}

#[test]
fn subjects_of_two_experiments_may_have_the_same_names() {
    let desk = Desk::new();
    for (gate, logs) in [("0.4", "logs/a"), ("0.6", "logs/b")] {
        desk.succeed(&format!(
            "run balance --headless --operator simulated:naive --subject P1 --seed 1 --rollouts 5 \
             --phases main --set sharing.gate={gate} --logs {logs}"
        ));
    }
    let report = json(&desk, "report logs --json");
    assert_eq!(report["sessions"].as_array().unwrap().len(), 2);
    assert_eq!(left_out(&report), [] as [String; 0]);
    assert!(report["sections"].to_string().contains("sharing.gate 0.6"), "{report}");
}

#[test]
fn swing_up_has_its_regions_and_tables() {
    let desk = Desk::new();
    for (subject, mode) in [("S1", "sequential"), ("S2", "simultaneous")] {
        desk.succeed(&format!(
            "run swing-up --headless --operator simulated:expert --subject {subject} --mode {mode} \
             --seed 1 --duration 60 --set session.introduction_duration_s=5"
        ));
    }
    let report = json(&desk, "report logs --json");
    let figures = thesis(&report);
    for name in ["figure 8", "figure 9", "figure 10", "table 1", "table 2"] {
        assert!(figures.iter().any(|figure| figure == name), "{name}: {figures:?}");
    }
    let text = report.to_string();
    assert!(text.contains("cos 160°") && text.contains("Top fast"), "table 1 as used");
}

#[test]
fn a_study_has_the_figures_of_chapter_four() {
    const CAR: &str = r#"(
        profile: "mountain-car",
        sets: {
            "session.phases": [main], "session.main_rollouts": 40, "session.hold_s": 0.0,
            "rules.cap_steps": 200, "rules.start_x": 0.42, "plant.power": 0.005,
            "rules.reward_threshold": 1.0, "sharing.gate": 0.01, "teaching.from_gate": true,
        },
        arms: [(name: "sequential", mode: sequential), (name: "simultaneous", mode: simultaneous)],
        operators: ["q_learning"],
        seeds: (count: 2),
        checkpoints: [50, 100],
        readouts: [agent, continuous],
        starts: [(name: "trained", count: 1), (name: "grid", count: 12)],
        references: [zero],
        compare: [(of: ("simultaneous", continuous), from: ("sequential", agent))],
        trajectories: [4, 5, 7],
    )"#;
    let desk = Desk::new();
    fs::write(desk.at("car.ron"), CAR).unwrap();
    desk.succeed("study ./car.ron --out car");
    let report = json(&desk, "report car --json");
    let figures = thesis(&report);
    for number in 45..=55 {
        let name = format!("figure {number}");
        assert!(figures.contains(&name), "{name}: {figures:?}");
    }
    assert!(report.to_string().contains("a start that was trained"));
}
