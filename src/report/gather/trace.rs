//! What the step rows of a session tell, in a tenth of the memory.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;

use crate::record::skim::{Number, Row, Skim, Spoilt};
use crate::record::{EpisodeRow, Error};
use crate::report::words::Plane;
use crate::session::Phase;
use crate::signal::End;

/// Ticks shown of the beginning and the end of main.
const WINDOW: usize = 500;
/// Moments of a region that are kept.
const MOMENTS: f64 = 300.0;

/// What the step rows of a session tell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Where the plant went in each phase.
    pub portraits: BTreeMap<Phase, Portrait>,
    /// How success and share went in each region, in main; regions in the order of their names.
    pub regions: Vec<RegionTrack>,
    /// The actions at main's beginning
    pub opening: Vec<Acted>,
    /// and at its end.
    pub closing: Vec<Acted>,
    /// Ticks of main.
    pub ticks: u64,
    /// Steps of the rollouts in `episodes.csv`,
    pub steps: u64,
    /// and how many of these have a row.
    pub found: u64,
    /// Rows of a step that was there already.
    pub doubled: usize,
}

/// Where the plant went, in the plane of the task's phase portraits.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Portrait {
    /// The rollouts that are shown,
    pub tracks: Vec<Vec<(f64, f64)>>,
    /// of how many there were,
    pub of: usize,
    /// with each how many-th tick of theirs.
    pub every: usize,
}

/// How success and share went in a region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RegionTrack {
    /// Its name.
    pub name: String,
    /// Some moments of main in it.
    pub moments: Vec<Moment>,
}

/// A moment of main.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Controlled time of main, s.
    pub t: f64,
    /// The region's success; none before it is known.
    pub success: Option<f64>,
    /// The person's share.
    pub share: f64,
}

/// The actions of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Acted {
    /// Controlled time of main, s.
    pub t: f64,
    /// The person's action,
    pub human: Option<f64>,
    /// the robot's,
    pub machine: Option<f64>,
    /// and what both came to.
    pub net: Option<f64>,
}

/// Which rollouts of a phase are shown, so that they have about so many points together.
#[derive(Clone, Copy, Debug, Default)]
struct Thinning {
    of: usize,
    rollouts: usize,
    ticks: usize,
}

impl Thinning {
    fn of(rows: &[EpisodeRow], phase: Phase, points: usize) -> Self {
        let lengths = rows.iter().filter(|row| row.phase == phase && row.end != End::Discarded);
        let (of, total) =
            lengths.fold((0, 0), |(of, total), row| (of + 1, total + row.steps as usize));
        let too_many = total.div_ceil(points.max(1)).max(1);
        // Whole rollouts are what the eye wants; at least eight of them.
        let rollouts = too_many.min((of / 8).max(1));
        Self { of, rollouts, ticks: too_many.div_ceil(rollouts) }
    }
}

/// The reader's place.
struct Walk<'a> {
    rows: &'a [EpisodeRow],
    /// The row of `episodes.csv` that the attempt under way ends with.
    row: usize,
    /// That row, where there is one.
    here: Option<&'a EpisodeRow>,
    at: Option<(Phase, u32, u32)>,
    is_discarded: bool,
    /// Rollouts of the phase before this one.
    before: usize,
    /// Time of main before this rollout, s.
    offset: f64,
    last_t: f64,
}

impl Walk<'_> {
    /// Takes in that a row of `phase`, `episode` and `step` comes; false where it did already.
    fn go_to(&mut self, phase: Phase, episode: u32, step: u32) -> bool {
        let before = self.at.filter(|(p, e, _)| (*p, *e) == (phase, episode));
        if before.is_some_and(|(.., last)| step > last) {
            self.at = Some((phase, episode, step));
            return true;
        }
        // Attempts stand in both files in the same order; one that has no ticks is passed over.
        let is_it =
            |row: &EpisodeRow| (row.phase, row.episode) == (phase, episode) && row.steps > 0;
        let found = self.rows.iter().skip(self.row).position(is_it);
        let is_past = |row: &EpisodeRow| (row.phase, row.episode) == (phase, episode);
        if found.is_none() && self.rows.iter().take(self.row).rev().any(is_past) {
            return false;
        }
        match self.at {
            Some((old, ..)) if old == phase => {
                self.before += usize::from(!self.is_discarded);
                let duration = self.here.map_or(self.last_t, |row| row.duration_s);
                self.offset += if self.is_discarded { 0.0 } else { duration };
            }
            _ => (self.before, self.offset) = (0, 0.0),
        }
        self.here = found.and_then(|ahead| self.rows.get(self.row + ahead));
        self.is_discarded = self.here.is_some_and(|row| row.end == End::Discarded);
        self.row += found.map_or(0, |ahead| ahead + 1);
        self.at = Some((phase, episode, step));
        self.last_t = 0.0;
        true
    }
}

impl Trace {
    /// Reads the `steps.csv` at `path`, whose rollouts are `rows`, and keeps about so many `points`
    /// of each phase. Also what had to be passed over.
    ///
    /// # Errors
    /// When the file cannot be read, or is another table.
    pub(super) fn read(
        path: &Path,
        rows: &[EpisodeRow],
        plane: &Plane,
        points: usize,
    ) -> Result<(Self, Spoilt), Error> {
        let thinning = Phase::ALL.map(|phase| Thinning::of(rows, phase, points));
        let of_phase = |phase: Phase| {
            Phase::ALL
                .iter()
                .position(|other| *other == phase)
                .map_or_else(Thinning::default, |at| thinning[at])
        };
        let main = rows.iter().filter(|row| row.phase == Phase::Main);
        let apart = main.map(|row| row.duration_s).sum::<f64>() / MOMENTS;
        let mut skim = Skim::open(path)?;
        let mut trace = Self::default();
        let mut closing = VecDeque::with_capacity(WINDOW + 1);
        let mut walk = Walk {
            rows,
            row: 0,
            here: None,
            at: None,
            is_discarded: false,
            before: 0,
            offset: 0.0,
            last_t: 0.0,
        };
        while let Some(row) = skim.next_row()? {
            let Some(phase) = row.phase() else { continue };
            let (episode, step) = (row.episode(), row.step());
            if !walk.go_to(phase, episode, step) {
                trace.doubled += 1;
                continue;
            }
            trace.found += u64::from(walk.here.is_some_and(|row| step < row.steps));
            if walk.is_discarded {
                continue;
            }
            walk.last_t = row.t();
            if phase != Phase::Introduction {
                let portrait = trace.portraits.entry(phase).or_default();
                portrait.take(&row, step, walk.before, of_phase(phase), plane);
            }
            if phase == Phase::Main {
                trace.act(&row, walk.offset + walk.last_t, apart, &mut closing);
            }
        }
        trace.closing = closing.into();
        trace.steps = rows.iter().map(|row| u64::from(row.steps)).sum();
        trace.regions.sort_by(|a, b| a.name.cmp(&b.name));
        Ok((trace, skim.spoilt()))
    }

    /// That steps of its rollouts have no row, in words, where there are more than the `spoilt` ones.
    pub(super) fn missing_beside(&self, spoilt: u64) -> Option<String> {
        let missing = self.steps - self.found.min(self.steps);
        match self.found {
            _ if missing <= spoilt => None,
            0 => Some("no step of its rollouts is there: no figures of single ticks".to_owned()),
            _ => Some(format!(
                "{missing} of the {} steps of its rollouts are not there: figures of single ticks \
                 show the others",
                self.steps
            )),
        }
    }

    /// Takes in a tick of main at time `t`.
    fn act(&mut self, row: &Row<'_>, t: f64, apart: f64, closing: &mut VecDeque<Acted>) {
        let Some(share) = row.number(Number::Share) else { return };
        self.ticks += 1;
        let acted = || Acted {
            t,
            human: row.number(Number::Human),
            machine: row.number(Number::Machine),
            net: row.number(Number::Mixed),
        };
        if self.opening.len() < WINDOW {
            self.opening.push(acted());
        }
        if closing.len() == WINDOW {
            closing.pop_front();
        }
        closing.push_back(acted());
        let name = row.region();
        let at = self.regions.iter().position(|region| region.name == name);
        let at = at.unwrap_or_else(|| {
            self.regions.push(RegionTrack { name: name.to_owned(), moments: Vec::new() });
            self.regions.len() - 1
        });
        let track = &mut self.regions[at];
        if track.moments.last().is_none_or(|last| t - last.t >= apart) {
            let success = row.number(Number::Success);
            track.moments.push(Moment { t, success, share });
        }
    }
}

impl Portrait {
    fn take(&mut self, row: &Row<'_>, step: u32, before: usize, thin: Thinning, plane: &Plane) {
        (self.of, self.every) = (self.of.max(before + 1).max(thin.of), thin.ticks.max(1));
        let is_shown = before.is_multiple_of(thin.rollouts.max(1));
        if !is_shown || !(step as usize).is_multiple_of(self.every) {
            return;
        }
        if step == 0 || self.tracks.is_empty() {
            self.tracks.push(Vec::new());
        }
        if let Some(track) = self.tracks.last_mut() {
            let point = plane.point(|index| row.state(index));
            // A pole that goes round leaves the picture on one side and comes in on the other.
            let jumps = |last: &(f64, f64)| plane.goes_round && (last.0 - point.0).abs() > 180.0;
            if track.last().is_some_and(jumps) {
                track.push((f64::NAN, f64::NAN));
            }
            track.push(point);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;

    use super::*;
    use crate::report::words::plane;
    use crate::signal::Tallied;

    fn rollout(episode: u32, steps: u32, end: End) -> EpisodeRow {
        EpisodeRow {
            phase: Phase::Main,
            episode,
            start: 0.0,
            steps,
            duration_s: 0.02 * f64::from(steps),
            end,
            total: 0.0,
            mean_reward: 0.0,
            share: None,
            success: None,
            receptive_fields: None,
            tallied: Tallied::default(),
        }
    }

    #[test]
    fn a_discarded_attempt_is_not_shown_and_takes_no_time() {
        let rows = [(1, End::Failed), (2, End::Discarded), (2, End::Failed)]
            .map(|(n, end)| rollout(n, 2, end));
        let mut text = "phase,episode,step,t,x,x_dot,theta,theta_dot,u_human,u_machine,share,u,\
                        u_applied,reward,success,region,lateness_us\n"
            .to_owned();
        for (attempt, row) in rows.iter().enumerate() {
            let n = row.episode;
            for (step, t) in [(0, 0.0), (1, 0.02)] {
                let theta = format!("0.{attempt}{step}");
                let row = "1.0,2.0,0.5,1.5,1.5,0.0,,all,0";
                writeln!(text, "main,{n},{step},{t},0.0,0.0,{theta},0.0,{row}").unwrap();
            }
            writeln!(text, "main,{n},2,0.04,0.0,0.0,0.5,0.0,,,,,,,,,0").unwrap();
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("steps.csv");
        std::fs::write(&path, text).unwrap();
        let (trace, spoilt) = Trace::read(&path, &rows, &plane("balance"), 100).unwrap();
        assert_eq!(spoilt, Spoilt::default());
        let portrait = &trace.portraits[&Phase::Main];
        assert_eq!((portrait.tracks.len(), portrait.of), (2, 2));
        assert!((portrait.tracks[1][1].0 - 0.21_f64.to_degrees()).abs() < 1e-9);
        let times: Vec<f64> = trace.opening.iter().map(|acted| acted.t).collect();
        assert_eq!(times, [0.0, 0.02, 0.04, 0.06]);
        assert_eq!(trace.closing, trace.opening);
        assert_eq!(trace.regions[0].name, "all");
        assert_eq!((trace.steps, trace.found, trace.doubled), (6, 6, 0));
        assert_eq!(trace.missing_beside(0), None);
    }

    #[test]
    fn steps_that_are_missing_or_doubled_are_known_and_move_nothing() {
        let rows = [(1, End::Failed), (2, End::Failed), (3, End::Failed)]
            .map(|(n, end)| rollout(n, 2, end));
        let head = "phase,episode,step,t,x,x_dot,theta,theta_dot,u_human,u_machine,share,u,\
                    u_applied,reward,success,region,lateness_us\n";
        let row = |n: u32, step: u32| {
            format!(
                "main,{n},{step},{},0.0,0.0,0.1,0.0,1.0,2.0,0.5,1.5,1.5,0.0,,all,0\n",
                0.02 * f64::from(step)
            )
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("steps.csv");
        let read = |ticks: &[(u32, u32)]| {
            let ticks: String = ticks.iter().map(|(n, step)| row(*n, *step)).collect();
            std::fs::write(&path, format!("{head}{ticks}")).unwrap();
            Trace::read(&path, &rows, &plane("balance"), 100).unwrap().0
        };
        let last = |trace: &Trace| trace.closing.last().unwrap().t;
        let whole = read(&[(1, 0), (1, 1), (2, 0), (2, 1), (3, 0), (3, 1)]);
        assert_eq!((whole.found, whole.doubled, last(&whole)), (6, 0, 0.1));
        // A row, and a block over a rollout's end, twice.
        let doubled =
            read(&[(1, 0), (1, 1), (1, 1), (2, 0), (1, 1), (2, 0), (2, 1), (3, 0), (3, 1)]);
        assert_eq!((doubled.found, doubled.doubled, last(&doubled)), (6, 3, 0.1));
        let cut = read(&[(1, 0), (2, 1), (3, 0), (3, 1)]);
        assert_eq!((cut.found, last(&cut)), (4, 0.1));
        assert!(cut.missing_beside(1).unwrap().starts_with("2 of the 6 steps"));
        assert!(read(&[]).missing_beside(0).unwrap().starts_with("no step"));
    }

    #[test]
    fn long_sessions_are_thinned_by_whole_rollouts_first() {
        let rows: Vec<EpisodeRow> = (1..=100).map(|n| rollout(n, 900, End::Cap)).collect();
        let thin = Thinning::of(&rows, Phase::Main, 4000);
        assert_eq!((thin.of, thin.rollouts, thin.ticks), (100, 12, 2));
        let short = Thinning::of(&rows[..1], Phase::Main, 4000);
        assert_eq!((short.rollouts, short.ticks), (1, 1));
    }
}
