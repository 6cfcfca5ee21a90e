use super::*;

#[test]
fn states_come_each_period_with_the_pole_hanging() {
    let mut lab = streaming();
    lab.wait(1.0);
    let states = lab.states();
    assert!((51..=53).contains(&states.len()), "{}", states.len());
    let state = lab.last();
    assert_eq!(state.sensors[..], [1028, 0]);
    assert_eq!(state.time_difference_us, Some(20_000));
    let firmware = state.firmware.unwrap();
    assert_eq!((firmware.latency_10us, firmware.latency_violation), (2000, 1));
    assert_eq!(lab.host.counts().skipped, 0);
    assert_eq!(lab.offences(), []);
}

#[test]
fn a_command_is_held_for_ever_and_acts_a_period_later() {
    let mut lab = streaming();
    lab.order(Order::Command(1500), 0.001);
    assert_eq!(lab.device.command(), 0);
    lab.wait(0.02);
    assert_eq!(lab.device.command(), 1500);
    lab.wait(60.0);
    assert_eq!(lab.device.command(), 1500);
    // It was held through the end of the track; only a new one is refused there.
    assert!(lab.device.state()[0] > 0.197);
    lab.order(Order::Command(1500), 0.05);
    assert!(lab.device.command() == 1500, "before homing the ends are elsewhere");
}

#[test]
fn a_guards_stop_stops_it_though_a_command_broke_off() {
    let mut lab = streaming();
    lab.order(Order::Command(1500), 0.05);
    assert_eq!(lab.device.command(), 1500);
    let mut command = Vec::new();
    lab.host.encode(&Order::Command(-1500), &mut command).unwrap();
    lab.write(&command[..5], 0.001);
    lab.write(&crate::backend::guard::Stop::of(Format::Sensorsini31).burst, 0.05);
    assert_eq!(lab.device.command(), 0);
}

#[test]
fn a_command_towards_a_close_end_is_refused_when_it_comes_only() {
    let mut lab = Lab::new(Format::Sensorsini31);
    lab.order(Order::Home, 8.0);
    lab.order(Order::Stream(true), 0.05);
    lab.order(Order::Command(3000), 2.0);
    assert_eq!(lab.device.command(), 3000);
    lab.order(Order::Command(3000), 0.05);
    assert_eq!(lab.device.command(), 0);
    lab.order(Order::Command(-3000), 0.05);
    assert_eq!(lab.device.command(), -3000);
}

#[test]
fn two_commands_that_wait_run_with_the_payload_of_the_second() {
    use Request::{ControlMode, SetMotor, SetTargetEquilibrium, SetTargetPosition};
    let mut lab = streaming();
    lab.write_while_busy(&[SetMotor(0), SetTargetPosition(0.1)]);
    assert_eq!(lab.obeyed()[1..], [SetMotor(1_036_831_949), SetTargetPosition(0.1)]);
    assert_eq!(lab.offences(), [Offence::TwoCommands]);
    let mut lab = streaming();
    lab.write_while_busy(&[ControlMode(false), SetMotor(1000)]);
    assert_eq!(lab.obeyed()[1..], [ControlMode(true), SetMotor(1000)]);
    let mut lab = streaming();
    lab.write_while_busy(&[SetTargetPosition(0.05), SetTargetEquilibrium(-1.0)]);
    assert_eq!(lab.obeyed()[1..], [SetTargetPosition(-1.0), SetTargetEquilibrium(-1.0)]);
    // The driver's own farewell.
    let mut lab = streaming();
    lab.write_while_busy(&[SetMotor(0), ControlMode(false), SetMotor(0)]);
    assert_eq!(lab.obeyed()[1], SetMotor(-928_318_976));
}

#[test]
fn a_stop_is_safe_after_another_command_and_after_half_of_one() {
    let mut lab = streaming();
    let stop = [Request::SetMotor(0); 3];
    let all = [&[Request::SetMotor(1234)][..], &stop].concat();
    lab.write_while_busy(&all);
    lab.wait(0.05);
    assert_eq!((lab.last().command, lab.crashed()), (0, false));
    assert_eq!(lab.offences(), [], "its buffer holds both, even read at once");
    let mut lab = streaming();
    lab.order(Order::Command(1234), 0.0001);
    lab.order(Order::Stop, 0.05);
    assert_eq!((lab.last().command, lab.offences()), (0, vec![]));
    let mut lab = streaming();
    lab.order(Order::Command(2000), 0.05);
    lab.write(&[0xAA, 0xC8, 8, 0x10, 0x0E], 0.001);
    lab.order(Order::Stop, 0.05);
    assert_eq!((lab.device.command(), lab.last().command), (0, 0));
    assert_eq!(lab.offences(), []);
}

#[test]
fn a_damaged_length_swallows_commands_until_zeros_flush_it() {
    let mut lab = streaming();
    lab.order(Order::Command(1000), 0.05);
    lab.write(&[0xAA, 0xC8, 32], 0.02);
    lab.order(Order::Command(0), 0.05);
    assert_eq!(lab.device.command(), 1000, "the stop waits behind the damage");
    for _ in 0..4 {
        lab.write(&[0; 8], 0.02);
    }
    assert_eq!(lab.device.command(), 0);
    assert!(!lab.crashed());
}

#[test]
fn more_than_its_buffer_holds_destroys_it_and_the_motor_goes_on() {
    let mut lab = streaming();
    lab.order(Order::Command(1000), 0.05);
    let mut bytes = Vec::new();
    Request::CollectRawAngle { count: 90, interval_us: 300 }.encode(&mut bytes);
    lab.write(&bytes, 0.002);
    bytes.clear();
    for _ in 0..5 {
        Request::SetMotor(0).encode(&mut bytes);
    }
    lab.write(&bytes, 0.1);
    assert!(lab.crashed());
    assert_eq!(lab.offences(), [Offence::WhileDeaf, Offence::TooManyBytes]);
    let states = lab.states().len();
    lab.order(Order::Stop, 1.0);
    assert_eq!(lab.states().len(), states);
}

#[test]
fn homing_is_deaf_and_silent_and_the_old_command_comes_back() {
    let mut lab = streaming();
    lab.order(Order::Command(900), 0.05);
    lab.order(Order::Home, 0.1);
    let states = lab.states().len();
    lab.order(Order::Stop, 0.5);
    assert_eq!(lab.offences(), [Offence::WhileDeaf]);
    assert_eq!(lab.states().len(), states);
    while !lab.heard.contains(&Ok(Message::Homed(1))) {
        lab.wait(0.01);
        assert!(lab.device.now().0 < 15.0, "homing does not end");
    }
    assert!(lab.device.now().0 > 3.0);
    assert!(lab.device.state()[0].abs() < 0.002, "{:?}", lab.device.state());
    assert_eq!(lab.device.command(), 0);
    lab.wait(0.03);
    assert_eq!(lab.device.command(), 900);
    assert!(lab.commands().contains(&2160) && lab.commands().contains(&-2160));
    assert!(lab.commands().contains(&1080));
}

#[test]
fn a_stuck_cart_is_pushed_for_ever() {
    let timed = |at_s, what| Timed { at_s, what };
    let stuck = Fault::Stuck { sensor: Sensor::Position, for_s: 1e4 };
    let faults = Faults { events: vec![timed(2.5, stuck)], ..Faults::default() };
    let params = Params::default();
    let mut lab = Lab::with(&params, &faults);
    lab.order(Order::Home, 120.0);
    assert_ne!(lab.device.command(), 0);
    assert!(!lab.heard.contains(&Ok(Message::Homed(1))));
}

#[test]
fn an_encoder_that_counts_down_is_turned() {
    let mut params = Params::default();
    params.rig.m_per_count = -params.rig.m_per_count;
    let mut lab = Lab::with(&params, &Faults::default());
    lab.order(Order::Home, 8.0);
    assert_eq!(lab.heard, [Ok(Message::Homed(-1))]);
    lab.order(Order::Stream(true), 0.05);
    lab.order(Order::Command(2000), 0.5);
    assert!(lab.last().sensors[1] > 100);
}

#[test]
fn replies_have_stray_bytes_and_a_new_period_a_wild_time_difference() {
    let mut lab = streaming();
    lab.order(Order::Query, 0.05);
    assert_eq!(lab.host.counts().skipped, 2);
    lab.order(Order::Configure(firmware_config(10)), 0.05);
    lab.order(Order::Query, 0.05);
    assert_eq!(lab.host.counts().skipped, 4);
    let told = lab.heard.iter().filter_map(|heard| match heard {
        Ok(Message::Config(config)) => Some(*config),
        _ => None,
    });
    let told: Vec<Config> = told.collect();
    assert!(firmware_config(10).is_taken(&told[1]) && !firmware_config(10).is_taken(&told[0]));
    let differences: Vec<u32> =
        lab.states().iter().filter_map(|state| state.time_difference_us).collect();
    assert_eq!(differences.iter().filter(|us| **us > 4_000_000_000).count(), 1);
    assert_eq!(lab.last().time_difference_us, Some(10_000));
    assert_eq!(lab.offences(), []);
}

#[test]
fn what_the_firmware_does_not_check_destroys_it() {
    let average = |average| {
        let mut config = firmware_config(20);
        config.firmware = config.firmware.map(|f| FirmwareConfig { average, ..f });
        config
    };
    for config in [firmware_config(0), average(0), average(33)] {
        let mut lab = streaming();
        let mut bytes = Vec::new();
        Request::SetControlConfig(config).encode(&mut bytes);
        lab.write(&bytes, 0.05);
        assert!(lab.crashed(), "{config:?}");
    }
}

#[test]
fn the_echo_has_16_bits_and_the_clock_32() {
    let params = Params { clock_us: u32::MAX - 500_000, ..Params::default() };
    let mut lab = Lab::with(&params, &Faults::default());
    lab.order(Order::Stream(true), 0.05);
    lab.order(Order::Command(40_000), 1.0);
    assert_eq!(lab.last().command, -25_536);
    assert_eq!(lab.offences(), [Offence::Duty]);
    let times: Vec<u32> = lab.states().iter().map(|state| state.time_us).collect();
    assert_eq!(times.windows(2).filter(|pair| pair[1] < pair[0]).count(), 1);
    let steady = lab.states()[1..].iter().all(|state| state.time_difference_us == Some(20_000));
    assert!(steady);
}

#[test]
fn the_boards_own_controller_overrules_the_host_until_it_is_off() {
    let mut lab = streaming();
    let mut bytes = Vec::new();
    Request::ControlMode(true).encode(&mut bytes);
    lab.write(&bytes, 0.05);
    lab.order(Order::Command(1000), 0.05);
    assert_eq!(lab.device.command(), 0);
    lab.order(Order::Disarm, 0.05);
    lab.order(Order::Command(1000), 0.05);
    lab.order(Order::Disarm, 0.05);
    assert_eq!(lab.device.command(), 1000, "from the host's control it stops nothing");
}

#[test]
fn the_gap_of_the_potentiometer_freezes_the_angle_without_a_word() {
    let mut params = Params::default();
    // A pole that turns over and over.
    params.rig.start = [0.0, 0.0, std::f64::consts::PI, 14.0];
    let mut lab = Lab::with(&params, &Faults::default());
    lab.order(Order::Stream(true), 2.0);
    let states = lab.states();
    let frozen = states.windows(2).filter(|pair| {
        let [a, b] = [pair[0].firmware.unwrap(), pair[1].firmware.unwrap()];
        a.angle_change == b.angle_change && a.angle_change != 0.0
    });
    assert!(frozen.count() >= 2);
    assert!(states.iter().all(|state| state.firmware.unwrap().invalid_steps == 0));
    assert!(states.iter().all(|state| state.sensors[0].abs() <= 2136));
}

#[test]
fn a_guess_in_the_gap_is_never_off_by_a_quarter_of_a_turn() {
    for speed in [9.0, 10.0, 12.0, 14.0] {
        let mut params = Params::default();
        params.rig.start = [0.0, 0.0, std::f64::consts::PI, speed];
        let mut lab = Lab::with(&params, &Faults::default());
        lab.order(Order::Stream(true), 10.0);
        let turn = params.rig.angle.counts_per_turn;
        let readings: Vec<i32> = lab.states().iter().map(|state| state.sensors[0]).collect();
        assert!(readings.iter().any(|reading| reading.abs() < 100), "{speed}: never there");
        for pair in readings.windows(2) {
            let way = f64::from(pair[1] - pair[0]).rem_euclid(turn);
            assert!(way.min(turn - way) < turn / 4.0, "{speed}: {pair:?}");
        }
    }
}

#[test]
fn the_gains_setting_is_named_and_never_obeyed() {
    let mut lab = streaming();
    let mut set_pid = vec![0xAA, 0xC4, 28];
    set_pid.resize(27, 0);
    set_pid.push(checksum(&set_pid));
    lab.write(&set_pid, 0.1);
    assert_eq!(lab.offences(), [Offence::TooManyBytes, Offence::SetPid]);
    assert_eq!(lab.obeyed().len(), 1);
}

#[test]
fn two_commands_in_a_period_are_named_and_one_after_each_state_is_not() {
    let mut lab = streaming();
    for command in 0..200 {
        lab.order(Order::Command(command * 10), 0.02);
    }
    assert_eq!(lab.offences(), []);
    lab.order(Order::Command(1), 0.002);
    lab.order(Order::Command(2), 0.002);
    assert_eq!(lab.offences(), [Offence::TwoCommands]);
    // A late host answers a state that it missed, and then the next; not three.
    let mut lab = streaming();
    lab.order(Order::Command(1), 0.052);
    for (command, offences) in [(2, 0), (3, 0), (4, 1)] {
        lab.order(Order::Command(command), 0.0035);
        assert_eq!(lab.offences().len(), offences);
    }
    let mut lab = Lab::new(Format::Sensorsini31);
    lab.order(Order::Command(1), 0.004);
    lab.order(Order::Command(2), 0.002);
    assert_eq!(lab.offences(), []);
    lab.order(Order::Command(3), 0.002);
    assert_eq!(lab.offences(), [Offence::TwoCommands]);
}
