//! Sinks for the entries of a sparse matrix.

use crate::sparsity::SparsityPattern;
use nalgebra::SMatrix;
#[cfg(feature = "plan")]
use std::collections::HashMap;

/// Takes a matrix entry by entry, always in the same order.
pub(crate) trait EntrySink {
    /// One structural non-zero.
    fn put(&mut self, row: usize, col: usize, value: f64);

    /// `values` in one row, from the column `col` on.
    fn put_row(&mut self, row: usize, col: usize, values: impl IntoIterator<Item = f64>) {
        for (k, value) in values.into_iter().enumerate() {
            self.put(row, col + k, value);
        }
    }

    /// A block, row by row, whose first entry is that of `row` and `col`.
    fn put_block<const N: usize, const M: usize>(
        &mut self,
        (row, col): (usize, usize),
        block: &SMatrix<f64, N, M>,
    ) {
        for k in 0..N {
            self.put_row(row + k, col, block.row(k).iter().copied());
        }
    }

    /// One entry of a symmetric matrix of which the lower triangle is kept.
    #[cfg(feature = "plan")]
    fn put_symmetric(&mut self, i: usize, j: usize, value: f64) {
        self.put(i.max(j), i.min(j), value);
    }

    /// The lower triangle of a block on the diagonal, row by row, from `first` on.
    fn put_lower<const N: usize>(&mut self, first: usize, block: &SMatrix<f64, N, N>) {
        for k in 0..N {
            self.put_row(first + k, first, block.row(k).iter().take(k + 1).copied());
        }
    }
}

/// Keeps the positions.
#[derive(Default)]
pub(crate) struct PatternSink(SparsityPattern);

impl PatternSink {
    /// The pattern of what `emit` puts into a sink.
    pub(crate) fn of(emit: impl FnOnce(&mut Self)) -> SparsityPattern {
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

/// Keeps the values.
pub(crate) struct ValueSink<'a> {
    slots: std::slice::IterMut<'a, f64>,
}

impl<'a> ValueSink<'a> {
    pub(crate) fn new(values: &'a mut [f64]) -> Self {
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

/// A matrix whose entries come as sums: where a position is put more than once, its values are added.
/// Made of one sequence of entries, like its values.
#[cfg(feature = "plan")]
#[derive(Debug, Clone, Default)]
pub(crate) struct Summed {
    pattern: SparsityPattern,
    /// Of every entry of the sequence, which position it is of.
    slots: Vec<usize>,
    /// The sequence itself, so that a test can hold another one against it.
    #[cfg(test)]
    sequence: Vec<(usize, usize)>,
}

#[cfg(feature = "plan")]
impl Summed {
    /// The positions of what `emit` puts into a sink.
    pub(crate) fn of(emit: impl FnOnce(&mut PatternSink)) -> Self {
        let sequence = PatternSink::of(emit);
        let mut summed = Self::default();
        let mut known = HashMap::with_capacity(sequence.len());
        for (row, col) in sequence.positions() {
            let slot = *known.entry((row, col)).or_insert_with(|| {
                summed.pattern.push(row, col);
                summed.pattern.len() - 1
            });
            summed.slots.push(slot);
        }
        #[cfg(test)]
        summed.sequence.extend(sequence.positions());
        summed
    }

    /// Where entries can be, each position once.
    pub(crate) fn pattern(&self) -> &SparsityPattern {
        &self.pattern
    }

    /// Adds up what `emit` puts into a sink, in the order of the pattern.
    pub(crate) fn fill(&self, values: &mut [f64], emit: impl FnOnce(&mut SumSink<'_>)) {
        values.fill(0.0);
        emit(&mut SumSink { slots: self.slots.iter(), values });
    }

    /// Whether `emit` puts the same positions in the same order as when this was made.
    #[cfg(test)]
    pub(crate) fn is_of(&self, emit: impl FnOnce(&mut PatternSink)) -> bool {
        PatternSink::of(emit).positions().eq(self.sequence.iter().copied())
    }
}

/// Adds the values.
#[cfg(feature = "plan")]
pub(crate) struct SumSink<'a> {
    slots: std::slice::Iter<'a, usize>,
    values: &'a mut [f64],
}

#[cfg(feature = "plan")]
impl EntrySink for SumSink<'_> {
    fn put(&mut self, _row: usize, _col: usize, value: f64) {
        if let Some(&slot) = self.slots.next() {
            self.values[slot] += value;
        }
    }
}
