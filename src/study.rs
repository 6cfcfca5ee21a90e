//! Runs without a screen: evaluation of policies, fits of tables, open-loop simulation, and
//! studies of many sessions.

pub mod batch;
pub mod evaluate;
pub mod fit;
pub mod simulate;
pub mod table;
