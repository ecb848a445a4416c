//! Models of the cost about a run, and the trial runs of a step.

use super::boxed::Room;
use super::problem::Choose;
use super::{PlanError, PlanProblem};
use nalgebra::DVector;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Relative change of the rows over all of a variable's bounds below which the variable moves nothing.
pub(super) const NOTHING: f64 = 1e-6;

/// The run that a model is about, in units of the bounds.
pub(super) struct Centre {
    pub x: DVector<f64>,
    /// Lengths of the bounds.
    pub scales: DVector<f64>,
    pub room: Room,
    /// Gradient of the cost.
    pub gradient: DVector<f64>,
    /// True if some variable moves the rows by more than [`NOTHING`].
    pub moves: bool,
}

impl Centre {
    /// Largest component of the gradient that a step within the bounds can follow.
    pub(super) fn projected(&self) -> f64 {
        self.room.projected(&self.gradient)
    }
}

/// A model of the cost about a run.
pub(super) trait CostModel {
    /// The run that the model is about.
    fn centre(&self) -> &Centre;

    /// Controls of a step with this κ and the cost of their run, if that is below `cost`.
    fn tried(
        &self,
        kappa: f64,
        cost: f64,
        trials: &mut Trials<'_>,
    ) -> Result<Option<(Vec<f64>, f64)>, PlanError>;
}

/// Trial runs.
pub(super) struct Trials<'a> {
    pub problem: &'a PlanProblem,
    pub interrupt: &'a Arc<AtomicBool>,
    /// Number of runs.
    pub runs: u64,
}

impl Trials<'_> {
    /// Cost of a run whose controls `choose` sets before each step.
    pub(super) fn cost(
        &mut self,
        controls: &mut [f64],
        choose: &mut Choose<'_>,
    ) -> Result<f64, PlanError> {
        self.runs += 1;
        match self.problem.run_cost_choosing(controls, choose, Some(self.interrupt)) {
            Ok(cost) => Ok(cost.judged()),
            Err(PlanError::Step(_)) => Ok(f64::INFINITY),
            Err(error) => Err(error),
        }
    }
}

/// Lengths of the bounds.
pub(super) fn scales(problem: &PlanProblem) -> DVector<f64> {
    let variables = problem.variables();
    DVector::from_iterator(variables.len(), variables.iter().map(|v| v.scale()))
}

/// Weights of effort, in units of the bounds.
pub(super) fn efforts(problem: &PlanProblem, scales: &DVector<f64>) -> DVector<f64> {
    let efforts = problem.variables().iter().zip(scales);
    DVector::from_iterator(scales.len(), efforts.map(|(v, scale)| v.effort * scale * scale))
}
