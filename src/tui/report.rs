//! The report screen: the figures and tables of a report, a page each.

mod chart;
mod page;

use ratatui::Frame;
use ratatui::crossterm::event::KeyEvent;

use super::keys::{self, Action, Hand, Screen};
use super::palette::{Look, Role};
use super::pen::{Pen, columns};
use super::text::{cut, wrapped};
use super::{help, small};
use crate::report::figure::{Item, Report, Section, Table};
use crate::report::text;

pub use page::{Bench, show};

/// What is on a page.
#[derive(Clone, Debug)]
enum Leaf {
    /// Sentences.
    Words { title: String, lines: Vec<String> },
    /// A figure or a table.
    Item(Box<Item>),
}

/// A page.
#[derive(Clone, Debug)]
struct Page {
    /// The heading of the part that it belongs to,
    part: String,
    /// and its number.
    number: usize,
    leaf: Leaf,
}

/// What a key led to, for the caller to carry out.
#[derive(Clone, Debug, PartialEq)]
pub enum Reaction {
    /// Nothing more.
    Stay,
    /// Leave the screen.
    Quit,
    /// Leave it at once: Ctrl-C.
    Interrupt,
    /// Save this; then [`Pages::say`] what came of it.
    Save(Box<Item>),
}

/// The state of the screen.
#[derive(Clone, Debug)]
pub struct Pages {
    all: Vec<Page>,
    at: usize,
    /// Lines of a long page that are passed over.
    scrolled: usize,
    message: Option<String>,
    help_open: bool,
}

impl Pages {
    /// The pages of `report`.
    #[must_use]
    pub fn new(report: &Report) -> Self {
        let mut pages = Vec::new();
        let parts: Vec<String> =
            report.sections.iter().map(|section| format!("· {}", section.title)).collect();
        let mut lines = vec!["In this report:".to_owned()];
        lines.extend(parts);
        if !report.left_out.is_empty() {
            lines.extend([String::new(), "Left out:".to_owned()]);
            let left = report.left_out.iter();
            lines.extend(left.map(|left| format!("· {}: {}", left.path, left.why)));
        }
        let leaf = Leaf::Words { title: report.title.clone(), lines };
        pages.push(Page { part: "coadapt report".to_owned(), number: 0, leaf });
        for (number, section) in (1..).zip(&report.sections) {
            let Section { title, notes, items } = section;
            // A blank line between one and the next.
            let lines = notes.iter().flat_map(|note| [note.clone(), String::new()]).collect();
            let words = Leaf::Words { title: title.clone(), lines };
            let leaves = items.iter().map(|item| Leaf::Item(Box::new(item.clone())));
            pages.extend(std::iter::once(words).chain(leaves).map(|leaf| Page {
                part: title.clone(),
                number,
                leaf,
            }));
        }
        Self { all: pages, at: 0, scrolled: 0, message: None, help_open: false }
    }

    /// Does what `key` asks for.
    pub fn handle(&mut self, key: KeyEvent) -> Reaction {
        let Some(action) = keys::action(Screen::Report, key) else { return Reaction::Stay };
        self.message = None;
        if self.help_open && !matches!(action, Action::QuitNow) {
            self.help_open = false;
            return Reaction::Stay;
        }
        match action {
            Action::Next => self.turn_to(self.at + 1),
            Action::Previous => self.turn_to(self.at.saturating_sub(1)),
            Action::NextPart => self.turn_to_part(|number, here| number > here),
            Action::PreviousPart => self.turn_to_part_before(),
            Action::Down => self.scrolled += 1,
            Action::Up => self.scrolled = self.scrolled.saturating_sub(1),
            Action::Help => self.help_open = true,
            Action::Quit => return Reaction::Quit,
            Action::QuitNow => return Reaction::Interrupt,
            Action::Save => match self.all.get(self.at).map(|page| &page.leaf) {
                Some(Leaf::Item(item)) => return Reaction::Save(item.clone()),
                _ => self.say("nothing to save here: turn to a figure or a table"),
            },
            _ => {}
        }
        Reaction::Stay
    }

    fn turn_to(&mut self, page: usize) {
        self.at = page.min(self.all.len().saturating_sub(1));
        self.scrolled = 0;
    }

    fn here(&self) -> usize {
        self.all.get(self.at).map_or(0, |page| page.number)
    }

    fn turn_to_part(&mut self, fits: impl Fn(usize, usize) -> bool) {
        let here = self.here();
        if let Some(page) = self.all.iter().position(|page| fits(page.number, here)) {
            self.turn_to(page);
        }
    }

    /// To the first page of this part, or from there to that of the part before.
    fn turn_to_part_before(&mut self) {
        let first = |number: usize| self.all.iter().position(|page| page.number == number);
        let here = self.here();
        let target = match first(here) {
            Some(page) if page < self.at => Some(page),
            _ => first(here.saturating_sub(1)),
        };
        self.turn_to(target.unwrap_or(0));
    }

    /// Shows `message` until the next key.
    pub fn say(&mut self, message: impl Into<String>) {
        self.message = Some(message.into());
    }
}

/// Draws the page that is open.
pub fn draw(frame: &mut Frame<'_>, pages: &mut Pages, look: Look) {
    let area = frame.area();
    let mut pen = Pen::new(frame.buffer_mut(), area, look);
    if small::is_too_small(&pen) {
        small::draw(&mut pen, None);
    } else {
        draw_page(&mut pen, pages);
    }
    look.finish(frame.buffer_mut());
}

fn draw_page(pen: &mut Pen<'_>, pages: &mut Pages) {
    let (width, height) = (pen.width(), pen.height());
    let Some(page) = pages.all.get(pages.at) else { return };
    let place = format!("page {} of {}", pages.at + 1, pages.all.len());
    let room = usize::from(width.saturating_sub(columns(&place) + 4));
    pen.text(1, 0, &cut(&page.part, room), Role::Strong);
    pen.text_until(width - 1, 0, &place, Role::Dim);
    pen.rule(1);
    {
        let mut inside = pen.part(1, 2, width - 2, height - 4);
        match &page.leaf {
            Leaf::Words { title, lines } => {
                let width = usize::from(inside.width());
                let lines = lines.iter().flat_map(|line| wrapped(line, width));
                let lines: Vec<String> =
                    [title.clone(), String::new()].into_iter().chain(lines).collect();
                pages.scrolled = scroll(&mut inside, &lines, pages.scrolled);
            }
            Leaf::Item(item) => match &**item {
                Item::Figure(figure) => chart::draw(&mut inside, figure),
                Item::Table(table) => {
                    let lines = table_lines(item, table, usize::from(inside.width()));
                    pages.scrolled = scroll(&mut inside, &lines, pages.scrolled);
                }
            },
        }
    }
    match &pages.message {
        Some(message) => {
            let message = cut(message, usize::from(width - 2));
            pen.text(1, height - 1, &message, Role::Strong);
        }
        None => help::hints(pen, height - 1, Screen::Report, Hand::Nobody),
    }
    if pages.help_open {
        help::draw(pen, Screen::Report, Hand::Nobody, &[]);
    }
}

/// Writes `lines` from the `scrolled`-th on, the first as a heading; returns how far they are
/// scrolled: never beyond the last.
fn scroll(pen: &mut Pen<'_>, lines: &[String], scrolled: usize) -> usize {
    let room = usize::from(pen.height());
    let scrolled = scrolled.min(lines.len().saturating_sub(room));
    for (y, line) in (0..pen.height()).zip(lines.iter().skip(scrolled)) {
        let is_heading = y == 0 && scrolled == 0;
        pen.text(0, y, line, if is_heading { Role::Strong } else { Role::Text });
    }
    let below = lines.len().saturating_sub(scrolled + room);
    if below > 0 {
        let more = format!(" {below} more lines below ");
        pen.text_until(pen.width(), pen.height() - 1, &more, Role::Dim);
    }
    scrolled
}

/// A table, or where it is too wide for that a few lines for each row.
fn table_lines(item: &Item, table: &Table, width: usize) -> Vec<String> {
    let caption = item.caption();
    let mut lines = vec![heading(caption)];
    lines.push(caption.preset.clone());
    lines.extend(wrapped(&caption.sentence, width));
    lines.push(String::new());
    let flat: Vec<String> = text::columns(table)
        .into_iter()
        .map(|line| line.trim_start_matches("  ").to_owned())
        .collect();
    if flat.iter().all(|line| line.chars().count() <= width) {
        lines.extend(flat);
        return lines;
    }
    let widest = table.columns.iter().map(|column| column.chars().count()).max().unwrap_or(0);
    for row in &table.rows {
        let mut cells = table.columns.iter().zip(row);
        if let Some((_, name)) = cells.next() {
            lines.push(name.clone());
        }
        lines.extend(cells.map(|(column, cell)| format!("  {column:widest$}  {cell}")));
    }
    lines
}

/// Title, and what it is in the thesis.
fn heading(caption: &crate::report::figure::Caption) -> String {
    if caption.thesis.is_empty() {
        caption.title.clone()
    } else {
        format!("{} ({})", caption.title, caption.thesis)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figure::{Axis, Caption, Content, Figure, LeftOut, Mark, Role, Series};
    use ratatui::backend::TestBackend;
    use ratatui::crossterm::event::{KeyCode, KeyModifiers};

    fn caption(name: &str, thesis: &str) -> Caption {
        Caption {
            name: name.to_owned(),
            thesis: thesis.to_owned(),
            title: "Balance time of each group".to_owned(),
            preset: "balance · thesis".to_owned(),
            sentence: "The mean balance time over the subjects of each group.".to_owned(),
        }
    }

    fn report() -> Report {
        let points =
            |slope: f64| (0..=100).map(move |x| (f64::from(x), 1.0 + slope * f64::from(x)));
        let figure = Figure {
            caption: caption("figure", "figure 31"),
            x: Axis::new("rollout", ""),
            y: Axis::new("balance time", "s"),
            content: Content::Series(vec![
                Series::new("sequential", Role::Sequential, Mark::Dashed, points(0.01).collect()),
                Series::new("simultaneous", Role::Simultaneous, Mark::Line, points(0.02).collect()),
            ]),
        };
        let table = Table {
            caption: caption("table", ""),
            columns: ["subject", "mode", "robot alone (s)"].map(str::to_owned).to_vec(),
            rows: vec![["S01", "sequential", "1.37"].map(str::to_owned).to_vec()],
        };
        let section = |title: &str, items| Section {
            title: title.to_owned(),
            notes: vec!["4 subjects in each mode.".to_owned()],
            items,
        };
        Report {
            title: "Report of 8 sessions".to_owned(),
            sections: vec![
                section("Group: balance · thesis", vec![Item::Table(table), Item::Figure(figure)]),
                section("S01 001", vec![]),
            ],
            comparisons: vec![],
            left_out: vec![LeftOut { path: "logs/x".to_owned(), why: "it is empty".to_owned() }],
        }
    }

    fn press(pages: &mut Pages, key: KeyCode) -> Reaction {
        pages.handle(KeyEvent::new(key, KeyModifiers::NONE))
    }

    fn shown(pages: &mut Pages, width: u16, height: u16) -> TestBackend {
        let mut terminal = ratatui::Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(frame, pages, Look::default())).unwrap();
        terminal.backend().clone()
    }

    #[test]
    fn the_first_page_tells_what_is_there_and_what_is_not() {
        let mut pages = Pages::new(&report());
        insta::assert_snapshot!(shown(&mut pages, 80, 24));
    }

    #[test]
    fn a_figure_is_a_chart_with_its_legend_and_sentence() {
        let mut pages = Pages::new(&report());
        for _ in 0..3 {
            press(&mut pages, KeyCode::Right);
        }
        insta::assert_snapshot!("figure_80", shown(&mut pages, 80, 24));
        insta::assert_snapshot!("figure_120", shown(&mut pages, 120, 40));
    }

    /// Four subjects' lines, which colours alone would tell apart, and means with their spread.
    #[test]
    fn subjects_have_signs_and_means_their_spread() {
        let subject = |at: usize| {
            let mark = [Mark::Line, Mark::Dashed, Mark::Dotted][at % 3];
            let height = 5.0 * crate::report::figure::real(at);
            let points = (0..=100).map(|x| (f64::from(x), height + 0.3 * f64::from(x)));
            Series::new(format!("S{at}"), Role::One(at), mark, points.collect())
        };
        let mut means =
            Series::new("mean ± sd", Role::Plain, Mark::Shape(0), vec![(50.0, 40.0), (75.0, 20.0)]);
        means.spread = Some(vec![(35.0, 45.0), (10.0, 30.0)]);
        let mut report = report();
        report.sections[0].items = vec![Item::Figure(Figure {
            caption: caption("figure", "figure 33"),
            x: Axis::whole("rollout"),
            y: Axis::new("success", "%"),
            content: Content::Series((0..4).map(subject).chain([means]).collect()),
        })];
        let mut pages = Pages::new(&report);
        pages.turn_to(2);
        insta::assert_snapshot!("subjects_80", shown(&mut pages, 80, 24));
    }

    #[test]
    fn keys_turn_pages_and_save_what_is_there() {
        let mut pages = Pages::new(&report());
        assert_eq!(press(&mut pages, KeyCode::Char('s')), Reaction::Stay);
        press(&mut pages, KeyCode::Left);
        assert_eq!(pages.at, 0);
        press(&mut pages, KeyCode::Right);
        press(&mut pages, KeyCode::Right);
        let Reaction::Save(item) = press(&mut pages, KeyCode::Char('s')) else { panic!() };
        assert_eq!(item.data_file(), "table.csv");
        press(&mut pages, KeyCode::Char('n'));
        assert_eq!((pages.at, pages.here()), (4, 2));
        press(&mut pages, KeyCode::Right);
        assert_eq!(pages.at, 4, "the last page");
        press(&mut pages, KeyCode::Char('p'));
        assert_eq!(pages.at, 1);
        press(&mut pages, KeyCode::Char('?'));
        assert_eq!(press(&mut pages, KeyCode::Char('q')), Reaction::Stay, "closes the help");
        assert_eq!(press(&mut pages, KeyCode::Char('q')), Reaction::Quit);
        let ctrl_c = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        assert_eq!(pages.handle(ctrl_c), Reaction::Interrupt);
    }

    #[test]
    fn a_long_message_is_cut() {
        let mut pages = Pages::new(&report());
        pages.say(format!("saved {}.svg here", "long-".repeat(40)));
        assert!(shown(&mut pages, 80, 24).to_string().contains('…'));
    }

    #[test]
    fn any_size_is_drawn() {
        let mut pages = Pages::new(&report());
        for (width, height) in [(1, 1), (20, 5), (80, 24), (300, 90)] {
            for _ in 0..6 {
                shown(&mut pages, width, height);
                press(&mut pages, KeyCode::Right);
            }
            pages.turn_to(0);
        }
    }
}
