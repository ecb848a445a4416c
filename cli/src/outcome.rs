//! How a command ends.

use std::process::ExitCode;
pub use tumble_model::failure::{Failure, refuse_flags};

/// How a command ended well.
pub enum Outcome {
    /// All is as it should be.
    Done,
    /// Finished, but some step did not converge.
    Unconverged,
    /// Ctrl-C: what was computed is written.
    Interrupted,
    /// `verify` found that the file's certificates are not those of its steps, or `validate`
    /// that a quantity is off.
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

/// The exit code of a command that ended early.
pub fn exit_code(failure: &Failure) -> ExitCode {
    match failure {
        Failure::Input(_) | Failure::Setting { .. } => ExitCode::from(2),
        Failure::Other(_) => ExitCode::from(1),
    }
}
