use super::super::Params;
use super::*;
use proptest::prelude::*;

/// Pads of which one has its stick at `value`.
fn pads(value: f64) -> Pads {
    let mut pads = Pads::new(&Params::default());
    let about = About {
        id: Id(3),
        name: "Xbox Pad".to_owned(),
        guid: "0".repeat(32),
        mapping: "SDL mapping".to_owned(),
    };
    pads.take(Event::Connected(about), Seconds(0.0));
    stick(&mut pads, value);
    pads
}

fn stick(pads: &mut Pads, value: f64) {
    let axis = Event::Axis { pad: Id(3), axis: Axis::LeftStickX, value };
    pads.take(axis, Seconds(0.0));
    let axis = Event::Axis { pad: Id(3), axis: Axis::Code(196_611), value: -value };
    pads.take(axis, Seconds(0.0));
}

impl Inlet {
    fn hear(&mut self, line: &str, now: Seconds) -> Vec<Event> {
        self.take(understand(line), now)
    }
}

/// The far end after it was told `events`.
fn hear(far: &mut Pads, events: Vec<Event>) {
    for event in events {
        far.take(event, Seconds(0.0));
    }
}

#[test]
fn a_state_goes_through_a_line_and_only_what_changed_becomes_an_event() {
    let (mut near, mut outlet, mut inlet) = (pads(0.0), Outlet::new(1), Inlet::default());
    let mut far = Pads::new(&Params::default());
    let now = Seconds(5.0);
    hear(&mut far, inlet.hear(&outlet.line(&near, Seconds(0.1)), now));
    assert_eq!(far.present(), near.present());
    stick(&mut near, -0.1234567890123456);
    let south = Event::Button { pad: Id(3), button: Button::South, is_pressed: true };
    near.take(south.clone(), now);
    let events = inlet.hear(&outlet.line(&near, Seconds(0.12)), now);
    assert_eq!(events.len(), 3);
    assert!(events.contains(&south));
    hear(&mut far, events);
    assert_eq!(far.present(), near.present());
    assert_eq!(far.deflection(), Some(-0.1234567890123456));
    assert_eq!(inlet.hear(&outlet.line(&near, Seconds(0.14)), now), []);
    near.take(Event::Disconnected(Id(3)), now);
    let events = inlet.hear(&outlet.line(&near, Seconds(0.16)), now);
    assert_eq!(events, [Event::Disconnected(Id(3))]);
}

#[test]
fn lines_that_are_late_twice_or_missing_are_counted_and_change_nothing_wrong() {
    let (near, mut outlet, mut inlet) = (pads(0.5), Outlet::new(1), Inlet::default());
    let lines: Vec<String> =
        (0..5).map(|k| outlet.line(&near, Seconds(0.02 * f64::from(k)))).collect();
    for line in [0, 3, 1, 3, 4] {
        inlet.hear(&lines[line], Seconds(1.0));
    }
    assert_eq!(inlet.counts(), Counts { taken: 3, lost: 2, stale: 2, damaged: 0 });
    // A relay that was started anew begins at 1 again.
    let line = Outlet::new(2).line(&near, Seconds(0.0));
    inlet.hear(&line, Seconds(1.0));
    assert_eq!(inlet.counts(), Counts { taken: 4, lost: 2, stale: 2, damaged: 0 });
}

#[test]
fn a_line_cut_anywhere_is_damaged_and_the_next_whole_one_counts() {
    let (near, mut outlet) = (pads(0.5), Outlet::new(1));
    let line = outlet.line(&near, Seconds(0.0));
    let next = outlet.line(&near, Seconds(0.02));
    for cut in 0..line.len() {
        let mut inlet = Inlet::default();
        assert_eq!(inlet.hear(&line[..cut], Seconds(1.0)), [], "{cut}");
        assert_eq!(inlet.counts().damaged, 1);
        assert!(!inlet.hear(&next, Seconds(1.0)).is_empty());
    }
    let mut inlet = Inlet::default();
    for line in ["", "null", "{}", "[1]", r#"{"coadapt_pad":1}"#, &line.replace("0.5", "null")] {
        assert_eq!(inlet.hear(line, Seconds(1.0)), [], "{line}");
    }
    assert_eq!(inlet.counts().damaged, 6);
}

#[test]
fn a_newer_relay_is_told_apart_from_damage() {
    let mut inlet = Inlet::default();
    let line = r#"{"coadapt_pad":2,"what":"ever"}"#;
    assert_eq!(inlet.hear(line, Seconds(0.0)), []);
    assert_eq!((inlet.newer(), inlet.counts().damaged), (Some(2), 0));
    inlet.hear(&Outlet::new(1).line(&pads(0.0), Seconds(0.0)), Seconds(0.0));
    assert_eq!(inlet.newer(), None);
}

#[test]
fn the_age_is_what_the_link_adds_to_its_best() {
    let (near, mut outlet, mut inlet) = (pads(0.0), Outlet::new(1), Inlet::default());
    assert_eq!(inlet.age(Seconds(0.0)), None);
    let about = |age: f64, expected: f64| (age - expected).abs() < 1e-3;
    // The clocks differ by 100 s; the link takes 10 ms, then 250 ms, then 10 ms.
    for (t, takes, age) in [(0.0, 0.01, 0.0), (0.02, 0.25, 0.24), (0.5, 0.01, 0.0)] {
        let now = Seconds(100.0 + t + takes);
        inlet.hear(&outlet.line(&near, Seconds(t)), now);
        assert!(about(inlet.age(now).unwrap().0, age), "{t}");
    }
    assert!(about(inlet.age(Seconds(101.51)).unwrap().0, 1.0));
    inlet.end();
    assert_eq!(inlet.age(Seconds(101.51)), None);
}

#[test]
fn a_computer_that_slept_is_late_no_more_after_a_second_of_steady_lines() {
    let (near, mut outlet, mut inlet) = (pads(0.0), Outlet::new(1), Inlet::default());
    let mut age = 0.0;
    for k in 0..200_u32 {
        let t = 0.02 * f64::from(k);
        // The relay's clock stands still for a minute; ours does not.
        let now = Seconds(t + if k < 50 { 0.0 } else { 60.0 });
        inlet.hear(&outlet.line(&near, Seconds(t)), now);
        age = inlet.age(now).unwrap().0;
        assert!(k != 60 || age > 59.0, "{age}");
    }
    assert!(age < 0.1, "{age}");
    // A link that is slow, but not equally so, stays late.
    for k in 200..400_u32 {
        let t = 0.02 * f64::from(k);
        let now = Seconds(60.0 + t + 3.0 + f64::from(k % 10) * 0.02);
        inlet.hear(&outlet.line(&near, Seconds(t)), now);
        age = inlet.age(now).unwrap().0;
    }
    assert!(age > 2.0, "{age}");
}

#[test]
fn a_line_with_absurd_numbers_is_damaged_or_bounded() {
    let mut inlet = Inlet::default();
    let line = |seq: u64, pads: &str| {
        format!(r#"{{"coadapt_pad":1,"run":1,"seq":{seq},"t":0.0,"pads":[{pads}]}}"#)
    };
    inlet.hear(&line(1, ""), Seconds(0.0));
    inlet.hear(&line(u64::MAX, ""), Seconds(0.0));
    assert_eq!(inlet.counts(), Counts { taken: 1, lost: 0, stale: 0, damaged: 1 });
    let axes: Vec<String> = (0..1000).map(|k| format!(r#"[{{"code":{k}}},0.5]"#)).collect();
    let pad = |id: u32| {
        let axes = axes.join(",");
        format!(r#"{{"id":{id},"name":"P","guid":"","mapping":"","axes":[{axes}],"pressed":[]}}"#)
    };
    let pads: Vec<String> = (0..30).map(pad).collect();
    let events = inlet.hear(&line(2, &pads.join(",")), Seconds(0.0));
    assert_eq!(events.len(), MOST_PADS * (1 + MOST_CONTROLS));
    inlet.hear("bash: command not found", Seconds(0.0));
    assert_eq!(inlet.strange(), Some("bash: command not found"));
}

#[test]
fn a_link_that_ended_leaves_no_pad() {
    let (near, mut inlet) = (pads(0.7), Inlet::default());
    inlet.hear(&Outlet::new(1).line(&near, Seconds(0.0)), Seconds(0.0));
    assert_eq!(inlet.end(), [Event::Disconnected(Id(3))]);
    assert_eq!(inlet.end(), []);
    // The next relay brings it again, as a new one.
    let events = inlet.hear(&Outlet::new(2).line(&near, Seconds(0.0)), Seconds(0.0));
    assert!(matches!(events[0], Event::Connected(_)));
}

proptest! {
    #[test]
    fn no_line_whatever_makes_it_fail(
        line in ".{0,200}",
        bytes in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let mut inlet = Inlet::default();
        inlet.hear(&line, Seconds(0.0));
        inlet.hear(&String::from_utf8_lossy(&bytes), Seconds(0.0));
        prop_assert_eq!(inlet.counts().taken, 0);
    }

    /// Whatever is lost, doubled or swapped on the way, the far end shows what the last line
    /// that counts says.
    #[test]
    fn the_far_end_is_always_the_newest_state(
        order in prop::collection::vec(0..20_usize, 1..60),
    ) {
        let mut outlet = Outlet::new(1);
        let value = |k: usize| f64::from(u32::try_from(k).unwrap()) / 100.0 - 0.1;
        let lines: Vec<String> =
            (0..20).map(|k| outlet.line(&pads(value(k)), Seconds(0.0))).collect();
        let (mut inlet, mut far) = (Inlet::default(), Pads::new(&Params::default()));
        for k in &order {
            hear(&mut far, inlet.hear(&lines[*k], Seconds(0.0)));
        }
        let newest = order.iter().max().unwrap();
        prop_assert_eq!(far.present()[0].axes[&Axis::LeftStickX], value(*newest));
    }
}
