use super::*;
use crate::backend::emulator::faults::{Fault as Broken, Faults, Noise, Timed};
use crate::backend::emulator::rig::Sensor;
use crate::backend::emulator::{self, Emulator};
use crate::backend::serial::bench::{Bench, FORMATS, LIMIT, PERIOD, STEP, params};
use crate::random::{Place, Purpose, stream};
use rand::RngExt;

#[test]
fn a_device_is_greeted_homed_armed_driven_and_stopped() {
    for format in FORMATS {
        let mut bench = Bench::new(format, &Faults::default(), 1);
        assert_eq!(*bench.driver.stage(), Stage::Opening);
        bench.go(1.5);
        assert_eq!(*bench.driver.stage(), Stage::Ready, "{format:?}");
        assert_eq!(bench.driver.arm(bench.now), Err(NotArmed::NotHomed));
        bench.wish = Some(0.5);
        bench.go(0.5);
        assert_eq!(bench.device.command(), 0, "{format:?}: nobody armed it");
        bench.wish = None;
        bench.home();
        bench.driver.arm(bench.now).unwrap();
        bench.wish = Some(0.4);
        bench.go(0.15);
        assert_eq!(bench.driver.standing(), Standing::Armed, "{format:?}");
        assert!(bench.device.command() > 0, "{format:?}");
        let moved = bench.driver.latest().unwrap().0[1];
        assert!(moved > 0.01, "{format:?}: {moved}");
        bench.driver.emergency(bench.now);
        bench.go(0.1);
        assert_eq!((bench.device.command(), bench.driver.stopped()), (0, Stopped::Confirmed));
        assert!(bench.driver.arm(bench.now).is_err(), "latched");
        assert_eq!(bench.device.offences(), [], "{format:?}");
    }
}

#[test]
fn a_state_agrees_with_the_plant_behind_the_device() {
    for format in FORMATS {
        let mut bench = Bench::armed(format);
        for (wish, time_s) in [(0.6, 0.3), (-0.6, 0.3), (0.0, 0.5)] {
            bench.wish = Some(wish);
            bench.go(time_s);
        }
        let (state, _) = bench.driver.latest().unwrap();
        let truth = bench.device.state();
        assert!((state[0] - truth[0]).abs() < 0.005, "{format:?} {state:?} {truth:?}");
        let turned = (state[2] - truth[2]).rem_euclid(std::f64::consts::TAU);
        assert!(turned.min(std::f64::consts::TAU - turned) < 0.1, "{format:?} {state:?} {truth:?}");
    }
}

#[test]
fn a_hand_off_the_switch_and_a_silent_caller_stop_the_motor_without_a_fault() {
    for format in FORMATS {
        let mut bench = Bench::armed(format);
        bench.wish = Some(0.4);
        bench.go(0.1);
        assert!(bench.device.command() > 0);
        bench.wish = None;
        bench.go(0.15);
        assert_eq!(bench.device.command(), 0, "{format:?}");
        assert_eq!(bench.driver.standing(), Standing::Armed, "{format:?}");
    }
}

#[test]
fn an_unplugged_device_is_forgotten_and_not_armed_again_by_coming_back() {
    for format in FORMATS {
        let faults = Faults {
            events: vec![Timed { at_s: 24.0, what: Broken::Unplug { for_s: 2.0 } }],
            ..Faults::default()
        };
        let mut bench = Bench::new(format, &faults, 1);
        bench.home();
        bench.driver.arm(bench.now).unwrap();
        bench.go(23.9 - bench.now.0);
        bench.wish = Some(0.1);
        bench.go(0.3);
        assert!(matches!(bench.driver.stage(), Stage::Closed(_)), "{format:?}");
        assert_eq!(bench.driver.stopped(), Stopped::Unconfirmed);
        bench.go(4.0);
        assert_eq!(*bench.driver.stage(), Stage::Ready, "{format:?}");
        assert_eq!(bench.driver.standing(), Standing::Disarmed);
        assert_eq!(bench.driver.arm(bench.now), Err(NotArmed::NotHomed));
        assert_eq!(bench.device.command(), 0, "{format:?}: stopped before anything else");
    }
}

#[test]
fn another_firmware_is_refused_by_name() {
    for (format, version, words) in
        [(Format::Sensorsini31, 27, "27 bytes"), (Format::Cobs1, 2, "version 2")]
    {
        let faults = Faults { version: Some(version), ..Faults::default() };
        let mut bench = Bench::new(format, &faults, 1);
        bench.go(2.0);
        let Stage::Closed(why) = bench.driver.stage() else { panic!("{format:?}") };
        assert!(why.contains(words), "{why}");
    }
    let mut silent = Driver::new(&params(Format::Cobs1), PERIOD, LIMIT);
    silent.opened(Seconds(0.0));
    (0..3000_u32).for_each(|k| silent.pass(Seconds(f64::from(k) * STEP)));
    assert!(matches!(silent.stage(), Stage::Closed(why) if why.contains("does not answer")));
}

#[test]
fn an_order_to_home_that_is_lost_is_found_out_and_homing_that_goes_on_is_not_spoken_into() {
    for format in FORMATS {
        let mut bench = Bench::new(format, &Faults::default(), 1);
        bench.go(1.5);
        bench.driver.home(bench.now).unwrap();
        while *bench.driver.stage() != Stage::Homing {
            bench.go(STEP);
        }
        assert!(!bench.driver.take_output().is_empty(), "the order, which nobody gets");
        bench.go(0.4);
        assert_eq!(*bench.driver.stage(), Stage::Homing, "{format:?}: it may yet begin");
        bench.go(0.6);
        assert_eq!(*bench.driver.stage(), Stage::Ready, "{format:?}");
        assert_eq!(bench.driver.arm(bench.now), Err(NotArmed::NotHomed));
        bench.driver.home(bench.now).unwrap();
        bench.go(2.0);
        assert_eq!(*bench.driver.stage(), Stage::Homing, "{format:?}");
        bench.go(18.0);
        assert!(bench.driver.is_homed(), "{format:?}");
        assert_eq!(bench.device.offences(), [], "{format:?}");
    }
}

/// Why an armed and driven device is not armed any more, soon after `what` befell it.
fn named(format: Format, what: &Broken) -> String {
    let faults =
        Faults { events: vec![Timed { at_s: 23.0, what: what.clone() }], ..Faults::default() };
    let mut bench = Bench::new(format, &faults, 1);
    bench.home();
    bench.go(22.5 - bench.now.0);
    bench.driver.arm(bench.now).unwrap();
    // To and fro, as a cart that only goes one way comes to its limit.
    for turn in 0..60 {
        bench.wish = Some(if turn % 12 < 6 { 0.7 } else { -0.7 });
        bench.go(0.05);
        if let Stage::Closed(why) = bench.driver.stage() {
            return why.clone();
        }
        if let Standing::Latched(fault) = bench.driver.standing() {
            assert!(bench.now.0 >= 23.0, "{format:?} {what:?}: {fault} before it came");
            return fault.to_string();
        }
    }
    format!("{:?}", bench.driver.standing())
}

#[test]
fn a_host_that_stood_still_writes_one_burst_whoever_else_stops_the_motor() {
    for stood_s in [0.065, 0.09, 0.12] {
        let mut bench = Bench::armed(Format::Sensorsini31);
        bench.wish = Some(0.4);
        bench.go(0.1);
        let mut waiting = Vec::new();
        let woken = bench.now + Seconds(stood_s);
        while bench.now < woken {
            bench.now = bench.now + Seconds(STEP);
            let written = bench.driver.take_output();
            waiting.extend(bench.device.advance(bench.now, &written));
        }
        // As the port's thread does it: the clock goes on between all these.
        let moment = |k: u32| woken + Seconds(0.0003 * f64::from(k));
        let half = waiting.len() / 2;
        bench.driver.read(&waiting[..half], moment(0));
        bench.driver.pass(moment(0));
        bench.driver.answer(moment(1));
        let mut written = bench.driver.take_output();
        bench.driver.read(&waiting[half..], moment(2));
        bench.driver.pass(moment(2));
        bench.driver.answer(moment(3));
        written.extend(bench.driver.take_output());
        bench.driver.emergency(moment(4));
        written.extend(bench.driver.take_output());
        assert_eq!(written.len(), 24, "{stood_s}: {written:x?}");
        assert!(matches!(bench.driver.standing(), Standing::Latched(_)), "{stood_s}");
        bench.device.advance(bench.now + Seconds(STEP), &written);
        bench.now = bench.now + Seconds(STEP);
        bench.go(0.2);
        assert_eq!((bench.device.command(), bench.driver.stopped()), (0, Stopped::Confirmed));
        assert_eq!(bench.device.offences(), []);
    }
}

#[test]
fn a_motor_that_may_be_on_is_said_to_be_until_a_state_says_otherwise() {
    for format in FORMATS {
        // Nothing was ever driven: nothing has to be confirmed.
        let mut bench = Bench::new(format, &Faults::default(), 1);
        bench.driver.lost("unplugged");
        bench.driver.emergency(bench.now);
        assert_eq!(bench.driver.stopped(), Stopped::No, "{format:?}");

        let mut bench = Bench::armed(format);
        bench.wish = Some(0.4);
        bench.go(0.1);
        bench.driver.lost("unplugged");
        for press in [Driver::emergency, Driver::disarm] {
            press(&mut bench.driver, bench.now);
            assert_eq!(bench.driver.stopped(), Stopped::Unconfirmed, "{format:?}");
        }
        assert!(bench.driver.take_output().is_empty(), "nobody is there");
        bench.driver.opened(bench.now);
        assert_eq!(bench.driver.stopped(), Stopped::Unconfirmed, "{format:?}: not heard yet");
        bench.wish = None;
        bench.go(2.0);
        assert_eq!(bench.driver.stopped(), Stopped::Confirmed, "{format:?}");

        let mut bench = Bench::new(format, &Faults::default(), 1);
        bench.go(1.5);
        bench.driver.home(bench.now).unwrap();
        bench.go(2.0);
        bench.driver.lost("unplugged");
        assert_eq!(bench.driver.stopped(), Stopped::Unconfirmed, "{format:?}: it homes");
    }
}

#[test]
fn a_board_whose_cart_is_stuck_is_not_spoken_to_while_it_homes() {
    let format = Format::Sensorsini31;
    let mut device = emulator::Params { format, ..emulator::Params::default() };
    device.rig.motor.viscous_n_s_per_m = 46.0;
    let device = Emulator::new(&device, &Faults::default(), 1);
    let mut bench = Bench::of(&params(format), PERIOD, device);
    bench.go(1.5);
    bench.driver.home(bench.now).unwrap();
    bench.go(29.0);
    assert!(!bench.driver.is_stuck(bench.now));
    bench.go(2.0);
    assert!(bench.driver.is_stuck(bench.now));
    bench.driver.emergency(bench.now);
    bench.driver.disarm(bench.now);
    bench.go(5.0);
    assert_eq!(*bench.driver.stage(), Stage::Homing);
    assert_eq!(bench.device.offences(), []);
}

#[test]
fn every_fault_that_stops_an_armed_device_is_named() {
    let jump = |sensor| Broken::Jump { sensor, counts: 1800 };
    let stuck = |sensor| Broken::Stuck { sensor, for_s: 3.0 };
    for format in FORMATS {
        for (what, words) in [
            (Broken::Stall { for_s: 0.3 }, "no state came"),
            (Broken::Unplug { for_s: 3.0 }, "unplugged"),
            (jump(Sensor::Position), "position jumped"),
            (jump(Sensor::Angle), "angle jumped"),
            (stuck(Sensor::Position), "the cart does not move though"),
            (stuck(Sensor::Angle), "the angle does not change"),
        ] {
            let name = named(format, &what);
            assert!(name.contains(words), "{format:?} {what:?}: {name}");
        }
    }
    // A board without its stream says nothing any more, and the other one says hello.
    for (format, words) in
        [(Format::Sensorsini31, "no state came"), (Format::Cobs1, "the device was reset")]
    {
        let name = named(format, &Broken::Reset);
        assert!(name.contains(words), "{format:?}: {name}");
    }
    let pressed = named(Format::Cobs1, &Broken::Estop { for_s: 1.0 });
    assert!(pressed.contains("its emergency stop is pressed"), "{pressed}");
}

/// The most noise of a session.
const NOISE: Noise = Noise {
    drop: 0.01,
    duplicate: 0.01,
    flip: 0.01,
    truncate: 0.05,
    delay: 0.05,
    longest_delay_s: 0.05,
};

/// Sessions of random faults: whatever happens, the driver writes nothing that it must not,
/// and no command beyond the limits is ever on the motor's pins for its doing.
fn sessions(count: u64) -> Reached {
    let mut reached = Reached::default();
    for seed in 0..count {
        let format = FORMATS[usize::from(seed % 2 == 1)];
        // Homing takes its time; without it there is more time for all else.
        let homes = seed % 8 < 2;
        let step_s = if homes { 0.4 } else { 0.05 };
        let mut chance = stream(seed, Purpose::Starts, Place::default());
        let faults = Faults::random(&mut chance, &NOISE, 60.0 * step_s);
        let mut bench = Bench::new(format, &faults, seed);
        bench.driver.params.homing = homes;
        bench.driver.opened(Seconds(0.0));
        let mut chance = stream(seed, Purpose::EvaluationStarts, Place::default());
        let mut drove = false;
        for _ in 0..60 {
            if homes && !bench.driver.is_homed() && chance.random_bool(0.3) {
                let _ = bench.driver.home(bench.now);
            }
            if chance.random_bool(0.2) {
                let _ = bench.driver.arm(bench.now);
            }
            match chance.random_range(0..20) {
                0 => bench.driver.emergency(bench.now),
                1 => bench.driver.clear(),
                2 => bench.driver.disarm(bench.now),
                3 => bench.wish = None,
                _ => bench.wish = Some(chance.random_range(-5.0..5.0)),
            }
            let was_armed = bench.driver.standing() == Standing::Armed;
            bench.go(step_s);
            drove |= bench.device.command() != 0;
            // Whatever took the motor away says why: a fault, or that the device was gone, which
            // may be greeted anew by now.
            if let (true, Standing::Disarmed) = (was_armed, bench.driver.standing()) {
                match bench.driver.stage() {
                    Stage::Closed(why) => assert!(!why.is_empty()),
                    stage => assert_eq!(*stage, Stage::Opening, "{format:?}, seed {seed}"),
                }
            }
        }
        reached.homed += u64::from(bench.driver.is_homed() && homes);
        reached.driven += u64::from(drove);
        bench.wish = None;
        bench.driver.emergency(bench.now);
        let offences = bench.device.offences();
        assert_eq!(offences, [], "{format:?}, seed {seed}");
    }
    reached
}

/// How many of the random sessions came how far.
#[derive(Debug, Default)]
struct Reached {
    homed: u64,
    driven: u64,
}

#[test]
fn no_fault_makes_the_driver_write_what_it_must_not() {
    let reached = sessions(64);
    assert!(reached.homed > 4 && reached.driven > 10, "{reached:?}");
}

/// `cargo test --release -- --ignored ten_thousand`: takes minutes.
#[test]
#[ignore = "takes minutes; run it after a change of the driver"]
fn ten_thousand_sessions_of_random_faults() {
    let reached = sessions(10_000);
    assert!(reached.homed > 1000 && reached.driven > 2000, "{reached:?}");
}

#[test]
fn a_board_that_demands_homing_says_so_to_a_profile_that_has_none() {
    let params = Params { homing: false, ..params(Format::Cobs1) };
    let device = emulator::Params { format: Format::Cobs1, ..emulator::Params::default() };
    let device = Emulator::new(&device, &Faults::default(), 1);
    let mut bench = Bench::of(&params, PERIOD, device);
    bench.go(1.5);
    bench.driver.arm(bench.now).unwrap();
    bench.go(0.1);
    assert_eq!(bench.driver.standing(), Standing::Latched(Fault::DemandsHoming));
    assert!(Fault::DemandsHoming.to_string().contains("set backend.homing to true"));
}

#[test]
fn why_a_board_does_not_home_is_kept_until_it_does() {
    let events = vec![Timed { at_s: 1.0, what: Broken::Estop { for_s: 2.0 } }];
    let mut bench = Bench::new(Format::Cobs1, &Faults { events, ..Faults::default() }, 1);
    bench.go(1.5);
    bench.driver.home(bench.now).unwrap();
    bench.go(0.5);
    assert_eq!(bench.driver.refused(), Some(NotArmed::Device(Outcome::Estop)));
    assert!(!bench.driver.is_homed());
    bench.go(1.5);
    bench.driver.home(bench.now).unwrap();
    bench.go(0.5);
    assert_eq!(bench.driver.refused(), None);
}
