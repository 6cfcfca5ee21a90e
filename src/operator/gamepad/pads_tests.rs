use super::*;
use proptest::prelude::*;

const NOW: Seconds = Seconds(1.0);

fn about(id: u32, name: &str) -> About {
    let guid = format!("{id:032x}");
    About { id: Id(id), name: name.to_owned(), guid, mapping: "SDL mapping".to_owned() }
}

fn connected(id: u32, name: &str) -> Event {
    Event::Connected(about(id, name))
}

fn stick(id: u32, value: f64) -> Event {
    Event::Axis { pad: Id(id), axis: Axis::LeftStickX, value }
}

fn press(id: u32, button: Button) -> [Event; 2] {
    [true, false].map(|is_pressed| Event::Button { pad: Id(id), button, is_pressed })
}

/// Lets `events` happen to `pads`.
fn happen(pads: &mut Pads, events: impl IntoIterator<Item = Event>) {
    for event in events {
        pads.take(event, NOW);
    }
}

fn after(params: &Params, events: impl IntoIterator<Item = Event>) -> Pads {
    let mut pads = Pads::new(params);
    happen(&mut pads, events);
    pads
}

fn news(pads: &mut Pads) -> Vec<News> {
    std::iter::from_fn(|| pads.next_news()).collect()
}

#[test]
fn a_pad_that_never_moved_is_an_idle_hand_and_none_is_nobody() {
    let params = Params::default();
    assert_eq!(Pads::new(&params).deflection(), None);
    assert!(Pads::new(&params).trouble().unwrap().contains("plug one in"));
    let pads = after(&params, [connected(1, "A")]);
    assert_eq!((pads.deflection(), pads.trouble(), pads.last_event()), (Some(0.0), None, None));
}

#[test]
fn an_axis_counts_from_its_first_event_near_the_centre() {
    let params = Params::default();
    let mut pads = after(&params, [connected(1, "A"), stick(1, 0.9)]);
    assert_eq!(pads.deflection(), None);
    assert!(pads.trouble().unwrap().contains("left_stick_x through its centre"));
    pads.take(stick(1, 0.1), NOW);
    assert_eq!(pads.deflection(), Some(0.1));
    pads.take(stick(1, -0.8), NOW);
    assert_eq!(pads.deflection(), Some(-0.8));
    pads.take(Event::Axis { pad: Id(1), axis: Axis::RightStickX, value: 0.3 }, NOW);
    assert_eq!(pads.deflection(), Some(-0.8));
}

#[test]
fn unplugged_is_nobody_and_plugged_back_the_stick_passes_its_centre_first() {
    let params = Params::default();
    let mut pads = after(&params, [connected(1, "A"), stick(1, 0.0), stick(1, 0.7)]);
    news(&mut pads);
    pads.take(Event::Disconnected(Id(1)), NOW);
    assert_eq!(pads.deflection(), None);
    assert_eq!(news(&mut pads), [News::Gone("A was unplugged".to_owned())]);
    assert!(pads.trouble().unwrap().contains("A is unplugged"));
    pads.take(connected(2, "A"), NOW);
    assert_eq!(news(&mut pads), [News::Back("A is plugged in".to_owned())]);
    assert_eq!(pads.deflection(), None, "before any event");
    for (value, steers) in [(0.7, None), (0.2, None), (-0.15, Some(-0.15)), (0.7, Some(0.7))] {
        pads.take(stick(2, value), NOW);
        assert_eq!(pads.deflection(), steers);
    }
}

#[test]
fn of_two_pads_the_first_steers_and_the_other_takes_over_with_its_begin_button() {
    let params = Params::default();
    let mut pads = after(&params, [connected(1, "A"), connected(2, "B"), stick(1, 0.0)]);
    assert!(pads.words().starts_with("gamepad A") && pads.words().ends_with("1 more"));
    assert!(
        matches!(&news(&mut pads)[1], News::Remark(words) if words.contains("B is plugged in and waits; A steers"))
    );
    pads.take(stick(2, 1.0), NOW);
    assert_eq!(pads.deflection(), Some(0.0));
    // Its buttons mean nothing else while it waits, but for the emergency stop.
    for button in [Button::Select, Button::North, Button::South] {
        happen(&mut pads, press(2, button));
    }
    assert_eq!(news(&mut pads), []);
    happen(&mut pads, press(2, Button::East));
    assert_eq!(news(&mut pads), [News::Asks(Request::Stop)]);
    happen(&mut pads, press(2, Button::Start));
    assert_eq!(news(&mut pads), [News::Back("B steers from now on".to_owned())]);
    assert_eq!(pads.deflection(), None, "its stick is held off the centre");
    pads.take(stick(2, 0.0), NOW);
    pads.take(stick(2, 0.4), NOW);
    assert_eq!(pads.deflection(), Some(0.4));
    // Without the one that steers the other does not step in by itself.
    pads.take(Event::Disconnected(Id(2)), NOW);
    assert_eq!(pads.deflection(), None);
    assert!(pads.trouble().unwrap().ends_with("or press start on A"));
}

#[test]
fn a_wanted_pad_is_known_by_its_name_or_guid_and_no_other_steers() {
    for wanted in ["wingman", &format!("{:032X}", 0xab)] {
        let params = Params { pad: Some(wanted.to_owned()), ..Params::default() };
        let mut pads = after(&params, [connected(1, "Xbox"), stick(1, 0.0)]);
        assert_eq!(pads.deflection(), None);
        happen(&mut pads, press(1, Button::Start));
        assert_eq!(pads.deflection(), None);
        assert!(pads.trouble().unwrap().contains(&format!("no gamepad `{wanted}`")));
        pads.take(connected(0xab, "Logitech WingMan"), NOW);
        assert_eq!(pads.deflection(), Some(0.0));
    }
}

#[test]
fn a_held_button_asks_once_and_every_button_for_what_it_is_mapped_to() {
    let params = Params::default();
    let mut pads = after(&params, [connected(1, "A")]);
    news(&mut pads);
    let [down, up] = press(1, Button::Select);
    happen(&mut pads, [down.clone(), down.clone(), up, down]);
    assert_eq!(news(&mut pads), [News::Asks(Request::Pause), News::Asks(Request::Pause)]);
    for (button, request) in [
        (Button::Start, Request::Begin),
        (Button::North, Request::Discard),
        (Button::East, Request::Stop),
    ] {
        happen(&mut pads, press(1, button));
        assert_eq!(news(&mut pads), [News::Asks(request)]);
    }
}

#[test]
fn what_is_no_number_is_told_once_and_passed_over() {
    let params = Params::default();
    let mut pads = after(&params, [connected(1, "A"), stick(1, 0.1)]);
    news(&mut pads);
    for value in [f64::NAN, f64::INFINITY, f64::NAN] {
        pads.take(stick(1, value), NOW);
    }
    assert_eq!(pads.deflection(), Some(0.1));
    assert_eq!(news(&mut pads).len(), 1);
}

#[test]
fn a_pad_with_30_axes_and_one_that_invents_them_are_kept_within_bounds() {
    let params =
        Params { map: Map { steer: Axis::Code(29), ..Map::default() }, ..Params::default() };
    let axis = |code, value| Event::Axis { pad: Id(1), axis: Axis::Code(code), value };
    let mut pads = after(&params, [connected(1, "A")]);
    (0..30).for_each(|code| pads.take(axis(code, f64::from(code) / 1000.0), NOW));
    assert_eq!(pads.present()[0].axes.len(), 30);
    assert_eq!(pads.deflection(), Some(0.029));
    (0..100_000).for_each(|code| pads.take(axis(code, 0.5), NOW));
    assert_eq!(pads.present()[0].axes.len(), MOST_CONTROLS);
    assert_eq!(pads.deflection(), Some(0.5));
}

fn any_event() -> impl Strategy<Value = Event> {
    let value = prop_oneof![Just(f64::NAN), -2.0..2.0_f64, Just(0.0)];
    let button = prop::sample::select(vec![Button::Start, Button::East, Button::South]);
    (0..4_u32, 0..3_u32, value, button).prop_map(|(kind, pad, value, button)| match kind {
        0 => connected(pad, "P"),
        1 => Event::Disconnected(Id(pad)),
        2 => stick(pad, value),
        _ => Event::Button { pad: Id(pad), button, is_pressed: value > 0.0 },
    })
}

proptest! {
    /// Whatever happens, a deflection is a number of a pad that is there, and after the last
    /// pad is gone nobody steers.
    #[test]
    fn no_order_of_events_lets_a_pad_steer_that_is_gone(
        events in prop::collection::vec(any_event(), 0..60),
    ) {
        let mut pads = after(&Params::default(), events);
        if let Some(deflection) = pads.deflection() {
            prop_assert!(deflection.is_finite());
            prop_assert!(pads.steering().is_some());
            prop_assert_eq!(pads.trouble(), None);
        } else {
            prop_assert!(pads.trouble().is_some());
        }
        for id in 0..3 {
            pads.take(Event::Disconnected(Id(id)), NOW);
        }
        prop_assert_eq!(pads.deflection(), None);
        pads.take(connected(7, "P"), NOW);
        pads.take(stick(7, 0.9), NOW);
        prop_assert_eq!(pads.deflection(), None);
    }
}

proptest! {
    /// Only the button of the pad in charge holds the switch, and only while it is down.
    #[test]
    fn no_order_of_events_leaves_the_switch_held(
        events in proptest::collection::vec((0..8_u8, 1..4_u32), 0..80),
    ) {
        let mut pads = Pads::new(&Params::default());
        let mut down = BTreeSet::new();
        for (event, id) in events {
            let button = |button, is_pressed| Event::Button { pad: Id(id), button, is_pressed };
            let event = match event {
                0 => connected(id, "A"),
                1 => Event::Disconnected(Id(id)),
                2 | 3 => button(Button::LeftTrigger, true),
                4 => button(Button::LeftTrigger, false),
                5 => button(Button::Start, true),
                6 => button(Button::Start, false),
                _ => stick(id, 0.7),
            };
            match event {
                Event::Button { button: Button::LeftTrigger, is_pressed: true, .. } => {
                    down.insert(Id(id));
                }
                Event::Button { button: Button::LeftTrigger, .. } | Event::Disconnected(_) => {
                    down.remove(&Id(id));
                }
                _ => {}
            }
            pads.take(event, NOW);
            let charge = pads.steering().map(|pad| pad.about.id);
            let may_be_held = charge.is_some_and(|id| down.contains(&id));
            prop_assert!(may_be_held || pads.switch() == Switch::Free);
        }
        // The pad in charge has its switch at hand again.
        if let Some(Id(id)) = pads.steering().map(|pad| pad.about.id) {
            let [press, release] = press(id, Button::LeftTrigger);
            pads.take(press, NOW);
            prop_assert_eq!(pads.switch(), Switch::Held);
            pads.take(release, NOW);
            prop_assert_eq!(pads.switch(), Switch::Free);
        }
    }
}
