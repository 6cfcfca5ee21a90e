//! Hands on the mouse.
//!
//! The terminal's one reader feeds the [`Pointer`], and the [`Mouse`] samples it at each tick;
//! both must use the same clock. The pointer ends at the screen's edge, and with it its
//! velocity.

mod pointer;

use serde::{Deserialize, Serialize};

pub use pointer::{Grid, Pointer};

use super::shaping::{Shape, Shaper};
use super::{Badge, News, Operator, Practice, Switch, View};
use crate::check::{Check, Checker};
use crate::clock::{Clock, WallClock};
use crate::random::Place;
use crate::signal::{Action, Intent, Seconds, State};

/// What of the pointer steers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Steer {
    /// Its velocity is the force, as in the thesis.
    #[default]
    Velocity,
    /// Its position is where the plant is drawn to, by a spring and a damper.
    Position,
}

impl Steer {
    /// What it does, in words for the person.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Velocity => "the pointer's velocity is the force",
            Self::Position => "the plant is drawn to the pointer's place",
        }
    }
}

/// Along which side of the screen the pointer is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Along {
    /// To the right is positive.
    #[default]
    Horizontal,
    /// Up is positive.
    Vertical,
}

/// A button of the mouse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Button {
    /// Under the index finger of a right hand.
    #[default]
    Left,
    /// The wheel.
    Middle,
    /// The other one.
    Right,
}

impl Button {
    /// What keeps it held as the dead-man switch, for people.
    #[must_use]
    pub fn switch_name(self) -> String {
        let which = match self {
            Self::Left => "left",
            Self::Middle => "middle",
            Self::Right => "right",
        };
        format!("hold the {which} mouse button")
    }
}

/// The mouse's parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// What of the pointer steers.
    pub steer: Steer,
    /// Along which side of the screen.
    pub along: Along,
    /// The velocity that counts as full deflection, in screens per second.
    pub full_speed_screens_s: f64,
    /// The time over which velocity is measured, s.
    pub window_s: f64,
    /// Where the plant is drawn to with the pointer at the screen's edge, in the unit of the
    /// plant's position.
    pub reach: f64,
    /// The spring's part of the largest action per unit of distance,
    pub spring: f64,
    /// and the damper's per unit of velocity.
    pub damper: f64,
    /// Whether the pointer is hidden over the live screen, where the terminal can.
    pub hide_pointer: bool,
    /// The dead-man switch: real hardware moves only while this button is held.
    pub enable: Button,
    /// From the pointer's velocity or position to the action or place.
    pub shape: Shape,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            steer: Steer::default(),
            along: Along::default(),
            full_speed_screens_s: 1.5,
            window_s: 0.06,
            reach: 1.0,
            spring: 2.0,
            damper: 0.8,
            hide_pointer: true,
            enable: Button::default(),
            shape: Shape::default(),
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        c.range("full_speed_screens_s", self.full_speed_screens_s, 0.05..=50.0);
        c.range("window_s", self.window_s, 0.01..=0.5);
        c.range("reach", self.reach, 0.001..=1000.0);
        c.range("spring", self.spring, 0.0..=1000.0);
        c.range("damper", self.damper, 0.0..=1000.0);
        self.shape.check(&mut c.section("shape"));
    }
}

impl Params {
    /// The deflection that `pointer` stands for at `now`, −1 to 1; 0 before its first event.
    #[must_use]
    pub fn deflection(&self, pointer: &Pointer, now: Seconds) -> f64 {
        match self.steer {
            Steer::Velocity => {
                let velocity = pointer.velocity(self.along, now, Seconds(self.window_s));
                (velocity / self.full_speed_screens_s).clamp(-1.0, 1.0)
            }
            Steer::Position => pointer.place(self.along).unwrap_or(0.0),
        }
    }

    /// The part of the largest action, −1 to 1, that draws a plant in `state` to `target`. The
    /// first two numbers of every task's state are a position and its rate: the cart's in
    /// balance and swing-up, m; the ball's in speed-up, m, which a motor turns the beam for, so
    /// that it wants a soft spring; the car's in mountain car, whose valley lies left of 0.
    fn pull(&self, target: f64, state: &State) -> f64 {
        let &[position, rate, ..] = &state[..] else { return 0.0 };
        let pull = self.spring * (target - position) - self.damper * rate;
        if pull.is_nan() { 0.0 } else { pull.clamp(-1.0, 1.0) }
    }
}

/// The operator at the mouse: the [`Pointer`], sampled at each tick.
#[derive(Clone, Debug)]
pub struct Mouse {
    pointer: Pointer,
    clock: WallClock,
    params: Params,
    /// The largest action.
    limit: f64,
    /// Makes an action of a velocity, or a target of a position.
    shaper: Shaper,
    badge: Badge,
    /// The grid that the badge tells of.
    told: Option<Grid>,
}

impl Mouse {
    /// The mouse that moves `pointer`, whose events carry times of `clock`, for ticks of `tick`
    /// and actions up to ± `limit`.
    #[must_use]
    pub fn new(
        pointer: Pointer,
        clock: WallClock,
        params: &Params,
        limit: f64,
        tick: Seconds,
    ) -> Self {
        let full = match params.steer {
            Steer::Velocity => limit,
            Steer::Position => params.reach,
        };
        let shaper = Shaper::new(params.shape, full, tick);
        let badge = Badge::new("mouse");
        let mut mouse =
            Self { pointer, clock, params: params.clone(), limit, shaper, badge, told: None };
        mouse.tell();
        mouse
    }

    /// What the mouse says of itself.
    #[must_use]
    pub fn badge(&self) -> Badge {
        self.badge.clone()
    }

    /// Says how finely the pointer is known, and whether it was seen at all; returns the former
    /// if it is new.
    fn tell(&mut self) -> Option<String> {
        let is_seen = self.pointer.last_event().is_some();
        self.badge.set_state(if is_seen { "" } else { "not moved yet" });
        let grid = self.pointer.grid();
        if grid == self.told {
            return None;
        }
        self.told = grid;
        let words = format!("mouse, {}", grid?);
        self.badge.say(&words);
        Some(words)
    }

    /// The action at `now`, and the deflection that it comes from.
    fn steer(&mut self, state: &State, now: Seconds) -> (f64, f64) {
        let raw = self.params.deflection(&self.pointer, now);
        let shaped = self.shaper.shape(raw);
        let action = match self.params.steer {
            Steer::Velocity => shaped,
            // A pointer that nobody sees draws nowhere.
            Steer::Position if self.pointer.place(self.params.along).is_none() => 0.0,
            Steer::Position => self.limit * self.params.pull(shaped, state),
        };
        (action, raw)
    }
}

impl Operator for Mouse {
    /// A mouse that moves through the countdown goes on moving.
    fn begin(&mut self, _place: Place, _practice: Practice) {}

    /// Numbers mean more or less by how finely the pointer is known: `events.csv` has it.
    fn news(&mut self, _now: Seconds) -> Option<News> {
        self.tell().map(News::Remark)
    }

    fn switch(&mut self, _now: Seconds) -> Switch {
        Switch::of(self.pointer.is_held(self.params.enable))
    }

    fn switch_name(&self) -> Option<String> {
        Some(self.params.enable.switch_name())
    }

    fn intent(&mut self, view: View<'_>) -> Intent {
        let now = self.clock.now();
        let age = self.pointer.last_event().map_or(0.0, |at| (now - at).0.max(0.0));
        let (action, raw) = self.steer(view.state, now);
        Intent::Present { action: Action(action), raw: Some(raw), age: Seconds(age) }
    }

    fn tune(&mut self, sensitivity: f64) {
        self.shaper.set_sensitivity(sensitivity);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: Seconds = Seconds(0.02);

    fn mouse(params: &Params) -> Mouse {
        let pointer = Pointer::default();
        pointer.set_grid(Some(Grid::of(101, 101, None)));
        Mouse::new(pointer, WallClock::start(), params, 10.0, TICK)
    }

    fn still() -> State {
        State::from_slice(&[0.0; 4]).unwrap()
    }

    #[test]
    fn an_unseen_mouse_is_present_and_idle_in_either_way() {
        for steer in [Steer::Velocity, Steer::Position] {
            let mut mouse = mouse(&Params { steer, ..Params::default() });
            let away = State::from_slice(&[0.4, 0.1, 0.0, 0.0]).unwrap();
            let view = View { state: &away, now: Seconds(0.0), rollout_time: Seconds(0.0) };
            let intent = mouse.intent(view);
            assert_eq!((intent.action(), intent.raw()), (Action(0.0), Some(0.0)));
            assert_eq!(
                mouse.badge().words_now(),
                "mouse, pointer in cells (101 × 101), not moved yet"
            );
            mouse.pointer.moves_to(50, 50, mouse.clock.now());
            assert_eq!(mouse.news(Seconds(0.0)), None);
            assert_eq!(mouse.badge().words_now(), "mouse, pointer in cells (101 × 101)");
        }
    }

    #[test]
    fn another_grid_is_news() {
        let mut mouse = mouse(&Params::default());
        mouse.pointer.set_grid(Some(Grid::of(80, 24, Some((10, 20)))));
        let words = "mouse, pointer in pixels (800 × 480)".to_owned();
        assert_eq!(mouse.news(Seconds(0.0)), Some(News::Remark(words.clone())));
        assert_eq!(mouse.news(Seconds(0.0)), None);
        assert_eq!(mouse.badge().words(), words);
    }

    #[test]
    fn velocity_is_the_force_and_sensitivity_turns_it() {
        let mut mouse = mouse(&Params { full_speed_screens_s: 2.0, ..Params::default() });
        for k in 0..=10_u16 {
            mouse.pointer.moves_to(50 + k, 50 - k, Seconds(f64::from(k) * 0.01));
        }
        // A hundredth of the screen in 0.01 s.
        let (action, raw) = mouse.steer(&still(), Seconds(0.1));
        assert!((raw - 0.5).abs() < 1e-9 && (action - 5.0).abs() < 1e-6, "{raw} {action}");
        mouse.tune(0.5);
        assert!((mouse.steer(&still(), Seconds(0.1)).0 - 2.5).abs() < 1e-6);
        assert_eq!(mouse.steer(&still(), Seconds(1.0)), (0.0, 0.0));
        mouse.params.along = Along::Vertical;
        assert!((mouse.steer(&still(), Seconds(0.1)).1 - 0.5).abs() < 1e-9);
    }

    #[test]
    fn position_draws_the_plant_there_by_a_spring_and_a_damper() {
        let params = Params {
            steer: Steer::Position,
            reach: 2.0,
            spring: 0.5,
            damper: 0.25,
            ..Params::default()
        };
        let mut mouse = mouse(&params);
        mouse.pointer.moves_to(75, 50, Seconds(0.0));
        // Half the way to the edge is 1 m.
        assert_eq!(mouse.steer(&still(), Seconds(9.0)), (5.0, 0.5));
        let moving = State::from_slice(&[0.5, 1.0, 0.0, 0.0]).unwrap();
        assert_eq!(mouse.steer(&moving, Seconds(9.0)), (0.0, 0.5));
        let far = State::from_slice(&[-90.0, 0.0]).unwrap();
        assert_eq!(mouse.steer(&far, Seconds(9.0)).0, 10.0);
        let lost = State::from_slice(&[f64::NAN, 0.0]).unwrap();
        assert_eq!(mouse.steer(&lost, Seconds(9.0)).0, 0.0);
        assert_eq!(mouse.steer(&State::default(), Seconds(9.0)).0, 0.0);
    }

    /// A spring and a damper on a mass settle where the pointer is.
    #[test]
    fn a_mass_comes_to_rest_at_the_pointer() {
        let params = Params { steer: Steer::Position, ..Params::default() };
        let mut mouse = mouse(&params);
        mouse.pointer.moves_to(80, 50, Seconds(0.0));
        let (mut x, mut v) = (0.0, 0.0);
        for _ in 0..1000 {
            let state = State::from_slice(&[x, v]).unwrap();
            let (force, _) = mouse.steer(&state, Seconds(1.0));
            v += force * TICK.0;
            x += v * TICK.0;
        }
        assert!((x - 0.6).abs() < 1e-6 && v.abs() < 1e-6, "{x} {v}");
    }
}
