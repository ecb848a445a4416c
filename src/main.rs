//! The command line of tumble. See `tumble --help`.
//!
//! Exit codes: 0 done; 2 bad input; 3 finished, but some step did not converge;
//! 130 interrupted; 1 anything else.

#![forbid(unsafe_code)]

mod cli;

use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::run() {
        Ok(outcome) => outcome.exit_code(),
        Err(failure) => {
            // Standard error may be closed; the exit code says it all the same.
            let _ = writeln!(std::io::stderr(), "tumble: {failure}");
            cli::exit_code(&failure)
        }
    }
}
