//! The law without compliance: as the limit of the law with less and less of it, or at once, where the laws leave nothing open.
//!
//! Equation numbers are those of `docs/native-solver.md` and, from J on, of `docs/joints.md`.

use super::{Iterate, Newton, Until, evaluate, evaluate_again, keeps};
use crate::solver::native::effort::SolveEffort;
use crate::solver::native::equations::{Determined, Equations, MapResidual};
use crate::solver::native::law::NaturalMap;
use crate::solver::native::tolerances::{
    CLEAR, CORRECTIONS, DETERMINED_ITERATIONS, KEPT_FACTORS, LEFT_OPEN, ROLLING_CORRECTIONS,
    SETTLING,
};
use nalgebra::Vector3;

impl<E: Equations> Newton<E> {
    /// Moves a solution of `law` to the limit of vanishing compliance (N9): the law without
    /// compliance, every contact on the piece that `law` puts it on, and the compliance in
    /// the matrix alone, which leaves the undetermined part of the impulses where it is.
    /// Returns the residual of the law without compliance. The iterate must have been evaluated.
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
        self.find_pieces(equations, map, iterate);
        let merit = evaluate_again(equations, &NaturalMap::EXACT, iterate);
        // Any multiple of the compliance leaves the same part of the impulses where it is; the less of it, the more do these feel
        // of rounding, so that what settles would not come to rest.
        // That of the law itself, with which the matrix is factorised, goes first, where nothing gives more than it.
        let setting = equations.setting();
        let settles = setting.unsettled <= SETTLING;
        let part = if settles { 1.0 } else { equations.policy().limit_compliance };
        let first = if setting.all_give_alike { 1.0 } else { part };
        let matrix = (map.compliance * first, map.compliance * part);
        let most = if setting.all_give_alike { CORRECTIONS } else { ROLLING_CORRECTIONS };
        self.correct(equations, (matrix, limit(equations), most), (merit, iterate), effort)
    }

    /// Moves a point near a solution of the law without compliance there, where the pieces are those found last, with
    /// the compliance `matrix` in the Newton matrix, and the second one from where the first is slow, until a residual of
    /// `limit`, by so many corrections that leave more than a small part of it. Returns the residual.
    fn correct(
        &mut self,
        equations: &E,
        ((mut matrix, least), limit, mut left): ((f64, f64), f64, u32),
        (mut merit, iterate): (MapResidual, &mut Iterate<E>),
        effort: &mut SolveEffort<'_>,
    ) -> f64 {
        let enough = self::limit(equations);
        while left > 0 {
            if merit.largest <= limit || !effort.spend() {
                break;
            }
            if !self.set_direction(equations, matrix, iterate) {
                break;
            }
            self.try_step(iterate, 1.0);
            let corrected = evaluate(equations, &NaturalMap::EXACT, &mut self.trial);
            let good = keeps(equations, merit.largest, corrected.largest, KEPT_FACTORS);
            let were_kept = std::mem::replace(&mut self.kept.are_good, good);
            let changes = matrix > least && !good;
            if changes {
                matrix = least;
            } else if !good {
                left -= 1;
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

    /// Solves the law without compliance, where nothing is to be selected, with the compliance `matrix` in the Newton matrix.
    /// `evaluated` tells that the iterate was, for that law. Returns the residual; infinite where something turns out to be to
    /// select.
    pub(in super::super) fn solve_determined(
        &mut self,
        equations: &E,
        (evaluated, matrix, determined): (bool, f64, Determined),
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> f64 {
        let (map, mut until) = (NaturalMap::EXACT, Until::converged(equations));
        if determined == Determined::Maybe {
            until.iterations = DETERMINED_ITERATIONS;
        }
        let merit = match evaluated {
            true => iterate.residual,
            false => evaluate(equations, &map, iterate),
        };
        if determined == Determined::Maybe && !is_clear(equations, iterate, merit.largest) {
            return f64::INFINITY;
        }
        // What rolls gives more across only for the rule's sake: in the matrix it would make this slow.
        self.gives_alike = true;
        let (converged, merit) =
            self.go_on(equations, &map, (matrix, until), (merit, iterate), effort);
        let mut residual = f64::INFINITY;
        if converged {
            self.find_pieces(equations, &map, iterate);
            // Kept factors gain a digit or two a step, where Newton's method doubles them: not the first below the limit.
            let limit = KEPT_FACTORS * limit(equations);
            // What a correction does not shrink by much is rounding.
            let by = ((matrix, matrix), limit, 1);
            let corrected = self.correct(equations, by, (merit, iterate), effort);
            if determined == Determined::Surely || self.is_selected(equations, matrix, iterate) {
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
        let (enough, mut is_selected) = (LEFT_OPEN * before, false);
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
            if is_selected || left > KEPT_FACTORS * before || left == f64::INFINITY {
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
    let near = CLEAR * largest(&iterate.impulses) - apart;
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
