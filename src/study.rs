//! Runs without a screen: evaluation of policies, fits of tables, open-loop
//! simulation.

pub mod evaluate;
pub mod fit;
pub mod simulate;
pub mod table;
