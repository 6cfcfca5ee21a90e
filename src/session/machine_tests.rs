//! Every (stage × event) pair, and what no order of events may do.

use std::fmt::Write as _;

use proptest::prelude::*;

use super::*;
use crate::session::plan::{Params, PhasePlan, Wanted};
use crate::signal::Seconds;

fn plan(attended: bool) -> Plan {
    let params = Params {
        introduction_rollouts: Some(2),
        main_rollouts: Some(2),
        autonomous_rollouts: 1,
        hold_s: 0.06,
        autonomous_hold_s: 0.0,
        break_s: 0.04,
        ..Params::default()
    };
    Plan::new(&params, Seconds(0.02), 1, attended)
}

const fn at(phase: Phase, rollout: u32, step: u32) -> Moment {
    Moment { phase, rollout, attempt: 0, step, steps_before: 0 }
}

/// A stage in few words, for the table.
fn words(stage: Stage) -> String {
    let place = |m: Moment| {
        let again = if m.attempt > 0 { format!("'{}", m.attempt) } else { String::new() };
        format!("{}{}{again}@{}", &m.phase.word()[..1], m.rollout, m.step)
    };
    match stage {
        Stage::Instruction(m) => format!("instruction {}", place(m)),
        Stage::Break { next, ticks_left } => format!("break {ticks_left} {}", place(next)),
        Stage::Hold { moment, ticks_left } => format!("hold {ticks_left} {}", place(moment)),
        Stage::Running(m) => format!("running {}", place(m)),
        Stage::Paused(m) => format!("paused {}", place(m)),
        Stage::Stopped(m) => format!("stopped {}", place(m)),
        Stage::Finished(how) => format!("{how:?}"),
    }
}

fn effect_words(effects: &[Effect]) -> String {
    let words: Vec<String> = effects
        .iter()
        .map(|effect| match effect {
            Effect::Halt => "halt".to_owned(),
            Effect::Enter(phase) => format!("enter {}", phase.word()),
            Effect::Prepare(m) => format!("prepare {}", m.rollout),
            Effect::GoOn(m) => format!("go on {}", m.rollout),
            Effect::Release(_) => "release".to_owned(),
            Effect::Close { end, .. } => end.word().to_owned(),
            Effect::Restore => "restore".to_owned(),
            Effect::Leave(phase) => format!("leave {}", phase.word()),
            Effect::Finish(how) => format!("{how:?}"),
        })
        .collect();
    words.join(", ")
}

/// The eight events of the table, in its order.
const EVENTS: [(&str, Event); 8] = [
    ("begin", Event::Begin),
    ("tick", Event::Tick(None)),
    ("failed", Event::Tick(Some(End::Failed))),
    ("cap", Event::Tick(Some(End::Cap))),
    ("pause", Event::Pause),
    ("discard", Event::Discard),
    ("stop", Event::Stop),
    ("abort", Event::Abort),
];

#[test]
fn every_stage_in_every_phase_answers_every_event_as_the_table_says() {
    let plan = plan(true);
    let mut table = String::new();
    for phase in Phase::ALL {
        let stages = [
            Stage::Instruction(Moment::start_of(phase)),
            Stage::Break { next: Moment::start_of(phase), ticks_left: 2 },
            Stage::Break { next: Moment::start_of(phase), ticks_left: 1 },
            Stage::Hold { moment: Moment::start_of(phase), ticks_left: 3 },
            Stage::Hold { moment: Moment::start_of(phase), ticks_left: 1 },
            Stage::Hold { moment: at(phase, 1, 7), ticks_left: 2 },
            Stage::Running(at(phase, 1, 0)),
            Stage::Running(at(phase, 1, 7)),
            Stage::Running(at(phase, 2, 7)),
            Stage::Paused(at(phase, 1, 0)),
            Stage::Paused(at(phase, 1, 7)),
            Stage::Stopped(at(phase, 1, 0)),
        ];
        for stage in stages {
            for (name, event) in EVENTS {
                let (next, effects) = transition(&plan, stage, event);
                let becomes = if next == stage { "·".to_owned() } else { words(next) };
                let (stage, effects) = (words(stage), effect_words(&effects));
                writeln!(table, "{stage:<24} {name:<8} → {becomes:<24} {effects}").unwrap();
            }
        }
    }
    for how in [Finish::Complete, Finish::Aborted] {
        for (_, event) in EVENTS {
            assert_eq!(
                transition(&plan, Stage::Finished(how), event),
                (Stage::Finished(how), vec![])
            );
        }
    }
    insta::assert_snapshot!("machine_table", table);
}

/// Where the plant is not returned, a rollout whose time is over goes on at once; one that
/// failed does not, and neither does one that nobody steers.
#[test]
fn a_session_without_returns_goes_on_where_it_was() {
    let mut plan = plan(true);
    plan.returns = false;
    let over = |phase, end| {
        let stage = Stage::Running(at(phase, 1, 7));
        let (next, effects) = transition(&plan, stage, Event::Tick(Some(end)));
        (words(next), effect_words(&effects))
    };
    let said = |stage: &str, effects: &str| (stage.to_owned(), effects.to_owned());
    assert_eq!(over(Phase::Main, End::Cap), said("running m2@0", "cap, go on 2"));
    let held = said("hold 3 m2@0", "halt, failed, prepare 2");
    assert_eq!(over(Phase::Main, End::Failed), held);
    assert!(over(Phase::Autonomous, End::Cap).1.starts_with("halt, cap, leave autonomous"));
    let discarded = transition(&plan, Stage::Running(at(Phase::Main, 2, 7)), Event::Discard);
    assert_eq!(effect_words(&discarded.1), "halt, discarded, restore, prepare 2");
}

#[test]
fn an_unattended_session_runs_through_without_a_person() {
    let plan = plan(false);
    let (mut stage, effects) = begin(&plan, None, false);
    let mut story = effect_words(&effects);
    for _ in 0..200 {
        let end = match stage {
            Stage::Running(m) if m.step == 4 => Some(End::Failed),
            _ => None,
        };
        let (next, effects) = transition(&plan, stage, Event::Tick(end));
        stage = next;
        if !effects.is_empty() {
            write!(story, "\n{}", effect_words(&effects)).unwrap();
        }
    }
    assert_eq!(stage, Stage::Finished(Finish::Complete));
    insta::assert_snapshot!(story, @r"
    enter introduction, prepare 1
    release
    halt, failed, prepare 2
    release
    halt, failed, leave introduction, enter main, prepare 1
    release
    halt, failed, prepare 2
    release
    halt, failed, leave main, enter autonomous, prepare 1, release
    halt, failed, leave autonomous, enter zero_control, prepare 1, release
    halt, failed, leave zero_control, Complete
    ");
}

#[test]
fn a_set_duration_ends_the_phase_in_the_middle_of_a_rollout() {
    let params = Params {
        phases: vec![Wanted::Main],
        main_rollouts: None,
        main_duration_s: Some(1.0),
        hold_s: 0.0,
        ..Params::default()
    };
    let plan = Plan::new(&params, Seconds(0.02), 1, false);
    assert_eq!(plan.phases, [PhasePlan { phase: Phase::Main, rollouts: None, steps: Some(50) }]);
    let (mut stage, _) = begin(&plan, None, false);
    let mut ends = Vec::new();
    for k in 1..=60 {
        let end = (k % 20 == 0).then_some(End::Failed);
        let (next, effects) = transition(&plan, stage, Event::Tick(end));
        stage = next;
        ends.extend(effects.iter().filter_map(|effect| match effect {
            Effect::Close { moment, end } => Some((k, moment.step, *end)),
            _ => None,
        }));
    }
    assert_eq!(ends, [(20, 20, End::Failed), (40, 20, End::Failed), (50, 10, End::Time)]);
    assert_eq!(stage, Stage::Finished(Finish::Complete));
}

#[test]
fn a_resumed_session_goes_on_where_it_was() {
    let unattended = plan(false);
    let from = at(Phase::Main, 2, 0);
    let (stage, effects) = begin(&unattended, Some(from), false);
    assert_eq!(effects, [Effect::Prepare(from)], "what was learned is kept");
    assert_eq!(stage.moment(), Some(from));
    let (stage, _) = begin(&plan(true), Some(from), false);
    assert_eq!(stage, Stage::Instruction(from), "a person reads first");
}

fn any_event() -> impl Strategy<Value = Event> {
    prop_oneof![
        2 => Just(Event::Begin),
        20 => Just(Event::Tick(None)),
        2 => Just(Event::Tick(Some(End::Failed))),
        1 => Just(Event::Pause),
        1 => Just(Event::Discard),
        1 => Just(Event::Stop),
    ]
}

proptest! {
    /// Whatever happens, rollouts are prepared before they are released and closed after,
    /// each planned rollout is closed by exactly one end that is not a discard, and the
    /// plant is only driven in `Running`.
    #[test]
    fn no_order_of_events_breaks_the_rollouts(
        attended: bool,
        events in prop::collection::vec(any_event(), 0..1500),
    ) {
        let plan = plan(attended);
        let (mut stage, mut effects) = begin(&plan, None, false);
        let (mut prepared, mut released) = (None, None);
        let mut counted = Vec::new();
        for event in events {
            for effect in effects.drain(..) {
                match effect {
                    Effect::Prepare(m) => {
                        prop_assert_eq!(m.step, 0);
                        prepared = Some((m.phase, m.rollout, m.attempt));
                        released = None;
                    }
                    Effect::Release(m) => {
                        prop_assert_eq!(prepared, Some((m.phase, m.rollout, m.attempt)));
                        released = prepared;
                    }
                    Effect::Close { moment: m, end } => {
                        prop_assert_eq!(released, Some((m.phase, m.rollout, m.attempt)));
                        prop_assert!(m.step > 0);
                        if end != End::Discarded {
                            counted.push((m.phase, m.rollout));
                        }
                    }
                    _ => {}
                }
            }
            (stage, effects) = transition(&plan, stage, event);
        }
        let mut once = counted.clone();
        once.sort_unstable();
        once.dedup();
        prop_assert_eq!(once, counted, "in order, each once");
        let (over, _) = transition(&plan, stage, Event::Abort);
        prop_assert!(matches!(over, Stage::Finished(_)));
    }
}
