//! The step problem solved by Ipopt: the adapter between [`StepNlp`] and
//! [`crate::ipopt`], started from the previous solution.

mod ladder;
mod subproblem;

pub use ladder::{LADDER_CERTIFICATE, Ladder, Rung};

use super::{Decision, Step, StepReport, StepSolver, StepStatus};
use crate::error::Error;
use crate::ipopt::{BarrierStrategy, MultiplierStep, Options, Point, ReturnStatus, Solver, Start};
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
    /// The multipliers at the last point that Ipopt converged to.
    last: Option<Multipliers>,
}

/// A solution's multipliers, with the point that they belong to.
struct Multipliers {
    x: Vec<f64>,
    constraints: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

/// Where a solve starts and how long it may take.
#[derive(Clone, Copy)]
struct Attempt<'a> {
    start: &'a Decision,
    /// Only with the multipliers of the start, which must be the last solution.
    warm: bool,
    /// Iterations; the options may allow less.
    limit: u32,
}

/// What the objective is multiplied with where m g ℓ is 1 N m: the middle of the range, 10⁶ to
/// 10⁸ and more, in which iterations and certificates hardly change.
const OBJECTIVE_SCALE: f64 = 1e7;

/// A step of Ipopt alone counts as failed with a certificate above this, m/s, whatever Ipopt
/// says of it: its tolerance can be met by points that violate the contact law grossly.
pub const ACCEPTED_CERTIFICATE: f64 = 0.01;

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

    /// The recommended settings for the contact steps of `model`: the barrier is chosen anew
    /// in every iteration, the multipliers' step by dual infeasibility, and the objective, a
    /// sum of squared slacks (N m, W), is measured in units of weight times reach ℓ:
    ///
    /// ```text
    /// obj_scaling_factor = 10⁷/(m g ℓ)²
    /// ```
    ///
    /// Its square makes the objective flat, so that the tolerance is met while slacks are
    /// still large: forces act at a distance and things that should stick creep. Scaled,
    /// Ipopt goes on to certificates of some 10⁻⁶ m/s, and from its warm starts in fewer
    /// iterations, because the next step begins nearer to its solution (docs/ipopt-path.md).
    #[must_use]
    pub fn options(model: &ContactModel, tolerance: f64, max_iterations: u32) -> Options {
        let body = model.body();
        let moment = body.mass() * model.gravity().norm() * body.reach();
        // Without gravity there is no weight to go by.
        let scaling = (OBJECTIVE_SCALE / (moment * moment)).clamp(1e-3, 1e10);
        Options {
            tolerance,
            max_iterations,
            barrier: BarrierStrategy::Adaptive,
            multiplier_step: MultiplierStep::MinDualInfeasibility,
            objective_scaling: scaling,
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
                Ok(Prepared { active: active.to_vec(), subproblem, solver, start, last: None })
            }
        }
    }
}

impl IpoptSolver {
    /// Solves `step` for the flags `active`. `None` where the attempt is to be warm and
    /// there are no multipliers for its start.
    fn attempt(
        &mut self,
        step: &Step<'_>,
        active: &[bool],
        attempt: Attempt<'_>,
        solution: &mut Decision,
    ) -> Result<Option<StepReport>, Error> {
        let alpha = active.iter().map(|&active| f64::from(u8::from(active)));
        self.nlp.set_step(step.state, step.wrench, alpha);
        let mut prepared = self.prepare(active)?;
        let Prepared { subproblem, solver, start: x, last, .. } = &mut prepared;
        subproblem.gather(attempt.start.as_slice(), x);
        let known = last.take().filter(|last| attempt.warm && last.x == *x);
        let start = match &known {
            Some(known) => Start::Warm {
                x,
                constraint_multipliers: &known.constraints,
                lower_multipliers: &known.lower,
                upper_multipliers: &known.upper,
            },
            None if attempt.warm => {
                self.current = Some(prepared);
                return Ok(None);
            }
            None => Start::Cold { x },
        };
        solver.set_iteration_limit(attempt.limit.min(self.options.max_iterations))?;

        let mut program = subproblem.bind(&self.nlp, &mut self.scratch, self.interrupt.as_deref());
        let outcome = solver.solve(&mut program, subproblem.bounds(), &start)?;
        match outcome.point {
            Some(point) => subproblem.scatter(point.x, solution.as_mut_slice()),
            // No iterate to report: free flight is at least a motion.
            None => solution.set_free_flight(step.free),
        }
        let interrupted = outcome.status == ReturnStatus::UserRequestedStop;
        let converged = outcome.status.is_success() && outcome.point.is_some();
        *last = outcome.point.filter(|_| converged).map(Multipliers::of);
        let report = StepReport {
            status: if converged { StepStatus::Converged } else { StepStatus::Failed },
            iterations: outcome.iterations,
            ipopt_status: Some(outcome.status),
            rung: None,
        };
        self.current = Some(prepared);
        if interrupted { Err(Error::Interrupted) } else { Ok(Some(report)) }
    }
}

impl Multipliers {
    fn of(point: Point<'_>) -> Self {
        Self {
            x: point.x.to_vec(),
            constraints: point.constraint_multipliers.to_vec(),
            lower: point.lower_multipliers.to_vec(),
            upper: point.upper_multipliers.to_vec(),
        }
    }
}

/// Ipopt alone, from the previous solution without multipliers: what the tutorial does.
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
        let attempt = Attempt { start: step.previous, warm: false, limit: u32::MAX };
        let report = self.attempt(step, active, attempt, solution)?;
        Ok(report.unwrap_or(StepReport::without_problem(StepStatus::Failed)))
    }
}
