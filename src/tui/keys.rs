//! The keys: one table that both obeys and explains them.

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use crate::operator::Device;

/// Where a key is pressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Screen {
    /// Choosing a session.
    Setup,
    /// Reading an instruction, or having a break.
    Briefing,
    /// A session under way.
    Live,
    /// A session's results.
    Results,
    /// What is plugged in.
    Devices,
    /// The real plant of a session.
    Plant,
    /// A recorded session.
    Replay,
    /// A session at another terminal.
    Watch,
    /// Figures and tables of sessions.
    Report,
}

impl Screen {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Setup,
        Self::Briefing,
        Self::Live,
        Self::Results,
        Self::Devices,
        Self::Plant,
        Self::Replay,
        Self::Watch,
        Self::Report,
    ];

    /// The heading in the help.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Setup => "set-up",
            Self::Briefing => "instruction and break",
            Self::Live => "live",
            Self::Results => "results",
            Self::Devices => "devices",
            Self::Plant => "plant",
            Self::Replay => "replay",
            Self::Watch => "watch",
            Self::Report => "report",
        }
    }
}

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// To the next thing: field, page.
    Next,
    /// To the one before.
    Previous,
    /// To the next part of a report,
    NextPart,
    /// or to the one before.
    PreviousPart,
    /// The value to the left; less.
    Left,
    /// The value to the right; more.
    Right,
    /// Begin, or go on.
    Begin,
    /// Read a profile.
    Open,
    /// Write a profile.
    Save,
    /// Try the controls without a session.
    TryHands,
    /// Learn a gamepad's map.
    Learn,
    /// To what stands above,
    Up,
    /// or below.
    Down,
    /// Go on with a session that was cut off.
    Resume,
    /// Emergency stop.
    Stop,
    /// Pause, or go on.
    Pause,
    /// Throw the rollout away.
    Discard,
    /// Run faster than the wall where nobody steers.
    Faster,
    /// Raise the device's sensitivity,
    MoreSensitive,
    /// or lower it.
    LessSensitive,
    /// Show or hide share and success.
    Progress,
    /// Show the scene only, or everything.
    SubjectView,
    /// Show or hide the page of the real plant.
    Plant,
    /// Arm the plant's motor, or disarm it.
    Arm,
    /// Let the plant look for its ends.
    Home,
    /// Calibrate the plant.
    Calibrate,
    /// Yes to what is asked,
    Yes,
    /// or no.
    No,
    /// The fault was seen; or end a calibration.
    Clear,
    /// A step of a recording on,
    StepOn,
    /// or back.
    StepBack,
    /// Slower, down to a tenth.
    Slower,
    /// To a recording's beginning,
    First,
    /// or its end.
    Last,
    /// A digit of a rollout's number.
    Digit,
    /// Forget what was typed.
    Forget,
    /// Show or hide the curve of the person's action,
    Human,
    /// the robot's,
    Machine,
    /// and what the plant got of both.
    Net,
    /// Show or hide the keys.
    Help,
    /// Leave; asked once more during a session.
    Quit,
    /// Leave at once.
    QuitNow,
}

/// What one or more keys do on a screen.
#[derive(Clone, Copy, Debug)]
pub struct Binding {
    /// Where.
    pub screen: Screen,
    /// Which keys; empty for keys that another part takes, listed for the help only.
    pub keys: &'static [KeyCode],
    /// The keys in words; empty: not in the table of the help.
    pub shown: &'static str,
    /// What they do, for the help.
    pub help: &'static str,
    /// What they do, for the line of keys; empty: not in that line.
    pub hint: &'static str,
    /// What they ask for.
    pub action: Option<Action>,
}

impl Binding {
    /// The keys in words, and what they do: where something else than keys steers, that.
    #[must_use]
    pub const fn words(&self, hand: Hand) -> (&'static str, &'static str) {
        match (self.screen, self.action, hand) {
            (Screen::Live, None, Hand::On(Device::Gamepad)) => ("stick", "steer with the stick"),
            (Screen::Live, None, Hand::On(Device::Mouse)) => ("mouse", "steer with the mouse"),
            _ => (self.shown, self.help),
        }
    }
}

const fn bind(
    screen: Screen,
    keys: &'static [KeyCode],
    shown: &'static str,
    hint: &'static str,
    help: &'static str,
    action: Action,
) -> Binding {
    Binding { screen, keys, shown, help, hint, action: Some(action) }
}

const fn elsewhere(
    screen: Screen,
    shown: &'static str,
    hint: &'static str,
    help: &'static str,
) -> Binding {
    Binding { screen, keys: &[], shown, help, hint, action: None }
}

/// All keys of all screens. `Ctrl-C` is [`Action::QuitNow`] everywhere.
pub const BINDINGS: &[Binding] = {
    use Action as A;
    use KeyCode::{
        BackTab, Backspace, Char, Down, End, Enter, Esc, F, Home, Left, PageDown, PageUp,
    };
    use KeyCode::{Right, Tab, Up};
    use Screen::{Briefing, Devices, Live, Plant, Replay, Report, Results, Setup, Watch};
    &[
        bind(Setup, &[Tab, Down], "Tab ↓", "next", "to the next field", A::Next),
        bind(Setup, &[BackTab, Up], "Shift-Tab ↑", "", "to the field before", A::Previous),
        bind(Setup, &[Left], "←", "", "the choice before; less", A::Left),
        bind(Setup, &[Right], "←→", "change", "the next choice; more", A::Right),
        bind(Setup, &[Enter], "Enter", "begin", "begin the session", A::Begin),
        bind(Setup, &[Char('o')], "o", "open", "open a profile", A::Open),
        bind(Setup, &[Char('s')], "s", "save", "save these settings as a profile", A::Save),
        bind(Setup, &[Char('t')], "t", "try", "try your hands; nothing is recorded", A::TryHands),
        bind(Setup, &[Char('r')], "r", "", "resume the session that was cut off", A::Resume),
        elsewhere(Setup, "letters", "", "type in a text field; Tab or Esc leaves it"),
        bind(Setup, &[Char('?'), F(1)], "?", "keys", "show or hide these keys", A::Help),
        bind(Setup, &[Char('q')], "q", "quit", "quit", A::Quit),
        //
        bind(Briefing, &[Enter], "Enter", "go on", "read, rested: go on", A::Begin),
        bind(Briefing, &[Char('o')], "", "", "the page of the real plant", A::Plant),
        bind(Briefing, &[Char('?'), F(1)], "?", "keys", "show or hide these keys", A::Help),
        bind(Briefing, &[Char('q')], "q", "end", "end the session (asks once)", A::Quit),
        //
        elsewhere(Live, "← →", "push", "steer while held; also h l and a d"),
        bind(Live, &[Char(' ')], "space", "stop", "emergency stop, until Enter", A::Stop),
        bind(Live, &[Enter], "Enter", "", "go on after a stop or a pause", A::Begin),
        bind(Live, &[Char('P'), Esc], "P", "pause", "pause, or go on; also Esc", A::Pause),
        bind(Live, &[Char('x')], "x", "discard", "throw this rollout away, repeat it", A::Discard),
        bind(
            Live,
            &[Char('f')],
            "f",
            "faster",
            "faster while nobody steers: 1 4 16× max",
            A::Faster,
        ),
        bind(
            Live,
            &[Char('+'), Char('=')],
            "+",
            "",
            "raise your device's sensitivity",
            A::MoreSensitive,
        ),
        bind(Live, &[Char('-')], "-", "", "lower it", A::LessSensitive),
        bind(Live, &[Char('p')], "p", "progress", "show or hide share and success", A::Progress),
        bind(Live, &[Char('v')], "v", "view", "the subject's view, or all", A::SubjectView),
        // Only a session at a real plant has that page, and then the help says so.
        bind(Live, &[Char('o')], "", "", "the page of the real plant", A::Plant),
        bind(Live, &[Char('?'), F(1)], "?", "keys", "show or hide these keys", A::Help),
        bind(Live, &[Char('q')], "q", "end", "end the session (asks once)", A::Quit),
        //
        bind(Results, &[Right, Tab, Char('l')], "→ Tab", "next page", "next page", A::Next),
        bind(Results, &[Left, BackTab, Char('h')], "←", "", "the page before", A::Previous),
        bind(Results, &[Enter], "Enter", "new session", "back to the set-up", A::Begin),
        bind(Results, &[Char('?'), F(1)], "?", "keys", "show or hide these keys", A::Help),
        bind(Results, &[Char('q'), Esc], "q", "quit", "quit", A::Quit),
        //
        bind(Devices, &[Right, Tab], "←→", "device", "the next device; also Tab", A::Next),
        bind(Devices, &[Left, BackTab], "←", "", "the one before", A::Previous),
        bind(Devices, &[Down], "↓", "", "more of what is to be done", A::Down),
        bind(Devices, &[Up], "↑", "", "back up", A::Up),
        bind(Devices, &[Char('m')], "m", "map the pad", "learn the gamepad's map", A::Learn),
        bind(Devices, &[Char('s')], "s", "save", "save what was learned to a profile", A::Save),
        elsewhere(Devices, "a d", "", "try the keyboard, on its page; also h l"),
        bind(Devices, &[Char('?'), F(1)], "?", "keys", "show or hide these keys", A::Help),
        bind(Devices, &[Char('q'), Esc], "q", "quit", "quit", A::Quit),
        //
        bind(Plant, &[Char('m')], "m", "arm", "arm the motor, or disarm it", A::Arm),
        bind(Plant, &[Char('f')], "f", "home", "find the ends of the track (asks first)", A::Home),
        bind(Plant, &[Char('c')], "c", "calibrate", "calibrate, step by step", A::Calibrate),
        bind(Plant, &[Char('y')], "y", "", "yes", A::Yes),
        bind(Plant, &[Char('n')], "n", "", "no", A::No),
        bind(Plant, &[Char('x')], "x", "clear", "clear a fault; end a calibration", A::Clear),
        bind(Plant, &[Char(' ')], "space", "stop", "emergency stop", A::Stop),
        bind(Plant, &[Char('o'), Esc], "o", "scene", "back to the scene; also Esc", A::Plant),
        bind(Plant, &[Char('?'), F(1)], "?", "keys", "show or hide these keys", A::Help),
        bind(Plant, &[Char('q')], "q", "end", "end the session (asks once)", A::Quit),
        //
        bind(Replay, &[Char(' ')], "space", "pause", "pause, or go on", A::Pause),
        bind(Replay, &[Char('.')], ". ,", "step", "a step on, or back", A::StepOn),
        bind(Replay, &[Char(',')], "", "", "a step back", A::StepBack),
        bind(Replay, &[Right], "← →", "1 s", "a second back, or on", A::Right),
        bind(Replay, &[Left], "", "", "a second back", A::Left),
        bind(Replay, &[Home], "Home End", "", "the beginning, the end", A::First),
        bind(Replay, &[End], "", "", "the end", A::Last),
        bind(
            Replay,
            &[Char('+'), Char('=')],
            "+ -",
            "speed",
            "0.1 to 100 times as fast",
            A::Faster,
        ),
        bind(Replay, &[Char('-')], "", "", "slower", A::Slower),
        bind(Replay, &[Char('n')], "n p", "rollout", "the next rollout, the one before", A::Next),
        bind(Replay, &[Char('p')], "", "", "the rollout before", A::Previous),
        bind(
            Replay,
            &[PageDown, Char('N')],
            "N P",
            "",
            "the next phase, the one before; also PageDown",
            A::Down,
        ),
        bind(Replay, &[PageUp, Char('P')], "", "", "the phase before", A::Up),
        bind(
            Replay,
            &[
                Char('0'),
                Char('1'),
                Char('2'),
                Char('3'),
                Char('4'),
                Char('5'),
                Char('6'),
                Char('7'),
                Char('8'),
                Char('9'),
            ],
            "12 Enter",
            "",
            "to the phase's rollout of that number",
            A::Digit,
        ),
        bind(Replay, &[Enter], "", "", "go there", A::Begin),
        bind(Replay, &[Esc, Backspace], "", "", "forget the number", A::Forget),
        bind(
            Replay,
            &[Char('y')],
            "y r m",
            "",
            "curves of you, the robot, the motor (net)",
            A::Human,
        ),
        bind(Replay, &[Char('r')], "", "", "the robot's action", A::Machine),
        bind(Replay, &[Char('m')], "", "", "the net action", A::Net),
        bind(Replay, &[Char('v')], "v", "", "the subject's view, or all", A::SubjectView),
        bind(Replay, &[Char('?'), F(1)], "?", "keys", "show or hide these keys", A::Help),
        bind(Replay, &[Char('q')], "q", "quit", "quit", A::Quit),
        //
        bind(Watch, &[Char('v')], "v", "view", "the subject's view, or all", A::SubjectView),
        bind(Watch, &[Char('p')], "p", "progress", "show or hide share and success", A::Progress),
        bind(Watch, &[Char('?'), F(1)], "?", "keys", "show or hide these keys", A::Help),
        bind(Watch, &[Char('q'), Esc], "q", "quit", "quit; the session goes on", A::Quit),
        //
        bind(
            Report,
            &[Right, Tab, Char('l')],
            "←→",
            "turn",
            "the next page; ← the one before",
            A::Next,
        ),
        bind(Report, &[Left, BackTab, Char('h')], "", "", "the page before", A::Previous),
        bind(Report, &[Down], "↓↑", "scroll", "more of a long page; ↑ back", A::Down),
        bind(Report, &[Up], "", "", "back up", A::Up),
        bind(
            Report,
            &[Char('n')],
            "n",
            "next part",
            "the next group, study or session",
            A::NextPart,
        ),
        bind(Report, &[Char('p')], "p", "", "the one before", A::PreviousPart),
        bind(Report, &[Char('s')], "s", "save", "save this figure here, as SVG and CSV", A::Save),
        bind(Report, &[Char('?'), F(1)], "?", "keys", "show or hide these keys", A::Help),
        bind(Report, &[Char('q'), Esc], "q", "quit", "quit", A::Quit),
    ]
};

/// What `event` asks for on `screen`.
#[must_use]
pub fn action(screen: Screen, event: KeyEvent) -> Option<Action> {
    if event.kind == KeyEventKind::Release {
        return None;
    }
    if event.modifiers.intersects(KeyModifiers::CONTROL | KeyModifiers::ALT) {
        let is_ctrl_c =
            event.code == KeyCode::Char('c') && event.modifiers.contains(KeyModifiers::CONTROL);
        return is_ctrl_c.then_some(Action::QuitNow);
    }
    let code = match event.code {
        // Terminals that tell keys apart say Shift and the small letter.
        KeyCode::Char(letter) if event.modifiers.contains(KeyModifiers::SHIFT) => {
            KeyCode::Char(letter.to_ascii_uppercase())
        }
        KeyCode::Tab if event.modifiers.contains(KeyModifiers::SHIFT) => KeyCode::BackTab,
        code => code,
    };
    let found = of(screen).find(|binding| binding.keys.contains(&code))?.action?;
    // Held keys repeat; only what is harmless to do often follows them.
    let repeats = matches!(
        found,
        Action::Next
            | Action::Previous
            | Action::NextPart
            | Action::PreviousPart
            | Action::Left
            | Action::Right
            | Action::Up
            | Action::Down
            | Action::MoreSensitive
            | Action::LessSensitive
            | Action::StepOn
            | Action::StepBack
    );
    (event.kind == KeyEventKind::Press || repeats).then_some(found)
}

/// The bindings of `screen`.
pub fn of(screen: Screen) -> impl Iterator<Item = &'static Binding> {
    BINDINGS.iter().filter(move |binding| binding.screen == screen)
}

/// Who steers, as far as the line of keys goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hand {
    /// A person with this device.
    On(Device),
    /// A script or a model of a person.
    Absent,
    /// Nobody.
    Nobody,
}

/// The line of keys at the bottom of `screen`: pairs of key and word. Where nobody steers
/// there is nothing to push or discard, where somebody does nothing to hurry.
pub fn hints(screen: Screen, hand: Hand) -> impl Iterator<Item = (&'static str, &'static str)> {
    let fits = move |binding: &&Binding| match binding.action {
        None => matches!(hand, Hand::On(_)),
        Some(Action::Discard) => hand != Hand::Nobody,
        Some(Action::Faster) => screen == Screen::Replay || hand == Hand::Nobody,
        Some(_) => true,
    };
    of(screen)
        .filter(fits)
        .filter(|b| !b.hint.is_empty())
        .map(move |binding| (binding.words(hand).0, binding.hint))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::terminal::{ENABLE_KEYS, direction};

    #[test]
    fn no_key_has_two_meanings_on_a_screen_and_none_is_a_steering_key() {
        for screen in Screen::ALL {
            let mut seen = Vec::new();
            for key in of(screen).flat_map(|binding| binding.keys) {
                assert!(!seen.contains(key), "{key} twice on {}", screen.word());
                seen.push(*key);
            }
            assert!(of(screen).any(|b| b.action == Some(Action::Help)), "{}", screen.word());
            assert!(of(screen).any(|b| b.action == Some(Action::Quit)), "{}", screen.word());
        }
        // The hands that steer go on steering under the plant's page.
        for key in [Screen::Live, Screen::Plant].into_iter().flat_map(of).flat_map(|b| b.keys) {
            let steers = direction(&KeyEvent::new(*key, KeyModifiers::NONE));
            assert_eq!(steers, None, "{key}");
        }
        for letter in ENABLE_KEYS.chars() {
            let (small, large) = (KeyCode::Char(letter), letter.to_ascii_uppercase());
            for key in [small, KeyCode::Char(large)] {
                assert!(BINDINGS.iter().all(|binding| !binding.keys.contains(&key)), "{key}");
                assert_eq!(direction(&KeyEvent::new(key, KeyModifiers::NONE)), None, "{key}");
            }
        }
    }

    #[test]
    fn keys_act_on_press_and_only_moves_repeat() {
        let press = |code| KeyEvent::new(code, KeyModifiers::NONE);
        let with = |code, kind| KeyEvent { kind, ..press(code) };
        assert_eq!(action(Screen::Live, press(KeyCode::Char(' '))), Some(Action::Stop));
        assert_eq!(action(Screen::Live, press(KeyCode::Char('p'))), Some(Action::Progress));
        assert_eq!(action(Screen::Live, press(KeyCode::Char('P'))), Some(Action::Pause));
        let shifted = KeyEvent::new(KeyCode::Char('p'), KeyModifiers::SHIFT);
        assert_eq!(action(Screen::Live, shifted), Some(Action::Pause));
        assert_eq!(action(Screen::Live, press(KeyCode::Char('d'))), None);
        for kind in [KeyEventKind::Release, KeyEventKind::Repeat] {
            assert_eq!(action(Screen::Live, with(KeyCode::Char('v'), kind)), None);
        }
        let held = with(KeyCode::Tab, KeyEventKind::Repeat);
        assert_eq!(action(Screen::Setup, held), Some(Action::Next));
        for screen in Screen::ALL {
            let ctrl_c = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
            assert_eq!(action(screen, ctrl_c), Some(Action::QuitNow));
        }
    }
}
