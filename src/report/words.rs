//! The words of each task: what its states, starts and actions are called, and their units.

use crate::signal::wrapped;
use crate::task::mountain_car::MountainCar;
use crate::task::speed_up::SpeedUp;
use crate::task::swing_up::SwingUp;

/// A quantity as figures show it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quantity {
    /// What it is.
    pub(super) label: &'static str,
    /// Its unit in figures,
    pub(super) unit: &'static str,
    /// and what one of the unit in files is in it.
    pub(super) factor: f64,
}

const fn quantity(label: &'static str, unit: &'static str, factor: f64) -> Quantity {
    Quantity { label, unit, factor }
}

const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// The two numbers of the state that tell most, in a phase portrait.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    /// The first one's place in the state, and what it is.
    pub(super) x: (usize, Quantity),
    /// The second one's.
    pub(super) y: (usize, Quantity),
    /// Whether the first is an angle that goes round.
    pub(super) goes_round: bool,
}

impl Plane {
    /// A state's point, in the units of figures.
    pub(super) fn point(&self, state: impl Fn(usize) -> f64) -> (f64, f64) {
        let (x, y) = (state(self.x.0), state(self.y.0));
        let x = if self.goes_round { wrapped(x) } else { x };
        (x * self.x.1.factor, y * self.y.1.factor)
    }
}

/// The plane of `task`'s phase portraits.
pub(super) fn plane(task: &str) -> Plane {
    let angle = (2, quantity("pole angle", "°", DEGREES));
    let rate = (3, quantity("pole angular velocity", "°/s", DEGREES));
    match task {
        SwingUp::NAME => Plane { x: angle, y: rate, goes_round: true },
        SpeedUp::NAME => Plane {
            x: (0, quantity("ball position", "m", 1.0)),
            y: (1, quantity("ball velocity", "m/s", 1.0)),
            goes_round: false,
        },
        MountainCar::NAME => Plane {
            x: (0, quantity("position", "", 1.0)),
            y: (1, quantity("velocity", "per step", 1.0)),
            goes_round: false,
        },
        _ => Plane { x: angle, y: rate, goes_round: false },
    }
}

/// What tells the starts of `task` apart.
pub(super) fn start(task: &str) -> Quantity {
    match task {
        SwingUp::NAME => quantity("push at the start", "°/s", DEGREES),
        SpeedUp::NAME => quantity("push at the start", "m/s", 1.0),
        MountainCar::NAME => quantity("start position", "", 1.0),
        _ => quantity("release angle", "°", DEGREES),
    }
}

/// The action on the plant of `task`.
pub(super) fn action(task: &str) -> Quantity {
    match task {
        SpeedUp::NAME => quantity("motor voltage", "V", 1.0),
        MountainCar::NAME => quantity("throttle", "", 1.0),
        _ => quantity("force on the cart", "N", 1.0),
    }
}

/// Words as in a heading.
pub(super) fn heading(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters.map(|c| if c == '_' { ' ' } else { c })).collect()
    })
}

/// The mean of what is called so.
pub(super) fn mean_of(label: &str) -> String {
    if label.starts_with("mean ") { label.to_owned() } else { format!("mean {label}") }
}

/// All of a count of things, one by one.
pub(super) fn each(count: usize, noun: &str) -> String {
    if count == 1 { format!("the one {noun}") } else { format!("each of {}", counted(count, noun)) }
}

/// A count with its noun.
pub(super) fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}
