use super::super::{Firmware, FirmwareConfig, Readings, StateFrame};
use super::*;
use proptest::prelude::*;

fn hear_all(host: &mut Host) -> Vec<Result<Message, Refusal>> {
    std::iter::from_fn(|| host.hear()).collect()
}

fn hear(bytes: &[u8]) -> (Vec<Result<Message, Refusal>>, Counts) {
    let mut host = Host::default();
    host.take(bytes);
    (hear_all(&mut host), host.counts())
}

fn bytes(reply: &Reply) -> Vec<u8> {
    let mut bytes = Vec::new();
    reply.encode(&mut bytes);
    bytes
}

/// A state of another firmware, `len` bytes long.
fn other(len: u8, fill: u8) -> Vec<u8> {
    let mut bytes = vec![START, STATE, len];
    bytes.resize(usize::from(len) - 1, fill);
    bytes.push(checksum(&bytes));
    bytes
}

fn state() -> StateFrame {
    StateFrame {
        sensors: Readings::new(&[-1107, 300]).unwrap(),
        time_us: 77,
        time_difference_us: Some(20_000),
        firmware: Some(Firmware::default()),
        ..StateFrame::default()
    }
}

#[test]
fn states_of_every_other_firmware_are_refused_with_their_length() {
    for len in OTHER_LAYOUTS {
        let two = [other(len, 1), other(len, 2)].concat();
        let (heard, counts) = hear(&two);
        assert_eq!(heard, [Err(Refusal::OtherLayout { len })]);
        assert_eq!((counts.good, counts.skipped), (0, u64::from(len) * 2));
        let words = Refusal::OtherLayout { len }.to_string();
        assert!(words.contains(&format!("{len} bytes")) && words.contains("flash"), "{words}");
        // A single one may be chance, as may two that do not touch.
        let single = [other(len, 1), bytes(&Reply::State(state())), other(len, 2)].concat();
        assert_eq!(hear(&single).0, [Ok(Message::State(state()))], "{len}");
    }
}

#[test]
fn the_factory_firmware_is_recognised_by_three_messages_in_a_row() {
    let mut message = vec![b'$'];
    for float in [2048.0_f32, -120.0, 0.0] {
        message.extend(float.to_le_bytes());
    }
    message.push(13);
    assert_eq!(hear(&message.repeat(2)).0, []);
    let begun = [&message[5..], &message.repeat(3)].concat();
    assert_eq!(hear(&begun).0, [Err(Refusal::Factory)]);
    message[12] = 1;
    assert_eq!(hear(&message.repeat(9)).0, []);
}

#[test]
fn replies_that_nobody_asked_for_hold_up_no_state() {
    let whole = bytes(&Reply::State(state()));
    // A recording's frame with a length of 80 kB, and raw angles without a checksum.
    for strange in [vec![START, 0xD1, 0x80, 0x38, 1, 0], bytes(&Reply::RawAngles(vec![7; 98]))] {
        let (heard, counts) = hear(&[&strange[..], &whole].concat());
        assert_eq!(heard, [Ok(Message::State(state()))]);
        assert_eq!(counts.skipped, strange.len() as u64);
    }
}

#[test]
fn a_reply_amid_states_is_heard_and_its_stray_bytes_are_skipped() {
    let firmware =
        FirmwareConfig { sync: true, angle_hanging: 1028.5, average: 1, correct_dynamics: true };
    let config = Config { period_ms: 10, firmware: Some(firmware) };
    let all = [
        bytes(&Reply::State(state())),
        bytes(&Reply::Config(config)),
        bytes(&Reply::State(state())),
        bytes(&Reply::Pid([1.0; 6])),
        bytes(&Reply::Calibrated(-1)),
        bytes(&Reply::Pong),
        bytes(&Reply::Experiment(16_000)),
    ];
    let (heard, counts) = hear(&all.concat());
    let expected = [
        Message::State(state()),
        Message::Config(config),
        Message::State(state()),
        Message::Gains([1.0; 6]),
        Message::Homed(-1),
        Message::Pong,
        Message::Experiment(16_000),
    ];
    assert_eq!(heard, expected.map(Ok));
    assert_eq!((counts.good, counts.skipped, counts.checksum_errors), (7, 8, 0));
    let wanted = FirmwareConfig { correct_dynamics: false, ..firmware };
    assert!(Config { firmware: Some(wanted), ..config }.is_taken(&config));
    assert!(!Config { period_ms: 20, ..config }.is_taken(&config));
}

#[test]
fn a_stop_is_three_frames_and_what_would_harm_the_board_is_not_sent() {
    let mut out = Vec::new();
    let mut host = Host::default();
    host.encode(&Order::Stop, &mut out).unwrap();
    assert_eq!(out, [0xAA, 0xC8, 8, 0, 0, 0, 0, 0xF3].repeat(3));
    let firmware =
        FirmwareConfig { sync: true, angle_hanging: 1000.0, average: 1, correct_dynamics: true };
    let good = Config { period_ms: 20, firmware: Some(firmware) };
    let with = |firmware| Config { firmware: Some(firmware), ..good };
    let mut try_to = |config| host.encode(&Order::Configure(config), &mut out);
    let period = |given| Err(Unsendable::Period { given, least: 2, most: 50 });
    assert_eq!(try_to(Config { period_ms: 0, ..good }), period(0));
    assert_eq!(try_to(Config { period_ms: 51, ..good }), period(51));
    let average = |average| FirmwareConfig { average, ..firmware };
    assert_eq!(try_to(with(average(0))), Err(Unsendable::Average(0)));
    assert_eq!(try_to(with(average(33))), Err(Unsendable::Average(33)));
    let hanging = |angle_hanging| FirmwareConfig { angle_hanging, ..firmware };
    assert!(matches!(try_to(with(hanging(f32::NAN))), Err(Unsendable::AngleHanging(_))));
    assert_eq!(try_to(Config { firmware: None, ..good }), Err(Unsendable::NoFirmwareConfig));
    assert_eq!(try_to(good), Ok(None));
    assert_eq!(out.len(), 24 + 14);
}

prop_compose! {
    fn any_state()(
        angle in any::<i16>(), position in any::<i16>(), command in any::<i16>(),
        (time_us, time_difference) in any::<(u32, u32)>(),
        (angle_change, target_position_m) in (-1e6..1e6_f32, -1.0..1.0_f32),
        (invalid_steps, latency_10us, latency_violation) in any::<(u8, u16, u16)>(),
    ) -> StateFrame {
        StateFrame {
            sensors: Readings::new(&[i32::from(angle), i32::from(position)]).unwrap(),
            time_us,
            time_difference_us: Some(time_difference),
            command: i32::from(command),
            firmware: Some(Firmware {
                angle_change, target_position_m, invalid_steps, latency_10us, latency_violation,
            }),
            ..StateFrame::default()
        }
    }
}

/// Bytes among which beginnings of frames are frequent.
fn any_bytes() -> impl Strategy<Value = Vec<u8>> {
    let piece = prop_oneof![
        prop::collection::vec(any::<u8>(), 0..40),
        any_state().prop_map(|state| bytes(&Reply::State(state))),
        (any_state(), 0..31_usize)
            .prop_map(|(state, cut)| { bytes(&Reply::State(state))[..cut].to_vec() }),
        (prop::sample::select(&OTHER_LAYOUTS[..]), any::<u8>())
            .prop_map(|(len, fill)| other(len, fill)),
        Just(vec![0xAA, 0xCC, 0x1F]),
        Just(vec![0xAA, 0xC5, 28]),
        Just(vec![b'$', 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 13]),
    ];
    prop::collection::vec(piece, 0..12).prop_map(|pieces| pieces.concat())
}

proptest! {
    #[test]
    fn no_bytes_make_it_fail_and_their_pieces_do_not_matter(
        bytes in any_bytes(),
        cuts in prop::collection::vec(1..40_usize, 1..60),
    ) {
        let (whole, counts) = hear(&bytes);
        let (mut host, mut heard, mut rest) = (Host::default(), Vec::new(), &bytes[..]);
        for cut in cuts.iter().cycle() {
            let (piece, after) = rest.split_at((*cut).min(rest.len()));
            host.take(piece);
            heard.extend(hear_all(&mut host));
            rest = after;
            if rest.is_empty() { break; }
        }
        prop_assert_eq!(&heard, &whole);
        prop_assert_eq!(host.counts(), counts);
        // Every byte is in a message, skipped, or the beginning of a message.
        prop_assert!(counts.skipped <= bytes.len() as u64);
        for len in 0..bytes.len().min(36) {
            let _ = (Request::decode(&bytes[..len]), frames::raw_angles(&bytes[..len], 3));
        }
    }

    #[test]
    fn every_state_survives_the_wire(states in prop::collection::vec(any_state(), 1..5)) {
        let sent: Vec<u8> = states.iter().flat_map(|s| bytes(&Reply::State(*s))).collect();
        let (heard, counts) = hear(&sent);
        let expected: Vec<_> = states.iter().map(|s| Ok(Message::State(*s))).collect();
        prop_assert_eq!(heard, expected);
        prop_assert_eq!(counts.skipped, 0);
    }

    #[test]
    fn a_flipped_bit_costs_a_state_and_never_changes_one(
        states in prop::collection::vec(any_state(), 2..4),
        at in any::<prop::sample::Index>(),
        bit in 0..8_u8,
    ) {
        let mut sent: Vec<u8> = states.iter().flat_map(|s| bytes(&Reply::State(*s))).collect();
        let at = at.index(sent.len());
        sent[at] ^= 1 << bit;
        let (heard, _) = hear(&sent);
        let mut expected = states.clone();
        expected.remove(at / 31);
        // The damaged one may be waited for at the end.
        let heard: Vec<_> = heard.into_iter().filter_map(Result::ok).collect();
        let expected: Vec<_> = expected.into_iter().map(Message::State).collect();
        prop_assert_eq!(heard, expected);
    }
}
