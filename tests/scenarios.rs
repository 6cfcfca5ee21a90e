//! The matrix of task × learner × mode × operator: whole sessions from a table of scenarios.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test ends at its first surprise")]

#[path = "program/desk.rs"]
#[expect(dead_code, reason = "other tests need more of a desk")]
mod desk;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use desk::{Desk, text};
use serde::Deserialize;
use serde_json::Value;

/// A line of `tests/data/scenarios.ron`.
#[derive(Clone, Debug, Deserialize)]
struct Scenario {
    profile: String,
    words: String,
    expect: Vec<String>,
}

/// The number at `path` of the results' phases.
fn number(results: &Value, path: &str) -> f64 {
    let place = format!("/phases/{}", path.replace('.', "/"));
    let value = results.pointer(&place).unwrap_or_else(|| panic!("no {path} in {results}"));
    value.as_f64().unwrap_or_else(|| panic!("{path} is {value}"))
}

/// What of `expected` does not hold.
fn broken(results: &Value, expected: &str) -> Option<String> {
    let words: Vec<&str> = expected.split_whitespace().collect();
    match words[..] {
        [path, ">", other] => {
            let (left, right) = (number(results, path), number(results, other));
            (left <= right).then(|| format!("{expected}, but they are {left} and {right}"))
        }
        [path, range] => {
            let (from, to) = range.split_once("..").unwrap();
            let (from, to): (f64, f64) = (from.parse().unwrap(), to.parse().unwrap());
            let value = number(results, path);
            (!(from..=to).contains(&value)).then(|| format!("{expected}, but it is {value}"))
        }
        _ => panic!("{expected:?} is no expectation"),
    }
}

/// Runs one scenario; tells what went wrong.
fn run(scenario: &Scenario) -> Vec<String> {
    let desk = Desk::new();
    let data = format!("{}/tests/data/scenarios", env!("CARGO_MANIFEST_DIR"));
    let words = scenario.words.replace("DATA", &data);
    let line = format!("run {} --headless --json {words}", scenario.profile);
    let output = desk.run(&line);
    if !output.status.success() {
        return vec![format!("{line}: {}", text(&output.stderr))];
    }
    let results: Value = serde_json::from_slice(&output.stdout).unwrap();
    let faults = scenario.expect.iter().filter_map(|expected| broken(&results, expected));
    faults.map(|fault| format!("{line}: {fault}")).collect()
}

#[test]
fn every_scenario_comes_out_as_expected() {
    let table = include_str!("data/scenarios.ron");
    let scenarios: Vec<Scenario> = ron::from_str(table).unwrap();
    let (next, faults) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(2, usize::from) {
            scope.spawn(|| {
                while let Some(scenario) = scenarios.get(next.fetch_add(1, Ordering::Relaxed)) {
                    faults.lock().unwrap().extend(run(scenario));
                }
            });
        }
    });
    let faults = faults.into_inner().unwrap();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Every task meets every learner, mode and kind of operator.
#[test]
fn the_matrix_has_no_hole() {
    let scenarios: Vec<Scenario> = ron::from_str(include_str!("data/scenarios.ron")).unwrap();
    for task in ["balance", "swing-up", "speed-up", "mountain-car"] {
        for word in ["rfwr", "lwpr", "simultaneous", "sequential", "simulated:", "script:", "none"]
        {
            let met = scenarios.iter().any(|s| s.profile == task && s.words.contains(word));
            assert!(met, "{task} never meets {word}");
        }
        let modern = format!("{task}-modern");
        assert!(scenarios.iter().any(|s| s.profile == modern), "{modern} is never run");
    }
}
