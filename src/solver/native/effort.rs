//! What a step has cost so far, and when to give it up.

use super::tolerances::BUDGET;
use crate::error::Error;
use crate::step::Step;

/// Counts the iterations of a step, over all its starts, and asks for an interrupt before each.
#[derive(Debug)]
pub(super) struct Effort<'a> {
    step: &'a Step<'a>,
    iterations: u32,
    interrupted: bool,
}

impl<'a> Effort<'a> {
    pub(super) fn new(step: &'a Step<'a>) -> Self {
        Self { step, iterations: 0, interrupted: false }
    }

    /// One iteration more; `false` where there is to be none.
    pub(super) fn spend(&mut self) -> bool {
        self.interrupted |= self.step.check_interrupt().is_err();
        if self.is_over() {
            return false;
        }
        self.iterations += 1;
        true
    }

    /// Whether the budget is used up or the step interrupted.
    pub(super) fn is_over(&self) -> bool {
        self.interrupted || self.iterations >= BUDGET
    }

    pub(super) fn iterations(&self) -> u32 {
        self.iterations
    }

    /// # Errors
    /// [`Error::Interrupted`] if it was.
    pub(super) fn check(&self) -> Result<(), Error> {
        if self.interrupted { Err(Error::Interrupted) } else { Ok(()) }
    }
}
