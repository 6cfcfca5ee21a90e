//! The device's end of a serial port: a pseudo-terminal.

use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, fcntl_setfl, open};
use rustix::io::{Errno, FdFlags, fcntl_setfd};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// Why there is no port.
#[derive(Debug, thiserror::Error)]
pub enum PortError {
    /// The system gives no pseudo-terminal.
    #[error("no pseudo-terminal for the device: {0}")]
    NoTerminal(#[from] io::Error),
    /// Something is where the link should be.
    #[error("--port-link {}: there is something that is no link; name another path", .0.display())]
    InTheWay(PathBuf),
    /// The link could not be made.
    #[error("--port-link {}: {why}", path.display())]
    NoLink {
        /// Where it should be.
        path: PathBuf,
        /// The system's words.
        why: io::Error,
    },
}

/// The device's end.
#[derive(Debug)]
pub struct Port {
    master: OwnedFd,
    name: PathBuf,
    link: Option<PathBuf>,
}

/// What came from the port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Read {
    /// So many bytes.
    Bytes(usize),
    /// Nothing within the time.
    Nothing,
    /// No program has the port open.
    Nobody,
}

impl Port {
    /// A new port, and a link to it at `link`, in place of an older link.
    ///
    /// # Errors
    /// When the system has no pseudo-terminal, or no link can be made.
    pub fn open(link: Option<&Path>) -> Result<Self, PortError> {
        let (master, name) = pair()?;
        let mut port = Self { master, name, link: None };
        if let Some(link) = link {
            port.make_link(link)?;
            port.link = Some(link.to_owned());
        }
        Ok(port)
    }

    /// The path that a program opens.
    #[must_use]
    pub fn name(&self) -> &Path {
        &self.name
    }

    /// Waits at most `patience` for bytes. What a program wrote before it closed the port is
    /// still read.
    ///
    /// # Errors
    /// What the system says, but for what means that nobody is there.
    pub fn read(&self, buffer: &mut [u8], patience: Duration) -> io::Result<Read> {
        let mut polled = [PollFd::new(&self.master, PollFlags::IN)];
        let patience = Timespec {
            tv_sec: patience.as_secs().try_into().unwrap_or(i64::MAX),
            tv_nsec: patience.subsec_nanos().into(),
        };
        match poll(&mut polled, Some(&patience)) {
            Ok(0) | Err(Errno::INTR) => return Ok(Read::Nothing),
            Ok(_) => {}
            Err(error) => return Err(error.into()),
        }
        match rustix::io::read(&self.master, buffer) {
            Ok(0) | Err(Errno::IO) => Ok(Read::Nobody),
            Ok(bytes) => Ok(Read::Bytes(bytes)),
            Err(Errno::AGAIN | Errno::INTR) => Ok(Read::Nothing),
            Err(error) => Err(error.into()),
        }
    }

    /// Writes what the port has room for, and returns how many bytes are lost: a serial line
    /// waits for nobody.
    ///
    /// # Errors
    /// What the system says, but for what means that nobody is there.
    pub fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        let mut rest = bytes;
        while !rest.is_empty() {
            match rustix::io::write(&self.master, rest) {
                Ok(0) | Err(Errno::AGAIN | Errno::IO) => break,
                Ok(written) => rest = &rest[written..],
                Err(Errno::INTR) => {}
                Err(error) => return Err(error.into()),
            }
        }
        Ok(rest.len())
    }

    /// Passes every byte as it is: the system forgets that whenever the port was closed.
    ///
    /// # Errors
    /// What the system says.
    pub fn make_raw(&self) -> io::Result<()> {
        let mut settings = tcgetattr(&self.master)?;
        settings.make_raw();
        tcsetattr(&self.master, OptionalActions::Now, &settings)?;
        Ok(())
    }

    fn make_link(&self, link: &Path) -> Result<(), PortError> {
        let no_link = |why| PortError::NoLink { path: link.to_owned(), why };
        match std::fs::symlink_metadata(link) {
            Ok(found) if found.is_symlink() => std::fs::remove_file(link).map_err(no_link)?,
            Ok(_) => return Err(PortError::InTheWay(link.to_owned())),
            Err(_) => {}
        }
        std::os::unix::fs::symlink(&self.name, link).map_err(no_link)
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        if let Some(link) = &self.link
            && std::fs::read_link(link).is_ok_and(|to| to == self.name)
        {
            let _ = std::fs::remove_file(link);
        }
    }
}

/// The device's end, and the path of the other. That one is opened once, so that its being
/// closed is seen, and closed: a device does not keep its own port open.
fn pair() -> io::Result<(OwnedFd, PathBuf)> {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    // Whoever inherited it would keep the cable in.
    fcntl_setfd(&master, FdFlags::CLOEXEC)?;
    grantpt(&master)?;
    unlockpt(&master)?;
    let name = ptsname(&master, Vec::new())?;
    drop(open(&name, OFlags::RDWR | OFlags::NOCTTY, Mode::empty())?);
    fcntl_setfl(&master, OFlags::RDWR | OFlags::NONBLOCK)?;
    Ok((master, PathBuf::from(name.to_string_lossy().into_owned())))
}

#[cfg(test)]
mod tests {
    use std::fs::{File, OpenOptions};
    use std::io::{Read as _, Write as _};
    use std::os::unix::fs::OpenOptionsExt;

    use super::*;

    const PATIENCE: Duration = Duration::from_secs(5);

    fn program(port: &Port) -> File {
        let flags = OFlags::NOCTTY.bits().cast_signed();
        OpenOptions::new().read(true).write(true).custom_flags(flags).open(port.name()).unwrap()
    }

    #[test]
    fn every_byte_goes_through_both_ways_and_last_words_are_heard() {
        let port = Port::open(None).unwrap();
        let mut buffer = [0; 512];
        assert_eq!(port.read(&mut buffer, PATIENCE).unwrap(), Read::Nobody);
        for _ in 0..2 {
            let mut program = program(&port);
            port.make_raw().unwrap();
            let all: Vec<u8> = (0..=255).collect();
            assert_eq!(port.write(&all).unwrap(), 0);
            let mut read = [0; 256];
            program.read_exact(&mut read).unwrap();
            assert_eq!(read[..], all);
            program.write_all(&all).unwrap();
            drop(program);
            assert_eq!(port.read(&mut buffer, PATIENCE).unwrap(), Read::Bytes(256));
            assert_eq!(buffer[..256], all);
            assert_eq!(port.read(&mut buffer, PATIENCE).unwrap(), Read::Nobody);
        }
    }

    #[test]
    fn a_program_that_does_not_read_costs_bytes_and_no_time() {
        let port = Port::open(None).unwrap();
        let _program = program(&port);
        port.make_raw().unwrap();
        assert!(port.write(&vec![7; 1 << 20]).unwrap() > 0);
    }

    #[test]
    fn the_link_follows_the_port_and_leaves_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("cp0");
        std::os::unix::fs::symlink("/nonexistent", &link).unwrap();
        let port = Port::open(Some(&link)).unwrap();
        assert_eq!(std::fs::read_link(&link).unwrap(), port.name());
        drop(port);
        assert!(std::fs::symlink_metadata(&link).is_err());
        std::fs::write(&link, "mine").unwrap();
        assert!(matches!(Port::open(Some(&link)), Err(PortError::InTheWay(_))));
    }
}
