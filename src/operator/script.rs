//! An operator that follows a table of times and values.
//!
//! CSV: a header with the columns `t,u` and, if rollouts are told apart, `phase,episode`.
//! RON: a list such as `[(t: 0.0, u: 0.0), (t: 0.5, u: 3.0, phase: "main", episode: 3)]`.
//! `t` is the time within the rollout in s, `u` the action in the plant's unit, held until
//! the next row; before the first row it is 0. A row without phase or episode serves every
//! one; a rollout follows the rows that name it most closely.

mod parse;

use std::collections::BTreeMap;
use std::fmt;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use super::{Operator, Practice, View};
use crate::random::Place;
use crate::signal::Intent;

/// The largest script that is read, bytes.
pub const MAX_BYTES: u64 = 64 << 20;
/// How many faults are listed.
const MAX_FAULTS: usize = 20;
/// Rows may be this late, s: times such as 0.06 are not sums of ticks to the last bit.
const ROUNDING_S: f64 = 1e-9;

/// The rollouts that a row is for; `None` is every one. The phase is [`Place`]'s number.
type Address = (Option<u8>, Option<u32>);

/// A phase's word in scripts and its number in [`Place`].
pub type PhaseWord = (&'static str, u8);

/// A row: the value `u` from the time `t`, s, on; nobody is there where it is `None`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Row {
    t: f64,
    u: Option<f64>,
}

/// A row of a recorded session: what the person did then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recorded {
    /// The phase and the rollout.
    pub place: Place,
    /// The time within the rollout, s.
    pub t: f64,
    /// The action, in the plant's unit; `None` where nobody was there.
    pub u: Option<f64>,
}

/// One fault in a script.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RowFault {
    /// The line, from 1.
    pub line: usize,
    /// The column, in characters from 1.
    pub column: usize,
    /// What is wrong, and what would be allowed.
    pub what: String,
}

/// Why a script cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ScriptError {
    /// The file cannot be read.
    #[error("cannot read the script {file}: {cause}")]
    Unreadable {
        /// The script.
        file: PathBuf,
        /// The system's reason.
        cause: std::io::Error,
    },
    /// A directory, a pipe or a device.
    #[error("the script {0} is not a plain file; save the table to one")]
    NotAFile(PathBuf),
    /// Larger than [`MAX_BYTES`].
    #[error(
        "the script {file} has {bytes} bytes; at most {MAX_BYTES} are read: keep one row \
             for each change of u"
    )]
    TooLarge {
        /// The script.
        file: PathBuf,
        /// Its size.
        bytes: u64,
    },
    /// Rows that say nothing usable.
    #[error("{}", list(file, faults, *more))]
    Rows {
        /// The script.
        file: PathBuf,
        /// The first faults, by line.
        faults: Vec<RowFault>,
        /// How many more there are.
        more: usize,
    },
}

fn list(file: &Path, faults: &[RowFault], more: usize) -> String {
    let mut lines: Vec<String> = faults
        .iter()
        .map(|fault| format!("{}:{}:{}: {}", file.display(), fault.line, fault.column, fault.what))
        .collect();
    if more > 0 {
        lines.push(format!("and {more} more"));
    }
    lines.join("\n")
}

/// Collects faults and counts those beyond the list's end.
#[derive(Default)]
struct Faults {
    listed: Vec<RowFault>,
    more: usize,
}

impl Faults {
    fn push(&mut self, (line, column): (usize, usize), what: impl fmt::Display) {
        if self.listed.len() < MAX_FAULTS {
            self.listed.push(RowFault { line, column, what: what.to_string() });
        } else {
            self.more += 1;
        }
    }
}

/// The operator that follows a script.
#[derive(Clone, Debug)]
pub struct Script {
    tables: BTreeMap<Address, Vec<Row>>,
    limit: f64,
    current: Option<Address>,
    /// The number of rows whose time has come.
    passed: usize,
    /// What is wanted where no row speaks.
    otherwise: Intent,
}

impl Script {
    /// Does once more what was recorded in `rows`, in their order: of a rollout that was
    /// repeated the last time. Where nothing was recorded nobody is there.
    #[must_use]
    pub fn recorded(rows: impl IntoIterator<Item = Recorded>, limit: f64) -> Self {
        let mut tables = BTreeMap::<Address, Vec<Row>>::new();
        for Recorded { place, t, u } in rows {
            let table = tables.entry((Some(place.phase), Some(place.rollout))).or_default();
            if table.last().is_some_and(|last| last.t >= t) {
                table.clear();
            }
            table.push(Row { t, u });
        }
        Self { tables, limit, current: None, passed: 0, otherwise: Intent::Absent }
    }

    /// Reads the script in `file`. `phases` are the words allowed in the column `phase`;
    /// actions are clipped to ± `limit`.
    ///
    /// # Errors
    /// When the file is no plain file, too large or unreadable, or with all faults of its
    /// rows at once.
    pub fn load(file: &Path, phases: &[PhaseWord], limit: f64) -> Result<Self, ScriptError> {
        let unreadable = |cause| ScriptError::Unreadable { file: file.to_owned(), cause };
        // Asked before opening: opening a pipe would wait for its other end.
        let facts = fs::metadata(file).map_err(unreadable)?;
        if !facts.is_file() {
            return Err(ScriptError::NotAFile(file.to_owned()));
        }
        let mut bytes = Vec::new();
        if facts.len() <= MAX_BYTES {
            let open = File::open(file).map_err(unreadable)?;
            open.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
        }
        let size = facts.len().max(bytes.len() as u64);
        if size > MAX_BYTES {
            return Err(ScriptError::TooLarge { file: file.to_owned(), bytes: size });
        }
        let is_ron = file.extension().is_some_and(|end| end.eq_ignore_ascii_case("ron"));
        let mut faults = Faults::default();
        let tables = parse::tables(&bytes, is_ron, phases, &mut faults);
        if faults.listed.is_empty() {
            let otherwise = Intent::fresh(0.0);
            Ok(Self { tables, limit, current: None, passed: 0, otherwise })
        } else {
            let Faults { listed, more } = faults;
            Err(ScriptError::Rows { file: file.to_owned(), faults: listed, more })
        }
    }
}

impl Operator for Script {
    fn begin(&mut self, place: Place, _practice: Practice) {
        let (phase, episode) = (Some(place.phase), Some(place.rollout));
        self.current = [(phase, episode), (phase, None), (None, episode), (None, None)]
            .into_iter()
            .find(|address| self.tables.contains_key(address));
        self.passed = 0;
    }

    fn intent(&mut self, view: View<'_>) -> Intent {
        let rows = self.current.and_then(|address| self.tables.get(&address));
        let rows = rows.map_or(&[][..], Vec::as_slice);
        let now = view.rollout_time.0 + ROUNDING_S;
        while rows.get(self.passed).is_some_and(|row| row.t <= now) {
            self.passed += 1;
        }
        match self.passed.checked_sub(1).and_then(|last| rows.get(last)) {
            Some(Row { u: Some(u), .. }) => Intent::fresh(u.clamp(-self.limit, self.limit)),
            Some(Row { u: None, .. }) => Intent::Absent,
            None => self.otherwise,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Seconds, State};

    const PHASES: [PhaseWord; 2] = [("introduction", 1), ("main", 2)];

    fn load(name: &str, text: &str) -> Result<Script, ScriptError> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(name);
        fs::write(&file, text).unwrap();
        Script::load(&file, &PHASES, 10.0)
    }

    fn follow(script: &mut Script, phase: u8, rollout: u32, times: &[f64]) -> Vec<f64> {
        script.begin(Place { phase, rollout, attempt: 0 }, Practice::default());
        let state = State::default();
        let view = |t| View { state: &state, now: Seconds(0.0), rollout_time: Seconds(t) };
        times.iter().map(|t| script.intent(view(*t)).action().0).collect()
    }

    #[test]
    fn csv_and_ron_hold_values_and_serve_the_closest_address() {
        let csv = "t,u,phase,episode\n0.1,1,,\n0.06,2,main,\n0.5,99,main,\n0,3,main,3\n";
        let ron = "[(t: 0.1, u: 1), (t: 0.06, u: 2.0, phase: \"main\"),
            (t: 0.5, u: 99.0, phase: \"main\"), (t: 0.0, u: 3.0, phase: \"main\", episode: 3)]";
        for mut script in [load("a.csv", csv).unwrap(), load("a.ron", ron).unwrap()] {
            assert_eq!(follow(&mut script, 1, 1, &[-1.0, 0.0, 0.1, 9.0]), [0.0, 0.0, 1.0, 1.0]);
            assert_eq!(follow(&mut script, 2, 1, &[0.02 * 3.0, 0.5]), [2.0, 10.0]);
            assert_eq!(follow(&mut script, 2, 3, &[0.0]), [3.0]);
        }
    }

    #[test]
    fn a_recording_is_done_once_more_and_nobody_is_there_beyond_it() {
        let place = |rollout| Place { phase: 2, rollout, attempt: 0 };
        let rows = [(1, 0.0, 5.0), (1, 0.02, 6.0), (1, 0.0, 1.0), (1, 0.02, 99.0), (3, 0.0, 4.0)];
        let rows = rows.map(|(rollout, t, u)| Recorded { place: place(rollout), t, u: Some(u) });
        let end = Recorded { place: place(3), t: 0.02, u: None };
        let mut script = Script::recorded(rows.into_iter().chain([end]), 10.0);
        assert_eq!(follow(&mut script, 2, 1, &[0.0, 0.02]), [1.0, 10.0]);
        let state = State::default();
        let mut is_there = |rollout, t| {
            script.begin(place(rollout), Practice::default());
            let view = View { state: &state, now: Seconds(0.0), rollout_time: Seconds(t) };
            script.intent(view).is_present()
        };
        assert_eq!(
            [(2, 0.0), (3, 0.0), (3, 0.02)].map(|(k, t)| is_there(k, t)),
            [false, true, false]
        );
    }

    #[test]
    fn every_fault_is_named_with_its_place() {
        let error = load("a.csv", "t,u\n0,1\n1,NaN\n0.5,x\n0.2,1,7\n").unwrap_err().to_string();
        for part in [":3:3: u is `NaN`", ":4:5: u is `x`", ":5:1: the row has 3 cells"] {
            assert!(error.contains(part), "{error}");
        }
        let error = load("a.csv", "t,v\n").unwrap_err().to_string();
        assert!(error.contains(":1:3:") && error.contains("column u is missing"), "{error}");
        let ron = "[(t: 1.0, u: 0.0),\n (t: 0.5, u: 0.0),\n (t: 2.0, u: NaN), (t: 3.0)]";
        let error = load("a.ron", ron).unwrap_err().to_string();
        for part in [":2:2: t is 0.5", ":3:2: u is `NaN`", ":3:20:"] {
            assert!(error.contains(part), "{error}");
        }
        let many = format!("t,u\n{}", "x,1\n".repeat(30));
        assert!(load("a.csv", &many).unwrap_err().to_string().ends_with("and 10 more"));
    }

    #[test]
    fn folders_and_giants_are_refused_unread() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |file: &Path| Script::load(file, &PHASES, 10.0).unwrap_err();
        assert!(matches!(refused(folder.path()), ScriptError::NotAFile(_)));
        let giant = folder.path().join("giant.csv");
        File::create(&giant).unwrap().set_len(1 << 30).unwrap();
        assert!(matches!(refused(&giant), ScriptError::TooLarge { bytes, .. } if bytes == 1 << 30));
    }
}
