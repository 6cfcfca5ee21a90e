//! `coadapt emulate`: a device without hardware, in real time.

use std::fs;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::mpsc::Receiver;
use std::time::Duration;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::hands_on::{self, Doing};
use super::shutdown::Shutdown;
use super::{RunError, signal_code, tell};
use crate::backend::emulator::faults::Faults;
use crate::backend::emulator::port::{Port, Read};
use crate::backend::emulator::trace::{Entry, Event};
use crate::backend::emulator::{Emulator, Params};
#[cfg(unix)]
use crate::backend::priority::{self, Urgency};
use crate::check::{Check, Checker};
use crate::cli;
use crate::clock::{Clock, WallClock};
use crate::profile::Order;
use crate::signal::Seconds;

/// Bytes are passed on at least this often.
const TURN: Seconds = Seconds(0.001);
/// When the machine was busy for longer than this, the device's time stood still: a burst of
/// states from a past that no host saw would make it look as if the host were to blame.
const STALL: Seconds = Seconds(0.004);

/// Emulates until a signal comes, or the reader of the trace is gone.
pub(super) fn emulate(words: &cli::Emulate) -> Result<ExitCode, RunError> {
    let params = device(words)?;
    let faults = match &words.faults {
        Some(file) => load::<Faults>(file)?,
        None => Faults::default(),
    };
    let shutdown = Shutdown::listen();
    if io::stdin().is_terminal() {
        tell(hands_on::HINT);
    }
    let mut stand = Stand {
        device: Emulator::new(&params, &faults, words.seed),
        port: None,
        link: words.port_link.clone(),
        is_open: false,
        clock: WallClock::start(),
        behind: Seconds(0.0),
        notes: Notes { json: words.json, is_read: true },
        lines: hands_on::listen()?,
    };
    // A real device keeps its time whatever this computer does.
    #[cfg(unix)]
    priority::go_first(Urgency::Motor);
    // Before a hand can pull the cable, it is in.
    stand.plug()?;
    while stand.notes.is_read {
        if let Some(signal) = shutdown.signal() {
            return Ok(signal_code(signal));
        }
        stand.turn()?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The device and its port.
struct Stand {
    device: Emulator,
    /// The port while the cable is in.
    port: Option<Port>,
    link: Option<PathBuf>,
    /// Some program has the port open.
    is_open: bool,
    clock: WallClock,
    /// How long the device's time has stood still altogether.
    behind: Seconds,
    notes: Notes,
    /// What is typed.
    lines: Receiver<String>,
}

impl Stand {
    fn turn(&mut self) -> Result<(), RunError> {
        while let Ok(line) = self.lines.try_recv() {
            self.lend_a_hand(&line);
        }
        self.plug()?;
        let written = self.hear().map_err(|error| broken(&error))?;
        self.stand_still()?;
        let read = self.device.advance(self.now(), &written);
        if let Some(port) = self.port.as_ref().filter(|_| self.is_open) {
            let lost = port.write(&read).map_err(|error| broken(&error))?;
            if lost > 0 {
                self.notes.happens(self.device.now(), &Happening::Unread { bytes: lost })?;
            }
        }
        self.notes.entries(&self.device.take_trace())
    }

    /// Does by hand what `line` says.
    fn lend_a_hand(&mut self, line: &str) {
        match line.parse() {
            Ok(Doing::Hand(hand)) => {
                if !self.device.hand(hand) {
                    tell("the motor is on: nobody pushes the cart against it");
                }
            }
            Ok(Doing::Unplug(time)) => self.device.pull(time),
            Ok(Doing::Help) => tell(hands_on::HELP),
            Err(why) => tell(&why),
        }
    }

    /// The device's time now.
    fn now(&self) -> Seconds {
        self.clock.now() - self.behind
    }

    fn stand_still(&mut self) -> Result<(), RunError> {
        let stalled = self.now() - self.device.now();
        if stalled <= STALL {
            return Ok(());
        }
        self.behind = self.behind + stalled;
        self.notes.happens(self.device.now(), &Happening::Stalled { for_s: stalled.0 })
    }

    /// Puts the cable in, under a new name, or pulls it.
    fn plug(&mut self) -> Result<(), RunError> {
        match (self.device.is_plugged(), &self.port) {
            (true, None) => {
                let port = Port::open(self.link.as_deref())
                    .map_err(|error| RunError::Failed(error.to_string()))?;
                let happening = Happening::Port { path: port.name().to_owned() };
                self.port = Some(port);
                self.notes.happens(self.device.now(), &happening)
            }
            (false, Some(_)) => {
                self.port = None;
                self.is_open = false;
                self.notes.happens(self.device.now(), &Happening::Gone)
            }
            _ => Ok(()),
        }
    }

    /// What a program wrote, after waiting for it a short time.
    fn hear(&mut self) -> io::Result<Vec<u8>> {
        let mut buffer = [0; 4096];
        let patience = Duration::from_secs_f64(TURN.0);
        let read = match &self.port {
            Some(port) => port.read(&mut buffer, patience)?,
            None => Read::Nobody,
        };
        match read {
            Read::Nobody => {
                self.is_open = false;
                self.clock.wait_until(self.clock.now() + TURN);
                Ok(Vec::new())
            }
            Read::Bytes(len) => {
                self.opened()?;
                Ok(buffer[..len].to_vec())
            }
            Read::Nothing => self.opened().map(|()| Vec::new()),
        }
    }

    /// Some program has the port open.
    fn opened(&mut self) -> io::Result<()> {
        if let Some(port) = self.port.as_ref().filter(|_| !self.is_open) {
            port.make_raw()?;
            self.device.connect();
            self.is_open = true;
        }
        Ok(())
    }
}

fn broken(error: &io::Error) -> RunError {
    RunError::Failed(format!("the emulated port broke: {error}"))
}

/// What happens at the port, in the trace beside what the device does.
#[derive(Serialize)]
#[serde(tag = "what", rename_all = "snake_case")]
enum Happening {
    /// The port is there.
    Port { path: PathBuf },
    /// The cable is pulled.
    Gone,
    /// The machine was busy, and the device's time stood still.
    Stalled { for_s: f64 },
    /// The program does not read: bytes were lost.
    Unread { bytes: usize },
}

/// Tells what happens: all of it as JSON, or what a person should know.
struct Notes {
    json: bool,
    /// Somebody reads standard output.
    is_read: bool,
}

impl Notes {
    fn happens(&mut self, now: Seconds, happening: &Happening) -> Result<(), RunError> {
        #[derive(Serialize)]
        struct Line<'a> {
            at_s: f64,
            #[serde(flatten)]
            happening: &'a Happening,
        }
        if self.json {
            return self.line(&json(&Line { at_s: now.0, happening })?);
        }
        match happening {
            Happening::Port { path } => self.line(&path.display().to_string()),
            Happening::Gone => {
                tell("the cable is pulled");
                Ok(())
            }
            Happening::Stalled { for_s } => {
                tell(&format!("this computer was busy: the device stood still for {for_s:.3} s"));
                Ok(())
            }
            Happening::Unread { bytes } => {
                tell(&format!("{bytes} bytes were not read by the program"));
                Ok(())
            }
        }
    }

    fn entries(&mut self, entries: &[Entry]) -> Result<(), RunError> {
        for entry in entries {
            if self.json {
                self.line(&json(entry)?)?;
                continue;
            }
            match &entry.event {
                Event::Forbidden { offence } => {
                    tell(&format!("{:.4} s: the host must never: {offence}", entry.at_s));
                }
                Event::Crashed { by } => {
                    tell(&format!("{:.4} s: the firmware has crashed: {by}", entry.at_s));
                }
                Event::Fault { fault } => tell(&format!("{:.4} s: {fault:?}", entry.at_s)),
                _ => {}
            }
        }
        Ok(())
    }

    fn line(&mut self, line: &str) -> Result<(), RunError> {
        let mut out = io::stdout().lock();
        match writeln!(out, "{line}").and_then(|()| out.flush()) {
            Ok(()) => Ok(()),
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                self.is_read = false;
                Ok(())
            }
            Err(error) => {
                Err(RunError::Failed(format!("cannot write to standard output: {error}")))
            }
        }
    }
}

fn json(line: &impl Serialize) -> Result<String, RunError> {
    serde_json::to_string(line)
        .map_err(|error| RunError::Failed(format!("the trace has no JSON: {error}")))
}

/// The device of the order's profile.
fn device(words: &cli::Emulate) -> Result<Params, RunError> {
    let order =
        Order { profile: words.profile.clone(), sets: words.set.clone(), ..Order::default() };
    let profile = super::session::profile_of(&order)?;
    let Some(plant) = &profile.backend else {
        return Err(RunError::Usage(format!(
            "the profile {} has no section `backend`, and so no device: physical-cart-pole and \
             cobs-cart-pole have one",
            words.profile
        )));
    };
    Ok(Params { format: plant.format, baud: plant.baud, rig: plant.emulated.clone(), clock_us: 0 })
}

fn load<T: DeserializeOwned + Check>(path: &Path) -> Result<T, RunError> {
    let shown = path.display().to_string();
    let text = fs::read_to_string(path)
        .map_err(|error| RunError::Usage(format!("cannot read {shown}: {error}")))?;
    parse(&text, &shown)
}

fn parse<T: DeserializeOwned + Check>(text: &str, name: &str) -> Result<T, RunError> {
    let options =
        ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    let parsed: T =
        options.from_str(text).map_err(|error| RunError::Usage(format!("{name}: {error}")))?;
    let mut faults = Vec::new();
    parsed.check(&mut Checker::new(&mut faults));
    if faults.is_empty() {
        return Ok(parsed);
    }
    let lines: Vec<String> = faults
        .iter()
        .map(|fault| {
            format!("{name}: {} is {}, allowed: {}", fault.key, fault.value, fault.allowed)
        })
        .collect();
    Err(RunError::Usage(lines.join("\n")))
}
