//! Made-up sessions, rows and learners.

use std::fs;
use std::path::Path;

use coadapt::record::sidecar::Host;
use coadapt::record::{
    Checkpoint, Columns, EpisodeRow, Folder, Manner, Policy, Recorder, Sidecar, Status, StepRow,
    VERSION,
};
use coadapt::session::{Moment, Phase, Subject, Trial};
use coadapt::sharing::Mode;
use coadapt::signal::{End, State, Tallied};
use serde::{Deserialize, Serialize};

pub const STATE: [&str; 4] = ["x", "x_dot", "theta", "theta_dot"];
pub const COLUMNS: Columns<'static, &str> =
    Columns { state: &STATE, tally: &["mean_speed", "end_hits"] };

/// A learner as the program stores them: an enum with a tag.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "learner", rename_all = "snake_case")]
pub enum Model {
    Memory { beta: Vec<f64> },
}

pub fn model(number: f64) -> Model {
    Model::Memory { beta: vec![number, -0.0, 5e-324, 0.1 + 0.2] }
}

pub fn subject() -> Subject {
    "S07".parse().unwrap()
}

pub fn sidecar(trial: Trial) -> Sidecar {
    Sidecar {
        version: VERSION.to_owned(),
        task: "balance".to_owned(),
        preset: "balance".to_owned(),
        mode: Mode::Simultaneous,
        assigned: false,
        learner: "rfwr".to_owned(),
        operator: "none".to_owned(),
        backend: "simulated".to_owned(),
        subject: subject(),
        trial,
        seed: 1,
        status: Status::Running,
        started: String::new(),
        ended: None,
        key_releases: None,
        devices: Vec::new(),
        host: Host::default(),
        timing: None,
        planned: Phase::ALL.to_vec(),
        profile_ron: "(task: balance)".to_owned(),
        profile: serde_json::json!({ "task": "balance" }),
        phases: std::collections::BTreeMap::new(),
        resumed: Vec::new(),
    }
}

pub fn step(episode: u32, step: u32) -> StepRow {
    let t = f64::from(step) * 0.02;
    StepRow {
        phase: Phase::Main,
        episode,
        step,
        t,
        state: State::new([t.sin(), 1e-300, -0.0, 1.0 / 3.0]),
        u_human: Some(10.0),
        u_machine: None,
        share: Some(1.0),
        u: Some(10.0),
        u_applied: Some(1e22),
        reward: Some(0.1 + 0.2),
        success: Some(0.0),
        region: Some("all"),
        lateness_us: 0,
        raw: None,
    }
}

pub fn episode(number: u32) -> EpisodeRow {
    EpisodeRow {
        phase: Phase::Main,
        episode: number,
        start: 0.05,
        steps: 3,
        duration_s: 0.06,
        end: End::Failed,
        total: 1.5,
        mean_reward: 0.5,
        share: Some(1.0),
        success: None,
        receptive_fields: Some(7),
        tallied: Tallied::new([0.1 + 0.2, 3.0]),
    }
}

pub fn checkpoint(rollout: u32) -> Box<Checkpoint<Model>> {
    Box::new(Checkpoint {
        version: VERSION.to_owned(),
        moment: Moment { rollout, ..Moment::start_of(Phase::Main) },
        of: Some(3),
        learner: Some(model(f64::from(rollout) / 7.0)),
        sharing: None,
        learned: 3,
        refused: 0,
        practice: rollout,
        operator: Vec::new(),
        momentum: None,
        tenths: 0,
        steps_bytes: 0,
        episodes_bytes: 0,
    })
}

pub fn a_policy(learner: Model) -> Policy<Model> {
    Policy {
        version: VERSION.to_owned(),
        task: "balance".to_owned(),
        preset: "balance".to_owned(),
        mode: Mode::Sequential,
        percent: 100,
        features: STATE.map(str::to_owned).to_vec(),
        outputs: vec!["u_human".to_owned()],
        action_limit: Some(10.0),
        learner,
    }
}

pub fn start(logs: &Path, manner: Manner) -> (Recorder<Model>, Trial) {
    let created = Folder::create(logs, &subject(), None, "balance", "simultaneous").unwrap();
    let recorder = Recorder::start(created.folder, &COLUMNS, manner, &sidecar(created.trial));
    (recorder.unwrap(), created.trial)
}

/// Records the rollouts, each with three steps and followed by a checkpoint.
pub fn rollouts(recorder: &mut Recorder<Model>, numbers: std::ops::RangeInclusive<u32>) {
    for number in numbers {
        for k in 0..3 {
            recorder.step(step(number, k));
        }
        recorder.episode(episode(number));
        recorder.checkpoint(checkpoint(number + 1));
    }
}

pub fn complete(trial: Trial) -> Sidecar {
    Sidecar { status: Status::Complete, ..sidecar(trial) }
}

pub fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap()
}

pub fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
    }
}
