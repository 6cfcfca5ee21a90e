//! The terminal's answers, told apart from the keys typed meanwhile.
//!
//! The terminal answers in the stream that keys come in. [`Answers`] takes that stream in
//! pieces of any size: what answers a question is noted, and what a person typed comes out as
//! events. Whatever the bytes are, it goes on.

use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use super::abilities::Abilities;

/// No sequence that matters is longer; what is, is not worth waiting for.
const LONGEST: usize = 256;

/// Answers so far.
#[derive(Clone, Debug, Default)]
#[expect(clippy::struct_excessive_bools, reason = "each is an answer of its own")]
pub struct Answers {
    /// What may be the beginning of something.
    pending: Vec<u8>,
    is_over: bool,
    has_kitty: bool,
    has_pixels: bool,
    is_synchronised: bool,
    cell_px: Option<(u16, u16)>,
    area_px: Option<(u16, u16)>,
}

/// What the stream begins with.
enum Piece {
    /// `CSI`, parameters, final byte, and the length of all.
    Csi(usize),
    /// `ESC O` and a letter.
    Ss3(u8),
    /// A character, and its length.
    Char(char, usize),
    /// Alt with a character.
    Alt(char, usize),
    /// The key Esc, before another escape.
    Esc,
    /// So many bytes that mean nothing here.
    Noise(usize),
    /// More has to come.
    Cut,
}

impl Answers {
    /// Takes `bytes` in; what was typed in them comes out.
    pub fn take(&mut self, bytes: &[u8]) -> Vec<Event> {
        self.pending.extend_from_slice(bytes);
        let mut typed = Vec::new();
        loop {
            let (event, length) = match piece(&self.pending) {
                Piece::Cut if self.pending.len() <= LONGEST => return typed,
                Piece::Cut => (None, self.pending.len()),
                Piece::Noise(length) => (None, length),
                Piece::Esc => (Some(press(KeyCode::Esc, KeyModifiers::NONE)), 1),
                Piece::Char(c, length) => (Some(character(c)), length),
                Piece::Alt(c, length) => {
                    (Some(press(KeyCode::Char(c), KeyModifiers::ALT)), 1 + length)
                }
                Piece::Ss3(letter) => (arrow(letter).map(|key| press(key, KeyModifiers::NONE)), 3),
                Piece::Csi(length) => {
                    let inner: Vec<u8> = self.pending[2..length].to_vec();
                    (self.sequence(&inner), length)
                }
            };
            typed.extend(event);
            self.pending.drain(..length.clamp(1, self.pending.len()));
        }
    }

    /// Nothing more comes: what is left is taken for what it looks like.
    pub fn finish(&mut self) -> Vec<Event> {
        let left = std::mem::take(&mut self.pending);
        if left == [0x1b] { vec![press(KeyCode::Esc, KeyModifiers::NONE)] } else { Vec::new() }
    }

    /// Whether the last question was answered, and with it all.
    #[must_use]
    pub const fn is_over(&self) -> bool {
        self.is_over
    }

    /// Whether a sequence has begun that has not ended.
    #[must_use]
    pub const fn is_cut(&self) -> bool {
        !self.pending.is_empty()
    }

    /// Notes in `abilities` what was answered.
    pub fn note(&self, abilities: &mut Abilities) {
        abilities.answered = self.is_over;
        abilities.key_releases = self.has_kitty;
        abilities.mouse_pixels = self.has_pixels;
        abilities.synchronised = self.is_synchronised;
        let by_area = || {
            let ((width, height), (columns, rows)) = (self.area_px?, abilities.size?);
            Some((width.checked_div(columns)?, height.checked_div(rows)?))
        };
        let is_real = |(width, height): &(u16, u16)| *width > 0 && *height > 0;
        // A cell's own size is exact, the area's may have a margin.
        let said = self.cell_px.filter(is_real).or_else(|| by_area().filter(is_real));
        abilities.cell_px = said.or(abilities.cell_px);
    }

    /// A sequence, from after its `CSI` to its final byte: an answer, or a key.
    fn sequence(&mut self, inner: &[u8]) -> Option<Event> {
        let (last, parameters) = inner.split_last()?;
        let text = std::str::from_utf8(parameters).ok()?;
        if let Some(text) = text.strip_prefix('?') {
            match (*last, text.strip_suffix('$').map(numbers).as_deref()) {
                (b'u', _) => self.has_kitty = true,
                (b'c', _) => self.is_over = true,
                // Set or not, now or for ever but off: all but "not recognised".
                (b'y', Some([1016, state])) => self.has_pixels = matches!(state, 1..=3),
                (b'y', Some([2026, state])) => self.is_synchronised = matches!(state, 1..=3),
                _ => {}
            }
            return None;
        }
        let given = numbers(text);
        match (*last, &given[..]) {
            (b't', &[6, height, width]) => self.cell_px = Some((width, height)),
            (b't', &[4, height, width]) => self.area_px = Some((width, height)),
            _ => return key(*last, text),
        }
        None
    }
}

/// The numbers between semicolons; what is none is 0, what is too large the largest.
fn numbers(text: &str) -> Vec<u16> {
    let number = |part: &str| match part.parse::<u64>() {
        Ok(number) => u16::try_from(number).unwrap_or(u16::MAX),
        Err(_) => 0,
    };
    text.split(';').map(number).collect()
}

/// What `bytes` begin with.
fn piece(bytes: &[u8]) -> Piece {
    match bytes {
        [] | [0x1b] | [0x1b, b'O'] => Piece::Cut,
        [0x1b, 0x1b, ..] => Piece::Esc,
        [0x1b, b'[', rest @ ..] => {
            let is_inner = |byte: &u8| matches!(byte, 0x20..=0x3f);
            let inner = rest.iter().take_while(|byte| is_inner(byte)).count();
            match rest.get(inner) {
                None => Piece::Cut,
                // The console's F1 to F5, `CSI [ A`; nobody here waits for them.
                Some(b'[') if inner == 0 && rest.len() == 1 => Piece::Cut,
                Some(b'[') if inner == 0 => Piece::Noise(4),
                Some(0x40..=0x7e) => Piece::Csi(2 + inner + 1),
                Some(_) => Piece::Noise(2 + inner),
            }
        }
        [0x1b, b'O', letter, ..] => Piece::Ss3(*letter),
        // A string of the terminal's, up to its end.
        [0x1b, b']' | b'P' | b'_' | b'^', rest @ ..] => {
            let ends = |pair: &[u8]| pair == b"\x1b\\";
            let bell = rest.iter().position(|byte| *byte == 0x07).map(|at| at + 1);
            let end = rest.windows(2).position(ends).map(|at| at + 2);
            match bell.into_iter().chain(end).min() {
                Some(length) => Piece::Noise(2 + length),
                None => Piece::Cut,
            }
        }
        [0x1b, rest @ ..] => match piece(rest) {
            Piece::Char(c, length) => Piece::Alt(c, length),
            Piece::Cut => Piece::Cut,
            _ => Piece::Noise(1),
        },
        [first, ..] => {
            let length = match first {
                0x00..=0x7f => 1,
                0xc0..=0xdf => 2,
                0xe0..=0xef => 3,
                0xf0..=0xf7 => 4,
                _ => return Piece::Noise(1),
            };
            match bytes.get(..length).map(std::str::from_utf8) {
                None => Piece::Cut,
                Some(Ok(text)) => {
                    text.chars().next().map_or(Piece::Noise(1), |c| Piece::Char(c, length))
                }
                Some(Err(_)) => Piece::Noise(1),
            }
        }
    }
}

fn press(code: KeyCode, modifiers: KeyModifiers) -> Event {
    Event::Key(KeyEvent::new(code, modifiers))
}

/// The key that sends `c` where keys are not told apart.
fn character(c: char) -> Event {
    let (code, modifiers) = match c {
        '\r' => (KeyCode::Enter, KeyModifiers::NONE),
        '\t' => (KeyCode::Tab, KeyModifiers::NONE),
        '\x7f' => (KeyCode::Backspace, KeyModifiers::NONE),
        '\0' => (KeyCode::Char(' '), KeyModifiers::CONTROL),
        '\x01'..='\x1a' => {
            let letter = char::from(u8::try_from(c).unwrap_or(0) - 1 + b'a');
            (KeyCode::Char(letter), KeyModifiers::CONTROL)
        }
        '\x1c'..='\x1f' => {
            let digit = char::from(u8::try_from(c).unwrap_or(0x1c) - 0x1c + b'4');
            (KeyCode::Char(digit), KeyModifiers::CONTROL)
        }
        c if c.is_uppercase() => (KeyCode::Char(c), KeyModifiers::SHIFT),
        c => (KeyCode::Char(c), KeyModifiers::NONE),
    };
    press(code, modifiers)
}

fn arrow(letter: u8) -> Option<KeyCode> {
    Some(match letter {
        b'A' => KeyCode::Up,
        b'B' => KeyCode::Down,
        b'C' => KeyCode::Right,
        b'D' => KeyCode::Left,
        b'H' => KeyCode::Home,
        b'F' => KeyCode::End,
        _ => return None,
    })
}

/// The key of `CSI text last`, in the terminals' old tongue or in kitty's.
fn key(last: u8, text: &str) -> Option<Event> {
    if text.is_empty() {
        match last {
            b'I' => return Some(Event::FocusGained),
            b'O' => return Some(Event::FocusLost),
            b'Z' => return Some(press(KeyCode::BackTab, KeyModifiers::SHIFT)),
            _ => {}
        }
    }
    let mut parts = text.split(';').map(|part| numbers(&part.replace(':', ";")));
    let first = parts.next().unwrap_or_default();
    let (mask, kind) = match parts.next().as_deref() {
        Some([mask, kind, ..]) => (*mask, *kind),
        Some([mask]) => (*mask, 1),
        _ => (1, 1),
    };
    let number = first.first().copied().unwrap_or_default();
    let code = match last {
        b'~' => match number {
            1 | 7 => KeyCode::Home,
            2 => KeyCode::Insert,
            3 => KeyCode::Delete,
            4 | 8 => KeyCode::End,
            5 => KeyCode::PageUp,
            6 => KeyCode::PageDown,
            _ => return None,
        },
        b'u' => match number {
            9 => KeyCode::Tab,
            13 => KeyCode::Enter,
            27 => KeyCode::Esc,
            127 => KeyCode::Backspace,
            // Kitty's own numbers for keys without a character.
            57344.. => return None,
            _ => KeyCode::Char(char::from_u32(first.get(1).copied().unwrap_or(number).into())?),
        },
        letter => arrow(letter)?,
    };
    let bits = u8::try_from(mask.saturating_sub(1)).unwrap_or(0);
    let held = [KeyModifiers::SHIFT, KeyModifiers::ALT, KeyModifiers::CONTROL];
    let modifiers = held
        .iter()
        .enumerate()
        .filter(|(bit, _)| bits & (1 << bit) != 0)
        .fold(KeyModifiers::NONE, |all, (_, one)| all | *one);
    let kind = match kind {
        2 => KeyEventKind::Repeat,
        3 => KeyEventKind::Release,
        _ => KeyEventKind::Press,
    };
    Some(Event::Key(KeyEvent::new_with_kind(code, modifiers, kind)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What kitty says, in the order of the questions.
    const KITTY: &[u8] =
        b"\x1b[?0u\x1b[?1016;2$y\x1b[?2026;2$y\x1b[6;20;10t\x1b[4;480;800t\x1b[?62c";

    fn found(answers: &Answers) -> Abilities {
        let mut abilities = Abilities { size: Some((80, 24)), ..Abilities::default() };
        answers.note(&mut abilities);
        abilities
    }

    fn codes(events: &[Event]) -> Vec<KeyCode> {
        events.iter().filter_map(|event| event.as_key_event().map(|key| key.code)).collect()
    }

    #[test]
    fn a_full_answer_is_understood_in_pieces_of_any_size() {
        for size in 1..KITTY.len() {
            let mut answers = Answers::default();
            for piece in KITTY.chunks(size) {
                assert!(!answers.is_over());
                assert_eq!(answers.take(piece), []);
            }
            assert!(answers.is_over() && !answers.is_cut());
            let abilities = found(&answers);
            assert!(abilities.answered && abilities.key_releases);
            assert!(abilities.mouse_pixels && abilities.synchronised);
            assert_eq!(abilities.cell_px, Some((10, 20)));
        }
    }

    #[test]
    fn a_plain_answer_promises_nothing() {
        let mut answers = Answers::default();
        answers.take(b"\x1b[?1016;0$y\x1b[?2026;4$y\x1b[?1;2c");
        let abilities = found(&answers);
        assert!(abilities.answered && !abilities.key_releases);
        assert!(!abilities.mouse_pixels && !abilities.synchronised);
        assert_eq!(abilities.cell_px, None);
        // From the whole area, if a cell is not known; never from nonsense.
        answers.take(b"\x1b[4;481;805t");
        assert_eq!(found(&answers).cell_px, Some((10, 20)));
        answers.take(b"\x1b[6;0;0t");
        assert_eq!(found(&answers).cell_px, Some((10, 20)));
    }

    #[test]
    fn what_is_typed_among_the_answers_comes_out() {
        use KeyCode::{BackTab, Backspace, Char, Delete, Down, Enter, Esc, Left, Right, Tab};
        let mut answers = Answers::default();
        let typed = answers.take(
            b"a\x1b[?0u\x1b[C\x1bOD\r\t\x7f\x1b[Z\x1b[3~\x1b[?62c\xc3\xa9\x1b\x1b[B\x03\x1b[97;1:3u\x1b[I",
        );
        let expected = [
            Char('a'),
            Right,
            Left,
            Enter,
            Tab,
            Backspace,
            BackTab,
            Delete,
            Char('é'),
            Esc,
            Down,
            Char('c'),
            Char('a'),
        ];
        assert_eq!(codes(&typed), expected);
        assert_eq!(typed.last(), Some(&Event::FocusGained));
        let keys: Vec<_> = typed.iter().filter_map(Event::as_key_event).collect();
        assert_eq!(keys[11].modifiers, KeyModifiers::CONTROL);
        assert_eq!(keys[12].kind, KeyEventKind::Release);
        // A lone Esc is known as one only once nothing follows.
        assert_eq!(answers.take(b"\x1b"), []);
        assert!(answers.is_cut());
        assert_eq!(codes(&answers.finish()), [Esc]);
    }

    proptest! {
        #[test]
        fn no_bytes_disturb_it_and_letters_after_them_arrive(
            bytes in proptest::collection::vec(any::<u8>(), 0..400),
            size in 1..50_usize,
        ) {
            let mut answers = Answers::default();
            for piece in bytes.chunks(size) {
                answers.take(piece);
                prop_assert!(answers.pending.len() <= LONGEST);
            }
            answers.finish();
            prop_assert_eq!(codes(&answers.take(b"q")), [KeyCode::Char('q')]);
        }

        /// Sequences of the terminal's own kind, cut and mixed.
        #[test]
        fn pieces_of_answers_in_any_order_are_no_keys_that_were_not_typed(
            parts in proptest::collection::vec(0..6_usize, 0..20),
            size in 1..9_usize,
        ) {
            let all: Vec<&[u8]> = vec![
                b"\x1b[?0u", b"\x1b[?1016;2$y", b"\x1b[6;20;10t", b"\x1b[?62;22c", b"\x1bP>|kitty\x1b\\",
                b"\x1b]22;x\x07",
            ];
            let stream: Vec<u8> = parts.iter().flat_map(|part| all[*part].to_vec()).collect();
            let mut answers = Answers::default();
            for piece in stream.chunks(size) {
                prop_assert_eq!(answers.take(piece), []);
            }
        }
    }
}
