//! Wall and virtual time: the only room that reads a clock; the others are handed one.

use std::time::{Duration, Instant};

use crate::signal::Seconds;

/// A source of time that can be waited on.
pub trait Clock: Send {
    /// The time since the clock started.
    fn now(&self) -> Seconds;
    /// Returns at `deadline` or, when that has passed, at once; and tells when whatever was waited
    /// for was due. A device's clock waits for its next state, and at `deadline` one is expected.
    fn wait_until(&mut self, deadline: Seconds) -> Seconds;
    /// Whether the time is that of the wall, so that people and devices can take part.
    fn is_wall(&self) -> bool;
}

/// Real time, from a monotonic clock. Copies share their start.
#[derive(Clone, Copy, Debug)]
pub struct WallClock {
    start: Instant,
}

impl WallClock {
    /// A clock that starts at 0 now.
    #[must_use]
    #[expect(clippy::disallowed_methods, reason = "the room that reads the clock")]
    pub fn start() -> Self {
        Self { start: Instant::now() }
    }
}

impl Clock for WallClock {
    #[expect(clippy::disallowed_methods, reason = "the room that reads the clock")]
    fn now(&self) -> Seconds {
        Seconds(Instant::now().duration_since(self.start).as_secs_f64())
    }

    #[expect(clippy::disallowed_methods, reason = "the room that waits")]
    fn wait_until(&mut self, deadline: Seconds) -> Seconds {
        let left = deadline - self.now();
        if left.0 > 0.0 {
            std::thread::sleep(Duration::from_secs_f64(left.0));
        }
        deadline
    }

    fn is_wall(&self) -> bool {
        true
    }
}

/// Time that passes only when waited for: sessions run as fast as the machine goes.
#[derive(Clone, Copy, Debug, Default)]
pub struct VirtualClock {
    now: Seconds,
}

impl Clock for VirtualClock {
    fn now(&self) -> Seconds {
        self.now
    }

    fn wait_until(&mut self, deadline: Seconds) -> Seconds {
        if deadline > self.now {
            self.now = deadline;
        }
        deadline
    }

    fn is_wall(&self) -> bool {
        false
    }
}

/// What waiting for a tick's deadline brought.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wake {
    /// How long after its deadline the tick starts.
    pub lateness: Seconds,
    /// Ticks left out because their time had passed entirely.
    pub missed: u64,
}

/// Absolute deadlines t0 + k·period. A missed tick is counted and left out, never caught
/// up in a burst: a plant must not see several commands in a millisecond.
#[derive(Clone, Copy, Debug)]
pub struct Pacer {
    next: Seconds,
}

impl Pacer {
    /// Deadlines from now on.
    #[must_use]
    pub fn new(clock: &dyn Clock) -> Self {
        Self { next: clock.now() }
    }

    /// Waits for the next deadline; the one after it comes `period` later.
    pub fn wait(&mut self, clock: &mut dyn Clock, period: Seconds) -> Wake {
        let due = clock.wait_until(self.next);
        let late = (clock.now() - due).0.max(0.0);
        let missed = (late / period.0).floor();
        let lateness = Seconds(late - missed * period.0);
        self.next = due + period * (missed + 1.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a count of ticks, at least 0"
        )]
        Wake { lateness, missed: missed as u64 }
    }

    /// Goes on without waiting, and without anything missed.
    pub fn skip(&mut self, clock: &dyn Clock) -> Wake {
        self.next = clock.now();
        Wake::default()
    }
}

/// The processor time that this thread has used; none where the system does not tell.
#[must_use]
pub fn processor_time() -> Option<Seconds> {
    #[cfg(unix)]
    {
        let used = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        #[expect(clippy::cast_precision_loss, reason = "exact for two million years")]
        let (seconds, nanoseconds) = (used.tv_sec as f64, used.tv_nsec as f64);
        Some(Seconds(seconds + nanoseconds * 1e-9))
    }
    #[cfg(not(unix))]
    None
}

/// The date and time of the wall.
#[must_use]
pub fn today() -> jiff::Timestamp {
    jiff::Timestamp::now()
}

/// The date and time of the wall, to the millisecond, in UTC (RFC 3339).
#[must_use]
pub fn timestamp() -> String {
    today().strftime("%Y-%m-%dT%H:%M:%S%.3fZ").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadlines_are_absolute_and_missed_ticks_are_left_out() {
        let mut clock = VirtualClock::default();
        let period = Seconds(0.02);
        let mut pacer = Pacer::new(&clock);
        for k in 0..100 {
            let wake = pacer.wait(&mut clock, period);
            assert_eq!(wake.missed, 0);
            assert!((clock.now().0 - 0.02 * f64::from(k)).abs() < 1e-9);
        }
        clock.wait_until(clock.now() + Seconds(0.071));
        let wake = pacer.wait(&mut clock, period);
        assert_eq!(wake.missed, 2);
        assert!((wake.lateness.0 - 0.011).abs() < 1e-9, "{wake:?}");
        assert_eq!(pacer.wait(&mut clock, period).missed, 0);
    }
}
