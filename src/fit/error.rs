//! What can be wrong with a fit's input.

use crate::error::Error;

/// Why a recording, a scene or a fit was refused: one sentence.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// A file that is no recording.
    #[error("{0}")]
    File(String),
    /// A row of a toss that cannot be.
    #[error("toss {toss}, row {row}: {why}")]
    Row {
        /// Which toss.
        toss: String,
        /// The frame, from 0.
        row: usize,
        /// What is wrong, and what would be right.
        why: String,
    },
    /// A toss that cannot be as a whole.
    #[error("toss {toss}: {why}")]
    Toss {
        /// Which toss.
        toss: String,
        /// What is wrong, and what would be right.
        why: String,
    },
    /// A scene that tosses cannot be simulated in.
    #[error("{0}")]
    Scene(String),
    /// A request that has no meaning: a count, a bound, a name.
    #[error("{0}")]
    Request(String),
    /// A toss that the library refuses to simulate.
    #[error("toss {toss} cannot be simulated: {error}")]
    Rollout {
        /// Which toss.
        toss: String,
        /// Why.
        error: Error,
    },
    /// The fit was given up because its interrupt flag was raised.
    #[error("the fit was interrupted")]
    Interrupted,
}
