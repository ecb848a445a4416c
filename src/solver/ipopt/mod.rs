//! The step problem solved by Ipopt: the adapter between [`crate::step_nlp`] and
//! [`crate::ipopt`], started from the previous solution.
//!
//! There are two programs of a step. The reduced one is that of [several
//! bodies](crate::step_nlp::several), for one body as for ten; the tutorial's own, of one body, is there
//! to repeat what the tutorial does. What is posed, where Ipopt starts, what is remembered and what is
//! tried next stand once, for both.

mod clamped;
mod ladder;
mod memory;
mod posed;
mod posing;
mod program;
mod rung;
mod start;
pub(crate) mod units;

pub use ladder::{LADDER_RESIDUAL, Ladder};
pub use rung::Rung;

use crate::ipopt::{BarrierStrategy, IpoptError, MultiplierStep, Options, Scaling};
use crate::step_nlp::several::SeveralNlp;
use crate::step_nlp::{ProgramPoint, StepNlp};
use memory::IpoptMemory;
use posed::PosedProgram;
use posing::{posed_in, solve_posed};
use program::{Hold, IpoptEffort, IpoptProgram, StartMultipliers};
use start::ProgramStart;
use tumble_core::contact::{Candidates, Contact};
use tumble_core::error::Error;
#[cfg(feature = "save")]
use tumble_core::simulation::save::{from_bytes, to_bytes};
use tumble_core::step::{Step, StepReport, StepSolution, StepSolver, StepStatus};
use tumble_core::world::World;
#[cfg(feature = "save")]
use units::ProgramUnits;

/// Ipopt's tolerance in the tutorial.
pub const TOLERANCE: f64 = 1e-6;
/// The tutorial's iteration limit.
pub const MOST_ITERATIONS: u32 = 300;

/// More bodies than this are refused: see [`IpoptSolver::new`].
pub const MOST_BODIES: usize = 10;

/// The body that the tutorial's program is of.
const BODY: usize = 0;

/// Which program Ipopt sees. Both have the same solutions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Formulation {
    /// The tutorial's, of one body, in SI units: all variables and rows; the variables of a contact
    /// that is not flagged are clamped, both bounds zero. Its rows without a free variable, and the row
    /// ‖q⁺‖² = 1, which the attitude rows imply, make the Jacobian rank-deficient everywhere.
    Clamped,
    /// That of any bodies: only variables and rows of the candidates that free flight closes, no row
    /// ‖q⁺‖² = 1, and nothing of friction where μ = 0; in the scene's own units, in which scaled
    /// copies of a scene are one program.
    #[default]
    Reduced,
}

impl Formulation {
    /// The word of the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Clamped => "clamped",
            Self::Reduced => "reduced",
        }
    }
}

/// Ipopt for the steps of one world; by itself, from the previous solution without multipliers, as the
/// tutorial does it.
pub struct IpoptSolver {
    program: IpoptProgram,
    accepted: f64,
    memory: IpoptMemory,
    /// What was posed last.
    posed: PosedProgram,
    /// The start and the end of the last solve.
    start: ProgramStart,
    end: ProgramStart,
}

/// What the objective is multiplied with: 10⁷/(m g ℓ)² in the [scene's units](units), the middle
/// of the range, 10⁶ to 10⁸ and more, in which iterations and residuals hardly change.
const OBJECTIVE_SCALE: f64 = 1e7 / (98.1 * 98.1);

/// A step of Ipopt alone counts as failed with a residual above this, m/s, whatever Ipopt
/// says of it: its tolerance can be met by points that violate the contact law grossly. Of the
/// steps that it solves with these settings all but one in a hundred are below 0.02. The number
/// is that of the tutorial's cube, and scaled with the world's [speed](World::speed_scale).
pub const ACCEPTED_RESIDUAL: f64 = 0.1;

/// What Ipopt refused before it ran.
impl From<IpoptError> for Error {
    fn from(error: IpoptError) -> Self {
        Self::Solver { solver: "Ipopt", why: error.to_string() }
    }
}

/// Ipopt with the recommended ladder for `world`.
///
/// # Errors
/// As [`IpoptSolver::new`].
pub fn ladder_for(
    world: &World,
    formulation: Formulation,
    options: Options,
) -> Result<Box<dyn StepSolver>, Error> {
    let ipopt = IpoptSolver::new(world, formulation, options)?;
    Ok(Box::new(Ladder::new(world, ipopt, &Rung::ALL)))
}

/// Ipopt from the previous solution alone: what it does not solve from there is failed. In a world that
/// the tutorial's program is [not of](crate::step_nlp::StepNlp::unsuitable) its steps are held to the
/// ladder's residual.
///
/// # Errors
/// As [`IpoptSolver::new`].
pub fn alone_for(
    world: &World,
    formulation: Formulation,
    options: Options,
) -> Result<Box<dyn StepSolver>, Error> {
    let ipopt = IpoptSolver::new(world, formulation, options)?;
    if StepNlp::unsuitable(world).is_none() {
        return Ok(Box::new(ipopt));
    }
    Ok(Box::new(Ladder::new(world, ipopt, &[Rung::Previous])))
}

impl IpoptSolver {
    /// A solver for steps of `world`.
    ///
    /// # Errors
    /// An option out of its range; more than [`MOST_BODIES`] bodies, which the native solver is made
    /// for; with [`Formulation::Clamped`], a world that
    /// [`StepNlp::new`](crate::step_nlp::StepNlp::new) refuses.
    pub fn new(world: &World, formulation: Formulation, options: Options) -> Result<Self, Error> {
        let bodies = world.bodies().len();
        if bodies > MOST_BODIES {
            let why = format!(
                "the world has {bodies} bodies; allowed is up to {MOST_BODIES}, and `native` takes \
                 any number"
            );
            return Err(Error::Solver { solver: "Ipopt", why });
        }
        if let Some(why) = SeveralNlp::unsuitable(world) {
            return Err(Error::Solver { solver: "Ipopt", why: why.to_owned() });
        }
        Ok(Self {
            program: IpoptProgram::new(world, formulation, options)?,
            accepted: ACCEPTED_RESIDUAL * world.speed_scale(),
            memory: IpoptMemory::default(),
            posed: PosedProgram::default(),
            start: ProgramStart::default(),
            end: ProgramStart::default(),
        })
    }

    /// The recommended settings: the barrier is chosen anew in every iteration, the
    /// multipliers' step by dual infeasibility, and the objective, a sum of squared slacks
    /// (N m, W in SI units), is multiplied with 10⁷/(m g ℓ)² of the tutorial's cube. Its square makes the objective flat, so that the tolerance is met while slacks are
    /// still large: forces act at a distance and things that should stick creep. Scaled,
    /// Ipopt goes on to residuals of some 10⁻⁶ m/s, and from its warm starts in fewer
    /// iterations, because the next step begins nearer to its solution (docs/ipopt-path.md).
    #[must_use]
    pub fn options(tolerance: f64, max_iterations: u32) -> Options {
        Options {
            tolerance,
            max_iterations,
            barrier: BarrierStrategy::Adaptive,
            multiplier_step: MultiplierStep::MinDualInfeasibility,
            objective_scaling: OBJECTIVE_SCALE,
            ..Options::default()
        }
    }
}

impl IpoptSolver {
    /// The tutorial's settings: its tolerance and its limit, and Ipopt's defaults.
    #[must_use]
    pub fn tutorial_options() -> Options {
        Options {
            tolerance: TOLERANCE,
            max_iterations: MOST_ITERATIONS,
            barrier: BarrierStrategy::Monotone,
            multiplier_step: MultiplierStep::Primal,
            initial_barrier: 0.1,
            scaling: Scaling::GradientBased,
            objective_scaling: 1.0,
            bound_push: 0.01,
            ..Options::default()
        }
    }

    /// Solves `step` from the point `start` of the program, slacks and multipliers λ included,
    /// instead of the previous solution's: to repeat a step that another program recorded.
    ///
    /// # Errors
    /// As [`StepSolver::solve`]; a start of another number of contact points.
    pub fn solve_from(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        start: &ProgramPoint,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        let points = |world: &World| world.bodies()[BODY].contact_points().len();
        if start.layout().contacts() != points(self.program.world()) {
            return Err(Error::Count {
                field: "contact points of the start",
                count: start.layout().contacts(),
                allowed: "those of the world's body",
            });
        }
        self.begin(step, candidates.contacts())?;
        self.start.set_point(candidates.contacts(), start, &self.program.units);
        self.solve_from_start(step, candidates, solution)
    }

    /// Takes the units of `step`, if it is one of the solver's world. What is known in others is
    /// forgotten.
    fn begin(&mut self, step: &Step<'_>, contacts: &[Contact]) -> Result<(), Error> {
        step.check(contacts)?;
        let points = |world: &World| -> Vec<usize> {
            world.bodies().iter().map(|body| body.contact_points().len()).collect()
        };
        if points(self.program.world()) != points(step.world) {
            let why = "the step is of another world than the one that the solver was made for";
            return Err(Error::Solver { solver: "Ipopt", why: why.to_owned() });
        }
        if self.program.set_units(step) {
            self.memory.clear();
        }
        Ok(())
    }

    /// The memory and the units that it is in.
    #[cfg(feature = "save")]
    fn remembered(&self) -> Vec<u8> {
        // Numbers, which always have bytes.
        to_bytes(&(&self.program.units, &self.memory)).unwrap_or_default()
    }

    /// Goes on from what was [remembered](IpoptSolver::remembered) in `world`.
    #[cfg(feature = "save")]
    fn remember(&mut self, world: &World, remembered: &[u8]) -> Result<(), Error> {
        if remembered.is_empty() {
            self.memory.clear();
            return Ok(());
        }
        let (units, memory): (ProgramUnits, IpoptMemory) = from_bytes(remembered)?;
        let are_mine = !self.program.is_tutorials() || units == ProgramUnits::SI;
        if !are_mine || !units.are_possible() || !memory.is_whole() {
            return Err(Error::Saved("has a memory that is not Ipopt's".to_owned()));
        }
        self.program.take_units(world, units);
        self.memory = memory;
        Ok(())
    }

    /// Solves `step` from the start that has been set.
    fn solve_from_start(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        let Self { program, memory, posed, start, end, accepted } = self;
        let (limit, depth) = (program.max_iterations(), missed_depth(step, *accepted));
        *posed = posed_in(program, step, candidates.contacts(), depth);
        let (multipliers, hold) = (StartMultipliers::Estimated, Hold::NOT);
        let effort = IpoptEffort { multipliers, limit, depth, tightness: 1.0, hold };
        let attempted = solve_posed(program, step, start, effort, candidates, posed, end)?;
        end.write(step, candidates.contacts(), &program.units, solution);
        memory.keep(step.previous, solution, end, attempted.multipliers);
        Ok(StepReport {
            status: if attempted.converged { StepStatus::Converged } else { StepStatus::Failed },
            iterations: attempted.iterations,
            start: Some(Rung::Previous.name()),
            message: Some(attempted.status.name()),
        })
    }
}

/// A contact that ends a step no deeper than this need not have been posed, m: a tenth of what the
/// residual of the step may be.
fn missed_depth(step: &Step<'_>, accepted: f64) -> f64 {
    0.1 * accepted * step.world.time_step()
}

impl StepSolver for IpoptSolver {
    fn accepted_residual(&self) -> f64 {
        self.accepted
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        self.begin(step, candidates.contacts())?;
        let Self { program, memory, start, .. } = self;
        let known = memory.point(step.previous);
        start.set_previous(step, candidates.contacts(), known, &program.units);
        self.solve_from_start(step, candidates, solution)
    }

    fn change_world(&mut self, world: &World) -> Result<(), Error> {
        let formulation = self.program.formulation();
        *self = Self::new(world, formulation, self.program.options().clone())?;
        Ok(())
    }

    #[cfg(feature = "save")]
    fn memory(&self) -> Vec<u8> {
        self.remembered()
    }

    #[cfg(feature = "save")]
    fn recall(&mut self, world: &World, memory: &[u8]) -> Result<(), Error> {
        self.remember(world, memory)
    }
}
