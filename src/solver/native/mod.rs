//! tumble's own solver of the contact step: exact, in about a microsecond.
//!
//! Newton's method on the natural map of the contact law, started from the impulses of
//! the last step; behind it, for the few steps in a thousand where that does not lead
//! to a solution, other starts and an interior point. The derivation is in
//! `docs/native-solver.md`, whose equation numbers (N1, N2, …) the code cites.
//!
//! Where a face slides, the laws alone leave the motion undetermined. This solver takes
//! the limit of an equal, vanishing compliance at every contact point (N6): what very
//! stiff, equal springs would do.

mod effort;
mod elimination;
mod equations;
mod interior_point;
mod newton;
mod starts;
mod tolerances;

use crate::contact::Contact;
use crate::contact::detection::admit_missed;
use crate::contact::rounding;
use crate::error::Error;
use crate::mechanics::State;
use crate::mechanics::quaternion::advance;
use crate::step::{ContactForce, Step, StepReport, StepSolution, StepSolver, StepStatus};
use crate::world::World;
use effort::Effort;
use equations::StepEquations;
use interior_point::InteriorPoint;
use nalgebra::Vector3;
use newton::{Iterate, Law, Newton, exact_residual};
use starts::Start;
pub use tolerances::ACCEPTED_RESIDUAL;
use tolerances::{COMPLIANCES, LARGE_TURN, SETTLED, SHARPNESSES, STICK_MARGINS, TURN_GAIN};

/// The body that is solved for: this solver has one body's six velocities as unknowns.
const BODY: usize = 0;

/// The native solver of the steps of a world of one body. Owns all scratch memory: a step
/// allocates nothing.
#[derive(Debug, Clone)]
pub struct NativeSolver {
    accepted: f64,
    equations: StepEquations,
    newton: Newton,
    interior_point: InteriorPoint,
    iterate: Iterate,
    /// The best point of all starts, for a step that none of them solves.
    best: Iterate,
}

/// What a start or all starts came to.
#[derive(Debug, Clone, Copy)]
struct Outcome {
    solved: bool,
    start: Start,
}

/// How good the end of a start is: the least is best.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
struct Rank {
    unsolved: bool,
    /// Turns the body further in one step than its motion explains.
    turns_too_far: bool,
    /// Without compliance, m/s.
    residual: f64,
}

/// Where a start led.
#[derive(Debug, Clone, Copy)]
struct Reached {
    /// Without compliance, m/s.
    residual: f64,
    /// Whether the law with compliance was solved on the way, so that the point is the one
    /// of the selection rule.
    selected: bool,
}

impl NativeSolver {
    /// A solver for steps of `world`.
    #[must_use]
    pub fn new(world: &World) -> Self {
        let body = &world.bodies()[BODY];
        let contacts = body.contact_points().len();
        Self {
            accepted: ACCEPTED_RESIDUAL * world.speed_scale(),
            equations: StepEquations::new(world, body),
            newton: Newton::new(contacts),
            interior_point: InteriorPoint::new(contacts),
            iterate: Iterate::new(contacts),
            best: Iterate::new(contacts),
        }
    }

    /// Tries one start after another until one leads to a solution; otherwise leaves
    /// the best point found.
    ///
    /// A solution that the law with compliance did not select, or one that turns the body
    /// too far in one step, is kept, and another one preferred to it, as long as there are
    /// starts other than the scattered ones.
    fn solve_candidates(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        effort: &mut Effort<'_>,
    ) -> Outcome {
        let tolerances = *self.equations.tolerances();
        let nothing = Rank { unsolved: true, turns_too_far: true, residual: f64::INFINITY };
        let mut best = (nothing, Start::Previous);
        for (index, start) in starts::all().enumerate() {
            let enough = best.0.residual <= tolerances.sufficient;
            if enough && matches!(start, Start::Scattered(_)) {
                break;
            }
            self.start(step, contacts, start, effort);
            let reached = if start == Start::Previous && self.repeats(step) {
                Reached { residual: self.residual(), selected: true }
            } else {
                self.descend(effort)
            };
            let rank = Rank {
                unsolved: reached.residual > tolerances.solved,
                turns_too_far: self.turns_too_far(step),
                residual: reached.residual,
            };
            if !rank.unsolved && reached.selected && !rank.turns_too_far {
                return Outcome { solved: true, start };
            }
            if index == 0 || rank < best.0 {
                best = (rank, start);
                self.best.copy_from(&self.iterate);
            }
            if effort.is_over() {
                break;
            }
        }
        self.iterate.copy_from(&self.best);
        if !self.iterate.is_finite() {
            // Only where the step's own numbers overflow: free flight is at least finite.
            self.start(step, contacts, Start::Zero, effort);
        }
        Outcome { solved: best.0.residual <= self.accepted, start: best.1 }
    }

    /// Whether the last step's impulses are this step's as they are: they did not change from
    /// the step before the last one to the last, so that Newton's method with compliance has
    /// nothing left to select between them, and they obey the law without compliance to
    /// rounding. A residual alone does not say so: it hardly feels the shares that the law
    /// leaves open.
    ///
    /// Where it is so the iterate keeps the velocities that the impulses leave as they were, to
    /// the last bit: rounding in the sum of the impulses would add up from step to step, until
    /// the face of a body at rest is warped by it.
    fn repeats(&mut self, step: &Step<'_>) -> bool {
        if self.equations.unsettled() > SETTLED {
            return false;
        }
        let tolerances = *self.equations.tolerances();
        self.equations.keep_velocity(&step.states[BODY], &mut self.iterate);
        let residual = self.residual();
        let sinking = self.iterate.gap_speed(&self.equations);
        if residual <= tolerances.exact && sinking <= tolerances.rounding {
            return true;
        }
        self.iterate.velocity = self.equations.velocity_after(&self.iterate.impulses);
        false
    }

    /// The residual of the law without compliance at the iterate, m/s.
    fn residual(&mut self) -> f64 {
        exact_residual(&self.equations, &mut self.iterate)
    }

    /// Whether the iterate turns the body by more than [`LARGE_TURN`] in the step, and by more
    /// than [`TURN_GAIN`] times what it came with: the discrete equations have such solutions for slender
    /// bodies, and they make energy from nothing.
    fn turns_too_far(&self, step: &Step<'_>) -> bool {
        let h = step.world.time_step();
        let turn = h * self.iterate.velocity.spin.norm();
        turn > LARGE_TURN && turn > TURN_GAIN * h * step.states[BODY].spin.norm()
    }

    /// Sets the iterate to a start.
    fn start(
        &mut self,
        step: &Step<'_>,
        contacts: &[Contact],
        start: Start,
        effort: &mut Effort<'_>,
    ) {
        let candidates = self.equations.candidates();
        let impulses = &mut self.iterate.impulses;
        impulses.clear();
        match start {
            Start::Previous => {
                let to_impulse = step.world.time_step() / step.world.bodies()[BODY].mass();
                impulses.extend(contacts.iter().enumerate().map(|(place, contact)| {
                    let before = step.previous.find(&contact.key, place);
                    before.map_or(Vector3::zeros(), |before| before.force * to_impulse)
                }));
            }
            Start::Zero => impulses.extend(candidates.iter().map(|_| Vector3::zeros())),
            Start::InteriorPoint(scale) => {
                let Self { equations, interior_point, iterate, .. } = self;
                return interior_point.solve(equations, scale, iterate, effort);
            }
            Start::Scattered(number) => starts::scatter(number, &self.equations, impulses),
        }
        self.iterate.velocity = self.equations.velocity_after(&self.iterate.impulses);
    }

    /// Newton with compliance, then its limit; with less and less compliance where the
    /// limit is not in reach.
    fn descend(&mut self, effort: &mut Effort<'_>) -> Reached {
        let tolerances = *self.equations.tolerances();
        let mut reached = Reached { residual: f64::INFINITY, selected: false };
        for compliance in COMPLIANCES {
            let law = Law::with_compliance(compliance);
            let Self { equations, newton, iterate, .. } = &mut *self;
            let converged = newton.solve(equations, &law, compliance, iterate, effort);
            reached.selected |= converged;
            if converged {
                reached.residual = newton.take_limit(equations, &law, iterate, effort);
            } else {
                reached.residual = exact_residual(equations, iterate);
                if reached.residual > tolerances.near {
                    break;
                }
            }
            if reached.residual > tolerances.solved {
                reached.residual = self.polish(compliance, effort);
            }
            if reached.residual <= tolerances.solved || effort.is_over() {
                break;
            }
        }
        reached
    }

    /// Solves the law without compliance from a point near a solution, in every way there
    /// is. Returns its residual.
    fn polish(&mut self, compliance: f64, effort: &mut Effort<'_>) -> f64 {
        let Self { equations, newton, iterate, .. } = self;
        let solved = equations.tolerances().solved;
        for sharpness in SHARPNESSES {
            let law = Law { sharpness, ..Law::EXACT };
            newton.solve(equations, &law, compliance, iterate, effort);
            let residual = exact_residual(equations, iterate);
            if residual <= solved {
                return residual;
            }
        }
        let mut residual = f64::INFINITY;
        for stick_margin in STICK_MARGINS {
            let law = Law { stick_margin, ..Law::with_compliance(compliance) };
            residual = newton.take_limit(equations, &law, iterate, effort);
            if residual <= solved {
                break;
            }
        }
        residual
    }

    /// X⁺ of the iterate (eq. 8).
    fn next_state(&self, step: &Step<'_>) -> State {
        let (state, velocity) = (&step.states[BODY], &self.iterate.velocity);
        let h = step.world.time_step();
        State {
            position: state.position + h * velocity.linear,
            attitude: advance(&state.attitude, &velocity.spin, h),
            velocity: velocity.linear,
            spin: velocity.spin,
        }
    }

    /// Writes the new state, and the force and slip of every contact.
    fn write(
        &self,
        step: &Step<'_>,
        contacts: &[Contact],
        next: State,
        solution: &mut StepSolution,
    ) {
        let to_force = step.world.bodies()[BODY].mass() / step.world.time_step();
        let turning = self.equations.turning(&self.iterate.velocity);
        let candidates = self.equations.candidates().iter().zip(&self.iterate.impulses);
        solution.set_free(&[next]);
        solution.contacts.extend(contacts.iter().zip(candidates).map(
            |(contact, (candidate, impulse))| {
                let (normal, force) = (candidate.normal, impulse * to_force);
                let u = turning.point_velocity(candidate);
                ContactForce {
                    key: contact.key,
                    force,
                    normal_force: normal.dot(&force),
                    slip: u - normal * normal.dot(&u),
                }
            },
        ));
    }

    /// How deep a point may be below the ground at the end of the step before it counts as
    /// missed, m: what no certificate sees, or what rounding leaves of a height.
    fn deepest_miss(&self, step: &Step<'_>, next: &State) -> f64 {
        let (ground, reach) = (step.world.ground(), step.world.reach());
        let arm = ground.normal() * reach;
        let rounding = rounding::gap(ground.normal(), &next.position, ground.offset(), &arm);
        rounding.max(self.equations.tolerances().missed * step.world.time_step())
    }
}

impl StepSolver for NativeSolver {
    fn accepted_residual(&self) -> f64 {
        self.accepted
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        contacts: &mut Vec<Contact>,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        self.equations.begin(step, BODY);
        self.equations.set_unsettled(unsettled(step));
        let mut effort = Effort::new(step);
        let (mut admitted, mut first_start) = (0, true);
        let (outcome, next) = loop {
            for contact in &contacts[admitted..] {
                self.equations.admit(contact);
            }
            admitted = contacts.len();
            let outcome = self.solve_candidates(step, contacts, &mut effort);
            effort.check()?;
            first_start &= outcome.start == Start::Previous;
            let next = self.next_state(step);
            let depth = self.deepest_miss(step, &next);
            if !admit_missed(step.world, step.states, &[next], depth, contacts) {
                break (outcome, next);
            }
        };
        self.write(step, contacts, next, solution);
        let status = match (outcome.solved, first_start) {
            (true, true) => StepStatus::Converged,
            (true, false) => StepStatus::Retried,
            (false, _) => StepStatus::Failed,
        };
        let start = Some(outcome.start.name());
        Ok(StepReport { status, iterations: effort.iterations(), start, message: None })
    }
}

/// How much the impulses changed from the step before the last one to the last, in parts of
/// the largest; infinite where none pressed.
fn unsettled(step: &Step<'_>) -> f64 {
    let Some(earlier) = step.earlier else { return f64::INFINITY };
    let (mut apart, mut largest) = (0.0_f64, 0.0_f64);
    for (place, contact) in step.previous.contacts.iter().enumerate() {
        let before = earlier.find(&contact.key, place).map_or(Vector3::zeros(), |c| c.force);
        apart = apart.max((contact.force - before).amax());
        largest = largest.max(contact.force.amax());
    }
    if largest > 0.0 { apart / largest } else { f64::INFINITY }
}
