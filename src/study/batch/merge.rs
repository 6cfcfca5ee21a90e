//! Shards of a study, joined.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::folder::{Card, card, read};
use super::plan::{Changes, Study};
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
/// folder of profiles.
///
/// # Errors
/// When one of them holds no study, or another one, or the study is no longer what it was.
pub fn merge(folders: &[PathBuf], profiles: &Path) -> Result<Merged, StudyError> {
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
        if card.name != known.name {
            let why = format!("it is the study {}, not {}", card.name, known.name);
            return Err(misfit(path, why));
        }
        if card.identity != known.identity {
            let why = "the study, its settings or its profile differ".to_owned();
            return Err(misfit(path, why));
        }
    }
    let changes = Changes { sets: known.sets.clone(), seeds: known.seeds };
    let study = Study::find(&known.found, profiles, &changes)?;
    if known.version != env!("CARGO_PKG_VERSION") || study.identity() != known.identity {
        let why = format!(
            "it was run by coadapt {}, or {} or its profile has changed since",
            known.version, known.found
        );
        return Err(StudyError::OtherStudy { path: (*first).clone(), why });
    }
    let card = Card { shard: 1, shards: 1, ..known.clone() };
    Ok(Merged { study, card, folders: folders.to_vec() })
}

impl Merged {
    /// What came of the run of that `number`: of several results one that is done.
    #[must_use]
    pub fn read(&self, number: u32) -> Option<Kept> {
        let mut found: Option<Kept> = None;
        for kept in self.folders.iter().filter_map(|folder| read(folder, number)) {
            let is_better =
                found.as_ref().is_none_or(|found| matches!(found.outcome, Outcome::Failed(_)));
            if is_better {
                found = Some(kept);
            }
        }
        found
    }

    /// The shards that none of the folders holds, by the number of shards that they say.
    #[must_use]
    pub fn absent(&self) -> BTreeMap<u32, Vec<u32>> {
        let mut held: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for card in self.folders.iter().filter_map(|folder| card(folder).ok()) {
            held.entry(card.shards).or_default().push(card.shard);
        }
        held.into_iter()
            .map(|(of, held)| (of, (1..=of).filter(|shard| !held.contains(shard)).collect()))
            .filter(|(_, absent): &(u32, Vec<u32>)| !absent.is_empty())
            .collect()
    }
}
