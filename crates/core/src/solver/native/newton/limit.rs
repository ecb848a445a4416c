//! Law without compliance: limit of vanishing compliance, or direct solution for independent rows.
//!
//! Equation numbers refer to `docs/native-solver.md`. Numbers from J on refer to `docs/joints.md`.

use super::{Iterate, Newton, NewtonRun, add_loads, evaluate, evaluate_again, keeps};
use crate::solver::native::effort::SolveEffort;
use crate::solver::native::equations::{Determined, Equations};
use crate::solver::native::law::NaturalMap;
use crate::solver::native::settings::{
    CLEARANCE, COMPLIANCE, CORRECTIONS, DETERMINED_COMPLIANCE, DETERMINED_ITERATIONS,
    KEPT_CORRECTION, SETTLING,
};
use nalgebra::Vector3;

/// Newton steps on fixed pieces towards the law without compliance.
struct Correction {
    /// ε in the matrix.
    compliance: f64,
    /// ε in the matrix once convergence is slow.
    least_compliance: f64,
    /// Residual to reach (m/s).
    residual: f64,
    /// Largest number of steps that reduce the residual slowly.
    slow_steps: u32,
}

impl<E: Equations> Newton<E> {
    /// Moves a solution of the law of `map` to the limit of vanishing compliance (N9).
    ///
    /// The law has no compliance, and every contact stays on its piece. The compliance in the
    /// matrix leaves the undetermined part of the impulses unchanged. Returns the residual of the
    /// law without compliance (m/s). The iterate must have been evaluated.
    pub(crate) fn take_limit(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> f64 {
        if iterate.map != *map {
            evaluate_again(equations, map, iterate);
        }
        self.find_pieces(equations, iterate);
        evaluate_again(equations, &NaturalMap::EXACT, iterate);
        // Any multiple of the compliance leaves the same part of the impulses unchanged. A smaller
        // one amplifies rounding, so that settling impulses would not come to rest. With isotropic
        // compliance the law's own goes first: the matrix is factorised with it.
        let (setting, own) = (equations.setting(), map.compliance);
        let settles = setting.unsettled <= SETTLING;
        let part = if settles { 1.0 } else { equations.settings().limit_compliance };
        let correction = Correction {
            compliance: if setting.all_isotropic { own } else { own * part },
            least_compliance: own * part,
            residual: limit(equations),
            slow_steps: CORRECTIONS,
        };
        self.correct(equations, correction, iterate, effort)
    }

    /// Moves an evaluated point near a solution of the law without compliance to the solution.
    /// Returns the residual (m/s).
    fn correct(
        &mut self,
        equations: &E,
        correction: Correction,
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> f64 {
        let Correction { mut compliance, least_compliance, residual, mut slow_steps } = correction;
        let (enough, mut merit) = (limit(equations), iterate.residual);
        while slow_steps > 0 {
            if merit.largest <= residual || !effort.spend() {
                break;
            }
            if !self.set_direction(equations, compliance, iterate) {
                break;
            }
            self.try_step(equations, iterate, 1.0);
            let corrected = evaluate(equations, &NaturalMap::EXACT, &mut self.trial);
            let good = keeps(equations, merit.largest, corrected.largest, KEPT_CORRECTION);
            let were_kept = std::mem::replace(&mut self.kept.are_good, good);
            let changes = compliance > least_compliance && !good;
            if changes {
                compliance = least_compliance;
            } else if !good {
                slow_steps -= 1;
            }
            if corrected.largest >= merit.largest {
                if (were_kept || changes) && merit.largest > enough {
                    continue;
                }
                break;
            }
            std::mem::swap(iterate, &mut self.trial);
            merit = corrected;
        }
        merit.largest
    }

    /// Solves the law without compliance for independent rows.
    ///
    /// `is_evaluated` is true if the iterate was evaluated for that law. Returns the residual
    /// (m/s). Returns infinity if the rows turn out to be dependent.
    pub(crate) fn solve_determined(
        &mut self,
        equations: &E,
        determined: Determined,
        is_evaluated: bool,
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> f64 {
        let map = NaturalMap::EXACT;
        let is_sure = determined == Determined::Surely;
        let compliance = DETERMINED_COMPLIANCE;
        let mut run = NewtonRun { compliance, ..NewtonRun::with_compliance(equations) };
        if !is_sure {
            run.iterations = DETERMINED_ITERATIONS;
        }
        if !is_evaluated {
            evaluate(equations, &map, iterate);
        }
        if !is_sure && !is_clear(equations, iterate, iterate.residual.largest) {
            return f64::INFINITY;
        }
        // The larger compliance of rolling contacts serves only the selection rule. In the matrix
        // it would slow convergence.
        self.is_isotropic = true;
        let mut residual = f64::INFINITY;
        if self.go_on(equations, &map, run, iterate, effort) {
            self.find_pieces(equations, iterate);
            // Retained factors gain one or two digits per step, while Newton's method doubles the
            // digits. The residual must fall clearly below the limit. Slow progress means rounding
            // level.
            let residual_to_reach = KEPT_CORRECTION * limit(equations);
            let correction = Correction {
                compliance,
                least_compliance: compliance,
                residual: residual_to_reach,
                slow_steps: 1,
            };
            let corrected = self.correct(equations, correction, iterate, effort);
            if is_sure || self.is_selected(equations, compliance, iterate) {
                residual = corrected;
            }
        }
        self.is_isotropic = false;
        residual
    }

    /// Tests if the laws determine the impulses of the solution `iterate`. With the response W of
    /// the constraining rows,
    ///
    /// ```text
    /// r ← (W + ε E)⁻¹ ε r,   r = p̂ at first,                                   (J16)
    /// ```
    ///
    /// This is the step from u = 0 to u = −ε r. It keeps the part of r in the null space of W and
    /// shrinks all else. Compliance could also load an open row. So no row may be close to another
    /// piece of its law.
    fn is_selected(&mut self, equations: &E, matrix: f64, iterate: &mut Iterate<E>) -> bool {
        if !is_clear(equations, iterate, 0.0) {
            return false;
        }
        let mut before = largest(&iterate.impulses);
        let (enough, mut is_selected) = (COMPLIANCE * before, false);
        self.trial.impulses.clone_from(&iterate.impulses);
        self.trial.points.clone_from(&iterate.points);
        loop {
            let Self { trial, .. } = &*self;
            let points = iterate.points.iter_mut().zip(&trial.points).zip(&trial.impulses);
            points.for_each(|((point, u), left)| *point = u + matrix * left);
            evaluate_again(equations, &NaturalMap::EXACT, iterate);
            // The factors belong to a nearby point. They stay valid while the pieces are the same.
            self.kept.are_good = true;
            if !self.set_direction(equations, matrix, iterate) {
                break;
            }
            let Self { trial, eliminations, step, .. } = &mut *self;
            trial.impulses.clear();
            trial.impulses.extend(eliminations.iter().map(|of| of.impulse_step(step)));
            add_loads(equations, eliminations, |_| Vector3::zeros(), &mut trial.impulses);
            let left = largest(&trial.impulses);
            is_selected = left <= enough;
            if is_selected || left > KEPT_CORRECTION * before || left == f64::INFINITY {
                break;
            }
            before = left;
        }
        iterate.points.clone_from(&self.trial.points);
        evaluate_again(equations, &NaturalMap::EXACT, iterate);
        is_selected
    }
}

/// True if no row is so close to another piece that compliance could change its piece. The solution
/// may be `apart` from the point (m/s).
fn is_clear<E: Equations>(equations: &E, iterate: &Iterate<E>, apart: f64) -> bool {
    let near = CLEARANCE * largest(&iterate.impulses) - apart;
    iterate.projections.iter().all(|projection| projection.clearance(equations.graphs()) > near)
}

/// Largest entry. Infinite if an entry is NaN.
fn largest(impulses: &[Vector3<f64>]) -> f64 {
    let largest = impulses.iter().map(Vector3::amax).fold(0.0, f64::max);
    let is_known = impulses.iter().flatten().all(|number| !number.is_nan());
    if is_known { largest } else { f64::INFINITY }
}

/// Residual at which the limit of vanishing compliance is reached (m/s). Settling impulses are
/// solved to rounding, because they may be kept for many steps.
fn limit(equations: &impl Equations) -> f64 {
    let tolerances = equations.tolerances();
    if equations.setting().unsettled <= SETTLING { tolerances.rounding } else { tolerances.exact }
}
