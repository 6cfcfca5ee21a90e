//! The terminal: taken over, asked, read by one thread, and always given back.

mod abilities;
mod answers;
mod capture;
mod feed;
mod probe;

use std::io::{self, BufWriter, IsTerminal, Stdout, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

use ratatui::Frame;
use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::event::{
    self, DisableFocusChange, EnableFocusChange, Event, KeyboardEnhancementFlags,
    PopKeyboardEnhancementFlags, PushKeyboardEnhancementFlags,
};
use ratatui::crossterm::terminal::{
    BeginSynchronizedUpdate, EndSynchronizedUpdate, EnterAlternateScreen, LeaveAlternateScreen,
    disable_raw_mode, enable_raw_mode,
};
use ratatui::crossterm::{cursor, execute, queue};

pub use abilities::Abilities;
pub use capture::Mouse;
pub use feed::Feed;
pub use probe::{inside, probe};

use probe::Tty;

use super::palette::{Glyphs, Look, Palette};
use crate::profile;

/// Whether the terminal is ours, so that it is given back exactly once.
static TAKEN: AtomicBool = AtomicBool::new(false);
/// Whether it was told to report key releases.
static REPORTS_RELEASES: AtomicBool = AtomicBool::new(false);

/// All keys as escape codes: otherwise letters would have no releases.
const ALL_KEYS: KeyboardEnhancementFlags = KeyboardEnhancementFlags::DISAMBIGUATE_ESCAPE_CODES
    .union(KeyboardEnhancementFlags::REPORT_EVENT_TYPES)
    .union(KeyboardEnhancementFlags::REPORT_ALL_KEYS_AS_ESCAPE_CODES)
    .union(KeyboardEnhancementFlags::REPORT_ALTERNATE_KEYS);
/// Whether the next picture must be painted in full.
static BLANK: AtomicBool = AtomicBool::new(false);

/// Why there is no screen.
#[derive(Debug, thiserror::Error)]
pub enum NoScreen {
    /// Standard input or output is a file or a pipe.
    #[error("there is no terminal here (standard {0} is not one): run coadapt in a terminal")]
    NoTerminal(&'static str),
    /// The terminal cannot be drawn on.
    #[error("the terminal says TERM=dumb and cannot show a screen: use another terminal")]
    Dumb,
    /// The system refused.
    #[error("the terminal could not be taken over: {0}")]
    Io(#[from] io::Error),
}

/// Where keys come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeysFrom {
    /// Standard input.
    Input,
    /// The terminal that the program was started at, since standard input is a pipe with
    /// something else in it.
    Terminal,
}

/// What the reader thread saw.
#[derive(Debug)]
pub enum Heard {
    /// A key, a new size, a paste.
    Event(Event),
    /// Nothing for as long as one was ready to wait.
    Nothing,
    /// The terminal is gone.
    Lost,
}

/// The terminal while it is ours.
pub struct Screen {
    terminal: ratatui::Terminal<CrosstermBackend<BufWriter<Stdout>>>,
    heard: Receiver<Heard>,
    sender: Option<SyncSender<Heard>>,
    stop: Arc<AtomicBool>,
    feed: Feed,
}

impl Screen {
    /// Whether there is a terminal to take over.
    ///
    /// # Errors
    /// When there is none, or none that can be drawn on.
    pub fn check(keys: KeysFrom) -> Result<(), NoScreen> {
        if keys == KeysFrom::Input && !io::stdin().is_terminal() {
            return Err(NoScreen::NoTerminal("input"));
        }
        if !io::stdout().is_terminal() {
            return Err(NoScreen::NoTerminal("output"));
        }
        if std::env::var("TERM").is_ok_and(|term| term == "dumb") {
            return Err(NoScreen::Dumb);
        }
        Ok(())
    }

    /// Takes the terminal over. Nothing is asked of it yet: the first picture comes first.
    ///
    /// # Errors
    /// When there is none, or it refuses.
    pub fn take(feed: Feed, keys: KeysFrom) -> Result<Self, NoScreen> {
        Self::check(keys)?;
        enable_raw_mode()?;
        TAKEN.store(true, Ordering::SeqCst);
        let mut out = BufWriter::with_capacity(1 << 16, io::stdout());
        let (sender, heard) = sync_channel(256);
        let stop = Arc::new(AtomicBool::new(false));
        let taken = execute!(out, EnterAlternateScreen, cursor::Hide, EnableFocusChange)
            .and_then(|()| ratatui::Terminal::new(CrosstermBackend::new(out)));
        match taken {
            Ok(terminal) => Ok(Self { terminal, heard, sender: Some(sender), stop, feed }),
            Err(error) => {
                give_back();
                Err(error.into())
            }
        }
    }

    /// Draws one frame, as one synchronised update, while the terminal is ours. The keys are
    /// read from the first on.
    ///
    /// # Errors
    /// When the terminal is gone.
    pub fn draw(&mut self, picture: impl FnOnce(&mut Frame<'_>)) -> io::Result<()> {
        if !is_taken() {
            return Ok(());
        }
        if BLANK.swap(false, Ordering::SeqCst) {
            // A new size is painted in full, even the same one; clearing would first ask the
            // terminal where its cursor is, and the answer is among the keys.
            let size = self.terminal.size()?;
            self.terminal.resize(size.into())?;
        }
        queue!(self.terminal.backend_mut(), BeginSynchronizedUpdate)?;
        self.terminal.draw(picture)?;
        execute!(self.terminal.backend_mut(), EndSynchronizedUpdate)?;
        if let Some(sender) = self.sender.take() {
            let (feed, stop) = (self.feed.clone(), Arc::clone(&self.stop));
            std::thread::Builder::new().name("coadapt-terminal".to_owned()).spawn(move || {
                let _hands = Attended(&feed);
                read(&sender, &feed, &stop);
            })?;
        }
        Ok(())
    }

    /// The next thing heard within `patience`.
    #[must_use]
    pub fn hear(&self, patience: Duration) -> Heard {
        match self.heard.recv_timeout(patience) {
            Ok(heard) => heard,
            Err(RecvTimeoutError::Timeout) => Heard::Nothing,
            Err(RecvTimeoutError::Disconnected) => Heard::Lost,
        }
    }

    /// Reads the mouse from now on, or no longer. It is read once the terminal has said
    /// whether in pixels or in cells, so this is to be asked for again with every picture.
    pub fn keep_mouse(&mut self, wanted: Mouse) {
        capture::keep(self.terminal.backend_mut(), wanted, &self.feed);
    }

    /// The feed of steering keys and the pointer.
    #[must_use]
    pub const fn feed(&self) -> &Feed {
        &self.feed
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        give_back();
    }
}

/// Gives the terminal back as it was, if it is ours. Every failure is passed over: what can
/// be undone is undone.
pub fn give_back() {
    if !TAKEN.swap(false, Ordering::SeqCst) {
        return;
    }
    let mut out = io::stdout();
    capture::give_back(&mut out);
    if REPORTS_RELEASES.load(Ordering::SeqCst) {
        let _ = execute!(out, PopKeyboardEnhancementFlags);
    }
    let _ = execute!(out, DisableFocusChange, EndSynchronizedUpdate, LeaveAlternateScreen);
    let _ = execute!(out, cursor::Show);
    let _ = disable_raw_mode();
    let _ = out.flush();
}

/// Takes the terminal once more that was given back only for a while. A terminal that is gone
/// by now fails at the next picture.
pub fn take_again() {
    let _ = enable_raw_mode();
    let mut out = io::stdout();
    let _ = execute!(out, EnterAlternateScreen, cursor::Hide, EnableFocusChange);
    if REPORTS_RELEASES.load(Ordering::SeqCst) {
        let _ = execute!(out, PushKeyboardEnhancementFlags(ALL_KEYS));
    }
    BLANK.store(true, Ordering::SeqCst);
    TAKEN.store(true, Ordering::SeqCst);
}

/// Whether the terminal is ours now.
#[must_use]
pub fn is_taken() -> bool {
    TAKEN.load(Ordering::SeqCst)
}

/// Hands that are watched; once nobody reads any more, however that came, nothing is held.
struct Attended<'a>(&'a Feed);

impl Drop for Attended<'_> {
    fn drop(&mut self) {
        self.0.let_go();
    }
}

/// The one reader of the terminal: asks what it can do, feeds the hands at once, and passes
/// everything on.
///
/// A terminal that never answers delays how the first keys are understood, but neither a key
/// nor a picture: what is typed while it is asked is passed on as it comes.
fn read(sender: &SyncSender<Heard>, feed: &Feed, stop: &AtomicBool) {
    let pass = |event: Event| {
        feed.take(&event);
        // A mouse moves more often than anyone looks, and only hands care.
        if matches!(event, Event::Mouse(_)) {
            return;
        }
        // A full queue means that nobody looks; hands were fed all the same.
        let _ = sender.try_send(Heard::Event(event));
    };
    let is_stopped = || stop.load(Ordering::SeqCst);
    let asked = Tty::open().and_then(|tty| probe::ask(&tty, feed.clock, pass, is_stopped));
    let Ok(abilities) = asked else {
        let _ = sender.try_send(Heard::Lost);
        return;
    };
    report_releases(&abilities, feed);
    while !is_stopped() {
        match event::poll(Duration::from_millis(100))
            .and_then(|ready| if ready { event::read().map(Some) } else { Ok(None) })
        {
            Ok(Some(event)) => pass(event),
            Ok(None) => {}
            Err(_) => {
                let _ = sender.try_send(Heard::Lost);
                return;
            }
        }
    }
}

/// Has the terminal report key releases, if it can.
fn report_releases(abilities: &Abilities, feed: &Feed) {
    if !abilities.key_releases || !is_taken() {
        return;
    }
    if execute!(io::stdout(), PushKeyboardEnhancementFlags(ALL_KEYS)).is_ok() {
        REPORTS_RELEASES.store(true, Ordering::SeqCst);
        feed.hands().set_releases_known(true);
    }
}

/// How pictures look here: what the profile asks for, what the environment says.
#[must_use]
pub fn look(wanted: profile::Glyphs) -> Look {
    let set = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    let palette = if set("NO_COLOR").is_some() { Palette::Plain } else { Palette::Colours };
    let speaks_unicode = speaks_unicode(set);
    let is_console = set("TERM").is_some_and(|term| term == "linux");
    let glyphs = match wanted {
        profile::Glyphs::Braille => Glyphs::Braille,
        profile::Glyphs::Half => Glyphs::Half,
        profile::Glyphs::Auto if speaks_unicode && !is_console => Glyphs::Braille,
        profile::Glyphs::Ascii | profile::Glyphs::Auto => Glyphs::Ascii,
    };
    Look { glyphs, palette }
}

/// Whether the locale is one of UTF-8, with `get` for a variable that is set and not empty.
#[must_use]
pub fn speaks_unicode(get: impl Fn(&str) -> Option<String>) -> bool {
    let locale = get("LC_ALL").or_else(|| get("LC_CTYPE")).or_else(|| get("LANG"));
    locale.is_some_and(|locale| {
        let locale = locale.to_ascii_lowercase();
        locale.contains("utf-8") || locale.contains("utf8")
    })
}
