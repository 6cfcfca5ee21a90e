//! The session as a pure state machine: (plan, stage, event) → (stage, effects).
//!
//! ```text
//!             Begin             countdown over            rollout over
//! Instruction ─────▶ Hold ───────────────────▶ Running ───────────────▶ Hold (next rollout)
//!      ▲              ▲ ▲                        │  │                   or Break (next phase)
//!      │ over, Begin  │ └─── Discard ────────────┤  │ Pause             or Finished
//!    Break            └────────── resume ────────┼─ Paused
//!                                                └─ Stop ──▶ Stopped ──Begin──▶ Hold
//! ```
//!
//! Without a person (`attended` false) instructions and breaks are left out. Abort ends
//! the session from anywhere.

use serde::{Deserialize, Serialize};

use super::plan::Plan;
use super::{Moment, Phase};
use crate::signal::End;

/// What a session is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// The phase's instruction is on the screen until somebody begins.
    Instruction(Moment),
    /// A rest before the phase's instruction.
    Break {
        /// What comes after it.
        next: Moment,
        /// How long it lasts.
        ticks_left: u32,
    },
    /// The plant is held still and the countdown runs.
    Hold {
        /// The rollout that comes after it, or goes on.
        moment: Moment,
        /// How long it lasts.
        ticks_left: u32,
    },
    /// The plant is under control.
    Running(Moment),
    /// Somebody paused; the plant is held.
    Paused(Moment),
    /// Somebody pressed the emergency stop; the plant is held until somebody begins again.
    Stopped(Moment),
    /// All is over.
    Finished(Finish),
}

/// How a session finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Finish {
    /// All phases took place.
    Complete,
    /// Somebody or something ended it before.
    Aborted,
}

impl Stage {
    /// The moment of the session that the stage belongs to.
    #[must_use]
    pub const fn moment(&self) -> Option<Moment> {
        match *self {
            Self::Instruction(moment)
            | Self::Break { next: moment, .. }
            | Self::Hold { moment, .. }
            | Self::Running(moment)
            | Self::Paused(moment)
            | Self::Stopped(moment) => Some(moment),
            Self::Finished(_) => None,
        }
    }
}

/// What can happen to a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Somebody is ready: the instruction is read, the break long enough, the stop cleared.
    Begin,
    /// A control tick is over; in a running rollout, with the end that the task saw.
    Tick(Option<End>),
    /// Pause, or go on.
    Pause,
    /// Throw this rollout away and repeat it from the same start.
    Discard,
    /// Emergency stop.
    Stop,
    /// End the session.
    Abort,
}

/// What the control cycle has to do about a transition, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Stop the plant.
    Halt,
    /// A phase begins: main gets a fresh learner, full share and an empty window.
    Enter(Phase),
    /// Put the plant to the rollout's start, tell the operator, remember all that a
    /// discard would restore.
    Prepare(Moment),
    /// The same, but the plant goes on where it is.
    GoOn(Moment),
    /// The plant is let go.
    Release(Moment),
    /// The rollout is over.
    Close {
        /// The rollout and how far it came.
        moment: Moment,
        /// Why.
        end: End,
    },
    /// Learner, window and share become what they were at the rollout's start.
    Restore,
    /// A phase is over.
    Leave(Phase),
    /// The session is over.
    Finish(Finish),
}

/// The stage and effects that a session begins with, at `from` or at the plan's beginning.
/// `goes_on` says that the rollout of `from` went on from the one before: where nobody is
/// there to get ready, it does so again, without a countdown.
#[must_use]
pub fn begin(plan: &Plan, from: Option<Moment>, goes_on: bool) -> (Stage, Vec<Effect>) {
    match from.or_else(|| plan.phases.first().map(|p| Moment::start_of(p.phase))) {
        Some(moment) if goes_on && !plan.attended => {
            (Stage::Running(moment), vec![Effect::Prepare(moment), Effect::Release(moment)])
        }
        // A resumed phase goes on: entering it would forget what was learned.
        Some(moment) if from.is_some() && moment.rollout > 1 => arrive(plan, moment, Vec::new()),
        Some(moment) => arrive(plan, moment, vec![Effect::Enter(moment.phase)]),
        None => (Stage::Finished(Finish::Complete), vec![Effect::Finish(Finish::Complete)]),
    }
}

/// The stage after `event`, and what to do. Events without a meaning in a stage leave it
/// as it is.
#[must_use]
pub fn transition(plan: &Plan, stage: Stage, event: Event) -> (Stage, Vec<Effect>) {
    use Effect::{Close, Halt, Restore};
    match (stage, event) {
        (Stage::Finished(_), _) => (stage, vec![]),

        (
            Stage::Running(moment) | Stage::Paused(moment) | Stage::Hold { moment, .. },
            Event::Abort,
        ) if moment.step > 0 => {
            let (stage, mut effects) = finish(Finish::Aborted);
            effects.splice(0..0, [Halt, Close { moment, end: End::Aborted }]);
            (stage, effects)
        }
        (_, Event::Abort) => {
            let (stage, mut effects) = finish(Finish::Aborted);
            effects.insert(0, Halt);
            (stage, effects)
        }

        (
            Stage::Running(moment) | Stage::Paused(moment) | Stage::Hold { moment, .. },
            Event::Stop,
        ) => {
            let effects = if moment.step > 0 {
                vec![Halt, Close { moment, end: End::Discarded }, Restore]
            } else {
                vec![Halt]
            };
            (Stage::Stopped(again(moment)), effects)
        }
        (_, Event::Stop) => (stage, vec![Halt]),

        (Stage::Stopped(moment) | Stage::Instruction(moment), Event::Begin) => {
            prepare(plan, moment, vec![])
        }
        (Stage::Break { next, .. }, Event::Begin) => (Stage::Instruction(next), vec![]),
        (Stage::Break { next, ticks_left: 0 | 1 }, Event::Tick(_)) => {
            (Stage::Instruction(next), vec![])
        }
        (Stage::Break { next, ticks_left }, Event::Tick(_)) => {
            (Stage::Break { next, ticks_left: ticks_left - 1 }, vec![])
        }

        (Stage::Hold { moment, ticks_left: 0 | 1 }, Event::Tick(_)) => {
            (Stage::Running(moment), vec![Effect::Release(moment)])
        }
        (Stage::Hold { moment, ticks_left }, Event::Tick(_)) => {
            (Stage::Hold { moment, ticks_left: ticks_left - 1 }, vec![])
        }
        (Stage::Hold { moment, .. }, Event::Pause) => (Stage::Paused(moment), vec![]),

        (Stage::Running(moment), Event::Tick(end)) => step(plan, moment, end),
        (Stage::Running(moment), Event::Pause) => (Stage::Paused(moment), vec![Halt]),
        (
            Stage::Running(moment) | Stage::Paused(moment) | Stage::Hold { moment, .. },
            Event::Discard,
        ) if moment.step > 0 && moment.phase.is_steered() => {
            let effects = vec![Halt, Close { moment, end: End::Discarded }, Restore];
            prepare(plan, again(moment), effects)
        }
        (Stage::Paused(moment), Event::Pause | Event::Begin) => {
            (Stage::Hold { moment, ticks_left: plan.hold_ticks(moment.phase) }, vec![])
        }
        _ => (stage, vec![]),
    }
}

/// The same rollout once more; as it was when it has not begun yet.
const fn again(moment: Moment) -> Moment {
    let attempt = if moment.step > 0 { moment.attempt.saturating_add(1) } else { moment.attempt };
    Moment { step: 0, attempt, ..moment }
}

/// A controlled step is over.
fn step(plan: &Plan, moment: Moment, end: Option<End>) -> (Stage, Vec<Effect>) {
    let moment = Moment { step: moment.step + 1, ..moment };
    let steps = moment.steps_before + u64::from(moment.step);
    let phase_plan = plan.phase(moment.phase);
    let time_is_over = phase_plan.and_then(|p| p.steps).is_some_and(|all| steps >= all);
    let Some(end) = end.or(time_is_over.then_some(End::Time)) else {
        return (Stage::Running(moment), vec![]);
    };
    let mut effects = vec![Effect::Halt, Effect::Close { moment, end }];
    let rollouts_are_over =
        phase_plan.and_then(|p| p.rollouts).is_some_and(|all| moment.rollout >= all);
    if !(rollouts_are_over || time_is_over) {
        let next = Moment {
            rollout: moment.rollout + 1,
            attempt: 0,
            step: 0,
            steps_before: steps,
            ..moment
        };
        if end == End::Cap && !plan.returns && next.phase.is_steered() {
            // The motor, too, goes on: there is no halt between.
            let effects = vec![Effect::Close { moment, end }, Effect::GoOn(next)];
            return (Stage::Running(next), effects);
        }
        return prepare(plan, next, effects);
    }
    effects.push(Effect::Leave(moment.phase));
    if let Some(next) = plan.after(moment.phase) {
        effects.push(Effect::Enter(next));
        rest(plan, Moment::start_of(next), effects)
    } else {
        let (stage, finish) = finish(Finish::Complete);
        effects.extend(finish);
        (stage, effects)
    }
}

/// Between two phases: a break where a person is there, except before zero control, which
/// follows at once.
fn rest(plan: &Plan, next: Moment, effects: Vec<Effect>) -> (Stage, Vec<Effect>) {
    if plan.attended && plan.break_ticks > 0 && next.phase != Phase::ZeroControl {
        (Stage::Break { next, ticks_left: plan.break_ticks }, effects)
    } else {
        arrive(plan, next, effects)
    }
}

/// At the door of a phase.
fn arrive(plan: &Plan, moment: Moment, effects: Vec<Effect>) -> (Stage, Vec<Effect>) {
    if plan.attended && moment.phase != Phase::ZeroControl {
        (Stage::Instruction(moment), effects)
    } else {
        prepare(plan, moment, effects)
    }
}

fn prepare(plan: &Plan, moment: Moment, mut effects: Vec<Effect>) -> (Stage, Vec<Effect>) {
    effects.push(Effect::Prepare(moment));
    let ticks_left = plan.hold_ticks(moment.phase);
    if ticks_left == 0 {
        effects.push(Effect::Release(moment));
        (Stage::Running(moment), effects)
    } else {
        (Stage::Hold { moment, ticks_left }, effects)
    }
}

fn finish(how: Finish) -> (Stage, Vec<Effect>) {
    (Stage::Finished(how), vec![Effect::Finish(how)])
}

#[cfg(test)]
#[path = "machine_tests.rs"]
mod tests;
