//! What is tried when Ipopt does not solve a step from its first start: a ladder of
//! rungs, each with its reason, the last of which always holds.

use super::{Attempt, IpoptSolver};
use crate::certificate::certify_contact_step;
use crate::error::Error;
use crate::model::ContactModel;
use crate::solver::native::NativeSolver;
use crate::solver::{Decision, Step, StepReport, StepSolver, StepStatus};
use nalgebra::Vector3;

/// A step counts as solved only with a certificate of at most this, m/s, whatever Ipopt says
/// of it: fifty times what its solutions usually have.
pub const LADDER_CERTIFICATE: f64 = 1e-4;

/// How a step came to be solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Rung {
    /// Ipopt from the previous step's solution with its multipliers, where Ipopt found that
    /// solution itself for the same flags: at rest and in sliding little changes.
    Warm,
    /// Ipopt from the previous step's solution alone, the tutorial's start.
    Previous,
    /// Ipopt from the native solver's point, with the flags of the contacts that carry a
    /// force there: a flagged contact that lifts off while it slips leaves the program
    /// without a feasible optimum (docs/formulation.md, section 8).
    NativeStart,
    /// Ipopt from free flight without forces: forgets a bad previous solution.
    FreeFlight,
    /// Ipopt from free flight with the body's weight shared by the flagged contacts: off
    /// the corner of the cone, where the program's derivatives bend most.
    SharedWeight,
    /// The native solver's own solution, marked [`StepStatus::Fallback`].
    Native,
}

impl Rung {
    /// All rungs, in their order.
    pub const ALL: [Self; 6] = [
        Self::Warm,
        Self::Previous,
        Self::NativeStart,
        Self::FreeFlight,
        Self::SharedWeight,
        Self::Native,
    ];

    /// The word of run.json.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Warm => "warm",
            Self::Previous => "previous",
            Self::NativeStart => "native_start",
            Self::FreeFlight => "free_flight",
            Self::SharedWeight => "shared_weight",
            Self::Native => "native",
        }
    }

    /// How many iterations to wait for. A warm start that is near enough takes few; from
    /// another start near the solution Ipopt takes 10 to 30, and where it has taken 60 it
    /// mostly goes on to its limit, and another start is cheaper (docs/ipopt-path.md).
    fn patience(self) -> u32 {
        match self {
            Self::Warm => 25,
            Self::Previous | Self::NativeStart => 60,
            Self::FreeFlight | Self::SharedWeight | Self::Native => u32::MAX,
        }
    }

    /// How the step counts that this rung solved.
    fn status(self) -> StepStatus {
        match self {
            Self::Warm | Self::Previous => StepStatus::Converged,
            Self::NativeStart | Self::FreeFlight | Self::SharedWeight => StepStatus::Retried,
            Self::Native => StepStatus::Fallback,
        }
    }
}

/// Ipopt with the ladder behind it.
pub struct Ladder {
    ipopt: IpoptSolver,
    native: NativeSolver,
    rungs: Vec<Rung>,
    /// The native solution of the step, once it is asked for.
    native_point: Decision,
    native_active: Vec<bool>,
    start: Decision,
    flags: Vec<bool>,
    forces: Vec<Vector3<f64>>,
}

impl Ladder {
    /// Ipopt and the rungs to try, in order; [`Rung::ALL`] is the recommended ladder.
    #[must_use]
    pub fn new(model: &ContactModel, ipopt: IpoptSolver, rungs: &[Rung]) -> Self {
        let n = model.contact_count();
        let nowhere = Decision::zeros(n);
        Self {
            ipopt,
            native: NativeSolver::new(model),
            rungs: rungs.to_vec(),
            native_point: nowhere.clone(),
            native_active: vec![false; n],
            start: nowhere,
            flags: vec![false; n],
            forces: vec![Vector3::zeros(); n],
        }
    }

    /// One rung: sets `active` and `solution`; the status is Failed where Ipopt did not
    /// converge. `None` where the rung has nothing to start from.
    fn climb(
        &mut self,
        rung: Rung,
        step: &Step<'_>,
        active: &mut [bool],
        solution: &mut Decision,
    ) -> Result<Option<StepReport>, Error> {
        match rung {
            Rung::Warm | Rung::Previous => self.start.copy_from(step.previous),
            Rung::NativeStart => {
                active.copy_from_slice(&self.native_active);
                self.start.copy_from(&self.native_point);
            }
            Rung::FreeFlight => self.start.set_free_flight(step.free),
            Rung::SharedWeight => self.share_weight(step, active),
            Rung::Native => {
                active.copy_from_slice(&self.native_active);
                solution.copy_from(&self.native_point);
                return Ok(Some(StepReport::without_problem(StepStatus::Fallback)));
            }
        }
        let attempt =
            Attempt { start: &self.start, warm: rung == Rung::Warm, limit: rung.patience() };
        self.ipopt.attempt(step, active, attempt, solution)
    }

    fn share_weight(&mut self, step: &Step<'_>, active: &[bool]) {
        self.start.set_free_flight(step.free);
        let count = active.iter().filter(|active| **active).count().max(1) as f64;
        let share = step.model.body().mass() * step.model.gravity().norm() / count;
        let normal = self.start.layout().force_z();
        for (force, _) in
            self.start.as_mut_slice()[normal].iter_mut().zip(active).filter(|(_, active)| **active)
        {
            *force = share;
        }
    }

    /// The certificate of a point, m/s.
    fn certificate(&mut self, step: &Step<'_>, point: &Decision) -> f64 {
        for (slot, force) in self.forces.iter_mut().zip(point.forces()) {
            *slot = force;
        }
        certify_contact_step(step.model, step.state, &point.state(), &self.forces, step.wrench)
            .worst()
    }
}

impl StepSolver for Ladder {
    fn accepted_certificate(&self) -> f64 {
        LADDER_CERTIFICATE
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        active: &mut [bool],
        solution: &mut Decision,
    ) -> Result<StepReport, Error> {
        self.flags.copy_from_slice(active);
        let mut native_solved = None;
        let mut report = StepReport::without_problem(StepStatus::Failed);
        for index in 0..self.rungs.len() {
            let rung = self.rungs[index];
            active.copy_from_slice(&self.flags);
            if matches!(rung, Rung::NativeStart | Rung::Native) && native_solved.is_none() {
                self.native_active.copy_from_slice(&self.flags);
                let native =
                    self.native.solve(step, &mut self.native_active, &mut self.native_point)?;
                native_solved = Some(native.status != StepStatus::Failed);
            }
            let Some(attempt) = self.climb(rung, step, active, solution)? else { continue };
            report.iterations += attempt.iterations;
            report.ipopt_status = attempt.ipopt_status.or(report.ipopt_status);
            report.rung = Some(rung);
            let solved = match rung {
                Rung::Native => native_solved == Some(true),
                _ => attempt.status == StepStatus::Converged,
            };
            if solved && self.certificate(step, solution) <= LADDER_CERTIFICATE {
                report.status = rung.status();
                break;
            }
        }
        Ok(report)
    }
}
