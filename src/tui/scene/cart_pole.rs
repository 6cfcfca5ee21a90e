//! The cart-pole on its track, to scale (thesis fig. 13).

use super::{Light, ROOM_FOR_WORDS};
use crate::tui::canvas::{Canvas, DOTS_ACROSS, DOTS_DOWN, Point};
use crate::tui::palette::Role;
use crate::tui::pen::Pen;
use crate::tui::text::place;

/// The plant's measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// The whole pole's length, m.
    pub pole_length_m: f64,
    /// The track's length, m; `None` for an endless one, which scrolls under the cart.
    pub track_length_m: Option<f64>,
    /// The pole falls beyond ± this angle, rad; `None` where it turns all the way round.
    pub fail_angle_rad: Option<f64>,
}

/// The drawn cart's width, m: it has no width in the equations.
const CART_WIDTH_M: f64 = 0.3;
/// The distance of marks along the track, m.
const MARK_M: f64 = 0.25;

/// The weight at the pole's tip, in radii of the pole.
const BOB: f64 = 1.8;

/// How many dots of the tip's past are drawn, and how long they lie apart, s.
const TRAIL: (u8, f64) = (10, 0.02);

/// Whether there is no room for words.
fn is_ornament(canvas: &Canvas) -> bool {
    canvas.height() < f64::from(ROOM_FOR_WORDS) * DOTS_DOWN
}

/// Half the pole's thickness in dots: to be seen at arm's length.
fn pole_radius(scale: f64) -> f64 {
    (0.03 * scale).clamp(1.4, 4.0)
}

/// Where things are, in dots.
struct Place {
    /// Dots a metre, the same in x and y.
    scale: f64,
    cart: Point,
    cart_half_width: f64,
    cart_height: f64,
    wheel: f64,
    track_y: f64,
    /// The track's middle; the cart's own place on an endless track.
    middle_x: f64,
}

impl Place {
    fn new(canvas: &Canvas, geometry: &Geometry, x_m: f64) -> Self {
        match geometry.fail_angle_rad {
            Some(angle) => Self::upright(canvas, geometry, x_m, angle),
            None => Self::turning(canvas, geometry, x_m),
        }
    }

    /// The largest scale at which the whole pole, held upright or falling at an end of the
    /// track, stays in the picture.
    fn upright(canvas: &Canvas, geometry: &Geometry, x_m: f64, fail_angle_rad: f64) -> Self {
        let length = geometry.pole_length_m.max(1e-3);
        let reach = length * fail_angle_rad.sin().abs();
        let track = geometry.track_length_m.unwrap_or(2.0 * reach + CART_WIDTH_M);
        // Beside the track stand the squares, four cells and a gap at each end.
        let beside = 2.0 * 5.0 * DOTS_ACROSS;
        let above_track = canvas.height() - DOTS_DOWN;
        let rough = above_track / (length + 0.2);
        // Whole cells, so that the cart's edges are sharp and change no cell above or below.
        let cart_and_wheels = ((0.13 * rough / DOTS_DOWN).round() * DOTS_DOWN).clamp(8.0, 20.0);
        let bob = BOB * pole_radius(rough);
        let scale = ((above_track - cart_and_wheels - bob) / length)
            .min((canvas.width() - beside) / (track + CART_WIDTH_M))
            .min(canvas.width() / (track + 2.0 * reach))
            .max(1e-6);
        let wheel = 0.19 * cart_and_wheels;
        let track_y = above_track;
        let middle_x = (canvas.width() / 2.0).floor();
        let offset = if geometry.track_length_m.is_some() { x_m * scale } else { 0.0 };
        let cart_height = cart_and_wheels - 2.0 * wheel;
        Self {
            scale,
            cart: (middle_x + offset, track_y - cart_and_wheels),
            cart_half_width: (CART_WIDTH_M / 2.0 * scale).max(4.0),
            cart_height,
            wheel,
            track_y,
            middle_x,
        }
    }

    /// The largest scale at which the pole can turn all the way round at either end of the
    /// track: its pivot stands half-way up, on the border of two cells.
    fn turning(canvas: &Canvas, geometry: &Geometry, x_m: f64) -> Self {
        let length = geometry.pole_length_m.max(1e-3);
        let track = geometry.track_length_m.unwrap_or(CART_WIDTH_M);
        let pivot_y = DOTS_DOWN * (canvas.height() / 2.0 / DOTS_DOWN).floor();
        let room = pivot_y.min(canvas.height() - pivot_y);
        let bob = BOB * pole_radius(room / length);
        // Beyond the reach of the pole stand the squares.
        let beside = 2.0 * (5.0 * DOTS_ACROSS + bob);
        let scale = ((room - bob) / length)
            .min((canvas.width() - beside) / (track + 2.0 * length))
            .max(1e-6);
        let least = if is_ornament(canvas) { 4.0 } else { 8.0 };
        let cart_and_wheels = ((0.13 * scale / DOTS_DOWN).round() * DOTS_DOWN).clamp(least, 20.0);
        let wheel = 0.19 * cart_and_wheels;
        let middle_x = (canvas.width() / 2.0).floor();
        let offset = if geometry.track_length_m.is_some() { x_m * scale } else { 0.0 };
        Self {
            scale,
            cart: (middle_x + offset, pivot_y),
            cart_half_width: (CART_WIDTH_M / 2.0 * scale).max(4.0),
            cart_height: cart_and_wheels - 2.0 * wheel,
            wheel,
            track_y: pivot_y + cart_and_wheels,
            middle_x,
        }
    }

    /// The point `length` metres from the pivot at `angle` from upright, to the right.
    fn beyond_pivot(&self, length: f64, angle: f64) -> Point {
        let (sin, cos) = angle.sin_cos();
        (self.cart.0 + self.scale * length * sin, self.cart.1 - self.scale * length * cos)
    }
}

/// Draws the plant in `state` = `[x, ẋ, θ, θ̇]`.
pub fn draw(pen: &mut Pen<'_>, geometry: &Geometry, state: &[f64], light: Light) {
    let &[x, _, theta, ..] = state else { return };
    if pen.width() < 4 || pen.height() < 4 {
        return;
    }
    if !(x.is_finite() && theta.is_finite()) {
        pen.centred(0, "the state is not a number", Role::Alarm);
        return;
    }
    let mut canvas = Canvas::new(pen.width(), pen.height(), pen.look.glyphs);
    let place = Place::new(&canvas, geometry, x);
    track(&mut canvas, geometry, &place, x);
    if let Some(angle) = geometry.fail_angle_rad {
        limits(&mut canvas, geometry, &place, angle);
    } else {
        trail(&mut canvas, geometry, &place, state);
    }
    cart(&mut canvas, &place);
    pole(&mut canvas, geometry, &place, theta);
    if pen.height() >= ROOM_FOR_WORDS {
        squares(&mut canvas, geometry, &place, light);
    }
    canvas.draw(pen);
}

/// The track's line with a mark every quarter of a metre, a longer one at the middle.
fn track(canvas: &mut Canvas, geometry: &Geometry, place: &Place, x_m: f64) {
    let half_m = geometry.track_length_m.map(|length| length / 2.0);
    let half = half_m.map_or(canvas.width(), |half| half * place.scale + place.cart_half_width);
    let (left, right) = (place.middle_x - half, place.middle_x + half);
    canvas.rectangle((left, place.track_y), (right, place.track_y + 1.0), Role::Dim);
    // On a track with ends the marks stand still; an endless one carries them along.
    let origin = if half_m.is_some() { 0.0 } else { x_m };
    let step = MARK_M * (4.0 / (MARK_M * place.scale)).ceil().max(1.0);
    let reach = half_m.unwrap_or(canvas.width() / 2.0 / place.scale);
    let first = ((origin - reach) / step).ceil();
    for k in 0..crate::tui::text::place((2.0 * reach / step).floor() + 1.0).min(400) {
        let number = first + f64::from(k);
        let x = place.middle_x + ((number * step - origin) * place.scale).round();
        let is_long = number % 4.0 == 0.0;
        let length = if is_long { 3.0 } else { 2.0 };
        canvas.rectangle((x, place.track_y), (x + 1.0, place.track_y + length), Role::Dim);
    }
}

/// A short mark at each angle beyond which the pole has fallen.
fn limits(canvas: &mut Canvas, geometry: &Geometry, place: &Place, fail_angle_rad: f64) {
    for angle in [-fail_angle_rad, fail_angle_rad] {
        let length = geometry.pole_length_m;
        let (from, to) =
            (place.beyond_pivot(0.90 * length, angle), place.beyond_pivot(length, angle));
        canvas.pole(from, to, 0.5, Role::Dim);
    }
}

/// Where the tip was the moment before, by its speed now: the faster, the longer.
fn trail(canvas: &mut Canvas, geometry: &Geometry, place: &Place, state: &[f64]) {
    let &[_, speed, theta, turn, ..] = state else { return };
    if !(speed.is_finite() && turn.is_finite()) {
        return;
    }
    // On an endless track the cart stands still in the picture.
    let drift = if geometry.track_length_m.is_some() { speed * place.scale } else { 0.0 };
    let tip = place.beyond_pivot(geometry.pole_length_m, theta);
    let bob = BOB * pole_radius(place.scale);
    // In an ornament it would hide the pole.
    let size = if is_ornament(canvas) { 0.5 } else { 1.0 };
    for age in (1..=TRAIL.0).map(f64::from) {
        let ago = age * TRAIL.1;
        let then = place.beyond_pivot(geometry.pole_length_m, theta - turn * ago);
        let middle = (then.0 - drift * ago, then.1);
        // At rest there is none.
        if (middle.0 - tip.0).hypot(middle.1 - tip.1) > bob + 1.0 {
            canvas.mote(middle, size * (1.9 - 0.12 * age), Role::Dim);
        }
    }
}

fn cart(canvas: &mut Canvas, place: &Place) {
    let (x, y) = place.cart;
    let half = place.cart_half_width;
    canvas.rectangle((x - half, y), (x + half, y + place.cart_height), Role::Text);
    for side in [-0.6, 0.6] {
        let middle = (x + side * half, place.track_y - place.wheel);
        canvas.capsule(middle, middle, place.wheel + 0.2, Role::Text);
    }
}

fn pole(canvas: &mut Canvas, geometry: &Geometry, place: &Place, theta: f64) {
    let radius = pole_radius(place.scale);
    let tip = place.beyond_pivot(geometry.pole_length_m, theta);
    if geometry.fail_angle_rad.is_none() && theta.cos() < 0.0 {
        // The hanging pole is seen in front of cart and track.
        canvas.clear(place.cart, tip, radius + 1.2);
    }
    canvas.pole(place.cart, tip, radius, Role::Text);
    canvas.disc(tip, BOB * radius, Role::Text);
}

/// The squares at the ends of the track, with their word below.
fn squares(canvas: &mut Canvas, geometry: &Geometry, at: &Place, light: Light) {
    // What turns all the way round reaches beyond the ends of the track.
    let beyond = match geometry.fail_angle_rad {
        Some(_) => at.cart_half_width,
        None => at.scale * geometry.pole_length_m + BOB * pole_radius(at.scale),
    };
    let half =
        geometry.track_length_m.map_or(f64::INFINITY, |length| length / 2.0 * at.scale + beyond);
    let last = (canvas.width() / DOTS_ACROSS - 4.0).max(0.0);
    let left = ((at.middle_x - half) / DOTS_ACROSS - 5.0).floor().clamp(0.0, last);
    let right = ((at.middle_x + half) / DOTS_ACROSS + 1.0).ceil().clamp(0.0, last);
    let word_row = f64::from(place(at.track_y / DOTS_DOWN));
    for column in [left, right] {
        super::square(canvas, column, word_row - 2.0, light);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::palette::Glyphs;
    use crate::tui::scene::tests::{in_all_glyphs, picture};

    /// A point in dots is inside the picture.
    fn is_inside(canvas: &Canvas, (x, y): Point) -> bool {
        (0.0..=canvas.width()).contains(&x) && (0.0..=canvas.height()).contains(&y)
    }

    #[test]
    fn the_whole_pole_is_in_the_picture_wherever_a_rollout_can_go() {
        for (columns, rows) in [(80, 14), (80, 19), (120, 30), (200, 50), (300, 20)] {
            for pole_length_m in [0.3, 0.6, 1.0, 2.0] {
                let canvas = Canvas::new(columns, rows, Glyphs::Braille);
                let fail = 30_f64.to_radians();
                let geometry = Geometry {
                    pole_length_m,
                    track_length_m: Some(1.0),
                    fail_angle_rad: Some(fail),
                };
                for (x, angle) in [(0.0, 0.0), (0.5, fail), (-0.5, -fail), (0.5, -fail)] {
                    let place = Place::new(&canvas, &geometry, x);
                    let tip = place.beyond_pivot(pole_length_m, angle);
                    assert!(
                        is_inside(&canvas, tip),
                        "{columns}x{rows}, {pole_length_m} m: {tip:?}"
                    );
                    assert!(is_inside(&canvas, place.cart));
                }
                // The room is used: the pole is high, or the track is wide.
                let place = Place::new(&canvas, &geometry, 0.0);
                let used = (place.scale * pole_length_m / canvas.height())
                    .max(place.scale * (1.0 + CART_WIDTH_M) / canvas.width());
                assert!(used > 0.6, "{columns}x{rows}, {pole_length_m} m: {used}");
            }
        }
    }

    #[test]
    fn a_length_is_as_long_across_as_up() {
        let canvas = Canvas::new(80, 14, Glyphs::Braille);
        let geometry =
            Geometry { pole_length_m: 1.0, track_length_m: Some(1.0), fail_angle_rad: Some(0.5) };
        let (left, right) =
            (Place::new(&canvas, &geometry, -0.5), Place::new(&canvas, &geometry, 0.5));
        let up = left.cart.1 - left.beyond_pivot(1.0, 0.0).1;
        assert!((right.cart.0 - left.cart.0 - up).abs() < 1e-9);
    }

    const TURNING: Geometry =
        Geometry { pole_length_m: 1.0, track_length_m: Some(1.0), fail_angle_rad: None };

    #[test]
    fn a_pole_that_turns_stays_in_the_picture_all_the_way_round() {
        for (columns, rows) in [(55, 14), (80, 14), (73, 30), (120, 30), (40, 60)] {
            let canvas = Canvas::new(columns, rows, Glyphs::Braille);
            for (x, tenth) in (0..63_u8).flat_map(|k| [(-0.5, k), (0.0, k), (0.5, k)]) {
                let place = Place::new(&canvas, &TURNING, x);
                let tip = place.beyond_pivot(1.0, f64::from(tenth) / 10.0);
                assert!(is_inside(&canvas, tip), "{columns}x{rows}, {tenth}: {tip:?}");
            }
        }
    }

    #[test]
    fn all_the_way_round() {
        let draw =
            |state: [f64; 4]| move |pen: &mut Pen<'_>| draw(pen, &TURNING, &state, Light::Go);
        let small = |state| picture((80, 15), Glyphs::Braille, draw(state));
        insta::assert_snapshot!("turning_hangs", small([0.0, 0.0, 3.1, 0.0]));
        insta::assert_snapshot!("turning_swings", small([0.2, 1.0, 1.2, -9.0]));
        insta::assert_snapshot!("turning_stands", small([-0.3, 0.0, 0.1, 0.3]));
        let whirls = [0.2, 1.0, 2.2, 12.0];
        insta::assert_snapshot!(
            "turning_whirls_120x30",
            picture((120, 30), Glyphs::Braille, draw(whirls))
        );
        insta::assert_snapshot!("turning_glyphs", in_all_glyphs((56, 14), draw(whirls)));
        insta::assert_snapshot!("turning_ornament", in_all_glyphs((20, 5), draw(whirls)));
    }

    #[test]
    fn the_trail_is_longer_the_faster_the_pole_turns_and_none_at_rest() {
        let dots = |turn| {
            let ascii = |pen: &mut Pen<'_>| draw(pen, &TURNING, &[0.0, 0.0, 1.0, turn], Light::Go);
            picture((80, 15), Glyphs::Ascii, ascii).matches('.').count()
        };
        assert_eq!(dots(0.2), 0);
        assert!(dots(4.0) > 0 && dots(12.0) > dots(4.0));
    }
}
