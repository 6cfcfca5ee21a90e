//! Writing into a part of the screen, clipped at its edges.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::palette::{Look, Role};

/// Writes into one rectangle; what would lie outside is left out, so that no layout, however
/// small its terminal, can write into a neighbour or beyond the screen.
pub struct Pen<'a> {
    buffer: &'a mut Buffer,
    area: Rect,
    /// How things look here.
    pub look: Look,
}

impl<'a> Pen<'a> {
    /// A pen for `area`.
    pub fn new(buffer: &'a mut Buffer, area: Rect, look: Look) -> Self {
        let area = area.intersection(buffer.area);
        Self { buffer, area, look }
    }

    /// A pen for `width` × `height` cells from (`x`, `y`) of this one's rectangle.
    pub fn part(&mut self, x: u16, y: u16, width: u16, height: u16) -> Pen<'_> {
        let area = Rect {
            x: self.area.x.saturating_add(x),
            y: self.area.y.saturating_add(y),
            width,
            height,
        };
        Pen { area: area.intersection(self.area), buffer: self.buffer, look: self.look }
    }

    /// The rectangle on the screen.
    #[must_use]
    pub const fn area(&self) -> Rect {
        self.area
    }

    /// The rectangle's width.
    #[must_use]
    pub const fn width(&self) -> u16 {
        self.area.width
    }

    /// The rectangle's height.
    #[must_use]
    pub const fn height(&self) -> u16 {
        self.area.height
    }

    /// The whole screen, for widgets that draw themselves.
    pub const fn buffer(&mut self) -> &mut Buffer {
        self.buffer
    }

    /// The style of `role`.
    #[must_use]
    pub const fn style(&self, role: Role) -> Style {
        self.look.palette.style(role)
    }

    /// Writes `text` from (`x`, `y`) on; returns the column after it.
    pub fn text(&mut self, x: u16, y: u16, text: &str, role: Role) -> u16 {
        if x >= self.area.width || y >= self.area.height {
            return x;
        }
        let (left, top) = (self.area.x + x, self.area.y + y);
        let room = usize::from(self.area.width - x);
        let (end, _) = self.buffer.set_stringn(left, top, text, room, self.style(role));
        end - self.area.x
    }

    /// Writes `text` so that it ends before column `end`; returns where it begins.
    pub fn text_until(&mut self, end: u16, y: u16, text: &str, role: Role) -> u16 {
        let x = end.saturating_sub(columns(text));
        self.text(x, y, text, role);
        x
    }

    /// Writes `text` in the middle of row `y`.
    pub fn centred(&mut self, y: u16, text: &str, role: Role) {
        let x = self.area.width.saturating_sub(columns(text)) / 2;
        self.text(x, y, text, role);
    }

    /// Writes `glyph` `count` times; returns the column after it.
    pub fn repeat(&mut self, x: u16, y: u16, glyph: &str, count: u16, role: Role) -> u16 {
        self.text(x, y, &glyph.repeat(usize::from(count.min(self.area.width))), role)
    }

    /// A rule across row `y`.
    pub fn rule(&mut self, y: u16) {
        self.repeat(0, y, "─", self.area.width, Role::Dim);
    }

    /// Empties the rectangle.
    pub fn clear(&mut self) {
        for position in self.area.positions() {
            self.buffer[position].reset();
        }
    }

    /// An emptied box with a border and `title`; returns a pen for its inside, a column
    /// away from the border.
    pub fn boxed(&mut self, title: &str, role: Role) -> Pen<'_> {
        self.clear();
        let (width, height) = (self.area.width, self.area.height);
        let bar = "─".repeat(usize::from(width.saturating_sub(2)));
        self.text(0, 0, &format!("╭{bar}╮"), role);
        for y in 1..height.saturating_sub(1) {
            self.text(0, y, "│", role);
            self.text(width.saturating_sub(1), y, "│", role);
        }
        self.text(0, height.saturating_sub(1), &format!("╰{bar}╯"), role);
        if !title.is_empty() {
            self.text(2, 0, &format!(" {title} "), role);
        }
        self.part(2, 1, width.saturating_sub(4), height.saturating_sub(2))
    }
}

/// The columns that `text` takes.
#[must_use]
pub fn columns(text: &str) -> u16 {
    u16::try_from(ratatui::text::Line::raw(text).width()).unwrap_or(u16::MAX)
}
