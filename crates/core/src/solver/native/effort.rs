//! What an island of a step has cost so far, and when to give it up.

use super::policy::Policy;
use super::tolerances::{BUDGET_CONTACTS, BUDGET_STARTS, LEAST_BUDGET};
use crate::error::Error;
use crate::step::Step;
use std::sync::atomic::{AtomicBool, Ordering};

/// Counts the iterations of an island, over all its starts, and asks for an interrupt before each.
#[derive(Debug)]
pub(super) struct SolveEffort<'a> {
    interrupt: Option<&'a AtomicBool>,
    iterations: u32,
    /// How many more there may be, and how many must be left for other starts when this one ends.
    left: u32,
    reserve: u32,
    interrupted: bool,
}

impl<'a> SolveEffort<'a> {
    /// That of an island of so many `bodies` and `contacts`: fewer iterations where each takes longer.
    pub(super) fn new(step: &Step<'a>, bodies: usize, contacts: usize) -> Self {
        Self::of(step.interrupt, Policy::of(bodies).budget, contacts)
    }

    /// The same within a budget for up to [`BUDGET_CONTACTS`].
    pub(super) fn of(interrupt: Option<&'a AtomicBool>, budget: u32, contacts: usize) -> Self {
        let cost = u32::try_from(contacts.div_ceil(BUDGET_CONTACTS)).unwrap_or(u32::MAX).max(1);
        let left = (budget / cost).max(LEAST_BUDGET);
        Self { interrupt, iterations: 0, left, reserve: 0, interrupted: false }
    }

    /// Another start: it may use up a part of what is left, and no more than `most` iterations.
    pub(super) fn begin_start(&mut self, most: u32) {
        self.reserve = self.left - self.left.div_ceil(BUDGET_STARTS).min(most);
    }

    /// One iteration more; `false` where there is to be none.
    pub(super) fn spend(&mut self) -> bool {
        self.interrupted |= self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed));
        if self.is_over() {
            return false;
        }
        self.iterations = self.iterations.saturating_add(1);
        self.left -= 1;
        true
    }

    /// Whether the start at hand has used up its part, or the step is interrupted.
    pub(super) fn is_over(&self) -> bool {
        self.interrupted || self.left <= self.reserve
    }

    /// Whether the whole budget is used up or the step interrupted.
    pub(super) fn is_used_up(&self) -> bool {
        self.interrupted || self.left == 0
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
