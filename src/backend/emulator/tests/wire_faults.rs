use proptest::prelude::*;

use super::*;
use crate::check::{Check, Checker};

fn run(faults: &Faults, time: f64) -> Lab {
    let mut lab = Lab::with(&Params::default(), faults);
    lab.order(Order::Stream(true), time);
    lab
}

fn at(at_s: f64, what: Fault) -> Faults {
    Faults { events: vec![Timed { at_s, what }], ..Faults::default() }
}

#[test]
fn other_firmwares_are_refused_by_the_host() {
    for len in [17, 27] {
        let lab = run(&Faults { version: Some(len), ..Faults::default() }, 0.2);
        let len = len.to_le_bytes()[0];
        assert_eq!(lab.heard.first(), Some(&Err(Refusal::OtherLayout { len })));
        assert_eq!(lab.states(), []);
    }
}

#[test]
fn noise_costs_states_and_never_changes_one_unseen() {
    let noises = [
        Noise { drop: 0.002, ..Noise::default() },
        Noise { duplicate: 0.002, ..Noise::default() },
        Noise { flip: 0.002, ..Noise::default() },
        Noise { truncate: 0.05, ..Noise::default() },
    ];
    for to_host in noises {
        let lab = run(&Faults { to_host, ..Faults::default() }, 20.0);
        let states = lab.states();
        assert!((850..990).contains(&states.len()), "{}", states.len());
        assert!(states.iter().all(|state| state.sensors[..] == [1028, 0]));
        assert!(lab.host.counts().skipped > 0);
    }
}

#[test]
fn late_states_come_whole_and_in_order() {
    let to_host = Noise { delay: 0.2, longest_delay_s: 0.05, ..Noise::default() };
    let lab = run(&Faults { to_host, ..Faults::default() }, 5.0);
    assert!(lab.states().len() > 240);
    assert_eq!(lab.host.counts().skipped, 0);
    assert!(lab.states().windows(2).all(|pair| pair[0].time_us < pair[1].time_us));
}

#[test]
fn a_stall_ends_in_a_burst() {
    let mut lab = run(&at(1.0, Fault::Stall { for_s: 0.1 }), 1.0);
    let before = lab.states().len();
    lab.wait(0.09);
    assert_eq!(lab.states().len(), before);
    lab.wait(0.0105);
    assert_eq!(lab.states().len(), before + 5);
}

#[test]
fn a_reset_forgets_everything() {
    let mut lab = run(&at(1.0, Fault::Reset), 0.5);
    lab.order(Order::Command(500), 0.4);
    assert_eq!(lab.device.command(), 500);
    lab.wait(1.0);
    assert_eq!(lab.device.command(), 0);
    let states = lab.states().len();
    lab.order(Order::Stream(true), 0.1);
    assert!(lab.states().len() > states && lab.last().time_us < 2_000_000);
    // It counts from where the cart was.
    assert!(lab.last().sensors[1].abs() < 50);
}

#[test]
fn an_unplugged_board_goes_on_unheard() {
    let faults = Faults { garbage_at_connect: 40, ..at(1.0, Fault::Unplug { for_s: 1.0 }) };
    let mut lab = run(&faults, 0.5);
    lab.order(Order::Command(500), 0.6);
    assert!(!lab.device.is_plugged());
    let states = lab.states().len();
    lab.order(Order::Stop, 0.8);
    assert_eq!((lab.states().len(), lab.device.command()), (states, 500));
    lab.wait(0.3);
    assert!(lab.device.is_plugged() && lab.states().len() > states);
    lab.device.connect();
    lab.order(Order::Stop, 0.1);
    assert_eq!(lab.device.command(), 0);
    assert!(lab.host.counts().skipped >= 40);
}

#[test]
fn sensors_stick_and_jump() {
    let stuck = Fault::Stuck { sensor: Sensor::Position, for_s: 1.0 };
    let mut lab = run(&at(0.5, stuck), 0.4);
    lab.order(Order::Command(2000), 1.0);
    let held = lab.last().sensors[1];
    lab.wait(0.2);
    assert!(lab.last().sensors[1] > held + 500);
    let jump = Fault::Jump { sensor: Sensor::Position, counts: 500 };
    let lab = run(&at(0.5, jump), 1.0);
    assert_eq!(lab.last().sensors[1], 500);
}

#[test]
fn the_same_seed_does_the_same() {
    let noise = Noise { drop: 0.01, flip: 0.01, delay: 0.1, ..Noise::default() };
    let faults = Faults { to_host: noise.clone(), to_device: noise, ..Faults::default() };
    let [one, two] = [run(&faults, 2.0), run(&faults, 2.0)];
    assert_eq!((one.heard, one.trace), (two.heard, two.trace));
}

#[test]
fn a_fault_file_is_read_and_checked() {
    let text = "(to_host: (flip: 0.001, delay: 0.01, longest_delay_s: 0.05),
        garbage_at_connect: 40, version: Some(17), events: [
        (at_s: 5.0, what: Unplug(for_s: 1.0)), (at_s: 6.0, what: Reset),
        (at_s: 9.0, what: Jump(sensor: position, counts: 500))])";
    let faults: Faults = ron::from_str(text).unwrap();
    assert_eq!(faults.events.len(), 3);
    let mut wrong = Vec::new();
    Faults { to_host: Noise { flip: 2.0, ..Noise::default() }, ..faults }
        .check(&mut Checker::new(&mut wrong));
    assert_eq!(wrong[0].key, "to_host.flip");
    let mut wrong = Vec::new();
    rig::Params::default().check(&mut Checker::new(&mut wrong));
    assert_eq!(wrong, []);
}

/// Pieces of what a host may write: orders of either format, halves of them, rubbish.
fn any_write() -> impl Strategy<Value = (Vec<u8>, f64)> {
    let order = prop_oneof![
        any::<i32>().prop_map(Order::Command),
        Just(Order::Stop),
        any::<bool>().prop_map(Order::Stream),
        Just(Order::Home),
        Just(Order::Query),
        Just(Order::Arm { watchdog_ms: 100 }),
        Just(Order::Configure(firmware_config(5))),
    ];
    let written = (any::<bool>(), order, 0..40_usize).prop_map(|(is_cobs1, order, cut)| {
        let format = if is_cobs1 { Format::Cobs1 } else { Format::Sensorsini31 };
        let mut bytes = Vec::new();
        format.codec().encode(&order, &mut bytes).unwrap();
        bytes.truncate(cut);
        bytes
    });
    let bytes = prop_oneof![written, prop::collection::vec(any::<u8>(), 0..60)];
    (bytes, 0.0..0.1)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn nothing_that_a_host_writes_breaks_an_emulated_device(
        writes in prop::collection::vec(any_write(), 0..30),
        is_cobs1 in any::<bool>(),
    ) {
        let format = if is_cobs1 { Format::Cobs1 } else { Format::Sensorsini31 };
        let noise = Noise { drop: 0.01, flip: 0.01, delay: 0.1, ..Noise::default() };
        let faults = Faults { to_host: noise.clone(), to_device: noise, ..Faults::default() };
        let mut lab = Lab::with(&Params { format, ..Params::default() }, &faults);
        for (bytes, time) in writes {
            lab.write(&bytes, time);
            if is_cobs1 {
                prop_assert!(lab.device.command().abs() <= 7200);
            }
        }
        lab.wait(40.0);
        // A well-behaved board never drives on without its host.
        prop_assert!(!is_cobs1 || lab.device.command() == 0);
        prop_assert!(lab.device.state().is_finite());
    }
}
