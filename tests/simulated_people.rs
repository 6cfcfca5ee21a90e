//! How well simulated people do their tasks without a robot, on virtual time.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, helpers too")]
#![expect(clippy::print_stdout, reason = "one test prints tables")]

use coadapt::operator::simulated::{Kind, Skill, ball_beam, mountain_car, swing_up};
use coadapt::operator::{Operator, Practice, View};
use coadapt::plant::{self, Plant};
use coadapt::random::{Place, Purpose, stream};
use coadapt::signal::{Action, Seconds, State};

/// A person at a plant.
struct Desk<P, O> {
    plant: P,
    operator: O,
    seed: u64,
    tick: Seconds,
}

impl<P: Plant, O: Operator> Desk<P, O> {
    /// The states and actions of a rollout of at most `ticks`, until `over`.
    fn rollout(
        &mut self,
        number: u32,
        practised: Seconds,
        start: State,
        ticks: u32,
        over: impl Fn(&State) -> bool,
    ) -> Vec<(State, Action)> {
        let place = Place { phase: 2, rollout: number, attempt: 0 };
        self.plant.reseed(stream(self.seed, Purpose::Friction, place));
        self.operator.begin(place, Practice { rollouts: number - 1, time: practised });
        let mut state = start;
        let mut rows = Vec::new();
        for tick in 0..ticks {
            let time = self.tick * f64::from(tick);
            let view = View { state: &state, now: time, rollout_time: time };
            let action = self.operator.intent(view).action();
            rows.push((state, action));
            state = self.plant.step(&state, action);
            if over(&state) {
                break;
            }
        }
        rows
    }
}

fn mean(values: &[f64]) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "few values")]
    let count = values.len().max(1) as f64;
    values.iter().sum::<f64>() / count
}

const TICK: Seconds = Seconds(0.02);
/// Practice before what is measured: the introduction.
const INTRODUCTION: Seconds = Seconds(180.0);

/// What came of swinging up for some time.
#[derive(Clone, Copy, Debug)]
struct Swung {
    height: f64,
    longest_hold_s: f64,
    /// Of the times within 30° of upright that last 0.3 s or longer, the mean.
    mean_hold_s: f64,
    /// Until the pole was first within 30° of upright for half a second; infinite if never.
    up_s: f64,
}

/// A rollout that begins hanging at rest, after so much practice.
fn swing_up(
    params: &swing_up::Params,
    skill: Skill,
    kind: Kind,
    seed: u64,
    practised: Seconds,
    seconds: u32,
) -> Swung {
    let physics = plant::cart_pole::Params { pole_length_m: 0.6, ..Default::default() };
    let mut desk = Desk {
        operator: swing_up::Swinger::new(params, skill, kind, seed, TICK, &physics),
        plant: plant::cart_pole::CartPole::new(physics, TICK),
        seed,
        tick: TICK,
    };
    let hanging = State::new([0.0, 0.0, std::f64::consts::PI, 0.0]);
    let rows = desk.rollout(1, practised, hanging, seconds * 50, |_| false);
    let heights: Vec<f64> = rows.iter().map(|(state, _)| state[2].cos()).collect();
    let (mut longest, mut hold, mut up_s) = (0.0_f64, 0.0, f64::INFINITY);
    let mut holds = Vec::new();
    for (tick, height) in heights.iter().enumerate() {
        if *height > 30_f64.to_radians().cos() {
            hold += TICK.0;
        } else {
            holds.extend((hold > 0.3).then_some(hold));
            hold = 0.0;
        }
        if hold > 0.5 && up_s.is_infinite() {
            #[expect(clippy::cast_precision_loss, reason = "few ticks")]
            let now = tick as f64 * TICK.0;
            up_s = now - 0.5;
        }
        longest = longest.max(hold);
    }
    holds.extend((hold > 0.3).then_some(hold));
    Swung { mean_hold_s: mean(&holds), height: mean(&heights), longest_hold_s: longest, up_s }
}

/// What came of rolling the ball.
#[derive(Clone, Copy, Debug)]
struct Rolled {
    /// R of eq. 27 without learning or help, m/s.
    reward: f64,
    /// How often a minute an end stopped the ball.
    hits_min: f64,
}

fn roll(
    params: &ball_beam::Params,
    skill: Skill,
    kind: Kind,
    seed: u64,
    practised: Seconds,
    seconds: u32,
) -> Rolled {
    let physics = plant::ball_beam::Params::default();
    let end = physics.beam_half_length_m;
    let mut desk = Desk {
        operator: ball_beam::Roller::new(params, skill, kind, seed, TICK, &physics),
        plant: plant::ball_beam::BallBeam::new(physics, TICK),
        seed,
        tick: TICK,
    };
    let rows = desk.rollout(1, practised, State::new([0.0; 4]), seconds * 50, |_| false);
    let reward = |state: &State| state[1].abs() - if state[0].abs() > 0.17 { 1.0 } else { 0.0 };
    let rewards: Vec<f64> = rows.iter().map(|(state, _)| reward(state)).collect();
    let hits = rows
        .windows(2)
        .filter(|pair| pair[1].0[0].abs() >= end && pair[0].0[0].abs() < end)
        .count();
    #[expect(clippy::cast_precision_loss, reason = "few hits")]
    let hits = hits as f64;
    Rolled { reward: mean(&rewards), hits_min: hits * 60.0 / f64::from(seconds) }
}

/// The steps of `rollouts` drives from (−0.7, 0), 500 at most.
fn drive(
    params: &mountain_car::Params,
    skill: Skill,
    kind: Kind,
    seed: u64,
    practised: Seconds,
    rollouts: u32,
) -> Vec<f64> {
    const TICK: Seconds = Seconds(0.04);
    let physics = plant::mountain_car::Params::default();
    let mut desk = Desk {
        operator: mountain_car::Driver::new(params, skill, kind, seed, TICK, &physics),
        plant: plant::mountain_car::MountainCar::new(physics),
        seed,
        tick: TICK,
    };
    let mut time = practised;
    (1..=rollouts)
        .map(|number| {
            let start = State::new([-0.7, 0.0]);
            let rows = desk.rollout(number, time, start, 500, |state| state[0] >= 0.5);
            #[expect(clippy::cast_precision_loss, reason = "at most 500")]
            let steps = rows.len() as f64;
            time = time + TICK * steps;
            steps
        })
        .collect()
}

/// Seeds of the tests; the tables of the modules' docs are over 1 to 20.
const SEEDS: std::ops::RangeInclusive<u64> = 1..=8;

/// A measure's mean over the people of each skill, after the introduction.
fn by_skill(measure: impl Fn(Skill, u64) -> f64) -> [f64; 3] {
    Skill::ALL.map(|skill| mean(&SEEDS.map(|seed| measure(skill, seed)).collect::<Vec<_>>()))
}

#[test]
fn the_more_skilled_keep_the_pole_higher_and_longer() {
    let params = swing_up::Params::default();
    let swung = |skill, seed| swing_up(&params, skill, Kind::DelayedPd, seed, INTRODUCTION, 120);
    let [naive, average, expert] = by_skill(|skill, seed| swung(skill, seed).height);
    assert!(naive + 0.1 < average && average + 0.1 < expert, "{naive} {average} {expert}");
    let [naive, average, expert] = by_skill(|skill, seed| swung(skill, seed).longest_hold_s);
    assert!((0.2..1.5).contains(&naive), "{naive}");
    assert!((1.5..3.5).contains(&average), "{average}");
    assert!((4.0..15.0).contains(&expert), "{expert}");
    let [naive, average, expert] = by_skill(|skill, seed| swung(skill, seed).mean_hold_s);
    assert!(naive < 0.8 && (0.5..2.0).contains(&average), "{naive} {average}");
    assert!((1.5..6.0).contains(&expert), "{expert}");
    let mut up: Vec<f64> = SEEDS.map(|seed| swung(Skill::Expert, seed).up_s).collect();
    up.sort_by(f64::total_cmp);
    assert!(up[4] < 5.0 && up[7] < 10.0, "{up:?}");
}

#[test]
fn the_more_skilled_roll_the_ball_faster_without_hitting_the_ends() {
    let params = ball_beam::Params::default();
    let rolled = |skill, seed| roll(&params, skill, Kind::DelayedPd, seed, INTRODUCTION, 120);
    let [naive, average, expert] = by_skill(|skill, seed| rolled(skill, seed).reward);
    assert!((0.04..0.1).contains(&naive), "{naive}");
    assert!((0.09..0.14).contains(&average), "{average}");
    assert!((0.13..0.18).contains(&expert), "{expert}");
    assert!(naive < average && average < expert);
    let [naive, average, expert] = by_skill(|skill, seed| rolled(skill, seed).hits_min);
    assert!(expert <= average && average <= naive && naive < 2.0, "{naive} {average} {expert}");
}

#[test]
fn the_more_skilled_drive_to_the_flag_in_fewer_steps() {
    let params = mountain_car::Params::default();
    let [naive, average, expert] = by_skill(|skill, seed| {
        mean(&drive(&params, skill, Kind::DelayedPd, seed, INTRODUCTION, 10))
    });
    assert!((150.0..250.0).contains(&naive), "{naive}");
    assert!((120.0..160.0).contains(&average), "{average}");
    assert!((104.0..120.0).contains(&expert), "{expert}");
}

#[test]
fn practice_helps_in_every_task_and_with_every_habit() {
    let later = INTRODUCTION + Seconds(1000.0);
    let (pole, ball, car) = (
        swing_up::Params::default(),
        ball_beam::Params::default(),
        mountain_car::Params::default(),
    );
    for kind in Kind::ALL {
        let over = |measure: &dyn Fn(u64) -> f64| mean(&SEEDS.map(measure).collect::<Vec<_>>());
        let height = |t| over(&|seed| swing_up(&pole, Skill::Naive, kind, seed, t, 60).height);
        let reward = |t| over(&|seed| roll(&ball, Skill::Naive, kind, seed, t, 60).reward);
        let steps = |t| over(&|seed| mean(&drive(&car, Skill::Naive, kind, seed, t, 5)));
        let (first, last) = (height(INTRODUCTION), height(later));
        assert!(first < last, "{kind} pole: {first} {last}");
        let (first, last) = (reward(INTRODUCTION), reward(later));
        assert!(first < last, "{kind} ball: {first} {last}");
        let (first, last) = (steps(INTRODUCTION), steps(later));
        assert!(first > last, "{kind} car: {first} {last}");
    }
}

/// The actions of a rollout at `place`, with a state that circles around `middle`.
fn actions(
    operator: &mut dyn Operator,
    middle: &[f64],
    number: u32,
    practised: Seconds,
) -> Vec<f64> {
    let place = Place { phase: 2, rollout: number, attempt: 0 };
    operator.begin(place, Practice { rollouts: number - 1, time: practised });
    (0..300)
        .map(|tick| {
            let time = TICK * f64::from(tick);
            let swing = 0.1 * (time.0 * 3.0).sin();
            let moved: Vec<f64> = middle.iter().map(|value| value + swing).collect();
            let state = State::from_slice(&moved).unwrap();
            operator.intent(View { state: &state, now: time, rollout_time: time }).action().0
        })
        .collect()
}

/// An operator for each task, its limit, and a state.
fn everyone(kind: Kind, seed: u64) -> Vec<(Box<dyn Operator>, f64, Vec<f64>)> {
    let skill = Skill::Naive;
    let (pole, ball, car) = (
        plant::cart_pole::Params { force_limit_n: 2.0, ..Default::default() },
        plant::ball_beam::Params { voltage_limit_v: 1.0, ..Default::default() },
        plant::mountain_car::Params { throttle_limit: 0.5, ..Default::default() },
    );
    let swinger =
        swing_up::Swinger::new(&swing_up::Params::default(), skill, kind, seed, TICK, &pole);
    let roller =
        ball_beam::Roller::new(&ball_beam::Params::default(), skill, kind, seed, TICK, &ball);
    let driver =
        mountain_car::Driver::new(&mountain_car::Params::default(), skill, kind, seed, TICK, &car);
    vec![
        (Box::new(swinger), 2.0, vec![0.0, 0.0, 3.0, 0.0]),
        (Box::new(roller), 1.0, vec![0.0; 4]),
        (Box::new(driver), 0.5, vec![-0.5, 0.0]),
    ]
}

#[test]
fn actions_repeat_by_seed_place_and_practice_and_stay_within_the_limit() {
    for kind in Kind::ALL {
        let people = everyone(kind, 5).into_iter().zip(everyone(kind, 5)).zip(everyone(kind, 6));
        for (task, (((mut one, limit, middle), (mut twin, ..)), (mut other, ..))) in
            people.enumerate()
        {
            let practised = Seconds(60.0);
            let seventh = actions(&mut *one, &middle, 7, practised);
            assert!(seventh.iter().all(|action| action.abs() <= limit), "{kind} {task}");
            assert!(seventh.iter().any(|action| *action != 0.0), "{kind} {task}");
            assert_ne!(seventh, actions(&mut *one, &middle, 8, practised), "{kind} {task}");
            // As in a session resumed before its seventh rollout: whoever is told the same
            // place and practice does the same, whatever went before.
            assert_eq!(seventh, actions(&mut *one, &middle, 7, practised), "{kind} {task}");
            assert_eq!(seventh, actions(&mut *twin, &middle, 7, practised), "{kind} {task}");
            assert_ne!(seventh, actions(&mut *other, &middle, 7, practised), "{kind} {task}");
            assert_ne!(seventh, actions(&mut *one, &middle, 7, Seconds(0.0)), "{kind} {task}");
        }
    }
}

/// Prints the tables of the modules' docs.
#[test]
#[ignore = "for people: --ignored --nocapture"]
fn measure() {
    let cells = |kind: Kind, measure: &dyn Fn(Skill, Seconds, u64) -> f64, digits: usize| {
        let cells = Skill::ALL.map(|skill| {
            let of = |t| mean(&(1..=20).map(|seed| measure(skill, t, seed)).collect::<Vec<_>>());
            let (first, last) = (of(INTRODUCTION), of(INTRODUCTION + Seconds(1000.0)));
            format!("{first:.digits$}, {last:.digits$}")
        });
        println!("//! | {kind} | {} |", cells.join(" | "));
    };
    let (pole, ball, car) = (
        swing_up::Params::default(),
        ball_beam::Params::default(),
        mountain_car::Params::default(),
    );
    println!("height");
    for kind in Kind::ALL {
        cells(kind, &|skill, t, seed| swing_up(&pole, skill, kind, seed, t, 120).height, 2);
    }
    println!("mean hold, s");
    for kind in Kind::ALL {
        cells(kind, &|skill, t, seed| swing_up(&pole, skill, kind, seed, t, 120).mean_hold_s, 1);
    }
    println!("longest hold, s");
    for kind in Kind::ALL {
        cells(kind, &|skill, t, seed| swing_up(&pole, skill, kind, seed, t, 120).longest_hold_s, 1);
    }
    println!("reward, m/s");
    for kind in Kind::ALL {
        cells(kind, &|skill, t, seed| roll(&ball, skill, kind, seed, t, 120).reward, 3);
    }
    println!("hits a minute");
    for kind in Kind::ALL {
        cells(kind, &|skill, t, seed| roll(&ball, skill, kind, seed, t, 120).hits_min, 1);
    }
    println!("steps");
    for kind in Kind::ALL {
        cells(kind, &|skill, t, seed| mean(&drive(&car, skill, kind, seed, t, 10)), 0);
    }
}
