//! `coadapt pad-relay`: a gamepad at this computer for a session at another.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::process::ExitCode;
use std::time::Duration;

use super::words::{document, read};
use super::{RunError, tell};
use crate::cli;
use crate::clock::{Clock, WallClock};
use crate::operator::gamepad::events::Events;
use crate::operator::gamepad::hub::Hub;
use crate::operator::gamepad::inbox::Inbox;
use crate::operator::gamepad::relay::{HEARTBEAT, Outlet};
use crate::operator::gamepad::{Event, Pads, Params};
use crate::operator::socket_path;
use crate::random::draw_seed;
use crate::signal::Seconds;

/// Moves closer together than this share a line; a button never waits.
const BURST: Seconds = Seconds(0.004);

/// Relays until the reader is gone, or the table of events is over.
pub(super) fn pad_relay(words: &cli::PadRelay) -> Result<ExitCode, RunError> {
    if let Some(socket) = &words.forward {
        return forward(socket);
    }
    let clock = WallClock::start();
    let feed = if let Some(file) = &words.events {
        let events = Events::load(file).map_err(|e| RunError::Usage(e.to_string()))?;
        Feed::Table(events.into_queue())
    } else {
        let profile = read(&document(&words.profile, &words.set)?)?;
        let hub = Hub::open(clock, &profile.operator.gamepad.sdl_mappings)
            .map_err(|e| RunError::Failed(e.to_string()))?;
        tell("relaying; Ctrl-C ends; coadapt devices shows why a pad is not heard");
        Feed::Pads(hub.listen(clock.now()))
    };
    let run = draw_seed().map_err(|error| RunError::Failed(error.to_string()))?;
    relay(feed, clock, Outlet::new(run))
}

fn relay(mut feed: Feed, mut clock: WallClock, mut outlet: Outlet) -> Result<ExitCode, RunError> {
    let mut out = io::stdout().lock();
    let mut pads = Pads::new(&Params::default());
    let mut due = clock.now();
    loop {
        match feed.next(&mut clock, due) {
            Next::Event(event) => {
                match &event {
                    Event::Connected(about) => tell(&format!("{} is plugged in", about.name)),
                    Event::Disconnected(_) => tell("a gamepad was unplugged"),
                    Event::Axis { .. } | Event::Button { .. } => {}
                }
                let may_wait = matches!(event, Event::Axis { .. });
                let now = clock.now();
                pads.take(event, now);
                due = Seconds(due.0.min(now.0 + BURST.0));
                if may_wait {
                    continue;
                }
            }
            Next::Time => {}
            Next::Over => return Ok(ExitCode::SUCCESS),
        }
        // A button's line goes out before the next event is heard, or a tap would vanish.
        let now = clock.now();
        let line = outlet.line(&pads, now);
        match writeln!(out, "{line}").and_then(|()| out.flush()) {
            Ok(()) => due = now + HEARTBEAT,
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
                return Ok(ExitCode::SUCCESS);
            }
            Err(error) => {
                return Err(RunError::Failed(format!("cannot write to standard output: {error}")));
            }
        }
    }
}

/// Where events come from.
enum Feed {
    Pads(Inbox),
    Table(VecDeque<(Seconds, Event)>),
}

enum Next {
    Event(Event),
    Time,
    Over,
}

impl Feed {
    /// The next event, or that it is `due` without one, or that there will never be one.
    fn next(&mut self, clock: &mut WallClock, due: Seconds) -> Next {
        match self {
            Self::Pads(heard) => {
                let patience = Duration::from_secs_f64((due - clock.now()).0.max(0.0));
                heard.wait(patience).map_or(Next::Time, |(event, _)| Next::Event(event))
            }
            Self::Table(events) => {
                let Some((at, _)) = events.front() else {
                    // The last event's line still goes out.
                    let is_told = clock.now() < due;
                    return if is_told { Next::Over } else { Next::Time };
                };
                if *at > due {
                    clock.wait_until(due);
                    return Next::Time;
                }
                clock.wait_until(*at);
                events.pop_front().map_or(Next::Over, |(_, event)| Next::Event(event))
            }
        }
    }
}

/// Passes a relay's lines on from standard input to the session that listens at `socket`.
#[cfg(unix)]
fn forward(socket: &str) -> Result<ExitCode, RunError> {
    let path = socket_path(socket).ok_or_else(|| {
        RunError::Usage(format!("--forward {socket}: give unix:PATH, the session's socket"))
    })?;
    let mut stream = std::os::unix::net::UnixStream::connect(&path).map_err(|error| {
        RunError::Failed(format!(
            "no session listens at {} ({error}): first start coadapt run PROFILE --operator \
             gamepad:relay=unix:{}",
            path.display(),
            path.display()
        ))
    })?;
    let Err(error) = io::copy(&mut io::stdin().lock(), &mut stream) else {
        return Ok(ExitCode::SUCCESS);
    };
    // Only a session that wants no more says something, and then hangs up.
    let mut said = String::new();
    let _ = stream.read_to_string(&mut said);
    let why = match said.trim() {
        "" if error.kind() == io::ErrorKind::BrokenPipe => return Ok(ExitCode::SUCCESS),
        "" => error.to_string(),
        said => said.to_owned(),
    };
    Err(RunError::Failed(format!("the relay's lines went no further: {why}")))
}

#[cfg(not(unix))]
fn forward(_socket: &str) -> Result<ExitCode, RunError> {
    Err(RunError::Usage("this system has no Unix sockets".to_owned()))
}
