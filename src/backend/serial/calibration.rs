//! The guided calibration of a cart-pole: where its pole hangs, and which way is right.
//!
//! A pure function of time and states: [`Procedure`] is shown every state of the device and
//! says what it wants next; a person is asked before anything moves.
//!
//! ```text
//! HangStill ─▶ MayHome ─▶ Homing ─▶ MayPush ─▶ Steady ─▶ Push ─▶ WhichWay ─▶ Limits ─▶ Done
//!     └───── homed, or needs no homing ─▲         ▲ the hand is off ┘
//! ```
//!
//! Signs: the motor's positive action has to make the position grow, and a hanging pole whose
//! cart is pushed to the right lags behind, where θ − π is positive (θ = 0 upright, positive to
//! the right: see the cart-pole's equations). Whether this is the right of the person who looks
//! at it, only the person knows; if not, all three signs are turned.

use super::Params;
use super::rest::{REST, Rest, around};
use super::shelf::{Calibration, MadeFor};
use crate::backend::wire::StateFrame;
use crate::signal::Seconds;

/// The push: this part of the largest action,
const PUSH: f64 = 0.25;
/// for at most this time,
const PUSH_TIME: Seconds = Seconds(0.3);
/// and ended when the cart has come so far, m.
const PUSH_WAY: f64 = 0.03;
/// A cart that came less far than this did not move, m.
const MOVED: f64 = 0.005;
/// A pole that turned further than this part of a turn lags behind,
const LAG_TURNS: f64 = 0.7 / 360.0;
/// if these are also more counts than this.
const LAG_COUNTS: f64 = 5.0;

/// A device that is told to home and sends states for longer than this does not do it.
const HOME_WITHIN: Seconds = Seconds(5.0);
/// Homing is silent for longer than this.
const SILENCE: Seconds = Seconds(0.5);

/// What is calibrated.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// The device's lasting name.
    pub device: String,
    /// Now, RFC 3339.
    pub at: String,
    /// The largest action, in the plant's unit.
    pub limit: f64,
    /// From the track's middle to its ends, m, where it is known.
    pub half_track_m: Option<f64>,
}

/// A state of the device, and what is known besides.
#[derive(Clone, Copy, Debug)]
pub struct Sight<'a> {
    /// The state in counts.
    pub frame: &'a StateFrame,
    /// Whether the ends of the track are known.
    pub is_homed: bool,
    /// Whether the motor follows: it is armed, and a hand is on the switch that enables it.
    pub is_armed: bool,
    /// When the state came.
    pub now: Seconds,
}

/// What the procedure wants until the next state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wish {
    /// The motor off.
    Nothing,
    /// The device is to look for its ends. Said until it is seen to do so.
    Home,
    /// This action, in the plant's unit.
    Drive(f64),
}

/// How far a calibration has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The hanging pole's reading is measured.
    HangStill,
    /// The person is asked whether homing may begin.
    MayHome,
    /// The device looks for its ends.
    Homing,
    /// The person is asked whether the cart may be pushed.
    MayPush,
    /// The push waits for the cart, the pole, the motor and the hand on its switch.
    Steady,
    /// The cart is pushed.
    Push,
    /// The person is asked whether that was to the right.
    WhichWay,
    /// The person is asked whether the limits are right.
    Limits,
    /// There is a result.
    Done,
    /// There is none.
    Failed,
}

impl Step {
    /// Whether a person's yes or no is waited for.
    #[must_use]
    pub const fn asks(self) -> bool {
        matches!(self, Self::MayHome | Self::MayPush | Self::WhichWay | Self::Limits)
    }
}

/// Why a calibration failed, and what to do about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Trouble {
    /// The person ended it.
    #[error("the calibration was ended: begin it again before the motor is armed")]
    Cancelled,
    /// The person does not want the cart to move.
    #[error("it cannot be done without moving the cart: clear the track first")]
    MayNotMove,
    /// The device sends states in place of homing.
    #[error("the device does not begin to home: disarm the motor first")]
    HomingRefused,
    /// Homing has ended without a result.
    #[error("homing found no ends: look whether the cart and its belt run freely")]
    NotHomed,
    /// The device was homed and is not any more.
    #[error("the device has lost its zero: look at its power and its cable")]
    ZeroLost,
    /// A push without motion.
    #[error("the cart did not move: is its supply on, does it run freely?")]
    StoodStill,
    /// A motion of the cart without one of the pole.
    #[error("the pole did not swing when the cart moved: look at the angle sensor")]
    HungStill,
    /// The limits are no limits.
    #[error("the hard limit must be inside the track: lower it in the profile")]
    Limits,
}

/// What is on at the moment.
#[derive(Clone, Debug)]
enum Stage {
    HangStill(Rest),
    MayHome,
    Homing(Homing),
    MayPush,
    Steady { rest: Rest, lacks: Lacks },
    Push(Push),
    WhichWay,
    Limits,
    Done,
    Failed(Trouble),
}

/// What the push waits for.
#[derive(Clone, Copy, Debug, Default)]
struct Lacks {
    /// A cart that is not close to an end.
    room: bool,
    /// A motor that follows.
    motor: bool,
}

/// The silence of a device that homes.
#[derive(Clone, Copy, Debug, Default)]
struct Homing {
    since: Option<Seconds>,
    last: Option<Seconds>,
}

/// A push under way.
#[derive(Clone, Copy, Debug)]
struct Push {
    since: Seconds,
    now: Seconds,
    /// The pole's reading before it.
    hung: f64,
    /// The cart's reading before it.
    from: i32,
    /// The first turn of the pole that counts as one, counts.
    lag: Option<f64>,
}

/// A calibration under way.
#[derive(Clone, Debug)]
pub struct Procedure {
    params: Params,
    about: About,
    stage: Stage,
    found: Calibration,
}

impl Procedure {
    /// The calibration of a device that was opened with `params`.
    #[must_use]
    pub fn new(params: &Params, about: About) -> Self {
        let scales = &params.scales;
        let found = Calibration {
            device: about.device.clone(),
            at: about.at.clone(),
            made_for: MadeFor::of(params),
            hanging: scales.angle.hanging,
            angle_invert: scales.angle.invert,
            position_invert: scales.position.invert,
            motor_invert: scales.motor.invert,
        };
        let stage = Stage::HangStill(Rest::of(scales.angle.counts_per_turn));
        Self { params: params.clone(), about, stage, found }
    }

    /// A state came: what is wanted until the next one.
    pub fn see(&mut self, sight: Sight<'_>) -> Wish {
        let &[angle, position, ..] = &sight.frame.sensors[..] else { return Wish::Nothing };
        let has_zero = !self.params.homing || sight.is_homed;
        let needs_zero = matches!(
            self.stage,
            Stage::MayPush
                | Stage::Steady { .. }
                | Stage::Push(_)
                | Stage::WhichWay
                | Stage::Limits
        );
        if needs_zero && !has_zero {
            self.stage = Stage::Failed(Trouble::ZeroLost);
        }
        match &mut self.stage {
            Stage::HangStill(rest) => {
                if sight.frame.command == 0 {
                    rest.see(angle, sight.now);
                } else {
                    rest.begin_anew();
                }
                if rest.measured() >= 1.0 {
                    self.found.hanging = rest.mean();
                    self.stage = if has_zero { Stage::MayPush } else { Stage::MayHome };
                }
                Wish::Nothing
            }
            Stage::Homing(homing) => {
                if sight.is_homed {
                    self.stage = Stage::MayPush;
                    return Wish::Nothing;
                }
                match homing.trouble(sight.now) {
                    None => Wish::Home,
                    Some(trouble) => {
                        self.stage = Stage::Failed(trouble);
                        Wish::Nothing
                    }
                }
            }
            Stage::Steady { rest, lacks } => {
                rest.see(angle, sight.now);
                let x = self.params.scales.position(position);
                *lacks = Lacks { room: !has_room(x, &self.params), motor: !sight.is_armed };
                if lacks.room || lacks.motor || rest.time() < REST {
                    return Wish::Nothing;
                }
                let hung = rest.mean();
                let now = sight.now;
                self.stage = Stage::Push(Push { since: now, now, hung, from: position, lag: None });
                Wish::Drive(PUSH * self.about.limit)
            }
            Stage::Push(_) if !sight.is_armed => {
                self.steady();
                Wish::Nothing
            }
            Stage::Push(push) => {
                let turn = self.params.scales.angle.counts_per_turn;
                push.now = sight.now;
                let lag = around(f64::from(angle) - push.hung, turn);
                push.lag = push.lag.or((lag.abs() > lag_counts(turn)).then_some(lag));
                let counts = f64::from(position) - f64::from(push.from);
                let way = counts * self.params.scales.position.m_per_count;
                // Written so that a time that is no number ends it.
                if push.now - push.since < PUSH_TIME && way.abs() < PUSH_WAY {
                    return Wish::Drive(PUSH * self.about.limit);
                }
                let lag = push.lag;
                self.judge(way, lag);
                Wish::Nothing
            }
            _ => Wish::Nothing,
        }
    }

    /// The signs, by the raw `way` of a cart that was pushed by a positive action, and the pole's
    /// raw `lag`.
    fn judge(&mut self, way: f64, lag: Option<f64>) {
        self.stage = match lag {
            _ if way.abs() < MOVED => Stage::Failed(Trouble::StoodStill),
            None => Stage::Failed(Trouble::HungStill),
            Some(lag) => {
                self.found.position_invert = way < 0.0;
                self.found.angle_invert = lag < 0.0;
                Stage::WhichWay
            }
        };
    }

    /// The person says yes.
    pub fn go_on(&mut self) {
        match self.stage {
            Stage::MayHome => self.stage = Stage::Homing(Homing::default()),
            Stage::MayPush => self.steady(),
            Stage::WhichWay => self.ask_limits(),
            Stage::Limits => self.stage = Stage::Done,
            _ => {}
        }
    }

    /// The person says no.
    pub fn no(&mut self) {
        match self.stage {
            Stage::MayHome | Stage::MayPush => self.stage = Stage::Failed(Trouble::MayNotMove),
            Stage::WhichWay => {
                let Calibration { angle_invert, position_invert, motor_invert, .. } =
                    &mut self.found;
                for invert in [angle_invert, position_invert, motor_invert] {
                    *invert = !*invert;
                }
                self.ask_limits();
            }
            Stage::Limits => self.stage = Stage::Failed(Trouble::Limits),
            _ => {}
        }
    }

    /// The person ends it. A result that is there stays.
    pub fn cancel(&mut self) {
        if !matches!(self.stage, Stage::Done | Stage::Failed(_)) {
            self.stage = Stage::Failed(Trouble::Cancelled);
        }
    }

    fn steady(&mut self) {
        let rest = Rest::of(self.params.scales.angle.counts_per_turn);
        self.stage = Stage::Steady { rest, lacks: Lacks::default() };
    }

    fn ask_limits(&mut self) {
        let hard = self.params.safety.hard_limit_m;
        let is_inside = self.about.half_track_m.is_none_or(|half| hard < half);
        self.stage = if is_inside { Stage::Limits } else { Stage::Failed(Trouble::Limits) };
    }

    /// How far it has come.
    #[must_use]
    pub const fn step(&self) -> Step {
        match self.stage {
            Stage::HangStill(_) => Step::HangStill,
            Stage::MayHome => Step::MayHome,
            Stage::Homing(_) => Step::Homing,
            Stage::MayPush => Step::MayPush,
            Stage::Steady { .. } => Step::Steady,
            Stage::Push(_) => Step::Push,
            Stage::WhichWay => Step::WhichWay,
            Stage::Limits => Step::Limits,
            Stage::Done => Step::Done,
            Stage::Failed(_) => Step::Failed,
        }
    }

    /// How much of the step is done, 0 to 1; 0 where nobody knows.
    #[must_use]
    pub fn progress(&self) -> f64 {
        match &self.stage {
            Stage::HangStill(rest) => rest.measured(),
            Stage::Steady { rest, .. } => (rest.time().0 / REST.0).min(1.0),
            Stage::Push(push) => ((push.now - push.since).0 / PUSH_TIME.0).clamp(0.0, 1.0),
            Stage::Done => 1.0,
            _ => 0.0,
        }
    }

    /// What was found, when all is done.
    #[must_use]
    pub const fn result(&self) -> Option<&Calibration> {
        if matches!(self.stage, Stage::Done) { Some(&self.found) } else { None }
    }

    /// Why nothing was found.
    #[must_use]
    pub const fn trouble(&self) -> Option<Trouble> {
        if let Stage::Failed(trouble) = self.stage { Some(trouble) } else { None }
    }

    /// What the person is told or asked: at most two lines of 76 characters.
    #[must_use]
    pub fn prompt(&self) -> String {
        match &self.stage {
            Stage::HangStill(rest) if rest.is_disturbed() => {
                "The pole moves: steady it by hand, then let it hang.\n\
                 Its angle at rest is measured from the beginning."
            }
            Stage::HangStill(_) => {
                "Let the pole hang and keep your hands off.\nIts angle at rest is being measured."
            }
            Stage::MayHome => {
                "Homing moves the cart over the whole track, and nothing can stop it.\n\
                 Is the track clear, and are your hands off?"
            }
            Stage::Homing(_) => "The device looks for the ends of its track. Keep your hands off.",
            Stage::MayPush => {
                "Next the motor pushes the cart by some centimetres; see which way it goes.\n\
                 Is the track clear?"
            }
            Stage::Steady { rest, lacks } => return waiting(rest, *lacks),
            Stage::Push(_) => "The motor pushes the cart. See which way it goes.",
            Stage::WhichWay => "Did the cart move to the right, as you see it?",
            Stage::Limits => return self.limits(),
            Stage::Done => "The device is calibrated.",
            Stage::Failed(trouble) => return trouble.to_string(),
        }
        .to_owned()
    }

    fn limits(&self) -> String {
        let (soft, hard) = (self.params.safety.soft_limit_m, self.params.safety.hard_limit_m);
        let rule =
            format!("From ±{soft:.3} m on the motor only pushes inward; ±{hard:.3} m stops it.");
        match self.about.half_track_m {
            Some(half) => {
                format!("{rule}\nThe track ends at ±{half:.3} m: are both limits inside it?")
            }
            None => {
                format!("{rule}\nMeasure the track from its middle: are both limits inside it?")
            }
        }
    }
}

/// What the push waits for, in words.
fn waiting(rest: &Rest, lacks: Lacks) -> String {
    let plant = if lacks.room {
        "Push the cart by hand to the middle of its track."
    } else if rest.is_disturbed() {
        "Waiting until the pole hangs still: steady it by hand, then let go."
    } else {
        "The cart moves in a moment: keep clear."
    };
    let motor = "Waiting for the motor: arm it, and keep a hand on its enable switch.";
    if !lacks.motor {
        plant.to_owned()
    } else if lacks.room || rest.is_disturbed() {
        format!("{plant}\n{motor}")
    } else {
        motor.to_owned()
    }
}

/// Whether a push from `x` stays within the limits, whichever way it goes.
fn has_room(x: f64, params: &Params) -> bool {
    let soft = params.safety.soft_limit_m;
    x.abs() <= (soft - 2.0 * PUSH_WAY).max(soft / 2.0)
}

fn lag_counts(turn: f64) -> f64 {
    (LAG_TURNS * turn).max(LAG_COUNTS)
}

impl Homing {
    /// What is wrong when a state comes at `now` from a device that is not homed.
    fn trouble(&mut self, now: Seconds) -> Option<Trouble> {
        let since = *self.since.get_or_insert(now);
        let last = self.last.replace(now).unwrap_or(now);
        if now - last > SILENCE {
            return Some(Trouble::NotHomed);
        }
        (now - since > HOME_WITHIN).then_some(Trouble::HomingRefused)
    }
}

#[cfg(test)]
#[path = "calibration_tests.rs"]
mod tests;
