//! What the fields change, and what is wrong with it.

use std::path::PathBuf;

use serde::Serialize;
use tui_input::Input;

use super::{Field, Setup, without_sets};
use crate::operator::simulated::{Kind, Skill};
use crate::operator::{Choice, Device};
use crate::profile::{Document, Experiment, Fault, Order, Profile, WantedMode};
use crate::session::Subject;
use crate::session::plan::Wanted;
use crate::tui::sensitivity;

/// The key of the pole's length.
pub(super) const POLE_LENGTH: &str = "plant.pole_length_m";
const PHASES: &str = "session.phases";
const PRACTICE_ROLLOUTS: &str = "session.introduction_rollouts";
const PRACTICE_DURATION: &str = "session.introduction_duration_s";
const MAIN_ROLLOUTS: &str = "session.main_rollouts";
const MAIN_DURATION: &str = "session.main_duration_s";

/// The policy that an autonomous run uses unless another is named.
pub(super) const LAST_POLICY: &str = "last";

/// The texts as they are typed, whether they fit or not.
#[derive(Clone, Debug)]
pub(super) struct Drafts {
    introduction: Input,
    main: Input,
    autonomous: Input,
    subject: Input,
    trial: Input,
    script: Input,
    pole: Input,
    /// Also while it is not needed.
    policy: Input,
    seed: Input,
    /// Whether the focused text was not touched yet, so that typing replaces it.
    pub fresh: bool,
    /// The wanted phases, also where they are none.
    pub phases: [bool; 3],
    /// The model of a person, also while another operator steers.
    model: (Skill, Kind),
}

impl Drafts {
    pub fn new(order: &Order, profile: &Profile) -> Self {
        let number = |number: Option<u64>| number.map(|n| n.to_string()).unwrap_or_default();
        let choice = order.operator.parse().unwrap_or_default();
        let mut drafts = Self {
            introduction: Input::default(),
            main: Input::default(),
            autonomous: Input::default(),
            script: Input::default(),
            pole: Input::default(),
            phases: [true; 3],
            subject: Input::new(order.subject.to_string()),
            trial: Input::new(number(order.trial.map(u64::from))),
            seed: Input::new(number(order.seed)),
            policy: Input::new(order.policy.clone().unwrap_or_else(|| LAST_POLICY.to_owned())),
            model: (Skill::Average, Kind::default()),
            fresh: true,
        };
        match choice {
            Choice::Simulated(skill, kind) => drafts.model = (skill, kind),
            Choice::Script(file) => drafts.script = Input::new(file.display().to_string()),
            Choice::Keyboard
            | Choice::Gamepad(_)
            | Choice::Mouse
            | Choice::QLearning
            | Choice::None => {}
        }
        drafts.show_profile(profile);
        drafts
    }

    /// Shows what `profile` says.
    pub fn show_profile(&mut self, profile: &Profile) {
        let session = &profile.session;
        self.introduction =
            Input::new(extent(session.introduction_rollouts, session.introduction_duration_s));
        self.autonomous = Input::new(session.autonomous_rollouts.to_string());
        self.main = Input::new(extent(session.main_rollouts, session.main_duration_s));
        self.phases = Wanted::ALL.map(|phase| session.phases.contains(&phase));
        self.pole = Input::new(pole_length(profile).map_or(String::new(), length_words));
    }

    /// Shows the changes `sets` as they were typed, also those that do not fit.
    pub fn show_sets(&mut self, sets: &[(String, String)]) {
        for (key, value) in sets.iter().filter(|(_, value)| value != "None") {
            let value = value.clone();
            match key.as_str() {
                PRACTICE_ROLLOUTS => self.introduction = Input::new(value),
                "session.autonomous_rollouts" => self.autonomous = Input::new(value),
                MAIN_ROLLOUTS => self.main = Input::new(value),
                POLE_LENGTH => self.pole = Input::new(value),
                _ => {}
            }
        }
    }

    /// The text of `field`.
    pub const fn text(&self, field: Field) -> Option<&Input> {
        match field {
            Field::Introduction => Some(&self.introduction),
            Field::Main => Some(&self.main),
            Field::Autonomous => Some(&self.autonomous),
            Field::Subject => Some(&self.subject),
            Field::Trial => Some(&self.trial),
            Field::Script => Some(&self.script),
            Field::Pole => Some(&self.pole),
            Field::Policy => Some(&self.policy),
            Field::Seed => Some(&self.seed),
            _ => None,
        }
    }

    /// The text of `field`, to type into.
    pub const fn text_mut(&mut self, field: Field) -> Option<&mut Input> {
        match field {
            Field::Introduction => Some(&mut self.introduction),
            Field::Main => Some(&mut self.main),
            Field::Autonomous => Some(&mut self.autonomous),
            Field::Subject => Some(&mut self.subject),
            Field::Trial => Some(&mut self.trial),
            Field::Script => Some(&mut self.script),
            Field::Pole => Some(&mut self.pole),
            Field::Policy => Some(&mut self.policy),
            Field::Seed => Some(&mut self.seed),
            _ => None,
        }
    }

    /// The text of `field`, or nothing.
    pub fn value(&self, field: Field) -> &str {
        self.text(field).map_or("", Input::value)
    }
}

impl Setup {
    /// Who steers; the keyboard while the words choose nobody.
    #[must_use]
    pub fn operator(&self) -> Choice {
        match self.order.operator.strip_prefix("script:") {
            Some(file) => Choice::Script(PathBuf::from(file)),
            None => self.order.operator.parse().unwrap_or_default(),
        }
    }

    /// Whether the robot is alone from the start, with a policy from elsewhere.
    pub(super) fn is_autonomous_alone(&self) -> bool {
        self.drafts.phases == [false, false, true]
    }

    /// Brings what `field`'s text says into the order.
    pub(super) fn take_text(&mut self, field: Field) {
        let text = self.drafts.value(field).to_owned();
        match field {
            Field::Introduction => {
                let is_timed = self.base.session.introduction_rollouts.is_none();
                self.change_extent(&text, [PRACTICE_ROLLOUTS, PRACTICE_DURATION], is_timed);
            }
            Field::Main => {
                let is_timed = self.base.session.main_rollouts.is_none();
                self.change_extent(&text, [MAIN_ROLLOUTS, MAIN_DURATION], is_timed);
            }
            Field::Autonomous => self.change("session.autonomous_rollouts", &text),
            Field::Pole => self.change(POLE_LENGTH, &text),
            Field::Subject => {
                if let Ok(subject) = text.parse() {
                    self.order.subject = subject;
                }
            }
            Field::Trial => self.order.trial = text.parse().ok(),
            Field::Seed => self.order.seed = text.parse().ok(),
            Field::Script => self.order.operator = format!("script:{text}"),
            Field::Policy => self.order_policy(),
            _ => {}
        }
    }

    /// A phase ends after a number of rollouts, or, written with an `s`, after a time. Whether
    /// it `is_timed` before any change.
    fn change_extent(&mut self, text: &str, [rollouts, duration]: [&str; 2], is_timed: bool) {
        if let Some(seconds) = text.trim().strip_suffix('s') {
            self.change(duration, seconds.trim());
            self.change(rollouts, "None");
        } else {
            self.change(rollouts, text);
            if is_timed {
                self.change(duration, "None");
            } else {
                self.restore(duration);
            }
        }
    }

    /// Changes `key` of the profile; a value that the profile has anyway is no change.
    fn change(&mut self, key: &str, value: &str) {
        let mut alone = without_sets(&self.document);
        alone.set(key, value);
        if alone.read().is_ok_and(|profile| profile == self.base) {
            self.restore(key);
        } else {
            self.document.set(key, value);
            self.order.change(key, value);
            self.read_again();
        }
    }

    fn restore(&mut self, key: &str) {
        self.document.unset(key);
        self.order.restore(key);
        self.read_again();
    }

    /// Reads the profile after a change.
    pub(super) fn read_again(&mut self) {
        let mut document = self.document.clone();
        self.reading = document.read().map(drop);
        // What fits is shown also beside what does not: each round takes faults away.
        for _ in 0..=document.sets().len() {
            match document.read() {
                Ok(profile) => {
                    self.profile = profile;
                    return;
                }
                Err(report) => report.faults().iter().for_each(|f| document.unset(&f.key)),
            }
        }
        self.profile = self.base.clone();
    }

    /// Goes on to the next choice of the focused field, or to the one before.
    pub(super) fn change_choice(&mut self, forward: bool) {
        match self.focus {
            Field::Mode => {
                let mode = next(&MODES, &self.profile.mode, forward);
                self.change("mode", &word(&mode));
            }
            Field::Learner => {
                let kind = word(&self.profile.learner.kind);
                self.change("learner.kind", next(&LEARNERS, &kind.as_str(), forward));
            }
            Field::Operator => {
                let words = next(&self.operators(), &self.operator_word(), forward);
                self.choose_operator(words);
            }
            Field::Skill => {
                self.drafts.model.0 = next(&Skill::ALL, &self.drafts.model.0, forward);
                self.choose_operator("simulated");
            }
            Field::Kind => {
                self.drafts.model.1 = next(&Kind::ALL, &self.drafts.model.1, forward);
                self.choose_operator("simulated");
            }
            Field::Sensitivity => self.change_sensitivity(forward),
            Field::Progress => {
                let shown = !self.profile.screen.show_progress;
                self.change("screen.show_progress", &shown.to_string());
            }
            Field::SubjectView => {
                let only = !self.profile.screen.subject_view;
                self.change("screen.subject_view", &only.to_string());
            }
            field => self.change_number(field, forward),
        }
    }

    /// The operator's first word.
    pub(super) fn operator_word(&self) -> &'static str {
        match self.operator() {
            Choice::Simulated(..) => "simulated",
            Choice::Script(_) => "script",
            Choice::QLearning => Q_LEARNING,
            Choice::None => "none",
            hand => hand.device().unwrap_or(Device::Keyboard).word(),
        }
    }

    /// The operators that know the task.
    fn operators(&self) -> Vec<&'static str> {
        let experiment = &self.profile.experiment;
        let has_agent = experiment.knows(&Choice::QLearning).is_ok();
        OPERATORS.into_iter().filter(|word| has_agent || *word != Q_LEARNING).collect()
    }

    /// The device whose sensitivity is shown: the person's, or the keyboard in reserve.
    pub(super) fn device(&self) -> Device {
        self.operator().device().unwrap_or(Device::Keyboard)
    }

    /// The sensitivity of that device.
    pub(super) fn sensitivity(&self) -> f64 {
        self.profile.operator.shape(self.device()).sensitivity
    }

    fn choose_operator(&mut self, word: &str) {
        let (skill, kind) = self.drafts.model;
        self.order.operator = match word {
            "simulated" => Choice::Simulated(skill, kind).to_string(),
            "script" => format!("script:{}", self.drafts.value(Field::Script)),
            word => word.to_owned(),
        };
    }

    fn change_sensitivity(&mut self, forward: bool) {
        let value = sensitivity::stepped(self.sensitivity(), forward);
        self.change(&sensitivity_key(self.device()), &format!("{value:?}"));
    }

    /// More or less of a number, in steps that a person would take.
    fn change_number(&mut self, field: Field, forward: bool) {
        let text = self.drafts.value(field);
        let (digits, unit) = text.strip_suffix('s').map_or((text, ""), |digits| (digits, "s"));
        let (step, least, most) = match (field, unit) {
            (Field::Pole, _) => (0.05, 0.05, 10.0),
            (Field::Main, "s") => (10.0, 10.0, 86_400.0),
            (Field::Trial, _) => (1.0, 1.0, 9999.0),
            (field, _) if field.phase().is_some() => (10.0, 10.0, 1e6),
            _ => return,
        };
        let Ok(value) = digits.trim().parse::<f64>() else { return };
        // The next multiple of the step, so that odd numbers become round.
        let count = value / step;
        let next = if forward { (count + 1e-9).floor() + 1.0 } else { (count - 1e-9).ceil() - 1.0 };
        let value = (next * step).clamp(least, most);
        let text = if field == Field::Pole { length_words(value) } else { format!("{value:.0}") };
        if let Some(draft) = self.drafts.text_mut(field) {
            *draft = Input::new(text + unit);
        }
        self.take_text(field);
    }

    /// Wants a phase, or no longer.
    pub(super) fn toggle(&mut self, phase: Wanted) {
        for (wanted, which) in self.drafts.phases.iter_mut().zip(Wanted::ALL) {
            *wanted ^= which == phase;
        }
        let wanted = Wanted::ALL.into_iter().zip(self.drafts.phases);
        let words: Vec<&str> = wanted.filter(|(_, on)| *on).map(|(p, _)| p.word()).collect();
        self.change(PHASES, &format!("[{}]", words.join(", ")));
        self.order_policy();
    }

    /// A policy is asked for where nothing is learned before.
    pub(super) fn order_policy(&mut self) {
        let policy = self.drafts.value(Field::Policy).trim().to_owned();
        self.order.policy = self.is_autonomous_alone().then_some(policy);
    }

    /// The first thing that is wrong, and the field to right it.
    pub(super) fn fault(&self) -> Option<(Field, String)> {
        let value = |field| self.drafts.value(field);
        if let Err(bad) = value(Field::Subject).parse::<Subject>() {
            return Some((Field::Subject, bad.to_string()));
        }
        let trial = value(Field::Trial);
        if !trial.is_empty() && !trial.parse::<u32>().is_ok_and(|trial| trial > 0) {
            let message = format!(
                "trial {trial:?} is no number from 1 on; leave it empty for the next free one"
            );
            return Some((Field::Trial, message));
        }
        match self.order.operator.parse::<Choice>() {
            Ok(choice) => {
                if let Err(stranger) = self.profile.experiment.knows(&choice) {
                    return Some((Field::Operator, stranger.to_string()));
                }
            }
            Err(unknown) => return Some((Field::Script, unknown.to_string())),
        }
        if let Err(report) = &self.reading {
            let first = report.faults().first()?;
            let field = Field::of_key(&first.key).unwrap_or(Field::Profile);
            return Some((field, words(first)));
        }
        if self.order.policy.as_ref().is_some_and(String::is_empty) {
            let message = "an autonomous run needs a policy: `last`, or a policy's file";
            return Some((Field::Policy, message.to_owned()));
        }
        let seed = value(Field::Seed);
        if !seed.is_empty() && seed.parse::<u64>().is_err() {
            let message = format!(
                "seed {seed:?} is no whole number of at most 20 digits; leave it empty to draw one"
            );
            return Some((Field::Seed, message));
        }
        None
    }
}

/// A fault in one line.
pub(super) fn words(fault: &Fault) -> String {
    format!("{}; {}", fault.message, fault.expected)
}

/// The allowed values of a number `key`, as its check says when it refuses one.
pub(super) fn allowed(document: &Document, key: &str) -> String {
    let mut refused = document.clone();
    refused.set(key, "-1e9");
    let report = refused.read().err();
    let fault = report.as_ref().and_then(|r| r.faults().iter().find(|fault| fault.key == key));
    let words = fault.and_then(|fault| fault.expected.strip_prefix("allowed: "));
    words.unwrap_or_default().to_owned()
}

/// What ends a phase, as it is typed.
fn extent(rollouts: Option<u32>, duration_s: Option<f64>) -> String {
    match (rollouts, duration_s) {
        (Some(rollouts), _) => rollouts.to_string(),
        (None, Some(duration)) => format!("{duration}s"),
        (None, None) => String::new(),
    }
}

/// The pole's length, m, where the plant has one.
pub(super) fn pole_length(profile: &Profile) -> Option<f64> {
    match &profile.experiment {
        Experiment::Balance { plant, .. } | Experiment::SwingUp { plant, .. } => {
            Some(plant.pole_length_m)
        }
        _ => None,
    }
}

/// The profile's key of the sensitivity of `device`.
pub(super) fn sensitivity_key(device: Device) -> String {
    format!("operator.{}.shape.sensitivity", device.word())
}

fn length_words(length_m: f64) -> String {
    format!("{:?}", (length_m * 1e6).round() / 1e6)
}

const MODES: [WantedMode; 3] =
    [WantedMode::Simultaneous, WantedMode::Sequential, WantedMode::Assigned];
/// The words of the learners, as profiles spell them.
const LEARNERS: [&str; 2] = ["rfwr", "lwpr"];
const OPERATORS: [&str; 7] =
    ["keyboard", "gamepad", "mouse", "simulated", Q_LEARNING, "script", "none"];
const Q_LEARNING: &str = "q_learning";

/// The one of `all` after `current`, or before it, all around.
pub(super) fn next<T: Clone + PartialEq>(all: &[T], current: &T, forward: bool) -> T {
    let here = all.iter().position(|one| one == current);
    let by = if forward { 1 } else { all.len().saturating_sub(1) };
    let next = here.and_then(|here| all.get((here + by) % all.len())).or(all.first());
    next.unwrap_or(current).clone()
}

/// The word that stands for `value` in a profile.
pub(super) fn word(value: &impl Serialize) -> String {
    // The choices are plain enums, which always have a word.
    ron::to_string(value).unwrap_or_default()
}
