//! The real plant of a session: chosen, opened, and stopped at the end.

use std::path::Path;

use super::panics::tell_later;
use super::session::{Company, usage};
use super::shutdown::Shutdown;
use super::{RunError, tell};
use crate::backend::safety::warden::Standing;
use crate::backend::safety::{Limits, Safe};
use crate::backend::serial::address::Address;
use crate::backend::serial::desk::{Desk, Latency, View};
use crate::backend::serial::driver::{Stage, Stopped};
use crate::backend::serial::pump::{Place, Pump};
use crate::backend::serial::station::{About, Wish};
use crate::backend::serial::wired::{Manner, Metronome, Wired};
use crate::backend::serial::{self};
use crate::backend::wire::Format;
use crate::clock::{self, Clock, WallClock};
use crate::operator::Choice;
use crate::profile::Profile;
use crate::record::sidecar::{Lateness, Served};
use crate::session::plan::Plan;
use crate::signal::Seconds;
use crate::tui::app::PlantDesk;
use crate::tui::plant::Facts;
use crate::tui::terminal::is_taken;

/// The folder of calibrations, among the sessions: no subject's name begins with a dot.
const SHELF: &str = ".calibrations";
/// How long a device that nobody watches may take to be there,
const APPEARS: Seconds = Seconds(10.0);
/// to find its ends,
const HOMES: Seconds = Seconds(45.0);
/// and to follow.
const ANSWERS: Seconds = Seconds(3.0);
/// Looked at, and wished for again, after this time.
const BETWEEN: Seconds = Seconds(0.1);

/// A real plant at its port.
pub(super) struct Real {
    /// None once it was stopped.
    pump: Option<Pump>,
    desk: Desk,
    clock: WallClock,
    manner: Manner,
    params: serial::Params,
    port: String,
    half_track: Option<f64>,
}

/// The device that `backend` names; none for the simulated plant.
///
/// # Errors
/// When there is no such backend, or this session may not have it.
pub(super) fn chosen(
    backend: &str,
    profile: &Profile,
    choice: &Choice,
    company: &Company,
) -> Result<Option<Address>, RunError> {
    let refused = |why: &str| Err(RunError::Usage(format!("--backend {backend}: {why}")));
    if backend == "simulated" {
        return match company {
            Company::Armed(_) => Err(RunError::Usage(
                "--arm is for a real plant: add --backend serial:PORT, or leave it out".to_owned(),
            )),
            _ => Ok(None),
        };
    }
    let Some(words) = backend.strip_prefix("serial:") else {
        return refused("is not known; give simulated, or serial:PORT for a real plant");
    };
    let address = words.parse::<Address>().map_err(|error| usage(&error))?;
    let Some(plant) = &profile.backend else {
        return refused(
            "this profile has no section `backend` and so no real plant; physical-cart-pole and \
             cobs-cart-pole have one",
        );
    };
    match company {
        Company::Headless => refused(
            "a real plant without a screen has to be armed by --arm; stay beside it, with a hand \
             on its power switch",
        ),
        Company::Attended(_) if plant.hold_to_enable && choice.device().is_none() => refused(
            "its motor moves only while a person holds a switch, and this operator has none: give \
             --operator keyboard, gamepad or mouse",
        ),
        _ => Ok(Some(address)),
    }
}

impl Real {
    /// The plant of `profile` at `address`, whose port is opened as soon as it is there.
    ///
    /// # Errors
    /// When no thread serves it. Without a screen also when it cannot be armed.
    pub(super) fn open(
        address: Address,
        profile: &Profile,
        choice: &Choice,
        company: &Company,
        logs: &Path,
    ) -> Result<Self, RunError> {
        let Some(mut params) = profile.backend.clone() else {
            return Err(RunError::Failed("the profile has no real plant".to_owned()));
        };
        let Some(plant) = profile.experiment.cart_pole().cloned() else {
            return Err(RunError::Failed("the profile's plant is no cart-pole".to_owned()));
        };
        let clock = match company {
            Company::Attended(keys) => keys.clock,
            Company::Headless | Company::Armed(_) => WallClock::start(),
        };
        if matches!(company, Company::Armed(_)) {
            // Who gave --arm stands beside it.
            params.hold_to_enable = false;
        }
        let switch = choice
            .device()
            .filter(|_| params.hold_to_enable)
            .and_then(|device| profile.operator.switch_name(device));
        let (tick, limit) = (profile.tick(), plant.force_limit_n);
        let half_track = plant.track_length_m.map(|length| length / 2.0);
        let manner = Manner {
            limit,
            period: tick,
            stale: tick * params.safety.stale_periods,
            push: params.push,
            push_time: Seconds(params.push_s),
            upright: params.upright_deg.to_radians(),
            switch,
        };
        let about = About {
            device: String::new(),
            period: tick,
            limit,
            plant,
            found: None,
            now: clock::today(),
        };
        let port = address.to_string();
        let place = Place { address, shelf: logs.join(SHELF) };
        let pump = Pump::start(&params, place, about, clock)
            .map_err(|error| RunError::Failed(error.to_string()))?;
        let desk = pump.desk().clone();
        let real = Self { pump: Some(pump), desk, clock, manner, params, port, half_track };
        if let Company::Armed(shutdown) = company
            && let Err(error) = real.arm(shutdown)
        {
            real.close();
            return Err(error);
        }
        Ok(real)
    }

    /// Homes and arms a plant that nobody watches at a screen.
    fn arm(&self, shutdown: &Shutdown) -> Result<(), RunError> {
        let is_ready = |view: &View| view.look.stage == Stage::Ready;
        self.wait(shutdown, APPEARS, None, is_ready, "the device does not become ready")?;
        let desk = &self.desk;
        desk.see(|view| view.look.calibrated.clone()).map_err(|why| {
            self.failed(&format!(
                "{why}; run this profile once without --headless, and press o, then c"
            ))
        })?;
        if !desk.see(|view| view.look.is_homed) {
            let begins = |view: &View| view.look.stage == Stage::Homing || view.look.is_homed;
            self.wait(shutdown, ANSWERS, Some(Wish::Home), begins, "homing does not begin")?;
            let is_homed = |view: &View| view.look.is_homed;
            self.wait(shutdown, HOMES, None, is_homed, "homing found no ends")?;
            self.wait(shutdown, APPEARS, None, is_ready, "it is not ready after homing")?;
        }
        let is_armed = |view: &View| view.look.standing == Standing::Armed;
        self.wait(shutdown, ANSWERS, Some(Wish::Arm), is_armed, "the motor does not follow")
    }

    /// Waits at most `patience` until something is true; wishes for it again and again, where a
    /// wish helps: at first the motor's guard may be starting, or a stop unconfirmed.
    fn wait(
        &self,
        shutdown: &Shutdown,
        patience: Seconds,
        wish: Option<Wish>,
        is_true: impl Fn(&View) -> bool,
        otherwise: &str,
    ) -> Result<(), RunError> {
        let desk = &self.desk;
        let end = self.clock.now() + patience;
        loop {
            if let Some(signal) = shutdown.signal() {
                return Err(RunError::Signal(signal));
            }
            let look = desk.view().look;
            // Where nothing is wished again, a refusal is the last word.
            let is_refused = wish.is_none() && look.refused.is_some();
            if is_refused || self.clock.now() >= end {
                let refused = look.refused.map(|why| why.to_string());
                return Err(self.failed(&match look.stage {
                    Stage::Closed(why) => why,
                    _ => refused.unwrap_or_else(|| otherwise.to_owned()),
                }));
            }
            if let Some(wish) = wish {
                desk.wish(wish);
            }
            if desk.wait(BETWEEN, |view| is_true(view).then_some(())).is_some() {
                return Ok(());
            }
        }
    }

    fn failed(&self, why: &str) -> RunError {
        RunError::Failed(format!("{}: {why}", self.port))
    }

    /// The plant for the control cycle, within its limits.
    pub(super) fn backend(&self) -> Safe {
        let Manner { limit, stale, .. } = self.manner;
        // The plant's own guard, which knows more, is to be heard first.
        let stale = stale * 2.0;
        let wired = Wired::new(self.desk.clone(), self.clock, self.manner.clone());
        Safe::new(Box::new(wired), Limits { action: limit, stale })
    }

    /// The clock of its states.
    pub(super) fn metronome(&self) -> Metronome {
        Metronome::new(self.desk.clone(), self.clock, self.manner.period)
    }

    /// What the screen needs of it.
    pub(super) fn at_the_screen(&self) -> PlantDesk {
        let safety = &self.params.safety;
        PlantDesk {
            desk: self.desk.clone(),
            facts: Facts {
                port: self.port.clone(),
                format: self.params.format,
                switch: self.manner.switch.clone(),
                homing: self.params.homing,
                soft_limit_m: safety.soft_limit_m,
                hard_limit_m: safety.hard_limit_m,
                half_track_m: self.half_track,
            },
        }
    }

    /// What `session.json` calls it.
    pub(super) fn name(&self) -> String {
        let look = self.desk.view().look;
        let calibrated =
            look.calibrated.map_or_else(|why| why.to_string(), |at| format!("calibrated {at}"));
        format!("{}, {calibrated}", look.device)
    }

    /// Stops the motor and closes the port, and tells how well the plant was served. A stop that
    /// is not confirmed is said aloud.
    pub(super) fn close(mut self) -> Served {
        let motor_is_off = self.stop();
        let View { look, latency, is_first, .. } = self.desk.view();
        let Latency { p50_us: p50, p99_us: p99, max_us: max } = latency;
        Served {
            states: look.states,
            lost: look.lost,
            latency_us: Lateness { p50, p99, max },
            real_time: is_first,
            motor_is_off,
        }
    }

    /// Stops the motor, and tells whether it is known to be off; if it is not, a person as well.
    fn stop(&mut self) -> bool {
        let Some(pump) = self.pump.take() else { return true };
        if self.desk.see(|view| view.look.stage == Stage::Homing) && !is_taken() {
            tell("waiting for the device to end its homing, which nothing can stop: hands off");
        }
        let is_off = matches!(pump.close(), Stopped::Confirmed | Stopped::No);
        if !is_off {
            tell_later(&format!(
                "THE STOP WAS NOT CONFIRMED by the device: {}",
                out_of_reach(self.params.format)
            ));
        }
        is_off
    }
}

impl Drop for Real {
    /// Whatever went wrong: the motor stops, and nobody is left in doubt whether it did.
    fn drop(&mut self) {
        self.stop();
    }
}

/// What to do about a motor that nobody can reach.
const fn out_of_reach(format: Format) -> &'static str {
    match format {
        Format::Sensorsini31 => {
            "this board keeps its last command for ever; if the cart moves, switch the motor's \
             supply off"
        }
        Format::Cobs1 => {
            "its own watchdog stops the motor; if the cart still moves, switch the supply off"
        }
    }
}

/// A rollout on a real plant waits until that is ready: a countdown of a tick at least.
pub(super) fn waits_for_the_plant(plan: &mut Plan) {
    plan.hold_ticks = plan.hold_ticks.max(1);
    plan.autonomous_hold_ticks = plan.autonomous_hold_ticks.max(1);
}
