//! What slows and blurs a person: delay lines, lags, wandering noise.
//!
//! Every part is sized for one tick and starts anew with each rollout; none allocates
//! after its construction.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

use crate::signal::Seconds;

/// The last rows of numbers, one a tick, for looking back.
#[derive(Clone, Debug)]
pub(super) struct DelayLine<const N: usize> {
    rows: Vec<[f64; N]>,
    newest: usize,
    empty: bool,
}

impl<const N: usize> DelayLine<N> {
    /// A line that can look back `ticks`.
    pub(super) fn reaching(ticks: f64) -> Self {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small count of ticks, at least 0"
        )]
        let rows = ticks.max(0.0).ceil() as usize + 2;
        Self { rows: vec![[0.0; N]; rows], newest: 0, empty: true }
    }

    /// Forgets everything: the next row is taken for the whole past.
    pub(super) fn clear(&mut self) {
        self.rows.fill([0.0; N]);
        self.empty = true;
    }

    pub(super) fn push(&mut self, row: [f64; N]) {
        if self.empty {
            self.rows.fill(row);
            self.empty = false;
        }
        self.newest = (self.newest + 1) % self.rows.len();
        self.rows[self.newest] = row;
    }

    /// The row pushed `ticks` before the newest, or the oldest one kept.
    pub(super) fn back(&self, ticks: usize) -> [f64; N] {
        let len = self.rows.len();
        self.rows[(self.newest + len - ticks.min(len - 1)) % len]
    }

    /// The row `ticks` before the newest, interpolated between its neighbours.
    pub(super) fn at(&self, ticks: f64) -> [f64; N] {
        let whole = ticks.floor();
        let part = ticks - whole;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small count of ticks; a negative one saturates to 0"
        )]
        let index = whole as usize;
        let (newer, older) = (self.back(index), self.back(index + 1));
        std::array::from_fn(|i| newer[i] + (older[i] - newer[i]) * part)
    }

    /// All that it remembers, the oldest first.
    pub(super) fn numbers(&mut self) -> impl Iterator<Item = &mut f64> {
        let len = self.rows.len();
        self.rows.rotate_left((self.newest + 1) % len);
        self.newest = len - 1;
        self.empty = false;
        self.rows.as_flattened_mut().iter_mut()
    }
}

/// A lag of first order: the output follows the input with a time constant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lag {
    gain: f64,
    value: f64,
}

impl Lag {
    /// A lag at rest; a time constant of 0 follows at once.
    pub(super) fn new(time_constant: f64, tick: Seconds) -> Self {
        Self { gain: 1.0 - decay(time_constant, tick), value: 0.0 }
    }

    pub(super) fn follow(&mut self, input: f64) -> f64 {
        self.value += self.gain * (input - self.value);
        self.value
    }

    /// All that it remembers.
    pub(super) const fn number(&mut self) -> &mut f64 {
        &mut self.value
    }
}

/// Noise with a memory (Ornstein–Uhlenbeck), of unit standard deviation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wander {
    keep: f64,
    value: f64,
}

impl Wander {
    /// No noise yet; a correlation time of 0 makes it white.
    pub(super) fn still(correlation_time: f64, tick: Seconds) -> Self {
        Self { keep: decay(correlation_time, tick), value: 0.0 }
    }

    /// Noise from now on, in its stationary state.
    pub(super) fn restart(&mut self, rng: &mut impl Rng) {
        self.value = normal(rng);
    }

    pub(super) fn next(&mut self, rng: &mut impl Rng) -> f64 {
        self.value = self.keep * self.value + (1.0 - self.keep * self.keep).sqrt() * normal(rng);
        self.value
    }

    /// All that it remembers.
    pub(super) const fn number(&mut self) -> &mut f64 {
        &mut self.value
    }
}

/// A draw from the standard normal distribution.
pub(super) fn normal(rng: &mut impl Rng) -> f64 {
    rng.sample(StandardNormal)
}

/// What is left of a disturbance after a tick.
fn decay(time_constant: f64, tick: Seconds) -> f64 {
    if time_constant > 0.0 { (-tick.0 / time_constant).exp() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Place, Purpose, stream};

    const TICK: Seconds = Seconds(0.02);

    #[test]
    fn a_delay_line_interpolates_between_ticks_and_starts_filled() {
        let mut line = DelayLine::<1>::reaching(3.5);
        line.push([7.0]);
        assert_eq!(line.at(3.5), [7.0]);
        for k in 0..10 {
            line.push([f64::from(k)]);
        }
        assert_eq!(line.at(0.0), [9.0]);
        assert_eq!(line.at(2.0), [7.0]);
        assert!((line.at(3.5)[0] - 5.5).abs() < 1e-12);
        line.clear();
        line.push([1.0]);
        assert_eq!(line.at(3.5), [1.0]);
    }

    #[test]
    fn a_lag_covers_63_percent_in_its_time_constant() {
        let mut lag = Lag::new(0.1, TICK);
        let after: f64 = (0..5).map(|_| lag.follow(1.0)).last().unwrap();
        assert!((after - (1.0 - (-1.0_f64).exp())).abs() < 1e-12, "{after}");
        assert_eq!(Lag::new(0.0, TICK).follow(3.0), 3.0);
    }

    #[test]
    fn wandering_noise_has_unit_spread_and_the_named_memory() {
        let mut rng = stream(1, Purpose::OperatorNoise, Place::default());
        let mut wander = Wander::still(0.15, TICK);
        wander.restart(&mut rng);
        let draws: Vec<f64> = (0..200_000).map(|_| wander.next(&mut rng)).collect();
        let mean = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
            sum / count
        };
        let variance = mean(&mut draws.iter().map(|x| x * x));
        let lagged = mean(&mut draws.windows(2).map(|pair| pair[0] * pair[1]));
        assert!((variance - 1.0).abs() < 0.1, "{variance}");
        assert!((lagged / variance - (-0.02_f64 / 0.15).exp()).abs() < 0.01);
    }
}
