//! Runs without a screen: evaluation of policies and open-loop simulation.

pub mod evaluate;
pub mod simulate;
