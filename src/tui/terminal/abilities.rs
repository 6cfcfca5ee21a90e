//! What the terminal can do, as far as it says so.

use std::sync::{Mutex, PoisonError};

use serde::Serialize;

/// What is known of the terminal: from its answers, from the environment, from the system.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[expect(clippy::struct_excessive_bools, reason = "each is an answer of its own")]
pub struct Abilities {
    /// Whether it answered at all; if not, what it was asked about counts as missing.
    pub answered: bool,
    /// How long the answer took, s.
    pub answer_s: Option<f64>,
    /// Whether it can report that a key was let go (kitty's keyboard protocol).
    pub key_releases: bool,
    /// Whether it can report the mouse in pixels instead of cells (mode 1016).
    pub mouse_pixels: bool,
    /// Whether it shows a frame at once (synchronised updates, mode 2026).
    pub synchronised: bool,
    /// Whether the pointer's shape can be set (OSC 22). A guess from the terminal's name, for
    /// terminals do not tell.
    pub pointer_shape: bool,
    /// A cell's width and height, pixels.
    pub cell_px: Option<(u16, u16)>,
    /// Columns and rows.
    pub size: Option<(u16, u16)>,
    /// `TERM`.
    pub term: Option<String>,
    /// The terminal's name and version, where the environment has them (`TERM_PROGRAM`).
    pub program: Option<String>,
    /// How many colours it has, by `TERM` and `COLORTERM`.
    pub colours: u32,
    /// Whether the person wants none (`NO_COLOR`).
    pub no_colour: bool,
    /// Whether it is a tmux, by `TMUX` or `TERM`.
    pub tmux: bool,
    /// Whether it is a GNU screen, by `STY` or `TERM`.
    pub screen: bool,
    /// Whether it is reached through ssh.
    pub ssh: bool,
}

/// What was found last.
static KNOWN: Mutex<Option<Abilities>> = Mutex::new(None);

impl Abilities {
    /// What the environment says, with `get` for a variable that is set and not empty.
    #[must_use]
    pub fn of_environment(get: impl Fn(&str) -> Option<String>) -> Self {
        let term = get("TERM");
        let name = term.clone().unwrap_or_default();
        let program = get("TERM_PROGRAM").map(|program| match get("TERM_PROGRAM_VERSION") {
            Some(version) => format!("{program} {version}"),
            None => program,
        });
        let is_true = get("COLORTERM").is_some_and(|c| c == "truecolor" || c == "24bit");
        let tmux = get("TMUX").is_some() || name.starts_with("tmux");
        let sets_shapes =
            ["xterm-kitty", "foot", "xterm-ghostty"].iter().any(|known| name.starts_with(known))
                || ["KITTY_WINDOW_ID", "XTERM_VERSION"].iter().any(|name| get(name).is_some());
        Self {
            // A tmux calls itself screen, too, and passes nothing on.
            screen: !tmux && (get("STY").is_some() || name.starts_with("screen")),
            pointer_shape: sets_shapes && !tmux && !name.starts_with("screen"),
            colours: match name.as_str() {
                _ if is_true => 1 << 24,
                "dumb" => 0,
                name if name.ends_with("-direct") => 1 << 24,
                name if name.contains("256color") || sets_shapes => 256,
                _ => 8,
            },
            no_colour: get("NO_COLOR").is_some(),
            ssh: ["SSH_CONNECTION", "SSH_TTY"].iter().any(|name| get(name).is_some()),
            term,
            program,
            tmux,
            ..Self::default()
        }
    }

    /// The program between the person's terminal and this one, in a word.
    #[must_use]
    pub const fn inside(&self) -> Option<&'static str> {
        match (self.tmux, self.screen) {
            (true, _) => Some("tmux"),
            (_, true) => Some("screen"),
            _ => None,
        }
    }

    /// Whether pixels of the mouse can be used: they are reported, and the screen's are known.
    #[must_use]
    pub const fn has_pixels(&self) -> bool {
        self.mouse_pixels && self.cell_px.is_some()
    }

    /// What a person with this terminal should know, in whole sentences.
    #[must_use]
    pub fn sentences(&self) -> Vec<String> {
        let mut said = Vec::new();
        match self.inside() {
            Some(inside) if !self.key_releases => said.push(format!(
                "this is {inside}, which swallows key releases, mouse pixels and pointer shapes: \
                 steer outside it, or with a gamepad"
            )),
            Some(inside) => said.push(format!("this is {inside}")),
            None => {}
        }
        if self.key_releases {
            said.push("key releases are reported".to_owned());
        } else {
            said.push(
                "key releases are not reported, and estimated from key repeats: terminals with \
                 kitty's keyboard protocol report them (kitty, foot, Ghostty, WezTerm, Alacritty)"
                    .to_owned(),
            );
        }
        said.push(match self.cell_px {
            Some((width, height)) if self.mouse_pixels => {
                format!("the mouse is read in pixels; a cell has {width} × {height}")
            }
            _ => "the mouse is read in cells".to_owned(),
        });
        if !self.answered {
            said.push("the terminal did not answer: what it can do is not known".to_owned());
        }
        said
    }

    /// From now on these are what [`known`](Self::known) says.
    pub(super) fn publish(&self) {
        *KNOWN.lock().unwrap_or_else(PoisonError::into_inner) = Some(self.clone());
    }

    /// What the last probe found; `None` before one is over.
    #[must_use]
    pub fn known() -> Option<Self> {
        KNOWN.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(variables: &[(&str, &str)]) -> Abilities {
        Abilities::of_environment(|name| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn what_lies_between_is_known_by_variables_and_names() {
        let inside = |variables: &[(&str, &str)]| of(variables).inside();
        assert_eq!(inside(&[("TERM", "xterm-256color")]), None);
        assert_eq!(inside(&[("TERM", "screen-256color"), ("TMUX", "/tmp/x,1,0")]), Some("tmux"));
        assert_eq!(inside(&[("TERM", "tmux-256color")]), Some("tmux"));
        assert_eq!(inside(&[("TERM", "screen.xterm-256color")]), Some("screen"));
        assert_eq!(inside(&[("TERM", "vt100"), ("STY", "12.pts")]), Some("screen"));
        assert!(of(&[("TMUX", "x")]).sentences()[0].contains("tmux, which swallows"));
    }

    #[test]
    fn colours_shapes_and_ssh_are_guessed_from_the_environment() {
        let kitty = of(&[("TERM", "xterm-kitty"), ("COLORTERM", "truecolor")]);
        assert!(kitty.pointer_shape && !kitty.ssh);
        assert_eq!(kitty.colours, 1 << 24);
        assert_eq!(of(&[("TERM", "xterm-256color")]).colours, 256);
        assert_eq!(of(&[("TERM", "dumb")]).colours, 0);
        assert!(of(&[("SSH_TTY", "/dev/pts/1")]).ssh);
        assert!(!of(&[("TERM", "xterm-kitty"), ("TMUX", "x")]).pointer_shape);
    }
}
