//! `session.json`: all that the rows do not say about a session.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::Error;
use super::document::{self, Document};
use super::names::SESSION;
use crate::session::{Phase, Subject, Trial};
use crate::sharing::Mode;

/// How a session stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// It is being recorded, or the process that did so was killed.
    #[default]
    Running,
    /// All phases took place.
    Complete,
    /// Somebody ended it.
    Aborted,
    /// A signal ended it.
    Interrupted,
    /// A fault ended it.
    Failed,
}

/// How late something was, µs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lateness {
    /// Half of all were at most this late.
    pub p50: u64,
    /// 99 of 100 were at most this late.
    pub p99: u64,
    /// The latest.
    pub max: u64,
}

/// How well a real plant and this program kept up with each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Served {
    /// States that came,
    pub states: u64,
    /// and those that the plant's own time says are missing.
    pub lost: u64,
    /// From a state until its command was written, µs.
    pub latency_us: Lateness,
    /// The system let the port's thread go before all others of the computer.
    #[serde(default)]
    pub real_time: bool,
    /// At the end the device said that its motor is off.
    #[serde(default)]
    pub motor_is_off: bool,
}

/// How well the host kept time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Timing {
    /// Control ticks.
    pub ticks: u64,
    /// Ticks left out because their time had passed.
    pub missed: u64,
    /// Step rows lost because the disk was too slow.
    pub lost_rows: u64,
    /// How late the ticks began, µs.
    pub lateness_us: Lateness,
    /// Whether the control thread ran with real-time priority.
    pub realtime_priority: bool,
    /// Frames drawn.
    pub screen_frames: u64,
    /// The same of a real plant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plant: Option<Served>,
}

/// The machine and the terminal.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Host {
    /// The operating system and its version.
    pub os: String,
    /// The processor's architecture.
    pub architecture: String,
    /// The terminal, if there is one.
    pub terminal: Option<String>,
}

/// That a session was taken up again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Resumption {
    /// The wall's date and time.
    pub at: String,
    /// The program's version then.
    pub version: String,
    /// The phase that it went on with.
    pub phase: Phase,
    /// The rollout that it went on with.
    pub episode: u32,
    /// Step rows of the cut rollout that were dropped.
    pub dropped_steps: u64,
}

/// The content of `session.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sidecar {
    /// The program's version.
    pub version: String,
    /// The task's name outside, such as `swing-up`.
    pub task: String,
    /// The profile's name.
    pub preset: String,
    /// What the robot does while it learns.
    pub mode: Mode,
    /// Whether the mode was assigned by the program.
    pub assigned: bool,
    /// The learner's word.
    pub learner: String,
    /// Who steers, as on the command line.
    pub operator: String,
    /// What is steered, as on the command line.
    pub backend: String,
    /// The subject.
    pub subject: Subject,
    /// The trial.
    pub trial: Trial,
    /// The seed, given or drawn.
    pub seed: u64,
    /// How the session stands.
    pub status: Status,
    /// The wall's date and time at its beginning.
    pub started: String,
    /// The wall's date and time at its end.
    pub ended: Option<String>,
    /// How the keyboard's releases were known, when there was a keyboard.
    pub key_releases: Option<String>,
    /// The devices that took part.
    pub devices: Vec<String>,
    /// The machine and the terminal.
    pub host: Host,
    /// How well the host kept time; only on the wall's time.
    pub timing: Option<Timing>,
    /// The planned phases, in order.
    pub planned: Vec<Phase>,
    /// The whole effective profile as a profile file, from which a resume sets up again.
    pub profile_ron: String,
    /// The same for programs that read JSON only.
    pub profile: serde_json::Value,
    /// The results by phase.
    pub phases: BTreeMap<String, serde_json::Value>,
    /// When the session was resumed.
    pub resumed: Vec<Resumption>,
}

impl Document for Sidecar {
    const KIND: &'static str = "session";
    const PRETTY: bool = true;
}

/// Reads a `session.json`.
///
/// # Errors
/// When it is missing, cut off, not a session's, of a newer schema or holds a wrong value.
pub fn read_sidecar(path: &Path) -> Result<Sidecar, Error> {
    document::read(path)
}

/// Reads the facts of the session in `folder`.
///
/// # Errors
/// When the folder is no session's; of those in it one is named. Or when its `session.json` does
/// not read.
pub fn sidecar_of(folder: &Path) -> Result<Sidecar, Error> {
    let file = folder.join(SESSION);
    let Err(missing) = fs::metadata(&file) else { return read_sidecar(&file) };
    let give = "give a session's folder, such as logs/S07/001-balance-simultaneous";
    let why = match (missing.kind(), fs::metadata(folder)) {
        (ErrorKind::NotADirectory, _) => format!("this is a file; {give}"),
        (ErrorKind::NotFound, Err(_)) => format!("there is no such folder; {give}"),
        (ErrorKind::NotFound, Ok(_)) => match a_session_in(folder) {
            Some(session) => format!(
                "this folder is no recorded session but holds some; give one of them, such as {}",
                session.display()
            ),
            None => format!("this folder is no recorded session, for {SESSION} is missing; {give}"),
        },
        _ => return Err(Error::io("read", &file)(missing)),
    };
    Err(Error::NoSession { path: folder.to_owned(), why })
}

/// The first session in `folder`, or in a folder of it.
fn a_session_in(folder: &Path) -> Option<PathBuf> {
    let below = |folder: &Path| {
        let mut folders: Vec<PathBuf> = fs::read_dir(folder)
            .into_iter()
            .flatten()
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| path.is_dir())
            .collect();
        folders.sort();
        folders
    };
    let nearby = below(folder);
    let farther = nearby.iter().flat_map(|folder| below(folder));
    nearby.iter().cloned().chain(farther).find(|folder| folder.join(SESSION).is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_above_sessions_names_one_of_them() {
        let logs = tempfile::tempdir().unwrap();
        let refused = |folder: &Path| sidecar_of(folder).unwrap_err().to_string();
        assert!(refused(&logs.path().join("S9")).contains("no such folder"));
        let file = logs.path().join("notes.txt");
        fs::write(&file, "").unwrap();
        assert!(refused(&file).contains("this is a file"));
        assert!(refused(logs.path()).contains("session.json is missing"));
        let session = logs.path().join("S1").join("001-balance-simultaneous");
        fs::create_dir_all(&session).unwrap();
        fs::write(session.join(SESSION), "{}").unwrap();
        for above in [logs.path(), &logs.path().join("S1")] {
            assert!(refused(above).ends_with(&format!("such as {}", session.display())));
        }
        assert!(!refused(&session).contains("no recorded session"));
    }

    #[test]
    fn a_timing_tells_of_a_real_plant_where_there_was_one() {
        let simulated = Timing { ticks: 7, ..Timing::default() };
        let text = serde_json::to_string(&simulated).unwrap();
        assert!(!text.contains("plant"), "{text}");
        let plant = Served {
            states: 9,
            lost: 1,
            latency_us: Lateness { p50: 1, p99: 2, max: 3 },
            real_time: true,
            motor_is_off: true,
        };
        let real = Timing { plant: Some(plant), ..simulated };
        for timing in [simulated, real] {
            let text = serde_json::to_string(&timing).unwrap();
            assert_eq!(serde_json::from_str::<Timing>(&text).unwrap(), timing);
        }
    }
}
