//! The program as Ipopt receives it: without its free rows.
//!
//! Ipopt treats clamped variables as parameters. For a row without a bound it would keep a slack
//! and a multiplier.

use crate::ipopt::{Bounds, IpoptProgress, NonlinearProgram};
use crate::sparsity::SparsityPattern;
use crate::step_nlp::StepNlp;
use std::sync::atomic::{AtomicBool, Ordering};

/// Rows with a bound, and their entries of the Jacobian.
pub(super) struct BoundRows {
    rows: Vec<usize>,
    pattern: SparsityPattern,
    /// Index of every entry of `pattern` in the program's.
    entries: Vec<usize>,
    /// Scratch memory for all rows and entries of the program.
    all_rows: Vec<f64>,
    all_entries: Vec<f64>,
}

impl BoundRows {
    /// Selects the rows of `nlp` that have a bound in `bounds`, and removes the other rows from
    /// `bounds`.
    pub(super) fn take(nlp: &StepNlp, bounds: &mut Bounds) -> Self {
        let Bounds { constraint_lower: lower, constraint_upper: upper, .. } = bounds;
        let has_bound = |row: usize| lower[row].is_finite() || upper[row].is_finite();
        let rows: Vec<_> = (0..lower.len()).filter(|&row| has_bound(row)).collect();
        let (mut pattern, mut entries) = (SparsityPattern::new(), Vec::new());
        for (entry, (row, col)) in nlp.jacobian_pattern().positions().enumerate() {
            if let Ok(row) = rows.binary_search(&row) {
                pattern.push(row, col);
                entries.push(entry);
            }
        }
        let (all_rows, all_entries) =
            (vec![0.0; lower.len()], vec![0.0; nlp.jacobian_pattern().len()]);
        for side in [lower, upper] {
            *side = rows.iter().map(|&row| side[row]).collect();
        }
        Self { rows, pattern, entries, all_rows, all_entries }
    }

    /// Indices of the rows, ascending.
    pub(super) fn rows(&self) -> &[usize] {
        &self.rows
    }
}

/// Program with the rows that have a bound, in the form of Ipopt's wrapper.
pub(super) struct BoundProgram<'a> {
    pub(super) nlp: &'a StepNlp,
    pub(super) rows: BoundRows,
    /// Ends the solve when set.
    pub(super) interrupt: Option<&'a AtomicBool>,
}

impl NonlinearProgram for BoundProgram<'_> {
    fn keep_going(&mut self, _progress: &IpoptProgress) -> bool {
        !self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    fn variable_count(&self) -> usize {
        self.nlp.layout().variables()
    }

    fn constraint_count(&self) -> usize {
        self.rows.rows.len()
    }

    fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.rows.pattern
    }

    fn hessian_pattern(&self) -> &SparsityPattern {
        self.nlp.hessian_pattern()
    }

    fn objective(&mut self, x: &[f64]) -> f64 {
        self.nlp.objective(x)
    }

    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        self.nlp.gradient(x, gradient);
    }

    fn constraints(&mut self, x: &[f64], constraints: &mut [f64]) {
        let BoundRows { rows, all_rows, .. } = &mut self.rows;
        self.nlp.constraints(x, all_rows);
        for (slot, &row) in constraints.iter_mut().zip(&*rows) {
            *slot = all_rows[row];
        }
    }

    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        let BoundRows { entries, all_entries, .. } = &mut self.rows;
        self.nlp.jacobian(x, all_entries);
        for (slot, &entry) in values.iter_mut().zip(&*entries) {
            *slot = all_entries[entry];
        }
    }

    fn hessian(
        &mut self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        values: &mut [f64],
    ) {
        let BoundRows { rows, all_rows, .. } = &mut self.rows;
        all_rows.fill(0.0);
        for (&row, multiplier) in rows.iter().zip(multipliers) {
            all_rows[row] = *multiplier;
        }
        self.nlp.hessian(x, objective_factor, all_rows, values);
    }
}
