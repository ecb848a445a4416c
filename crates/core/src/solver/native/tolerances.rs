//! Tolerances for solved, resting and missed, in m/s.
//!
//! Residuals are speeds, with each contact in its own scale (eq. 18). The numbers apply to the
//! tutorial's cube. In other worlds they are multiplied by the [speed
//! scale](crate::world::World::speed_scale). A smaller copy of a scene is thus solved as the larger
//! one. No tolerance is below the rounding of the step's own speeds. In short intervals, the rounding
//! of gaps over h (22) is large. A solution is not asked for more than that, but Newton's iterations go
//! on as far as they come: an impulse of an impact is then known to more digits than its gap.

use super::settings::PROXIMAL_ACCURACY;
use crate::world::World;

/// Default residual (m/s) below which a step counts as solved, as used for the certificate.
/// [`with_residual`](crate::solver::native::NativeSolver::with_residual) changes it.
pub const ACCEPTED_RESIDUAL: f64 = 1e-9;
/// Largest residual that may be requested (m/s): half of the speed gained by gravity in a step of 2
/// ms.
pub const LARGEST_RESIDUAL: f64 = 1e-2;
/// Residual of preliminary solutions (m/s). Points then err by 2·10⁻⁶ m in a step of 2 ms, which
/// hardly changes what they meet.
const PRELIMINARY: f64 = 1e-3;
/// Penetration speed up to which overlaps after a preliminary solution wait for the final one
/// (m/s). They are within its error.
const MISSED_BY_PRELIMINARY: f64 = 0.1 * PRELIMINARY;
/// Tolerance of the law without compliance (m/s): the rounding of φ⁺/h.
const EXACT: f64 = 1e-12;
/// Residual of a stage that solved the step of one body (m/s).
const SOLVED: f64 = 1e-10;
/// Relative rounding of speeds: sixteen rounding errors.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Tolerances of one step (m/s).
#[derive(Debug, Clone, Copy)]
pub(super) struct Tolerances {
    /// Residual at rounding level.
    pub(super) rounding: f64,
    /// Residual of the limit of vanishing compliance.
    pub(super) exact: f64,
    /// Residual of converged Newton iterations with compliance: a tenth of the final tolerance.
    pub(super) newton: f64,
    /// Residual of a stage that solved the step.
    pub(super) solved: f64,
    /// Residual of a [preliminary](Self::preliminary) solution.
    preliminary: f64,
    /// Residual below which full steps are taken even if it grows. The natural map has kinks at the
    /// scale of the compliance, where a line search stalls although the next piece has the
    /// solution.
    pub(super) whole_steps: f64,
    /// Residual of a stalled iteration that is close enough to continue from.
    pub(super) near: f64,
    /// Penetration speed above which a contact was missed by detection.
    pub(super) missed: f64,
    /// Penetration speed above which a contact was missed, at a preliminary solution.
    pub(super) missed_by_preliminary: f64,
    /// The last impulses are accepted if their residual is at most `repeated`, and if loaded
    /// contacts open or close at most at the speed `still`.
    pub(super) repeated: f64,
    pub(super) still: f64,
    /// Gap speed over one step that is treated as zero.
    pub(super) level: f64,
    /// Speed up to which resting bodies stay at rest.
    pub(super) rest: f64,
}

impl Tolerances {
    /// Tolerances of a step of `world` whose bodies move at `speed` (m/s), up to `length` (m) from the origin.
    pub(super) fn new(world: &World, speed: f64, length: f64) -> Self {
        let scale = world.speed_scale().max(ROUNDING / EXACT * speed);
        let gaps = scale.max(ROUNDING / SOLVED * length / world.time_step());
        let (rounding, exact) = (1e-14 * scale, EXACT * scale);
        Self {
            rounding,
            exact,
            newton: 1e-11 * scale,
            solved: SOLVED * gaps,
            preliminary: PRELIMINARY * scale,
            whole_steps: 1e-5 * scale,
            near: 1e-4 * scale,
            missed: 1e-10 * gaps,
            missed_by_preliminary: MISSED_BY_PRELIMINARY * scale,
            repeated: exact,
            still: rounding,
            level: 0.0,
            rest: exact,
        }
    }

    /// Tolerances of an island of several bodies.
    ///
    /// Hyperstatic forces near the edges of their cones converge slowly in their last digits. The
    /// remainder appears in the gaps of the next step. A heap whose gaps contradict each other by
    /// 10⁻¹³ m must push and slide to satisfy them. Gaps of that size are therefore treated as
    /// zero. Together with the solution's residual they stay below the
    /// [accepted](ACCEPTED_RESIDUAL) one.
    ///
    /// With `repeats_exactly` the last impulses must repeat exactly. A joint force that is the same
    /// in every step could move all bodies at the same small speed.
    pub(super) fn for_several(
        world: &World,
        speed: f64,
        length: f64,
        repeats_exactly: bool,
    ) -> Self {
        let of_one = Self::new(world, speed, length);
        let (scale, gaps) = (of_one.exact / EXACT, of_one.solved / SOLVED);
        let rest = 3e-10 * scale;
        let (repeated, still) =
            if repeats_exactly { (of_one.exact, of_one.rounding) } else { (rest, of_one.exact) };
        Self {
            solved: 3e-10 * gaps,
            exact: EXACT * gaps,
            level: 5e-10 * gaps,
            rest,
            repeated,
            still,
            ..of_one
        }
    }

    /// Tolerances of a contact problem without a world, solved to `residual`. Its velocities and
    /// `residual` are relative to its own speed.
    pub(super) fn for_problem(residual: f64) -> Self {
        let scale = (residual / ACCEPTED_RESIDUAL).max(ROUNDING / EXACT);
        // Closeness to a solution hardly depends on the tolerance: 1e-4 to 2e-2 perform similarly.
        let near = 5e-3_f64.max(10.0 * residual);
        let (solved, exact) = (3e-10 * scale, EXACT * scale);
        Self {
            rounding: 1e-14 * scale,
            exact,
            newton: 1e-11 * scale,
            solved,
            preliminary: solved,
            whole_steps: 0.1 * near,
            near,
            missed: 1e-10 * scale,
            missed_by_preliminary: 1e-10 * scale,
            repeated: solved,
            still: exact,
            level: 0.0,
            rest: 0.0,
        }
    }

    /// Tolerances multiplied by `factor`.
    pub(super) fn times(self, factor: f64) -> Self {
        let solved = factor * self.solved;
        Self {
            rounding: factor * self.rounding,
            exact: factor * self.exact,
            newton: factor * self.newton,
            solved,
            preliminary: self.preliminary.max(solved),
            whole_steps: self.whole_steps.max(solved),
            near: self.near.max(solved),
            missed: factor * self.missed,
            missed_by_preliminary: self.missed_by_preliminary.max(factor * self.missed),
            repeated: factor * self.repeated,
            still: factor * self.still,
            level: factor * self.level,
            rest: factor * self.rest,
        }
    }

    /// Tolerances of a solution that only shows what the bodies meet.
    pub(super) fn preliminary(self) -> Self {
        let solved = self.preliminary;
        Self { exact: solved, newton: self.newton.max(PROXIMAL_ACCURACY * solved), solved, ..self }
    }
}
