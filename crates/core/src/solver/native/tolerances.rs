//! What counts as solved, still or missed, in m/s.
//!
//! Residuals are speeds: each contact is compared in its own scale (eq. 18). The numbers are those
//! of the tutorial's cube. Another world has them multiplied by its
//! [speed scale](crate::world::World::speed_scale), so that a smaller copy of a scene is solved as
//! the larger one is. No tolerance is below what the step's own speeds are rounded to.

use crate::world::World;

/// Residual of a step that counts as solved, m/s: what the certificate is held against, where no
/// [other](crate::solver::native::NativeSolver::with_residual) is asked for.
pub const ACCEPTED_RESIDUAL: f64 = 1e-9;
/// The largest that may be asked for, m/s: half of what gravity gives in a step of 2 ms.
pub const LARGEST_RESIDUAL: f64 = 1e-2;
/// The law without compliance is met to the rounding of φ⁺/h, m/s.
const EXACT: f64 = 1e-12;
/// Speeds are rounded to this part of themselves: sixteen roundings.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// The tolerances of one step, m/s.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tolerances {
    /// What is left where an equation is solved as well as doubles can.
    pub(super) rounding: f64,
    /// The limit of vanishing compliance is reached.
    pub(super) exact: f64,
    /// Newton's method with compliance has converged: a tenth of what is asked in the end.
    pub(super) newton: f64,
    /// A stage has solved the step.
    pub(super) solved: f64,
    /// Whole steps are taken below this residual even where it grows: the natural map has kinks at
    /// the scale of the compliance, where a line search stalls although the next piece of the map
    /// has the solution.
    pub(super) whole_steps: f64,
    /// An iteration that stalled below this is near enough to a solution to go on from it.
    pub(super) near: f64,
    /// A point that goes down through the ground at this speed was missed by detection.
    pub(super) missed: f64,
    /// The last impulses are this step's if their residual is at most `repeated`, and contacts that
    /// press open or close at most at the speed `still`.
    pub(super) repeated: f64,
    pub(super) still: f64,
    /// A gap that one step opens or closes at this speed counts as none.
    pub(super) level: f64,
    /// What was at rest and would move at most at this speed stays at rest.
    pub(super) rest: f64,
}

impl Tolerances {
    /// Those of a step of `world` whose bodies move at `speed` (m/s).
    pub(super) fn of(world: &World, speed: f64) -> Self {
        let scale = world.speed_scale().max(ROUNDING / EXACT * speed);
        let (rounding, exact) = (1e-14 * scale, EXACT * scale);
        Self {
            rounding,
            exact,
            newton: 1e-11 * scale,
            solved: 1e-10 * scale,
            whole_steps: 1e-5 * scale,
            near: 1e-4 * scale,
            missed: 1e-10 * scale,
            repeated: exact,
            still: rounding,
            level: 0.0,
            rest: exact,
        }
    }

    /// The same for an island of several bodies. Where forces are shared in many ways and some lie
    /// on the edge of their cones, the last digits come slowly, and what is left of them is in the
    /// gaps of the next step: a heap whose gaps contradict each other by 10⁻¹³ m has to push and to
    /// slide somewhere to obey them. So gaps of that size count as none; with what a solution may
    /// miss they stay below what is [accepted](ACCEPTED_RESIDUAL).
    ///
    /// Whether the last impulses have to repeat exactly: a force that joints keep may be the same in
    /// every step and move all of them by the same small speed.
    pub(super) fn of_several(world: &World, speed: f64, repeats_exactly: bool) -> Self {
        let of_one = Self::of(world, speed);
        let scale = of_one.exact / EXACT;
        let (solved, exact) = (3e-10 * scale, of_one.exact);
        let (repeated, still) =
            if repeats_exactly { (exact, of_one.rounding) } else { (solved, exact) };
        Self { solved, level: 5e-10 * scale, rest: 3e-10 * scale, repeated, still, ..of_one }
    }

    /// Those of a contact problem without a world, whose velocities are in parts of its own speed,
    /// solved to a `residual` in the same parts.
    pub(super) fn of_problem(residual: f64) -> Self {
        let scale = (residual / ACCEPTED_RESIDUAL).max(ROUNDING / EXACT);
        // Near a solution is near whatever is asked for: between 1e-4 and 2e-2 it hardly matters.
        let near = 5e-3_f64.max(10.0 * residual);
        let (solved, exact) = (3e-10 * scale, EXACT * scale);
        Self {
            rounding: 1e-14 * scale,
            exact,
            newton: 1e-11 * scale,
            solved,
            whole_steps: 0.1 * near,
            near,
            missed: 1e-10 * scale,
            repeated: solved,
            still: exact,
            level: 0.0,
            rest: 0.0,
        }
    }

    /// The same for steps that may miss their laws by `factor` times as much.
    pub(super) fn loosened(self, factor: f64) -> Self {
        let solved = factor * self.solved;
        Self {
            rounding: factor * self.rounding,
            exact: factor * self.exact,
            newton: factor * self.newton,
            solved,
            whole_steps: self.whole_steps.max(solved),
            near: self.near.max(solved),
            missed: factor * self.missed,
            repeated: factor * self.repeated,
            still: factor * self.still,
            level: factor * self.level,
            rest: factor * self.rest,
        }
    }
}
