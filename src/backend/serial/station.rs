//! A real plant with all that is done at it, without its port: a pure function of time, bytes and
//! wishes.
//!
//! The [`Driver`] speaks with the device. The station decides what it is to want at each state:
//! nothing, what the caller wants, the return to the middle, or what a calibration needs.
//!
//! ```text
//! wishes (a person, the control cycle) ─▶ Station ─▶ Driver ─▶ Warden ─▶ bytes
//!                 Look ◀─────────────────────┘ ▲
//!                                              └── bytes, time
//! ```

mod look;

use jiff::Timestamp;

use super::Params;
use super::calibration::{self, Procedure, Sight};
use super::centre::{Centre, Pole};
use super::driver::{Driver, NotArmed};
use super::shelf::{Calibration, Uncalibrated, current};
use crate::backend::safety::warden::{Fault, Standing, Wanted};
use crate::plant::cart_pole;
use crate::signal::Seconds;
pub use look::{Calibrating, Duty, Grip, Look};

/// What a person, or the control cycle, asks of a station.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wish {
    /// The motor may follow.
    Arm,
    /// It may not any more.
    Disarm,
    /// The emergency stop.
    Stop,
    /// The motor must stop for this fault, which others than its own guard have found.
    Latch(Fault),
    /// The fault was seen.
    Clear,
    /// The device is to look for its ends.
    Home,
    /// A calibration is to begin,
    Calibrate,
    /// its question has the answer yes,
    Yes,
    /// or no,
    No,
    /// or it is to end.
    Cancel,
    /// The cart is to go to the middle.
    Return(Pole),
    /// The motor is to rest.
    Rest,
}

/// What is on, with its procedure.
enum Work {
    Rest,
    Follow,
    Return { centre: Centre, is_there: bool },
    Calibrate(Box<Procedure>),
}

/// The plant as the station knows it.
#[derive(Clone, Debug)]
pub struct About {
    /// The device's lasting name.
    pub device: String,
    /// The time between two states.
    pub period: Seconds,
    /// The largest action, in the plant's unit.
    pub limit: f64,
    /// The cart-pole.
    pub plant: cart_pole::Params,
    /// The calibration that was found for the device.
    pub found: Option<Calibration>,
    /// The date and time, until the station is told a later one.
    pub now: Timestamp,
}

/// One real plant.
pub struct Station {
    /// As the profile has it, without the calibration.
    params: Params,
    about: About,
    driver: Driver,
    work: Work,
    enabled: Option<Seconds>,
    /// That hand was there when the motor was armed.
    must_let_go: bool,
    refused: Option<NotArmed>,
    wanted: Option<(f64, Seconds)>,
    answered: u64,
    applied: f64,
    /// A calibration that was just made, to be stored.
    fresh: Option<Calibration>,
}

/// A hand that was on the switch so long ago may be off it.
const HELD: Seconds = Seconds(0.15);

impl Station {
    /// A station whose device is not there yet.
    #[must_use]
    pub fn new(params: &Params, about: About) -> Self {
        let driver =
            Driver::new(&calibrated(params, about.found.as_ref()), about.period, about.limit);
        Self {
            params: params.clone(),
            driver,
            about,
            work: Work::Rest,
            enabled: None,
            must_let_go: false,
            refused: None,
            wanted: None,
            answered: 0,
            applied: 0.0,
            fresh: None,
        }
    }

    /// The port is open.
    pub fn opened(&mut self, now: Seconds) {
        self.rest();
        self.driver.opened(now);
    }

    /// The port is gone, for this reason.
    pub fn lost(&mut self, why: impl Into<String>) {
        self.rest();
        self.driver.lost(why);
    }

    /// Takes bytes that were read at `now`, and lets time pass.
    pub fn read(&mut self, bytes: &[u8], now: Seconds) {
        self.driver.read(bytes, now);
        self.driver.pass(now);
        let is_off = self.driver.standing() != Standing::Armed;
        if is_off && matches!(self.work, Work::Follow | Work::Return { .. }) {
            self.rest();
        }
    }

    /// A hand is on the switch at `now`, or is not.
    pub const fn enable(&mut self, is_held: bool, now: Seconds) {
        self.enabled = if is_held { Some(now) } else { None };
        self.must_let_go &= is_held;
    }

    /// The caller wants `action` from `now` on.
    pub fn want(&mut self, action: f64, now: Seconds) {
        if !matches!(self.work, Work::Calibrate(_)) {
            self.work = Work::Follow;
            self.wanted = Some((action, now));
        }
    }

    /// Somebody wishes something.
    pub fn obey(&mut self, wish: Wish, now: Seconds) {
        match wish {
            Wish::Arm => {
                // Arming alone never moves a cart, whatever the hand was left on.
                self.must_let_go = self.enabled.is_some();
                self.refused = self.arm(now).err();
            }
            Wish::Disarm => {
                self.rest();
                self.driver.disarm(now);
            }
            Wish::Stop => {
                self.cancel();
                self.driver.emergency(now);
            }
            Wish::Latch(fault) => {
                self.cancel();
                self.driver.latch(fault, now);
            }
            Wish::Clear => {
                self.refused = None;
                self.driver.clear();
            }
            Wish::Home => self.refused = self.driver.home(now).err(),
            Wish::Calibrate => self.calibrate(now),
            Wish::Yes => self.answer_question(true, now),
            Wish::No => self.answer_question(false, now),
            Wish::Cancel => {
                self.cancel();
                self.driver.disarm(now);
            }
            Wish::Return(pole) => self.go_back(pole),
            Wish::Rest => {
                if !matches!(self.work, Work::Calibrate(_)) {
                    self.rest();
                }
            }
        }
    }

    /// The date and time are `now`: a program may run for days, and a computer may sleep.
    pub const fn date(&mut self, now: Timestamp) {
        self.about.now = now;
    }

    /// Whoever asked for something is told why not.
    pub const fn refuse(&mut self, why: NotArmed) {
        self.refused = Some(why);
    }

    /// The device whose port is about to be opened is called `device`; `found` is its calibration.
    pub fn meet(&mut self, device: String, found: Option<Calibration>) {
        // One that could not be kept counts all the same for the device that it was made at.
        if device == self.about.device && self.about.found.is_some() {
            return;
        }
        self.about.device = device;
        self.about.found = found;
        self.driver.set_scales(&calibrated(&self.params, self.about.found.as_ref()).scales);
    }

    /// This program stood still for so long, and the motor's guard has stopped it.
    pub fn stood_still(&mut self, gap: Seconds, now: Seconds) {
        self.driver.latch(Fault::Clock(gap.0), now);
    }

    /// Nobody would stop the motor any more if this program died.
    pub fn unguarded(&mut self, now: Seconds) {
        self.driver.latch(Fault::Unguarded, now);
    }

    /// Whether a state waits for its command, and the command for the caller's wish: there is
    /// none that is younger than the state.
    #[must_use]
    pub fn waits_for_caller(&self) -> bool {
        let Some((_, at)) = self.driver.latest() else { return false };
        let is_told = self.wanted.is_some_and(|(_, wanted)| wanted >= at);
        self.driver.owes_command() && matches!(self.work, Work::Follow) && !is_told
    }

    /// Writes the command for the latest state, if that has none yet.
    pub fn answer(&mut self, now: Seconds) {
        if !self.driver.owes_command() {
            return;
        }
        let wanted = match self.decide(now) {
            Some((action, at)) => Wanted { action, at, is_enabled: self.is_enabled(now) },
            None => Wanted { action: 0.0, at: now, is_enabled: false },
        };
        self.driver.want(wanted);
        if let Some(applied) = self.driver.answer(now) {
            self.applied = applied;
        }
        self.answered = self.driver.received().states;
    }

    /// What is to be written to the port now.
    pub fn take_output(&mut self) -> Vec<u8> {
        self.driver.take_output()
    }

    /// A calibration that was just made and is to be stored.
    pub const fn take_calibration(&mut self) -> Option<Calibration> {
        self.fresh.take()
    }

    /// The device that is driven.
    #[must_use]
    pub const fn driver(&self) -> &Driver {
        &self.driver
    }

    /// All that others may know.
    #[must_use]
    pub fn look(&self, now: Seconds) -> Look {
        Look {
            device: self.about.device.clone(),
            stage: self.driver.stage().clone(),
            standing: self.driver.standing(),
            stopped: self.driver.stopped(),
            is_homed: self.driver.is_homed(),
            is_stuck: self.driver.is_stuck(now),
            calibrated: self.calibration().map(|found| found.at.clone()),
            duty: match &self.work {
                Work::Rest => Duty::Rest,
                Work::Follow => Duty::Follow,
                Work::Return { centre, is_there } => {
                    Duty::Return { is_there: *is_there, trouble: centre.trouble() }
                }
                Work::Calibrate(procedure) => Duty::Calibrate(Calibrating {
                    step: procedure.step(),
                    progress: procedure.progress(),
                    prompt: procedure.prompt(),
                }),
            },
            grip: self.grip(now),
            refused: self.refused.or_else(|| self.driver.refused()),
            latest: self.driver.latest(),
            states: self.driver.received().states,
            answered: self.answered,
            applied: self.applied,
            lost: self.driver.received().lost,
            counts: self.driver.counts(),
        }
    }

    fn grip(&self, now: Seconds) -> Grip {
        let is_held = self.enabled.is_some_and(|at| now - at <= HELD);
        match (self.params.hold_to_enable, is_held) {
            (true, false) => Grip::Off,
            (true, true) if self.must_let_go => Grip::LeftOn,
            _ => Grip::On,
        }
    }

    fn is_enabled(&self, now: Seconds) -> bool {
        self.grip(now) == Grip::On
    }

    /// The calibration that counts.
    fn calibration(&self) -> Result<&Calibration, Uncalibrated> {
        let About { found, now, .. } = &self.about;
        current(found.as_ref(), &self.params, *now, self.params.calibration_days)
    }

    fn arm(&mut self, now: Seconds) -> Result<(), NotArmed> {
        // What calibrates may be armed before it is calibrated: it is how that is done.
        let calibrates = match &self.work {
            Work::Calibrate(procedure) => procedure.trouble().is_none(),
            _ => false,
        };
        if !calibrates {
            self.calibration()?;
            self.rest();
        }
        self.driver.arm(now)
    }

    fn rest(&mut self) {
        self.cancel();
        self.wanted = None;
        self.work = Work::Rest;
    }

    fn cancel(&mut self) {
        if let Work::Calibrate(procedure) = &mut self.work {
            procedure.cancel();
        }
    }

    fn go_back(&mut self, pole: Pole) {
        if matches!(self.work, Work::Calibrate(_)) {
            return;
        }
        let About { limit, plant, .. } = &self.about;
        let centre = Centre::new(&self.params.centre, pole, *limit, plant, &self.params);
        self.work = Work::Return { centre, is_there: false };
    }

    fn calibrate(&mut self, now: Seconds) {
        self.rest();
        self.refused = None;
        self.driver.disarm(now);
        let about = calibration::About {
            device: self.about.device.clone(),
            at: self.about.now.to_string(),
            limit: self.about.limit,
            half_track_m: self.about.plant.track_length_m.map(|length| length / 2.0),
        };
        let params = calibrated(&self.params, self.about.found.as_ref());
        self.work = Work::Calibrate(Box::new(Procedure::new(&params, about)));
    }

    fn answer_question(&mut self, yes: bool, now: Seconds) {
        let Work::Calibrate(procedure) = &mut self.work else { return };
        if yes {
            procedure.go_on();
        } else {
            procedure.no();
        }
        if let Some(found) = procedure.result().cloned() {
            // Readings mean something else from now on: nobody is armed over that.
            self.driver.disarm(now);
            self.driver.set_scales(&calibrated(&self.params, Some(&found)).scales);
            self.about.found = Some(found.clone());
            self.fresh = Some(found);
            self.work = Work::Rest;
        }
    }

    /// What is wanted at the latest state, and since when.
    fn decide(&mut self, now: Seconds) -> Option<(f64, Seconds)> {
        let is_enabled = self.is_enabled(now);
        let (state, _) = self.driver.latest()?;
        match &mut self.work {
            Work::Rest => None,
            Work::Follow => self.wanted,
            Work::Return { centre, is_there } => {
                // Without a hand on the switch time does not count against anybody.
                let passed = if is_enabled { self.about.period } else { Seconds(0.0) };
                let wish = centre.see(&state, passed);
                *is_there = wish.is_there;
                Some((wish.action, now))
            }
            Work::Calibrate(procedure) => {
                let sight = Sight {
                    frame: self.driver.frame()?,
                    is_homed: self.driver.is_homed(),
                    is_armed: self.driver.standing() == Standing::Armed && is_enabled,
                    now,
                };
                match procedure.see(sight) {
                    calibration::Wish::Nothing => None,
                    calibration::Wish::Drive(action) => Some((action, now)),
                    calibration::Wish::Home => {
                        self.refused = self.driver.home(now).err();
                        None
                    }
                }
            }
        }
    }
}

/// `params` with the scales that were `found`.
fn calibrated(params: &Params, found: Option<&Calibration>) -> Params {
    let mut params = params.clone();
    if let Some(found) = found.filter(|found| found.fits(&params)) {
        found.apply(&mut params.scales);
    }
    params
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::serial::bench::{about, params};
    use crate::backend::serial::shelf::MadeFor;
    use crate::backend::wire::Format;

    #[test]
    fn a_calibration_grows_old_while_the_program_runs() {
        let params = params(Format::Cobs1);
        let found = Calibration {
            device: "usb-robot".to_owned(),
            at: about().now.to_string(),
            made_for: MadeFor::of(&params),
            hanging: 0.0,
            angle_invert: true,
            position_invert: false,
            motor_invert: false,
        };
        let mut station = Station::new(&params, About { found: Some(found), ..about() });
        let calibrated = |station: &Station| station.look(Seconds(0.0)).calibrated;
        station.date("2026-03-21T09:00:00Z".parse().unwrap());
        assert_eq!(calibrated(&station), Ok(about().now.to_string()));
        station.date("2026-03-21T10:00:00Z".parse().unwrap());
        assert_eq!(calibrated(&station), Err(Uncalibrated::Stale));
    }

    #[test]
    fn a_hand_that_never_let_go_of_the_switch_enables_nothing_after_arming() {
        let mut station = Station::new(&params(Format::Cobs1), about());
        let grip = |station: &Station, now| station.look(Seconds(now)).grip;
        station.enable(true, Seconds(0.0));
        assert_eq!(grip(&station, 0.0), Grip::On);
        station.obey(Wish::Arm, Seconds(0.01));
        station.enable(true, Seconds(0.02));
        assert_eq!(grip(&station, 0.02), Grip::LeftOn);
        station.enable(false, Seconds(0.03));
        assert_eq!(grip(&station, 0.03), Grip::Off);
        station.enable(true, Seconds(0.04));
        assert_eq!(grip(&station, 0.04), Grip::On);
        station.enable(false, Seconds(0.05));
        station.obey(Wish::Arm, Seconds(0.06));
        station.enable(true, Seconds(0.07));
        assert_eq!(grip(&station, 0.07), Grip::On, "the usual way");
    }

    #[test]
    fn what_was_refused_is_forgotten_once_its_reason_was_seen() {
        let mut station = Station::new(&params(Format::Cobs1), about());
        let refused = |station: &Station| station.look(Seconds(0.0)).refused;
        for seen in [Wish::Clear, Wish::Calibrate] {
            station.obey(Wish::Arm, Seconds(0.0));
            assert!(refused(&station).is_some());
            station.obey(seen, Seconds(0.0));
            assert_eq!(refused(&station), None, "{seen:?}");
        }
    }
}
