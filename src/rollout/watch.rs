//! Observation and interruption of a running batch.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};

/// Flags through which other threads observe and end a batch.
#[derive(Debug, Default, Clone, Copy)]
pub struct RolloutWatch<'a> {
    /// Ends the batch within one step of each rollout after it is set.
    pub interrupt: Option<&'a Arc<AtomicBool>>,
    /// Number of completed steps of all rollouts, updated in chunks.
    pub done: Option<&'a AtomicU64>,
}
