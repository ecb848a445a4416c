//! What is tried when Ipopt does not solve a step from its first start: a ladder of
//! rungs, each with its reason, the last of which always holds.

use super::missed_depth;
use super::program::Attempted;
use crate::contact::certificate::{Certifier, Claim};
use crate::contact::{Candidates, Contact, rounding};
use crate::error::Error;
use crate::solver::native::NativeSolver;
use crate::step::{ContactForce, Step, StepReport, StepSolution, StepSolver, StepStatus};
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
fn budget(max_iterations: u32, candidates: usize) -> u32 {
    let usual = max_iterations.max(STEP_BUDGET);
    let share = MANY_CANDIDATES as f64 / candidates.max(MANY_CANDIDATES) as f64;
    ((f64::from(usual) * share) as u32).max(1)
}

/// The tolerances, as parts of the usual one, with which Ipopt goes on where it has met the usual
/// one and the residual is too large.
const TIGHTER: [f64; 3] = [1e-2, 1e-4, 1e-6];

/// Iterations with each of them.
const PATIENCE_TIGHTER: u32 = 25;

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

/// A program of the step that climbs the ladder: starts for its rungs, one solve after another, and
/// what is remembered of the last steps.
///
/// It has an *end*, that of its last solve, and the *best* end of the step.
pub(super) trait Climber: Send {
    /// A residual above this part of the [accepted](LADDER_RESIDUAL) one is worth going on for with a
    /// tighter tolerance.
    const WORTH_IT: f64;

    /// Takes up `step`, with free flight for the best end.
    ///
    /// # Errors
    /// A step that is none of the program's world.
    fn begin(&mut self, step: &Step<'_>, contacts: &[Contact]) -> Result<(), Error>;

    /// The most iterations of one solve.
    fn max_iterations(&self) -> u32;

    /// How many iterations to wait for from `rung`, one of `rungs`.
    fn patience(&self, rung: Rung, rungs: &[Rung]) -> u32;

    /// Solves from the start of `rung` in at most `limit` iterations. Contacts that are missed by more
    /// than `depth` (m) are admitted. `None` where the rung has nothing to start from.
    ///
    /// # Errors
    /// What Ipopt refuses; an interrupt.
    fn climb(
        &mut self,
        rung: Rung,
        step: &Step<'_>,
        candidates: &mut Candidates,
        native: &StepSolution,
        within: Within,
    ) -> Result<Option<Attempted>, Error>;

    /// Goes on from the end of what was `attempted` with this part of the usual tolerance, in at most
    /// `limit` iterations. `None` where the multipliers of the end are not known.
    ///
    /// # Errors
    /// As [`Climber::climb`].
    fn tighten(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        attempted: &Attempted,
        tightness: f64,
        limit: u32,
    ) -> Result<Option<Attempted>, Error>;

    /// Makes the end the one before it was tightened last.
    fn undo(&mut self);

    /// Makes the end a solution of the step.
    fn set_end(&mut self, step: &Step<'_>, contacts: &[Contact], solution: &StepSolution);

    /// Writes the end to `solution`.
    fn write(&self, step: &Step<'_>, contacts: &[Contact], solution: &mut StepSolution);

    /// Makes the end the best one, with the multipliers of the attempt.
    fn keep_best(&mut self, attempted: Attempted);

    /// Remembers the best end, which `solution` is, as what followed `step.previous`.
    fn remember(&mut self, step: &Step<'_>, solution: &StepSolution);
}

/// What a rung may take.
#[derive(Debug, Clone, Copy)]
pub(super) struct Within {
    /// Iterations.
    pub(super) limit: u32,
    /// A contact that ends no deeper need not have been posed, m.
    pub(super) depth: f64,
}

/// Ipopt with the ladder behind it, on the program `C`.
pub(super) struct Climb<C> {
    climber: C,
    native: NativeSolver,
    rungs: Vec<Rung>,
    accepted: f64,
    certifier: Certifier,
    /// The native solution of the step, and whether it was asked for.
    native_solution: StepSolution,
    is_asked: bool,
    /// The end of the rung that was tried last, and the best one.
    tried: StepSolution,
    best: StepSolution,
}

impl<C: Climber> Climb<C> {
    pub(super) fn of(world: &World, climber: C, rungs: &[Rung]) -> Self {
        Self {
            climber,
            native: NativeSolver::new(world),
            rungs: rungs.to_vec(),
            accepted: LADDER_RESIDUAL * world.speed_scale(),
            certifier: Certifier::new(),
            native_solution: StepSolution::default(),
            is_asked: false,
            tried: StepSolution::default(),
            best: StepSolution::default(),
        }
    }

    /// One rung; leaves its end in `tried`. `None` where the rung has nothing to start from.
    fn climb(
        &mut self,
        rung: Rung,
        step: &Step<'_>,
        candidates: &mut Candidates,
        left: u32,
    ) -> Result<Option<Attempted>, Error> {
        if rung == Rung::Native {
            self.climber.set_end(step, candidates.contacts(), &self.native_solution);
            self.tried.copy_from(&self.native_solution);
            // The residual decides: what the native solver fails may be within what the ladder promises.
            return Ok(Some(Attempted::free()));
        }
        let patience = self.climber.patience(rung, &self.rungs);
        let limit = patience.min(self.climber.max_iterations()).min(left);
        let within = Within { limit, depth: missed_depth(step, self.accepted) };
        let native = &self.native_solution;
        let Some(mut attempted) = self.climber.climb(rung, step, candidates, native, within)?
        else {
            return Ok(None);
        };
        let contacts = candidates.contacts();
        self.climber.write(step, contacts, &mut self.tried);
        self.tighten(step, contacts, left, &mut attempted)?;
        Ok(Some(attempted))
    }

    /// Where Ipopt meets its tolerance and the step is not solved, goes on from the end with
    /// smaller ones: a contact that is lighter than the body needs more than the program's scale
    /// asks for. The better end stays.
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
                || residual <= C::WORTH_IT * self.accepted
                || self.is_rounding(step, residual)
            {
                break;
            }
            let limit = PATIENCE_TIGHTER.min(left - attempted.iterations);
            let tighter = self.climber.tighten(step, contacts, attempted, tightness, limit)?;
            let Some(mut tighter) = tighter else { break };
            tighter.iterations += attempted.iterations;
            let is_better = tighter.converged && {
                self.climber.write(step, contacts, &mut self.tried);
                self.residual(step, contacts) < residual
            };
            if !is_better {
                self.climber.undo();
                self.climber.write(step, contacts, &mut self.tried);
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
        if !self.is_asked {
            self.native.solve(step, candidates, &mut self.native_solution)?;
            self.is_asked = true;
        }
        add_late(candidates.contacts(), &mut self.native_solution);
        Ok(())
    }

    /// The residual of the rung tried last, m/s.
    fn residual(&mut self, step: &Step<'_>, contacts: &[Contact]) -> f64 {
        let (states, next) = (step.states, &self.tried.states);
        let claim = Claim { states, next, wrenches: step.wrenches, contacts };
        self.certifier.contact_step(step.world, &claim, self.tried.forces()).residual()
    }
}

/// Contacts that were admitted after `solution` was found have no force in it.
fn add_late(contacts: &[Contact], solution: &mut StepSolution) {
    let late = &contacts[solution.contacts.len()..];
    solution.contacts.extend(late.iter().map(|contact| ContactForce::none(contact.key)));
}

impl<C: Climber> StepSolver for Climb<C> {
    fn accepted_residual(&self) -> f64 {
        self.accepted
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        self.is_asked = false;
        self.climber.begin(step, candidates.contacts())?;
        // Where no rung has an end to show, free flight is at least a motion.
        self.best.set_free(step.free);
        let budget = budget(self.climber.max_iterations(), candidates.contacts().len());
        let mut least = f64::INFINITY;
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
            let Some(attempted) = self.climb(rung, step, candidates, left)? else { continue };
            let contacts = candidates.contacts();
            report.iterations += attempted.iterations;
            if rung != Rung::Native {
                report.message = Some(attempted.status.name());
            }
            let is_solved = self.is_solved(step, contacts, attempted.converged);
            let residual = self.residual(step, contacts);
            if residual < least {
                least = residual;
                self.climber.keep_best(attempted);
                self.best.copy_from(&self.tried);
                report.start = Some(rung.name());
            }
            if is_solved {
                report.status = rung.status();
                break;
            }
        }
        add_late(candidates.contacts(), &mut self.best);
        solution.copy_from(&self.best);
        self.climber.remember(step, solution);
        Ok(report)
    }
}
