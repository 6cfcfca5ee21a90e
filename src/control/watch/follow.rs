//! The watcher's side: who can be watched, and what is seen of them.

use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::Builder;
use std::time::Duration;

use rustix::io::Errno;

use super::line::{Hello, Line, Strange};
use super::place::{self, Place};
use crate::clock::{Clock, WallClock};
use crate::control::snapshot::{Publisher, Watcher, channel};
use crate::session::machine::Stage;
use crate::session::{Moment, Phase};
use crate::signal::Seconds;

/// How long a session may take to let us in and to say all of its hello. One that is busy does so
/// within a picture's time.
const HELLO: Seconds = Seconds(1.0);
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
        let sockets = place.sockets();
        // All at once: the silent ones take their time together.
        let answers = std::thread::scope(|scope| {
            let asked: Vec<_> = sockets
                .iter()
                .filter_map(|at| Builder::new().spawn_scoped(scope, move || Self::at(at)).ok())
                .collect();
            asked.into_iter().filter_map(|asked| asked.join().ok()?).collect::<Vec<_>>()
        });
        for answer in answers {
            match answer {
                Ok(session) => found.push(session),
                Err(why) => strange.push(why),
            }
        }
        (found, strange)
    }

    /// The session that listens at `socket`, if one does. It never takes longer than
    /// [`HELLO`], whatever the other end does.
    fn at(socket: &Path) -> Option<Result<Self, Strange>> {
        let silent = || place::pid_of(socket).map(|pid| Err(Strange::Silent { pid }));
        let clock = WallClock::start();
        let stream = match place::knock(socket) {
            Ok(stream) => stream,
            Err(Errno::AGAIN) => return silent(),
            Err(_) => return None,
        };
        let mut stream = BufReader::new(Some(stream).filter(place::is_peer_own)?);
        let line = match first_line(&mut stream, &clock) {
            Ok(line) => line,
            Err(Unheard::Gone) => return None,
            Err(Unheard::Silent) => return silent(),
        };
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
        let news = Arc::new(AtomicU64::new(0));
        let heard = Arc::clone(&news);
        let mut stream = self.stream;
        let _ = stream.get_ref().set_read_timeout(None);
        let closing = stream.get_ref().try_clone().ok();
        let reader = Builder::new().name("coadapt-follow".to_owned());
        let started = reader.spawn(move || {
            while let Some(line) = next_line(&mut stream) {
                take(&publisher, &line);
                heard.fetch_add(1, Ordering::SeqCst);
            }
            over.store(true, Ordering::SeqCst);
        });
        is_over.fetch_or(started.is_err(), Ordering::SeqCst);
        Following { watcher, is_over, news, closing }
    }
}

/// Why a session's first line was not heard.
enum Unheard {
    /// Nobody is there any more.
    Gone,
    /// It did not come in time.
    Silent,
}

/// The first whole line, if all of it came before [`HELLO`] is over at `clock`.
fn first_line(stream: &mut BufReader<UnixStream>, clock: &WallClock) -> Result<String, Unheard> {
    let mut line = Vec::new();
    while !line.ends_with(b"\n") {
        let left = HELLO - clock.now();
        if left <= Seconds(0.0) || line.len() as u64 > LONGEST_LINE {
            return Err(Unheard::Silent);
        }
        // A system may know no shorter wait than a microsecond, and takes zero for ever.
        let patience = Duration::from_secs_f64(left.0.max(1e-3));
        stream.get_ref().set_read_timeout(Some(patience)).map_err(|_| Unheard::Gone)?;
        let came = match stream.fill_buf() {
            Ok([]) => return Err(Unheard::Gone),
            Ok(came) => came,
            Err(why) => match why.kind() {
                ErrorKind::Interrupted => continue,
                ErrorKind::WouldBlock | ErrorKind::TimedOut => return Err(Unheard::Silent),
                _ => return Err(Unheard::Gone),
            },
        };
        let end = came.iter().position(|byte| *byte == b'\n').map_or(came.len(), |at| at + 1);
        line.extend_from_slice(&came[..end]);
        stream.consume(end);
    }
    Ok(String::from_utf8_lossy(&line).into_owned())
}

/// The next whole line, what is no text in it made visible; `None` once there is none.
fn next_line(stream: &mut BufReader<UnixStream>) -> Option<String> {
    let mut line = Vec::new();
    stream.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line).ok()?;
    line.ends_with(b"\n").then(|| String::from_utf8_lossy(&line).into_owned())
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
    news: Arc<AtomicU64>,
    closing: Option<UnixStream>,
}

impl Following {
    /// Whether nothing more will come: it is over, or its program is gone.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.is_over.load(Ordering::SeqCst)
    }

    /// How many lines came so far: a session that lives sends 30 a second.
    #[must_use]
    pub fn news(&self) -> u64 {
        self.news.load(Ordering::SeqCst)
    }
}

impl Drop for Following {
    fn drop(&mut self) {
        if let Some(stream) = &self.closing {
            let _ = stream.shutdown(std::net::Shutdown::Both);
        }
    }
}
