//! The picture of the set-up screen: every field in its fixed place.

use ratatui::Frame;

use super::edit::{pole_length, word};
use super::lines::{Light, Signs, choice, command, input, note, push, slider, tick, value, window};
use super::prompt::Prompt;
use super::{Field, Setup, Shelf};
use crate::operator::Choice;
use crate::profile::{Experiment, WantedMode};
use crate::session::plan::Wanted;
use crate::tui::keys::{Hand, Screen};
use crate::tui::palette::{Look, Role};
use crate::tui::pen::Pen;
use crate::tui::scene::{self, Scene};
use crate::tui::sensitivity;
use crate::tui::text::{cut, fixed, signed, wrapped};
use crate::tui::{help, small};

/// What the screen shows beside the form.
#[derive(Clone, Copy, Debug)]
pub struct Extras<'a> {
    /// How things look on this terminal.
    pub look: Look,
    /// How key releases are known, such as `reported by the terminal`.
    pub key_releases: &'a str,
    /// How finely the pointer is known, in words; empty before it is read.
    pub pointer: &'a str,
    /// The push of the hands, −1 to 1, while they are tried.
    pub hands: Option<f64>,
    /// The time of the moving picture, s.
    pub time_s: f64,
}

/// The columns of labels, values and explanations.
const LABEL: u16 = 3;
const VALUE: u16 = 15;
const ABOUT: u16 = 35;
/// The last column but one of the form, whatever the terminal's width.
const FORM: u16 = 79;
/// Beside the small picture.
const BESIDE: u16 = 51;
/// The columns of main and autonomous in the row of phases.
const MAIN: u16 = 39;
const AUTONOMOUS: u16 = 57;

/// Draws the screen.
pub fn draw(frame: &mut Frame<'_>, setup: &Setup, shelf: &Shelf, extras: &Extras<'_>) {
    let area = frame.area();
    let mut pen = Pen::new(frame.buffer_mut(), area, extras.look);
    if small::is_too_small(&pen) {
        small::draw(&mut pen, None);
    } else {
        let height = pen.height();
        View { setup, shelf, extras, fault: setup.fault() }.draw(&mut pen, height);
    }
    extras.look.finish(frame.buffer_mut());
}

struct View<'a> {
    setup: &'a Setup,
    shelf: &'a Shelf,
    extras: &'a Extras<'a>,
    fault: Option<(Field, String)>,
}

impl View<'_> {
    fn draw(&self, pen: &mut Pen<'_>, height: u16) {
        pen.text(1, 0, "coadapt", Role::Strong);
        pen.text_until(
            pen.width() - 1,
            0,
            "the terminal laboratory for simultaneous human–robot learning",
            Role::Dim,
        );
        self.tabs(pen);
        self.what(pen);
        self.phases(pen, 7);
        self.who(pen);
        self.how(pen);
        self.picture(pen, height);
        self.below(pen, height);
        help::hints(pen, height - 1, Screen::Setup, Hand::Absent);
    }

    /// How the value of `field` is shown.
    fn light(&self, field: Field) -> Light {
        let setup = self.setup;
        match setup.focus == field && setup.prompt.is_none() && !setup.trying_hands {
            false => Light::Off,
            true if setup.typing => Light::Typing,
            true => Light::On,
        }
    }

    /// The label of a row, marked where one of its `fields` has the focus or a fault.
    fn label(&self, pen: &mut Pen<'_>, y: u16, text: &str, fields: &[Field]) {
        let signs = Signs::of(pen.look.glyphs);
        let is_here = fields.contains(&self.setup.focus);
        if is_here {
            pen.text(1, y, signs.here, Role::Strong);
        }
        if self.fault.as_ref().is_some_and(|(field, _)| fields.contains(field)) {
            pen.text(VALUE - 2, y, signs.fault, Role::Wait);
        }
        pen.text(LABEL, y, text, if is_here { Role::Strong } else { Role::Dim });
    }

    /// A text that is typed, and returns the column after it.
    fn typed(&self, pen: &mut Pen<'_>, at: (u16, u16, u16), field: Field) -> u16 {
        let drafts = &self.setup.drafts;
        match drafts.text(field) {
            Some(text) => input(pen, at, text, self.light(field), drafts.fresh),
            None => at.0,
        }
    }

    /// The tasks, the chosen one underlined.
    fn tabs(&self, pen: &mut Pen<'_>) {
        let signs = Signs::of(pen.look.glyphs);
        let chosen = self.setup.profile.experiment.name();
        let mut x = LABEL;
        if self.setup.focus == Field::Task {
            pen.text(1, 2, signs.here, Role::Strong);
        }
        for task in Experiment::NAMES {
            let is_chosen = task == chosen;
            let light = if is_chosen { self.light(Field::Task) } else { Light::Off };
            let end = if is_chosen && light == Light::Off {
                pen.text(x, 2, &format!(" {task} "), Role::Strong)
            } else {
                value(pen, x, 2, &format!(" {task} "), light)
            };
            if is_chosen {
                pen.repeat(x, 3, signs.under, end - x, Role::Strong);
            }
            x = end + 3;
        }
    }

    /// Profile, mode and learner.
    fn what(&self, pen: &mut Pen<'_>) {
        let setup = self.setup;
        self.label(pen, 4, "profile", &[Field::Profile]);
        let name = cut(setup.document.name(), 15);
        choice(pen, VALUE, 4, &name, self.light(Field::Profile));
        let listed = self.shelf.profiles.iter().find(|listed| listed.name == setup.order.profile);
        let title = listed.map_or(setup.document.shown(), |listed| &listed.title);
        note(pen, ABOUT, 4, FORM, title, Role::Dim);

        self.label(pen, 5, "mode", &[Field::Mode]);
        let mode = setup.profile.mode;
        choice(pen, VALUE, 5, &word(&mode), self.light(Field::Mode));
        let about = match mode {
            WantedMode::Simultaneous => "the robot takes over as success rises",
            WantedMode::Sequential => "the robot only watches, then acts alone",
            WantedMode::Assigned => "one of the two, balanced over the subjects",
        };
        note(pen, ABOUT, 5, FORM, about, Role::Dim);

        self.label(pen, 6, "learner", &[Field::Learner]);
        let learner = &setup.profile.learner;
        choice(pen, VALUE, 6, &word(&learner.kind), self.light(Field::Learner));
        let fields =
            format!("at most {} fields; preset {}", learner.max_fields, setup.profile.preset);
        note(pen, ABOUT, 6, FORM, &fields, Role::Dim);
    }

    fn phases(&self, pen: &mut Pen<'_>, y: u16) {
        let fields = [Field::Introduction, Field::Main, Field::Autonomous];
        self.label(pen, y, "phases", &fields);
        let places = [VALUE, MAIN, AUTONOMOUS];
        for (((field, phase), x), on) in
            fields.into_iter().zip(Wanted::ALL).zip(places).zip(self.setup.drafts.phases)
        {
            let light = self.light(field);
            let box_light = if light == Light::Off { Light::Off } else { Light::On };
            let end = tick(pen, x, y, on, phase.word(), box_light);
            let width = if field == Field::Main { 8 } else { 7 };
            self.typed(pen, (end + 1, y, width), field);
        }
        let about = match self.setup.focus {
            Field::Introduction => {
                "practice, neither learned nor counted; space: with it or without"
            }
            Field::Main => "rollouts of teaching, or seconds when written as 420s; space: on, off",
            Field::Autonomous => "starts of the robot alone, then of nobody; space: on, off",
            _ => return,
        };
        note(pen, VALUE, y + 1, FORM, about, Role::Dim);
    }

    /// Subject, trial and operator.
    fn who(&self, pen: &mut Pen<'_>) {
        let setup = self.setup;
        self.label(pen, 9, "subject", &[Field::Subject]);
        self.typed(pen, (VALUE, 9, 18), Field::Subject);
        match &self.fault {
            Some((Field::Subject, message)) => {
                let short = message.split_once(';').map_or(message.as_str(), |(short, _)| short);
                note(pen, ABOUT, 9, FORM, short, Role::Wait);
            }
            _ => note(pen, ABOUT, 9, FORM, "names the folder; no full names", Role::Dim),
        }

        self.label(pen, 10, "trial", &[Field::Trial]);
        let is_open = setup.drafts.value(Field::Trial).is_empty();
        if is_open && self.light(Field::Trial) == Light::Off {
            pen.text(VALUE, 10, &format!("{:03}", self.shelf.next_trial()), Role::Text);
        } else {
            self.typed(pen, (VALUE, 10, 10), Field::Trial);
        }
        note(pen, ABOUT, 10, FORM, &self.trials(), Role::Dim);

        self.label(
            pen,
            11,
            "operator",
            &[Field::Operator, Field::Skill, Field::Kind, Field::Script],
        );
        choice(pen, VALUE, 11, setup.operator_word(), self.light(Field::Operator));
        match setup.operator() {
            Choice::Keyboard => {
                let about = format!("key releases {}", self.extras.key_releases);
                note(pen, ABOUT, 11, FORM, &about, Role::Dim);
            }
            Choice::Gamepad(_) => {
                let about = "plug it in; coadapt devices shows and maps it";
                note(pen, ABOUT, 11, FORM, about, Role::Dim);
            }
            Choice::Mouse => {
                let about = setup.profile.operator.mouse.steer.words();
                note(pen, ABOUT, 11, FORM, about, Role::Dim);
            }
            Choice::Simulated(skill, kind) => {
                choice(pen, ABOUT, 11, skill.word(), self.light(Field::Skill));
                choice(pen, BESIDE, 11, kind.word(), self.light(Field::Kind));
            }
            Choice::Script(_) => {
                let is_empty = setup.drafts.value(Field::Script).is_empty();
                if is_empty && self.light(Field::Script) == Light::Off {
                    pen.text(ABOUT, 11, "a table of times and values: its file", Role::Dim);
                } else {
                    self.typed(pen, (ABOUT, 11, FORM - ABOUT), Field::Script);
                }
            }
            Choice::QLearning => {
                note(pen, ABOUT, 11, FORM, "an agent that learns to drive", Role::Dim);
            }
            Choice::None => note(pen, ABOUT, 11, FORM, "nobody steers: always 0", Role::Dim),
        }
    }

    /// What to know about the trial's number.
    fn trials(&self) -> String {
        let taken = &self.shelf.trials;
        let list = match taken.as_slice() {
            [] => "none so far".to_owned(),
            [only] => format!("{only:03} exists"),
            [first, second] => format!("{first:03} and {second:03} exist"),
            [first, .., last] => format!("{first:03} to {last:03}: {} exist", taken.len()),
        };
        match self.setup.order.trial {
            None if self.light(Field::Trial) == Light::Off => {
                format!("the next free one; {list}")
            }
            None => format!("{:03}, the next free one; {list}", self.shelf.next_trial()),
            Some(trial) if taken.contains(&trial) => {
                format!("{trial:03} is taken: the next free one after it")
            }
            Some(_) => format!("instead of {:03}; {list}", self.shelf.next_trial()),
        }
    }

    /// Sensitivity, pole, screen, policy and seed.
    fn how(&self, pen: &mut Pen<'_>) {
        let setup = self.setup;
        self.label(pen, 12, "sensitivity", &[Field::Sensitivity]);
        let sensitivity = setup.sensitivity();
        slider(
            pen,
            (VALUE, 12, 27),
            sensitivity::part(sensitivity),
            self.light(Field::Sensitivity),
        );
        pen.text(43, 12, &fixed(sensitivity, 5, 2), Role::Text);

        if pole_length(&setup.profile).is_some() {
            self.label(pen, 13, "pole", &[Field::Pole]);
            let end = self.typed(pen, (VALUE, 13, 12), Field::Pole);
            pen.text(end + 1, 13, "m", Role::Dim);
            note(pen, ABOUT, 13, BESIDE, &format!("{} m", setup.pole_range), Role::Dim);
        }

        self.label(pen, 14, "show", &[Field::Progress, Field::SubjectView]);
        let screen = &setup.profile.screen;
        tick(pen, VALUE, 14, screen.show_progress, "progress", self.light(Field::Progress));
        let light = self.light(Field::SubjectView);
        tick(pen, 31, 14, screen.subject_view, "subject view only", light);

        self.label(pen, 15, "policy", &[Field::Policy]);
        if setup.is_autonomous_alone() {
            self.typed(pen, (VALUE, 15, BESIDE - VALUE - 1), Field::Policy);
        } else {
            pen.text(VALUE, 15, "main's; choose for autonomous alone", Role::Dim);
        }

        self.label(pen, 16, "seed", &[Field::Seed]);
        let is_open = setup.drafts.value(Field::Seed).is_empty();
        if is_open && self.light(Field::Seed) == Light::Off {
            pen.text(VALUE, 16, "drawn, and kept with the session", Role::Dim);
        } else {
            self.typed(pen, (VALUE, 16, 22), Field::Seed);
        }
    }

    /// The plant at its chosen measures, gently moving; where there is room all tasks', the
    /// chosen one in a frame.
    fn picture(&self, pen: &mut Pen<'_>, height: u16) {
        const ROOMY: u16 = 112;
        let chosen = &self.setup.profile.experiment;
        if pen.width() < ROOMY {
            // A gap keeps it apart from the words at its left.
            let mut part = pen.part(BESIDE + 2, 12, pen.width() - BESIDE - 4, 6);
            self.moving(&mut part, chosen);
            return;
        }
        let all = Experiment::all();
        let count = u16::try_from(all.len()).unwrap_or(1);
        let (x, width, each) = (FORM + 2, pen.width() - FORM - 3, (height - 10).min(32) / count);
        for (one, row) in all.iter().zip(0..) {
            let is_chosen = one.name() == chosen.name();
            let mut part = pen.part(x, 2 + row * each, width, each);
            if is_chosen {
                self.moving(&mut part.boxed(one.name(), Role::Strong), chosen);
            } else {
                part.text(2, 0, one.name(), Role::Dim);
                let (width, height) = (part.width(), part.height());
                self.moving(&mut part.part(1, 1, width - 2, height - 2), one);
            }
        }
    }

    fn moving(&self, pen: &mut Pen<'_>, experiment: &Experiment) {
        let state = scene::preview(experiment, self.extras.time_s);
        Scene::of(experiment).draw(pen, &state, scene::Light::Go);
    }

    /// Below the form: changes, what is asked or wrong, and the equal command.
    fn below(&self, pen: &mut Pen<'_>, height: u16) {
        let lines = command(&self.setup.order.command_line(), usize::from(pen.width() - VALUE - 1));
        let bottom = height - 1;
        let room = 2 + (height - small::LEAST_HEIGHT) / 4;
        let count = u16::try_from(lines.len()).unwrap_or(u16::MAX);
        let y = bottom - count.clamp(2, room) - 2;
        self.changes(pen, y - 1);
        let is_quiet = !self.asks(pen, y);
        // Where nothing else is said, the command has one row more.
        let rows = count.clamp(2, room + u16::from(is_quiet));
        let command_top = bottom - rows;
        let rows = usize::from(rows);
        let shown = window(lines.len(), rows, self.extras.time_s);
        pen.text(LABEL, command_top, "equal to", Role::Dim);
        if lines.len() > rows {
            let which = format!("{} to {}", shown.start + 1, shown.end);
            pen.text(LABEL, command_top + 1, &which, Role::Dim);
        }
        // While something is wrong, this is not yet what was typed.
        let role = if self.fault.is_some() { Role::Dim } else { Role::Text };
        let skipped = lines.iter().skip(shown.start).take(rows);
        for (line, y) in skipped.zip(command_top..) {
            pen.text(VALUE, y, line, role);
        }
    }

    /// What is asked, tried, wrong or to be resumed, in two rows from `y` on; returns
    /// whether it may need the second.
    fn asks(&self, pen: &mut Pen<'_>, y: u16) -> bool {
        if let Some(prompt) = &self.setup.prompt {
            self.prompt(pen, y, prompt);
        } else if self.setup.trying_hands {
            self.hands(pen, y);
        } else if let Some((message, role)) = self.message() {
            say(pen, y, &message, role);
        } else {
            self.unfinished(pen, y);
            return false;
        }
        true
    }

    /// The profile and what was changed in it.
    fn changes(&self, pen: &mut Pen<'_>, y: u16) {
        let document = &self.setup.document;
        let changed = document.changed();
        // Their sections stand in the command below.
        let names: Vec<&str> =
            changed.iter().map(|key| key.rsplit('.').next().unwrap_or(key)).collect();
        let shown = document.shown();
        let words = match names.len() {
            0 => format!("{shown}, as it is"),
            count => format!("{shown}, {count} changed: {}", names.join(", ")),
        };
        pen.text(LABEL, y, "changes", Role::Dim);
        note(pen, VALUE, y, pen.width() - 1, &words, Role::Text);
    }

    /// What a person should read now.
    fn message(&self) -> Option<(String, Role)> {
        let setup = self.setup;
        match (&self.fault, &setup.message) {
            (Some((_, fault)), _) if setup.refused => {
                Some((format!("not begun: {fault}"), Role::Alarm))
            }
            (_, Some(message)) => Some((message.clone(), Role::Strong)),
            (Some((_, fault)), None) => Some((fault.clone(), Role::Wait)),
            (None, None) => None,
        }
    }

    fn prompt(&self, pen: &mut Pen<'_>, y: u16, prompt: &Prompt) {
        let (question, about, text) = match prompt {
            Prompt::Open(text) => {
                ("open profile", "a name or a path   Enter opens   Esc back", Some(text))
            }
            Prompt::Save(text) => {
                ("save as", "a name for the profile   Enter saves   Esc back", Some(text))
            }
            Prompt::Overwrite(path) => {
                let question = format!("{} exists.", path.display());
                let end = pen.text(LABEL, y, &cut(&question, 60), Role::Strong);
                pen.text(end + 1, y, "Replace it?", Role::Strong);
                pen.text(LABEL, y + 1, "Enter replaces   Esc keeps it", Role::Dim);
                return;
            }
        };
        let x = pen.text(LABEL, y, question, Role::Strong) + 2;
        if let Some(text) = text {
            let width = pen.width() - x - 2;
            input(pen, (x, y, width), text, Light::Typing, self.setup.drafts.fresh);
        }
        match &self.setup.message {
            Some(message) => note(pen, LABEL, y + 1, pen.width() - 1, message, Role::Wait),
            None => note(pen, LABEL, y + 1, pen.width() - 1, about, Role::Dim),
        }
    }

    /// The strip that shows the push of the hands.
    fn hands(&self, pen: &mut Pen<'_>, y: u16) {
        let now = self.extras.hands.unwrap_or(0.0);
        pen.text(LABEL, y, "your push", Role::Strong);
        pen.text(14, y, "left", Role::Dim);
        push(pen, (19, y, 18), now);
        pen.text(59, y, "right", Role::Dim);
        let percent = format!("{} %", signed(now * 100.0, 4, 0));
        pen.text(66, y, &percent, Role::You);
        let about = match (self.setup.operator(), self.extras.pointer) {
            (Choice::Mouse, "") => "move the mouse   Esc ends".to_owned(),
            (Choice::Mouse, pointer) => format!("move the mouse; {pointer}   Esc ends"),
            _ => format!("hold the arrows; releases {}   Esc ends", self.extras.key_releases),
        };
        note(pen, LABEL, y + 1, pen.width() - 1, &about, Role::Dim);
    }

    /// The session that can be resumed.
    fn unfinished(&self, pen: &mut Pen<'_>, y: u16) {
        let all = &self.shelf.unfinished;
        let Some(one) = all.get(self.setup.cut_off.min(all.len().saturating_sub(1))) else {
            return;
        };
        let of = one.of.map_or(String::new(), |of| format!("/{of}"));
        let (subject, trial) = (cut(one.subject.as_str(), 24), one.trial);
        let words = format!("{subject} trial {trial} was cut at {} {}{of}", one.phase, one.episode);
        if self.setup.focus == Field::Unfinished {
            pen.text(1, y, Signs::of(pen.look.glyphs).here, Role::Strong);
        }
        let end = value(pen, LABEL, y, &words, self.light(Field::Unfinished));
        let end = pen.text(end + 3, y, "r", Role::Strong);
        let end = pen.text(end + 1, y, "resume", Role::Dim);
        if all.len() > 1 {
            let which = format!("{} of {}", self.setup.cut_off + 1, all.len());
            pen.text(end + 3, y, &which, Role::Dim);
        }
    }
}

/// Writes `message` in two lines from `y` on.
fn say(pen: &mut Pen<'_>, y: u16, message: &str, role: Role) {
    let width = pen.width() - LABEL - 1;
    let lines = wrapped(message, usize::from(width));
    let (first, rest) = lines.split_first().map_or(("", &[][..]), |(f, r)| (f.as_str(), r));
    note(pen, LABEL, y, LABEL + width, first, role);
    if !rest.is_empty() {
        note(pen, LABEL, y + 1, LABEL + width, &rest.join(" "), role);
    }
}
