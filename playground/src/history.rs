//! States of the past, from which earlier steps are computed again.

use std::collections::VecDeque;
use tumble_core::simulation::summary::RunSummary;
use tumble_core::simulation::{Saved, Simulation};

/// Number of bodies in all kept states. One takes up to 10 kB.
const MOST_KEPT: usize = 6000;
/// Number of bodies in the kept states of a session before a change.
const MOST_KEPT_BEFORE: usize = 600;
/// Maximum number of kept states.
const MOST_STATES: usize = 1000;

/// A kept state.
pub struct SavedState {
    /// The simulation.
    pub saved: Saved,
    /// Counts of the steps before.
    pub summary: RunSummary,
}

/// States kept for the way back, the oldest first. Many bodies have fewer states, at shorter intervals.
#[derive(Default)]
pub struct History {
    states: VecDeque<SavedState>,
}

impl History {
    /// Keeps the state of a simulation if it is due.
    pub fn store(&mut self, simulation: &Simulation<'_>, summary: &RunSummary) {
        let bodies = simulation.states().len();
        let every = if bodies <= 4 { 64 } else { 8 };
        let last = self.states.back().map(|kept| kept.saved.index());
        if last.is_some_and(|last| simulation.index() < last + every) {
            return;
        }
        self.states.push_back(SavedState { saved: simulation.save(), summary: summary.clone() });
        let most = (MOST_KEPT / bodies.max(1)).clamp(2, MOST_STATES);
        while self.states.len() > most {
            self.states.pop_front();
        }
    }

    /// Last state before step `index`, or the first of all if that is at `index`.
    pub fn before(&self, index: u64) -> Option<&SavedState> {
        let earlier = self.states.iter().rev().find(|kept| kept.saved.index() < index);
        earlier.or_else(|| self.states.front().filter(|kept| kept.saved.index() == index))
    }

    /// Forgets all but the last states of a simulation of as many `bodies`.
    pub fn shorten(&mut self, bodies: usize) {
        let most = (MOST_KEPT_BEFORE / bodies.max(1)).clamp(2, MOST_STATES);
        let surplus = self.states.len().saturating_sub(most);
        self.states.drain(..surplus);
    }

    /// Forgets the states after step `index`.
    pub fn forget_after(&mut self, index: u64) {
        self.states.retain(|kept| kept.saved.index() <= index);
    }
}
