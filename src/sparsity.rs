//! Coordinate patterns of sparse matrices: where the entries stand, apart from
//! their values. The [step's program](crate::step_nlp) makes them, [Ipopt](crate::ipopt)
//! takes them.

/// The positions of a sparse matrix's structural non-zeros, 0-based, in the order
/// in which their values are stored.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SparsityPattern {
    rows: Vec<usize>,
    cols: Vec<usize>,
}

impl SparsityPattern {
    /// An empty pattern.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends the position (`row`, `col`).
    pub fn push(&mut self, row: usize, col: usize) {
        self.rows.push(row);
        self.cols.push(col);
    }

    /// The number of entries.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no entry.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The row of every entry.
    #[must_use]
    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// The column of every entry.
    #[must_use]
    pub fn cols(&self) -> &[usize] {
        &self.cols
    }

    /// The positions in storage order.
    pub fn positions(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.rows.iter().copied().zip(self.cols.iter().copied())
    }
}
