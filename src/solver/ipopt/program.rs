//! One solve of the step's program by Ipopt: flags, start and limit in, a point out.

use super::memory::Multipliers;
use super::subproblem::{Scratch, Subproblem};
use super::units::Units;
use super::{BODY, Formulation};
use crate::error::Error;
use crate::ipopt::{Options, ReturnStatus, Solver, Start};
use crate::mechanics::Wrench;
use crate::step::Step;
use crate::step_nlp::{ProgramPoint, SMOOTHING, StepNlp};
use crate::world::World;

/// The program of one world, with Ipopt for it.
pub(super) struct Program {
    /// The step problem in `units`.
    nlp: StepNlp,
    pub(super) units: Units,
    pub(super) formulation: Formulation,
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
    /// As many as variables and as rows, at least.
    zeros: Vec<f64>,
}

/// Where a solve starts (a point in the program's units) and how long it may take.
#[derive(Clone, Copy)]
pub(super) struct Attempt<'a> {
    pub(super) start: &'a ProgramPoint,
    pub(super) multipliers: StartMultipliers<'a>,
    /// Iterations.
    pub(super) limit: u32,
    /// Ipopt's tolerance, as a part of that of the options.
    pub(super) tightness: f64,
    /// How much friction yields to what differs from the forces of the start, as a part of the
    /// body's own answer h/m; 0 is the exact program.
    pub(super) yielding: f64,
}

/// The multipliers of a start.
#[derive(Clone, Copy)]
pub(super) enum StartMultipliers<'a> {
    /// Ipopt's own estimate, from a point that it first moves away from its bounds.
    Estimated,
    /// Zero: those of a solution whose slacks are zero, because the objective's gradient is zero
    /// there.
    Zero,
    /// Those that Ipopt ended with.
    Known(&'a Multipliers),
}

/// How a solve ended.
pub(super) struct Attempted {
    pub(super) converged: bool,
    pub(super) iterations: u32,
    pub(super) status: ReturnStatus,
    /// Where it converged.
    pub(super) multipliers: Option<Multipliers>,
}

impl Attempted {
    /// Free flight, where no point is posed: exact without Ipopt.
    pub(super) fn free() -> Self {
        let status = ReturnStatus::SolveSucceeded;
        Self { converged: true, iterations: 0, status, multipliers: None }
    }
}

impl Program {
    pub(super) fn new(
        world: &World,
        formulation: Formulation,
        options: Options,
    ) -> Result<Self, Error> {
        options.validate()?;
        let units = Self::units_for(formulation, world, &Wrench::zero());
        let nlp = StepNlp::new(units.world(world), SMOOTHING)?;
        let scratch = Scratch::new(&nlp);
        Ok(Self { nlp, units, formulation, options, scratch, current: None })
    }

    fn units_for(formulation: Formulation, world: &World, wrench: &Wrench) -> Units {
        match formulation {
            Formulation::Clamped => Units::SI,
            Formulation::Reduced => Units::of(world, wrench),
        }
    }

    /// Takes the units that `step` asks for; says whether they are others than before.
    pub(super) fn set_units(&mut self, step: &Step<'_>) -> Result<bool, Error> {
        let units = Self::units_for(self.formulation, step.world, &step.wrenches[BODY]);
        if units == self.units {
            return Ok(false);
        }
        // The structure is the same: what is prepared stays.
        self.nlp = StepNlp::new(units.world(step.world), SMOOTHING)?;
        self.units = units;
        Ok(true)
    }

    /// The number of contact points.
    pub(super) fn points(&self) -> usize {
        self.nlp.layout().contacts()
    }

    /// The most iterations of one solve.
    pub(super) fn max_iterations(&self) -> u32 {
        self.options.max_iterations
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
                let rows = subproblem.bounds().constraint_lower.len();
                let zeros = vec![0.0; start.len().max(rows)];
                Ok(Prepared { flags: flags.to_vec(), subproblem, solver, start, zeros })
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
        let (state, wrench) = (&step.states[BODY], &step.wrenches[BODY]);
        self.nlp.set_step(&self.units.state(state), &self.units.wrench(wrench), alpha);
        let world = self.nlp.world();
        let compliance = attempt.yielding * world.time_step() / world.bodies()[BODY].mass();
        let anchors = (0..flags.len()).map(|i| attempt.start.force(i).xy());
        self.nlp.anchor_friction(compliance, anchors);
        let mut prepared = self.prepare(flags)?;
        let Prepared { subproblem, solver, start: x, zeros, .. } = &mut prepared;
        subproblem.gather(attempt.start.as_slice(), x);
        let start = match attempt.multipliers {
            StartMultipliers::Estimated => Start::Cold { x },
            StartMultipliers::Zero => Start::Warm {
                x,
                constraint_multipliers: &zeros[..subproblem.bounds().constraint_lower.len()],
                lower_multipliers: &zeros[..x.len()],
                upper_multipliers: &zeros[..x.len()],
            },
            StartMultipliers::Known(known) => Start::Warm {
                x,
                constraint_multipliers: &known.constraints,
                lower_multipliers: &known.lower,
                upper_multipliers: &known.upper,
            },
        };
        solver.set_limits(attempt.limit, self.options.tolerance * attempt.tightness)?;

        let mut program = subproblem.bind(&self.nlp, &mut self.scratch, step.interrupt);
        let outcome = solver.solve(&mut program, subproblem.bounds(), &start)?;
        match outcome.point {
            Some(found) => subproblem.scatter(found.x, point.as_mut_slice()),
            // No iterate to report: free flight is at least a motion.
            None => point.set_free(&self.units.state(&step.free[BODY])),
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
