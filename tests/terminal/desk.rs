//! A terminal with the program on it, in a folder of its own.

use std::fs;
use std::io::{Read, Write};
use std::num::NonZero;
use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;

use coadapt::clock::{Clock, WallClock};
use coadapt::signal::Seconds;
use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, native_pty_system};
use serde_json::Value;

/// How long anything may take on a busy machine.
const PATIENCE: Seconds = Seconds(20.0);

/// What the terminal says when it is asked what it can do.
#[derive(Clone, Copy, PartialEq)]
pub enum Answers {
    /// Nothing, ever.
    Never,
    /// That it is a terminal.
    Plainly,
    /// That it also reports key releases.
    WithKitty,
    /// That it also reports the mouse in pixels; a cell has 10 by 20.
    WithPixels,
    /// Plainly, while keys are typed.
    Among(&'static str),
}

/// How a terminal is to be.
pub struct Seat {
    pub columns: u16,
    pub rows: u16,
    pub answers: Answers,
    pub variables: Vec<(&'static str, &'static str)>,
    pub desk: Option<tempfile::TempDir>,
    /// The file in the desk's folder that standard output goes to, in place of the terminal.
    pub output: Option<&'static str>,
}

impl Default for Seat {
    fn default() -> Self {
        let answers = Answers::Plainly;
        Self { columns: 80, rows: 24, answers, variables: Vec::new(), desk: None, output: None }
    }
}

/// What the program wrote so far, and the screen that it makes.
struct Seen {
    raw: Vec<u8>,
    screen: vt100::Parser,
}

/// A terminal with the program on it; the program is killed with it.
pub struct Terminal {
    /// None once the terminal was closed.
    master: Option<Box<dyn MasterPty + Send>>,
    is_closing: Arc<AtomicBool>,
    child: Box<dyn Child + Send + Sync>,
    writer: Arc<Mutex<Box<dyn Write + Send>>>,
    seen: Arc<Mutex<Seen>>,
    reader: Option<JoinHandle<()>>,
    settings: String,
    desk: Option<tempfile::TempDir>,
}

impl Seat {
    /// The terminal, with the words of `line` given to the program.
    pub fn open(self, line: &str) -> Terminal {
        let desk = self.desk.unwrap_or_else(|| tempfile::tempdir().unwrap());
        let pair = native_pty_system().openpty(size(self.columns, self.rows)).unwrap();
        let program = env!("CARGO_BIN_EXE_coadapt");
        let mut command = match self.output {
            None => CommandBuilder::new(program),
            Some(file) => {
                let mut shell = CommandBuilder::new("/bin/sh");
                shell.args(["-c", &format!("exec \"$0\" \"$@\" > {file}"), program]);
                shell
            }
        };
        command.args(line.split_whitespace());
        command.cwd(desk.path());
        command.env_clear();
        command.env("TERM", "xterm-256color");
        command.env("LANG", "C.UTF-8");
        for (name, value) in &self.variables {
            command.env(name, value);
        }
        let settings = format!("{:?}", pair.master.get_termios());
        let child = pair.slave.spawn_command(command).unwrap();
        let writer = Arc::new(Mutex::new(pair.master.take_writer().unwrap()));
        let screen = vt100::Parser::new(some(self.rows), some(self.columns), 0);
        let seen = Arc::new(Mutex::new(Seen { raw: Vec::new(), screen }));
        let source = pair.master.try_clone_reader().unwrap();
        let (to, from, answers) = (Arc::clone(&seen), Arc::clone(&writer), self.answers);
        let is_closing = Arc::new(AtomicBool::new(false));
        let is_over = Arc::clone(&is_closing);
        let reader = std::thread::spawn(move || read(source, &to, &from, answers, &is_over));
        let desk = Some(desk);
        let (master, reader) = (Some(pair.master), Some(reader));
        Terminal { master, is_closing, child, writer, seen, reader, settings, desk }
    }
}

fn some(count: u16) -> NonZero<u16> {
    NonZero::new(count).unwrap()
}

fn size(columns: u16, rows: u16) -> PtySize {
    PtySize { rows, cols: columns, pixel_width: 0, pixel_height: 0 }
}

/// Takes what the program writes, and answers its question.
fn read(
    mut source: Box<dyn Read + Send>,
    seen: &Mutex<Seen>,
    writer: &Mutex<Box<dyn Write + Send>>,
    answers: Answers,
    is_over: &AtomicBool,
) {
    let mut bytes = [0; 4096];
    let mut asked = false;
    // A terminal whose program ended is an error on Linux.
    while !is_over.load(Ordering::SeqCst)
        && let Ok(count @ 1..) = source.read(&mut bytes)
    {
        let mut seen = seen.lock().unwrap();
        seen.raw.extend_from_slice(&bytes[..count]);
        seen.screen.process(&bytes[..count]);
        if !asked && contains(&seen.raw, b"\x1b[c") {
            asked = true;
            assert!(contains(&seen.raw, b"\x1b[?u"), "the last question came first");
            let answer = match answers {
                Answers::Never => String::new(),
                Answers::Plainly => "\x1b[?1016;0$y\x1b[?62c".to_owned(),
                Answers::WithKitty => "\x1b[?0u\x1b[?62c".to_owned(),
                Answers::WithPixels => {
                    "\x1b[?1016;2$y\x1b[?2026;2$y\x1b[6;20;10t\x1b[?62c".to_owned()
                }
                Answers::Among(keys) => format!("{keys}\x1b[?1016;0$y{keys}\x1b[?62c{keys}"),
            };
            writer.lock().unwrap().write_all(answer.as_bytes()).unwrap();
        }
    }
}

/// Lets `time_s` pass.
pub fn rest(time_s: f64) {
    WallClock::start().wait_until(Seconds(time_s));
}

fn contains(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}

impl Terminal {
    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap()
    }

    fn screen(&self) -> String {
        self.seen().screen.screen().contents()
    }

    /// Waits until the screen shows `text`.
    pub fn shows(&self, text: &str) {
        self.shows_that(text, |screen| screen.contains(text));
    }

    /// Waits until the screen is as `is` says; `what` is for the message.
    pub fn shows_that(&self, what: &str, is: impl Fn(&str) -> bool) {
        let mut clock = WallClock::start();
        while !is(&self.screen()) {
            let now = clock.now();
            assert!(now < PATIENCE, "{what}: not on the screen, but\n{}", self.screen());
            clock.wait_until(now + Seconds(0.01));
        }
    }

    /// Waits until a rollout is under way. The instruction speaks of GO as well.
    pub fn goes(&self) {
        self.shows_that("GO", |screen| screen.contains("motor") && screen.contains(" GO "));
    }

    /// Waits for the countdown.
    pub fn waits(&self) {
        self.shows_that("WAIT", |screen| screen.contains("motor") && screen.contains(" WAIT "));
    }

    /// Stops reading what the program writes, as a link that stalls, and does `what` every 0.1 s
    /// until the program has ended.
    pub fn stalls(&mut self, what: impl Fn(&Self)) {
        let seen = Arc::clone(&self.seen);
        let _reader_waits = seen.lock().unwrap();
        // The system's own buffer fills up with whole pictures.
        for columns in (0..60).map(|turn| 80 + turn % 2) {
            self.master.as_ref().unwrap().resize(size(columns, 24)).unwrap();
            rest(0.05);
        }
        let mut clock = WallClock::start();
        while self.child.try_wait().unwrap().is_none() {
            let now = clock.now();
            assert!(now < PATIENCE, "the program never ended");
            what(self);
            clock.wait_until(now + Seconds(0.1));
        }
    }

    pub fn keys(&self, keys: &str) {
        let mut writer = self.writer.lock().unwrap();
        writer.write_all(keys.as_bytes()).unwrap();
        writer.flush().unwrap();
    }

    pub fn resize(&self, columns: u16, rows: u16) {
        let mut seen = self.seen();
        self.master.as_ref().unwrap().resize(size(columns, rows)).unwrap();
        seen.screen.screen_mut().set_size(some(rows), some(columns));
    }

    pub fn signal(&self, name: &str) {
        let line = format!("kill -{name} {}", self.child.process_id().unwrap());
        assert!(Command::new("sh").args(["-c", &line]).status().unwrap().success());
    }

    /// Closes the terminal's window, so to say. The program draws, so that the reader hears
    /// of it.
    pub fn close(&mut self) {
        self.is_closing.store(true, Ordering::SeqCst);
        self.reader.take().unwrap().join().unwrap();
        *self.writer.lock().unwrap() = Box::new(std::io::sink());
        self.master = None;
    }

    /// Waits for the program's end; its exit code.
    pub fn code(&mut self) -> u32 {
        let mut clock = WallClock::start();
        let code = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status.exit_code();
            }
            assert!(clock.now() < PATIENCE, "it does not end:\n{}", self.screen());
            clock.wait_until(clock.now() + Seconds(0.01));
        };
        if let Some(reader) = self.reader.take() {
            reader.join().unwrap();
        }
        code
    }

    /// Whether the program wrote `text`.
    pub fn wrote(&self, text: &str) -> bool {
        contains(&self.seen().raw, text.as_bytes())
    }

    /// The terminal is as the program found it: screen, cursor and settings.
    pub fn is_given_back(&self) {
        let seen = self.seen();
        let screen = seen.screen.screen();
        assert!(!screen.alternate_screen(), "still the other screen");
        assert!(!screen.hide_cursor(), "no cursor");
        let settings = self.master.as_ref().unwrap().get_termios();
        assert_eq!(format!("{settings:?}"), self.settings);
        let last = |text: &str| {
            let text = text.as_bytes();
            seen.raw.windows(text.len()).rposition(|window| window == text)
        };
        assert!(last("\x1b[?1004l") > last("\x1b[?1004h"), "focus is still reported");
        assert!(last("\x1b[?2026l") > last("\x1b[?2026h"), "an update is still open");
        assert!(last("\x1b[?1049h").is_some(), "it was never taken");
        for (on, off) in [
            ("\x1b[?1003h", "\x1b[?1003l"),
            ("\x1b[?1006h", "\x1b[?1006l"),
            ("\x1b[?1016h", "\x1b[?1016l"),
            ("\x1b[>3p", "\x1b[>1p"),
            ("\x1b]22;none\x1b\\", "\x1b]22;\x1b\\"),
        ] {
            assert!(last(on).is_none() || last(off) > last(on), "{on:?} is not undone");
        }
    }

    /// The colours that the program asked for.
    pub fn colours(&self) -> Vec<String> {
        let raw = String::from_utf8_lossy(&self.seen().raw).into_owned();
        let styles = raw.split("\x1b[").skip(1).filter_map(|rest| {
            let end = rest.find(|c: char| !c.is_ascii_digit() && c != ';' && c != ':')?;
            rest[end..].starts_with('m').then(|| rest[..end].to_owned())
        });
        let is_colour = |style: &String| {
            style.split(';').any(|part| {
                let code: u8 = part.split(':').next().unwrap().parse().unwrap_or(0);
                matches!(code, 30..=38 | 40..=48 | 58 | 90..=97 | 100..=107)
            })
        };
        styles.filter(is_colour).collect()
    }

    /// Nothing but 7-bit characters was written.
    pub fn is_ascii(&self) {
        let seen = self.seen();
        if let Some(at) = seen.raw.iter().position(|byte| !byte.is_ascii()) {
            let around = &seen.raw[at.saturating_sub(40)..seen.raw.len().min(at + 40)];
            panic!("not 7 bits: {}", String::from_utf8_lossy(around));
        }
    }

    /// The path of `name` in the program's folder.
    pub fn at(&self, name: &str) -> PathBuf {
        self.desk.as_ref().unwrap().path().join(name)
    }

    /// The folder, for another terminal.
    pub fn into_desk(mut self) -> tempfile::TempDir {
        self.desk.take().unwrap()
    }

    /// What `session.json` of a session says.
    pub fn session(&self, folder: &str) -> Value {
        let text = fs::read(self.at(folder).join("session.json")).unwrap();
        serde_json::from_slice(&text).unwrap()
    }

    /// The person's pushes, row by row, from `steps.csv`, whose rows are whole.
    pub fn pushes(&self, folder: &str) -> Vec<f64> {
        self.column(folder, "u_human")
    }

    /// A column of `steps.csv`, without empty cells.
    pub fn column(&self, folder: &str, name: &str) -> Vec<f64> {
        let text = fs::read_to_string(self.at(folder).join("steps.csv")).unwrap_or_default();
        let whole = &text[..text.rfind('\n').map_or(0, |end| end + 1)];
        let mut rows = whole.lines().map(|row| row.split(',').collect::<Vec<_>>());
        let Some(header) = rows.next() else { return Vec::new() };
        let column = header.iter().position(|known| *known == name).unwrap();
        rows.inspect(|row| assert_eq!(row.len(), header.len(), "{row:?}"))
            .filter_map(|row| row[column].parse().ok())
            .collect()
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
