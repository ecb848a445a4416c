//! Coordinate patterns of sparse matrices: the positions of the entries without their values. The
//! [step's program](crate::step_nlp) creates them, and [Ipopt](crate::ipopt) uses them.

/// Positions of a sparse matrix's structural non-zeros, 0-based, in the storage order of the
/// values.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SparsityPattern {
    rows: Vec<usize>,
    cols: Vec<usize>,
}

impl SparsityPattern {
    /// Returns an empty pattern.
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends the position (`row`, `col`).
    pub fn push(&mut self, row: usize, col: usize) {
        self.rows.push(row);
        self.cols.push(col);
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// True if the pattern has no entry.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Row of every entry.
    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// Column of every entry.
    pub fn cols(&self) -> &[usize] {
        &self.cols
    }

    /// Positions in storage order.
    pub fn positions(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.rows.iter().copied().zip(self.cols.iter().copied())
    }
}
