//! What is plugged in, as plain data: for the screen, for people and for programs.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use crate::backend::serial::ports::Port;
use crate::host::{About, Problem, Rights};
use crate::operator::gamepad::rights::Node;
use crate::operator::gamepad::{Button, Id, Pads};
use crate::operator::{self, Device};
use crate::tui::small::{LEAST_HEIGHT, LEAST_WIDTH};
use crate::tui::terminal::Abilities;

/// Everything that is known of the devices.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Survey {
    /// The pads that the program hears.
    pub gamepads: Vec<Gamepad>,
    /// The pads that the system knows, whether or not they are heard.
    pub gamepad_nodes: Vec<Node>,
    /// The serial ports.
    pub serial_ports: Vec<Port>,
    /// The terminal.
    pub terminal: Terminal,
    /// What is in the way, and what mends it.
    pub problems: Vec<Problem>,
}

/// A pad that the program hears.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Gamepad {
    /// Its name.
    pub name: String,
    /// SDL's GUID of it.
    pub guid: String,
    /// Where the names of its axes and buttons come from.
    pub mapping: String,
    /// Its device, where the system's list has one pad of that name.
    pub node: Option<String>,
    /// What this user may do with it.
    pub rights: Option<Rights>,
    /// Whether it is the one that steers.
    pub steers: bool,
    /// Where its axes are that have moved, −1 to 1.
    pub axes: BTreeMap<String, f64>,
    /// The buttons that were pressed since, and whether they are held now.
    pub buttons: BTreeMap<String, bool>,
    /// The axis that steers by the profile's map.
    pub steering: Steering,
}

/// An axis on its way to an action.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Steering {
    /// Which.
    pub axis: String,
    /// Where it is, −1 to 1; 0 before it moved.
    pub raw: f64,
    /// The part of the largest action, −1 to 1, before the filter.
    pub shaped: f64,
}

/// The terminal.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Terminal {
    /// Whether it was asked what it can do.
    pub asked: bool,
    /// Whether the locale is one of UTF-8.
    pub utf8: bool,
    /// What it said, and what the environment says.
    #[serde(flatten)]
    pub abilities: Abilities,
}

/// The pads of `pads` as plain data, with the buttons that were pressed so far.
#[must_use]
pub fn gamepads(
    pads: &Pads,
    pressed: &BTreeMap<Id, BTreeSet<Button>>,
    params: &operator::Params,
    nodes: &[Node],
) -> Vec<Gamepad> {
    let steering = pads.steering().map(|pad| pad.about.id);
    let shape = params.shape(Device::Gamepad);
    let each = |pad: &operator::gamepad::Pad| {
        let about = &pad.about;
        let mut alike = nodes.iter().filter(|node| node.name == about.name);
        // Two of one name cannot be told apart.
        let node = alike.next().filter(|_| alike.next().is_none());
        let axis = params.gamepad.map.steer;
        let raw = pad.axes.get(&axis).copied().unwrap_or(0.0);
        let known = pressed.get(&about.id).into_iter().flatten().chain(&pad.pressed);
        Gamepad {
            name: about.name.clone(),
            guid: about.guid.clone(),
            mapping: about.mapping.clone(),
            node: node.map(|node| node.path.clone()),
            rights: node.map(|node| node.rights),
            steers: steering == Some(about.id),
            axes: pad.axes.iter().map(|(axis, at)| (axis.to_string(), *at)).collect(),
            buttons: known.map(|b| (b.to_string(), pad.pressed.contains(b))).collect(),
            steering: Steering { axis: axis.to_string(), raw, shaped: shape.curve(raw) },
        }
    };
    pads.present().iter().map(each).collect()
}

impl Survey {
    /// The problems with `about`.
    pub fn problems_of(&self, about: Option<About>) -> impl Iterator<Item = &Problem> {
        self.problems.iter().filter(move |problem| Some(problem.about) == about)
    }
}

impl Terminal {
    /// What about this terminal is in the way, and what mends it.
    #[must_use]
    pub fn problems(&self) -> Vec<Problem> {
        let mut problems = Vec::new();
        let mut add = |what: &str, mend: &str| {
            problems.push(Problem::new(About::Terminal, what, mend));
        };
        let abilities = &self.abilities;
        match abilities.term.as_deref() {
            Some("linux") => add(
                "this is the Linux console: plain letters only, no key releases, no mouse",
                "kitty coadapt    # in a graphical session; or ssh to here from one",
            ),
            Some("dumb") | None => add(
                "TERM is dumb or not set: no screen can be drawn",
                "export TERM=xterm-256color    # if the terminal is one of its kind",
            ),
            Some(_) => {}
        }
        if let Some((width, height)) = abilities.size
            && (width < LEAST_WIDTH || height < LEAST_HEIGHT)
            && width > 0
        {
            add(
                &format!(
                    "the terminal has {width}×{height}, the screens need \
                     {LEAST_WIDTH}×{LEAST_HEIGHT}"
                ),
                r"printf '\033[8;24;80t'    # or make its window larger, or its letters smaller",
            );
        }
        if !self.utf8 {
            add(
                "the locale is not one of UTF-8: pictures are drawn with plain letters",
                "export LC_ALL=C.UTF-8",
            );
        }
        if self.asked && !abilities.answered {
            add(
                "the terminal did not answer: what it can do is not known",
                "kitty coadapt    # or another terminal that answers",
            );
        }
        // The console's lacks were told in one.
        let is_asked = self.asked && abilities.term.as_deref() != Some("linux");
        if is_asked && !abilities.key_releases {
            match abilities.inside() {
                Some(inside) => add(
                    &format!(
                        "{inside} swallows key releases and mouse pixels; a held key is estimated \
                         from its repeats"
                    ),
                    &format!("kitty coadapt    # outside {inside}; or add --operator gamepad"),
                ),
                None => add(
                    "key releases are not reported; a held key is estimated from its repeats",
                    "kitty coadapt    # or foot, Ghostty, WezTerm; or add --operator gamepad",
                ),
            }
        }
        if is_asked && !abilities.has_pixels() && abilities.inside().is_none() {
            add(
                "the mouse is read in cells, not in pixels: its steps are coarse",
                "kitty coadapt    # or foot, Ghostty, WezTerm",
            );
        }
        problems
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn able() -> Terminal {
        Terminal {
            asked: true,
            utf8: true,
            abilities: Abilities {
                answered: true,
                key_releases: true,
                mouse_pixels: true,
                cell_px: Some((9, 18)),
                size: Some((80, 24)),
                term: Some("xterm-kitty".to_owned()),
                ..Abilities::default()
            },
        }
    }

    #[test]
    fn each_thing_that_a_terminal_lacks_is_a_problem_with_a_cure() {
        assert_eq!(able().problems(), []);
        let with = |change: fn(&mut Terminal)| {
            let mut terminal = able();
            change(&mut terminal);
            let mut problems = terminal.problems();
            assert_eq!(problems.len(), 1, "{problems:?}");
            problems.remove(0)
        };
        assert!(with(|t| t.abilities.key_releases = false).mend.contains("--operator gamepad"));
        assert!(with(|t| t.abilities.mouse_pixels = false).what.contains("in cells"));
        assert!(with(|t| t.abilities.size = Some((79, 30))).what.contains("79×30"));
        assert_eq!(with(|t| t.utf8 = false).mend, "export LC_ALL=C.UTF-8");
        let console = with(|t| {
            t.abilities.term = Some("linux".to_owned());
            t.abilities.key_releases = false;
        });
        assert!(console.what.contains("console"));
        let tmux = with(|t| {
            t.abilities.tmux = true;
            t.abilities.key_releases = false;
            t.abilities.mouse_pixels = false;
        });
        assert!(tmux.what.starts_with("tmux swallows"));
    }

    #[test]
    fn of_a_terminal_that_was_not_asked_nothing_is_claimed() {
        let mut terminal = able();
        terminal.asked = false;
        terminal.abilities.key_releases = false;
        terminal.abilities.answered = false;
        terminal.abilities.size = None;
        assert_eq!(terminal.problems(), []);
    }
}
