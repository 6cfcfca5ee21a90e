//! The plant at the end of a serial line.

pub mod driver;
pub mod ports;
pub mod scales;
