//! The plant at the end of a serial line.

pub mod address;
pub mod driver;
mod greeting;
mod params;
#[cfg(unix)]
pub mod port;
pub mod ports;
pub mod scales;

pub use params::Params;
