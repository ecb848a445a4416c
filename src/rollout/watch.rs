//! A batch as it runs, seen from outside.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};

/// How others follow a batch and end it.
#[derive(Debug, Default, Clone, Copy)]
pub struct RolloutWatch<'a> {
    /// Ends the batch soon after it is raised, within a step of each rollout.
    pub interrupt: Option<&'a Arc<AtomicBool>>,
    /// Steps done so far, of all rollouts; it grows in chunks.
    pub done: Option<&'a AtomicU64>,
}
