//! Settings: those of a study's file, each with every value that a person sweeps over.

use super::StudyError;
use super::params::{Params, Sets, Setting};

/// The most settings: planning reads the profile of each.
const MOST_SETTINGS: usize = 10_000;
/// The most letters in the name of a setting.
const LONGEST_NAME: usize = 400;

/// The settings of `params`, or the one without changes, each with each of the values that `sets`
/// sweep over. Their names say what they change, so a value that another change would replace is
/// refused.
///
/// # Errors
/// When a change would not hold, one is made twice, or there are too many.
pub(super) fn sweep(
    params: &Params,
    sets: &[(String, String)],
) -> Result<Vec<Setting>, StudyError> {
    if let Some(problem) = clash(params, sets) {
        return Err(StudyError::Sets { problem });
    }
    let plain = Setting { name: "profile".to_owned(), sets: Sets::default() };
    let is_plain = params.settings.is_empty();
    let mut swept = if is_plain { vec![plain] } else { params.settings.clone() };
    // Counted before they are made: a slip of the hand is soon a million.
    let many = sets.iter().try_fold(swept.len(), |many, (_, words)| {
        many.checked_mul(values(words).len()).filter(|many| *many <= MOST_SETTINGS)
    });
    if many.is_none_or(|many| many > MOST_SETTINGS) {
        let problem = format!("there are more than {MOST_SETTINGS} settings");
        return Err(StudyError::TooMany { problem });
    }
    for (key, words) in sets {
        let values = values(words);
        swept = swept
            .iter()
            .flat_map(|setting| values.iter().map(|value| with(setting, key, value, values.len())))
            .collect();
    }
    match swept.iter().find(|setting| !is_fit(&setting.name)) {
        Some(Setting { name, .. }) => Err(StudyError::Sets {
            problem: format!(
                "`{name}` cannot name a setting: use at most {LONGEST_NAME} letters, and none that \
                 cannot be printed"
            ),
        }),
        None => Ok(swept),
    }
}

/// `setting` with one of so `many` values of `key`, which its name tells where there are several.
fn with(setting: &Setting, key: &str, value: &str, many: usize) -> Setting {
    let mut with = setting.clone();
    with.sets.0.insert(key.to_owned(), value.to_owned());
    if many > 1 {
        let is_plain = setting.sets.0.is_empty() && setting.name == "profile";
        let before = if is_plain { String::new() } else { with.name + " " };
        with.name = format!("{before}{key}={value}");
    }
    with
}

/// Which of `sets` would not hold in every run.
fn clash(params: &Params, sets: &[(String, String)]) -> Option<String> {
    for (index, (key, words)) in sets.iter().enumerate() {
        if sets[..index].iter().any(|(other, _)| other == key) {
            return Some(format!(
                "--set {key} is given twice: put commas between its values, as in --set \
                 {key}=A,B"
            ));
        }
        if key == "mode" {
            return Some(
                "--set mode changes nothing: each arm of a study has its own mode; change the \
                 arms in its file"
                    .to_owned(),
            );
        }
        let has = |sets: &Sets| sets.0.contains_key(key);
        let arm = params.arms.iter().find(|arm| has(&arm.sets)).map(|arm| ("arm", &arm.name));
        let setting = params.settings.iter().find(|setting| has(&setting.sets));
        if let Some((what, name)) = arm.or(setting.map(|setting| ("setting", &setting.name))) {
            return Some(format!(
                "--set {key} would not hold everywhere: the {what} `{name}` of the study sets it \
                 too; take it out of one of them"
            ));
        }
        let values = values(words);
        let twice = (1..values.len()).find(|at| values[..*at].contains(&values[*at]));
        if let Some(at) = twice {
            return Some(format!("--set {key} has the value {} twice", values[at]));
        }
    }
    None
}

fn is_fit(name: &str) -> bool {
    (1..=LONGEST_NAME).contains(&name.chars().count()) && !name.chars().any(char::is_control)
}

/// The values between the commas that stand in no bracket and no quotes.
fn values(words: &str) -> Vec<&str> {
    let (mut depth, mut quoted, mut from) = (0_i32, false, 0);
    let mut values = Vec::new();
    for (at, c) in words.char_indices() {
        match c {
            '"' => quoted = !quoted,
            _ if quoted => {}
            '[' | '(' | '{' => depth += 1,
            ']' | ')' | '}' => depth -= 1,
            ',' if depth == 0 => {
                values.push(words[from..at].trim());
                from = at + 1;
            }
            _ => {}
        }
    }
    values.push(words[from..].trim());
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_in_brackets_and_quotes_part_nothing() {
        assert_eq!(values("1, 2"), ["1", "2"]);
        assert_eq!(values("[a, b],(c, d), \"e, f\""), ["[a, b]", "(c, d)", "\"e, f\""]);
        assert_eq!(values(""), [""]);
    }
}
