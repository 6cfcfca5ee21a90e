//! `coadapt devices`: what is plugged in, on a screen, in sentences or as JSON.

mod words;

use std::collections::BTreeMap;
use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::process::ExitCode;

use serde::Serialize;

use super::curtain::shown_to;
use super::words::{document, read};
use super::{RunError, say};
use crate::backend::serial::ports;
use crate::cli;
use crate::clock::{Clock, WallClock};
use crate::host::{About, Host, Login, Problem};
use crate::operator::gamepad::hub::{Hub, NoPads};
use crate::operator::gamepad::inbox::Inbox;
use crate::operator::gamepad::rights::{self, Build};
use crate::operator::gamepad::{Event, Pads};
use crate::operator::terminal::Hands;
use crate::profile::{Document, Profile};
use crate::signal::Seconds;
use crate::tui::devices::{self, Bench, Devices, Survey, Terminal, gamepads};
use crate::tui::terminal::{Abilities, Feed, KeysFrom, Screen, probe, speaks_unicode};

/// Where profiles are saved.
const PROFILES: &str = "profiles";
/// How long pads may take to say that they are there, where nobody waits at a screen.
const SETTLING: Seconds = Seconds(0.3);
/// Of the JSON object.
const SCHEMA: u32 = 1;

/// `coadapt devices …`
pub(super) fn devices(words: &cli::Devices) -> Result<ExitCode, RunError> {
    let document = document(&words.profile, &words.set)?;
    let profile = read(&document)?;
    let clock = WallClock::start();
    let hub = Hub::open(clock, &profile.operator.gamepad.sdl_mappings);
    if !words.json && Screen::check(KeysFrom::Input).is_ok() {
        return on_screen(document, profile, &hub, clock);
    }
    let survey = look_once(&profile, &hub, clock);
    if words.json {
        say(&json(&survey)?)?;
    } else {
        say(&words::sentences(&survey).join("\n"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The survey as one JSON object.
fn json(survey: &Survey) -> Result<String, RunError> {
    #[derive(Serialize)]
    struct Object<'a> {
        schema: u32,
        #[serde(flatten)]
        survey: &'a Survey,
    }
    serde_json::to_string(&Object { schema: SCHEMA, survey })
        .map_err(|error| RunError::Failed(format!("the devices have no JSON: {error}")))
}

/// What is there now, for a program or a file.
fn look_once(profile: &Profile, hub: &Result<Hub, NoPads>, mut clock: WallClock) -> Survey {
    let mut pads = Pads::new(&profile.operator.gamepad);
    if let Ok(hub) = hub {
        let heard = hub.listen(clock.now());
        let settled = clock.now() + SETTLING;
        clock.wait_until(settled);
        while let Some((event, at)) = heard.next() {
            pads.take(event, at);
        }
    }
    let mut survey = Computer::here(hub).survey(pads.present().len());
    // Only a person's terminal is asked: a script in the background would be stopped, and a
    // dumb terminal would print the questions.
    let is_dumb = std::env::var("TERM").is_ok_and(|term| term == "dumb");
    let asked = if io::stdin().is_terminal() && !is_dumb { probe().ok() } else { None };
    add_terminal(&mut survey, asked);
    let nodes = &survey.gamepad_nodes;
    survey.gamepads = gamepads(&pads, &BTreeMap::new(), &profile.operator, nodes);
    survey
}

/// What the computer's files say.
struct Computer {
    host: Host,
    build: Build,
    /// Why no pad can be heard.
    no_pads: Option<String>,
}

impl Computer {
    /// This one, with what came of reaching for its pads.
    fn here<T>(hub: &Result<T, NoPads>) -> Self {
        let no_pads = hub.as_ref().err().map(|why| match why {
            NoPads::NotBuilt => why.to_string(),
            NoPads::System(cause) => format!("gamepads cannot be reached: {cause}"),
        });
        Self { host: Host::here(), build: Build::here(), no_pads }
    }

    /// Everything but the terminal, where the program hears so many pads.
    fn survey(&self, heard: usize) -> Survey {
        let host = &self.host;
        // Groups may be given while one looks.
        let login = Login::on(host);
        let gamepad_nodes = rights::nodes(host);
        let serial_ports = ports::ports(host, &ports::listed(host));
        let mut problems = rights::problems(host, &login, self.build, &gamepad_nodes, heard);
        if let Some(why) = self.no_pads.as_ref().filter(|_| problems.is_empty()) {
            problems.push(Problem::new(About::Gamepad, why, rights::WITHOUT_UDEV));
        }
        problems.extend(ports::problems(host, &login, &serial_ports));
        Survey { gamepad_nodes, serial_ports, problems, ..Survey::default() }
    }
}

/// Adds what the terminal `asked` said; without it, what the environment says.
fn add_terminal(survey: &mut Survey, asked: Option<Abilities>) {
    let get = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    survey.terminal = Terminal {
        asked: asked.is_some(),
        utf8: speaks_unicode(get),
        abilities: asked.unwrap_or_else(|| Abilities::of_environment(get)),
    };
    survey.problems.extend(survey.terminal.problems());
}

/// The screen's view of the computer.
struct Here<'a> {
    computer: Computer,
    heard: Option<Inbox>,
    is_over: &'a dyn Fn() -> bool,
}

impl Bench for Here<'_> {
    fn survey(&mut self, heard: usize) -> Survey {
        let mut survey = self.computer.survey(heard);
        add_terminal(&mut survey, Abilities::known());
        survey
    }

    fn events(&mut self) -> Vec<(Event, Seconds)> {
        let inbox = self.heard.as_ref();
        std::iter::from_fn(|| inbox?.next()).collect()
    }

    fn is_told_to_end(&self) -> bool {
        (self.is_over)()
    }
}

/// Shows the devices until the person leaves.
fn on_screen(
    document: Document,
    profile: Profile,
    hub: &Result<Hub, NoPads>,
    clock: WallClock,
) -> Result<ExitCode, RunError> {
    let feed = Feed::new(Hands::new(&profile.operator.keyboard), clock);
    let mut devices = Devices::new(document, profile, PathBuf::from(PROFILES));
    let computer = Computer::here(hub);
    if let Some(why) = &computer.no_pads {
        devices.hear_no_pads(why.as_str());
    }
    let heard = hub.as_ref().ok().map(|hub| hub.listen(clock.now()));
    shown_to(feed, |screen, is_over| {
        devices::show(screen, &mut Here { computer, heard, is_over }, devices)
    })
}
