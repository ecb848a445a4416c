//! Ipopt for several bodies: the [program of several bodies](crate::step_nlp::several) with the
//! [rungs](Rung) of one body.
//!
//! A step is posed with the contacts that free flight closes and those that carried a force in the
//! step before. Where its end takes another pair of features into each other, that one joins and
//! the step is solved again. Bodies without such a contact are in free flight.

mod program;
mod start;

use super::ladder::{Climb, Climber, Rung, Within};
use super::memory::Multipliers;
use super::of_another_world;
use super::program::{Attempted, StartMultipliers};
use crate::contact::{Candidates, Contact, ContactKey, KeyIndex, Partner};
use crate::error::Error;
use crate::ipopt::Options;
use crate::mechanics::quaternion::advance;
use crate::step::{ContactForce, Step, StepReport, StepSolution, StepSolver};
use crate::world::World;
use program::{Effort, Posed, Program};
use start::{Memory, Poses, Start};

/// More bodies than this are refused: see [`SeveralLadder::new`].
pub const MOST_BODIES: usize = 10;

/// How many iterations to wait for from the previous solution without its multipliers: where it has
/// not led to the end by then, the native start mostly does in less than five.
const PATIENCE_PREVIOUS: u32 = 30;

/// Ipopt for worlds of several bodies, with fixed pieces, rounded points or coefficients of
/// friction of their own, with the ladder behind it.
pub struct SeveralLadder(Climb<Several>);

/// The program of several bodies with its ends.
struct Several {
    program: Program,
    memory: Memory,
    /// What was posed last, and the contacts' keys.
    posed: Posed,
    keys: Vec<ContactKey>,
    /// The start and the end of the last solve.
    start: Start,
    end: Start,
    /// The best end of the step.
    best: Start,
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
        let several = Several {
            program: Program::new(world, options)?,
            memory: Memory::default(),
            posed: Posed::default(),
            keys: Vec::new(),
            start: Start::default(),
            end: Start::default(),
            best: Start::default(),
            multipliers: None,
        };
        Ok(Self(Climb::of(world, several, rungs)))
    }
}

impl StepSolver for SeveralLadder {
    fn accepted_residual(&self) -> f64 {
        self.0.accepted_residual()
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        self.0.solve(step, candidates, solution)
    }
}

impl Climber for Several {
    /// Whatever is solved is good enough.
    const WORTH_IT: f64 = 1.0;

    fn begin(&mut self, step: &Step<'_>, contacts: &[Contact]) -> Result<(), Error> {
        step.check(contacts)?;
        if self.program.bodies() != step.world.bodies().len() {
            return Err(of_another_world());
        }
        if self.program.set_units(step) {
            self.memory.clear();
        }
        self.best.reset(step.free, 0);
        self.multipliers = None;
        Ok(())
    }

    fn max_iterations(&self) -> u32 {
        self.program.max_iterations()
    }

    /// Without end from the last start that there is.
    fn patience(&self, rung: Rung, rungs: &[Rung]) -> u32 {
        let last = rungs.iter().rfind(|rung| **rung != Rung::Native);
        match rung {
            last_start if last == Some(&last_start) => u32::MAX,
            Rung::Previous => PATIENCE_PREVIOUS,
            other => other.patience(),
        }
    }

    fn climb(
        &mut self,
        rung: Rung,
        step: &Step<'_>,
        candidates: &mut Candidates,
        native: &StepSolution,
        Within { limit, depth }: Within,
    ) -> Result<Option<Attempted>, Error> {
        let units = self.program.units;
        let contacts = candidates.contacts();
        self.posed = pose(step, contacts, depth);
        match rung {
            Rung::Warm => {
                let known = self.memory.multipliers(step.previous);
                if known.is_none_or(|(keys, _)| *keys != keys_of(contacts, &self.posed)) {
                    return Ok(None);
                }
                self.start.set_previous(step, contacts, &self.memory, &units);
                coast(step, &self.posed, &mut self.start);
            }
            Rung::Previous => self.start.set_previous(step, contacts, &self.memory, &units),
            Rung::NativeStart => {
                self.start.set_solution(step, contacts, native, &units);
                let forces = native.contacts.iter();
                let carry = forces.enumerate().filter(|(_, force)| force.carries_force());
                self.posed = Posed::of(contacts, carry.map(|(index, _)| index).collect());
            }
            Rung::FreeFlight => self.start.reset(step.free, contacts.len()),
            Rung::SharedWeight => self.start.share_weight(step, (contacts, &self.posed), &units),
            Rung::Native => return Ok(None),
        }
        let settled = matches!(rung, Rung::Warm | Rung::NativeStart);
        let Self { program, memory, start, end, posed, .. } = &mut *self;
        let multipliers = match (rung, memory.multipliers(step.previous)) {
            (Rung::Warm, Some((_, known))) => StartMultipliers::Known(known),
            (Rung::NativeStart, _) => StartMultipliers::Zero,
            _ => StartMultipliers::Estimated,
        };
        let effort = Effort { limit, tightness: 1.0, settled };
        let posing = (&mut *candidates, posed);
        let from = (start, multipliers);
        let attempted = solve_posed(program, step, from, (effort, depth), posing, end)?;
        self.keys = keys_of(candidates.contacts(), &self.posed);
        Ok(Some(attempted))
    }

    fn tighten(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        attempted: &Attempted,
        tightness: f64,
        limit: u32,
    ) -> Result<Option<Attempted>, Error> {
        let Some(known) = &attempted.multipliers else { return Ok(None) };
        let Self { program, start, end, posed, .. } = &mut *self;
        start.clone_from(end);
        let effort = Effort { limit, tightness, settled: true };
        let from = (&*start, StartMultipliers::Known(known));
        program.attempt(step, (contacts, posed), from, effort, end).map(Some)
    }

    fn undo(&mut self) {
        self.end.clone_from(&self.start);
    }

    fn set_end(&mut self, step: &Step<'_>, contacts: &[Contact], solution: &StepSolution) {
        self.end.set_solution(step, contacts, solution, &self.program.units);
    }

    fn write(&self, step: &Step<'_>, contacts: &[Contact], solution: &mut StepSolution) {
        self.end.write(step, contacts, &self.program.units, solution);
    }

    fn keep_best(&mut self, attempted: Attempted) {
        self.best.clone_from(&self.end);
        let keys = &self.keys;
        self.multipliers = attempted.multipliers.map(|multipliers| (keys.clone(), multipliers));
    }

    fn remember(&mut self, step: &Step<'_>, solution: &StepSolution) {
        self.best.values.resize_with(solution.contacts.len(), Default::default);
        let multipliers = self.multipliers.take();
        self.memory.keep(step.previous, solution, &self.best.values, multipliers);
    }
}

/// The candidates that free flight closes, to what a missed one may be deep (`near`, m), and those that
/// carried a force in the step before.
fn pose(step: &Step<'_>, contacts: &[Contact], near: f64) -> Posed {
    let free = Poses::of(step.states, step.free);
    let mut known = KeyIndex::new();
    let taken = contacts.iter().enumerate().filter(|(place, contact)| {
        let before = known.find(&step.previous.contacts, &contact.key, *place);
        let rests = matches!(contact.key.partner, Partner::Body(_))
            && before.is_some_and(ContactForce::carries_force);
        rests || free.gap(contact) <= near
    });
    Posed::of(contacts, taken.map(|(place, _)| place).collect())
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
