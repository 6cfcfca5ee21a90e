//! From a hand's event to the first action that carries it, end to end through a
//! pseudo-terminal; and what the readers cost.
//!
//! ```sh
//! cargo bench --bench hands                  # 300 events of each device
//! HANDS_TRIES=1000 HANDS_DEVICE=mouse cargo bench --bench hands
//! ```
//!
//! The program starts itself once more on a pseudo-terminal. That child has the real screen
//! with its reader, the real control cycle on the wall's time, and the real operator; it
//! writes down when each step had acted, by the machine's monotonic clock. The parent plays the
//! terminal and the pad, and knows by the same clock when it began to write each event. A
//! step's time is taken after the plant was acted upon, so the delays are a little too long
//! rather than too short.

#![expect(clippy::expect_used, reason = "a benchmark that cannot be set up says why and ends")]
#![expect(clippy::print_stdout, reason = "the figures are the result")]

#[cfg(not(unix))]
fn main() {}

#[cfg(unix)]
fn main() {
    match std::env::var("HANDS_CHILD") {
        Ok(device) => child::run(&device),
        Err(_) => parent::run(),
    }
}

/// The machine's monotonic clock, which two processes share, ns.
#[cfg(unix)]
fn monotonic() -> i64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}

#[cfg(unix)]
mod child {
    use std::fmt::Write as _;
    use std::path::Path;
    use std::time::Duration;

    use coadapt::clock::WallClock;
    use coadapt::control::cycle::{Crew, Cycle, Rules};
    use coadapt::control::snapshot::{Command, channel};
    use coadapt::control::witness::{Happening, Standing, Witness};
    use coadapt::learner::Model;
    use coadapt::operator::Operator;
    use coadapt::operator::gamepad::link::Socket;
    use coadapt::operator::gamepad::{self, Gamepad, Source};
    use coadapt::operator::mouse::{self, Pointer};
    use coadapt::operator::terminal::{self, Hands, Keyboard};
    use coadapt::profile::Document;
    use coadapt::record::{EpisodeRow, StepRow};
    use coadapt::session::machine::Stage;
    use coadapt::session::plan::Plan;
    use coadapt::session::{Moment, Phase};
    use coadapt::sharing::Mode;
    use coadapt::study::evaluate::simulated_backend;
    use coadapt::tui::terminal::{Feed, Heard, KeysFrom, Mouse, Screen};
    use ratatui::crossterm::event::{Event, KeyCode};

    use super::monotonic;

    /// A session of nothing but one endless rollout.
    const PROFILE: &str = r#"(
        task: "speed-up",
        session: (phases: [introduction], introduction_duration_s: Some(3600.0), hold_s: 0.0),
        rules: (rollout_s: 3600.0),
    )"#;

    /// Writes down when each step had acted, what the hand wanted, how late it was, and what
    /// the readers had cost by then.
    struct Stamp(String);

    impl Witness for Stamp {
        fn allow_waiting(&mut self, _may_wait: bool) {}
        fn step(&mut self, row: &StepRow) {
            let now = monotonic();
            let wish = row.u_human.unwrap_or(f64::NAN);
            let cost = reader_ns();
            let _ = writeln!(self.0, "{now} {wish} {} {cost}", row.lateness_us);
        }
        fn episode(&mut self, _row: &EpisodeRow) {}
        fn happening(&mut self, _happening: Happening) {}
        fn standing(&mut self, _standing: Standing) {}
        fn policy(&mut self, _percent: Option<u8>, _learner: &Model) {}
        fn lost(&self) -> u64 {
            0
        }
        fn fault(&self) -> Option<String> {
            None
        }
    }

    /// The processor's time that the readers' threads have had, ns.
    fn reader_ns() -> u64 {
        let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
        tasks
            .filter(|task| {
                let name = std::fs::read_to_string(task.path().join("comm")).unwrap_or_default();
                name.starts_with("coadapt-termina") || name.starts_with("coadapt-relay")
            })
            .filter_map(|task| std::fs::read_to_string(task.path().join("schedstat")).ok())
            .filter_map(|stat| stat.split(' ').next()?.parse::<u64>().ok())
            .sum()
    }

    pub(super) fn run(device: &str) {
        let folder = std::env::var("HANDS_FOLDER").expect("the parent names a folder");
        let folder = Path::new(&folder);
        let profile = Document::from_text("hands", PROFILE).read().expect("the profile is right");
        let (tick, clock) = (profile.tick(), WallClock::start());
        let task = profile.experiment.task(tick);
        let limit = task.action_limit();

        let keys = terminal::Params { rise_s: 0.0, ..terminal::Params::default() };
        let (hands, pointer) = (Hands::new(&keys), Pointer::default());
        let feed = Feed::new(hands.clone(), clock);
        feed.replace(hands.clone(), pointer.clone());
        let operator: Box<dyn Operator> = match device {
            "keyboard" => Box::new(Keyboard::new(hands, clock, &keys, limit, tick)),
            "mouse" => {
                Box::new(mouse::Mouse::new(pointer, clock, &mouse::Params::default(), limit, tick))
            }
            _ => {
                let socket = Socket::listen(&folder.join("pad"), clock).expect("a free socket");
                let source = Source::socket(socket, clock);
                Box::new(Gamepad::new(source, &gamepad::Params::default(), limit, tick))
            }
        };

        let (publisher, watcher) =
            channel(Stage::Instruction(Moment::start_of(Phase::Introduction)));
        let fresh = profile
            .learner
            .build(task.feature_names().len(), limit)
            .expect("the learner's parameters are right");
        let rules = Rules {
            plan: Plan::new(&profile.session, tick, 1, true),
            tick,
            mode: Mode::Simultaneous,
            sharing: profile.sharing.clone(),
            teaching: profile.teaching.clone(),
            fresh: fresh.clone(),
        };
        let crew = Crew {
            task,
            backend: simulated_backend(&profile, 1),
            operator,
            witness: Stamp(String::with_capacity(1 << 24)),
            publisher: Some(publisher),
        };
        let cycle = Cycle::new(rules, crew, fresh, None);
        let mut ticking = clock;
        let control = std::thread::spawn(move || cycle.run(&mut ticking));

        let mut screen = Screen::take(feed, KeysFrom::Input).expect("a terminal");
        let read = if device == "mouse" { Mouse::Hidden } else { Mouse::Unread };
        loop {
            let seen = watcher.look();
            let words = format!("{:?} {:?}", seen.tick, seen.human);
            screen.draw(|frame| frame.render_widget(words.as_str(), frame.area())).expect("a tty");
            screen.keep_mouse(read);
            match screen.hear(Duration::from_millis(33)) {
                Heard::Event(Event::Key(key)) if key.code == KeyCode::Char('q') => break,
                Heard::Event(Event::Key(key)) if key.code == KeyCode::Enter => {
                    watcher.ask(Command::Begin);
                }
                Heard::Lost => break,
                _ => {}
            }
        }
        watcher.insist(Command::Abort("over".to_owned()));
        let outcome = control.join().expect("the control thread ends");
        std::fs::write(folder.join("steps"), outcome.witness.0).expect("a place to write");
    }
}

#[cfg(unix)]
mod parent {
    use std::io::{Read, Write};
    use std::os::unix::net::UnixStream;
    use std::path::Path;
    use std::sync::{Arc, Mutex};

    use coadapt::clock::{Clock, WallClock};
    use coadapt::operator::gamepad::relay::Outlet;
    use coadapt::operator::gamepad::{About, Axis, Event, Id, Pads, Params};
    use coadapt::random::{Place, Purpose, stream};
    use coadapt::signal::Seconds;
    use portable_pty::{Child, CommandBuilder, PtySize, native_pty_system};
    use rand::RngExt;

    use super::monotonic;

    type Pipe = Arc<Mutex<Box<dyn Write + Send>>>;

    /// A step of the child: when it had acted, the hand's wish, its lateness, the readers' cost.
    struct Step {
        at: i64,
        wish: f64,
        late_us: f64,
        cost: u64,
    }

    /// A device: what to write for a push, for rest, and for the `k`th event of a flood.
    struct Device {
        name: &'static str,
        hand: Hand,
    }

    #[expect(clippy::large_enum_variant, reason = "one, made once")]
    enum Hand {
        Keys,
        Mouse { column: u32 },
        Pad { stream: Option<UnixStream>, pads: Pads, outlet: Outlet },
    }

    pub(super) fn run() {
        let only = std::env::var("HANDS_DEVICE").ok();
        let tries = std::env::var("HANDS_TRIES").ok().and_then(|n| n.parse().ok()).unwrap_or(300);
        println!("device     event to action, ms: p50    p99    max   (a tick is 20 ms)");
        let pad = || {
            let mut pads = Pads::new(&Params::default());
            let about = About {
                id: Id(0),
                name: "Pad".to_owned(),
                guid: "0".repeat(32),
                mapping: String::new(),
            };
            pads.take(Event::Connected(about), Seconds(0.0));
            Hand::Pad { stream: None, pads, outlet: Outlet::new(1) }
        };
        for (name, hand) in
            [("keyboard", Hand::Keys), ("mouse", Hand::Mouse { column: 20 }), ("gamepad", pad())]
        {
            if only.as_ref().is_none_or(|only| only == name) {
                Device { name, hand }.measure(tries);
            }
        }
    }

    impl Device {
        fn measure(mut self, tries: usize) {
            let folder = tempfile::tempdir().expect("a folder");
            let (mut child, pipe) = start(self.name, folder.path());
            rest(1.0);
            if let Hand::Pad { stream, .. } = &mut self.hand {
                *stream = Some(UnixStream::connect(folder.path().join("pad")).expect("a socket"));
            }
            self.send(&pipe, 0.0);
            self.rest_for(0.3);
            write(&pipe, b"\r");
            self.rest_for(0.5);

            // Pushes and rests at times that have nothing to do with the ticks.
            let mut chance = stream(1, Purpose::Starts, Place::default());
            let mut sent = Vec::new();
            for _ in 0..tries {
                self.rest_for(0.12 + chance.random_range(0.0..0.05));
                sent.push(monotonic());
                self.send(&pipe, 1.0);
                self.rest_for(0.06 + chance.random_range(0.0..0.05));
                self.send(&pipe, 0.0);
            }
            // Then quiet, then a flood of so many events a second.
            let quiet = span(|| self.rest_for(5.0));
            let thousand = span(|| self.flood(&pipe, 1000, 10.0));
            self.rest_for(0.5);
            let flood = span(|| self.flood(&pipe, 5000, 10.0));
            self.send(&pipe, 0.0);
            rest(0.3);
            write(&pipe, b"q");
            child.wait().expect("the child ends");

            let steps = steps(&folder.path().join("steps"));
            let mut delays: Vec<f64> = sent
                .iter()
                .filter_map(|at| {
                    let first = steps.iter().find(|step| step.at >= *at && step.wish != 0.0)?;
                    #[expect(clippy::cast_precision_loss, reason = "milliseconds")]
                    Some((first.at - at) as f64 * 1e-6)
                })
                .collect();
            delays.sort_by(f64::total_cmp);
            let p = |part: f64| percentile(&delays, part);
            println!(
                "{:10} {:28.2} {:6.2} {:6.2}   of {} of {tries} pushes",
                self.name,
                p(0.5),
                p(0.99),
                p(1.0),
                delays.len()
            );
            for (name, span) in
                [("quiet", quiet), ("1,000 events/s", thousand), ("5,000 events/s", flood)]
            {
                tell(name, span, &steps);
            }
        }

        /// Has the hand push as far as `value`, or rest at 0.
        fn send(&mut self, pipe: &Pipe, value: f64) {
            match &mut self.hand {
                Hand::Keys if value == 0.0 => write(pipe, b"\x1b[1;1:3C"),
                Hand::Keys => write(pipe, b"\x1b[1;1:1C"),
                // A mouse that does not move rests; one that moves goes to the other side.
                Hand::Mouse { .. } if value == 0.0 => {}
                Hand::Mouse { column } => {
                    *column = 80 - *column;
                    write(pipe, format!("\x1b[<35;{column};10M").as_bytes());
                }
                Hand::Pad { stream, pads, outlet } => {
                    let axis = Event::Axis { pad: Id(0), axis: Axis::LeftStickX, value };
                    pads.take(axis, Seconds(0.0));
                    say(stream, pads, outlet);
                }
            }
        }

        /// Lets time pass; a relay sends its heartbeat meanwhile.
        fn rest_for(&mut self, time_s: f64) {
            let clock = WallClock::start();
            while clock.now().0 < time_s {
                rest((time_s - clock.now().0).clamp(0.0, 0.02));
                if let Hand::Pad { stream, pads, outlet } = &mut self.hand {
                    say(stream, pads, outlet);
                }
            }
        }

        /// Sends `rate` events a second, a burst every 10 ms.
        fn flood(&mut self, pipe: &Pipe, rate: u32, time_s: f64) {
            let mut clock = WallClock::start();
            let (mut due, mut k) = (0.0, 0_u32);
            while due < time_s {
                let mut burst = Vec::new();
                for _ in 0..rate / 100 {
                    k += 1;
                    match &mut self.hand {
                        Hand::Keys => burst.extend(b"\x1b[1;1:2C"),
                        Hand::Mouse { .. } => {
                            burst.extend(format!("\x1b[<35;{};10M", 1 + k % 80).bytes());
                        }
                        Hand::Pad { pads, outlet, .. } => {
                            let value = f64::from(k % 100) / 100.0;
                            let axis = Event::Axis { pad: Id(0), axis: Axis::LeftStickX, value };
                            pads.take(axis, Seconds(0.0));
                            burst.extend(outlet.line(pads, now()).bytes());
                            burst.push(b'\n');
                        }
                    }
                }
                match &mut self.hand {
                    Hand::Pad { stream: Some(stream), .. } => {
                        stream.write_all(&burst).expect("the child reads");
                    }
                    _ => write(pipe, &burst),
                }
                due += 0.01;
                clock.wait_until(Seconds(due));
            }
        }
    }

    fn now() -> Seconds {
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds since the machine's start")]
        Seconds(monotonic() as f64 * 1e-9)
    }

    fn say(stream: &mut Option<UnixStream>, pads: &Pads, outlet: &mut Outlet) {
        let line = format!("{}\n", outlet.line(pads, now()));
        let stream = stream.as_mut().expect("it is connected");
        stream.write_all(line.as_bytes()).expect("the child reads");
    }

    /// Starts the child on a terminal of its own that can do all that is asked for.
    fn start(device: &str, folder: &Path) -> (Box<dyn Child + Send + Sync>, Pipe) {
        let size = PtySize { rows: 24, cols: 80, pixel_width: 0, pixel_height: 0 };
        let pair = native_pty_system().openpty(size).expect("a pseudo-terminal");
        let program = std::env::current_exe().expect("this program");
        let mut command = CommandBuilder::new(program);
        command.env("HANDS_CHILD", device);
        command.env("HANDS_FOLDER", folder);
        command.env("TERM", "xterm-256color");
        for variable in ["TMUX", "STY"] {
            command.env_remove(variable);
        }
        let child = pair.slave.spawn_command(command).expect("the child starts");
        let pipe: Pipe = Arc::new(Mutex::new(pair.master.take_writer().expect("a writer")));
        let mut source = pair.master.try_clone_reader().expect("a reader");
        let answers = Arc::clone(&pipe);
        std::thread::spawn(move || {
            // The terminal is open for as long as it is read.
            let _master = pair.master;
            let (mut bytes, mut seen, mut is_asked) = ([0; 4096], Vec::new(), false);
            while let Ok(count @ 1..) = source.read(&mut bytes) {
                seen.extend_from_slice(&bytes[..count]);
                if !is_asked && seen.windows(3).any(|part| part == b"\x1b[c") {
                    is_asked = true;
                    write(&answers, b"\x1b[?0u\x1b[?2026;2$y\x1b[?62c");
                }
            }
        });
        (child, pipe)
    }

    fn write(pipe: &Pipe, bytes: &[u8]) {
        let mut pipe = pipe.lock().expect("no thread died");
        pipe.write_all(bytes).and_then(|()| pipe.flush()).expect("the child reads");
    }

    fn rest(time_s: f64) {
        WallClock::start().wait_until(Seconds(time_s));
    }

    /// From when to when `doing` was done.
    fn span(doing: impl FnOnce()) -> (i64, i64) {
        let from = monotonic();
        doing();
        (from, monotonic())
    }

    fn steps(file: &Path) -> Vec<Step> {
        let text = std::fs::read_to_string(file).expect("the child wrote its steps");
        let step = |line: &str| {
            let mut words = line.split(' ');
            Some(Step {
                at: words.next()?.parse().ok()?,
                wish: words.next()?.parse().ok()?,
                late_us: words.next()?.parse().ok()?,
                cost: words.next()?.parse().ok()?,
            })
        };
        text.lines().filter_map(step).collect()
    }

    /// What happened in a span of time: how late the ticks were, what the readers cost.
    fn tell(name: &str, (from, to): (i64, i64), steps: &[Step]) {
        let within: Vec<&Step> = steps.iter().filter(|s| (from..to).contains(&s.at)).collect();
        let (Some(first), Some(last)) = (within.first(), within.last()) else { return };
        let mut late: Vec<f64> = within.iter().map(|step| step.late_us).collect();
        late.sort_by(f64::total_cmp);
        #[expect(clippy::cast_precision_loss, reason = "a percentage")]
        let cost = (last.cost - first.cost) as f64 / (last.at - first.at) as f64 * 100.0;
        println!(
            "  {name:16} readers {cost:5.2} % of a core; ticks late p99 {:.2} ms, max {:.2} ms",
            percentile(&late, 0.99) * 1e-3,
            percentile(&late, 1.0) * 1e-3
        );
    }

    /// The value below which `part` of the sorted `values` lie.
    fn percentile(values: &[f64], part: f64) -> f64 {
        #[expect(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a place in a short list"
        )]
        let at = ((values.len() as f64 * part).ceil() as usize).clamp(1, values.len().max(1));
        values.get(at - 1).copied().unwrap_or(f64::NAN)
    }
}
