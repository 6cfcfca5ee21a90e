//! Puts a report together from what was gathered.

use std::collections::BTreeMap;

use super::figure::{Report, Section};
use super::gather::{Gathered, Recorded};
use super::group::{self, Group};
use super::session::{self, View};
use super::{pair, studies, words};
use crate::sharing::Mode;

/// What must be the same in sessions that are compared.
type Kind<'a> = (&'a str, &'a str, &'a str, &'a str);

fn kind(session: &Recorded) -> Kind<'_> {
    (&session.task, &session.preset, &session.operator, &session.backend)
}

/// The report of what was gathered.
#[must_use]
pub fn compose(gathered: &Gathered) -> Report {
    let groups = groups(&gathered.sessions);
    let full = groups.iter().filter(|group| !group.sessions.is_empty());
    let (mut sections, comparisons): (Vec<Section>, Vec<_>) = full.map(group::section).unzip();
    sections.extend(gathered.studies.iter().flat_map(studies::sections));
    for group in &groups {
        let view = |session| View { session, preset: &group.preset };
        sections.extend(both_modes(group).into_iter().map(|pair| pair::section(pair.map(view))));
    }
    let mut singles: Vec<(&Recorded, &str)> = groups
        .iter()
        .flat_map(|group| {
            let all = group.sessions.iter().chain(&group.cut);
            all.map(|session| (*session, &*group.preset))
        })
        .collect();
    singles.sort_by_key(|(session, _)| (&session.subject, session.trial));
    let views = singles.into_iter().map(|(session, preset)| View { session, preset });
    sections.extend(views.map(session::section));
    let (sessions, studies) = (gathered.sessions.len(), gathered.studies.len());
    let parts = [(sessions, "session"), (studies, "study")].map(|(count, noun)| {
        if noun == "study" && count != 1 {
            format!("{count} studies")
        } else {
            words::counted(count, noun)
        }
    });
    let counts = [sessions, studies];
    let named: Vec<&str> =
        parts.iter().zip(counts).filter(|(_, n)| *n > 0).map(|(part, _)| &**part).collect();
    let mut report = Report {
        title: format!("Report of {}", named.join(" and ")),
        sections,
        comparisons: comparisons.concat(),
        left_out: gathered.left_out.clone(),
    };
    report.tell_names_apart();
    report
}

/// The subjects' sessions in both modes, sequential first.
fn both_modes<'a>(group: &Group<'a>) -> Vec<[&'a Recorded; 2]> {
    let mut subjects: BTreeMap<&str, [Option<&Recorded>; 2]> = BTreeMap::new();
    for session in &group.sessions {
        let at = usize::from(session.mode == Mode::Simultaneous);
        subjects.entry(&session.subject).or_default()[at].get_or_insert(session);
    }
    subjects.into_values().filter_map(|[a, b]| Some([a?, b?])).collect()
}

/// The sessions that may be compared, together. Those of one preset whose profiles differ are
/// groups of their own, and say in what they differ from the largest.
fn groups(sessions: &[Recorded]) -> Vec<Group<'_>> {
    let mut kinds: BTreeMap<Kind<'_>, Vec<&Recorded>> = BTreeMap::new();
    for session in sessions {
        kinds.entry(kind(session)).or_default().push(session);
    }
    let shared_by_kinds = |task: &str, preset: &str| {
        kinds.keys().filter(|kind| kind.0 == task && kind.1 == preset).count() > 1
    };
    let mut groups = Vec::new();
    for ((task, preset, operator, backend), members) in &kinds {
        let mut profiles: BTreeMap<&BTreeMap<String, String>, Vec<&Recorded>> = BTreeMap::new();
        for session in members {
            profiles.entry(&session.profile).or_default().push(session);
        }
        let mut profiles: Vec<_> = profiles.into_iter().collect();
        profiles.sort_by_key(|(_, members)| usize::MAX - members.len());
        let usual = profiles.first().map(|(profile, _)| *profile);
        for (at, (profile, members)) in profiles.iter().enumerate() {
            let mut label = format!("{task} · {preset}");
            let mut stem = format!("{task}-{preset}");
            if shared_by_kinds(task, preset) {
                let plant = if *backend == "simulated" { "" } else { backend };
                label = format!("{label} · {operator}");
                stem = format!("{stem}-{operator}{plant}");
                if !plant.is_empty() {
                    label = format!("{label} · {plant}");
                }
            }
            if at > 0 {
                label = format!(
                    "{label} · {}",
                    usual.map_or(String::new(), |usual| changes(usual, profile))
                );
                stem = format!("{stem}-variant-{}", at + 1);
            }
            let (sessions, cut) = members.iter().partition(|session| session.is_complete());
            let stem =
                stem.replace(|c: char| !(c.is_ascii_alphanumeric() || "-_.".contains(c)), "-");
            groups.push(Group { task, preset: label, stem, sessions, cut });
        }
    }
    groups
}

/// In what `profile` differs from `usual`, at most three keys by name.
fn changes(usual: &BTreeMap<String, String>, profile: &BTreeMap<String, String>) -> String {
    let differs: Vec<String> = profile
        .iter()
        .filter(|(key, value)| usual.get(*key) != Some(*value))
        .map(|(key, value)| format!("{key} {value}"))
        .collect();
    let gone = usual.keys().filter(|key| !profile.contains_key(*key)).count();
    let more = (differs.len() + gone).saturating_sub(3);
    let named = differs.iter().take(3).cloned().collect::<Vec<_>>().join(", ");
    if more == 0 { named } else { format!("{named} and {more} more changes") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_variant_says_in_what_it_differs() {
        let profile = |pairs: &[(&str, &str)]| {
            pairs
                .iter()
                .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()))
                .collect::<BTreeMap<_, _>>()
        };
        let usual = profile(&[("a", "1"), ("b", "2"), ("c", "3"), ("d", "4")]);
        let one = profile(&[("a", "1"), ("b", "5"), ("c", "3"), ("d", "4")]);
        assert_eq!(changes(&usual, &one), "b 5");
        let all = profile(&[("a", "0"), ("b", "0"), ("c", "0"), ("d", "0")]);
        assert_eq!(changes(&usual, &all), "a 0, b 0, c 0 and 1 more changes");
    }
}
