use super::*;
use crate::backend::guard::Stop;

fn homed() -> Lab {
    let mut lab = Lab::new(Format::Cobs1);
    lab.order(Order::Stream(true), 0.05);
    lab.order(Order::Home, 8.0);
    assert!(lab.heard.contains(&Ok(Message::Homed(1))));
    lab
}

fn armed() -> Lab {
    let mut lab = homed();
    lab.order(Order::Arm { watchdog_ms: 100 }, 0.02);
    lab.order(Order::Command(1500), 0.02);
    assert_eq!(lab.device.command(), 1500);
    lab
}

fn has(state: StateFrame, flags: Flags) -> bool {
    state.flags.unwrap().has(flags)
}

#[test]
fn it_says_hello_and_follows_nobody_who_has_not_homed_and_armed_it() {
    let mut lab = Lab::new(Format::Cobs1);
    lab.wait(0.1);
    let [Ok(Message::Hello(hello))] = lab.heard[..] else { panic!("{:?}", lab.heard) };
    assert_eq!((hello.name().as_str(), hello.sensors, hello.full_scale), ("emulated", 2, 7200));
    lab.order(Order::Command(1000), 0.02);
    lab.order(Order::Arm { watchdog_ms: 0 }, 0.02);
    lab.order(Order::Command(1000), 0.02);
    assert_eq!(lab.acks(), [Outcome::NotHomed]);
    assert_eq!(lab.commands(), Vec::<i32>::new());
}

#[test]
fn silence_stops_it_and_commands_alone_do_not_start_it_again() {
    let mut lab = armed();
    lab.wait(0.07);
    assert_eq!(lab.device.command(), 1500);
    lab.wait(0.02);
    assert_eq!(lab.device.command(), 0);
    lab.wait(0.03);
    assert!(has(lab.last(), Flags::WATCHDOG) && !has(lab.last(), Flags::ARMED));
    for _ in 0..10 {
        lab.order(Order::Command(1500), 0.02);
    }
    assert_eq!(lab.device.command(), 0);
    lab.order(Order::Arm { watchdog_ms: 100 }, 0.02);
    assert_eq!(lab.device.command(), 0);
    lab.order(Order::Command(-700), 0.03);
    let state = lab.last();
    assert_eq!(state.command, -700);
    assert!(has(state, Flags::ARMED) && has(state, Flags::HOMED));
    assert!(!has(state, Flags::WATCHDOG));
}

#[test]
fn commands_keep_it_alive_and_their_numbers_come_back() {
    let mut lab = armed();
    for _ in 0..50 {
        lab.order(Order::Command(600), 0.02);
    }
    let mut bytes = Vec::new();
    let number = lab.host.encode(&Order::Command(601), &mut bytes).unwrap();
    lab.write(&bytes, 0.03);
    assert_eq!((lab.last().command, lab.last().applied), (601, number));
    assert_eq!(lab.host.counts().lost, 0);
}

#[test]
fn it_stops_at_once_even_while_it_homes() {
    let mut lab = armed();
    lab.order(Order::Stop, 0.002);
    assert_eq!(lab.device.command(), 0);
    lab.order(Order::Home, 0.5);
    assert_ne!(lab.device.command(), 0);
    lab.order(Order::Arm { watchdog_ms: 0 }, 0.02);
    assert_eq!(lab.acks().last(), Some(&Outcome::Busy));
    lab.order(Order::Stop, 0.03);
    assert_eq!(lab.device.command(), 0);
    assert!(!has(lab.last(), Flags::HOMED) && !has(lab.last(), Flags::HOMING));
}

#[test]
fn a_guards_stop_stops_it_whatever_was_said_before() {
    let mut lab = armed();
    // Numbers have gone on, and a command breaks off in its middle.
    for _ in 0..10 {
        lab.order(Order::Command(500), 0.02);
    }
    assert_eq!(lab.device.command(), 500);
    let mut command = Vec::new();
    lab.host.encode(&Order::Command(700), &mut command).unwrap();
    lab.write(&command[..5], 0.001);
    lab.write(&Stop::of(Format::Cobs1).burst, 0.02);
    assert_eq!(lab.device.command(), 0);
    assert!(!has(lab.last(), Flags::ARMED) && !has(lab.last(), Flags::WATCHDOG));
}

#[test]
fn at_a_switch_it_goes_inward_only() {
    let mut lab = armed();
    for _ in 0..100 {
        lab.order(Order::Command(3000), 0.02);
    }
    assert!(has(lab.last(), Flags::LIMIT_RIGHT));
    assert_eq!(lab.device.command(), 0);
    lab.order(Order::Command(-3000), 0.02);
    assert_eq!(lab.device.command(), -3000);
    lab.order(Order::Command(i32::MIN), 0.01);
    assert_eq!(lab.device.command(), -7200);
}

#[test]
fn wrong_values_are_refused() {
    let mut lab = homed();
    let mut bytes = Vec::new();
    for (k, watchdog_ms) in (100..).zip([39, 251, 40, 250]) {
        cobs1::frames::Request::Arm { version: 1, watchdog_ms }.encode(k, &mut bytes);
    }
    cobs1::frames::Request::Arm { version: 2, watchdog_ms: 0 }.encode(104, &mut bytes);
    cobs1::frames::Request::Config { period_ms: 10 }.encode(105, &mut bytes);
    lab.write(&bytes, 0.05);
    let expected = [
        Outcome::BadValue,
        Outcome::BadValue,
        Outcome::Done,
        Outcome::Done,
        Outcome::WrongVersion,
        Outcome::Busy,
    ];
    assert_eq!(lab.acks()[2..], expected);
}

#[test]
fn the_emergency_stop_disarms_it_until_it_is_armed_again() {
    let events = vec![Timed { at_s: 9.0, what: Fault::Estop { for_s: 0.5 } }];
    let faults = Faults { events, ..Faults::default() };
    let mut lab = Lab::with(&Params { format: Format::Cobs1, ..Params::default() }, &faults);
    lab.order(Order::Stream(true), 0.05);
    lab.order(Order::Home, 8.8);
    lab.order(Order::Arm { watchdog_ms: 250 }, 0.02);
    lab.order(Order::Command(500), 0.2);
    assert_eq!(lab.device.command(), 0);
    assert!(has(lab.last(), Flags::ESTOP));
    lab.order(Order::Arm { watchdog_ms: 250 }, 0.6);
    assert_eq!(lab.acks().last(), Some(&Outcome::Estop));
    lab.order(Order::Command(500), 0.02);
    assert_eq!(lab.device.command(), 0);
}

#[test]
fn another_version_is_refused_by_both() {
    let faults = Faults { version: Some(3), ..Faults::default() };
    let mut lab = Lab::with(&Params { format: Format::Cobs1, ..Params::default() }, &faults);
    lab.wait(0.05);
    assert_eq!(lab.heard, [Err(Refusal::Version { seen: 3 })]);
    lab.order(Order::Arm { watchdog_ms: 0 }, 0.05);
    assert_eq!(lab.acks(), [Outcome::WrongVersion]);
}
