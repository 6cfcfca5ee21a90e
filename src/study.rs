//! Runs without a screen: evaluation of policies, fits of tables, open-loop simulation, sessions
//! done once more, and studies of many.

pub mod batch;
pub mod evaluate;
pub mod fit;
pub mod simulate;
pub mod table;
pub mod verify;
