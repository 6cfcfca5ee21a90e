//! The control cycle with a plant, an operator and a witness made for the test.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking, helpers too")]

use std::sync::{Arc, Mutex};

use coadapt::backend::safety::{Limits, Safe};
use coadapt::backend::{Backend, Sensed};
use coadapt::clock::{Pacer, VirtualClock};
use coadapt::control::cycle::{Crew, Cycle, Outcome, Rules};
use coadapt::control::snapshot::{Command, Watcher, channel};
use coadapt::control::witness::{Happening, Standing, Witness};
use coadapt::learner::{Learner, Model};
use coadapt::operator::{Feedback, Operator, Practice, View};
use coadapt::profile::{Document, Profile};
use coadapt::random::Place;
use coadapt::record::{EpisodeRow, StepRow};
use coadapt::session::machine::{Finish, Stage};
use coadapt::session::plan::Plan;
use coadapt::session::{Moment, Phase};
use coadapt::sharing::Mode;
use coadapt::signal::{Action, End, Intent, Seconds, State};

const LIMIT: f64 = 10.0;
const PUSH: f64 = 1.0;
/// The length of a rollout.
const TICKS: u32 = 6;

/// What happened, in order.
#[derive(Clone, Debug, PartialEq)]
enum Entry {
    /// The plant was halted,
    Halt,
    /// or received this.
    Applied(f64),
    /// The operator began, after so many rollouts and ticks,
    Begun(u32, f64),
    /// the witness was told of something, a word,
    Told(&'static str),
    /// or was given the policy of a tenth, %.
    Policy(u8),
}

/// What all parts of a session write into.
#[derive(Clone, Default)]
struct Diary(Arc<Mutex<Vec<Entry>>>);

impl Diary {
    fn note(&self, entry: Entry) {
        self.0.lock().unwrap().push(entry);
    }

    /// What was noted since it was taken last.
    fn take(&self) -> Vec<Entry> {
        std::mem::take(&mut *self.0.lock().unwrap())
    }
}

/// A plant that rests wherever it is put; at one look its state is lost.
struct Rest {
    diary: Diary,
    state: State,
    /// The speed that it claims, m/s.
    speed: f64,
    looks: u32,
    lost: Option<Lost>,
}

/// At which look a plant's state is lost, the numbers that come instead, and what the plant's own
/// guard says of it.
#[derive(Clone, Copy)]
struct Lost {
    at_look: u32,
    to: [f64; 4],
    says: Option<&'static str>,
}

impl Backend for Rest {
    fn sense(&mut self) -> Sensed {
        self.looks += 1;
        if let Some(lost) = self.lost.filter(|lost| lost.at_look == self.looks) {
            self.state = State::new(lost.to);
        }
        Sensed { state: self.state, age: Seconds(0.0) }
    }

    fn actuate(&mut self, wanted: Action) -> Action {
        self.diary.note(Entry::Applied(wanted.0));
        wanted
    }

    fn halt(&mut self) {
        self.diary.note(Entry::Halt);
    }

    fn prepare(&mut self, start: State, _place: Place) {
        let [x, _, theta, theta_dot] = start[..] else { panic!("{start:?}") };
        self.state = State::new([x, self.speed, theta, theta_dot]);
    }

    fn go_on(&mut self, _place: Place) {}

    fn fault(&mut self) -> Option<String> {
        let lost = self.lost.filter(|lost| lost.at_look <= self.looks)?;
        lost.says.map(str::to_owned)
    }
}

/// Pushes to the right, and more so in a repeated rollout; learns how often it was told of it.
struct Pusher {
    push: f64,
    told: f64,
    diary: Diary,
}

impl Operator for Pusher {
    fn begin(&mut self, place: Place, practice: Practice) {
        self.push = PUSH * f64::from(1 + place.attempt);
        let ticks = practice.time.0 / 0.02;
        assert!((ticks - ticks.round()).abs() < 1e-9, "{practice:?}");
        self.diary.note(Entry::Begun(practice.rollouts, ticks.round()));
    }

    fn intent(&mut self, _view: View<'_>) -> Intent {
        Intent::fresh(self.push)
    }

    fn tune(&mut self, sensitivity: f64) {
        self.push = PUSH * sensitivity;
    }

    fn told(&mut self, _feedback: &Feedback<'_>) {
        self.told += 1.0;
    }

    fn learned(&self) -> Vec<f64> {
        vec![self.told]
    }

    fn recall(&mut self, learned: &[f64]) -> bool {
        let &[told] = learned else { return false };
        self.told = told;
        true
    }
}

/// Notes what it is told, and keeps the policies and the last counts of samples.
struct Notary {
    diary: Diary,
    policies: Vec<(u8, Model)>,
    learned: u64,
    refused: u64,
    /// Where the session stood at the beginning of each rollout.
    standings: Vec<Standing>,
}

impl Witness for Notary {
    fn allow_waiting(&mut self, _may_wait: bool) {}
    fn step(&mut self, _row: &StepRow) {
        self.diary.note(Entry::Told("step"));
    }
    fn episode(&mut self, _row: &EpisodeRow) {
        self.diary.note(Entry::Told("episode"));
    }
    fn happening(&mut self, happening: Happening) {
        self.diary.note(Entry::Told(happening.event));
    }
    fn standing(&mut self, standing: Standing) {
        (self.learned, self.refused) = (standing.learned, standing.refused);
        self.standings.push(standing);
        self.diary.note(Entry::Told("standing"));
    }
    fn policy(&mut self, percent: Option<u8>, learner: &Model) {
        let percent = percent.unwrap_or(100);
        self.diary.note(Entry::Policy(percent));
        self.policies.push((percent, learner.clone()));
    }
    fn lost(&self) -> u64 {
        0
    }
    fn fault(&self) -> Option<String> {
        None
    }
}

/// A session that is ticked by hand.
struct Session {
    cycle: Cycle<Notary>,
    clock: VirtualClock,
    pacer: Pacer,
    watcher: Watcher,
    diary: Diary,
}

/// Rollouts of [`TICKS`]; a main phase of fifty ticks, whose tenths end within rollouts.
fn profile(phases: &str) -> Profile {
    let text = format!(
        r#"(
            task: "balance",
            rules: (cap_s: 0.12),
            session: (
                phases: [{phases}],
                introduction_rollouts: Some(3),
                main_rollouts: None,
                main_duration_s: Some(1.0),
                hold_s: 0.0,
            ),
        )"#
    );
    Document::from_text("control", &text).read().unwrap()
}

impl Session {
    fn new(profile: &Profile, attended: bool, lost: Option<Lost>) -> Self {
        Self::at_speed(0.0, profile, attended, lost, None)
    }

    fn at_speed(
        speed: f64,
        profile: &Profile,
        attended: bool,
        lost: Option<Lost>,
        from: Option<(Standing, Vec<EpisodeRow>)>,
    ) -> Self {
        let (tick, seed) = (profile.tick(), 1);
        let diary = Diary::default();
        let plan = Plan::new(&profile.session, tick, seed, attended);
        let first = plan.phases[0].phase;
        let (publisher, watcher) = channel(Stage::Instruction(Moment::start_of(first)));
        let fresh = profile.learner.build(4, LIMIT).unwrap();
        let rules = Rules {
            plan,
            tick,
            mode: Mode::Simultaneous,
            sharing: profile.sharing.clone(),
            teaching: profile.teaching.clone(),
            fresh: fresh.clone(),
        };
        let (state, looks) = (State::default(), 0);
        let plant = Rest { diary: diary.clone(), state, speed, looks, lost };
        let limits = Limits { action: LIMIT, stale: Seconds(1.0) };
        let crew = Crew {
            task: profile.experiment.task(tick),
            backend: Safe::new(Box::new(plant), limits),
            operator: Box::new(Pusher { push: PUSH, told: 0.0, diary: diary.clone() }),
            witness: Notary {
                diary: diary.clone(),
                policies: Vec::new(),
                learned: 0,
                refused: 0,
                standings: Vec::new(),
            },
            publisher: Some(publisher),
        };
        let cycle = Cycle::new(rules, crew, fresh, from);
        let clock = VirtualClock::default();
        let pacer = Pacer::new(&clock);
        Self { cycle, clock, pacer, watcher, diary }
    }

    fn ask(&self, command: Command) {
        assert!(self.watcher.ask(command));
    }

    fn tick(&mut self, ticks: u32) {
        for _ in 0..ticks {
            assert!(self.cycle.step(&mut self.clock, &mut self.pacer), "over already");
        }
    }

    fn stage(&self) -> Stage {
        self.watcher.look().stage
    }

    fn finish(self) -> Outcome<Notary> {
        let Self { cycle, mut clock, .. } = self;
        cycle.run(&mut clock)
    }
}

fn applied(entries: &[Entry]) -> Vec<f64> {
    entries
        .iter()
        .filter_map(|entry| match entry {
            Entry::Applied(force) => Some(*force),
            _ => None,
        })
        .collect()
}

fn policies(entries: &[Entry]) -> Vec<u8> {
    entries
        .iter()
        .filter_map(|entry| match entry {
            Entry::Policy(percent) => Some(*percent),
            _ => None,
        })
        .collect()
}

fn begun(entries: &[Entry]) -> Vec<(u32, f64)> {
    entries
        .iter()
        .filter_map(|entry| match entry {
            Entry::Begun(rollouts, ticks) => Some((*rollouts, *ticks)),
            _ => None,
        })
        .collect()
}

/// Sensitivity that is turned reaches the operator at the next tick, and is written down.
#[test]
fn a_turned_sensitivity_works_at_the_next_tick_and_is_written_down() {
    let mut session = Session::new(&profile("main"), true, None);
    session.ask(Command::Begin);
    session.tick(2);
    let diary = session.diary.clone();
    diary.take();
    session.ask(Command::Sensitivity(2.0));
    session.tick(1);
    let entries = diary.take();
    assert!(entries.contains(&Entry::Told("sensitivity")), "{entries:?}");
    assert_eq!(applied(&entries), [2.0 * PUSH]);
}

#[test]
fn practice_counts_what_was_steered_but_not_what_was_discarded() {
    let mut session = Session::new(&profile("main"), true, None);
    session.ask(Command::Begin);
    session.tick(TICKS + 2);
    session.ask(Command::Discard);
    session.tick(1);
    let diary = session.diary.clone();
    assert_eq!(begun(&diary.take()), [(0, 0.0), (1, 6.0), (1, 6.0)]);
    session.finish();
    assert_eq!(begun(&diary.take())[..3], [(2, 12.0), (3, 18.0), (4, 24.0)]);
}

/// What the operator had learned by the beginning of each rollout.
fn learned(standings: &[Standing]) -> Vec<f64> {
    standings.iter().flat_map(|standing| standing.operator.clone()).collect()
}

#[test]
fn what_an_operator_learned_in_a_discarded_rollout_is_forgotten() {
    let mut session = Session::new(&profile("main"), true, None);
    session.ask(Command::Begin);
    session.tick(TICKS + 2);
    session.ask(Command::Discard);
    let standings = session.finish().witness.standings;
    assert_eq!(learned(&standings)[..4], [0.0, 6.0, 6.0, 12.0]);
}

#[test]
fn an_operator_knows_in_a_resumed_session_what_it_had_learned() {
    let profile = profile("introduction, main");
    let outcome = Session::new(&profile, false, None).finish();
    let whole = learned(&outcome.witness.standings);
    assert_eq!(whole[..4], [0.0, 6.0, 12.0, 18.0], "also in practice");
    let standing = outcome.witness.standings[4].clone();
    let earlier = outcome.episodes[..4].to_vec();
    let resumed = Session::at_speed(0.0, &profile, false, None, Some((standing, earlier)));
    assert_eq!(learned(&resumed.finish().witness.standings), whole[5..]);
}

#[test]
fn practice_goes_on_in_a_resumed_session() {
    let profile = profile("introduction, main");
    let session = Session::new(&profile, false, None);
    let diary = session.diary.clone();
    let outcome = session.finish();
    let whole = begun(&diary.take());
    assert_eq!(whole[..5], [(0, 0.0), (1, 6.0), (2, 12.0), (3, 18.0), (4, 24.0)]);
    let standing = outcome.witness.standings[4].clone();
    let earlier = outcome.episodes[..4].to_vec();
    let resumed = Session::at_speed(0.0, &profile, false, None, Some((standing, earlier)));
    let diary = resumed.diary.clone();
    resumed.finish();
    assert_eq!(begun(&diary.take()), whole[4..]);
}

#[test]
fn samples_that_the_learner_refuses_are_told_once_a_rollout() {
    // Divided by its norm, 1 m/s, this speed is a number; divided by a smaller one it is not.
    let mut profile = profile("introduction, main");
    profile.learner.norm_in = vec![1e-6; 4];
    let session = Session::at_speed(1e305, &profile, false, None, None);
    let diary = session.diary.clone();
    let outcome = session.finish();
    assert_eq!((outcome.learned, outcome.refused), (0, 50));
    assert_eq!(outcome.learner.fields(), 0, "the learner is untouched");
    let told = diary.take().iter().filter(|e| **e == Entry::Told("samples_refused")).count();
    // Main's fifty ticks; nothing is learned, or refused, in the introduction.
    assert_eq!(told, 50_usize.div_ceil(TICKS as usize));
}

/// The look within the tick that ends the first rollout: each tick looks before it decides,
/// while it actuates, and at what came of it.
const LAST_LOOK: u32 = 3 * (TICKS - 1) + 2;
const GONE: Lost = Lost { at_look: LAST_LOOK, to: [f64::NAN; 4], says: None };

#[test]
fn a_trip_at_a_rollouts_end_holds_the_plant_until_a_person_begins_anew() {
    let mut session = Session::new(&profile("introduction, main"), true, Some(GONE));
    session.ask(Command::Begin);
    session.tick(TICKS - 1);
    assert_eq!(applied(&session.diary.take()), [PUSH; TICKS as usize - 1]);
    session.tick(1);
    let next =
        Moment { rollout: 2, steps_before: TICKS.into(), ..Moment::start_of(Phase::Introduction) };
    assert_eq!(session.stage(), Stage::Stopped(next));
    session.tick(10);
    assert_eq!(session.stage(), Stage::Stopped(next));
    let entries = session.diary.take();
    assert_eq!(applied(&entries), [0.0], "{entries:?}");
    assert!(entries.contains(&Entry::Told("tripped")), "{entries:?}");
    session.ask(Command::Begin);
    session.tick(3);
    assert_eq!(applied(&session.diary.take()), [PUSH; 3]);
    assert!(matches!(session.stage(), Stage::Running(moment) if moment.rollout == 2));
}

#[test]
fn a_trip_where_nobody_could_begin_anew_ends_the_session_with_its_cause() {
    let session = Session::new(&profile("introduction, main"), false, Some(GONE));
    let diary = session.diary.clone();
    let outcome = session.finish();
    assert_eq!(outcome.finish, Finish::Aborted);
    assert_eq!(outcome.cause.as_deref(), Some("the plant's state is not finite"));
    assert_eq!(applied(&diary.take()), [PUSH, PUSH, PUSH, PUSH, PUSH, 0.0]);
}

#[test]
fn what_the_plants_own_guard_says_is_the_cause() {
    let gone = Lost { says: Some("the sensor is unplugged"), ..GONE };
    let outcome = Session::new(&profile("introduction, main"), false, Some(gone)).finish();
    assert_eq!(outcome.cause.as_deref(), Some("the sensor is unplugged"));
}

#[test]
fn a_plant_stops_before_anything_is_written_about_it() {
    let ends = [
        Command::Stop,
        Command::Discard,
        Command::Pause,
        Command::Abort("enough".to_owned()),
        Command::Interrupt("a signal".to_owned()),
    ];
    for command in ends {
        let mut session = Session::new(&profile("introduction, main"), true, None);
        session.ask(Command::Begin);
        session.tick(3);
        session.diary.take();
        session.ask(command.clone());
        session.tick(1);
        let entries = session.diary.take();
        assert_eq!(entries[0], Entry::Halt, "{command:?}: {entries:?}");
        assert!(entries.iter().any(|entry| matches!(entry, Entry::Told(_))), "{entries:?}");
    }
    let mut session = Session::new(&profile("introduction, main"), true, None);
    session.ask(Command::Begin);
    session.tick(TICKS - 1);
    session.diary.take();
    session.tick(1);
    let entries = session.diary.take();
    let after: Vec<&Entry> = entries.iter().skip_while(|entry| **entry != Entry::Halt).collect();
    let before = [Entry::Applied(PUSH), Entry::Told("step")];
    assert_eq!(entries[..2], before, "{entries:?}");
    assert_eq!(after.len(), entries.len() - 2, "the rollout's end: {entries:?}");
}

/// From the second tick of the first rollout on the state is finite, but not in units of the
/// learner's norm. Counts are told at the ends of eight whole rollouts.
#[test]
fn a_sample_that_the_learner_refuses_is_counted_and_not_learned() {
    let far = Lost { at_look: 4, to: [f64::MAX, 0.0, 0.0, 0.0], says: None };
    let outcome = Session::new(&profile("main"), false, Some(far)).finish();
    assert_eq!(outcome.finish, Finish::Complete);
    let Notary { learned, refused, .. } = outcome.witness;
    assert_eq!((learned, refused), (43, 5));
}

#[test]
fn a_tenth_crossed_in_a_discarded_attempt_is_stored_anew() {
    let mut session = Session::new(&profile("main"), true, None);
    session.ask(Command::Begin);
    session.tick(5);
    assert_eq!(policies(&session.diary.take()), [10]);
    session.ask(Command::Discard);
    session.tick(5);
    assert_eq!(policies(&session.diary.take()), [10], "stored again in the repeat");
    let outcome = session.finish();
    assert_eq!(outcome.finish, Finish::Complete);
    assert_eq!(outcome.episodes.iter().filter(|row| row.end == End::Discarded).count(), 1);
    let stored = outcome.witness.policies;
    let percents: Vec<u8> = stored.iter().map(|(percent, _)| *percent).collect();
    assert_eq!(percents, [10, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 100]);
    let [first, repeated] = [0, 1].map(|at| serde_json::to_string(&stored[at].1).unwrap());
    assert_ne!(first, repeated, "the repeat pushes harder");
}
