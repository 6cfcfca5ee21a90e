//! Who guards a real plant: decides, frame by frame, what may go to its motor.
//!
//! A pure function of time and data: it reads no clock, owns no port, and can be put through
//! years of faults in a second. Whatever the caller wants, in this order: what is no number is
//! 0 and a fault; the action is saturated; it changes no faster than the slew allows; beyond the
//! soft limit it may only point inward. A fault is latched: the plant gets 0 until a person
//! clears it and arms again. Nothing else ever arms.
//!
//! ```text
//!             arm                    fault, stop
//! Disarmed ─────────▶ Armed ───────────────────▶ Latched
//!     ▲                 │ disarm, link lost          │ clear (a person)
//!     └─────────────────┴────────────────────────────┘
//! ```

mod fault;

use serde::{Deserialize, Serialize};

pub use fault::Fault;

use crate::check::{Check, Checker};
use crate::signal::{Seconds, State, wrapped};

/// The limits of a real plant. Positions are those of the state's first number, angles of its
/// third.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// How fast the action may grow, parts of the largest per second; `None`: at once.
    pub slew_per_s: Option<f64>,
    /// Beyond this distance from the middle the action may only point inward, m.
    pub soft_limit_m: f64,
    /// The same for a cart that would come there by itself within this time, s: it is not to roll
    /// on to the hard limit.
    pub coast_s: f64,
    /// Beyond this one the plant is stopped, m.
    pub hard_limit_m: f64,
    /// How far the pole may lean before the plant is stopped, degrees; `None`: all around.
    pub angle_limit_deg: Option<f64>,
    /// The plant is stopped when no state came for so many periods.
    pub stale_periods: f64,
    /// It is stopped when the position jumps further from one state to the next, m,
    pub jump_m: f64,
    /// or the angle, degrees: a potentiometer's stands still for up to 0.09 s beside its gap.
    pub jump_deg: f64,
    /// It is stopped when the device repeats another command than was sent for so many states.
    pub echo_states: u32,
    /// It is stopped when more frames than this fail their checksum within a second.
    pub checksum_errors_per_s: u32,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            slew_per_s: Some(20.0),
            soft_limit_m: 0.17,
            coast_s: 0.1,
            hard_limit_m: 0.188,
            angle_limit_deg: None,
            stale_periods: 3.0,
            jump_m: 0.03,
            jump_deg: 120.0,
            echo_states: 3,
            checksum_errors_per_s: 5,
        }
    }
}

impl Check for Params {
    fn check(&self, c: &mut Checker<'_>) {
        if let Some(slew) = self.slew_per_s {
            c.range("slew_per_s", slew, 0.1..=1000.0);
        }
        c.range("soft_limit_m", self.soft_limit_m, 0.001..=100.0);
        c.range("coast_s", self.coast_s, 0.0..=2.0);
        c.range("hard_limit_m", self.hard_limit_m, 0.001..=100.0);
        c.demand(
            // One that is beyond its own range is told already.
            self.soft_limit_m < self.hard_limit_m || !(0.001..=100.0).contains(&self.hard_limit_m),
            "soft_limit_m",
            self.soft_limit_m,
            "less than hard_limit_m, or nothing turns the plant around before it is stopped",
        );
        if let Some(limit) = self.angle_limit_deg {
            c.range("angle_limit_deg", limit, 1.0..=180.0);
        }
        c.range("stale_periods", self.stale_periods, 1.5..=10.0);
        c.range("jump_m", self.jump_m, 1e-4..=10.0);
        c.range("jump_deg", self.jump_deg, 1.0..=180.0);
        c.count("echo_states", self.echo_states, 2..=50);
        c.count("checksum_errors_per_s", self.checksum_errors_per_s, 1..=1000);
    }
}

/// What the plant's guard allows at the moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Standing {
    /// Nothing: nobody armed it.
    #[default]
    Disarmed,
    /// What the limits allow.
    Armed,
    /// Nothing, for this reason, until a person clears it.
    Latched(Fault),
}

/// A state as it came from the device.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// The plant's state, SI.
    pub state: State,
    /// When it came, by this computer's clock.
    pub at: Seconds,
    /// The device's own time, if it has one.
    pub device: Option<Seconds>,
    /// The command that the device holds, in its own unit, if it says so.
    pub held: Option<i64>,
    /// That the device stopped by itself, and why.
    pub stopped: Option<&'static str>,
}

/// What the caller wants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// The action, in the plant's unit.
    pub action: f64,
    /// When it was wanted.
    pub at: Seconds,
    /// Whether a hand is on the switch that enables the motor.
    pub is_enabled: bool,
}

/// Damaged frames of the last second that are remembered; more are a fault in any case.
const REMEMBERED: usize = 64;

/// The guard of one plant.
#[derive(Clone, Debug)]
pub struct Warden {
    params: Params,
    /// The largest action, in the plant's unit.
    limit: f64,
    /// The time between two states.
    period: Seconds,
    standing: Standing,
    last: Option<Observation>,
    /// The latest time that this guard was told.
    now: Option<Seconds>,
    /// The action that was allowed last.
    action: f64,
    /// The commands that were sent last, in the device's unit, newest first.
    sent: [Option<i64>; 2],
    /// States in a row whose held command was none of these.
    wrong_echoes: u32,
    damaged: Vec<Seconds>,
    stuck: Stuck,
}

/// What suggests that a sensor is stuck.
#[derive(Clone, Copy, Debug, Default)]
struct Stuck {
    /// How long the cart was pushed without a change of its position.
    pushed: Seconds,
    /// How far the cart has moved without a change of the angle, m.
    moved: f64,
}

impl Warden {
    /// The guard of a plant with actions up to ± `limit` and a state each `period`.
    #[must_use]
    pub fn new(params: Params, limit: f64, period: Seconds) -> Self {
        Self {
            params,
            limit,
            period,
            standing: Standing::Disarmed,
            last: None,
            now: None,
            action: 0.0,
            sent: [None; 2],
            wrong_echoes: 0,
            damaged: Vec::with_capacity(REMEMBERED),
            stuck: Stuck::default(),
        }
    }

    /// What it allows at the moment.
    #[must_use]
    pub const fn standing(&self) -> Standing {
        self.standing
    }

    /// The latest state.
    #[must_use]
    pub const fn latest(&self) -> Option<&Observation> {
        self.last.as_ref()
    }

    /// Arms, because a person asked for it at `now`.
    ///
    /// # Errors
    /// The fault that is latched, or that the plant's state is not known or not allowed.
    pub fn arm(&mut self, now: Seconds) -> Result<(), Fault> {
        self.pass(now);
        if let Standing::Latched(fault) = self.standing {
            return Err(fault);
        }
        let Some(last) = self.last else { return Err(Fault::Stale(f64::INFINITY)) };
        self.judge_age(now).map_or(Ok(()), Err)?;
        self.judge_place(&last.state).map_or(Ok(()), Err)?;
        self.standing = Standing::Armed;
        self.stuck = Stuck::default();
        self.action = 0.0;
        self.wrong_echoes = 0;
        Ok(())
    }

    /// From now on nothing is allowed, and nothing is wrong either.
    pub fn disarm(&mut self) {
        if self.standing == Standing::Armed {
            self.standing = Standing::Disarmed;
        }
        self.action = 0.0;
    }

    /// A fault, or the emergency stop. The first of several stays: it is the cause.
    pub fn latch(&mut self, fault: Fault) {
        if !matches!(self.standing, Standing::Latched(_)) {
            self.standing = Standing::Latched(fault);
        }
        self.action = 0.0;
    }

    /// A person has seen the fault. It does not arm.
    pub fn clear(&mut self) {
        if matches!(self.standing, Standing::Latched(_)) {
            self.standing = Standing::Disarmed;
        }
    }

    /// The link is gone, or new: nothing that was known of the device holds any more.
    pub fn forget(&mut self) {
        self.disarm();
        self.last = None;
        self.sent = [None; 2];
        self.wrong_echoes = 0;
        self.damaged.clear();
    }

    /// A state came.
    pub fn observe(&mut self, seen: Observation) {
        self.pass(seen.at);
        let stuck = self.judge_sensors(&seen);
        let fault = self.judge_state(&seen).or_else(|| self.judge_echo(&seen)).or(stuck);
        self.last = Some(seen);
        if let Some(fault) = fault {
            self.trip(fault);
        }
    }

    /// A frame came that was damaged.
    pub fn damaged(&mut self, now: Seconds) {
        self.pass(now);
        self.damaged.retain(|at| (now - *at).0 < 1.0);
        if self.damaged.len() < REMEMBERED {
            self.damaged.push(now);
        }
        let count = u32::try_from(self.damaged.len()).unwrap_or(u32::MAX);
        if count > self.params.checksum_errors_per_s {
            self.trip(Fault::Checksums(count));
        }
    }

    /// Time went on to `now` without anything from the device.
    pub fn pass(&mut self, now: Seconds) {
        let before = self.now.replace(now);
        if let Some(gap) = before.map(|before| (now - before).0)
            && gap > CLOCK_JUMP.0
        {
            self.trip(Fault::Clock(gap));
        }
        if self.last.is_some()
            && let Some(fault) = self.judge_age(now)
        {
            self.trip(fault);
        }
    }

    /// The action that may go to the plant at `now`, in the plant's unit.
    pub fn allow(&mut self, wanted: Option<Wanted>, now: Seconds) -> f64 {
        self.pass(now);
        let Some(wanted) = wanted.filter(|wanted| wanted.is_enabled && self.is_fresh(wanted, now))
        else {
            // Nobody's wish, or one that is too old: a stop takes no slew.
            self.action = 0.0;
            return 0.0;
        };
        if self.standing != Standing::Armed {
            self.action = 0.0;
            return 0.0;
        }
        if !wanted.action.is_finite() {
            self.latch(Fault::Action);
            return 0.0;
        }
        let saturated = wanted.action.clamp(-self.limit, self.limit);
        let slewed = self.slewed(saturated);
        self.action = self.inward(slewed);
        self.action
    }

    /// The command that stands for the allowed action was sent, in the device's unit.
    pub fn sent(&mut self, command: i64) {
        if self.sent[0] != Some(command) {
            self.sent = [Some(command), self.sent[0]];
        }
    }

    /// An armed plant is stopped for `fault`; of one that is not, nothing but a reset matters
    /// later.
    fn trip(&mut self, fault: Fault) {
        if self.standing == Standing::Armed {
            self.latch(fault);
        }
    }

    /// Whether the caller still means it: one that stands still wants nothing.
    fn is_fresh(&self, wanted: &Wanted, now: Seconds) -> bool {
        let age = (now - wanted.at).0;
        (0.0..=self.params.stale_periods * self.period.0).contains(&age)
    }

    /// `wanted`, as far as the slew allows to go there from the last action in a period.
    /// Towards 0 it is free.
    fn slewed(&self, wanted: f64) -> f64 {
        let Some(slew) = self.params.slew_per_s else { return wanted };
        let step = slew * self.limit * self.period.0;
        // A push to the other side begins at 0.
        let from = if wanted * self.action > 0.0 { self.action } else { 0.0 };
        if wanted.abs() <= from.abs() { wanted } else { wanted.clamp(from - step, from + step) }
    }

    /// `wanted`, but beyond the soft limit, or on the way there, only if it points inward.
    fn inward(&self, wanted: f64) -> f64 {
        let Some([position, velocity, ..]) = self.last.as_ref().map(|seen| &seen.state[..]) else {
            return 0.0;
        };
        let soft = self.params.soft_limit_m;
        let rolls_to = position + velocity * self.params.coast_s;
        let is_beyond = [*position, rolls_to].iter().any(|x| x.abs() > soft && wanted * x > 0.0);
        // One that still rolls outward there, or on to the hard limit, is braked.
        let is_far = position.abs() > soft || rolls_to.abs() > self.params.hard_limit_m;
        let is_leaving = is_far && velocity * position > 0.0;
        let part = if is_leaving { (velocity.abs() / BRAKED_FULLY).min(1.0) } else { 0.0 };
        let brake = -position.signum() * part * self.limit;
        let allowed = if is_beyond { 0.0 } else { wanted };
        if allowed.abs() < brake.abs() { brake } else { allowed }
    }

    /// What is wrong with the age of the latest state.
    fn judge_age(&self, now: Seconds) -> Option<Fault> {
        let age = (now - self.last.as_ref()?.at).0;
        // Written so that an age that is no number is too old.
        let is_fresh = age <= self.params.stale_periods * self.period.0;
        (!is_fresh).then_some(Fault::Stale(age * 1e3))
    }

    /// What is wrong with where the plant is.
    fn judge_place(&self, state: &State) -> Option<Fault> {
        if !state.is_finite() {
            return Some(Fault::State);
        }
        let position = state.first().copied().unwrap_or(0.0);
        if position.abs() > self.params.hard_limit_m {
            return Some(Fault::Position(position));
        }
        let angle = wrapped(state.get(2).copied().unwrap_or(0.0)).to_degrees();
        let is_beyond = self.params.angle_limit_deg.is_some_and(|limit| angle.abs() > limit);
        is_beyond.then_some(Fault::Angle(angle))
    }

    /// What is wrong with a state, by itself and after the one before.
    fn judge_state(&self, seen: &Observation) -> Option<Fault> {
        if let Some(why) = seen.stopped {
            return Some(Fault::Device(why));
        }
        let wrong = self.judge_place(&seen.state);
        let Some(last) = self.last.as_ref().filter(|last| last.state.is_finite()) else {
            return wrong;
        };
        if let (Some(before), Some(now)) = (last.device, seen.device)
            && let passed = (now - before).0
            && !(passed > 0.0 && passed <= CLOCK_JUMP.0)
        {
            // Ahead of us it is when this computer slept: its own clock does not count that.
            return Some(if passed > 0.0 { Fault::Clock(passed) } else { Fault::Reset });
        }
        let change = |index: usize| {
            let value = |state: &State| state.get(index).copied().unwrap_or(0.0);
            value(&seen.state) - value(&last.state)
        };
        let moved = change(0);
        if moved.abs() > self.params.jump_m {
            return Some(Fault::PositionJump(moved.abs()));
        }
        let turned = wrapped(change(2)).to_degrees();
        if turned.abs() > self.params.jump_deg {
            return Some(Fault::AngleJump(turned.abs()));
        }
        wrong
    }

    /// What is wrong with sensors whose readings do not change at all.
    fn judge_sensors(&mut self, seen: &Observation) -> Option<Fault> {
        let last = self.last.as_ref()?;
        let (&[x, _, theta, ..], &[x_before, _, theta_before, ..]) =
            (&seen.state[..], &last.state[..])
        else {
            return None;
        };
        let is_pushed = self.action.abs() > PUSHED * self.limit;
        let stands = x == x_before && x.abs() < self.params.soft_limit_m;
        let Stuck { pushed, moved } = self.stuck;
        self.stuck = Stuck {
            pushed: if is_pushed && stands { pushed + self.period } else { Seconds(0.0) },
            moved: if theta == theta_before { moved + (x - x_before).abs() } else { 0.0 },
        };
        if self.stuck.pushed > STUCK_FOR {
            return Some(Fault::PositionStuck);
        }
        (self.stuck.moved > STUCK_OVER_M).then_some(Fault::AngleStuck)
    }

    /// What is wrong with the command that the device holds. One that was sent a moment ago
    /// may not have arrived yet.
    fn judge_echo(&mut self, seen: &Observation) -> Option<Fault> {
        let (Some(held), Some(sent)) = (seen.held, self.sent[0]) else { return None };
        if self.sent.contains(&Some(held)) {
            self.wrong_echoes = 0;
            return None;
        }
        self.wrong_echoes += 1;
        let is_enough = self.wrong_echoes >= self.params.echo_states;
        is_enough.then_some(Fault::Echo { held, sent })
    }
}

/// A cart that is pushed with this part of the largest action moves,
const PUSHED: f64 = 0.3;
/// within this time.
const STUCK_FOR: Seconds = Seconds(0.5);
/// A pole hangs no more still than this while its cart moves, m.
const STUCK_OVER_M: f64 = 0.15;
/// A cart that rolls on beyond the soft limit as fast as this is braked by the largest action, and
/// a slower one by less, m/s.
const BRAKED_FULLY: f64 = 0.1;
/// A pause of the caller that no scheduler explains.
const CLOCK_JUMP: Seconds = Seconds(1.0);

#[cfg(test)]
#[path = "warden_tests.rs"]
mod tests;
