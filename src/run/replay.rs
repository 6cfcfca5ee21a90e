//! `coadapt replay`: a recorded session on the screen, or done once more and compared.

use std::io::{self, IsTerminal};
use std::path::Path;
use std::process::ExitCode;

use super::curtain::shown;
use super::session::usage;
use super::{RunError, say, screen, tell};
use crate::cli;
use crate::control::recording::Recording;
use crate::operator::Choice;
use crate::profile::{Document, Profile};
use crate::record::{self, Sidecar, Status, folder};
use crate::study::verify::{Difference, Verdict, VerifyError, verify};
use crate::tui::replay::{self, Player};
use crate::tui::terminal::{KeysFrom, Screen, look};
use serde::Serialize;

/// `coadapt replay …`
pub(super) fn replay(words: &cli::Replay) -> Result<ExitCode, RunError> {
    let (sidecar, profile) = session(&words.session)?;
    if words.verify {
        return checked(words, &sidecar, &profile);
    }
    if !io::stdout().is_terminal() {
        return Err(RunError::Usage(format!(
            "replay draws on a terminal, and standard output is none: run it in one, or compare \
             the session with its repetition: coadapt replay {} --verify",
            words.session.display()
        )));
    }
    Screen::check(KeysFrom::Input).map_err(|error| usage(&error))?;
    on_screen(&words.session, &sidecar, &profile)
}

/// The facts and the profile of the session in `folder`.
fn session(folder: &Path) -> Result<(Sidecar, Profile), RunError> {
    let sidecar = record::sidecar_of(folder).map_err(|error| usage(&error))?;
    let profile = Document::from_text("profile_ron of session.json", sidecar.profile_ron.clone())
        .read()
        .map_err(|report| usage(&report))?;
    Ok((sidecar, profile))
}

/// Shows the session until the person leaves.
fn on_screen(folder: &Path, sidecar: &Sidecar, profile: &Profile) -> Result<ExitCode, RunError> {
    let task = profile.experiment.task(profile.tick());
    let recording =
        Recording::read(folder, task, profile.session.returns).map_err(|error| usage(&error))?;
    if recording.is_empty() {
        let why = recording.trouble().unwrap_or("not one step was recorded");
        return Err(RunError::Usage(format!("{}: nothing to replay: {why}", folder.display())));
    }
    let look = look(profile.screen.glyphs);
    let player = Player::new(recording, screen::info_of(profile, sidecar), look);
    let frames_per_s = profile.screen.frames_per_s;
    shown(|screen, is_over| replay::show(screen, player, frames_per_s, is_over))
}

/// The JSON object of `replay --verify`.
#[derive(Serialize)]
struct Object<'a> {
    schema: u32,
    session: String,
    /// Whether every row is the same.
    verified: bool,
    rows: u64,
    rollouts: u64,
    /// Whether more may follow: the session or a table was cut, or it still runs.
    partial: bool,
    difference: Option<&'a Difference>,
    /// What recorded it, where that is not this program.
    recorded_by: Option<String>,
    /// Why it cannot be done once more.
    refused: Option<String>,
}

/// Does the session once more and says what came of it.
fn checked(
    words: &cli::Replay,
    sidecar: &Sidecar,
    profile: &Profile,
) -> Result<ExitCode, RunError> {
    let folder = &words.session;
    let choice: Option<Choice> = sidecar.operator.parse().ok();
    let agent = match choice {
        Some(Choice::QLearning) => {
            let agent = profile.experiment.agent(sidecar.seed).map_err(|error| usage(&error))?;
            Some(Box::new(agent) as Box<dyn crate::operator::Operator>)
        }
        _ => None,
    };
    let is_foreign =
        sidecar.version != record::VERSION || sidecar.host.architecture != std::env::consts::ARCH;
    let recorded_by =
        is_foreign.then(|| format!("coadapt {} on {}", sidecar.version, sidecar.host.architecture));
    let (verdict, refused) = match verify(folder, profile, sidecar, agent) {
        Ok(verdict) => (verdict, None),
        Err(error @ (VerifyError::RealPlant { .. } | VerifyError::NoRows { .. })) if words.json => {
            let nothing = Verdict { rows: 0, rollouts: 0, partial: true, difference: None };
            (nothing, Some(error.to_string()))
        }
        Err(error) => return Err(usage(&error)),
    };
    let is_same = verdict.difference.is_none() && refused.is_none();
    let partial = verdict.partial || sidecar.status != Status::Complete;
    if words.json {
        let object = Object {
            schema: 1,
            session: folder.display().to_string(),
            verified: is_same,
            rows: verdict.rows,
            rollouts: verdict.rollouts,
            partial,
            difference: verdict.difference.as_ref(),
            recorded_by,
            refused: refused.clone(),
        };
        let json = serde_json::to_string(&object)
            .map_err(|error| RunError::Failed(format!("the verdict has no JSON: {error}")))?;
        say(&json)?;
    } else {
        say(&sentences(folder, sidecar, &verdict).join("\n"))?;
        if let Some(by) = recorded_by.filter(|_| !is_same) {
            tell(&format!("it was recorded by {by}: another program may round otherwise"));
        }
    }
    if refused.is_some() {
        return Ok(ExitCode::from(2));
    }
    Ok(if is_same { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// The verdict for people.
fn sentences(folder: &Path, sidecar: &Sidecar, verdict: &Verdict) -> Vec<String> {
    let Verdict { rows, rollouts, difference, .. } = verdict;
    let same = format!("{rows} rows and {rollouts} rollouts");
    let mut lines = match difference {
        None => vec![
            format!("{}: verified", folder.display()),
            format!("{same} are the same, bit by bit, when the session is done once more"),
        ],
        Some(difference) => vec![
            format!("{}: NOT the same when the session is done once more", folder.display()),
            format!("first difference: {difference}"),
            format!("{same} before it are the same, bit by bit"),
        ],
    };
    let lost = sidecar.timing.as_ref().map_or(0, |timing| timing.lost_rows);
    if difference.is_some() && lost > 0 {
        lines.push(format!(
            "the recording lost {lost} rows, without which what follows them cannot be repeated"
        ));
    }
    let end = match sidecar.status {
        Status::Running if folder::is_busy(folder) => Some("the session still runs"),
        Status::Running => Some("the session was cut"),
        Status::Complete if verdict.partial => Some("a table ends before the session does"),
        Status::Complete => None,
        _ if verdict.partial => Some("the session ended early"),
        _ => None,
    };
    if let (None, Some(end)) = (&difference, end) {
        lines.push(format!("{end}: this is as far as it goes"));
    }
    lines
}
