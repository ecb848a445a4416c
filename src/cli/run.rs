//! What a run came to.

use std::time::Duration;
use tumble::simulation::summary::RunSummary;

/// How far a run came.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum End {
    Complete,
    /// Ctrl-C.
    Interrupted,
    /// A failed step under `--on-failure stop`.
    Stopped,
}

impl End {
    /// The word of run.json.
    pub fn name(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::Interrupted => "interrupted",
            Self::Stopped => "stopped",
        }
    }
}

pub struct Run {
    pub end: End,
    pub summary: RunSummary,
    /// Of the stepping alone.
    pub elapsed: Duration,
}
