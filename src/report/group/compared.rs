//! Both modes beside each other, with the tests that a reviewer asks for.

use std::collections::{BTreeMap, BTreeSet};

use super::{Group, Subject, average, last_average};
use crate::report::achieved::{Yardstick, yardstick};
use crate::report::figure::{Caption, Contrast, Table};
use crate::report::gather::Recorded;
use crate::report::metrics::{deviation, mean};
use crate::report::series::WINDOW;
use crate::report::spread::{LEAST_VALUES, median};
use crate::report::statistics::{Comparison, Test, compare, compare_paired};
use crate::report::words;
use crate::session::Phase;
use crate::sharing::Mode;

/// The seed of the intervals' resampling: the same report each time.
const SEED: u64 = 0;

/// The comparison of a group's modes.
pub(super) struct Compared {
    /// Its table, where both modes took place.
    pub(super) table: Option<Table>,
    /// In sentences.
    pub(super) sentences: Vec<String>,
    /// In numbers.
    pub(super) contrasts: Vec<Contrast>,
}

/// What is compared: its name, and the number of a session.
type Measure = (String, fn(&Recorded) -> Option<f64>);

fn measures(task: &str) -> [Measure; 3] {
    let name = yardstick(task).name;
    [
        (format!("{name}, robot alone"), |session| average(session, Phase::Autonomous)),
        (format!("{name}, teaching"), |session| average(session, Phase::Main)),
        (format!("{name}, last {WINDOW} rollouts"), last_average),
    ]
}

/// How subjects of both modes belong together.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Pairing {
    /// They do not.
    None,
    /// Too few are in both modes to be paired, and too few in one only to be compared.
    Unclear,
    /// They are the same people, or some are: whoever was in one mode only is left out.
    Subjects,
    /// They are simulated, with the same seeds.
    Seeds,
}

impl Pairing {
    fn of(arms: &[Vec<Subject<'_>>; 2], is_simulated: bool) -> Self {
        let names = arms.each_ref().map(|arm| arm.iter().map(|one| one.name).collect::<Vec<_>>());
        let seeds = arms.each_ref().map(|arm| {
            let mut seeds: Vec<u64> = arm.iter().filter_map(single_seed).collect();
            seeds.sort_unstable();
            seeds.dedup();
            seeds
        });
        let in_both = names[0].iter().filter(|name| names[1].contains(name)).count();
        let in_one = [names[0].len() - in_both, names[1].len() - in_both];
        // A test takes two people in each mode. Of both ways, the one that tells of more people.
        let (is_paired, is_apart) = (in_both >= 2, in_one.iter().all(|count| *count >= 2));
        if is_paired && (in_both >= in_one[0] + in_one[1] || !is_apart) {
            Self::Subjects
        } else if in_both > 0 && is_apart {
            Self::None
        } else if in_both > 0 {
            Self::Unclear
        } else if is_simulated && seeds[0] == seeds[1] && seeds[0].len() == names[0].len() {
            Self::Seeds
        } else {
            Self::None
        }
    }

    /// By what they are paired.
    const fn word(self) -> Option<&'static str> {
        match self {
            Self::None | Self::Unclear => None,
            Self::Subjects => Some("subject"),
            Self::Seeds => Some("seed"),
        }
    }

    /// The values of both modes, paired ones in the same order.
    fn values(
        self,
        arms: &[Vec<Subject<'_>>; 2],
        of: impl Fn(&Subject<'_>) -> Option<f64>,
    ) -> [Vec<f64>; 2] {
        if matches!(self, Self::None | Self::Unclear) {
            return arms.each_ref().map(|arm| arm.iter().filter_map(&of).collect());
        }
        let key = |subject: &Subject<'_>| match self {
            Self::Seeds => single_seed(subject).map(|seed| format!("{seed:020}")),
            _ => Some(subject.name.to_owned()),
        };
        let [first, second] = arms.each_ref().map(|arm| {
            let known = arm.iter().filter_map(|subject| Some((key(subject)?, of(subject)?)));
            known.collect::<BTreeMap<_, _>>()
        });
        let both = first.iter().filter_map(|(key, a)| Some((*a, *second.get(key)?)));
        let (a, b): (Vec<f64>, Vec<f64>) = both.unzip();
        [a, b]
    }
}

/// The seed of a subject with one session.
fn single_seed(subject: &Subject<'_>) -> Option<u64> {
    match subject.sessions[..] {
        [session] => Some(session.seed),
        _ => None,
    }
}

/// Takes out of `arms` who does not fit the pairing, and names them: of pairs those who were in one
/// mode only; else those who were in both, who are no independent people.
fn leave_out_misfits(pairing: Pairing, arms: &mut [Vec<Subject<'_>>; 2]) -> Option<String> {
    let names = arms.each_ref().map(|arm| arm.iter().map(|one| one.name).collect::<BTreeSet<_>>());
    let is_in_both = |name: &str| names.iter().all(|names| names.contains(name));
    let is_fit = |name: &str| match pairing {
        Pairing::Subjects => is_in_both(name),
        Pairing::None => !is_in_both(name),
        Pairing::Seeds | Pairing::Unclear => true,
    };
    let all: BTreeSet<&str> = names.iter().flatten().copied().collect();
    let misfits: Vec<&str> = all.into_iter().filter(|name| !is_fit(name)).collect();
    for arm in arms.iter_mut() {
        arm.retain(|one| is_fit(one.name));
    }
    let why = match pairing {
        Pairing::Subjects => "in one mode only",
        _ => "in both modes, the others in one",
    };
    (!misfits.is_empty())
        .then(|| format!("Left out of the comparison, as they were {why}: {}.", misfits.join(", ")))
}

/// A bootstrap of few values is too narrow to be told.
fn without_narrow_interval(compared: Comparison) -> Comparison {
    let is_wide_enough = compared.n.0.min(compared.n.1) >= LEAST_VALUES;
    Comparison { interval95: compared.interval95.filter(|_| is_wide_enough), ..compared }
}

/// Compares the modes of `group`.
pub(super) fn table(group: &Group<'_>) -> Compared {
    let mut arms = [group.arm(Mode::Simultaneous), group.arm(Mode::Sequential)];
    if arms.iter().any(Vec::is_empty) {
        return Compared { table: None, sentences: Vec::new(), contrasts: Vec::new() };
    }
    let is_simulated =
        group.sessions.iter().all(|session| session.operator.starts_with("simulated"));
    let pairing = Pairing::of(&arms, is_simulated);
    let misfits = leave_out_misfits(pairing, &mut arms);
    let yard = yardstick(group.task);
    let (mut rows, mut sentences, mut contrasts) = (Vec::new(), Vec::new(), Vec::new());
    for (name, of) in measures(group.task) {
        let [a, b] = pairing.values(&arms, |subject| subject.mean_of(of));
        let compared = match pairing {
            Pairing::Unclear => None,
            Pairing::None => compare(&a, &b, SEED),
            _ => compare_paired(&a, &b, SEED),
        };
        let compared = compared.map(without_narrow_interval);
        if let Some(compared) = &compared {
            let unit = match yard.unit {
                "" => String::new(),
                unit => format!(", in {unit}"),
            };
            sentences.push(format!(
                "{}, simultaneous against sequential{unit}: {compared}.",
                words::heading(&name)
            ));
            contrasts.push(Contrast {
                preset: group.preset.clone(),
                measure: name.clone(),
                unit: yard.unit,
                of: [Mode::Simultaneous, Mode::Sequential].map(Mode::word),
                paired_by: pairing.word(),
                comparison: *compared,
            });
        }
        if !a.is_empty() || !b.is_empty() {
            rows.push(row(group.task, name, [&a, &b], compared.as_ref()));
        }
    }
    if sentences.is_empty() {
        let few =
            "Too few subjects for a test: it takes at least two in each mode, or two in both.";
        sentences.push(few.to_owned());
    }
    sentences.extend(misfits);
    let table = Table {
        caption: caption(group, pairing),
        columns: [
            "measure",
            "simultaneous",
            "sequential",
            "difference",
            "95 % interval",
            "Hedges' g",
            "test",
            "p",
            "smallest p possible",
        ]
        .map(str::to_owned)
        .to_vec(),
        rows,
    };
    Compared { table: Some(table), sentences, contrasts }
}

/// What the table of a comparison is called and says.
fn caption(group: &Group<'_>, pairing: Pairing) -> Caption {
    let (few, paired) = match pairing {
        Pairing::None | Pairing::Unclear => ("subjects are dealt to the modes", ""),
        Pairing::Subjects => ("differences of subjects change their sign", ", paired by subject"),
        Pairing::Seeds => ("differences of seeds change their sign", ", paired by seed"),
    };
    let less = if yardstick(group.task).more_is_better { "" } else { " Less is better." };
    let sentence = format!(
        "Simultaneous against sequential mode{paired}: means ± standard deviation over subjects, \
         medians, the difference of means with its 95 % interval (BCa bootstrap; from {LEAST_VALUES} \
         subjects on, of fewer it would be too narrow), Hedges' g, and the chance p of such a \
         difference if the mode did not matter. With few subjects p counts every way in which {few}; \
         none of the rows is corrected for the others.{less}"
    );
    Caption {
        name: format!("{}-comparison", group.stem),
        thesis: String::new(),
        title: "Simultaneous against sequential".to_owned(),
        preset: group.preset.clone(),
        sentence,
    }
}

fn row(
    task: &str,
    name: String,
    values: [&[f64]; 2],
    compared: Option<&Comparison>,
) -> Vec<String> {
    let Yardstick { unit, decimals, .. } = yardstick(task);
    let decimals = decimals.max(2);
    let arm = |values: &[f64]| {
        if values.is_empty() {
            return "–".to_owned();
        }
        let sd = deviation(values).map_or(String::new(), |sd| format!(" ± {sd:.decimals$}"));
        let middle = median(values).map_or(String::new(), |m| format!(", median {m:.decimals$}"));
        let blank = if unit.is_empty() { "" } else { " " };
        format!("{:.decimals$}{blank}{unit}{sd}{middle} (n = {})", mean(values), values.len())
    };
    let nothing = "–".to_owned();
    let mut row = vec![name, arm(values[0]), arm(values[1])];
    row.extend(match compared {
        None => vec![nothing; 6],
        Some(compared) => vec![
            format!("{:+.decimals$}", compared.difference),
            compared.interval95.map_or_else(
                || nothing.clone(),
                |(a, b)| format!("{a:+.decimals$} to {b:+.decimals$}"),
            ),
            compared.hedges_g.map_or_else(|| nothing.clone(), |g| format!("{g:+.2}")),
            test(compared.test),
            chance(compared.p),
            compared.smallest_p.map_or(nothing, chance),
        ],
    });
    row
}

/// A chance with three decimals, or that it is smaller than they show: it is never 0.
fn chance(p: f64) -> String {
    if p < 0.001 { "< 0.001".to_owned() } else { format!("{p:.3}") }
}

fn test(test: Test) -> String {
    match test {
        Test::Permutation { arrangements } => format!("exact permutation, {arrangements} ways"),
        Test::PairedPermutation { arrangements } => {
            format!("exact sign flips, {arrangements} ways")
        }
        Test::Welch { t, df } => format!("Welch t = {t:.2}, df = {df:.1}"),
        Test::PairedT { t, df } => format!("paired t = {t:.2}, df = {df:.0}"),
    }
}
