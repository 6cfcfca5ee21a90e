//! What a person chose for one session, and the command line that says the same.

use std::path::PathBuf;

use crate::session::Subject;

/// The choices for one session outside of the profile's text, and the changes to it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Order {
    /// The profile's name or path.
    pub profile: String,
    /// Who.
    pub subject: Subject,
    /// The number; the next free one when not given.
    pub trial: Option<u32>,
    /// Who or what steers, as on the command line.
    pub operator: String,
    /// The policy that an autonomous run uses: a file, or `last`.
    pub policy: Option<String>,
    /// The seed; drawn when not given.
    pub seed: Option<u64>,
    /// What is steered, as on the command line.
    pub backend: String,
    /// The folder of all sessions.
    pub logs: PathBuf,
    /// The changes to the profile: dotted path and value.
    pub sets: Vec<(String, String)>,
}

impl Default for Order {
    fn default() -> Self {
        Self {
            profile: "balance".to_owned(),
            subject: Subject::default(),
            trial: None,
            operator: "keyboard".to_owned(),
            policy: None,
            seed: None,
            backend: "simulated".to_owned(),
            logs: PathBuf::from("logs"),
            sets: Vec::new(),
        }
    }
}

impl Order {
    /// Changes `key` of the profile to `value`, in place of an earlier change.
    pub fn change(&mut self, key: &str, value: &str) {
        match self.sets.iter_mut().find(|(changed, _)| changed == key) {
            Some((_, old)) => value.clone_into(old),
            None => self.sets.push((key.to_owned(), value.to_owned())),
        }
    }

    /// Takes back the change of `key`.
    pub fn restore(&mut self, key: &str) {
        self.sets.retain(|(changed, _)| changed != key);
    }

    /// The words that start the same session from a shell, defaults left out.
    #[must_use]
    pub fn command_line(&self) -> String {
        let usual = Self::default();
        let mut words = vec!["coadapt".to_owned(), "run".to_owned(), self.profile.clone()];
        let mut option = |name: &str, value: Option<String>| {
            words.extend(value.into_iter().flat_map(|value| [format!("--{name}"), value]));
        };
        let unusual = |value: &str, usual: &str| (value != usual).then(|| value.to_owned());
        option("subject", unusual(self.subject.as_str(), usual.subject.as_str()));
        option("trial", self.trial.map(|trial| trial.to_string()));
        for (key, value) in &self.sets {
            match short_form(key, value) {
                Some((name, value)) => option(name, Some(value)),
                None => option("set", Some(format!("{key}={value}"))),
            }
        }
        option("operator", unusual(&self.operator, &usual.operator));
        option("backend", unusual(&self.backend, &usual.backend));
        option("policy", self.policy.clone());
        option("seed", self.seed.map(|seed| seed.to_string()));
        let logs = self.logs.to_string_lossy();
        option("logs", unusual(&logs, &usual.logs.to_string_lossy()));
        words.iter().map(|word| shell_word(word)).collect::<Vec<_>>().join(" ")
    }
}

/// The option of its own that `key=value` has, if it has one.
fn short_form(key: &str, value: &str) -> Option<(&'static str, String)> {
    let is_word =
        |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_lowercase() || b == b'_');
    let value = value.trim();
    match key {
        "mode" if is_word(value) => Some(("mode", value.to_owned())),
        "learner.kind" if is_word(value) => Some(("learner", value.to_owned())),
        "session.main_rollouts" if value.parse::<u32>().is_ok() => {
            Some(("rollouts", value.to_owned()))
        }
        "session.main_duration_s" if value.parse::<f64>().is_ok() => {
            Some(("duration", value.to_owned()))
        }
        "session.phases" => {
            let list = value.strip_prefix('[')?.strip_suffix(']')?.trim_end_matches([',', ' ']);
            let phases: Vec<&str> = list.split(',').map(str::trim).collect();
            phases.iter().all(|phase| is_word(phase)).then(|| ("phases", phases.join(",")))
        }
        _ => None,
    }
}

/// `word` as a shell reads it.
#[must_use]
pub fn shell_word(word: &str) -> String {
    let is_plain = |b: u8| b.is_ascii_alphanumeric() || b"-_./:=,+@%".contains(&b);
    if !word.is_empty() && word.bytes().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_without_choices_is_the_shortest_command() {
        assert_eq!(Order::default().command_line(), "coadapt run balance");
    }

    #[test]
    fn every_choice_is_said_by_its_shortest_option() {
        let mut order = Order {
            profile: "my profiles/it's.ron".to_owned(),
            subject: "S07".parse().unwrap(),
            trial: Some(3),
            operator: "simulated:average".to_owned(),
            policy: Some("last".to_owned()),
            seed: Some(1),
            backend: "serial:/dev/ttyACM0".to_owned(),
            logs: PathBuf::from("/data/logs"),
            sets: Vec::new(),
        };
        order.change("mode", "simultaneous");
        order.change("session.phases", "[introduction, main]");
        order.change("session.main_rollouts", "30");
        order.change("session.main_duration_s", "60.0");
        order.change("learner.kind", "lwpr");
        order.change("plant.pole_length_m", "0.6");
        order.change("session.instructions.autonomous", "Let go & watch");
        order.change("mode", "sequential");
        assert_eq!(
            order.command_line(),
            r"coadapt run 'my profiles/it'\''s.ron' --subject S07 --trial 3 --mode sequential \
              --phases introduction,main --rollouts 30 --duration 60.0 --learner lwpr \
              --set plant.pole_length_m=0.6 \
              --set 'session.instructions.autonomous=Let go & watch' \
              --operator simulated:average --backend serial:/dev/ttyACM0 --policy last --seed 1 \
              --logs /data/logs"
                .replace("\\\n              ", "")
        );
    }

    #[test]
    fn what_the_short_options_cannot_say_is_set() {
        let mut order = Order::default();
        order.change("session.main_rollouts", "None");
        order.change("session.phases", "main");
        order.change("mode", "x");
        order.restore("mode");
        assert_eq!(
            order.command_line(),
            "coadapt run balance --set session.main_rollouts=None --set session.phases=main"
        );
    }
}
