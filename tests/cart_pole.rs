//! The cart-pole against golden data and physics.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking, helpers too")]

use std::io::Read;

use coadapt::plant::Plant;
use coadapt::plant::cart_pole::{CartPole, Integrator, Params};
use coadapt::signal::{Action, Seconds, State};
use proptest::prelude::*;

const TICK: Seconds = Seconds(0.02);

fn frictionless() -> Params {
    Params {
        pole_friction_per_s: 0.0,
        cart_friction_per_s: 0.0,
        friction_noise_per_s: 0.0,
        track_length_m: None,
        substeps: 1,
        ..Params::default()
    }
}

fn golden(name: &str) -> Vec<csv::StringRecord> {
    let path = format!("{}/tests/data/cart-pole/{name}.csv.gz", env!("CARGO_MANIFEST_DIR"));
    let mut text = String::new();
    flate2::read::GzDecoder::new(std::fs::File::open(path).unwrap())
        .read_to_string(&mut text)
        .unwrap();
    csv::Reader::from_reader(text.as_bytes()).records().map(Result::unwrap).collect()
}

fn agrees_with_gymnasium(name: &str) {
    let mut plant = CartPole::new(frictionless(), TICK);
    let mut state = State::default();
    let mut compared = 0;
    for row in golden(name) {
        let number = |i: usize| row[i].parse::<f64>().unwrap();
        let expected = State::new([number(4), number(5), number(6), number(7)]);
        if &row[2] == "0" {
            let integrator = match &row[1] {
                "euler" => Integrator::Euler,
                _ => Integrator::SemiImplicit,
            };
            plant = CartPole::new(Params { integrator, ..frictionless() }, TICK);
            state = expected;
            continue;
        }
        state = plant.step(&state, Action(number(3)));
        for (ours, theirs) in state.iter().zip(expected.iter()) {
            let error = (ours - theirs).abs() / theirs.abs().max(1.0);
            assert!(error < 1e-10, "{name} {row:?}: {state:?}");
        }
        compared += 1;
    }
    assert!(compared > 300, "{name}: {compared} rows");
}

#[test]
fn bang_bang_forces_agree_with_gymnasium() {
    agrees_with_gymnasium("bang-bang");
}

#[test]
fn real_forces_agree_with_gymnasium() {
    agrees_with_gymnasium("real-forces");
}

#[test]
fn the_full_circle_agrees_with_gymnasium() {
    agrees_with_gymnasium("full-circle");
}

/// Kinetic and potential energy of cart and uniform rod, J.
fn energy(p: &Params, state: &State) -> f64 {
    let &[_, v, theta, omega] = &state[..] else { panic!() };
    let (m, half) = (p.pole_mass_kg, p.pole_length_m / 2.0);
    0.5 * (p.cart_mass_kg + m) * v * v
        + m * half * v * omega * theta.cos()
        + 0.5 * (4.0 / 3.0) * m * half * half * omega * omega
        + m * p.gravity_m_s2 * half * theta.cos()
}

#[test]
fn a_finely_stepped_frictionless_plant_conserves_energy() {
    let params = Params { substeps: 1000, ..frictionless() };
    let mut plant = CartPole::new(params.clone(), TICK);
    let mut state = State::new([0.0, 0.3, 0.2, 0.0]);
    let before = energy(&params, &state);
    for _ in 0..500 {
        state = plant.step(&state, Action(0.0));
    }
    let drift = (energy(&params, &state) - before).abs() / before.abs();
    assert!(drift < 1e-4, "{drift:e}");
}

#[test]
fn a_pole_that_whirls_through_the_full_circle_conserves_energy() {
    let params = Params { pole_length_m: 0.6, substeps: 1000, ..frictionless() };
    let mut plant = CartPole::new(params.clone(), TICK);
    let mut state = State::new([0.0, 0.0, std::f64::consts::PI, 12.0]);
    let before = energy(&params, &state);
    for _ in 0..500 {
        state = plant.step(&state, Action(0.0));
    }
    assert!(state[2] > 6.0 * std::f64::consts::PI, "{state:?}");
    let drift = (energy(&params, &state) - before).abs() / before.abs();
    assert!(drift < 1e-3, "{drift:e}");
}

#[test]
fn friction_takes_energy_away() {
    let params = Params { pole_friction_per_s: 0.2, cart_friction_per_s: 0.5, ..frictionless() };
    let mut plant = CartPole::new(params.clone(), TICK);
    let mut state = State::new([0.0, 0.3, 0.2, 0.0]);
    let before = energy(&params, &state);
    for _ in 0..3000 {
        state = plant.step(&state, Action(0.0));
    }
    assert!(energy(&params, &state) < before - 0.1);
}

#[test]
fn the_zero_state_stays() {
    let mut plant = CartPole::new(Params::default(), TICK);
    let mut state = State::new([0.0; 4]);
    for _ in 0..1000 {
        state = plant.step(&state, Action(0.0));
    }
    assert_eq!(state, State::new([0.0; 4]));
}

#[test]
fn a_hanging_pole_is_at_rest_and_comes_back_to_it() {
    let hanging = State::new([0.0, 0.0, std::f64::consts::PI, 0.0]);
    let params = Params { friction_noise_per_s: 0.0, ..Params::default() };
    let mut plant = CartPole::new(params, TICK);
    let mut settle = |mut state: State, ticks: u32| {
        for _ in 0..ticks {
            state = plant.step(&state, Action(0.0));
        }
        state
    };
    let still = settle(hanging, 1000);
    for (now, before) in still.iter().zip(hanging.iter()) {
        assert!((now - before).abs() < 1e-12, "{still:?}");
    }
    let swung = settle(State::new([0.0, 0.0, 2.6, 0.0]), 5000);
    assert!((swung[2] - hanging[2]).abs() < 1e-3 && swung[3].abs() < 1e-2, "{swung:?}");
}

#[test]
fn an_upright_pole_falls_from_the_slightest_tilt() {
    let mut plant = CartPole::new(Params::default(), TICK);
    let mut state = State::new([0.0, 0.0, 1e-4, 0.0]);
    for _ in 0..200 {
        state = plant.step(&state, Action(0.0));
    }
    assert!(state[2].abs() > 0.5, "{state:?}");
}

#[test]
fn the_cart_bounces_off_the_end_of_the_track() {
    let mut plant = CartPole::new(Params::default(), TICK);
    let mut state = State::new([0.49, 1.0, 0.0, 0.0]);
    state = plant.step(&state, Action(0.0));
    assert!(state[0] <= 0.5 && state[1] < 0.0 && state[1] > -0.25, "{state:?}");
}

proptest! {
    #[test]
    fn the_cart_never_leaves_the_track(
        x in -0.5..0.5_f64, v in -3.0..3.0_f64, theta in -0.5..0.5_f64,
        forces in prop::collection::vec(-10.0..10.0_f64, 1..200),
    ) {
        let mut plant = CartPole::new(Params::default(), TICK);
        let mut state = State::new([x, v, theta, 0.0]);
        for force in forces {
            state = plant.step(&state, Action(force));
            prop_assert!(state[0].abs() <= 0.5);
            prop_assert!(state.is_finite());
        }
    }

    #[test]
    fn left_and_right_are_mirror_images(
        theta in -0.5..0.5_f64, v in -1.0..1.0_f64, force in -10.0..10.0_f64,
    ) {
        let params = Params { friction_noise_per_s: 0.0, ..Params::default() };
        let mut plant = CartPole::new(params, TICK);
        let right = plant.step(&State::new([0.1, v, theta, 0.2]), Action(force));
        let left = plant.step(&State::new([-0.1, -v, -theta, -0.2]), Action(-force));
        for (a, b) in right.iter().zip(left.iter()) {
            prop_assert_eq!(*a, -*b);
        }
    }
}

#[test]
fn drag_is_a_force_that_the_pole_feels() {
    let start = State::new([0.0, 0.4, 2.0, 1.0]);
    let dragged = Params { cart_drag_n_s_per_m: 3.22, ..frictionless() };
    assert_eq!(
        CartPole::new(dragged.clone(), TICK).step(&start, Action(1.77)),
        CartPole::new(frictionless(), TICK).step(&start, Action(1.77 - 3.22 * 0.4)),
    );
    // At the speed where the drag takes all of the force nothing accelerates, and the pole hangs
    // straight. Friction of eq. 15 would let it lean.
    let mut plant =
        CartPole::new(Params { pole_friction_per_s: 2.0, substeps: 10, ..dragged }, TICK);
    let mut state = State::new([0.0, 0.0, std::f64::consts::PI, 0.0]);
    for _ in 0..1500 {
        state = plant.step(&state, Action(1.77));
    }
    assert!((state[1] - 1.77 / 3.22).abs() < 1e-6, "{state:?}");
    assert!((state[2] - std::f64::consts::PI).abs() < 1e-6, "{state:?}");
}
