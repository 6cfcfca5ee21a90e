//! The figures of one session: figures 8–9, 14–19, 21–22 and 40, and what [`portrait`] shows.

use super::achieved::{Yardstick, yardstick};
use super::figure::{Axis, Caption, Content, Figure, Item, Mark, Role, Section, Series, real};
use super::gather::{Moment, Recorded};
use super::metrics::mean;
use super::series::{
    ByRollout, NEIGHBOURS, WINDOW, along, average_around, by_x, extent, moving_average, numbers,
};
use super::{portrait, words};
use crate::record::{EpisodeRow, Status};
use crate::session::Phase;
use crate::sharing::Mode;
use crate::task::balance::Balance;
use crate::task::speed_up::SpeedUp;
use crate::task::swing_up::SwingUp;

/// A session, and under which name its preset goes in the report.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// The session.
    pub session: &'a Recorded,
    /// Task and preset.
    pub preset: &'a str,
}

/// The part of a report that shows a session.
#[must_use]
pub fn section(view: View<'_>) -> Section {
    let session = view.session;
    let mut items: Vec<Item> = Vec::new();
    let mut add = |figure: Option<Figure>| items.extend(figure.map(Item::Figure));
    add(view.per_rollout());
    add(view.moving_average());
    if goes_by_time(&session.task) {
        for figure in view.by_time() {
            add(Some(figure));
        }
    } else {
        add(view.success());
        add(view.share());
    }
    add(view.by_start(Phase::Main));
    add(view.by_start(Phase::Autonomous));
    for figure in portrait::figures(view) {
        add(Some(figure));
    }
    let title = format!("{} · {} · {}", session.title(), session.task, session.mode.word());
    Section { title, notes: view.notes(), items }
}

/// Whether success and share of `task` are shown along time, as figures 8, 9 and 40 are.
fn goes_by_time(task: &str) -> bool {
    matches!(task, SwingUp::NAME | SpeedUp::NAME)
}

/// What colour and shape stand for `mode`.
#[must_use]
pub const fn role(mode: Mode) -> Role {
    match mode {
        Mode::Simultaneous => Role::Simultaneous,
        Mode::Sequential => Role::Sequential,
    }
}

/// The line of `mode`.
#[must_use]
pub const fn line(mode: Mode) -> Mark {
    match mode {
        Mode::Simultaneous => Mark::Line,
        Mode::Sequential => Mark::Dashed,
    }
}

/// The shape of `mode`.
#[must_use]
pub const fn shape(mode: Mode) -> Mark {
    match mode {
        Mode::Simultaneous => Mark::Shape(0),
        Mode::Sequential => Mark::Shape(1),
    }
}

/// The line and the shape of `mode`.
#[must_use]
pub const fn linked(mode: Mode) -> Mark {
    match mode {
        Mode::Simultaneous => Mark::Linked(0),
        Mode::Sequential => Mark::DashLinked(1),
    }
}

/// The line of `mode` with the shape of one subject, the `at`-th of its group.
#[must_use]
pub const fn subject(mode: Mode, at: usize) -> Mark {
    match mode {
        Mode::Simultaneous => Mark::Linked(at),
        Mode::Sequential => Mark::DashLinked(at),
    }
}

/// The axis of what `task` is measured by.
#[must_use]
pub fn measure(task: &str) -> Axis {
    let Yardstick { name, unit, range, decimals, .. } = yardstick(task);
    // Heights lie on both sides of 0; times, speeds and steps do not.
    let floor = range.is_none().then_some(0.0);
    Axis { range, floor, is_whole: decimals == 0, ..Axis::new(name, unit) }
}

/// What each rollout of main of `session` is measured by; those cut before it was known are left
/// out.
#[must_use]
pub fn measured(session: &Recorded) -> ByRollout {
    of_main(session, yardstick(&session.task).of)
}

/// A number of each rollout of main of `session`, where it is known.
#[must_use]
pub fn of_main(session: &Recorded, of: impl Fn(&EpisodeRow) -> Option<f64>) -> ByRollout {
    let rows = session.of_phase(Phase::Main);
    rows.into_iter().filter_map(|row| Some((row.episode, of(row)?))).collect()
}

/// What the `rows` are measured by, against where they started, in the units of figures.
#[must_use]
pub fn by_start(task: &str, rows: &[&EpisodeRow]) -> Vec<(f64, f64)> {
    let factor = words::start(task).factor;
    let known =
        rows.iter().filter_map(|row| Some((row.start * factor, (yardstick(task).of)(row)?)));
    by_x(&known.collect::<Vec<_>>())
}

/// Whether the starts differ enough for a figure of them.
#[must_use]
pub fn starts_differ(points: &[(f64, f64)]) -> bool {
    let mut places: Vec<u64> = points.iter().map(|(x, _)| x.to_bits()).collect();
    places.sort_unstable();
    places.dedup();
    places.len() > NEIGHBOURS
}

/// Numbers by their place, from 1.
#[must_use]
pub fn numbered(values: &[f64]) -> Vec<(f64, f64)> {
    values.iter().enumerate().map(|(at, value)| (real(at + 1), *value)).collect()
}

impl View<'_> {
    /// A caption; the thesis's figure `balance` is the one of the task balance.
    #[must_use]
    pub fn caption(&self, name: &str, thesis: &str, title: &str, sentence: String) -> Caption {
        Caption {
            name: format!("{}-{name}", self.session.stem()),
            thesis: thesis.to_owned(),
            title: title.to_owned(),
            preset: self.preset.to_owned(),
            sentence,
        }
    }

    /// The thesis's figure of the task balance, by mode; of another task a likeness of it.
    fn of_balance(&self, sequential: u32, simultaneous: u32) -> String {
        let number = match self.session.mode {
            Mode::Sequential => sequential,
            Mode::Simultaneous => simultaneous,
        };
        let like = if self.session.task == Balance::NAME { "" } else { "like " };
        format!("{like}figure {number}")
    }

    fn notes(&self) -> Vec<String> {
        let session = self.session;
        let Recorded { learner, operator, backend, seed, preset, .. } = session;
        let mut notes = vec![format!(
            "Preset {preset}; {operator} steers, {learner} learns, the plant is {backend}; seed \
             {seed}."
        )];
        let main = session.of_phase(Phase::Main).len();
        let status = match session.status {
            Status::Complete if session.lost > 0 => Some("Rows of its rollouts are lost"),
            Status::Complete => None,
            Status::Running => Some("It is under way, or was killed"),
            Status::Aborted => Some("Somebody ended it early"),
            Status::Interrupted => Some("A signal ended it"),
            Status::Failed => Some("A fault ended it"),
        };
        if let Some(status) = status {
            let rollouts = words::counted(main, "rollout");
            notes.push(format!("{status}: {rollouts} of main are there. It counts in no group."));
        }
        if session.resumed > 0 {
            let times = words::counted(session.resumed, "time");
            notes.push(format!("It was taken up again {times}."));
        }
        notes
    }

    fn per_rollout(&self) -> Option<Figure> {
        let Recorded { task, mode, .. } = self.session;
        let values = measured(self.session);
        let (average, points) = (mean(&numbers(&values)), along(&values));
        let axis = measure(task);
        (!values.is_empty()).then(|| Figure {
            caption: self.caption(
                "per-rollout",
                &self.of_balance(14, 14),
                &format!("{} in each rollout", words::heading(&axis.label)),
                format!(
                    "The {} of {} of the {mode} session; the mean is {}.",
                    axis.label,
                    words::each(values.len(), "rollout"),
                    with_unit(task, average),
                    mode = mode.word(),
                ),
            ),
            x: Axis::whole("rollout"),
            y: axis.clone(),
            content: Content::Series(vec![
                Series::new(mode.word(), role(*mode), shape(*mode), points.clone()),
                level("mean", average, &points),
            ]),
        })
    }

    fn moving_average(&self) -> Option<Figure> {
        let Recorded { task, mode, .. } = self.session;
        let averages = moving_average(&measured(self.session), WINDOW);
        let (first, last) = (*averages.first_key_value()?.1, *averages.last_key_value()?.1);
        let axis = measure(task);
        Some(Figure {
            caption: self.caption(
                "moving-average",
                &self.of_balance(15, 15),
                &format!("{}, moving average", words::heading(&axis.label)),
                format!(
                    "The {} of each {WINDOW} rollouts in a row: {} in the first {WINDOW}, {} \
                     in the last {WINDOW}.",
                    words::mean_of(&axis.label),
                    with_unit(task, first),
                    with_unit(task, last)
                ),
            ),
            x: Axis::whole("rollout"),
            y: axis,
            content: Content::Series(vec![Series::new(
                mode.word(),
                role(*mode),
                line(*mode),
                along(&averages),
            )]),
        })
    }

    /// A number at each rollout's end, in percent.
    fn at_ends(&self, of: impl Fn(&EpisodeRow) -> Option<f64>) -> Vec<(f64, f64)> {
        along(&of_main(self.session, |row| of(row).map(|value| 100.0 * value)))
    }

    fn success(&self) -> Option<Figure> {
        let mode = self.session.mode;
        let points = self.at_ends(|row| row.success);
        let last = points.last()?.1;
        Some(Figure {
            caption: self.caption(
                "success",
                &self.of_balance(16, 16),
                "Success",
                format!("The success at the end of each rollout of main; {last:.0} % at the end."),
            ),
            x: Axis::whole("rollout"),
            y: Axis::new("success", "%").from(0.0, 100.0),
            content: Content::Series(vec![Series::new(
                mode.word(),
                role(mode),
                line(mode),
                points,
            )]),
        })
    }

    fn share(&self) -> Option<Figure> {
        let mode = self.session.mode;
        let points = self.at_ends(|row| row.share);
        let last = points.last()?.1;
        let what = match mode {
            Mode::Simultaneous => {
                format!("100 % is the person alone, 0 % the robot alone; {last:.0} % at the end")
            }
            Mode::Sequential => {
                format!("the robot only watches, so it is {last:.0} % throughout")
            }
        };
        Some(Figure {
            caption: self.caption(
                "share",
                &self.of_balance(17, 17),
                "The person's share w",
                format!("The mixing weight at the end of each rollout of main: {what}."),
            ),
            x: Axis::whole("rollout"),
            y: Axis::new("person's share w", "%").from(0.0, 100.0),
            content: Content::Series(vec![Series::new(
                mode.word(),
                role(mode),
                line(mode),
                points,
            )]),
        })
    }

    /// Success and share of each region along time.
    fn by_time(&self) -> Vec<Figure> {
        let tracks = &self.session.trace.regions;
        let is_swing_up = self.session.task == SwingUp::NAME;
        let curve = |what: &str, of: fn(&Moment) -> Option<f64>| {
            let series = tracks.iter().enumerate().map(|(at, track)| {
                let known = track.moments.iter();
                let points = known.filter_map(|m| Some((m.t, 100.0 * of(m)?))).collect();
                let name = if track.name == "all" { what } else { &track.name };
                let mark = match at % 3 {
                    0 => Mark::Line,
                    1 => Mark::Dashed,
                    _ => Mark::Dotted,
                };
                Series::new(words::heading(name), Role::One(at), mark, points)
            });
            series.filter(|series| !series.points.is_empty()).collect::<Vec<_>>()
        };
        let success = curve("success", |moment| moment.success);
        let share = curve("person's share w", |moment| Some(moment.share));
        let figure = |name: &str, thesis: &str, title: &str, sentence: &str, y, series| Figure {
            caption: self.caption(name, thesis, title, sentence.to_owned()),
            x: Axis::new("controlled time of main", "s"),
            y,
            content: Content::Series(series),
        };
        if success.is_empty() && share.is_empty() {
            return Vec::new();
        }
        if is_swing_up {
            return vec![
                figure(
                    "success",
                    "figure 8",
                    "Success in each state region",
                    "The success in each region of the state space during main; 100 % is what \
                     Table 1 asks for.",
                    Axis::new("success", "%").from(0.0, 100.0),
                    success,
                ),
                figure(
                    "share",
                    "figure 9",
                    "The person's share in each state region",
                    "The control sharing weight w in each region during main: from the person \
                     alone (100 %) to the robot alone (0 %).",
                    Axis::new("person's share w", "%").from(0.0, 100.0),
                    share,
                ),
            ];
        }
        let dashed = share.into_iter().map(|series| Series {
            mark: Mark::Dashed,
            role: Role::One(1),
            ..series
        });
        vec![figure(
            "success-and-share",
            "figure 40",
            "Success and the person's share",
            "The success, and the mixing weight that follows from it, during main.",
            Axis::new("success, share", "%").from(0.0, 100.0),
            success.into_iter().chain(dashed).collect(),
        )]
    }

    fn by_start(&self, phase: Phase) -> Option<Figure> {
        let Recorded { task, mode, .. } = self.session;
        let points = by_start(task, &self.session.of_phase(phase));
        // Where a session runs on, a rollout of main starts wherever the one before ended.
        let runs_on = phase == Phase::Main && goes_by_time(task);
        if runs_on || !starts_differ(&points) {
            return None;
        }
        let average = mean(&points.iter().map(|(_, y)| *y).collect::<Vec<_>>());
        let zero = by_start(task, &self.session.of_phase(Phase::ZeroControl));
        let start = words::start(task);
        let axis = measure(task);
        let who = if phase == Phase::Main { "teaching" } else { "robot alone" };
        let mut series = vec![
            Series::new(who, role(*mode), shape(*mode), points.clone()),
            Series::new(
                format!("mean of {NEIGHBOURS} neighbours"),
                Role::One(2),
                Mark::Line,
                average_around(&points, NEIGHBOURS),
            ),
            level("mean", average, &points),
        ];
        if !zero.is_empty() {
            series.push(Series::new("zero control", Role::Plain, Mark::Dotted, zero.clone()));
        }
        let nobody =
            if zero.is_empty() { "" } else { ", and what nobody at the controls comes to" };
        let (name, thesis, title) = if phase == Phase::Main {
            ("by-start", self.of_balance(18, 19), "while teaching")
        } else {
            ("autonomous", self.of_balance(21, 22), "of the robot alone")
        };
        Some(Figure {
            caption: self.caption(
                name,
                &thesis,
                &format!("{} {title}, by {}", words::heading(&axis.label), start.label),
                format!(
                    "The {} of {} against the {}, its mean over {NEIGHBOURS} neighbouring ones, \
                     the mean of all ({}){nobody}.",
                    axis.label,
                    words::counted(points.len(), "rollout"),
                    start.label,
                    with_unit(task, average)
                ),
            ),
            x: Axis::new(start.label, start.unit),
            y: axis,
            content: Content::Series(series),
        })
    }
}

/// A level line over the extent of `points`.
#[must_use]
pub fn level(label: &str, value: f64, points: &[(f64, f64)]) -> Series {
    let ends = extent(points).map_or_else(Vec::new, |(a, b)| vec![(a, value), (b, value)]);
    Series::new(label, Role::Plain, Mark::Dashed, ends)
}

/// What `task` is measured by, as a text.
#[must_use]
pub fn with_unit(task: &str, value: f64) -> String {
    let Yardstick { unit, decimals, .. } = yardstick(task);
    let blank = if unit.is_empty() { "" } else { " " };
    format!("{value:.decimals$}{blank}{unit}")
}
