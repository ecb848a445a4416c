//! Proximal point method: repeated solves with compliance on changes only.
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::effort::SolveEffort;
use super::equations::Equations;
use super::law::NaturalMap;
use super::newton::{Iterate, Newton, NewtonRun, evaluate_again, exact_residual};
use super::settings::{
    CHANGING, EASY_STEP, FAST_REDUCTION, LEAST_COMPLIANCE, LONGEST_STEP, PROXIMAL_ACCURACY,
    PROXIMAL_FACTORS, REFINED_COUPLINGS, REFINEMENTS, STAGE_ITERATIONS,
};

/// Memory of the method.
#[derive(Debug, Clone)]
pub(super) struct Proximal<E: Equations> {
    /// End of the last successful proximal step.
    last: Iterate<E>,
    /// Point with the smallest residual.
    best: Iterate<E>,
}

impl<E: Equations> Proximal<E> {
    pub(super) fn new() -> Self {
        Self { last: Iterate::new(), best: Iterate::new() }
    }

    /// Reserves memory for `couplings` couplings.
    pub(super) fn reserve(&mut self, couplings: usize) {
        self.last.reserve(couplings);
        self.best.reserve(couplings);
    }

    /// Solves the law with compliance on changes from the last proximal step (N13) repeatedly.
    ///
    /// A solution with p̂ = p̂_0 solves the law without compliance. Contacts may change their
    /// pieces on the way. `first` has the first ε and the factor of all steps. Leaves `iterate` at
    /// the best point and returns its residual (m/s).
    ///
    /// A step changes the impulses by about the residual over ε. The best ε is the smallest with
    /// which Newton's method converges. It shrinks after an easy step and grows after a failed one.
    /// After failed steps it shrinks later ([`Settings::longest_wait`](super::settings::Settings)).
    pub(super) fn solve(
        &mut self,
        equations: &E,
        first: NaturalMap,
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
        // Refinements do not pay in a heap whose forces change.
        let (count, unsettled) =
            (equations.setting().couplings.len(), equations.setting().unsettled);
        let is_heap = count > REFINED_COUPLINGS && unsettled > CHANGING && unsettled.is_finite();
        let longest_wait = equations.settings().longest_wait;
        let mut refinements = if is_heap && equations.bodies() > 1 { 0 } else { REFINEMENTS };
        let (mut map, mut is_evaluated) = (first, true);
        let (mut failed, mut waits) = (0, 0);
        for _ in 0..STAGE_ITERATIONS {
            if least <= tolerances.solved || least <= best.rounding(equations) {
                if least <= tolerances.exact || refinements == 0 {
                    break;
                }
                refinements -= 1;
            }
            if effort.is_over() || map.compliance > 1.0 {
                break;
            }
            // A proximal step: the law with compliance on changes from p̂_0
            let run = NewtonRun {
                compliance: map.compliance,
                iterations: LONGEST_STEP,
                residual: tolerances.newton.max(PROXIMAL_ACCURACY * least),
            };
            let before = effort.iterations();
            let converged =
                newton.solve_from_here(equations, &map, run, is_evaluated, iterate, effort);
            let taken = effort.iterations() - before;
            let residual = evaluate_again(equations, &NaturalMap::EXACT, iterate).largest;
            let is_fast = residual < FAST_REDUCTION * least;
            if residual < least {
                least = residual;
                best.copy_from(iterate);
            }
            is_evaluated = converged;
            // A failed step is undone, and ε grows. Later steps wait as often as steps have failed.
            if !converged {
                iterate.copy_from(last);
                map.compliance *= after_failed;
                failed = longest_wait.min(failed + 1);
                waits = failed;
                continue;
            }
            // ε shrinks after an easy step, unless it waits, and grows after a long one.
            last.copy_from(iterate);
            if taken <= EASY_STEP && waits > 0 {
                waits -= 1;
                if is_fast {
                    (failed, waits) = (0, 0);
                }
            } else if taken <= EASY_STEP {
                map.compliance = (map.compliance * after_easy).max(LEAST_COMPLIANCE);
            } else if taken > 2 * EASY_STEP {
                map.compliance *= after_long;
            }
        }
        iterate.copy_from(best);
        exact_residual(equations, iterate)
    }
}
