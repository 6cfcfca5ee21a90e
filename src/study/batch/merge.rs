//! Shards of a study, joined.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::folder::{Card, card, read};
use super::plan::{Changes, Study};
use super::shard::Shard;
use super::{Kept, Outcome, StudyError};

/// A study whose runs are in several folders.
#[derive(Debug)]
pub struct Merged {
    /// The study.
    pub study: Study,
    /// Its card, of all runs.
    pub card: Card,
    folders: Vec<PathBuf>,
}

/// Joins what is in `folders`. The study is found again as it was asked for; `profiles` is the
/// folder of profiles. `is_enough` says when to give up.
///
/// # Errors
/// When one of them holds no study, or another one, or the study is no longer what it was.
pub fn merge(
    folders: &[PathBuf],
    profiles: &Path,
    is_enough: &dyn Fn() -> bool,
) -> Result<Merged, StudyError> {
    let mut cards = Vec::new();
    for folder in folders {
        cards.push((folder, card(folder)?));
    }
    let Some(((first, known), others)) = cards.split_first() else {
        return Err(StudyError::NoStudy { path: PathBuf::new() });
    };
    let misfit = |path: &Path, why: String| StudyError::Misfit {
        path: path.to_owned(),
        first: (*first).clone(),
        why,
    };
    for (path, card) in others {
        if card.version != known.version {
            let why = format!("it is of coadapt {}, not {}", card.version, known.version);
            return Err(misfit(path, why));
        }
        if card.identity != known.identity {
            return Err(misfit(path, card.otherness(known)));
        }
    }
    let (path, found) = ((*first).clone(), known.found.clone());
    if known.version != env!("CARGO_PKG_VERSION") {
        let why = format!(
            "its runs are those of coadapt {}, and this is {}",
            known.version,
            env!("CARGO_PKG_VERSION")
        );
        return Err(StudyError::OtherStudy { path, why });
    }
    let changes = Changes { sets: known.sets.clone(), seeds: known.seeds };
    let study = match Study::find(&found, profiles, &changes, is_enough) {
        Err(StudyError::Interrupted) => return Err(StudyError::Interrupted),
        Err(why) => return Err(StudyError::Gone { path, found, why: Box::new(why) }),
        Ok(study) => study,
    };
    if study.identity() != known.identity {
        let why = "its file or its profile has changed since".to_owned();
        return Err(StudyError::Changed { path, found, why });
    }
    let card = Card { shard: 1, shards: 1, ..known.clone() };
    Ok(Merged { study, card, folders: folders.to_vec() })
}

impl Merged {
    /// What came of the run of that `number`, and where: of several results one that is done.
    #[must_use]
    pub fn read(&self, number: u32) -> Option<(&Path, Kept)> {
        let mut found: Option<(&Path, Kept)> = None;
        for folder in &self.folders {
            let is_open = |found: &(&Path, Kept)| matches!(found.1.outcome, Outcome::Failed(_));
            if found.as_ref().is_none_or(is_open)
                && let Some(kept) = read(folder, number)
            {
                found = Some((folder, kept));
            }
        }
        found
    }

    /// The shards that none of the folders holds and that have one of the `missing` runs, by the
    /// number of shards that the folders say.
    #[must_use]
    pub fn absent(&self, missing: &[u32]) -> Vec<Shard> {
        let mut held: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
        for card in self.folders.iter().filter_map(|folder| card(folder).ok()) {
            held.entry(card.shards.max(1)).or_default().insert(card.shard);
        }
        let mut absent = BTreeSet::new();
        for (of, held) in held {
            let lacking = missing.iter().map(|run| Shard::of_run(*run, of).number);
            absent.extend(lacking.filter(|number| !held.contains(number)).map(|n| (of, n)));
        }
        absent.into_iter().map(|(of, number)| Shard { number, of }).collect()
    }
}
