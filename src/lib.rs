//! coadapt: the terminal laboratory for simultaneous human–robot learning.

pub mod backend;
pub mod check;
pub mod clock;
pub mod control;
pub mod learner;
pub mod operator;
pub mod plant;
pub mod profile;
pub mod random;
pub mod record;
pub mod report;

pub mod session;
pub mod sharing;
pub mod signal;
pub mod task;
pub mod teaching;
pub mod tui;
