//! The run to both ends of the track and back to its middle.

/// The duty to the ends.
const FAST: f64 = 0.3;
/// The duty close to the middle.
const SLOW: f64 = 0.15;
/// From here on the last run is slow, counts.
const CLOSE: i32 = 200;
/// A cart that moves fewer counts than this in [`WATCH_US`] is at an end.
const STANDING: i32 = 16;
/// How long a movement is watched, µs.
const WATCH_US: u64 = 100_000;

/// A run under way.
#[derive(Clone, Debug)]
pub struct Homing {
    leg: Leg,
    watched_at: u64,
    watched: i32,
    /// The reading at the end where forward duty led.
    ahead: i32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Leg {
    Forward,
    Backward,
    Middle,
}

/// What to do now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Drive with this duty.
    Drive(f64),
    /// The cart stands in the middle.
    Done(Ends),
}

/// What was found: the readings of the ends, the encoder's sign turned if need be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ends {
    /// −1 where the encoder counts down as the motor pushes forward.
    pub direction: i8,
    /// The raw reading in the middle.
    pub middle: i32,
    /// Counts from the middle to an end.
    pub reach: i32,
}

impl Homing {
    /// A run that begins at `now`, µs, with the encoder at `position`.
    #[must_use]
    pub const fn new(now: u64, position: i32) -> Self {
        Self { leg: Leg::Forward, watched_at: now, watched: position, ahead: 0 }
    }

    /// What to do at `now` with the encoder at `position`. A cart that is stuck on its way to
    /// the middle is pushed for ever.
    pub fn step(&mut self, now: u64, position: i32) -> Step {
        match self.leg {
            Leg::Forward => {
                if self.stands(now, position) {
                    self.ahead = position;
                    self.leg = Leg::Backward;
                    return Step::Drive(-FAST);
                }
                Step::Drive(FAST)
            }
            Leg::Backward => {
                if self.stands(now, position) {
                    // From here on `watched` is the reading at the other end.
                    self.leg = Leg::Middle;
                    return Step::Drive(FAST);
                }
                Step::Drive(-FAST)
            }
            Leg::Middle => {
                let middle = self.watched.midpoint(self.ahead);
                let direction = if self.ahead < self.watched { -1 } else { 1 };
                let left = (middle - position) * direction;
                if left <= 1 {
                    let reach = (self.ahead - middle).abs();
                    let direction = if direction < 0 { -1 } else { 1 };
                    return Step::Done(Ends { direction, middle, reach });
                }
                Step::Drive(if left < CLOSE { SLOW } else { FAST })
            }
        }
    }

    /// Whether the cart has not moved since it was last watched.
    fn stands(&mut self, now: u64, position: i32) -> bool {
        if now < self.watched_at + WATCH_US {
            return false;
        }
        let moved = (position - self.watched).abs();
        self.watched_at = now;
        self.watched = position;
        moved < STANDING
    }
}
