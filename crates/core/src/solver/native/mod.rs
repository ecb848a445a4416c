//! tumble's own solver of the contact step: exact, in about a microsecond for one body.
//!
//! Newton's method on the natural map of the contact law, started from the impulses of the last
//! step. Where that does not lead to a solution, further stages do: the proximal point
//! method, an interior point. `docs/native-solver.md` has the algorithm on one page and the
//! derivation; the code cites its equation numbers (N1, N2, …).
//!
//! Bodies that touch each other, directly or through others, are an island. Islands are
//! independent problems, and each is solved alone: a body that touches fixed things only with
//! six unknowns on the stack (`single`), several bodies with a sparse system (`island`).
//!
//! Where a face slides, the laws alone leave the motion undetermined. This solver takes
//! the limit of an equal, vanishing compliance at every contact point (N6): what very
//! stiff, equal springs would do.

mod blocks;
mod coupling;
mod dense;
mod effort;
mod equations;
mod fixed_motion;
pub(crate) mod fronts;
mod interior_point;
mod island;
mod islands;
mod law;
mod linearised;
mod member;
mod newton;
mod order;
mod pair_motion;
mod part;
mod pattern;
pub(crate) mod plan;
mod posed;
mod proximal;
mod round_motion;
mod settings;
mod single;
mod six;
mod stages;
#[cfg(feature = "threads")]
mod threads;
mod tolerances;
mod turning;

use crate::contact::{Candidates, Contact, rounding};
use crate::error::{Error, in_range};
use crate::joint::JointForce;
use crate::mechanics::State;
use crate::mechanics::quaternion::advance;
use crate::step::{
    ContactForce, IslandSolver, Step, StepReport, StepSolution, StepSolver, StepStatus,
};
use crate::world::World;
use islands::{IslandParts, IslandView, Marked, StepContacts};
pub use law::MapPiece;
pub use linearised::{Smoothing, StepChange, StepDerivative, StepGradient};
use nalgebra::Vector3;
use part::{IslandPart, PartRequest, Parts};
pub(crate) use posed::solve as solve_problem;
use settings::{CHANGING, Settings};
pub use stages::STARTS;
use stages::{StageOutcome, StageRun};
#[cfg(feature = "threads")]
use std::num::NonZeroUsize;
#[cfg(feature = "threads")]
use threads::Threads;
use tolerances::Tolerances;
pub use tolerances::{ACCEPTED_RESIDUAL, LARGEST_RESIDUAL};

/// The native solver of the steps of a world. Owns all scratch memory: a step allocates
/// nothing once its contacts have been seen.
#[derive(Debug, Clone)]
pub struct NativeSolver {
    /// What steps are solved to, in a world of the speed scale 1, and times the speed scale of the last one, m/s.
    residual: f64,
    accepted: f64,
    islands: IslandParts,
    /// The problems of the islands; memory is kept from step to step.
    parts: Parts,
    /// Of every body, how the problem of its island ended.
    ends: Vec<IslandEnd>,
    /// Memory of [`NativeSolver::reached`] and [`NativeSolver::admit_foreseen`].
    reached: Vec<State>,
    /// Which bodies rest in the step at hand, as told, and as they were left.
    rests: Vec<bool>,
    /// Where islands are solved at the same time; `None` for the caller's thread alone.
    #[cfg(feature = "threads")]
    threads: Option<Threads>,
}

impl NativeSolver {
    /// A solver for steps of `world`.
    #[must_use]
    pub fn new(world: &World) -> Self {
        let mut first = IslandPart::default();
        let points = world.bodies().iter().map(|body| body.contact_points().len());
        first.reserve(world, points.max().unwrap_or(0));
        Self {
            residual: ACCEPTED_RESIDUAL,
            accepted: ACCEPTED_RESIDUAL * world.speed_scale(),
            islands: IslandParts::default(),
            parts: Parts::new(first),
            ends: Vec::new(),
            reached: Vec::with_capacity(world.bodies().len()),
            rests: Vec::new(),
            #[cfg(feature = "threads")]
            threads: None,
        }
    }

    /// The same, for steps that count as solved with a residual of `residual` (m/s, times the world's
    /// [speed scale](World::speed_scale)) in place of [`ACCEPTED_RESIDUAL`]: iterations end so much earlier, gaps that a
    /// step opens or closes at half of it count as none, and what moves no faster than a third of it comes to rest.
    /// The certificate of each step has what was reached.
    ///
    /// # Errors
    /// A residual outside 1e-9…1e-2 m/s.
    pub fn with_residual(mut self, residual: f64) -> Result<Self, Error> {
        let allowed = "1e-9 to 1e-2";
        in_range("residual (m/s)", residual, ACCEPTED_RESIDUAL, LARGEST_RESIDUAL, allowed)?;
        self.accepted *= residual / self.residual;
        self.residual = residual;
        Ok(self)
    }

    /// How many times the usual residual steps may have.
    fn loosened(&self) -> f64 {
        self.residual / ACCEPTED_RESIDUAL
    }

    /// The same, on up to `count` threads: islands are solved at the same time. Numbers, reports
    /// and errors are the same on any number of threads.
    ///
    /// The threads are this solver's own and wait between steps; copies of it share them. With one
    /// there are none. Nor are they asked where it would not be worth it: in a step of one island,
    /// or of little to solve. A program that simulates many scenes uses cores better by
    /// one simulation a core.
    ///
    /// # Errors
    /// More than 1024 threads; threads that cannot be started.
    #[cfg(feature = "threads")]
    pub fn with_threads(mut self, count: NonZeroUsize) -> Result<Self, Error> {
        self.threads = Threads::new(count)?;
        Ok(self)
    }

    /// Of every contact of the last step, in the candidates' order, the piece of its law that the
    /// solution is on: also where the impulses of the step before were accepted as they were. Empty
    /// before the first step with contacts.
    #[must_use]
    pub fn pieces(&self) -> Vec<ContactPiece> {
        let contacts = self.islands.all().map(|(_, island)| island.contacts.len()).sum();
        let open = ContactPiece { piece: MapPiece::Open, margin: f64::INFINITY };
        let mut pieces = vec![open; contacts];
        for (number, island) in self.islands.all() {
            self.parts.get(number).write_pieces(&island, &mut pieces);
        }
        pieces
    }

    /// Finds the islands, of which those are to be solved that are `marked` or have contacts that
    /// `solution` does not have yet.
    fn find_islands(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        marked: Marked<'_>,
        solution: &StepSolution,
    ) {
        let joints_are_new = solution.joints.len() != step.world.joints().len();
        let contacts = StepContacts { contacts, known: solution.contacts.len() };
        self.islands.find(step, contacts, joints_are_new, marked);
    }

    /// Admits the contacts that the bodies of large islands whose forces change meet half-way between going
    /// on as now and falling freely. Returns whether there are any.
    fn admit_foreseen(&mut self, step: &Step<'_>, candidates: &mut Candidates) -> bool {
        let moves = |island: &IslandView<'_>| {
            let (bodies, contacts) = (island.bodies.len(), island.contacts.len());
            Settings::of(bodies, contacts, !island.joints.is_empty()).is_large
                && island.unsettled > CHANGING
                && island.unsettled < f64::INFINITY
        };
        if !self.islands.all().any(|(_, island)| moves(&island)) {
            return false;
        }
        let h = step.world.time_step();
        self.reached.clear();
        self.reached.extend_from_slice(step.states);
        for (_, island) in self.islands.all().filter(|(_, island)| moves(island)) {
            for &body in island.bodies {
                let (now, free) = (&step.states[body], &step.free[body]);
                let velocity = 0.5 * (now.velocity + free.velocity);
                let spin = 0.5 * (now.spin + free.spin);
                self.reached[body] = State {
                    position: now.position + h * velocity,
                    attitude: advance(&now.attitude, &spin, h),
                    velocity,
                    spin,
                };
            }
        }
        let depth = deepest_miss(step, &self.reached, self.loosened());
        candidates.admit_missed(step.world, step.states, &self.reached, depth)
    }

    /// Solves every island that was found to need it, and writes its states and forces. Returns the iterations.
    fn solve_islands(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        solution: &mut StepSolution,
    ) -> Result<u32, Error> {
        let known = solution.contacts.len();
        solution.joints.resize(step.world.joints().len(), JointForce::none(Vector3::zeros()));
        solution.gears.resize(step.world.gears().len(), 0.0);
        solution.contacts.extend(contacts[known..].iter().map(|c| ContactForce::none(c.key)));
        let Self { islands, rests, .. } = self;
        islands.keep(step, StepContacts { contacts, known }, rests, solution);
        self.parts.assign(&self.islands, step.states.len());
        let asked = PartRequest { accepted: self.accepted, loosened: self.loosened() };
        let is_solved = self.solve_on_threads(step, contacts, asked)?;
        // In the order of the islands, on whichever threads they were solved.
        let mut iterations = 0_u32;
        for (number, island) in self.islands.changed() {
            let part = self.parts.of(number);
            if !is_solved {
                part.solve(step, contacts, &island, asked)?;
            }
            let ended = part.write(step, contacts, &island, solution);
            let StageOutcome { solved, run, retried, .. } = ended.outcome;
            for &body in island.bodies {
                let end = &mut self.ends[body];
                let retried = end.retried || retried;
                let is_quiet = solved && !retried && ended.iterations == 0;
                *end = IslandEnd { solved, run, retried, is_quiet };
            }
            iterations = iterations.saturating_add(ended.iterations);
        }
        Ok(iterations)
    }

    /// Solves every island that is `marked` or has contacts that `solution` does not have yet, until
    /// no more contacts are found.
    fn solve_marked(
        &mut self,
        step: &Step<'_>,
        marked: Marked<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        let mut iterations = 0_u32;
        self.find_islands(step, candidates.contacts(), marked, solution);
        if solution.contacts.is_empty() && self.admit_foreseen(step, candidates) {
            self.find_islands(step, candidates.contacts(), marked, solution);
        }
        loop {
            let more = self.solve_islands(step, candidates.contacts(), solution)?;
            iterations = iterations.saturating_add(more);
            let loosened = self.loosened();
            let reached = self.reached(step, solution);
            let depth = deepest_miss(step, reached, loosened);
            if !candidates.admit_missed(step.world, step.states, reached, depth) {
                break;
            }
            self.find_islands(step, candidates.contacts(), Marked::NONE, solution);
        }
        let solved = self.ends.iter().all(|end| end.solved);
        let status = match (solved, self.ends.iter().any(|end| end.retried)) {
            (true, false) => StepStatus::Converged,
            (true, true) => StepStatus::Retried,
            (false, _) => StepStatus::Failed,
        };
        let mut runs = self.ends.iter().map(|end| end.run);
        let run = runs.find(|run| *run != StageRun::PREVIOUS).unwrap_or(StageRun::PREVIOUS);
        Ok(StepReport { status, iterations, start: Some(run.name()), message: None })
    }

    /// Where contacts are looked for: X⁺, or X of a body whose problem was not solved, since that says
    /// nothing about what will meet.
    fn reached<'a>(&'a mut self, step: &Step<'_>, solution: &'a StepSolution) -> &'a [State] {
        if self.ends.iter().all(|end| end.solved) {
            return &solution.states;
        }
        self.reached.clear();
        let ends = solution.states.iter().zip(step.states).zip(&self.ends);
        let reached = ends.map(|((next, now), end)| if end.solved { *next } else { *now });
        self.reached.extend(reached);
        &self.reached
    }

    /// Solves the problems of the islands that changed at the same time, each in the memory of its part, where there are
    /// threads and it is worth it. Returns whether it did.
    #[cfg(feature = "threads")]
    fn solve_on_threads(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        asked: PartRequest,
    ) -> Result<bool, Error> {
        let Self { islands, parts, threads, .. } = self;
        match threads {
            Some(threads) if threads.are_worth_it(islands) => {
                threads.solve(step, contacts, islands, parts, asked).map(|()| true)
            }
            _ => Ok(false),
        }
    }

    /// There are no threads.
    #[cfg(not(feature = "threads"))]
    fn solve_on_threads(
        &mut self,
        _: &Step<'_>,
        _: &[Contact],
        _: PartRequest,
    ) -> Result<bool, Error> {
        Ok(false)
    }
}

/// Where on its law a contact of a solved step is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPiece {
    /// The piece of the natural map, with the compliance of the selection rule.
    pub piece: MapPiece,
    /// How far the next piece is, m/s, in the contact's own scale: where it is small against what a
    /// change of the step's data moves, the solution has a kink.
    pub margin: f64,
}

/// How the problem of a body's island ended.
#[derive(Debug, Clone, Copy)]
struct IslandEnd {
    solved: bool,
    run: StageRun,
    /// Whether it, or one that it grew out of in the same call, needed another stage than its first.
    retried: bool,
    /// Whether the last impulses were the solution, without an iteration.
    is_quiet: bool,
}

impl IslandEnd {
    /// That of free flight.
    const FREE: Self =
        Self { solved: true, run: StageRun::PREVIOUS, retried: false, is_quiet: true };
}

/// How deep a body may be in another at the end of the step before the contact counts as
/// missed, m: what no certificate sees of steps that may have `loosened` times the usual residual,
/// or what rounding leaves of a gap.
fn deepest_miss(step: &Step<'_>, next: &[State], loosened: f64) -> f64 {
    let world = step.world;
    // Without a ground a gap may be along any direction.
    let (normal, arm, offset) = match world.ground() {
        Some(ground) => (*ground.normal(), ground.normal() * world.reach(), ground.offset()),
        None => (Vector3::repeat(1.0), Vector3::x() * world.reach(), 0.0),
    };
    let (mut rounding, mut speed) = (0.0_f64, 0.0_f64);
    for ((body, next), free) in world.bodies().iter().zip(next).zip(step.free) {
        let lost = rounding::gap(&normal, &next.position, offset, &arm);
        rounding = rounding.max(lost);
        speed = speed.max(free.velocity.norm() + free.spin.norm() * body.reach());
    }
    let tolerances = Tolerances::of(world, speed).loosened(loosened);
    rounding.max(tolerances.missed * world.time_step())
}

impl StepSolver for NativeSolver {
    fn accepted_residual(&self) -> f64 {
        self.accepted
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        step.check(candidates.contacts())?;
        self.accepted = self.residual * step.world.speed_scale();
        solution.set_free(step.free);
        // What was not solved at once has a report of its own.
        self.rests.truncate(self.ends.len());
        for (rests, end) in self.rests.iter_mut().zip(&self.ends) {
            *rests &= end.is_quiet && end.run == StageRun::PREVIOUS;
        }
        self.ends.clear();
        self.ends.resize(step.states.len(), IslandEnd::FREE);
        self.solve_marked(step, Marked::NONE, candidates, solution)
    }

    fn islands(&mut self) -> Option<&mut dyn IslandSolver> {
        Some(self)
    }

    /// Its memory is for the steps of any world.
    fn change_world(&mut self, _: &World) -> Result<(), Error> {
        Ok(())
    }
}

impl IslandSolver for NativeSolver {
    fn solve_again(
        &mut self,
        step: &Step<'_>,
        marked: &[bool],
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        let bodies = step.states.len();
        let known = solution.contacts.len();
        if [self.ends.len(), solution.states.len()] != [bodies; 2]
            || known > candidates.contacts().len()
        {
            return self.solve(step, candidates, solution);
        }
        step.check(candidates.contacts())?;
        let marked = Marked(Some(marked));
        for (body, end) in self.ends.iter_mut().enumerate() {
            end.retried &= !marked.holds(body);
        }
        self.solve_marked(step, marked, candidates, solution)
    }

    fn is_solved(&self, body: usize) -> bool {
        self.ends.get(body).is_some_and(|end| end.solved)
    }

    fn expect_rest(&mut self, bodies: &[bool]) {
        self.rests.clear();
        self.rests.extend_from_slice(bodies);
    }

    fn rested(&self, body: usize) -> bool {
        self.rests.get(body).is_some_and(|rests| *rests)
    }
}
