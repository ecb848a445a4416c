//! Problems with large coefficients of friction, whose cones are nearly half-spaces.

use super::solve;
use crate::problem::{ContactProblem, ProblemError, Solution, SolveOptions};

/// Largest coefficient that is solved directly.
const WIDE: f64 = 1e3;

/// Reduced coefficients that are solved first, in this order, each from the solution of the
/// previous one.
const LOWERED: [f64; 3] = [10.0, 1e3, 1e5];

impl ContactProblem {
    /// Solves the problem.
    ///
    /// If it does not converge, the [solution](Solution) reports it and holds the best point found,
    /// which may be zero impulses. Coefficients of friction beyond 1000 are reduced first. Some
    /// problems with coefficients beyond 10⁵ do not converge.
    ///
    /// # Errors
    /// If an option is out of range, if the initial impulses do not have one number per row, or on
    /// an interrupt.
    pub fn solve(&self, options: &SolveOptions<'_>) -> Result<Solution, ProblemError> {
        options.check(self)?;
        let widest = self.laws().iter().fold(0.0_f64, |most, law| most.max(law.friction()));
        if widest <= WIDE {
            return Ok(self.or_none(solve(self, options)?));
        }
        self.solve_in_turn(options, widest)
    }

    /// Solves the problem with reduced coefficients and with its own, the largest being `widest`.
    /// Returns the best point, or zero impulses.
    ///
    /// Impulses in a cone are also in every wider one. A reduced problem in which all contacts
    /// stick or open therefore has a solution of the original one.
    fn solve_in_turn(
        &self,
        options: &SolveOptions<'_>,
        widest: f64,
    ) -> Result<Solution, ProblemError> {
        let mut best: Option<Solution> = None;
        let (mut iterations, mut last) = (0, None);
        for most in LOWERED.into_iter().filter(|most| *most < widest).chain([f64::INFINITY]) {
            let lowered = self.with_friction_up_to(most);
            let start = last.as_deref().or(options.start);
            let asked = SolveOptions { start, ..*options };
            let found = solve(&lowered, &asked)?;
            iterations += found.iterations;
            if found.is_solved() {
                last = Some(found.impulses.clone());
            }
            let found = found.evaluated_in(self);
            if best.as_ref().is_none_or(|best| found.residual < best.residual) {
                best = Some(found);
            }
            if best.as_ref().is_some_and(Solution::is_solved) {
                break;
            }
        }
        let none = || self.none(options.residual);
        Ok(Solution { iterations, ..self.or_none(best.unwrap_or_else(none)) })
    }

    /// Returns `found`, or zero impulses if their residual is smaller.
    fn or_none(&self, found: Solution) -> Solution {
        if found.is_solved() {
            return found;
        }
        let none = self.none(found.asked);
        if found.residual <= none.residual {
            return found;
        }
        let Solution { iterations, parts, start, .. } = found;
        Solution { iterations, parts, start, selected: false, ..none }
    }

    /// Zero impulses.
    fn none(&self, residual: f64) -> Solution {
        let impulses = vec![0.0; self.row_count()];
        let evaluation = self.evaluate(&impulses);
        Solution::new(impulses, evaluation, residual)
    }
}
