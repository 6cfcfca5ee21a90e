//! What is wrong with a study's file.

use super::params::{Arm, Params, Readout, Reference, Sets};
use super::plan::{REFERENCE_ARM, operators};
use crate::operator::Choice;
use crate::profile::{Experiment, Wrong};
use crate::task::mountain_car::MountainCar;

/// The most seeds.
const MOST_SEEDS: u32 = 100_000;
/// The most starts of a policy.
const MOST_STARTS: u32 = 100_000;

/// What is wrong with `params` whatever the profile.
pub(super) fn faults(params: &Params) -> Vec<Wrong> {
    let mut faults = Faults::default();
    faults.names(params);
    faults.changes(params);
    faults.seeds_and_starts(params);
    faults.tests(params);
    faults.compared(params);
    faults.0
}

/// What does not go with the task, or with who steers.
pub(super) fn misfits(params: &Params, experiment: &Experiment) -> Vec<Wrong> {
    let mut faults = Faults::default();
    for arm in &params.arms {
        let words = operators(params, arm);
        let message = format!("nobody steers in the arm `{}`", arm.name);
        let expected = "an `operator` of its own, or `operators` of the study";
        faults.demand(!words.is_empty(), "arms", message, expected);
        for word in words {
            faults.operator(params, experiment, arm, word);
        }
    }
    for reference in &params.references {
        let is_known = *reference == Reference::Zero || experiment.name() == MountainCar::NAME;
        let message = format!("{} is known of the mountain car only", reference.word());
        faults.demand(is_known, "references", message, "zero");
    }
    faults.0
}

/// Faults, each told once.
#[derive(Default)]
struct Faults(Vec<Wrong>);

impl Faults {
    fn demand(&mut self, holds: bool, key: &'static str, message: String, expected: &str) {
        let fault = Wrong { key, message, expected: expected.to_owned() };
        if !holds && !self.0.contains(&fault) {
            self.0.push(fault);
        }
    }

    fn names(&mut self, params: &Params) {
        let named = "one or more, each with a name of its own: 1 to 64 letters, digits, - _ . =";
        for (key, names) in [
            ("arms", params.arms.iter().map(|arm| &arm.name).collect::<Vec<_>>()),
            ("settings", params.settings.iter().map(|setting| &setting.name).collect()),
            ("starts", params.starts.iter().map(|starts| &starts.name).collect()),
        ] {
            for (index, name) in names.iter().enumerate() {
                let twice = names[..index].contains(name);
                self.demand(!twice, key, format!("`{key}` has two called `{name}`"), named);
                self.demand(is_name(name), key, format!("`{name}` is no name in `{key}`"), named);
                let is_free = key != "arms" || *name != REFERENCE_ARM;
                self.demand(is_free, key, format!("no arm can be called `{REFERENCE_ARM}`"), named);
            }
        }
        self.demand(!params.arms.is_empty(), "arms", "there are no arms".to_owned(), named);
        let none = "policies have no `starts`".to_owned();
        self.demand(!params.starts.is_empty(), "starts", none, named);
    }

    /// Changes that another one would replace: the names of settings would not be true.
    fn changes(&mut self, params: &Params) {
        let has_mode = |sets: &Sets| sets.0.contains_key("mode");
        for (key, has) in [
            ("sets", has_mode(&params.sets)),
            ("settings", params.settings.iter().any(|setting| has_mode(&setting.sets))),
            ("arms", params.arms.iter().any(|arm| has_mode(&arm.sets))),
        ] {
            let message = "`mode` is no change: each arm has its own".to_owned();
            self.demand(!has, key, message, "the `mode` of the arms");
        }
        for arm in &params.arms {
            for setting in &params.settings {
                let both = arm.sets.0.keys().find(|key| setting.sets.0.contains_key(*key));
                let message = format!(
                    "the arm `{}` and the setting `{}` both set {}",
                    arm.name,
                    setting.name,
                    both.map_or("", String::as_str)
                );
                self.demand(both.is_none(), "arms", message, "a key in one of them only");
            }
        }
    }

    fn seeds_and_starts(&mut self, params: &Params) {
        let seeds = params.seeds;
        let why = if seeds.count == 0 { "there is nothing to run" } else { "that is too many" };
        let message = format!("`seeds.count` is {}: {why}", seeds.count);
        let allowed = format!("1 to {MOST_SEEDS}");
        let is_fit = (1..=MOST_SEEDS).contains(&seeds.count);
        self.demand(is_fit, "seeds.count", message, &allowed);
        let last = seeds.first.saturating_add(u64::from(seeds.count));
        let message = format!("`seeds.first` is {}", seeds.first);
        let allowed = "below 2^53, which every JSON reader knows";
        self.demand(last <= 1 << 53, "seeds.first", message, allowed);
        for starts in &params.starts {
            let allowed = format!("1 to {MOST_STARTS}");
            let message = format!("`{}` has {} starts", starts.name, starts.count);
            self.demand((1..=MOST_STARTS).contains(&starts.count), "starts", message, &allowed);
        }
    }

    fn tests(&mut self, params: &Params) {
        let points = &params.checkpoints;
        let are_tenths = points.iter().all(|point| *point % 10 == 0 && (10..=100).contains(point));
        self.demand(
            are_tenths && points.is_sorted_by(|a, b| a < b) && !points.is_empty(),
            "checkpoints",
            format!("`checkpoints` is {points:?}"),
            "some of 10, 20, … 100, in order",
        );
        let readouts = &params.readouts;
        self.demand(
            twice(readouts).is_none() && !readouts.is_empty(),
            "readouts",
            format!("`readouts` is {readouts:?}"),
            "some of agent, continuous, rounded, sign, each once",
        );
        let last = params.starts.last().map_or(0, |starts| starts.count);
        let beyond = params.trajectories.iter().find(|start| **start >= last);
        let message = format!("there is no start {}", beyond.unwrap_or(&0));
        let allowed = "numbers of the last of `starts`, from 0, each once";
        self.demand(beyond.is_none(), "trajectories", message, allowed);
        let again = twice(&params.trajectories);
        let message = format!("the start {} stands there twice", again.unwrap_or(&0));
        self.demand(again.is_none(), "trajectories", message, allowed);
    }

    fn compared(&mut self, params: &Params) {
        // Two words can mean the same person.
        let people: Vec<Option<Choice>> =
            params.operators.iter().map(|word| word.parse().ok()).collect();
        let again = (1..people.len())
            .find(|at| people[*at].is_some() && people[..*at].contains(&people[*at]));
        let message = again.map_or_else(String::new, |at| {
            let is_same = |before: &&String| before.parse().ok() == people[at];
            let before = params.operators.iter().find(is_same);
            let (before, word) = (before.map_or("", String::as_str), &params.operators[at]);
            format!("`{word}` and `{before}` are the same person")
        });
        self.demand(again.is_none(), "operators", message, "each person once");
        let again = twice(&params.references).map(|reference| reference.word());
        let message = format!("{} stands there twice", again.unwrap_or_default());
        self.demand(again.is_none(), "references", message, "each once");
        let again = twice(&params.compare);
        self.demand(again.is_none(), "compare", "a pair is there twice".to_owned(), "each once");
        for pair in &params.compare {
            for (arm, readout) in [&pair.of, &pair.from] {
                let is_known = params.arms.iter().any(|known| known.name == *arm)
                    && params.readouts.contains(readout);
                let word = readout.word();
                let message = format!("there is no arm `{arm}` with the readout {word}");
                self.demand(is_known, "compare", message, "arms and readouts of this study");
            }
        }
    }

    /// What is wrong with `word` for who steers in `arm`.
    fn operator(&mut self, params: &Params, experiment: &Experiment, arm: &Arm, word: &str) {
        let expected = "simulated:SKILL[:TYPE], q_learning (mountain car) or none: nobody is there";
        let key = if arm.operator.is_some() { "arms" } else { "operators" };
        match word.parse::<Choice>() {
            Ok(choice @ (Choice::Simulated(..) | Choice::QLearning | Choice::None)) => {
                if let Err(stranger) = experiment.knows(&choice) {
                    self.demand(false, key, stranger.to_string(), expected);
                }
                let is_agent = choice == Choice::QLearning;
                let wants_one = params.readouts.contains(&Readout::Agent);
                let message = format!("{word} is no agent whose policy could be tested");
                let allowed = "agent only where q_learning steers alone";
                self.demand(is_agent || !wants_one, "readouts", message, allowed);
            }
            Ok(_) => self.demand(false, key, format!("{word} needs a person or a file"), expected),
            Err(unknown) => self.demand(false, key, unknown.to_string(), expected),
        }
    }
}

/// The first of `values` that was there before.
fn twice<T: PartialEq>(values: &[T]) -> Option<&T> {
    (1..values.len()).find(|at| values[..*at].contains(&values[*at])).map(|at| &values[at])
}

fn is_name(name: &str) -> bool {
    let is_plain = |b: u8| b.is_ascii_alphanumeric() || b"-_.=".contains(&b);
    (1..=64).contains(&name.len()) && name.bytes().all(is_plain)
}
