//! Method of multipliers: Newton's method on the velocities alone, with impulses that follow from them.
//!
//! With compliance ε on changes from p̂_0 (N13), the impulse of each coupling is a function of its motion,
//!
//! ```text
//! p̂ = P(p̂_0 − u/ε),                                                            (N20)
//! ```
//!
//! the projection of the natural map (N4) with ρ = 1/ε. Without friction of contacts and with fixed
//! directions, the velocities minimise a convex function. A line search on its slope converges from
//! any start, also where the impulses of a motor and of a brake exclude each other in turn.

use super::{Iterate, Newton, evaluate, exact_residual};
use crate::solver::native::effort::SolveEffort;
use crate::solver::native::equations::{Equations, Velocities};
use crate::solver::native::law::{LawRows, NaturalMap};
use crate::solver::native::settings::{
    LEAST_MULTIPLIER_COMPLIANCE, MULTIPLIER_ACCURACY, MULTIPLIER_COMPLIANCE, MULTIPLIER_ITERATIONS,
    MULTIPLIER_SEARCH, MULTIPLIER_STEPS, PROXIMAL_FACTORS,
};
use nalgebra::Vector3;

impl<E: Equations> Newton<E> {
    /// Approaches a solution of the law by multipliers from `iterate`, and leaves it at the best point.
    /// Returns its residual (m/s). The proximal point method leads on from near a solution.
    pub(crate) fn solve_by_multipliers(
        &mut self,
        equations: &E,
        best: &mut Iterate<E>,
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> f64 {
        let tolerances = equations.tolerances();
        let [after_easy, _, after_failed] = PROXIMAL_FACTORS;
        let mut map = NaturalMap::with_compliance(MULTIPLIER_COMPLIANCE);
        let mut least = exact_residual(equations, iterate);
        best.copy_from(iterate);
        let mut known = iterate.impulses.clone();
        for _ in 0..MULTIPLIER_STEPS {
            if least <= tolerances.near || effort.is_over() {
                break;
            }
            let enough = tolerances.newton.max(MULTIPLIER_ACCURACY * least);
            iterate.impulses.clone_from(&known);
            iterate.keep_impulses(equations, &map);
            self.trial.shifts.clone_from(&iterate.shifts);
            let converged = self.minimise(equations, &map, &known, enough, iterate, effort);
            iterate.forget_impulses();
            self.trial.forget_impulses();
            let residual = exact_residual(equations, iterate);
            if residual < least {
                least = residual;
                best.copy_from(iterate);
            }
            if converged {
                known.clone_from(&iterate.impulses);
                map.compliance = (after_easy * map.compliance).max(LEAST_MULTIPLIER_COMPLIANCE);
            } else {
                map.compliance *= after_failed;
                iterate.velocity.copy_from(&best.velocity);
            }
        }
        iterate.copy_from(best);
        exact_residual(equations, iterate)
    }

    /// Newton's method on the velocities for the impulses (N20) after those in `known`, until the
    /// equations of motion have a residual of at most `enough` (m/s). Returns true on convergence.
    fn minimise(
        &mut self,
        equations: &E,
        map: &NaturalMap,
        known: &[Vector3<f64>],
        enough: f64,
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> bool {
        follow(equations, map, known, iterate);
        for _ in 0..MULTIPLIER_ITERATIONS {
            if iterate.motion.largest <= enough {
                return true;
            }
            self.kept.are_good = false;
            self.find_pieces(equations, iterate);
            if !effort.spend() || !self.set_direction(equations, map.compliance, iterate) {
                return false;
            }
            let Some(before) = equations.slope_along(&iterate.scratch, &self.step) else {
                return false;
            };
            // Bisection for the length at which the slope of the convex function has fallen to half
            let (mut low, mut high, mut length) = (0.0, f64::INFINITY, 1.0);
            for _ in 0..MULTIPLIER_SEARCH {
                let Self { trial, step, .. } = self;
                trial.velocity.set_moved(&iterate.velocity, length, step);
                follow(equations, map, known, trial);
                let slope = equations.slope_along(&trial.scratch, step).unwrap_or(f64::NAN);
                if slope.abs() <= 0.5 * before.abs() || slope < 0.0 && length == 1.0 {
                    break;
                }
                if slope < 0.0 {
                    low = length;
                } else {
                    high = length;
                }
                length = 0.5 * (low + high.min(2.0));
            }
            std::mem::swap(iterate, &mut self.trial);
        }
        iterate.motion.largest <= enough
    }
}

/// Sets the impulses (N20) of the velocities of `iterate`, and evaluates the law of `map` there.
fn follow<E: Equations>(
    equations: &E,
    map: &NaturalMap,
    known: &[Vector3<f64>],
    iterate: &mut Iterate<E>,
) {
    let (stiffness, graphs) = (1.0 / map.compliance, equations.graphs());
    iterate.evaluate_points(equations);
    let Iterate { impulses, points, projections, .. } = &mut *iterate;
    impulses.clear();
    projections.clear();
    for ((coupling, u), known) in equations.couplings().iter().zip(&*points).zip(known) {
        let rows = coupling.rows.with_scale(stiffness);
        let law_rows = LawRows { rows: &rows, graphs };
        let (projection, missed) =
            coupling.law.evaluated(&NaturalMap::EXACT, law_rows, projections, u, known);
        projections.push(projection);
        impulses.push(known - stiffness * missed);
    }
    evaluate(equations, map, iterate);
}
