//! The control thread: one tick, one straight line; and what others see of it.

pub mod cycle;
mod effects;
mod learning;
pub mod recording;
mod rollout;
pub mod scale;
pub mod scribe;
pub mod snapshot;
pub mod watch;
pub mod witness;
