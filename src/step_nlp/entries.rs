//! Sinks for the entries of a sparse matrix.

use crate::sparsity::SparsityPattern;

/// Takes a matrix entry by entry, always in the same order.
pub(super) trait EntrySink {
    /// One structural non-zero.
    fn put(&mut self, row: usize, col: usize, value: f64);
}

/// Keeps the positions.
#[derive(Default)]
pub(super) struct PatternSink(pub(super) SparsityPattern);

impl EntrySink for PatternSink {
    fn put(&mut self, row: usize, col: usize, _value: f64) {
        self.0.push(row, col);
    }
}

/// Keeps the values.
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
