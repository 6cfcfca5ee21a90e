//! What a tick of main teaches: the share moves, and the learner learns.

use super::cycle::Cycle;
use super::witness::{Happening, Witness};
use crate::learner::Learner;
use crate::operator::View;
use crate::session::{Moment, Phase};
use crate::sharing::weight::Opened;
use crate::sharing::{self, mix};
use crate::signal::{End, Seconds, State};
use crate::teaching::{Lesson, Sight};

impl<W: Witness> Cycle<W> {
    /// What the robot would do in `state`, where that is asked for.
    pub(super) fn machine(
        &mut self,
        moment: Moment,
        share: Option<f64>,
        state: &State,
        features: &[f64],
    ) -> Option<f64> {
        let is_idle = share.is_none_or(|share| share >= 1.0);
        let is_seen = self.is_seen();
        match (moment.phase, &mut self.deputy) {
            (Phase::Autonomous, Some(deputy)) => {
                let rollout_time = Seconds(f64::from(moment.step) * self.rules.tick.0);
                let view = View { state, now: rollout_time, rollout_time };
                Some(deputy.intent(view).action().0)
            }
            // It has no effect, and nobody looks at it.
            (Phase::Main, _) if is_idle && !is_seen => None,
            (Phase::Main | Phase::Autonomous, _) => {
                let mut action = [0.0];
                self.mind.learner.predict(features, &mut action);
                Some(action[0])
            }
            _ => None,
        }
    }

    /// Whether anybody looks at single steps.
    pub(super) fn is_seen(&self) -> bool {
        self.needs.steps || self.crew.publisher.is_some()
    }

    /// The cost of `state`, where lessons weigh by it.
    pub(super) fn cost(&self, state: &State) -> f64 {
        if self.rules.teaching.outcome_s.is_some() { self.crew.task.cost(state) } else { 0.0 }
    }

    /// The action of both.
    pub(super) fn mixed(&self, share: f64, human: f64, machine: f64) -> f64 {
        let action = mix(share, human, machine);
        if self.rules.sharing.round_mix && share > 0.0 && share < 1.0 {
            sharing::rounded(action, self.crew.task.action_limit())
        } else {
            action
        }
    }

    /// Lets the share move by the measure of a step, where it moves each step; returns the
    /// success.
    pub(super) fn observe(&mut self, moment: Moment, region: usize, measure: f64) -> f64 {
        self.rollout.total_measure += measure;
        if self.rules.sharing.window_episodes.is_some() {
            return self.mind.sharing.success(region);
        }
        self.move_share(moment, region, measure)
    }

    /// Takes a measure into the region's window, moves its share, and returns its success.
    fn move_share(&mut self, moment: Moment, region: usize, measure: f64) -> f64 {
        let observed = self.mind.sharing.observe(region, measure);
        if observed.gate_opened && self.rules.sharing.gate > 0.0 {
            self.note_gate(moment, region);
        }
        if observed.froze {
            let name = self.crew.task.regions().get(region).map_or("", |region| region.name);
            let share = self.mind.sharing.share(region);
            self.note_in(moment, "frozen", format!("region {name} at the share {share}"));
        }
        observed.success
    }

    pub(super) fn teach(&mut self, sight: Sight) {
        if let Some(lesson) = self.teacher.see(&sight) {
            self.learn(&lesson);
        }
    }

    /// Gives the learner a lesson.
    fn learn(&mut self, lesson: &Lesson) {
        match self.mind.learner.update(&lesson.x, &[lesson.y], lesson.weight) {
            Ok(()) => self.mind.learned += 1,
            Err(why) => {
                self.mind.refused += 1;
                let so_far = self.rollout.refused.map_or(0, |(count, _)| count);
                self.rollout.refused = Some((so_far + 1, why));
            }
        }
    }

    fn note_gate(&mut self, moment: Moment, region: usize) {
        if let Some(Opened { step, tau }) = self.mind.sharing.gate(region) {
            let unit = match self.rules.sharing.window_episodes {
                Some(_) => "episode",
                None => "step",
            };
            let cause = format!("success reached the gate at {unit} {step}; tau {tau} {unit}s");
            self.note_in(moment, "gate_opened", cause);
        }
    }

    fn note_in(&mut self, moment: Moment, event: &'static str, cause: String) {
        let moment = Some(moment);
        self.crew.witness.happening(Happening { event, moment, phase: None, cause });
    }

    /// The lessons of main's rollout that were not ripe yet, and the share where it moves
    /// once an episode: a whole one, not one that the phase's time cut.
    pub(super) fn conclude_rollout(&mut self, moment: Moment, end: End, state: State) {
        let cost = self.crew.task.cost(&state);
        while let Some(lesson) = self.teacher.close(end == End::Failed, cost) {
            self.learn(&lesson);
        }
        let is_whole = moment.step > 0 && end != End::Time;
        if self.rules.sharing.window_episodes.is_some() && is_whole {
            let region = self.crew.task.region(&state);
            let mean = self.rollout.total_measure / f64::from(moment.step);
            self.move_share(moment, region, mean);
        }
    }
}
