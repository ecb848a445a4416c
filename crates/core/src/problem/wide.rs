//! Coefficients of friction beyond which a cone is a half-space but for digits.

use super::{ContactProblem, Law, ProblemError, Solution, SolveOptions};

/// Coefficients up to this are solved as they are.
const WIDE: f64 = 1e3;

/// What wider ones are lowered to first, one after the other, each from the solution of the one before.
const LOWERED: [f64; 3] = [10.0, 1e3, 1e5];

impl ContactProblem {
    /// The best point of the problem with its coefficients lowered and as they are, or none at all.
    ///
    /// Impulses that keep within a cone keep within every wider one, too, so that a lowered problem in which all sticks or opens has a solution of the wider one.
    pub(super) fn solve_in_turn(
        &self,
        options: &SolveOptions<'_>,
    ) -> Result<Solution, ProblemError> {
        let widest = self.laws.iter().fold(0.0_f64, |most, law| most.max(law.friction()));
        if widest <= WIDE {
            return Ok(self.or_none(crate::solver::native::solve_problem(self, options)?));
        }
        let mut best: Option<Solution> = None;
        let (mut iterations, mut last) = (0, None);
        for most in LOWERED.into_iter().filter(|most| *most < widest).chain([f64::INFINITY]) {
            let laws = self.laws.iter().map(|law| law.with_friction_up_to(most)).collect();
            let lowered = Self { laws, ..self.clone() };
            let start = last.as_deref().or(options.start);
            let asked = SolveOptions { start, ..*options };
            let found = crate::solver::native::solve_problem(&lowered, &asked)?;
            iterations += found.iterations;
            if found.is_solved() {
                last = Some(found.impulses.clone());
            }
            let found = found.of_problem(self);
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

    /// What was found, or no impulses where they miss the laws by less.
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

    /// No impulses.
    fn none(&self, residual: f64) -> Solution {
        let impulses = vec![0.0; self.row_count()];
        let evaluation = self.evaluate(&impulses);
        Solution::of(impulses, evaluation, residual)
    }
}

impl Law {
    /// The coefficient of a contact; 0 of other rows.
    fn friction(&self) -> f64 {
        match self {
            Self::Contact { friction, .. } => *friction,
            Self::Rows(_) => 0.0,
        }
    }

    /// The same with a coefficient of at most `most`.
    fn with_friction_up_to(&self, most: f64) -> Self {
        match self {
            Self::Contact { friction, tangents } => {
                Self::Contact { friction: friction.min(most), tangents: *tangents }
            }
            Self::Rows(_) => self.clone(),
        }
    }
}
