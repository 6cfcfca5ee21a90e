//! The agent in a session's hands; its equations are tested against golden data in
//! `tests/q_learning.rs`.

use super::*;
use crate::check::{Check, Checker};
use crate::signal::{Action, Seconds};

const PLACE: Place = Place { phase: 2, rollout: 1, attempt: 0 };

fn learner(params: &Params) -> QLearner {
    let mut learner = QLearner::new(params, 3, &mountain_car::Params::default());
    learner.begin(PLACE, Practice::default());
    learner
}

fn wish(learner: &mut QLearner, state: &State) -> f64 {
    let view = View { state, now: Seconds(0.0), rollout_time: Seconds(0.0) };
    learner.intent(view).action().0
}

fn tell(learner: &mut QLearner, state: &State, applied: f64, next: &State, end: Option<End>) {
    learner.told(&Feedback {
        state,
        applied: Action(applied),
        reward: if end == Some(End::Goal) { 100.0 } else { -1.0 },
        next,
        end,
        share: 1.0,
        bumped: false,
        is_frozen: false,
    });
}

/// Drives `steps` steps on a road of its own.
fn drive(learner: &mut QLearner, steps: u32) -> Vec<f64> {
    (0..steps)
        .map(|k| {
            let at = |k: u32| State::new([-1.0 + 0.01 * f64::from(k % 140), 0.02]);
            let wish = wish(learner, &at(k));
            tell(learner, &at(k), wish, &at(k + 1), None);
            wish
        })
        .collect()
}

#[test]
fn the_defaults_pass_and_every_fault_is_named() {
    let faults = |params: &Params| {
        let mut faults = Vec::new();
        params.check(&mut Checker::new(&mut faults));
        faults.into_iter().map(|fault| fault.key).collect::<Vec<_>>()
    };
    assert!(faults(&Params::default()).is_empty());
    let wrong =
        Params { gamma: 1.1, lambda: Some(f64::NAN), velocity_cells: 0, ..Params::default() };
    assert_eq!(faults(&wrong), ["velocity_cells", "gamma", "lambda"]);
}

#[test]
fn the_learning_rate_falls_as_printed() {
    let beta = |episodes| Params::default().beta(episodes);
    assert!((beta(0) - 0.954_992_586_021_435_9).abs() < 1e-12);
    assert!((beta(60_000) - 10.0 / 60_100_f64.powf(0.51)).abs() < 1e-12);
    assert_eq!(Params { beta_scale: 1e3, ..Params::default() }.beta(0), 1.0);
}

#[test]
fn of_equal_values_the_lowest_throttle_wins() {
    let mut table = Table::new(&Params::default(), &mountain_car::Params::default());
    let cell = table.cell(&State::new([-0.5, 0.0]));
    assert_eq!(table.best(cell), Throttle::Back);
    table.add(cell, Throttle::Back, -1.0);
    assert_eq!(table.best(cell), Throttle::Rest);
    table.add(cell, Throttle::Rest, -1.0);
    table.add(cell, Throttle::Ahead, -1.0);
    assert_eq!(table.best(cell), Throttle::Back);
    table.add(cell, Throttle::Ahead, 0.5);
    assert_eq!(table.best(cell), Throttle::Ahead);
}

#[test]
fn every_state_has_a_cell_even_beyond_the_hill() {
    let table = Table::new(&Params::default(), &mountain_car::Params::default());
    let last = table.cell(&State::new([0.5, 0.07]));
    assert_eq!(last, table.cell(&State::new([9.0, f64::INFINITY])));
    for state in [[f64::NAN, f64::NAN], [-9.0, -9.0], [-1.2, -0.07]] {
        assert_eq!(table.best(table.cell(&State::new(state))), Throttle::Back);
    }
    assert_eq!(table.cell(&State::new([-1.2, -0.07])), table.cell(&State::new([-2.0, -1.0])));
}

#[test]
fn looking_often_changes_nothing() {
    let (mut once, mut often) = (learner(&Params::default()), learner(&Params::default()));
    let state = State::new([-1.0, 0.02]);
    for _ in 0..50 {
        wish(&mut often, &state);
    }
    assert_eq!(drive(&mut once, 1000), drive(&mut often, 1000));
}

#[test]
fn the_robot_is_shown_tries_or_what_is_best() {
    let params = Params { epsilon: 1.0, beta_scale: 0.0, ..Params::default() };
    let mut tries = learner(&params);
    let mut best = learner(&Params { shows: Shows::Best, ..params });
    let state = State::new([-1.0, 0.02]);
    let (mut tried, mut shown) = (Vec::new(), Vec::new());
    for _ in 0..100 {
        let view = View { state: &state, now: Seconds(0.0), rollout_time: Seconds(0.0) };
        let wanted = (tries.intent(view), best.intent(view));
        assert_eq!(wanted.0, wanted.1);
        assert_eq!(tries.shown(wanted.0), wanted.0);
        tried.push(wanted.0.action().0);
        shown.push(best.shown(wanted.1).action().0);
        tell(&mut tries, &state, 0.0, &state, None);
        tell(&mut best, &state, 0.0, &state, None);
    }
    assert!(tried.contains(&1.0) && shown.iter().all(|action| *action == -1.0));
}

#[test]
fn what_is_handed_over_for_good_teaches_the_agent_no_more() {
    let mut agent = learner(&Params::default());
    let (state, next) = (State::new([-1.0, 0.02]), State::new([-0.98, 0.02]));
    for is_frozen in [true, false] {
        wish(&mut agent, &state);
        let (applied, share) = (Action(1.0), 1.0);
        let (end, reward, bumped) = (None, -1.0, false);
        let (state, next) = (&state, &next);
        let told = Feedback { state, applied, reward, next, end, share, bumped, is_frozen };
        agent.told(&told);
        assert_eq!(agent.learned().is_empty(), is_frozen);
    }
}

#[test]
fn wishes_are_throttles_and_one_in_ten_is_drawn() {
    let mut wanted = drive(&mut learner(&Params { beta_scale: 0.0, ..Params::default() }), 20_000);
    // Nothing is learned, so that the lowest throttle stays best: what differs was drawn.
    let drawn = wanted.iter().filter(|wish| **wish != -1.0).count();
    assert!((1100..1600).contains(&drawn), "{drawn} of 20000, 1333 expected");
    wanted.sort_unstable_by(f64::total_cmp);
    wanted.dedup();
    assert_eq!(wanted, [-1.0, 0.0, 1.0]);
}

#[test]
fn the_value_moves_of_what_was_wanted_or_of_what_was_done() {
    let (state, next) = (State::new([-0.5, 0.0]), State::new([-0.51, -0.001]));
    for (updates, moved) in [(Updates::Own, Throttle::Back), (Updates::Executed, Throttle::Ahead)] {
        let mut learner = learner(&Params { updates, epsilon: 0.0, ..Params::default() });
        assert_eq!(wish(&mut learner, &state), -1.0);
        tell(&mut learner, &state, 0.6, &next, None);
        let cell = learner.agent().cell(&state);
        for throttle in Throttle::ALL {
            assert_eq!(learner.agent().value(cell, throttle) < 0.0, throttle == moved);
        }
    }
}

#[test]
fn an_end_at_the_flag_has_no_future_and_a_cap_has_one() {
    let (state, next) = (State::new([-0.5, 0.0]), State::new([0.5, 0.02]));
    let params = Params { epsilon: 0.0, q_initial: 10.0, ..Params::default() };
    for (end, target) in [(Some(End::Goal), 100.0), (Some(End::Cap), 8.9), (None, 8.9)] {
        let mut learner = learner(&params);
        wish(&mut learner, &state);
        tell(&mut learner, &state, -1.0, &next, end);
        let value = learner.agent().value(learner.agent().cell(&state), Throttle::Back);
        let expected = 10.0 + params.beta(0) * (target - 10.0);
        assert!((value - expected).abs() < 1e-12, "{end:?}: {value}");
    }
}

#[test]
fn nonsense_is_not_learned() {
    let mut learner = learner(&Params::default());
    let state = State::new([-0.5, 0.0]);
    tell(&mut learner, &state, 0.0, &state, None);
    wish(&mut learner, &state);
    tell(&mut learner, &state, -1.0, &State::new([f64::NAN, 0.0]), Some(End::Failed));
    assert!(learner.learned().is_empty());
}

#[test]
fn what_was_learned_is_recalled_to_the_bit_and_nothing_else_is() {
    let params = Params { lambda: Some(0.9), ..Params::default() };
    let mut one = learner(&params);
    drive(&mut one, 500);
    let learned = one.learned();
    let mut other = learner(&params);
    drive(&mut other, 77);
    assert!(other.recall(&learned));
    let place = Place { rollout: 2, ..PLACE };
    for learner in [&mut one, &mut other] {
        learner.begin(place, Practice { rollouts: 1, time: Seconds(20.0) });
    }
    assert_eq!(drive(&mut one, 500), drive(&mut other, 500));
    assert_eq!(one.learned(), other.learned());

    for damaged in [&[1.0][..], &[0.5, 1.0], &[-1.0, 1.0], &[30_000.0, 1.0], &[0.0, f64::NAN]] {
        assert!(!other.recall(damaged), "{damaged:?}");
    }
    assert_eq!(one.learned(), other.learned());
    assert!(other.recall(&[]) && other.learned().is_empty());
}

#[test]
fn traces_carry_the_flag_back_to_the_last_step_off_the_policy() {
    let plant = mountain_car::Params::default();
    let params = Params { lambda: Some(0.9), gamma: 1.0, ..Params::default() };
    let mut agent = Agent::new(&params, &plant);
    let cells = [-1.0, -0.8, -0.6, -0.4].map(|x| agent.cell(&State::new([x, 0.01])));
    // The second step is off the policy as soon as its neighbour is worth more.
    agent.learn(cells[1], Throttle::Ahead, 1.0, None);
    agent.begin(0);
    let next = |k: usize| cells.get(k + 1).copied();
    for (k, cell) in cells.into_iter().enumerate() {
        let reward = if k == 3 { 100.0 } else { 0.0 };
        agent.learn(cell, Throttle::Back, reward, next(k));
    }
    let beta = params.beta(0);
    let value = |k: usize| agent.value(cells[k], Throttle::Back);
    assert!((value(3) - 100.0 * beta).abs() < 1e-9);
    assert!((value(2) - 90.0 * beta).abs() < 1e-9);
    assert!((value(1) - 81.0 * beta).abs() < 1e-9);
    assert!(value(0) < beta, "{}: an experiment's return was counted", value(0));
}
