//! The control thread: one tick, one straight line; and what others see of it.

pub mod snapshot;
