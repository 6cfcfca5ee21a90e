//! Pictures of the plants.

pub mod ball_beam;
pub mod cart_pole;
pub mod mountain_car;
pub mod regions;

use super::canvas::Canvas;
use super::palette::Role;

/// A picture lower than this, in cells, is an ornament without words.
const ROOM_FOR_WORDS: u16 = 8;
/// A picture narrower than this, in cells, as well.
const ROOM_ACROSS: u16 = 44;

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

/// A square of two rows with its word below, its upper left cell at (`column`, `row`).
fn square(canvas: &mut Canvas, column: f64, row: f64, light: Light) {
    for row in [row, row + 1.0] {
        canvas.text(column, row, light.square(), light.role());
    }
    canvas.text(column, row + 2.0, light.word(), light.role());
}

/// The arrow that says where a speed leads; a dot where its digits say 0.
fn arrow(speed: f64, decimals: i32) -> &'static str {
    let least = 0.5 * 10_f64.powi(-decimals);
    match speed {
        _ if speed >= least => "→",
        _ if speed <= -least => "←",
        _ => "·",
    }
}

/// A word in a block: seen as a shape before it is read.
fn block(word: &str) -> String {
    format!("▐█{word}█▌")
}
