//! A session tick by tick: phase portraits (figures 24–28), actions (29, 30 and 41), and the
//! receptive fields.

use super::figure::{Axis, Content, Figure, Mark, Role, Series};
use super::gather::{Acted, Portrait};
use super::session::{View, role};
use super::words::{self, Plane};
use crate::session::Phase;
use crate::sharing::Mode;
use crate::task::balance::Balance;
use crate::task::speed_up::SpeedUp;

/// The figures of the session's ticks.
#[must_use]
pub fn figures(view: View<'_>) -> Vec<Figure> {
    let phases = [Phase::Main, Phase::Autonomous, Phase::ZeroControl];
    let portraits = phases.into_iter().filter_map(|phase| of_phase(view, phase));
    let actions = [true, false].into_iter().filter_map(|at_start| actions(view, at_start));
    portraits.chain(actions).chain(fields(view)).collect()
}

fn axes(plane: &Plane) -> (Axis, Axis) {
    let axis = |quantity: words::Quantity| Axis::new(quantity.label, quantity.unit);
    let (x, y) = (axis(plane.x.1), axis(plane.y.1));
    if plane.goes_round { (x.from(-180.0, 180.0), y) } else { (x, y) }
}

fn of_phase(view: View<'_>, phase: Phase) -> Option<Figure> {
    let session = view.session;
    let portrait = session.trace.portraits.get(&phase)?;
    let (x, y) = axes(&words::plane(&session.task));
    let is_sequential = session.mode == Mode::Sequential;
    let (number, name, who, label, role) = match phase {
        Phase::Main => {
            let number = if is_sequential { 24 } else { 25 };
            (number, "teaching", "during teaching", "teaching", role(session.mode))
        }
        Phase::Autonomous => {
            // The captions of 26 and 27 are swapped in the thesis: its text and its pictures tell.
            let number = if is_sequential { 27 } else { 26 };
            (number, "robot-alone", "of the robot alone", "robot alone", Role::Machine)
        }
        _ => (28, "zero-control", "with nobody at the controls", "zero control", Role::Plain),
    };
    let like = if session.task == Balance::NAME { "" } else { "like " };
    let sentence = format!("The {} against the {} {who}: {}.", y.label, x.label, shown(portrait));
    Some(Figure {
        caption: view.caption(
            &format!("portrait-{name}"),
            &format!("{like}figure {number}"),
            &format!("Trajectories {who}"),
            sentence,
        ),
        x,
        y,
        content: Content::Series(vec![Series::new(
            label,
            role,
            Mark::Thin,
            joined(portrait.tracks.iter()),
        )]),
    })
}

/// How much of a phase a portrait shows.
fn shown(portrait: &Portrait) -> String {
    let drawn = words::counted(portrait.tracks.len(), "rollout");
    let all = if portrait.tracks.len() < portrait.of {
        format!("{drawn} of {}, evenly chosen", portrait.of)
    } else {
        drawn
    };
    match portrait.every {
        0 | 1 => all,
        every => format!("{all}, one tick in {every}"),
    }
}

/// Several tracks as one series, with a break after each.
pub(super) fn joined<'a>(tracks: impl Iterator<Item = &'a Vec<(f64, f64)>>) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for track in tracks {
        if !points.is_empty() {
            points.push((f64::NAN, f64::NAN));
        }
        points.extend(track);
    }
    points
}

fn actions(view: View<'_>, at_start: bool) -> Option<Figure> {
    let session = view.session;
    let (ticks, number, name, when) = if at_start {
        (&session.trace.opening, 29, "actions-first", "beginning")
    } else {
        (&session.trace.closing, 30, "actions-last", "end")
    };
    // A short main has one and the same beginning and end.
    let is_same = session.trace.opening == session.trace.closing;
    let (first, last) = (ticks.first()?, ticks.last()?);
    if !at_start && is_same {
        return None;
    }
    let thesis = match &*session.task {
        SpeedUp::NAME => "figure 41".to_owned(),
        Balance::NAME => format!("figure {number}"),
        _ => format!("like figure {number}"),
    };
    let curve = |label: &str, role, mark, of: fn(&Acted) -> Option<f64>| {
        let points = ticks.iter().map(|tick| (tick.t, of(tick).unwrap_or(f64::NAN)));
        Series::new(label, role, mark, points.collect())
    };
    let series = [
        curve("human", Role::Human, Mark::Line, |tick| tick.human),
        curve("machine", Role::Machine, Mark::Dashed, |tick| tick.machine),
        curve("net (what acts)", Role::Plain, Mark::Dotted, |tick| tick.net),
    ];
    let quantity = words::action(&session.task);
    Some(Figure {
        caption: view.caption(
            name,
            &thesis,
            &format!("Human, machine and net action at the {when}"),
            format!(
                "The {} that person and robot ask for, and their mix, at the {when} of main: from \
                 {:.0} to {:.0} s of controlled time.",
                quantity.label, first.t, last.t
            ),
        ),
        x: Axis::new("controlled time of main", "s"),
        y: Axis::new(quantity.label, quantity.unit),
        content: Content::Series(
            series.into_iter().filter(|one| one.pieces().next().is_some()).collect(),
        ),
    })
}

/// The receptive fields in the plane of the portraits.
fn fields(view: View<'_>) -> Option<Figure> {
    let session = view.session;
    let plane = words::plane(&session.task);
    let names = &session.features;
    let place = |name: &str| names.iter().position(|other| other == name);
    let columns = column_names(&session.task);
    let (first, second) = (columns[plane.x.0], columns[plane.y.0]);
    let (cos, sin) = (place("cos_theta"), place("sin_theta"));
    // What the learner sees at a point, all else being as at the centre.
    let seen = |centre: &[f64], (x, y): (f64, f64)| {
        let (x, y) = (x / plane.x.1.factor, y / plane.y.1.factor);
        let mut features = centre.to_vec();
        let mut put = |at: Option<usize>, value: f64| {
            if let Some(feature) = at.and_then(|at| features.get_mut(at)) {
                *feature = value;
            }
        };
        put(place(first), x);
        put(place(second), y);
        put(cos, x.cos());
        put(sin, x.sin());
        features
    };
    let middle = |centre: &[f64]| {
        let at = |place: Option<usize>| place.and_then(|at| centre.get(at)).copied();
        let x = at(place(first)).or_else(|| Some(at(sin)?.atan2(at(cos)?)))?;
        Some((x * plane.x.1.factor, at(place(second))? * plane.y.1.factor))
    };
    let centres: Vec<Vec<f64>> = session.fields.iter().map(super::gather::Field::centre).collect();
    let middles: Vec<(f64, f64)> = centres.iter().filter_map(|centre| middle(centre)).collect();
    if middles.is_empty() {
        return None;
    }
    let reach = |of: fn(&(f64, f64)) -> f64| {
        middles.iter().map(|point| of(point).abs()).fold(1e-6, f64::max)
    };
    let scale = (reach(|point| point.0), reach(|point| point.1));
    let outlines: Vec<Vec<(f64, f64)>> = session
        .fields
        .iter()
        .zip(&centres)
        .filter_map(|(field, centre)| {
            Some(field.outline(middle(centre)?, scale, |point| seen(centre, point)))
        })
        .filter(|outline| !outline.is_empty())
        .collect();
    let (x, y) = axes(&plane);
    Some(Figure {
        caption: view.caption(
            "receptive-fields",
            "",
            "Receptive fields in the state space",
            format!(
                "The centres of {} of the final policy, and where each answers with 61 % of its \
                 strength (q = 1), cut at its own centre in all that is not shown.",
                words::counted(session.fields.len(), "receptive field")
            ),
        ),
        x,
        y,
        content: Content::Series(vec![
            Series::new("outline", Role::Machine, Mark::Thin, joined(outlines.iter())),
            Series::new("centre", Role::Plain, Mark::Shape(3), middles),
        ]),
    })
}

/// The names of the state's numbers.
fn column_names(task: &str) -> [&'static str; 4] {
    match task {
        crate::task::mountain_car::MountainCar::NAME => ["x", "v", "", ""],
        _ => ["x", "x_dot", "theta", "theta_dot"],
    }
}
