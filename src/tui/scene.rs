//! Pictures of the plants.

pub mod cart_pole;

use super::palette::Role;

/// What the squares at the ends of the track tell the person.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// The plant is free: steer.
    Go,
    /// The plant is held: wait.
    Wait,
}

impl Light {
    /// The word.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Go => " GO ",
            Self::Wait => "WAIT",
        }
    }

    /// The shape: solid to go, hatched to wait.
    #[must_use]
    pub const fn square(self) -> &'static str {
        match self {
            Self::Go => "████",
            Self::Wait => "▒▒▒▒",
        }
    }

    /// The colour's role.
    #[must_use]
    pub const fn role(self) -> Role {
        match self {
            Self::Go => Role::Go,
            Self::Wait => Role::Wait,
        }
    }
}
