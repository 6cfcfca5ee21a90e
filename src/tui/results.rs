//! The results of a session: charts with axes and units, and the files written.
//!
//! At 80×24 one page at a time; where there is room all of them at once.

mod charts;
mod measure;

pub use measure::Start;

use ratatui::Frame;

use super::keys::{Hand, Screen};
use super::palette::{Look, Role};
use super::pen::{Pen, columns};
use super::text::{cut, fixed, mean, real, wrapped};
use super::{help, live, small};
use crate::record::EpisodeRow;
use crate::report::achieved::{Yardstick, yardstick};
use crate::report::metrics::{self, RegionEnd};
use crate::session::Phase;
use crate::task::balance::Balance;

/// What a session came to.
#[derive(Clone, Debug)]
pub struct Info {
    /// Its title, such as "balance · simultaneous · rfwr · S07 trial 002".
    pub title: String,
    /// How it finished, a word.
    pub finish: String,
    /// Its rollouts.
    pub rollouts: Vec<EpisodeRow>,
    /// The folder of its files.
    pub folder: String,
    /// Its files, by name.
    pub files: Vec<String>,
    /// What else is to be said of it, a line each.
    pub summary: Vec<String>,
    /// What a person must see first.
    pub alarm: Option<&'static str>,
    /// The robot alone after each tenth of main: percent of main, mean of the measure.
    pub evaluation: Option<Vec<(u8, f64)>>,
    /// What rollouts are measured by.
    pub measure: Yardstick,
    /// How rollouts began; `None` where they all begin alike.
    pub start: Option<Start>,
    /// How main ended in each region, where there are several.
    pub regions: Vec<RegionEnd>,
}

impl Default for Info {
    fn default() -> Self {
        Self {
            title: String::new(),
            finish: String::new(),
            rollouts: Vec::new(),
            folder: String::new(),
            files: Vec::new(),
            summary: Vec::new(),
            alarm: None,
            evaluation: None,
            measure: yardstick(Balance::NAME),
            start: None,
            regions: Vec::new(),
        }
    }
}

impl Info {
    /// The rollouts of `phase` that count.
    fn of(&self, phase: Phase) -> impl Iterator<Item = &EpisodeRow> {
        metrics::rollouts_of(&self.rollouts, phase)
    }

    /// The measure of the rollouts of `phase` that count.
    fn measured(&self, phase: Phase) -> Vec<f64> {
        self.of(phase).filter_map(self.measure.of).collect()
    }

    /// The pages' titles.
    const fn pages(&self) -> [&'static str; PAGES] {
        [self.measure.word, "sharing", "robot alone", "files"]
    }
}

/// The state of the screen.
#[derive(Clone, Debug, Default)]
pub struct State {
    /// The page.
    page: usize,
    /// Whether the keys are shown.
    pub help_open: bool,
    /// A word to the person, in place of the line of keys.
    pub message: Option<String>,
    /// Glyphs and colours.
    pub look: Look,
}

/// A sentence of the summary begins here, after its phase.
const SENTENCE: u16 = 14;

/// How many pages there are.
const PAGES: usize = 4;

impl State {
    /// A screen that looks like `look`.
    #[must_use]
    pub fn new(look: Look) -> Self {
        Self { look, ..Self::default() }
    }

    /// Turns to the next page.
    pub const fn next(&mut self) {
        self.page = (self.page + 1) % PAGES;
    }

    /// Turns to the page before.
    pub const fn previous(&mut self) {
        self.page = (self.page + PAGES - 1) % PAGES;
    }
}

/// Draws the screen.
pub fn draw(frame: &mut Frame<'_>, info: &Info, state: &State) {
    let area = frame.area();
    let mut pen = Pen::new(frame.buffer_mut(), area, state.look);
    if small::is_too_small(&pen) {
        small::draw(&mut pen, None);
    } else {
        whole(&mut pen, info, state);
    }
    state.look.finish(frame.buffer_mut());
}

fn whole(pen: &mut Pen<'_>, info: &Info, state: &State) {
    let (width, height) = (pen.width(), pen.height());
    let x = pen.text(1, 0, "coadapt", Role::Dim);
    let finish = columns(&info.finish);
    let room = width.saturating_sub(x + finish + 6);
    pen.text(x + 3, 0, &cut(&info.title, room.into()), Role::Strong);
    pen.text_until(width - 1, 0, &info.finish, Role::Strong);
    let last = height - 1;
    let is_wide = width >= 120 && height >= 40;
    if let Some(alarm) = info.alarm {
        pen.text(1, if is_wide { 1 } else { 2 }, alarm, Role::Alarm);
    }
    if is_wide {
        let (half, upper) = (width / 2, (height - 3) / 2);
        for (page, (column, row)) in (0..).zip([(0, 0), (half, 0), (0, upper), (half, upper)]) {
            let mut part = pen.part(column, 2 + row, half - 1, upper);
            part.text(1, 0, info.pages()[page], Role::Strong);
            let (w, h) = (part.width(), part.height());
            draw_page(&mut part.part(0, 1, w, h - 2), info, page);
        }
    } else {
        let mut x = 1;
        for (page, title) in info.pages().iter().enumerate() {
            let is_here = page == state.page;
            let shown = if is_here { format!("[{title}]") } else { format!(" {title} ") };
            x = pen.text(x, 1, &shown, if is_here { Role::Strong } else { Role::Dim }) + 2;
        }
        draw_page(&mut pen.part(0, 3, width, height - 5), info, state.page);
    }
    match &state.message {
        Some(message) => {
            pen.text(1, last, message, Role::Alarm);
        }
        None => help::hints(pen, last, Screen::Results, Hand::Absent),
    }
    if state.help_open {
        help::draw(pen, Screen::Results, Hand::Absent, &[]);
    }
}

fn draw_page(pen: &mut Pen<'_>, info: &Info, page: usize) {
    let (width, height) = (pen.width(), pen.height());
    match page {
        0 => {
            let lines = statistics(info, &[Phase::Introduction, Phase::Main]);
            let chart = height.saturating_sub(u16::try_from(lines.len()).unwrap_or(0));
            charts::measured(&mut pen.part(0, 0, width, chart), info);
            write(&mut pen.part(0, chart, width, height - chart), &lines);
        }
        1 => {
            let lines = regions(info, width.saturating_sub(2));
            let chart = height.saturating_sub(u16::try_from(lines.len()).unwrap_or(0));
            charts::sharing(&mut pen.part(0, 0, width, chart), info);
            write(&mut pen.part(0, chart, width, height - chart), &lines);
        }
        2 => {
            let lines = statistics(info, &[Phase::Autonomous, Phase::ZeroControl]);
            let chart = height.saturating_sub(u16::try_from(lines.len()).unwrap_or(0));
            charts::alone(&mut pen.part(0, 0, width, chart), info);
            write(&mut pen.part(0, chart, width, height - chart), &lines);
        }
        _ => files(pen, info),
    }
}

/// A line for each of `phases` that took place: its measure.
fn statistics(info: &Info, phases: &[Phase]) -> Vec<String> {
    let (unit, decimals) = (info.measure.unit, info.measure.decimals);
    let line = |phase: &Phase| {
        let values = info.measured(*phase);
        let average = mean(&values)?;
        let squares = values.iter().map(|value| (value - average).powi(2)).sum::<f64>();
        let deviation = (squares / (real(values.len()) - 1.0)).sqrt();
        let line = format!(
            "{:<13}{:>4} {:<8}   mean {} {unit}   sd {} {unit}",
            live::phase_word(*phase),
            values.len(),
            if values.len() == 1 { "rollout" } else { "rollouts" },
            fixed(average, 6, decimals),
            fixed(deviation, 5, decimals),
        );
        Some(line.trim_end().to_owned())
    };
    phases.iter().filter_map(line).collect()
}

/// How main ended in each region, slow beside fast where `width` has room for both.
fn regions(info: &Info, width: u16) -> Vec<String> {
    let one = |region: &RegionEnd| {
        format!(
            "{:<12}share {} % success {} %",
            region.name.replace('_', " "),
            fixed(100.0 * region.share, 3, 0),
            fixed(100.0 * region.success, 3, 0)
        )
    };
    let pairs = info.regions.chunks(2).rev().map(|pair| pair.iter().map(one).collect::<Vec<_>>());
    let beside: Vec<String> = pairs.clone().map(|pair| pair.join("   ")).collect();
    if beside.iter().all(|line| columns(line) <= width) {
        beside
    } else {
        pairs.flatten().collect()
    }
}

fn write(pen: &mut Pen<'_>, lines: &[String]) {
    for (line, y) in lines.iter().zip(0..) {
        pen.text(1, y, line, Role::Text);
    }
}

/// A sentence of the summary in lines of at most `width`, the later ones moved in.
fn sentence(line: &str, width: usize) -> Vec<(String, Role)> {
    let line = line.replace(" -", " −");
    if line.chars().count() <= width {
        return vec![(line, Role::Text)];
    }
    // The phase's name and its blanks stay as they are.
    let (phase, words) = line.split_at(line.find("  ").unwrap_or(0));
    let lines = wrapped(words, width.saturating_sub(SENTENCE.into()));
    let begins = std::iter::once(phase).chain(std::iter::repeat(""));
    begins
        .zip(lines)
        .map(|(begin, words)| {
            (format!("{begin:<width$}{words}", width = SENTENCE.into()), Role::Text)
        })
        .collect()
}

/// Summary and files, as many as there is room for.
fn files(pen: &mut Pen<'_>, info: &Info) {
    let width = usize::from(pen.width().saturating_sub(2));
    let mut lines: Vec<(String, Role)> =
        info.summary.iter().flat_map(|line| sentence(line, width)).collect();
    if !lines.is_empty() {
        lines.push((String::new(), Role::Text));
    }
    if !info.folder.is_empty() {
        lines.push(("saved in".to_owned(), Role::Dim));
        lines.push((cut(&info.folder, width), Role::Strong));
    }
    // Names in columns: policies alone are eleven.
    let longest = info.files.iter().map(|name| name.chars().count()).max().unwrap_or(0) + 2;
    let across = (width / longest.max(1)).max(1);
    for row in info.files.chunks(across) {
        let row = row.iter().fold(String::new(), |row, name| row + &format!("{name:<longest$}"));
        lines.push((cut(row.trim_end(), width), Role::Text));
    }
    let height = usize::from(pen.height());
    if lines.len() > height {
        let left_out = lines.len() - height + 1;
        lines.truncate(height.saturating_sub(1));
        lines.push((format!("… {left_out} lines more"), Role::Dim));
    }
    for ((line, role), y) in lines.iter().zip(0..) {
        pen.text(1, y, line, *role);
    }
}
