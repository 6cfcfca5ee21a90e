//! Exports as a user makes them: what is in them is what the session holds, whatever happened to it.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]

#[path = "program/desk.rs"]
mod desk;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
#[cfg(any(feature = "parquet", feature = "mcap"))]
use std::path::PathBuf;

use coadapt::profile::Experiment;
use desk::{Desk, names, text};

const SESSION: &str = "logs/S07/001-balance-simultaneous";

/// A desk with a short session on it.
fn desk() -> Desk {
    let desk = Desk::new();
    desk.succeed(
        "run balance --headless --operator simulated:average --subject S07 --mode simultaneous \
         --seed 1 --rollouts 10 --set session.introduction_rollouts=2 \
         --set session.autonomous_rollouts=3",
    );
    desk
}

/// The columns of a CSV file, by name.
fn columns(path: &Path) -> BTreeMap<String, Vec<String>> {
    let mut table = csv::Reader::from_path(path).unwrap();
    let header = table.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    let column = |at: usize| rows.iter().map(|row| row[at].to_owned()).collect();
    header.iter().enumerate().map(|(at, name)| (name.to_owned(), column(at))).collect()
}

/// The unit of each column of `table`, as `columns.csv` in `folder` tells.
fn units(folder: &Path, table: &str) -> BTreeMap<String, String> {
    let all = columns(&folder.join("columns.csv"));
    let rows = (0..all["table"].len()).filter(|row| all["table"][*row] == table);
    rows.map(|row| (all["column"][row].clone(), all["unit"][row].clone())).collect()
}

/// Makes a session of these rows in place of the recorded ones.
fn rewrite(session: &Path, steps: &str, episodes: &str) {
    let keep_header = |name: &str, rows: &str| {
        let path = session.join(name);
        let before = fs::read_to_string(&path).unwrap();
        let header = before.lines().next().unwrap();
        fs::write(path, format!("{header}\n{rows}")).unwrap();
    };
    keep_header("steps.csv", steps);
    keep_header("episodes.csv", episodes);
}

#[test]
fn a_csv_export_is_the_session_with_its_units() {
    let desk = desk();
    let session = desk.at(SESSION);
    desk.succeed(&format!("export {SESSION} --to csv"));
    let out = desk.at("S07-001-balance-simultaneous-csv");
    assert_eq!(
        names(&out),
        ["columns.csv", "episodes.csv", "evaluation.csv", "events.csv", "steps.csv"]
    );
    for name in ["steps", "episodes", "events", "evaluation"] {
        let file = format!("{name}.csv");
        let (recorded, exported) = (columns(&session.join(&file)), columns(&out.join(&file)));
        assert!(recorded.values().next().unwrap().len() > 3, "{name}");
        for (column, cells) in &recorded {
            assert_eq!(&exported[column], cells, "{name}.{column}");
        }
        assert!(exported["subject"].iter().all(|cell| cell == "S07"));
        assert!(exported["trial"].iter().all(|cell| cell == "1"));
        // Every column is told of, and no other.
        let units = units(&out, name);
        assert!(units.keys().eq(exported.keys()), "{name}: {units:?}");
        let is_plain = |column: &str| ["theta", "duration_s"].contains(&column);
        assert!(
            units.iter().all(|(column, unit)| !is_plain(column) || unit == "rad" || unit == "s")
        );
    }
    let steps = columns(&out.join("steps.csv"));
    assert!(steps["attempt"].iter().all(|attempt| attempt == "0"));
    assert!(steps["end"].iter().all(|end| ["failed", "cap"].contains(&end.as_str())));
    // The session is as it was.
    assert!(!names(&session).iter().any(|name| name == "columns.csv"));
}

/// What the profile knows of units, and what the tasks count.
#[test]
fn every_task_has_its_units() {
    let desk = Desk::new();
    for experiment in Experiment::all() {
        let task = experiment.name();
        desk.succeed(&format!(
            "run {task} --headless --operator none --mode sequential --rollouts 1 --duration 2 \
             --phases main --seed 1 --subject {task}"
        ));
        let session = format!("logs/{task}/001-{task}-sequential");
        desk.succeed(&format!("export {session} --to csv --out {task}"));
        let steps = units(&desk.at(task), "steps");
        let unit = experiment.action_unit();
        let expected = if unit.is_empty() { "1" } else { unit };
        for action in ["u_human", "u_machine", "u", "u_applied"] {
            assert_eq!(steps[action], expected, "{task}");
        }
        for table in ["steps", "episodes"] {
            let columns = columns(&desk.at(task).join("columns.csv"));
            assert!(!columns["meaning"].iter().any(|meaning| meaning.contains("newer")), "{task}");
            let units = units(&desk.at(task), table);
            let words = ["subject", "task", "preset", "mode", "phase", "region", "end"];
            for (column, unit) in &units {
                assert_eq!(unit.is_empty(), words.contains(&column.as_str()), "{task} {column}");
            }
        }
    }
}

#[test]
fn a_session_cut_anywhere_gives_its_whole_rows() {
    let desk = desk();
    let session = desk.at(SESSION);
    let whole = fs::read_to_string(session.join("steps.csv")).unwrap();
    let line_ends = |text: &str| text.matches('\n').count();
    for (number, cut) in
        [0, 1, 40, whole.len() / 2, whole.len() / 2 + 7, whole.len() - 1].into_iter().enumerate()
    {
        fs::write(session.join("steps.csv"), &whole[..cut]).unwrap();
        desk.succeed(&format!("export {SESSION} --to csv --out {number}"));
        let rows = line_ends(&whole[..cut]).saturating_sub(1);
        let steps = columns(&desk.at(&number.to_string()).join("steps.csv"));
        assert_eq!(steps["t"].len(), rows, "cut at {cut} of {}", whole.len());
        assert!(rows < line_ends(&whole) - 1);
    }
    // All was cut off from the rollout under way, which then has no end.
    let episodes = fs::read_to_string(session.join("episodes.csv")).unwrap();
    let kept = episodes.lines().take(3).fold(String::new(), |text, line| text + line + "\n");
    fs::write(session.join("episodes.csv"), kept + "main,1,0.0").unwrap();
    fs::write(session.join("steps.csv"), &whole).unwrap();
    desk.succeed(&format!("export {SESSION} --to csv --out short"));
    let steps = columns(&desk.at("short").join("steps.csv"));
    for (phase, end) in steps["phase"].iter().zip(&steps["end"]) {
        assert_eq!(end.is_empty(), phase != "introduction");
    }
    assert_eq!(columns(&desk.at("short").join("episodes.csv"))["episode"].len(), 2);
}

/// A rollout that was thrown away twice, once before its first step, and cut off the third time.
const STEPS: &str = "\
main,1,0,0.0,0.1,0.0,0.2,0.0,1.5,NaN,1.0,1.5,1.5,0.9,0.5,all,0,0.25
main,1,1,0.02,NaN,0.0,inf,0.0,,,,,,,,,0,
main,1,0,0.0,0.1,0.0,0.2,0.0,,,,,,,,,0,
main,1,0,0.0,0.1,0.0,0.2,0.0,1.5,,1.0,1.5,1.5,0.9,0.5,all,0,
main,1,1,0.02,0.1,0.0,0.2,0.0,1.5,,1.0,1.5,1.5,0.9,0.5,all,0,
";
const EPISODES: &str = "\
main,1,0.2,1,0.02,discarded,0.9,0.9,1.0,0.5,0
main,1,0.2,0,0.0,discarded,0.0,0.0,1.0,0.5,0
";

#[test]
fn discarded_rollouts_are_marked_and_what_is_missing_stays_so() {
    let desk = desk();
    rewrite(&desk.at(SESSION), STEPS, EPISODES);
    desk.succeed(&format!("export {SESSION} --to csv --out out"));
    let steps = columns(&desk.at("out").join("steps.csv"));
    assert_eq!(steps["attempt"], ["0", "0", "1", "2", "2"]);
    assert_eq!(steps["end"], ["discarded", "discarded", "discarded", "", ""]);
    assert_eq!(steps["u_machine"], [""; 5]);
    assert_eq!(steps["x"], ["0.1", "", "0.1", "0.1", "0.1"]);
    assert_eq!(steps["theta"][1], "inf");
    assert_eq!(steps["raw"], ["0.25", "", "", "", ""]);
    let episodes = columns(&desk.at("out").join("episodes.csv"));
    assert_eq!(episodes["attempt"], ["0", "1"]);
}

#[test]
fn nothing_is_replaced_and_nothing_half_is_left() {
    let desk = desk();
    fs::write(desk.at("taken"), "mine").unwrap();
    let output = desk.run(&format!("export {SESSION} --to csv --out taken"));
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("is there already"), "{}", text(&output.stderr));
    assert_eq!(fs::read_to_string(desk.at("taken")).unwrap(), "mine");
    // A wrong cell far down.
    let path = desk.at(SESSION).join("steps.csv");
    let mut steps = fs::read_to_string(&path).unwrap();
    steps.push_str("main,1,2,0.04,abc,0.0,0.2,0.0,,,,,,,,,0,\n");
    let line = steps.lines().count();
    fs::write(path, steps).unwrap();
    let output = desk.run(&format!("export {SESSION} --to csv --out out"));
    assert_eq!(output.status.code(), Some(2));
    let told = text(&output.stderr);
    assert!(told.contains(&format!("line {line}, column x: \"abc\" is not a number")), "{told}");
    assert_eq!(names(&desk.at("")), ["logs", "taken"]);
}

#[test]
fn what_is_no_session_is_said_to_be_none() {
    let desk = desk();
    fs::create_dir(desk.at("empty")).unwrap();
    let refusal = |line: &str| {
        let output = desk.run(line);
        assert_eq!(output.status.code(), Some(2), "{line}");
        text(&output.stderr)
    };
    assert!(refusal("export empty --to csv").contains("session.json"));
    assert!(refusal("export nowhere --to csv --out out").contains("no such folder"));
    assert!(refusal("export logs --to csv").contains(&format!("such as {SESSION}")));
    assert!(refusal(&format!("export {SESSION} --to xls")).contains("csv, parquet or mcap"));
    let path = desk.at(SESSION).join("session.json");
    let newer = fs::read_to_string(&path).unwrap().replacen("\"schema\": 1", "\"schema\": 9", 1);
    fs::write(path, newer).unwrap();
    assert!(refusal(&format!("export {SESSION} --to csv")).contains("newer coadapt"));
    assert_eq!(names(&desk.at("")), ["empty", "logs"]);
}

#[test]
fn json_tells_what_was_written() {
    let desk = desk();
    let printed = desk.succeed(&format!("export {SESSION} --to csv --out out --json"));
    let told: serde_json::Value = serde_json::from_str(&printed).unwrap();
    assert_eq!(
        (&told["schema"], &told["to"], &told["path"]),
        (&1.into(), &"csv".into(), &"out".into())
    );
    let rows = columns(&desk.at("out").join("steps.csv"))["t"].len();
    assert_eq!(told["counts"]["steps"], rows);
    assert_eq!(told["counts"]["episodes"], 18);
}

#[cfg(not(feature = "parquet"))]
#[test]
fn a_build_without_parquet_says_how_to_get_it() {
    says_how_to_build("parquet");
}

#[cfg(not(feature = "mcap"))]
#[test]
fn a_build_without_mcap_says_how_to_get_it() {
    says_how_to_build("mcap");
}

#[cfg(not(all(feature = "parquet", feature = "mcap")))]
fn says_how_to_build(form: &str) {
    let desk = Desk::new();
    let output = desk.run(&format!("export anything --to {form}"));
    assert_eq!(output.status.code(), Some(2));
    let told = text(&output.stderr);
    assert!(told.contains(&format!("cargo build --release --features {form}")), "{told}");
    assert_eq!(names(&desk.at("")), [""; 0]);
}

/// Where the session of the crafted rows is exported to as `form`.
#[cfg(any(feature = "parquet", feature = "mcap"))]
fn crafted(desk: &Desk, form: &str) -> PathBuf {
    rewrite(&desk.at(SESSION), STEPS, EPISODES);
    desk.succeed(&format!("export {SESSION} --to {form} --out crafted"));
    desk.at("crafted")
}

#[cfg(feature = "parquet")]
mod in_parquet {
    use super::*;
    use arrow_array::cast::AsArray;
    use arrow_array::types::{Float64Type, UInt32Type};
    use arrow_array::{Array, RecordBatch};
    use arrow_schema::SchemaRef;
    use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

    /// The file's schema and rows.
    fn read(path: &Path) -> (SchemaRef, Vec<RecordBatch>) {
        let file = fs::File::open(path).unwrap();
        let reader = ParquetRecordBatchReaderBuilder::try_new(file).unwrap();
        let schema = reader.schema().clone();
        (schema, reader.build().unwrap().map(Result::unwrap).collect())
    }

    /// A cell as the CSV export writes it.
    fn cell(array: &dyn Array, row: usize) -> String {
        if array.is_null(row) {
            String::new()
        } else if let Some(numbers) = array.as_primitive_opt::<Float64Type>() {
            let number: f64 = numbers.value(row);
            number.to_bits().to_string()
        } else if let Some(numbers) = array.as_primitive_opt::<UInt32Type>() {
            numbers.value(row).to_string()
        } else {
            array.as_string::<i32>().value(row).to_owned()
        }
    }

    #[test]
    fn parquet_holds_what_csv_holds_with_units_in_the_schema() {
        let desk = desk();
        desk.succeed(&format!("export {SESSION} --to csv --out csv"));
        desk.succeed(&format!("export {SESSION} --to parquet --out parquet"));
        for name in ["steps", "episodes", "events", "evaluation"] {
            let table = columns(&desk.at("csv").join(format!("{name}.csv")));
            let units = units(&desk.at("csv"), name);
            let path = desk.at("parquet").join(format!("{name}.parquet"));
            let (schema, batches) = read(&path);
            assert_eq!(schema.fields().len(), table.len());
            assert_eq!(schema.metadata()["subject"], "S07");
            for (at, field) in schema.fields().iter().enumerate() {
                assert_eq!(
                    field.metadata()["unit"],
                    units[field.name()],
                    "{name}.{}",
                    field.name()
                );
                let read: Vec<String> = batches
                    .iter()
                    .flat_map(|batch| {
                        let array = batch.column(at);
                        (0..array.len()).map(|row| cell(array, row)).collect::<Vec<_>>()
                    })
                    .collect();
                let is_number = field.data_type() == &arrow_schema::DataType::Float64;
                let bits = |text: &String| match text.parse::<f64>() {
                    Ok(number) if is_number => number.to_bits().to_string(),
                    _ => text.clone(),
                };
                let written: Vec<String> = table[field.name()].iter().map(bits).collect();
                assert_eq!(read, written, "{name}.{}", field.name());
            }
        }
    }

    #[test]
    fn what_is_missing_stays_so() {
        let desk = desk();
        let batch = read(&crafted(&desk, "parquet").join("steps.parquet")).1.remove(0);
        let column = |name: &str| batch.column_by_name(name).unwrap();
        assert_eq!(column("u_machine").null_count(), 5);
        assert_eq!(column("x").null_count(), 1);
        assert_eq!(column("theta").as_primitive::<Float64Type>().value(1), f64::INFINITY);
        assert_eq!(column("end").null_count(), 2);
    }
}

#[cfg(feature = "mcap")]
mod in_mcap {
    use super::*;
    use serde_json::Value;

    /// The messages of each channel: time in ns, and content.
    fn channels(path: &Path) -> BTreeMap<String, Vec<(u64, Value)>> {
        let bytes = fs::read(path).unwrap();
        let mut channels: BTreeMap<String, Vec<(u64, Value)>> = BTreeMap::new();
        for message in mcap::MessageStream::new(&bytes).unwrap() {
            let message = message.unwrap();
            let schema = message.channel.schema.as_ref().unwrap();
            let known: Value = serde_json::from_slice(&schema.data).unwrap();
            assert_eq!(
                (&*schema.encoding, &*message.channel.message_encoding),
                ("jsonschema", "json")
            );
            let content: Value = serde_json::from_slice(&message.data).unwrap();
            // Nothing that the schema does not tell of.
            for name in content.as_object().unwrap().keys() {
                assert!(known["properties"][name].is_object(), "{}.{name}", message.channel.topic);
            }
            let of = channels.entry(message.channel.topic.clone()).or_default();
            of.push((message.log_time, content));
        }
        channels
    }

    #[test]
    fn mcap_holds_every_step_on_one_line_of_time() {
        let desk = desk();
        desk.succeed(&format!("export {SESSION} --to mcap"));
        let channels = channels(&desk.at("S07-001-balance-simultaneous.mcap"));
        let steps = columns(&desk.at(SESSION).join("steps.csv"));
        let states = &channels["/state"];
        assert_eq!(states.len(), steps["t"].len());
        for (row, (_, state)) in states.iter().enumerate() {
            assert_eq!(
                state["theta"].as_f64().unwrap(),
                steps["theta"][row].parse::<f64>().unwrap()
            );
        }
        // One tick from row to row, across rollouts and phases.
        for (row, (time, _)) in states.iter().enumerate() {
            assert_eq!(*time, 20_000_000 * row as u64, "row {row}");
        }
        let acted = steps["u_applied"].iter().filter(|cell| !cell.is_empty()).count();
        assert_eq!((channels["/action"].len(), channels["/sharing"].len()), (acted, acted));
        // A rollout's result stands where its last row stands.
        let (time, first) = &channels["/episode"][0];
        let last = steps["step"].iter().skip(1).position(|step| step == "0").unwrap();
        assert_eq!(*time, states[last].0);
        assert_eq!(
            first["end"],
            columns(&desk.at(SESSION).join("episodes.csv"))["end"][0].as_str()
        );
        let events = columns(&desk.at(SESSION).join("events.csv"));
        let told: Vec<&str> =
            channels["/event"].iter().map(|(_, event)| event["event"].as_str().unwrap()).collect();
        assert_eq!(told, events["event"]);
        let (end, complete) = channels["/event"].last().unwrap();
        assert_eq!(complete["message"], "complete");
        assert_eq!(*end, states.last().unwrap().0);
        assert!(channels["/event"].is_sorted_by_key(|(time, _)| *time));
    }

    #[test]
    fn what_is_missing_or_infinite_is_left_out() {
        let desk = desk();
        let channels = channels(&crafted(&desk, "mcap"));
        assert_eq!(channels["/state"][1].1, serde_json::json!({ "x_dot": 0.0, "theta_dot": 0.0 }));
        assert!(channels["/action"].iter().all(|(_, action)| action.get("u_machine").is_none()));
        let attempts: Vec<&Value> =
            channels["/place"].iter().map(|(_, at)| &at["attempt"]).collect();
        assert_eq!(attempts, [0, 0, 1, 2, 2]);
    }
}
