//! Ways to find controls, one after the other.

use super::mode::Modes;
use super::{PlanError, Problem, Replay};
use crate::mechanics::State;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A way to look for controls.
pub trait Leg: Send + Sync {
    /// Its word in files and reports.
    fn name(&self) -> &'static str;

    /// Refuses a problem that is too large for it.
    ///
    /// # Errors
    /// [`PlanError::Problem`]: what is too many, and how many there may be.
    fn check(&self, _problem: &Problem) -> Result<(), PlanError> {
        Ok(())
    }

    /// Looks for controls from `from`, the best replay so far. What it hands back is replayed, and kept only where its replay
    /// is better.
    ///
    /// # Errors
    /// A step that cannot be posed. An interrupt is none: it hands back what it has.
    fn run(
        &self,
        problem: &Problem,
        from: &Replay,
        watch: &mut Watch<'_>,
    ) -> Result<LegEnd, PlanError>;
}

/// What a leg came to.
#[derive(Debug, Clone, Default)]
pub struct LegEnd {
    /// The controls that it found, within their bounds.
    pub controls: Vec<f64>,
    /// Its iterations.
    pub iterations: u64,
    /// The runs that it made.
    pub runs: u64,
    /// How it ended, in its own words.
    pub message: String,
    /// The cost that it claims, where it has one of its own.
    pub cost: Option<f64>,
    /// The states of its own run, from the start on, where it has one: held against the replay's.
    pub states: Option<Vec<Vec<State>>>,
    /// The modes that it took for granted, where it did: held against the replay's.
    pub modes: Option<Modes>,
}

/// What is reported of a leg.
#[derive(Debug, Clone, Default)]
pub struct LegReport {
    /// Its word.
    pub name: &'static str,
    /// Its iterations.
    pub iterations: u64,
    /// The runs that it made.
    pub runs: u64,
    /// How it ended, in its own words.
    pub message: String,
    /// The cost that it claims.
    pub claimed: Option<f64>,
    /// The cost of the replay of its controls.
    pub cost: f64,
    /// Whether that replay meets all targets.
    pub meets: bool,
    /// How far its own run and the replay are apart at most, m.
    pub apart: Option<f64>,
    /// In how many steps the modes that it took for granted are not those of the replay.
    pub other_modes: Option<usize>,
    /// Whether its controls are the best from there on.
    pub kept: bool,
}

/// How far a search is.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Who searches.
    pub leg: &'static str,
    /// Its iterations so far.
    pub iteration: u64,
    /// The least cost that it has seen; of an iterate of its own, what that claims.
    pub cost: f64,
    /// The best controls so far, where they can be replayed.
    pub controls: &'a [f64],
}

/// How others follow a search and end it.
pub struct Watch<'a> {
    /// Ends it soon after it is raised; what was found so far is handed back.
    pub interrupt: &'a Arc<AtomicBool>,
    /// Is told of every iteration; ends the search where it returns false, as for a limit of time.
    pub progress: &'a mut (dyn FnMut(&Progress<'_>) -> bool + Send),
}

impl Watch<'_> {
    /// Whether the search is to end.
    #[must_use]
    pub fn is_interrupted(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
    }

    /// Tells of an iteration; false where the search is to end.
    pub fn goes_on(&mut self, progress: &Progress<'_>) -> bool {
        !self.is_interrupted() && (self.progress)(progress)
    }
}
