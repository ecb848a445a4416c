//! What is asked of a solver of contact problems, and what it answers.

use super::error::{all_in_range, length};
use super::{ContactProblem, Evaluation, ProblemError};
use std::sync::atomic::AtomicBool;

/// The residual to which a problem is solved where nothing else is asked for, m/s.
pub const DEFAULT_RESIDUAL: f64 = 1e-9;

/// What is asked of a solve.
#[derive(Debug, Clone, Copy)]
pub struct SolveOptions<'a> {
    /// The largest [residual](Evaluation::residual) of what counts as solved, m/s.
    pub residual: f64,
    /// Impulses to start from; none of all where there are none.
    pub start: Option<&'a [f64]>,
    /// Which solution, where there are several.
    pub selection: Selection,
    /// Ends the solve with [`ProblemError::Interrupted`] when it is raised.
    pub interrupt: Option<&'a AtomicBool>,
}

/// Which solution, where there are several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Selection {
    /// The first that is found.
    #[default]
    Any,
    /// The limit of an equal, vanishing compliance at all groups (N6), the rule of `docs/native-solver.md`:
    /// of what sticks the impulses of the least norm. Another one is taken only where no start leads to
    /// that, and the solution [says so](Solution::selected).
    Compliance,
}

impl Default for SolveOptions<'_> {
    fn default() -> Self {
        Self { residual: DEFAULT_RESIDUAL, start: None, selection: Selection::Any, interrupt: None }
    }
}

impl SolveOptions<'_> {
    pub(super) fn check(&self, problem: &ContactProblem) -> Result<(), ProblemError> {
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

/// A solution, or the best point that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// p of every row, N s.
    pub impulses: Vec<f64>,
    /// u of every row, m/s.
    pub velocities: Vec<f64>,
    /// v of the global form; empty of the local one.
    pub body_velocities: Vec<f64>,
    /// The residual that was asked for, m/s.
    pub asked: f64,
    /// The largest miss of a law, m/s, found from the impulses alone ([`Evaluation::residual`]).
    pub residual: f64,
    /// The error that Siconos and FCLIB measure ([`Evaluation::relative_error`]).
    pub relative_error: f64,
    /// Iterations of all starts of all parts.
    pub iterations: u64,
    /// How many parts there are that have nothing to do with each other.
    pub parts: usize,
    /// The start that led to it, of the first part that needed another than the first start.
    pub start: &'static str,
    /// Whether it is solved, and every part is at the solution of the selection rule.
    pub selected: bool,
}

impl Solution {
    /// Whether the residual is what was asked for.
    #[must_use]
    pub fn is_solved(&self) -> bool {
        self.residual <= self.asked
    }

    /// The same impulses as a solution of another problem with as many rows.
    pub(super) fn of_problem(self, problem: &ContactProblem) -> Self {
        let Self { impulses, asked, iterations, parts, start, selected, .. } = self;
        let evaluation = problem.evaluate(&impulses);
        let found = Self::of(impulses, evaluation, asked);
        let selected = selected && found.is_solved();
        Self { iterations, parts, start, selected, ..found }
    }

    /// That of impulses, with nothing said of how they were found.
    pub(crate) fn of(impulses: Vec<f64>, evaluation: Evaluation, asked: f64) -> Self {
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
