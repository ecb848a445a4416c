//! Gradient of a scalar function of a whole run with respect to its initial state, the wrenches of
//! every step, and the constants of the world.
//!
//! The run goes forward once and is then traversed backward with transposed products of the step
//! derivatives ([`StepDerivative::vjp`]). One pass suffices for any number of arguments. Steps are
//! recorded as far as the memory [budget](Checkpoints) allows. A longer run is divided into segments,
//! recursively, and their steps are taken again from saved states. The run is equal to the last bit
//! with and without derivatives.

mod backward;
mod impact_time;

use super::{Interval, Saved, Simulation, accuracy};
use crate::derivative::StateChange;
use crate::error::Error;
use crate::mechanics::{State, Wrench};
use crate::solver::native::{Smoothing, StepDerivative};
use crate::world::Constant;
use backward::Backward;

/// Memory budget of the backward pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Checkpoints {
    /// Largest number of recorded steps, at least one. Records beyond 64 MB reduce it, but not below
    /// 16.
    pub steps: usize,
    /// Number of saved simulations, at least two.
    pub saved: usize,
}

impl Default for Checkpoints {
    /// Records 10 000 steps of one body, or 100 of a hundred. Longer runs are taken twice, up to 300
    /// times this length.
    fn default() -> Self {
        Self { steps: 10_000, saved: 300 }
    }
}

/// Returns the derivatives of the scalar with respect to the states after a number of steps.
pub type ByStates<'f> = dyn FnMut(u64, &[State]) -> Option<Vec<StateChange>> + 'f;

/// A run to differentiate.
pub struct Run<'f> {
    /// Number of steps.
    pub steps: u64,
    /// Callback before each step that sets its inputs. It is called again for the same step with
    /// the simulation in the same state, and must do the same.
    pub before: &'f mut dyn FnMut(&mut Simulation<'_>) -> Result<(), Error>,
    /// Derivatives of the scalar with respect to the states after a number of steps (0 is the
    /// start); `None` if it does not depend on them.
    pub by_states: &'f mut ByStates<'f>,
    /// Constants to differentiate with respect to.
    pub constants: &'f [Constant],
    /// Constants that `before` sets anew for each step, such as joint forces and targets of motors.
    /// The gradient has their derivatives step by step.
    pub inputs: &'f [Constant],
    /// Memory budget.
    pub checkpoints: Checkpoints,
    /// Optional [smoothing](StepDerivative::smoothed) of the step derivatives. The run stays exact.
    /// The result is then a search direction and not a derivative, where the exact one does not
    /// exist.
    pub smoothing: Option<Smoothing>,
    /// True if impacts are differentiated with their times (G21): the derivative of the motion,
    /// not of the steps. [Located](crate::world::Impacts::Located) impacts always are.
    pub has_impact_times: bool,
}

/// Gradient of a scalar function of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunGradient {
    /// Derivatives with respect to the initial states.
    pub states: Vec<StateChange>,
    /// Derivatives with respect to the wrenches, one list per step.
    pub wrenches: Vec<Vec<Wrench>>,
    /// Derivatives with respect to the requested constants, in their order.
    pub constants: Vec<Vec<f64>>,
    /// Derivatives with respect to the [inputs](Run::inputs), in their order, one list per step.
    /// Empty without inputs.
    pub inputs: Vec<Vec<Vec<f64>>>,
    /// Smallest [margin](StepDerivative::margin) of a step (m/s), and the index of that step.
    pub margin: (f64, u64),
    /// Smallest [feature margin](StepDerivative::feature_margin) of a step (m), and the index of
    /// that step.
    pub feature_margin: (f64, u64),
    /// Number of failed or unphysical steps. Results across them are not derivatives of the
    /// equations.
    pub unsolved: u64,
    /// Number of steps with pressing contacts whose features are [unknown](StepDerivative::unknown)
    /// functions of the poses.
    pub unknown: u64,
    /// Number of steps in which shares of forces were [kept](StepDerivative::keeps_shares).
    pub kept: u64,
    /// Number of intervals with an impact whose time is left out: all impacts without
    /// [`Run::has_impact_times`], and those in which several points of connected bodies meet with it. These count
    /// as meeting at their mean time.
    pub untimed: u64,
    /// Number of steps with a [reduced](super::StepRecord::restitution_share) restitution, which is
    /// treated as a constant.
    pub limited: u64,
}

impl RunGradient {
    /// Adds to the derivatives by the wrenches of the step that was processed last.
    fn add_last_wrenches(&mut self, more: &[Wrench]) {
        let last = self.wrenches.last_mut().into_iter().flatten();
        last.zip(more).for_each(|(sum, more)| *sum = sum.plus(more));
    }

    /// Adds to the derivatives by the inputs of the step that was processed last.
    fn add_last_inputs(&mut self, more: &[Vec<f64>]) {
        let last = self.inputs.last_mut().into_iter().flatten().flatten();
        last.zip(more.iter().flatten()).for_each(|(sum, more)| *sum += more);
    }

    /// Adds the diagnostics of the interval `taken` of step `index`.
    fn note(&mut self, index: u64, taken: &Interval, derivative: &StepDerivative) {
        let smaller = |most: &mut (f64, u64), margin: f64| {
            if margin < most.0 {
                *most = (margin, index);
            }
        };
        smaller(&mut self.margin, derivative.margin());
        smaller(&mut self.feature_margin, derivative.feature_margin());
        self.unsolved += u64::from(!taken.report.status.is_one_problem());
        self.unknown += u64::from(derivative.unknown() > 0);
        self.kept += u64::from(derivative.keeps_shares());
        self.limited += u64::from(taken.restitution_share < 1.0);
    }
}

impl Simulation<'_> {
    /// Runs `run` from the current state and returns the gradient of its scalar. The simulation is
    /// left at the end of the run, or unchanged after an error.
    ///
    /// # Errors
    /// If a step cannot be posed, is interrupted or [has no derivative](Simulation::linearise); if
    /// a callback of `run` fails; if it returns derivatives for another number of bodies.
    pub fn gradient(&mut self, run: &mut Run<'_>) -> Result<RunGradient, Error> {
        let start = self.save();
        let found = self.differentiated(run, &start);
        self.world.set_span(None);
        if found.is_err() {
            self.restore(&start)?;
        }
        found
    }

    /// Gradient of a run from `start`, the current state of the simulation.
    fn differentiated(&mut self, run: &mut Run<'_>, start: &Saved) -> Result<RunGradient, Error> {
        for constant in run.constants.iter().filter(|c| c.is_of_shapes()) {
            // Rejects constants that cannot vary.
            self.world().with_constants(&[(*constant, &constant.values(self.world()))])?;
        }
        self.check_motion()?;
        let is_divided = accuracy::divides_steps(&self.world, &self.moment);
        let mut backward =
            Backward::begin(run, self.index(), self.world(), is_divided, self.inputs.at_instant)?;
        backward.go(self, run, 0, run.steps, start)?;
        backward.end(self, run, start)
    }
}
