//! What the columns of the tables are: kind, unit and meaning.

/// What a column's cells hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A word or text.
    Text,
    /// A number without fraction, from 0.
    Whole,
    /// Any number.
    Number,
}

impl Kind {
    /// The word in `columns.csv`.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Whole => "integer",
            Self::Number => "number",
        }
    }
}

/// A column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name, as in the session's files.
    pub name: String,
    /// What its cells hold.
    pub kind: Kind,
    /// Their unit: `1` for numbers without one, nothing for words.
    pub unit: &'static str,
    /// What they mean.
    pub meaning: &'static str,
}

/// The column `name` of a table of `task`.
pub fn column(task: &str, name: &str) -> Column {
    let (kind, unit, meaning) = of_any_task(name)
        .or_else(|| of_state(task, name))
        .or_else(|| of_task(task, name))
        .unwrap_or((Kind::Number, "", "what a newer task counts"));
    Column { name: name.to_owned(), kind, unit, meaning }
}

type About = (Kind, &'static str, &'static str);

fn of_any_task(name: &str) -> Option<About> {
    use Kind::{Number, Text, Whole};
    Some(match name {
        "subject" => (Text, "", "who took part"),
        "trial" => (Whole, "1", "the subject's trial, from 1"),
        "task" => (Text, "", "the task"),
        "preset" => (Text, "", "the preset, such as thesis or modern"),
        "mode" => (Text, "", "simultaneous: the robot takes over; sequential: it only watches"),
        "phase" => {
            (Text, "", "introduction, main, autonomous (robot alone), zero_control (nobody)")
        }
        "episode" => (Whole, "1", "the rollout within the phase, from 1"),
        "attempt" => (Whole, "1", "how often this rollout was discarded before"),
        "step" => (Whole, "1", "the control step within the rollout, from 0"),
        "t" => (Number, "s", "time since the rollout began"),
        "share" => (Number, "1", "the person's share w of the controls"),
        "success" => (Number, "1", "success over the moving window"),
        "region" => (Text, "", "the region of the state, all where there is one"),
        "lateness_us" => (Whole, "us", "how late the tick began; 0 on virtual time"),
        "raw" => (Number, "1", "the device's deflection, -1 to 1, before it was shaped"),
        "steps" => (Whole, "1", "controlled steps"),
        "duration_s" => (Number, "s", "controlled time"),
        "end" => (
            Text,
            "",
            "how the rollout ended: failed, cap, goal, time, aborted, discarded; empty: cut off",
        ),
        "receptive_fields" => (Whole, "1", "the learner's fields at the rollout's end"),
        "time" => (Text, "", "date and time; empty on virtual time"),
        "event" => (Text, "", "what happened, a word"),
        "cause" => (Text, "", "why"),
        "policy" => (Text, "", "the policy's file, such as policy-010: after 10 % of main"),
        _ => return None,
    })
}

fn of_state(task: &str, name: &str) -> Option<About> {
    let is_car = task == "mountain-car";
    let is_beam = task == "speed-up";
    let (unit, meaning) = match name {
        "x" if is_car => ("1", "position of the car, in the problem's own unit"),
        "v" if is_car => ("1", "velocity of the car, per step"),
        "x" if is_beam => ("m", "position of the ball on the beam"),
        "x_dot" if is_beam => ("m/s", "velocity of the ball"),
        "theta" if is_beam => ("rad", "angle of the servo"),
        "theta_dot" if is_beam => ("rad/s", "angular velocity of the servo"),
        "x" => ("m", "position of the cart"),
        "x_dot" => ("m/s", "velocity of the cart"),
        "theta" => ("rad", "angle of the pole, 0 upright"),
        "theta_dot" => ("rad/s", "angular velocity of the pole"),
        _ => return None,
    };
    Some((Kind::Number, unit, meaning))
}

fn of_task(task: &str, name: &str) -> Option<About> {
    let (action, start, reward) = match task {
        "balance" => ("N", ("rad", "angle of the pole at the start"), "1"),
        "swing-up" => ("N", ("rad/s", "angular velocity of the pole at the start"), "1"),
        "speed-up" => ("V", ("m/s", "velocity of the ball at the start"), "m/s"),
        "mountain-car" => ("1", ("1", "position of the car at the start"), "1"),
        _ => ("", ("", "the start state's telling number"), ""),
    };
    let (unit, meaning) = match name {
        "u_human" => (action, "the person's action"),
        "u_machine" => (action, "the robot's action"),
        "u" => (action, "the mixed action w u_human + (1 - w) u_machine"),
        "u_applied" => (action, "the action that the plant received, within its limits"),
        "reward" => (reward, "the reward of the step"),
        "return" => (reward, "the sum of rewards"),
        "mean_reward" => (reward, "the mean of rewards"),
        "start" => start,
        "mean_height" => ("1", "mean pseudo-height of the pole, -1 hanging, 1 upright"),
        "top_share" => ("1", "part of the time at the top"),
        "longest_hold_s" => ("s", "the longest hold at the top"),
        "mean_speed" => ("m/s", "mean speed of the ball"),
        "end_hits" => ("1", "hits of the beam's ends"),
        _ => return None,
    };
    Some((Kind::Number, unit, meaning))
}
