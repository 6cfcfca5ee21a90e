//! The pipe or socket through which a relayed pad comes: read by a thread of its own, its
//! latest state looked at by the tick.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, ErrorKind, Read};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use super::pads::{Event, least};
use super::relay::{self, Counts, Inlet, LONGEST_LINE};
use crate::clock::{Clock, WallClock};
use crate::signal::Seconds;

/// Events that wait for the tick; more are only there when nobody looks.
const QUEUE: usize = 4096;

/// Where lines come in; clones are the same.
#[derive(Clone, Debug, Default)]
pub struct Link(Arc<Mutex<State>>);

/// An event, when its line came, and how late that was.
#[derive(Clone, Debug, PartialEq)]
pub struct Relayed {
    /// What happened.
    pub event: Event,
    /// When its line came.
    pub at: Seconds,
    /// How old it was by then.
    pub age: Seconds,
}

#[derive(Debug, Default)]
struct State {
    inlet: Inlet,
    events: VecDeque<Relayed>,
    /// Why no line comes; `None` while the link is up.
    down: Option<String>,
    is_over: bool,
}

impl Link {
    /// The link over standard input, whose lines are stamped with `clock`. There is one for
    /// the whole program.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn standard_input(clock: WallClock) -> io::Result<Self> {
        static LINK: OnceLock<Link> = OnceLock::new();
        if let Some(link) = LINK.get() {
            link.join(clock.now());
            return Ok(link.clone());
        }
        let link = Self::default();
        let reading = link.clone();
        std::thread::Builder::new().name("coadapt-relay".to_owned()).spawn(move || {
            reading.read(BufReader::new(io::stdin()), clock);
            let words = "the relay has ended: start coadapt pad-relay and this again";
            reading.end(words, clock.now());
        })?;
        Ok(LINK.get_or_init(|| link).clone())
    }

    /// Hands over the events that came since the last call, oldest first.
    pub fn drain(&self) -> VecDeque<Relayed> {
        std::mem::take(&mut self.state().events)
    }

    /// How old the newest state is at `now`; `None` where there is none.
    #[must_use]
    pub fn age(&self, now: Seconds) -> Option<Seconds> {
        self.state().inlet.age(now)
    }

    /// What became of the lines so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.state().inlet.counts()
    }

    /// Why no state comes, and what to do about it.
    #[must_use]
    pub fn trouble(&self) -> Option<String> {
        let state = self.state();
        match state.inlet.newer() {
            Some(version) => Some(format!(
                "the relay speaks version {version}, newer than this program: use the same \
                 coadapt on both computers"
            )),
            None => state.down.clone().or_else(|| {
                let beginning = state.inlet.strange()?;
                Some(format!("this is no line of coadapt pad-relay: {beginning}"))
            }),
        }
    }

    /// A new listener: it hears first of the pads that are there.
    fn join(&self, now: Seconds) {
        let mut state = self.state();
        let present = state.inlet.present().map(Event::Connected);
        state.events = present.map(|event| Relayed { event, at: now, age: Seconds(0.0) }).collect();
    }

    /// Reads lines until the reader ends or the link is not wanted any more.
    fn read(&self, mut reader: impl BufRead, clock: WallClock) {
        let mut line = Vec::new();
        loop {
            let room = LONGEST_LINE.saturating_sub(line.len()).max(1);
            let limit = u64::try_from(room).unwrap_or(u64::MAX);
            match reader.by_ref().take(limit).read_until(b'\n', &mut line) {
                Ok(0) => break,
                // A line that was waited for, one without an end, or the last one, cut off.
                Ok(_) => {
                    let is_whole = line.ends_with(b"\n") || line.len() >= LONGEST_LINE;
                    if is_whole {
                        self.take(&line, clock.now());
                        line.clear();
                    }
                }
                Err(error) if is_passing(&error) => {}
                Err(_) => break,
            }
            if self.state().is_over {
                return;
            }
        }
        if !line.is_empty() {
            self.take(&line, clock.now());
        }
    }

    pub(super) fn take(&self, line: &[u8], now: Seconds) {
        // The tick never waits for a long line to be understood.
        let line = relay::understand(String::from_utf8_lossy(line).trim_end());
        let mut state = self.state();
        state.down = None;
        let events = state.inlet.take(line, now);
        state.push(events, now);
    }

    /// The link is down, for the reason and with the cure in `words`.
    pub(super) fn end(&self, words: &str, now: Seconds) {
        let mut state = self.state();
        let events = state.inlet.end();
        state.push(events, now);
        state.down = Some(words.to_owned());
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn push(&mut self, events: Vec<Event>, now: Seconds) {
        let age = self.inlet.age(now).unwrap_or(Seconds(0.0));
        self.events.extend(events.into_iter().map(|event| Relayed { event, at: now, age }));
        while self.events.len() > QUEUE {
            let oldest = least(self.events.iter().map(|relayed| &relayed.event));
            self.events.remove(oldest);
        }
    }
}

/// Whether reading goes on after `error`.
fn is_passing(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

#[cfg(unix)]
pub use socket::{Socket, SocketError};

#[cfg(unix)]
mod socket {
    use std::fs::{self, Permissions};
    use std::io::{self, BufReader, ErrorKind, Write};
    use std::os::unix::fs::{FileTypeExt, PermissionsExt};
    use std::os::unix::net::{UnixListener, UnixStream};
    use std::path::{Path, PathBuf};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::time::Duration;

    use super::Link;
    use crate::clock::{Clock, WallClock};
    use crate::signal::Seconds;

    /// How long a second relay waits for the first to go.
    const KNOCK: Seconds = Seconds(0.3);
    /// What a second relay is told.
    const TAKEN: &str = "another relay steers this session already: end that one first\n";
    /// How often a silent connection looks whether it is still wanted.
    const LOOK: Duration = Duration::from_millis(100);

    /// Why nobody can connect.
    #[derive(Debug, thiserror::Error)]
    pub enum SocketError {
        /// Another program listens there.
        #[error("{0}: another program listens there already; name another socket")]
        Taken(PathBuf),
        /// Something else has that name.
        #[error("{0} is there already and is no socket; name another path")]
        NoSocket(PathBuf),
        /// The system refuses.
        #[error("cannot listen at {path}: {cause}; name a path in a folder of your own")]
        Refused {
            /// The socket.
            path: PathBuf,
            /// The reason.
            cause: io::Error,
        },
    }

    /// A Unix socket at which one relay after the other may connect, for this user only. It
    /// is gone from the disk once this is dropped.
    #[derive(Debug)]
    pub struct Socket {
        link: Link,
        path: PathBuf,
    }

    impl Socket {
        /// Listens at `path`; lines are stamped with `clock`.
        ///
        /// # Errors
        /// When another program listens there, or nobody can.
        pub fn listen(path: &Path, clock: WallClock) -> Result<Self, SocketError> {
            let refused = |cause| SocketError::Refused { path: path.to_owned(), cause };
            make_room(path)?;
            let listener = bind(path).map_err(refused)?;
            let link = Link::default();
            let words = format!(
                "no relay yet: on the pad's computer run  coadapt pad-relay | ssh LAB-PC coadapt \
                 pad-relay --forward unix:{}",
                path.display()
            );
            link.end(&words, clock.now());
            let accepting = link.clone();
            std::thread::Builder::new()
                .name("coadapt-relay".to_owned())
                .spawn(move || accept(&listener, &accepting, clock))
                .map_err(refused)?;
            Ok(Self { link, path: path.to_owned() })
        }

        /// Where lines come in.
        #[must_use]
        pub const fn link(&self) -> &Link {
            &self.link
        }
    }

    impl Drop for Socket {
        fn drop(&mut self) {
            self.link.state().is_over = true;
            // Wakes the thread that waits for a relay.
            let _ = UnixStream::connect(&self.path);
            let _ = fs::remove_file(&self.path);
        }
    }

    /// Removes a socket that nobody listens at any more.
    fn make_room(path: &Path) -> Result<(), SocketError> {
        let Ok(there) = fs::symlink_metadata(path) else { return Ok(()) };
        if !there.file_type().is_socket() {
            return Err(SocketError::NoSocket(path.to_owned()));
        }
        match UnixStream::connect(path) {
            Ok(_) => Err(SocketError::Taken(path.to_owned())),
            Err(error) if error.kind() == ErrorKind::ConnectionRefused => fs::remove_file(path)
                .map_err(|cause| SocketError::Refused { path: path.to_owned(), cause }),
            Err(cause) => Err(SocketError::Refused { path: path.to_owned(), cause }),
        }
    }

    /// A socket that was never anybody else's: it is made in a folder of this user, and then
    /// moved to its place.
    fn bind(path: &Path) -> io::Result<UnixListener> {
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        let folder =
            tempfile::Builder::new().prefix(".pad").tempdir_in(parent.unwrap_or(Path::new(".")))?;
        let private = folder.path().join("s");
        let listener = UnixListener::bind(&private)?;
        fs::set_permissions(&private, Permissions::from_mode(0o600))?;
        fs::rename(&private, path)?;
        Ok(listener)
    }

    /// Takes relays, one at a time: of two hands at once nobody would know who steers.
    fn accept(listener: &UnixListener, link: &Link, clock: WallClock) {
        let is_taken = Arc::new(AtomicBool::new(false));
        for stream in listener.incoming() {
            if link.state().is_over {
                return;
            }
            let Ok(mut stream) = stream else { continue };
            // Somebody who only knocks is gone in a moment.
            let (mut waiting, since) = (clock, clock.now());
            while is_taken.load(Ordering::SeqCst) && waiting.now() - since < KNOCK {
                waiting.wait_until(waiting.now() + Seconds(0.005));
            }
            if is_taken.swap(true, Ordering::SeqCst) {
                let _ = stream.write_all(TAKEN.as_bytes());
                continue;
            }
            let (link, is_free) = (link.clone(), Arc::clone(&is_taken));
            let read = move || {
                // Without it a session's end would wait for the relay's next line.
                let _ = stream.set_read_timeout(Some(LOOK));
                let before = link.counts();
                link.read(BufReader::new(stream), clock);
                // Somebody who only knocked has not been a relay.
                if link.counts() != before {
                    link.end("the relay has ended: start coadapt pad-relay again", clock.now());
                }
                is_free.store(false, Ordering::SeqCst);
            };
            if std::thread::Builder::new().name("coadapt-relay".to_owned()).spawn(read).is_err() {
                is_taken.store(false, Ordering::SeqCst);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Params;
    use super::super::map::Axis;
    use super::super::pads::{About, Id, Pads};
    use super::super::relay::Outlet;
    use super::*;

    fn lines(run: u64) -> Vec<u8> {
        let mut pads = Pads::new(&Params::default());
        let about = About {
            id: Id(0),
            name: "Pad".to_owned(),
            guid: String::new(),
            mapping: String::new(),
        };
        pads.take(Event::Connected(about), Seconds(0.0));
        let axis = Event::Axis { pad: Id(0), axis: Axis::LeftStickX, value: 0.1 };
        pads.take(axis, Seconds(0.0));
        let mut outlet = Outlet::new(run);
        let mut bytes = b"half a line\xff\n".to_vec();
        for t in [0.0, 0.02] {
            bytes.extend(outlet.line(&pads, Seconds(t)).into_bytes());
            bytes.push(b'\n');
        }
        bytes.extend(b"{\"coadapt_pad\":1,");
        bytes
    }

    #[test]
    fn lines_of_a_pipe_become_events_and_its_end_takes_the_pads_away() {
        let link = Link::default();
        link.read(&lines(1)[..], WallClock::start());
        let counts = Counts { taken: 2, lost: 0, stale: 0, damaged: 2 };
        assert_eq!(link.counts(), counts);
        assert!(link.trouble().unwrap().contains("no line of coadapt pad-relay: {\"coadapt_pad"));
        let events: Vec<Event> = link.drain().into_iter().map(|relayed| relayed.event).collect();
        assert!(matches!(events[..], [Event::Connected(_), Event::Axis { .. }]), "{events:?}");
        link.end("over", Seconds(9.0));
        assert_eq!(link.trouble(), Some("over".to_owned()));
        let over =
            Relayed { event: Event::Disconnected(Id(0)), at: Seconds(9.0), age: Seconds(0.0) };
        assert_eq!(link.drain().pop_front(), Some(over));
    }

    #[test]
    fn a_line_without_an_end_is_read_in_bounded_pieces() {
        let link = Link::default();
        let endless = vec![b'x'; 5 * LONGEST_LINE / 2];
        link.read(&[&endless[..], b"\n", &lines(1)[..]].concat()[..], WallClock::start());
        assert_eq!((link.counts().taken, link.counts().damaged), (2, 5));
    }

    #[cfg(unix)]
    #[test]
    fn a_socket_takes_one_relay_after_the_other_and_leaves_nothing_behind() {
        use std::io::Write;
        use std::os::unix::net::UnixStream;

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pad");
        let socket = Socket::listen(&path, WallClock::start()).unwrap();
        assert!(matches!(Socket::listen(&path, WallClock::start()), Err(SocketError::Taken(_))));
        assert!(socket.link().trouble().unwrap().contains("no relay yet"));
        let mut clock = WallClock::start();
        for run in 1..=2 {
            UnixStream::connect(&path).unwrap().write_all(&lines(run)).unwrap();
            let is_over = || socket.link().trouble().is_some_and(|words| words.contains("ended"));
            while socket.link().counts().taken < run * 2 || !is_over() {
                let now = clock.now();
                assert!(now.0 < 60.0, "{:?}", socket.link().counts());
                clock.wait_until(now + Seconds(0.001));
            }
        }
        drop(socket);
        assert!(!path.exists());
        std::fs::write(&path, "a file").unwrap();
        let refused = Socket::listen(&path, WallClock::start()).unwrap_err().to_string();
        assert!(refused.contains("no socket"), "{refused}");
    }
}
