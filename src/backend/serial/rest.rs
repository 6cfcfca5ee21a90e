//! A hanging pole's rest, and its reading there.

use crate::signal::Seconds;

/// The pole's rest is measured over this many states,
const STATES: u32 = 1000;
/// or over at least this many
const STATES_AT_LEAST: u32 = 400;
/// once this time is over. At 50 Hz both come together; a faster device gives more states.
const LONG_ENOUGH: Seconds = Seconds(8.0);
/// A pole at rest stays within this part of a turn, half a degree,
const REST_TURNS: f64 = 0.5 / 360.0;
/// but is always allowed so many counts.
const REST_COUNTS: f64 = 4.0;
/// How long it must be at rest before the push.
pub(super) const REST: Seconds = Seconds(1.0);

/// A pole that hangs at rest, or begins anew.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    /// Counts of a full turn.
    turn: f64,
    /// The first reading and its time, and the latest time.
    first: Option<(i32, Seconds)>,
    now: Seconds,
    pub(super) count: u32,
    /// Of the readings' distances from the first one, counts.
    sum: f64,
    low: f64,
    high: f64,
    pub(super) was_disturbed: bool,
}

impl Rest {
    pub(super) const fn of(turn: f64) -> Self {
        Self {
            turn,
            first: None,
            now: Seconds(0.0),
            count: 0,
            sum: 0.0,
            low: 0.0,
            high: 0.0,
            was_disturbed: false,
        }
    }

    pub(super) const fn begin_anew(&mut self) {
        *self = Self { was_disturbed: true, ..Self::of(self.turn) };
    }

    pub(super) fn see(&mut self, reading: i32, now: Seconds) {
        let (first, _) = *self.first.get_or_insert((reading, now));
        let away = around(f64::from(reading) - f64::from(first), self.turn);
        self.now = now;
        self.count += 1;
        self.sum += away;
        self.low = self.low.min(away);
        self.high = self.high.max(away);
        if self.high - self.low > (REST_TURNS * self.turn).max(REST_COUNTS) {
            self.begin_anew();
        }
    }

    /// How long it has been at rest.
    pub(super) fn time(&self) -> Seconds {
        self.first.map_or(Seconds(0.0), |(_, since)| self.now - since)
    }

    /// Whether it moved a moment ago.
    pub(super) fn is_disturbed(&self) -> bool {
        self.was_disturbed && self.time() < REST
    }

    /// The mean reading, near the first one.
    pub(super) fn mean(&self) -> f64 {
        let first = self.first.map_or(0.0, |(first, _)| f64::from(first));
        first + self.sum / f64::from(self.count.max(1))
    }

    /// How much of the measurement is done, 0 to 1.
    pub(super) fn measured(&self) -> f64 {
        let count = f64::from(self.count);
        let in_time = (count / f64::from(STATES_AT_LEAST)).min(self.time().0 / LONG_ENOUGH.0);
        (count / f64::from(STATES)).max(in_time).clamp(0.0, 1.0)
    }
}

/// `counts` within half a turn of 0.
pub(super) fn around(counts: f64, turn: f64) -> f64 {
    counts - turn * (counts / turn).round()
}
