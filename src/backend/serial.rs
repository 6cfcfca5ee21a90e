//! The plant at the end of a serial line.

pub mod ports;
