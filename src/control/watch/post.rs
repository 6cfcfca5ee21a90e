//! The session's side: takes whoever connects, and writes what is new, never waiting.

use std::fs::{self, Permissions};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::JoinHandle;

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::WatchError;
use super::line::{Hello, Line, Seen};
use super::place::{self, Place};
use crate::clock::{Clock, WallClock};
use crate::control::snapshot::Watcher;
use crate::record::EpisodeRow;
use crate::signal::Seconds;

/// The time between two pictures.
const FRAME: Seconds = Seconds(1.0 / 30.0);
/// How often the last picture is offered.
const FAREWELLS: u32 = 4;
/// The most who watch at a time.
const MOST_WATCHERS: usize = 64;
/// The most rollouts in a line.
const MOST_ROLLOUTS: usize = 100;

/// This program's sockets so far.
static SOCKETS: AtomicU32 = AtomicU32::new(0);

/// Lets others watch a session, as long as it lives.
#[derive(Debug)]
pub struct Post {
    path: PathBuf,
    /// Its end is heard by the thread.
    waker: Option<UnixStream>,
    thread: Option<JoinHandle<()>>,
}

impl Post {
    /// Shows what `watcher` sees to whoever connects at `place`, and says `hello` first.
    ///
    /// # Errors
    /// When there is no safe place for the socket, or the system refuses.
    pub fn open(place: &Place, hello: Hello, watcher: Watcher) -> Result<Self, WatchError> {
        let folder = place.open()?;
        // Whoever was killed left its socket here.
        let _ = place.sockets();
        let path = folder.join(place::name(SOCKETS.fetch_add(1, Ordering::Relaxed)));
        let greeting = serde_json::to_value(&hello).map(|_| Line::Hello(Box::new(hello)))?;
        let refused = |cause| WatchError::Io { action: "listen at", path: path.clone(), cause };
        let listener = listen(&path).map_err(refused)?;
        let (waker, wake) = UnixStream::pair().map_err(refused)?;
        let desk = Desk {
            listener,
            wake,
            greeting: greeting.to_bytes(),
            watcher,
            rollouts: Vec::new(),
            guests: Vec::new(),
        };
        let thread = std::thread::Builder::new()
            .name("coadapt-watch".to_owned())
            .spawn(move || desk.serve(WallClock::start()))
            .map_err(refused)?;
        Ok(Self { path, waker: Some(waker), thread: Some(thread) })
    }

    /// The socket.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Post {
    fn drop(&mut self) {
        self.waker = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        let _ = fs::remove_file(&self.path);
    }
}

/// Nobody else may enter the folder, so that the socket is nobody else's in between either.
fn listen(path: &Path) -> io::Result<UnixListener> {
    // One of this name was made by a program of the same number, which is gone.
    let _ = fs::remove_file(path);
    let listener = UnixListener::bind(path)?;
    fs::set_permissions(path, Permissions::from_mode(0o600))?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}

/// The thread's own.
struct Desk {
    listener: UnixListener,
    wake: UnixStream,
    greeting: Vec<u8>,
    watcher: Watcher,
    rollouts: Vec<EpisodeRow>,
    guests: Vec<Guest>,
}

/// Somebody who watches.
struct Guest {
    stream: UnixStream,
    /// What did not fit yet.
    rest: Vec<u8>,
    /// Rollouts that were sent.
    rollouts: usize,
}

impl Desk {
    /// Serves until the session is over; then shows its last tick to whoever is ready for it
    /// soon.
    fn serve(mut self, mut clock: WallClock) {
        let mut due = clock.now();
        while self.wait(due - clock.now()) {
            if !self.welcome() {
                // Whoever could not be taken still knocks.
                clock.wait_until(clock.now() + FRAME);
            }
            if clock.now() >= due {
                self.show();
                due = clock.now() + FRAME;
            }
        }
        for _ in 0..FAREWELLS {
            self.show();
            if self.guests.iter().all(|guest| guest.rest.is_empty()) {
                return;
            }
            clock.wait_until(clock.now() + FRAME);
        }
    }

    /// Waits for somebody to come or, where somebody is there, for the next picture's time;
    /// false once the session is over.
    fn wait(&self, patience: Seconds) -> bool {
        #[expect(clippy::cast_possible_truncation, reason = "a thirtieth of a second at most")]
        let patience = Timespec { tv_sec: 0, tv_nsec: (patience.0 * 1e9).clamp(0.0, 1e8) as _ };
        let patience = (!self.guests.is_empty()).then_some(&patience);
        let mut ends =
            [PollFd::new(&self.listener, PollFlags::IN), PollFd::new(&self.wake, PollFlags::IN)];
        match poll(&mut ends, patience) {
            Ok(_) => ends[1].revents().is_empty(),
            Err(rustix::io::Errno::INTR) => true,
            Err(_) => false,
        }
    }

    /// Takes those who knock, if they are of this user; false where the system has no room for
    /// them.
    fn welcome(&mut self) -> bool {
        loop {
            let stream = match self.listener.accept() {
                Ok((stream, _)) => stream,
                Err(error) => return error.kind() == ErrorKind::WouldBlock,
            };
            let is_welcome = self.guests.len() < MOST_WATCHERS
                && place::is_peer_own(&stream)
                && stream.set_nonblocking(true).is_ok();
            if is_welcome {
                self.guests.push(Guest { stream, rest: self.greeting.clone(), rollouts: 0 });
            }
        }
    }

    /// Writes the latest tick to everyone who has read all before it.
    fn show(&mut self) {
        if self.guests.is_empty() {
            return;
        }
        self.watcher.rollouts(&mut self.rollouts);
        let seen = Seen::new(&self.watcher.look(), self.watcher.waits());
        let picture = Line::Seen(Box::new(seen)).to_bytes();
        let rollouts = &self.rollouts;
        self.guests.retain_mut(|guest| guest.send(rollouts, &picture).is_ok());
    }
}

impl Guest {
    /// Writes what is left, then the rollouts that are new, then the picture: as much as fits.
    fn send(&mut self, rollouts: &[EpisodeRow], picture: &[u8]) -> io::Result<()> {
        self.flush()?;
        if !self.rest.is_empty() {
            return Ok(());
        }
        let new = rollouts.get(self.rollouts..).unwrap_or_default();
        let new = &new[..new.len().min(MOST_ROLLOUTS)];
        if !new.is_empty() {
            self.rest = Line::Rollouts(new.to_vec()).to_bytes();
            self.rollouts += new.len();
        }
        self.rest.extend_from_slice(picture);
        self.flush()
    }

    fn flush(&mut self) -> io::Result<()> {
        while !self.rest.is_empty() {
            match self.stream.write(&self.rest) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(count) => drop(self.rest.drain(..count)),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}
