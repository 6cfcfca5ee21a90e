//! What a study shows, as a table for people.

use super::params::Params;
use super::plan::{REFERENCE_ARM, Run, Study};
use super::results::Done;
use super::summary::{Difference, Group, Of, Part, Spread};
use crate::profile::Experiment;

/// Makes the table, part by part: policies at the last checkpoint, references among them, and how
/// they differ.
pub(super) struct Words {
    task: &'static str,
    last: u8,
    /// What the references of the setting came to.
    references: Vec<Group>,
}

impl Words {
    pub(super) fn new(study: &Study) -> Self {
        let last = study.last_checkpoint();
        Self { task: study.task(), last, references: Vec::new() }
    }

    /// The lines for the parts of runs that are compared.
    pub(super) fn of(&mut self, parts: &[Part]) -> Vec<String> {
        parts.iter().flat_map(|part| self.of_part(part)).collect()
    }

    fn of_part(&mut self, part: &Part) -> Vec<String> {
        let (references, groups): (Vec<&Group>, Vec<&Group>) =
            part.groups.iter().partition(|group| group.arm == REFERENCE_ARM);
        if !references.is_empty() {
            self.references.retain(|known| known.of.setting == part.of.setting);
            self.references.extend(references.into_iter().cloned());
        }
        if part.of.checkpoint != self.last {
            return Vec::new();
        }
        let decimals = |group: &Group| decimals(self.task, &group.readout, &part.of.measure);
        let shown: Vec<(&Group, usize)> =
            groups.into_iter().filter_map(|group| Some((group, decimals(group)?))).collect();
        let Some((_, decimals)) = shown.last() else { return Vec::new() };
        let is_beside = |group: &&Group| {
            let Of { setting, start, measure, .. } = &group.of;
            (setting, start, measure) == (&part.of.setting, &part.of.start, &part.of.measure)
        };
        let beside = self.references.iter().filter(is_beside).map(|group| (group, *decimals));
        let groups =
            beside.chain(shown.iter().copied()).map(|(group, decimals)| line(group, decimals));
        let differences = part.differences.iter().map(|difference| difference.lines(*decimals));
        [heading(&part.of, self.last)].into_iter().chain(groups).chain(differences).collect()
    }
}

/// The measures of `task` that tables show, and their decimals.
pub(super) fn headlines(task: &str) -> &'static [(&'static str, usize)] {
    match task {
        "balance" => &[("mean_balance_s", 2)],
        "swing-up" => &[("mean_height", 3), ("mean_longest_hold_s", 2)],
        "speed-up" => &[("mean_speed", 4)],
        _ => &[("mean_steps", 1), ("mean_reward", 3), ("mean_return", 2)],
    }
}

/// That no policy can reach the threshold of success, where the optimum is known.
pub(super) fn beyond_the_optimum(study: &Study, run: &Run, done: &Done) -> Option<String> {
    let profile = study.profile(run).ok()?;
    let Experiment::MountainCar { rules, .. } = &profile.experiment else { return None };
    let Params { starts, .. } = &study.params;
    let trained = starts.iter().find(|starts| starts.count == 1)?;
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

/// The decimals of a measure of a readout that tables show.
fn decimals(task: &str, readout: &str, measure: &str) -> Option<usize> {
    if readout == "team" {
        return match measure {
            "success" | "share" => Some(3),
            "gate" => Some(0),
            _ => None,
        };
    }
    headlines(task).iter().find(|(name, _)| *name == measure).map(|(_, decimals)| *decimals)
}

fn heading(of: &Of, percent: u8) -> String {
    let Of { setting, operator, start, measure, .. } = of;
    format!("\n{measure} from {start} at {percent} % · {operator} · {setting}")
}

fn line(group: &Group, decimals: usize) -> String {
    let Group { arm, readout, spread, .. } = group;
    format!("  {arm:<12} {readout:<10} {}", spread.words(decimals))
}

impl Spread {
    fn words(&self, decimals: usize) -> String {
        let Self { n, mean, median, interval95, .. } = self;
        let interval = interval95.map_or(String::new(), |(low, high)| {
            format!("  95 % {low:.decimals$} to {high:.decimals$}")
        });
        let median = if *n > 1 { format!("  median {median:.decimals$}") } else { String::new() };
        format!("{mean:>8.decimals$}{interval}{median}  n {n}")
    }
}

impl Difference {
    /// Two lines: what is subtracted, and what came out.
    fn lines(&self, decimals: usize) -> String {
        let Self { of, arm, readout, from_arm, from_readout, from_operator, above, below, spread } =
            self;
        let another = if *from_operator == of.operator {
            String::new()
        } else {
            format!(" ({from_operator})")
        };
        format!(
            "  {arm} {readout} − {from_arm} {from_readout}{another}\n  {:2}{}, {above} up, {below} down",
            "",
            spread.words(decimals)
        )
    }
}
