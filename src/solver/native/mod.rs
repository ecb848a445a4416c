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

mod elimination;
mod equations;
mod interior_point;
mod newton;
mod starts;

use super::{Decision, Step, StepReport, StepSolver, StepStatus};
use crate::error::Error;
use crate::model::ContactModel;
use crate::quaternion::advance;
use crate::state::State;
use equations::StepEquations;
use interior_point::InteriorPoint;
use nalgebra::Vector3;
use newton::{Iterate, Law, Newton, exact_residual};
use starts::Start;

/// ε of the compliance û = u + ε p̂ while a solution is sought (N6).
const COMPLIANCE: f64 = 1e-6;
/// The compliances to follow where the limit cannot be taken from the first.
const COMPLIANCES: [f64; 4] = [COMPLIANCE, 1e-7, 1e-8, 1e-9];
/// Scalings of the natural map to try where Newton's method stalls near a solution.
const SHARPNESSES: [f64; 7] = [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6];
/// Margins on the cone to try when a limit is taken: a contact exactly on its cone may
/// belong to either side.
const STICK_MARGINS: [f64; 3] = [0.0, 1e-3, -1e-3];
/// Largest certificate of a step that counts as solved, m/s.
pub const ACCEPTED_CERTIFICATE: f64 = 1e-9;
/// A step is solved when its residual without compliance is at most this, m/s.
const ACCEPTED_RESIDUAL: f64 = 1e-10;
/// With this residual a point is taken if no start but the scattered ones does better.
const SETTLED_RESIDUAL: f64 = 5e-10;
/// When all starts have been tried, the best point counts as solved with at most this
/// residual, if its certificate, which is often smaller, agrees.
const ARGUABLE_RESIDUAL: f64 = 1e-8;
/// With at most this residual without compliance (m/s) an iteration that stalled is near
/// enough to a solution to go on from it.
const NEARBY_RESIDUAL: f64 = 1e-4;
/// Points lower than this after the step, as a speed through the ground (m/s), join it.
const MISSED_CONTACT: f64 = 1e-10;

/// The native solver of one model's steps. Owns all scratch memory: a step allocates
/// nothing.
#[derive(Debug, Clone)]
pub struct NativeSolver {
    equations: StepEquations,
    newton: Newton,
    interior_point: InteriorPoint,
    iterate: Iterate,
    /// The best point of all starts, for a step that none of them solves.
    best: Iterate,
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

/// What the starts of one set of candidates came to.
#[derive(Debug, Clone, Copy)]
struct Attempts {
    solved: bool,
    /// Whether the first start did.
    first_start: bool,
    iterations: u32,
}

impl NativeSolver {
    /// A solver for steps of `model`.
    #[must_use]
    pub fn new(model: &ContactModel) -> Self {
        let contacts = model.contact_count();
        Self {
            equations: StepEquations::new(model),
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
    /// wildly in one step, stands back for another as long as there are starts other than
    /// the scattered ones.
    fn solve_candidates(&mut self, step: &Step<'_>) -> Attempts {
        let mut iterations = 0;
        // Unsolved, wild, residual: the least is best.
        let mut best = (true, true, f64::INFINITY);
        for (index, start) in starts::all().enumerate() {
            if best.2 <= SETTLED_RESIDUAL && matches!(start, Start::Scattered(_)) {
                break;
            }
            iterations += self.start(step, start);
            let reached = self.descend(&mut iterations);
            let solved = reached.residual <= ACCEPTED_RESIDUAL;
            let wild = self.turns_wildly(step);
            if solved && reached.selected && !wild {
                return Attempts { solved: true, first_start: index == 0, iterations };
            }
            let rank = (!solved, wild, reached.residual);
            if index == 0 || rank < best {
                best = rank;
                self.best.copy_from(&self.iterate);
            }
        }
        self.iterate.copy_from(&self.best);
        if !self.iterate.is_finite() {
            // Only where the step's own numbers overflow: free flight is at least finite.
            self.start(step, Start::Zero);
        }
        Attempts { solved: best.2 <= ARGUABLE_RESIDUAL, first_start: false, iterations }
    }

    /// Whether the iterate turns the body by more than 1 rad in the step, and by more than
    /// twice what it came with: the discrete equations have such solutions for slender
    /// bodies, and they make energy from nothing.
    fn turns_wildly(&self, step: &Step<'_>) -> bool {
        let turn = step.model.time_step() * self.iterate.velocity.spin.norm();
        turn > 1.0 && turn > 2.0 * step.model.time_step() * step.state.spin.norm()
    }

    /// Sets the iterate to a start; returns the iterations that cost.
    fn start(&mut self, step: &Step<'_>, start: Start) -> u32 {
        let candidates = self.equations.candidates();
        let impulses = &mut self.iterate.impulses;
        impulses.clear();
        match start {
            Start::Previous => {
                let to_impulse = step.model.time_step() / step.model.body().mass();
                impulses
                    .extend(candidates.iter().map(|c| step.previous.force(c.point) * to_impulse));
            }
            Start::Zero => impulses.extend(candidates.iter().map(|_| Vector3::zeros())),
            Start::InteriorPoint(scale) => {
                return self.interior_point.solve(&self.equations, scale, &mut self.iterate);
            }
            Start::Scattered(number) => starts::scatter(number, &self.equations, impulses),
        }
        self.iterate.velocity = self.equations.velocity_after(&self.iterate.impulses);
        0
    }

    /// Newton with compliance, then its limit; with less and less compliance where the
    /// limit is not in reach.
    fn descend(&mut self, iterations: &mut u32) -> Reached {
        let mut reached = Reached { residual: f64::INFINITY, selected: false };
        for compliance in COMPLIANCES {
            let law = Law::with_compliance(compliance);
            let Self { equations, newton, iterate, .. } = &mut *self;
            let found = newton.solve(equations, &law, compliance, iterate);
            *iterations += found.iterations;
            reached.selected |= found.converged;
            if found.converged {
                reached.residual = newton.take_limit(equations, &law, iterate, iterations);
            } else {
                reached.residual = exact_residual(equations, iterate);
                if reached.residual > NEARBY_RESIDUAL {
                    break;
                }
            }
            if reached.residual > ACCEPTED_RESIDUAL {
                reached.residual = self.polish(compliance, iterations);
            }
            if reached.residual <= ACCEPTED_RESIDUAL {
                break;
            }
        }
        reached
    }

    /// Solves the law without compliance from a point near a solution, in every way there
    /// is. Returns its residual.
    fn polish(&mut self, compliance: f64, iterations: &mut u32) -> f64 {
        let Self { equations, newton, iterate, .. } = self;
        for sharpness in SHARPNESSES {
            let law = Law { sharpness, ..Law::EXACT };
            *iterations += newton.solve(equations, &law, compliance, iterate).iterations;
            let residual = exact_residual(equations, iterate);
            if residual <= ACCEPTED_RESIDUAL {
                return residual;
            }
        }
        let mut residual = f64::INFINITY;
        for stick_margin in STICK_MARGINS {
            let law = Law { stick_margin, ..Law::with_compliance(compliance) };
            residual = newton.take_limit(equations, &law, iterate, iterations);
            if residual <= ACCEPTED_RESIDUAL {
                break;
            }
        }
        residual
    }

    /// Makes candidates of the points that the motion found would take below the
    /// ground. Returns whether there were any.
    fn admit_missed(&mut self, step: &Step<'_>, next: &State) -> bool {
        let lowest = -MISSED_CONTACT * step.model.time_step();
        let before = self.equations.candidates().len();
        for (point, height) in step.model.contact_heights(next).enumerate() {
            let known = self.equations.candidates().iter().any(|c| c.point == point);
            if height < lowest && !known {
                self.equations.admit(step.model, step.state, point);
            }
        }
        self.equations.candidates().len() > before
    }

    /// X⁺ of the iterate (eq. 8).
    fn next_state(&self, step: &Step<'_>) -> State {
        let (velocity, h) = (&self.iterate.velocity, step.model.time_step());
        State {
            position: step.state.position + h * velocity.linear,
            attitude: advance(&step.state.attitude, &velocity.spin, h),
            velocity: velocity.linear,
            spin: velocity.spin,
        }
    }

    /// Writes forces, slacks (zero) and slip speeds, and flags the points that carry a
    /// force: with these flags the point is the optimum of the tutorial's program, but for
    /// its smoothing of the cone (ε times the slip speed in eq. 15).
    fn write(&self, step: &Step<'_>, active: &mut [bool], solution: &mut Decision) {
        let to_force = step.model.body().mass() / step.model.time_step();
        let smoothing = step.model.smoothing();
        let layout = solution.layout();
        let turning = self.equations.turning(&self.iterate.velocity);
        active.fill(false);
        for (candidate, impulse) in self.equations.candidates().iter().zip(&self.iterate.impulses) {
            let force = impulse * to_force;
            let slip = turning.point_velocity(candidate).xy();
            let [fx, fy, fz, _, _, slip_speed] = layout.contact_variables(candidate.point);
            let x = solution.as_mut_slice();
            (x[fx], x[fy], x[fz]) = (force[0], force[1], force[2]);
            let friction = force.xy().norm();
            if friction > 0.0 {
                // λ of eq. 10: c_xy + λ f_xy/ρ = 0 with ρ = √(f·f + ε²).
                x[slip_speed] = slip.norm() * friction.hypot(smoothing) / friction;
            }
            active[candidate.point] = force[2] > 0.0;
        }
    }
}

impl StepSolver for NativeSolver {
    fn accepted_certificate(&self) -> f64 {
        ACCEPTED_CERTIFICATE
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        active: &mut [bool],
        solution: &mut Decision,
    ) -> Result<StepReport, Error> {
        self.equations.begin(step);
        for (point, _) in active.iter().enumerate().filter(|(_, active)| **active) {
            self.equations.admit(step.model, step.state, point);
        }
        let (mut iterations, mut first_start) = (0, true);
        let (solved, next) = loop {
            let attempts = self.solve_candidates(step);
            iterations += attempts.iterations;
            first_start &= attempts.first_start;
            let next = self.next_state(step);
            if !self.admit_missed(step, &next) {
                break (attempts.solved, next);
            }
        };
        solution.set_free_flight(&next);
        self.write(step, active, solution);
        let status = match (solved, first_start) {
            (true, true) => StepStatus::Converged,
            (true, false) => StepStatus::Retried,
            (false, _) => StepStatus::Failed,
        };
        Ok(StepReport { iterations, ..StepReport::without_problem(status) })
    }
}
