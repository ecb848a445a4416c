//! What is tried when Ipopt does not solve a step from its first start: a ladder of
//! rungs, each with its reason, the last of which always holds.

use super::memory::Multipliers;
use super::program::{Attempt, Program};
use super::{BODY, IpoptSolver, previous_point, set_flags, set_point, set_solution};
use crate::contact::certificate::{Certifier, Claim};
use crate::contact::{Candidates, Contact, rounding};
use crate::error::Error;
use crate::solver::native::NativeSolver;
use crate::step::{ContactForce, Step, StepReport, StepSolution, StepSolver, StepStatus};
use crate::step_nlp::ProgramPoint;
use crate::world::World;

/// A step counts as solved only with a residual of at most this, m/s, whatever Ipopt says
/// of it: a hundred times what its solutions usually have. The number is that of the
/// tutorial's cube, and scaled with the world's [speed](World::speed_scale).
pub const LADDER_RESIDUAL: f64 = 1e-3;

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

    fn asks_native(self) -> bool {
        matches!(self, Self::NativeStart | Self::Native)
    }
}

/// Ipopt with the ladder behind it.
pub struct Ladder {
    ipopt: IpoptSolver,
    native: NativeSolver,
    rungs: Vec<Rung>,
    accepted: f64,
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
    /// Whether it was asked, and whether it solved the step.
    solved: Option<bool>,
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
        Self {
            ipopt,
            native: NativeSolver::new(world),
            rungs: rungs.to_vec(),
            accepted: LADDER_RESIDUAL * world.speed_scale(),
            certifier: Certifier::new(),
            asked: Asked {
                solved: None,
                solution: StepSolution::default(),
                point: ProgramPoint::zeros(n),
                flags: vec![false; n],
            },
            tried: StepSolution::default(),
            best: StepSolution::default(),
            best_point: ProgramPoint::zeros(n),
        }
    }

    /// One rung, from the flags of `contacts`; leaves its end in `tried`. `None` where the
    /// rung has nothing to start from.
    fn climb(
        &mut self,
        rung: Rung,
        step: &Step<'_>,
        contacts: &[Contact],
    ) -> Result<Option<Climbed>, Error> {
        let IpoptSolver { program, memory, flags, start, point, .. } = &mut self.ipopt;
        set_flags(contacts, flags);
        let mut multipliers = None;
        match rung {
            Rung::Warm => {
                multipliers = previous_point(memory, step, flags, start);
                if multipliers.is_none() {
                    return Ok(None);
                }
            }
            Rung::Previous => {
                previous_point(memory, step, flags, start);
            }
            Rung::NativeStart => {
                flags.copy_from_slice(&self.asked.flags);
                start.copy_from(&self.asked.point);
            }
            Rung::FreeFlight => start.set_free(&step.free[BODY]),
            Rung::SharedWeight => share_weight(step, flags, start),
            Rung::Native => {
                self.tried.copy_from(&self.asked.solution);
                point.copy_from(&self.asked.point);
                return Ok(Some(Climbed {
                    converged: self.asked.solved == Some(true),
                    iterations: 0,
                    message: None,
                    multipliers: None,
                }));
            }
        }
        let attempt = Attempt { start, multipliers, limit: rung.patience() };
        let attempted = Program::attempt(program, step, flags, attempt, point)?;
        set_solution(step, contacts, point, &mut self.tried);
        Ok(Some(Climbed {
            converged: attempted.converged,
            iterations: attempted.iterations,
            message: Some(attempted.status.name()),
            multipliers: attempted.multipliers,
        }))
    }

    /// Asks the native solver, once a step. It may admit contacts that detection missed; they
    /// then are contacts of the step.
    fn ask_native(&mut self, step: &Step<'_>, candidates: &mut Candidates) -> Result<(), Error> {
        if self.asked.solved.is_some() {
            return Ok(());
        }
        let Asked { solved, solution, point, flags } = &mut self.asked;
        let known = candidates.contacts().len();
        let report = self.native.solve(step, candidates, solution)?;
        *solved = Some(report.status != StepStatus::Failed);
        set_point(step, solution, point);
        flags.fill(false);
        for contact in solution.contacts.iter().filter(|contact| contact.carries_force()) {
            flags[contact.key.point] = true;
        }
        let admitted = &candidates.contacts()[known..];
        self.best.contacts.extend(admitted.iter().map(|contact| ContactForce::none(contact.key)));
        Ok(())
    }

    /// The residual of the rung tried last, m/s.
    fn residual(&mut self, step: &Step<'_>, contacts: &[Contact]) -> f64 {
        let (states, next) = (step.states, &self.tried.states);
        let claim = Claim { states, next, wrenches: step.wrenches, contacts };
        self.certifier.contact_step(step.world, &claim, self.tried.forces()).residual()
    }
}

/// Sets `start` to free flight with the weight on the flagged points.
fn share_weight(step: &Step<'_>, flags: &[bool], start: &mut ProgramPoint) {
    start.set_free(&step.free[BODY]);
    let count = flags.iter().filter(|flag| **flag).count().max(1) as f64;
    let share = step.world.bodies()[BODY].mass() * step.world.gravity().norm() / count;
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
        self.asked.solved = None;
        // Where no rung has an end to show, free flight is at least a motion.
        self.best.set_free(step.free);
        let contacts = candidates.contacts().iter();
        self.best.contacts.extend(contacts.map(|contact| ContactForce::none(contact.key)));
        self.best_point.set_free(&step.free[BODY]);
        let (mut least, mut multipliers) = (f64::INFINITY, None);
        let mut report = StepReport::without_problem(StepStatus::Failed);
        for index in 0..self.rungs.len() {
            let rung = self.rungs[index];
            if rung.asks_native() {
                self.ask_native(step, candidates)?;
            }
            let contacts = candidates.contacts();
            let Some(climbed) = self.climb(rung, step, contacts)? else { continue };
            report.iterations += climbed.iterations;
            report.message = climbed.message.or(report.message);
            let residual = self.residual(step, contacts);
            if residual < least {
                (least, multipliers) = (residual, climbed.multipliers);
                self.best.copy_from(&self.tried);
                self.best_point.copy_from(&self.ipopt.point);
                report.start = Some(rung.name());
            }
            let rounding = || rounding::residual(step.world, step.states, &self.tried.states);
            if climbed.converged && (residual <= self.accepted || residual <= rounding()) {
                report.status = rung.status();
                break;
            }
        }
        solution.copy_from(&self.best);
        self.ipopt.memory.keep(step.previous, solution, &self.best_point, multipliers);
        Ok(report)
    }
}
