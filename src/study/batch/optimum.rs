//! The fewest steps in which a mountain car can reach its flag.
//!
//! Value iteration (Bellman 1957) of the steps that are left, on a grid of position × velocity
//! with linear interpolation between its points; then the car follows the best of the three
//! throttles step by step. Sweeps go through the grid in both directions in turn and use what
//! they have just found (Gauss–Seidel), so that few are needed.

use crate::operator::{Operator, Practice, View};
use crate::plant::mountain_car::{MountainCar, Params};
use crate::random::Place;
use crate::signal::Intent;

/// Points of the grid along position and velocity: finer ones find no fewer steps.
const POINTS: (usize, usize) = (1701, 701);
/// Sweeps, should the values not settle before.
const MOST_SWEEPS: usize = 500;
/// Values that change by less have settled, steps: the way that is best no longer changes.
const SETTLED: f64 = 0.1;
/// More than any way takes.
const FAR: f64 = 1e4;

/// The best policy that there is, as the grid shows it.
#[derive(Clone)]
pub(super) struct Optimum {
    plant: MountainCar,
    params: Params,
    points: (usize, usize),
    /// Steps that are left, velocity by velocity of one position after the other.
    left: Vec<f64>,
}

impl Optimum {
    /// The best policy for a car with the parameters `params`; none when `is_enough` says so in
    /// between.
    pub(super) fn find(params: &Params, is_enough: &dyn Fn() -> bool) -> Option<Self> {
        Self::on_grid(params, POINTS, is_enough)
    }

    fn on_grid(
        params: &Params,
        points: (usize, usize),
        is_enough: &dyn Fn() -> bool,
    ) -> Option<Self> {
        let mut optimum = Self {
            plant: MountainCar::new(params.clone()),
            params: params.clone(),
            points,
            left: vec![FAR; points.0 * points.1],
        };
        for sweep in 0..MOST_SWEEPS {
            let mut change = 0.0_f64;
            for step in 0..points.0 {
                // The flag is at the end: values spread from there.
                let column = if sweep % 2 == 0 { points.0 - 1 - step } else { step };
                change = change.max(optimum.sweep(column, sweep % 4 < 2));
            }
            if is_enough() {
                return None;
            }
            if change < SETTLED {
                break;
            }
        }
        Some(optimum)
    }

    /// Takes the values of one position anew; returns the largest change.
    fn sweep(&mut self, column: usize, is_upwards: bool) -> f64 {
        let rows = self.points.1;
        let x = self.position(column);
        let pull = self.plant.pull(x);
        let mut change = 0.0_f64;
        for step in 0..rows {
            let row = if is_upwards { step } else { rows - 1 - step };
            let value = self.best(pull, x, self.velocity(row)).1;
            let place = &mut self.left[column * rows + row];
            change = change.max((*place - value).abs());
            *place = value;
        }
        change
    }

    /// The best throttle, as a part of the largest, and the steps that are left with it.
    fn best(&self, pull: f64, x: f64, v: f64) -> (f64, f64) {
        if x >= self.params.goal {
            return (0.0, 0.0);
        }
        let limit = self.params.throttle_limit;
        let mut best = (0.0, f64::INFINITY);
        for part in [-1.0, 0.0, 1.0] {
            let (x, v) = self.plant.roll(pull, x, v, part * limit);
            let left = 1.0 + self.left(x, v);
            if left < best.1 {
                best = (part, left);
            }
        }
        best
    }

    /// The steps that are left at position `x` and velocity `v`.
    fn left(&self, x: f64, v: f64) -> f64 {
        if x >= self.params.goal {
            return 0.0;
        }
        let (columns, rows) = self.points;
        let (column, right) = place((x - self.params.left_wall) / self.length(), columns);
        let speed = self.params.speed_limit;
        let (row, up) = place((v + speed) / (2.0 * speed), rows);
        let at = column * rows + row;
        let here = self.left[at] * (1.0 - up) + self.left[at + 1] * up;
        let beside = self.left[at + rows] * (1.0 - up) + self.left[at + rows + 1] * up;
        here * (1.0 - right) + beside * right
    }

    fn length(&self) -> f64 {
        self.params.goal - self.params.left_wall
    }

    fn position(&self, column: usize) -> f64 {
        self.params.left_wall + self.length() * part(column, self.points.0)
    }

    fn velocity(&self, row: usize) -> f64 {
        self.params.speed_limit * (2.0 * part(row, self.points.1) - 1.0)
    }
}

impl Operator for Optimum {
    fn begin(&mut self, _place: Place, _practice: Practice) {}

    fn intent(&mut self, view: View<'_>) -> Intent {
        let &[x, v] = &view.state[..] else { return Intent::Absent };
        let (part, _) = self.best(self.plant.pull(x), x, v);
        Intent::fresh(part * self.params.throttle_limit)
    }
}

/// How far the point `index` of `points` is along an axis, 0 to 1.
fn part(index: usize, points: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "a few thousand points")]
    let part = index as f64 / (points - 1) as f64;
    part
}

/// The point below `part` of an axis with `points`, and how far it is to the next, 0 to 1.
fn place(part: f64, points: usize) -> (usize, f64) {
    #[expect(clippy::cast_precision_loss, reason = "a few thousand points")]
    let at = part.clamp(0.0, 1.0) * (points - 1) as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let below = (at as usize).min(points - 2);
    #[expect(clippy::cast_precision_loss, reason = "a few thousand points")]
    let rest = at - below as f64;
    (below, rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Plant;
    use crate::signal::{Seconds, State};

    /// The steps to the flag from `x` at rest, if it is reached.
    fn steps(optimum: &mut Optimum, x: f64) -> Option<u32> {
        let mut plant = MountainCar::new(Params::default());
        let mut state = State::new([x, 0.0]);
        (1..=500).find(|_| {
            let now = Seconds(0.0);
            let view = View { state: &state, now, rollout_time: now };
            let action = optimum.intent(view).action();
            state = plant.step(&state, action);
            state[0] >= 0.5
        })
    }

    #[test]
    fn a_car_at_rest_needs_104_steps_from_the_trained_start_and_fewer_from_the_wall() {
        let mut optimum = Optimum::on_grid(&Params::default(), (426, 176), &|| false).unwrap();
        let trained = steps(&mut optimum, -0.7).unwrap();
        assert!((104..=106).contains(&trained), "{trained}");
        assert!(steps(&mut optimum, -1.2).unwrap() < trained);
        assert!(Optimum::on_grid(&Params::default(), (10, 10), &|| true).is_none());
    }
}
