//! The proximal point method: compliance that acts on changes alone, again and again.
//!
//! Equation numbers are those of `docs/native-solver.md`.

use super::effort::SolveEffort;
use super::equations::Equations;
use super::law::NaturalMap;
use super::newton::{Iterate, Newton, Until, evaluate_again, exact_residual};
use super::tolerances::{
    CROWD_SHARE, LEAST_COMPLIANCE, LONGEST_WAIT, MOST_PROXIMAL_STEPS, MOST_REFINEMENTS,
    PROXIMAL_EASE, PROXIMAL_EFFORT, PROXIMAL_GROWTH, PROXIMAL_ITERATIONS, PROXIMAL_RETREAT,
    PROXIMAL_SHARE, WORTH_MORE,
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

    /// Room for so many contacts.
    pub(super) fn reserve(&mut self, contacts: usize) {
        self.last.reserve(contacts);
        self.best.reserve(contacts);
    }

    /// Solves the law with compliance on changes from where the last such step ended (N13), until
    /// nothing changes: a solution of it with p̂ = p̂_0 is one of the law without compliance, and
    /// contacts may change their pieces on the way. Leaves `iterate` at the best point and returns
    /// its residual.
    ///
    /// A step changes impulses by about the residual over ε, so that the ε to take is the smallest
    /// with which Newton's method still follows: less after a step that was easy for it, more after
    /// one that it did not find the end of. In a crowd ε then stays as it is for as many easy steps as steps have failed: where the residual
    /// stands, every second one would fail, and take four times what an easy one does. What a crowd whose forces change is solved to is
    /// not refined.
    pub(super) fn solve(
        &mut self,
        equations: &E,
        (mut compliance, sharpness): (f64, f64),
        newton: &mut Newton<E>,
        iterate: &mut Iterate<E>,
        effort: &mut SolveEffort<'_>,
    ) -> f64 {
        let tolerances = equations.tolerances();
        let Self { last, best } = self;
        let mut least = exact_residual(equations, iterate);
        best.copy_from(iterate);
        last.copy_from(iterate);
        let is_crowd = equations.policy().follows(iterate.impulses.len());
        let changes = is_crowd && equations.setting().changes();
        let mut refinements = if changes { MOST_REFINEMENTS } else { 0 };
        let share = if is_crowd { CROWD_SHARE } else { PROXIMAL_SHARE };
        let (mut failed, mut waits, mut evaluated) = (0, 0, true);
        for _ in 0..MOST_PROXIMAL_STEPS {
            if least <= tolerances.solved {
                if least <= tolerances.exact || refinements == MOST_REFINEMENTS {
                    break;
                }
                refinements += 1;
            }
            if effort.is_over() || compliance > 1.0 {
                break;
            }
            let map = NaturalMap { sharpness, ..NaturalMap::with_compliance(compliance) };
            let until = Until {
                iterations: PROXIMAL_ITERATIONS,
                residual: tolerances.newton.max(share * least),
            };
            let (before, known) = (effort.iterations(), (until, evaluated));
            let converged = newton.solve_from_here(equations, &map, known, iterate, effort);
            let taken = effort.iterations() - before;
            let residual = evaluate_again(equations, &NaturalMap::EXACT, iterate).largest;
            let falls = residual < WORTH_MORE * least;
            if residual < least {
                least = residual;
                best.copy_from(iterate);
            }
            evaluated = converged;
            if !converged {
                iterate.copy_from(last);
                compliance *= PROXIMAL_RETREAT;
                failed += u32::from(is_crowd && failed < LONGEST_WAIT);
                waits = failed;
                continue;
            }
            last.copy_from(iterate);
            if taken <= PROXIMAL_EASE && waits > 0 {
                waits -= 1;
                if falls {
                    (failed, waits) = (0, 0);
                }
            } else if taken <= PROXIMAL_EASE {
                compliance = (compliance * PROXIMAL_GROWTH).max(LEAST_COMPLIANCE);
            } else if taken > PROXIMAL_EFFORT {
                compliance *= 2.0;
            }
        }
        iterate.copy_from(best);
        exact_residual(equations, iterate)
    }
}
