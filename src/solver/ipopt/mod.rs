//! The step problem solved by Ipopt: the adapter between [`crate::step_nlp`] and
//! [`crate::ipopt`], started from the previous solution.

mod alone;
mod ladder;
mod memory;
mod posing;
mod program;
mod several;
mod subproblem;
mod units;

pub use alone::Ladder;
pub use ladder::{LADDER_RESIDUAL, Rung};
pub use several::{MOST_BODIES, SeveralLadder};

use crate::contact::{Candidates, Contact};
use crate::error::Error;
use crate::ipopt::{BarrierStrategy, IpoptError, MultiplierStep, Options, Scaling};
use crate::mechanics::{RigidBody, State};
use crate::step::{ContactForce, Step, StepReport, StepSolution, StepSolver, StepStatus};
use crate::step_nlp::{ProgramPoint, SMOOTHING, StepNlp};
use crate::world::World;
use memory::{Memory, Multipliers};
use posing::{Effort, pose, solve_posed};
use program::{Program, StartMultipliers};
use units::Units;

/// Ipopt's tolerance in the tutorial.
pub const TOLERANCE: f64 = 1e-6;
/// The tutorial's iteration limit.
pub const MOST_ITERATIONS: u32 = 300;

/// The body that is solved for: the tutorial's program is of one.
const BODY: usize = 0;

/// Which program Ipopt sees. Both have the same solutions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Formulation {
    /// The tutorial's, in SI units: all variables and rows; the variables of a contact that is
    /// not flagged are clamped, both bounds zero. Its rows without a free variable, and the row
    /// ‖q⁺‖² = 1, which the attitude rows imply, make the Jacobian rank-deficient everywhere.
    Clamped,
    /// Only variables and rows of the candidates that free flight takes to the ground, no row
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

/// Ipopt for the steps of one world.
pub struct IpoptSolver {
    program: Program,
    accepted: f64,
    memory: Memory<ProgramPoint, Multipliers>,
    /// Which points are candidates of the step.
    flags: Vec<bool>,
    start: ProgramPoint,
    point: ProgramPoint,
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

/// Ipopt with the recommended ladder for any world that it is made for: the tutorial's program where
/// that is [of the world](crate::step_nlp::StepNlp::unsuitable), posed as `formulation` says, and the
/// [program of several bodies](SeveralLadder) for all others.
///
/// # Errors
/// As [`IpoptSolver::new`] and [`SeveralLadder::new`]; a world of the latter with
/// [`Formulation::Clamped`], which is the tutorial's.
pub fn ladder_for(
    world: &World,
    formulation: Formulation,
    options: Options,
) -> Result<Box<dyn StepSolver>, Error> {
    if StepNlp::unsuitable(world).is_none() || formulation == Formulation::Clamped {
        let ipopt = IpoptSolver::new(world, formulation, options)?;
        return Ok(Box::new(Ladder::new(world, ipopt, &Rung::ALL)));
    }
    Ok(Box::new(SeveralLadder::new(world, options, &Rung::ALL)?))
}

/// Ipopt alone for any world that [`ladder_for`] takes: from the previous solution, and what it does
/// not solve from there is failed.
///
/// # Errors
/// As [`ladder_for`].
pub fn alone_for(
    world: &World,
    formulation: Formulation,
    options: Options,
) -> Result<Box<dyn StepSolver>, Error> {
    if StepNlp::unsuitable(world).is_none() || formulation == Formulation::Clamped {
        return Ok(Box::new(IpoptSolver::new(world, formulation, options)?));
    }
    Ok(Box::new(SeveralLadder::new(world, options, &[Rung::Previous])?))
}

impl IpoptSolver {
    /// A solver for steps of `world`.
    ///
    /// # Errors
    /// An option out of its range, a world that
    /// [`StepNlp::new`](crate::step_nlp::StepNlp::new) refuses.
    pub fn new(world: &World, formulation: Formulation, options: Options) -> Result<Self, Error> {
        let program = Program::new(world, formulation, options)?;
        let n = program.points();
        Ok(Self {
            program,
            accepted: ACCEPTED_RESIDUAL * world.speed_scale(),
            memory: Memory::default(),
            flags: vec![false; n],
            start: ProgramPoint::zeros(n),
            point: ProgramPoint::zeros(n),
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
        if start.layout() != self.start.layout() {
            return Err(Error::Count {
                field: "contact points of the start",
                count: start.layout().contacts(),
                allowed: "those of the world's body",
            });
        }
        self.begin(step, candidates.contacts())?;
        self.start.copy_from(start);
        self.program.units.convert_point(&mut self.start);
        self.solve_from_start(step, candidates, solution)
    }

    /// Takes the units of `step`, if it is one of the solver's world. What is known in others is
    /// forgotten.
    fn begin(&mut self, step: &Step<'_>, contacts: &[Contact]) -> Result<(), Error> {
        step.check(contacts)?;
        let points = |body: &RigidBody| body.contact_points().len() == self.program.points();
        let is_own = matches!(step.world.bodies(), [body] if points(body));
        if !is_own {
            return Err(of_another_world());
        }
        if step.previous.states.is_empty() {
            let field = "states of the previous solution";
            return Err(Error::Count { field, count: 0, allowed: "one a body" });
        }
        if self.program.set_units(step)? {
            self.memory.clear();
        }
        Ok(())
    }

    /// Solves `step` from the start that has been set.
    fn solve_from_start(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        let Self { program, memory, flags, start, point, accepted } = self;
        pose(step, candidates.contacts(), program.formulation, flags);
        let effort = Effort {
            limit: program.max_iterations(),
            depth: missed_depth(step, *accepted),
            yielding: 0.0,
        };
        let posed = (&mut *candidates, &mut flags[..]);
        let attempted =
            solve_posed(program, step, (start, StartMultipliers::Estimated), effort, posed, point)?;
        set_solution(step, candidates.contacts(), (point, &program.units), solution);
        memory.keep(step.previous, solution, point, attempted.multipliers);
        Ok(StepReport {
            status: if attempted.converged { StepStatus::Converged } else { StepStatus::Failed },
            iterations: attempted.iterations,
            start: Some(Rung::Previous.name()),
            message: Some(attempted.status.name()),
        })
    }
}

/// Why a step is refused whose world has other bodies than the solver's.
fn of_another_world() -> Error {
    let why = "the step is of another world than the one that the solver was made for";
    Error::Solver { solver: "Ipopt", why: why.to_owned() }
}

/// A point that ends a step no lower than this below the ground need not have been posed, m: a
/// tenth of what the residual of the step may be.
fn missed_depth(step: &Step<'_>, accepted: f64) -> f64 {
    0.1 * accepted * step.world.time_step()
}

/// Sets `start` to the point of the last step's solution; its multipliers, if they are known
/// for `flags`.
fn previous_point<'a>(
    memory: &'a Memory<ProgramPoint, Multipliers>,
    step: &Step<'_>,
    (flags, units): (&[bool], &Units),
    start: &mut ProgramPoint,
) -> Option<&'a Multipliers> {
    let Some(known) = memory.find(step.previous) else {
        set_point(step, step.previous, units, start);
        return None;
    };
    start.copy_from(&known.point);
    known.multipliers.as_ref().filter(|multipliers| multipliers.flags == flags)
}

/// Sets `point` to that of `solution`, in `units`.
fn set_point(step: &Step<'_>, solution: &StepSolution, units: &Units, point: &mut ProgramPoint) {
    let world = step.world;
    // The tutorial's program is of worlds with one.
    let Some(ground) = world.ground() else { return };
    let heights: Vec<f64> = world.heights(BODY, &solution.states[BODY].pose()).collect();
    let (friction, smoothing) = (world.friction(), SMOOTHING * units.force());
    point.set_solution(solution, ground, |i| heights[i], friction, smoothing);
    units.convert_point(point);
}

/// `point`, which is in `units`, as the solution of `step`.
fn set_solution(
    step: &Step<'_>,
    contacts: &[Contact],
    (point, units): (&ProgramPoint, &Units),
    solution: &mut StepSolution,
) {
    let next: State = units.si_state(&point.state());
    let (before, after) = (step.states[BODY].pose(), next.pose());
    solution.set_free(&[next]);
    solution.contacts.extend(contacts.iter().map(|contact| {
        let force = point.force(contact.key.point) * units.force();
        let normal = contact.normal();
        let u = contact.motion((&before, &after), None, step.world.time_step());
        ContactForce {
            key: contact.key,
            force: contact.frame * force,
            normal_force: force[2],
            slip: u - normal * normal.dot(&u),
        }
    }));
}

/// Ipopt alone, from the previous solution without multipliers: what the tutorial does.
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
        previous_point(&self.memory, step, (&[], &self.program.units), &mut self.start);
        self.solve_from_start(step, candidates, solution)
    }
}
