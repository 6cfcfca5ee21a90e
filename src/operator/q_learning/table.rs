//! The table of values: a grid of cells, three throttles in each.

use super::Params;
use crate::plant::mountain_car;
use crate::signal::State;

/// A cell of the table it came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell(usize);

/// What the agent chooses from (4.2.1), the lowest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Throttle {
    /// Fully back, −1.
    Back,
    /// None, 0.
    Rest,
    /// Fully ahead, 1.
    Ahead,
}

impl Throttle {
    /// All of them, the lowest first.
    pub const ALL: [Self; 3] = [Self::Back, Self::Rest, Self::Ahead];

    /// Its part of the largest throttle.
    #[must_use]
    pub const fn part(self) -> f64 {
        match self {
            Self::Back => -1.0,
            Self::Rest => 0.0,
            Self::Ahead => 1.0,
        }
    }

    /// The throttle nearest to `part` of the largest one; halves count as rest.
    #[must_use]
    pub fn nearest(part: f64) -> Self {
        if part > 0.5 {
            Self::Ahead
        } else if part < -0.5 {
            Self::Back
        } else {
            Self::Rest
        }
    }
}

/// One axis of the grid.
#[derive(Clone, Copy, Debug)]
struct Axis {
    from: f64,
    length: f64,
    cells: f64,
}

impl Axis {
    fn new(from: f64, to: f64, cells: u32) -> Self {
        Self { from, length: to - from, cells: f64::from(cells) }
    }

    /// The cell that holds `at`; beyond the ends the last one on that side.
    #[inline]
    fn cell(self, at: f64) -> usize {
        let cell = (at - self.from) / self.length * self.cells;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within 0 and the number of cells"
        )]
        let cell = cell.clamp(0.0, self.cells - 1.0) as usize;
        cell
    }
}

/// Q: the value of each throttle in each cell.
#[derive(Clone, Debug)]
pub(super) struct Table {
    position: Axis,
    velocity: Axis,
    /// Cells along the velocity.
    row: usize,
    initial: f64,
    values: Vec<[f64; 3]>,
}

impl Table {
    pub(super) fn new(params: &Params, plant: &mountain_car::Params) -> Self {
        let (across, up) = (params.position_cells, params.velocity_cells);
        let cells = across as usize * up as usize;
        Self {
            position: Axis::new(plant.left_wall, plant.goal, across),
            velocity: Axis::new(-plant.speed_limit, plant.speed_limit, up),
            row: up as usize,
            initial: params.q_initial,
            values: vec![[params.q_initial; 3]; cells],
        }
    }

    #[inline]
    pub(super) fn cell(&self, state: &State) -> Cell {
        let &[x, v] = &state[..] else { return Cell(0) };
        Cell(self.position.cell(x) * self.row + self.velocity.cell(v))
    }

    pub(super) fn values(&self) -> &[[f64; 3]] {
        &self.values
    }

    #[inline]
    pub(super) fn value(&self, cell: Cell, throttle: Throttle) -> f64 {
        self.values[cell.0][throttle as usize]
    }

    /// The largest value in `cell`.
    #[inline]
    pub(super) fn most(&self, cell: Cell) -> f64 {
        let [back, rest, ahead] = self.values[cell.0];
        back.max(rest).max(ahead)
    }

    /// The throttle with that value, the lowest of equals.
    #[inline]
    pub(super) fn best(&self, cell: Cell) -> Throttle {
        let [back, rest, ahead] = self.values[cell.0];
        if ahead > back.max(rest) {
            Throttle::Ahead
        } else if rest > back {
            Throttle::Rest
        } else {
            Throttle::Back
        }
    }

    /// Whether no throttle has a larger value.
    #[inline]
    pub(super) fn is_best(&self, cell: Cell, throttle: Throttle) -> bool {
        self.value(cell, throttle) >= self.most(cell)
    }

    #[inline]
    pub(super) fn add(&mut self, cell: Cell, throttle: Throttle, change: f64) {
        self.values[cell.0][throttle as usize] += change;
    }

    /// The place of a value among all.
    #[inline]
    pub(super) const fn place(cell: Cell, throttle: Throttle) -> usize {
        cell.0 * Throttle::ALL.len() + throttle as usize
    }

    #[inline]
    pub(super) fn add_at(&mut self, place: usize, change: f64) {
        self.values.as_flattened_mut()[place] += change;
    }

    /// The values that are no longer the initial one, each after its place.
    pub(super) fn changed(&self) -> Vec<f64> {
        let initial = self.initial.to_bits();
        let mut changed = Vec::new();
        for (place, value) in self.values.as_flattened().iter().enumerate() {
            if value.to_bits() != initial {
                #[expect(clippy::cast_precision_loss, reason = "3 million values at most")]
                changed.extend([place as f64, *value]);
            }
        }
        changed
    }

    /// Becomes the table with these [`changed`](Self::changed) values; false, and nothing
    /// changes, where they are none of a table of this size.
    pub(super) fn recall(&mut self, changed: &[f64]) -> bool {
        let (pairs, rest) = changed.as_chunks::<2>();
        let fits = |[place, value]: &[f64; 2]| self.index(*place).is_some() && value.is_finite();
        if !rest.is_empty() || !pairs.iter().all(fits) {
            return false;
        }
        self.values.fill([self.initial; 3]);
        for [place, value] in pairs {
            if let Some(place) = self.index(*place) {
                self.values.as_flattened_mut()[place] = *value;
            }
        }
        true
    }

    fn index(&self, place: f64) -> Option<usize> {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "what was lost shows in the comparison"
        )]
        let index = Some(place as usize).filter(|index| *index as f64 == place);
        index.filter(|index| *index < self.values.as_flattened().len())
    }
}
