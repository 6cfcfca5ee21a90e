use super::events::Events;
use super::link::Link;
use super::*;
use crate::clock::{Clock, WallClock};
use crate::operator::Request;
use crate::signal::State;

const TICK: Seconds = Seconds(0.02);

fn scripted(table: &str, params: &Params) -> Gamepad {
    let events = Events::parse(&format!("t,event,pad,what,value\n{table}")).unwrap();
    Gamepad::new(Source::script(events), params, 10.0, TICK)
}

/// What `gamepad` wants at `now`, asked as the control cycle asks.
fn wish(gamepad: &mut Gamepad, now: f64) -> (Vec<News>, Intent) {
    let now = Seconds(now);
    let news = std::iter::from_fn(|| gamepad.news(now)).collect();
    let state = State::default();
    (news, gamepad.intent(View { state: &state, now, rollout_time: now }))
}

#[test]
fn a_stick_goes_through_the_shape_and_its_raw_value_is_kept() {
    let params = Params {
        shape: Shape { dead_zone: 0.1, sensitivity: 0.5, invert: true, ..Shape::default() },
        ..Params::default()
    };
    let mut pad = scripted(
        "0,connect,1,A,\n0.02,axis,1,left_stick_x,0\n0.04,axis,1,left_stick_x,0.55\n",
        &params,
    );
    assert_eq!(
        wish(&mut pad, 0.0).1,
        Intent::Present { action: Action(0.0), raw: Some(0.0), age: Seconds(0.0) }
    );
    wish(&mut pad, 0.02);
    let Intent::Present { action, raw, age } = wish(&mut pad, 0.1).1 else { panic!() };
    assert!((action.0 + 2.5).abs() < 1e-12 && raw == Some(0.55), "{action:?} {raw:?}");
    assert!((age.0 - 0.06).abs() < 1e-12);
    pad.tune(1.0);
    assert!((wish(&mut pad, 0.12).1.action().0 + 5.0).abs() < 1e-12);
    assert_eq!(pad.badge().words(), "gamepad A, left_stick_x, a table of events");
}

#[test]
fn an_unplugged_pad_is_absent_in_the_same_tick_and_comes_back_through_its_centre() {
    let mut pad = scripted(
        "0,connect,1,A,\n0,axis,1,left_stick_x,0\n0.04,axis,1,left_stick_x,1\n\
         0.06,disconnect,1,,\n0.08,connect,1,A,\n0.10,axis,1,left_stick_x,1\n\
         0.12,axis,1,left_stick_x,0\n0.14,axis,1,left_stick_x,-1\n",
        &Params::default(),
    );
    wish(&mut pad, 0.02);
    assert_eq!(wish(&mut pad, 0.04).1.action(), Action(10.0));
    let (news, intent) = wish(&mut pad, 0.06);
    assert!(matches!(news[..], [News::Gone(_)]) && intent == Intent::Absent && pad.is_gone());
    assert!(pad.badge().trouble().unwrap().contains("A is unplugged"));
    for now in [0.08, 0.10] {
        assert_eq!(wish(&mut pad, now).1, Intent::Absent);
        assert!(pad.is_gone());
    }
    assert_eq!(wish(&mut pad, 0.12).1.action(), Action(0.0));
    assert!(!pad.is_gone() && pad.badge().trouble().is_none());
    assert_eq!(wish(&mut pad, 0.14).1.action(), Action(-10.0));
    assert!(pad.is_over());
}

#[test]
fn the_filter_forgets_the_push_of_a_pad_that_went() {
    let shape = Shape { filter_s: 1.0, ..Shape::default() };
    let mut pad = scripted(
        "0,connect,1,A,\n0,axis,1,left_stick_x,0\n0,axis,1,left_stick_x,1\n9,disconnect,1,,\n\
         90,connect,1,A,\n90,axis,1,left_stick_x,0\n",
        &Params { shape, ..Params::default() },
    );
    for tick in 0..500 {
        wish(&mut pad, f64::from(tick) * 0.02);
    }
    assert!(wish(&mut pad, 8.99).1 == Intent::Absent);
    for tick in 500..4400 {
        wish(&mut pad, f64::from(tick) * 0.02);
    }
    assert_eq!(wish(&mut pad, 90.0).1.action(), Action(0.0));
}

#[test]
fn buttons_ask_and_without_any_pad_nobody_steers() {
    let mut pad = scripted("1,connect,1,A,\n2,press,1,east,\n", &Params::default());
    let (news, intent) = wish(&mut pad, 0.0);
    assert!(news.is_empty() && intent == Intent::Absent && pad.is_gone());
    wish(&mut pad, 1.0);
    assert_eq!(wish(&mut pad, 2.0).0, [News::Asks(Request::Stop)]);
    let mut none = Gamepad::new(Source::nothing("no way"), &Params::default(), 1.0, TICK);
    assert_eq!(wish(&mut none, 0.0).1, Intent::Absent);
    assert_eq!(none.badge().trouble(), Some("no way".to_owned()));
}

/// The switch at the times `now`, asked as the control cycle asks.
fn switches(gamepad: &mut Gamepad, now: &[f64]) -> Vec<Switch> {
    let mut at = |now: &f64| {
        wish(gamepad, *now);
        gamepad.switch(Seconds(*now))
    };
    now.iter().map(&mut at).collect()
}

#[test]
fn the_switch_is_held_from_press_to_release_whatever_else_is_pressed() {
    use Switch::{Free, Held};
    let table = "0,connect,1,A,\n1,press,1,left_trigger,\n2,press,1,south,\n2,release,1,south,\n\
                 3,axis,1,left_stick_x,1\n4,release,1,left_trigger,\n";
    let mut pad = scripted(table, &Params::default());
    assert_eq!(pad.switch_name().as_deref(), Some("hold L1"));
    let told = switches(&mut pad, &[0.0, 0.98, 1.0, 2.0, 3.0, 4.0, 9.0]);
    assert_eq!(told, [Free, Free, Held, Held, Held, Free, Free]);
    let none = Map { enable: None, ..Map::default() };
    let mut pad = scripted(table, &Params { map: none, ..Params::default() });
    assert_eq!((pad.switch(Seconds(1.0)), pad.switch_name()), (Switch::None, None));
    let other = Map { enable: Some(Button::South), ..Map::default() };
    let mut pad = scripted(table, &Params { map: other, ..Params::default() });
    assert_eq!(switches(&mut pad, &[1.0, 1.98, 2.0]), [Free, Free, Free]);
}

#[test]
fn an_unplugged_pad_and_one_that_does_not_steer_have_a_free_switch() {
    use Switch::{Free, Held};
    let mut pad = scripted(
        "0,connect,1,A,\n0,connect,2,B,\n1,press,2,left_trigger,\n2,press,1,left_trigger,\n\
         3,release,2,left_trigger,\n4,press,2,start,\n5,press,2,left_trigger,\n\
         6,disconnect,2,,\n7,connect,2,B,\n8,press,2,left_trigger,\n",
        &Params::default(),
    );
    // From 4 s on B steers, whose switch is pressed at 5 s; A's is held throughout.
    let told = switches(&mut pad, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
    assert_eq!(told, [Free, Held, Held, Free, Held, Free, Free, Held]);
}

/// A relay's line with one pad, whose switch is held.
fn relayed(clock: WallClock) -> Link {
    let link = Link::default();
    let mut outlet = relay::Outlet::new(1);
    let mut pads = Pads::new(&Params::default());
    let (name, mapping) = ("Far".to_owned(), String::new());
    let about = About { id: Id(1), name, guid: String::new(), mapping };
    pads.take(Event::Connected(about), Seconds(0.0));
    let (button, is_pressed) = (Button::LeftTrigger, true);
    pads.take(Event::Button { pad: Id(1), button, is_pressed }, Seconds(0.0));
    link.take(outlet.line(&pads, Seconds(0.0)).as_bytes(), clock.now());
    link
}

#[test]
fn a_relayed_switch_is_held_while_the_relay_is_heard() {
    let mut clock = WallClock::start();
    let steer = |link: &Link, silent_s| {
        let params = Params { silent_s, ..Params::default() };
        Gamepad::new(Source::relay(link.clone(), clock), &params, 1.0, TICK)
    };
    let (live, stale, over) = (relayed(clock), relayed(clock), relayed(clock));
    let mut pad = steer(&live, 5.0);
    assert_eq!(pad.switch(Seconds(0.0)), Switch::Held);
    let mut pad = steer(&over, 5.0);
    assert_eq!(pad.switch(Seconds(0.0)), Switch::Held);
    over.end("over", clock.now());
    // In the same tick, before the pad is known to be gone, and after.
    assert_eq!(pad.switch(Seconds(0.0)), Switch::Free);
    assert_eq!(pad.switch(Seconds(0.02)), Switch::Free);
    let mut pad = steer(&stale, 0.05);
    clock.wait_until(clock.now() + Seconds(0.06));
    assert_eq!(pad.switch(Seconds(0.0)), Switch::Free);
    let mut none = Gamepad::new(Source::nothing("no way"), &Params::default(), 1.0, TICK);
    assert_eq!(none.switch(Seconds(0.0)), Switch::Free);
}

#[test]
fn wrong_parameters_are_told_with_what_is_allowed() {
    let told = |params: &Params| {
        let mut faults = Vec::new();
        params.check(&mut Checker::new(&mut faults));
        faults.iter().map(|f| format!("{}: {}", f.key, f.allowed)).collect::<Vec<_>>().join("\n")
    };
    assert_eq!(told(&Params::default()), "");
    let same = Map { stop: Some(Button::Start), ..Map::default() };
    let good = "030000005e0400008e02000014010000,Xbox,a:b0,leftx:a0,platform:Linux,";
    let params = Params {
        map: same,
        sdl_mappings: vec![good.to_owned(), "Xbox,a:b0".to_owned()],
        shape: Shape { dead_zone: 1.0, ..Shape::default() },
        centre: f64::NAN,
        ..Params::default()
    };
    let told = told(&params);
    for words in
        ["map.stop: another button", "sdl_mappings: lines", "shape.dead_zone", "centre: 0.01"]
    {
        assert!(told.contains(words), "{words}: {told}");
    }
    assert_eq!(told.matches("sdl_mappings").count(), 1);
}
