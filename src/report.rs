//! What came out: measures of a session's rollouts.

pub mod metrics;
