//! The doorbell: everything else is the library.

fn main() {}
