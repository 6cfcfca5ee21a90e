//! How soon the motor stops after all that may end a session, and how well states and commands
//! keep up with each other.
//!
//! ```sh
//! cargo bench --bench stops                            # 20 tries each, then 60 s at each rate
//! cargo bench --bench stops -- --tries 100 --timing 0  # more tries, no rates
//! ```
//!
//! The program starts itself once more as the emulated device, as a session at it, and as that
//! session's guard. A stop takes from just before the signal until the trace told that the motor
//! follows a command of 0: the time to write and read the trace is in it, so the figures are a
//! little too large rather than too small.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a benchmark that fails says why and ends")]
#![expect(clippy::print_stdout, reason = "the figures are the result")]

#[cfg(unix)]
#[path = "../tests/program/stand.rs"]
mod stand;

#[cfg(not(unix))]
fn main() {}

#[cfg(unix)]
fn main() -> std::process::ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let is_program = words.first().is_some_and(|word| !word.starts_with("--"));
    if is_program { victim::run() } else { measure::run(&words) }
}

#[cfg(unix)]
mod victim {
    use std::io::Read;
    use std::process::ExitCode;

    /// Names a session that is to panic when it reads something.
    pub(super) const PANICS: &str = "STOPS_PANICS";

    /// Coadapt with the same words.
    pub(super) fn run() -> ExitCode {
        if std::env::var_os(PANICS).is_some() {
            std::thread::spawn(|| {
                std::io::stdin().read_exact(&mut [0]).unwrap();
                panic!("as it was told");
            });
        }
        coadapt::run::run()
    }
}

#[cfg(unix)]
mod measure {
    use std::io::Write;
    use std::os::unix::process::CommandExt;
    use std::path::{Path, PathBuf};
    use std::process::{Child, ExitCode, Stdio};

    use coadapt::clock::{Clock, WallClock};
    use coadapt::random::{Place, Purpose, stream};
    use coadapt::signal::Seconds;
    use rand::RngExt;
    use rustix::process::{Pid, Signal, kill_process};
    use serde_json::Value;

    use super::stand::{Line, Stand, monotonic, ready, soon};
    use super::victim::PANICS;

    const PROFILES: [&str; 2] = ["physical-cart-pole", "cobs-cart-pole"];
    /// Later than this is too late.
    const LATE_MS: f64 = 150.0;

    /// What ends a session, or holds it up.
    #[derive(Clone, Copy)]
    enum Cause {
        Signal(Signal),
        Panic,
    }

    const CAUSES: [(&str, Cause); 7] = [
        ("SIGINT", Cause::Signal(Signal::INT)),
        ("SIGTERM", Cause::Signal(Signal::TERM)),
        ("SIGHUP", Cause::Signal(Signal::HUP)),
        ("SIGTSTP", Cause::Signal(Signal::TSTP)),
        ("SIGKILL", Cause::Signal(Signal::KILL)),
        ("SIGSTOP", Cause::Signal(Signal::STOP)),
        ("a panic", Cause::Panic),
    ];

    pub(super) fn run(words: &[String]) -> ExitCode {
        let number = |name: &str, default: u32| {
            let at = words.iter().position(|word| word == name);
            at.map_or(default, |at| words[at + 1].parse().unwrap())
        };
        let (tries, seconds) = (number("--tries", 20), number("--timing", 60));
        if tries > 0 {
            stops(tries);
        }
        if seconds > 0 {
            rates(seconds);
        }
        ExitCode::SUCCESS
    }

    /// This program, which is coadapt as well.
    fn program() -> PathBuf {
        std::env::current_exe().unwrap()
    }

    fn stops(tries: u32) {
        println!("motor at 0 after, ms          min  median     max   above {LATE_MS} ms");
        let mut chance = stream(1, Purpose::Starts, Place::default());
        for profile in PROFILES {
            for (name, cause) in CAUSES {
                let mut took: Vec<f64> = Vec::new();
                while took.len() < tries as usize {
                    took.extend(stop(profile, cause, chance.random_range(0.0..0.05)));
                }
                took.sort_by(f64::total_cmp);
                let late = took.iter().filter(|took| **took > LATE_MS).count();
                println!(
                    "{profile:18} {name:8} {:6.1}  {:6.1}  {:6.1}   {late} of {tries}",
                    took[0],
                    took[took.len() / 2],
                    took[took.len() - 1],
                );
            }
        }
    }

    /// How long the motor went on after `cause`, ms, which came so much `later` than any moment;
    /// `None` for a session that was over before, on a machine that was too busy.
    fn stop(profile: &'static str, cause: Cause, later: f64) -> Option<f64> {
        let mut sets = ready(profile);
        sets.extend(["session.phases=[main]", "session.main_duration_s=60.0"]);
        let stand = Stand::new(&program(), profile, &sets, "()");
        let mut command = stand.armed_session();
        // A job of its own, as a shell starts it: what stops it can let it go on.
        command.process_group(0).stdin(Stdio::piped());
        if matches!(cause, Cause::Panic) {
            command.env(PANICS, "yes");
        }
        let mut process = command.spawn().unwrap();
        let is_driven = stand.is_driven_by(&mut process);
        WallClock::start().wait_until(Seconds(later));
        if is_driven {
            soon("a moment with the motor on", || stand.motor() != 0);
        }
        let began = monotonic();
        let is_there = is_driven && process.try_wait().unwrap().is_none();
        if is_there {
            happen(cause, &mut process);
            soon("the stop", || stand.motor() == 0);
            // Long enough for whatever would start it again.
            WallClock::start().wait_until(Seconds(0.3));
        }
        let _ = process.kill();
        process.wait().unwrap();
        let trace = stand.trace_since(began);
        stand.end();
        is_there.then(|| stopped_after(began, &trace))
    }

    fn happen(cause: Cause, process: &mut Child) {
        match cause {
            Cause::Signal(signal) => kill_process(Pid::from_child(process), signal).unwrap(),
            Cause::Panic => process.stdin.as_mut().unwrap().write_all(b"!").unwrap(),
        }
    }

    /// From `began` until the motor was off for good, ms.
    fn stopped_after(began: i64, trace: &[Line]) -> f64 {
        let motor = |line: &Line| line.motor().map(|command| (line.read_ns, command));
        let off = trace.iter().rev().filter_map(motor).take_while(|(_, command)| *command == 0);
        let (off, _) = off.last().unwrap_or((i64::MAX, 0));
        #[expect(clippy::cast_precision_loss, reason = "milliseconds")]
        let took = (off - began) as f64 * 1e-6;
        took
    }

    fn rates(seconds: u32) {
        println!(
            "\n{seconds:2} s of driving               states  lost  missed ticks   state to command, µs: p50     p99     max"
        );
        for profile in PROFILES {
            for period_ms in [20, 10, 5] {
                let (rate, told) = (1000 / period_ms, rate(profile, period_ms, seconds));
                let (timing, status) = (&told["timing"], &told["status"]);
                let plant = &timing["plant"];
                let count = |value: &Value| value.as_u64().unwrap_or(0);
                let us = |part: &str| count(&plant["latency_us"][part]);
                println!(
                    "{profile:18} {rate:3} Hz {:8} {:5} {:13} {:28} {:7} {:7}   {}",
                    count(&plant["states"]),
                    count(&plant["lost"]),
                    count(&timing["missed"]),
                    us("p50"),
                    us("p99"),
                    us("max"),
                    status.as_str().unwrap_or("?"),
                );
            }
        }
    }

    /// The `session.json` of so many seconds of teaching.
    fn rate(profile: &'static str, period_ms: u32, seconds: u32) -> Value {
        let tick = format!("tick_ms={period_ms}.0");
        let duration = format!("session.main_duration_s={seconds}.0");
        let mut sets = ready(profile);
        sets.extend([&tick, &duration, "session.phases=[main]", "rules.rollout_s=3600.0"]);
        let stand = Stand::new(&program(), profile, &sets, "()");
        let output = stand.armed_session().output().unwrap();
        let session = only_folder_in(&stand.folder.path().join("logs/anon"));
        let text =
            session.and_then(|folder| std::fs::read_to_string(folder.join("session.json")).ok());
        let Some(text) = text else { panic!("no session: {output:?}") };
        serde_json::from_str(&text).unwrap()
    }

    /// The one folder in `folder`.
    fn only_folder_in(folder: &Path) -> Option<PathBuf> {
        let entries = std::fs::read_dir(folder).ok()?.flatten();
        entries.map(|entry| entry.path()).find(|path| path.is_dir())
    }
}
