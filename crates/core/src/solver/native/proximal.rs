//! The proximal point method: compliance that acts on changes alone, again and again.
//!
//! Equation numbers are those of `docs/native-solver.md`.

use super::effort::SolveEffort;
use super::equations::Equations;
use super::law::NaturalMap;
use super::newton::{Iterate, Newton, NewtonRun, evaluate_again, exact_residual};
use super::settings::{
    EASY_STEP, LEAST_COMPLIANCE, LONGEST_STEP, PROXIMAL_ACCURACY, PROXIMAL_FACTORS, REFINEMENTS,
    STAGE_ITERATIONS,
};

/// Memory of the method.
#[derive(Debug, Clone)]
pub(super) struct Proximal<E: Equations> {
    /// Where the last proximal step ended.
    last: Iterate<E>,
    /// The point with the least residual.
    best: Iterate<E>,
}

impl<E: Equations> Proximal<E> {
    pub(super) fn new() -> Self {
        Self { last: Iterate::new(), best: Iterate::new() }
    }

    /// Makes room for so many couplings.
    pub(super) fn reserve(&mut self, couplings: usize) {
        self.last.reserve(couplings);
        self.best.reserve(couplings);
    }

    /// Solves the law with compliance on changes from where the last such step ended (N13), until
    /// nothing changes: a solution of it with p̂ = p̂_0 is one of the law without compliance, and
    /// contacts may change their pieces on the way. `compliance` is the first ε. Leaves `iterate` at
    /// the best point and returns its residual, m/s.
    ///
    /// A step changes impulses by about the residual over ε, so that the ε to take is the smallest
    /// with which Newton's method still follows: less after an easy step, more after one whose end
    /// was not found.
    pub(super) fn solve(
        &mut self,
        equations: &E,
        mut compliance: f64,
        newton: &mut Newton<E>,
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> f64 {
        let tolerances = equations.tolerances();
        let [after_easy, after_long, after_failed] = PROXIMAL_FACTORS;
        let Self { last, best } = self;
        let mut least = exact_residual(equations, iterate);
        best.copy_from(iterate);
        last.copy_from(iterate);
        let (mut refinements, mut is_evaluated) = (0, true);
        for _ in 0..STAGE_ITERATIONS {
            if least <= tolerances.solved {
                if least <= tolerances.exact || refinements == REFINEMENTS {
                    break;
                }
                refinements += 1;
            }
            if effort.is_over() || compliance > 1.0 {
                break;
            }
            let map = NaturalMap::with_compliance(compliance);
            let run = NewtonRun {
                compliance,
                iterations: LONGEST_STEP,
                residual: tolerances.newton.max(PROXIMAL_ACCURACY * least),
            };
            let before = effort.iterations();
            let converged =
                newton.solve_from_here(equations, &map, run, is_evaluated, iterate, effort);
            let taken = effort.iterations() - before;
            let residual = evaluate_again(equations, &NaturalMap::EXACT, iterate).largest;
            if residual < least {
                least = residual;
                best.copy_from(iterate);
            }
            is_evaluated = converged;
            if !converged {
                iterate.copy_from(last);
                compliance *= after_failed;
                continue;
            }
            last.copy_from(iterate);
            if taken <= EASY_STEP {
                compliance = (compliance * after_easy).max(LEAST_COMPLIANCE);
            } else if taken > 2 * EASY_STEP {
                compliance *= after_long;
            }
        }
        iterate.copy_from(best);
        exact_residual(equations, iterate)
    }
}
