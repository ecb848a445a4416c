//! Models of the cost about a run, of which shooting takes its steps.

use super::boxed::Room;
use super::problem::Choose;
use super::{PlanError, Problem};
use nalgebra::DVector;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A control that over all of its bounds would move the rows by less than this part of them moves nothing.
pub(super) const NOTHING: f64 = 1e-6;

/// The run that a model is about: its controls, how far these may go, and what the cost does there, in parts of their bounds.
pub(super) struct Centre {
    pub x: DVector<f64>,
    /// The lengths of all bounds.
    pub scales: DVector<f64>,
    pub room: Room,
    /// The derivatives of the cost.
    pub gradient: DVector<f64>,
    /// Whether a variable moves the rows: over all of its bounds by more than [`NOTHING`] of them.
    pub moves: bool,
}

impl Centre {
    /// The largest derivative of the cost that a step within the bounds can follow.
    pub(super) fn projected(&self) -> f64 {
        self.room.projected(&self.gradient)
    }
}

/// A model of the cost about a run.
pub(super) trait Model {
    /// What it is about.
    fn centre(&self) -> &Centre;

    /// The controls that it comes to with this κ, and the cost of their run, where that is below `cost`.
    fn tried(
        &self,
        kappa: f64,
        cost: f64,
        trials: &mut Trials<'_>,
    ) -> Result<Option<(Vec<f64>, f64)>, PlanError>;
}

/// Runs that are made to see what they cost.
pub(super) struct Trials<'a> {
    pub problem: &'a Problem,
    pub interrupt: &'a Arc<AtomicBool>,
    /// How many there were.
    pub runs: u64,
}

impl Trials<'_> {
    /// What the run costs whose controls `choose` sets on its way.
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

/// The lengths of all bounds.
pub(super) fn scales(problem: &Problem) -> DVector<f64> {
    let variables = problem.variables();
    DVector::from_iterator(variables.len(), variables.iter().map(|v| v.scale()))
}

/// What the efforts cost in parts of the bounds.
pub(super) fn efforts(problem: &Problem, scales: &DVector<f64>) -> DVector<f64> {
    let efforts = problem.variables().iter().zip(scales);
    DVector::from_iterator(scales.len(), efforts.map(|(v, scale)| v.effort * scale * scale))
}
