//! What a study shows: means, medians and intervals of its numbers, and differences seed by seed.

use std::collections::BTreeMap;
use std::thread;

use serde::Serialize;

use super::plan::Study;
use super::results::{Done, Row};
use crate::report::metrics::{deviation, mean};
use crate::report::spread::{interval95, median};

/// Which numbers belong together.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub(super) struct Of {
    /// The setting.
    pub(super) setting: String,
    /// Who steered.
    pub(super) operator: String,
    /// After how much of main, %.
    pub(super) checkpoint: u8,
    /// From where.
    pub(super) start: String,
    /// What was measured.
    pub(super) measure: String,
}

/// A number over the seeds.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Group {
    /// Which.
    #[serde(flatten)]
    pub(super) of: Of,
    /// The arm, or the word for references.
    pub(super) arm: String,
    /// Whose policy.
    pub(super) readout: String,
    /// What came out.
    #[serde(flatten)]
    pub(super) spread: Spread,
}

/// How the difference of two arms or readouts is, seed by seed.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Difference {
    /// Which numbers.
    #[serde(flatten)]
    pub(super) of: Of,
    /// The arm
    pub(super) arm: String,
    /// and readout
    pub(super) readout: String,
    /// less that arm,
    pub(super) from_arm: String,
    /// readout
    pub(super) from_readout: String,
    /// and who steered it: another one where an arm has an operator of its own.
    pub(super) from_operator: String,
    /// Seeds whose difference is above 0,
    pub(super) above: usize,
    /// and below.
    pub(super) below: usize,
    /// What came out.
    #[serde(flatten)]
    pub(super) spread: Spread,
}

/// The spread of some numbers.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Spread {
    /// How many there are.
    pub(super) n: usize,
    /// Their mean,
    pub(super) mean: f64,
    /// their median,
    pub(super) median: f64,
    /// the standard error of the mean,
    pub(super) standard_error: Option<f64>,
    /// and its 95 % interval; none of fewer than five.
    pub(super) interval95: Option<(f64, f64)>,
}

impl Spread {
    fn of(values: &[f64]) -> Option<Self> {
        let (n, median) = (values.len(), median(values)?);
        #[expect(clippy::cast_precision_loss, reason = "a number of seeds")]
        let standard_error = deviation(values).map(|deviation| deviation / (n as f64).sqrt());
        Some(Self { n, mean: mean(values), median, standard_error, interval95: interval95(values) })
    }
}

/// What is shown of numbers that belong together.
pub(super) struct Part {
    /// Which numbers.
    pub(super) of: Of,
    /// Each arm and readout.
    pub(super) groups: Vec<Group>,
    /// How they differ.
    pub(super) differences: Vec<Difference>,
}

/// An arm and the word of a readout.
type Side = (String, String);
type BySeed = BTreeMap<u64, f64>;

/// The numbers of runs that are compared: by what they are, arm and readout, then by seed.
#[derive(Default)]
pub(super) struct Numbers(BTreeMap<Of, BTreeMap<Side, BySeed>>);

impl Numbers {
    /// Takes in what a run came to.
    pub(super) fn take(&mut self, done: &Done) {
        let labels = &done.labels;
        for Row { checkpoint, readout, start, measure, value } in &done.rows {
            let of = Of {
                setting: labels.setting.clone(),
                operator: labels.operator.clone(),
                checkpoint: *checkpoint,
                start: start.clone(),
                measure: measure.clone(),
            };
            let side = (labels.arm.clone(), readout.clone());
            let arms = self.0.entry(of).or_default();
            arms.entry(side).or_default().insert(labels.seed, *value);
        }
    }

    /// What they show, worked out by so many threads; less of it when `is_enough` says so in
    /// between.
    pub(super) fn show(
        &self,
        study: &Study,
        jobs: usize,
        is_enough: &(dyn Fn() -> bool + Sync),
    ) -> Vec<Part> {
        let sides = sides(study);
        let all: Vec<&Of> = self.0.keys().collect();
        let work = |share: &[&Of]| -> Vec<Part> {
            let parts = share.iter().map_while(|of| {
                let is_wanted = !is_enough();
                is_wanted.then(|| self.part(study, &sides, of))
            });
            parts.flatten().collect()
        };
        let share = all.len().div_ceil(jobs.max(1)).max(1);
        thread::scope(|scope| {
            let work = &work;
            let threads: Vec<_> =
                all.chunks(share).map(|share| scope.spawn(move || work(share))).collect();
            let parts = threads.into_iter().map(|thread| {
                thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            });
            parts.flatten().collect()
        })
    }

    fn part(&self, study: &Study, sides: &[(Side, Side)], of: &Of) -> Option<Part> {
        let arms = self.0.get(of)?;
        let mut differences = Vec::new();
        for (side, from) in sides {
            let Some(values) = arms.get(side) else { continue };
            for operator in study.opposite(&side.0, &from.0, &of.operator) {
                let across = Of { operator, ..of.clone() };
                let others = self.0.get(&across).and_then(|arms| arms.get(from));
                differences.extend(others.and_then(|others| {
                    subtract(of, (side, values), (from, &across.operator, others))
                }));
            }
        }
        let groups = arms.iter().filter_map(|((arm, readout), by_seed)| {
            let values: Vec<f64> = by_seed.values().copied().collect();
            let spread = Spread::of(&values)?;
            Some(Group { of: of.clone(), arm: arm.clone(), readout: readout.clone(), spread })
        });
        Some(Part { of: of.clone(), groups: groups.collect(), differences })
    }
}

/// All that is compared: the pairs of `study`, and how main itself went in each arm with the first.
fn sides(study: &Study) -> Vec<(Side, Side)> {
    let pairs = study.pairs().into_iter().map(|pair| {
        let [of, from] =
            [pair.of, pair.from].map(|(arm, readout)| (arm, readout.word().to_owned()));
        (of, from)
    });
    let team = |name: &String| (name.clone(), "team".to_owned());
    let (first, others) = study.params.arms.split_at(1);
    let teams = others.iter().map(|other| (team(&other.name), team(&first[0].name)));
    pairs.chain(teams).collect()
}

/// The difference over the seeds that both sides have.
fn subtract(
    of: &Of,
    ((arm, readout), a): (&Side, &BySeed),
    ((from_arm, from_readout), from_operator, b): (&Side, &str, &BySeed),
) -> Option<Difference> {
    let values: Vec<f64> =
        a.iter().filter_map(|(seed, value)| Some(value - b.get(seed)?)).collect();
    Some(Difference {
        of: of.clone(),
        arm: arm.clone(),
        readout: readout.clone(),
        from_arm: from_arm.clone(),
        from_readout: from_readout.clone(),
        from_operator: from_operator.to_owned(),
        above: values.iter().filter(|value| **value > 0.0).count(),
        below: values.iter().filter(|value| **value < 0.0).count(),
        spread: Spread::of(&values)?,
    })
}
