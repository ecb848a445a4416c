//! Results of a command.

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
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Mismatch => 1,
            Self::Unconverged => 3,
            Self::Interrupted => 130,
        }
    }
}

/// Exit code of a command that ended early.
pub fn exit_code(failure: &Failure) -> u8 {
    match failure {
        Failure::Input(_) | Failure::Setting { .. } => 2,
        Failure::Other(_) => 1,
    }
}

/// Rejects every given flag: it has no effect with `place`. `flags` holds each flag and whether it was
/// given.
pub fn refuse_flags(place: &str, flags: &[(&str, bool)]) -> Result<(), Failure> {
    Failure::refuse_idle(place, flags).map_err(Failure::as_flag)
}
