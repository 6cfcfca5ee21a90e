//! The names of a session's files and of their columns: contracts with whoever reads them.

pub(super) const SESSION: &str = "session.json";
pub(super) const STEPS: &str = "steps.csv";
pub(super) const EPISODES: &str = "episodes.csv";
pub(super) const EVENTS: &str = "events.csv";
pub(super) const CHECKPOINT: &str = "checkpoint.json";
pub(super) const EVALUATION: &str = "evaluation.csv";

/// The word for checkpoints in their files.
pub(super) const CHECKPOINT_KIND: &str = "checkpoint";

/// The columns of `episodes.csv`, before those of what the task counted.
pub(super) const EPISODE_COLUMNS: [&str; 11] = [
    "phase",
    "episode",
    "start",
    "steps",
    "duration_s",
    "end",
    "return",
    "mean_reward",
    "share",
    "success",
    "receptive_fields",
];

/// The columns of `evaluation.csv`, before those of what the task counted.
pub(super) const EVALUATION_COLUMNS: [&str; 8] =
    ["policy", "episode", "start", "steps", "duration_s", "end", "return", "mean_reward"];

/// The columns of `events.csv`.
pub(super) const EVENT_COLUMNS: [&str; 6] = ["time", "phase", "episode", "step", "event", "cause"];

/// The columns at the end of `steps.csv` that came later: sessions of before lack them.
pub(super) const LATER_STEP_COLUMNS: [&str; 1] = ["raw"];

/// The columns of `steps.csv` before and after the state's.
pub(super) const STEP_COLUMNS: ([&str; 4], [&str; 9]) = (
    ["phase", "episode", "step", "t"],
    [
        "u_human",
        "u_machine",
        "share",
        "u",
        "u_applied",
        "reward",
        "success",
        "region",
        "lateness_us",
    ],
);
