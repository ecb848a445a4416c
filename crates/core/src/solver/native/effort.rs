//! Iteration counter of an island, limited for each stage and interruptible.

use super::settings::{NEWTON_ITERATIONS, STAGE_ITERATIONS};
use crate::error::Error;
use std::sync::atomic::{AtomicBool, Ordering};

/// Counts the iterations of an island over all stages, and checks for an interrupt before each.
#[derive(Debug)]
pub(super) struct SolveEffort<'a> {
    interrupt: Option<&'a AtomicBool>,
    iterations: u32,
    /// Count at which the current stage ends.
    stage_end: u32,
    interrupted: bool,
    /// True for one short stage.
    is_limited: bool,
}

impl<'a> SolveEffort<'a> {
    /// Counter at zero.
    pub(super) fn new(interrupt: Option<&'a AtomicBool>) -> Self {
        let stage_end = STAGE_ITERATIONS;
        Self { interrupt, iterations: 0, stage_end, interrupted: false, is_limited: false }
    }

    /// Allows only one stage, with a few iterations. The island has no solution.
    pub(super) fn limit(&mut self) {
        self.is_limited = true;
    }

    /// Begins another stage.
    pub(super) fn begin_stage(&mut self) {
        let allowed = if self.is_limited { NEWTON_ITERATIONS } else { STAGE_ITERATIONS };
        self.stage_end = self.iterations.saturating_add(allowed);
    }

    /// Counts one iteration. Returns false if the stage is over.
    pub(super) fn spend(&mut self) -> bool {
        self.interrupted |= self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed));
        if self.is_over() {
            return false;
        }
        self.iterations = self.iterations.saturating_add(1);
        true
    }

    /// True if the current stage has used up its iterations or the step is interrupted.
    pub(super) fn is_over(&self) -> bool {
        self.interrupted || self.iterations >= self.stage_end
    }

    /// True if no further stage may begin.
    pub(super) fn is_last_stage(&self) -> bool {
        self.interrupted || self.is_limited
    }

    /// Number of iterations of all stages so far.
    pub(super) fn iterations(&self) -> u32 {
        self.iterations
    }

    /// Returns an error if the step was interrupted.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if the step was interrupted.
    pub(super) fn check(&self) -> Result<(), Error> {
        if self.interrupted { Err(Error::Interrupted) } else { Ok(()) }
    }
}
