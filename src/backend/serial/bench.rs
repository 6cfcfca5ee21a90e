//! A driver and an emulated device, on virtual time.

use super::Params;
use super::desk::{Latency, View};
use super::driver::{Driver, Stage};
use super::scales;
use super::station::{About, Station};
use crate::backend::emulator::faults::Faults;
use crate::backend::emulator::{self, Emulator};
use crate::backend::safety::warden::Wanted;
use crate::backend::wire::Format;
use crate::plant::cart_pole;
use crate::signal::Seconds;

/// Both formats.
pub(super) const FORMATS: [Format; 2] = [Format::Sensorsini31, Format::Cobs1];

/// The largest action of the emulated robot, N.
pub(super) const LIMIT: f64 = 1.77;
/// A state comes each.
pub(super) const PERIOD: Seconds = Seconds(0.02);
/// How often whoever owns the port moves bytes.
pub(super) const STEP: f64 = 0.001;

pub(super) fn params(format: Format) -> Params {
    let angle = scales::Angle { invert: true, ..scales::Angle::default() };
    let scales = scales::Params { angle, ..scales::Params::default() };
    Params { format, scales, ..Params::default() }
}

/// What is known of a plant whose device is not there yet.
pub(super) fn view() -> View {
    let station = Station::new(&params(Format::Cobs1), about());
    let look = station.look(Seconds(0.0));
    View { look, latency: Latency::default(), not_kept: None, is_first: false }
}

/// The emulated robot, which nobody has calibrated.
pub(super) fn about() -> About {
    About {
        device: "usb-robot".to_owned(),
        period: PERIOD,
        limit: LIMIT,
        plant: cart_pole::Params::default(),
        found: None,
        now: "2026-03-14T09:26:53Z".parse().unwrap(),
    }
}

/// A driver and a device, on virtual time.
pub(super) struct Bench {
    pub(super) driver: Driver,
    pub(super) device: Emulator,
    pub(super) now: Seconds,
    /// What the person's and the robot's controls want; `None`: the hand is off the switch.
    pub(super) wish: Option<f64>,
    was_plugged: bool,
}

impl Bench {
    pub(super) fn new(format: Format, faults: &Faults, seed: u64) -> Self {
        let device = emulator::Params { format, ..emulator::Params::default() };
        Self::of(&params(format), PERIOD, Emulator::new(&device, faults, seed))
    }

    /// A driver of `params` at this device, of which it wants a state each `period`.
    pub(super) fn of(params: &Params, period: Seconds, device: Emulator) -> Self {
        let mut driver = Driver::new(params, period, LIMIT);
        driver.opened(Seconds(0.0));
        Self { driver, device, now: Seconds(0.0), wish: None, was_plugged: true }
    }

    /// Lets `time_s` pass.
    pub(super) fn go(&mut self, time_s: f64) {
        let wish = self.wish;
        self.steer(time_s, |_, _| wish);
    }

    /// Lets `time_s` pass, and asks `hand` what it wants at each state.
    pub(super) fn steer(
        &mut self,
        time_s: f64,
        mut hand: impl FnMut(&mut Driver, Seconds) -> Option<f64>,
    ) {
        let end = self.now + Seconds(time_s);
        while self.now < end {
            self.now = self.now + Seconds(STEP);
            let is_plugged = self.device.is_plugged();
            if self.was_plugged && !is_plugged {
                self.driver.lost("unplugged");
            } else if is_plugged && !self.was_plugged {
                self.driver.opened(self.now);
            }
            self.was_plugged = is_plugged;
            let written = self.driver.take_output();
            let read = self.device.advance(self.now, &written);
            self.driver.read(&read, self.now);
            self.driver.pass(self.now);
            if self.driver.owes_command() {
                if let Some(action) = hand(&mut self.driver, self.now) {
                    self.driver.want(Wanted { action, at: self.now, is_enabled: true });
                }
                self.driver.answer(self.now);
            }
        }
    }

    /// Until it is ready, homed and armed.
    pub(super) fn armed(format: Format) -> Self {
        let mut bench = Self::new(format, &Faults::default(), 1);
        bench.home();
        bench.driver.arm(bench.now).unwrap();
        bench
    }

    pub(super) fn home(&mut self) {
        self.go(1.5);
        assert_eq!(*self.driver.stage(), Stage::Ready);
        self.driver.home(self.now).unwrap();
        self.go(20.0);
        assert!(self.driver.is_homed(), "{:?}", self.driver.stage());
        self.go(0.5);
    }
}
