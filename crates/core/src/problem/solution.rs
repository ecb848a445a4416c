//! Options and results of solvers of contact problems.

use super::error::{all_in_range, length};
use super::{ContactProblem, Evaluation, ProblemError};
use std::sync::atomic::AtomicBool;

/// Default residual of a converged problem (m/s).
pub const DEFAULT_RESIDUAL: f64 = 1e-9;

/// Options of a solve.
#[derive(Debug, Clone, Copy)]
pub struct SolveOptions<'a> {
    /// Largest [residual](Evaluation::residual) of a converged problem (m/s).
    pub residual: f64,
    /// Initial impulses (N s); zero if `None`.
    pub start: Option<&'a [f64]>,
    /// Selection among several solutions.
    pub selection: Selection,
    /// Flag that ends the solve with [`ProblemError::Interrupted`] when raised.
    pub interrupt: Option<&'a AtomicBool>,
}

/// Selection among several solutions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Selection {
    /// First solution found.
    #[default]
    Any,
    /// Limit of equal, vanishing compliances at all groups (N6), the selection rule of
    /// `docs/native-solver.md`. For sticking contacts these are the impulses of least norm. If no
    /// initial point leads to this limit, another solution is returned and
    /// [marked](Solution::selected).
    Compliance,
}

impl Default for SolveOptions<'_> {
    fn default() -> Self {
        Self { residual: DEFAULT_RESIDUAL, start: None, selection: Selection::Any, interrupt: None }
    }
}

impl SolveOptions<'_> {
    pub(crate) fn check(&self, problem: &ContactProblem) -> Result<(), ProblemError> {
        if !(self.residual > 0.0 && self.residual.is_finite()) {
            let (what, value) = ("the residual (m/s)", self.residual);
            return Err(ProblemError::OutOfRange { what, value, allowed: "above 0, and finite" });
        }
        if let Some(start) = self.start {
            length("impulses to start from", start.len(), problem.row_count())?;
            all_in_range("an impulse to start from", start)?;
        }
        Ok(())
    }
}

/// Solution, or the best point found.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Impulse p of every row (N s).
    pub impulses: Vec<f64>,
    /// Velocity u of every row (m/s).
    pub velocities: Vec<f64>,
    /// Velocity v of the global form; empty for the local form.
    pub body_velocities: Vec<f64>,
    /// Requested residual (m/s).
    pub asked: f64,
    /// Largest residual of a law (m/s), computed from the impulses only ([`Evaluation::residual`]).
    pub residual: f64,
    /// Relative error as defined by Siconos and FCLIB ([`Evaluation::relative_error`]).
    pub relative_error: f64,
    /// Iterations over all initial points and all parts.
    pub iterations: u64,
    /// Number of independent parts.
    pub parts: usize,
    /// Name of the initial point that led to the solution; the one of the first part that needed
    /// more than the first point.
    pub start: &'static str,
    /// True if it converged and every part is at the solution of the selection rule.
    pub selected: bool,
}

impl Solution {
    /// True if the residual is at most the requested one.
    pub fn is_solved(&self) -> bool {
        self.residual <= self.asked
    }

    /// Evaluates the same impulses in another problem with as many rows.
    pub(crate) fn evaluated_in(self, problem: &ContactProblem) -> Self {
        let Self { impulses, asked, iterations, parts, start, selected, .. } = self;
        let evaluation = problem.evaluate(&impulses);
        let found = Self::new(impulses, evaluation, asked);
        let selected = selected && found.is_solved();
        Self { iterations, parts, start, selected, ..found }
    }

    /// Creates a solution from impulses, without solver diagnostics.
    pub(crate) fn new(impulses: Vec<f64>, evaluation: Evaluation, asked: f64) -> Self {
        let Evaluation { velocities, body_velocities, residual, relative_error } = evaluation;
        Self {
            impulses,
            velocities,
            body_velocities,
            asked,
            residual,
            relative_error,
            iterations: 0,
            parts: 0,
            start: "none",
            selected: true,
        }
    }
}
