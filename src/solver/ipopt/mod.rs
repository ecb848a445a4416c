//! The step problem solved by Ipopt: the adapter between [`crate::step_nlp`] and
//! [`crate::ipopt`], started from the previous solution.

mod ladder;
mod memory;
mod program;
mod subproblem;

pub use ladder::{LADDER_RESIDUAL, Ladder, Rung};

use crate::contact::{Candidates, Contact};
use crate::error::Error;
use crate::ipopt::{BarrierStrategy, IpoptError, MultiplierStep, Options};
use crate::mechanics::State;
use crate::step::{ContactForce, Step, StepReport, StepSolution, StepSolver, StepStatus};
use crate::step_nlp::{ProgramPoint, SMOOTHING};
use crate::world::World;
use memory::{Memory, Multipliers};
use program::{Attempt, Program};

/// The body that is solved for: the tutorial's program is of one.
const BODY: usize = 0;

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

/// Ipopt for the steps of one world.
pub struct IpoptSolver {
    program: Program,
    accepted: f64,
    memory: Memory,
    /// Which points are candidates of the step.
    flags: Vec<bool>,
    start: ProgramPoint,
    point: ProgramPoint,
}

/// What the objective is multiplied with where m g ℓ is 1 N m: the middle of the range, 10⁶ to
/// 10⁸ and more, in which iterations and residuals hardly change.
const OBJECTIVE_SCALE: f64 = 1e7;

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

    /// The recommended settings for the contact steps of `world`: the barrier is chosen anew
    /// in every iteration, the multipliers' step by dual infeasibility, and the objective, a
    /// sum of squared slacks (N m, W), is measured in units of weight times reach ℓ:
    ///
    /// ```text
    /// obj_scaling_factor = 10⁷/(m g ℓ)²
    /// ```
    ///
    /// Its square makes the objective flat, so that the tolerance is met while slacks are
    /// still large: forces act at a distance and things that should stick creep. Scaled,
    /// Ipopt goes on to residuals of some 10⁻⁶ m/s, and from its warm starts in fewer
    /// iterations, because the next step begins nearer to its solution (docs/ipopt-path.md).
    #[must_use]
    pub fn options(world: &World, tolerance: f64, max_iterations: u32) -> Options {
        let body = &world.bodies()[BODY];
        let moment = body.mass() * world.gravity().norm() * body.reach();
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
}

impl IpoptSolver {
    /// Solves `step` from the point `start` of the program, slacks and multipliers λ included,
    /// instead of the previous solution's: to repeat a step that another program recorded.
    ///
    /// # Errors
    /// As [`StepSolver::solve`]; a start of another number of contact points.
    pub fn solve_from(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
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
        set_flags(contacts, &mut self.flags);
        self.start.copy_from(start);
        self.solve_from_start(step, contacts, solution)
    }

    /// Solves `step` for the flags and the start that have been set.
    fn solve_from_start(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        let Self { program, memory, flags, start, point, .. } = self;
        let attempt = Attempt { start, multipliers: None, limit: u32::MAX };
        let attempted = program.attempt(step, flags, attempt, point)?;
        set_solution(step, contacts, point, solution);
        memory.keep(step.previous, solution, point, attempted.multipliers);
        Ok(StepReport {
            status: if attempted.converged { StepStatus::Converged } else { StepStatus::Failed },
            iterations: attempted.iterations,
            start: Some(Rung::Previous.name()),
            message: Some(attempted.status.name()),
        })
    }
}

/// Sets `start` to the point of the last step's solution; its multipliers, if they are known
/// for `flags`.
fn previous_point<'a>(
    memory: &'a Memory,
    step: &Step<'_>,
    flags: &[bool],
    start: &mut ProgramPoint,
) -> Option<&'a Multipliers> {
    let Some(known) = memory.find(step.previous) else {
        set_point(step, step.previous, start);
        return None;
    };
    start.copy_from(&known.point);
    known.multipliers.as_ref().filter(|multipliers| multipliers.flags == flags)
}

/// Sets `point` to that of `solution`.
fn set_point(step: &Step<'_>, solution: &StepSolution, point: &mut ProgramPoint) {
    let world = step.world;
    let heights: Vec<f64> = world.heights(BODY, &solution.states[BODY].pose()).collect();
    let friction = world.friction();
    point.set_solution(solution, world.ground(), |i| heights[i], friction, SMOOTHING);
}

/// Flags the points of `contacts`.
fn set_flags(contacts: &[Contact], flags: &mut [bool]) {
    flags.fill(false);
    for contact in contacts {
        flags[contact.key.point] = true;
    }
}

/// `point` as the solution of `step`.
fn set_solution(
    step: &Step<'_>,
    contacts: &[Contact],
    point: &ProgramPoint,
    solution: &mut StepSolution,
) {
    let next: State = point.state();
    let (before, after) = (step.states[BODY].pose(), next.pose());
    solution.set_free(&[next]);
    solution.contacts.extend(contacts.iter().map(|contact| {
        let force = point.force(contact.key.point);
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
        let contacts = candidates.contacts();
        set_flags(contacts, &mut self.flags);
        previous_point(&self.memory, step, &self.flags, &mut self.start);
        self.solve_from_start(step, contacts, solution)
    }
}
