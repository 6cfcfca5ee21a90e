//! The port's thread: moves bytes between a port and its station, keeps the motor's guard alive,
//! and finds the device again when it was unplugged.

use std::os::fd::AsFd;
use std::path::PathBuf;
use std::thread::JoinHandle;

use hdrhistogram::Histogram;

use super::Params;
use super::address::Address;
use super::desk::{Ask, Desk, Latency, Ring, Shown, View};
use super::driver::{NotArmed, Stage, Stopped};
use super::port::{Bell, Port};
use super::shelf;
use super::station::{About, Station, Wish};
use crate::backend::guard::{self, Guard, Stop, Watch, last_resort};
use crate::backend::priority::{self, Urgency};
use crate::backend::safety::warden::{Fault, Standing};
use crate::clock::{self, Clock, WallClock};
use crate::host::Host;
use crate::signal::Seconds;

/// Nobody waits longer than this for bytes: what is due in time is done in time.
const TURN: Seconds = Seconds(0.01);
/// Whoever looked at this very moment is shown the news after this time.
const SOON: Seconds = Seconds(0.001);
/// A device that is not there is looked for this often.
const SEARCH: Seconds = Seconds(0.25);
/// A device that was given up is greeted anew after this time.
const AGAIN: Seconds = Seconds(2.0);
/// A device that is not armed is given up after so long without a state.
const SILENCE: Seconds = Seconds(1.0);
/// A board that is busy takes so long to look at a stop, and its buffer does not hold two.
const QUIET: Seconds = Seconds(0.005);
/// How long a stop may take to be confirmed at the end.
const FAREWELL: Seconds = Seconds(0.4);
/// How long the end of homing is waited for.
const LONGEST: Seconds = Seconds(45.0);
/// Whoever was silent for this part of the guard's patience may already share the port with it.
const ALMOST: f64 = 0.9;

/// Where a station's device and its calibration are found.
#[derive(Clone, Debug)]
pub struct Place {
    /// The device.
    pub address: Address,
    /// The folder of calibrations.
    pub shelf: PathBuf,
}

/// A station at its port, with the thread that serves it.
#[derive(Debug)]
pub struct Pump {
    desk: Desk,
    thread: Option<JoinHandle<()>>,
}

impl Pump {
    /// Starts to serve the plant of `params` at `place`. The device is greeted as soon as it is
    /// there; `about` tells of the plant, but for what `place` tells.
    ///
    /// # Errors
    /// When no thread starts.
    pub fn start(
        params: &Params,
        place: Place,
        about: About,
        clock: WallClock,
    ) -> Result<Self, StartError> {
        let period = about.period;
        let station = Station::new(params, About { device: place.address.to_string(), ..about });
        let desk = Desk::new(station.look(clock.now()));
        let mut server = Server {
            stop: Stop::of(params.format),
            baud: params.baud.0,
            // Its own judgement of silence comes first.
            patience: Seconds(guard::PATIENCE.0.max(1.2 * params.safety.stale_periods * period.0)),
            period,
            place,
            host: Host::here(),
            clock,
            desk: desk.clone(),
            station,
            link: None,
            next_search: Seconds(0.0),
            beat_at: Seconds(0.0),
            seen_at: Seconds(0.0),
            latency_us: Histogram::new_with_max(10_000_000, 3).ok(),
            not_kept: None,
            is_first: false,
            shown: Shown::Yes,
            is_over: false,
        };
        let thread = std::thread::Builder::new()
            .name("coadapt-serial".to_owned())
            .spawn(move || server.serve())
            .map_err(StartError)?;
        Ok(Self { desk, thread: Some(thread) })
    }

    /// Where the station is looked at and wished from.
    #[must_use]
    pub fn desk(&self) -> &Desk {
        &self.desk
    }

    /// Stops the motor, closes the port, and tells whether the motor is known to be off.
    pub fn close(mut self) -> Stopped {
        if self.end() { self.desk.see(|view| view.look.stopped) } else { Stopped::Unconfirmed }
    }

    /// Ends the port's thread, and tells whether it came to its end. One that failed has pulled
    /// the last resort, and heard no answer.
    fn end(&mut self) -> bool {
        self.desk.ask(Ask::Close);
        self.thread.take().is_none_or(|thread| thread.join().is_ok())
    }
}

impl Drop for Pump {
    fn drop(&mut self) {
        self.end();
    }
}

/// That a station is not served: the system gives no thread.
#[derive(Debug, thiserror::Error)]
#[error("no thread for the serial port ({0}): end other programs, then try again")]
pub struct StartError(std::io::Error);

/// An open port, and who guards it.
struct Link {
    port: Port,
    guard: Option<Guard>,
}

impl Link {
    /// Tells the guard that all is well, or what to mind.
    fn beat(&mut self, watch: Watch) {
        if let Some(guard) = &mut self.guard {
            guard.beat(watch);
        }
        last_resort::set_mute(watch == Watch::Mute);
    }

    fn is_guarded(&mut self) -> bool {
        self.guard.as_mut().is_some_and(Guard::is_watching)
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        // Whoever closes a port in order has stopped its motor before; of a thread that failed
        // nobody knows, and the guard stops it.
        if !std::thread::panicking() {
            self.beat(Watch::Idle);
        }
        last_resort::disarm();
    }
}

impl Ring for Bell {
    fn ring(&self) {
        Self::ring(self);
    }
}

/// What is said of a calibration's file.
fn told_of_shelf(what: &str) -> impl Fn(&shelf::Error) -> String {
    move |error| format!("the calibration {what}: {error}")
}

/// The thread's own.
struct Server {
    place: Place,
    host: Host,
    baud: u32,
    stop: Stop,
    /// How long the guard bears silence while the motor is armed.
    patience: Seconds,
    period: Seconds,
    clock: WallClock,
    desk: Desk,
    station: Station,
    link: Option<Link>,
    next_search: Seconds,
    /// When the guard was told last that all is well.
    beat_at: Seconds,
    /// When the state came that is answered next.
    seen_at: Seconds,
    latency_us: Option<Histogram<u64>>,
    not_kept: Option<String>,
    /// This thread goes before all others of the computer.
    is_first: bool,
    shown: Shown,
    is_over: bool,
}

impl Server {
    fn serve(&mut self) {
        self.is_first = priority::go_first(Urgency::Motor);
        while !self.is_over {
            self.turn();
            self.show();
        }
        self.say_farewell();
    }

    /// One turn: bytes in, decisions, bytes out.
    fn turn(&mut self) {
        self.station.date(clock::today());
        self.obey();
        if self.link.is_none() {
            self.search();
        }
        let mut buffer = [0; 4096];
        let Some(link) = &mut self.link else {
            self.clock.wait_until(self.clock.now() + TURN);
            return;
        };
        let patience = if self.shown == Shown::NotYet {
            SOON
        } else if self.station.waits_for_caller() {
            // The caller has half a period for its decision.
            let left = self.seen_at + self.period * 0.5 - self.clock.now();
            if left.0 > 0.0 { left } else { Seconds(0.0) }
        } else {
            TURN
        };
        match link.port.read(&mut buffer, patience) {
            Ok(read) => {
                self.heed_standstill();
                let states = self.station.driver().received().states;
                let now = self.clock.now();
                self.station.read(&buffer[..read], now);
                let is_ready = *self.station.driver().stage() == Stage::Ready;
                if self.station.driver().received().states != states || !is_ready {
                    self.seen_at = now;
                }
            }
            Err(lost) => return self.lose(&lost.to_string()),
        }
        // What was asked meanwhile may be the caller's decision.
        self.obey();
        let is_late = self.clock.now() - self.seen_at >= self.period * 0.5;
        let mut answers = self.station.driver().owes_command();
        answers &= !self.station.waits_for_caller() || is_late;
        if answers {
            self.station.answer(self.clock.now());
        }
        self.flush();
        if answers {
            self.note_latency();
        }
        self.heed_last_resort();
        self.beat();
        self.keep_calibration();
        self.give_up();
    }

    /// A device that is not what it should be, or sends nothing any more, is greeted anew after a
    /// pause: its supply may just have come on.
    fn give_up(&mut self) {
        let driver = self.station.driver();
        let is_silent = *driver.stage() == Stage::Ready
            && driver.standing() != Standing::Armed
            && self.clock.now() - self.seen_at > SILENCE;
        let why = match driver.stage() {
            Stage::Closed(why) if self.link.is_some() => why.clone(),
            _ if is_silent => "the device sends no states: look at its power".to_owned(),
            _ => return,
        };
        self.lose(&why);
        self.next_search = self.clock.now() + AGAIN;
    }

    /// Does what was asked.
    fn obey(&mut self) {
        let now = self.clock.now();
        for ask in self.desk.take_asked() {
            match ask {
                Ask::Wish(Wish::Arm) if !self.is_guarded() => {
                    self.station.refuse(NotArmed::Unguarded);
                    self.replace_guard();
                }
                Ask::Wish(Wish::Arm) => {
                    // A person arms anew, after whatever stopped the motor.
                    last_resort::forget();
                    self.station.obey(Wish::Arm, now);
                }
                Ask::Wish(wish) => self.station.obey(wish, now),
                Ask::Want(action, at) => self.station.want(action, at),
                Ask::Enable(is_held, at) => self.station.enable(is_held, at),
                Ask::Close => self.is_over = true,
            }
        }
    }

    /// A guard that is gone gets a successor, for the next time.
    fn replace_guard(&mut self) {
        let Some(link) = &mut self.link else { return };
        if link.guard.as_ref().is_none_or(Guard::is_gone) {
            link.guard = Guard::start(&link.port, &self.stop, self.patience).ok();
        }
    }

    fn is_guarded(&mut self) -> bool {
        self.link.as_mut().is_some_and(Link::is_guarded)
    }

    /// Looks for the device, and opens its port.
    fn search(&mut self) {
        let now = self.clock.now();
        if now < self.next_search {
            return;
        }
        self.next_search = now + SEARCH;
        if let Err(why) = self.connect() {
            self.station.lost(why);
        }
    }

    /// Opens the device's port, with its guard, or tells why not.
    fn connect(&mut self) -> Result<(), String> {
        let path = self.place.address.path(&self.host).map_err(|error| error.to_string())?;
        let device = self.place.address.identity(&self.host, &path);
        let found = shelf::load(&self.place.shelf, &device);
        let (port, bell) = Port::open(&path, self.baud).map_err(|error| error.to_string())?;
        // Nothing fails from here on: what has a copy of the port would keep it locked. A
        // calibration that cannot be read is made anew.
        self.not_kept = found.as_ref().err().map(told_of_shelf("cannot be read"));
        let found = found.unwrap_or_default();
        let guard = Guard::start(&port, &self.stop, self.patience).ok();
        if let Ok(copy) = port.as_fd().try_clone_to_owned() {
            last_resort::arm(copy, &self.stop.burst);
        }
        self.station.meet(device, found);
        self.desk.hang(Some(Box::new(bell)));
        self.link = Some(Link { port, guard });
        self.station.opened(self.clock.now());
        Ok(())
    }

    /// The device is gone: its port is closed at once, or it would come back under another name.
    fn lose(&mut self, why: &str) {
        if self.station.driver().standing() == Standing::Armed {
            last_resort::stop();
        }
        self.link = None;
        self.desk.hang(None);
        self.station.lost(why);
        self.next_search = self.clock.now() + SEARCH;
    }

    fn flush(&mut self) {
        self.heed_standstill();
        let output = self.station.take_output();
        let Some(link) = &self.link else { return };
        if *self.station.driver().stage() == Stage::Homing {
            // From the order on, not a byte more.
            last_resort::set_mute(true);
        }
        let writing = last_resort::writing();
        let may_drive = !last_resort::was_pulled();
        let is_armed = self.station.driver().standing() == Standing::Armed;
        let sent = if may_drive || !is_armed { link.port.write(&output) } else { Ok(()) };
        drop(writing);
        if let Err(lost) = sent {
            self.lose(&lost.to_string());
        }
    }

    /// This thread stood still for so long that the guard has stopped the motor: whatever it was
    /// about to write is of another time. The guard has the last word and ends first, as a board's
    /// buffer does not hold the stops of both.
    fn heed_standstill(&mut self) {
        let gap = self.clock.now() - self.beat_at;
        let is_armed = self.station.driver().standing() == Standing::Armed;
        if !is_armed || gap < self.patience * ALMOST {
            return;
        }
        drop(self.station.take_output());
        self.tell_guard(Watch::Idle);
        self.clock.wait_until(self.clock.now() + QUIET);
        self.station.stood_still(gap, self.clock.now());
    }

    /// Somebody has stopped the motor past this thread: it must not drive on.
    fn heed_last_resort(&mut self) {
        if last_resort::was_pulled() && self.station.driver().standing() == Standing::Armed {
            self.clock.wait_until(self.clock.now() + QUIET);
            self.station.obey(Wish::Latch(Fault::Interrupted), self.clock.now());
            self.flush();
        }
    }

    fn beat(&mut self) {
        let driver = self.station.driver();
        let watch = match (driver.stage(), driver.standing()) {
            (Stage::Homing, _) => Watch::Mute,
            (_, Standing::Armed) => Watch::Armed,
            _ => Watch::Idle,
        };
        self.tell_guard(watch);
        if watch == Watch::Armed && !self.is_guarded() {
            self.station.unguarded(self.clock.now());
        }
    }

    fn tell_guard(&mut self, watch: Watch) {
        if let Some(link) = &mut self.link {
            // Taken before: what happens to this thread meanwhile the guard counts as silence.
            self.beat_at = self.clock.now();
            link.beat(watch);
        }
    }

    fn note_latency(&mut self) {
        let passed = (self.clock.now() - self.seen_at).0 * 1e6;
        if let Some(histogram) = &mut self.latency_us {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "saturates"
            )]
            histogram.saturating_record(passed as u64);
        }
    }

    fn keep_calibration(&mut self) {
        if let Some(calibration) = self.station.take_calibration() {
            let stored = shelf::store(&self.place.shelf, &calibration);
            self.not_kept = stored.as_ref().err().map(told_of_shelf("could not be kept"));
        }
    }

    fn show(&mut self) {
        let latency = self.latency_us.as_ref().map_or_else(Latency::default, |all| Latency {
            p50_us: all.value_at_quantile(0.5),
            p99_us: all.value_at_quantile(0.99),
            max_us: all.max(),
        });
        let look = self.station.look(self.clock.now());
        let (not_kept, is_first) = (self.not_kept.clone(), self.is_first);
        self.shown = self.desk.show(View { look, latency, not_kept, is_first });
    }

    /// The motor stops, and is given time to say so. A device that homes cannot be stopped, and
    /// whoever spoke to it next would not know that it does: its end is waited for.
    fn say_farewell(&mut self) {
        let end = self.clock.now() + LONGEST;
        let is_homing = |server: &Self| {
            server.link.is_some() && *server.station.driver().stage() == Stage::Homing
        };
        while is_homing(self) && self.clock.now() < end {
            self.turn();
            self.show();
        }
        let end = self.clock.now() + FAREWELL;
        if self.link.is_some() && *self.station.driver().stage() == Stage::Ready {
            self.station.obey(Wish::Disarm, self.clock.now());
            while self.clock.now() < end
                && self.link.is_some()
                && self.station.driver().stopped() == Stopped::Told
            {
                self.turn();
            }
        }
        self.link = None;
        self.desk.hang(None);
        self.show();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::serial::bench::{about, params, view};
    use crate::backend::serial::shelf::{Calibration, MadeFor};
    use crate::backend::wire::Format;

    #[test]
    fn a_stop_of_a_thread_that_failed_is_not_confirmed() {
        let mut view = view();
        view.look.stopped = Stopped::Confirmed;
        let pump = |fails: bool| {
            let desk = Desk::new(view.look.clone());
            let thread = std::thread::spawn(move || assert!(!fails, "as it may"));
            Pump { desk, thread: Some(thread) }
        };
        assert_eq!(pump(false).close(), Stopped::Confirmed);
        assert_eq!(pump(true).close(), Stopped::Unconfirmed);
    }

    #[test]
    fn its_station_knows_what_day_it_is() {
        let params = params(Format::Cobs1);
        let fresh = Calibration {
            device: "/dev/nowhere".to_owned(),
            at: clock::today().to_string(),
            made_for: MadeFor::of(&params),
            hanging: 0.0,
            angle_invert: true,
            position_invert: false,
            motor_invert: false,
        };
        // The program was started at another time, when it was no calibration of then.
        let about = About { found: Some(fresh), ..about() };
        let address = "/dev/nowhere".parse().unwrap();
        let place = Place { address, shelf: PathBuf::from("/nowhere") };
        let pump = Pump::start(&params, place, about, WallClock::start()).unwrap();
        let is_calibrated = |view: &View| view.look.calibrated.is_ok().then_some(());
        assert!(pump.desk().wait(Seconds(60.0), is_calibrated).is_some());
    }
}
