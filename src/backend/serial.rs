//! The plant at the end of a serial line.

pub mod address;
#[cfg(test)]
mod bench;
pub mod calibration;
pub mod centre;
pub mod desk;
pub mod driver;
mod greeting;
mod params;
#[cfg(unix)]
pub mod port;
pub mod ports;
#[cfg(unix)]
pub mod pump;
mod rest;
pub mod scales;
pub mod shelf;
pub mod standing;
pub mod station;
pub mod wired;

pub use params::Params;
