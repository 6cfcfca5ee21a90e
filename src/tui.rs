//! The screens: pictures of plain data.
//!
//! Everything here that draws is a pure function of what it is given: facts of the session
//! ([`live::Info`]), the control thread's latest [snapshot](crate::control::snapshot), what
//! is known of the rollouts, and the state of the screen itself. Nothing reads a clock, a
//! file or a device, so a picture can be tested, and drawing can never hold up a tick.
//!
//! What is said by colour is also said by a word or a shape, and every number has a fixed
//! place and a fixed width: what moves on the screen is what moves in the experiment.

pub mod app;
pub mod briefing;
pub mod canvas;
pub mod devices;
pub mod help;
pub mod keys;
pub mod live;
pub mod palette;
pub mod pen;
pub mod plant;
pub mod replay;
pub mod report;
pub mod results;
pub mod scene;
pub mod sensitivity;
pub mod setup;
pub mod small;
pub mod terminal;
pub mod text;
pub mod watch;
