//! The host's end of a serial port: opened for this program alone, raw, and never waited for
//! longer than one asks.

use std::fs;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, open};
use rustix::io::Errno;
use rustix::pipe::{PipeFlags, pipe_with};
use rustix::termios::{
    ControlModes, OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr,
};
use serialport::TTYPort;

use crate::signal::Seconds;

/// Why a port could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum PortError {
    /// The system's words.
    #[error("{path} cannot be opened: {why}; `coadapt devices` tells what stands in the way")]
    Closed {
        /// The port.
        path: String,
        /// What the system said.
        why: String,
    },
}

/// That the other end is gone, or the system gave up on the port.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the device is gone ({0}): look at the cable")]
pub struct Lost(String);

/// An open port.
#[derive(Debug)]
pub struct Port {
    /// What is read and written.
    wire: OwnedFd,
    /// Keeps other programs away; its settings are the port's.
    _settings: TTYPort,
    /// Wakes whoever waits for bytes.
    woken: OwnedFd,
}

/// Wakes whoever waits at a [`Port`].
#[derive(Debug)]
pub struct Bell(OwnedFd);

impl Bell {
    /// Wakes the one who waits, or who will wait next.
    pub fn ring(&self) {
        // A full pipe has been rung already.
        let _ = rustix::io::write(&self.0, &[1]);
    }
}

impl Port {
    /// Opens `path` at `baud` bits a second for this program alone, and forgets what came before.
    ///
    /// # Errors
    /// What the system says.
    pub fn open(path: &str, baud: u32) -> Result<(Self, Bell), PortError> {
        let closed = |why: String| PortError::Closed { path: path.to_owned(), why };
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        // Opened first: once the settings' own end is open nobody else gets in.
        let wire = open(path, flags, Mode::empty()).map_err(|why| closed(why.to_string()))?;
        let settings =
            serialport::new(path, baud).open_native().map_err(|why| closed(why.to_string()))?;
        let (woken, bell) = pipe_with(PipeFlags::NONBLOCK | PipeFlags::CLOEXEC)
            .map_err(|why| closed(why.to_string()))?;
        let port = Self { wire, _settings: settings, woken };
        port.keep_lines();
        hurry(path);
        let _ = tcflush(&port.wire, QueueSelector::IOFlush);
        Ok((port, Bell(bell)))
    }

    /// Waits at most `patience` for bytes, or for the bell, and reads what there is.
    ///
    /// # Errors
    /// When the device is gone; it is to be closed at once then.
    pub fn read(&self, buffer: &mut [u8], patience: Seconds) -> Result<usize, Lost> {
        let lost = |why: Errno| Lost(why.to_string());
        let mut polled =
            [PollFd::new(&self.wire, PollFlags::IN), PollFd::new(&self.woken, PollFlags::IN)];
        let patience = Duration::from_secs_f64(patience.0.clamp(0.0, 1.0));
        let patience = Timespec { tv_sec: 0, tv_nsec: patience.subsec_nanos().into() };
        match poll(&mut polled, Some(&patience)) {
            Ok(0) | Err(Errno::INTR) => return Ok(0),
            Ok(_) => {}
            Err(why) => return Err(lost(why)),
        }
        let (wire, bell) = (polled[0].revents(), polled[1].revents());
        if !bell.is_empty() {
            let _ = rustix::io::read(&self.woken, &mut [0_u8; 64]);
        }
        if wire.is_empty() {
            return Ok(0);
        }
        match rustix::io::read(&self.wire, buffer) {
            // An end that is readable and has nothing is closed.
            Ok(0) => Err(Lost("it was unplugged".to_owned())),
            Ok(bytes) => Ok(bytes),
            Err(Errno::AGAIN | Errno::INTR) => Ok(0),
            Err(why) => Err(lost(why)),
        }
    }

    /// Writes all of `bytes`, for which the port has room unless its device is gone.
    ///
    /// # Errors
    /// When it has not.
    pub fn write(&self, bytes: &[u8]) -> Result<(), Lost> {
        let mut rest = bytes;
        while !rest.is_empty() {
            match rustix::io::write(&self.wire, rest) {
                Ok(written) => rest = &rest[written..],
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) => return Err(Lost("it takes no bytes".to_owned())),
                Err(why) => return Err(Lost(why.to_string())),
            }
        }
        Ok(())
    }

    /// Leaves the modem lines alone when the port is closed: on some boards they are the reset.
    fn keep_lines(&self) {
        if let Ok(mut settings) = tcgetattr(&self.wire) {
            settings.control_modes -= ControlModes::HUPCL;
            let _ = tcsetattr(&self.wire, OptionalActions::Now, &settings);
        }
    }
}

impl AsFd for Port {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.wire.as_fd()
    }
}

/// Asks an FTDI chip to pass bytes on at once. Who may not ask finds in `coadapt devices` how to.
fn hurry(path: &str) {
    let device = fs::canonicalize(path).ok();
    let name = device.as_deref().and_then(|path| path.file_name()).and_then(|name| name.to_str());
    if let Some(name) = name {
        let _ = fs::write(format!("/sys/bus/usb-serial/devices/{name}/latency_timer"), "1");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::emulator::port as device;

    const PATIENCE: Seconds = Seconds(1.0);

    fn open_pair() -> (device::Port, Port, Bell) {
        let device = device::Port::open(None).unwrap();
        let (port, bell) = Port::open(device.name().to_str().unwrap(), 230_400).unwrap();
        (device, port, bell)
    }

    #[test]
    fn all_bytes_pass_both_ways_and_nobody_else_gets_in() {
        let (device, port, _bell) = open_pair();
        let all: Vec<u8> = (0..=255).collect();
        assert_eq!(device.write(&all).unwrap(), 0);
        let mut read = Vec::new();
        while read.len() < 256 {
            let mut buffer = [0; 512];
            let bytes = port.read(&mut buffer, PATIENCE).unwrap();
            assert!(bytes > 0);
            read.extend_from_slice(&buffer[..bytes]);
        }
        assert_eq!(read, all);
        port.write(&all).unwrap();
        let mut buffer = [0; 512];
        let heard = device.read(&mut buffer, Duration::from_secs(1)).unwrap();
        assert_eq!((heard, &buffer[..256]), (device::Read::Bytes(256), &all[..]));
        assert!(Port::open(device.name().to_str().unwrap(), 230_400).is_err());
    }

    #[test]
    fn an_unplugged_device_is_lost_at_once_and_the_bell_wakes() {
        let (device, port, bell) = open_pair();
        bell.ring();
        assert_eq!(port.read(&mut [0; 8], PATIENCE), Ok(0));
        drop(device);
        assert!(port.read(&mut [0; 8], PATIENCE).is_err());
        assert!(port.write(&[0]).is_err());
    }

    #[test]
    fn a_port_that_is_none_is_refused_by_name() {
        let error = Port::open("/dev/null", 9600).unwrap_err().to_string();
        assert!(error.contains("/dev/null"), "{error}");
    }
}
