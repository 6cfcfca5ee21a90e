//! The doorbell: everything else is the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    coadapt::run::run()
}
