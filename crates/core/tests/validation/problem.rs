//! A problem with a closed-form solution, and the reason why it cannot be posed.

use crate::inputs::{Input, TestInputs};
use crate::problems::PROBLEMS;
use crate::quantity::TestQuantity;
use crate::runner::Runner;
use tumble_core::error::Error;

/// A problem with a closed-form solution.
#[derive(Debug, Clone, Copy)]
pub struct TestProblem {
    pub name: &'static str,
    /// The usual time step, s.
    pub time_step: f64,
    /// The inputs with their usual values.
    pub inputs: &'static [(Input, f64)],
    /// The number of bodies.
    pub bodies: usize,
    pub solve: fn(&TestInputs, &mut Runner<'_>) -> SolvedBy,
}

/// The result of [`TestProblem::solve`]: measured and expected values, or a [`Refusal`] of inputs
/// with a motion that differs from the closed form.
pub type SolvedBy = Result<Vec<TestQuantity>, Refusal>;

impl TestProblem {
    /// A problem without a name, for any solver.
    pub const fn solved_by(solve: fn(&TestInputs, &mut Runner<'_>) -> SolvedBy) -> Self {
        Self { name: "", time_step: 0.0, inputs: &[], bodies: 1, solve }
    }

    /// The inputs with their usual values.
    pub fn inputs(&self) -> TestInputs {
        TestInputs::new(self.time_step, self.inputs)
    }

    /// Simulates the problem and compares.
    pub fn solve(&self, inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
        (self.solve)(inputs, runner)
    }
}

/// The problem with this name.
pub fn find(name: &str) -> Option<&'static TestProblem> {
    PROBLEMS.iter().find(|problem| problem.name == name)
}

/// The reason why a problem cannot be posed with given inputs.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// The model refuses a number.
    #[error(transparent)]
    Model(#[from] Error),
    /// The closed form does not describe the motion.
    #[error("{0}")]
    Motion(String),
}

impl Refusal {
    /// Refuses if `condition` holds.
    pub fn when(condition: bool, why: impl Into<String>) -> Result<(), Self> {
        if condition { Err(Self::Motion(why.into())) } else { Ok(()) }
    }
}
