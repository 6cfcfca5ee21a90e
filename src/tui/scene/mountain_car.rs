//! The car in its valley, y = sin 3x (thesis section 4.2, eq. 30–31).
//!
//! Heights are drawn by a scale of their own, so that the valley fills a wide screen; the car
//! stands on the slope as it is drawn. The wall and the flag stand half a car beyond their
//! places, so that the car's nose touches them when its middle is there.

use super::{Light, ROOM_ACROSS, ROOM_FOR_WORDS, arrow, block};
use crate::tui::canvas::{Canvas, DOTS_ACROSS, Point};
use crate::tui::palette::Role;
use crate::tui::pen::Pen;
use crate::tui::text::{fixed, place as cells};

/// The task's measures; lengths have no unit in the thesis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Where the wall is.
    pub left: f64,
    /// From here on the car has arrived.
    pub goal: f64,
    /// The fastest that the car can be, a step.
    pub speed_limit: f64,
}

/// How many dots of the trail there are; they lie a step apart.
const TRAIL: u8 = 6;
/// Cells of the speed's bar, to each side.
const GAUGE: f64 = 12.0;

/// Where things are, in dots.
struct Place {
    /// Dots for 1 in x.
    across: f64,
    /// Where x = `left` is, in dots from the left.
    left: f64,
    from: f64,
    /// Dots for 1 in height.
    up: f64,
    /// The valley's floor.
    floor: f64,
    /// Half the line's thickness.
    line: f64,
    /// Half the car's length.
    half_car: f64,
    /// Where the flag's pole stands, in dots from the left, and how high it is.
    pole: f64,
    flag: f64,
}

impl Place {
    fn new(canvas: &Canvas, geometry: &Geometry) -> Self {
        let (width, height) = (canvas.width(), canvas.height());
        let half_car = (width / 18.0).min(height / 5.5).clamp(3.0, 16.0).round();
        let wall = (width / 40.0).clamp(2.0, 6.0).round();
        let flag = (0.3 * height).clamp(6.0, 36.0).round();
        let line = (height / 40.0).clamp(0.9, 2.2);
        let range = (geometry.goal - geometry.left).max(1e-3);
        let beyond = 0.75 * flag + 2.0;
        let across = ((width - wall - 2.0 * half_car - beyond) / range).max(1e-6);
        let floor = height - 2.0 * line;
        // The hill is 2 high. Above the goal there is room for the flag.
        let up = ((floor - flag - line) / 2.0).max(1.0);
        let left = wall + half_car;
        let pole = left + range * across + half_car;
        Self { across, left, from: geometry.left, up, floor, line, half_car, pole, flag }
    }

    fn column(&self, x: f64) -> f64 {
        self.left + (x - self.from) * self.across
    }

    /// The middle of the hill's line `dots` from the left.
    fn hill(&self, dots: f64) -> Point {
        // Beyond the flag the ground is level: nothing happens there.
        let x = self.from + (dots.min(self.pole) - self.left) / self.across;
        (dots, self.floor - (1.0 + (3.0 * x).sin()) * self.up)
    }
}

/// Draws the plant in `state` = `[x, v]`, v a step.
pub fn draw(pen: &mut Pen<'_>, geometry: &Geometry, state: &[f64], light: Light) {
    let &[x, speed, ..] = state else { return };
    if pen.width() < 8 || pen.height() < 4 {
        return;
    }
    if !(x.is_finite() && speed.is_finite()) {
        pen.centred(0, "the state is not a number", Role::Alarm);
        return;
    }
    let mut canvas = Canvas::new(pen.width(), pen.height(), pen.look.glyphs);
    let place = Place::new(&canvas, geometry);
    let has_words = pen.height() >= ROOM_FOR_WORDS && pen.width() >= ROOM_ACROSS;
    let has_arrived = x >= geometry.goal;
    trail(&mut canvas, &place, x, speed);
    flag(&mut canvas, &place, has_arrived);
    let car = Car::new(&place, x);
    car.body(&mut canvas);
    hill(&mut canvas, &place);
    car.wheels(&mut canvas);
    if has_words {
        words(&mut canvas, geometry, &place, speed, has_arrived);
        let row = f64::from(pen.height()) - 3.0;
        for column in [0.0, f64::from(pen.width()) - 4.0] {
            super::square(&mut canvas, column, row, light);
        }
    }
    canvas.draw(pen);
}

/// The hill from the wall to a little beyond the flag.
fn hill(canvas: &mut Canvas, place: &Place) {
    let wall = place.left - place.half_car;
    let end = canvas.width();
    let step = 2.0;
    for k in 0..cells((end - wall) / step) {
        let from = wall + step * f64::from(k);
        let (a, b) = (place.hill(from), place.hill((from + step).min(end)));
        canvas.capsule(a, b, place.line, Role::Text);
    }
    // The wall stands from above the car down to the foot of the hill.
    let foot = place.hill(wall).1;
    let top = (foot - 1.8 * place.half_car).max(0.0);
    let thick = (place.left - place.half_car).max(2.0);
    canvas.rectangle((wall - thick, top), (wall, foot + place.line), Role::Text);
}

/// The flag on its pole: a pennant while it is waited for, a large banner once it is reached.
fn flag(canvas: &mut Canvas, place: &Place, has_arrived: bool) {
    let x = place.pole;
    let foot = place.hill(x).1;
    let top = (foot - place.flag).max(0.0);
    canvas.rectangle((x, top), (x + 2.0, foot), Role::Text);
    let (left, length, height) = (x + 2.0, 0.7 * place.flag, 0.55 * place.flag);
    let (from, to) = ((left, top), (left + length, top + height));
    if has_arrived {
        canvas.rectangle(from, to, Role::Go);
    } else {
        canvas.fill(from, to, Role::Text, |(px, py)| {
            (py - top - height / 2.0).abs() <= height / 2.0 * (1.0 - (px - left) / length)
        });
    }
}

/// The car: both wheels on the slope, its body along them.
struct Car {
    rear: Point,
    front: Point,
    wheel: f64,
    half: f64,
}

impl Car {
    fn new(place: &Place, x: f64) -> Self {
        let half = place.half_car;
        let middle = place.column(x);
        let wheel = (0.24 * half).max(1.3);
        let on = |dots: f64| {
            let (a, b) = (place.hill(dots - 1.0), place.hill(dots + 1.0));
            let (dx, dy) = (b.0 - a.0, b.1 - a.1);
            let lift = (place.line + wheel) / dx.hypot(dy);
            let at = place.hill(dots);
            (at.0 + lift * dy, at.1 - lift * dx)
        };
        Self { rear: on(middle - 0.55 * half), front: on(middle + 0.55 * half), wheel, half }
    }

    fn body(&self, canvas: &mut Canvas) {
        let (rear, front, wheel, half) = (self.rear, self.front, self.wheel, self.half);
        let (dx, dy) = (front.0 - rear.0, front.1 - rear.1);
        let length = dx.hypot(dy).max(1e-6);
        let (cos, sin) = (dx / length, dy / length);
        let axle = (f64::midpoint(rear.0, front.0), f64::midpoint(rear.1, front.1));
        let is_car = |(x, y): Point| {
            // Along the car and up from its axles.
            let (u, v) = (x - axle.0, y - axle.1);
            let (u, v) = (u * cos + v * sin, u * sin - v * cos);
            let sill = 0.3 * wheel;
            let is_body = u.abs() <= half && (sill..=sill + 0.42 * half).contains(&v);
            let is_cabin = u.abs() <= (0.95 * half - 0.55 * v).min(0.6 * half)
                && (0.0..=sill + 0.82 * half).contains(&v);
            is_body || is_cabin
        };
        let reach = 1.5 * half + wheel;
        let from = (axle.0 - reach, axle.1 - reach);
        canvas.fill(from, (axle.0 + reach, axle.1 + reach), Role::Strong, is_car);
        for at in [rear, front] {
            canvas.clear(at, at, wheel + 0.9);
        }
    }

    fn wheels(&self, canvas: &mut Canvas) {
        for at in [self.rear, self.front] {
            canvas.disc(at, self.wheel, Role::Strong);
        }
    }
}

/// Where the car was the steps before, by its speed now.
fn trail(canvas: &mut Canvas, place: &Place, x: f64, speed: f64) {
    for age in (1..=TRAIL).map(f64::from) {
        let path = speed * place.across * age;
        if path.abs() < 1.0 {
            continue;
        }
        let dots = place.column(x) - path - (place.half_car + 2.0) * speed.signum();
        if dots < place.left - place.half_car {
            break;
        }
        let at = place.hill(dots);
        canvas.mote((at.0, at.1 - place.line - 0.6 * place.half_car), 1.9 - 0.15 * age, Role::Dim);
    }
}

/// In the first rows, each in its place: the speed, as a bar as well, and the word at the goal.
fn words(canvas: &mut Canvas, geometry: &Geometry, at: &Place, speed: f64, has_arrived: bool) {
    let middle = (canvas.width() / DOTS_ACROSS / 2.0).floor();
    let words = format!("{} {} a step", arrow(speed, 3), fixed(speed.abs(), 5, 3));
    canvas.text(middle - 6.0, 0.0, &words, Role::Strong);
    canvas.glyph(middle, 1.0, '│', Role::Dim);
    let part = (speed / geometry.speed_limit).clamp(-1.0, 1.0);
    let length = cells((part.abs() * GAUGE).round());
    for k in (1..=length).map(f64::from) {
        let tip = if part < 0.0 { '←' } else { '→' };
        let glyph = if k == f64::from(length) { tip } else { '━' };
        canvas.glyph(middle + k * part.signum(), 1.0, glyph, Role::Strong);
    }
    if has_arrived {
        canvas.text(at.pole / DOTS_ACROSS - 10.0, 0.0, &block("GOAL"), Role::Go);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::palette::Glyphs;
    use crate::tui::scene::tests::{in_all_glyphs, picture};

    const GEOMETRY: Geometry = Geometry { left: -1.2, goal: 0.5, speed_limit: 0.07 };

    fn small(state: [f64; 2]) -> String {
        picture((80, 15), Glyphs::Braille, |pen| draw(pen, &GEOMETRY, &state, Light::Go))
    }

    #[test]
    fn a_car_climbs() {
        insta::assert_snapshot!("car_at_the_foot", small([-0.5, 0.0]));
        insta::assert_snapshot!("car_at_the_wall", small([-1.2, 0.0]));
        insta::assert_snapshot!("car_climbs", small([0.2, 0.06]));
        insta::assert_snapshot!("car_at_the_goal", small([0.5, 0.03]));
        let wide = |pen: &mut Pen<'_>| draw(pen, &GEOMETRY, &[-0.9, -0.05], Light::Wait);
        insta::assert_snapshot!("car_120x30", picture((120, 30), Glyphs::Braille, wide));
        insta::assert_snapshot!("car_glyphs", in_all_glyphs((80, 15), wide));
    }

    #[test]
    fn the_goal_is_named_when_it_is_reached() {
        assert!(!small([0.49, 0.03]).contains("GOAL"));
        assert!(small([0.5, 0.03]).contains("GOAL"));
    }

    #[test]
    fn the_car_stays_in_the_picture() {
        for (columns, rows) in [(20, 5), (44, 8), (80, 14), (80, 19), (120, 30), (200, 14)] {
            let canvas = Canvas::new(columns, rows, Glyphs::Braille);
            let place = Place::new(&canvas, &GEOMETRY);
            for x in [-1.2, -0.5, 0.0, 0.5] {
                let car = Car::new(&place, x);
                for (x, y) in [car.rear, car.front] {
                    let is_inside = (0.0..=canvas.width()).contains(&x)
                        && (car.wheel..=canvas.height()).contains(&y);
                    assert!(is_inside, "{columns}x{rows}: {x}, {y}");
                }
            }
        }
    }
}
