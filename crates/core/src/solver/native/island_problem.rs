//! Problem of one island: its equations, for one body or several, and their solution.

use super::ContactPiece;
use super::effort::SolveEffort;
use super::equations::{Equations, Velocity, reserve};
use super::island::Island;
use super::islands::{IslandPartition, IslandView};
use super::single::Single;
use super::stages::{StageOutcome, StageSolver};
use crate::contact::Contact;
use crate::error::Error;
use crate::mechanics::State;
use crate::step::{Step, StepSolution};
use crate::world::World;
use nalgebra::Vector3;

/// Equations and solver of one island, with their memory.
///
/// Data kept between steps, such as the elimination order, belongs to the last island solved here.
#[derive(Debug, Clone, Default)]
pub(super) struct IslandProblem {
    /// Index of the current island. `first` is the first body of the last one.
    island: Option<usize>,
    first: Option<usize>,
    /// Problem of one body.
    alone: Option<Box<StagedProblem<Single>>>,
    /// Problem of several bodies, or of one with joints.
    together: Option<Box<StagedProblem<Island>>>,
    /// Body of the last solve, if solved as a single body.
    only: Option<usize>,
    ended: ProblemResult,
}

/// Required accuracy of an island's solution.
#[derive(Debug, Clone, Copy)]
pub(super) struct SolveAccuracy {
    /// Largest residual that is not a failure (m/s).
    pub(super) accepted: f64,
    /// Factor on the usual residual tolerances.
    pub(super) tolerance_factor: f64,
    /// True if islands that are [solved twice](IslandView::is_solved_twice) get a preliminary
    /// solution.
    pub(super) is_preliminary: bool,
}

/// Result of the last solve of an island.
#[derive(Debug, Clone, Copy)]
pub(super) struct ProblemResult {
    pub(super) outcome: StageOutcome,
    pub(super) iterations: u32,
}

/// Result without a solve.
impl Default for ProblemResult {
    fn default() -> Self {
        Self { outcome: StageOutcome::UNSOLVED, iterations: 0 }
    }
}

/// Problem of an island with the equations `E`: of one body, or of several.
#[derive(Debug, Clone)]
struct StagedProblem<E: Equations> {
    equations: E,
    solver: StageSolver<E>,
    /// p̂ of the last step (m/s).
    previous: Vec<Vector3<f64>>,
    /// Number of contacts with reserved memory.
    room: usize,
}

impl<E: Equations> StagedProblem<E> {
    fn new(equations: E) -> Self {
        Self { equations, solver: StageSolver::new(), previous: Vec::new(), room: 0 }
    }

    /// Reserves memory for `contacts` contacts.
    fn reserve(&mut self, contacts: usize) {
        if contacts > self.room {
            self.room = contacts;
            self.solver.reserve(contacts);
            reserve(&mut self.previous, contacts);
        }
    }

    /// Solves from the impulses of the last step, p̂ = h f/M with M = `mass` (kg).
    fn solve(
        &mut self,
        step: &Step<'_>,
        island: &IslandView<'_>,
        mass: f64,
        asked: SolveAccuracy,
        effort: &mut SolveEffort<'_>,
    ) -> StageOutcome {
        let to_impulse = step.world.time_step() / mass;
        self.reserve(island.contacts.len() + 2 * island.joints.len() + island.gears.len());
        let forces = &island.known.before;
        self.previous.clear();
        self.previous.extend(island.contacts.iter().map(|&place| forces[place] * to_impulse));
        self.equations.extend_with_moments(island, &mut self.previous);
        self.equations.extend_previous(step, &mut self.previous);
        self.equations.foresee(step, island, &self.previous);
        self.solver.solve(&mut self.equations, &self.previous, asked.accepted, effort)
    }

    /// True if all impulses are those of the last step. With their rounding, forces at rest would change for
    /// dozens of steps.
    fn keeps_impulses(&self) -> bool {
        self.solver.impulses() == self.previous
    }

    fn write_pieces(&self, island: &IslandView<'_>, pieces: &mut [ContactPiece]) {
        let solved = self.solver.pieces(&self.equations);
        for (&place, (piece, margin)) in island.contacts.iter().zip(solved) {
            pieces[place] = ContactPiece { piece, margin };
        }
    }

    /// Writes force f = M p̂/h and slip of every contact of the island. The slip is the tangential
    /// part of u. If the island [keeps](Self::keeps_impulses) its impulses, the forces are those of the last step.
    fn write_forces(
        &self,
        step: &Step<'_>,
        contacts: &[Contact],
        island: &IslandView<'_>,
        mass: f64,
        solution: &mut StepSolution,
    ) {
        let to_force = mass / step.world.time_step();
        let solved = self.solver.impulses().iter().zip(self.solver.points());
        let couplings = self.equations.couplings();
        let keeps = self.keeps_impulses();
        for ((&place, coupling), (impulse, u)) in island.contacts.iter().zip(couplings).zip(solved)
        {
            let normal = contacts[place].normal();
            let force = if keeps { island.known.before[place] } else { impulse * to_force };
            let found = &mut solution.contacts[place];
            found.force = force;
            found.normal_force = normal.dot(&force);
            found.adhesion = coupling.rows.adhesion * to_force;
            found.slip = u - normal * normal.dot(u);
        }
    }
}

impl IslandProblem {
    /// Index of the current island.
    #[cfg(feature = "threads")]
    pub(super) fn island(&self) -> Option<usize> {
        self.island
    }

    /// Reserves memory for problems of one body with up to `contacts` contacts.
    pub(super) fn reserve(&mut self, world: &World, contacts: usize) {
        let problem = alone(&mut self.alone, world);
        problem.equations.reserve(contacts);
        problem.reserve(contacts);
    }

    /// Solves the problem of `island` with the contacts found so far.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if the step was interrupted.
    pub(super) fn solve(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        island: &IslandView<'_>,
        asked: SolveAccuracy,
    ) -> Result<(), Error> {
        let mut effort = SolveEffort::new(step.interrupt);
        if island.is_hopeless {
            effort.limit();
        }
        self.only = only(step.world, contacts, island);
        // A single body has six unknowns on the stack.
        let outcome = if let Some(body) = self.only {
            let problem = alone(&mut self.alone, step.world);
            problem.equations.begin(step, body, island.unsettled);
            problem.equations.setting_mut().loosen(asked.tolerance_factor);
            for &place in island.contacts {
                problem.equations.admit(&contacts[place]);
                if let Some(tensor) = contacts[place].friction_tensor(step.world, step.states) {
                    problem.equations.setting_mut().set_friction_tensor(&tensor);
                }
                if contacts[place].has_law_offset(step.world) {
                    let carried = contacts[place].law_offset(step.world, step.states);
                    problem.equations.setting_mut().carry(&carried);
                }
            }
            let mass = step.world.bodies()[body].mass();
            problem.solve(step, island, mass, asked, &mut effort)
        } else {
            // An island has a sparse system.
            let problem = together(&mut self.together, step.world);
            problem.equations.begin(step, island);
            problem.equations.setting_mut().loosen(asked.tolerance_factor);
            if asked.is_preliminary && island.is_solved_twice() {
                problem.equations.setting_mut().make_preliminary();
            }
            problem.equations.admit_all(step, contacts, island);
            let mass = problem.equations.mass();
            problem.solve(step, island, mass, asked, &mut effort)
        };
        self.ended = ProblemResult { outcome, iterations: effort.iterations() };
        effort.check()
    }

    /// Writes the last solution: states of the island's bodies at k+1 and forces of its contacts.
    /// Returns the result.
    pub(super) fn write(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        island: &IslandView<'_>,
        solution: &mut StepSolution,
    ) -> ProblemResult {
        if let Some(body) = self.only {
            let problem = alone(&mut self.alone, step.world);
            solution.states[body] = next_state(step, body, problem.solver.velocity());
            let mass = step.world.bodies()[body].mass();
            problem.write_forces(step, contacts, island, mass, solution);
        } else {
            let problem = together(&mut self.together, step.world);
            for (&body, velocity) in island.bodies.iter().zip(problem.solver.velocity()) {
                solution.states[body] = next_state(step, body, velocity);
            }
            let mass = problem.equations.mass();
            problem.write_forces(step, contacts, island, mass, solution);
            let impulses = problem.solver.impulses();
            let keeps = problem.keeps_impulses();
            problem.equations.write_moments(impulses, keeps, island, solution);
            problem.equations.write_joints(step, impulses, keeps, solution);
            problem.equations.write_gears(step, impulses, keeps, solution);
        }
        self.ended
    }

    /// Writes the pieces of the last solution of the island.
    pub(super) fn write_pieces(&self, island: &IslandView<'_>, pieces: &mut [ContactPiece]) {
        match (&self.alone, &self.together) {
            (Some(problem), _) if self.only.is_some() => problem.write_pieces(island, pieces),
            (_, Some(problem)) if self.only.is_none() => problem.write_pieces(island, pieces),
            _ => {}
        }
    }
}

/// Problem memories of a solver and their assignment to islands.
#[derive(Debug, Clone)]
pub(super) struct ProblemPool {
    list: Vec<IslandProblem>,
    /// Part of each island.
    serving: Vec<usize>,
    /// Part whose last island began with the body, for each body. [`NONE`] without one.
    of_first: Vec<usize>,
}

const NONE: usize = usize::MAX;

impl ProblemPool {
    pub(super) fn new(first: IslandProblem) -> Self {
        Self { list: vec![first], serving: Vec::new(), of_first: Vec::new() }
    }

    /// Assigns a part to every island: the one whose last island began with the same body,
    /// otherwise a free one.
    pub(super) fn assign(&mut self, islands: &IslandPartition, bodies: usize) {
        if bodies == 1 && self.serving == [0] && self.list[0].island == Some(0) {
            return;
        }
        self.serving.clear();
        self.of_first.clear();
        self.of_first.resize(bodies, NONE);
        for (place, part) in self.list.iter_mut().enumerate() {
            part.island = None;
            // The last step may belong to another world.
            if let Some(known) = part.first.and_then(|first| self.of_first.get_mut(first)) {
                *known = place;
            }
        }
        for (number, first) in islands.first_bodies().enumerate() {
            let known = self.of_first[first];
            self.serving.push(known);
            if known != NONE {
                self.list[known].island = Some(number);
            }
        }
        let mut left = 0;
        for (number, first) in islands.first_bodies().enumerate() {
            if self.serving[number] != NONE {
                continue;
            }
            while self.list.get(left).is_some_and(|part| part.island.is_some()) {
                left += 1;
            }
            if left == self.list.len() {
                self.list.push(IslandProblem::default());
            }
            self.serving[number] = left;
            let part = &mut self.list[left];
            (part.island, part.first) = (Some(number), Some(first));
        }
    }

    /// Part of an island.
    pub(super) fn get(&self, island: usize) -> &IslandProblem {
        &self.list[self.serving[island]]
    }

    /// Part of an island, mutable.
    pub(super) fn get_mut(&mut self, island: usize) -> &mut IslandProblem {
        &mut self.list[self.serving[island]]
    }

    /// All parts, assigned or not.
    #[cfg(feature = "threads")]
    pub(super) fn all(&mut self) -> &mut [IslandProblem] {
        &mut self.list
    }
}

/// Body of an island that can be solved as a single body: it has no joints and touches only planes
/// of fixed objects, without turning friction.
fn only(world: &World, contacts: &[Contact], island: &IslandView<'_>) -> Option<usize> {
    let [body] = *island.bodies else { return None };
    if !island.joints.is_empty() {
        return None;
    }
    let has_moments = world.has_turning_friction();
    let is_plain = |place: &usize| {
        let contact = &contacts[*place];
        contact.features.curved.is_none()
            && !(has_moments && contact.turning_friction(world).acts())
    };
    island.contacts.iter().all(is_plain).then_some(body)
}

fn alone<'a>(
    problem: &'a mut Option<Box<StagedProblem<Single>>>,
    world: &World,
) -> &'a mut StagedProblem<Single> {
    problem.get_or_insert_with(|| Box::new(StagedProblem::new(Single::new(world))))
}

fn together<'a>(
    problem: &'a mut Option<Box<StagedProblem<Island>>>,
    world: &World,
) -> &'a mut StagedProblem<Island> {
    problem.get_or_insert_with(|| Box::new(StagedProblem::new(Island::new(world))))
}

/// X⁺ of a body (eq. 8).
#[inline(always)]
pub(super) fn next_state(step: &Step<'_>, body: usize, velocity: &Velocity) -> State {
    let (state, map) = (&step.states[body], step.world.step_map());
    State {
        position: state.position + map.time_step * velocity.linear,
        attitude: map.advance(&state.attitude, &velocity.spin),
        velocity: velocity.linear,
        spin: velocity.spin,
    }
}
