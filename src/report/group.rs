//! The figures and tables of a group of subjects: figures 10 and 31–38, tables 1 and 2, and the
//! comparison of both modes.
//!
//! A subject counts once: with several sessions in one mode, its numbers are their means.

mod compared;
mod tables;
mod tenths;

use std::collections::BTreeMap;

use super::achieved::{Achieved, yardstick};
use super::figure::{
    Axis, Caption, Content, Contrast, Figure, Item, Mark, Role, Section, Series, real,
};
use super::gather::Recorded;
use super::metrics::{deviation, mean};
use super::series::{ByRollout, WINDOW, along, moving_average, numbers, over_rows, with_gaps};
use super::session::{line, linked, measure, measured, numbered, of_main, role, shape, with_unit};
use super::words;
use crate::record::EpisodeRow;
use crate::session::Phase;
use crate::sharing::Mode;
use crate::task::balance::Balance;
use crate::task::swing_up::SwingUp;

/// Sessions that may be compared: of one task, preset and profile, kind of operator and plant.
#[derive(Clone, Debug)]
pub struct Group<'a> {
    /// The task.
    pub task: &'a str,
    /// Task and preset, and what else tells the group from others.
    pub preset: String,
    /// The beginning of its files' names.
    pub stem: String,
    /// Its complete sessions.
    pub sessions: Vec<&'a Recorded>,
    /// Sessions that are not complete.
    pub cut: Vec<&'a Recorded>,
}

/// A subject in one mode.
#[derive(Clone, Debug)]
struct Subject<'a> {
    name: &'a str,
    sessions: Vec<&'a Recorded>,
}

impl Subject<'_> {
    /// The mean over its sessions of a number that each has.
    fn mean_of(&self, of: impl Fn(&Recorded) -> Option<f64>) -> Option<f64> {
        let values: Vec<f64> = self.sessions.iter().filter_map(|session| of(session)).collect();
        (!values.is_empty()).then(|| mean(&values))
    }

    /// The mean over its sessions of numbers that each has, rollout by rollout.
    fn mean_row(&self, of: impl Fn(&Recorded) -> ByRollout) -> ByRollout {
        let rows: Vec<ByRollout> = self.sessions.iter().map(|session| of(session)).collect();
        over_rows(&rows).into_iter().map(|(rollout, (mean, _))| (rollout, mean)).collect()
    }
}

/// What a session's rollouts of `phase` are measured by, on average.
fn average(session: &Recorded, phase: Phase) -> Option<f64> {
    let rows = session.of_phase(phase);
    if rows.is_empty() { None } else { Achieved::of(&session.task, &rows).mean() }
}

/// What the last rollouts of main are measured by, on average.
fn last_average(session: &Recorded) -> Option<f64> {
    let values = numbers(&measured(session));
    let last = &values[values.len().saturating_sub(WINDOW)..];
    (!last.is_empty()).then(|| mean(last))
}

/// The part of a report that shows `group`, and its comparisons.
#[must_use]
pub fn section(group: &Group<'_>) -> (Section, Vec<Contrast>) {
    let mut items = Vec::new();
    let comparison = compared::table(group);
    items.extend(comparison.table.map(Item::Table));
    if group.task == SwingUp::NAME {
        items.extend(tables::regions(group).map(Item::Table));
        items.extend(tables::swing_up(group).map(Item::Table));
    }
    items.extend(tables::subjects(group).map(Item::Table));
    // Of one subject in one mode its own figures tell all but these.
    let is_alone = matches!(&group.arms()[..], [(_, arm)] if arm.len() == 1);
    let of_many = || {
        [
            group.balance_time(),
            group.moving_averages(),
            group.at_ends(Mode::Simultaneous, "success", 33, |row| row.success),
            group.at_ends(Mode::Sequential, "success", 33, |row| row.success),
            group.at_ends(Mode::Simultaneous, "share", 34, |row| row.share),
            group.autonomous(),
            group.sorted(),
        ]
    };
    let figures = (!is_alone).then(of_many).into_iter().flatten();
    let figures = figures.chain([group.each_tenth(), group.improvement()]).flatten();
    items.extend(figures.map(Item::Figure));
    let mut notes = group.notes();
    notes.extend(comparison.sentences);
    let title = format!("Group: {}", group.preset);
    (Section { title, notes, items }, comparison.contrasts)
}

impl<'a> Group<'a> {
    /// The subjects who took part in `mode`, by name.
    fn arm(&self, mode: Mode) -> Vec<Subject<'a>> {
        let mut subjects: BTreeMap<&str, Vec<&Recorded>> = BTreeMap::new();
        for session in self.sessions.iter().filter(|session| session.mode == mode) {
            subjects.entry(&session.subject).or_default().push(session);
        }
        subjects.into_iter().map(|(name, sessions)| Subject { name, sessions }).collect()
    }

    /// Both modes that somebody took part in.
    fn arms(&self) -> Vec<(Mode, Vec<Subject<'a>>)> {
        let modes = [Mode::Sequential, Mode::Simultaneous].into_iter();
        modes.map(|mode| (mode, self.arm(mode))).filter(|(_, arm)| !arm.is_empty()).collect()
    }

    fn notes(&self) -> Vec<String> {
        let arms: Vec<String> = self
            .arms()
            .iter()
            .map(|(mode, arm)| {
                format!("{} in {} mode", words::counted(arm.len(), "subject"), mode.word())
            })
            .collect();
        let repeated = self.arms().iter().any(|(_, arm)| arm.iter().any(|s| s.sessions.len() > 1));
        let mut notes = vec![format!(
            "{}. A subject counts once{}; rollouts of one subject are not independent.",
            if arms.is_empty() { "No complete session".to_owned() } else { arms.join(", ") },
            if repeated { ", with the mean of its sessions in a mode" } else { "" }
        )];
        if !self.cut.is_empty() {
            let names: Vec<String> = self
                .cut
                .iter()
                .map(|session| format!("{} ({})", session.title(), session.mode.word()))
                .collect();
            notes.push(format!("Not complete, so not counted here: {}.", names.join(", ")));
        }
        notes
    }

    fn caption(&self, name: &str, number: u32, title: &str, sentence: String) -> Caption {
        let like = if self.task == Balance::NAME { "" } else { "like " };
        Caption {
            name: format!("{}-{name}", self.stem),
            thesis: format!("{like}figure {number}"),
            title: title.to_owned(),
            preset: self.preset.clone(),
            sentence,
        }
    }

    fn balance_time(&self) -> Option<Figure> {
        let axis = measure(self.task);
        let mut series = Vec::new();
        for (mode, arm) in self.arms() {
            let curves: Vec<ByRollout> = arm.iter().map(|one| one.mean_row(measured)).collect();
            let rows = over_rows(&curves);
            let rows = with_gaps(&rows).into_iter();
            let rows = rows.map(|(at, row)| (at, row.copied().unwrap_or((f64::NAN, f64::NAN))));
            let (points, band) =
                rows.map(|(at, (mean, sd))| ((at, mean), (mean - sd, mean + sd))).unzip();
            series.push(Series::new(mode.word(), role(mode), line(mode), points).within(band));
        }
        let sentence = format!(
            "The {} over the subjects of each group in each rollout of main, ± one standard \
             deviation over subjects ({}).",
            words::mean_of(&axis.label),
            self.sizes()
        );
        let title = format!("{} of each group", words::heading(&axis.label));
        series.iter().any(|one| !one.points.is_empty()).then(|| Figure {
            caption: self.caption("per-rollout", 31, &title, sentence),
            x: Axis::whole("rollout"),
            y: axis.clone(),
            content: Content::Series(series),
        })
    }

    fn moving_averages(&self) -> Option<Figure> {
        let axis = measure(self.task);
        let mut series = Vec::new();
        for (mode, arm) in self.arms() {
            let curves: Vec<ByRollout> = arm.iter().map(|one| one.mean_row(measured)).collect();
            let means = over_rows(&curves).into_iter().map(|(rollout, row)| (rollout, row.0));
            let points = along(&moving_average(&means.collect(), WINDOW));
            series.push(Series::new(mode.word(), role(mode), line(mode), points));
        }
        series.retain(|one| !one.points.is_empty());
        let sentence = format!(
            "The moving average (window {WINDOW}) of the {} of each group ({}).",
            words::mean_of(&axis.label),
            self.sizes()
        );
        let title = format!("{} of each group, moving average", words::heading(&axis.label));
        (!series.is_empty()).then(|| Figure {
            caption: self.caption("moving-average", 32, &title, sentence),
            x: Axis::whole("rollout"),
            y: axis,
            content: Content::Series(series),
        })
    }

    fn sizes(&self) -> String {
        let arms = self.arms();
        let sizes: Vec<String> =
            arms.iter().map(|(mode, arm)| format!("{} {}", arm.len(), mode.word())).collect();
        sizes.join(", ")
    }

    /// A number of each subject of `mode` at each rollout's end, in percent.
    fn at_ends(
        &self,
        mode: Mode,
        what: &str,
        number: u32,
        of: impl Fn(&EpisodeRow) -> Option<f64>,
    ) -> Option<Figure> {
        let arm = self.arm(mode);
        let mut series = Vec::new();
        for (at, subject) in arm.iter().enumerate() {
            let percent = |row: &EpisodeRow| of(row).map(|value| 100.0 * value);
            let points = along(&subject.mean_row(|session| of_main(session, percent)));
            let mark = match at % 3 {
                0 => Mark::Line,
                1 => Mark::Dashed,
                _ => Mark::Dotted,
            };
            let one = Series::new(subject.name, Role::One(at), mark, points);
            series.extend(one.pieces().next().is_some().then(|| one.clone()));
        }
        let (title, label) = match what {
            "share" => ("The person's share w of each subject", "person's share w"),
            _ => ("Success of each subject", "success"),
        };
        let like = if mode == Mode::Sequential { "like " } else { "" };
        let mut caption = self.caption(
            &format!("{what}-{}", mode.word()),
            number,
            &format!("{title}, {} group", mode.word()),
            format!(
                "The {label} at the end of each rollout of main, of {} of the {} group.",
                words::each(arm.len(), "subject"),
                mode.word()
            ),
        );
        if !caption.thesis.starts_with("like ") {
            caption.thesis.insert_str(0, like);
        }
        (!series.is_empty()).then(|| Figure {
            caption,
            x: Axis::whole("rollout"),
            y: Axis::new(label, "%").from(0.0, 100.0),
            content: Content::Series(series),
        })
    }

    /// The subjects' means of what their robots do alone, by mode.
    fn alone(&self) -> Vec<(Mode, Vec<(&'a str, f64)>)> {
        let arms = self.arms().into_iter().map(|(mode, arm)| {
            let known = arm.iter().filter_map(|subject| {
                let alone = subject.mean_of(|session| average(session, Phase::Autonomous))?;
                Some((subject.name, alone))
            });
            (mode, known.collect::<Vec<_>>())
        });
        arms.filter(|(_, known)| !known.is_empty()).collect()
    }

    fn autonomous(&self) -> Option<Figure> {
        let axis = measure(self.task);
        let (mut series, mut names, mut told) = (Vec::new(), Vec::new(), Vec::new());
        for (place, (mode, subjects)) in (1_u8..).zip(self.alone()) {
            let place = f64::from(place);
            let values: Vec<f64> = subjects.iter().map(|(_, value)| *value).collect();
            let (mean, sd) = (mean(&values), deviation(&values));
            let spread = sd.unwrap_or(0.0);
            series.push(
                Series::new(
                    format!("{}, mean ± sd", mode.word()),
                    role(mode),
                    shape(mode),
                    vec![(place, mean)],
                )
                .within(vec![(mean - spread, mean + spread)]),
            );
            let beside = values.iter().map(|value| (place + 0.25, *value)).collect();
            let label = format!("{}, each subject", mode.word());
            let who = subjects.iter().map(|(name, _)| (*name).to_owned()).collect();
            series.push(Series::new(label, role(mode), shape(mode), beside).each_of(who));
            names.push((place, mode.word().to_owned()));
            let sd = sd.map_or(String::new(), |sd| format!(" ± {}", with_unit(self.task, sd)));
            let n = words::counted(values.len(), "subject");
            told.push(format!("{} {}{sd} ({n})", mode.word(), with_unit(self.task, mean)));
        }
        let most = real(names.len()) + 0.5;
        let sentence = format!(
            "The {} of the final policies alone, ± one standard deviation over subjects: {}.",
            words::mean_of(&axis.label),
            told.join("; ")
        );
        let title = format!("{} of the robot alone, each group", words::heading(&axis.label));
        (!series.is_empty()).then(|| Figure {
            caption: self.caption("autonomous", 35, &title, sentence),
            x: Axis { names, ..Axis::new("group", "").from(0.5, most) },
            y: Axis { range: None, ..axis },
            content: Content::Series(series),
        })
    }

    /// The subjects of each group by what their robots do alone; for swing-up figure 10.
    fn sorted(&self) -> Option<Figure> {
        let axis = measure(self.task);
        let better_is_more = yardstick(self.task).more_is_better;
        let mut series = Vec::new();
        let mut longest = 0;
        for (mode, mut subjects) in self.alone() {
            subjects.sort_by(|a, b| a.1.total_cmp(&b.1));
            if !better_is_more {
                subjects.reverse();
            }
            longest = longest.max(subjects.len());
            let (who, values): (Vec<String>, Vec<f64>) =
                subjects.into_iter().map(|(name, value)| (name.to_owned(), value)).unzip();
            let sorted = Series::new(mode.word(), role(mode), linked(mode), numbered(&values));
            series.push(sorted.each_of(who));
        }
        let zero: Vec<f64> = self
            .sessions
            .iter()
            .filter_map(|session| average(session, Phase::ZeroControl))
            .collect();
        if !zero.is_empty() {
            let ends = vec![(1.0, mean(&zero)), (real(longest.max(2)), mean(&zero))];
            series.push(Series::new("zero control", Role::Plain, Mark::Dotted, ends));
        }
        let nobody = if zero.is_empty() {
            ""
        } else {
            "; the dotted line is what nobody at the controls comes to"
        };
        let number = if self.task == SwingUp::NAME { 10 } else { 36 };
        let sentence = format!(
            "The {} of each subject's final policy alone, the subjects of each group sorted \
             from the worst to the best{nobody}.",
            words::mean_of(&axis.label)
        );
        let title = format!("{} of the robot alone, subjects sorted", words::heading(&axis.label));
        let mut caption = self.caption("sorted", number, &title, sentence);
        if number == 10 {
            "figure 10".clone_into(&mut caption.thesis);
        }
        (longest > 0).then(|| Figure {
            caption,
            x: Axis {
                names: (1..=longest).map(|n| (real(n), n.to_string())).collect(),
                ..Axis::new("subject, from worst to best", "")
            },
            y: Axis { range: None, ..axis },
            content: Content::Series(series),
        })
    }
}
