//! Contact steps solved by Ipopt: the adapter between [`crate::step_nlp`] and [`crate::ipopt`],
//! started from the previous solution.
//!
//! The program is the tutorial's. Variables of contacts without force are clamped. Beyond the
//! tutorial, only the contacts that free flight closes are posed, and the program is in the scene's
//! own units. [`IpoptSolver::tutorial`] reproduces the tutorial.

mod clamping;
mod ladder;
mod memory;
mod posed;
mod program;
mod rows;
mod start;
mod units;

pub use super::{ACCEPTED_RESIDUAL, LADDER_RESIDUAL, Rung};
pub use ladder::Ladder;

use crate::ipopt::{BarrierStrategy, IpoptError, MultiplierStep, Options, Scaling};
use crate::step_nlp::{DissipationFactor, ProgramPoint, StepNlp};
use clamping::Clamping;
use memory::IpoptMemory;
use posed::PosedContacts;
use program::{IpoptEffort, IpoptProgram, StartMultipliers, solve_posed};
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
/// Iteration limit in the tutorial.
pub const MOST_ITERATIONS: u32 = 300;

/// Index of the body in the tutorial's program.
const BODY: usize = 0;

/// Ipopt solver for the steps of one world. Alone, it starts from the previous solution without
/// multipliers, as in the tutorial.
pub struct IpoptSolver {
    program: IpoptProgram,
    accepted: f64,
    memory: IpoptMemory,
    /// Contacts of the last program.
    posed: PosedContacts,
    /// Start and result of the last solve.
    start: ProgramPoint,
    end: ProgramPoint,
}

/// Factor of the objective: 10⁷/(m g ℓ)² in the [scene's units](units). It is in the middle of the
/// range 10⁶ to 10⁸ in which iterations and residuals hardly change.
const OBJECTIVE_SCALE: f64 = 1e7 / (98.1 * 98.1);

/// Converts a refusal of Ipopt's wrapper.
impl From<IpoptError> for Error {
    fn from(error: IpoptError) -> Self {
        Self::Solver { solver: "Ipopt", why: error.to_string() }
    }
}

/// Creates Ipopt with the recommended ladder for `world`.
///
/// # Errors
/// See [`IpoptSolver::new`].
pub fn ladder_for(world: &World, options: Options) -> Result<Box<dyn StepSolver>, Error> {
    let ipopt = IpoptSolver::new(world, options)?;
    Ok(Box::new(Ladder::new(world, ipopt, &Rung::ALL)))
}

impl IpoptSolver {
    /// Creates a solver for steps of `world`.
    ///
    /// # Errors
    /// An option out of its range; a world [unsuitable](StepNlp::unsuitable) for the program, which
    /// needs the native solver.
    pub fn new(world: &World, options: Options) -> Result<Self, Error> {
        Self::with_clamping(world, Clamping::Posed, DissipationFactor::Flag, options)
    }

    /// Creates the tutorial's solver: its flags and all its rows, in SI units. Its settings are
    /// [`IpoptSolver::tutorial_options`].
    ///
    /// # Errors
    /// See [`IpoptSolver::new`].
    pub fn tutorial(world: &World, options: Options) -> Result<Self, Error> {
        Self::with_clamping(world, Clamping::Tutorial, DissipationFactor::Flag, options)
    }

    /// Creates the solver of the tutorial's variant, whose rows of maximum dissipation have the normal
    /// force as a factor.
    ///
    /// # Errors
    /// See [`IpoptSolver::new`].
    pub fn tutorial_product(world: &World, options: Options) -> Result<Self, Error> {
        Self::with_clamping(world, Clamping::Tutorial, DissipationFactor::Product, options)
    }

    fn with_clamping(
        world: &World,
        clamping: Clamping,
        factor: DissipationFactor,
        options: Options,
    ) -> Result<Self, Error> {
        if let Some(why) = StepNlp::unsuitable(world) {
            let why = format!("{why}; use the native solver");
            return Err(Error::Solver { solver: "Ipopt", why });
        }
        let program = IpoptProgram::new(world, clamping, factor, options)?;
        let point = ProgramPoint::zeros(program.points());
        Ok(Self {
            program,
            accepted: ACCEPTED_RESIDUAL * world.speed_scale(),
            memory: IpoptMemory::default(),
            posed: PosedContacts::default(),
            start: point.clone(),
            end: point,
        })
    }

    /// Recommended settings: adaptive barrier, multiplier steps by dual infeasibility, and a scaled
    /// objective.
    ///
    /// The objective is a sum of squared slacks (N m, W in SI units). The squares make it flat:
    /// unscaled, the tolerance is met while slacks are still large, so forces act at a distance and
    /// sticking contacts creep. The factor is 10⁷/(m g ℓ)² of the tutorial's cube. With it Ipopt
    /// reaches residuals of about 10⁻⁶ m/s, and warm starts need fewer iterations
    /// (docs/ipopt-path.md).
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
    /// Settings of the tutorial: its tolerance, its iteration limit, and Ipopt's defaults.
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

    /// Solves `step` from the point `start` of the program, including slacks and multipliers λ.
    /// This repeats a step that another program recorded.
    ///
    /// # Errors
    /// See [`StepSolver::solve`]; a start with another number of contact points.
    pub fn solve_from(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        start: &ProgramPoint,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        if start.layout().contacts() != self.program.points() {
            return Err(Error::Count {
                field: "contact points of the start",
                count: start.layout().contacts(),
                allowed: "the number of the world's body",
            });
        }
        self.begin(step, candidates.contacts())?;
        self.start.copy_from(&self.program.units.point(start));
        self.solve_from_start(step, candidates, solution)
    }

    /// Updates the units for `step` and checks that it belongs to the solver's world. A change of
    /// units clears the memory.
    fn begin(&mut self, step: &Step<'_>, contacts: &[Contact]) -> Result<(), Error> {
        step.check(contacts)?;
        let bodies = step.world.bodies();
        if bodies.len() != 1 || bodies[BODY].contact_points().len() != self.program.points() {
            let why = "the step belongs to another world; create a new solver";
            return Err(Error::Solver { solver: "Ipopt", why: why.to_owned() });
        }
        if self.program.set_units(step)? {
            self.memory.clear();
        }
        Ok(())
    }

    /// Serialises the units and the memory.
    #[cfg(feature = "save")]
    fn remembered(&self) -> Vec<u8> {
        // Serialisation of plain numbers cannot fail.
        to_bytes(&(&self.program.units, &self.memory)).unwrap_or_default()
    }

    /// Restores the [serialised](IpoptSolver::remembered) memory in `world`.
    #[cfg(feature = "save")]
    fn remember(&mut self, world: &World, remembered: &[u8]) -> Result<(), Error> {
        if remembered.is_empty() {
            self.memory.clear();
            return Ok(());
        }
        let (units, memory): (ProgramUnits, IpoptMemory) = from_bytes(remembered)?;
        let are_mine = !self.program.is_tutorials() || units == ProgramUnits::SI;
        if !are_mine || !units.are_possible() || !memory.is_whole(self.end.as_slice().len()) {
            return Err(Error::Saved("has a memory that is not Ipopt's".to_owned()));
        }
        self.program.take_units(world, units)?;
        self.memory = memory;
        Ok(())
    }

    /// Solves `step` from the start stored in `self.start`.
    fn solve_from_start(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        let Self { program, memory, posed, start, end, accepted } = self;
        let limit = program.max_iterations();
        let depth = missed_depth(step, *accepted);
        *posed = program.closed(step, candidates.contacts(), depth);
        let multipliers = StartMultipliers::Estimated;
        let effort = IpoptEffort { multipliers, limit, depth, tightness: 1.0, compliance: 0.0 };
        let attempted = solve_posed(program, step, start, effort, candidates, posed, end)?;
        start::write(end, step, candidates.contacts(), program, solution);
        memory.keep(step.previous, solution, end, attempted.multipliers);
        Ok(StepReport {
            status: if attempted.converged { StepStatus::Converged } else { StepStatus::Failed },
            iterations: attempted.iterations,
            start: Some(Rung::Previous.name()),
            message: Some(attempted.status.name()),
        })
    }
}

/// Penetration at the end of a step below which a contact need not be in the program, m. It is a
/// tenth of the accepted residual times h.
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
        start::set_previous(start, step, candidates.contacts(), known, &program.units);
        self.solve_from_start(step, candidates, solution)
    }

    fn change_world(&mut self, world: &World) -> Result<(), Error> {
        let Self { program, .. } = &*self;
        let options = program.options().clone();
        *self = Self::with_clamping(world, program.clamping(), program.factor(), options)?;
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
