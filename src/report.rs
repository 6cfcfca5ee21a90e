//! What came out: measures of a session's rollouts.

pub mod achieved;
pub mod metrics;
pub mod spread;
pub mod statistics;
