//! The watcher's side: who can be watched, and what is seen of them.

use std::io::{BufRead, BufReader, Read};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::line::{Hello, Line, Strange};
use super::place::{Place, is_peer_own};
use crate::control::snapshot::{Publisher, Watcher, channel};
use crate::session::machine::Stage;
use crate::session::{Moment, Phase};

/// How long a session may take to say hello. One that is busy says it within a picture's time.
const HELLO: Duration = Duration::from_secs(1);
/// The longest line that is read, bytes.
const LONGEST_LINE: u64 = 1 << 22;

/// A session that can be watched.
#[derive(Debug)]
pub struct Found {
    /// Its socket.
    pub socket: PathBuf,
    /// What it says of itself.
    pub hello: Hello,
    stream: BufReader<UnixStream>,
}

impl Found {
    /// The sessions of this user, and what is said by those that are not understood.
    #[must_use]
    pub fn all(place: &Place) -> (Vec<Self>, Vec<Strange>) {
        let (mut found, mut strange) = (Vec::new(), Vec::new());
        for socket in place.sockets() {
            match Self::at(&socket) {
                Some(Ok(session)) => found.push(session),
                Some(Err(why)) => strange.push(why),
                None => {}
            }
        }
        (found, strange)
    }

    /// The session that listens at `socket`, if one does.
    fn at(socket: &Path) -> Option<Result<Self, Strange>> {
        let stream = UnixStream::connect(socket).ok().filter(is_peer_own)?;
        stream.set_read_timeout(Some(HELLO)).ok()?;
        let mut stream = BufReader::new(stream);
        let line = next_line(&mut stream)?;
        Some(match Line::read(&line) {
            Ok(Line::Hello(hello)) => Ok(Self { socket: socket.to_owned(), hello: *hello, stream }),
            Ok(_) => Err(Strange::Text("it did not say hello".to_owned())),
            Err(why) => Err(why),
        })
    }

    /// Follows it from now on.
    #[must_use]
    pub fn follow(self) -> Following {
        let (publisher, watcher) =
            channel(Stage::Instruction(Moment::start_of(Phase::Introduction)));
        let is_over = Arc::new(AtomicBool::new(false));
        let over = Arc::clone(&is_over);
        let mut stream = self.stream;
        let _ = stream.get_ref().set_read_timeout(None);
        let closing = stream.get_ref().try_clone().ok();
        let reader = std::thread::Builder::new().name("coadapt-follow".to_owned());
        let started = reader.spawn(move || {
            while let Some(line) = next_line(&mut stream) {
                take(&publisher, &line);
            }
            over.store(true, Ordering::SeqCst);
        });
        is_over.fetch_or(started.is_err(), Ordering::SeqCst);
        Following { watcher, is_over, closing }
    }
}

/// The next whole line; `None` once there is none.
fn next_line(stream: &mut BufReader<UnixStream>) -> Option<String> {
    let mut line = String::new();
    stream.by_ref().take(LONGEST_LINE).read_line(&mut line).ok()?;
    line.ends_with('\n').then_some(line)
}

/// What `line` says is seen from now on. What is not understood is left out.
fn take(publisher: &Publisher, line: &str) {
    match Line::read(line) {
        Ok(Line::Seen(seen)) => {
            publisher.publish(&seen.snapshot());
            publisher.waits(seen.waits);
        }
        Ok(Line::Rollouts(rows)) => rows.into_iter().for_each(|row| publisher.rollout(row)),
        Ok(Line::Hello(_)) | Err(_) => {}
    }
}

/// A session that is followed; no longer once this is dropped.
#[derive(Debug)]
pub struct Following {
    /// Looks at it. What is asked here reaches nobody.
    pub watcher: Watcher,
    is_over: Arc<AtomicBool>,
    closing: Option<UnixStream>,
}

impl Following {
    /// Whether nothing more will come: it is over, or its program is gone.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.is_over.load(Ordering::SeqCst)
    }
}

impl Drop for Following {
    fn drop(&mut self) {
        if let Some(stream) = &self.closing {
            let _ = stream.shutdown(std::net::Shutdown::Both);
        }
    }
}
