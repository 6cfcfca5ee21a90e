use super::super::{Ack, Config, Flags, Hello, Outcome, Readings, StateFrame};
use super::*;
use crate::random::{Place, Purpose, stream};
use proptest::prelude::*;
use rand::RngExt;

fn hear_all(host: &mut Host) -> Vec<Result<Message, Refusal>> {
    std::iter::from_fn(|| host.hear()).collect()
}

fn hear(bytes: &[u8]) -> (Vec<Result<Message, Refusal>>, Counts) {
    let mut host = Host::default();
    host.take(bytes);
    (hear_all(&mut host), host.counts())
}

fn bytes(reply: &Reply, number: u8) -> Vec<u8> {
    let mut bytes = Vec::new();
    reply.encode(number, &mut bytes);
    bytes
}

fn requests(bytes: &[u8]) -> Vec<(u8, Result<Request, Outcome>)> {
    let mut deframer = Deframer::default();
    deframer.take(bytes);
    std::iter::from_fn(|| deframer.piece())
        .filter_map(|piece| match piece {
            Piece::Good(frame, _) => Some((frame.number(), Request::decode(&frame))),
            Piece::Damaged(_) | Piece::Overlong(_) => None,
        })
        .collect()
}

fn state(command: i32) -> StateFrame {
    StateFrame {
        sensors: Readings::new(&[4095, -2000]).unwrap(),
        time_us: 77,
        command,
        applied: Some(9),
        flags: Some(Flags::ARMED.with(Flags::HOMED, true)),
        ..StateFrame::default()
    }
}

#[test]
fn a_state_of_two_sensors_takes_25_bytes() {
    assert_eq!(bytes(&Reply::State(state(5)), 1).len(), 25);
}

#[test]
fn orders_reach_the_device_with_their_numbers() {
    let (mut host, mut out) = (Host::default(), Vec::new());
    let config = Config { period_ms: 10, firmware: None };
    let orders = [
        (Order::Query, Request::Query),
        (Order::Configure(config), Request::Config { period_ms: 10 }),
        (Order::Stream(true), Request::Stream(true)),
        (Order::Home, Request::Home),
        (Order::Arm { watchdog_ms: 50 }, Request::Arm { version: 1, watchdog_ms: 50 }),
        (Order::Command(-900), Request::Command(-900)),
        (Order::Disarm, Request::Disarm),
        (Order::Ping, Request::Ping),
    ];
    for (k, (order, _)) in (1..).zip(&orders) {
        assert_eq!(host.encode(order, &mut out), Ok(Some(k)));
    }
    let expected: Vec<_> = (1..).zip(orders.map(|(_, request)| Ok(request))).collect();
    assert_eq!(requests(&out), expected);
    out.clear();
    assert_eq!(host.encode(&Order::Stop, &mut out), Ok(Some(11)));
    assert_eq!(requests(&out).len(), 3);
    let refused = host.encode(&Order::Arm { watchdog_ms: 251 }, &mut out);
    assert_eq!(refused, Err(Unsendable::Watchdog(251)));
    let slow = Config { period_ms: 101, firmware: None };
    assert!(host.encode(&Order::Configure(slow), &mut out).is_err());
}

#[test]
fn lost_frames_are_counted_by_their_numbers_and_a_restart_is_no_loss() {
    let mut sent = Vec::new();
    for number in [253, 255, 2, 2] {
        sent.extend(bytes(&Reply::State(state(0)), number));
    }
    let hello = Hello { sensors: 2, name: Hello::named("bench"), ..Hello::default() };
    sent.extend(bytes(&Reply::Hello { version: 1, hello }, 1));
    sent.extend(bytes(&Reply::Homed(0), 2));
    let (heard, counts) = hear(&sent);
    assert_eq!(heard.len(), 6);
    assert_eq!(heard[4], Ok(Message::Hello(hello)));
    assert_eq!(heard[5], Ok(Message::NotHomed));
    assert_eq!(hello.name(), "bench");
    // 254, and 1.
    assert_eq!((counts.good, counts.lost), (6, 2));
}

#[test]
fn another_version_is_refused_whatever_its_hello_looks_like() {
    let hello = Reply::Hello { version: 2, hello: Hello::default() };
    let (heard, counts) = hear(&bytes(&hello, 1));
    assert_eq!(heard, [Err(Refusal::Version { seen: 2 })]);
    assert_eq!(counts.good, 0);
}

#[test]
fn rubbish_of_any_length_is_skipped_up_to_the_next_delimiter() {
    for len in [1, 3, 64, 65, 66, 67, 200, 3000] {
        let mut sent = vec![7; len];
        sent.push(0);
        sent.extend(bytes(&Reply::State(state(0)), 1));
        let (heard, counts) = hear(&sent);
        assert_eq!(heard, [Ok(Message::State(state(0)))], "{len}");
        assert_eq!(counts.skipped, len as u64 + 1);
    }
    assert_eq!(hear(&[0; 50]).1, Counts::default());
}

#[test]
fn a_name_is_cut_between_letters() {
    let hello = |name| Hello { name: Hello::named(name), ..Hello::default() }.name();
    assert_eq!(hello("Stab"), "Stab");
    assert_eq!(hello("0123456789abcdeß"), "0123456789abcde");
}

/// One bit is always noticed where it stays in the body; where it moves a delimiter or the
/// stuffing, one in 65536 may pass.
#[test]
fn flipped_bits_pass_no_more_often_than_the_checksum_lets_them() {
    let mut chance = stream(5, Purpose::Wire, Place::default());
    let (mut flips, mut passed) = (0, 0);
    for _ in 0..1000 {
        let sensors: Vec<i32> = (0..4).map(|_| chance.random_range(-5000..5000)).collect();
        let state = StateFrame {
            sensors: Readings::new(&sensors).unwrap(),
            time_us: chance.random(),
            ..state(chance.random_range(-9..9))
        };
        let sent = bytes(&Reply::State(state), chance.random_range(1..=255));
        for bit in 0..sent.len() * 8 {
            let mut flipped = sent.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            flipped.push(0);
            flips += 1;
            passed += u32::from(hear(&flipped).0.iter().any(Result::is_ok));
        }
    }
    assert!(flips > 200_000 && passed < 10, "{passed} of {flips}");
}

prop_compose! {
    fn any_state()(
        sensors in prop::collection::vec(any::<i32>(), 0..=8),
        time_us in any::<u32>(), command in any::<i32>(), applied in any::<u8>(),
        flags in any::<u16>(),
    ) -> StateFrame {
        StateFrame {
            sensors: Readings::new(&sensors).unwrap(),
            time_us, command,
            applied: Some(applied),
            flags: Some(Flags(flags)),
            ..StateFrame::default()
        }
    }
}

fn any_reply() -> impl Strategy<Value = Reply> {
    prop_oneof![
        any_state().prop_map(Reply::State),
        (any::<u8>(), prop::sample::select(&Outcome::ALL[..]))
            .prop_map(|(of, outcome)| Reply::Ack(Ack { of, outcome })),
        any::<i8>().prop_map(Reply::Homed),
        any::<(u8, u16, u16, i32, [u8; 16])>().prop_map(
            |(sensors, period_ms, watchdog_ms, full_scale, name)| Reply::Hello {
                version: VERSION,
                hello: Hello { sensors, period_ms, watchdog_ms, full_scale, name },
            }
        ),
    ]
}

fn any_request() -> impl Strategy<Value = Request> {
    prop_oneof![
        Just(Request::Query),
        Just(Request::Home),
        Just(Request::Stop),
        Just(Request::Disarm),
        Just(Request::Ping),
        any::<bool>().prop_map(Request::Stream),
        any::<u16>().prop_map(|period_ms| Request::Config { period_ms }),
        any::<i32>().prop_map(Request::Command),
        any::<(u16, u16)>()
            .prop_map(|(version, watchdog_ms)| Request::Arm { version, watchdog_ms }),
    ]
}

fn any_bytes() -> impl Strategy<Value = Vec<u8>> {
    let piece = prop_oneof![
        prop::collection::vec(any::<u8>(), 0..90),
        prop::collection::vec(1..=255_u8, 60..70),
        (any_reply(), any::<u8>()).prop_map(|(reply, number)| bytes(&reply, number)),
        (any_reply(), 0..20_usize).prop_map(|(reply, cut)| {
            let bytes = bytes(&reply, 1);
            bytes[..cut.min(bytes.len())].to_vec()
        }),
        Just(vec![0]),
    ];
    prop::collection::vec(piece, 0..12).prop_map(|pieces| pieces.concat())
}

proptest! {
    #[test]
    fn no_bytes_make_it_fail_and_their_pieces_do_not_matter(
        bytes in any_bytes(),
        cuts in prop::collection::vec(1..80_usize, 1..60),
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
        prop_assert!(counts.skipped <= bytes.len() as u64);
        requests(&bytes);
    }

    #[test]
    fn every_reply_survives_the_wire(
        replies in prop::collection::vec((any_reply(), 1..=255_u8), 1..5),
    ) {
        let sent: Vec<u8> = replies.iter().flat_map(|(r, number)| bytes(r, *number)).collect();
        let mut deframer = Deframer::default();
        deframer.take(&sent);
        for (reply, number) in &replies {
            let Some(Piece::Good(frame, _)) = deframer.piece() else { panic!("{reply:?}") };
            prop_assert_eq!(frame.number(), *number);
            prop_assert_eq!(Reply::decode(&frame), Some(*reply));
        }
        prop_assert_eq!(hear(&sent).0.len(), replies.len());
    }

    #[test]
    fn every_request_survives_the_wire(request in any_request(), number in 1..=255_u8) {
        let mut sent = Vec::new();
        request.encode(number, &mut sent);
        prop_assert_eq!(requests(&sent), [(number, Ok(request))]);
    }
}
