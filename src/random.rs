//! One seed, named streams.
//!
//! Every use of chance draws from a ChaCha stream of its own, named by what it is for and
//! by the rollout it is used in. A new use of chance therefore never shifts an old one,
//! and a resumed session needs no generator positions: the place in the plan is enough.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// What a stream of random numbers is for. The number is part of the stored sessions'
/// meaning: never change one, only add.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Purpose {
    /// Start states of the rollouts.
    Starts = 1,
    /// The plant's friction noise.
    Friction = 2,
    /// A simulated operator's personal traits.
    OperatorTraits = 3,
    /// A simulated operator's noise within a rollout.
    OperatorNoise = 4,
    /// Start states of evaluations, when they are random.
    EvaluationStarts = 5,
    /// The assignment of subjects to modes.
    Assignment = 6,
    /// Resampling for intervals.
    Bootstrap = 7,
    /// The faults of an emulated device and its wire.
    Wire = 8,
}

/// The place of a rollout within a session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// A small number for the phase.
    pub phase: u8,
    /// The rollout within the phase, from 1 (0: before any rollout).
    pub rollout: u32,
    /// How often this rollout was discarded before.
    pub attempt: u16,
}

/// The stream for `purpose` at `place` of the session seeded with `seed`.
#[must_use]
pub fn stream(seed: u64, purpose: Purpose, place: Place) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(
        u64::from(purpose as u8) << 56
            | u64::from(place.phase) << 48
            | u64::from(place.attempt) << 32
            | u64::from(place.rollout),
    );
    rng
}

/// A seed nobody chose, from the operating system.
///
/// # Errors
/// When the operating system offers no random numbers.
pub fn draw_seed() -> Result<u64, rand::rngs::SysError> {
    use rand::TryRng;
    // 53 bits, so that the seed survives every JSON reader.
    Ok(rand::rngs::SysRng.try_next_u64()? >> 11)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    #[test]
    fn streams_differ_by_purpose_and_place_and_repeat_by_seed() {
        let place = Place { phase: 2, rollout: 7, attempt: 0 };
        let first = |purpose, place| stream(9, purpose, place).next_u64();
        let base = first(Purpose::Starts, place);
        assert_eq!(base, first(Purpose::Starts, place));
        assert_ne!(base, first(Purpose::Friction, place));
        assert_ne!(base, first(Purpose::Starts, Place { rollout: 8, ..place }));
        assert_ne!(base, first(Purpose::Starts, Place { attempt: 1, ..place }));
        assert_ne!(base, stream(10, Purpose::Starts, place).next_u64());
    }
}
