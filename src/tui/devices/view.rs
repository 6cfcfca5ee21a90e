//! The picture of the devices screen.

use std::iter::once;

use ratatui::Frame;

use super::{Devices, Gamepad, Page, Prompt, curve};
use crate::backend::serial::ports::Port;
use crate::host::Problem;
use crate::operator::Device;
use crate::operator::gamepad::Map;
use crate::operator::gamepad::learn::{Learner, Step};
use crate::tui::keys::{Hand, Screen};
use crate::tui::palette::{Look, Role};
use crate::tui::pen::{Pen, columns};
use crate::tui::setup::lines::{Light, Signs, input, note, push};
use crate::tui::text::{cut, signed, wrapped};
use crate::tui::{help, small};

/// What the screen shows beside its own state.
#[derive(Clone, Debug)]
pub struct Extras<'a> {
    /// How things look on this terminal.
    pub look: Look,
    /// How key releases are known, such as `reported by the terminal`.
    pub key_releases: &'a str,
    /// The keyboard's deflection, −1 to 1.
    pub push: f64,
    /// How the pointer is known, such as `pointer in cells (80 × 24)`, and the mouse's
    /// deflection, while it is read.
    pub pointer: Option<(String, f64)>,
}

/// The columns of labels and values.
const LABEL: u16 = 1;
const VALUE: u16 = 14;
/// Where a page begins.
const TOP: u16 = 5;
/// The width of a response curve.
const CURVE: u16 = 31;

/// Draws the screen.
pub fn draw(frame: &mut Frame<'_>, devices: &Devices, extras: &Extras<'_>) {
    let area = frame.area();
    let mut pen = Pen::new(frame.buffer_mut(), area, extras.look);
    if small::is_too_small(&pen) {
        small::draw(&mut pen, None);
    } else {
        View { devices, extras }.draw(&mut pen);
    }
    if devices.help_open {
        help::draw(&mut pen, Screen::Devices, Hand::Absent, &[]);
    }
    extras.look.finish(frame.buffer_mut());
}

struct View<'a> {
    devices: &'a Devices,
    extras: &'a Extras<'a>,
}

impl View<'_> {
    fn draw(&self, pen: &mut Pen<'_>) {
        let (width, height) = (pen.width(), pen.height());
        self.head(pen);
        self.tabs(pen);
        let below = self.below(width);
        let least = match self.devices.page {
            _ if self.devices.learner.is_some() => 10,
            // The curve and its words.
            Page::Hand(Device::Gamepad) if self.devices.heard() == 0 => 4,
            Page::Hand(_) => 12,
            Page::Serial | Page::Terminal => 6,
        };
        let room = height - TOP - 2 - least;
        let wanted = u16::try_from(below.len()).unwrap_or(u16::MAX).min(room);
        let top = height - 1 - wanted;
        {
            let mut page = pen.part(LABEL, TOP, width - 2 * LABEL, top - TOP - 1);
            self.page(&mut page);
        }
        self.bottom(pen, top, wanted, &below);
        help::hints(pen, height - 1, Screen::Devices, Hand::Nobody);
    }

    fn head(&self, pen: &mut Pen<'_>) {
        let end = pen.text(1, 0, "coadapt", Role::Strong);
        let shown = self.devices.document.shown();
        pen.text(end + 3, 0, &format!("devices, as {} maps them", cut(shown, 36)), Role::Text);
        let words = match self.devices.survey.problems.len() {
            _ if !self.devices.is_surveyed => "looking".to_owned(),
            0 => "nothing is in the way".to_owned(),
            1 => "1 problem".to_owned(),
            count => format!("{count} problems"),
        };
        pen.text_until(pen.width() - 1, 0, &words, Role::Dim);
    }

    /// The pages, the shown one underlined, those with problems marked.
    fn tabs(&self, pen: &mut Pen<'_>) {
        let signs = Signs::of(pen.look.glyphs);
        let mut x = LABEL;
        for page in Page::ALL {
            let is_shown = page == self.devices.page;
            let role = if is_shown { Role::Strong } else { Role::Dim };
            let mut end = pen.text(x, 2, page.word(), role);
            if is_shown {
                pen.repeat(x, 3, signs.under, end - x, Role::Strong);
            }
            if self.devices.survey.problems_of(page.about()).next().is_some() {
                end = pen.text(end + 1, 2, "!", Role::Wait);
            }
            x = end + 4;
        }
    }

    fn page(&self, pen: &mut Pen<'_>) {
        match self.devices.page {
            Page::Hand(Device::Gamepad) => self.gamepad(pen),
            Page::Hand(Device::Keyboard) => self.keyboard(pen),
            Page::Hand(Device::Mouse) => self.mouse(pen),
            Page::Serial => self.serial(pen),
            Page::Terminal => self.terminal(pen),
        }
    }

    /// The response curve of `device` at the right; returns the width that is left.
    fn curve(&self, pen: &mut Pen<'_>, device: Device, raw: Option<f64>) -> u16 {
        let left = pen.width() - CURVE;
        let height = pen.height().min(18);
        let shape = self.devices.profile.operator.shape(device);
        curve::draw(&mut pen.part(left, 0, CURVE, height), shape, raw);
        left - 2
    }

    /// Why no pad is heard, and the pads that the system has.
    fn no_gamepad(&self, pen: &mut Pen<'_>) {
        let why = self.devices.no_pads.as_deref();
        let why = why.unwrap_or("no gamepad is heard: plug one in");
        let nodes = &self.devices.survey.gamepad_nodes;
        let nodes = nodes
            .iter()
            .map(|node| format!("{}  {}, rights {}", node.name, node.path, node.rights.words()));
        let mut y = 0;
        for (words, role) in
            once((why.to_owned(), Role::Strong)).chain(nodes.map(|n| (n, Role::Text)))
        {
            for line in wrapped(&words, usize::from(pen.width())) {
                pen.text(0, y, &line, role);
                y += 1;
            }
        }
    }

    fn gamepad(&self, pen: &mut Pen<'_>) {
        let pads = self.devices.gamepads();
        let Some(pad) = pads.iter().find(|pad| pad.steers).or_else(|| pads.first()) else {
            let left = self.curve(pen, Device::Gamepad, None);
            self.no_gamepad(&mut pen.part(0, 0, left, pen.height()));
            return;
        };
        let raw = pad.steers.then_some(pad.steering.raw);
        let left = self.curve(pen, Device::Gamepad, raw);
        let mut pen = pen.part(0, 0, left, pen.height());
        let map = &self.devices.profile.operator.gamepad.map;
        about_pad(&mut pen, pad, map, pads.len() - 1);
        axes(&mut pen, pad);
    }

    fn keyboard(&self, pen: &mut Pen<'_>) {
        let left = self.curve(pen, Device::Keyboard, Some(self.extras.push));
        let mut pen = pen.part(0, 0, left, pen.height());
        pen.text(0, 0, "keyboard", Role::Strong);
        let releases = format!("key releases {}", self.extras.key_releases);
        for (line, y) in wrapped(&releases, usize::from(left)).iter().zip(1..3) {
            pen.text(0, y, line, Role::Dim);
        }
        pen.text(0, 3, "hold a or d (h or l) to try it", Role::Dim);
        push(&mut pen, (0, 5, 15), self.extras.push);
        pen.text(34, 5, &signed(self.extras.push, 5, 2), Role::You);
        let params = &self.devices.profile.operator.keyboard;
        let repeat = match params.repeat_hold_s {
            Some(hold_s) => format!("{hold_s} s"),
            None => "1.6 intervals".to_owned(),
        };
        rows(
            &mut pen,
            7,
            &[
                ("push", format!("{} of the limit", params.push)),
                ("rise, fall", format!("{} s, {} s", params.rise_s, params.fall_s)),
                ("a tap", format!("{} s, releases untold", params.tap_hold_s)),
                ("a repeat", format!("{repeat}, releases untold")),
            ],
        );
    }

    fn mouse(&self, pen: &mut Pen<'_>) {
        let (known, raw) = match &self.extras.pointer {
            Some((known, raw)) => (known.as_str(), Some(*raw)),
            None => ("not read yet", None),
        };
        let left = self.curve(pen, Device::Mouse, raw);
        let mut pen = pen.part(0, 0, left, pen.height());
        let params = &self.devices.profile.operator.mouse;
        let word = |value: &dyn std::fmt::Debug| format!("{value:?}").to_lowercase();
        pen.text(0, 0, "mouse", Role::Strong);
        note(&mut pen, 0, 1, left, known, Role::Dim);
        note(&mut pen, 0, 2, left, "move it to try it", Role::Dim);
        push(&mut pen, (0, 4, 15), raw.unwrap_or(0.0));
        pen.text(34, 4, &signed(raw.unwrap_or(0.0), 5, 2), Role::You);
        rows(
            &mut pen,
            6,
            &[
                ("steers by", format!("{}, {}", word(&params.steer), word(&params.along))),
                ("full at", format!("{} screens/s", params.full_speed_screens_s)),
                ("over", format!("{} s", params.window_s)),
                ("reach", format!("{}", params.reach)),
                ("spring", format!("{}, damper {}", params.spring, params.damper)),
            ],
        );
    }

    fn serial(&self, pen: &mut Pen<'_>) {
        let ports = &self.devices.survey.serial_ports;
        if ports.is_empty() {
            pen.text(0, 0, "no serial port: plug the plant in", Role::Strong);
        }
        let mut y = 0;
        for (port, at) in ports.iter().zip(1..) {
            let lines = port_lines(port);
            let needed = u16::try_from(lines.len()).unwrap_or(u16::MAX);
            if y + needed > pen.height() {
                let last = pen.height().saturating_sub(1);
                pen.text(0, last, &format!("and {} more", ports.len() - at + 1), Role::Dim);
                return;
            }
            for (line, row) in lines.iter().zip(y..) {
                let role = if row == y { Role::Strong } else { Role::Dim };
                note(pen, if row == y { 0 } else { 2 }, row, pen.width(), line, role);
            }
            y += needed + 1;
        }
    }

    fn terminal(&self, pen: &mut Pen<'_>) {
        let terminal = &self.devices.survey.terminal;
        let known = &terminal.abilities;
        if !terminal.asked {
            pen.text(0, 0, "the terminal is being asked what it can do", Role::Dim);
            return;
        }
        let yes = |holds: bool| if holds { "yes" } else { "no" };
        let size = known.size.map_or_else(|| "unknown".to_owned(), |(w, h)| format!("{w}×{h}"));
        let cell = known.cell_px.map_or_else(String::new, |(w, h)| format!(", a cell {w}×{h} px"));
        let inside = known.inside().unwrap_or("neither tmux nor screen");
        let program = known.program.as_deref().unwrap_or("");
        let term = known.term.as_deref().unwrap_or("not set");
        let colours = match known.colours {
            0..=256 => known.colours.to_string(),
            _ => "16 million".to_owned(),
        };
        let no_colour = if known.no_colour { ", but NO_COLOR is set" } else { "" };
        rows(
            pen,
            0,
            &[
                ("TERM", format!("{term}  {program}")),
                ("size", size + &cell),
                ("key releases", yes(known.key_releases).to_owned()),
                ("mouse pixels", yes(known.has_pixels()).to_owned()),
                ("colours", colours + no_colour),
                ("one frame", format!("{} (synchronised update)", yes(known.synchronised))),
                ("pointer", format!("its shape can be set: {}", yes(known.pointer_shape))),
                ("UTF-8", yes(terminal.utf8).to_owned()),
                ("inside", inside.to_owned()),
                ("over SSH", yes(known.ssh).to_owned()),
            ],
        );
    }

    /// What stands below the page: a question, or else the problems and what mends them.
    fn below(&self, width: u16) -> Vec<(String, Role)> {
        let width = usize::from(width - 2 * LABEL);
        if let Some(learner) = &self.devices.learner {
            return learning(learner, width);
        }
        let mut lines = Vec::new();
        for problem in self.devices.survey.problems_of(self.devices.page.about()) {
            lines.extend(told(problem, width));
        }
        if !lines.is_empty() {
            let copy = "to copy these lines: coadapt devices | cat".to_owned();
            lines.push((copy, Role::Dim));
        }
        lines
    }

    fn bottom(&self, pen: &mut Pen<'_>, top: u16, rows: u16, lines: &[(String, Role)]) {
        if self.prompt(pen) || rows == 0 {
            return;
        }
        pen.rule(top - 1);
        let hidden = lines.len().saturating_sub(usize::from(rows));
        let skipped = usize::from(self.devices.scrolled).min(hidden);
        for ((line, role), y) in lines.iter().skip(skipped).take(usize::from(rows)).zip(top..) {
            pen.text(LABEL, y, line, *role);
        }
        if hidden > 0 {
            let more = format!(
                " ↑↓ {} to {} of {} ",
                skipped + 1,
                lines.len() - hidden + skipped,
                lines.len()
            );
            pen.text_until(pen.width() - 1, top - 1, &more, Role::Strong);
        }
    }

    /// What is asked about saving, or was answered; returns whether something was.
    fn prompt(&self, pen: &mut Pen<'_>) -> bool {
        let (devices, width) = (self.devices, pen.width());
        let y = pen.height() - 4;
        if devices.prompt.is_none() && devices.message.is_none() {
            return false;
        }
        pen.part(0, y, width, 3).clear();
        pen.rule(y);
        let message = devices.message.as_deref();
        match &devices.prompt {
            Some(Prompt::Name { text, is_fresh }) => {
                let x = pen.text(LABEL, y + 1, "save as", Role::Strong) + 2;
                input(pen, (x, y + 1, width - x - 2), text, Light::Typing, *is_fresh);
                let about = "a name for the profile   Enter saves   Esc back";
                let role = if message.is_some() { Role::Wait } else { Role::Dim };
                note(pen, LABEL, y + 2, width, message.unwrap_or(about), role);
            }
            Some(Prompt::Overwrite(path)) => {
                let question = format!("{} exists. Replace it?", path.display());
                note(pen, LABEL, y + 1, width, &question, Role::Strong);
                pen.text(LABEL, y + 2, "Enter replaces   Esc keeps it", Role::Dim);
            }
            None => {
                let lines = wrapped(message.unwrap_or(""), usize::from(width - 2));
                for (line, row) in lines.iter().take(2).zip(y + 1..) {
                    pen.text(LABEL, row, line, Role::Strong);
                }
            }
        }
        true
    }
}

/// A pad's name, GUID, mapping, rights and map.
fn about_pad(pen: &mut Pen<'_>, pad: &Gamepad, map: &Map, others: usize) {
    let steers = if pad.steers { "steers" } else { "is not the wanted one" };
    let end = pen.text(0, 0, &cut(&pad.name, 30), Role::Strong);
    pen.text(end + 1, 0, steers, Role::You);
    let rights = match (&pad.node, pad.rights) {
        (Some(node), Some(rights)) => {
            let event = node.rsplit('/').next().unwrap_or(node);
            format!("{event}: {}", rights.words())
        }
        _ => "rights unknown".to_owned(),
    };
    note(pen, 0, 1, pen.width(), &format!("{}; {rights}", pad.mapping), Role::Dim);
    note(pen, 0, 2, pen.width(), &format!("GUID {}", pad.guid), Role::Dim);
    let (mut x, mut y) = (0, 3);
    for (purpose, button) in map.buttons() {
        let name = button.map_or_else(|| "none".to_owned(), |button| button.to_string());
        let is_held = pad.buttons.get(&name) == Some(&true);
        let shown = if is_held { format!("[{name}]") } else { name };
        if x + columns(purpose) + columns(&shown) + 1 > pen.width() {
            (x, y) = (0, y + 1);
        }
        let end = pen.text(x, y, purpose, Role::Dim);
        let role = if is_held { Role::Go } else { Role::Text };
        x = pen.text(end + 1, y, &shown, role) + 2;
    }
    let held: Vec<&str> =
        pad.buttons.iter().filter_map(|(name, is_held)| is_held.then_some(name.as_str())).collect();
    let held = if held.is_empty() { "no button".to_owned() } else { held.join(", ") };
    let more = match others {
        0 => String::new(),
        1 => "; 1 more pad waits".to_owned(),
        _ => format!("; {others} more pads wait"),
    };
    // Long names take a third row.
    note(pen, 0, (y + 1).max(5), pen.width(), &format!("held {held}{more}"), Role::Text);
}

/// Where the axes are, the one that steers first.
fn axes(pen: &mut Pen<'_>, pad: &Gamepad) {
    const FIRST: u16 = 7;
    let steer = &pad.steering.axis;
    let others = pad.axes.iter().filter(|(name, _)| *name != steer);
    let all: Vec<(&String, f64)> = std::iter::once((steer, pad.steering.raw))
        .chain(others.map(|(name, at)| (name, *at)))
        .collect();
    let rows = usize::from(pen.height().saturating_sub(FIRST));
    let shown = if all.len() > rows { rows.saturating_sub(1) } else { all.len() };
    for ((name, at), y) in all.iter().take(shown).zip(FIRST..) {
        let role = if *name == steer { Role::Strong } else { Role::Text };
        pen.text(0, y, &cut(name, 13), role);
        push(pen, (VALUE, y, 7), *at);
        let end = pen.text(VALUE + 18, y, &signed(*at, 5, 2), role);
        if *name == steer {
            pen.text(end + 1, y, "steers", Role::You);
        }
    }
    if shown < all.len() {
        let y = FIRST + u16::try_from(shown).unwrap_or(0);
        pen.text(0, y, &format!("and {} axes more", all.len() - shown), Role::Dim);
    }
}

/// Labels and values, a row each.
fn rows(pen: &mut Pen<'_>, top: u16, rows: &[(&str, String)]) {
    for ((label, value), y) in rows.iter().zip(top..) {
        pen.text(0, y, label, Role::Dim);
        note(pen, VALUE, y, pen.width(), value, Role::Text);
    }
}

/// A port in two or three lines.
fn port_lines(port: &Port) -> Vec<String> {
    let usb = port.usb.as_ref().map_or_else(String::new, |usb| {
        let names = [&usb.manufacturer, &usb.name].into_iter().flatten();
        let names: Vec<&str> = names.map(String::as_str).collect();
        let serial = usb.serial.as_ref().map_or_else(String::new, |no| format!(", serial {no}"));
        format!("  USB {:04x}:{:04x} {}{serial}", usb.vendor, usb.product, names.join(" "))
    });
    let by_id = port.by_id.as_ref().map(|name| format!("/dev/serial/by-id/{name}"));
    let group = port.group.as_deref().unwrap_or("?");
    let rights = format!("rights {}, group {group}", port.rights.words());
    let holder = port.holder.as_ref().map(|by| format!("open in {} ({})", by.name, by.pid));
    let latency = port.latency_ms.map(|latency_ms| format!("latency {latency_ms} ms"));
    let about: Vec<String> = [Some(rights), holder, latency].into_iter().flatten().collect();
    let lines = [Some(format!("{}{usb}", port.path)), by_id, Some(about.join(", "))];
    lines.into_iter().flatten().collect()
}

/// A problem and what mends it, in lines of at most `width`.
fn told(problem: &Problem, width: usize) -> Vec<(String, Role)> {
    let what = wrapped(&format!("! {}", problem.what), width);
    let mend = problem.mend.lines().flat_map(|line| wrapped(line, width.saturating_sub(4)));
    let mend = mend.map(|line| (format!("    {line}"), Role::Strong));
    what.into_iter().map(|line| (line, Role::Wait)).chain(mend).collect()
}

/// What is asked to learn a map, and what was learned.
fn learning(learner: &Learner, width: usize) -> Vec<(String, Role)> {
    let steps = 1 + learner.map().buttons().len();
    let step = match learner.step() {
        Step::Steer => format!("1 of {steps}: "),
        Step::Button(at) => format!("{} of {steps}: ", at + 2),
        Step::Done => String::new(),
    };
    let mut lines = vec![(step + &learner.question(), Role::Strong)];
    if let Some(remark) = learner.remark() {
        lines.extend(wrapped(remark, width).into_iter().map(|line| (line, Role::Wait)));
    }
    let right = if learner.invert() { "its right is negative" } else { "its right is positive" };
    let steer = format!("steer {}, {right}", learner.map().steer);
    let buttons = learner.map().buttons().map(|(purpose, button)| {
        format!("{purpose} {}", button.map_or_else(|| "none".to_owned(), |b| b.to_string()))
    });
    let map = wrapped(&format!("{steer}; {}", buttons.join(", ")), width);
    lines.extend(map.into_iter().map(|line| (line, Role::Text)));
    let keys = match learner.step() {
        Step::Done => "s saves it to a profile   m learns anew   q leaves without it",
        Step::Steer => "Esc keeps the axis   m stops learning",
        Step::Button(_) => "Esc keeps the button   Delete: none   m stops learning",
    };
    lines.push((keys.to_owned(), Role::Dim));
    lines
}
