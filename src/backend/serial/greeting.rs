//! How a device is greeted: the motor stops first, then the device tells who it is, is configured,
//! and shows that its states make sense.

use std::collections::VecDeque;

use super::Params;
use crate::backend::wire::{Config, FirmwareConfig, Format, Order};
use crate::signal::Seconds;

/// The time between two orders. A board that still streams from before gets no two of them between
/// two states: its longest period is 50 ms.
const SPACING: Seconds = Seconds(0.06);
/// How long an answer may take.
const PATIENCE: Seconds = Seconds(0.5);
/// States in a row that must make sense.
const STATES: u32 = 10;

/// What a step waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Awaits {
    /// Nothing but its time.
    Time,
    /// The device's configuration or name.
    Identity,
    /// So many states that make sense.
    States,
}

/// What is written, and what must come before the next step.
#[derive(Clone, Copy, Debug)]
struct Step {
    order: Order,
    awaits: Awaits,
}

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// The device is to answer, or a moment to pass.
    Waits,
    /// This is to be written.
    Says(Order),
    /// The device is not what it should be, for this reason.
    Refused(&'static str),
    /// The device is there.
    Done,
}

/// A greeting under way.
#[derive(Clone, Debug, Default)]
pub struct Greeting {
    wanted: Option<Config>,
    steps: VecDeque<Step>,
    /// How long an answer may take.
    patience: Seconds,
    /// When the next order is due,
    due: Seconds,
    /// and when it was written.
    asked: Option<Seconds>,
    /// A state came since the last order, of a board that streams from before; `None`: it does
    /// not, as far as is known.
    state_came: Option<bool>,
    /// States in a row that made sense.
    sensible: u32,
    refused: Option<&'static str>,
}

impl Greeting {
    /// Begins at `now`, when the port was just opened, with a device that is to send a state each
    /// `period`.
    #[must_use]
    pub fn begin(params: &Params, period: Seconds, now: Seconds) -> Self {
        let wanted = config(params, period);
        Self {
            wanted: Some(wanted),
            steps: steps(params.format, wanted),
            // The states that are waited for need their time.
            patience: PATIENCE + period * f64::from(2 * STATES),
            due: now + Seconds(params.start_s),
            ..Self::default()
        }
    }

    /// Time goes on to `now`.
    pub fn pass(&mut self, now: Seconds) -> Progress {
        if let Some(why) = self.refused {
            return Progress::Refused(why);
        }
        let Some(step) = self.steps.front().copied() else { return Progress::Done };
        match self.asked {
            None if now < self.due => Progress::Waits,
            // One order after each state of a board that streams, unless its states stay away.
            None if self.state_came == Some(false) && now - self.due < PATIENCE => Progress::Waits,
            None => {
                self.asked = Some(now);
                let goes_on = step.order != Order::Stream(false);
                self.state_came = self.state_came.filter(|_| goes_on).map(|_| false);
                Progress::Says(step.order)
            }
            Some(_) if step.awaits == Awaits::Time => {
                self.next(now);
                Progress::Waits
            }
            Some(at) if now - at > self.patience => Progress::Refused(
                "the device does not answer: look at its power, its cable, its baud rate and its \
                 firmware",
            ),
            Some(_) => Progress::Waits,
        }
    }

    /// The device told its configuration.
    pub fn configured(&mut self, told: &Config, now: Seconds) {
        if self.wanted.is_some_and(|wanted| wanted.is_taken(told)) {
            self.identified(now);
        } else if self.awaits(Awaits::Identity) {
            self.refused = Some("the board did not take its configuration: switch it off and on");
        }
    }

    /// The device told its name.
    pub fn identified(&mut self, now: Seconds) {
        if self.awaits(Awaits::Identity) {
            self.next(now);
        }
    }

    /// The device sent a state, which made sense or did not.
    pub fn saw(&mut self, makes_sense: bool) {
        self.state_came = Some(true);
        if self.awaits(Awaits::States) {
            self.sensible = if makes_sense { self.sensible + 1 } else { 0 };
            if self.sensible >= STATES {
                self.steps.clear();
            }
        }
    }

    fn awaits(&self, what: Awaits) -> bool {
        self.asked.is_some() && self.steps.front().is_some_and(|step| step.awaits == what)
    }

    fn next(&mut self, now: Seconds) {
        self.steps.pop_front();
        self.asked = None;
        self.due = now + SPACING;
    }
}

fn config(params: &Params, period: Seconds) -> Config {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a reading, which the firmware keeps as f32"
    )]
    let angle_hanging = params.scales.angle.hanging as f32;
    let firmware = (params.format == Format::Sensorsini31).then_some(FirmwareConfig {
        sync: true,
        angle_hanging,
        average: params.average,
        correct_dynamics: false,
    });
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "2 to 50 ms, as the profile's check demands"
    )]
    let period_ms = (period.0 * 1e3).round() as u16;
    Config { period_ms, firmware }
}

/// The motor first.
fn steps(format: Format, wanted: Config) -> VecDeque<Step> {
    let step = |order, awaits| Step { order, awaits };
    let configure = Order::Configure(wanted);
    match format {
        Format::Sensorsini31 => VecDeque::from([
            step(Order::Stop, Awaits::Time),
            step(Order::Disarm, Awaits::Time),
            step(Order::Stream(false), Awaits::Time),
            step(configure, Awaits::Time),
            step(Order::Query, Awaits::Identity),
            step(Order::Stream(true), Awaits::States),
        ]),
        Format::Cobs1 => VecDeque::from([
            step(Order::Stop, Awaits::Time),
            step(Order::Query, Awaits::Identity),
            step(configure, Awaits::Time),
            step(Order::Stream(true), Awaits::States),
        ]),
    }
}
