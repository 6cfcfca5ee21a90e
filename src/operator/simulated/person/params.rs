//! The numbers of a person, whatever is steered.

use serde::{Deserialize, Serialize};

use super::{Character, Span};
use crate::check::{Check, Checker};
use crate::operator::simulated::{BySkill, NaiveAverageExpert, Skill, growth};
use crate::signal::Seconds;

/// A person's parameters in tasks whose practice is counted in time.
///
/// Delay and lag are those of people who track and balance by eye (Milton et al. 2009: 0.1
/// to 0.25 s in all); spreads, noise and growth are ours, as in the cart-pole's balancer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// Skill before any steering.
    pub skill_first: NaiveAverageExpert,
    /// Skill after endless practice.
    pub skill_last: NaiveAverageExpert,
    /// Standard deviation of `skill_last` over operators.
    pub skill_last_sd: NaiveAverageExpert,
    /// Factor on the spread of all personal traits.
    pub trait_spread: NaiveAverageExpert,
    /// Steered time in which the distance to the last skill shrinks to 1/e, s.
    pub practice_s: f64,
    /// How old the state is that the operator acts on, s.
    pub delay_s: BySkill,
    /// Standard deviation of the delay over operators, s.
    pub delay_sd_s: f64,
    /// Standard deviation of the logarithm of each personal factor.
    pub trait_sd: f64,
    /// Correlation time of all wandering errors, s.
    pub noise_correlation_s: f64,
    /// Time constant of the hand, s.
    pub lag_s: f64,
    /// White motor noise before the lag, as a fraction of the wanted action.
    pub motor_noise_fraction: BySkill,
    /// Wandering motor noise, as a part of the largest action.
    pub motor_noise: BySkill,
    /// `intermittent`: a decision is held for a time drawn between these, s.
    pub decision_hold_s: (f64, f64),
    /// `bang-bang`: a push, as a part of the largest wish.
    pub bang: f64,
    /// `bang-bang`: wishes up to this part of the largest one are no push.
    pub bang_threshold: f64,
    /// `mouse-limited`: time constant with which a sustained action fades, s.
    pub travel_s: f64,
    /// `lapses`: how often a wish turns into its opposite, 1/s.
    pub lapses_per_s: BySkill,
    /// `lapses`: how long it does, s.
    pub lapse_s: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            skill_first: (0.05, 0.4, 1.2),
            skill_last: (0.7, 0.9, 1.2),
            skill_last_sd: (0.1, 0.1, 0.0),
            trait_spread: (1.0, 1.0, 0.5),
            practice_s: 300.0,
            delay_s: (0.22, 0.18),
            delay_sd_s: 0.015,
            trait_sd: 0.2,
            noise_correlation_s: 0.15,
            lag_s: 0.05,
            motor_noise_fraction: (0.5, 0.25),
            motor_noise: (0.1, 0.04),
            decision_hold_s: (0.2, 0.3),
            bang: 0.7,
            bang_threshold: 0.15,
            travel_s: 1.0,
            lapses_per_s: (1.0, 0.5),
            lapse_s: 0.2,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        growth::check(
            c,
            [self.skill_first, self.skill_last, self.skill_last_sd, self.trait_spread],
        );
        c.range("practice_s", self.practice_s, 1.0..=1e6);
        c.range("delay_sd_s", self.delay_sd_s, 0.0..=0.2);
        c.range("trait_sd", self.trait_sd, 0.0..=1.0);
        c.range("noise_correlation_s", self.noise_correlation_s, 0.0..=10.0);
        c.range("lag_s", self.lag_s, 0.0..=2.0);
        c.range("bang", self.bang, 0.0..=1.0);
        c.range("bang_threshold", self.bang_threshold, 0.0..=1.0);
        c.range("travel_s", self.travel_s, 0.01..=100.0);
        c.range("lapse_s", self.lapse_s, 0.0..=10.0);
        let pairs = [
            ("delay_s", self.delay_s, 0.0..=1.0),
            ("motor_noise_fraction", self.motor_noise_fraction, 0.0..=5.0),
            ("motor_noise", self.motor_noise, 0.0..=1.0),
            ("lapses_per_s", self.lapses_per_s, 0.0..=100.0),
        ];
        growth::check_pairs(c, pairs);
        growth::check_hold(c, self.decision_hold_s);
    }
}

impl Params {
    /// The numbers of a person with `skill` for wishes up to `wish` and actions up to
    /// `limit`.
    pub(in crate::operator::simulated) fn character(
        &self,
        skill: Skill,
        wish: f64,
        limit: f64,
    ) -> Character {
        Character {
            growth: growth::Growth {
                skill_first: skill.of(self.skill_first),
                skill_last: skill.of(self.skill_last),
                skill_last_sd: skill.of(self.skill_last_sd),
                trait_spread: skill.of(self.trait_spread),
            },
            span: Span::Time(Seconds(self.practice_s)),
            delay_s: self.delay_s,
            delay_sd_s: self.delay_sd_s,
            trait_sd: self.trait_sd,
            noise_correlation_s: self.noise_correlation_s,
            lag_s: self.lag_s,
            motor_noise_fraction: self.motor_noise_fraction,
            motor_noise: (self.motor_noise.0 * limit, self.motor_noise.1 * limit),
            decision_hold_s: self.decision_hold_s,
            bang: self.bang * wish,
            bang_threshold: self.bang_threshold * wish,
            travel_s: self.travel_s,
            lapses_per_s: self.lapses_per_s,
            lapse_s: self.lapse_s,
            limit,
        }
    }
}
