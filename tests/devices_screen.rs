//! The devices screen as it looks and as it is used, with events in place of a pad.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail as tests do")]

use std::path::Path;

use coadapt::backend::serial::ports::{Holder, Port, Usb};
use coadapt::host::{About as Of, Problem, Rights};
use coadapt::operator::gamepad::rights::Node;
use coadapt::operator::gamepad::{About, Axis, Button, Event, Id};
use coadapt::profile::Document;
use coadapt::signal::Seconds;
use coadapt::tui::devices::{self, Devices, Extras, Reaction, Survey, Terminal};
use coadapt::tui::palette::{Glyphs, Look, Palette};
use coadapt::tui::terminal::Abilities;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

const PAD: Id = Id(0);
const BOTH: Rights = Rights { read: true, write: true };

/// A screen with someone who plays the pad and carries out what the keys ask for.
struct Desk {
    devices: Devices,
    push: f64,
    pointer: Option<(String, f64)>,
    look: Look,
}

impl Desk {
    fn new(profiles: &Path, sets: &[(&str, &str)]) -> Self {
        let mut document = Document::find("balance", profiles).unwrap();
        for (key, value) in sets {
            document.set(key, value);
        }
        let profile = document.read().unwrap();
        let document = Document::find("balance", profiles).unwrap();
        let mut devices = Devices::new(document, profile, profiles.to_owned());
        devices.take(Survey::default());
        Self { devices, push: 0.0, pointer: None, look: Look::default() }
    }

    /// Nothing can be saved here.
    fn nowhere() -> Self {
        Self::new(Path::new("/dev/null/profiles"), &[])
    }

    fn plug(&mut self, id: Id, name: &str) {
        let guid = "030000005e0400008e02000014010000".to_owned();
        let (name, mapping) = (name.to_owned(), "SDL mapping".to_owned());
        self.hear(&Event::Connected(About { id, name, guid, mapping }));
    }

    fn hear(&mut self, event: &Event) {
        self.devices.hear(event, Seconds(1.0));
    }

    fn axis(&mut self, axis: Axis, values: &[f64]) {
        for value in values {
            self.hear(&Event::Axis { pad: PAD, axis, value: *value });
        }
    }

    fn button(&mut self, button: Button) {
        for is_pressed in [true, false] {
            self.hear(&Event::Button { pad: PAD, button, is_pressed });
        }
    }

    fn key(&mut self, code: KeyCode) -> Reaction {
        let reaction = self.devices.handle(KeyEvent::new(code, KeyModifiers::NONE));
        if let Reaction::Save { path, overwrite } = &reaction {
            match self.devices.document().save(path, *overwrite) {
                Ok(()) => self.devices.saved(path),
                Err(error) => self.devices.refuse(&error),
            }
        }
        reaction
    }

    fn keys(&mut self, letters: &str) {
        for letter in letters.chars() {
            self.key(KeyCode::Char(letter));
        }
    }

    fn page(&mut self, to_the_right: usize) {
        for _ in 0..to_the_right {
            self.key(KeyCode::Right);
        }
    }

    fn picture(&self, width: u16, height: u16) -> String {
        let mut terminal = ratatui::Terminal::new(TestBackend::new(width, height)).unwrap();
        let extras = Extras {
            look: self.look,
            key_releases: "estimated from key repeats inside tmux, up to 120 ms late",
            push: self.push,
            pointer: self.pointer.clone(),
        };
        terminal.draw(|frame| devices::draw(frame, &self.devices, &extras)).unwrap();
        terminal.backend().to_string()
    }

    fn shows(&self, words: &str) {
        let picture = self.picture(120, 40);
        assert!(picture.contains(words), "no `{words}` in\n{picture}");
    }
}

fn node(rights: Rights) -> Node {
    Node {
        path: "/dev/input/event7".to_owned(),
        name: "Xbox 360 pad".to_owned(),
        is_there: true,
        rights,
    }
}

/// A pad that steers, and one that waits.
fn with_pads() -> Desk {
    let mut desk = Desk::nowhere();
    desk.plug(PAD, "Xbox 360 pad");
    desk.plug(Id(1), "Old stick");
    desk.devices.take(Survey { gamepad_nodes: vec![node(BOTH)], ..Survey::default() });
    desk.axis(Axis::LeftStickX, &[0.05, 0.4, 0.62]);
    desk.axis(Axis::LeftStickY, &[-0.1]);
    desk.axis(Axis::RightZ, &[-1.0]);
    desk.hear(&Event::Button { pad: PAD, button: Button::Select, is_pressed: true });
    desk
}

/// Two ports and what is in their way.
fn with_ports() -> Survey {
    let port = |path: &str| Port {
        path: path.to_owned(),
        by_id: None,
        usb: None,
        rights: BOTH,
        group: Some("dialout".to_owned()),
        holder: None,
        latency_ms: None,
    };
    let ftdi = Port {
        by_id: Some("usb-FTDI_FT232R_USB_UART_A50285BI-if00-port0".to_owned()),
        usb: Some(Usb {
            vendor: 0x0403,
            product: 0x6001,
            serial: Some("A50285BI".to_owned()),
            manufacturer: Some("FTDI".to_owned()),
            name: Some("FT232R USB UART".to_owned()),
        }),
        rights: Rights::default(),
        holder: Some(Holder { pid: 4711, name: "screen".to_owned() }),
        latency_ms: Some(16),
        ..port("/dev/ttyUSB0")
    };
    let problem = |what: &str, mend: &str| Problem::new(Of::Serial, what, mend);
    Survey {
        serial_ports: vec![ftdi, port("/dev/ttyS0")],
        problems: vec![
            problem(
                "ann may not use /dev/ttyUSB0: not in group dialout",
                "sudo usermod -aG dialout ann    # then log out and in again",
            ),
            problem(
                "/dev/ttyUSB0: its FTDI chip keeps bytes up to 16 ms, too long for a control loop",
                "echo 1 | sudo tee /sys/bus/usb-serial/devices/ttyUSB0/latency_timer\n\
                 echo 'ACTION==\"add\", SUBSYSTEM==\"usb-serial\", DRIVER==\"ftdi_sio\", \
                 ATTR{latency_timer}=\"1\"' | sudo tee /etc/udev/rules.d/70-coadapt-latency.rules",
            ),
        ],
        ..Survey::default()
    }
}

macro_rules! pictures {
    ($name:literal, $desk:expr) => {
        insta::assert_snapshot!(concat!($name, "_80x24"), $desk.picture(80, 24));
        insta::assert_snapshot!(concat!($name, "_120x40"), $desk.picture(120, 40));
    };
}

#[test]
fn a_pad_is_shown_live_with_its_response_curve() {
    let desk = with_pads();
    pictures!("devices_gamepad", desk);
    desk.shows("1 more pad waits");
}

#[test]
fn every_part_of_the_shape_is_seen_in_the_curve() {
    let sets = [
        ("operator.gamepad.shape.dead_zone", "0.3"),
        ("operator.gamepad.shape.outer_zone", "0.2"),
        ("operator.gamepad.shape.exponent", "2"),
        ("operator.gamepad.shape.invert", "true"),
    ];
    let mut desk = Desk::new(Path::new("/dev/null/profiles"), &sets);
    desk.plug(PAD, "Xbox 360 pad");
    desk.axis(Axis::LeftStickX, &[0.0, -0.7]);
    insta::assert_snapshot!("devices_bent_80x24", desk.picture(80, 24));
    desk.shows("inverted, no filter");
}

#[test]
fn without_a_pad_the_page_says_what_to_do() {
    let mut desk = Desk::nowhere();
    desk.devices.hear_no_pads("this coadapt was built without gamepads (feature `gamepad`)");
    desk.shows("built without gamepads");
    let mut desk = Desk::nowhere();
    desk.devices.take(Survey {
        gamepad_nodes: vec![node(Rights { read: true, write: false })],
        problems: vec![Problem::new(
            Of::Gamepad,
            "ann may not use Xbox 360 pad (/dev/input/event7): rights read only, read and write \
             are needed",
            "sudo usermod -aG input ann    # then log in again",
        )],
        ..Survey::default()
    });
    pictures!("devices_shut", desk);
    desk.keys("m");
    desk.shows("no gamepad steers: plug one in");
}

#[test]
fn the_keyboard_the_mouse_the_ports_and_the_terminal_have_pages() {
    let mut desk = with_pads();
    desk.push = -0.5;
    desk.page(1);
    pictures!("devices_keyboard", desk);
    desk.page(1);
    desk.shows("not read yet");
    desk.pointer = Some(("pointer in pixels (720 × 432)".to_owned(), 0.8));
    insta::assert_snapshot!("devices_mouse_80x24", desk.picture(80, 24));
    desk.devices.take(with_ports());
    desk.page(1);
    pictures!("devices_serial", desk);
    let mut survey = with_ports();
    survey.terminal = Terminal {
        asked: true,
        utf8: true,
        abilities: Abilities {
            answered: true,
            term: Some("screen-256color".to_owned()),
            tmux: true,
            size: Some((120, 40)),
            colours: 256,
            ..Abilities::default()
        },
    };
    survey.problems = survey.terminal.problems();
    desk.devices.take(survey);
    desk.page(1);
    pictures!("devices_terminal", desk);
}

#[test]
fn more_than_fits_is_scrolled_to() {
    let mut desk = with_pads();
    let long = |n: usize| Problem::new(Of::Gamepad, format!("problem {n}"), "a line\nanother");
    desk.devices.take(Survey { problems: (1..6).map(long).collect(), ..Survey::default() });
    assert!(desk.picture(80, 24).contains("problem 1"));
    for _ in 0..99 {
        desk.key(KeyCode::Down);
    }
    let picture = desk.picture(80, 24);
    assert!(picture.contains("problem 5") && !picture.contains("problem 1"), "{picture}");
}

#[test]
fn a_map_is_learned_by_moving_and_saved_without_replacing_anything_unasked() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("pad.ron");
    std::fs::write(&file, "kept").unwrap();
    let mut desk = Desk::new(folder.path(), &[]);
    desk.plug(PAD, "Xbox 360 pad");
    desk.keys("s");
    desk.shows("nothing was learned yet");
    desk.keys("m");
    desk.shows("1 of 6: move the stick that steers to the right");
    desk.axis(Axis::RightZ, &[-1.0]);
    desk.axis(Axis::RightStickX, &[-0.2, -0.6, -0.97, -0.5, -0.1, 0.0]);
    desk.shows("2 of 6: press the button for begin");
    desk.button(Button::South);
    desk.button(Button::South);
    desk.shows("south is for begin already");
    insta::assert_snapshot!("devices_learning_80x24", desk.picture(80, 24));
    desk.button(Button::West);
    desk.key(KeyCode::Delete);
    desk.shows("5 of 6");
    desk.key(KeyCode::Esc);
    desk.shows("6 of 6: press the button for enable");
    desk.key(KeyCode::Esc);
    pictures!("devices_learned", desk);
    let map = desk.devices.profile().operator.gamepad.clone();
    assert_eq!((map.map.steer, map.shape.invert), (Axis::RightStickX, true));
    assert_eq!(map.map.discard, None);

    desk.keys("spad");
    desk.key(KeyCode::Enter);
    desk.shows("pad.ron exists. Replace it?");
    desk.key(KeyCode::Esc);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "kept");
    desk.keys("smine");
    desk.key(KeyCode::Enter);
    desk.shows("saved as");
    let saved = Document::find("mine", folder.path()).unwrap();
    assert!(saved.source().contains("steer: right_stick_x,"), "{}", saved.source());
    assert!(saved.source().contains("// the axis that steers"), "comments are kept");
    let learned = saved.read().unwrap().operator.gamepad;
    assert_eq!(learned, map);
}

#[test]
fn learning_is_left_with_m_and_ends_when_the_pad_goes() {
    let mut desk = with_pads();
    desk.keys("mm");
    assert!(!desk.picture(80, 24).contains("1 of 6"));
    desk.keys("m");
    assert_eq!(desk.key(KeyCode::Char('q')), Reaction::Stay);
    desk.hear(&Event::Disconnected(Id(1)));
    desk.hear(&Event::Disconnected(PAD));
    desk.shows("the pad is gone");
    assert_eq!(desk.key(KeyCode::Char('q')), Reaction::Quit);
}

#[test]
fn plain_letters_and_no_colour_are_enough() {
    let mut desk = with_pads();
    desk.look = Look { glyphs: Glyphs::Ascii, palette: Palette::Plain };
    let picture = desk.picture(80, 24);
    let letters = picture.lines().map(|line| line.trim_matches('"'));
    assert!(letters.clone().all(str::is_ascii), "{picture}");
    insta::assert_snapshot!("devices_ascii_80x24", picture);
    desk.keys("?");
    assert!(desk.picture(80, 24).contains("keys: devices"));
}

#[test]
fn no_size_breaks_it() {
    let mut desk = with_pads();
    desk.devices.take(with_ports());
    for _ in 0..5 {
        for (width, height) in [(1, 1), (40, 10), (80, 24), (81, 25), (300, 90)] {
            desk.picture(width, height);
        }
        desk.page(1);
    }
}
