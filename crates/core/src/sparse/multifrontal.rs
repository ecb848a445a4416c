//! Multifrontal solver of a sparse linear system with nodes of any size, along a [plan](SymbolicFactorisation).
//!
//! The pattern is symmetric, the values are not. Dense kernels work on contiguous columns. Pivoting
//! is restricted to a front's own rows.

use super::dense::{FrontView, PackedBlocks};
use super::symbolic::{RowRun, SymbolicFactorisation};
use nalgebra::Matrix6;

/// Values of a system with a [`SymbolicFactorisation`], overwritten with their factors by
/// [`Fronts::factorise`].
#[derive(Debug, Clone, Default)]
pub(crate) struct Fronts {
    /// Columns of all fronts with all their rows. `up` has each front's own rows in the columns
    /// behind.
    low: Vec<f64>,
    up: Vec<f64>,
    swaps: Vec<usize>,
    /// Contribution blocks not yet assembled, and the one of the current front.
    stack: Vec<f64>,
    rest: Vec<f64>,
    packed: PackedBlocks,
}

impl Fronts {
    /// Sets an identity matrix.
    pub(crate) fn begin_unit(&mut self, plan: &SymbolicFactorisation) {
        self.begin(plan);
        for front in &plan.fronts {
            for k in 0..front.own {
                self.low[front.low + k * front.rows() + k] = 1.0;
            }
        }
    }

    /// Sets a zero matrix.
    pub(crate) fn begin(&mut self, plan: &SymbolicFactorisation) {
        self.low.clear();
        self.low.resize(plan.entries.0, 0.0);
        self.up.clear();
        self.up.resize(plan.entries.1, 0.0);
        self.swaps.clear();
        self.swaps.resize(plan.size(), 0);
    }

    /// Adds a block with `rows` rows at the places `row` and `column` of the plan. Its values are
    /// column-major.
    pub(crate) fn add(
        &mut self,
        plan: &SymbolicFactorisation,
        row: usize,
        column: usize,
        rows: usize,
        block: &[f64],
    ) {
        let (first, stride, to) = self.at(plan, row, column);
        for (k, column) in block.chunks_exact(rows).enumerate() {
            let to = &mut to[first + k * stride..][..rows];
            to.iter_mut().zip(column).for_each(|(entry, value)| *entry += value);
        }
    }

    /// Storage of a block at the places `row` and `column`: first index, column stride and list.
    fn at(
        &mut self,
        plan: &SymbolicFactorisation,
        row: usize,
        column: usize,
    ) -> (usize, usize, &mut [f64]) {
        let front = &plan.fronts[plan.front_of[row.min(column)]];
        if front.numbers().contains(&column) {
            let first = (column - front.begin) * front.rows() + plan.within(front, row);
            (first, front.rows(), &mut self.low[front.columns()])
        } else {
            let behind = plan.within(front, column) - front.own;
            (behind * front.own + row - front.begin, front.own, &mut self.up[front.across()])
        }
    }

    /// Reads a 6 × 6 block at places of the plan.
    pub(super) fn block(
        &mut self,
        plan: &SymbolicFactorisation,
        row: usize,
        column: usize,
    ) -> Matrix6<f64> {
        let (first, stride, from) = self.at(plan, row, column);
        let mut block = Matrix6::zeros();
        for (k, column) in block.data.0.iter_mut().enumerate() {
            column.copy_from_slice(&from[first + k * stride..][..6]);
        }
        block
    }

    /// Overwrites a 6 × 6 block at places of the plan.
    pub(super) fn set_block(
        &mut self,
        plan: &SymbolicFactorisation,
        row: usize,
        column: usize,
        block: &Matrix6<f64>,
    ) {
        let (first, stride, to) = self.at(plan, row, column);
        for (k, column) in block.data.0.iter().enumerate() {
            to[first + k * stride..][..6].copy_from_slice(column);
        }
    }

    /// Factorises the matrix. Returns false if a front is singular.
    pub(crate) fn factorise(&mut self, plan: &SymbolicFactorisation) -> bool {
        let Self { low, up, swaps, stack, rest, packed } = self;
        stack.clear();
        for front in &plan.fronts {
            let behind = front.behind();
            rest.clear();
            rest.resize(behind * behind, 0.0);
            let mut view = FrontView {
                low: &mut low[front.columns()],
                up: &mut up[front.across()],
                own: front.own,
                behind,
                swaps: &mut swaps[front.numbers()],
            };
            // The last child is on top of the stack.
            for &child in front.children.iter().rev() {
                let size = plan.fronts[child].behind();
                let runs = plan.fronts[child].runs;
                let left = stack.len() - size * size;
                view.assemble(rest, &stack[left..], size, &plan.runs[runs.0..runs.1]);
                stack.truncate(left);
            }
            if !view.factorise(packed) {
                return false;
            }
            view.subtract_from(rest, packed);
            stack.extend_from_slice(rest);
        }
        true
    }

    /// Solves the factorised system in place, for a right-hand side by place. `behind` is scratch
    /// for the rows behind a front.
    pub(crate) fn solve(
        &self,
        plan: &SymbolicFactorisation,
        values: &mut [f64],
        behind: &mut Vec<f64>,
    ) {
        self.solve_all::<1>(plan, values.as_chunks_mut().0, behind);
    }

    /// Solves for C right-hand sides at once. The values of a place are contiguous.
    pub(crate) fn solve_all<const C: usize>(
        &self,
        plan: &SymbolicFactorisation,
        values: &mut [[f64; C]],
        behind: &mut Vec<f64>,
    ) {
        #[inline(always)]
        fn subtract<const C: usize>(from: &mut [f64; C], factor: f64, value: &[f64; C]) {
            from.iter_mut().zip(value).for_each(|(entry, value)| *entry -= factor * value);
        }
        let is_nothing = |value: &[f64; C]| value.iter().all(|number| *number == 0.0);
        let Self { low, up, swaps, .. } = self;
        // Forward: each front eliminates its own numbers from those behind it. Zeros are skipped.
        for front in &plan.fronts {
            let low = &low[front.columns()];
            for (pivot, swap) in swaps[front.numbers()].iter().enumerate() {
                values.swap(front.begin + pivot, front.begin + swap);
            }
            let list = &plan.behind[front.list.0..front.list.1];
            behind.clear();
            behind.extend(list.iter().flat_map(|place| values[*place]));
            let behind = behind.as_chunks_mut::<C>().0;
            for (k, column) in low.chunks_exact(front.rows()).enumerate() {
                let value = values[front.begin + k];
                if is_nothing(&value) {
                    continue;
                }
                let own = values[front.begin + k + 1..][..front.own - k - 1].iter_mut();
                own.zip(&column[k + 1..])
                    .for_each(|(entry, factor)| subtract(entry, *factor, &value));
                let left = behind.iter_mut().zip(&column[front.own..]);
                left.for_each(|(entry, factor)| subtract(entry, *factor, &value));
            }
            list.iter().zip(&*behind).for_each(|(place, value)| values[*place] = *value);
        }
        // Backward: the numbers behind a front are known.
        for front in plan.fronts.iter().rev() {
            let (low, up) = (&low[front.columns()], &up[front.across()]);
            let list = &plan.behind[front.list.0..front.list.1];
            for (place, column) in list.iter().zip(up.chunks_exact(front.own)) {
                let value = values[*place];
                if !is_nothing(&value) {
                    let own = values[front.numbers()].iter_mut();
                    own.zip(column).for_each(|(entry, factor)| subtract(entry, *factor, &value));
                }
            }
            for (k, column) in low.chunks_exact(front.rows()).enumerate().rev() {
                let value = values[front.begin + k].map(|number| number / column[k]);
                values[front.begin + k] = value;
                let above = values[front.begin..front.begin + k].iter_mut();
                above.zip(column).for_each(|(entry, factor)| subtract(entry, *factor, &value));
            }
        }
    }
}

impl Fronts {
    /// Solves the transposed system: transposed forward and backward passes in reverse order.
    pub(super) fn solve_transposed(&self, plan: &SymbolicFactorisation, values: &mut [f64]) {
        for front in &plan.fronts {
            let (low, up) = (&self.low[front.columns()], &self.up[front.across()]);
            for (k, column) in low.chunks_exact(front.rows()).enumerate() {
                let own = &values[front.begin..front.begin + k];
                let known: f64 = own.iter().zip(column).map(|(value, factor)| value * factor).sum();
                values[front.begin + k] = (values[front.begin + k] - known) / column[k];
            }
            let list = &plan.behind[front.list.0..front.list.1];
            for (place, column) in list.iter().zip(up.chunks_exact(front.own)) {
                let own = values[front.numbers()].iter().zip(column);
                let known: f64 = own.map(|(value, factor)| value * factor).sum();
                values[*place] -= known;
            }
        }
        for front in plan.fronts.iter().rev() {
            let low = &self.low[front.columns()];
            let list = &plan.behind[front.list.0..front.list.1];
            for (k, column) in low.chunks_exact(front.rows()).enumerate().rev() {
                let own = values[front.begin + k + 1..][..front.own - k - 1].iter();
                let inside: f64 =
                    own.zip(&column[k + 1..]).map(|(value, factor)| value * factor).sum();
                let behind = list.iter().zip(&column[front.own..]);
                let outside: f64 = behind.map(|(place, factor)| values[*place] * factor).sum();
                values[front.begin + k] -= inside + outside;
            }
            for (pivot, swap) in self.swaps[front.numbers()].iter().enumerate().rev() {
                values.swap(front.begin + pivot, front.begin + swap);
            }
        }
    }
}

impl FrontView<'_> {
    /// Adds a child's contribution block of order `size` to the front, and to `rest` behind it.
    fn assemble(&mut self, rest: &mut [f64], left: &[f64], size: usize, runs: &[RowRun]) {
        let (own, rows) = (self.own, self.own + self.behind);
        for columns in runs {
            for k in 0..columns.count {
                let column = &left[(columns.from + k) * size..][..size];
                let to = columns.to + k;
                for run in runs {
                    let target = if to < own {
                        &mut self.low[to * rows + run.to..]
                    } else if run.to < own {
                        &mut self.up[(to - own) * own + run.to..]
                    } else {
                        &mut rest[(to - own) * self.behind + run.to - own..]
                    };
                    let part = &column[run.from..run.from + run.count];
                    let target = target[..run.count].iter_mut().zip(part);
                    target.for_each(|(entry, value)| *entry += value);
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "tests/multifrontal.rs"]
mod tests;
