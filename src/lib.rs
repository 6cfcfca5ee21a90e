//! coadapt: the terminal laboratory for simultaneous human–robot learning.

pub mod check;
pub mod clock;
pub mod learner;
pub mod operator;
pub mod plant;
pub mod random;
pub mod signal;
