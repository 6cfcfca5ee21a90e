//! What a person is to do now, in one sentence and what belongs to it.

use super::Page;
use crate::backend::safety::warden::Standing;
use crate::backend::serial::calibration::Step;
use crate::backend::serial::standing::{Stage, Stopped};
use crate::backend::serial::station::{Calibrating, Duty, Grip};
use crate::tui::palette::Role;

/// What to do.
pub(super) struct Advice {
    /// The sentence that matters,
    pub first: String,
    /// how it looks,
    pub role: Role,
    /// and what belongs to it.
    pub more: Vec<String>,
    /// The keys that go on from here, and what they do.
    pub keys: Vec<(&'static str, &'static str)>,
    /// How much of what is on is done, 0 to 1.
    pub progress: Option<f64>,
}

impl Advice {
    fn new(role: Role, first: impl Into<String>) -> Self {
        Self { first: first.into(), role, more: Vec::new(), keys: Vec::new(), progress: None }
    }

    fn and(mut self, more: impl Into<String>) -> Self {
        self.more.push(more.into());
        self
    }

    fn key(mut self, key: &'static str, word: &'static str) -> Self {
        self.keys.push((key, word));
        self
    }

    /// Why the last wish was refused, where that is not what all of this is about.
    fn and_refusal(self, page: &Page<'_>) -> Self {
        let Some(why) = page.view.look.refused.map(|why| why.to_string()) else { return self };
        let is_said = |line: &String| line.to_lowercase().contains(&why.to_lowercase());
        if is_said(&self.first) || self.more.iter().any(is_said) {
            return self;
        }
        self.and(format!("Refused: {why}."))
    }
}

/// What to do on `page`: danger first, then what is under way, then the next step.
pub(super) fn of(page: &Page<'_>) -> Advice {
    let look = &page.view.look;
    let is_unsure = look.stopped == Stopped::Unconfirmed;
    match (&look.stage, look.standing, &look.duty) {
        _ if is_unsure => unconfirmed(page),
        (Stage::Closed(why), ..) => Advice::new(Role::Wait, "There is no device.")
            .and(sentence(why))
            .and("It is looked for all the time: once it is there, this page goes on."),
        (_, Standing::Latched(fault), _) => Advice::new(Role::Alarm, format!("STOPPED: {fault}."))
            .key("x", "clear it, once all is well")
            .key("m", "then arm the motor"),
        (Stage::Opening, ..) => Advice::new(Role::Strong, "The device is being greeted.")
            .and("If it does not answer within seconds: look at its power and its baud."),
        (Stage::Homing, ..) if look.is_stuck => {
            Advice::new(Role::Alarm, "HOMING DOES NOT END: switch the motor's supply off.")
                .and("Then look whether the cart is stuck. The motor pushes on until then.")
        }
        (Stage::Homing, ..) => {
            Advice::new(Role::Strong, "The device looks for the ends of its track.")
                .and("KEEP YOUR HANDS OFF: nothing can stop it but the motor's supply.")
                .and("Whoever quits now waits until it is done.")
        }
        _ if page.panel.asks_home() => Advice::new(
            Role::Strong,
            "Homing moves the cart over the whole track, and nothing can stop it.",
        )
        .and("Is the track clear, and are your hands off?")
        .key("y", "home it")
        .key("n", "leave it"),
        (_, _, Duty::Calibrate(calibrating)) => calibration(calibrating),
        (_, Standing::Disarmed, _) => disarmed(page),
        (_, Standing::Armed, _) => armed(page),
    }
}

/// The motor was told to stop, and nobody knows whether it did.
fn unconfirmed(page: &Page<'_>) -> Advice {
    let advice = Advice::new(Role::Alarm, "STOP NOT CONFIRMED: switch the motor's supply off.");
    let advice = match (&page.view.look.standing, &page.view.look.stage) {
        (Standing::Latched(fault), _) => {
            advice.and(sentence(&fault.to_string())).key("x", "clear it, once all is well")
        }
        (_, Stage::Closed(why)) => return advice.and(sentence(why)),
        _ => advice.and("The device was told to stop and does not say that it did."),
    };
    advice.and_refusal(page)
}

/// The prompt of a calibration, how far it is, and the keys that go on.
fn calibration(calibrating: &Calibrating) -> Advice {
    let mut lines = calibrating.prompt.lines();
    let first = lines.next().unwrap_or_default();
    let failed = calibrating.step == Step::Failed;
    let advice = if failed {
        Advice::new(Role::Wait, "The calibration has no result.").and(sentence(first))
    } else {
        Advice::new(Role::Strong, first)
    };
    let advice = lines.fold(advice, Advice::and);
    match calibrating.step {
        step if step.asks() => {
            advice.key("y", "yes").key("n", "no").key("x", "end the calibration")
        }
        Step::Failed => advice.key("c", "begin again").key("x", "leave it"),
        Step::Homing | Step::Done => advice,
        Step::Steady => Advice { progress: Some(calibrating.progress), ..advice }
            .key("m", "arm the motor")
            .key("x", "end the calibration"),
        _ => Advice { progress: Some(calibrating.progress), ..advice },
    }
}

/// The next step towards a motor that may move.
fn disarmed(page: &Page<'_>) -> Advice {
    let look = &page.view.look;
    let advice = match &look.calibrated {
        Err(why) => Advice::new(Role::Strong, sentence(&why.to_string()))
            .and("That takes about a minute, and asks before anything moves.")
            .key("c", "calibrate"),
        Ok(_) if page.facts.homing && !look.is_homed => {
            Advice::new(Role::Strong, "The device does not know the ends of its track.")
                .key("f", "home it; it asks before anything moves")
        }
        Ok(_) => {
            let advice =
                Advice::new(Role::Strong, "All is ready to arm the motor.").key("m", "arm it");
            match &page.facts.switch {
                Some(switch) => {
                    advice.and(format!("Armed, it moves only with a hand on the switch: {switch}."))
                }
                None => advice.and("Armed, it may move at any time: keep clear."),
            }
        }
    };
    let advice = advice.and_refusal(page);
    match &page.view.not_kept {
        Some(why) => advice.and(sentence(why)),
        None => advice,
    }
}

/// A motor that may move.
fn armed(page: &Page<'_>) -> Advice {
    let look = &page.view.look;
    let switch = page.facts.switch.as_deref().filter(|_| look.grip == Grip::Off);
    let advice = match (switch, &look.duty) {
        _ if look.grip == Grip::LeftOn => {
            Advice::new(Role::Strong, "Let go of the switch: it counts from then on.")
        }
        (Some(switch), _) => {
            let hold = capital(switch);
            Advice::new(Role::Strong, format!("{hold}: without it the motor stays off."))
        }
        (None, Duty::Return { trouble: Some(trouble), .. }) => {
            Advice::new(Role::Wait, sentence(&trouble.to_string()))
        }
        (None, Duty::Return { is_there: false, .. }) => {
            Advice::new(Role::Strong, "The cart goes back to the middle: keep clear.")
        }
        (None, _) if page.is_running => {
            Advice::new(Role::Go, "The session runs.").key("o", "show the scene")
        }
        (None, _) => Advice::new(Role::Go, "All is ready: the session goes on in the scene.")
            .key("o", "show the scene"),
    };
    match &page.facts.switch {
        Some(_) if look.grip == Grip::On => {
            advice.and("To let go stops the motor, and so does space.")
        }
        _ => advice.and("Space is the emergency stop; m disarms."),
    }
}

/// `words` with a capital letter and a full stop.
fn sentence(words: &str) -> String {
    let stop = if words.ends_with(['.', '?', '!']) { "" } else { "." };
    format!("{}{stop}", capital(words))
}

/// `words` with a capital letter.
fn capital(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
