//! A partition of the state space: each region has a share of its own.

use serde::{Deserialize, Serialize};

/// How a region's measure becomes a success between 0 and 1 (eq. 9, 19, 28).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scale {
    /// The measure that counts as success 0.
    pub minimum: f64,
    /// The measure that counts as success 1.
    pub threshold: f64,
}

impl Scale {
    /// The saturating h of eq. 10 (as read in the errata: 1 above 1).
    #[must_use]
    pub fn success(&self, mean: f64) -> f64 {
        ((mean - self.minimum) / (self.threshold - self.minimum)).clamp(0.0, 1.0)
    }
}

/// One region of a task's partition. Which region a state is in is the task's to say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// The name in the log's `region` column.
    pub name: &'static str,
    /// How its measure is scaled.
    pub scale: Scale,
}
