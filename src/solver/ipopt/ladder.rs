//! Retry ladder: a sequence of start points ("rungs") for a step that Ipopt does not solve from its
//! first one. The last rung always has a solution.

use super::memory::Multipliers;
use super::posed::PosedContacts;
use super::program::{Attempted, IpoptEffort, StartMultipliers, solve_posed};
use super::{BODY, IpoptSolver, LADDER_RESIDUAL, Rung, missed_depth, start};
use crate::step_nlp::ProgramPoint;
use tumble_core::contact::certificate::{Certifier, Claim};
use tumble_core::contact::{Candidates, Contact, rounding};
use tumble_core::error::Error;
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::{ContactForce, Step, StepReport, StepSolution, StepSolver, StepStatus};
use tumble_core::world::World;

/// Iteration limit of a step over all rungs, unless the limit of one solve is larger. After it, the
/// native solution is used. From good start points Ipopt needs a tenth.
const STEP_BUDGET: u32 = 300;

/// Number of candidates above which the iteration limit shrinks in proportion: iterations are then
/// slow (10 ms with 100 candidates, 110 ms with 961).
const MANY_CANDIDATES: usize = 64;

impl Rung {
    /// Iteration limit. A good warm start needs few iterations. After 30 iterations from the
    /// previous solution the native start mostly needs fewer than five. After 60 from the native
    /// start another start is cheaper (docs/ipopt-path.md).
    fn patience(self) -> u32 {
        match self {
            Self::Warm => 25,
            Self::Previous => 30,
            Self::NativeStart => 60,
            Self::FreeFlight | Self::SharedWeight | Self::Native => u32::MAX,
        }
    }

    /// Status of a step solved by this rung.
    fn status(self) -> StepStatus {
        match self {
            Self::Warm | Self::Previous => StepStatus::Converged,
            Self::NativeStart | Self::FreeFlight | Self::SharedWeight => StepStatus::Retried,
            Self::Native => StepStatus::Fallback,
        }
    }
}

/// Iteration limit of a step with `candidates`, where one solve may use `max_iterations`.
fn budget(max_iterations: u32, candidates: usize) -> u32 {
    let usual = max_iterations.max(STEP_BUDGET);
    let share = MANY_CANDIDATES as f64 / candidates.max(MANY_CANDIDATES) as f64;
    ((f64::from(usual) * share) as u32).max(1)
}

/// Factors of the usual tolerance for further solves, if Ipopt met the usual tolerance and the
/// residual is still too large.
const TIGHTER: [f64; 3] = [1e-2, 1e-4, 1e-6];

/// Iteration limit with each tighter tolerance.
const PATIENCE_TIGHTER: u32 = 25;

/// Compliance of friction about the start's forces, as a fraction of the body's own response h/m.
const COMPLIANCE: f64 = 1e-2;

/// Fraction of the [accepted](LADDER_RESIDUAL) residual above which a tighter tolerance is worth
/// further iterations. The residual of settled steps is a tenth of it (docs/ipopt-path.md).
const WORTH_IT: f64 = 1e-2;

/// Ipopt with the retry ladder.
pub struct Ladder {
    ipopt: IpoptSolver,
    native: NativeSolver,
    rungs: Vec<Rung>,
    accepted: f64,
    certifier: Certifier,
    /// Native solution of the step, and whether it has been computed.
    native_solution: StepSolution,
    is_asked: bool,
    /// Result of the last rung.
    tried: StepSolution,
    /// Best result of the step: its solution, its point, and Ipopt's multipliers there.
    best: StepSolution,
    best_end: ProgramPoint,
    multipliers: Option<Multipliers>,
}

impl Ladder {
    /// Creates a ladder with the rungs in order; [`Rung::ALL`] is recommended.
    pub fn new(world: &World, ipopt: IpoptSolver, rungs: &[Rung]) -> Self {
        let best_end = ipopt.end.clone();
        Self {
            ipopt,
            native: NativeSolver::new(world),
            rungs: rungs.to_vec(),
            accepted: LADDER_RESIDUAL * world.speed_scale(),
            certifier: Certifier::new(),
            native_solution: StepSolution::default(),
            is_asked: false,
            tried: StepSolution::default(),
            best: StepSolution::default(),
            best_end,
            multipliers: None,
        }
    }

    /// Iteration limit of `rung`; unlimited for the last rung with Ipopt.
    fn patience(&self, rung: Rung) -> u32 {
        let last = self.rungs.iter().rfind(|rung| **rung != Rung::Native);
        if last == Some(&rung) { u32::MAX } else { rung.patience() }
    }

    /// Runs one rung and leaves its result in `tried`. Returns `None` if the rung has no start
    /// point.
    fn climb(
        &mut self,
        rung: Rung,
        step: &Step<'_>,
        candidates: &mut Candidates,
        left: u32,
    ) -> Result<Option<Attempted>, Error> {
        if rung == Rung::Native {
            let (solution, ipopt) = (&self.native_solution, &mut self.ipopt);
            let contacts = candidates.contacts();
            start::set_solution(&mut ipopt.end, contacts, solution, &ipopt.program.units);
            self.tried.copy_from(solution);
            // The residual decides: a failed native solution can still be within the ladder's
            // limit.
            return Ok(Some(Attempted::free()));
        }
        let limit = self.patience(rung).min(self.ipopt.program.max_iterations()).min(left);
        let Some(mut attempted) = self.start_from(rung, step, candidates, limit)? else {
            return Ok(None);
        };
        let contacts = candidates.contacts();
        self.write(step, contacts);
        self.tighten(step, contacts, left, &mut attempted)?;
        Ok(Some(attempted))
    }

    /// Solves from the start of `rung` in at most `limit` iterations. Returns `None` if the rung
    /// has no start point.
    fn start_from(
        &mut self,
        rung: Rung,
        step: &Step<'_>,
        candidates: &mut Candidates,
        limit: u32,
    ) -> Result<Option<Attempted>, Error> {
        let (depth, near) = match rung {
            // Ipopt seldom solves a step with a grazing force, 10⁻⁵ of the weight. Without it the
            // residual is the depth over h, within the limit (docs/ipopt-path.md).
            Rung::FreeFlight => {
                let depth = self.accepted * step.world.time_step();
                (depth, -depth)
            }
            _ => {
                let depth = missed_depth(step, self.accepted);
                (depth, depth)
            }
        };
        let contacts = candidates.contacts();
        let native = &self.native_solution;
        let IpoptSolver { program, memory, posed, start: x, end, .. } = &mut self.ipopt;
        let units = program.units;
        let free = units.state(&step.free[BODY]);
        *posed = program.closed(step, contacts, near);
        let mut multipliers = StartMultipliers::Estimated;
        // Initial point and multipliers of each rung
        match rung {
            Rung::Warm => {
                let known = memory.multipliers(step.previous);
                let keys = posed.keys(contacts);
                let Some(known) = known.filter(|known| known.contacts == keys) else {
                    return Ok(None);
                };
                multipliers = StartMultipliers::Known(known);
                start::set_previous(x, step, contacts, memory.point(step.previous), &units);
                start::coast(x, program.world());
            }
            Rung::Previous => {
                start::set_previous(x, step, contacts, memory.point(step.previous), &units)
            }
            Rung::NativeStart => {
                multipliers = StartMultipliers::Zero;
                start::set_solution(x, contacts, native, &units);
                *posed =
                    PosedContacts::new(contacts, |index, _| native.contacts[index].carries_force());
            }
            Rung::FreeFlight => x.set_free(&free),
            Rung::SharedWeight => start::share_weight(x, &free, program.world(), contacts, posed),
            Rung::Native => return Ok(None),
        }
        let (tightness, compliance) = (1.0, COMPLIANCE);
        let effort = IpoptEffort { multipliers, limit, depth, tightness, compliance };
        solve_posed(program, step, x, effort, candidates, posed, end).map(Some)
    }

    /// Continues with tighter tolerances if Ipopt met its tolerance and the residual is too large.
    /// A contact lighter than the body needs a tighter tolerance than the program's scale. Keeps
    /// the better result.
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
            let Some(known) = &attempted.multipliers else { break };
            let limit = PATIENCE_TIGHTER.min(left - attempted.iterations);
            let multipliers = StartMultipliers::Known(known);
            let compliance = COMPLIANCE;
            let effort = IpoptEffort { multipliers, limit, depth: 0.0, tightness, compliance };
            let IpoptSolver { program, posed, start, end, .. } = &mut self.ipopt;
            start.copy_from(end);
            let mut tighter = program.attempt(step, contacts, posed, start, effort, end)?;
            tighter.iterations += attempted.iterations;
            let is_better = tighter.converged && {
                self.write(step, contacts);
                self.residual(step, contacts) < residual
            };
            if !is_better {
                let IpoptSolver { start, end, .. } = &mut self.ipopt;
                end.copy_from(start);
                self.write(step, contacts);
                attempted.iterations = tighter.iterations;
                break;
            }
            *attempted = tighter;
        }
        Ok(())
    }

    /// Writes Ipopt's result to `tried`.
    fn write(&mut self, step: &Step<'_>, contacts: &[Contact]) {
        let IpoptSolver { program, end, .. } = &self.ipopt;
        start::write(end, step, contacts, program, &mut self.tried);
    }

    /// True if the last result solves the step.
    fn is_solved(&mut self, step: &Step<'_>, contacts: &[Contact], converged: bool) -> bool {
        let residual = self.residual(step, contacts);
        converged && (residual <= self.accepted || self.is_rounding(step, residual))
    }

    fn is_rounding(&self, step: &Step<'_>, residual: f64) -> bool {
        residual <= rounding::residual(step.world, step.states, &self.tried.states)
    }

    /// Computes the native solution once per step. The native solver may admit contacts that
    /// detection missed; they become contacts of the step.
    fn ask_native(&mut self, step: &Step<'_>, candidates: &mut Candidates) -> Result<(), Error> {
        if !self.is_asked {
            self.native.solve(step, candidates, &mut self.native_solution)?;
            self.is_asked = true;
        }
        add_late(candidates.contacts(), &mut self.native_solution);
        Ok(())
    }

    /// Residual of the last rung, m/s.
    fn residual(&mut self, step: &Step<'_>, contacts: &[Contact]) -> f64 {
        let states = step.states;
        let wrenches = step.wrenches;
        let tried = &self.tried;
        let next = &tried.states;
        let claim = Claim { states, next, wrenches, contacts, joints: &[], gears: &[] };
        self.certifier.contact_step(step.world, &claim, self.tried.forces()).residual()
    }
}

/// Appends contacts that were admitted after `solution` was found, with zero force.
fn add_late(contacts: &[Contact], solution: &mut StepSolution) {
    let late = &contacts[solution.contacts.len()..];
    solution.contacts.extend(late.iter().map(|contact| ContactForce::none(contact.key)));
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
        self.is_asked = false;
        self.ipopt.begin(step, candidates.contacts())?;
        // If no rung has a result, free flight is reported.
        self.best.set_free(step.free);
        self.best_end.set_free(&self.ipopt.program.units.state(&step.free[BODY]));
        self.multipliers = None;
        let most = self.ipopt.program.max_iterations();
        let budget = budget(most, candidates.contacts().len());
        let mut least = f64::INFINITY;
        let mut report = StepReport::without_problem(StepStatus::Failed);
        // Rungs in order, within the budget of iterations
        for index in 0..self.rungs.len() {
            let rung = self.rungs[index];
            if matches!(rung, Rung::NativeStart | Rung::Native) {
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
            // The best point of all rungs is kept.
            let is_solved = self.is_solved(step, contacts, attempted.converged);
            let residual = self.residual(step, contacts);
            if residual < least {
                least = residual;
                self.best.copy_from(&self.tried);
                self.best_end.copy_from(&self.ipopt.end);
                self.multipliers = attempted.multipliers;
                report.start = Some(rung.name());
            }
            if is_solved {
                report.status = rung.status();
                break;
            }
        }
        add_late(candidates.contacts(), &mut self.best);
        solution.copy_from(&self.best);
        let multipliers = self.multipliers.take();
        self.ipopt.memory.keep(step.previous, solution, &self.best_end, multipliers);
        Ok(report)
    }

    fn change_world(&mut self, world: &World) -> Result<(), Error> {
        self.ipopt.change_world(world)?;
        self.accepted = LADDER_RESIDUAL * world.speed_scale();
        self.native.change_world(world)
    }

    #[cfg(feature = "save")]
    fn memory(&self) -> Vec<u8> {
        self.ipopt.remembered()
    }

    #[cfg(feature = "save")]
    fn recall(&mut self, world: &World, memory: &[u8]) -> Result<(), Error> {
        self.ipopt.remember(world, memory)
    }
}
