//! The scale of success where a task measures people by their own practice.

use crate::record::EpisodeRow;
use crate::session::Phase;
use crate::sharing::region::Region;
use crate::signal::End;
use crate::task::{OwnScale, Task};

/// The regions of `task` as main has them after the rollouts `earlier`; and, where the
/// scale goes by the person's introduction, how it was found.
#[must_use]
pub fn regions(task: &dyn Task, earlier: &[EpisodeRow]) -> (Vec<Region>, Option<String>) {
    let mut regions = task.regions().to_vec();
    let practice = earlier.iter().filter(|row| {
        row.phase == Phase::Introduction && !matches!(row.end, End::Discarded | End::Aborted)
    });
    let (total, steps) = practice
        .fold((0.0, 0.0), |(total, steps), row| (total + row.total, steps + f64::from(row.steps)));
    let Some(OwnScale { scale, why }) = task.own_scale((steps > 0.0).then(|| total / steps)) else {
        return (regions, None);
    };
    for region in &mut regions {
        region.scale = scale;
    }
    (regions, Some(why))
}
