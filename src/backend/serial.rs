//! The plant at the end of a serial line.

pub mod driver;
mod greeting;
mod params;
pub mod ports;
pub mod scales;

pub use params::Params;
