//! The pieces that the form is written with.

use ratatui::style::Modifier;
use tui_input::Input;

use crate::tui::palette::{Glyphs, Role};
use crate::tui::pen::{Pen, columns};
use crate::tui::text::{cut, place, real};

/// The few signs of the form, also where only 7-bit characters can be shown.
pub(in crate::tui) struct Signs {
    /// Beside the label of the focused field.
    pub here: &'static str,
    /// Around a choice.
    pub before: &'static str,
    pub after: &'static str,
    pub under: &'static str,
    pub knob: &'static str,
    pub push: &'static str,
    pub fault: &'static str,
}

impl Signs {
    pub const fn of(glyphs: Glyphs) -> Self {
        match glyphs {
            Glyphs::Ascii => Self {
                here: ">",
                before: "<",
                after: ">",
                under: "=",
                knob: "O",
                push: "#",
                fault: "!",
            },
            Glyphs::Braille | Glyphs::Half => Self {
                here: "›",
                before: "‹",
                after: "›",
                under: "▔",
                knob: "●",
                push: "█",
                fault: "✗",
            },
        }
    }
}

/// How a value is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::tui) enum Light {
    /// Another field has the focus.
    Off,
    /// The focus is here: reversed.
    On,
    /// It is being typed: a cursor.
    Typing,
}

/// Writes `text` reversed where the focus is on it; returns the column after it.
pub(super) fn value(pen: &mut Pen<'_>, x: u16, y: u16, text: &str, light: Light) -> u16 {
    let end = pen.text(x, y, text, if light == Light::Off { Role::Text } else { Role::Strong });
    if light != Light::Off {
        reverse(pen, x, y, end.saturating_sub(x));
    }
    end
}

/// Writes a choice between its signs, the brightness only on the word.
pub(super) fn choice(pen: &mut Pen<'_>, x: u16, y: u16, word: &str, light: Light) -> u16 {
    let signs = Signs::of(pen.look.glyphs);
    let role = if light == Light::Off { Role::Dim } else { Role::Strong };
    pen.text(x, y, signs.before, role);
    let end = value(pen, x + 1, y, &format!(" {word} "), light);
    pen.text(end, y, signs.after, role)
}

/// Writes a box to tick with its label.
pub(super) fn tick(pen: &mut Pen<'_>, x: u16, y: u16, on: bool, word: &str, light: Light) -> u16 {
    let mark = if on { "[x]" } else { "[ ]" };
    let end = value(pen, x, y, mark, light);
    let role = if on { Role::Text } else { Role::Dim };
    pen.text(end + 1, y, word, role)
}

/// Writes a text of at most `width` columns, scrolled to its cursor; returns the column
/// after it. A `fresh` text is reversed as a whole, since typing replaces it.
pub(in crate::tui) fn input(
    pen: &mut Pen<'_>,
    (x, y, width): (u16, u16, u16),
    text: &Input,
    light: Light,
    fresh: bool,
) -> u16 {
    if light != Light::Typing {
        // Both ends tell more of a path than its beginning alone.
        let shown = shortened(text.value(), width);
        let shown = if light == Light::On && shown.is_empty() { " ".to_owned() } else { shown };
        return value(pen, x, y, &shown, light);
    }
    let room = usize::from(width.saturating_sub(1));
    let scroll = text.visual_scroll(room);
    let shown = visible(text.value(), scroll, usize::from(width));
    let end = pen.text(x, y, &shown, Role::Strong);
    let cursor = u16::try_from(text.visual_cursor().saturating_sub(scroll)).unwrap_or(width);
    if fresh && !shown.is_empty() {
        reverse(pen, x, y, end.saturating_sub(x));
    } else {
        reverse(pen, x + cursor.min(width.saturating_sub(1)), y, 1);
    }
    end.max(x + cursor + 1)
}

/// The columns `from` .. `from + width` of `text`, whole characters only.
fn visible(text: &str, from: usize, width: usize) -> String {
    let mut column = 0;
    let mut shown = String::new();
    for c in text.chars() {
        let wide = usize::from(columns(c.encode_utf8(&mut [0; 4])));
        if column >= from && column + wide <= from + width {
            shown.push(c);
        }
        column += wide;
    }
    shown
}

/// `text` in `width` columns, its middle left out where it is longer.
fn shortened(text: &str, width: u16) -> String {
    let (length, width) = (text.chars().count(), usize::from(width));
    if length <= width {
        return text.to_owned();
    }
    let head = width.saturating_sub(1) / 2;
    let tail = width.saturating_sub(1) - head;
    let end: String = text.chars().skip(length - tail).collect();
    text.chars().take(head).chain(['…']).chain(end.chars()).collect()
}

/// A slider from `left` to `right` whose knob stands at `at`, 0 to 1.
pub(super) fn slider(pen: &mut Pen<'_>, (x, y, width): (u16, u16, u16), at: f64, light: Light) {
    let signs = Signs::of(pen.look.glyphs);
    let role = if light == Light::Off { Role::Dim } else { Role::Strong };
    let end = pen.text(x, y, "├", role);
    let end = pen.repeat(end, y, "─", width.saturating_sub(2), role);
    pen.text(end, y, "┤", role);
    let inner = f64::from(width.saturating_sub(3));
    let knob = x + 1 + place((at.clamp(0.0, 1.0) * inner).round());
    value(pen, knob, y, signs.knob, light);
}

/// A bar from the middle to `push`, −1 to 1.
pub(in crate::tui) fn push(pen: &mut Pen<'_>, (x, y, half): (u16, u16, u16), push: f64) {
    let signs = Signs::of(pen.look.glyphs);
    let push = if push.is_finite() { push.clamp(-1.0, 1.0) } else { 0.0 };
    let filled = place((push.abs() * f64::from(half)).round());
    pen.text(x, y, "├", Role::Dim);
    pen.repeat(x + 1, y, "─", 2 * half + 1, Role::Dim);
    pen.text(x + 2 * half + 2, y, "┤", Role::Dim);
    let middle = x + 1 + half;
    let from = if push < 0.0 { middle - filled } else { middle + 1 };
    pen.repeat(from, y, signs.push, filled, Role::You);
    pen.text(middle, y, "┼", Role::Text);
}

/// Reverses `width` cells, whatever the palette.
fn reverse(pen: &mut Pen<'_>, x: u16, y: u16, width: u16) {
    let area = pen.part(x, y, width, 1).area();
    for position in area.positions() {
        if let Some(cell) = pen.buffer().cell_mut(position) {
            cell.modifier.insert(Modifier::REVERSED);
        }
    }
}

/// A shell command in lines of at most `width` characters, each but the last continued
/// with a backslash, so that what is copied from the screen still runs.
pub(super) fn command(command: &str, width: usize) -> Vec<String> {
    let room = width.saturating_sub(3).max(1);
    let mut lines: Vec<String> = Vec::new();
    let mut line = String::new();
    for part in parts(command) {
        if !line.is_empty() && line.chars().count() + 1 + part.chars().count() > room {
            lines.push(std::mem::take(&mut line) + " \\");
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line.push_str(&part);
        while line.chars().count() > room {
            let rest: String = line.chars().skip(room).collect();
            let head: String = line.chars().take(room).collect();
            // Within quotes a backslash is a letter: they end before it and begin anew.
            let quote = if is_quoted(&head) { "'" } else { "" };
            lines.push(format!("{head}{quote}\\"));
            line = format!("{quote}{rest}");
        }
    }
    lines.push(line);
    lines
}

/// The words of a command outside of quotes, an option together with its value.
fn parts(command: &str) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    for word in command.split(' ') {
        match parts.last_mut() {
            Some(last) if is_quoted(last) || (last.starts_with("--") && !last.contains(' ')) => {
                last.push(' ');
                last.push_str(word);
            }
            _ => parts.push(word.to_owned()),
        }
    }
    parts
}

/// Whether a shell is still within quotes after `text`.
fn is_quoted(text: &str) -> bool {
    (text.matches('\'').count() - text.matches("\\'").count()) % 2 == 1
}

/// Which `rows` of `count` lines are shown at `time_s`: they take turns.
pub(super) fn window(count: usize, rows: usize, time_s: f64) -> std::ops::Range<usize> {
    /// A person reads two lines in this time.
    const TURN_S: f64 = 4.0;
    if count <= rows {
        return 0..count;
    }
    let pages = count.div_ceil(rows.max(1));
    let page = usize::from(place((time_s / TURN_S).rem_euclid(real(pages))));
    let from = (page * rows).min(count - rows);
    from..from + rows
}

/// `text` cut to what fits between `x` and column `end`.
pub(in crate::tui) fn note(pen: &mut Pen<'_>, x: u16, y: u16, end: u16, text: &str, role: Role) {
    pen.text(x, y, &cut(text, usize::from(end.saturating_sub(x))), role);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_broken_at_blanks_and_no_letter_is_lost() {
        let words = "coadapt run balance --subject S07 --policy ".to_owned() + &"x".repeat(90);
        for width in [5, 20, 40, 78, 200] {
            let lines = command(&words, width);
            assert!(lines.iter().all(|line| line.chars().count() <= width), "{lines:?}");
            // What a shell makes of it.
            assert_eq!(lines.join("\n").replace("\\\n", ""), words);
        }
    }

    #[test]
    fn an_option_stays_with_its_value_and_quotes_stay_whole() {
        let words = "coadapt run --set a=1 --operator 'script:my own file.csv'";
        assert_eq!(
            command(words, 32),
            ["coadapt run --set a=1 \\", "--operator 'script:my own fil'\\", "'e.csv'"]
        );
    }

    #[test]
    fn lines_beyond_the_room_take_turns() {
        let shown: Vec<usize> =
            (0..100).flat_map(|second| window(5, 2, f64::from(second))).collect();
        assert!((0..5).all(|line| shown.contains(&line)));
        assert_eq!(window(2, 2, 1e9), 0..2);
        assert_eq!(window(5, 2, f64::NAN).len(), 2);
    }

    #[test]
    fn a_long_text_shows_both_its_ends() {
        assert_eq!(shortened("abcdefgh", 5), "ab…gh");
        assert_eq!(shortened("abc", 5), "abc");
    }
}
