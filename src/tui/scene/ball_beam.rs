//! The ball on its beam: one end rests on a post, the other on the servo's lever
//! (thesis section 3.3).
//!
//! Lengths are to scale, but the ball is drawn larger than it is and the tilt
//! [`TILT_FACTOR`] times as steep: the beam's 5° are flat on a screen.

use super::{Light, ROOM_ACROSS, ROOM_FOR_WORDS, arrow, block};
use crate::tui::canvas::{Canvas, DOTS_ACROSS, DOTS_DOWN, Point};
use crate::tui::palette::Role;
use crate::tui::pen::Pen;
use crate::tui::text::fixed;

/// The plant's measures, and the task's limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Half the beam's length, m: the ball rolls between ± this.
    pub beam_half_length_m: f64,
    /// The ball is to stay within ± this, m.
    pub limit_m: f64,
    /// The servo turns between ± this, rad.
    pub servo_limit_rad: f64,
    /// The beam's tilt when the servo is at its limit, rad.
    pub beam_limit_rad: f64,
}

/// How many times as steep as it is the beam is drawn.
pub const TILT_FACTOR: f64 = 1.5;

/// The drawn ball's radius, m: the real one's 13 mm would be hard to see.
const BALL_M: f64 = 0.02;
/// The drawn ball's radius at least, in dots.
const LEAST_BALL: f64 = 2.6;
/// How many dots of the trail there are, and how long they lie apart, s.
const TRAIL: (u8, f64) = (6, 0.07);

/// Where things are, in dots.
struct Place {
    /// Dots a metre.
    scale: f64,
    /// The beam's end on the post, about which it turns.
    pivot: Point,
    /// The beam's direction, to the right.
    along: Point,
    length: f64,
    /// Half the beam's thickness.
    beam: f64,
    ball: f64,
    /// The servo's axle, and the length of its lever.
    hub: Point,
    lever: f64,
}

impl Place {
    /// The largest scale at which the whole beam, its ball and the servo fit, whatever the tilt.
    fn new(canvas: &Canvas, geometry: &Geometry, servo_rad: f64) -> Self {
        let length_m = (2.0 * geometry.beam_half_length_m).max(1e-3);
        let steepest = TILT_FACTOR * geometry.beam_limit_rad.abs();
        let rise_m = length_m * steepest.sin().abs();
        // Left of the beam a ball can overhang, right of it stands the servo.
        let is_small = canvas.width() < f64::from(ROOM_ACROSS) * DOTS_ACROSS;
        let (before, after) = if is_small { (4.0, 8.0) } else { (12.0, 20.0) };
        let beam = (canvas.height() / 36.0).clamp(0.8, 2.6);
        let up_m = rise_m + 2.0 * BALL_M;
        let scale = ((canvas.width() - before - after) / length_m)
            .min((canvas.height() - 4.0 - 4.0 * beam) / (up_m + rise_m))
            .max(1e-6);
        let (rise, ball) = (rise_m * scale, (BALL_M * scale).max(LEAST_BALL));
        let spare = (canvas.height() - 2.0 * rise - 2.0 * ball - 2.0 * beam).max(0.0);
        // Most of what is left over is the servo's, below.
        let pivot_y = (rise + 2.0 * ball + beam + 0.25 * spare).floor();
        let length = length_m * scale;
        let left = before + ((canvas.width() - before - after - length) / 2.0).max(0.0).floor();
        let lever = (0.5 * (after - 2.0)).min(0.6 * rise + 2.0);
        let hub_y = (pivot_y + rise + 0.5 * lever + 2.0 * beam).min(canvas.height() - lever - 1.0);
        let tilt = TILT_FACTOR * tilt(geometry, servo_rad);
        Self {
            scale,
            pivot: (left, pivot_y),
            along: (tilt.cos(), tilt.sin()),
            length,
            beam,
            ball,
            hub: (left + length + lever, hub_y),
            lever,
        }
    }

    /// The point `x` metres right of the beam's middle and `above` dots off it.
    fn on_beam(&self, x_m: f64, above: f64) -> Point {
        let along = self.length / 2.0 + x_m * self.scale;
        let (cos, sin) = self.along;
        (self.pivot.0 + along * cos + above * sin, self.pivot.1 + along * sin - above * cos)
    }
}

/// The beam's angle, rad; positive: the right end is the lower one, and the ball runs right.
fn tilt(geometry: &Geometry, servo_rad: f64) -> f64 {
    let part = servo_rad / geometry.servo_limit_rad;
    if part.is_finite() { part.clamp(-1.0, 1.0) * geometry.beam_limit_rad } else { 0.0 }
}

/// Draws the plant in `state` = `[x m, ẋ m/s, θ rad, θ̇ rad/s]`, θ the servo's angle.
pub fn draw(pen: &mut Pen<'_>, geometry: &Geometry, state: &[f64], light: Light) {
    let &[x, speed, servo, ..] = state else { return };
    if pen.width() < 8 || pen.height() < 4 {
        return;
    }
    if !(x.is_finite() && speed.is_finite() && servo.is_finite()) {
        pen.centred(0, "the state is not a number", Role::Alarm);
        return;
    }
    let mut canvas = Canvas::new(pen.width(), pen.height(), pen.look.glyphs);
    let place = Place::new(&canvas, geometry, servo);
    let half = geometry.beam_half_length_m;
    let x = x.max(-half.abs()).min(half.abs());
    stand(&mut canvas, geometry, &place, servo);
    beam(&mut canvas, geometry, &place, x);
    ball(&mut canvas, &place, x, speed);
    if pen.height() >= ROOM_FOR_WORDS && pen.width() >= ROOM_ACROSS {
        words(&mut canvas, geometry, x, speed);
        for column in [0.0, f64::from(pen.width()) - 4.0] {
            super::square(&mut canvas, column, 0.0, light);
        }
    }
    canvas.draw(pen);
}

/// The post at the left; at the right the servo with its lever, and the rod up to the beam.
fn stand(canvas: &mut Canvas, geometry: &Geometry, place: &Place, servo_rad: f64) {
    let (x, y) = place.pivot;
    let floor = canvas.height();
    canvas.rectangle((x - 1.0, y), (x + 1.0, floor), Role::Text);
    canvas.rectangle((x - 4.0, floor - 1.0), (x + 4.0, floor), Role::Text);
    let limit = geometry.servo_limit_rad.abs();
    let turn = if limit.is_finite() { servo_rad.clamp(-limit, limit) } else { 0.0 };
    let hand = (place.hub.0 - place.lever * turn.cos(), place.hub.1 + place.lever * turn.sin());
    let end = place.on_beam(place.length / 2.0 / place.scale, 0.0);
    canvas.pole(end, hand, 0.6, Role::Dim);
    canvas.rectangle((place.hub.0 - 1.0, place.hub.1), (place.hub.0 + 1.0, floor), Role::Text);
    canvas.pole(place.hub, hand, 0.9, Role::Text);
    let hub = (0.35 * place.lever).max(1.2);
    canvas.capsule(place.hub, place.hub, hub, Role::Text);
}

/// The beam, thick where the ball is to stay; beyond the limits thin, and where the ball is
/// too far its end is swollen.
fn beam(canvas: &mut Canvas, geometry: &Geometry, place: &Place, x_m: f64) {
    let half = geometry.beam_half_length_m;
    let limit = geometry.limit_m.abs().min(half.abs());
    let thin = 0.55 * place.beam;
    canvas.pole(place.on_beam(-half, 0.0), place.on_beam(half, 0.0), thin, Role::Text);
    canvas.pole(place.on_beam(-limit, 0.0), place.on_beam(limit, 0.0), place.beam, Role::Text);
    let mark = 2.0 * place.beam + 2.0;
    for side in [-1.0, 1.0] {
        let (from, to) = (place.on_beam(side * limit, 0.0), place.on_beam(side * limit, -mark));
        canvas.pole(from, to, 0.7, Role::Text);
        let is_hit = side * x_m >= limit;
        let (stop, role) =
            if is_hit { (2.2 * place.beam, Role::Wait) } else { (0.8 * place.beam, Role::Text) };
        let end = place.on_beam(side * half, 0.0);
        canvas.capsule(end, place.on_beam(side * half, 0.6 * place.ball), stop, role);
    }
    // The middle, where the ball is best.
    canvas.pole(place.on_beam(0.0, 0.0), place.on_beam(0.0, -mark), 0.7, Role::Dim);
}

/// The ball, and behind it a trail as long as it is fast.
fn ball(canvas: &mut Canvas, place: &Place, x_m: f64, speed: f64) {
    let rest = place.beam + place.ball;
    let middle = place.on_beam(x_m, rest);
    let behind = place.ball + 1.5;
    let size = (place.ball / 4.0).min(1.0);
    for age in (1..=TRAIL.0).map(f64::from) {
        let path = speed.abs() * place.scale * TRAIL.1 * age;
        if path < 1.0 {
            continue;
        }
        let back = (behind + path) * speed.signum();
        let from_middle = x_m - back / place.scale;
        let at = place.on_beam(from_middle, rest);
        canvas.mote(at, (1.8 - 0.17 * age) * size, Role::Dim);
    }
    canvas.disc(middle, place.ball, Role::Text);
}

/// In the last row, each in its place: the speed, and which end the ball is too near to.
fn words(canvas: &mut Canvas, geometry: &Geometry, x_m: f64, speed: f64) {
    let columns = canvas.width() / DOTS_ACROSS;
    let row = canvas.height() / DOTS_DOWN - 1.0;
    let middle = (columns / 2.0).floor();
    let words = format!("{} {} m/s", arrow(speed, 2), fixed(speed.abs(), 4, 2));
    canvas.text(middle - 5.0, row, &words, Role::Strong);
    if x_m.abs() >= geometry.limit_m {
        let word = if x_m.abs() >= geometry.beam_half_length_m { "END" } else { "HIT" };
        let column = if x_m < 0.0 { 9.0 } else { columns - 18.0 };
        canvas.text(column, row, &block(word), Role::Wait);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::palette::Glyphs;
    use crate::tui::scene::tests::{in_all_glyphs, picture};

    const GEOMETRY: Geometry = Geometry {
        beam_half_length_m: 0.2125,
        limit_m: 0.17,
        servo_limit_rad: 1.46,
        beam_limit_rad: 0.0873,
    };

    fn small(state: [f64; 4]) -> String {
        picture((80, 15), Glyphs::Braille, |pen| draw(pen, &GEOMETRY, &state, Light::Go))
    }

    #[test]
    fn a_ball_rolls() {
        insta::assert_snapshot!("ball_rolls", small([0.05, 0.18, 0.3, 0.0]));
        insta::assert_snapshot!("ball_hits", small([0.18, 0.4, -1.46, 0.0]));
        insta::assert_snapshot!("ball_ends", small([-0.2125, -0.04, 1.46, 0.0]));
        let wide = |pen: &mut Pen<'_>| draw(pen, &GEOMETRY, &[0.0, -0.3, 1.0, 0.0], Light::Wait);
        insta::assert_snapshot!("ball_120x30", picture((120, 30), Glyphs::Braille, wide));
        insta::assert_snapshot!("ball_glyphs", in_all_glyphs((80, 15), wide));
    }

    #[test]
    fn an_end_is_named_only_while_the_ball_is_there() {
        let seen = |x| small([x, 0.0, 0.0, 0.0]);
        assert!(!seen(0.16).contains("HIT") && !seen(-0.16).contains("END"));
        for x in [0.17, -0.2] {
            assert!(seen(x).contains("HIT") && !seen(x).contains("END"));
        }
        assert!(seen(-0.2125).contains("END") && !seen(-0.2125).contains("HIT"));
    }

    #[test]
    fn ball_and_beam_stay_in_the_picture_however_the_beam_is_tilted() {
        for (columns, rows) in [(20, 5), (44, 8), (80, 14), (80, 19), (120, 30), (200, 14)] {
            let canvas = Canvas::new(columns, rows, Glyphs::Braille);
            for (servo, x) in [(-1.46, 0.2125), (-1.46, -0.2125), (1.46, 0.2125), (0.0, 0.0)] {
                let place = Place::new(&canvas, &GEOMETRY, servo);
                for above in [0.0, place.beam + 2.0 * place.ball] {
                    let (x, y) = place.on_beam(x, above);
                    let is_inside = (-1.0..=canvas.width()).contains(&x)
                        && (-1.0..=canvas.height()).contains(&y);
                    assert!(is_inside, "{columns}x{rows}: {x}, {y}");
                }
            }
        }
    }

    #[test]
    fn a_positive_angle_lowers_the_right_end() {
        let canvas = Canvas::new(80, 14, Glyphs::Braille);
        let right = |servo| Place::new(&canvas, &GEOMETRY, servo).on_beam(0.2, 0.0).1;
        assert!(right(0.5) > right(0.0) && right(0.0) > right(-0.5));
    }
}
