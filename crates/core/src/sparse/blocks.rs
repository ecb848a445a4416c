//! Sparse linear system of 6 × 6 blocks, one block row per body and one off-diagonal block pair per
//! coupled pair of bodies.
//!
//! The [pattern](Pattern) is symmetric, the values are not. Pivoting is restricted to a body's own
//! block. It suffices in practice, because the block contains the body's mass and all springs
//! acting on it. A singular pivot block makes the whole system count as singular.
//!
//! Large eliminations use the multifrontal [solver](super::multifrontal), with the same pattern and order
//! and with pivoting inside a front.

use super::multifrontal::Fronts;
use super::pattern::Pattern;
use super::six::{SixFactors, subtract_product};
use super::symbolic::SymbolicFactorisation;
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector6};

/// Matrix, overwritten with its factors by [`BlockSystem::factorise`]:
///
/// ```text
/// M = (D + L) (E + D⁻¹ U)
/// ```
///
/// D are the pivot blocks, L the blocks below them and U those above.
#[derive(Debug, Clone, Default)]
pub(crate) struct BlockSystem {
    diagonal: Vec<Matrix6<f64>>,
    /// Factors of each block of D.
    pivots: Vec<SixFactors>,
    /// Blocks (place, later) and (later, place), by their index in the pattern. After factorisation
    /// D⁻¹ U and L.
    upper: Vec<Matrix6<f64>>,
    lower: Vec<Matrix6<f64>>,
    /// Replaces the fields above if the pattern has a front plan.
    fronts: Fronts,
    numbers: Vec<f64>,
    behind: Vec<f64>,
    /// Cached blocks of the fronts with row and column. Contacts of the same bodies follow each
    /// other.
    open: [(usize, usize, Matrix6<f64>); OPEN],
    opened: usize,
}

/// Number of blocks of two bodies.
const OPEN: usize = 4;

impl BlockSystem {
    /// Resets the matrix to zero, with this pattern.
    pub(crate) fn begin(&mut self, pattern: &Pattern) {
        if let Some(plan) = pattern.plan() {
            self.opened = 0;
            return self.fronts.begin(plan);
        }
        self.diagonal.clear();
        self.diagonal.resize(pattern.order.len(), Matrix6::zeros());
        self.upper.clear();
        self.upper.resize(pattern.order.blocks(), Matrix6::zeros());
        self.lower.clear();
        self.lower.resize(pattern.order.blocks(), Matrix6::zeros());
    }

    /// Adds to the block (row, column), which the pattern must contain.
    pub(crate) fn add(
        &mut self,
        pattern: &Pattern,
        row: usize,
        column: usize,
        block: &Matrix6<f64>,
    ) {
        *self.block_of(pattern, row, column) += block;
    }

    /// Adds to the last three rows and columns of the block (row, column).
    pub(crate) fn add_turning(
        &mut self,
        pattern: &Pattern,
        row: usize,
        column: usize,
        turning: &Matrix3<f64>,
    ) {
        let block = self.block_of(pattern, row, column);
        for (to, from) in block.data.0[3..].iter_mut().zip(&turning.data.0) {
            (0..3).for_each(|i| to[3 + i] += from[i]);
        }
    }

    /// Returns the block (row, column) for accumulation. The pattern must contain it.
    pub(crate) fn block_of(
        &mut self,
        pattern: &Pattern,
        row: usize,
        column: usize,
    ) -> &mut Matrix6<f64> {
        let Some(plan) = pattern.plan() else {
            return self.block(pattern, pattern.order.place(row), pattern.order.place(column));
        };
        let known =
            self.open[..self.opened].iter().position(|open| (open.0, open.1) == (row, column));
        let place = known.unwrap_or_else(|| {
            if self.opened == OPEN {
                self.close(plan);
            }
            let block = self.fronts.block(plan, plan.place(row), plan.place(column));
            self.open[self.opened] = (row, column, block);
            self.opened += 1;
            self.opened - 1
        });
        &mut self.open[place].2
    }

    /// Writes the cached blocks back.
    fn close(&mut self, plan: &SymbolicFactorisation) {
        for (row, column, block) in &self.open[..self.opened] {
            self.fronts.set_block(plan, plan.place(*row), plan.place(*column), block);
        }
        self.opened = 0;
    }

    /// Block at two places of the elimination order.
    fn block(&mut self, pattern: &Pattern, row: usize, column: usize) -> &mut Matrix6<f64> {
        match row.cmp(&column) {
            std::cmp::Ordering::Equal => &mut self.diagonal[row],
            std::cmp::Ordering::Less => &mut self.upper[pattern.order.find(row, column)],
            std::cmp::Ordering::Greater => &mut self.lower[pattern.order.find(column, row)],
        }
    }

    /// Factorises the matrix. Returns false if a pivot block is singular.
    pub(crate) fn factorise(&mut self, pattern: &Pattern) -> bool {
        if let Some(plan) = pattern.plan() {
            self.close(plan);
            return self.fronts.factorise(plan);
        }
        let Self { diagonal, pivots, upper, lower, .. } = self;
        pivots.clear();
        for (pivot, row) in (0..pattern.order.len()).map(|pivot| (pivot, pattern.order.row(pivot)))
        {
            let Some(factors) = SixFactors::new(&diagonal[pivot]) else { return false };
            // Updates affect later rows only.
            let (upper, later_upper) = upper.split_at_mut(row.end);
            let (lower, later_lower) = lower.split_at_mut(row.end);
            for upper in &mut upper[row.clone()] {
                factors.solve_block(upper);
            }
            pivots.push(factors);
            let mut updated = pattern.order.updated(pivot);
            for i in row.clone() {
                subtract_product(&mut diagonal[pattern.order.column(i)], &lower[i], &upper[i]);
                for (j, block) in (i + 1..row.end).zip(&mut updated) {
                    let later = block - row.end;
                    subtract_product(&mut later_upper[later], &lower[i], &upper[j]);
                    subtract_product(&mut later_lower[later], &lower[j], &upper[i]);
                }
            }
        }
        true
    }

    /// Solves the factorised system, or its transpose, in place. The right-hand side is in
    /// elimination order.
    pub(crate) fn solve<const TRANSPOSED: bool>(
        &mut self,
        pattern: &Pattern,
        values: &mut [Vector6<f64>],
    ) {
        // Multifrontal factors have their own order of the numbers.
        if let Some(plan) = pattern.plan() {
            let Self { fronts, numbers, behind, .. } = self;
            numbers.resize(plan.size(), 0.0);
            let places = |body: usize| (plan.place(body), pattern.order.place(body));
            for (to, from) in (0..pattern.order.len()).map(places) {
                numbers[to..to + 6].copy_from_slice(values[from].as_slice());
            }
            if TRANSPOSED {
                fronts.solve_transposed(plan, numbers);
            } else {
                fronts.solve(plan, numbers, behind);
            }
            for (from, to) in (0..pattern.order.len()).map(places) {
                values[to].copy_from_slice(&numbers[from..from + 6]);
            }
            return;
        }
        if TRANSPOSED {
            self.solve_transposed(pattern, values);
            return;
        }
        // Forward substitution, then backward
        for (pivot, factors) in self.pivots.iter().enumerate() {
            factors.solve(&mut values[pivot].data.0[0]);
            let value = values[pivot];
            for i in pattern.order.row(pivot) {
                values[pattern.order.column(i)] -= self.lower[i] * value;
            }
        }
        for pivot in (0..pattern.order.len()).rev() {
            let mut value = values[pivot];
            for i in pattern.order.row(pivot) {
                value -= self.upper[i] * values[pattern.order.column(i)];
            }
            values[pivot] = value;
        }
    }

    /// Solves the factorised system in place for several right-hand sides, in elimination order.
    pub(crate) fn solve_all<const C: usize>(
        &mut self,
        pattern: &Pattern,
        values: &mut [SMatrix<f64, 6, C>],
    ) {
        if let Some(plan) = pattern.plan() {
            let Self { fronts, numbers, behind, .. } = self;
            numbers.resize(plan.size() * C, 0.0);
            let numbers = numbers.as_chunks_mut().0;
            let places = |body: usize| (plan.place(body), pattern.order.place(body));
            for (to, from) in (0..pattern.order.len()).map(places) {
                for (row, to) in numbers[to..to + 6].iter_mut().enumerate() {
                    *to = std::array::from_fn(|k| values[from][(row, k)]);
                }
            }
            fronts.solve_all::<C>(plan, numbers, behind);
            for (from, to) in (0..pattern.order.len()).map(places) {
                for (row, from) in numbers[from..from + 6].iter().enumerate() {
                    (0..C).for_each(|k| values[to][(row, k)] = from[k]);
                }
            }
            return;
        }
        // Leading zero blocks remain zero.
        let first = values.iter().position(|value| *value != SMatrix::<f64, 6, C>::zeros());
        let first = first.unwrap_or(values.len());
        for (pivot, factors) in self.pivots.iter().enumerate().skip(first) {
            factors.solve_block(&mut values[pivot]);
            let value = values[pivot];
            for i in pattern.order.row(pivot) {
                subtract_product(&mut values[pattern.order.column(i)], &self.lower[i], &value);
            }
        }
        // Backward substitution
        for pivot in (0..pattern.order.len()).rev() {
            let mut value = values[pivot];
            for i in pattern.order.row(pivot) {
                subtract_product(&mut value, &self.upper[i], &values[pattern.order.column(i)]);
            }
            values[pivot] = value;
        }
    }

    /// Solves Mᵀ x = b: first (E + D⁻¹ U)ᵀ, then (D + L)ᵀ.
    fn solve_transposed(&self, pattern: &Pattern, values: &mut [Vector6<f64>]) {
        for pivot in 0..pattern.order.len() {
            let value = values[pivot];
            for i in pattern.order.row(pivot) {
                values[pattern.order.column(i)] -= self.upper[i].tr_mul(&value);
            }
        }
        for (pivot, factors) in self.pivots.iter().enumerate().rev() {
            let mut value = values[pivot];
            for i in pattern.order.row(pivot) {
                value -= self.lower[i].tr_mul(&values[pattern.order.column(i)]);
            }
            factors.solve_transposed(&mut value);
            values[pivot] = value;
        }
    }
}

#[cfg(test)]
#[path = "tests/blocks.rs"]
mod tests;
