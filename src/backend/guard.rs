//! What stops the motor when this program no longer can.
//!
//! A board may hold its last command for ever, and a program that is killed, or stopped by
//! hand, sends no other. So a small second process, the guard, holds the port as well and
//! listens to this one's heart beat. When that ends while the motor is armed it writes a burst
//! of stops, then one again and again for a second:
//!
//! ```text
//! this program ──── beats: idle, armed, mute ───▶ coadapt guard
//!      │                                               │ none in time, or the line's end
//!      └── commands ─▶ port ◀── stops ─────────────────┘
//! ```
//!
//! What this program can still feel, a panic or a signal, is the [`last_resort`]'s affair.

pub mod child;
pub mod last_resort;
pub mod vigil;

use std::io::{self, Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::termios::{QueueSelector, tcflush};

use super::wire::{Format, Order};
use crate::signal::Seconds;
pub use vigil::Watch;

/// How long an armed program may be silent before the guard stops the motor.
pub const PATIENCE: Seconds = Seconds(0.08);
/// How long this program waits for its guard to go. Longer takes only one that stops the motor.
const FAREWELL: Duration = Duration::from_millis(50);

/// Why there is no guard. Without one the motor stays off.
#[derive(Debug, thiserror::Error)]
pub enum GuardError {
    /// The program to start is not known.
    #[error(
        "the motor's guard is this program once more, whose file is not found ({0}): start coadapt anew"
    )]
    NoProgram(io::Error),
    /// The system starts no process.
    #[error("the motor's guard could not be started ({0}): end other programs, then try again")]
    NotStarted(io::Error),
}

/// The bytes that stop a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stop {
    /// Those that stop it whatever it was told before, even half a command.
    pub burst: Vec<u8>,
    /// Those that say it once more. A program that goes on may say it at the same time, and a
    /// board's buffer has to hold both.
    pub again: Vec<u8>,
}

impl Stop {
    /// What stops a device of this format.
    #[must_use]
    pub fn of(format: Format) -> Self {
        let bytes = |order| {
            let mut bytes = Vec::new();
            // Every format can say these, to any device.
            let _ = format.codec().encode(&order, &mut bytes);
            bytes
        };
        let again = match format {
            Format::Sensorsini31 => Order::Command(0),
            Format::Cobs1 => Order::Stop,
        };
        Self { burst: bytes(Order::Stop), again: bytes(again) }
    }
}

/// The guard of one port, seen from the program that it guards against.
///
/// It keeps the port open, and locked: drop it before the port is opened again.
#[derive(Debug)]
pub struct Guard {
    /// The process, until somebody waits for its end.
    process: Option<Child>,
    /// Beats out, the guard's sign of life in.
    line: UnixStream,
    told: Watch,
    is_ready: bool,
    is_gone: bool,
    /// The guard takes the beats off the line.
    listens: bool,
}

impl Guard {
    /// Starts a guard that writes `stop` to `port` when this program was silent for longer than
    /// `patience` while armed. It watches a moment later: see [`Guard::is_watching`].
    ///
    /// # Errors
    /// When no process can be started.
    pub fn start(port: impl AsFd, stop: &Stop, patience: Seconds) -> Result<Self, GuardError> {
        let program = std::env::current_exe().map_err(GuardError::NoProgram)?;
        Self::start_program(&program, port, stop, patience)
    }

    /// The same with `program` as the guard, which is to know the words of `coadapt guard`.
    ///
    /// # Errors
    /// When no process can be started.
    pub fn start_program(
        program: &Path,
        port: impl AsFd,
        stop: &Stop,
        patience: Seconds,
    ) -> Result<Self, GuardError> {
        let (process, line) =
            spawn(program, &port, stop, patience).map_err(GuardError::NotStarted)?;
        Ok(Self {
            process: Some(process),
            line,
            told: Watch::Idle,
            is_ready: false,
            is_gone: false,
            listens: true,
        })
    }

    /// The heart beats: to be called every period. It waits for nothing.
    pub fn beat(&mut self, watch: Watch) {
        self.told = watch;
        match self.line.write(&[watch.byte()]) {
            Ok(_) => self.listens = true,
            // So many beats wait that there is no room for more.
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => self.listens = false,
            Err(_) => self.is_gone = true,
        }
    }

    /// Whether the guard would stop the motor now: it has started, is still there, and takes the
    /// beats. Only then may the motor be armed.
    pub fn is_watching(&mut self) -> bool {
        self.listen();
        self.is_ready && !self.is_gone && self.listens
    }

    /// Whether it has ended, and will never watch again.
    #[must_use]
    pub const fn is_gone(&self) -> bool {
        self.is_gone
    }

    /// The guard's process.
    #[must_use]
    pub fn process(&self) -> Option<u32> {
        self.process.as_ref().map(Child::id)
    }

    /// Hears the guard's sign of life, or its end.
    fn listen(&mut self) {
        let mut signs = [0; 8];
        loop {
            match self.line.read(&mut signs) {
                Ok(1..) => self.is_ready = true,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Ok(0) | Err(_) => {
                    self.is_gone = true;
                    return;
                }
            }
        }
    }

    /// Waits a short time for the line's other end to close.
    fn is_gone_soon(&mut self) -> bool {
        let is_set = self.line.set_nonblocking(false).is_ok()
            && self.line.set_read_timeout(Some(FAREWELL)).is_ok();
        if is_set && !self.is_gone {
            self.listen();
        }
        self.is_gone
    }
}

impl Drop for Guard {
    /// The line ends, and with it the guard: at once after an idle beat, as at every orderly
    /// end; if the motor is armed, after having stopped it.
    fn drop(&mut self) {
        let _ = self.line.shutdown(std::net::Shutdown::Write);
        let is_soon = self.told != Watch::Armed && self.is_gone_soon();
        let Some(mut process) = self.process.take() else { return };
        if is_soon {
            let _ = process.wait();
            return;
        }
        // Whoever takes longer is waited for aside, so that no dead process stays in the table.
        let waits = std::thread::Builder::new().name("coadapt-farewell".to_owned());
        let _ = waits.spawn(move || process.wait());
    }
}

/// The guard's process, and this program's end of the line to it.
fn spawn(
    program: &Path,
    port: &impl AsFd,
    stop: &Stop,
    patience: Seconds,
) -> io::Result<(Child, UnixStream)> {
    let (line, its_end) = UnixStream::pair()?;
    line.set_nonblocking(true)?;
    let port = port.as_fd().try_clone_to_owned()?;
    // Whatever else this program has opened is closed by the system when the guard starts.
    let process = Command::new(program)
        .arg("guard")
        .args(["--stop", &hex(&stop.burst), "--again", &hex(&stop.again)])
        .args(["--patience-s", &patience.0.to_string()])
        .stdin(Stdio::from(OwnedFd::from(its_end)))
        .stdout(Stdio::from(port))
        // It outlives the terminal, and has nothing to say.
        .stderr(Stdio::null())
        .spawn()?;
    Ok((process, line))
}

/// Bytes as words of a command line.
fn hex(bytes: &[u8]) -> String {
    let digits = bytes.iter().flat_map(|byte| [byte >> 4, byte & 0xf]);
    digits.filter_map(|digit| char::from_digit(digit.into(), 16)).collect()
}

/// Writes a stop to a port that others write to as well, without waiting for a device that takes
/// nothing.
fn write_stop(port: impl AsFd, stop: &[u8]) -> io::Result<()> {
    if !has_room(&port) {
        // Whatever waits would only come before the stop. A pipe has nothing to forget.
        let _ = tcflush(&port, QueueSelector::OFlush);
    }
    let mut rest = stop;
    while !rest.is_empty() {
        if !has_room(&port) {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        match rustix::io::write(&port, rest) {
            Ok(written) => rest = &rest[written..],
            Err(Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

/// Whether a write would not have to wait. A port that is gone counts: writing tells.
fn has_room(port: &impl AsFd) -> bool {
    let mut polled = [PollFd::new(port, PollFlags::OUT)];
    loop {
        match poll(&mut polled, Some(&Timespec { tv_sec: 0, tv_nsec: 0 })) {
            Err(Errno::INTR) => {}
            asked => return asked != Ok(0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_can_say_stop_several_times() {
        for format in [Format::Sensorsini31, Format::Cobs1] {
            let Stop { burst, again } = Stop::of(format);
            assert!(burst.len() >= 18 && burst.len() >= again.len(), "{format:?}");
        }
        // A board whose buffer holds 32 bytes gets both at once.
        let Stop { burst, again } = Stop::of(Format::Sensorsini31);
        assert_eq!((burst.len(), again.len()), (24, 8));
        assert_eq!(hex(&[0xaa, 0x05, 0]), "aa0500");
    }

    #[test]
    fn a_stop_waits_for_no_device_that_takes_nothing() {
        let (mut heard, port) = io::pipe().unwrap();
        let stop = Stop::of(Format::Sensorsini31).burst;
        write_stop(&port, &stop).unwrap();
        let mut bytes = vec![0; stop.len()];
        heard.read_exact(&mut bytes).unwrap();
        assert_eq!(bytes, stop);
        while has_room(&port) {
            rustix::io::write(&port, &[0; 512]).unwrap();
        }
        assert_eq!(write_stop(&port, &stop).unwrap_err().kind(), io::ErrorKind::WouldBlock);
        drop(heard);
        assert_eq!(write_stop(&port, &stop).unwrap_err().kind(), io::ErrorKind::BrokenPipe);
    }
}
