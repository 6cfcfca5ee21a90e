//! Learning a pad's map by moving: the stick that steers, then a button for each purpose.
//!
//! A pure state machine. It hears what the pad does and asks for one thing after the other:
//!
//! ```text
//! steer ─▶ begin ─▶ pause ─▶ discard ─▶ stop ─▶ enable ─▶ done
//! ```
//!
//! An axis is taken once it went far out and came back to the middle: noise does not go far,
//! a trigger does not rest in the middle, and a throttle does not come back.

use std::collections::BTreeMap;

use super::{Axis, Button, Map};

/// An axis that was moved on purpose went at least this far from the middle,
const FAR: f64 = 0.6;
/// this much farther than every other one,
const CLEARLY: f64 = 0.2;
/// and came back to within this of it.
const BACK: f64 = 0.25;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Move the stick that steers to the right, and let it go.
    Steer,
    /// Press the button for this purpose: its place in [`Map::buttons`].
    Button(usize),
    /// Nothing more.
    Done,
}

/// How one axis has moved since the question.
#[derive(Clone, Copy, Debug)]
struct Travel {
    /// Where it is.
    at: f64,
    /// The farthest from the middle that it was, with its sign.
    peak: f64,
    /// Whether it was out when the question came, as a trigger is at rest.
    began_out: bool,
    /// Whether it was never seen on its way out: it tells where it rests, or has no between.
    jumped: bool,
    /// Whether it knows nothing between the middle and its ends, as a directional pad.
    is_digital: bool,
}

impl Travel {
    /// Asked anew while it is at `at`; an axis that never said anything is in the middle.
    fn from(at: f64) -> Self {
        Self { at, peak: 0.0, began_out: at.abs() > BACK, jumped: false, is_digital: true }
    }

    fn go(&mut self, to: f64) {
        self.jumped |= self.peak == 0.0 && to.abs() >= FAR;
        self.is_digital &= to == 0.0 || to.abs() > 0.999;
        if to.abs() > self.peak.abs() {
            self.peak = to;
        }
        self.at = to;
    }

    /// Whether it went far from the middle as a stick or a directional pad does.
    fn was_moved(&self) -> bool {
        self.peak.abs() >= FAR && !self.began_out && (!self.jumped || self.is_digital)
    }
}

/// The pupil.
#[derive(Clone, Debug)]
pub struct Learner {
    map: Map,
    invert: bool,
    step: Step,
    travels: BTreeMap<Axis, Travel>,
    /// The purposes that were answered: a kept one may still give way to a pressed one.
    pressed: [bool; 5],
    remark: Option<String>,
}

impl Learner {
    /// Learns what differs from `map` and `invert`, of a pad whose axes are at `axes` now;
    /// one that never said anything is `None`.
    pub fn new(
        map: Map,
        invert: bool,
        axes: impl IntoIterator<Item = (Axis, Option<f64>)>,
    ) -> Self {
        let travel = |(axis, at): (Axis, Option<f64>)| (axis, Travel::from(at.unwrap_or(0.0)));
        let travels = axes.into_iter().map(travel).collect();
        Self { map, invert, step: Step::Steer, travels, pressed: [false; 5], remark: None }
    }

    /// What is asked for now.
    #[must_use]
    pub const fn step(&self) -> Step {
        self.step
    }

    /// The map, as far as it is learned.
    #[must_use]
    pub const fn map(&self) -> &Map {
        &self.map
    }

    /// Whether the right is negative on the steering axis.
    #[must_use]
    pub const fn invert(&self) -> bool {
        self.invert
    }

    /// Why the last answer was not taken.
    #[must_use]
    pub fn remark(&self) -> Option<&str> {
        self.remark.as_deref()
    }

    /// The question, in words.
    #[must_use]
    pub fn question(&self) -> String {
        match self.step {
            Step::Steer => "move the stick that steers to the right, and let it go".to_owned(),
            Step::Button(at) => {
                let purpose = self.map.buttons().get(at).map_or("", |(purpose, _)| purpose);
                format!("press the button for {purpose}: {}", meaning(purpose))
            }
            Step::Done => "the map is complete".to_owned(),
        }
    }

    /// An axis moved to `value`.
    pub fn moved(&mut self, axis: Axis, value: f64) {
        if !value.is_finite() {
            return;
        }
        self.travels.entry(axis).or_insert_with(|| Travel::from(0.0)).go(value);
        if self.step == Step::Steer {
            self.settle();
        }
    }

    /// A button was pressed.
    pub fn press(&mut self, button: Button) {
        match self.step {
            Step::Steer => {
                self.remark = Some(format!("{button} is a button; only a stick can steer"));
            }
            Step::Button(at) => self.answer(at, Some(button), true),
            Step::Done => {}
        }
    }

    /// Keeps what the map had for the question, and goes on.
    pub fn keep(&mut self) {
        match self.step {
            Step::Steer => self.go_on(),
            Step::Button(at) => {
                let kept = self.map.buttons().get(at).and_then(|(_, button)| *button);
                self.answer(at, kept, false);
            }
            Step::Done => {}
        }
    }

    /// Leaves the purpose without a button, and goes on.
    pub fn leave_out(&mut self) {
        match self.step {
            Step::Steer => self.remark = Some("something has to steer; Esc keeps it".to_owned()),
            Step::Button(at) => self.answer(at, None, true),
            Step::Done => {}
        }
    }

    /// Takes the axis that was moved most, once it is back in the middle.
    fn settle(&mut self) {
        let mut moved: Vec<(Axis, Travel)> =
            self.travels.iter().filter(|(_, t)| t.was_moved()).map(|(a, t)| (*a, *t)).collect();
        moved.sort_by(|(_, a), (_, b)| b.peak.abs().total_cmp(&a.peak.abs()));
        // What went out and stays there is a throttle.
        let is_back = |(_, travel): &(Axis, Travel)| travel.at.abs() <= BACK;
        let Some((axis, travel)) = moved.iter().copied().find(is_back) else { return };
        let alike = |(other, second): &&(Axis, Travel)| {
            *other != axis && travel.peak.abs() - second.peak.abs() < CLEARLY && !second.is_digital
        };
        if let Some((other, _)) = moved.iter().find(alike) {
            // The next time one that is still out does not count.
            self.remark = Some(format!("{axis} and {other} moved alike: move one, straight"));
            self.forget();
            return;
        }
        self.map.steer = axis;
        self.invert = travel.peak < 0.0;
        self.go_on();
    }

    fn answer(&mut self, at: usize, button: Option<Button>, pressed: bool) {
        let buttons = self.map.buttons();
        let taken = buttons.iter().zip(self.pressed).enumerate().find(|(other, ((_, b), by))| {
            // A button that an unanswered purpose has by habit is free to be taken.
            *other != at && button.is_some() && *b == button && (*by || *other < at)
        });
        if let (Some(button), Some((_, ((purpose, _), _)))) = (button, taken) {
            self.remark = Some(format!(
                "{button} is for {purpose} already, and one press cannot mean two things: press \
                 another, or Delete for none"
            ));
            return;
        }
        if pressed {
            // Where a purpose to come had it by habit, it is asked for without one.
            for (later, (_, held)) in buttons.iter().enumerate().skip(at + 1) {
                if button.is_some() && *held == button {
                    self.put(later, None);
                }
            }
        }
        self.put(at, button);
        if let Some(answered) = self.pressed.get_mut(at) {
            *answered = true;
        }
        self.go_on();
    }

    const fn put(&mut self, at: usize, button: Option<Button>) {
        match at {
            0 => self.map.begin = button,
            1 => self.map.pause = button,
            2 => self.map.discard = button,
            3 => self.map.stop = button,
            _ => self.map.enable = button,
        }
    }

    fn go_on(&mut self) {
        self.remark = None;
        self.forget();
        self.step = match self.step {
            Step::Steer => Step::Button(0),
            Step::Button(at) if at + 1 < self.map.buttons().len() => Step::Button(at + 1),
            Step::Button(_) | Step::Done => Step::Done,
        };
    }

    /// Forgets how far the axes went.
    fn forget(&mut self) {
        for travel in self.travels.values_mut() {
            *travel = Travel::from(travel.at);
        }
    }

    /// The profile's keys with what was learned.
    #[must_use]
    pub fn sets(&self) -> Vec<(String, String)> {
        let word = |button: Option<Button>| {
            button.map_or_else(|| "None".to_owned(), |button| format!("Some({button})"))
        };
        let key = |name: &str| format!("operator.gamepad.{name}");
        let steer = (key("map.steer"), self.map.steer.to_string());
        let buttons = self.map.buttons().into_iter();
        let buttons = buttons.map(|(name, button)| (key(&format!("map.{name}")), word(button)));
        let invert = (key("shape.invert"), self.invert.to_string());
        std::iter::once(steer).chain(buttons).chain([invert]).collect()
    }
}

/// What a purpose of [`Map::buttons`] means.
#[must_use]
pub fn meaning(purpose: &str) -> &'static str {
    match purpose {
        "begin" => "go on, take over",
        "pause" => "pause, or go on",
        "discard" => "repeat this rollout",
        "stop" => "the emergency stop",
        _ => "a robot moves while it is held",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn learner(axes: &[(Axis, Option<f64>)]) -> Learner {
        Learner::new(Map::default(), false, axes.iter().copied())
    }

    /// An axis goes out to `peak` and back, as a stick does.
    fn swing(learner: &mut Learner, axis: Axis, peak: f64) {
        for part in [0.2, 0.5, 0.9, 1.0, 0.7, 0.3, 0.05, 0.0] {
            learner.moved(axis, peak * part);
        }
    }

    #[test]
    fn the_axis_that_went_out_and_came_back_steers_and_its_sign_counts() {
        let mut pupil = learner(&[(Axis::RightStickX, Some(0.02))]);
        swing(&mut pupil, Axis::RightStickX, -0.98);
        assert_eq!((pupil.map().steer, pupil.invert()), (Axis::RightStickX, true));
        assert_eq!(pupil.step(), Step::Button(0));
        let mut pupil = Learner::new(Map::default(), true, []);
        swing(&mut pupil, Axis::DPadX, 1.0);
        assert_eq!((pupil.map().steer, pupil.invert()), (Axis::DPadX, false));
    }

    #[test]
    fn noise_triggers_at_rest_and_throttles_do_not_win() {
        let mut pupil = learner(&[(Axis::LeftZ, Some(-1.0)), (Axis::RightZ, None)]);
        for n in 0..100 {
            pupil.moved(Axis::LeftStickY, if n % 2 == 0 { 0.1 } else { -0.1 });
        }
        // One at its end that is known, one that says so only now, another, no number.
        pupil.moved(Axis::LeftZ, -0.99);
        pupil.moved(Axis::RightZ, -1.0);
        pupil.moved(Axis::Code(40), 0.9);
        pupil.moved(Axis::Code(41), f64::NAN);
        assert_eq!(pupil.step(), Step::Steer);
        swing(&mut pupil, Axis::LeftStickX, 0.95);
        assert_eq!(pupil.map().steer, Axis::LeftStickX);
    }

    #[test]
    fn a_trigger_that_is_pulled_through_its_middle_does_not_win() {
        let mut pupil = learner(&[(Axis::LeftZ, Some(-1.0))]);
        for value in [-0.5, 0.0, 0.5, 1.0, 0.5, 0.1, -0.5, -1.0] {
            pupil.moved(Axis::LeftZ, value);
        }
        // The same of one that had not said where it rests.
        for value in [-0.95, -0.5, 0.0, 0.5, 1.0, 0.5, 0.1, -0.5, -1.0] {
            pupil.moved(Axis::RightZ, value);
        }
        assert_eq!(pupil.step(), Step::Steer, "{pupil:?}");
    }

    #[test]
    fn a_slanted_move_takes_the_greater_part_and_an_even_one_is_asked_again() {
        let mut pupil = learner(&[]);
        for part in [0.5, 1.0, 0.5, 0.0] {
            pupil.moved(Axis::LeftStickY, 0.3 * part);
            pupil.moved(Axis::LeftStickX, 0.95 * part);
        }
        assert_eq!(pupil.map().steer, Axis::LeftStickX);
        let mut pupil = learner(&[]);
        for part in [0.5, 1.0, 0.5, 0.0] {
            pupil.moved(Axis::RightStickX, 0.8 * part);
            pupil.moved(Axis::RightStickY, 0.75 * part);
        }
        assert_eq!(pupil.step(), Step::Steer);
        assert!(pupil.remark().is_some_and(|remark| remark.contains("moved alike")), "{pupil:?}");
        // A throttle that was pushed on the way is passed over the next time.
        for value in [0.3, 0.9] {
            pupil.moved(Axis::Code(9), value);
        }
        swing(&mut pupil, Axis::RightStickX, 0.95);
        assert!(pupil.remark().is_some_and(|remark| remark.contains("code(9)")), "{pupil:?}");
        swing(&mut pupil, Axis::RightStickX, 0.95);
        assert_eq!(pupil.map().steer, Axis::RightStickX);
    }

    #[test]
    fn a_directional_pad_has_no_way_between_and_can_steer() {
        let mut pupil = learner(&[]);
        pupil.moved(Axis::DPadX, -1.0);
        pupil.moved(Axis::DPadX, 0.0);
        assert_eq!((pupil.map().steer, pupil.invert()), (Axis::DPadX, true));
    }

    #[test]
    fn buttons_are_pressed_kept_or_left_out() {
        let mut pupil = learner(&[]);
        pupil.press(Button::South);
        assert!(pupil.remark().is_some_and(|remark| remark.contains("only a stick")));
        pupil.leave_out();
        assert_eq!(pupil.step(), Step::Steer);
        pupil.keep();
        assert!(pupil.question().contains("begin"));
        pupil.press(Button::South);
        pupil.keep();
        pupil.leave_out();
        pupil.press(Button::Code(12));
        pupil.press(Button::RightTrigger);
        assert_eq!(pupil.step(), Step::Done);
        let expected = Map {
            begin: Some(Button::South),
            discard: None,
            stop: Some(Button::Code(12)),
            enable: Some(Button::RightTrigger),
            ..Map::default()
        };
        assert_eq!(*pupil.map(), expected);
    }

    #[test]
    fn one_button_for_two_things_is_refused_with_words() {
        let mut pupil = learner(&[]);
        pupil.keep();
        pupil.press(Button::Select);
        // It was the pause's by habit, which has none now.
        assert_eq!(pupil.map().pause, None);
        pupil.press(Button::Select);
        assert_eq!(pupil.step(), Step::Button(1));
        let remark = pupil.remark().unwrap();
        assert!(remark.contains("select is for begin already"), "{remark}");
        pupil.press(Button::West);
        assert_eq!((pupil.step(), pupil.map().pause), (Step::Button(2), Some(Button::West)));
        assert_eq!(pupil.remark(), None);
    }

    #[test]
    fn a_pad_with_30_axes_is_learned_as_well() {
        let axes: Vec<(Axis, Option<f64>)> = (0..30).map(|n| (Axis::Code(n), None)).collect();
        let mut pupil = learner(&axes);
        for n in 0..30 {
            pupil.moved(Axis::Code(n), if n % 3 == 0 { -1.0 } else { 0.04 });
        }
        swing(&mut pupil, Axis::Code(17), -0.9);
        let sets = pupil.sets();
        assert_eq!(sets[0], ("operator.gamepad.map.steer".to_owned(), "code(17)".to_owned()));
        assert_eq!(sets[6].1, "true");
        assert_eq!(sets[1].1, "Some(start)");
    }

    #[test]
    fn what_is_learned_is_a_profile() {
        let mut pupil = learner(&[]);
        swing(&mut pupil, Axis::Code(3), 1.0);
        pupil.press(Button::Code(7));
        pupil.leave_out();
        pupil.keep();
        pupil.keep();
        pupil.keep();
        for (key, value) in pupil.sets().iter().filter(|(key, _)| key.contains("map.")) {
            let name = key.rsplit('.').next().unwrap();
            let map: Map = ron::from_str(&format!("({name}: {value})")).unwrap();
            assert_eq!(map.buttons().len(), 5);
        }
    }
}
