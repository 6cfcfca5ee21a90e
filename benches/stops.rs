//! How soon the motor stops after all that may end a session, and how well states and commands
//! keep up with each other.
//!
//! ```sh
//! cargo bench --bench stops     # 20 tries each, then 60 s at each rate, then 50 sessions of faults
//! cargo bench --bench stops -- --tries 100 --timing 0 --faults 0    # more tries, nothing else
//! cargo bench --bench stops -- --profile cobs-cart-pole --rate 100  # one device, one rate
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
    use std::fs::OpenOptions;
    use std::io::Write;
    use std::os::unix::process::CommandExt;
    use std::path::{Path, PathBuf};
    use std::process::{Child, Command, ExitCode, Output, Stdio};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::thread::JoinHandle;
    use std::time::Duration;

    use coadapt::backend::emulator::faults::{Faults, Noise};
    use coadapt::backend::emulator::port::Port;
    use coadapt::clock::{Clock, WallClock};
    use coadapt::random::{Place, Purpose, stream};
    use coadapt::signal::Seconds;
    use rand::RngExt;
    use rustix::process::{Pid, Signal, kill_process};
    use rustix::termios::{Winsize, tcsetwinsize};
    use serde_json::Value;

    use super::stand::{Line, Stand, monotonic, offences, ready, soon};
    use super::victim::PANICS;

    const PROFILES: [&str; 2] = ["physical-cart-pole", "cobs-cart-pole"];
    /// The most noise of a session of faults.
    const NOISE: Noise = Noise {
        drop: 0.002,
        duplicate: 0.002,
        flip: 0.002,
        truncate: 0.01,
        delay: 0.02,
        longest_delay_s: 0.03,
    };
    /// Later than this is too late.
    const LATE_MS: f64 = 150.0;

    /// What ends a session, or holds it up.
    #[derive(Clone, Copy)]
    enum Cause {
        Signal(Signal),
        Panic,
        ClosedTerminal,
    }

    const CAUSES: [(&str, Cause); 8] = [
        ("SIGINT", Cause::Signal(Signal::INT)),
        ("SIGTERM", Cause::Signal(Signal::TERM)),
        ("SIGHUP", Cause::Signal(Signal::HUP)),
        ("SIGTSTP", Cause::Signal(Signal::TSTP)),
        ("SIGKILL", Cause::Signal(Signal::KILL)),
        ("SIGSTOP", Cause::Signal(Signal::STOP)),
        ("a panic", Cause::Panic),
        ("closed", Cause::ClosedTerminal),
    ];

    pub(super) fn run(words: &[String]) -> ExitCode {
        let number = |name: &str, default: u32| {
            let at = words.iter().position(|word| word == name);
            at.map_or(default, |at| words[at + 1].parse().unwrap())
        };
        let only = words.iter().position(|word| word == "--profile").map(|at| &words[at + 1]);
        let profiles: Vec<_> =
            PROFILES.into_iter().filter(|name| only.is_none_or(|only| only == name)).collect();
        let (tries, seconds) = (number("--tries", 20), number("--timing", 60));
        let sessions = number("--faults", 50);
        let mut failures = 0;
        if tries > 0 {
            failures += stops(&profiles, tries);
        }
        if seconds > 0 {
            rates(&profiles, number("--rate", 0), seconds);
        }
        if sessions > 0 {
            failures += faults(&profiles, sessions);
        }
        ExitCode::from(u8::from(failures > 0))
    }

    /// This program, which is coadapt as well.
    fn program() -> PathBuf {
        std::env::current_exe().unwrap()
    }

    fn stops(profiles: &[&'static str], tries: u32) -> usize {
        println!("motor at 0 after, ms          min  median     max   above {LATE_MS} ms");
        let mut chance = stream(1, Purpose::Starts, Place::default());
        let mut all_late = 0;
        for profile in profiles.iter().copied() {
            for (name, cause) in CAUSES {
                let mut took: Vec<f64> = Vec::new();
                let mut over = 0;
                while took.len() < tries as usize && over <= tries {
                    match stop(profile, cause, chance.random_range(0.0..0.05)) {
                        Some(ms) => took.push(ms),
                        None => over += 1,
                    }
                }
                took.sort_by(f64::total_cmp);
                let (Some(least), Some(most)) = (took.first(), took.last()) else {
                    println!("{profile:18} {name:8} no session came as far as to drive");
                    all_late += 1;
                    continue;
                };
                let late = took.iter().filter(|took| **took > LATE_MS).count();
                println!(
                    "{profile:18} {name:8} {:6.1}  {:6.1}  {:6.1}   {late} of {tries}{}",
                    least,
                    took[took.len() / 2],
                    most,
                    if over > 0 {
                        format!(", {over} more were over before")
                    } else {
                        String::new()
                    },
                );
                all_late += late;
            }
        }
        all_late
    }

    /// How long the motor went on after `cause`, ms, which came so much `later` than any moment;
    /// `None` for a session that was over before, on a machine that was too busy.
    fn stop(profile: &'static str, cause: Cause, later: f64) -> Option<f64> {
        let mut sets = ready(profile);
        sets.extend(["session.phases=[main]", "session.main_duration_s=60.0"]);
        sets.push("backend.hold_to_enable=false");
        let stand = Stand::new(&program(), profile, &sets, "()");
        let (mut process, mut screen) = match cause {
            Cause::ClosedTerminal => {
                let (process, screen) = Screen::at(&stand);
                screen.begin(&stand);
                (process, Some(screen))
            }
            _ => (alone(&stand, cause), None),
        };
        let is_driven = stand.is_driven_by(&mut process);
        wait(later);
        if is_driven {
            soon("a moment with the motor on", || stand.motor() != 0);
        }
        let began = monotonic();
        let is_there = is_driven && process.try_wait().unwrap().is_none();
        if is_there {
            match cause {
                Cause::Signal(signal) => {
                    kill_process(Pid::from_child(&process), signal).unwrap();
                }
                Cause::Panic => process.stdin.as_mut().unwrap().write_all(b"!").unwrap(),
                Cause::ClosedTerminal => drop(screen.take()),
            }
            soon("the stop", || stand.motor() == 0);
            // Long enough for whatever would start it again.
            wait(0.3);
        }
        let _ = process.kill();
        process.wait().unwrap();
        let trace = stand.trace_since(began);
        stand.end();
        is_there.then(|| stopped_after(began, &trace))
    }

    /// A session that nobody watches.
    fn alone(stand: &Stand, cause: Cause) -> Child {
        let mut command = stand.armed_session();
        // A job of its own, as a shell starts it: what stops it can let it go on.
        command.process_group(0).stdin(Stdio::piped());
        if matches!(cause, Cause::Panic) {
            command.env(PANICS, "yes");
        }
        command.spawn().unwrap()
    }

    /// A terminal with a session on its screen. Dropped, it is closed.
    struct Screen {
        terminal: Arc<Port>,
        reader: Option<JoinHandle<()>>,
        closes: Arc<AtomicBool>,
    }

    impl Screen {
        /// A session at a terminal of its own.
        fn at(stand: &Stand) -> (Child, Self) {
            let terminal = Arc::new(Port::open(None).unwrap());
            let open = || OpenOptions::new().read(true).write(true).open(terminal.name()).unwrap();
            let size = Winsize { ws_row: 24, ws_col: 80, ws_xpixel: 0, ws_ypixel: 0 };
            tcsetwinsize(open(), size).unwrap();
            let process = Command::new("setsid")
                .args(["--ctty", &program().display().to_string()])
                .args(stand.words())
                .args(["--backend", &format!("serial:{}", stand.port())])
                .current_dir(stand.folder.path())
                .stdin(open())
                .stdout(open())
                .stderr(open())
                .spawn()
                .unwrap();
            let closes = Arc::new(AtomicBool::new(false));
            let (screen, is_closed) = (Arc::clone(&terminal), Arc::clone(&closes));
            let reader = std::thread::spawn(move || {
                while !is_closed.load(Ordering::Relaxed) {
                    let _ = screen.read(&mut [0; 4096], Duration::from_millis(2));
                }
            });
            (process, Self { terminal, reader: Some(reader), closes })
        }

        /// The person homes and arms the device, looks at the scene, and begins.
        fn begin(&self, stand: &Stand) {
            wait(2.0);
            if stand.profile == "cobs-cart-pole" {
                self.press("f");
                self.press("y");
                let is_homed = |line: &Line| line.entry["what"] == "homing_ended";
                soon("the end of homing", || stand.trace().iter().any(is_homed));
                wait(1.0);
            }
            for key in ["m", "o", "\r"] {
                self.press(key);
            }
        }

        fn press(&self, key: &str) {
            self.terminal.write(key.as_bytes()).unwrap();
            wait(0.5);
        }
    }

    fn wait(time_s: f64) {
        WallClock::start().wait_until(Seconds(time_s));
    }

    impl Drop for Screen {
        fn drop(&mut self) {
            self.closes.store(true, Ordering::Relaxed);
            let _ = self.reader.take().map(JoinHandle::join);
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

    fn rates(profiles: &[&'static str], only: u32, seconds: u32) {
        println!(
            "\n{seconds:2} s of driving               states  lost  missed ticks   state to command, µs: p50     p99     max"
        );
        for profile in profiles.iter().copied() {
            for rate in [50, 100, 200] {
                if ![0, rate].contains(&only) {
                    continue;
                }
                let (told, why) = drive(profile, 1000 / rate, seconds);
                let (timing, status) = (&told["timing"], &told["status"]);
                let plant = &timing["plant"];
                let count = |value: &Value| value.as_u64().unwrap_or(0);
                let us = |part: &str| count(&plant["latency_us"][part]);
                println!(
                    "{profile:18} {rate:3} Hz {:8} {:5} {:13} {:28} {:7} {:7}   {}{}",
                    count(&plant["states"]),
                    count(&plant["lost"]),
                    count(&timing["missed"]),
                    us("p50"),
                    us("p99"),
                    us("max"),
                    status.as_str().unwrap_or("?"),
                    if status == "complete" { "" } else { &why },
                );
            }
        }
    }

    /// Sessions of random faults: how they ended, and whether the device got what it must not.
    fn faults(profiles: &[&'static str], sessions: u32) -> usize {
        println!("\nsessions of random faults");
        let mut forbidden = 0;
        for seed in 0..sessions {
            let mut chance = stream(u64::from(seed), Purpose::Starts, Place::default());
            let profile = profiles[seed as usize % profiles.len()];
            let faults = Faults::random(&mut chance, &NOISE, 12.0);
            let mut sets = ready(profile);
            sets.extend(["session.phases=[main]", "session.main_duration_s=6.0"]);
            let stand = Stand::new(&program(), profile, &sets, &ron::to_string(&faults).unwrap());
            let output = stand.armed_session().output().unwrap();
            let trace = stand.end();
            let bad: Vec<_> = offences(&trace).iter().map(|line| line.entry.to_string()).collect();
            forbidden += bad.len();
            let code = output.status.code();
            println!("{seed:3} {profile:18} {code:?} {} {bad:?}", said(&output));
            assert!(matches!(code, Some(0 | 1)), "{output:?}");
        }
        println!("{sessions} sessions, {forbidden} forbidden sends");
        forbidden
    }

    /// The `session.json` of so many seconds of teaching, and what the session said.
    fn drive(profile: &'static str, period_ms: u32, seconds: u32) -> (Value, String) {
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
        (serde_json::from_str(&text).unwrap(), format!(": {}", said(&output)))
    }

    /// The line in which a session says how it ended.
    fn said(output: &Output) -> String {
        let all = [&output.stdout, &output.stderr].map(|part| String::from_utf8_lossy(part));
        let mut lines = all.iter().flat_map(|part| part.lines());
        lines
            .find(|line| line.contains("ended") || line.contains("coadapt: "))
            .unwrap_or("complete")
            .to_owned()
    }

    /// The one folder in `folder`.
    fn only_folder_in(folder: &Path) -> Option<PathBuf> {
        let entries = std::fs::read_dir(folder).ok()?.flatten();
        entries.map(|entry| entry.path()).find(|path| path.is_dir())
    }
}
