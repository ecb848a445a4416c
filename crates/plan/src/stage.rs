//! Stages of a search: the trait, its results, and how a caller watches them.

use super::{PlanError, PlanProblem, Replay};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// One method of looking for controls.
pub trait Stage: Send + Sync {
    /// Name in files and reports.
    fn name(&self) -> &'static str;

    /// Refuses a problem that is too large for this stage.
    ///
    /// # Errors
    /// [`PlanError::Problem`] with the size and the limit.
    fn check(&self, _problem: &PlanProblem) -> Result<(), PlanError> {
        Ok(())
    }

    /// True if the stage only helps a search that has not met its targets.
    ///
    /// After earlier stages, [`PlanProblem::plan`] skips a fallback if they have met the targets.
    /// Otherwise the fallback starts a new attempt from the start of the search.
    fn is_fallback(&self) -> bool {
        false
    }

    /// Searches from `from`, the best replay of the attempt. The attempt keeps the result only if its replay is better.
    ///
    /// # Errors
    /// A step that cannot be posed. After an interrupt the stage returns its best controls so far.
    fn run(
        &self,
        problem: &PlanProblem,
        from: &Replay,
        watch: &mut SearchWatch<'_>,
    ) -> Result<StageResult, PlanError>;
}

/// Outcome of a stage.
#[derive(Debug, Clone, Default)]
pub struct StageResult {
    /// Best controls, within their bounds.
    pub controls: Vec<f64>,
    /// Number of iterations.
    pub iterations: u64,
    /// Number of runs of the simulator.
    pub runs: u64,
    /// Reason for the end, as a phrase.
    pub message: String,
}

/// Outcome of a stage, judged by the replay of its controls.
#[derive(Debug, Clone, Default)]
pub struct StageReport {
    /// Name of the stage.
    pub name: &'static str,
    /// Number of iterations.
    pub iterations: u64,
    /// Number of runs of the simulator.
    pub runs: u64,
    /// Reason for the end, as a phrase.
    pub message: String,
    /// Cost of the replay.
    pub cost: f64,
    /// True if the replay meets all targets and path constraints.
    pub meets: bool,
    /// True if the attempt continued from these controls.
    pub kept: bool,
}

/// State of a search after an iteration.
#[derive(Debug, Clone, Copy)]
pub struct SearchProgress<'a> {
    /// Name of the current stage.
    pub stage: &'static str,
    /// Iteration of that stage.
    pub iteration: u64,
    /// Least cost that the stage has found.
    pub cost: f64,
    /// Best controls of the stage.
    pub controls: &'a [f64],
}

/// Connection between a search and its caller.
pub struct SearchWatch<'a> {
    /// Ends the search soon after it is raised. The search returns its best plan so far.
    pub interrupt: &'a Arc<AtomicBool>,
    /// Callback after each iteration. The search ends when it returns false, for example at a time limit.
    pub progress: &'a mut (dyn FnMut(&SearchProgress<'_>) -> bool + Send),
}

impl SearchWatch<'_> {
    /// True if the interrupt is raised.
    pub fn is_interrupted(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
    }

    /// Reports an iteration, and returns whether the search should continue.
    pub fn goes_on(&mut self, progress: &SearchProgress<'_>) -> bool {
        !self.is_interrupted() && (self.progress)(progress)
    }
}
