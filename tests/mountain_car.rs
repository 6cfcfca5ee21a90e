//! The mountain car against golden data and its own physics.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking, helpers too")]

use std::io::Read;

use coadapt::plant::Plant;
use coadapt::plant::mountain_car::{MountainCar, Params};
use coadapt::signal::{Action, State};
use proptest::prelude::*;

const FILES: [&str; 4] = ["random-actions", "pump", "walls", "grid-starts"];

/// A golden row: throttle (none at the start), position, velocity, and whether the case
/// ended here.
struct Row {
    throttle: Option<f64>,
    x: f64,
    v: f64,
    at_goal: bool,
}

fn golden(name: &str) -> Vec<Row> {
    let path = format!("{}/tests/data/mountain-car/{name}.csv.gz", env!("CARGO_MANIFEST_DIR"));
    let mut text = String::new();
    flate2::read::GzDecoder::new(std::fs::File::open(path).unwrap())
        .read_to_string(&mut text)
        .unwrap();
    let row = |row: csv::StringRecord| Row {
        throttle: row[2].parse::<f64>().ok().map(|action| action - 1.0),
        x: row[3].parse().unwrap(),
        v: row[4].parse().unwrap(),
        at_goal: &row[5] == "1",
    };
    csv::Reader::from_reader(text.as_bytes()).records().map(|r| row(r.unwrap())).collect()
}

/// Whether `state` is the row's. Gymnasium clips the position at 0.6, the thesis at 0.5,
/// where every case ends: the position of an ending row is cut to 0.5.
fn agrees(state: &State, row: &Row) -> bool {
    (state[0] - row.x.min(0.5)).abs() <= 1e-12 && (state[1] - row.v).abs() <= 1e-12
}

#[test]
fn each_step_agrees_with_gymnasium() {
    let mut plant = MountainCar::new(Params::default());
    let (mut compared, mut clipped) = (0, 0);
    for name in FILES {
        for pair in golden(name).windows(2) {
            let Some(throttle) = pair[1].throttle else { continue };
            let state = plant.step(&State::new([pair[0].x, pair[0].v]), Action(throttle));
            assert!(agrees(&state, &pair[1]), "{name}: {state:?}");
            assert_eq!(pair[1].at_goal, state[0] >= 0.5, "{name}: {state:?}");
            compared += 1;
            clipped += u32::from(pair[1].x > 0.5);
        }
    }
    assert!(compared > 2500 && clipped >= 5, "{compared} rows, {clipped} beyond the goal");
}

#[test]
fn whole_runs_agree_with_gymnasium() {
    let mut plant = MountainCar::new(Params::default());
    for name in FILES {
        let mut state = State::default();
        for row in golden(name) {
            state = match row.throttle {
                None => State::new([row.x, row.v]),
                Some(throttle) => plant.step(&state, Action(throttle)),
            };
            assert!(agrees(&state, &row), "{name}: {state:?}");
        }
    }
}

#[test]
fn the_bottom_of_the_valley_is_at_rest() {
    let mut plant = MountainCar::new(Params::default());
    let bottom = State::new([-std::f64::consts::FRAC_PI_6, 0.0]);
    let mut state = bottom;
    for _ in 0..1000 {
        state = plant.step(&state, Action(0.0));
    }
    assert!((state[0] - bottom[0]).abs() < 1e-12 && state[1].abs() < 1e-12, "{state:?}");
}

#[test]
fn the_wall_takes_all_speed() {
    let mut plant = MountainCar::new(Params::default());
    let state = plant.step(&State::new([-1.15, -0.07]), Action(0.0));
    assert_eq!(state, State::new([-1.2, 0.0]));
    let away = plant.step(&state, Action(0.0));
    assert!(away[0] > -1.2 && away[1] > 0.0, "the slope rolls the car off the wall");
}

#[test]
fn full_throttle_alone_does_not_reach_the_goal_but_swinging_does() {
    let mut plant = MountainCar::new(Params::default());
    let mut steps = |throttle: fn(f64) -> f64| {
        let mut state = State::new([-0.7, 0.0]);
        (1..=500).find(|_| {
            state = plant.step(&state, Action(throttle(state[1])));
            state[0] >= 0.5
        })
    };
    assert_eq!(steps(|_| 1.0), None);
    assert_eq!(steps(|v| if v < 0.0 { -1.0 } else { 1.0 }), Some(113));
}

/// v²/2 and the potential of eq. 30's slope.
fn energy(p: &Params, state: &State) -> f64 {
    let &[x, v] = &state[..] else { panic!() };
    v * v / 2.0 + p.gravity / 3.0 * (3.0 * x).sin()
}

proptest! {
    #[test]
    fn coasting_keeps_energy_within_a_bound(x in -0.95..-0.1_f64) {
        let params = Params::default();
        let mut plant = MountainCar::new(params.clone());
        let mut state = State::new([x, 0.0]);
        let before = energy(&params, &state);
        // Velocity first, then position: the map keeps E − v·∂E/∂x/2 up to second order, so
        // that E itself swings by half of this product and never drifts.
        let bound = 0.5 * 0.06 * params.gravity;
        for _ in 0..3000 {
            state = plant.step(&state, Action(0.0));
            prop_assert!((energy(&params, &state) - before).abs() <= bound, "{state:?}");
        }
    }

    #[test]
    fn the_state_stays_in_its_bounds(
        x in -1.2..0.5_f64, v in -0.07..0.07_f64,
        throttles in prop::collection::vec(-100.0..100.0_f64, 1..200),
    ) {
        let mut plant = MountainCar::new(Params::default());
        let mut state = State::new([x, v]);
        for throttle in throttles {
            state = plant.step(&state, Action(throttle));
            prop_assert!((-1.2..=0.5).contains(&state[0]) && state[1].abs() <= 0.07);
            prop_assert!(state[0] > -1.2 || state[1] == 0.0);
        }
    }
}
