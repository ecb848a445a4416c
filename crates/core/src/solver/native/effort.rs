//! Iterations of an island: counted, limited for each stage, and interruptible.

use super::settings::STAGE_ITERATIONS;
use crate::error::Error;
use std::sync::atomic::{AtomicBool, Ordering};

/// Counts the iterations of an island over all stages, and looks for an interrupt before each.
#[derive(Debug)]
pub(super) struct SolveEffort<'a> {
    interrupt: Option<&'a AtomicBool>,
    iterations: u32,
    /// The count at which the stage at hand ends.
    stage_end: u32,
    interrupted: bool,
}

impl<'a> SolveEffort<'a> {
    /// Nothing spent yet.
    pub(super) fn new(interrupt: Option<&'a AtomicBool>) -> Self {
        Self { interrupt, iterations: 0, stage_end: STAGE_ITERATIONS, interrupted: false }
    }

    /// Begins another stage.
    pub(super) fn begin_stage(&mut self) {
        self.stage_end = self.iterations.saturating_add(STAGE_ITERATIONS);
    }

    /// Counts one iteration more; `false` if the stage is over.
    pub(super) fn spend(&mut self) -> bool {
        self.interrupted |= self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed));
        if self.is_over() {
            return false;
        }
        self.iterations = self.iterations.saturating_add(1);
        true
    }

    /// Whether the stage at hand has used up its iterations, or the step is interrupted.
    pub(super) fn is_over(&self) -> bool {
        self.interrupted || self.iterations >= self.stage_end
    }

    /// Whether the step is interrupted.
    pub(super) fn is_interrupted(&self) -> bool {
        self.interrupted
    }

    /// The iterations of all stages so far.
    pub(super) fn iterations(&self) -> u32 {
        self.iterations
    }

    /// # Errors
    /// [`Error::Interrupted`] if the step was.
    pub(super) fn check(&self) -> Result<(), Error> {
        if self.interrupted { Err(Error::Interrupted) } else { Ok(()) }
    }
}
