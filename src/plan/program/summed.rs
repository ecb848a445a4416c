//! Matrices whose entries come as sums.

use crate::sparsity::SparsityPattern;
use crate::step_nlp::entries::{EntrySink, PatternSink};
use std::collections::HashMap;

/// A matrix whose entries come as sums: where a position is put more than once, its values are added.
/// Made of one sequence of entries, like its values.
#[derive(Debug, Clone, Default)]
pub(super) struct Summed {
    pattern: SparsityPattern,
    /// Of every entry of the sequence, which position it is of.
    slots: Vec<usize>,
    /// The sequence itself, so that a test can hold another one against it.
    #[cfg(test)]
    sequence: Vec<(usize, usize)>,
}

impl Summed {
    /// The positions of what `emit` puts into a sink.
    pub(super) fn of(emit: impl FnOnce(&mut PatternSink)) -> Self {
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
    pub(super) fn pattern(&self) -> &SparsityPattern {
        &self.pattern
    }

    /// Adds up what `emit` puts into a sink, in the order of the pattern.
    pub(super) fn fill(&self, values: &mut [f64], emit: impl FnOnce(&mut SumSink<'_>)) {
        values.fill(0.0);
        emit(&mut SumSink { slots: self.slots.iter(), values });
    }

    /// Whether `emit` puts the same positions in the same order as when this was made.
    #[cfg(test)]
    pub(super) fn is_of(&self, emit: impl FnOnce(&mut PatternSink)) -> bool {
        PatternSink::of(emit).positions().eq(self.sequence.iter().copied())
    }
}

/// Adds the values.
pub(super) struct SumSink<'a> {
    slots: std::slice::Iter<'a, usize>,
    values: &'a mut [f64],
}

impl EntrySink for SumSink<'_> {
    fn put(&mut self, _row: usize, _col: usize, value: f64) {
        if let Some(&slot) = self.slots.next() {
            self.values[slot] += value;
        }
    }
}
