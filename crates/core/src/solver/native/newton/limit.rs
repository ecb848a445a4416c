//! The law without compliance: as the limit of the law with less and less of it, or at once, where the laws leave nothing open.
//!
//! Equation numbers are those of `docs/native-solver.md` and, from J on, of `docs/joints.md`.

use super::{Iterate, Newton, NewtonRun, evaluate, evaluate_again, keeps};
use crate::solver::native::effort::SolveEffort;
use crate::solver::native::equations::{Determined, Equations};
use crate::solver::native::law::NaturalMap;
use crate::solver::native::settings::{
    CLEARANCE, COMPLIANCE, CORRECTIONS, DETERMINED_COMPLIANCE, DETERMINED_ITERATIONS,
    KEPT_CORRECTION, SETTLING,
};
use nalgebra::Vector3;

/// Newton steps on the pieces found last, towards the law without compliance.
struct Correction {
    /// ε in the matrix.
    compliance: f64,
    /// ε in the matrix once the steps are slow.
    least_compliance: f64,
    /// The residual to reach, m/s.
    residual: f64,
    /// The most steps that leave more than a small part of the residual.
    slow_steps: u32,
}

impl<E: Equations> Newton<E> {
    /// Moves a solution of the law of `map` to the limit of vanishing compliance (N9): the law without
    /// compliance, every contact on its present piece, and the compliance in the matrix alone,
    /// which leaves the undetermined part of the impulses where it is. Returns the residual of the
    /// law without compliance, m/s. The iterate must have been evaluated.
    pub(in super::super) fn take_limit(
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
        // Any multiple of the compliance leaves the same part of the impulses where it is. With less
        // of it they feel more of rounding, so that what settles would not come to rest. The law's
        // own goes first where nothing gives more than it: the matrix is factorised with it.
        let (setting, own) = (equations.setting(), map.compliance);
        let settles = setting.unsettled <= SETTLING;
        let part = if settles { 1.0 } else { equations.settings().limit_compliance };
        let correction = Correction {
            compliance: if setting.all_give_alike { own } else { own * part },
            least_compliance: own * part,
            residual: limit(equations),
            slow_steps: CORRECTIONS,
        };
        self.correct(equations, correction, iterate, effort)
    }

    /// Moves a point near a solution of the law without compliance, which was evaluated, to the
    /// solution. Returns the residual, m/s.
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
            self.try_step(iterate, 1.0);
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

    /// Solves the law without compliance, where nothing is to be selected. `is_evaluated` tells that
    /// the iterate was, for that law. Returns the residual, m/s; infinite where something turns out
    /// to be to select.
    pub(in super::super) fn solve_determined(
        &mut self,
        equations: &E,
        determined: Determined,
        is_evaluated: bool,
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> f64 {
        let (map, is_sure) = (NaturalMap::EXACT, determined == Determined::Surely);
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
        // What rolls gives more across only for the rule's sake: in the matrix it would make this
        // slow.
        self.gives_alike = true;
        let mut residual = f64::INFINITY;
        if self.go_on(equations, &map, run, iterate, effort) {
            self.find_pieces(equations, iterate);
            // Kept factors gain a digit or two a step, where Newton's method doubles them: not the
            // first below the limit. What one correction does not shrink by much is rounding.
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
        self.gives_alike = false;
        residual
    }

    /// Whether the laws leave nothing of the impulses of `iterate`, a solution, open. With the response W of the rows that hold,
    ///
    /// ```text
    /// r ← (W + ε E)⁻¹ ε r,   r = p̂ at first,                                   (J16)
    /// ```
    ///
    /// the step from u = 0 to u = −ε r, leaves of r what W does not see, and of all else little. What is open, and would not be where
    /// others give way, has a say too: no row may be so near to another piece of its law.
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
            // The factors are those of a point near it, as long as the pieces are the same.
            self.kept.are_good = true;
            if !self.set_direction(equations, matrix, iterate) {
                break;
            }
            let Self { trial, eliminations, step, .. } = &mut *self;
            trial.impulses.clear();
            trial.impulses.extend(eliminations.iter().map(|of| of.impulse_step(step)));
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

/// Whether no row of a point is so near to another piece of its law that compliance has a say in which it is on, or may be where
/// the solution is `apart` from it, m/s.
fn is_clear<E: Equations>(equations: &E, iterate: &Iterate<E>, apart: f64) -> bool {
    let near = CLEARANCE * largest(&iterate.impulses) - apart;
    iterate.pulls.iter().all(|pull| pull.clearance(equations.graphs()) > near)
}

/// The largest entry; infinite where one is no number.
fn largest(impulses: &[Vector3<f64>]) -> f64 {
    let largest = impulses.iter().map(Vector3::amax).fold(0.0, f64::max);
    let is_known = impulses.iter().flatten().all(|number| !number.is_nan());
    if is_known { largest } else { f64::INFINITY }
}

/// The residual at which the limit of vanishing compliance is reached: to rounding where the
/// impulses are settling, because they may be kept for many steps.
fn limit(equations: &impl Equations) -> f64 {
    let tolerances = equations.tolerances();
    if equations.setting().unsettled <= SETTLING { tolerances.rounding } else { tolerances.exact }
}
