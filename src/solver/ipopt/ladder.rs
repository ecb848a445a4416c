//! What is tried when Ipopt does not solve a step from its first start: a ladder of
//! rungs, each with its reason, the last of which always holds.

use super::memory::Multipliers;
use super::posed::PosedProgram;
use super::posing::{posed_in, solve_posed};
use super::program::{Attempted, Hold, IpoptEffort, StartMultipliers};
use super::start::ProgramStart;
use super::{IpoptSolver, Rung, missed_depth};
use tumble_core::contact::certificate::{Certifier, Claim};
use tumble_core::contact::{Candidates, Contact, Partner, rounding};
use tumble_core::error::Error;
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::{ContactForce, Step, StepReport, StepSolution, StepSolver, StepStatus};
use tumble_core::world::World;

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

/// How firmly the ladder holds on to the forces of a start, and how exact it asks Ipopt to be.
struct Manner {
    /// Friction's part of [`Hold`].
    friction: f64,
    /// That of normal forces where those of the start have settled; where they have not, they are
    /// free: an impact is far from what was before it.
    normal: f64,
    /// A residual above this part of the [accepted](LADDER_RESIDUAL) one is worth going on for with a
    /// tighter tolerance.
    worth_it: f64,
}

/// Where bodies touch the ground alone. Friction that has settled is exact; where it has not, and the residual
/// says so, Ipopt goes on from the end with this as the start, and what is left is this part of it. A
/// cost for normal forces takes a cube that slides or tips from 2 iterations a step to 21. Worth going
/// on for is ten times what settled steps have; steps of friction that has just stopped or begun are
/// above it (docs/ipopt-path.md).
const APART: Manner = Manner { friction: 1e-2, normal: 0.0, worth_it: 1e-2 };

/// Where bodies touch each other or fixed pieces, in more points than carry them. Without a cost a stack of five at
/// rest takes 59 iterations a step, with 10⁻⁶ 33, with 10⁻³ 4, with 10⁻² and more 2. Whatever is solved
/// is good enough (docs/ipopt-path.md).
const TOGETHER: Manner = Manner { friction: 0.1, normal: 0.1, worth_it: 1.0 };

impl Manner {
    /// That of what is `posed` of `candidates`.
    fn of(candidates: &[Contact], posed: &PosedProgram) -> &'static Self {
        let mut partners = posed.contacts.iter().map(|&index| candidates[index].key.partner);
        if partners.any(|partner| partner != Partner::Ground) { &TOGETHER } else { &APART }
    }

    /// How firmly to hold on to forces that have `settled`, or have not.
    fn hold(&self, settled: bool) -> Hold {
        Hold { friction: self.friction, normal: if settled { self.normal } else { 0.0 } }
    }
}

/// Ipopt with the ladder behind it.
pub struct Ladder {
    ipopt: IpoptSolver,
    native: NativeSolver,
    rungs: Vec<Rung>,
    accepted: f64,
    certifier: Certifier,
    /// The native solution of the step, and whether it was asked for.
    native_solution: StepSolution,
    is_asked: bool,
    /// The end of the rung that was tried last.
    tried: StepSolution,
    /// The best end of the step: as a solution, as a point, and what Ipopt ended there with.
    best: StepSolution,
    best_end: ProgramStart,
    multipliers: Option<Multipliers>,
}

impl Ladder {
    /// Ipopt and the rungs to try, in order; [`Rung::ALL`] is the recommended ladder.
    #[must_use]
    pub fn new(world: &World, ipopt: IpoptSolver, rungs: &[Rung]) -> Self {
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
            best_end: ProgramStart::default(),
            multipliers: None,
        }
    }

    /// How many iterations to wait for from `rung`: without end from the last start that there is.
    fn patience(&self, rung: Rung) -> u32 {
        let last = self.rungs.iter().rfind(|rung| **rung != Rung::Native);
        if last == Some(&rung) { u32::MAX } else { rung.patience() }
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
            let (solution, units) = (&self.native_solution, &self.ipopt.program.units);
            self.ipopt.end.set_solution(step, candidates.contacts(), solution, units);
            self.tried.copy_from(solution);
            // The residual decides: what the native solver fails may be within what the ladder promises.
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

    /// Solves from the start of `rung` in at most `limit` iterations. `None` where the rung has nothing
    /// to start from.
    fn start_from(
        &mut self,
        rung: Rung,
        step: &Step<'_>,
        candidates: &mut Candidates,
        limit: u32,
    ) -> Result<Option<Attempted>, Error> {
        let depth = missed_depth(step, self.accepted);
        let (contacts, native) = (candidates.contacts(), &self.native_solution);
        let IpoptSolver { program, memory, posed, start, end, .. } = &mut self.ipopt;
        let units = program.units;
        *posed = posed_in(program, step, contacts, depth);
        let mut multipliers = StartMultipliers::Estimated;
        match rung {
            Rung::Warm => {
                let known = memory.multipliers(step.previous);
                let keys = posed.keys(contacts);
                let Some(known) = known.filter(|known| known.contacts == keys) else {
                    return Ok(None);
                };
                multipliers = StartMultipliers::Known(known);
                start.set_previous(step, contacts, memory.point(step.previous), &units);
                start.coast(step, posed);
            }
            Rung::Previous => {
                start.set_previous(step, contacts, memory.point(step.previous), &units)
            }
            Rung::NativeStart => {
                multipliers = StartMultipliers::Zero;
                start.set_solution(step, contacts, native, &units);
                *posed =
                    PosedProgram::of(contacts, |index, _| native.contacts[index].carries_force());
            }
            Rung::FreeFlight => start.reset(step.free, contacts.len()),
            Rung::SharedWeight => start.share_weight(step, contacts, posed, &units),
            Rung::Native => return Ok(None),
        }
        let hold = Manner::of(contacts, posed).hold(rung.has_settled());
        let effort = IpoptEffort { multipliers, limit, depth, tightness: 1.0, hold };
        solve_posed(program, step, start, effort, candidates, posed, end).map(Some)
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
        let manner = Manner::of(contacts, &self.ipopt.posed);
        for tightness in TIGHTER {
            let residual = self.residual(step, contacts);
            if attempted.iterations >= left
                || residual <= manner.worth_it * self.accepted
                || self.is_rounding(step, residual)
            {
                break;
            }
            let Some(known) = &attempted.multipliers else { break };
            let limit = PATIENCE_TIGHTER.min(left - attempted.iterations);
            let (multipliers, hold) = (StartMultipliers::Known(known), manner.hold(true));
            let effort = IpoptEffort { multipliers, limit, depth: 0.0, tightness, hold };
            let IpoptSolver { program, posed, start, end, .. } = &mut self.ipopt;
            start.clone_from(end);
            let mut tighter = program.attempt(step, contacts, posed, start, effort, end)?;
            tighter.iterations += attempted.iterations;
            let is_better = tighter.converged && {
                self.write(step, contacts);
                self.residual(step, contacts) < residual
            };
            if !is_better {
                let IpoptSolver { start, end, .. } = &mut self.ipopt;
                end.clone_from(start);
                self.write(step, contacts);
                attempted.iterations = tighter.iterations;
                break;
            }
            *attempted = tighter;
        }
        Ok(())
    }

    /// Writes Ipopt's end to `tried`.
    fn write(&mut self, step: &Step<'_>, contacts: &[Contact]) {
        let IpoptSolver { program, end, .. } = &self.ipopt;
        end.write(step, contacts, &program.units, &mut self.tried);
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
        let (states, wrenches, tried) = (step.states, step.wrenches, &self.tried);
        let next = &tried.states;
        let claim = Claim { states, next, wrenches, contacts, joints: &[], gears: &[] };
        self.certifier.contact_step(step.world, &claim, self.tried.forces()).residual()
    }
}

/// Contacts that were admitted after `solution` was found have no force in it.
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
        // Where no rung has an end to show, free flight is at least a motion.
        self.best.set_free(step.free);
        self.best_end.reset(step.free, 0);
        self.multipliers = None;
        let most = self.ipopt.program.max_iterations();
        let budget = budget(most, candidates.contacts().len());
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
                self.best.copy_from(&self.tried);
                self.best_end.clone_from(&self.ipopt.end);
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
        let (end, multipliers) = (&mut self.best_end, self.multipliers.take());
        end.values.resize_with(solution.contacts.len(), Default::default);
        self.ipopt.memory.keep(step.previous, solution, end, multipliers);
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
