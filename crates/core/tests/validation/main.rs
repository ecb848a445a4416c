//! Contact problems with closed-form solutions: docs/validation.md.
//!
//! A [`TestProblem`] simulates one or more runs with the solver of a [`Runner`] and compares the
//! results with two values. The *exact* value solves the continuous problem with Newton's and
//! Coulomb's laws by hand. The *discrete* value solves the time-stepping scheme of
//! `docs/formulation.md` for the same motion. It is a sum in closed form or a recurrence in one
//! unknown. Both formulas stand above the code that computes them.
//!
//! A [`TestQuantity`] holds if the measured value equals the discrete one to within its tolerance.
//! The tolerance covers rounding and the residuals of the steps (`tolerance.rs`). The order of
//! convergence of the discrete value to the exact one is declared ([`Convergence`]) and checked
//! ([`TestQuantity::converges`]).

#[path = "../common/campaign.rs"]
mod campaign;
mod edge;
mod inputs;
mod ipopt;
mod native;
mod planar;
mod planted;
mod prelude;
mod problems;
mod quantity;
mod residual;
mod runner;
mod threshold;
mod tolerance;
#[path = "../common/turning.rs"]
mod turning;

use inputs::{Input, TestInputs};
use problems::PROBLEMS;
use quantity::{Convergence, TestQuantity};
use runner::Runner;
use tumble_core::error::Error;

/// A problem with a closed-form solution.
#[derive(Debug, Clone, Copy)]
struct TestProblem {
    name: &'static str,
    /// The usual time step, s.
    time_step: f64,
    /// The inputs with their usual values.
    inputs: &'static [(Input, f64)],
    /// The number of bodies.
    bodies: usize,
    solve: fn(&TestInputs, &mut Runner<'_>) -> SolvedBy,
}

/// The result of [`TestProblem::solve`]: measured and expected values, or a [`Refusal`] of inputs
/// with a motion that differs from the closed form.
type SolvedBy = Result<Vec<TestQuantity>, Refusal>;

impl TestProblem {
    /// A problem without a name, for any solver.
    const fn solved_by(solve: fn(&TestInputs, &mut Runner<'_>) -> SolvedBy) -> Self {
        Self { name: "", time_step: 0.0, inputs: &[], bodies: 1, solve }
    }

    /// The inputs with their usual values.
    fn inputs(&self) -> TestInputs {
        TestInputs::new(self.time_step, self.inputs)
    }

    /// Simulates the problem and compares.
    fn solve(&self, inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
        (self.solve)(inputs, runner)
    }
}

/// The problem with this name.
fn find(name: &str) -> Option<&'static TestProblem> {
    PROBLEMS.iter().find(|problem| problem.name == name)
}

/// The reason why a problem cannot be posed with given inputs.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
enum Refusal {
    /// The model refuses a number.
    #[error(transparent)]
    Model(#[from] Error),
    /// The closed form does not describe the motion.
    #[error("{0}")]
    Motion(String),
}

impl Refusal {
    /// Refuses if `condition` holds.
    fn when(condition: bool, why: impl Into<String>) -> Result<(), Self> {
        if condition { Err(Self::Motion(why.into())) } else { Ok(()) }
    }
}
