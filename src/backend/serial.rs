//! The plant at the end of a serial line.

#[cfg(test)]
mod bench;
pub mod calibration;
pub mod centre;
pub mod driver;
pub mod ports;
pub mod scales;
pub mod shelf;
