//! Sessions on the screen: starts them, waits for them, and tells what happened after the
//! terminal was given back.

use std::panic::{self, AssertUnwindSafe};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::thread::JoinHandle;

use super::outcome::Finished;
use super::panics::tell_later;
use super::plant::Real;
use super::session::{Company, Keys, Session};
use super::shutdown::Shutdown;
use super::{RunError, curtain, exit_code, sentences, tell};

use crate::cli;
use crate::clock::WallClock;
use crate::operator::mouse::Pointer;
use crate::operator::terminal::{self, Hands};
use crate::operator::{Choice, Device, Via};
use crate::profile::{self, Document, Order, Profile, ProfileError};
use crate::record::{self, Sidecar, folder};
use crate::session::Phase;
use crate::session::plan::Plan;
use crate::sharing::{self, Mode};
use crate::task::Occasion;
use crate::task::balance::Balance;
use crate::tui::app::{self, Conductor, Running, Start};
use crate::tui::live::Info;
use crate::tui::results;
use crate::tui::scene::{self, Scene};
use crate::tui::setup::Shelf;
use crate::tui::terminal::{Feed, KeysFrom, Mouse, NoScreen, Screen, inside};

/// The folder of local profiles.
const PROFILES: &str = "profiles";

/// Opens the set-up screen, or the session that the command line asks for.
pub(super) fn screen(run: Option<&cli::Run>) -> Result<ExitCode, RunError> {
    let clock = WallClock::start();
    let feed = Feed::new(hands(), clock);
    let mut stage =
        Stage { feed: feed.clone(), shutdown: Shutdown::listen(), running: None, last: None };
    let keys = keys_of(run);
    // Everything that could be refused is refused before the screen is taken.
    let start = match run {
        None => {
            let order = Order::default();
            super::session::profile_of(&order)?;
            Start::Setup(Box::new(order))
        }
        Some(run) => {
            // Without a terminal no folder is made.
            Screen::check(keys).map_err(|error| no_screen(&error))?;
            let started = match &run.resume {
                Some(folder) => stage.take_up(folder)?,
                None => stage
                    .start(&run.order().map_err(|error| RunError::Usage(error.to_string()))?)?,
            };
            Start::Live(Box::new(started))
        }
    };
    let mut screen = match Screen::take(feed, keys) {
        Ok(screen) => screen,
        Err(error) => {
            stage.stop();
            return Err(no_screen(&error));
        }
    };
    let ended = panic::catch_unwind(AssertUnwindSafe(|| app::run(&mut screen, &mut stage, start)));
    // The plant first, then the log, then the terminal, then words.
    stage.stop();
    curtain::fall(screen);
    let ended = match ended {
        Ok(ended) => ended.map_err(RunError::Failed)?,
        Err(_) => {
            return Err(RunError::Failed(
                "the screen failed; the session up to then is kept and can be resumed".to_owned(),
            ));
        }
    };
    if let Some(finished) = &stage.last {
        tell(&sentences(finished).join("\n"));
    }
    let by_itself = || stage.last.as_ref().map_or(ExitCode::SUCCESS, exit_code);
    Ok(curtain::code_of(ended, &stage.shutdown).unwrap_or_else(by_itself))
}

/// A session needs none.
fn no_screen(error: &NoScreen) -> RunError {
    let how = "coadapt run balance --headless --operator simulated:average";
    RunError::Usage(format!("{error}, or run a session without a screen: {how}"))
}

/// Where keys come from while standard input may hold a relay's lines.
fn keys_of(run: Option<&cli::Run>) -> KeysFrom {
    let words = run.map(|run| match &run.resume {
        Some(folder) => record::read_sidecar(&folder.join("session.json"))
            .map_or(String::new(), |session| session.operator),
        None => run.operator.clone(),
    });
    match words.and_then(|words| words.parse().ok()) {
        Some(Choice::Gamepad(Via::RelayInput)) => KeysFrom::Terminal,
        _ => KeysFrom::Input,
    }
}

/// The conductor of the screens.
struct Stage {
    feed: Feed,
    shutdown: Shutdown,
    running: Option<JoinHandle<Result<Finished, RunError>>>,
    last: Option<Finished>,
}

impl Stage {
    fn start(&mut self, order: &Order) -> Result<Running, RunError> {
        let keys = self.keys();
        let session = Session::begin(order, &Company::Attended(keys.clone()))?;
        self.raise_curtain(session, keys, order.clone())
    }

    fn take_up(&mut self, folder: &Path) -> Result<Running, RunError> {
        let keys = self.keys();
        let session = Session::resume(folder, &Company::Attended(keys.clone()))?;
        let sidecar = session.sidecar();
        let order = Order {
            subject: sidecar.subject.clone(),
            operator: sidecar.operator.clone(),
            backend: sidecar.backend.clone(),
            logs: folder.ancestors().nth(2).map_or_else(|| "logs".into(), Path::to_owned),
            ..Order::default()
        };
        self.raise_curtain(session, keys, order)
    }

    /// Keys and a pointer for a new session.
    fn keys(&self) -> Keys {
        Keys { hands: hands(), pointer: Pointer::default(), clock: self.feed.clock }
    }

    fn raise_curtain(
        &mut self,
        mut session: Session,
        keys: Keys,
        order: Order,
    ) -> Result<Running, RunError> {
        // That nobody can watch ends no session.
        #[cfg(unix)]
        let post = super::watch::post(&session)
            .inspect_err(|error| session.notices.push(error.to_string()))
            .ok();
        // Only now is it known whose keyboard it is, for a resumed session as for a new one.
        keys.hands.set_params(&session.profile().operator.keyboard);
        self.feed.replace(keys.hands, keys.pointer);
        let running = Running {
            info: info_of(session.profile(), session.sidecar()),
            watcher: session.watcher.clone(),
            frames: session.frames.clone(),
            badge: session.device.as_ref().map(|device| device.badge.clone()),
            mouse: mouse(&session),
            screen: session.profile().screen.clone(),
            // The next session has a number and chance of its own.
            order: Order { trial: None, seed: None, ..order },
            notice: (!session.notices.is_empty()).then(|| session.notices.join("; ")),
            plant: session.real.as_ref().map(Real::at_the_screen),
        };
        self.shutdown.abort_on_signal(running.watcher.clone());
        self.last = None;
        let shutdown = self.shutdown.clone();
        let mut clock = self.feed.clock;
        let control = std::thread::Builder::new()
            .name("coadapt-control".to_owned())
            .spawn(move || {
                // Who watches sees it up to its last file.
                #[cfg(unix)]
                let _post = post;
                session.run(&mut clock, || shutdown.signal())
            })
            .map_err(|error| RunError::Failed(format!("no control thread: {error}")))?;
        self.running = Some(control);
        Ok(running)
    }

    /// Ends a session that still runs and waits for its last file.
    fn stop(&mut self) {
        self.shutdown.abort_now("the screen ended");
        match self.running.take().map(JoinHandle::join) {
            Some(Ok(Ok(finished))) => self.last = Some(finished),
            Some(Ok(Err(error))) => tell_later(&error.to_string()),
            Some(Err(_)) => {
                tell_later("the control thread failed, after it was told to stop the plant");
            }
            None => {}
        }
    }
}

impl Conductor for Stage {
    fn shelf(&mut self, order: &Order) -> Shelf {
        let kept = folder::trials(&order.logs, &order.subject).unwrap_or_default();
        let policies = kept
            .iter()
            .map(|kept| kept.path.join("policy.json"))
            .filter(|path| path.is_file())
            .map(|path| path.display().to_string())
            .collect();
        Shelf {
            trials: kept.iter().map(|kept| kept.trial.0).collect(),
            unfinished: folder::unfinished(&order.logs),
            policies,
            profiles: profile::list(Path::new(PROFILES)),
        }
    }

    fn document(&mut self, name: &str) -> Result<Document, ProfileError> {
        Document::find(name, Path::new(PROFILES))
    }

    fn begin(&mut self, order: &Order) -> Result<Running, String> {
        self.start(order).map_err(|error| error.to_string())
    }

    fn resume(&mut self, folder: &Path) -> Result<Running, String> {
        self.take_up(folder).map_err(|error| error.to_string())
    }

    fn results(&mut self) -> Option<Result<results::Info, String>> {
        if !self.running.as_ref()?.is_finished() {
            return None;
        }
        Some(match self.running.take()?.join() {
            Ok(Ok(finished)) => {
                let info = results_info(&finished);
                self.last = Some(finished);
                Ok(info)
            }
            Ok(Err(error)) => Err(error.to_string()),
            Err(_) => Err("the control thread failed, after the plant was told to stop; the \
                           session up to then is kept and can be resumed"
                .to_owned()),
        })
    }

    fn is_told_to_end(&self) -> bool {
        self.shutdown.signal().is_some()
    }
}

/// Hands that touch no key.
fn hands() -> Hands {
    Hands::new(&terminal::Params::default()).inside(inside())
}

/// How the mouse is to be read over the live screen: only by a session that it steers.
fn mouse(session: &Session) -> Mouse {
    match device(session.sidecar()) {
        Some(Device::Mouse) if session.profile().operator.mouse.hide_pointer => Mouse::Hidden,
        Some(Device::Mouse) => Mouse::Read,
        _ => Mouse::Unread,
    }
}

/// The device that the person has a hand on.
fn device(sidecar: &Sidecar) -> Option<Device> {
    sidecar.operator.parse::<Choice>().ok().and_then(|choice| choice.device())
}

/// The facts of a session for the live screen.
pub(super) fn info_of(profile: &Profile, sidecar: &Sidecar) -> Info {
    let task = profile.experiment.task(profile.tick());
    let plan = Plan::new(&profile.session, profile.tick(), sidecar.seed, true);
    let device = device(sidecar);
    let texts = &profile.session.instructions;
    let main = match sidecar.mode {
        Mode::Simultaneous => &texts.simultaneous,
        Mode::Sequential => &texts.sequential,
    };
    Info {
        task: sidecar.task.clone(),
        preset: sidecar.preset.clone(),
        mode: sidecar.mode.word().to_owned(),
        robot_watches: sidecar.mode == Mode::Sequential,
        learner: sidecar.learner.clone(),
        subject: sidecar.subject.to_string(),
        trial: sidecar.trial.0,
        phases: plan.phases,
        instructions: vec![
            (Phase::Introduction, texts.introduction.clone()),
            (Phase::Main, main.clone()),
            (Phase::Autonomous, texts.autonomous.clone()),
        ],
        tick_s: profile.tick().0,
        hold_s: profile.session.hold_s,
        autonomous_hold_s: profile.session.autonomous_hold_s,
        break_s: profile.session.break_s,
        gate: profile.sharing.gate,
        // Standing still alone scores 0.69 at balance: with the thesis's window the gate
        // waits for enough steps, whatever they are.
        gate_is_timer: profile.sharing == sharing::Params::default()
            && profile.experiment.name() == Balance::NAME,
        by_episode: profile.sharing.window_episodes.is_some(),
        longest_taught: task.longest(Occasion::Taught),
        longest_tested: task.longest(Occasion::Tested),
        action_limit: task.action_limit(),
        action_unit: profile.experiment.action_unit().to_owned(),
        scene: Scene::of(&profile.experiment),
        regions: scene::regions_of(&profile.experiment),
        field_cap: profile.learner.max_fields,
        operator: sidecar.operator.clone(),
        buttons: if device == Some(Device::Gamepad) {
            profile.operator.gamepad.map.sentence()
        } else {
            String::new()
        },
        device_state: String::new(),
        device,
        sensitivity: device.map_or(1.0, |device| profile.operator.shape(device).sensitivity),
    }
}

/// A finished session for the results screen.
fn results_info(finished: &Finished) -> results::Info {
    let results = &finished.results;
    let mut files: Vec<String> = std::fs::read_dir(&finished.folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    files.sort();
    let mut summary = results.phases.sentences();
    summary.extend(finished.cause.as_ref().map(|cause| format!("ended early: {cause}")));
    results::Info {
        title: results.title(),
        finish: results.status_word().to_owned(),
        rollouts: finished.episodes.clone(),
        folder: PathBuf::from(&finished.folder).display().to_string(),
        files,
        summary,
        alarm: finished
            .motor_may_be_on
            .then_some("THE STOP WAS NOT CONFIRMED: switch the motor's supply off."),
        evaluation: (!finished.tenths.is_empty()).then(|| finished.tenths.clone()),
        measure: results.yardstick(),
        start: results.is_of(Balance::NAME).then_some(results::Start::RELEASE),
        regions: results.phases.main.as_ref().map_or_else(Vec::new, |main| main.regions.clone()),
    }
}
