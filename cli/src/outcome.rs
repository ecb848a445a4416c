//! Results of a command.

use std::process::ExitCode;
pub use tumble_model::failure::Failure;

/// Result of a command that ran.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Success.
    Done,
    /// Finished, but some step is failed or wild.
    Unconverged,
    /// Ctrl-C: the results so far are written.
    Interrupted,
    /// `verify` found certificates that differ from its steps.
    Mismatch,
}

impl Outcome {
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::Done => ExitCode::SUCCESS,
            Self::Mismatch => ExitCode::from(1),
            Self::Unconverged => ExitCode::from(3),
            Self::Interrupted => ExitCode::from(130),
        }
    }
}

/// Exit code of a command that ended early.
pub fn exit_code(failure: &Failure) -> ExitCode {
    match failure {
        Failure::Input(_) | Failure::Setting { .. } => ExitCode::from(2),
        Failure::Other(_) => ExitCode::from(1),
    }
}

/// Rejects every given flag: it has no effect with `place`. `flags` holds each flag and whether it was
/// given.
pub fn refuse_flags(place: &str, flags: &[(&str, bool)]) -> Result<(), Failure> {
    Failure::refuse_idle(place, flags).map_err(Failure::as_flag)
}
