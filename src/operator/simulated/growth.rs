//! How skill grows, and the checks that all operators' parameters share.

use std::ops::RangeInclusive;

use crate::check::Checker;

/// A value at skill 0 and at skill 1; between and beyond, the line through both.
pub type BySkill = (f64, f64);

/// A value for each of [`Skill::ALL`](super::Skill::ALL).
pub type NaiveAverageExpert = (f64, f64, f64);

/// How an operator's skill grows, and how much operators differ.
///
/// Skill 0 is a first try, 1 a practised hand; above 1 the values are extrapolated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Skill before any practice.
    pub skill_first: f64,
    /// Skill after endless practice.
    pub skill_last: f64,
    /// Standard deviation of `skill_last` over operators.
    pub skill_last_sd: f64,
    /// Factor on the spread of all personal traits.
    pub trait_spread: f64,
}

/// Checks `skill_first`, `skill_last`, `skill_last_sd` and `trait_spread`.
pub(super) fn check(c: &mut Checker<'_>, triples: [NaiveAverageExpert; 4]) {
    let keys = [
        ("skill_first", 0.0..=2.0),
        ("skill_last", 0.0..=2.0),
        ("skill_last_sd", 0.0..=0.5),
        ("trait_spread", 0.0..=5.0),
    ];
    for ((key, range), (naive, average, expert)) in keys.into_iter().zip(triples) {
        for value in [naive, average, expert] {
            c.range(key, value, range.clone());
        }
    }
}

/// Checks both values of each key.
pub(super) fn check_pairs<const N: usize>(
    c: &mut Checker<'_>,
    pairs: [(&str, BySkill, RangeInclusive<f64>); N],
) {
    for (key, (first, second), range) in pairs {
        c.range(key, first, range.clone());
        c.range(key, second, range);
    }
}

/// Checks `decision_hold_s`.
pub(super) fn check_hold(c: &mut Checker<'_>, (shortest, longest): (f64, f64)) {
    check_pairs(c, [("decision_hold_s", (shortest, longest), 0.0..=10.0)]);
    c.demand(
        shortest <= longest,
        "decision_hold_s",
        format!("({shortest}, {longest})"),
        "the shorter time first",
    );
}
