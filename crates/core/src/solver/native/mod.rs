//! Native solver of the contact step: exact, in about a microsecond for one body.
//!
//! Newton's method on the natural map of the contact law starts from the impulses of the last step.
//! If it does not converge, further stages follow: the proximal point method and an interior point
//! method. `docs/native-solver.md` has the algorithm on one page and the derivation. The code cites
//! its equation numbers (N1, N2, …).
//!
//! Bodies connected by contacts form an island. Islands are independent problems. A body that
//! touches only fixed objects is solved with six unknowns on the stack (`single`). Several bodies
//! are solved with a sparse system (`island`).
//!
//! Calls of one step:
//!
//! ```text
//! NativeSolver::solve       repeats the following until no contact is missed
//!   IslandPartition::find       islands of the candidates, with the last forces
//!   IslandProblem::solve       couplings of an island: contacts, joints and gears
//!     StageSolver::solve    Newton, proximal point, interior point
//!   IslandProblem::write       new states, force and slip of every contact
//! ```
//!
//! A *coupling* has three rows u and an impulse p̂: a contact, or an anchor or rotation of a joint.
//! A *piece* of the law is open, stick or slip. It is unrelated to the convex pieces of bodies.
//!
//! For a sliding face the laws alone do not determine the motion. This solver takes the limit of an
//! equal, vanishing compliance at every contact point (N6). It is the limit of very stiff, equal
//! springs.

mod body_equation;
mod contact_problem;
mod coupling;
mod effort;
mod ellipsoid_motion;
mod equations;
mod fixed_motion;
mod interior_point;
mod island;
mod island_problem;
mod islands;
mod law;
mod linearised;
mod newton;
mod pair_motion;
mod proximal;
mod round_motion;
mod settings;
mod single;
mod stages;
#[cfg(feature = "threads")]
mod threads;
mod tolerances;
mod turning;

use crate::contact::{Candidates, Contact, rounding};
use crate::error::{Error, in_range};
use crate::joint::JointForce;
use crate::mechanics::State;
use crate::step::{
    ContactForce, IslandSolver, Step, StepReport, StepSolution, StepSolver, StepStatus,
};
use crate::world::World;
use island_problem::{IslandProblem, ProblemPool, SolveAccuracy};
use islands::{IslandPartition, Marked, StepContacts};
pub use law::MapPiece;
pub use linearised::{Smoothing, StepChange, StepDerivative, StepGradient};
use nalgebra::Vector3;
pub use stages::STARTS;
use stages::{StageOutcome, StageRun};
#[cfg(feature = "threads")]
use std::num::NonZeroUsize;
#[cfg(feature = "threads")]
use threads::Threads;
use tolerances::Tolerances;
pub use tolerances::{ACCEPTED_RESIDUAL, LARGEST_RESIDUAL};

/// Native solver of the steps of a world.
///
/// It owns all scratch memory. A step allocates nothing once its contacts have occurred before.
#[derive(Debug, Clone)]
pub struct NativeSolver {
    /// Accepted residual in a world with speed scale 1 (m/s). `accepted` includes the last speed
    /// scale.
    residual: f64,
    accepted: f64,
    islands: IslandPartition,
    /// Problems of the islands, with memory kept from step to step.
    parts: ProblemPool,
    /// Solve result of each body's island.
    ends: Vec<IslandEnd>,
    /// Scratch of [`NativeSolver::reached`] and [`NativeSolver::admit_foreseen`].
    reached: Vec<State>,
    /// Bodies expected to rest in the current step; after the step, those kept at rest.
    rests: Vec<bool>,
    /// Scratch of [`NativeSolver::find_preliminary`].
    preliminary: Vec<bool>,
    /// Thread pool for islands. `None` if only the caller's thread is used.
    #[cfg(feature = "threads")]
    threads: Option<Threads>,
}

impl NativeSolver {
    /// Solver for steps of `world`.
    pub fn new(world: &World) -> Self {
        let mut first = IslandProblem::default();
        let points = world.bodies().iter().map(|body| body.contact_points().len());
        first.reserve(world, points.max().unwrap_or(0));
        Self {
            residual: ACCEPTED_RESIDUAL,
            accepted: ACCEPTED_RESIDUAL * world.speed_scale(),
            islands: IslandPartition::default(),
            parts: ProblemPool::new(first),
            ends: Vec::new(),
            reached: Vec::with_capacity(world.bodies().len()),
            rests: Vec::new(),
            preliminary: Vec::new(),
            #[cfg(feature = "threads")]
            threads: None,
        }
    }

    /// Sets the accepted residual of a step (m/s, times the world's [speed
    /// scale](World::speed_scale)), instead of [`ACCEPTED_RESIDUAL`].
    ///
    /// Iterations end accordingly earlier. Gaps that a step opens or closes at half of this speed
    /// are treated as zero. Bodies no faster than a third of it come to rest. The certificate of
    /// each step contains the actual residual.
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

    /// Factor on the usual residual tolerances.
    fn tolerance_factor(&self) -> f64 {
        self.residual / ACCEPTED_RESIDUAL
    }

    /// Solves islands in parallel on up to `count` threads. Numbers, reports and errors do not
    /// depend on the number of threads.
    ///
    /// The threads belong to this solver, wait between steps and are shared by its copies. A count
    /// of one creates no threads. They are not used for a step with one island or little work. To
    /// simulate many scenes, one simulation per core is more efficient.
    ///
    /// # Errors
    /// More than 1024 threads; threads that cannot be started.
    #[cfg(feature = "threads")]
    pub fn with_threads(mut self, count: NonZeroUsize) -> Result<Self, Error> {
        self.threads = Threads::new(count)?;
        Ok(self)
    }

    /// Pieces of the law at the solution, for every contact of the last step in the candidates'
    /// order.
    ///
    /// Includes contacts whose last impulses were accepted unchanged. Empty before the first step
    /// with contacts.
    pub fn pieces(&self) -> Vec<ContactPiece> {
        let contacts = self.islands.all().map(|(_, island)| island.contacts.len()).sum();
        let open = ContactPiece { piece: MapPiece::Open, margin: f64::INFINITY };
        let mut pieces = vec![open; contacts];
        for (number, island) in self.islands.all() {
            self.parts.get(number).write_pieces(&island, &mut pieces);
        }
        pieces
    }

    /// Finds the islands. Those that are `marked` or have contacts missing in `solution` are to be
    /// solved.
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

    /// Adds contacts predicted for large islands whose forces change. Returns true if there are
    /// any.
    ///
    /// The prediction is the mean of the current motion and of free flight.
    fn admit_foreseen(&mut self, step: &Step<'_>, candidates: &mut Candidates) -> bool {
        if !self.islands.all().any(|(_, island)| island.changes()) {
            return false;
        }
        let h = step.world.time_step();
        step.states.clone_into(&mut self.reached);
        for (_, island) in self.islands.all().filter(|(_, island)| island.changes()) {
            for &body in island.bodies {
                let (now, free) = (&step.states[body], &step.free[body]);
                let velocity = 0.5 * (now.velocity + free.velocity);
                let spin = 0.5 * (now.spin + free.spin);
                self.reached[body] = State {
                    position: now.position + h * velocity,
                    attitude: step.world.step_map().advance(&now.attitude, &spin),
                    velocity,
                    spin,
                };
            }
        }
        let depth = missed_contact_depth(step, &self.reached, self.tolerance_factor(), false);
        candidates.admit_foreseen(step.world, step.states, &self.reached, depth)
    }

    /// Solves every island that needs it, and writes its states and forces. Returns the number of
    /// iterations. With `is_preliminary` the islands that are solved twice get a preliminary
    /// solution.
    fn solve_islands(
        &mut self,
        step: &Step<'_>,
        candidates: &Candidates,
        is_preliminary: bool,
        solution: &mut StepSolution,
    ) -> Result<u32, Error> {
        let contacts = candidates.contacts();
        let known = solution.contacts.len();
        solution.joints.resize(step.world.joints().len(), JointForce::none(Vector3::zeros()));
        solution.gears.resize(step.world.gears().len(), 0.0);
        solution.contacts.extend(contacts[known..].iter().map(|c| ContactForce::none(c.key)));
        if step.world.has_turning_friction() {
            solution.moments.resize(contacts.len(), Vector3::zeros());
        }
        let Self { islands, rests, .. } = self;
        // Islands at rest keep their solution.
        let aside = candidates.aside();
        islands.keep(step, StepContacts { contacts, known }, aside, rests, solution);
        self.parts.assign(&self.islands, step.states.len());
        let accepted = self.accepted;
        let tolerance_factor = self.tolerance_factor();
        let accuracy = SolveAccuracy { accepted, tolerance_factor, is_preliminary };
        let is_solved = self.solve_on_threads(step, contacts, accuracy)?;
        // The order of the islands is independent of the threads.
        let mut iterations = 0_u32;
        for (number, island) in self.islands.changed() {
            let part = self.parts.get_mut(number);
            if !is_solved {
                part.solve(step, contacts, &island, accuracy)?;
            }
            let ended = part.write(step, contacts, &island, solution);
            let StageOutcome { solved, run, retried, .. } = ended.outcome;
            for &body in island.bodies {
                let end = &mut self.ends[body];
                let retried = end.retried || retried;
                let continues = solved && island.is_solved_twice();
                let is_quiet = solved && !retried && !continues && ended.iterations == 0;
                let is_preliminary = is_preliminary && island.is_solved_twice();
                *end = IslandEnd { solved, run, retried, is_preliminary, continues, is_quiet };
            }
            iterations = iterations.saturating_add(ended.iterations);
        }
        self.islands.continue_from(solution, |body| self.ends[body].continues);
        Ok(iterations)
    }

    /// Solves every island that is `marked` or has contacts missing in `solution`, until no more
    /// contacts are found.
    ///
    /// Large islands whose forces change get preliminary solutions until all contacts are known.
    fn solve_marked(
        &mut self,
        step: &Step<'_>,
        marked: Marked<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        let (mut iterations, mut is_preliminary) = (0_u32, true);
        self.find_islands(step, candidates.contacts(), marked, solution);
        if solution.contacts.is_empty() && self.admit_foreseen(step, candidates) {
            self.find_islands(step, candidates.contacts(), marked, solution);
        }
        // Islands with new contacts are solved until there are no further ones.
        loop {
            let more = self.solve_islands(step, candidates, is_preliminary, solution)?;
            iterations = iterations.saturating_add(more);
            is_preliminary = self.ends.iter().any(|end| end.is_preliminary);
            let tolerance_factor = self.tolerance_factor();
            let reached = self.reached(step, solution);
            let depth = missed_contact_depth(step, reached, tolerance_factor, is_preliminary);
            let admits = if is_preliminary {
                candidates.admit_foreseen(step.world, step.states, reached, depth)
            } else {
                candidates.admit_missed(step.world, step.states, reached, depth)
            };
            if admits {
                self.find_islands(step, candidates.contacts(), Marked::NONE, solution);
            } else if is_preliminary {
                is_preliminary = false;
                self.find_preliminary(step, candidates.contacts(), solution);
            } else {
                break;
            }
        }
        // The step is as good as its worst island.
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

    /// Finds the islands again. Those with a preliminary solution are to be solved.
    fn find_preliminary(&mut self, step: &Step<'_>, contacts: &[Contact], solution: &StepSolution) {
        let mut marked = std::mem::take(&mut self.preliminary);
        marked.clear();
        marked.extend(self.ends.iter().map(|end| end.is_preliminary));
        self.find_islands(step, contacts, Marked(Some(&marked)), solution);
        self.preliminary = marked;
    }

    /// States where contacts are searched: X⁺, or X for a body in an unsolved island.
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

    /// Solves the changed islands in parallel, each in the memory of its part, if worthwhile.
    /// Returns true if it did.
    #[cfg(feature = "threads")]
    fn solve_on_threads(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        accuracy: SolveAccuracy,
    ) -> Result<bool, Error> {
        let Self { islands, parts, threads, .. } = self;
        match threads {
            Some(threads) if threads.are_worth_it(islands) => {
                threads.solve(step, contacts, islands, parts, accuracy).map(|()| true)
            }
            _ => Ok(false),
        }
    }

    /// Returns false: there are no threads.
    #[cfg(not(feature = "threads"))]
    fn solve_on_threads(
        &mut self,
        _: &Step<'_>,
        _: &[Contact],
        _: SolveAccuracy,
    ) -> Result<bool, Error> {
        Ok(false)
    }
}

/// Piece of the law (open, stick or slip) of a contact in a solved step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPiece {
    /// Piece of the natural map, with the compliance of the selection rule.
    pub piece: MapPiece,
    /// Distance to the next piece (m/s), in the contact's own scale. The solution has a kink nearby
    /// if a change of the step's data moves it by more.
    pub margin: f64,
}

/// Solve result of a body's island.
#[derive(Debug, Clone, Copy)]
struct IslandEnd {
    solved: bool,
    run: StageRun,
    /// True if it, or an island merged into it in the same call, needed more than its first stage.
    retried: bool,
    /// True if its solution is preliminary.
    is_preliminary: bool,
    /// True if another solve in this step continues from its forces.
    continues: bool,
    /// True if the last impulses were the solution, without an iteration.
    is_quiet: bool,
}

impl IslandEnd {
    /// Result for a body in free flight.
    const FREE: Self = Self {
        solved: true,
        run: StageRun::PREVIOUS,
        retried: false,
        is_preliminary: false,
        continues: false,
        is_quiet: true,
    };
}

/// Depth (m) at the end of the step above which a contact counts as missed.
///
/// It is below the resolution of the certificate for steps with `tolerance_factor` times the usual
/// residual, and larger if the solution `is_preliminary`. It is at least the rounding of a gap.
fn missed_contact_depth(
    step: &Step<'_>,
    next: &[State],
    tolerance_factor: f64,
    is_preliminary: bool,
) -> f64 {
    let world = step.world;
    // Without a ground a gap may have any direction.
    let (normal, arm, offset) = match world.ground() {
        Some(ground) => (*ground.normal(), ground.normal() * world.reach(), ground.offset()),
        None => (Vector3::repeat(1.0), Vector3::x() * world.reach(), 0.0),
    };
    let (mut rounding, mut speed, mut length) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (index, ((body, next), free)) in world.bodies().iter().zip(next).zip(step.free).enumerate()
    {
        let lost = rounding::gap(&normal, &next.position, offset, &arm);
        rounding = rounding.max(lost);
        speed = speed.max(free.velocity.norm() + free.spin.norm() * body.reach());
        length = length.max(step.distance(index));
    }
    let tolerances = Tolerances::new(world, speed, length).times(tolerance_factor);
    let missed = if is_preliminary { tolerances.missed_by_preliminary } else { tolerances.missed };
    rounding.max(missed * world.time_step())
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
        let aside = candidates.aside().iter().enumerate().filter(|(_, rests)| **rests);
        aside.for_each(|(body, _)| solution.states[body] = step.states[body]);
        // Islands that were not solved immediately have reports of their own.
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

    /// Does nothing: the memory serves steps of any world.
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
        bodies.clone_into(&mut self.rests);
    }

    fn expect_failure(&mut self, bodies: &[bool]) {
        self.islands.expect_failure(bodies);
    }

    fn rested(&self, body: usize) -> bool {
        self.rests.get(body).is_some_and(|rests| *rests)
    }
}
