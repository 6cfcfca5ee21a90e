//! The guard's own process: a line of beats as its standard input, the port as its output.

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::stdio::{stdin, stdout};
use signal_hook::consts::{
    SIGALRM, SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP, SIGTTIN, SIGTTOU, SIGUSR1, SIGUSR2,
};

use super::vigil::{Act, Heard, Vigil, Watch};
use super::{Stop, write_stop};
use crate::clock::{Clock, WallClock};
use crate::signal::Seconds;

/// What ends or stops the program that is guarded must not reach the guard.
const DEAF_TO: [i32; 10] =
    [SIGALRM, SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP, SIGTTIN, SIGTTOU, SIGUSR1, SIGUSR2];
/// The guard's sign of life.
const READY: u8 = b'r';

/// Watches until the program at the line's other end is gone, and writes `stop` when its beats
/// end while it is armed.
///
/// # Errors
/// When the guard would not survive what it guards against.
pub fn keep_watch(stop: &Stop, patience: Seconds) -> io::Result<()> {
    for signal in DEAF_TO {
        signal_hook::flag::register(signal, Arc::new(AtomicBool::new(false)))?;
    }
    // A session of its own has no terminal, and gets no signal that is meant for one.
    rustix::process::setsid()?;
    // A line that goes one way only takes no sign.
    let _ = rustix::io::write(stdin(), &[READY]);
    let mut clock = WallClock::start();
    let mut vigil = Vigil::new(patience);
    loop {
        match vigil.act(clock.now()) {
            Act::Listen(until) => {
                let left = until.map(|until| until - clock.now());
                let mut bytes = [0; 4096];
                let heard = listen(&mut bytes, left);
                let now = clock.now();
                for heard in heard {
                    vigil.hear(heard, now);
                }
            }
            Act::Wait(until) => {
                clock.wait_until(until);
            }
            // The next one may get through.
            Act::Stop => drop(write_stop(stdout(), &stop.burst)),
            Act::StopAgain => drop(write_stop(stdout(), &stop.again)),
            Act::Leave => return Ok(()),
        }
    }
}

/// What comes over the line, within `patience` if there is a limit.
fn listen(bytes: &mut [u8], patience: Option<Seconds>) -> Vec<Heard> {
    let patience = patience.map(|patience| {
        let patience = Duration::from_secs_f64(patience.0.max(0.0));
        Timespec {
            tv_sec: patience.as_secs().try_into().unwrap_or(i64::MAX),
            tv_nsec: patience.subsec_nanos().into(),
        }
    });
    let beats = stdin();
    match poll(&mut [PollFd::new(&beats, PollFlags::IN)], patience.as_ref()) {
        Ok(0) | Err(Errno::INTR) => return Vec::new(),
        Ok(_) => {}
        Err(_) => return vec![Heard::End],
    }
    match rustix::io::read(beats, &mut *bytes) {
        Err(Errno::INTR | Errno::AGAIN) => Vec::new(),
        Ok(0) | Err(_) => vec![Heard::End],
        Ok(len) => {
            bytes[..len].iter().filter_map(|byte| Watch::of(*byte)).map(Heard::Beat).collect()
        }
    }
}
