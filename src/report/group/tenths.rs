//! What the robots of a group do alone after each tenth of main: figures 37 and 38.

use std::collections::{BTreeMap, BTreeSet};

use super::{Group, mean};
use crate::record::EpisodeRow;
use crate::report::achieved::{Achieved, yardstick};
use crate::report::figure::{Axis, Content, Figure, SHAPES, Series};
use crate::report::gather::Recorded;
use crate::report::session::{linked, measure, role, subject, with_unit};
use crate::report::words;
use crate::sharing::Mode;

/// A subject, and its means by percent of main.
type Tenths<'a> = (&'a str, BTreeMap<u8, f64>);

/// What the policy of each tenth is measured by alone: percent and mean.
pub(super) fn tenths(session: &Recorded) -> BTreeMap<u8, f64> {
    let mut rows: BTreeMap<u8, Vec<&EpisodeRow>> = BTreeMap::new();
    for (percent, row) in &session.tenths {
        rows.entry(*percent).or_default().push(row);
    }
    let mean_of = |(percent, rows): (u8, Vec<&EpisodeRow>)| {
        Some((percent, Achieved::of(&session.task, &rows).mean()?))
    };
    rows.into_iter().filter_map(mean_of).collect()
}

impl<'a> Group<'a> {
    /// Each subject's means after each tenth, by mode.
    fn after_tenths(&self) -> Vec<(Mode, Vec<Tenths<'a>>)> {
        let arms = self.arms().into_iter().map(|(mode, arm)| {
            let known = arm.iter().map(|subject| {
                let each: Vec<BTreeMap<u8, f64>> =
                    subject.sessions.iter().map(|session| tenths(session)).collect();
                let percents: BTreeSet<u8> =
                    each.iter().flat_map(BTreeMap::keys).copied().collect();
                let at = |percent: u8| {
                    let values: Vec<f64> =
                        each.iter().filter_map(|one| one.get(&percent)).copied().collect();
                    // Of sessions that all have it: others would be other means.
                    (values.len() == each.len()).then(|| (percent, mean(&values)))
                };
                (subject.name, percents.into_iter().filter_map(at).collect::<BTreeMap<_, _>>())
            });
            (mode, known.filter(|(_, tenths)| !tenths.is_empty()).collect::<Vec<_>>())
        });
        arms.filter(|(_, known)| !known.is_empty()).collect()
    }

    pub(super) fn each_tenth(&self) -> Option<Figure> {
        let axis = measure(self.task);
        let mut series = Vec::new();
        for (mode, subjects) in self.after_tenths() {
            for (at, (name, tenths)) in subjects.into_iter().enumerate() {
                let points = tenths.into_iter().map(|(percent, v)| (f64::from(percent), v));
                let label = format!("{name} ({})", mode.word());
                let role = role(mode);
                series.push(Series::new(label, role, subject(mode, at), points.collect()));
            }
        }
        let sentence = format!(
            "The {} of each subject's robot alone after each tenth of main; colours and lines \
             tell the groups apart, shapes the subjects{}.",
            words::mean_of(&axis.label),
            if self.arms().iter().any(|(_, arm)| arm.len() > SHAPES) {
                ", six of a group at a time"
            } else {
                ""
            }
        );
        let title = format!("{} of the robot alone after each tenth", words::heading(&axis.label));
        (!series.is_empty()).then(|| Figure {
            caption: self.caption("tenths", 37, &title, sentence),
            x: Axis::new("part of main", "%").from(0.0, 100.0),
            y: Axis { range: None, ..axis },
            content: Content::Series(series),
        })
    }

    pub(super) fn improvement(&self) -> Option<Figure> {
        let axis = measure(self.task);
        // A ratio says nothing of heights, which may be negative, nor of steps that shall be few.
        let by_ratio = axis.range.is_none() && yardstick(self.task).more_is_better;
        let sign = if yardstick(self.task).more_is_better { 1.0 } else { -1.0 };
        let (mut series, mut told) = (Vec::new(), Vec::new());
        let all = self.after_tenths();
        let percents: BTreeSet<u8> =
            all.iter().flat_map(|(_, arm)| arm).flat_map(|(_, t)| t.keys()).copied().collect();
        if percents.first() != Some(&10) {
            return None;
        }
        let mut lacking = BTreeSet::new();
        for (mode, mut subjects) in all {
            // A mean of others at the end than at the beginning would be no improvement.
            subjects.retain(|(name, tenths)| {
                let has_all = tenths.len() == percents.len();
                lacking.extend((!has_all).then_some(*name));
                has_all
            });
            if subjects.is_empty() {
                continue;
            }
            let means: Vec<(f64, f64)> = percents
                .iter()
                .map(|&percent| {
                    let values: Vec<f64> =
                        subjects.iter().filter_map(|(_, t)| t.get(&percent)).copied().collect();
                    (f64::from(percent), mean(&values))
                })
                .collect();
            let first = means.first()?.1;
            let better = |value: f64| {
                if by_ratio { 100.0 * (value / first - 1.0) } else { sign * (value - first) }
            };
            let points: Vec<(f64, f64)> = means.iter().map(|(x, y)| (*x, better(*y))).collect();
            if let Some((_, last)) = points.last() {
                let last =
                    if by_ratio { format!("{last:.0} %") } else { with_unit(self.task, *last) };
                told.push(format!("{} {last}", mode.word()));
            }
            series.push(Series::new(mode.word(), role(mode), linked(mode), points));
        }
        let sentence = format!(
            "How much better the mean of each group's robots alone is than after the first tenth \
             of main; at the end {}.{}",
            told.join(", "),
            if lacking.is_empty() {
                String::new()
            } else {
                let names: Vec<&str> = lacking.into_iter().collect();
                format!(" Without {}: a number of some tenth is missing.", names.join(", "))
            }
        );
        let title = "Improvement of the robot alone over the first tenth";
        let y = if by_ratio {
            Axis::new("improvement", "%")
        } else {
            Axis::new(format!("improvement of {}", axis.label), axis.unit)
        };
        (!series.is_empty()).then(|| Figure {
            caption: self.caption("improvement", 38, title, sentence),
            x: Axis::new("part of main", "%").from(0.0, 100.0),
            y,
            content: Content::Series(series),
        })
    }
}
