//! The tables of a group: its subjects, the regions of swing-up (table 1), and what swing-up came
//! to (table 2).

use super::tenths::tenths;
use super::{Group, average, last_average};
use crate::report::achieved::yardstick;
use crate::report::figure::{Caption, Table};
use crate::report::gather::Recorded;
use crate::report::metrics::{deviation, mean};
use crate::report::series::WINDOW;
use crate::report::words;
use crate::session::Phase;
use crate::sharing::Mode;

fn caption(group: &Group<'_>, name: &str, thesis: &str, title: &str, sentence: &str) -> Caption {
    Caption {
        name: format!("{}-{name}", group.stem),
        thesis: thesis.to_owned(),
        title: title.to_owned(),
        preset: group.preset.clone(),
        sentence: sentence.to_owned(),
    }
}

/// A number, or a dash.
fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.decimals$}"))
}

/// What each subject came to.
pub(super) fn subjects(group: &Group<'_>) -> Option<Table> {
    let yard = yardstick(group.task);
    let (decimals, unit) = (yard.decimals.max(2), yard.unit);
    let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
    let mut rows = Vec::new();
    for (mode, arm) in group.arms() {
        for subject in arm {
            let end = |of: fn(&crate::record::EpisodeRow) -> Option<f64>| {
                subject.mean_of(|session| of(session.of_phase(Phase::Main).last()?))
            };
            let last = subject.mean_of(last_average);
            let first_tenth = subject.mean_of(|session| tenths(session).get(&10).copied());
            let alone = |phase| subject.mean_of(|session| average(session, phase));
            let percent = |value: Option<f64>| number(value.map(|value| 100.0 * value), 0);
            rows.push(vec![
                subject.name.to_owned(),
                mode.word().to_owned(),
                subject.sessions.len().to_string(),
                number(alone(Phase::Main), decimals),
                number(last, decimals),
                number(first_tenth, decimals),
                number(alone(Phase::Autonomous), decimals),
                number(alone(Phase::ZeroControl), decimals),
                percent(end(|row| row.success)),
                percent(end(|row| row.share)),
                number(end(|row| row.receptive_fields.map(f64::from)), 0),
            ]);
        }
    }
    let head = [
        "subject".to_owned(),
        "mode".to_owned(),
        "sessions".to_owned(),
        format!("teaching{unit}"),
        format!("last {WINDOW}{unit}"),
        format!("robot alone, first tenth{unit}"),
        format!("robot alone{unit}"),
        format!("zero control{unit}"),
        "success at the end (%)".to_owned(),
        "share at the end (%)".to_owned(),
        "receptive fields".to_owned(),
    ];
    let sentence =
        format!("The {} of each subject in each part of its sessions.", words::mean_of(yard.name));
    (!rows.is_empty()).then(|| Table {
        caption: caption(group, "subjects", "", "Subjects", &sentence),
        columns: head.to_vec(),
        rows,
    })
}

/// Table 1, with the values that these sessions used.
pub(super) fn regions(group: &Group<'_>) -> Option<Table> {
    let session: &Recorded = group.sessions.first().or_else(|| group.cut.first())?;
    let rule = |key: &str| session.profile.get(&format!("rules.{key}"))?.parse::<f64>().ok();
    let cos = |degrees: f64| format!("cos {degrees}°");
    let row = |name: &str, angles: (f64, f64), speeds: (f64, Option<f64>), goal: f64| {
        let most = speeds.1.map_or_else(|| "–".to_owned(), |most| most.to_string());
        vec![name.to_owned(), cos(angles.0), cos(angles.1), speeds.0.to_string(), most, cos(goal)]
    };
    let (down, top_slow, top_fast) =
        (rule("down_deg")?, rule("top_slow_deg")?, rule("top_fast_deg")?);
    let fast = (rule("down_fast_rad_s")?, rule("middle_fast_rad_s")?, rule("top_fast_rad_s")?);
    Some(Table {
        caption: caption(
            group,
            "regions",
            "table 1",
            "State regions of swing-up, as used",
            "Where each region lies in pseudo-height and angular velocity, and the mean height \
             that is full success there. A dash is no limit.",
        ),
        columns: [
            "region",
            "cos θ from",
            "cos θ to",
            "|θ̇| from (rad/s)",
            "|θ̇| to (rad/s)",
            "cos θ threshold",
        ]
        .map(str::to_owned)
        .to_vec(),
        rows: vec![
            row("Down slow", (180.0, down), (0.0, Some(fast.0)), rule("down_slow_goal_deg")?),
            row("Down fast", (180.0, down), (fast.0, None), rule("down_fast_goal_deg")?),
            row(
                "Middle slow",
                (down, top_slow),
                (0.0, Some(fast.1)),
                rule("middle_slow_goal_deg")?,
            ),
            row("Middle fast", (down, top_fast), (fast.1, None), rule("middle_fast_goal_deg")?),
            row("Top slow", (top_slow, 0.0), (0.0, Some(fast.2)), rule("top_slow_goal_deg")?),
            row("Top fast", (top_fast, 0.0), (fast.2, None), rule("top_fast_goal_deg")?),
        ],
    })
}

/// Table 2: pseudo-heights of person, team and robot.
pub(super) fn swing_up(group: &Group<'_>) -> Option<Table> {
    let cells = [
        ("HC (sequential)", Mode::Sequential, Phase::Main),
        ("ARC (sequential)", Mode::Sequential, Phase::Autonomous),
        ("HRC (simultaneous)", Mode::Simultaneous, Phase::Main),
        ("ARC (simultaneous)", Mode::Simultaneous, Phase::Autonomous),
    ];
    let values = cells.map(|(_, mode, phase)| {
        let arm = group.arm(mode);
        arm.iter().filter_map(|s| s.mean_of(|session| average(session, phase))).collect::<Vec<_>>()
    });
    let row = |name: &str, of: &dyn Fn(&[f64]) -> String| {
        std::iter::once(name.to_owned()).chain(values.iter().map(|values| of(values))).collect()
    };
    let is_there = values.iter().any(|values| !values.is_empty());
    is_there.then(|| Table {
        caption: caption(
            group,
            "table-2",
            "table 2",
            "Mean pseudo-height of each group",
            "HC: the person; HRC: person and robot together; ARC: the robot alone. Means and \
             standard deviations over subjects.",
        ),
        columns: std::iter::once("pseudo-height")
            .chain(cells.iter().map(|cell| cell.0))
            .map(str::to_owned)
            .collect(),
        rows: vec![
            row("mean", &|values| number((!values.is_empty()).then(|| mean(values)), 2)),
            row("standard deviation", &|values| number(deviation(values), 2)),
            row("subjects", &|values| values.len().to_string()),
        ],
    })
}
