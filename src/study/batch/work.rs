//! Runs, as many at a time as there are threads for.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use super::StudyError;
use super::folder::{Folder, Kept, Outcome};
use super::plan::Run;
use super::results::Done;
use super::session::Failure;
use crate::clock::processor_time;

/// A run that is over, as it is told of.
#[derive(Clone, Debug)]
pub struct Progress {
    /// Runs that are over so far, of those that were open,
    pub over: usize,
    /// and how many were open.
    pub of: usize,
    /// Why the run failed, if it did.
    pub failed: Option<(u32, String)>,
}

/// How runs went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Done,
    pub done: usize,
    /// gone wrong,
    pub failed: usize,
    /// and not begun, or given up, since the end was asked for.
    pub left: usize,
}

/// Carries out a run, unless it is asked to give up.
pub type Perform<'a> = dyn Fn(&Run, &dyn Fn() -> bool) -> Result<Done, Failure> + Sync + 'a;

/// What work on runs needs.
pub struct Desk<'a> {
    /// Where they are kept.
    pub folder: &'a Folder,
    /// Threads.
    pub jobs: usize,
    /// The most memory that this program has used, MiB.
    pub memory: &'a (dyn Fn() -> Option<f64> + Sync),
    /// Hears of each run that is over.
    pub told: &'a (dyn Fn(Progress) + Sync),
    /// Says when to give up.
    pub is_enough: &'a (dyn Fn() -> bool + Sync),
}

/// Carries out `runs` by `perform`, and keeps what comes of each at once. A run that fails is
/// kept as that, and the others go on.
///
/// # Errors
/// When something could not be kept; what is finished stays.
pub fn work(runs: &[&Run], desk: &Desk<'_>, perform: &Perform<'_>) -> Result<Tally, StudyError> {
    let (next, over) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let tally = Mutex::new(Tally::default());
    let refused = Mutex::new(None);
    let is_refused = AtomicBool::new(false);
    let ends = || is_refused.load(Ordering::Relaxed) || (desk.is_enough)();
    let worker = || {
        while !ends()
            && let Some(run) = runs.get(next.fetch_add(1, Ordering::Relaxed))
        {
            let kept = attempt(run, perform, &ends, desk.memory)
                .and_then(|kept| kept.map(|kept| keep(desk.folder, run, kept)).transpose());
            let failed = match kept {
                Ok(Some(failed)) => failed.map(|why| (run.number, why)),
                Ok(None) => continue,
                Err(error) => {
                    refused.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                    is_refused.store(true, Ordering::Relaxed);
                    return;
                }
            };
            {
                let mut tally = tally.lock().unwrap_or_else(PoisonError::into_inner);
                tally.done += usize::from(failed.is_none());
                tally.failed += usize::from(failed.is_some());
            }
            let over = over.fetch_add(1, Ordering::Relaxed) + 1;
            (desk.told)(Progress { over, of: runs.len(), failed });
        }
    };
    thread::scope(|scope| {
        // One of the workers is this thread.
        for _ in 1..desk.jobs.clamp(1, runs.len().max(1)) {
            let named = thread::Builder::new().name("coadapt-study".to_owned());
            // With fewer threads it only takes longer.
            let _ = named.spawn_scoped(scope, worker);
        }
        worker();
    });
    if let Some(error) = refused.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    let mut tally = tally.into_inner().unwrap_or_else(PoisonError::into_inner);
    tally.left = runs.len() - tally.done - tally.failed;
    Ok(tally)
}

/// Keeps what came of `run`; returns why it came to nothing, if so. What cannot be written
/// whatever the disk, such as a number that is not finite, is a failure of this run alone.
fn keep(folder: &Folder, run: &Run, mut kept: Kept) -> Result<Option<String>, StudyError> {
    match folder.keep(run.number, &kept) {
        Err(StudyError::File(error)) => {
            kept.outcome = Outcome::Failed(error.to_string());
            folder.keep(run.number, &kept)?;
        }
        other => other?,
    }
    Ok(match kept.outcome {
        Outcome::Failed(why) => Some(why),
        Outcome::Done(_) => None,
    })
}

/// Carries out `run`; nothing is kept of one that was given up.
fn attempt(
    run: &Run,
    perform: &Perform<'_>,
    ends: &dyn Fn() -> bool,
    memory: &dyn Fn() -> Option<f64>,
) -> Result<Option<Kept>, StudyError> {
    let before = processor_time();
    // A fault in one run is no reason to lose the others.
    let done = catch_unwind(AssertUnwindSafe(|| perform(run, ends)));
    let outcome = match done {
        Ok(Ok(done)) => Outcome::Done(Box::new(done)),
        Ok(Err(Failure::Interrupted)) => return Ok(None),
        Ok(Err(Failure::Refused(error))) => return Err(error),
        Ok(Err(Failure::Failed(why))) => Outcome::Failed(why),
        Err(panic) => {
            let words = panic
                .downcast_ref::<String>()
                .map(String::as_str)
                .or_else(|| panic.downcast_ref::<&str>().copied());
            Outcome::Failed(format!("a fault of coadapt itself: {}", words.unwrap_or("a panic")))
        }
    };
    let processor_s = processor_time().zip(before).map(|(after, before)| (after - before).0);
    let version = env!("CARGO_PKG_VERSION").to_owned();
    Ok(Some(Kept { version, outcome, processor_s, memory_mib: memory() }))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::profile::Text;
    use crate::study::batch::{Card, Changes, Shard, Study};

    fn study() -> Study {
        let text = "(profile: \"balance\", arms: [(name: \"a\", mode: sequential)], \
                    operators: [\"none\"], seeds: (count: 7), starts: [(name: \"g\", count: 1)])";
        let nowhere = Path::new("no-such");
        Study::of(&Text::new("x", text), nowhere, &Changes::default(), &|| false).unwrap()
    }

    fn folder(at: &Path, study: &Study) -> Folder {
        let card = Card {
            version: "1".to_owned(),
            name: study.name.clone(),
            task: study.task().to_owned(),
            preset: study.preset().to_owned(),
            found: study.name.clone(),
            sets: Vec::new(),
            seeds: None,
            shard: 1,
            shards: 1,
            identity: study.identity().to_owned(),
        };
        Folder::open(at, &card).unwrap()
    }

    fn nothing(study: &Study, run: &Run) -> Done {
        Done {
            labels: study.labels(run),
            rows: Vec::new(),
            cells: Vec::new(),
            curve: Vec::new(),
            table: None,
            trajectories: Vec::new(),
        }
    }

    /// Carries out what is open, with faults in the runs 2 and 3 if `is_bad`; how it went.
    fn carry_out(study: &Study, folder: &Folder, is_bad: bool, jobs: usize) -> Tally {
        let (open, _) = folder.open_runs(study, Shard::WHOLE);
        let (memory, told, is_enough) = (|| Some(1.0), |_| {}, || false);
        let desk = Desk { folder, jobs, memory: &memory, told: &told, is_enough: &is_enough };
        work(&open, &desk, &|run, _| match run.number {
            2 if is_bad => Err(Failure::Failed("the pole broke".to_owned())),
            3 if is_bad => std::panic::panic_any("the sky fell".to_owned()),
            _ => Ok(nothing(study, run)),
        })
        .unwrap()
    }

    #[test]
    fn a_run_that_fails_is_kept_as_that_and_stops_no_other() {
        for jobs in [1, 4] {
            let home = tempfile::tempdir().unwrap();
            let study = study();
            let folder = folder(home.path(), &study);
            let tally = carry_out(&study, &folder, true, jobs);
            assert_eq!(tally, Tally { done: 5, failed: 2, left: 0 });
            let outcome = |number| crate::study::batch::read(home.path(), number).unwrap().outcome;
            assert!(matches!(outcome(2), Outcome::Failed(why) if why == "the pole broke"));
            assert!(matches!(outcome(3), Outcome::Failed(why) if why.contains("the sky fell")));
            // They are tried once more; what is done is not done again.
            assert_eq!(carry_out(&study, &folder, false, jobs).done, 2);
            assert_eq!(folder.open_runs(&study, Shard::WHOLE), (Vec::new(), 7));
        }
    }

    #[test]
    fn a_number_that_is_not_finite_is_a_failure_of_its_run_alone() {
        let home = tempfile::tempdir().unwrap();
        let study = study();
        let folder = folder(home.path(), &study);
        let (open, _) = folder.open_runs(&study, Shard::WHOLE);
        let desk = Desk {
            folder: &folder,
            jobs: 2,
            memory: &|| None,
            told: &|_| {},
            is_enough: &|| false,
        };
        let tally = work(&open, &desk, &|run, _| {
            let mut done = nothing(&study, run);
            if run.number == 3 {
                done.cells.push(crate::study::batch::Cells {
                    checkpoint: 100,
                    readout: String::new(),
                    start: String::new(),
                    values: vec![f64::INFINITY],
                    returns: Vec::new(),
                });
            }
            Ok(done)
        });
        assert_eq!(tally.unwrap(), Tally { done: 6, failed: 1, left: 0 });
        let kept = crate::study::batch::read(home.path(), 3).unwrap();
        assert!(matches!(kept.outcome, Outcome::Failed(why) if why.contains("cells")));
    }

    #[test]
    fn what_the_disk_refuses_a_run_stops_all() {
        let home = tempfile::tempdir().unwrap();
        let study = study();
        let folder = folder(home.path(), &study);
        let (open, _) = folder.open_runs(&study, Shard::WHOLE);
        let desk = Desk {
            folder: &folder,
            jobs: 1,
            memory: &|| None,
            told: &|_| {},
            is_enough: &|| false,
        };
        let full = || StudyError::disk("write", Path::new("s"), std::io::Error::other("full"));
        let refused = work(&open, &desk, &|run, _| match run.number {
            3 => Err(Failure::Refused(full())),
            _ => Ok(nothing(&study, run)),
        });
        assert!(matches!(refused, Err(StudyError::Disk { .. })));
        assert_eq!(folder.open_runs(&study, Shard::WHOLE).1, 2);
    }

    #[test]
    fn a_folder_serves_one_process_at_a_time() {
        let home = tempfile::tempdir().unwrap();
        let study = study();
        let _folder = folder(home.path(), &study);
        let again = super::super::folder::card(home.path()).unwrap();
        assert!(matches!(Folder::open(home.path(), &again), Err(StudyError::Busy { .. })));
    }
}
