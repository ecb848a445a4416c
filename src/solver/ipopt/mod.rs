//! The step problem solved by Ipopt: the adapter between [`StepNlp`] and
//! [`crate::ipopt`], started from the previous solution.

mod subproblem;

use super::{Decision, Step, StepReport, StepSolver, StepStatus};
use crate::error::Error;
use crate::ipopt::{BarrierStrategy, MultiplierStep, Options, Solver, Start};
use crate::model::ContactModel;
use crate::step_nlp::StepNlp;
use subproblem::{Scratch, Subproblem};

/// How the variables of contacts without a flag are held at zero. Both have the same
/// solutions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Formulation {
    /// The tutorial's: all variables and rows, both bounds of an unflagged contact's
    /// variables zero. Its rows without a free variable, and the row ‖q⁺‖² = 1, which the
    /// attitude rows imply, make the Jacobian rank-deficient everywhere.
    Clamped,
    /// Only the flagged contacts' variables and rows, all heights, and no row ‖q⁺‖² = 1.
    #[default]
    Reduced,
}

/// Ipopt for the steps of one model.
pub struct IpoptSolver {
    nlp: StepNlp,
    formulation: Formulation,
    options: Options,
    scratch: Scratch,
    /// The problem of the last flags, kept for as long as they do not change.
    current: Option<Prepared>,
}

/// A problem with the solver of its structure.
struct Prepared {
    active: Vec<bool>,
    subproblem: Subproblem,
    solver: Solver,
    start: Vec<f64>,
}

impl IpoptSolver {
    /// A solver for steps of `model`.
    ///
    /// # Errors
    /// An option out of its range.
    pub fn new(
        model: &ContactModel,
        formulation: Formulation,
        options: Options,
    ) -> Result<Self, Error> {
        options.validate()?;
        let nlp = StepNlp::new(model.clone());
        Ok(Self { formulation, options, scratch: Scratch::new(&nlp), current: None, nlp })
    }

    /// The settings for contact steps: the recommended set, with the barrier chosen anew in
    /// every iteration and the multipliers' step by dual infeasibility, which take half the
    /// iterations of Ipopt's defaults and leave a hundredth of their certificate.
    #[must_use]
    pub fn options(tolerance: f64, max_iterations: u32) -> Options {
        Options {
            tolerance,
            max_iterations,
            barrier: BarrierStrategy::Adaptive,
            multiplier_step: MultiplierStep::MinDualInfeasibility,
            ..Options::default()
        }
    }

    /// The problem for the flags `active`.
    fn prepare(&mut self, active: &[bool]) -> Result<Prepared, Error> {
        match self.current.take() {
            Some(prepared) if prepared.active == active => Ok(prepared),
            _ => {
                let subproblem = Subproblem::new(&self.nlp, active, self.formulation);
                let program = subproblem.bind(&self.nlp, &mut self.scratch);
                let solver = Solver::new(&program, self.options.clone())?;
                let start = vec![0.0; subproblem.variables().len()];
                Ok(Prepared { active: active.to_vec(), subproblem, solver, start })
            }
        }
    }
}

impl StepSolver for IpoptSolver {
    fn solve(
        &mut self,
        step: &Step<'_>,
        active: &mut [bool],
        solution: &mut Decision,
    ) -> Result<StepReport, Error> {
        let alpha = active.iter().map(|&active| f64::from(u8::from(active)));
        self.nlp.set_step(step.state, step.wrench, alpha);
        let mut prepared = self.prepare(active)?;
        let Prepared { subproblem, solver, start, .. } = &mut prepared;
        subproblem.gather(step.previous.as_slice(), start);

        let mut program = subproblem.bind(&self.nlp, &mut self.scratch);
        let outcome = solver.solve(&mut program, subproblem.bounds(), &Start::Cold { x: start })?;
        match outcome.point {
            Some(point) => subproblem.scatter(point.x, solution.as_mut_slice()),
            // No iterate to report: free flight is at least a motion.
            None => solution.set_free_flight(step.free),
        }
        let converged = outcome.status.is_success() && outcome.point.is_some();
        let report = StepReport {
            status: if converged { StepStatus::Converged } else { StepStatus::Failed },
            iterations: outcome.iterations,
            ipopt_status: Some(outcome.status),
        };
        self.current = Some(prepared);
        Ok(report)
    }
}
