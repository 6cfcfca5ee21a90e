//! The ball and beam against its equations' solutions.

use coadapt::plant::Plant;
use coadapt::plant::ball_beam::{BallBeam, Params};
use coadapt::signal::{Action, Seconds, State};
use proptest::prelude::*;

const TICK: Seconds = Seconds(0.02);

/// The state after `ticks` under a constant voltage.
fn after(params: &Params, start: State, voltage: f64, ticks: u32) -> State {
    let mut plant = BallBeam::new(params.clone(), TICK);
    (0..ticks).fold(start, |state, _| plant.step(&state, Action(voltage)))
}

fn level() -> State {
    State::new([0.0; 4])
}

#[test]
fn the_servo_answers_a_voltage_as_equation_24_says() {
    let p = Params { servo_limit_rad: 3.0, ..Params::default() };
    let (gain, lag, voltage) = (p.servo_gain_rad_s_v, p.servo_time_constant_s, 2.0);
    for ticks in 1..=40 {
        let t = f64::from(ticks) * TICK.0;
        let state = after(&p, level(), voltage, ticks);
        let left = (-t / lag).exp();
        let theta_dot = gain * voltage * (1.0 - left);
        let theta = gain * voltage * (t - lag * (1.0 - left));
        assert!((state[3] - theta_dot).abs() < 1e-12, "{t}: {state:?}");
        assert!((state[2] - theta).abs() < 1e-12, "{t}: {state:?}");
    }
}

#[test]
fn the_servo_does_not_depend_on_the_substeps() {
    let with = |substeps| {
        let params = Params { substeps, ..Params::default() };
        let state = after(&params, State::new([0.0, 0.0, 0.1, -1.0]), 3.0, 7);
        (state[2], state[3])
    };
    let ((theta, theta_dot), (one_theta, one_theta_dot)) = (with(100), with(1));
    assert!((theta - one_theta).abs() < 1e-12 && (theta_dot - one_theta_dot).abs() < 1e-12);
}

#[test]
fn the_ball_accelerates_on_a_beam_at_rest_as_equation_25_says() {
    let p = Params::default();
    let theta = 0.3;
    let h = TICK.0 / f64::from(p.substeps);
    for ticks in 1..=60 {
        let t = f64::from(ticks) * TICK.0;
        let state = after(&p, State::new([-0.1, 0.05, theta, 0.0]), 0.0, ticks);
        let acceleration = p.ball_gain_m_s2_rad * theta;
        assert!((state[1] - (0.05 + acceleration * t)).abs() < 1e-12, "{t}: {state:?}");
        let x = -0.1 + 0.05 * t + acceleration * t * t / 2.0;
        // The position uses the new velocity: half a sub-step ahead of it.
        assert!((state[0] - x).abs() <= acceleration * t * h / 2.0 + 1e-12, "{t}: {state:?}");
    }
}

#[test]
fn the_ball_converges_with_the_substeps() {
    // A pulse of the servo: the exact x is a double integral of eq. 24's step response.
    let (ticks, voltage) = (20, 1.5);
    let exact = {
        let p = Params::default();
        let (t, lag) = (f64::from(ticks) * TICK.0, p.servo_time_constant_s);
        let left = (-t / lag).exp();
        let integral = t * t * t / 6.0 - lag * (t * t / 2.0 - lag * t + lag * lag * (1.0 - left));
        p.ball_gain_m_s2_rad * p.servo_gain_rad_s_v * voltage * integral
    };
    let error = |substeps| {
        let params = Params { substeps, ..Params::default() };
        (after(&params, level(), voltage, ticks)[0] - exact).abs()
    };
    assert!(error(10) < 0.02 * exact, "{:e} of {exact:e}", error(10));
    let ratio = error(10) / error(20);
    assert!((1.9..2.1).contains(&ratio), "of first order: {ratio}");
    assert!(error(1000) < 2e-4 * exact);
}

#[test]
fn a_level_beam_leaves_the_ball_at_rest() {
    let start = State::new([0.07, 0.0, 0.0, 0.0]);
    assert_eq!(after(&Params::default(), start, 0.0, 1000), start);
}

#[test]
fn the_ends_stop_the_ball_and_let_it_go() {
    let p = Params::default();
    let stopped = after(&p, State::new([0.2, 0.3, 1.0, 0.0]), 0.0, 20);
    assert_eq!((stopped[0], stopped[1]), (p.beam_half_length_m, 0.0));
    let [x, v, ..] = stopped[..] else { panic!() };
    let gone = after(&p, State::new([x, v, -0.5, 0.0]), 0.0, 20);
    assert!(gone[0] < p.beam_half_length_m - 0.01 && gone[1] < 0.0, "{gone:?}");
}

#[test]
fn the_servo_stops_at_its_limit_and_returns() {
    let p = Params::default();
    let state = after(&p, level(), 10.0, 50);
    assert_eq!(state[2], 1.46);
    assert_eq!(state[3], 0.0);
    let back = after(&p, state, -10.0, 5);
    assert!(back[2] < 1.0 && back[3] < -10.0, "{back:?}");
}

proptest! {
    #[test]
    fn the_state_stays_in_its_bounds(
        x in -0.2125..0.2125_f64, v in -2.0..2.0_f64, theta in -1.46..1.46_f64,
        voltages in prop::collection::vec(-10.0..10.0_f64, 1..200),
    ) {
        let p = Params::default();
        let mut plant = BallBeam::new(p.clone(), TICK);
        let mut state = State::new([x, v, theta, 0.0]);
        for voltage in voltages {
            state = plant.step(&state, Action(voltage));
            prop_assert!(state[0].abs() <= p.beam_half_length_m);
            prop_assert!(state[2].abs() <= p.servo_limit_rad);
            prop_assert!(state[3].abs() <= p.servo_gain_rad_s_v * p.voltage_limit_v);
            prop_assert!(state.is_finite());
        }
    }

    #[test]
    fn left_and_right_are_mirror_images(
        x in -0.21..0.21_f64, v in -1.0..1.0_f64, theta in -1.4..1.4_f64,
        theta_dot in -5.0..5.0_f64, voltage in -10.0..10.0_f64,
    ) {
        let state = State::new([x, v, theta, theta_dot]);
        let mirrored = State::new([-x, -v, -theta, -theta_dot]);
        let right = after(&Params::default(), state, voltage, 5);
        let left = after(&Params::default(), mirrored, -voltage, 5);
        for (a, b) in right.iter().zip(left.iter()) {
            prop_assert_eq!(*a, -*b);
        }
    }
}
