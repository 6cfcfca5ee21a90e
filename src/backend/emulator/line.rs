//! One direction of the wire: bytes at the speed of the baud rate, and what goes wrong with
//! them.

use std::collections::VecDeque;

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;

use super::faults::Noise;
use crate::backend::wire::on_the_wire;
use crate::signal::Seconds;

/// One direction of the wire.
pub struct Line {
    byte: Seconds,
    noise: Noise,
    chance: ChaCha8Rng,
    /// When the last byte so far is through.
    free: Seconds,
    coming: VecDeque<(Seconds, u8)>,
    stalled_until: Seconds,
}

impl Line {
    /// A free line at `baud`.
    #[must_use]
    pub fn new(baud: u32, noise: Noise, chance: ChaCha8Rng) -> Self {
        let (byte, zero) = (on_the_wire(1, baud), Seconds(0.0));
        Self { byte, noise, chance, free: zero, coming: VecDeque::new(), stalled_until: zero }
    }

    /// Sends what one side writes at once, and returns when its last byte is through.
    pub fn send(&mut self, bytes: &[u8], now: Seconds) -> Seconds {
        if bytes.is_empty() {
            return self.free;
        }
        let noise = self.noise.clone();
        let mut start = if self.free > now { self.free } else { now };
        if self.happens(noise.delay) {
            start = start + Seconds(self.chance.random_range(0.0..=noise.longest_delay_s));
        }
        let cut = self.happens(noise.truncate);
        let len = if cut { self.chance.random_range(0..bytes.len()) } else { bytes.len() };
        self.free = start;
        for byte in &bytes[..len] {
            if self.happens(noise.drop) {
                continue;
            }
            let flip = if self.happens(noise.flip) { self.chance.random_range(0..8) } else { 8 };
            let sent = if flip < 8 { byte ^ 1_u8 << flip } else { *byte };
            let times = if self.happens(noise.duplicate) { 2 } else { 1 };
            for _ in 0..times {
                self.free = self.free + self.byte;
                self.coming.push_back((self.free, sent));
            }
        }
        self.free
    }

    /// Sends bytes of chance.
    pub fn send_garbage(&mut self, bytes: u32, now: Seconds) {
        let garbage: Vec<u8> =
            (0..bytes).map(|_| self.chance.next_u32().to_le_bytes()[0]).collect();
        self.send(&garbage, now);
    }

    /// The next byte that has arrived by `now`.
    pub fn receive(&mut self, now: Seconds) -> Option<u8> {
        if now < self.stalled_until {
            return None;
        }
        self.coming.pop_front_if(|(due, _)| *due <= now).map(|(_, byte)| byte)
    }

    /// Whether what was to be through at `through` has been handed out by `now`.
    #[must_use]
    pub fn is_through(&self, through: Seconds, now: Seconds) -> bool {
        through <= now && now >= self.stalled_until
    }

    /// Holds everything back until `until`.
    pub const fn stall(&mut self, until: Seconds) {
        self.stalled_until = until;
    }

    /// Loses everything on the way.
    pub fn cut(&mut self) {
        self.coming.clear();
    }

    fn happens(&mut self, probability: f64) -> bool {
        // Nothing is drawn for what never happens.
        probability > 0.0 && self.chance.random_bool(probability.min(1.0))
    }
}
