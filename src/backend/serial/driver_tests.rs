use super::*;
use crate::backend::emulator::faults::{Fault as Broken, Faults, Noise, Timed};
use crate::backend::emulator::rig::Sensor;
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

/// Faults as they come, for the session `seed`.
fn random_faults(seed: u64) -> Faults {
    let mut chance = stream(seed, Purpose::Starts, Place::default());
    let mut noise = || {
        let mut rare = |most: f64| {
            if chance.random_bool(0.3) { chance.random_range(0.0..most) } else { 0.0 }
        };
        Noise {
            drop: rare(0.01),
            duplicate: rare(0.01),
            flip: rare(0.01),
            truncate: rare(0.05),
            delay: rare(0.05),
            longest_delay_s: 0.05,
        }
    };
    let (to_host, to_device) = (noise(), noise());
    let mut events = Vec::new();
    for _ in 0..chance.random_range(0..3) {
        let for_s = chance.random_range(0.01..0.3);
        let sensor = if chance.random_bool(0.5) { Sensor::Angle } else { Sensor::Position };
        let what = match chance.random_range(0..7) {
            0 => Broken::Stall { for_s },
            1 => Broken::Reset,
            2 => Broken::Unplug { for_s },
            3 => Broken::Stuck { sensor, for_s },
            4 => Broken::Jump { sensor, counts: chance.random_range(-2000..2000) },
            5 => Broken::Garbage { bytes: chance.random_range(1..200) },
            _ => Broken::Estop { for_s },
        };
        events.push(Timed { at_s: chance.random_range(0.0..3.0), what });
    }
    Faults {
        to_host,
        to_device,
        garbage_at_connect: chance.random_range(0..50),
        version: None,
        events,
    }
}

/// Sessions of random faults: whatever happens, the driver writes nothing that it must not,
/// and no command beyond the limits is ever on the motor's pins for its doing.
fn sessions(count: u64) {
    for seed in 0..count {
        let format = FORMATS[usize::from(seed % 2 == 1)];
        let mut bench = Bench::new(format, &random_faults(seed), seed);
        bench.driver.params.homing = false;
        bench.driver.opened(Seconds(0.0));
        let mut chance = stream(seed, Purpose::EvaluationStarts, Place::default());
        for _ in 0..60 {
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
            bench.go(0.05);
        }
        bench.wish = None;
        bench.driver.emergency(bench.now);
        let offences = bench.device.offences();
        assert_eq!(offences, [], "{format:?}, seed {seed}");
    }
}

#[test]
fn no_fault_makes_the_driver_write_what_it_must_not() {
    sessions(60);
}

/// `cargo test --release -- --ignored ten_thousand`: takes minutes.
#[test]
#[ignore = "takes minutes; run it after a change of the driver"]
fn ten_thousand_sessions_of_random_faults() {
    sessions(10_000);
}
