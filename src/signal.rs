//! What flows through the program: ticks, seconds, states, features, actions.
//!
//! Everything here has a fixed size, is `Copy` and lives on the stack, so that a control
//! tick never allocates and a snapshot is a plain copy.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

/// The number of control ticks since the session began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Tick(pub u64);

/// A span or point of time in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Seconds(pub f64);

impl std::ops::Add for Seconds {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl std::ops::Sub for Seconds {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl std::ops::Mul<f64> for Seconds {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self(self.0 * factor)
    }
}

/// Up to `CAPACITY` numbers on the stack; behaves like a slice of the numbers it holds.
///
/// States and features have different capacities and are therefore different types: one
/// cannot be passed for the other.
#[derive(Clone, Copy)]
pub struct Row<const CAPACITY: usize> {
    values: [f64; CAPACITY],
    len: u8,
}

impl<const CAPACITY: usize> Row<CAPACITY> {
    /// The most numbers that a row holds.
    pub const CAPACITY: usize = CAPACITY;

    /// The row of the given numbers; numbers beyond the capacity do not compile.
    #[must_use]
    pub const fn new<const N: usize>(numbers: [f64; N]) -> Self {
        const { assert!(N <= CAPACITY && CAPACITY < 256) };
        let mut values = [0.0; CAPACITY];
        let mut i = 0;
        while i < N {
            values[i] = numbers[i];
            i += 1;
        }
        #[expect(clippy::cast_possible_truncation, reason = "N <= CAPACITY < 256")]
        Self { values, len: N as u8 }
    }

    /// The row of a slice's numbers, or `None` when they are more than the capacity.
    #[must_use]
    pub fn from_slice(numbers: &[f64]) -> Option<Self> {
        let len = u8::try_from(numbers.len()).ok()?;
        let mut values = [0.0; CAPACITY];
        values.get_mut(..numbers.len())?.copy_from_slice(numbers);
        Some(Self { values, len })
    }

    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.iter().all(|value| value.is_finite())
    }
}

impl<const CAPACITY: usize> Default for Row<CAPACITY> {
    fn default() -> Self {
        Self { values: [0.0; CAPACITY], len: 0 }
    }
}

impl<const CAPACITY: usize> std::ops::Deref for Row<CAPACITY> {
    type Target = [f64];
    #[inline]
    fn deref(&self) -> &[f64] {
        &self.values[..usize::from(self.len)]
    }
}

impl<const CAPACITY: usize> PartialEq for Row<CAPACITY> {
    fn eq(&self, other: &Self) -> bool {
        self[..] == other[..]
    }
}

impl<const CAPACITY: usize> std::fmt::Debug for Row<CAPACITY> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self[..].fmt(f)
    }
}

impl<const CAPACITY: usize> Serialize for Row<CAPACITY> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self[..].serialize(serializer)
    }
}

impl<'de, const CAPACITY: usize> Deserialize<'de> for Row<CAPACITY> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers = Vec::<f64>::deserialize(deserializer)?;
        Self::from_slice(&numbers).ok_or_else(|| {
            serde::de::Error::invalid_length(numbers.len(), &"fewer numbers than the row holds")
        })
    }
}

/// A plant's state, in SI units, in the order of the plant's state columns.
pub type State = Row<4>;

/// What the learner sees of a state, in the order of the task's feature names.
pub type Features = Row<6>;

/// What a task counted in one rollout, in the order of its tally's names.
pub type Tallied = Row<4>;

/// `angle` within half a turn of 0, rad.
#[must_use]
pub fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

/// A plant's input in the plant's own unit (N for the cart-pole).
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Action(pub f64);

/// What an operator wants at this moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Intent {
    /// The operator is there. An idle hand is present with the value 0: an action like
    /// any other.
    Present {
        /// The shaped action, in the plant's unit.
        action: Action,
        /// The device's deflection that it was shaped from, −1 to 1, if there is a device.
        raw: Option<f64>,
        /// The time since the device last confirmed it.
        age: Seconds,
    },
    /// The device is gone, or silent beyond its limit: its part of u is 0 and the tick
    /// is not learned.
    #[default]
    Absent,
}

impl Intent {
    /// An action that the operator decided on at this very tick.
    #[must_use]
    pub const fn fresh(action: f64) -> Self {
        Self::Present { action: Action(action), raw: None, age: Seconds(0.0) }
    }

    /// The operator's part of the action: 0 when absent.
    #[must_use]
    pub const fn action(self) -> Action {
        match self {
            Self::Present { action, .. } => action,
            Self::Absent => Action(0.0),
        }
    }

    /// The device's deflection, if there is one.
    #[must_use]
    pub const fn raw(self) -> Option<f64> {
        match self {
            Self::Present { raw, .. } => raw,
            Self::Absent => None,
        }
    }

    /// Whether the operator is there.
    #[must_use]
    pub const fn is_present(self) -> bool {
        matches!(self, Self::Present { .. })
    }
}

/// Why a rollout ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// The plant left the allowed states.
    Failed,
    /// The rollout lasted as long as a rollout may.
    Cap,
    /// The task's goal was reached.
    Goal,
    /// The phase's time was over.
    Time,
    /// The session was ended in the middle of the rollout.
    Aborted,
    /// The rollout was thrown away and is repeated from the same start.
    Discarded,
}

impl End {
    /// The word in `episodes.csv`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Failed => "failed",
            Self::Cap => "cap",
            Self::Goal => "goal",
            Self::Time => "time",
            Self::Aborted => "aborted",
            Self::Discarded => "discarded",
        }
    }
}
