//! What the cycle does about a transition of the session.

use super::cycle::{Cycle, occasion};
use super::rollout::{Before, Mind, Rollout, WentOn};
use super::scale;
use super::witness::{Happening, Standing, Witness};
use crate::backend::{Backend, Readiness};
use crate::learner::Learner;
use crate::operator::{News, Practice, Request, Switch};
use crate::record::{EpisodeRow, Momentum, StepRow};
use crate::session::machine::{self, Effect, Event, Stage};
use crate::session::plan::Start;
use crate::session::{Moment, Phase};
use crate::sharing::Sharing;
use crate::signal::{End, Intent, State};

impl<W: Witness> Cycle<W> {
    /// Lets `event` happen to the session, and carries out what follows.
    pub(super) fn happen(&mut self, event: Event) {
        let before = self.stage;
        let (stage, effects) = machine::transition(&self.rules.plan, before, event);
        self.stage = stage;
        // The plant stops before anything that could wait for a disk.
        if event == Event::Stop {
            self.crew.backend.stop(None);
        } else if effects.contains(&Effect::Halt) {
            self.crew.backend.halt();
        }
        if matches!((before, event), (Stage::Stopped(_), Event::Begin)) {
            self.crew.backend.clear();
        }
        self.note_event(before, event);
        self.carry_out(&effects);
        if let Stage::Running(moment) = self.stage
            && event == Event::Tick(None)
            && self.rules.plan.phase(moment.phase).is_some_and(|phase| phase.steps.is_some())
        {
            self.store_tenths(moment, moment.rollout - 1);
        }
        let closed = effects
            .iter()
            .any(|effect| matches!(effect, Effect::Close { end, .. } if *end != End::Aborted));
        if closed {
            self.store_standing();
            self.heed_fault();
        }
    }

    /// Carries out effects in order.
    pub(super) fn carry_out(&mut self, effects: &[Effect]) {
        for effect in effects {
            match *effect {
                Effect::Enter(phase) => self.enter(phase),
                Effect::Prepare(moment) => self.prepare(moment),
                Effect::GoOn(moment) => self.go_on(moment),
                // Halts are done already, before everything else.
                Effect::Halt | Effect::Release(_) => {}
                Effect::Close { moment, end } => self.close(moment, end),
                Effect::Restore => {
                    if let Some(before) = self.before_rollout.take() {
                        self.mind = before.mind;
                        self.crew.operator.recall(&before.operator);
                    }
                }
                Effect::Leave(phase) => self.leave(phase),
                Effect::Finish(how) => {
                    let cause = self.cause.clone().unwrap_or_default();
                    self.note(format_finish(how), None, None, cause);
                }
            }
        }
    }

    fn enter(&mut self, phase: Phase) {
        if phase == Phase::Main {
            let (regions, own_scale) = scale::regions(&*self.crew.task, &self.episodes);
            self.mind = Mind {
                learner: self.rules.fresh.clone(),
                sharing: Sharing::new(&self.rules.sharing, self.rules.mode, &regions),
                learned: 0,
                refused: 0,
                tenths: 0,
            };
            if let Some(why) = own_scale {
                self.note("threshold", None, Some(phase), why);
            }
        }
        self.note("phase", None, Some(phase), String::new());
    }

    fn leave(&mut self, phase: Phase) {
        if phase == Phase::Main {
            self.crew.witness.policy(None, &self.mind.learner);
        }
    }

    /// Puts the plant to where the rollout begins: the task's start, or where a rollout
    /// that goes on began.
    fn prepare(&mut self, moment: Moment) {
        let task = &*self.crew.task;
        let momentum = self.momentum_of(moment);
        let start = match (&momentum, self.rules.plan.start(&moment)) {
            (Some(momentum), _) => momentum.state,
            (None, Start::Random(mut chance)) => {
                task.random_start(occasion(moment.phase), &mut chance)
            }
            (None, Start::Grid { index, count }) => task.grid_start(index, count),
        };
        self.crew.backend.prepare(start, moment.place());
        self.open(moment, start, momentum.as_ref());
    }

    /// A rollout begins where the one before ended, without a halt.
    fn go_on(&mut self, moment: Moment) {
        let Moment { phase, rollout, .. } = moment;
        let momentum = Momentum {
            state: self.crew.backend.sense().state,
            tally: self.rollout.tally.unfinished(),
            seen: self.teacher.seen(),
            operator: self.crew.operator.memory(),
        };
        self.crew.backend.go_on(moment.place());
        self.open(moment, momentum.state, Some(&momentum));
        self.went_on = Some(WentOn { phase, rollout, momentum });
    }

    /// What the rollout at `moment` goes on with, if it does not begin at the task's start.
    fn momentum_of(&self, moment: Moment) -> Option<Momentum> {
        let went_on = self.went_on.as_ref()?;
        let is_it = (went_on.phase, went_on.rollout) == (moment.phase, moment.rollout);
        is_it.then(|| went_on.momentum.clone())
    }

    /// The rollout that starts at `start` begins: for everyone anew, but for the `momentum`
    /// of one that goes on.
    fn open(&mut self, moment: Moment, start: State, momentum: Option<&Momentum>) {
        let task = &*self.crew.task;
        self.rollout =
            Rollout { start: task.start_value(&start), tally: task.tally(), ..Rollout::default() };
        self.seen.state = start;
        self.teacher.begin();
        if let Some(momentum) = momentum {
            self.rollout.tally.go_on(&momentum.tally);
            self.teacher.go_on(&momentum.seen);
        }
        self.before_rollout = None;
        if moment.phase.is_steered() {
            let practice = self.practice();
            self.crew.operator.begin(moment.place(), practice);
            if let Some(momentum) = momentum {
                self.crew.operator.go_on(&momentum.operator);
            }
            if self.rules.plan.attended {
                let operator = self.crew.operator.learned();
                self.before_rollout = Some(Before { mind: self.mind.clone(), operator });
            }
        }
    }

    /// A rollout is over: its last lessons, its ending state, its row, its policies.
    fn close(&mut self, moment: Moment, end: End) {
        let state = self.crew.backend.sense().state;
        let is_kept = !matches!(end, End::Discarded | End::Aborted);
        if moment.phase == Phase::Main && is_kept {
            self.conclude_rollout(moment, end, state);
        }
        let t = f64::from(moment.step) * self.rules.tick.0;
        self.crew.witness.step(&StepRow::ending(
            moment.phase,
            moment.rollout,
            moment.step,
            t,
            state,
        ));
        self.mark_losses(moment);
        if let Some((count, why)) = self.rollout.refused {
            let cause = format!("{count} of this rollout's samples were not learned: {why}");
            self.note("samples_refused", Some(moment), None, cause);
        }
        if self.rollout.absent > 0 {
            let (absent, all) = (self.rollout.absent, moment.step);
            let cause = format!("nobody steered at {absent} of {all} ticks: not learned");
            self.note("operator_absent", Some(moment), None, cause);
        }
        let row = self.episode_row(moment, end);
        self.crew.witness.episode(&row);
        if let Some(publisher) = &self.crew.publisher {
            publisher.rollout(row);
        }
        // A scale of success may go by what was practised.
        if self.needs.rollouts || moment.phase == Phase::Introduction {
            self.episodes.push(row);
        }
        if !is_kept {
            return;
        }
        if moment.phase.is_steered() {
            self.practice += 1;
            self.practised_ticks += u64::from(moment.step);
        }
        self.store_tenths(moment, moment.rollout);
    }

    /// What the operator has steered so far.
    fn practice(&self) -> Practice {
        #[expect(clippy::cast_precision_loss, reason = "a session is shorter than 2^53 ticks")]
        let ticks = self.practised_ticks as f64;
        Practice { rollouts: self.practice, time: self.rules.tick * ticks }
    }

    /// Marks a rollout of which step rows were lost.
    fn mark_losses(&mut self, moment: Moment) {
        let lost = self.crew.witness.lost();
        if lost > self.lost_before {
            let cause =
                format!("{} step rows could not be written in time", lost - self.lost_before);
            self.note("rows_lost", Some(moment), None, cause);
        }
        self.lost_before = lost;
    }

    fn episode_row(&self, moment: Moment, end: End) -> EpisodeRow {
        let is_main = moment.phase == Phase::Main;
        let fields = u32::try_from(self.mind.learner.fields()).unwrap_or(u32::MAX);
        EpisodeRow {
            phase: moment.phase,
            episode: moment.rollout,
            start: self.rollout.start,
            steps: moment.step,
            duration_s: f64::from(moment.step) * self.rules.tick.0,
            end,
            total: self.rollout.total_reward,
            mean_reward: self.rollout.total_reward / f64::from(moment.step.max(1)),
            share: match moment.phase {
                Phase::Introduction => Some(1.0),
                Phase::Main => Some(self.over_regions(Sharing::share)),
                Phase::Autonomous => Some(0.0),
                Phase::ZeroControl => None,
            },
            success: is_main.then(|| self.over_regions(Sharing::success)),
            receptive_fields: (is_main || moment.phase == Phase::Autonomous).then_some(fields),
            tallied: self.rollout.tally.tallied(),
        }
    }

    /// The mean of `value` over all regions.
    fn over_regions(&self, value: fn(&Sharing, usize) -> f64) -> f64 {
        let regions = self.crew.task.regions().len();
        let sum: f64 = (0..regions).map(|region| value(&self.mind.sharing, region)).sum();
        sum / f64::from(u32::try_from(regions).unwrap_or(u32::MAX)).max(1.0)
    }

    /// Stores the policies of the tenths of main that are over now.
    fn store_tenths(&mut self, moment: Moment, rollouts: u32) {
        if moment.phase != Phase::Main {
            return;
        }
        let steps = moment.steps_before + u64::from(moment.step);
        let over = self.rules.plan.tenths(Phase::Main, rollouts, steps);
        while self.mind.tenths < over {
            self.mind.tenths += 1;
            self.crew.witness.policy(Some(self.mind.tenths * 10), &self.mind.learner);
        }
    }

    /// A session that teaches no policy keeps the one it was given.
    pub(super) fn store_given_policy(&mut self) {
        let plan = &self.rules.plan;
        if plan.phase(Phase::Main).is_none() && plan.phase(Phase::Autonomous).is_some() {
            self.crew.witness.policy(None, &self.mind.learner);
        }
    }

    /// Stores where a cut session would go on. The learner is left out once it is frozen:
    /// it is the final policy then.
    pub(super) fn store_standing(&mut self) {
        let Some(moment) = self.stage.moment().filter(|_| self.needs.standings) else { return };
        let learns = moment.phase.is_steered();
        self.crew.witness.standing(Standing {
            moment,
            learner: learns.then(|| self.mind.learner.clone()),
            sharing: self.mind.sharing.clone(),
            learned: self.mind.learned,
            refused: self.mind.refused,
            practice: self.practice,
            operator: if learns { self.crew.operator.learned() } else { Vec::new() },
            momentum: self.momentum_of(moment),
            tenths: self.mind.tenths,
        });
    }

    /// Takes what happened to the operator's device since the last tick. Without it nobody
    /// can steer: a rollout that needs a person waits, before anything is applied.
    pub(super) fn listen(&mut self) {
        let (now, mut was_gone) = (self.now(), false);
        while let Some(news) = self.crew.operator.news(now) {
            let (event, words) = match news {
                News::Asks(request) => {
                    self.happen(match request {
                        Request::Begin => Event::Begin,
                        Request::Pause => Event::Pause,
                        Request::Discard => Event::Discard,
                        Request::Stop => Event::Stop,
                    });
                    continue;
                }
                News::Gone(words) => {
                    was_gone = true;
                    ("device_gone", words)
                }
                News::Back(words) => ("device_back", words),
                News::Remark(words) => ("device", words),
            };
            self.note(event, self.stage.moment(), None, words);
        }
        let is_steered = self.stage.moment().is_some_and(|moment| moment.phase.is_steered());
        let is_due = matches!(self.stage, Stage::Running(_) | Stage::Hold { .. });
        // One that came back within the tick was gone all the same.
        if is_steered && is_due && (was_gone || self.crew.operator.is_gone()) {
            self.seen.human = Intent::Absent;
            self.happen(Event::Pause);
        }
        let waits = matches!(self.stage, Stage::Paused(_) | Stage::Stopped(_));
        if waits && !self.rules.plan.attended && self.crew.operator.is_over() {
            let why = "the session waits, and its operator has nothing more to say";
            self.cause.get_or_insert_with(|| why.to_owned());
            self.happen(Event::Abort);
        }
    }

    /// Tells the plant whether a hand is on the switch, and hears whether it is ready: true while
    /// a countdown has to wait for it. A rollout that can no longer go on is paused.
    pub(super) fn heed_backend(&mut self) -> bool {
        self.crew.backend.enable(match self.crew.operator.switch(self.now()) {
            Switch::None => None,
            switch => Some(switch == Switch::Held),
        });
        let why = match self.stage {
            Stage::Hold { .. } | Stage::Running(_) => match self.crew.backend.readiness() {
                Readiness::Waits { why, needs_person } => Some((why, needs_person)),
                Readiness::Ready => None,
            },
            _ => None,
        };
        let (holds, is_last) = match self.stage {
            Stage::Hold { ticks_left, .. } => (true, ticks_left <= 1),
            _ => (false, false),
        };
        match why {
            Some((why, true)) if !self.rules.plan.attended => {
                self.cause.get_or_insert(why);
                self.happen(Event::Abort);
            }
            Some((why, _)) if holds => {
                self.tell_waiting(Some(why));
                return true;
            }
            Some((why, true)) => {
                self.note("plant_waits", self.stage.moment(), None, why);
                self.happen(Event::Pause);
            }
            None if is_last && !self.crew.backend.is_at_start() => {
                self.tell_waiting(Some("raise the pole: it starts once it is upright".to_owned()));
                return true;
            }
            // After the countdown a pole that stirs once more is as good a start.
            Some((_, false)) | None => {}
        }
        self.tell_waiting(None);
        false
    }

    fn tell_waiting(&self, why: Option<String>) {
        if let Some(publisher) = &self.crew.publisher {
            publisher.waits(why);
        }
    }

    /// A tripped limit is an emergency stop that nobody had to press.
    pub(super) fn heed_trip(&mut self) {
        let is_under_way =
            matches!(self.stage, Stage::Running(_) | Stage::Hold { .. } | Stage::Paused(_));
        if !is_under_way {
            return;
        }
        if let Some(why) = self.crew.backend.cause() {
            self.note("tripped", self.stage.moment(), None, why.clone());
            self.happen(Event::Stop);
            if !self.rules.plan.attended {
                self.cause.get_or_insert(why);
                self.happen(Event::Abort);
            }
        }
    }

    /// A session that cannot be written down is ended: nothing more would be kept.
    fn heed_fault(&mut self) {
        if matches!(self.stage, Stage::Finished(_)) {
            return;
        }
        if let Some(fault) = self.crew.witness.fault() {
            self.cause.get_or_insert(fault);
            self.happen(Event::Abort);
        }
    }

    /// Turns the operator's sensitivity, and writes it down: the rows after it mean
    /// something else.
    pub(super) fn tune(&mut self, sensitivity: f64) {
        self.crew.operator.tune(sensitivity);
        self.note("sensitivity", self.stage.moment(), None, sensitivity.to_string());
    }

    /// Writes down what people asked for; ticks speak through their rows.
    fn note_event(&mut self, before: Stage, event: Event) {
        let word = match event {
            Event::Tick(_) => return,
            Event::Begin => "begin",
            Event::Pause if matches!(before, Stage::Paused(_)) => "go_on",
            Event::Pause => "pause",
            Event::Discard => "discard",
            Event::Stop => "stop",
            Event::Abort => "abort",
        };
        if self.stage != before {
            let cause = self.cause.clone().unwrap_or_default();
            self.note(word, before.moment(), None, cause);
        }
    }

    fn note(
        &mut self,
        event: &'static str,
        moment: Option<Moment>,
        phase: Option<Phase>,
        cause: String,
    ) {
        self.crew.witness.happening(Happening { event, moment, phase, cause });
    }
}

const fn format_finish(how: machine::Finish) -> &'static str {
    match how {
        machine::Finish::Complete => "complete",
        machine::Finish::Aborted => "aborted",
    }
}

/// The ticks of a rollout that count as practice, as its rollout does.
pub(super) fn practised_ticks(row: &EpisodeRow) -> u64 {
    let counts = row.phase.is_steered() && !matches!(row.end, End::Discarded | End::Aborted);
    if counts { u64::from(row.steps) } else { 0 }
}
