//! The step problem solved by Ipopt: the adapter between [`StepNlp`] and
//! [`crate::ipopt`], started from the previous solution.

mod ladder;
mod subproblem;

pub use ladder::{ACCEPTED_CERTIFICATE, Ladder, Rung};

use super::{Decision, Step, StepReport, StepSolver, StepStatus};
use crate::error::Error;
use crate::ipopt::{BarrierStrategy, MultiplierStep, Options, ReturnStatus, Solver, Start};
use crate::model::ContactModel;
use crate::step_nlp::StepNlp;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
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
    interrupt: Option<Arc<AtomicBool>>,
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
        let scratch = Scratch::new(&nlp);
        Ok(Self { formulation, options, scratch, interrupt: None, current: None, nlp })
    }

    /// Gives up a step with [`Error::Interrupted`] within an iteration of `flag` being
    /// raised.
    pub fn interrupt_by(&mut self, flag: Arc<AtomicBool>) {
        self.interrupt = Some(flag);
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
                let program = subproblem.bind(&self.nlp, &mut self.scratch, None);
                let solver = Solver::new(&program, self.options.clone())?;
                let start = vec![0.0; subproblem.variables().len()];
                Ok(Prepared { active: active.to_vec(), subproblem, solver, start })
            }
        }
    }
}

impl IpoptSolver {
    /// Solves `step` for the flags `active` from `start`, in at most `limit` iterations and
    /// no more than the options allow.
    fn solve_from(
        &mut self,
        step: &Step<'_>,
        active: &[bool],
        start: &Decision,
        limit: u32,
        solution: &mut Decision,
    ) -> Result<StepReport, Error> {
        let alpha = active.iter().map(|&active| f64::from(u8::from(active)));
        self.nlp.set_step(step.state, step.wrench, alpha);
        let mut prepared = self.prepare(active)?;
        let Prepared { subproblem, solver, start: selected, .. } = &mut prepared;
        subproblem.gather(start.as_slice(), selected);
        solver.set_iteration_limit(limit.min(self.options.max_iterations))?;

        let mut program = subproblem.bind(&self.nlp, &mut self.scratch, self.interrupt.as_deref());
        let start = Start::Cold { x: selected };
        let outcome = solver.solve(&mut program, subproblem.bounds(), &start)?;
        match outcome.point {
            Some(point) => subproblem.scatter(point.x, solution.as_mut_slice()),
            // No iterate to report: free flight is at least a motion.
            None => solution.set_free_flight(step.free),
        }
        let interrupted = outcome.status == ReturnStatus::UserRequestedStop;
        let converged = outcome.status.is_success() && outcome.point.is_some();
        let report = StepReport {
            status: if converged { StepStatus::Converged } else { StepStatus::Failed },
            iterations: outcome.iterations,
            ipopt_status: Some(outcome.status),
            rung: Some(Rung::Previous),
        };
        self.current = Some(prepared);
        if interrupted { Err(Error::Interrupted) } else { Ok(report) }
    }
}

/// Ipopt alone, from the previous solution: what the tutorial does.
impl StepSolver for IpoptSolver {
    fn accepted_certificate(&self) -> f64 {
        ACCEPTED_CERTIFICATE
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        active: &mut [bool],
        solution: &mut Decision,
    ) -> Result<StepReport, Error> {
        self.solve_from(step, active, step.previous, u32::MAX, solution)
    }
}
