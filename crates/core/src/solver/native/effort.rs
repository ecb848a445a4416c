//! Iteration counter of an island, limited for each stage and interruptible.

use super::settings::{LIMITED_ITERATIONS, LIMITED_STAGES, STAGE_ITERATIONS};
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
    /// Number of stages that may still begin, if limited.
    stages: Option<u32>,
}

impl<'a> SolveEffort<'a> {
    /// Counter at zero.
    pub(super) fn new(interrupt: Option<&'a AtomicBool>) -> Self {
        let stage_end = STAGE_ITERATIONS;
        Self { interrupt, iterations: 0, stage_end, interrupted: false, stages: None }
    }

    /// Allows only a few short stages.
    pub(super) fn limit(&mut self) {
        self.stages = Some(LIMITED_STAGES);
    }

    /// Begins another stage.
    pub(super) fn begin_stage(&mut self) {
        let allowed = if self.stages.is_some() { LIMITED_ITERATIONS } else { STAGE_ITERATIONS };
        self.stages = self.stages.map(|left| left.saturating_sub(1));
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
        self.interrupted || self.stages == Some(0)
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
