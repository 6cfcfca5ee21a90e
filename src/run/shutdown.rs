//! Signals: a real plant stops, then the session ends the way a key ends it, or halts.

use std::sync::Arc;
use std::sync::atomic::{AtomicI32, Ordering};
use std::sync::mpsc::sync_channel;
use std::time::Duration;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGTSTP, SIGTTIN};
use signal_hook::iterator::Signals;
use signal_hook::low_level::{emulate_default_handler, raise, signal_name};

use crate::backend::guard::last_resort;
use crate::backend::priority::{self, Urgency};
use crate::clock::{Clock, WallClock};
use crate::control::snapshot::{Command, Watcher};
use crate::signal::Seconds;
use crate::tui::terminal::{give_back, is_taken, take_again};

/// The port's thread has stopped the motor after so long; if not, the guard is about to.
const LAST_WORD: Seconds = Seconds(0.04);

/// How long a terminal may take to be given back.
const FAREWELL: Duration = Duration::from_millis(300);

/// Remembers the signal that asked the program to end.
#[derive(Clone, Debug, Default)]
pub struct Shutdown {
    signal: Arc<AtomicI32>,
    sessions: Arc<std::sync::Mutex<Option<Watcher>>>,
}

impl Shutdown {
    /// Listens to INT, TERM, HUP and TSTP from now on.
    #[must_use]
    pub fn listen() -> Self {
        let shutdown = Self::default();
        if let Ok(mut signals) = Signals::new([SIGINT, SIGTERM, SIGHUP, SIGTSTP]) {
            let heard = shutdown.clone();
            let listener = std::thread::Builder::new().name("coadapt-signals".to_owned());
            // Without a listener signals keep their default: the program ends at once,
            // and the session can be resumed.
            let _ = listener.spawn(move || {
                // A computer that is busy must not keep a stop waiting.
                priority::go_first(Urgency::Motor);
                for signal in signals.forever() {
                    last_resort::stop();
                    match signal {
                        SIGTSTP => halt(),
                        _ => heard.hear(signal),
                    }
                }
            });
        }
        shutdown
    }

    /// The signal that came, if one did.
    #[must_use]
    pub fn signal(&self) -> Option<i32> {
        Some(self.signal.load(Ordering::SeqCst)).filter(|signal| *signal != 0)
    }

    /// Ends the watched session, in place of an earlier one, when a signal comes or came.
    pub fn abort_on_signal(&self, session: Watcher) {
        let early = session.clone();
        *self.sessions.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(session);
        // Looked at after the session is known, so that no signal falls between.
        if let Some(signal) = self.signal() {
            early.insist(interrupt(signal));
        }
    }

    /// Ends the watched session, if it still runs.
    pub fn abort_now(&self, cause: &str) {
        let session = self.sessions.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(session) = &*session {
            session.ask(Command::Abort(cause.to_owned()));
        }
    }

    fn hear(&self, signal: i32) {
        if self.signal.swap(signal, Ordering::SeqCst) != 0 {
            // Asked twice: the terminal is given back, and the session can be resumed.
            give_back_in_time();
            let _ = emulate_default_handler(signal);
        }
        let session = self.sessions.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(session) = &*session {
            session.insist(interrupt(signal));
        }
    }
}

/// Gives the terminal back, unless it takes nothing any more, as over a link that stalls.
fn give_back_in_time() {
    let (done, is_done) = sync_channel(1);
    let _ = std::thread::Builder::new().name("coadapt-farewell".to_owned()).spawn(move || {
        give_back();
        let _ = done.send(());
    });
    let _ = is_done.recv_timeout(FAREWELL);
}

/// Stands still until somebody lets the program go on, as after Ctrl-Z. A real plant has
/// stopped before.
fn halt() {
    let was_taken = is_taken();
    give_back();
    // A command that was on its way meanwhile is not the last word: that is the port's thread's.
    // Another stop from here might meet its stop in the board's buffer, which does not hold both.
    WallClock::start().wait_until(LAST_WORD);
    // It halts as TSTP does, and like it only where somebody can let the program go on: STOP
    // would halt it for ever at a terminal without a shell.
    let _ = raise(SIGTTIN);
    if was_taken {
        take_again();
    }
}

fn interrupt(signal: i32) -> Command {
    let name = signal_name(signal).unwrap_or("a signal");
    Command::Interrupt(format!("{name} arrived"))
}
