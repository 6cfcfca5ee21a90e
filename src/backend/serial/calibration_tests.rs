use std::f64::consts::{PI, TAU};

use super::*;
use crate::backend::emulator::faults::Faults;
use crate::backend::emulator::{self, Emulator};
use crate::backend::safety::warden::Standing;
use crate::backend::serial::bench::{Bench, FORMATS, LIMIT, PERIOD, params};
use crate::backend::serial::driver::Stage as Device;
use crate::backend::wire::{Format, Readings};
use crate::signal::State;
use proptest::prelude::*;

fn about() -> About {
    About {
        device: "usb-robot".to_owned(),
        at: "2026-03-14T09:26:53Z".to_owned(),
        limit: LIMIT,
        half_track_m: Some(0.198),
    }
}

/// How a robot is put together, and who looks at it.
#[derive(Clone, Copy, Debug)]
struct Robot {
    format: Format,
    homing: bool,
    /// The signs of its sensors.
    angle: i32,
    position: f64,
    hanging: f64,
    /// The profile's guess of its motor.
    motor_invert: bool,
    /// The person stands behind it.
    mirrored: bool,
}

impl Robot {
    fn usual(format: Format) -> Self {
        Self {
            format,
            homing: true,
            angle: -1,
            position: 1.0,
            hanging: 900.3,
            motor_invert: false,
            mirrored: false,
        }
    }

    fn params(self) -> Params {
        let mut params = params(self.format);
        params.homing = self.homing;
        params.scales.motor.invert = self.motor_invert;
        params
    }

    fn device(self) -> emulator::Params {
        let mut device = emulator::Params { format: self.format, ..emulator::Params::default() };
        device.rig.start = [0.0, 0.0, PI, 0.0];
        device.rig.angle.sign = self.angle;
        device.rig.angle.hanging = self.hanging;
        device.rig.m_per_count *= self.position;
        device
    }
}

/// A person with a robot.
struct Lab {
    bench: Bench,
    procedure: Procedure,
    /// The largest action that was wanted.
    most: f64,
    /// Where the cart stood before the push.
    stood: f64,
}

impl Lab {
    fn new(robot: Robot) -> Self {
        Self::of(&robot.params(), &robot.device())
    }

    fn of(params: &Params, device: &emulator::Params) -> Self {
        let device = Emulator::new(device, &Faults::default(), 1);
        let mut bench = Bench::of(params, PERIOD, device);
        bench.go(1.5);
        assert_eq!(*bench.driver.stage(), Device::Ready);
        Self { bench, procedure: Procedure::new(params, about()), most: 0.0, stood: 0.0 }
    }

    /// Lets `time_s` pass; the procedure sees each state and has its way.
    fn go(&mut self, time_s: f64) {
        let Self { bench, procedure, most, .. } = self;
        bench.steer(time_s, |driver, now| {
            let sight = Sight {
                frame: driver.frame()?,
                is_homed: driver.is_homed(),
                is_armed: driver.standing() == Standing::Armed,
                now,
            };
            match procedure.see(sight) {
                Wish::Nothing => None,
                Wish::Home => {
                    let _ = driver.home(now);
                    None
                }
                Wish::Drive(action) => {
                    *most = most.max(action.abs());
                    Some(action)
                }
            }
        });
    }

    fn step(&self) -> Step {
        self.procedure.step()
    }

    /// Somebody lets the pole hang at `degrees` from rest.
    fn hold(&mut self, degrees: f64) {
        let x = self.bench.device.state()[0];
        self.bench.device.put(State::new([x, 0.0, PI + degrees.to_radians(), 0.0]));
    }

    /// Until the person is asked whether the cart may be pushed.
    fn homed(robot: Robot) -> Self {
        let mut lab = Self::new(robot);
        lab.go(8.5);
        if robot.homing {
            assert_eq!(lab.step(), Step::MayHome, "{}", lab.procedure.prompt());
            lab.procedure.go_on();
            lab.go(20.0);
        }
        assert_eq!(lab.step(), Step::MayPush, "{}", lab.procedure.prompt());
        lab.hold(0.0);
        lab.stood = lab.bench.device.state()[0];
        lab
    }

    /// Until the cart was pushed.
    fn pushed(robot: Robot) -> Self {
        let mut lab = Self::homed(robot);
        lab.procedure.go_on();
        lab.bench.driver.arm(lab.bench.now).unwrap();
        lab.go(2.0);
        lab
    }
}

/// Whatever way round a robot is put together, it is driven and seen the right way afterwards.
fn comes_out_right(robot: Robot) {
    let mut lab = Lab::pushed(robot);
    assert_eq!(lab.step(), Step::WhichWay, "{robot:?}: {}", lab.procedure.prompt());
    assert!(lab.most <= 0.25 * LIMIT);
    assert_eq!(lab.bench.device.command(), 0);
    let went = lab.bench.device.state()[0] - lab.stood;
    assert!((0.005..0.06).contains(&went.abs()), "{robot:?}: {went}");
    let is_right = (went > 0.0) != robot.mirrored;
    if is_right {
        lab.procedure.go_on();
    } else {
        lab.procedure.no();
    }
    assert_eq!(lab.step(), Step::Limits);
    assert_eq!(lab.procedure.result(), None);
    lab.procedure.go_on();
    let found = lab.procedure.result().unwrap();
    assert!((found.hanging - robot.hanging).abs() < 1.0, "{found:?}");
    assert_eq!(lab.bench.device.offences(), []);

    let mut corrected = robot.params();
    found.apply(&mut corrected.scales);
    let mut bench =
        Bench::of(&corrected, PERIOD, Emulator::new(&robot.device(), &Faults::default(), 1));
    if robot.homing {
        bench.home();
    } else {
        bench.go(1.5);
    }
    bench.driver.arm(bench.now).unwrap();
    bench.wish = Some(0.3 * LIMIT);
    bench.go(0.2);
    let side = if robot.mirrored { -1.0 } else { 1.0 };
    let (state, truth) = (bench.driver.latest().unwrap().0, bench.device.state());
    assert!(side * truth[1] > 0.02, "{robot:?}: a positive action drives to the right, {truth:?}");
    assert!((state[0] - side * truth[0]).abs() < 0.006, "{robot:?} {state:?} {truth:?}");
    let apart = crate::signal::wrapped(state[2] - side * truth[2]);
    assert!(apart.abs() < 0.1, "{robot:?} {state:?} {truth:?}");
}

#[test]
fn the_usual_robot_is_calibrated() {
    for format in FORMATS {
        comes_out_right(Robot::usual(format));
    }
}

#[test]
fn a_robot_that_is_the_other_way_round_is_calibrated() {
    for mirrored in [false, true] {
        for (angle, position, motor_invert) in [(1, 1.0, false), (-1, -1.0, true), (1, -1.0, true)]
        {
            let usual = Robot::usual(Format::Sensorsini31);
            let robot = Robot { homing: false, angle, position, motor_invert, mirrored, ..usual };
            comes_out_right(robot);
        }
    }
    let robot = Robot { position: -1.0, mirrored: true, ..Robot::usual(Format::Cobs1) };
    comes_out_right(Robot { motor_invert: true, ..robot });
}

/// Near where the reading wraps; the board turns it to within half a turn.
#[test]
fn a_pole_that_hangs_where_the_reading_wraps_is_measured_as_on_a_circle() {
    let mut procedure = Procedure::new(&Params::default(), about());
    for k in 0..401_u32 {
        let reading = if k % 2 == 0 { 2135 } else { -2135 };
        see(&mut procedure, [reading, 0], false, Seconds(f64::from(k) * 0.02));
    }
    assert_eq!(procedure.step(), Step::MayHome);
    let turned = (procedure.found.hanging - 4271.34 / 2.0) / 4271.34;
    assert!((turned - turned.round()).abs() < 2e-4, "{}", procedure.found.hanging);
}

fn see(procedure: &mut Procedure, readings: [i32; 2], is_homed: bool, now: Seconds) -> Wish {
    let sensors = Readings::new(&readings).unwrap();
    let frame = StateFrame { sensors, ..StateFrame::default() };
    procedure.see(Sight { frame: &frame, is_homed, is_armed: true, now })
}

#[test]
fn a_rest_takes_1000_states_or_8_seconds_of_400() {
    for (period, states) in [(0.005, 1000), (0.02, 401), (0.05, 400), (0.01, 801)] {
        let mut procedure = Procedure::new(&Params::default(), about());
        let mut count = 0;
        while procedure.step() == Step::HangStill {
            // A little more than exactly, so that 8 s are 8 s.
            let now = Seconds(f64::from(count) * (period + 1e-9));
            see(&mut procedure, [1000, 0], false, now);
            count += 1;
        }
        assert_eq!(count, states, "{period}");
    }
}

#[test]
fn a_pole_that_moves_is_measured_from_the_beginning() {
    let mut lab = Lab::new(Robot::usual(Format::Cobs1));
    lab.go(6.0);
    assert!(lab.procedure.progress() > 0.7);
    lab.hold(2.0);
    lab.go(5.0);
    assert_eq!(lab.step(), Step::HangStill);
    assert!(lab.procedure.progress() < 0.1 && lab.procedure.prompt().contains("steady it"));
    lab.hold(0.0);
    lab.go(4.0);
    assert!(!lab.procedure.prompt().contains("steady it"));
    lab.go(6.0);
    assert_eq!(lab.step(), Step::MayHome);
}

#[test]
fn nothing_moves_before_a_person_said_yes() {
    let mut lab = Lab::new(Robot::usual(Format::Sensorsini31));
    lab.go(30.0);
    assert_eq!((lab.step(), lab.most), (Step::MayHome, 0.0));
    assert!(lab.bench.device.state()[0].abs() < 1e-3 && !lab.bench.driver.is_homed());
    lab.procedure.no();
    assert_eq!(lab.procedure.trouble(), Some(Trouble::MayNotMove));

    let mut lab = Lab::homed(Robot::usual(Format::Sensorsini31));
    lab.bench.driver.arm(lab.bench.now).unwrap();
    lab.go(3.0);
    assert_eq!((lab.step(), lab.most), (Step::MayPush, 0.0));
}

#[test]
fn the_push_waits_for_the_pole_the_cart_and_the_motor() {
    let mut lab = Lab::homed(Robot::usual(Format::Cobs1));
    lab.hold(5.0);
    lab.procedure.go_on();
    lab.go(3.0);
    let prompt = lab.procedure.prompt();
    assert!(prompt.contains("hangs still") && prompt.contains("arm it"), "{prompt}");
    lab.bench.device.put(State::new([0.15, 0.0, PI, 0.0]));
    lab.go(3.0);
    assert!(lab.procedure.prompt().contains("to the middle"));
    lab.bench.device.put(State::new([0.0, 0.0, PI, 0.0]));
    lab.go(3.0);
    assert!(lab.procedure.prompt().starts_with("Waiting for the motor"));
    assert_eq!((lab.step(), lab.most), (Step::Steady, 0.0));
    // The hand is taken off in the middle of the push.
    lab.bench.driver.arm(lab.bench.now).unwrap();
    lab.go(0.1);
    assert_eq!(lab.step(), Step::Push);
    lab.bench.driver.disarm(lab.bench.now);
    lab.go(0.3);
    assert_eq!(lab.step(), Step::Steady);
    lab.hold(0.0);
    lab.bench.driver.arm(lab.bench.now).unwrap();
    lab.go(3.0);
    assert_eq!(lab.step(), Step::WhichWay, "{}", lab.procedure.prompt());
}

#[test]
fn a_cart_that_is_stuck_and_a_pole_that_does_not_turn_are_told() {
    let usual = Robot::usual(Format::Cobs1);
    let unhomed = Robot { homing: false, ..Robot::usual(Format::Sensorsini31) };
    let mut stuck = unhomed.device();
    stuck.rig.motor.friction_forward = 0.25;
    let mut lab = Lab::of(&unhomed.params(), &stuck);
    lab.go(8.5);
    lab.procedure.go_on();
    lab.bench.driver.arm(lab.bench.now).unwrap();
    lab.go(2.0);
    assert_eq!(lab.procedure.trouble(), Some(Trouble::StoodStill), "{}", lab.procedure.prompt());

    let mut lab = Lab::homed(usual);
    let hung = lab.bench.driver.frame().unwrap().sensors[0];
    lab.procedure.go_on();
    for k in 0..100 {
        let now = Seconds(100.0 + 0.02 * f64::from(k));
        see(&mut lab.procedure, [hung, if k < 60 { 0 } else { 400 }], true, now);
    }
    assert_eq!(lab.procedure.trouble(), Some(Trouble::HungStill));
}

#[test]
fn a_device_that_does_not_home_is_told() {
    let asked = || {
        let mut procedure = Procedure::new(&Params::default(), about());
        for k in 0..402 {
            see(&mut procedure, [1000, 0], false, Seconds(f64::from(k) * 0.02));
        }
        procedure.go_on();
        procedure
    };
    let mut deaf = asked();
    for k in 0..300 {
        see(&mut deaf, [1000, 0], false, Seconds(10.0 + f64::from(k) * 0.02));
    }
    assert_eq!(deaf.trouble(), Some(Trouble::HomingRefused));
    let mut lost = asked();
    assert_eq!(see(&mut lost, [1000, 0], false, Seconds(10.0)), Wish::Home);
    assert_eq!(see(&mut lost, [1000, 0], false, Seconds(25.0)), Wish::Nothing);
    assert_eq!(lost.trouble(), Some(Trouble::NotHomed));
    let mut reset = asked();
    see(&mut reset, [1000, 0], true, Seconds(25.0));
    assert_eq!(reset.step(), Step::MayPush);
    see(&mut reset, [1000, 0], false, Seconds(26.0));
    assert_eq!(reset.trouble(), Some(Trouble::ZeroLost));
}

#[test]
fn a_hard_limit_beyond_the_track_is_refused() {
    for (half_track_m, is_asked) in [(Some(0.18), false), (Some(0.198), true), (None, true)] {
        let about = About { half_track_m, ..about() };
        let mut procedure = Procedure::new(&Params::default(), about);
        procedure.stage = Stage::WhichWay;
        procedure.go_on();
        assert_eq!(procedure.step() == Step::Limits, is_asked, "{half_track_m:?}");
    }
}

#[test]
fn a_prompt_fits_two_lines_of_76_characters() {
    use Trouble::{
        Cancelled, HomingRefused, HungStill, Limits, MayNotMove, NotHomed, StoodStill, ZeroLost,
    };
    let mut procedure = Procedure::new(&Params::default(), about());
    let mut params = Params::default();
    (params.safety.soft_limit_m, params.safety.hard_limit_m) = (99.0, 100.0);
    procedure.params = params;
    let mut disturbed = Rest::of(4000.0);
    disturbed.begin_anew();
    let rest = Rest::of(4000.0);
    let lacks = |room, motor| Lacks { room, motor };
    let push = Push { since: Seconds(0.0), now: Seconds(0.0), hung: 0.0, from: 0, lag: None };
    let mut stages = vec![
        Stage::HangStill(rest),
        Stage::HangStill(disturbed),
        Stage::MayHome,
        Stage::Homing(Homing::default()),
        Stage::MayPush,
        Stage::Push(push),
        Stage::WhichWay,
        Stage::Limits,
        Stage::Done,
    ];
    for (room, motor) in [(false, false), (false, true), (true, false), (true, true)] {
        for rest in [rest, disturbed] {
            stages.push(Stage::Steady { rest, lacks: lacks(room, motor) });
        }
    }
    stages.extend(
        [Cancelled, MayNotMove, HomingRefused, NotHomed, ZeroLost, StoodStill, HungStill, Limits]
            .map(Stage::Failed),
    );
    for half_track_m in [Some(99.5), None] {
        procedure.about.half_track_m = half_track_m;
        for stage in &stages {
            procedure.stage = stage.clone();
            let prompt = procedure.prompt();
            let lines: Vec<&str> = prompt.lines().collect();
            assert!((1..=2).contains(&lines.len()), "{prompt}");
            assert!(lines.iter().all(|line| line.chars().count() <= 76), "{prompt}");
        }
    }
}

proptest! {
    /// Whatever the readings and whatever the person says, a push is small and short, and none
    /// begins without a new rest.
    #[test]
    fn a_push_is_always_bounded(
        seed in prop::collection::vec(
            (0..4_i32, any::<i32>(), any::<i32>(), any::<(bool, bool)>(), 0..40_u8, 0.0..0.1_f64),
            1..400,
        ),
    ) {
        let mut procedure = Procedure::new(&Params::default(), about());
        let (mut now, mut driven) = (Seconds(0.0), None);
        procedure.stage = Stage::MayPush;
        for (still, angle, position, (is_homed, is_armed), hand, step) in seed {
            now = now + Seconds(step);
            match hand {
                0 => procedure.no(),
                1 => procedure.cancel(),
                2..6 => procedure.go_on(),
                _ => {}
            }
            let readings = if still > 0 { [1000, 0] } else { [angle, position] };
            let sensors = Readings::new(&readings).unwrap();
            let frame = StateFrame { sensors, ..StateFrame::default() };
            let is_homed = is_homed || still > 0;
            let is_armed = is_armed || still > 0;
            match procedure.see(Sight { frame: &frame, is_homed, is_armed, now }) {
                Wish::Drive(action) => {
                    prop_assert_eq!(action, 0.25 * LIMIT);
                    prop_assert!(is_armed && is_homed);
                    let since = *driven.get_or_insert(now);
                    prop_assert!(now - since < PUSH_TIME);
                }
                _ => driven = None,
            }
            if matches!(procedure.step(), Step::WhichWay | Step::Failed | Step::Limits) {
                procedure.stage = Stage::MayPush;
            }
            let is_sane = procedure.found.hanging.is_finite() && procedure.progress() <= 1.0;
            prop_assert!(is_sane);
        }
    }

    #[test]
    fn the_mean_of_readings_on_a_circle_is_where_they_are(
        at in -3000.0..3000.0_f64, turn in 400.0..5000.0_f64,
        noise in prop::collection::vec(-1.9..1.9_f64, 1..50),
    ) {
        let mut rest = Rest::of(turn);
        for (k, off) in (0_u32..).zip(&noise) {
            #[expect(clippy::cast_possible_truncation, reason = "some thousand counts")]
            let reading = around((at + off).round(), turn).round() as i32;
            rest.see(reading, Seconds(f64::from(k)));
        }
        let apart = around(rest.mean() - at, turn);
        prop_assert!(apart.abs() < 4.0, "{}", apart);
        prop_assert!(rest.count as usize == noise.len() || rest.was_disturbed);
        prop_assert!((rest.mean() / turn * TAU).is_finite());
    }
}
