//! A plant open loop: a start, a table of actions, a table of states.

use std::io::{self, Read, Write};

use super::table::{MOST_FAULTS, Table, TableError};
use crate::profile::Profile;
use crate::random::{Place, Purpose, stream};
use crate::signal::{Action, State};

/// Why a simulation could not be done.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// The start has the wrong numbers.
    #[error(
        "--start {given:?}: {problem}; give {count} finite numbers, {columns}, such as {example}"
    )]
    Start {
        /// As given.
        given: String,
        /// What is wrong.
        problem: String,
        /// How many are needed.
        count: usize,
        /// The state's columns.
        columns: String,
        /// A good one.
        example: String,
    },
    /// The table of actions is larger than any that is read.
    #[error(
        "{table} is too large: at most {MOST_BYTES} bytes of a table of actions are read; \
         simulate in parts"
    )]
    TooLarge {
        /// The table's name.
        table: String,
    },
    /// The table of actions cannot be read, or has faults.
    #[error(transparent)]
    Actions(#[from] TableError),
    /// Writing failed.
    #[error("the table of states could not be written: {0}")]
    Io(#[from] io::Error),
}

/// The most that is read of a table, bytes: days of actions.
const MOST_BYTES: u64 = 64 << 20;

/// Reads `x,…` as a state of the profile's plant.
///
/// # Errors
/// When it is not the right number of finite numbers.
pub fn start(profile: &Profile, given: &str) -> Result<State, SimulateError> {
    let columns = profile.experiment.columns();
    let refuse = |problem: String| SimulateError::Start {
        given: given.chars().take(80).collect(),
        problem,
        count: columns.len(),
        columns: columns.join(","),
        example: vec!["0"; columns.len()].join(","),
    };
    let mut numbers = Vec::new();
    for cell in given.split(',') {
        let number: f64 =
            cell.trim().parse().map_err(|_| refuse(format!("{cell:?} is not a number")))?;
        if !number.is_finite() {
            return Err(refuse(format!("{cell} is not finite")));
        }
        numbers.push(number);
    }
    if numbers.len() != columns.len() {
        return Err(refuse(format!("it has {} numbers", numbers.len())));
    }
    State::from_slice(&numbers).ok_or_else(|| refuse("it has too many numbers".to_owned()))
}

/// Reads the column `u` of a CSV table, a row a control step. `name` is the table's, for
/// messages.
///
/// # Errors
/// With the place of every wrong cell, up to twenty; when the table is too large.
pub fn actions(name: &str, table: impl Read) -> Result<Vec<f64>, SimulateError> {
    let mut table = table.take(MOST_BYTES);
    let read = actions_of(name, &mut table);
    // A table without end would fill the memory; what was read of it means nothing.
    if table.limit() == 0 {
        return Err(SimulateError::TooLarge { table: name.to_owned() });
    }
    read
}

fn actions_of(name: &str, table: impl Read) -> Result<Vec<f64>, SimulateError> {
    let mut table = Table::open(name, table, &["u".to_owned()])?;
    let mut actions = Vec::new();
    let mut faults = Vec::new();
    let mut row = [0.0];
    loop {
        match table.next(&mut row) {
            Ok(true) => {}
            Ok(false) => break,
            // All faults are told, those before this one too.
            Err(TableError::Faults(more)) => {
                faults.extend(more);
                break;
            }
            Err(error) => return Err(error.into()),
        }
        let [action] = row;
        if action.is_finite() {
            actions.push(action);
            continue;
        }
        faults.push(format!("{name}, line {}, column u: {action} is not finite", table.line()));
        if faults.len() >= MOST_FAULTS {
            faults.push("further lines were not read".to_owned());
            break;
        }
    }
    if faults.is_empty() { Ok(actions) } else { Err(TableError::Faults(faults).into()) }
}

/// Lets the plant go from `start` under `actions`, clipped to the plant's limit, and
/// writes `step,t,` and the state before each action and after the last one.
///
/// # Errors
/// When writing fails.
pub fn simulate(
    profile: &Profile,
    start: State,
    actions: &[f64],
    seed: u64,
    table: impl Write,
) -> Result<(), SimulateError> {
    let tick = profile.tick();
    let limit = profile.experiment.task(tick).action_limit();
    let mut plant = profile.experiment.plant(tick);
    plant.reseed(stream(seed, Purpose::Friction, Place::default()));
    let mut writer = csv::Writer::from_writer(table);
    let io = |error: csv::Error| match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    };
    let mut header = vec!["step", "t"];
    header.extend(profile.experiment.columns());
    writer.write_record(&header).map_err(io)?;
    let mut state = start;
    for step in 0..=actions.len() {
        let t = f64::from(u32::try_from(step).unwrap_or(u32::MAX)) * tick.0;
        writer.serialize((step, t, &state[..])).map_err(io)?;
        if let Some(action) = actions.get(step) {
            state = plant.step(&state, Action(action.clamp(-limit, limit)));
        }
    }
    writer.flush()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::Document;

    fn profile() -> Profile {
        Document::from_text("balance", "(task: \"balance\")").read().unwrap()
    }

    #[test]
    fn a_start_must_be_a_whole_finite_state() {
        let profile = profile();
        assert_eq!(start(&profile, "0, 0,0.05,-1").unwrap(), State::new([0.0, 0.0, 0.05, -1.0]));
        for (bad, word) in [
            ("", "not a number"),
            ("1,2", "2 numbers"),
            ("0,0,NaN,0", "not finite"),
            ("0,0,x,0", "\"x\""),
        ] {
            let message = start(&profile, bad).unwrap_err().to_string();
            assert!(message.contains(word) && message.contains("theta"), "{message}");
        }
    }

    #[test]
    fn all_wrong_actions_are_named_at_once() {
        assert_eq!(actions("f", "u\n1\n-2.5\n".as_bytes()).unwrap(), [1.0, -2.5]);
        let told = |text: &str| actions("f.csv", text.as_bytes()).unwrap_err().to_string();
        let message = told("u\nx\n1\n\"y\"\n");
        assert!(message.contains("line 2") && message.contains("line 4"), "{message}");
        assert!(told("v\n1\n").contains("no column u"));
    }

    /// Lines without end.
    struct Lines;

    impl Read for Lines {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            for (at, byte) in buffer.iter_mut().enumerate() {
                *byte = if at % 2 == 0 { b'1' } else { b'\n' };
            }
            Ok(buffer.len() / 2 * 2)
        }
    }

    #[test]
    fn a_table_without_end_is_refused() {
        let message = actions("noise", io::repeat(b'x')).unwrap_err().to_string();
        assert!(message.contains("noise") && message.contains("1 MiB"), "{message}");
        let message = actions("ones", "u\n".as_bytes().chain(Lines)).unwrap_err().to_string();
        assert!(message.contains("ones is too large"), "{message}");
    }

    #[test]
    fn the_table_has_a_row_before_each_action_and_one_after_the_last() {
        let mut table = Vec::new();
        simulate(&profile(), State::new([0.0; 4]), &[0.0, 0.0], 1, &mut table).unwrap();
        let text = String::from_utf8(table).unwrap();
        assert_eq!(
            text,
            "step,t,x,x_dot,theta,theta_dot\n0,0.0,0.0,0.0,0.0,0.0\n1,0.02,0.0,0.0,0.0,0.0\n\
             2,0.04,0.0,0.0,0.0,0.0\n"
        );
    }
}
