//! Problems with a closed-form answer, for any solver of the contact step.
//!
//! Each [`Problem`] poses one or more runs, lets a [`Laboratory`] simulate them with the
//! solver under test, and compares what came out with the answer of the continuous
//! problem: Newton's and Coulomb's laws, solved by hand. The answers stand above the code
//! that computes them, one file a problem.
//!
//! The step is first order in time, so that a measured quantity differs from the answer by
//! an error of order h. Each [`Quantity`] therefore names two allowances: what the step's
//! own discretisation may do, known from the same algebra, and what the certificates of
//! the run's steps allow ([`Run::velocity_slack`]).

mod compass;
mod dragging;
mod falling;
mod inputs;
mod laboratory;
mod rocking;
mod slope;
mod spinning;
mod stopping;
mod toppling;
mod tumbling;

pub use inputs::{Input, Inputs};
pub use laboratory::{Laboratory, MakeSolver, Run, Setup, Until};

use crate::error::Error;

/// A problem with an answer.
pub trait Problem: Sync {
    /// The word by which it is asked for.
    fn name(&self) -> &'static str;

    /// What happens in it and what the answer is, in a sentence or two; formulas in
    /// Unicode.
    fn about(&self) -> &'static str;

    /// The numbers it depends on, with their usual values.
    fn inputs(&self) -> Inputs;

    /// The unit of `input` in it.
    fn unit(&self, input: Input) -> &'static str {
        input.unit()
    }

    /// Simulates it and compares.
    ///
    /// # Errors
    /// [`Unsuitable`] inputs, for which the closed form is not the answer.
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable>;
}

/// All problems, in the order of a first reading.
pub static PROBLEMS: [&dyn Problem; 12] = [
    &falling::FreeFall,
    &stopping::SlidingStop,
    &slope::STICK,
    &slope::SLIDE,
    &stopping::FastPlate,
    &spinning::SpinningBox,
    &compass::Compass,
    &dragging::DraggedCube,
    &rocking::Rocking,
    &toppling::PushedOver,
    &toppling::SlopeTopple,
    &tumbling::Tumble,
];

/// The problem of that name.
#[must_use]
pub fn find(name: &str) -> Option<&'static dyn Problem> {
    PROBLEMS.iter().copied().find(|problem| problem.name() == name)
}

/// What a problem found out.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// Measured against exact.
    pub quantities: Vec<Quantity>,
    /// One of them over time, to be drawn.
    pub curve: Curve,
}

/// A number that was measured, and what it should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    /// In words.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// From the simulation.
    pub measured: f64,
    /// From the closed form.
    pub exact: f64,
    /// How far the step's own discretisation may take it from the closed form.
    pub discretisation: f64,
    /// How far the certificates of the steps may take it from there.
    pub slack: f64,
}

impl Quantity {
    /// measured − exact.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.measured - self.exact
    }

    /// Whether the error is within what discretisation and certificates allow.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.error().abs() <= self.discretisation + self.slack
    }

    /// The order p of the error, which goes like hᵖ, from the same quantity `at_half` the
    /// time step: p = log₂(e(h)/e(h/2)). `None` where an error is hardly one: no more than
    /// the certificates allow, or a tenth of what discretisation does, where it depends on
    /// how the step happens to fall; or where the allowance is not one of the time step.
    #[must_use]
    pub fn order(&self, at_half: &Self) -> Option<f64> {
        if at_half.discretisation >= 0.9 * self.discretisation {
            return None;
        }
        let speaks = |quantity: &Self| {
            let least = quantity.slack.max(0.1 * quantity.discretisation);
            quantity.error().abs() > least
        };
        (speaks(self) && speaks(at_half)).then(|| (self.error() / at_half.error()).abs().log2())
    }
}

/// A quantity over time, as it was simulated and as the closed form has it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curve {
    /// What is drawn, in words.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// t, s.
    pub times: Vec<f64>,
    /// From the simulation.
    pub measured: Vec<f64>,
    /// From the closed form; NaN where it says nothing.
    pub exact: Vec<f64>,
}

impl Curve {
    /// `measured` of every state of `run` beside `exact` of its time.
    fn of(
        (name, unit): (&'static str, &'static str),
        run: &Run,
        measured: impl Fn(usize) -> f64,
        exact: impl Fn(f64) -> f64,
    ) -> Self {
        let times: Vec<f64> = (0..run.states.len()).map(|k| run.time(k)).collect();
        Self {
            name,
            unit,
            measured: (0..run.states.len()).map(measured).collect(),
            exact: times.iter().map(|&t| exact(t)).collect(),
            times,
        }
    }
}

/// Why a problem cannot be posed with these inputs.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unsuitable {
    /// The model refuses a number.
    #[error(transparent)]
    Model(#[from] Error),
    /// The closed form is the answer of another motion.
    #[error("{0}")]
    Motion(String),
}
