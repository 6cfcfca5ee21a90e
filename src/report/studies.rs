//! The figures of studies: figures 45–55, and their likenesses for other tasks.

mod maps;

use std::collections::{BTreeMap, BTreeSet};

use super::achieved::yardstick;
use super::figure::{Axis, Caption, Content, Figure, Item, Mark, Role, Section, Series};
use super::gather::Outcome;
use super::gather::{Checkpoint, Sides};
use super::metrics::{deviation, mean};
use super::words;
use crate::task::mountain_car::MountainCar;

/// Pairs that are drawn; all are in the study's own tables.
const MOST_PAIRS: usize = 3;

/// One setting and operator of a study.
struct Part<'a> {
    outcome: &'a Outcome,
    setting: &'a str,
    operator: &'a str,
    preset: String,
    stem: String,
    /// What is compared: each pair of arm and readout.
    sides: Vec<&'a Sides>,
}

/// An arm and how its policy is read.
type Side<'a> = (&'a str, &'a str);

/// The parts of a report that show a study: one for each setting and operator.
#[must_use]
pub fn sections(outcome: &Outcome) -> Vec<Section> {
    let places: BTreeSet<(&str, &str)> =
        outcome.curves.iter().map(|point| (&*point.setting, &*point.operator)).collect();
    let is_one_setting = places.iter().map(|place| place.0).collect::<BTreeSet<_>>().len() == 1;
    places
        .into_iter()
        .map(|(setting, operator)| {
            let mut stem = format!("study-{}-{operator}", outcome.name);
            let mut title = format!("Study {} · {operator}", outcome.name);
            let mut preset = format!("{} · {}", outcome.task, outcome.preset);
            if !is_one_setting {
                stem = format!("{stem}-{setting}");
                title = format!("{title} · {setting}");
                preset = format!("{preset} · setting {setting}");
            }
            let stem =
                stem.replace(|c: char| !(c.is_ascii_alphanumeric() || "-_.".contains(c)), "-");
            let mut sides: Vec<&Sides> = Vec::new();
            for difference in &outcome.generalisation {
                let one = &difference.sides;
                if (&*one.setting, &*one.operator) == (setting, operator) && !sides.contains(&one) {
                    sides.push(one);
                }
            }
            let part = Part { outcome, setting, operator, preset, stem, sides };
            Section { title, notes: part.notes(), items: part.items() }
        })
        .collect()
}

impl<'a> Part<'a> {
    fn is_mountain_car(&self) -> bool {
        self.outcome.task == MountainCar::NAME
    }

    fn caption(&self, name: &str, thesis: &str, title: &str, sentence: String) -> Caption {
        let like = if self.is_mountain_car() { "" } else { "like " };
        Caption {
            name: format!("{}-{name}", self.stem),
            thesis: if thesis.is_empty() { String::new() } else { format!("{like}{thesis}") },
            title: title.to_owned(),
            preset: self.preset.clone(),
            sentence,
        }
    }

    fn notes(&self) -> Vec<String> {
        let runs = self.curves().map(|point| point.run).collect::<BTreeSet<_>>().len();
        let folder = self.outcome.path.display();
        vec![format!(
            "{} in {folder}; the unit is a seed. Intervals and differences seed by seed are in \
             its summary.json.",
            words::counted(runs, "run")
        )]
    }

    fn curves(&self) -> impl Iterator<Item = &'a super::gather::CurvePoint> {
        let (setting, operator) = (self.setting, self.operator);
        let is_here = move |point: &&super::gather::CurvePoint| {
            point.setting == setting && point.operator == operator
        };
        self.outcome.curves.iter().filter(is_here)
    }

    fn items(&self) -> Vec<Item> {
        let starts: Vec<&str> = {
            let mut seen: Vec<&str> = Vec::new();
            for row in self.checkpoints().filter(|row| row.start != "main") {
                if !seen.contains(&&*row.start) {
                    seen.push(&row.start);
                }
            }
            // What was trained comes first.
            seen.sort_by_key(|start| *start != "trained");
            seen
        };
        let mut figures: Vec<Figure> = starts
            .iter()
            .enumerate()
            .filter_map(|(at, start)| self.each_tenth(start, at == 0))
            .collect();
        figures.extend(self.generalisation());
        figures.extend(self.values());
        figures.extend(self.start_by_start());
        figures.extend(self.driven());
        figures.extend(self.curve("success", "figure 54", |point| point.success));
        figures.extend(self.curve("share", "figure 55", |point| point.share));
        figures.into_iter().map(Item::Figure).collect()
    }

    fn checkpoints(&self) -> impl Iterator<Item = &'a Checkpoint> {
        let (setting, operator) = (self.setting, self.operator);
        let is_here = move |row: &&Checkpoint| {
            row.setting == setting && (row.operator == operator || row.operator.is_empty())
        };
        self.outcome.checkpoints.iter().filter(is_here)
    }

    /// The sides of the first pair; where nothing is compared, all arms with their first readout.
    fn compared(&self) -> Vec<Side<'a>> {
        let mut all: Vec<Side<'a>> = Vec::new();
        for one in self.sides.iter().take(1) {
            for side in [(&*one.arm, &*one.readout), (&*one.from_arm, &*one.from_readout)] {
                if !all.contains(&side) {
                    all.push(side);
                }
            }
        }
        if all.is_empty() {
            for row in
                self.checkpoints().filter(|row| row.arm != "reference" && row.start != "main")
            {
                if !all.iter().any(|(arm, _)| *arm == row.arm) {
                    all.push((&row.arm, &row.readout));
                }
            }
        }
        all
    }

    /// The measure that the thesis shows: rewards of the mountain car, else the task's own.
    fn measure(&self, start: &str) -> Option<(&'a str, Axis)> {
        let yard = yardstick(&self.outcome.task);
        let mut names =
            self.checkpoints().filter(|row| row.start == start).map(|row| &*row.measure);
        if self.is_mountain_car() {
            let name = names.find(|name| *name == "mean_return")?;
            return Some((name, Axis::new("reward of a rollout", "")));
        }
        let named =
            |name: &&str| *name == format!("mean_{}", yard.word) || name.starts_with("mean_");
        Some((names.find(named)?, Axis::new(yard.name, yard.unit)))
    }

    fn each_tenth(&self, start: &str, is_first: bool) -> Option<Figure> {
        let (measure, y) = self.measure(start)?;
        let rows: Vec<&Checkpoint> =
            self.checkpoints().filter(|row| row.start == start && row.measure == measure).collect();
        let mut series = Vec::new();
        for (at, (arm, readout)) in self.compared().into_iter().enumerate() {
            let of = rows.iter().filter(|row| (&*row.arm, &*row.readout) == (arm, readout));
            let (mut points, mut spread) = (Vec::new(), Vec::new());
            for row in of {
                let error = row.standard_error.unwrap_or(0.0);
                points.push((f64::from(row.checkpoint), row.mean));
                spread.push((row.mean - error, row.mean + error));
            }
            let label = format!("{arm}, {readout}");
            let mark = if is_dashed(arm, at) { Mark::DashLinked(at) } else { Mark::Linked(at) };
            series.push(Series::new(label, role(arm, at), mark, points).within(spread));
        }
        for (at, row) in rows.iter().filter(|row| row.arm == "reference").enumerate() {
            let ends = vec![(10.0, row.mean), (100.0, row.mean)];
            let mark = match &*row.readout {
                "zero" => Mark::Dotted,
                _ if at % 2 == 0 => Mark::Dashed,
                _ => Mark::Thin,
            };
            series.push(Series::new(&*row.readout, Role::Plain, mark, ends));
        }
        series.retain(|one| !one.points.is_empty());
        let what = &y.label;
        let sentence = format!(
            "The {} of the policies alone after each tenth of main, from the starts \
             “{start}”, ± the standard error over the seeds.",
            words::mean_of(what)
        );
        let thesis = if is_first { "figure 45" } else { "like figure 45" };
        let title = format!("{} of the policies after each tenth, {start}", words::heading(what));
        let mut caption = self.caption(&format!("tenths-{start}"), thesis, &title, sentence);
        caption.thesis = caption.thesis.replace("like like", "like");
        (!series.is_empty()).then(|| Figure {
            caption,
            x: Axis::new("part of main", "%").from(0.0, 100.0),
            y,
            content: Content::Series(series),
        })
    }

    fn generalisation(&self) -> Vec<Figure> {
        let curve = |of: fn(&super::gather::Difference) -> Option<f64>| {
            let series = self.sides.iter().take(MOST_PAIRS).enumerate().map(|(at, sides)| {
                let rows = self.outcome.generalisation.iter().filter(|row| row.sides == **sides);
                let points = rows.filter_map(|row| Some((f64::from(row.checkpoint), of(row)?)));
                Series::new(pair(sides), Role::One(at), Mark::Linked(at), points.collect())
            });
            series.filter(|one| !one.points.is_empty()).collect::<Vec<_>>()
        };
        let normalised = curve(|row| row.normalised_return);
        let relative = curve(|row| row.relative_to_best);
        let figure =
            |name: &str, thesis: &str, title: &str, sentence: &str, y: &str, series| Figure {
                caption: self.caption(name, thesis, title, sentence.to_owned()),
                x: Axis::new("part of main", "%").from(0.0, 100.0),
                y: Axis::new(y, ""),
                content: Content::Series(series),
            };
        let figures = [
            figure(
                "generalisation",
                "figure 46",
                "Generalisation, as the thesis takes it",
                "The difference of normalised rewards, averaged over all starts and seeds, after \
                 each tenth of main: above 0 the first of the two is better. Returns are divided \
                 by the best of any run from the same start, so that starts whose best is near 0 \
                 or negative weigh heavily or turn the sign.",
                "difference of normalised reward",
                normalised,
            ),
            figure(
                "generalisation-to-best",
                "",
                "Generalisation, by how near the best each comes",
                "The same with best/steps in place of rewards: 1 is as good as the best run from \
                 a start.",
                "difference of nearness to the best",
                relative,
            ),
        ];
        let is_drawn =
            |figure: &Figure| matches!(&figure.content, Content::Series(of) if !of.is_empty());
        figures.into_iter().filter(is_drawn).collect()
    }

    /// The best run of each arm, where the study tells.
    fn best_runs(&self) -> BTreeMap<&'a str, u32> {
        let runs = self.outcome.trajectories.iter().map(|row| (&row.setting, &row.arm, row.run));
        let tables = self.outcome.values.iter().map(|row| (&row.setting, &row.arm, row.run));
        let here: BTreeSet<u32> = self.curves().map(|point| point.run).collect();
        runs.chain(tables)
            .filter(|(setting, _, run)| *setting == self.setting && here.contains(run))
            .map(|(_, arm, run)| (&**arm, run))
            .collect()
    }

    /// Success or share along main: of the best simultaneous run, or of all runs where no best is
    /// told.
    fn curve(
        &self,
        what: &str,
        thesis: &str,
        of: fn(&super::gather::CurvePoint) -> f64,
    ) -> Option<Figure> {
        let best = self.best_runs();
        let best = best.iter().find(|(arm, _)| arm.contains("simultaneous")).map(|(_, run)| *run);
        let label = if what == "share" { "person's share w" } else { "success" };
        let (series, sentence, thesis) = if let Some(run) = best {
            let points = self.curves().filter(|point| point.run == run);
            let points = points.map(|p| (f64::from(p.episode), 100.0 * of(p))).collect();
            let series =
                Series::new("best simultaneous run", Role::Simultaneous, Mark::Line, points);
            let sentence = format!(
                "The {label} during main in the best simultaneous run (run {run} of the plan)."
            );
            (vec![series], sentence, thesis.to_owned())
        } else {
            let mut arms: BTreeMap<&str, BTreeMap<u32, Vec<f64>>> = BTreeMap::new();
            for point in self.curves() {
                let at = arms.entry(&point.arm).or_default().entry(point.episode).or_default();
                at.push(100.0 * of(point));
            }
            let series = arms.into_iter().enumerate().map(|(at, (arm, episodes))| {
                let (mut points, mut spread) = (Vec::new(), Vec::new());
                for (episode, values) in episodes {
                    let (mean, sd) = (mean(&values), deviation(&values).unwrap_or(0.0));
                    points.push((f64::from(episode), mean));
                    spread.push((mean - sd, mean + sd));
                }
                let mark = if is_dashed(arm, at) { Mark::Dashed } else { Mark::Line };
                Series::new(arm, role(arm, at), mark, points).within(spread)
            });
            let sentence =
                format!("The {label} during main, mean ± standard deviation over seeds.");
            (series.collect(), sentence, format!("like {thesis}"))
        };
        let mut caption = self.caption(what, &thesis, &words::heading(label), sentence);
        caption.thesis = caption.thesis.replace("like like", "like");
        (!series.is_empty()).then(|| Figure {
            caption,
            x: Axis::whole("rollout"),
            y: Axis::new(label, "%").from(0.0, 100.0),
            content: Content::Series(series),
        })
    }
}

/// The colour of `arm`, the `at`-th of those shown.
fn role(arm: &str, at: usize) -> Role {
    match arm {
        "simultaneous" if at < 2 => Role::Simultaneous,
        "sequential" if at < 2 => Role::Sequential,
        _ => Role::One(at),
    }
}

/// Whether the lines of `arm`, the `at`-th of those shown, are dashed: those of a mode as everywhere.
fn is_dashed(arm: &str, at: usize) -> bool {
    match arm {
        "simultaneous" => false,
        "sequential" => true,
        _ => at % 2 == 1,
    }
}

/// What is compared, in words.
fn pair(sides: &Sides) -> String {
    let Sides { arm, readout, from_arm, from_readout, .. } = sides;
    format!("{arm} {readout} − {from_arm} {from_readout}")
}
