//! What the learner is given of each tick, between the tick and the learner.
//!
//! The thesis's lesson is plain: in this state the person did that. Three parts of ours, each
//! with a switch of its own, teach more of what a person means:
//!
//! - **Delay compensation** (`delay_s`): people act on what they saw a moment ago, so an
//!   action belongs to the state of that moment.
//! - **Outcome weighting** (`outcome_s`): a sample weighs more the more the task's cost fell
//!   afterwards, and hardly anything where a failure followed.
//! - **Executed target** (`target: executed`): while control is shared, the outcome is that
//!   of the mixed action u, so u is what is learned.
//!
//! A [`Teacher`] remembers as many ticks as these need and hands out lessons as they ripen.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::check::{Check, Checker};
use crate::signal::{Features, Intent, Seconds};

/// Which action is the learner's target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// What the person did, u_h: the thesis's.
    #[default]
    Human,
    /// What the plant received, u.
    Executed,
}

impl Target {
    /// The column of a session's rows that holds it.
    #[must_use]
    pub const fn column(self) -> &'static str {
        match self {
            Self::Human => "u_human",
            Self::Executed => "u_applied",
        }
    }
}

/// The parameters of teaching; the defaults are the thesis's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// Which action is the learner's target.
    pub target: Target,
    /// An action belongs to the state of this long before, s; 0: to that of its own tick.
    pub delay_s: f64,
    /// The regions in which that holds, by name; empty: all.
    pub delay_regions: Vec<String>,
    /// A sample weighs by how the cost changed within this time, s; `None`: all weigh 1.
    pub outcome_s: Option<f64>,
    /// A cost that falls by this much makes a sample weigh e times as much.
    pub outcome_scale: f64,
    /// The least that a sample weighs, and what one before a failure does,
    pub outcome_least: f64,
    /// and the most.
    pub outcome_most: f64,
    /// Whether nothing is learned before the gate of `sharing` opens (4.3).
    pub from_gate: bool,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            target: Target::Human,
            delay_s: 0.0,
            delay_regions: Vec::new(),
            outcome_s: None,
            outcome_scale: 0.02,
            outcome_least: 0.02,
            outcome_most: 3.0,
            from_gate: false,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.range("delay_s", self.delay_s, 0.0..=2.0);
        if let Some(outcome) = self.outcome_s {
            c.range("outcome_s", outcome, 0.001..=5.0);
        }
        c.range("outcome_scale", self.outcome_scale, 1e-9..=1e6);
        c.range("outcome_least", self.outcome_least, 0.0..=1.0);
        c.range("outcome_most", self.outcome_most, 1.0..=100.0);
    }
}

/// One sample for the learner: at `x` do `y`, weighing `weight`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lesson {
    /// The features of the state that the action belongs to.
    pub x: Features,
    /// The action to be learned.
    pub y: f64,
    /// How much the sample counts; 1 is the thesis's.
    pub weight: f64,
}

/// A tick as the teacher sees it.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// The features of its state.
    pub features: Features,
    /// The region of its state.
    pub region: usize,
    /// The cost of its state.
    pub cost: f64,
    /// What the person wanted; an absent one teaches nothing,
    pub human: Intent,
    /// what the plant received,
    pub applied: f64,
    /// and whether it is learned at all: not in a region whose learner is frozen.
    pub teaches: bool,
}

/// Makes lessons of the ticks of one rollout after the other.
#[derive(Clone, Debug)]
pub struct Teacher {
    params: Params,
    delay_ticks: usize,
    /// Which regions are delayed, by index.
    is_delayed: Vec<bool>,
    outcome_ticks: Option<usize>,
    /// The rollout's latest features, the newest last, for the delay.
    seen: VecDeque<Features>,
    /// Samples whose outcome is not known yet, the oldest first, with the cost they began
    /// at; a tick that teaches nothing is `None`.
    open: VecDeque<(f64, Option<Lesson>)>,
}

impl Teacher {
    /// A teacher for ticks of `tick` in a task with these `regions`.
    #[must_use]
    pub fn new(params: &Params, tick: Seconds, regions: &[&str]) -> Self {
        let ticks = |seconds: f64| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "checked: a few seconds of ticks of a millisecond or more"
            )]
            let ticks = (seconds / tick.0).round() as usize;
            ticks
        };
        let delay_ticks = ticks(params.delay_s);
        let outcome_ticks = params.outcome_s.map(|seconds| ticks(seconds).max(1));
        let is_delayed = regions
            .iter()
            .map(|name| {
                params.delay_regions.is_empty()
                    || params.delay_regions.iter().any(|delayed| delayed == name)
            })
            .collect();
        Self {
            params: params.clone(),
            delay_ticks,
            is_delayed,
            outcome_ticks,
            seen: VecDeque::with_capacity(delay_ticks + 1),
            open: VecDeque::with_capacity(outcome_ticks.unwrap_or(0) + 1),
        }
    }

    /// A rollout begins: nothing was seen of it before.
    pub fn begin(&mut self) {
        self.seen.clear();
        self.open.clear();
    }

    /// What was seen of late, the newest last.
    #[must_use]
    pub fn seen(&self) -> Vec<Features> {
        self.seen.iter().copied().collect()
    }

    /// The rollout that just began goes on from one of which this was [`seen`](Self::seen)
    /// last.
    pub fn go_on(&mut self, seen: &[Features]) {
        self.seen.clear();
        // Not more than a delay needs, whatever a checkpoint holds.
        self.seen.extend(seen.iter().rev().take(self.delay_ticks + 1).rev());
    }

    /// A control tick; returns the lesson that is ripe at it, if one is.
    pub fn see(&mut self, sight: &Sight) -> Option<Lesson> {
        if self.seen.len() > self.delay_ticks {
            self.seen.pop_front();
        }
        self.seen.push_back(sight.features);
        let lesson = self.lesson(sight);
        let Some(ticks) = self.outcome_ticks else { return lesson };
        let ripe = (self.open.len() >= ticks).then(|| self.open.pop_front()).flatten();
        self.open.push_back((sight.cost, lesson));
        ripe.and_then(|(cost, lesson)| self.weigh(lesson, sight.cost - cost))
    }

    /// The rollout is over; hands out the lessons that were not ripe yet, one a call. They
    /// weigh by the cost of the last state, or least where the rollout `failed`.
    pub fn close(&mut self, failed: bool, cost: f64) -> Option<Lesson> {
        while let Some((before, lesson)) = self.open.pop_front() {
            let change = if failed { f64::INFINITY } else { cost - before };
            let ripe = self.weigh(lesson, change);
            if ripe.is_some() {
                return ripe;
            }
        }
        None
    }

    /// The lesson of a tick before its outcome is known.
    fn lesson(&self, sight: &Sight) -> Option<Lesson> {
        let Intent::Present { action, .. } = sight.human else { return None };
        let y = match self.params.target {
            Target::Human => action.0,
            Target::Executed => sight.applied,
        };
        // Before a rollout's first tick the plant was held where it was let go, unless the
        // rollout goes on from another.
        let is_delayed = self.is_delayed.get(sight.region).copied().unwrap_or(true);
        let seen = if is_delayed { self.seen.front() } else { self.seen.back() };
        let x = seen.copied().unwrap_or(sight.features);
        sight.teaches.then_some(Lesson { x, y, weight: 1.0 })
    }

    /// `lesson`, weighing by how the cost changed after it.
    fn weigh(&self, lesson: Option<Lesson>, change: f64) -> Option<Lesson> {
        let (least, most) = (self.params.outcome_least, self.params.outcome_most);
        let weight = (-change / self.params.outcome_scale).exp();
        // A change that is not a number is no good outcome.
        let weight = if weight.is_nan() { least } else { weight.clamp(least, most) };
        lesson.filter(|_| weight > 0.0).map(|lesson| Lesson { weight, ..lesson })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sight(k: u32, human: Intent) -> Sight {
        let x = f64::from(k);
        Sight {
            features: Features::new([x]),
            region: 0,
            cost: -0.01 * x,
            human,
            applied: 100.0 + x,
            teaches: true,
        }
    }

    fn taught(params: &Params, ticks: u32, failed: bool) -> Vec<Lesson> {
        let mut teacher = Teacher::new(params, Seconds(0.02), &["all"]);
        teacher.begin();
        let mut lessons: Vec<Lesson> = (0..ticks)
            .filter_map(|k| teacher.see(&sight(k, Intent::fresh(f64::from(k)))))
            .collect();
        let last = -0.01 * f64::from(ticks);
        lessons.extend(std::iter::from_fn(|| teacher.close(failed, last)));
        lessons
    }

    #[test]
    fn an_idle_hand_teaches_zero_and_an_absent_one_nothing() {
        let mut thesis = Teacher::new(&Params::default(), Seconds(0.02), &["all"]);
        let idle = thesis.see(&sight(3, Intent::fresh(0.0))).unwrap();
        assert_eq!((idle.x[0], idle.y, idle.weight), (3.0, 0.0, 1.0));
        assert_eq!(thesis.see(&sight(4, Intent::Absent)), None);
        let executed = Params { target: Target::Executed, ..Params::default() };
        let mut executed = Teacher::new(&executed, Seconds(0.02), &["all"]);
        assert_eq!(executed.see(&sight(5, Intent::fresh(0.0))).unwrap().y, 105.0);
        let frozen = Sight { teaches: false, ..sight(6, Intent::fresh(0.0)) };
        assert_eq!(executed.see(&frozen), None);
    }

    #[test]
    fn a_delayed_action_belongs_to_the_state_seen_before_and_first_to_the_start() {
        let params = Params { delay_s: 0.06, ..Params::default() };
        let lessons = taught(&params, 6, false);
        let pairs: Vec<(f64, f64)> = lessons.iter().map(|l| (l.x[0], l.y)).collect();
        assert_eq!(pairs, [(0., 0.), (0., 1.), (0., 2.), (0., 3.), (1., 4.), (2., 5.)]);
    }

    #[test]
    fn only_the_named_regions_are_delayed() {
        let params =
            Params { delay_s: 0.04, delay_regions: vec!["top".to_owned()], ..Params::default() };
        let mut teacher = Teacher::new(&params, Seconds(0.02), &["down", "top"]);
        let mut at = |k, region| {
            let seen = Sight { region, ..sight(k, Intent::fresh(1.0)) };
            teacher.see(&seen).unwrap().x[0]
        };
        assert_eq!([at(0, 0), at(1, 0), at(2, 1), at(3, 0), at(4, 1)], [0.0, 1.0, 0.0, 3.0, 2.0]);
    }

    #[test]
    fn a_sample_weighs_by_what_came_of_it() {
        let params = Params { outcome_s: Some(0.1), ..Params::default() };
        let lessons = taught(&params, 9, false);
        assert_eq!(lessons.len(), 9, "every sample is handed out once");
        let order: Vec<f64> = lessons.iter().map(|lesson| lesson.y).collect();
        assert!(order.is_sorted());
        // Five ticks lower the cost by 0.05: exp(2.5) is cut to the most.
        assert!(lessons[..4].iter().all(|lesson| lesson.weight == 3.0));
        // The last one had a single tick.
        assert!((lessons[8].weight - 0.5_f64.exp()).abs() < 1e-12);
        let failed = taught(&params, 9, true);
        assert!(failed[4..].iter().all(|lesson| lesson.weight == 0.02));
        assert_eq!(failed[..4], lessons[..4]);
    }

    #[test]
    fn a_new_rollout_knows_nothing_of_the_one_before() {
        let params = Params { delay_s: 0.06, outcome_s: Some(0.04), ..Params::default() };
        let mut teacher = Teacher::new(&params, Seconds(0.02), &["all"]);
        for k in 0..9 {
            teacher.see(&sight(k, Intent::fresh(0.0)));
        }
        teacher.begin();
        assert_eq!(teacher.see(&sight(50, Intent::fresh(0.0))), None);
        assert_eq!(teacher.close(false, 0.0).unwrap().x[0], 50.0);
        assert_eq!(teacher.close(false, 0.0), None);
    }

    #[test]
    fn a_rollout_that_goes_on_remembers_what_was_seen_before() {
        let params = Params { delay_s: 0.06, ..Params::default() };
        let teacher = || Teacher::new(&params, Seconds(0.02), &["all"]);
        let (mut whole, mut first) = (teacher(), teacher());
        let see = |teacher: &mut Teacher, k| teacher.see(&sight(k, Intent::fresh(f64::from(k))));
        for k in 0..9 {
            see(&mut whole, k);
            see(&mut first, k);
        }
        let mut second = teacher();
        second.begin();
        second.go_on(&first.seen());
        for k in 9..15 {
            assert_eq!(see(&mut second, k), see(&mut whole, k));
        }
    }

    mod properties {
        use super::*;
        use proptest::prelude::*;

        proptest! {
            /// Whatever the parameters, each tick's sample comes out once, in order, within
            /// the allowed weights.
            #[test]
            fn every_sample_is_handed_out_once_and_in_order(
                delay_s in 0.0..0.5_f64,
                outcome_s in prop::option::of(0.001..0.5_f64),
                outcome_least in 0.001..1.0_f64,
                failed: bool,
                costs in prop::collection::vec(-1e3..1e3_f64, 1..60),
            ) {
                let params = Params { delay_s, outcome_s, outcome_least, ..Params::default() };
                let mut teacher = Teacher::new(&params, Seconds(0.02), &["all"]);
                teacher.begin();
                let mut lessons = Vec::new();
                for (k, &cost) in (0..).zip(&costs) {
                    let human = Intent::fresh(f64::from(k));
                    lessons.extend(teacher.see(&Sight { cost, ..sight(k, human) }));
                }
                lessons.extend(std::iter::from_fn(|| teacher.close(failed, 0.0)));
                let order: Vec<f64> = lessons.iter().map(|lesson| lesson.y).collect();
                let expected: Vec<f64> = (0..).take(costs.len()).map(f64::from).collect();
                prop_assert_eq!(order, expected);
                for lesson in &lessons {
                    let in_bounds = (outcome_least..=params.outcome_most).contains(&lesson.weight);
                    prop_assert!(in_bounds || outcome_s.is_none() && lesson.weight == 1.0);
                    prop_assert!(lesson.x[0] <= lesson.y, "no state of the future");
                }
            }
        }
    }
}
