//! What is tried when Ipopt does not solve a step from its first start: a ladder of
//! rungs, each with its reason, the last of which always holds.

use super::memory::Multipliers;
use super::posing::{Effort, pose, solve_posed};
use super::program::{Attempt, Attempted, StartMultipliers};
use super::units::Units;
use super::{
    BODY, Formulation, IpoptSolver, missed_depth, previous_point, set_point, set_solution,
};
use crate::contact::certificate::{Certifier, Claim};
use crate::contact::{Candidates, Contact, rounding};
use crate::error::Error;
use crate::mechanics::quaternion::advance;
use crate::solver::native::NativeSolver;
use crate::step::{ContactForce, Step, StepReport, StepSolution, StepSolver, StepStatus};
use crate::step_nlp::ProgramPoint;
use crate::step_nlp::layout::STATE;
use crate::world::World;

/// A step counts as solved only with a residual of at most this, m/s, whatever Ipopt says
/// of it: a hundred times what its solutions usually have. The number is that of the
/// tutorial's cube, and scaled with the world's [speed](World::speed_scale).
pub const LADDER_RESIDUAL: f64 = 1e-3;

/// The iterations of a step, all rungs together, that are waited for before the native solution
/// stands in; more where one solve may take more. From good starts Ipopt takes a tenth.
const STEP_BUDGET: u32 = 300;

/// With more candidates than this an iteration takes so long (10 ms with 100, 110 ms with 961) that
/// fewer of them are waited for, as many as cost the same.
const MANY_CANDIDATES: usize = 64;

/// The budget of a step with `candidates`, where one solve may take `max_iterations`.
pub(super) fn budget(max_iterations: u32, candidates: usize) -> u32 {
    let usual = max_iterations.max(STEP_BUDGET);
    let share = MANY_CANDIDATES as f64 / candidates.max(MANY_CANDIDATES) as f64;
    ((f64::from(usual) * share) as u32).max(1)
}

/// How much friction yields to what differs from the forces of the start, as a part of the
/// body's own answer h/m, in the reduced program. Where the forces have settled that is nothing;
/// where they have not, and the residual says so, Ipopt goes on from the end with this as the
/// start, and what is left is this part of it (docs/ipopt-path.md).
const YIELDING: f64 = 1e-2;

/// The tolerances, as parts of the usual one, with which Ipopt goes on where it has met the usual
/// one and the residual is too large.
pub(super) const TIGHTER: [f64; 3] = [1e-2, 1e-4, 1e-6];

/// A residual that is worth going on for, m/s, in parts of the [accepted](LADDER_RESIDUAL) one: ten
/// times what settled steps have. Steps of friction that has just stopped or begun are above it.
const WORTH_IT: f64 = 1e-2;

/// Iterations with each of them.
pub(super) const PATIENCE_TIGHTER: u32 = 25;

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
    pub(super) fn patience(self) -> u32 {
        match self {
            Self::Warm => 25,
            Self::Previous | Self::NativeStart => 60,
            Self::FreeFlight | Self::SharedWeight | Self::Native => u32::MAX,
        }
    }

    /// How the step counts that this rung solved.
    pub(super) fn status(self) -> StepStatus {
        match self {
            Self::Warm | Self::Previous => StepStatus::Converged,
            Self::NativeStart | Self::FreeFlight | Self::SharedWeight => StepStatus::Retried,
            Self::Native => StepStatus::Fallback,
        }
    }

    pub(super) fn asks_native(self) -> bool {
        matches!(self, Self::NativeStart | Self::Native)
    }
}

/// Ipopt with the ladder behind it.
pub struct Ladder {
    ipopt: IpoptSolver,
    native: NativeSolver,
    rungs: Vec<Rung>,
    accepted: f64,
    /// See [`YIELDING`].
    yielding: f64,
    certifier: Certifier,
    /// The native solution of the step, where it was asked for.
    asked: Asked,
    /// The end of the rung that was tried last.
    tried: StepSolution,
    /// The best end of the rungs so far.
    best: StepSolution,
    best_point: ProgramPoint,
}

/// What the native solver said of the step.
struct Asked {
    /// Whether it was asked.
    already: bool,
    solution: StepSolution,
    point: ProgramPoint,
    /// The points that carry a force in it.
    flags: Vec<bool>,
}

/// The end of a rung, its point in the ladder's buffers.
struct Climbed {
    converged: bool,
    iterations: u32,
    message: Option<&'static str>,
    multipliers: Option<Multipliers>,
}

impl Ladder {
    /// Ipopt and the rungs to try, in order; [`Rung::ALL`] is the recommended ladder.
    #[must_use]
    pub fn new(world: &World, ipopt: IpoptSolver, rungs: &[Rung]) -> Self {
        let n = ipopt.program.points();
        let exact = ipopt.program.formulation == Formulation::Clamped;
        Self {
            ipopt,
            yielding: if exact { 0.0 } else { YIELDING },
            native: NativeSolver::new(world),
            rungs: rungs.to_vec(),
            accepted: LADDER_RESIDUAL * world.speed_scale(),
            certifier: Certifier::new(),
            asked: Asked {
                already: false,
                solution: StepSolution::default(),
                point: ProgramPoint::zeros(n),
                flags: vec![false; n],
            },
            tried: StepSolution::default(),
            best: StepSolution::default(),
            best_point: ProgramPoint::zeros(n),
        }
    }

    /// One rung, from the flags of `candidates`; leaves its end in `tried`. `None` where the
    /// rung has nothing to start from.
    fn climb(
        &mut self,
        rung: Rung,
        step: &Step<'_>,
        candidates: &mut Candidates,
        left: u32,
    ) -> Result<Option<Climbed>, Error> {
        let IpoptSolver { program, memory, flags, start, point, .. } = &mut self.ipopt;
        pose(step, candidates.contacts(), program.formulation, flags);
        let units = program.units;
        let mut multipliers = StartMultipliers::Estimated;
        match rung {
            Rung::Warm => match previous_point(memory, step, (flags, &units), start) {
                Some(known) => {
                    multipliers = StartMultipliers::Known(known);
                    coast(step, &units, start);
                }
                None => return Ok(None),
            },
            Rung::Previous => {
                previous_point(memory, step, (flags, &units), start);
            }
            Rung::NativeStart => {
                multipliers = StartMultipliers::Zero;
                flags.copy_from_slice(&self.asked.flags);
                start.copy_from(&self.asked.point);
            }
            Rung::FreeFlight => start.set_free(&units.state(&step.free[BODY])),
            Rung::SharedWeight => share_weight(step, flags, &units, start),
            Rung::Native => {
                self.tried.copy_from(&self.asked.solution);
                point.copy_from(&self.asked.point);
                return Ok(Some(Climbed {
                    // The residual decides: what the native solver fails may be within what the
                    // ladder promises.
                    converged: true,
                    iterations: 0,
                    message: None,
                    multipliers: None,
                }));
            }
        }
        let limit = rung.patience().min(program.max_iterations()).min(left);
        let depth = missed_depth(step, self.accepted);
        let effort = Effort { limit, depth, yielding: self.yielding };
        let posed = (&mut *candidates, &mut flags[..]);
        let mut attempted = solve_posed(program, step, (start, multipliers), effort, posed, point)?;
        let contacts = candidates.contacts();
        set_solution(step, contacts, (point, &units), &mut self.tried);
        self.tighten(step, contacts, left, &mut attempted)?;
        Ok(Some(Climbed {
            converged: attempted.converged,
            iterations: attempted.iterations,
            message: Some(attempted.status.name()),
            multipliers: attempted.multipliers,
        }))
    }

    /// Where Ipopt meets its tolerance and the step is not solved, goes on from the end with
    /// smaller ones: a contact that is lighter than the body needs more than the program's scale
    /// asks for.
    fn tighten(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        left: u32,
        attempted: &mut Attempted,
    ) -> Result<(), Error> {
        for tightness in TIGHTER {
            let residual = self.residual(step, contacts);
            if attempted.iterations >= left
                || residual <= WORTH_IT * self.accepted
                || self.is_rounding(step, residual)
            {
                break;
            }
            let Some(multipliers) = &attempted.multipliers else { break };
            let IpoptSolver { program, flags, start, point, .. } = &mut self.ipopt;
            start.copy_from(point);
            let attempt = Attempt {
                start,
                multipliers: StartMultipliers::Known(multipliers),
                limit: PATIENCE_TIGHTER.min(left - attempted.iterations),
                tightness,
                yielding: self.yielding,
            };
            let mut tighter = program.attempt(step, flags, attempt, point)?;
            tighter.iterations += attempted.iterations;
            if !tighter.converged {
                point.copy_from(start);
                attempted.iterations = tighter.iterations;
                break;
            }
            let units = program.units;
            set_solution(step, contacts, (point, &units), &mut self.tried);
            let is_better = self.residual(step, contacts) < residual;
            let IpoptSolver { program, start, point, .. } = &mut self.ipopt;
            if !is_better {
                point.copy_from(start);
                set_solution(step, contacts, (point, &program.units), &mut self.tried);
                attempted.iterations = tighter.iterations;
                break;
            }
            *attempted = tighter;
        }
        Ok(())
    }

    /// Whether the end that was tried last solves the step.
    fn is_solved(&mut self, step: &Step<'_>, contacts: &[Contact], converged: bool) -> bool {
        let residual = self.residual(step, contacts);
        converged && (residual <= self.accepted || self.is_rounding(step, residual))
    }

    fn is_rounding(&self, step: &Step<'_>, residual: f64) -> bool {
        residual <= rounding::residual(step.world, step.states, &self.tried.states)
    }

    /// Asks the native solver, once a step. It may admit contacts that detection missed; they
    /// then are contacts of the step.
    fn ask_native(&mut self, step: &Step<'_>, candidates: &mut Candidates) -> Result<(), Error> {
        if self.asked.already {
            return Ok(());
        }
        let Asked { already, solution, point, flags } = &mut self.asked;
        self.native.solve(step, candidates, solution)?;
        *already = true;
        set_point(step, solution, &self.ipopt.program.units, point);
        flags.fill(false);
        for contact in solution.contacts.iter().filter(|contact| contact.carries_force()) {
            flags[contact.key.point] = true;
        }
        Ok(())
    }

    /// The residual of the rung tried last, m/s.
    fn residual(&mut self, step: &Step<'_>, contacts: &[Contact]) -> f64 {
        let (states, next) = (step.states, &self.tried.states);
        let claim = Claim { states, next, wrenches: step.wrenches, contacts };
        self.certifier.contact_step(step.world, &claim, self.tried.forces()).residual()
    }
}

/// Moves the state of `start` (in `units`), that of step k, on by one step at its own velocities:
/// what slides steadily is then where it will be.
fn coast(step: &Step<'_>, units: &Units, start: &mut ProgramPoint) {
    let (mut state, h) = (step.states[BODY], step.world.time_step());
    state.position += h * state.velocity;
    state.attitude = advance(&state.attitude, &state.spin, h);
    start.as_mut_slice()[STATE].copy_from_slice(units.state(&state).to_vector().as_slice());
}

/// Sets `start` (in `units`) to free flight with the weight on the flagged points.
fn share_weight(step: &Step<'_>, flags: &[bool], units: &Units, start: &mut ProgramPoint) {
    start.set_free(&units.state(&step.free[BODY]));
    let count = flags.iter().filter(|flag| **flag).count().max(1) as f64;
    let weight = step.world.bodies()[BODY].mass() * step.world.gravity().norm();
    let share = weight / units.force() / count;
    let normal = start.layout().force_z();
    let forces = start.as_mut_slice()[normal].iter_mut().zip(flags);
    for (force, _) in forces.filter(|(_, flag)| **flag) {
        *force = share;
    }
}

impl StepSolver for Ladder {
    fn accepted_residual(&self) -> f64 {
        self.accepted
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        self.asked.already = false;
        self.ipopt.begin(step, candidates.contacts())?;
        // Where no rung has an end to show, free flight is at least a motion.
        self.best.set_free(step.free);
        let units = self.ipopt.program.units;
        self.best_point.set_free(&units.state(&step.free[BODY]));
        let budget = budget(self.ipopt.program.max_iterations(), candidates.contacts().len());
        let (mut least, mut multipliers) = (f64::INFINITY, None);
        let mut report = StepReport::without_problem(StepStatus::Failed);
        for index in 0..self.rungs.len() {
            let rung = self.rungs[index];
            if rung.asks_native() {
                self.ask_native(step, candidates)?;
            }
            let left = budget.saturating_sub(report.iterations);
            if left == 0 && rung != Rung::Native {
                continue;
            }
            let Some(climbed) = self.climb(rung, step, candidates, left)? else { continue };
            let contacts = candidates.contacts();
            report.iterations += climbed.iterations;
            report.message = climbed.message.or(report.message);
            let residual = self.residual(step, contacts);
            if residual < least {
                (least, multipliers) = (residual, climbed.multipliers);
                self.best.copy_from(&self.tried);
                self.best_point.copy_from(&self.ipopt.point);
                report.start = Some(rung.name());
            }
            if self.is_solved(step, contacts, climbed.converged) {
                report.status = rung.status();
                break;
            }
        }
        // Those admitted after the best end was found have no force in it.
        let late = &candidates.contacts()[self.best.contacts.len()..];
        self.best.contacts.extend(late.iter().map(|contact| ContactForce::none(contact.key)));
        solution.copy_from(&self.best);
        self.ipopt.memory.keep(step.previous, solution, &self.best_point, multipliers);
        Ok(report)
    }
}
