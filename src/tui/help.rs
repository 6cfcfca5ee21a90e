//! The keys and the few facts that the screen has no room for.

use super::keys::{self, Hand, Screen};
use super::palette::Role;
use super::pen::{Pen, columns};
use super::text::wrapped;

/// The width of the page, its border included.
const WIDTH: u16 = 72;

/// What Ctrl-C does wherever there may be something to save.
const QUITS: &str = "stop, save and quit";

/// Draws the keys of `screen`, for `hand`, and `notes` over what is there.
pub fn draw(pen: &mut Pen<'_>, screen: Screen, hand: Hand, notes: &[String]) {
    let bindings: Vec<_> = keys::of(screen).filter(|b| !b.shown.is_empty()).collect();
    let width = WIDTH.min(pen.width());
    let lines: Vec<String> =
        notes.iter().flat_map(|note| wrapped(note, usize::from(width.saturating_sub(4)))).collect();
    let rows = bindings.len() + 1 + usize::from(!lines.is_empty()) + lines.len();
    let height = u16::try_from(rows + 2).unwrap_or(u16::MAX).min(pen.height());
    let (x, y) = ((pen.width() - width) / 2, (pen.height() - height) / 2);
    let title = format!("keys: {}", screen.word());
    let mut page = pen.part(x, y, width, height);
    let mut page = page.boxed(&title, Role::Strong);
    let shown = bindings.iter().map(|b| columns(b.shown)).max().unwrap_or(0).max(6);
    let mut y = 0;
    for binding in bindings {
        let (keys, what) = binding.words(hand);
        page.text(0, y, keys, Role::Strong);
        page.text(shown + 3, y, what, Role::Text);
        y += 1;
    }
    page.text(0, y, "Ctrl-C", Role::Strong);
    let quits = if matches!(screen, Screen::Replay | Screen::Watch | Screen::Report) {
        "quit"
    } else {
        QUITS
    };
    page.text(shown + 3, y, quits, Role::Text);
    y += 2;
    for line in lines {
        page.text(0, y, &line, Role::Dim);
        y += 1;
    }
}

/// The line of keys at the bottom of `screen`, in row `y`, for `hand`.
pub fn hints(pen: &mut Pen<'_>, y: u16, screen: Screen, hand: Hand) {
    let mut x = 1;
    for (key, word) in keys::hints(screen, hand) {
        if x + columns(key) + 1 + columns(word) > pen.width() {
            break;
        }
        x = pen.text(x, y, key, Role::Strong);
        x = pen.text(x + 1, y, word, Role::Dim) + 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::Device;

    #[test]
    fn the_line_of_keys_fits_the_smallest_screen() {
        let hands = [Hand::On(Device::Gamepad), Hand::On(Device::Mouse), Hand::Nobody];
        for (screen, hand) in Screen::ALL.into_iter().flat_map(|s| hands.map(|hand| (s, hand))) {
            let length: u16 =
                keys::hints(screen, hand).map(|(key, word)| columns(key) + columns(word) + 3).sum();
            assert!(length > 0 && length - 2 < 80, "{}: {length}", screen.word());
        }
    }
}
