//! Colours by meaning, glyphs by what the terminal can show.

use ratatui::buffer::Buffer;
use ratatui::style::{Color, Modifier, Style};

/// What a piece of the picture means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Ordinary text and shapes.
    Text,
    /// What the eye should find first.
    Strong,
    /// What may be overlooked: rules, marks, units, keys.
    Dim,
    /// The person.
    You,
    /// The robot.
    Robot,
    /// What the motor receives of both.
    Motor,
    /// The plant is free: steer.
    Go,
    /// The plant is held: wait.
    Wait,
    /// The time until release.
    Countdown,
    /// Something that needs a person now.
    Alarm,
}

impl Role {
    /// All roles.
    pub const ALL: [Self; 10] = [
        Self::Text,
        Self::Strong,
        Self::Dim,
        Self::You,
        Self::Robot,
        Self::Motor,
        Self::Go,
        Self::Wait,
        Self::Countdown,
        Self::Alarm,
    ];
}

/// Gives each role its style.
///
/// Only the 16 colours that every terminal theme chooses for itself, and of those only ones
/// that are legible on dark and on light grounds: no grey, no white, no black, no blue. Yellow is
/// pale on light ones; the countdown has its digits beside it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Palette {
    /// 16 colours.
    #[default]
    Colours,
    /// Bold and reverse only, as `NO_COLOR` asks.
    Plain,
}

impl Palette {
    /// The style of `role`.
    #[must_use]
    pub const fn style(self, role: Role) -> Style {
        let style = Style::new();
        match (self, role) {
            (Self::Plain, Role::Wait | Role::Alarm) => {
                style.add_modifier(Modifier::BOLD.union(Modifier::REVERSED))
            }
            (Self::Plain, Role::Strong | Role::Go | Role::Robot)
            | (Self::Colours, Role::Strong | Role::Motor) => style.add_modifier(Modifier::BOLD),
            (Self::Plain, _) | (_, Role::Text) => style,
            (Self::Colours, Role::Dim) => style.add_modifier(Modifier::DIM),
            (Self::Colours, Role::You) => style.fg(Color::Cyan),
            (Self::Colours, Role::Robot) => style.fg(Color::Magenta),
            (Self::Colours, Role::Go) => style.fg(Color::Green),
            (Self::Colours, Role::Wait) => style.fg(Color::Red),
            (Self::Colours, Role::Countdown) => style.fg(Color::Yellow),
            (Self::Colours, Role::Alarm) => {
                style.fg(Color::Red).add_modifier(Modifier::BOLD.union(Modifier::REVERSED))
            }
        }
    }
}

/// The finest glyphs that the terminal can show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Glyphs {
    /// 2×4 dots in a cell.
    #[default]
    Braille,
    /// Quarter blocks, 2×2 in a cell.
    Half,
    /// 7-bit characters only.
    Ascii,
}

/// How the pictures look on this terminal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// The finest glyphs.
    pub glyphs: Glyphs,
    /// The colours.
    pub palette: Palette,
}

impl Look {
    /// The last touch on a drawn buffer: where only 7-bit characters can be shown, every
    /// other one becomes its nearest relative, a cell for a cell.
    pub fn finish(self, buffer: &mut Buffer) {
        if self.glyphs != Glyphs::Ascii {
            return;
        }
        spell_plus_minus(buffer);
        for cell in &mut buffer.content {
            if !cell.symbol().is_ascii() {
                let relative = cell.symbol().chars().next().map_or(' ', ascii);
                cell.set_char(relative);
            }
        }
    }
}

/// Writes ± as +- where a blank stands beside it: a plus alone would read as a sum.
fn spell_plus_minus(buffer: &mut Buffer) {
    let width = usize::from(buffer.area.width);
    for at in 0..buffer.content.len() {
        if buffer.content[at].symbol() != "±" {
            continue;
        }
        let is_blank = |at: usize| buffer.content[at].symbol() == " ";
        let (plus, minus) = if (at + 1) % width != 0 && is_blank(at + 1) {
            (at, at + 1)
        } else if at % width != 0 && is_blank(at - 1) {
            (at - 1, at)
        } else {
            continue;
        };
        buffer.content[plus].set_char('+');
        buffer.content[minus].set_char('-');
    }
}

/// The 7-bit character that stands for `glyph`.
fn ascii(glyph: char) -> char {
    match glyph {
        c if c.is_ascii() => c,
        '─' | '━' | '–' | '−' | '▃' => '-',
        '│' | '┃' | '▌' | '▐' | '┤' | '├' => '|',
        '┌' | '┐' | '└' | '┘' | '╭' | '╮' | '╯' | '╰' | '┼' | '┬' | '┴' | '▅' | '±' => {
            '+'
        }
        '…' => '~',
        '█' | '▉' | '▊' | '▋' | '▇' | '╔' | '╗' | '╚' | '╝' | '║' => '#',
        '▓' | '▒' | '┊' => ':',
        '░' | '·' | '▁' => '.',
        '•' | '▆' | '✓' | '\u{2801}'..='\u{28ff}' => '*',
        '▂' => '_',
        '▄' | '═' | '■' => '=',
        '←' => '<',
        '→' => '>',
        '↑' => '^',
        '↓' => 'v',
        '×' => 'x',
        '°' => 'd',
        'τ' => 't',
        _ => '?',
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plain_palette_has_no_colour_and_still_tells_wait_from_go() {
        for role in Role::ALL {
            let style = Palette::Plain.style(role);
            assert_eq!((style.fg, style.bg), (None, None), "{role:?}");
            assert!(
                (Modifier::BOLD | Modifier::REVERSED).contains(style.add_modifier),
                "{role:?} uses more than bold and reverse"
            );
        }
        assert_ne!(Palette::Plain.style(Role::Go), Palette::Plain.style(Role::Wait));
        assert_ne!(Palette::Plain.style(Role::You), Palette::Plain.style(Role::Robot));
    }

    #[test]
    fn person_robot_and_motor_differ_in_colour() {
        let style = |role| Palette::Colours.style(role).fg;
        assert_ne!(style(Role::You), style(Role::Robot));
        assert_ne!(style(Role::You), style(Role::Motor));
        assert_ne!(style(Role::Robot), style(Role::Motor));
    }

    #[test]
    fn plus_minus_is_spelt_where_there_is_room() {
        let finished = |line: &str| {
            let mut buffer = Buffer::with_lines([line]);
            Look { glyphs: Glyphs::Ascii, ..Look::default() }.finish(&mut buffer);
            buffer.content.iter().map(|cell| cell.symbol().to_owned()).collect::<String>()
        };
        assert_eq!(finished("2.1 s ± 0.4 s"), "2.1 s +-0.4 s");
        assert_eq!(finished(" ±17 cm"), "+-17 cm");
        assert_eq!(finished("(±10)±"), "(+10)+");
    }

    #[test]
    fn finishing_for_ascii_leaves_7_bit_characters_only() {
        let mut buffer = Buffer::with_lines(["─│█▒░·←→×✓…°τ⣿é字a"]);
        Look { glyphs: Glyphs::Ascii, ..Look::default() }.finish(&mut buffer);
        assert!(buffer.content.iter().all(|cell| cell.symbol().is_ascii()));
    }
}
