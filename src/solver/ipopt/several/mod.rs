//! Ipopt for several bodies: the [program of several bodies](crate::step_nlp::several) with the
//! [rungs](Rung) of one body.
//!
//! A step is posed with the contacts that free flight closes and those that carried a force in the
//! step before. Where its end takes another pair of features into each other, that one joins and
//! the step is solved again. Bodies without such a contact are in free flight.

mod program;
mod start;

use super::ladder::{LADDER_RESIDUAL, PATIENCE_TIGHTER, Rung, TIGHTER, budget};
use super::memory::Multipliers;
use super::program::Attempted;
use super::{missed_depth, of_another_world};
use crate::contact::certificate::{Certifier, Claim};
use crate::contact::{Candidates, Contact, ContactKey, Partner, rounding};
use crate::error::Error;
use crate::ipopt::Options;
use crate::mechanics::quaternion::advance;
use crate::solver::native::NativeSolver;
use crate::step::{ContactForce, Step, StepReport, StepSolution, StepSolver, StepStatus};
use crate::world::World;
use program::{Effort, Posed, Program, StartMultipliers};
use start::{Memory, Poses, Start};

/// More bodies than this are refused: see [`SeveralLadder::new`].
pub const MOST_BODIES: usize = 10;

/// How many iterations to wait for from the previous solution without its multipliers: where it has
/// not led to the end by then, the native start mostly does in less than five.
const PATIENCE_PREVIOUS: u32 = 30;

/// Ipopt for worlds of several bodies, with fixed pieces, rounded points or coefficients of
/// friction of their own, with the ladder behind it.
pub struct SeveralLadder {
    program: Program,
    native: NativeSolver,
    rungs: Vec<Rung>,
    accepted: f64,
    certifier: Certifier,
    memory: Memory,
    /// Whether the native solver was asked for the step, and whether it solved it; its solution.
    asked: Option<bool>,
    native_solution: StepSolution,
    /// The start and the end of the rung that was tried last.
    start: Start,
    end: Start,
    tried: StepSolution,
    /// The best end of the rungs so far.
    best: StepSolution,
    best_end: Start,
}

/// The end of a rung, its point in the ladder's buffers.
struct Climbed {
    converged: bool,
    iterations: u32,
    message: Option<&'static str>,
    multipliers: Option<(Vec<ContactKey>, Multipliers)>,
}

impl SeveralLadder {
    /// Ipopt for `world` with `options` and the rungs to try, in order; [`Rung::ALL`] is the
    /// recommended ladder.
    ///
    /// # Errors
    /// An option out of its range; more than [`MOST_BODIES`] bodies, which the native solver is
    /// made for.
    pub fn new(world: &World, options: Options, rungs: &[Rung]) -> Result<Self, Error> {
        let bodies = world.bodies().len();
        if bodies > MOST_BODIES {
            let why = format!(
                "the world has {bodies} bodies; allowed is up to {MOST_BODIES}, and `native` takes \
                 any number"
            );
            return Err(Error::Solver { solver: "Ipopt", why });
        }
        Ok(Self {
            program: Program::new(world, options)?,
            native: NativeSolver::new(world),
            rungs: rungs.to_vec(),
            accepted: LADDER_RESIDUAL * world.speed_scale(),
            certifier: Certifier::new(),
            memory: Memory::default(),
            asked: None,
            native_solution: StepSolution::default(),
            start: Start::default(),
            end: Start::default(),
            tried: StepSolution::default(),
            best: StepSolution::default(),
            best_end: Start::default(),
        })
    }

    /// One rung; leaves its end in `end` and `tried`. `None` where it has nothing to start from.
    fn climb(
        &mut self,
        rung: Rung,
        step: &Step<'_>,
        candidates: &mut Candidates,
        left: u32,
    ) -> Result<Option<Climbed>, Error> {
        let units = self.program.units;
        let contacts = candidates.contacts();
        let mut posed = self.pose(step, contacts);
        match rung {
            Rung::Warm => {
                let known = self.memory.multipliers(step.previous);
                if known.is_none_or(|(keys, _)| *keys != keys_of(contacts, &posed)) {
                    return Ok(None);
                }
                self.start.set_previous(step, contacts, &self.memory, &units);
                coast(step, &posed, &mut self.start);
            }
            Rung::Previous => self.start.set_previous(step, contacts, &self.memory, &units),
            Rung::NativeStart => {
                self.start.set_solution(step, contacts, &self.native_solution, &units);
                let forces = self.native_solution.contacts.iter();
                let carry = forces.enumerate().filter(|(_, force)| force.carries_force());
                posed = Posed::of(contacts, carry.map(|(index, _)| index).collect());
            }
            Rung::FreeFlight => self.start.reset(step.free, contacts.len()),
            Rung::SharedWeight => self.start.share_weight(step, (contacts, &posed), &units),
            Rung::Native => {
                self.tried.copy_from(&self.native_solution);
                self.end.set_solution(step, contacts, &self.native_solution, &units);
                return Ok(Some(Climbed {
                    converged: self.asked == Some(true),
                    iterations: 0,
                    message: None,
                    multipliers: None,
                }));
            }
        }
        let patience = self.patience(rung);
        let depth = missed_depth(step, self.accepted);
        let settled = matches!(rung, Rung::Warm | Rung::NativeStart);
        let Self { program, memory, start, end, .. } = &mut *self;
        let multipliers = match (rung, memory.multipliers(step.previous)) {
            (Rung::Warm, Some((_, known))) => StartMultipliers::Known(known),
            (Rung::NativeStart, _) => StartMultipliers::Zero,
            _ => StartMultipliers::Estimated,
        };
        let limit = patience.min(program.max_iterations()).min(left);
        let effort = Effort { limit, tightness: 1.0, settled };
        let posing = (&mut *candidates, &mut posed);
        let from = (start, multipliers);
        let mut attempted = solve_posed(program, step, from, (effort, depth), posing, end)?;
        let contacts = candidates.contacts();
        self.end.write(step, contacts, &units, &mut self.tried);
        self.tighten(step, (contacts, &posed), left, &mut attempted)?;
        let keys = keys_of(contacts, &posed);
        Ok(Some(Climbed {
            converged: attempted.converged,
            iterations: attempted.iterations,
            message: Some(attempted.status.name()),
            multipliers: attempted.multipliers.map(|multipliers| (keys, multipliers)),
        }))
    }

    /// How many iterations to wait for from `rung`: without end from the last start that there is.
    fn patience(&self, rung: Rung) -> u32 {
        let last = self.rungs.iter().rfind(|rung| **rung != Rung::Native);
        match rung {
            last_start if last == Some(&last_start) => u32::MAX,
            Rung::Previous => PATIENCE_PREVIOUS,
            other => other.patience(),
        }
    }

    /// The candidates that free flight closes, to what a missed one may be deep, and those that
    /// carried a force in the step before.
    fn pose(&self, step: &Step<'_>, contacts: &[Contact]) -> Posed {
        let free = Poses::of(step.states, step.free);
        let near = missed_depth(step, self.accepted);
        let taken = contacts.iter().enumerate().filter(|(place, contact)| {
            let before = step.previous.find(&contact.key, *place);
            let rests = matches!(contact.key.partner, Partner::Body(_))
                && before.is_some_and(ContactForce::carries_force);
            rests || free.gap(contact) <= near
        });
        Posed::of(contacts, taken.map(|(place, _)| place).collect())
    }

    /// Where Ipopt meets its tolerance and the step is not solved, goes on from the end with
    /// smaller ones.
    fn tighten(
        &mut self,
        step: &Step<'_>,
        (contacts, posed): (&[Contact], &Posed),
        left: u32,
        attempted: &mut Attempted,
    ) -> Result<(), Error> {
        for tightness in TIGHTER {
            if attempted.iterations >= left || self.is_solved(step, contacts, attempted.converged) {
                break;
            }
            let Some(multipliers) = &attempted.multipliers else { break };
            let Self { program, start, end, .. } = &mut *self;
            start.clone_from(end);
            let limit = PATIENCE_TIGHTER.min(left - attempted.iterations);
            let effort = Effort { limit, tightness, settled: true };
            let from = (&*start, StartMultipliers::Known(multipliers));
            let mut tighter = program.attempt(step, (contacts, posed), from, effort, end)?;
            tighter.iterations += attempted.iterations;
            if !tighter.converged {
                end.clone_from(start);
                attempted.iterations = tighter.iterations;
                break;
            }
            *attempted = tighter;
            let units = program.units;
            self.end.write(step, contacts, &units, &mut self.tried);
        }
        Ok(())
    }

    /// Whether the end that was tried last solves the step.
    fn is_solved(&mut self, step: &Step<'_>, contacts: &[Contact], converged: bool) -> bool {
        let residual = self.residual(step, contacts);
        let rounding = || rounding::residual(step.world, step.states, &self.tried.states);
        converged && (residual <= self.accepted || residual <= rounding())
    }

    /// Asks the native solver, once a step. It may admit contacts that detection missed.
    fn ask_native(&mut self, step: &Step<'_>, candidates: &mut Candidates) -> Result<(), Error> {
        if self.asked.is_none() {
            let report = self.native.solve(step, candidates, &mut self.native_solution)?;
            self.asked = Some(report.status != StepStatus::Failed);
        }
        // What was admitted since has no force in it.
        let late = &candidates.contacts()[self.native_solution.contacts.len()..];
        let none = late.iter().map(|contact| ContactForce::none(contact.key));
        self.native_solution.contacts.extend(none);
        Ok(())
    }

    /// The residual of the rung tried last, m/s.
    fn residual(&mut self, step: &Step<'_>, contacts: &[Contact]) -> f64 {
        let (states, next) = (step.states, &self.tried.states);
        let claim = Claim { states, next, wrenches: step.wrenches, contacts };
        self.certifier.contact_step(step.world, &claim, self.tried.forces()).residual()
    }
}

impl Posed {
    /// These candidates, in ascending order, and the bodies that they are of.
    fn of(candidates: &[Contact], contacts: Vec<usize>) -> Self {
        let mut bodies = Vec::new();
        for &index in &contacts {
            bodies.push(candidates[index].key.body);
            if let Partner::Body(other) = candidates[index].key.partner {
                bodies.push(other);
            }
        }
        bodies.sort_unstable();
        bodies.dedup();
        Self { bodies, contacts }
    }
}

fn keys_of(candidates: &[Contact], posed: &Posed) -> Vec<ContactKey> {
    posed.contacts.iter().map(|&index| candidates[index].key).collect()
}

/// Moves the states of the bodies that take part, those of step k, on by one step at their own
/// velocities.
fn coast(step: &Step<'_>, posed: &Posed, start: &mut Start) {
    let h = step.world.time_step();
    for &body in &posed.bodies {
        let state = &mut start.states[body];
        state.position += h * state.velocity;
        state.attitude = advance(&state.attitude, &state.spin, h);
    }
}

/// Solves `step` with what is `posed`, from `start`, and again with the contacts that it missed, in
/// all within `effort`. A contact that ends no deeper than `depth` (m) need not have been
/// posed. `posed` is that of the last solve.
fn solve_posed(
    program: &mut Program,
    step: &Step<'_>,
    (start, multipliers): (&mut Start, StartMultipliers<'_>),
    (effort, depth): (Effort, f64),
    (candidates, posed): (&mut Candidates, &mut Posed),
    end: &mut Start,
) -> Result<Attempted, Error> {
    let limit = effort.limit;
    let contacts = candidates.contacts();
    let mut attempted = if posed.contacts.is_empty() {
        end.reset(step.free, contacts.len());
        Attempted::free()
    } else {
        program.attempt(step, (contacts, posed), (start, multipliers), effort, end)?
    };
    while attempted.converged && attempted.iterations < limit {
        candidates.admit_missed(step.world, step.states, &end.states, depth);
        let contacts = candidates.contacts();
        let poses = Poses::of(step.states, &end.states);
        let mut taken = posed.contacts.clone();
        let missed = (0..contacts.len()).filter(|index| {
            posed.contacts.binary_search(index).is_err() && poses.gap(&contacts[*index]) < -depth
        });
        taken.extend(missed);
        if taken.len() == posed.contacts.len() {
            break;
        }
        taken.sort_unstable();
        *posed = Posed::of(contacts, taken);
        start.values.resize_with(contacts.len(), Default::default);
        let effort = Effort { limit: limit - attempted.iterations, settled: false, ..effort };
        let from = (&*start, StartMultipliers::Estimated);
        let before = attempted.iterations;
        attempted = program.attempt(step, (contacts, posed), from, effort, end)?;
        attempted.iterations += before;
    }
    end.values.resize_with(candidates.contacts().len(), Default::default);
    Ok(attempted)
}

impl StepSolver for SeveralLadder {
    fn accepted_residual(&self) -> f64 {
        self.accepted
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        self.asked = None;
        step.check(candidates.contacts())?;
        if self.program.bodies() != step.world.bodies().len() {
            return Err(of_another_world());
        }
        if self.program.set_units(step) {
            self.memory.clear();
        }
        // Where no rung has an end to show, free flight is at least a motion.
        self.best.set_free(step.free);
        self.best_end.reset(step.free, 0);
        let budget = budget(self.program.max_iterations(), candidates.contacts().len());
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
                self.best_end.clone_from(&self.end);
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
        self.best_end.values.resize_with(self.best.contacts.len(), Default::default);
        solution.copy_from(&self.best);
        self.memory.keep(step.previous, solution, &self.best_end.values, multipliers);
        Ok(report)
    }
}
