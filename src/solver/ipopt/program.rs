//! One solve of the step's program by Ipopt: flags, start and limit in, a point out.

use super::memory::Multipliers;
use super::subproblem::{Scratch, Subproblem};
use super::{BODY, Formulation};
use crate::error::Error;
use crate::ipopt::{Options, ReturnStatus, Solver, Start};
use crate::step::Step;
use crate::step_nlp::{ProgramPoint, SMOOTHING, StepNlp};
use crate::world::World;

/// The program of one world, with Ipopt for it.
pub(super) struct Program {
    nlp: StepNlp,
    formulation: Formulation,
    options: Options,
    scratch: Scratch,
    /// The problem of the last flags, kept for as long as they do not change.
    current: Option<Prepared>,
}

/// A problem with the solver of its structure.
struct Prepared {
    flags: Vec<bool>,
    subproblem: Subproblem,
    solver: Solver,
    start: Vec<f64>,
}

/// Where a solve starts and how long it may take.
#[derive(Clone, Copy)]
pub(super) struct Attempt<'a> {
    pub(super) start: &'a ProgramPoint,
    /// Those of the start, for a warm one.
    pub(super) multipliers: Option<&'a Multipliers>,
    /// Iterations; the options may allow less.
    pub(super) limit: u32,
}

/// How a solve ended.
pub(super) struct Attempted {
    pub(super) converged: bool,
    pub(super) iterations: u32,
    pub(super) status: ReturnStatus,
    /// Where it converged.
    pub(super) multipliers: Option<Multipliers>,
}

impl Program {
    pub(super) fn new(
        world: &World,
        formulation: Formulation,
        options: Options,
    ) -> Result<Self, Error> {
        options.validate()?;
        let nlp = StepNlp::new(world.clone(), SMOOTHING)?;
        let scratch = Scratch::new(&nlp);
        Ok(Self { nlp, formulation, options, scratch, current: None })
    }

    /// The number of contact points.
    pub(super) fn points(&self) -> usize {
        self.nlp.layout().contacts()
    }

    /// The problem for the flags `flags`.
    fn prepare(&mut self, flags: &[bool]) -> Result<Prepared, Error> {
        match self.current.take() {
            Some(prepared) if prepared.flags == flags => Ok(prepared),
            _ => {
                let subproblem = Subproblem::new(&self.nlp, flags, self.formulation);
                let program = subproblem.bind(&self.nlp, &mut self.scratch, None);
                let solver = Solver::new(&program, self.options.clone())?;
                let start = vec![0.0; subproblem.variables().len()];
                Ok(Prepared { flags: flags.to_vec(), subproblem, solver, start })
            }
        }
    }

    /// Solves `step` for `flags` and writes the end to `point`; free flight where Ipopt has no
    /// iterate to report.
    pub(super) fn attempt(
        &mut self,
        step: &Step<'_>,
        flags: &[bool],
        attempt: Attempt<'_>,
        point: &mut ProgramPoint,
    ) -> Result<Attempted, Error> {
        let alpha = flags.iter().map(|&flag| f64::from(u8::from(flag)));
        self.nlp.set_step(&step.states[BODY], &step.wrenches[BODY], alpha);
        let mut prepared = self.prepare(flags)?;
        let Prepared { subproblem, solver, start: x, .. } = &mut prepared;
        subproblem.gather(attempt.start.as_slice(), x);
        let start = match attempt.multipliers {
            Some(known) => Start::Warm {
                x,
                constraint_multipliers: &known.constraints,
                lower_multipliers: &known.lower,
                upper_multipliers: &known.upper,
            },
            None => Start::Cold { x },
        };
        solver.set_iteration_limit(attempt.limit.min(self.options.max_iterations))?;

        let mut program = subproblem.bind(&self.nlp, &mut self.scratch, step.interrupt);
        let outcome = solver.solve(&mut program, subproblem.bounds(), &start)?;
        match outcome.point {
            Some(found) => subproblem.scatter(found.x, point.as_mut_slice()),
            // No iterate to report: free flight is at least a motion.
            None => point.set_free(&step.free[BODY]),
        }
        let interrupted = outcome.status == ReturnStatus::UserRequestedStop;
        let converged = outcome.status.is_success() && outcome.point.is_some();
        let found = outcome.point.filter(|_| converged);
        let attempted = Attempted {
            converged,
            iterations: outcome.iterations,
            status: outcome.status,
            multipliers: found.map(|point| Multipliers::of(flags, point)),
        };
        self.current = Some(prepared);
        if interrupted { Err(Error::Interrupted) } else { Ok(attempted) }
    }
}
