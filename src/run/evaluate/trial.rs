//! Which policies are tried, and by which rules.

use std::io;
use std::path::{Path, PathBuf};

use super::super::RunError;
use super::super::words::{document, read, usage};
use crate::cli;
use crate::learner::{Learner, Model};
use crate::profile::{self, Document, Profile};
use crate::record::{self, Policy, Status, folder, policy};
use crate::session::Phase;

/// A policy and the rules that it is tried by.
pub(super) struct Trial {
    /// The policy's file.
    pub(super) file: PathBuf,
    /// What stands in it.
    pub(super) policy: Policy<Model>,
    /// The rules.
    pub(super) profile: Profile,
    /// Where the rules come from.
    pub(super) shown: String,
    /// The session's folder, where a session is tried.
    folder: Option<PathBuf>,
}

/// The policies after the tenths of main, and what is to be said of those left out.
#[derive(Default)]
pub(super) struct Tenths {
    /// After how many percent of main, and what was learned by then.
    pub(super) learners: Vec<(u8, Model)>,
    /// Which are left out, and why.
    pub(super) notices: Vec<String>,
}

impl Trial {
    /// The policy that `words` name, and the profile: the given one, that of its session, or
    /// the shipped one of its task and preset.
    pub(super) fn of(words: &cli::Evaluate) -> Result<Self, RunError> {
        let is_session = words.policy.is_dir();
        let file = if is_session { final_policy(&words.policy)? } else { words.policy.clone() };
        let policy: Policy<Model> = record::read_policy(&file).map_err(usage)?;
        let rules = match &words.profile {
            Some(name) => document(name, &[])?,
            None => own_rules(&file, &policy, is_session)?,
        };
        let rules = changed(rules, words);
        let profile = read(&rules)?;
        if let Some(misfit) = misfit(&policy, &profile) {
            let remedy = remedy(words, &file, &policy, &rules);
            return Err(usage(format_args!("{}: {misfit}; {remedy}", file.display())));
        }
        let folder = is_session.then(|| words.policy.clone());
        Ok(Self { file, policy, profile, shown: rules.shown().to_owned(), folder })
    }

    /// The policies after the tenths of main, where a session is tried. One that is missing
    /// is told only if a later one is there: a session without main has none.
    pub(super) fn tenths(&self) -> Tenths {
        let mut tenths = Tenths::default();
        let Some(folder) = &self.folder else { return tenths };
        let mut missing = Vec::new();
        for percent in (10..=100).step_by(10) {
            let file = folder.join(policy::file_name(Some(percent)));
            let read = record::read_policy::<Model>(&file);
            if read.as_ref().is_err_and(is_missing) {
                missing.push(format!("{} is missing; this tenth is left out", file.display()));
                continue;
            }
            tenths.notices.append(&mut missing);
            let fault = match read {
                Err(error) => error.to_string(),
                Ok(policy) => {
                    let Some(misfit) = misfit(&policy, &self.profile) else {
                        tenths.learners.push((percent, policy.learner));
                        continue;
                    };
                    format!("{}: {misfit}", file.display())
                }
            };
            tenths.notices.push(format!("{fault}; this tenth is left out"));
        }
        tenths
    }
}

fn is_missing(error: &record::Error) -> bool {
    matches!(error, record::Error::Io { cause, .. } if cause.kind() == io::ErrorKind::NotFound)
}

/// The file of the final policy of the session in `folder`, or why there is none and what to
/// do.
fn final_policy(folder: &Path) -> Result<PathBuf, RunError> {
    let file = folder.join(policy::file_name(None));
    let sidecar = folder.join("session.json");
    let is_absent = |file: &Path| matches!(file.try_exists(), Ok(false));
    if !is_absent(&file) {
        return Ok(file);
    }
    let shown = folder.display();
    if is_absent(&sidecar) {
        return Err(usage(format_args!(
            "{shown} is not the folder of a session: it holds neither policy.json nor \
             session.json; give a policy's file, or a folder such as \
             logs/anon/001-balance-simultaneous"
        )));
    }
    let session = record::read_sidecar(&sidecar).map_err(usage)?;
    let problem = if !session.planned.contains(&Phase::Main) {
        "this session has no main phase, so no robot was taught in it; give another session"
            .to_owned()
    } else if session.status == Status::Complete {
        "policy.json is missing, though the session is complete; put it back".to_owned()
    } else if folder::is_busy(folder) {
        "this session is still being recorded, so it has no policy.json yet; let it end first"
            .to_owned()
    } else {
        format!(
            "this session was not finished, so it has no policy.json yet; finish it with: \
             coadapt run --resume {shown}"
        )
    };
    let tenths = (10..=100).rev().step_by(10);
    let latest = tenths
        .map(|percent| folder.join(policy::file_name(Some(percent))))
        .find(|file| file.is_file())
        .map_or(String::new(), |file| {
            format!("\nor evaluate its latest policy alone: coadapt evaluate {}", file.display())
        });
    Err(usage(format_args!("{shown}: {problem}{latest}")))
}

/// The rules of the session that the policy in `file` belongs to, or the shipped ones of its
/// task and preset.
fn own_rules(file: &Path, policy: &Policy<Model>, is_session: bool) -> Result<Document, RunError> {
    let sidecar = file.parent().unwrap_or(Path::new("")).join("session.json");
    if is_session || sidecar.is_file() {
        let session = record::read_sidecar(&sidecar).map_err(usage)?;
        return Ok(Document::from_text(&sidecar.display().to_string(), session.profile_ron));
    }
    if policy.task == policy::TABLE {
        return Err(usage(format_args!(
            "{} was learned from a table, so no task is known: give --profile",
            file.display()
        )));
    }
    let own = format!("{}-{}", policy.task, policy.preset);
    document(&own, &[]).or_else(|_| document(&policy.task, &[]))
}

/// `rules` with the changes that `words` ask for.
fn changed(mut rules: Document, words: &cli::Evaluate) -> Document {
    if let Some(starts) = words.starts {
        rules.set("session.autonomous_rollouts", &starts.to_string());
    }
    if words.random {
        rules.set("session.starts", "random");
    }
    for (key, value) in &words.set {
        rules.set(key, value);
    }
    rules
}

/// Why `policy` cannot act by the rules of `profile`; none when it can.
fn misfit(policy: &Policy<Model>, profile: &Profile) -> Option<String> {
    let features = profile.experiment.task(profile.tick()).feature_names();
    let columns = (policy.learner.inputs(), policy.learner.outputs());
    policy.misfit(profile.experiment.name(), features, columns)
}

/// What helps where a `policy` does not fit `rules`. Everything named here was tried first.
fn remedy(words: &cli::Evaluate, file: &Path, policy: &Policy<Model>, rules: &Document) -> String {
    let fits = |rules: &Document| rules.read().is_ok_and(|p| misfit(policy, &p).is_none());
    let mut remedies: Vec<String> = ["true", "false"]
        .iter()
        .find_map(|sees| sight(policy, rules, sees, fits))
        .into_iter()
        .collect();
    let own = || own_rules(file, policy, words.policy.is_dir());
    if words.profile.is_some() && own().is_ok_and(|own| fits(&changed(own, words))) {
        remedies.push("leave --profile out".to_owned());
    }
    let names = [format!("{}-{}", policy.task, policy.preset), policy.task.clone()];
    let listed = profile::list(Path::new("profiles")).into_iter().map(|listed| listed.name);
    let shipped = names
        .into_iter()
        .chain(listed)
        .find(|name| document(name, &[]).is_ok_and(|rules| fits(&changed(rules, words))));
    remedies.extend(shipped.map(|name| format!("give --profile {name}")));
    if remedies.is_empty() {
        return "no shipped profile fits it: give the one that it was taught with, --profile FILE, \
                or another policy"
            .to_owned();
    }
    remedies.join(", or ")
}

/// The words that let the learner see what `policy` was taught with, if `sees` is it: the one
/// rule that decides what a learner sees, and as many norms as it has inputs then.
fn sight(
    policy: &Policy<Model>,
    rules: &Document,
    sees: &str,
    fits: impl Fn(&Document) -> bool,
) -> Option<String> {
    let norms = match &policy.learner {
        Model::Rfwr(rfwr) => &rfwr.settings().norm_in,
        Model::Lwpr(lwpr) => &lwpr.settings().norm_in,
    };
    let norms = format!("{norms:?}");
    let mut rules = rules.clone();
    rules.set("rules.use_theta_dot", sees);
    rules.set("learner.norm_in", &norms);
    fits(&rules)
        .then(|| format!("add --set rules.use_theta_dot={sees} --set 'learner.norm_in={norms}'"))
}
