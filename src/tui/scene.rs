//! Pictures of the plants.

pub mod ball_beam;
pub mod cart_pole;
pub mod mountain_car;
pub mod regions;

use super::canvas::Canvas;
use super::palette::Role;
use super::pen::Pen;
use crate::profile::Experiment;

/// A picture lower than this, in cells, is an ornament without words.
const ROOM_FOR_WORDS: u16 = 8;
/// A picture narrower than this, in cells, as well.
const ROOM_ACROSS: u16 = 44;

/// The picture of a task's plant, to the measures of its profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scene {
    /// A cart-pole.
    CartPole(cart_pole::Geometry),
    /// A ball on a beam.
    BallBeam(ball_beam::Geometry),
    /// A car in a valley.
    MountainCar(mountain_car::Geometry),
}

impl Scene {
    /// The picture for `experiment`.
    #[must_use]
    pub const fn of(experiment: &Experiment) -> Self {
        match experiment {
            Experiment::Balance { plant, rules, .. } => Self::CartPole(cart_pole::Geometry {
                pole_length_m: plant.pole_length_m,
                track_length_m: plant.track_length_m,
                fail_angle_rad: Some(rules.fail_deg.to_radians()),
            }),
            Experiment::SwingUp { plant, .. } => Self::CartPole(cart_pole::Geometry {
                pole_length_m: plant.pole_length_m,
                track_length_m: plant.track_length_m,
                fail_angle_rad: None,
            }),
            Experiment::SpeedUp { plant, rules, .. } => Self::BallBeam(ball_beam::Geometry {
                beam_half_length_m: plant.beam_half_length_m,
                limit_m: rules.limit_m,
                servo_limit_rad: plant.servo_limit_rad,
                beam_limit_rad: plant.beam_limit_deg.to_radians(),
            }),
            Experiment::MountainCar { plant, .. } => Self::MountainCar(mountain_car::Geometry {
                left: plant.left_wall,
                goal: plant.goal,
                speed_limit: plant.speed_limit,
            }),
        }
    }

    /// Draws the plant in `state`.
    pub fn draw(&self, pen: &mut Pen<'_>, state: &[f64], light: Light) {
        match self {
            Self::CartPole(geometry) => cart_pole::draw(pen, geometry, state, light),
            Self::BallBeam(geometry) => ball_beam::draw(pen, geometry, state, light),
            Self::MountainCar(geometry) => mountain_car::draw(pen, geometry, state, light),
        }
    }
}

/// The state of a small picture that moves gently, `time_s` after it began: what the task is
/// about, at a glance.
#[must_use]
pub fn preview(experiment: &Experiment, time_s: f64) -> [f64; 4] {
    use std::f64::consts::{PI, TAU};
    /// How long the pole's or the car's way up takes, and how long it then stays, s.
    const WAY: f64 = 6.0;
    const STAY: f64 = 2.0;
    let part = (time_s.rem_euclid(WAY + STAY) / WAY).min(1.0);
    match experiment {
        Experiment::Balance { plant, rules, .. } => {
            let swing = (1.4 * time_s + 0.5).sin();
            let reach = plant.track_length_m.unwrap_or(1.0) / 2.0;
            // The cart hurries to where the pole falls.
            let lean = (1.4 * time_s + 1.1).sin() * rules.fail_deg.to_radians();
            [0.4 * reach * swing, 0.0, 0.4 * lean, 0.0]
        }
        // Three swings, each higher; then it stands.
        Experiment::SwingUp { plant, .. } => {
            let swing = (3.0 * TAU * part).sin();
            let angle = PI - PI * part.powi(2) - 0.9 * swing * part.sqrt() * (1.0 - part);
            let reach = plant.track_length_m.unwrap_or(1.0) / 2.0;
            [-0.4 * reach * swing * (1.0 - part), 0.0, angle, 4.0 * swing * (1.0 - part)]
        }
        // The beam tilts against the ball.
        Experiment::SpeedUp { plant, rules, .. } => {
            let phase = 2.0 * time_s;
            let tilt = -0.6 * plant.servo_limit_rad * phase.sin();
            [0.8 * rules.limit_m * phase.sin(), 0.25 * phase.cos(), tilt, 0.0]
        }
        // Two swings in the valley, then up to the flag.
        Experiment::MountainCar { plant, .. } => {
            let valley = -std::f64::consts::FRAC_PI_6;
            let swing = (2.5 * TAU * part).sin() * part;
            let x = valley + (plant.goal - valley) * part.powi(4) - 0.5 * swing * (1.0 - part);
            [x, 0.05 * (2.5 * TAU * part).cos() * (1.0 - part), 0.0, 0.0]
        }
    }
}

/// The map of the regions, for the task that has several.
#[must_use]
pub fn regions_of(experiment: &Experiment) -> Option<regions::Borders> {
    /// The pole is seldom faster than this, rad/s: the last column of Table 1.
    const FASTEST: f64 = 20.0;
    let Experiment::SwingUp { rules, .. } = experiment else { return None };
    Some(regions::Borders {
        down_rad: rules.down_deg.to_radians(),
        top_slow_rad: rules.top_slow_deg.to_radians(),
        top_fast_rad: rules.top_fast_deg.to_radians(),
        down_fast: rules.down_fast_rad_s,
        middle_fast: rules.middle_fast_rad_s,
        top_fast: rules.top_fast_rad_s,
        fastest: FASTEST,
    })
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::palette::{Glyphs, Look};
    use crate::tui::pen::Pen;
    use proptest::prelude::*;
    use ratatui::buffer::Buffer;
    use ratatui::layout::Rect;

    /// What `draw` draws on a pen of `width` × `height`, as text.
    pub fn picture(
        (width, height): (u16, u16),
        glyphs: Glyphs,
        draw: impl Fn(&mut Pen<'_>),
    ) -> String {
        let look = Look { glyphs, ..Look::default() };
        let mut buffer = Buffer::empty(Rect::new(0, 0, width, height));
        let area = buffer.area;
        draw(&mut Pen::new(&mut buffer, area, look));
        look.finish(&mut buffer);
        let row = |y| (0..width).map(|x| buffer[(x, y)].symbol()).collect::<String>();
        (0..height).map(|y| row(y).trim_end().to_owned() + "\n").collect()
    }

    /// The three glyph sets in one text.
    pub fn in_all_glyphs(size: (u16, u16), draw: impl Fn(&mut Pen<'_>)) -> String {
        [Glyphs::Braille, Glyphs::Half, Glyphs::Ascii]
            .map(|glyphs| format!("{glyphs:?}\n{}", picture(size, glyphs, &draw)))
            .concat()
    }

    /// Numbers that a plant gone wrong can hand over.
    fn any_number() -> impl Strategy<Value = f64> {
        prop_oneof![
            4 => -4.0..4.0,
            1 => prop_oneof![
                Just(f64::NAN),
                Just(f64::INFINITY),
                Just(f64::NEG_INFINITY),
                Just(0.0),
                any::<f64>(),
            ],
        ]
    }

    const BALL_BEAM: ball_beam::Geometry = ball_beam::Geometry {
        beam_half_length_m: 0.2125,
        limit_m: 0.17,
        servo_limit_rad: 1.46,
        beam_limit_rad: 0.0873,
    };
    const MOUNTAIN_CAR: mountain_car::Geometry =
        mountain_car::Geometry { left: -1.2, goal: 0.5, speed_limit: 0.07 };

    proptest! {
        #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

        #[test]
        fn no_state_or_size_or_geometry_breaks_a_picture(
            size in (0..=200_u16, 0..=60_u16),
            state in prop::array::uniform4(any_number()),
            strange in prop::array::uniform7(any_number()),
            (glyphs, is_strange, current) in (0..3_u8, any::<bool>(), 0..9_usize),
        ) {
            let glyphs = [Glyphs::Braille, Glyphs::Half, Glyphs::Ascii][usize::from(glyphs)];
            let [a, b, c, d, e, f, g] = strange;
            let pole = cart_pole::Geometry {
                pole_length_m: if is_strange { a } else { 1.0 },
                track_length_m: (b > 0.0).then_some(if is_strange { c } else { 1.0 }),
                fail_angle_rad: (d > 3.0).then_some(d),
            };
            let beam = ball_beam::Geometry {
                beam_half_length_m: a,
                limit_m: b,
                servo_limit_rad: c,
                beam_limit_rad: d,
            };
            let beam = if is_strange { beam } else { BALL_BEAM };
            let valley = mountain_car::Geometry { left: a, goal: b, speed_limit: c };
            let valley = if is_strange { valley } else { MOUNTAIN_CAR };
            let borders = regions::Borders {
                down_rad: a,
                top_slow_rad: b,
                top_fast_rad: c,
                down_fast: d,
                middle_fast: e,
                top_fast: f,
                fastest: g,
            };
            let map = regions::Map {
                borders: &borders,
                names: &regions::NAMES,
                shares: (a > 0.0).then_some(&strange[..]),
                successes: (b > 0.0).then_some(&strange[..]),
                frozen: (b > 0.0).then_some(&[true, false, true][..]),
                current,
                theta: state[2],
                theta_dot: state[3],
            };
            let drawn = picture(size, glyphs, |pen| {
                cart_pole::draw(pen, &pole, &state, Light::Go);
                ball_beam::draw(pen, &beam, &state, Light::Wait);
                mountain_car::draw(pen, &valley, &state[..2], Light::Go);
                regions::draw(pen, &map);
                regions::map(pen, &map);
                regions::list(pen, &map);
            });
            prop_assert!(glyphs != Glyphs::Ascii || drawn.is_ascii());
        }
    }

    #[test]
    fn a_state_that_is_no_number_is_said_to_be_none() {
        let words = "the state is not a number";
        let state = [0.0, f64::NAN, f64::NAN, 0.0];
        let pole = cart_pole::Geometry {
            pole_length_m: 1.0,
            track_length_m: Some(1.0),
            fail_angle_rad: None,
        };
        let seen = |draw: &dyn Fn(&mut Pen<'_>)| picture((80, 15), Glyphs::Braille, draw);
        assert!(seen(&|pen| cart_pole::draw(pen, &pole, &state, Light::Go)).contains(words));
        assert!(seen(&|pen| ball_beam::draw(pen, &BALL_BEAM, &state, Light::Go)).contains(words));
        assert!(
            seen(&|pen| mountain_car::draw(pen, &MOUNTAIN_CAR, &state, Light::Go)).contains(words)
        );
    }

    #[test]
    fn ornaments_have_no_words() {
        let state = [0.1, 0.05, 0.4, 0.0];
        let drawn = in_all_glyphs((20, 5), |pen| {
            ball_beam::draw(pen, &BALL_BEAM, &state, Light::Go);
        }) + &in_all_glyphs((20, 5), |pen| {
            mountain_car::draw(pen, &MOUNTAIN_CAR, &state, Light::Go);
        });
        assert!(!drawn.contains("GO") && !drawn.contains("m/s") && !drawn.contains("step"));
        insta::assert_snapshot!("ornaments", drawn);
    }
}
