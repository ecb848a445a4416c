//! Sinks for the entries of a sparse matrix.

use crate::sparsity::SparsityPattern;
use nalgebra::SMatrix;

/// Receives a matrix entry by entry, always in the same order.
pub(super) trait EntrySink {
    /// Adds one structural non-zero.
    fn put(&mut self, row: usize, col: usize, value: f64);

    /// Adds `values` in one row, starting at column `col`.
    fn put_row(&mut self, row: usize, col: usize, values: impl IntoIterator<Item = f64>) {
        for (k, value) in values.into_iter().enumerate() {
            self.put(row, col + k, value);
        }
    }

    /// Adds the lower triangle of a diagonal block row by row, starting at (`first`, `first`).
    fn put_lower<const N: usize>(&mut self, first: usize, block: &SMatrix<f64, N, N>) {
        for k in 0..N {
            self.put_row(first + k, first, block.row(k).iter().take(k + 1).copied());
        }
    }
}

/// Sink that stores the positions.
#[derive(Default)]
pub(super) struct PatternSink(SparsityPattern);

impl PatternSink {
    /// Sparsity pattern of the entries that `emit` adds.
    pub(super) fn collect(emit: impl FnOnce(&mut Self)) -> SparsityPattern {
        let mut sink = Self::default();
        emit(&mut sink);
        sink.0
    }
}

impl EntrySink for PatternSink {
    fn put(&mut self, row: usize, col: usize, _value: f64) {
        self.0.push(row, col);
    }
}

/// Sink that stores the values.
pub(super) struct ValueSink<'a> {
    slots: std::slice::IterMut<'a, f64>,
}

impl<'a> ValueSink<'a> {
    pub(super) fn new(values: &'a mut [f64]) -> Self {
        Self { slots: values.iter_mut() }
    }
}

impl EntrySink for ValueSink<'_> {
    fn put(&mut self, _row: usize, _col: usize, value: f64) {
        if let Some(slot) = self.slots.next() {
            *slot = value;
        }
    }
}
