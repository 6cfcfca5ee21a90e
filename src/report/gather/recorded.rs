//! A session read back for a report, whatever became of it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{Field, Trace};
use crate::learner::Model;
use crate::record::reader::{Episodes, ends_in_half_a_row, read_evaluation};
use crate::record::{
    EpisodeRow, Error, EvaluationRow, Policy, Sidecar, Status, read_policy, read_sidecar,
};
use crate::report::figure::LeftOut;
use crate::report::words::plane;
use crate::session::Phase;
use crate::sharing::Mode;

/// A session read back.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// Its folder.
    pub path: PathBuf,
    /// The subject.
    pub subject: String,
    /// The trial.
    pub trial: u32,
    /// The task's name outside.
    pub task: String,
    /// The profile's preset.
    pub preset: String,
    /// What the robot does while it learns.
    pub mode: Mode,
    /// The learner's word.
    pub learner: String,
    /// Who steers.
    pub operator: String,
    /// What is steered.
    pub backend: String,
    /// The seed.
    pub seed: u64,
    /// How it stands.
    pub status: Status,
    /// How often it was taken up again.
    pub resumed: usize,
    /// Its profile, each key with its value; without the mode, which tells groups apart.
    pub profile: BTreeMap<String, String>,
    /// Its rollouts, in order.
    pub rollouts: Vec<EpisodeRow>,
    /// Rollouts that took place, but whose rows cannot be used or are gone.
    pub lost: usize,
    /// What the policy of each tenth of main did alone: percent and rollout.
    pub tenths: Vec<(u8, EpisodeRow)>,
    /// What its step rows tell.
    pub trace: Trace,
    /// The names of what the learner sees,
    pub features: Vec<String>,
    /// and its receptive fields at the end.
    pub fields: Vec<Field>,
    /// What of it was left out.
    pub left_out: Vec<LeftOut>,
}

/// Reads the session in `folder`, and keeps about so many `points` of each phase's states. Rows
/// and files that cannot be used are left out and named.
///
/// # Errors
/// When nothing of it can be used.
pub fn read(folder: &Path, points: usize) -> Result<Recorded, Error> {
    let sidecar = read_sidecar(&folder.join("session.json"))?;
    let mut session = Recorded::of(folder, sidecar);
    session.read_rollouts()?;
    session.read_trace(points);
    session.read_tenths();
    session.read_policy();
    Ok(session)
}

impl Recorded {
    fn of(folder: &Path, sidecar: Sidecar) -> Self {
        let mut profile = BTreeMap::new();
        flatten("", &sidecar.profile, &mut profile);
        profile.retain(|key, _| !is_no_matter_of_results(key));
        Self {
            path: folder.to_owned(),
            subject: sidecar.subject.to_string(),
            trial: sidecar.trial.0,
            task: sidecar.task,
            preset: sidecar.preset,
            mode: sidecar.mode,
            learner: sidecar.learner,
            operator: sidecar.operator,
            backend: sidecar.backend,
            seed: sidecar.seed,
            status: sidecar.status,
            resumed: sidecar.resumed.len(),
            profile,
            rollouts: Vec::new(),
            lost: 0,
            tenths: Vec::new(),
            trace: Trace::default(),
            features: Vec::new(),
            fields: Vec::new(),
            left_out: Vec::new(),
        }
    }

    fn leave_out(&mut self, path: &Path, why: impl Into<String>) {
        self.left_out.push(LeftOut { path: path.display().to_string(), why: why.into() });
    }

    /// Names half a row at the end of `path`; whether there is one.
    fn mind_the_end(&mut self, path: &Path) -> bool {
        let is_cut = ends_in_half_a_row(path).unwrap_or(false);
        if is_cut {
            self.leave_out(path, "its last row is cut off: half a row is left out");
        }
        is_cut
    }

    fn read_rollouts(&mut self) -> Result<(), Error> {
        let path = self.path.join("episodes.csv");
        for row in Episodes::open(&path)? {
            match row {
                Ok(row) if is_finite(&row) => self.rollouts.push(row),
                Ok(row) => {
                    let (phase, episode) = (row.phase, row.episode);
                    let why = format!(
                        "the row of rollout {episode} of {phase} holds NaN or an infinite number: \
                         it is left out"
                    );
                    self.leave_out(&path, why);
                    self.lost += 1;
                }
                Err(error @ Error::Io { .. }) => return Err(error),
                Err(error) => {
                    self.leave_out(&path, format!("{}: the row is left out", error.why()));
                    self.lost += 1;
                }
            }
        }
        self.lost += usize::from(self.mind_the_end(&path));
        Ok(())
    }

    fn read_trace(&mut self, points: usize) {
        let path = self.path.join("steps.csv");
        match Trace::read(&path, &self.rollouts, &plane(&self.task), points) {
            Ok((trace, spoilt)) => {
                // Of a session that was killed the rollout under way has no row yet.
                self.lost = self.lost.max(trace.unlisted);
                let is_drawn = |row: &EpisodeRow| row.phase != Phase::Introduction;
                if trace.portraits.is_empty()
                    && spoilt.rows == 0
                    && self.rollouts.iter().any(is_drawn)
                {
                    self.leave_out(&path, "it holds no rows: no figures of single ticks");
                }
                self.trace = trace;
                if spoilt.rows > 0 {
                    let why = format!(
                        "{} cut off or with NaN or another thing that is no number, the first in \
                         line {}: left out",
                        if spoilt.rows == 1 {
                            "a row is".to_owned()
                        } else {
                            format!("{} rows are", spoilt.rows)
                        },
                        spoilt.first_line
                    );
                    self.leave_out(&path, why);
                }
                self.mind_the_end(&path);
            }
            Err(error) => {
                self.leave_out(&path, format!("{}: no figures of single ticks", error.why()));
            }
        }
    }

    fn read_tenths(&mut self) {
        let path = self.path.join("evaluation.csv");
        if !path.exists() {
            return;
        }
        match read_evaluation(&path) {
            Ok(rows) => {
                let all = rows.len();
                self.tenths = rows.iter().filter_map(tenth).collect();
                if self.tenths.len() < all {
                    let lost = all - self.tenths.len();
                    self.leave_out(
                        &path,
                        format!(
                            "{lost} of its rows hold no finite numbers, or name no tenth: left out"
                        ),
                    );
                }
                self.mind_the_end(&path);
            }
            Err(error) => {
                self.leave_out(&path, format!("{}: no figures of each tenth", error.why()));
            }
        }
    }

    fn read_policy(&mut self) {
        let path = self.path.join("policy.json");
        // A session that was cut, or had no main phase, has none.
        if !path.exists() {
            return;
        }
        match read_policy::<Model>(&path) {
            Ok(Policy { features, learner, .. }) => {
                self.fields = Field::all(&learner);
                self.features = features;
            }
            Err(error) => self.leave_out(&path, format!("{}: no receptive fields", error.why())),
        }
    }

    /// Whether it went to its end and all its rollouts are known: only then it counts among
    /// others.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.status == Status::Complete && self.lost == 0
    }

    /// What it is called: subject and trial.
    #[must_use]
    pub fn title(&self) -> String {
        format!("{} {:03}", self.subject, self.trial)
    }

    /// The beginning of its files' names.
    #[must_use]
    pub fn stem(&self) -> String {
        let Self { subject, trial, task, .. } = self;
        format!("{subject}-{trial:03}-{task}-{}", self.mode.word())
    }

    /// Its rollouts of `phase` that count.
    #[must_use]
    pub fn of_phase(&self, phase: Phase) -> Vec<&EpisodeRow> {
        crate::report::metrics::rollouts_of(&self.rollouts, phase).collect()
    }
}

/// The rollout of a policy after some percent of main.
fn tenth(row: &EvaluationRow) -> Option<(u8, EpisodeRow)> {
    let percent = row.policy.strip_prefix("policy-")?.parse().ok()?;
    let rollout = EpisodeRow {
        phase: Phase::Autonomous,
        episode: row.episode,
        start: row.start,
        steps: row.steps,
        duration_s: row.duration_s,
        end: row.end,
        total: row.total,
        mean_reward: row.mean_reward,
        share: None,
        success: None,
        receptive_fields: None,
        tallied: row.tallied,
    };
    is_finite(&rollout).then_some((percent, rollout))
}

fn is_finite(row: &EpisodeRow) -> bool {
    let numbers = [row.start, row.duration_s, row.total, row.mean_reward];
    let optional = [row.share, row.success].into_iter().flatten();
    numbers.into_iter().chain(optional).all(f64::is_finite) && row.tallied.is_finite()
}

/// Each leaf of `value` under its dotted path.
fn flatten(path: &str, value: &serde_json::Value, into: &mut BTreeMap<String, String>) {
    match value {
        serde_json::Value::Object(parts) => {
            for (key, value) in parts {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                flatten(&path, value, into);
            }
        }
        leaf => {
            into.insert(path.to_owned(), leaf.to_string());
        }
    }
}

/// Keys that do not say what was done: who is in which group, and what a screen looks like.
fn is_no_matter_of_results(key: &str) -> bool {
    key == "mode" || key == "preset" || key.starts_with("screen.")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_is_its_leaves() {
        let value = serde_json::json!({"a": {"b": 1.5, "c": [1, 2]}, "mode": "sequential"});
        let mut leaves = BTreeMap::new();
        flatten("", &value, &mut leaves);
        let shown: Vec<String> = leaves.iter().map(|(k, v)| format!("{k}={v}")).collect();
        assert_eq!(shown, ["a.b=1.5", "a.c=[1,2]", "mode=\"sequential\""]);
        assert!(is_no_matter_of_results("screen.glyphs") && !is_no_matter_of_results("plant.x"));
    }
}
