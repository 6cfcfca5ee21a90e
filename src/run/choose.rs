//! What an order comes to on this disk: which policy, which mode, which operator.

use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use super::RunError;
use super::session::{Company, Keys, usage};
use crate::clock::WallClock;
use crate::control::scribe::Device;
use crate::learner::{Learner, Model};
use crate::operator::gamepad::events::Events;
use crate::operator::gamepad::hub::Hub;
use crate::operator::gamepad::link::Link;
use crate::operator::gamepad::{self, Gamepad, Source};
use crate::operator::mouse::Mouse;
use crate::operator::script::{Recorded, Script};
use crate::operator::terminal::Keyboard;
use crate::operator::{self, Choice, Operator, Via};
use crate::profile::{Order, Profile};
use crate::random::{Place, Purpose, stream};
use crate::record::{self, assignment, folder, policy, reader};
use crate::session::plan::Wanted;
use crate::session::{Moment, Phase};
use crate::sharing::Mode;
use crate::study::batch;

/// The policy that the order asks for, read and fitting.
pub(super) fn order_policy(
    order: &Order,
    profile: &Profile,
) -> Result<Option<record::Policy<Model>>, RunError> {
    let phases = &profile.session.phases;
    let teaches = phases.contains(&Wanted::Main);
    let path = match &order.policy {
        Some(_) if teaches => {
            return Err(RunError::Usage(
                "--policy serves sessions without a main phase, since main teaches a policy of \
                 its own: add --phases autonomous"
                    .to_owned(),
            ));
        }
        None if teaches || !phases.contains(&Wanted::Autonomous) => return Ok(None),
        None => {
            return Err(RunError::Usage(
                "without a main phase the robot has learned nothing: give --policy FILE, or \
                 --policy last for this subject's latest"
                    .to_owned(),
            ));
        }
        Some(word) if word == "last" => last_policy(order, profile)?,
        Some(file) => PathBuf::from(file),
    };
    let policy: record::Policy<Model> = record::read_policy(&path).map_err(|e| usage(&e))?;
    let task = profile.experiment.task(profile.tick());
    let columns = (policy.learner.inputs(), policy.learner.outputs());
    if let Some(misfit) = policy.misfit(task.name(), task.feature_names(), columns) {
        return Err(RunError::Usage(format!("{}: {misfit}", path.display())));
    }
    let given = order.sets.iter().any(|(key, _)| key == "mode");
    if given && profile.mode.fixed() != Some(policy.mode) {
        return Err(RunError::Usage(format!(
            "{}: this policy was taught in the {} mode: leave --mode out",
            path.display(),
            policy.mode.word()
        )));
    }
    Ok(Some(policy))
}

/// The subject's latest final policy for the task, taught with the same preset.
fn last_policy(order: &Order, profile: &Profile) -> Result<PathBuf, RunError> {
    let kept = folder::trials(&order.logs, &order.subject).map_err(|e| usage(&e))?;
    let (task, preset) = (profile.experiment.name(), &profile.preset);
    let fits = |policy: record::Policy<Model>| policy.task == task && policy.preset == *preset;
    kept.iter()
        .rev()
        .map(|kept| kept.path.join(policy::file_name(None)))
        .find(|path| record::read_policy::<Model>(path).is_ok_and(fits))
        .ok_or_else(|| {
            RunError::Usage(format!(
                "--policy last: subject {} has no policy for {task}, preset {preset}, in {}; give \
                 its file",
                order.subject,
                order.logs.display()
            ))
        })
}

/// That the subject's latest session of this task and preset was cut off, and how to go on
/// with it.
pub(super) fn cut_off_notice(order: &Order, profile: &Profile) -> Option<String> {
    let (task, preset) = (profile.experiment.name(), &profile.preset);
    let cut = folder::unfinished(&order.logs)
        .into_iter()
        .find(|cut| cut.subject == order.subject && cut.task == task && cut.preset == *preset)?;
    Some(format!(
        "coadapt run --resume {} goes on with trial {}, cut at {} {}",
        cut.path.display(),
        cut.trial,
        cut.phase,
        cut.episode
    ))
}

/// The mode that the subject had, or the one that fewer subjects have.
pub(super) fn assigned_mode(order: &Order, profile: &Profile, seed: u64) -> Mode {
    let (task, preset) = (profile.experiment.name(), profile.preset.as_str());
    assignment::mode_of(&order.logs, &order.subject, task, preset).unwrap_or_else(|| {
        let so_far = assignment::modes_so_far(&order.logs, task, preset);
        let mut chance = stream(seed, Purpose::Assignment, Place::default());
        assignment::assign(&so_far, &mut chance)
    })
}

/// Who steers, and the device under their hands, if there is one.
pub(super) struct Hand {
    pub(super) operator: Box<dyn Operator>,
    pub(super) device: Option<Device>,
}

impl<O: Operator + 'static> From<O> for Hand {
    fn from(operator: O) -> Self {
        Self { operator: Box::new(operator), device: None }
    }
}

/// The operator that `choice` names.
pub(super) fn steer(
    choice: &Choice,
    profile: &Profile,
    seed: u64,
    company: &Company,
) -> Result<Hand, RunError> {
    let tick = profile.tick();
    let limit = profile.experiment.task(tick).action_limit();
    let params = &profile.operator;
    Ok(match choice {
        Choice::None => operator::Nobody.into(),
        Choice::Script(folder) if folder.is_dir() => recorded(folder, profile, limit)?.into(),
        Choice::Script(file) => {
            let phases = [Phase::Introduction, Phase::Main]
                .map(|phase| (phase.word(), Moment::start_of(phase).place().phase));
            Script::load(file, &phases, limit).map_err(|error| usage(&error))?.into()
        }
        Choice::Simulated(skill, kind) => {
            Hand { operator: batch::person(profile, (*skill, *kind), seed), device: None }
        }
        Choice::QLearning => profile.experiment.agent(seed).map_err(|e| usage(&e))?.into(),
        Choice::Gamepad(via) => {
            let source = pad_source(via, &params.gamepad, company)?;
            let gamepad = Gamepad::new(source, &params.gamepad, limit, tick);
            let device = Device { badge: gamepad.badge(), hands: None };
            Hand { operator: Box::new(gamepad), device: Some(device) }
        }
        Choice::Mouse => {
            let Keys { pointer, clock, .. } = attended(company, "mouse")?;
            let mouse = Mouse::new(pointer.clone(), *clock, &params.mouse, limit, tick);
            let device = Device { badge: mouse.badge(), hands: None };
            Hand { operator: Box::new(mouse), device: Some(device) }
        }
        Choice::Keyboard => {
            let Keys { hands, clock, .. } = attended(company, "keyboard")?;
            let keyboard = Keyboard::new(hands.clone(), *clock, &params.keyboard, limit, tick);
            let device = Device { badge: keyboard.badge(), hands: Some(hands.clone()) };
            Hand { operator: Box::new(keyboard), device: Some(device) }
        }
    })
}

/// Where the events of a gamepad come from. A computer without pads, or without a way to
/// them, is none that refuses the session: the screen says what is the matter.
fn pad_source(via: &Via, params: &gamepad::Params, company: &Company) -> Result<Source, RunError> {
    match via {
        Via::Script(file) => Ok(Source::script(Events::load(file).map_err(|e| usage(&e))?)),
        Via::Here => {
            let clock = attended(company, "gamepad")?.clock;
            Ok(match Hub::open(clock, &params.sdl_mappings) {
                Ok(hub) => Source::here(&hub, clock),
                Err(why) => Source::nothing(why.to_string()),
            })
        }
        Via::RelayInput => {
            let clock = attended(company, "relayed gamepad")?.clock;
            if io::stdin().is_terminal() {
                return Err(RunError::Usage(
                    "gamepad:relay=- reads standard input, which is a terminal here: run \
                     ssh PAD-COMPUTER coadapt pad-relay | coadapt run …, or use \
                     gamepad:relay=unix:PATH"
                        .to_owned(),
                ));
            }
            let link = Link::standard_input(clock).map_err(|e| RunError::Failed(e.to_string()))?;
            Ok(Source::relay(link, clock))
        }
        Via::RelaySocket(path) => relay_socket(path, attended(company, "relayed gamepad")?.clock),
    }
}

#[cfg(unix)]
fn relay_socket(path: &Path, clock: WallClock) -> Result<Source, RunError> {
    let socket = gamepad::link::Socket::listen(path, clock).map_err(|error| usage(&error))?;
    Ok(Source::socket(socket, clock))
}

#[cfg(not(unix))]
fn relay_socket(_path: &Path, _clock: WallClock) -> Result<Source, RunError> {
    Err(RunError::Usage("this system has no Unix sockets: use gamepad:relay=-".to_owned()))
}

/// The keys and the clock of a session with a person at `device`.
fn attended<'a>(company: &'a Company, device: &str) -> Result<&'a Keys, RunError> {
    match company {
        Company::Attended(keys) => Ok(keys),
        Company::Headless | Company::Armed(_) => Err(RunError::Usage(format!(
            "a headless session has no {device}: give --operator simulated:average, script:FILE \
             or none; a session that was begun at the {device} is resumed without --headless"
        ))),
    }
}

/// What the person did in the session in `folder`, to be done once more.
fn recorded(folder: &Path, profile: &Profile, limit: f64) -> Result<Script, RunError> {
    let refused = |error: record::Error| {
        RunError::Usage(match error {
            record::Error::NoSession { .. } => format!("--operator script:{error}, or a table"),
            other => format!("--operator script:{}: {other}", folder.display()),
        })
    };
    let session = record::sidecar_of(folder).map_err(refused)?;
    let task = profile.experiment.name();
    if session.task != task {
        return Err(RunError::Usage(format!(
            "--operator script:{}: this is a session of {}, not of {task}; give one of {task}",
            folder.display(),
            session.task
        )));
    }
    let steps = reader::Steps::open(&folder.join("steps.csv")).map_err(refused)?;
    let mut rows = Vec::new();
    for row in steps {
        let row = row.map_err(refused)?;
        if row.phase.is_steered() {
            let phase = Moment::start_of(row.phase).place().phase;
            let place = Place { phase, rollout: row.episode, attempt: 0 };
            rows.push(Recorded { place, t: row.t, u: row.u_human });
        }
    }
    Ok(Script::recorded(rows, limit))
}
