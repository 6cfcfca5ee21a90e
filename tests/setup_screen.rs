//! The set-up screen as it looks and as it is used, by keys alone.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "helpers of tests may fail as tests do"
)]

use std::path::{Path, PathBuf};

use coadapt::profile::{self, Document, Order};
use coadapt::record::folder::Unfinished;
use coadapt::session::{Phase, Trial};
use coadapt::tui::palette::{Glyphs, Look, Palette};
use coadapt::tui::setup::{self, Extras, Field, Reaction, Setup, Shelf};
use proptest::prelude::*;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

/// A screen with someone who carries out what it asks for.
struct Desk {
    setup: Setup,
    shelf: Shelf,
    profiles: PathBuf,
    hands: Option<f64>,
}

impl Desk {
    fn new(profiles: &Path) -> Self {
        let document = Document::find("balance", profiles).unwrap();
        let setup = Setup::new(Order::default(), &document, profiles.to_owned()).unwrap();
        let shelf = Shelf { profiles: profile::list(profiles), ..Shelf::default() };
        Self { setup, shelf, profiles: profiles.to_owned(), hands: None }
    }

    /// Nothing can be saved here.
    fn nowhere() -> Self {
        Self::new(Path::new("/dev/null/profiles"))
    }

    fn key(&mut self, key: KeyEvent) -> Reaction {
        let reaction = self.setup.handle(key, &self.shelf);
        match &reaction {
            Reaction::OpenProfile(name) => match Document::find(name, &self.profiles) {
                Ok(document) => self.setup.open(name, &document),
                Err(error) => self.setup.refuse(&error),
            },
            Reaction::SaveProfile { path, overwrite } => {
                match self.setup.document().save(path, *overwrite) {
                    Ok(()) => {
                        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
                        let document = Document::find(&name, &self.profiles).unwrap();
                        self.setup.open(&name, &document);
                        self.shelf.profiles = profile::list(&self.profiles);
                    }
                    Err(error) => self.setup.refuse(&error),
                }
            }
            Reaction::SubjectChanged => {
                let known = self.setup.order().subject.as_str() == "S07";
                self.shelf.trials = if known { vec![1, 2] } else { Vec::new() };
            }
            _ => {}
        }
        reaction
    }

    fn press(&mut self, code: KeyCode) -> Reaction {
        self.key(KeyEvent::new(code, KeyModifiers::NONE))
    }

    fn type_text(&mut self, text: &str) -> &mut Self {
        for c in text.chars() {
            self.press(KeyCode::Char(c));
        }
        self
    }

    /// Moves to `field` as a person would.
    fn go(&mut self, field: Field) -> &mut Self {
        for _ in 0..Field::ALL.len() {
            if self.setup.focus() == field {
                return self;
            }
            self.press(KeyCode::Tab);
        }
        panic!("{field:?} cannot be reached");
    }

    fn right(&mut self, times: usize) -> &mut Self {
        for _ in 0..times {
            self.press(KeyCode::Right);
        }
        self
    }

    fn begin(&mut self) -> Order {
        match self.press(KeyCode::Enter) {
            Reaction::Begin(order) => order,
            other => panic!("not begun: {other:?}"),
        }
    }

    fn picture_on(&self, width: u16, height: u16, look: Look) -> TestBackend {
        let extras = Extras {
            look,
            key_releases: "estimated from key repeats",
            pointer: "pointer in pixels (1600 × 960)",
            hands: self.hands,
            time_s: 0.0,
        };
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| setup::draw(frame, &self.setup, &self.shelf, &extras)).unwrap();
        terminal.backend().clone()
    }

    fn picture(&self) -> TestBackend {
        self.picture_on(80, 24, Look::default())
    }

    fn shows(&self, words: &str) -> bool {
        self.picture().to_string().contains(words)
    }
}

/// The order as the program will read it from the same words.
fn reads(order: &Order, profiles: &Path) -> Result<profile::Profile, String> {
    let mut document = Document::find(&order.profile, profiles).map_err(|e| e.to_string())?;
    order.sets.iter().for_each(|(key, value)| document.set(key, value));
    document.read().map_err(|report| report.to_string())
}

fn unfinished(subject: &str, episode: u32) -> Unfinished {
    Unfinished {
        path: PathBuf::from("logs/S07/002-balance-simultaneous"),
        subject: subject.parse().unwrap(),
        trial: Trial(2),
        task: "balance".to_owned(),
        preset: "thesis".to_owned(),
        mode: "simultaneous",
        phase: Phase::Main,
        episode,
        of: Some(100),
    }
}

#[test]
fn enter_begins_at_once_with_the_defaults() {
    let mut desk = Desk::nowhere();
    insta::assert_snapshot!("setup_start", desk.picture());
    insta::assert_snapshot!("setup_start_120x40", desk.picture_on(120, 40, Look::default()));
    assert_eq!(desk.begin(), Order::default());
}

#[test]
fn a_plain_palette_and_7_bit_glyphs_show_the_same() {
    let look = Look { palette: Palette::Plain, glyphs: Glyphs::Ascii };
    let picture = Desk::nowhere().picture_on(80, 24, look);
    assert!(picture.buffer().content.iter().all(|cell| cell.symbol().is_ascii()));
    insta::assert_snapshot!("setup_ascii", picture);
}

#[test]
fn the_focus_is_seen_without_colour() {
    let mut desk = Desk::nowhere();
    let look = Look { palette: Palette::Plain, ..Look::default() };
    for field in Field::ALL.into_iter().filter(|f| !matches!(f, Field::Task | Field::Unfinished)) {
        match field {
            Field::Skill => {
                desk.go(Field::Operator).right(3);
            }
            Field::Script => {
                desk.go(Field::Operator).right(1);
            }
            Field::Policy => {
                desk.go(Field::Introduction).type_text(" ").go(Field::Main).type_text(" ");
            }
            _ => {}
        }
        desk.go(field);
        if field == Field::Script {
            // A file is missing so far, and that would be marked too.
            desk.type_text("hands.csv");
        }
        let picture = desk.picture_on(80, 24, look);
        let buffer = picture.buffer();
        let marked: Vec<u16> = (0..24).filter(|y| buffer[(1, *y)].symbol() == "›").collect();
        let reversed = |y: u16| {
            (0..80).any(|x| buffer[(x, y)].modifier.contains(ratatui::style::Modifier::REVERSED))
        };
        assert_eq!(marked.len(), 1, "{field:?}");
        assert!((0..18).all(|y| reversed(y) == marked.contains(&y)), "{field:?}");
    }
}

#[test]
fn a_wrong_subject_is_told_at_once_and_does_not_begin() {
    let mut desk = Desk::nowhere();
    desk.go(Field::Subject).type_text("S/7 q");
    insta::assert_snapshot!("setup_wrong_subject", desk.picture());
    desk.go(Field::Seed);
    assert_eq!(desk.press(KeyCode::Enter), Reaction::Stay);
    assert_eq!(desk.setup.focus(), Field::Subject);
    assert!(desk.shows("not begun: subject \"S/7 q\""));
    desk.type_text("S07");
    assert_eq!(desk.begin().subject.as_str(), "S07");
    assert!(desk.shows("003"));
}

#[test]
fn sequential_for_a_duration() {
    let mut desk = Desk::nowhere();
    desk.go(Field::Mode).right(1).go(Field::Main).type_text("420s");
    desk.go(Field::Operator).right(3).go(Field::Kind).right(2);
    insta::assert_snapshot!("setup_sequential_duration", desk.picture());
    let order = desk.begin();
    assert_eq!(order.operator, "simulated:average:bang-bang");
    let session = reads(&order, &desk.profiles).unwrap().session;
    assert_eq!((session.main_rollouts, session.main_duration_s), (None, Some(420.0)));
    // Back to what the profile says: no change is left.
    desk.go(Field::Mode).right(2).go(Field::Main).type_text("100");
    desk.go(Field::Operator).right(3);
    assert_eq!(desk.begin(), Order::default());
}

#[test]
fn the_robot_alone_needs_a_policy_and_proposes_the_last() {
    let mut desk = Desk::nowhere();
    desk.shelf.policies = vec!["logs/S07/001-balance-simultaneous/policy.json".to_owned()];
    desk.go(Field::Introduction).type_text(" ").go(Field::Main).type_text(" ");
    assert_eq!(desk.begin().policy.as_deref(), Some("last"));
    desk.go(Field::Policy).right(1);
    insta::assert_snapshot!("setup_autonomous_alone", desk.picture());
    assert!(desk.begin().policy.unwrap().ends_with("policy.json"));
    desk.go(Field::Main).type_text(" ");
    assert_eq!(desk.begin().policy, None);
    desk.type_text(" ").go(Field::Autonomous).type_text(" ");
    assert_eq!(desk.press(KeyCode::Enter), Reaction::Stay, "no phase at all");
    assert!(desk.shows("not begun: `session.phases` is [], which is not allowed"));
}

#[test]
fn a_changed_pole_is_named_and_drawn() {
    let mut desk = Desk::nowhere();
    desk.go(Field::Pole).type_text("0.6").go(Field::Sensitivity).right(3);
    insta::assert_snapshot!("setup_changed_pole", desk.picture());
    let order = desk.begin();
    assert_eq!(
        order.command_line(),
        "coadapt run balance --set plant.pole_length_m=0.6 --set operator.keyboard.shape.sensitivity=1.41"
    );
    assert_eq!(desk.setup.profile(), &reads(&order, &desk.profiles).unwrap());
}

#[test]
fn a_pole_too_long_is_refused_in_the_words_of_the_check() {
    let mut desk = Desk::nowhere();
    desk.go(Field::Pole).type_text("99");
    desk.go(Field::Progress).type_text(" ");
    assert_eq!(desk.press(KeyCode::Enter), Reaction::Stay);
    insta::assert_snapshot!("setup_wrong_pole", desk.picture());
    assert_eq!(desk.setup.focus(), Field::Pole);
    desk.type_text("2");
    let profile = reads(&desk.begin(), &desk.profiles).unwrap();
    assert!(!profile.screen.show_progress, "nothing was lost");
    for text in ["", "a lot", "1, bounce: 9", "NaN", "1e999"] {
        desk.press(KeyCode::End);
        desk.key(KeyEvent::new(KeyCode::Char('u'), KeyModifiers::CONTROL));
        desk.type_text(text);
        assert_eq!(desk.press(KeyCode::Enter), Reaction::Stay, "{text:?}");
    }
}

#[test]
fn profiles_are_saved_never_over_another_unasked_and_opened_again() {
    let folder = tempfile::tempdir().unwrap();
    let mut desk = Desk::new(folder.path());
    desk.go(Field::Pole).type_text("0.6").press(KeyCode::Esc);
    desk.press(KeyCode::Char('s'));
    desk.type_text("mine?");
    assert_eq!(desk.press(KeyCode::Enter), Reaction::Stay);
    assert!(desk.shows("1 to 64 letters"));
    desk.press(KeyCode::Backspace);
    desk.press(KeyCode::Enter);
    assert_eq!(desk.setup.order().command_line(), "coadapt run mine");
    let text = std::fs::read_to_string(folder.path().join("mine.ron")).unwrap();
    assert!(text.contains("pole_length_m: 0.6, "), "{text}");

    desk.go(Field::Pole).type_text("0.7").press(KeyCode::Esc);
    desk.press(KeyCode::Char('s'));
    desk.press(KeyCode::Enter);
    assert!(desk.shows("Replace it?"));
    let held = KeyEvent { kind: KeyEventKind::Repeat, ..KeyEvent::from(KeyCode::Enter) };
    assert_eq!(desk.key(held), Reaction::Stay);
    desk.press(KeyCode::Esc);
    assert_eq!(std::fs::read_to_string(folder.path().join("mine.ron")).unwrap(), text);
    desk.press(KeyCode::Char('s'));
    desk.press(KeyCode::Enter);
    assert!(matches!(desk.press(KeyCode::Enter), Reaction::SaveProfile { overwrite: true, .. }));
    assert!(std::fs::read_to_string(folder.path().join("mine.ron")).unwrap().contains("0.7"));

    desk.go(Field::Pole).type_text("0.8").go(Field::Profile).press(KeyCode::Left);
    assert_eq!(desk.begin().command_line(), "coadapt run cobs-cart-pole");
    desk.go(Field::Profile).press(KeyCode::Left);
    assert_eq!(desk.begin().command_line(), "coadapt run balance-modern");
    desk.go(Field::Profile).press(KeyCode::Left);
    assert_eq!(desk.begin().command_line(), "coadapt run balance");
    desk.go(Field::Profile).right(3);
    assert_eq!(desk.begin().command_line(), "coadapt run mine --set plant.pole_length_m=0.8");
}

#[test]
fn a_profile_is_asked_for_and_a_wrong_name_can_be_corrected() {
    let mut desk = Desk::nowhere();
    desk.press(KeyCode::Char('s'));
    desk.type_text("pole-short");
    insta::assert_snapshot!("setup_save_prompt", desk.picture());
    desk.press(KeyCode::Esc);
    desk.press(KeyCode::Char('o'));
    desk.type_text("ballance").press(KeyCode::Enter);
    assert!(desk.shows("did you mean `balance`?"));
    insta::assert_snapshot!("setup_open_prompt", desk.picture());
    for _ in 0..4 {
        desk.press(KeyCode::Backspace);
    }
    desk.type_text("ance").press(KeyCode::Backspace);
    desk.type_text("e").press(KeyCode::Esc);
    assert_eq!(desk.begin(), Order::default());
}

#[test]
fn a_task_brings_its_plain_profile_and_keeps_who_and_how() {
    let mut desk = Desk::nowhere();
    desk.go(Field::Subject).type_text("S07");
    desk.go(Field::Seed).type_text("42");
    desk.go(Field::Operator).right(3);
    for (task, name) in [(1, "swing_up"), (2, "speed_up"), (3, "mountain_car")] {
        desk.go(Field::Task).right(1);
        let command = desk.setup.order().command_line();
        let expected = name.replace('_', "-");
        assert!(command.starts_with(&format!("coadapt run {expected} --subject S07")), "{task}");
        assert!(command.ends_with("--operator simulated:average --seed 42"), "{command}");
        insta::assert_snapshot!(format!("setup_{name}"), desk.picture());
        let wide = desk.picture_on(120, 40, Look::default());
        insta::assert_snapshot!(format!("setup_{name}_120x40"), wide);
    }
    desk.go(Field::Task).right(1);
    assert_eq!(desk.setup.order().profile, "balance");
}

#[test]
fn the_agent_is_offered_where_it_knows_the_task() {
    let mut desk = Desk::nowhere();
    desk.go(Field::Task).right(3).go(Field::Operator).right(4);
    assert!(desk.shows("‹ q_learning ›") && desk.shows("an agent that learns to drive"));
    assert!(desk.setup.order().command_line().contains("--operator q_learning"));
    desk.go(Field::Task).right(1);
    assert!(desk.shows("does not know balance"));
    desk.go(Field::Operator).right(1);
    assert!(!desk.shows("does not know balance"));
    for _ in 0..6 {
        assert!(!desk.shows("‹ q_learning ›"));
        desk.right(1);
    }
}

#[test]
fn a_phase_ends_after_rollouts_or_after_a_time() {
    let mut desk = Desk::nowhere();
    desk.go(Field::Task).right(1);
    assert!(desk.shows("180s") && desk.shows("420s"));
    desk.go(Field::Introduction).type_text("90s");
    desk.go(Field::Main).type_text("12");
    let command = desk.begin().command_line();
    assert!(command.contains("--set session.introduction_duration_s=90"), "{command}");
    assert!(command.contains("--rollouts 12"), "{command}");
    let session = &desk.setup.profile().session;
    assert_eq!(session.introduction_duration_s, Some(90.0));
    assert_eq!((session.main_rollouts, session.main_duration_s), (Some(12), None));
}

#[test]
fn a_time_can_be_typed_over_a_count() {
    let mut desk = Desk::nowhere();
    desk.go(Field::Introduction).type_text("180s");
    assert!(desk.shows("180s"));
    let command = desk.begin().command_line();
    assert!(command.contains("session.introduction_duration_s=180"), "{command}");
    let session = &desk.setup.profile().session;
    assert_eq!(session.introduction_duration_s, Some(180.0));
}

#[test]
fn a_broken_profile_is_not_opened_and_not_in_the_way() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("broken.ron"), "(task: \"balance\", mode: both)").unwrap();
    std::fs::write(folder.path().join("last.ron"), "(task: \"balance\")").unwrap();
    let mut desk = Desk::new(folder.path());
    desk.go(Field::Profile).right(2);
    assert!(desk.shows("`mode` cannot be both"));
    assert_eq!(desk.setup.order().profile, "balance-modern");
    desk.right(2);
    assert_eq!(desk.setup.order().profile, "last");
}

#[test]
fn a_session_that_was_cut_is_offered() {
    let mut desk = Desk::nowhere();
    assert_eq!(desk.press(KeyCode::Char('r')), Reaction::Stay);
    assert!(desk.shows("nothing to resume"));
    desk.shelf.unfinished = vec![unfinished("S07", 37), unfinished("S03", 5)];
    desk.press(KeyCode::Tab);
    insta::assert_snapshot!("setup_unfinished", desk.picture());
    assert_eq!(desk.press(KeyCode::Char('r')), Reaction::Resume(0));
    desk.go(Field::Unfinished).right(1);
    assert!(desk.shows("S03 trial 002 was cut at main 5/100"));
    assert_eq!(desk.press(KeyCode::Char('r')), Reaction::Resume(1));
    desk.shelf.unfinished.clear();
    assert_eq!(desk.press(KeyCode::Char('r')), Reaction::Stay);
}

#[test]
fn hands_are_tried_until_escape() {
    let mut desk = Desk::nowhere();
    assert_eq!(desk.press(KeyCode::Char('t')), Reaction::TryHands);
    desk.hands = Some(-0.5);
    insta::assert_snapshot!("setup_hands", desk.picture());
    for steering in [KeyCode::Left, KeyCode::Char('s'), KeyCode::Char('q'), KeyCode::Enter] {
        assert_eq!(desk.press(steering), Reaction::Stay);
        assert!(desk.setup.is_trying_hands());
    }
    desk.press(KeyCode::Esc);
    assert!(!desk.setup.is_trying_hands());
    assert_eq!(desk.press(KeyCode::Char('q')), Reaction::Quit);
}

#[test]
fn letters_type_in_a_text_and_are_commands_elsewhere() {
    let mut desk = Desk::nowhere();
    desk.go(Field::Subject).type_text("qsort");
    assert_eq!(desk.setup.order().subject.as_str(), "qsort");
    assert_eq!(desk.press(KeyCode::Esc), Reaction::Stay);
    assert_eq!(desk.press(KeyCode::Char('q')), Reaction::Quit);
    let ctrl_c = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
    for code in [KeyCode::Char('o'), KeyCode::Esc, KeyCode::Char('t')] {
        desk.press(code);
        assert_eq!(desk.key(ctrl_c), Reaction::Quit);
    }
}

#[test]
fn a_long_command_is_shown_whole_in_turns() {
    let mut desk = Desk::nowhere();
    desk.go(Field::Operator).right(4).go(Field::Script).type_text(&"long/".repeat(60));
    let look = Look::default();
    let mut shown = String::new();
    for turn in 0..4 {
        let extras = Extras {
            look,
            key_releases: "",
            pointer: "",
            hands: None,
            time_s: 4.0 * f64::from(turn),
        };
        let mut terminal = Terminal::new(TestBackend::new(80, 24)).unwrap();
        terminal.draw(|frame| setup::draw(frame, &desk.setup, &desk.shelf, &extras)).unwrap();
        shown += &terminal.backend().to_string();
    }
    assert!(shown.matches("long/long/").count() > 20);
    insta::assert_snapshot!("setup_long_command", desk.picture());
}

fn any_key() -> impl Strategy<Value = KeyEvent> {
    use KeyCode::{
        BackTab, Backspace, Char, Delete, Down, End, Enter, Esc, Home, Left, Right, Tab, Up,
    };
    let moves = vec![Tab, Tab, Tab, BackTab, Up, Down, Left, Right, Right, Enter, Esc];
    let edits = vec![Backspace, Delete, Home, End, Char(' ')];
    prop_oneof![
        3 => proptest::sample::select(moves),
        1 => proptest::sample::select(edits),
        2 => proptest::sample::select("0123456789.-sortN".chars().collect::<Vec<_>>()).prop_map(Char),
        1 => any::<char>().prop_map(Char),
    ]
    .prop_map(|code| KeyEvent::new(code, KeyModifiers::NONE))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn whatever_is_pressed_what_begins_reads_without_faults(
        keys in proptest::collection::vec(any_key(), 1..80),
        size in (1_u16..140, 1_u16..50),
    ) {
        let mut desk = Desk::nowhere();
        desk.shelf.trials = vec![1, 2];
        desk.shelf.unfinished = vec![unfinished("S07", 37)];
        for key in keys {
            if let Reaction::Begin(order) = desk.key(key) {
                let profile = reads(&order, &desk.profiles).map_err(TestCaseError::fail)?;
                prop_assert_eq!(&profile, desk.setup.profile());
                prop_assert!(order.operator.parse::<coadapt::operator::Choice>().is_ok());
            }
            desk.picture();
        }
        desk.picture_on(size.0, size.1, Look::default());
    }
}
