//! A session read back for a report, whatever became of it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::{Field, Trace};
use crate::learner::Model;
use crate::record::reader::{Episodes, Evaluations, ends_in_half_a_row};
use crate::record::{
    EpisodeRow, Error, EvaluationRow, Policy, Sidecar, Status, read_policy, read_sidecar,
};
use crate::report::figure::LeftOut;
use crate::report::metrics::counts;
use crate::report::words::{counted, plane};
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
    /// Rollouts that took place, but whose rows cannot be used or are gone, as far as is known.
    pub lost: usize,
    /// The rollouts that its `session.json` tells, by phase; none before its end.
    told: BTreeMap<String, usize>,
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
            told: sidecar
                .phases
                .iter()
                .filter_map(|(phase, told)| {
                    Some((phase.clone(), usize::try_from(told.get("episodes")?.as_u64()?).ok()?))
                })
                .collect(),
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

    fn mind_the_end(&mut self, path: &Path) {
        if ends_in_half_a_row(path).unwrap_or(false) {
            self.leave_out(path, "its last row is cut off: half a row is left out");
        }
    }

    fn read_rollouts(&mut self) -> Result<(), Error> {
        let path = self.path.join("episodes.csv");
        let mut seen = BTreeSet::new();
        for row in Episodes::open(&path)? {
            match row {
                Ok(row) if !is_finite(&row) => {
                    let (phase, episode) = (row.phase, row.episode);
                    let why = format!(
                        "the row of rollout {episode} of {phase} holds NaN or an infinite number: \
                         it is left out"
                    );
                    self.leave_out(&path, why);
                }
                Ok(row) if counts(&row) && !seen.insert((row.phase, row.episode)) => {
                    let (phase, episode) = (row.phase, row.episode);
                    let why =
                        format!("rollout {episode} of {phase} stands there twice: it counts once");
                    self.leave_out(&path, why);
                }
                Ok(row) => self.rollouts.push(row),
                Err(error @ Error::Io { .. }) => return Err(error),
                Err(error) => {
                    self.leave_out(&path, format!("{}: the row is left out", error.why()));
                }
            }
        }
        self.mind_the_end(&path);
        self.count_lost(&path);
        Ok(())
    }

    /// Compares its rollouts with those that its `session.json` tells; before a session's end that
    /// tells none, but their numbers do.
    fn count_lost(&mut self, path: &Path) {
        let mut lost = Vec::new();
        for phase in Phase::ALL {
            let there = self.of_phase(phase).len();
            let numbers: BTreeSet<u32> = self
                .rollouts
                .iter()
                .filter(|row| row.phase == phase)
                .map(|row| row.episode)
                .collect();
            let last = numbers.last().map_or(0, |last| *last as usize);
            let told = self.told.get(phase.word()).copied();
            let missing =
                told.map_or(last - numbers.len().min(last), |told| told.saturating_sub(there));
            if missing > 0 {
                self.lost += missing;
                lost.push(format!("{missing} of {} of {phase}", told.unwrap_or(last)));
            }
        }
        if !lost.is_empty() {
            let why = format!(
                "rollouts that took place are missing: {}; the session counts in no group",
                lost.join(", ")
            );
            self.leave_out(path, why);
        }
    }

    fn read_trace(&mut self, points: usize) {
        let path = self.path.join("steps.csv");
        match Trace::read(&path, &self.rollouts, &plane(&self.task), points) {
            Ok((trace, spoilt)) => {
                let told = [
                    spoilt.told(),
                    trace.missing_beside(spoilt.rows),
                    (trace.doubled > 0).then(|| {
                        let rows = counted(trace.doubled, "row");
                        format!("{rows} of steps that were there already: left out")
                    }),
                ];
                for why in told.into_iter().flatten() {
                    self.leave_out(&path, why);
                }
                self.trace = trace;
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
        let rows = match Evaluations::open(&path) {
            Ok(rows) => rows,
            Err(error) => {
                self.leave_out(&path, format!("{}: no figures of each tenth", error.why()));
                return;
            }
        };
        let mut seen = BTreeSet::new();
        let (mut bad, mut doubled) = (None, 0);
        for row in rows {
            let row = row.and_then(|row| {
                let why = "a number is not finite, or the policy is none of a tenth";
                tenth(&row).ok_or_else(|| Error::unfit(&path, why))
            });
            match row {
                Ok((percent, row)) if seen.insert((percent, row.episode)) => {
                    self.tenths.push((percent, row));
                }
                Ok(_) => doubled += 1,
                Err(error) => {
                    let (count, _) = bad.get_or_insert((0, error));
                    *count += 1;
                }
            }
        }
        if let Some((count, first)) = bad {
            let rows = counted(count, "row");
            self.leave_out(&path, format!("{rows} left out, the first because: {}", first.why()));
        }
        if doubled > 0 {
            let why =
                format!("{} of starts that were there already: left out", counted(doubled, "row"));
            self.leave_out(&path, why);
        }
        self.mind_the_end(&path);
        self.leave_out_short_tenths(&path);
    }

    /// A tenth that was tried from fewer starts than others is no fair one.
    fn leave_out_short_tenths(&mut self, path: &Path) {
        let mut starts = BTreeMap::<u8, usize>::new();
        for percent in (1..=10).map(|tenth| 10 * tenth) {
            if self.path.join(format!("policy-{percent:03}.json")).exists() {
                starts.insert(percent, 0);
            }
        }
        for (percent, _) in &self.tenths {
            *starts.entry(*percent).or_default() += 1;
        }
        let most = starts.values().copied().max().unwrap_or(0);
        let short: Vec<u8> =
            starts.iter().filter(|(_, count)| **count < most.max(1)).map(|(p, _)| *p).collect();
        if short.is_empty() {
            return;
        }
        if most == 0 {
            self.leave_out(path, "it holds no row that can be used: no figures of each tenth");
            return;
        }
        self.tenths.retain(|(percent, _)| !short.contains(percent));
        let names: Vec<String> = short.iter().map(|percent| format!("{percent} %")).collect();
        let why = format!(
            "the policies after {} of main have fewer rows than others, or none: left out",
            names.join(", ")
        );
        self.leave_out(path, why);
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
