//! ONE control tick, from sensing to publishing, in a straight line.
//!
//! The same cycle serves the screen, headless runs and evaluation; only the clock, the
//! operator and the witness differ.

use hdrhistogram::Histogram;

use super::effects;
use super::rollout::{Before, Mind, Rollout, WentOn};
use super::snapshot::{Command, MOST_REGIONS, Publisher, Snapshot};
use super::witness::{Needs, Standing, Witness};
use crate::backend::safety::Safe;
use crate::backend::{Backend, Sensed};
use crate::clock::{Clock, Pacer, Wake};
use crate::learner::{Learner, Model};
use crate::operator::{Feedback, Operator, View};
use crate::record::{EpisodeRow, StepRow};
use crate::session::machine::{self, Event, Finish, Stage};
use crate::session::plan::Plan;
use crate::session::{Moment, Phase};
use crate::sharing::{self, Mode, Sharing};
use crate::signal::{Action, End, Intent, Seconds, State, Tick};
use crate::task::{Occasion, Task};
use crate::teaching::{self, Sight, Teacher};

/// Who and what takes part.
pub struct Crew<W> {
    /// What the plant is used for.
    pub task: Box<dyn Task>,
    /// The plant, within its limits.
    pub backend: Safe,
    /// Who steers.
    pub operator: Box<dyn Operator>,
    /// Who writes it down.
    pub witness: W,
    /// Who may look and ask; nobody in an evaluation.
    pub publisher: Option<Publisher>,
}

/// How the session goes.
#[derive(Clone, Debug)]
pub struct Rules {
    /// Phases, rollouts, starts.
    pub plan: Plan,
    /// The time of a control step.
    pub tick: Seconds,
    /// Whether the robot takes over while it learns.
    pub mode: Mode,
    /// How control is shared.
    pub sharing: sharing::Params,
    /// What the learner is given.
    pub teaching: teaching::Params,
    /// The learner that main begins with.
    pub fresh: Model,
}

/// What a session led to.
#[derive(Debug)]
pub struct Outcome<W> {
    /// How it finished.
    pub finish: Finish,
    /// Why it was ended early.
    pub cause: Option<String>,
    /// Whether a signal, or the key that stands for one, ended it.
    pub interrupted: bool,
    /// The learner at its end.
    pub learner: Model,
    /// Windows, shares and gates at its end.
    pub sharing: Sharing,
    /// All its rollouts, discarded ones included.
    pub episodes: Vec<EpisodeRow>,
    /// Samples learned,
    pub learned: u64,
    /// and refused because they were not finite.
    pub refused: u64,
    /// The lateness of ticks, µs; empty on virtual time.
    pub lateness_us: Option<Histogram<u64>>,
    /// Ticks left out.
    pub missed: u64,
    /// Who wrote it down.
    pub witness: W,
}

/// A session under way.
pub struct Cycle<W> {
    pub(super) rules: Rules,
    pub(super) crew: Crew<W>,
    pub(super) stage: Stage,
    pub(super) mind: Mind,
    pub(super) before_rollout: Option<Before>,
    pub(super) rollout: Rollout,
    pub(super) went_on: Option<WentOn>,
    pub(super) teacher: Teacher,
    /// Rollouts that the operator has steered,
    pub(super) practice: u32,
    /// and their control steps.
    pub(super) practised_ticks: u64,
    pub(super) episodes: Vec<EpisodeRow>,
    pub(super) cause: Option<String>,
    interrupted: bool,
    /// Step rows lost before this rollout.
    pub(super) lost_before: u64,
    pub(super) seen: Snapshot,
    wanted_speed: f64,
    lateness_us: Option<Histogram<u64>>,
    /// Who drives in the learner's place where the robot is alone.
    pub(super) deputy: Option<Box<dyn Operator>>,
    /// What the witness wants.
    pub(super) needs: Needs,
}

impl<W: Witness> Cycle<W> {
    /// A session from its beginning, or from where it stood after the rollouts `earlier`.
    /// `learner` is what an autonomous phase without a main phase uses.
    #[must_use]
    pub fn new(
        rules: Rules,
        crew: Crew<W>,
        learner: Model,
        from: Option<(Standing, Vec<EpisodeRow>)>,
    ) -> Self {
        let sharing = Sharing::new(&rules.sharing, rules.mode, crew.task.regions());
        let mind = Mind { learner, sharing, learned: 0, refused: 0, tenths: 0 };
        let moment = from.as_ref().map(|(standing, _)| standing.moment);
        let goes_on = from.as_ref().is_some_and(|(standing, _)| standing.momentum.is_some());
        let (stage, effects) = machine::begin(&rules.plan, moment, goes_on);
        let needs = crew.witness.needs();
        let names: Vec<&str> = crew.task.regions().iter().map(|region| region.name).collect();
        let teacher = Teacher::new(&rules.teaching, rules.tick, &names);
        let mut cycle = Self {
            rules,
            crew,
            stage,
            mind,
            before_rollout: None,
            rollout: Rollout::default(),
            went_on: None,
            teacher,
            practice: 0,
            practised_ticks: 0,
            episodes: Vec::new(),
            cause: None,
            interrupted: false,
            lost_before: 0,
            seen: Snapshot::before(stage),
            wanted_speed: 1.0,
            lateness_us: Histogram::new_with_max(60_000_000, 3).ok(),
            deputy: None,
            needs,
        };
        let is_new = from.is_none();
        if let Some((standing, earlier)) = from {
            cycle.recall(standing);
            cycle.show_earlier(earlier);
        }
        cycle.carry_out(&effects);
        if is_new {
            cycle.store_given_policy();
            cycle.store_standing();
        }
        cycle.publish();
        cycle
    }

    /// The same, but where the robot is alone `deputy` drives: another policy, or the learner's
    /// read in another way. It is asked at each tick and told nothing.
    #[must_use]
    pub fn with_deputy(mut self, deputy: Box<dyn Operator>) -> Self {
        self.deputy = Some(deputy);
        self
    }

    /// Who steers.
    #[must_use]
    pub fn operator(&self) -> &dyn Operator {
        &*self.crew.operator
    }

    /// Who writes it down.
    pub const fn witness(&mut self) -> &mut W {
        &mut self.crew.witness
    }

    fn recall(&mut self, standing: Standing) {
        if let Some(learner) = standing.learner {
            self.mind.learner = learner;
        }
        self.mind.sharing = standing.sharing;
        self.mind.learned = standing.learned;
        self.mind.refused = standing.refused;
        self.practice = standing.practice;
        self.crew.operator.recall(&standing.operator);
        let Moment { phase, rollout, .. } = standing.moment;
        self.went_on = standing.momentum.map(|momentum| WentOn { phase, rollout, momentum });
        self.mind.tenths = standing.tenths;
    }

    fn show_earlier(&mut self, earlier: Vec<EpisodeRow>) {
        if let Some(publisher) = &self.crew.publisher {
            for row in &earlier {
                publisher.rollout(*row);
            }
        }
        self.practised_ticks = earlier.iter().map(effects::practised_ticks).sum();
        self.episodes = earlier;
    }

    /// Runs the session to its end.
    #[must_use]
    pub fn run(mut self, clock: &mut dyn Clock) -> Outcome<W> {
        let mut pacer = Pacer::new(clock);
        while self.step(clock, &mut pacer) {}
        self.into_outcome()
    }

    /// Waits for the next tick and does it; false, and nothing is done, once the session
    /// is finished.
    pub fn step(&mut self, clock: &mut dyn Clock, pacer: &mut Pacer) -> bool {
        if matches!(self.stage, Stage::Finished(_)) {
            return false;
        }
        let speed = self.speed();
        let is_paced = clock.is_wall() && speed.is_finite();
        self.crew.witness.allow_waiting(!is_paced);
        let wake = if speed.is_finite() {
            pacer.wait(clock, Seconds(self.rules.tick.0 / speed))
        } else {
            pacer.skip(clock)
        };
        self.tick(wake, clock);
        true
    }

    /// One control tick.
    fn tick(&mut self, wake: Wake, clock: &dyn Clock) {
        self.note_lateness(wake, clock);
        self.obey();
        self.listen();
        let waits = self.heed_backend();
        let end = match self.stage {
            Stage::Running(moment) => self.control(moment),
            Stage::Hold { moment, ticks_left } => {
                self.hold(moment, ticks_left);
                None
            }
            _ => None,
        };
        if !waits {
            self.happen(Event::Tick(end));
        }
        self.heed_trip();
        self.publish();
    }

    /// A tick under control: sense, decide, actuate; then learn and write down.
    fn control(&mut self, moment: Moment) -> Option<End> {
        let sensed = self.crew.backend.sense();
        let state = sensed.state;
        let region = self.crew.task.region(&state);
        let human = if moment.phase.is_steered() {
            self.intent(&state, f64::from(moment.step) * self.rules.tick.0)
        } else {
            Intent::Absent
        };
        let features = self.crew.task.features(&state);
        let share = self.share(moment.phase, region);
        let machine = self.machine(moment, share, &state, &features);
        let wanted = match (share, machine) {
            (Some(share), machine) => self.mixed(share, human.action().0, machine.unwrap_or(0.0)),
            (None, _) => 0.0,
        };
        let applied = self.crew.backend.actuate(Action(wanted)).0;
        // The time-critical half ends here.

        let Sensed { state: next, .. } = self.crew.backend.sense();
        let reward = self.crew.task.reward(&state, &next);
        let end = self.crew.task.end(&next, moment.step + 1, occasion(moment.phase));
        let is_main = moment.phase == Phase::Main;
        let mut success = None;
        if is_main {
            success = Some(self.observe(moment, region, self.crew.task.measure(&state, reward)));
            self.teach(Sight {
                features,
                region,
                cost: self.cost(&state),
                human: self.crew.operator.shown(human),
                applied,
                teaches: self.mind.sharing.teaches(region, self.rules.teaching.from_gate),
            });
        }
        if moment.phase.is_steered() {
            self.rollout.absent += u32::from(!human.is_present());
            self.crew.operator.told(&Feedback {
                state: &state,
                applied: Action(applied),
                reward,
                next: &next,
                end,
                share: share.unwrap_or(1.0),
                bumped: self.crew.task.bumped(&state, &next),
                is_frozen: is_main && self.mind.sharing.is_learner_frozen(region),
            });
        }
        self.rollout.total_reward += reward;
        self.rollout.tally.step(&state, &next);
        if self.is_seen() {
            let row = StepRow {
                phase: moment.phase,
                episode: moment.rollout,
                step: moment.step,
                t: f64::from(moment.step) * self.rules.tick.0,
                state,
                u_human: human.is_present().then_some(human.action().0),
                u_machine: machine,
                share,
                u: Some(wanted),
                u_applied: Some(applied),
                reward: Some(reward),
                success,
                region: self.crew.task.regions().get(region).map(|r| r.name),
                lateness_us: micros(self.seen.lateness),
                raw: human.raw().filter(|raw| raw.is_finite()),
            };
            self.crew.witness.step(&row);
            self.see(&row, human, region);
        }
        end
    }

    /// A tick of countdown: the operator looks, and nothing moves.
    fn hold(&mut self, moment: Moment, ticks_left: u32) {
        let Sensed { state, .. } = self.crew.backend.sense();
        let time = (f64::from(moment.step) - f64::from(ticks_left)) * self.rules.tick.0;
        let human =
            if moment.phase.is_steered() { self.intent(&state, time) } else { Intent::Absent };
        self.seen.state = state;
        self.seen.human = human;
        self.seen.machine = None;
        self.seen.action = 0.0;
        self.seen.applied = 0.0;
    }

    /// The time since the session's control began.
    pub(super) fn now(&self) -> Seconds {
        #[expect(clippy::cast_precision_loss, reason = "a tick count far below 2^52")]
        let ticks = self.seen.tick.0 as f64;
        self.rules.tick * ticks
    }

    fn intent(&mut self, state: &State, rollout_time: f64) -> Intent {
        let now = self.now();
        let rollout_time = Seconds(rollout_time);
        let limit = self.crew.task.action_limit();
        match self.crew.operator.intent(View { state, now, rollout_time }) {
            // A device's nonsense is nobody's wish.
            Intent::Present { action, .. } if !action.0.is_finite() => Intent::Absent,
            Intent::Present { action, raw, age } => {
                Intent::Present { action: Action(action.0.clamp(-limit, limit)), raw, age }
            }
            Intent::Absent => Intent::Absent,
        }
    }

    /// The person's share; none where nobody steers at all.
    fn share(&self, phase: Phase, region: usize) -> Option<f64> {
        match phase {
            Phase::Introduction => Some(1.0),
            Phase::Main => Some(self.mind.sharing.share(region)),
            Phase::Autonomous => Some(0.0),
            Phase::ZeroControl => None,
        }
    }

    /// Takes what was asked since the last tick.
    fn obey(&mut self) {
        while let Some(command) = self.crew.publisher.as_ref().and_then(Publisher::pending) {
            let event = match command {
                Command::Begin => Event::Begin,
                Command::Pause => Event::Pause,
                Command::Discard => Event::Discard,
                Command::Stop => Event::Stop,
                Command::Abort(cause) => {
                    self.cause.get_or_insert(cause);
                    Event::Abort
                }
                Command::Interrupt(cause) => {
                    self.interrupted = true;
                    self.cause.get_or_insert(cause);
                    Event::Abort
                }
                Command::Sensitivity(sensitivity) => {
                    self.tune(sensitivity);
                    continue;
                }
                Command::Speed(speed) => {
                    self.wanted_speed = if speed > 0.0 { speed } else { 1.0 };
                    continue;
                }
            };
            self.happen(event);
        }
    }

    /// Faster than the wall only where no hand is on the controls.
    fn speed(&self) -> f64 {
        match self.stage {
            _ if self.crew.backend.is_real() => 1.0,
            Stage::Hold { moment, .. } | Stage::Running(moment) if !moment.phase.is_steered() => {
                self.wanted_speed
            }
            _ => 1.0,
        }
    }

    fn note_lateness(&mut self, wake: Wake, clock: &dyn Clock) {
        self.seen.tick = Tick(self.seen.tick.0 + 1 + wake.missed);
        if clock.is_wall() {
            self.seen.lateness = wake.lateness;
            self.seen.missed += wake.missed;
            if let Some(histogram) = &mut self.lateness_us {
                histogram.saturating_record(u64::from(micros(wake.lateness)));
            }
        }
    }

    /// Keeps the tick for the screen.
    fn see(&mut self, row: &StepRow, human: Intent, region: usize) {
        self.seen.state = row.state;
        self.seen.human = human;
        self.seen.machine = row.u_machine;
        self.seen.action = row.u.unwrap_or(0.0);
        self.seen.applied = row.u_applied.unwrap_or(0.0);
        self.seen.region = region;
        self.seen.reward = row.reward.unwrap_or(0.0);
    }

    /// Shows this tick to whoever looks.
    fn publish(&mut self) {
        self.seen.speed = self.speed();
        let Some(publisher) = &self.crew.publisher else { return };
        let phase = self.stage.moment().map(|moment| moment.phase);
        for region in 0..self.crew.task.regions().len().min(MOST_REGIONS) {
            self.seen.shares[region] = match phase {
                Some(Phase::Introduction) | None => 1.0,
                Some(Phase::Main) => self.mind.sharing.share(region),
                Some(Phase::Autonomous | Phase::ZeroControl) => 0.0,
            };
            self.seen.successes[region] = self.mind.sharing.success(region);
            self.seen.frozen[region] = self.mind.sharing.is_frozen(region);
        }
        self.seen.stage = self.stage;
        self.seen.tallied = self.rollout.tally.tallied();
        self.seen.gate = self.mind.sharing.gate(self.seen.region);
        self.seen.fields = u32::try_from(self.mind.learner.fields()).unwrap_or(u32::MAX);
        self.seen.learned = self.mind.learned;
        self.seen.lost_rows = self.crew.witness.lost();
        publisher.publish(&self.seen);
    }

    fn into_outcome(mut self) -> Outcome<W> {
        self.crew.backend.halt();
        self.publish();
        let finish = match self.stage {
            Stage::Finished(finish) => finish,
            _ => Finish::Aborted,
        };
        Outcome {
            finish,
            cause: self.cause,
            interrupted: self.interrupted,
            learner: self.mind.learner,
            sharing: self.mind.sharing,
            episodes: self.episodes,
            learned: self.mind.learned,
            refused: self.mind.refused,
            lateness_us: self.lateness_us,
            missed: self.seen.missed,
            witness: self.crew.witness,
        }
    }
}

/// What the rollouts of `phase` are for.
pub(super) const fn occasion(phase: Phase) -> Occasion {
    if phase.is_steered() { Occasion::Taught } else { Occasion::Tested }
}

fn micros(lateness: Seconds) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    let micros = (lateness.0 * 1e6) as u32;
    micros
}
