//! A person's hand at the emulated plant.
//!
//! A real pole swings for minutes after homing, and nothing but a hand holds it upright. What is
//! done by hand takes its time here as there, so that the readings do not jump.

use std::f64::consts::PI;

use serde::Serialize;

use crate::signal::{Seconds, State, wrapped};

/// A hand turns a pole no faster than this, rad/s,
const TURN: f64 = 3.0;
/// and pushes a cart no faster than this, m/s.
const PUSH: f64 = 0.2;
/// From one step of the plant to the next.
const STEP: Seconds = Seconds(0.001);
/// A pole that was steadied is held until the cart is at rest, too;
const STEADIED: Seconds = Seconds(1.0);
/// one that is raised is held this long,
const HELD: Seconds = Seconds(3.0);
/// leaning so much, rad: nobody holds it better than within 2°.
const LEAN: f64 = 0.0175;

/// What a hand does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Hand {
    /// It brings the pole to hang at rest.
    Steady,
    /// It holds the pole upright for some seconds, and lets go.
    Raise,
    /// It moves the cart, where the motor is off.
    Push {
        /// How far, m; to the negative side if negative.
        by_m: f64,
    },
}

/// A hand at work.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Hold {
    /// The pole is led to this angle, and held there until then, once it is there.
    pole: Option<(f64, Option<Seconds>)>,
    /// The cart still has this way to go, m.
    cart: f64,
}

impl Hold {
    /// Begins what `hand` does.
    pub(super) const fn take(&mut self, hand: Hand) {
        match hand {
            Hand::Steady => self.pole = Some((PI, None)),
            Hand::Raise => self.pole = Some((LEAN, None)),
            Hand::Push { by_m } => self.cart = by_m,
        }
    }

    /// `state` as the hand leaves it, a step after the one before.
    pub(super) fn guide(
        &mut self,
        state: State,
        now: Seconds,
        reach_m: f64,
        is_driven: bool,
    ) -> State {
        let &[mut x, mut speed, mut theta, mut turn] = &state[..] else { return state };
        if let Some((target, until)) = self.pole {
            let left = wrapped(target - theta);
            let most = TURN * STEP.0;
            theta += left.clamp(-most, most);
            // The hand alone moves it: the plant adds nothing of its own.
            turn = 0.0;
            let is_there = left.abs() <= most;
            let hold = if target == PI { STEADIED } else { HELD };
            let until = until.or_else(|| is_there.then_some(now + hold));
            let is_over = until.is_some_and(|until| now >= until);
            self.pole = (!is_over).then_some((target, until));
        }
        if is_driven {
            self.cart = 0.0;
        }
        if self.cart != 0.0 {
            let way = self.cart.clamp(-PUSH * STEP.0, PUSH * STEP.0);
            let there = (x + way).clamp(-reach_m, reach_m);
            let is_over = (there - x - way).abs() > 1e-12 || way == self.cart;
            x = there;
            speed = 0.0;
            self.cart = if is_over { 0.0 } else { self.cart - way };
        }
        State::new([x, speed, theta, turn])
    }
}

#[cfg(test)]
mod tests {
    use super::super::rig::{Params, Rig};
    use super::*;

    fn rig(start: [f64; 4]) -> Rig {
        Rig::new(&Params { start, ..Params::default() }, 1)
    }

    /// How far the pole is from upright, rad.
    fn lean(rig: &Rig) -> f64 {
        wrapped(rig.state()[2]).abs()
    }

    #[test]
    fn a_swinging_pole_is_steadied_and_stays_so() {
        let mut rig = rig([0.0, 0.0, 2.0, 4.0]);
        assert!(rig.handle(Hand::Steady));
        for time in [1.0, 5.0] {
            rig.go(Seconds(time));
            assert!((lean(&rig) - PI).abs() < 0.01, "{:?}", rig.state());
            assert!(rig.state()[3].abs() < 0.05, "{:?}", rig.state());
        }
    }

    #[test]
    fn a_pole_is_held_upright_and_let_go() {
        let mut rig = rig([0.0, 0.0, PI, 0.0]);
        assert!(rig.handle(Hand::Raise));
        rig.go(Seconds(1.2));
        for tenth in 12..40_u8 {
            rig.go(Seconds(f64::from(tenth) / 10.0));
            assert!(lean(&rig) < 2_f64.to_radians(), "{:?}", rig.state());
        }
        rig.go(Seconds(6.0));
        assert!(lean(&rig) > 0.5, "it falls once it is let go: {:?}", rig.state());
    }

    #[test]
    fn readings_do_not_jump_under_a_hand() {
        let mut rig = rig([0.0, 0.0, 2.0, 4.0]);
        assert!(rig.handle(Hand::Steady) && rig.handle(Hand::Push { by_m: 0.1 }));
        let mut before = rig.state();
        for turn in 1..200_u8 {
            rig.go(Seconds(f64::from(turn) * 0.02));
            let now = rig.state();
            assert!((now[0] - before[0]).abs() < 0.01);
            assert!(wrapped(now[2] - before[2]).abs() < 0.3);
            before = now;
        }
    }

    #[test]
    fn a_cart_is_pushed_within_its_track_and_not_against_a_motor() {
        let mut rig = rig([0.0, 0.0, PI, 0.0]);
        assert!(rig.handle(Hand::Push { by_m: -0.05 }));
        rig.go(Seconds(1.0));
        assert!((rig.state()[0] + 0.05).abs() < 0.01, "{:?}", rig.state());
        assert!(rig.handle(Hand::Push { by_m: 9.0 }));
        rig.go(Seconds(5.0));
        assert!(rig.state()[0] <= 0.198 + 1e-9, "{:?}", rig.state());
        rig.drive(2000);
        assert!(!rig.handle(Hand::Push { by_m: 0.05 }));
        rig.drive(0);
        rig.go(Seconds(6.0));
        assert!(rig.handle(Hand::Push { by_m: -0.05 }));
    }
}
