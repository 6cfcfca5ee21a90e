//! A subject who took part in both modes: figures 14, 15, 20 and 23, both overlaid.

use super::figure::{Axis, Caption, Content, Figure, Item, Mark, Section, Series};
use super::metrics::mean;
use super::series::{NEIGHBOURS, WINDOW, along, average_around, moving_average, numbers};
use super::session::{
    View, by_start, level, line, measure, measured, role, shape, starts_differ, with_unit,
};
use super::words;
use crate::session::Phase;
use crate::task::balance::Balance;

/// The part of a report that lays two sessions of a subject over each other, the sequential one
/// first.
#[must_use]
pub fn section(views: [View<'_>; 2]) -> Section {
    let session = views[0].session;
    let figures = [
        per_rollout(views),
        averages(views),
        around_starts(views, Phase::Main),
        around_starts(views, Phase::Autonomous),
    ];
    let trials =
        views.map(|view| format!("{:03} {}", view.session.trial, view.session.mode.word()));
    Section {
        title: format!("{} · {} · both modes", session.subject, session.task),
        notes: vec![format!("Trials {} of one subject, under one preset.", trials.join(" and "))],
        items: figures.into_iter().flatten().map(Item::Figure).collect(),
    }
}

fn caption(view: View<'_>, name: &str, number: u32, title: String, sentence: String) -> Caption {
    let session = view.session;
    let like = if session.task == Balance::NAME { "" } else { "like " };
    Caption {
        name: format!("{}-{}-both-{name}", session.subject, session.task),
        thesis: format!("{like}figure {number}"),
        title,
        preset: view.preset.to_owned(),
        sentence,
    }
}

fn per_rollout(views: [View<'_>; 2]) -> Option<Figure> {
    let task = &views[0].session.task;
    let values = views.map(|view| measured(view.session));
    let axis = measure(task);
    let means = values.each_ref().map(|values| with_unit(task, mean(&numbers(values))));
    let series = views.iter().zip(&values).map(|(view, values)| {
        let mode = view.session.mode;
        Series::new(mode.word(), role(mode), shape(mode), along(values))
    });
    let sentence = format!(
        "The {} of each rollout in both modes: on average {} in sequential and {} in simultaneous \
         mode.",
        axis.label, means[0], means[1]
    );
    let title = format!("{} in each rollout, both modes", words::heading(&axis.label));
    values.iter().all(|values| !values.is_empty()).then(|| Figure {
        caption: caption(views[0], "per-rollout", 14, title, sentence),
        x: Axis::whole("rollout"),
        y: axis.clone(),
        content: Content::Series(series.collect()),
    })
}

fn averages(views: [View<'_>; 2]) -> Option<Figure> {
    let task = &views[0].session.task;
    let values = views.map(|view| measured(view.session));
    let averages = values.map(|values| moving_average(&values, WINDOW));
    let last = averages.each_ref().map(|points| points.last_key_value().map(|(_, value)| *value));
    let [sequential, simultaneous] = last;
    let axis = measure(task);
    let sentence = format!(
        "The {} of each {WINDOW} rollouts in a row; the last ones come to {} in sequential \
         and {} in simultaneous mode.",
        words::mean_of(&axis.label),
        with_unit(task, sequential?),
        with_unit(task, simultaneous?)
    );
    let title = format!("{}, moving average, both modes", words::heading(&axis.label));
    let series = views.iter().zip(&averages).map(|(view, points)| {
        let mode = view.session.mode;
        Series::new(mode.word(), role(mode), line(mode), along(points))
    });
    Some(Figure {
        caption: caption(views[0], "moving-average", 15, title, sentence),
        x: Axis::whole("rollout"),
        y: axis,
        content: Content::Series(series.collect()),
    })
}

/// Averages around each start, and the means of all.
fn around_starts(views: [View<'_>; 2], phase: Phase) -> Option<Figure> {
    let task = &views[0].session.task;
    let points = views.map(|view| by_start(task, &view.session.of_phase(phase)));
    if !points.iter().all(|points| starts_differ(points)) {
        return None;
    }
    let means =
        points.each_ref().map(|points| mean(&points.iter().map(|(_, y)| *y).collect::<Vec<_>>()));
    let mut series = Vec::new();
    for ((view, points), average) in views.iter().zip(&points).zip(means) {
        let mode = view.session.mode;
        let around = average_around(points, NEIGHBOURS);
        series.push(Series::new(mode.word(), role(mode), line(mode), around));
        let label = format!("mean, {}", mode.word());
        let mean = level(&label, average, points);
        series.push(Series { role: role(mode), mark: Mark::Dotted, ..mean });
    }
    let (name, number, who) = if phase == Phase::Main {
        ("by-start", 20, "while teaching")
    } else {
        ("autonomous", 23, "of the robot alone")
    };
    let (start, axis) = (words::start(task), measure(task));
    let sentence = format!(
        "The {} {who} against the {}, averaged over {NEIGHBOURS} neighbouring starts: {} on \
         average in sequential and {} in simultaneous mode.",
        axis.label,
        start.label,
        with_unit(task, means[0]),
        with_unit(task, means[1])
    );
    let title = format!("{} {who} by {}, both modes", words::heading(&axis.label), start.label);
    Some(Figure {
        caption: caption(views[0], name, number, title, sentence),
        x: Axis::new(start.label, start.unit),
        y: axis,
        content: Content::Series(series),
    })
}
