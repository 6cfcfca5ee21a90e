//! What a study shows: means, medians and intervals of its numbers, and differences seed by seed.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

use serde::Serialize;

use super::params::Params;
use super::plan::{REFERENCE_ARM, Run, Study, What};
use super::results::{Done, Row};
use super::table::whole;
use super::{Readout, StudyError};
use crate::profile::Experiment;
use crate::report::metrics::{deviation, mean};
use crate::report::spread::{interval95, median};

/// What a study shows.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// The version of this form.
    pub schema: u32,
    /// The program's version.
    pub version: String,
    /// The study.
    pub study: String,
    /// The task.
    pub task: String,
    /// Runs that were planned,
    pub runs: usize,
    /// and those of which there are results.
    pub done: usize,
    /// Runs that went wrong, and why.
    pub failed: Vec<(u32, String)>,
    /// Runs of which there is nothing.
    pub missing: Vec<u32>,
    /// What a reader should know.
    pub remarks: Vec<String>,
    /// All numbers, over the seeds.
    pub groups: Vec<Group>,
    /// Differences, seed by seed.
    pub differences: Vec<Difference>,
}

/// Which numbers belong together.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Of {
    /// The setting.
    pub setting: String,
    /// Who steered.
    pub operator: String,
    /// After how much of main, %.
    pub checkpoint: u8,
    /// From where.
    pub start: String,
    /// What was measured.
    pub measure: String,
}

/// A number over the seeds.
#[derive(Clone, Debug, Serialize)]
pub struct Group {
    /// Which.
    #[serde(flatten)]
    pub of: Of,
    /// The arm, or the word for references.
    pub arm: String,
    /// Whose policy.
    pub readout: String,
    /// What came out.
    #[serde(flatten)]
    pub spread: Spread,
}

/// How the difference of two arms or readouts is, seed by seed.
#[derive(Clone, Debug, Serialize)]
pub struct Difference {
    /// Which numbers.
    #[serde(flatten)]
    pub of: Of,
    /// The arm
    pub arm: String,
    /// and readout
    pub readout: String,
    /// less that arm
    pub from_arm: String,
    /// and readout.
    pub from_readout: String,
    /// Seeds whose difference is above 0,
    pub above: usize,
    /// and below.
    pub below: usize,
    /// What came out.
    #[serde(flatten)]
    pub spread: Spread,
}

/// The spread of some numbers.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Spread {
    /// How many there are.
    pub n: usize,
    /// Their mean,
    pub mean: f64,
    /// their median,
    pub median: f64,
    /// the standard error of the mean,
    pub standard_error: Option<f64>,
    /// and its 95 % interval (percentile bootstrap); none of a single one.
    pub interval95: Option<(f64, f64)>,
}

impl Spread {
    fn of(values: &[f64]) -> Option<Self> {
        let (n, median) = (values.len(), median(values)?);
        #[expect(clippy::cast_precision_loss, reason = "a number of seeds")]
        let standard_error = deviation(values).map(|deviation| deviation / (n as f64).sqrt());
        Some(Self { n, mean: mean(values), median, standard_error, interval95: interval95(values) })
    }
}

/// The numbers of one setting and operator: by what they are, arm and readout, then by seed.
type Numbers = BTreeMap<Of, BTreeMap<(String, String), BTreeMap<u64, f64>>>;

/// What the runs of `study` among `runs` show. `read` gives what a run came to, and why it came to
/// nothing; nothing of one that was not done. Runs of one setting and operator are held in memory
/// at a time.
pub fn summarise<'a>(
    study: &Study,
    runs: impl Iterator<Item = &'a Run>,
    read: &dyn Fn(u32) -> Option<Result<Done, String>>,
) -> Summary {
    let mut summary = Summary {
        schema: 1,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        study: study.name.clone(),
        task: study.task().to_owned(),
        runs: 0,
        done: 0,
        failed: Vec::new(),
        missing: Vec::new(),
        remarks: Vec::new(),
        groups: Vec::new(),
        differences: Vec::new(),
    };
    let mut numbers = Numbers::new();
    let mut current = None;
    for run in runs {
        summary.runs += 1;
        let operator = match &run.what {
            What::Session { operator, .. } => operator.to_string(),
            What::References => String::new(),
        };
        let place = Some((run.setting, operator.clone()));
        if current != place {
            summary.close(study, std::mem::take(&mut numbers));
            current = place;
        }
        match read(run.number) {
            Some(Ok(done)) => {
                summary.done += 1;
                if run.what == What::References {
                    summary.remarks.extend(beyond_the_optimum(study, run, &done));
                }
                take(&mut numbers, done);
            }
            Some(Err(why)) => summary.failed.push((run.number, why)),
            None => summary.missing.push(run.number),
        }
    }
    summary.close(study, numbers);
    summary
}

impl Summary {
    /// Writes it to `path` as JSON, whole or not at all.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn write(&self, path: &Path) -> Result<(), StudyError> {
        whole(path, |file| {
            serde_json::to_writer(&mut *file, self).map_err(io::Error::from)?;
            Ok(file.write_all(b"\n")?)
        })
    }

    /// Takes in the numbers of one setting and operator.
    fn close(&mut self, study: &Study, numbers: Numbers) {
        let pairs = study.pairs();
        for (of, arms) in numbers {
            for pair in &pairs {
                let side = |(arm, readout): &(String, Readout)| {
                    arms.get(&(arm.clone(), readout.word().to_owned()))
                };
                if let (Some(a), Some(b)) = (side(&pair.of), side(&pair.from)) {
                    self.differences.extend(difference(&of, &pair.of, &pair.from, a, b));
                }
            }
            // How main itself went is compared as well.
            let team = |arm: &str| arms.get(&(arm.to_owned(), "team".to_owned()));
            let (first, others) = study.params.arms.split_at(1);
            for other in others {
                if let (Some(a), Some(b)) = (team(&other.name), team(&first[0].name)) {
                    let side = |name: &str| (name.to_owned(), "team");
                    let (a_side, b_side) = (side(&other.name), side(&first[0].name));
                    self.differences.extend(subtract(&of, &a_side, &b_side, a, b));
                }
            }
            for ((arm, readout), by_seed) in arms {
                let values: Vec<f64> = by_seed.into_values().collect();
                if let Some(spread) = Spread::of(&values) {
                    self.groups.push(Group { of: of.clone(), arm, readout, spread });
                }
            }
        }
    }
}

fn take(numbers: &mut Numbers, done: Done) {
    let labels = done.labels;
    for Row { checkpoint, readout, start, measure, value } in done.rows {
        let (setting, operator) = (labels.setting.clone(), labels.operator.clone());
        let of = Of { setting, operator, checkpoint, start, measure };
        let arm = (labels.arm.clone(), readout);
        numbers.entry(of).or_default().entry(arm).or_default().insert(labels.seed, value);
    }
}

fn difference(
    of: &Of,
    (arm, readout): &(String, Readout),
    (from_arm, from_readout): &(String, Readout),
    a: &BTreeMap<u64, f64>,
    b: &BTreeMap<u64, f64>,
) -> Option<Difference> {
    let (a_side, b_side) = ((arm.clone(), readout.word()), (from_arm.clone(), from_readout.word()));
    subtract(of, &a_side, &b_side, a, b)
}

/// The difference over the seeds that both sides have.
fn subtract(
    of: &Of,
    (arm, readout): &(String, &str),
    (from_arm, from_readout): &(String, &str),
    a: &BTreeMap<u64, f64>,
    b: &BTreeMap<u64, f64>,
) -> Option<Difference> {
    let values: Vec<f64> =
        a.iter().filter_map(|(seed, value)| Some(value - b.get(seed)?)).collect();
    Some(Difference {
        of: of.clone(),
        arm: arm.clone(),
        readout: (*readout).to_owned(),
        from_arm: from_arm.clone(),
        from_readout: (*from_readout).to_owned(),
        above: values.iter().filter(|value| **value > 0.0).count(),
        below: values.iter().filter(|value| **value < 0.0).count(),
        spread: Spread::of(&values)?,
    })
}

/// That no policy can reach the threshold of success, where the optimum is known.
fn beyond_the_optimum(study: &Study, run: &Run, done: &Done) -> Option<String> {
    let Experiment::MountainCar { rules, .. } = &study.profile(run).experiment else { return None };
    let trained = study.params.starts.iter().find(|starts| starts.count == 1)?;
    let of_optimum = |measure: &str| {
        let row = done.rows.iter().find(|row| {
            row.readout == "optimum" && row.start == trained.name && row.measure == measure
        });
        row.map(|row| row.value)
    };
    let (steps, reward) = (of_optimum("mean_steps")?, of_optimum("mean_reward")?);
    let threshold = rules.reward_threshold;
    let most = (reward - rules.reward_min) / (threshold - rules.reward_min);
    (reward < threshold).then(|| {
        format!(
            "setting {}: rules.reward_threshold {threshold} is beyond the optimum: {steps} steps are \
             a mean reward of {reward:.3}, so success stays below {most:.3} and w above {:.3}",
            done.labels.setting,
            1.0 - most
        )
    })
}

/// The measures of `task` that tables show, and their decimals.
#[must_use]
pub fn headlines(task: &str) -> &'static [(&'static str, usize)] {
    match task {
        "balance" => &[("mean_balance_s", 2)],
        "swing-up" => &[("mean_height", 3), ("mean_longest_hold_s", 2)],
        "speed-up" => &[("mean_speed", 4)],
        _ => &[("mean_steps", 1), ("mean_reward", 3), ("mean_return", 2)],
    }
}

impl Summary {
    /// The table for people: policies at the last checkpoint, references among them, then the
    /// differences.
    #[must_use]
    pub fn sentences(&self, params: &Params) -> Vec<String> {
        let last = params.checkpoints.last().copied().unwrap_or(100);
        let mut lines = vec![format!(
            "{} ({}): {} of {} runs done, {} failed",
            self.study,
            self.task,
            self.done,
            self.runs,
            self.failed.len()
        )];
        let mut before = None;
        let references = |of: &Of| {
            let of = Of { operator: String::new(), checkpoint: 100, ..of.clone() };
            self.groups.iter().filter(move |group| group.of == of && group.arm == REFERENCE_ARM)
        };
        for group in &self.groups {
            if group.of.checkpoint != last || group.arm == REFERENCE_ARM {
                continue;
            }
            let Some(decimals) = decimals(&self.task, group) else { continue };
            if before.as_ref() != Some(&group.of) {
                lines.push(heading(&group.of, last));
                lines.extend(references(&group.of).map(|group| line(group, decimals)));
                before = Some(group.of.clone());
            }
            lines.push(line(group, decimals));
            let is_last = self.groups.iter().rfind(|other| other.of == group.of);
            if is_last.is_some_and(|last| std::ptr::eq(last, group)) {
                let of_it = self.differences.iter().filter(|other| other.of == group.of);
                lines.extend(of_it.map(|difference| difference.line(decimals)));
            }
        }
        lines.extend(self.remarks.iter().cloned());
        lines.extend(self.failed.iter().map(|(run, why)| format!("run {run} failed: {why}")));
        lines
    }
}

/// The decimals of a group that tables show.
fn decimals(task: &str, group: &Group) -> Option<usize> {
    if group.readout == "team" {
        return match group.of.measure.as_str() {
            "success" | "share" => Some(3),
            "gate" => Some(0),
            _ => None,
        };
    }
    headlines(task)
        .iter()
        .find(|(name, _)| *name == group.of.measure)
        .map(|(_, decimals)| *decimals)
}

fn heading(of: &Of, percent: u8) -> String {
    let Of { setting, operator, start, measure, .. } = of;
    format!("\n{measure} from {start} at {percent} % · {operator} · {setting}")
}

fn line(group: &Group, decimals: usize) -> String {
    let Group { arm, readout, spread, .. } = group;
    format!("  {arm:<14} {readout:<11} {}", spread.words(decimals))
}

impl Spread {
    fn words(&self, decimals: usize) -> String {
        let Self { n, mean, median, interval95, .. } = self;
        let interval = interval95.map_or(String::new(), |(low, high)| {
            format!("   95 % {low:.decimals$} to {high:.decimals$}")
        });
        let median = if *n > 1 { format!("   median {median:.decimals$}") } else { String::new() };
        format!("{mean:>9.decimals$}{interval}{median}   n {n}")
    }
}

impl Difference {
    fn line(&self, decimals: usize) -> String {
        let Self { arm, readout, from_arm, from_readout, above, below, spread, .. } = self;
        format!(
            "  {arm} {readout} − {from_arm} {from_readout}: {}, above 0 in {above}, below in {below}",
            spread.words(decimals).trim_start()
        )
    }
}
