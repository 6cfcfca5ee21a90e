//! What a policy achieves alone, over many starts.

use crate::backend::safety::{Limits, Safe};
use crate::backend::simulated::Simulated;
use crate::clock::{Pacer, VirtualClock};
use crate::control::cycle::{Crew, Cycle, Outcome, Rules};
use crate::control::witness::{self, Witness};
use crate::learner::Model;
use crate::operator::{self, Operator};
use crate::profile::Profile;
use crate::record::EpisodeRow;
use crate::session::Phase;
use crate::session::plan::{Plan, Wanted};
use crate::sharing::Mode;
use crate::signal::Seconds;

/// A simulated plant within its limits.
#[must_use]
pub fn simulated_backend(profile: &Profile, seed: u64) -> Safe {
    let tick = profile.tick();
    let plant = profile.experiment.plant(tick);
    let limit = profile.experiment.task(tick).action_limit();
    let limits = Limits { action: limit, stale: Seconds(3.0 * tick.0) };
    Safe::new(Box::new(Simulated::new(plant, seed)), limits)
}

/// The autonomous rollouts of `learner`, on virtual time, with the starts and the noise
/// that a session of `profile` and `seed` gives its autonomous phase; none when
/// `is_enough` says so in between.
pub fn autonomous(
    profile: &Profile,
    learner: &Model,
    seed: u64,
    is_enough: impl Fn() -> bool,
) -> Option<Vec<EpisodeRow>> {
    alone(profile, learner, seed, &[Phase::Autonomous], is_enough)
}

/// The same, and then nobody on the same starts and noise.
pub fn autonomous_and_nobody(
    profile: &Profile,
    learner: &Model,
    seed: u64,
    is_enough: impl Fn() -> bool,
) -> Option<Vec<EpisodeRow>> {
    alone(profile, learner, seed, &[Phase::Autonomous, Phase::ZeroControl], is_enough)
}

fn alone(
    profile: &Profile,
    learner: &Model,
    seed: u64,
    phases: &[Phase],
    is_enough: impl Fn() -> bool,
) -> Option<Vec<EpisodeRow>> {
    let driver = Driver { learner: learner.clone(), deputy: None };
    let outcome = driven(profile, driver, seed, phases, witness::Nobody, is_enough)?;
    Some(outcome.episodes)
}

/// Who drives where the robot is alone.
pub(super) struct Driver {
    /// The learner,
    pub(super) learner: Model,
    /// or who takes its place.
    pub(super) deputy: Option<Box<dyn Operator>>,
}

/// The rollouts of some of the phases that nobody steers, which `witness` writes down; none when
/// `is_enough` says so in between.
pub(super) fn driven<W: Witness>(
    profile: &Profile,
    driver: Driver,
    seed: u64,
    phases: &[Phase],
    witness: W,
    is_enough: impl Fn() -> bool,
) -> Option<Outcome<W>> {
    let tick = profile.tick();
    let mut session = profile.session.clone();
    session.phases = vec![Wanted::Autonomous];
    session.autonomous_hold_s = 0.0;
    let mut plan = Plan::new(&session, tick, seed, false);
    plan.phases.retain(|plan| phases.contains(&plan.phase));
    let rules = Rules {
        plan,
        tick,
        mode: Mode::Simultaneous,
        sharing: profile.sharing.clone(),
        teaching: profile.teaching.clone(),
        fresh: driver.learner.clone(),
    };
    let crew = Crew {
        task: profile.experiment.task(tick),
        backend: simulated_backend(profile, seed),
        operator: Box::new(operator::Nobody),
        witness,
        publisher: None,
    };
    let mut cycle = Cycle::new(rules, crew, driver.learner, None);
    if let Some(deputy) = driver.deputy {
        cycle = cycle.with_deputy(deputy);
    }
    let mut clock = VirtualClock::default();
    let mut pacer = Pacer::new(&clock);
    while cycle.step(&mut clock, &mut pacer) {
        if is_enough() {
            return None;
        }
    }
    Some(cycle.run(&mut clock))
}
