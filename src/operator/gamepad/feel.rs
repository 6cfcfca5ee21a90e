//! What the pad lets the hand feel: the plant let go, the end of the track, the robot's share.

use super::Rumble;
use crate::operator::Feedback;
use crate::signal::Seconds;

/// Something to be felt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feel {
    /// A pulse.
    Pulse {
        /// How strong, 0 to 1.
        strength: f64,
        /// How long.
        lasting: Seconds,
    },
    /// From now on a steady shaking.
    Steady {
        /// How strong, 0 to 1; 0 is none.
        strength: f64,
    },
}

/// The pulse of a plant that is let go,
const RELEASE: Seconds = Seconds(0.1);
/// and that of one that ran into the end of its track.
const TRACK_END: Seconds = Seconds(0.3);
/// A share that changed by less is not felt anew.
const STEP: f64 = 0.02;

/// Decides what is felt and when.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    rumble: Rumble,
    is_released: bool,
    /// The strength of the steady shaking that was asked for last.
    steady: f64,
}

impl Touch {
    /// A hand that feels what `rumble` names.
    #[must_use]
    pub const fn new(rumble: Rumble) -> Self {
        Self { rumble, is_released: false, steady: 0.0 }
    }

    /// A rollout is about to begin, with a countdown or without.
    pub fn begin(&mut self) {
        self.is_released = false;
    }

    /// What is felt as the plant goes, at `rollout_time`: negative in the countdown.
    pub fn released(&mut self, rollout_time: Seconds) -> Option<Feel> {
        let is_first = rollout_time.0 >= 0.0 && !self.is_released;
        self.is_released |= is_first;
        (is_first && self.rumble.release).then_some(self.pulse(RELEASE))
    }

    /// What is felt after a tick.
    pub fn told(&mut self, feedback: &Feedback<'_>) -> [Option<Feel>; 2] {
        let rumble = self.rumble;
        let pulse = (feedback.bumped && rumble.track_end).then_some(self.pulse(TRACK_END));
        let goes_on = rumble.share && feedback.end.is_none();
        let robot = if goes_on { (1.0 - feedback.share).clamp(0.0, 1.0) } else { 0.0 };
        [pulse, self.steady(robot * rumble.strength)]
    }

    /// What is felt once nobody is at the controls: nothing any more.
    pub fn rest(&mut self) -> Option<Feel> {
        self.steady(0.0)
    }

    fn steady(&mut self, strength: f64) -> Option<Feel> {
        let is_new =
            (strength - self.steady).abs() >= STEP || (strength == 0.0 && self.steady > 0.0);
        is_new.then(|| {
            self.steady = strength;
            Feel::Steady { strength }
        })
    }

    const fn pulse(&self, lasting: Seconds) -> Feel {
        Feel::Pulse { strength: self.rumble.strength, lasting }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Action, End, State};

    fn told(touch: &mut Touch, share: f64, bumped: bool, end: Option<End>) -> [Option<Feel>; 2] {
        let state = State::default();
        let applied = Action(0.0);
        let (state, next) = (&state, &state);
        touch.told(&Feedback {
            state,
            applied,
            reward: 0.0,
            next,
            end,
            share,
            bumped,
            is_frozen: false,
        })
    }

    #[test]
    fn nothing_is_felt_unless_the_profile_names_it() {
        let mut touch = Touch::new(Rumble::default());
        touch.begin();
        assert_eq!(touch.released(Seconds(0.0)), None);
        assert_eq!(told(&mut touch, 0.0, true, None), [None, None]);
    }

    #[test]
    fn the_release_is_felt_once_a_rollout_and_not_in_the_countdown() {
        let mut touch = Touch::new(Rumble { release: true, ..Rumble::default() });
        let pulse = Some(Feel::Pulse { strength: 0.5, lasting: RELEASE });
        for _ in 0..2 {
            touch.begin();
            assert_eq!(touch.released(Seconds(-0.02)), None);
            assert_eq!(touch.released(Seconds(0.0)), pulse);
            assert_eq!(touch.released(Seconds(0.02)), None);
        }
    }

    #[test]
    fn the_robots_share_is_felt_in_steps_and_ends_with_the_rollout() {
        let mut touch = Touch::new(Rumble { share: true, track_end: true, ..Rumble::default() });
        assert_eq!(told(&mut touch, 1.0, false, None), [None, None]);
        let steady = |strength| Some(Feel::Steady { strength });
        assert_eq!(told(&mut touch, 0.5, false, None), [None, steady(0.25)]);
        assert_eq!(told(&mut touch, 0.49, false, None), [None, None]);
        let pulse = Some(Feel::Pulse { strength: 0.5, lasting: TRACK_END });
        assert_eq!(told(&mut touch, 0.49, true, Some(End::Failed)), [pulse, steady(0.0)]);
        assert_eq!(touch.rest(), None);
    }
}
