//! Contact problems with closed-form solutions, for any solver of the contact step.
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
//! [`ValidationReport`] collects the findings for several solvers and time steps, and [`page()`] draws it.
//!
//! ```
//! use tumble_core::solver::native::NativeSolver;
//! use tumble_core::step::StepSolver;
//! use tumble_validation::{Input, Runner, find};
//!
//! let native = |world: &_| Ok(Box::new(NativeSolver::new(world)) as Box<dyn StepSolver>);
//! let problem = find("sliding-stop").expect("the problem exists");
//! let mut inputs = problem.inputs();
//! inputs.set(Input::Friction, 0.2);
//! let findings = problem.solve(&inputs, &mut Runner::new(&native, inputs.time_step))?;
//! assert!(findings.quantities.iter().all(|quantity| quantity.holds()));
//! # Ok::<(), tumble_validation::Refusal>(())
//! ```

#![forbid(unsafe_code)]

mod edge;
mod inputs;
mod page;
mod planar;
mod prelude;
mod problems;
mod quantity;
mod report;
mod residual;
mod runner;
mod threshold;
mod tolerance;

pub use inputs::{Input, TestInputs};
pub use page::page;
pub use problems::PROBLEMS;
pub use quantity::{Convergence, QuantityClaim, TestQuantity};
pub use report::{ErrorSeries, Experiment, ReportedSolver, Trial, ValidationReport};
pub use residual::ResidualCheck;
pub use runner::{MakeSolver, Runner, StepCounts};

use quantity::QuantityLabel;
use runner::TestRun;
use tumble_core::error::Error;

/// A problem with a closed-form solution.
#[derive(Debug, Clone, Copy)]
pub struct TestProblem {
    /// The name.
    pub name: &'static str,
    /// The motion and its solution, in a sentence or two with formulas in Unicode.
    pub about: &'static str,
    /// The usual time step, s.
    time_step: f64,
    /// The inputs with their usual values.
    inputs: &'static [(Input, f64)],
    /// The number of bodies.
    pub bodies: usize,
    /// The reason why only the native solver can solve the problem.
    pub native_only: Option<&'static str>,
    /// The unit of [`Input::Speed`].
    speed_unit: &'static str,
    solve: fn(&TestInputs, &mut Runner<'_>) -> SolvedBy,
}

/// The result of [`TestProblem::solve`].
type SolvedBy = Result<ProblemFindings, Refusal>;

impl TestProblem {
    /// A problem without a name, for any solver.
    const fn solved_by(solve: fn(&TestInputs, &mut Runner<'_>) -> SolvedBy) -> Self {
        let (time_step, bodies, native_only, speed_unit) = (0.0, 1, None, "m/s");
        Self { name: "", about: "", time_step, inputs: &[], bodies, native_only, speed_unit, solve }
    }

    /// The inputs with their usual values.
    #[must_use]
    pub fn inputs(&self) -> TestInputs {
        TestInputs::new(self.time_step, self.inputs)
    }

    /// The unit of `input`.
    #[must_use]
    pub fn unit(&self, input: Input) -> &'static str {
        if input == Input::Speed { self.speed_unit } else { input.unit() }
    }

    /// Simulates the problem and compares.
    ///
    /// # Errors
    /// A [`Refusal`] of inputs with a motion that differs from the closed form.
    pub fn solve(
        &self,
        inputs: &TestInputs,
        runner: &mut Runner<'_>,
    ) -> Result<ProblemFindings, Refusal> {
        (self.solve)(inputs, runner)
    }
}

/// The problem with this name.
#[must_use]
pub fn find(name: &str) -> Option<&'static TestProblem> {
    PROBLEMS.iter().find(|problem| problem.name == name)
}

/// The results of a problem.
#[derive(Debug, Clone, PartialEq)]
pub struct ProblemFindings {
    /// Measured and expected values.
    pub quantities: Vec<TestQuantity>,
    /// A quantity over time, for a plot.
    pub curve: TestCurve,
}

/// A quantity over time, in the simulation and in closed form.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TestCurve {
    /// The name.
    pub name: &'static str,
    /// The unit.
    pub unit: &'static str,
    /// t, s.
    pub times: Vec<f64>,
    /// Values in the simulation.
    pub measured: Vec<f64>,
    /// Closed-form values, NaN if unknown.
    pub exact: Vec<f64>,
}

impl TestCurve {
    /// The curve of `measured(k)` for every state k of `run`, without closed-form values.
    fn of((name, unit): QuantityLabel, run: &TestRun, measured: impl Fn(usize) -> f64) -> Self {
        let times: Vec<f64> = (0..=run.steps()).map(|k| run.time(k)).collect();
        let measured = (0..times.len()).map(measured).collect();
        Self { name, unit, measured, exact: vec![f64::NAN; times.len()], times }
    }

    /// The findings with this curve.
    fn with(self, quantities: impl Into<Vec<TestQuantity>>) -> SolvedBy {
        Ok(ProblemFindings { quantities: quantities.into(), curve: self })
    }

    /// The curve with the closed form `exact(t)`.
    fn beside(self, exact: impl Fn(f64) -> f64) -> Self {
        Self { exact: self.times.iter().map(|&t| exact(t)).collect(), ..self }
    }
}

/// The reason why a problem cannot be posed with given inputs.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
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
    fn when(condition: bool, why: impl Into<String>) -> Result<(), Self> {
        if condition { Err(Self::Motion(why.into())) } else { Ok(()) }
    }
}
