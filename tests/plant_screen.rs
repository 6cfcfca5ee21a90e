//! The page of a real plant as it looks and as it is used, without a plant.

use coadapt::backend::safety::warden::{Fault, Standing};
use coadapt::backend::serial::calibration::Step;
use coadapt::backend::serial::desk::{Latency, View};
use coadapt::backend::serial::shelf::Uncalibrated;
use coadapt::backend::serial::standing::{NotArmed, Stage, Stopped};
use coadapt::backend::serial::station::{Calibrating, Duty, Grip, Look, Wish};
use coadapt::backend::wire::{Counts, Format, Outcome};
use coadapt::signal::{Seconds, State};
use coadapt::tui::keys::Action;
use coadapt::tui::palette::{Glyphs, Look as Seen, Palette};
use coadapt::tui::plant::{self, Badge, Facts, Pace, Page, Panel};
use proptest::prelude::*;
use ratatui::Terminal;
use ratatui::backend::TestBackend;

fn facts() -> Facts {
    Facts {
        port: "/dev/ttyUSB0".to_owned(),
        format: Format::Sensorsini31,
        switch: Some("hold L1".to_owned()),
        homing: true,
        soft_limit_m: 0.17,
        hard_limit_m: 0.188,
        half_track_m: Some(0.198),
    }
}

/// Ready, homed, calibrated and off; the pole hangs.
fn ready() -> View {
    let look = Look {
        device: "usb-FTDI_FT232R_USB_UART_A50285BI".to_owned(),
        stage: Stage::Ready,
        standing: Standing::Disarmed,
        stopped: Stopped::No,
        is_homed: true,
        is_stuck: false,
        calibrated: Ok("2026-03-14T09:26:53Z".to_owned()),
        duty: Duty::Rest,
        grip: Grip::Off,
        refused: None,
        latest: Some((State::new([0.053, 0.0, 3.12, -0.02]), Seconds(61.0))),
        states: 3_071,
        answered: 3_071,
        applied: 0.0,
        lost: 0,
        counts: Counts { good: 3_080, ..Counts::default() },
    };
    let latency = Latency { p50_us: 310, p99_us: 840, max_us: 2_115 };
    View { look, latency, not_kept: None, is_first: true }
}

fn with(change: impl FnOnce(&mut Look)) -> View {
    let mut view = ready();
    change(&mut view.look);
    view
}

fn calibrating(step: Step, progress: f64, prompt: &str) -> View {
    with(|look| {
        look.calibrated = Err(Uncalibrated::Never);
        look.duty = Duty::Calibrate(Calibrating { step, progress, prompt: prompt.to_owned() });
    })
}

fn latched(fault: Fault) -> View {
    with(|look| {
        look.standing = Standing::Latched(fault);
        look.stopped = Stopped::Confirmed;
        look.latest = Some((State::new([0.1921, 0.31, -2.4, 4.1]), Seconds(61.0)));
    })
}

fn gone() -> View {
    with(|look| {
        look.stage = Stage::Closed("the device is gone (unplugged): look at the cable".to_owned());
        look.standing = Standing::Latched(Fault::Stale(61.0));
        look.counts.checksum_errors = 3;
        look.lost = 2;
    })
}

/// All that a page shows, to be changed by a test.
struct Shown {
    view: View,
    facts: Facts,
    panel: Panel,
    is_running: bool,
    pace: Option<Pace>,
    help_open: bool,
    message: Option<&'static str>,
    look: Seen,
}

impl Shown {
    fn new(view: &View) -> Self {
        Self {
            view: view.clone(),
            facts: facts(),
            panel: Panel::default(),
            is_running: false,
            pace: Some(Pace { late: Seconds(0.000_12), missed: 0 }),
            help_open: false,
            message: None,
            look: Seen::default(),
        }
    }

    fn picture(&self, width: u16, height: u16) -> String {
        let page = Page {
            view: &self.view,
            facts: &self.facts,
            panel: &self.panel,
            is_running: self.is_running,
            pace: self.pace,
            help_open: self.help_open,
            message: self.message,
            look: self.look,
        };
        let Ok(mut terminal) = Terminal::new(TestBackend::new(width, height));
        let Ok(_) = terminal.draw(|frame| plant::draw(frame, &page));
        terminal.backend().to_string()
    }
}

fn drawn(view: &View, change: impl FnOnce(&mut Shown)) -> String {
    let mut shown = Shown::new(view);
    change(&mut shown);
    shown.picture(80, 24)
}

fn picture(view: &View) -> String {
    drawn(view, |_| ())
}

macro_rules! pictures {
    ($name:literal, $view:expr) => {
        pictures!($name, $view, |_: &mut Shown| ());
    };
    ($name:literal, $view:expr, $change:expr) => {
        let mut shown = Shown::new(&$view);
        $change(&mut shown);
        insta::assert_snapshot!(concat!("plant_", $name, "_80x24"), shown.picture(80, 24));
        insta::assert_snapshot!(concat!("plant_", $name, "_120x40"), shown.picture(120, 40));
    };
}

#[test]
fn a_plant_that_is_not_there_and_one_that_was() {
    let mut view = with(|look| {
        let why = "/dev/ttyUSB0 is not there: plug it in, and look at its power and its cable";
        look.stage = Stage::Closed(why.to_owned());
        (look.latest, look.states, look.answered) = (None, 0, 0);
        look.counts = Counts::default();
        look.is_homed = false;
    });
    view.latency = Latency::default();
    pictures!("absent", view, |shown: &mut Shown| shown.pace = None);
    pictures!("gone", gone());
}

#[test]
fn a_device_that_is_greeted() {
    let mut view = with(|look| {
        (look.stage, look.latest) = (Stage::Opening, None);
        (look.states, look.answered) = (0, 0);
    });
    view.latency = Latency::default();
    pictures!("greeting", view);
}

#[test]
fn a_device_that_was_never_calibrated_is_not_armed() {
    let mut view = with(|look| look.calibrated = Err(Uncalibrated::Never));
    pictures!("uncalibrated", view);
    view.look.refused = Some(NotArmed::Uncalibrated(Uncalibrated::Never));
    let picture = picture(&view);
    assert!(!picture.contains("Refused"), "said twice: {picture}");
}

#[test]
fn a_calibration_asks_measures_and_fails() {
    let view = calibrating(
        Step::MayPush,
        0.0,
        "Next the motor pushes the cart by some centimetres; see which way it goes.\n\
         Is the track clear?",
    );
    pictures!("question", view);
    let view = calibrating(
        Step::HangStill,
        0.37,
        "Let the pole hang and keep your hands off.\nIts angle at rest is being measured.",
    );
    pictures!("measuring", view);
    let view = calibrating(
        Step::Failed,
        0.0,
        "the cart did not move: is its supply on, does it run freely?",
    );
    insta::assert_snapshot!("plant_failed_80x24", picture(&view));
}

#[test]
fn homing_is_asked_for_and_cannot_be_stopped() {
    let view = with(|look| look.is_homed = false);
    let not_homed = picture(&view);
    assert!(not_homed.contains("[HOME]") && !not_homed.contains("CALIBRATE"), "{not_homed}");
    insta::assert_snapshot!("plant_not_homed_80x24", not_homed);
    let needless = drawn(&view, |shown| shown.facts.homing = false);
    assert!(needless.contains("calibrated ✓ → [ARM]"), "{needless}");
    let mut panel = Panel::default();
    assert_eq!(panel.key(Action::Home, &view.look), []);
    let asked = drawn(&view, |shown| shown.panel = panel);
    insta::assert_snapshot!("plant_may_home_80x24", asked);
    let view = with(|look| {
        (look.stage, look.is_homed) = (Stage::Homing, false);
    });
    pictures!("homing", view);
}

#[test]
fn a_motor_that_is_off_and_one_that_is_armed() {
    pictures!("off", ready());
    let mut view = with(|look| look.standing = Standing::Armed);
    pictures!("armed", view);
    view.look.grip = Grip::LeftOn;
    let told = picture(&view);
    assert!(
        told.contains("Let go of the switch") && told.contains("since before arming"),
        "{told}"
    );
    view.look.grip = Grip::On;
    pictures!("hand_on", view);
    view.look.latest = Some((State::new([-0.174, -0.2, 0.09, 0.42]), Seconds(62.0)));
    view.look.duty = Duty::Follow;
    pictures!("running", view, |shown: &mut Shown| shown.is_running = true);
}

#[test]
fn a_fault_and_a_stop_that_nobody_confirms() {
    pictures!("fault", latched(Fault::Position(0.1921)));
    let mut view = latched(Fault::Stale(61.0));
    view.look.stopped = Stopped::Unconfirmed;
    pictures!("unconfirmed", view);
}

#[test]
fn a_cart_that_is_stuck_while_it_homes_is_told_with_what_to_do() {
    let view = with(|look| {
        look.stage = Stage::Homing;
        look.is_stuck = true;
        look.stopped = Stopped::Confirmed;
    });
    let picture = picture(&view);
    assert!(picture.contains("HOMING DOES NOT END: switch the motor's supply off."), "{picture}");
    assert!(picture.contains("MOVES by itself"), "{picture}");
    assert!(!picture.contains("stop confirmed"), "{picture}");
}

#[test]
fn the_bar_of_a_calibration_hides_no_key() {
    let picture = picture(&calibrating(Step::Steady, 0.4, "Hold the pole still."));
    let line = |words: &str| picture.lines().find(|line| line.contains(words)).unwrap().to_owned();
    assert!(line("40 %").contains("█████"), "{picture}");
    assert!(line("arm the motor").contains("end the calibration"), "{picture}");
    assert!(!line("arm the motor").contains('█'), "{picture}");
}

#[test]
fn a_motor_that_nobody_can_reach_is_told_whatever_else_is() {
    let view = View { look: Look { stopped: Stopped::Unconfirmed, ..gone().look }, ..gone() };
    let picture = picture(&view);
    assert!(picture.contains("STOP NOT CONFIRMED: switch the motor's supply off"), "{picture}");
    assert!(picture.contains("may be ON"), "{picture}");
}

#[test]
fn what_is_wrong_besides_is_told() {
    let mut view = ready();
    view.not_kept =
        Some("the calibration could not be kept: cannot write /nowhere: no such folder".to_owned());
    view.look.refused = Some(NotArmed::Unguarded);
    let picture = picture(&view);
    assert!(picture.contains("Refused: the motor's guard is not there"), "{picture}");
    assert!(picture.contains("could not be kept: cannot write /nowhere"), "{picture}");
    assert!(picture.contains("NOT KEPT"), "{picture}");
}

#[test]
fn why_arming_was_refused_is_told_beside_a_stop_and_once() {
    let mut view = latched(Fault::Stale(61.0));
    view.look.refused = Some(NotArmed::Fault(Fault::Stale(61.0)));
    for stopped in [Stopped::Confirmed, Stopped::Unconfirmed] {
        view.look.stopped = stopped;
        let twice = picture(&view);
        assert!(!twice.contains("Refused"), "{twice}");
    }
    view.look.standing = Standing::Disarmed;
    for refused in [NotArmed::Moving, NotArmed::Device(Outcome::Estop)] {
        view.look.refused = Some(refused);
        let picture = picture(&view);
        assert!(picture.contains(&format!("Refused: {refused}")), "{picture}");
        assert!(picture.contains("STOP NOT CONFIRMED"), "{picture}");
    }
}

#[test]
fn plain_letters_and_no_colour_are_enough() {
    let look = Seen { glyphs: Glyphs::Ascii, palette: Palette::Plain };
    let picture = drawn(&latched(Fault::Position(0.1921)), |shown| shown.look = look);
    assert!(picture.is_ascii(), "{picture}");
    insta::assert_snapshot!("plant_ascii_80x24", picture);
}

#[test]
fn its_keys_are_explained() {
    let help = drawn(&ready(), |shown| shown.help_open = true);
    insta::assert_snapshot!("plant_help_80x24", help);
    let message = "q again ends the session; any other key goes on";
    let asked = drawn(&ready(), |shown| shown.message = Some(message));
    assert!(asked.contains(message), "{asked}");
}

#[test]
fn keys_wish_for_what_their_words_say() {
    let mut panel = Panel::default();
    let mut wishes = |action, view: &View| panel.key(action, &view.look);
    let armed = with(|look| look.standing = Standing::Armed);
    assert_eq!(wishes(Action::Arm, &ready()), [Wish::Arm]);
    assert_eq!(wishes(Action::Arm, &armed), [Wish::Disarm]);
    assert_eq!(wishes(Action::Calibrate, &ready()), [Wish::Calibrate]);
    assert_eq!(wishes(Action::Clear, &latched(Fault::Stopped)), [Wish::Clear]);
    // Nothing was asked.
    assert_eq!(wishes(Action::Yes, &ready()), []);
    assert_eq!(wishes(Action::Clear, &ready()), []);

    let asks = calibrating(Step::WhichWay, 0.0, "Which way?");
    assert_eq!(wishes(Action::Yes, &asks), [Wish::Yes]);
    assert_eq!(wishes(Action::No, &asks), [Wish::No]);
    assert_eq!(wishes(Action::Clear, &asks), [Wish::Cancel]);
    assert_eq!(wishes(Action::Calibrate, &asks), [], "it would begin anew");
    let measures = calibrating(Step::HangStill, 0.3, "Wait.");
    assert_eq!(wishes(Action::Yes, &measures), []);
    let failed = calibrating(Step::Failed, 0.0, "failed");
    assert_eq!(wishes(Action::Calibrate, &failed), [Wish::Calibrate]);
    assert_eq!(wishes(Action::Clear, &failed), [Wish::Disarm]);
    assert_eq!(wishes(Action::Arm, &failed), [Wish::Disarm, Wish::Arm]);
}

#[test]
fn homing_begins_only_after_a_yes_to_its_own_question() {
    let mut panel = Panel::default();
    for answer in [Action::No, Action::Arm, Action::Plant, Action::Home] {
        assert_eq!(panel.key(Action::Home, &ready().look), []);
        assert!(panel.asks_home());
        panel.key(answer, &ready().look);
        if answer != Action::Home {
            assert_eq!(panel.key(Action::Yes, &ready().look), [], "after {answer:?}");
        }
    }
    assert_eq!(panel.key(Action::Yes, &ready().look), [Wish::Home]);
    assert_eq!(panel.key(Action::Yes, &ready().look), [], "once");
    // What happens meanwhile takes the question back.
    for view in [gone(), latched(Fault::Stopped), with(|look| look.standing = Standing::Armed)] {
        panel.key(Action::Home, &ready().look);
        panel.see(&view.look);
        assert_eq!(panel.key(Action::Yes, &ready().look), []);
        assert_eq!(panel.key(Action::Home, &view.look), []);
        assert!(!panel.asks_home());
    }
}

#[test]
fn the_page_opens_by_itself_once_for_each_trouble() {
    let mut panel = Panel::default();
    assert!(panel.is_open(), "a session begins with it");
    let latched = latched(Fault::Stopped);
    for trouble in [&latched, &gone()] {
        panel.see(&ready().look);
        panel.key(Action::Plant, &ready().look);
        panel.see(&ready().look);
        assert!(!panel.is_open());
        panel.see(&trouble.look);
        assert!(panel.is_open());
        panel.key(Action::Plant, &trouble.look);
        panel.see(&trouble.look);
        assert!(!panel.is_open(), "it stays closed once a person has closed it");
        panel.key(Action::Plant, &trouble.look);
    }
}

#[test]
fn the_scene_says_how_the_motor_stands() {
    let words = |view: &View| Badge::of(view, &facts()).words;
    let mut view = ready();
    assert_eq!(words(&view), "motor off: o arms it");
    view.look.standing = Standing::Armed;
    assert_eq!(words(&view), "motor ARMED: hold L1");
    view.look.grip = Grip::LeftOn;
    assert_eq!(words(&view), "motor ARMED: let go of the switch");
    view.look.grip = Grip::On;
    assert_eq!(words(&view), "motor ARMED, hand on");
    view.look.standing = Standing::Latched(Fault::Stopped);
    assert_eq!(words(&view), "motor STOPPED: o tells why");
    view.look.stopped = Stopped::Unconfirmed;
    assert!(words(&view).starts_with("STOP NOT CONFIRMED"));
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![any::<f64>(), -2.0..2.0, Just(f64::NAN), Just(f64::INFINITY), Just(0.0)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn no_size_and_no_state_breaks_it(
        (width, height) in (1..200_u16, 1..60_u16),
        numbers in prop::array::uniform5(any_number()),
        words in ".{0,200}",
        kind in 0..4_u8,
    ) {
        let [x, v, angle, turn, part] = numbers;
        let mut view = match kind {
            0 => calibrating(Step::Steady, part, &words),
            1 => gone(),
            2 => latched(Fault::Position(x)),
            _ => ready(),
        };
        view.look.latest = Some((State::new([x, v, angle, turn]), Seconds(part)));
        view.look.device.clone_from(&words);
        view.look.calibrated = Ok(words.clone());
        view.look.states = u64::MAX;
        view.latency.max_us = u64::MAX;
        let facts = Facts {
            port: words,
            soft_limit_m: x,
            hard_limit_m: v,
            half_track_m: (kind > 1).then_some(angle),
            ..facts()
        };
        for glyphs in [Glyphs::Braille, Glyphs::Half, Glyphs::Ascii] {
            let look = Seen { glyphs, ..Seen::default() };
            let shown = Shown { facts: facts.clone(), look, ..Shown::new(&view) };
            shown.picture(width, height);
        }
    }
}
