//! Sparse matrices of a problem, in compressed column form.

use super::ProblemError;

/// Largest number of rows or columns. The memory of a column is allocated before its first entry.
const MOST: usize = 1 << 27;
/// Largest entry. Products of three entries, as in Hᵀ M⁻¹ H, stay finite.
pub(super) const LARGEST: f64 = 1e100;

/// Compressed sparse column matrix with ascending rows per column. Entries are unique and nonzero.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseMatrix {
    rows: usize,
    /// Start index of each column, and the total number of entries at the end.
    starts: Vec<usize>,
    indices: Vec<usize>,
    values: Vec<f64>,
}

impl SparseMatrix {
    /// Creates a matrix from entries (row, column, value) in any order. Duplicate entries are
    /// added.
    ///
    /// # Errors
    /// If there are more than 2²⁷ rows or columns, or if an entry is outside the matrix, is not
    /// finite, or exceeds 1e100 after the additions.
    pub fn from_triplets(
        rows: usize,
        columns: usize,
        entries: impl IntoIterator<Item = (usize, usize, f64)>,
    ) -> Result<Self, ProblemError> {
        for (what, count) in [
            ("the number of rows of a matrix", rows),
            ("the number of columns of a matrix", columns),
        ] {
            if count > MOST {
                let (value, allowed) = (count as f64, "up to 134217728");
                return Err(ProblemError::OutOfRange { what, value, allowed });
            }
        }
        let mut entries: Vec<_> = entries.into_iter().collect();
        for &(row, column, value) in &entries {
            if row >= rows || column >= columns {
                return Err(ProblemError::Entry { row, column, rows, columns });
            }
            if !value.is_finite() {
                return Err(ProblemError::NotFinite { what: "an entry of a matrix", value });
            }
        }
        // A stable sort, so that sums are taken in the order of the input.
        entries.sort_by_key(|&(row, column, _)| (column, row));
        // Duplicates are neighbours now, and are added.
        let mut merged: Vec<(usize, usize, f64)> = Vec::with_capacity(entries.len());
        for entry in entries {
            match merged.last_mut() {
                Some(last) if (last.0, last.1) == (entry.0, entry.1) => last.2 += entry.2,
                _ => merged.push(entry),
            }
        }
        for &(.., value) in &merged {
            if value.is_nan() || value.abs() > LARGEST {
                let what = "an entry of a matrix";
                let allowed = "magnitudes up to 1e100";
                return Err(ProblemError::OutOfRange { what, value, allowed });
            }
        }
        merged.retain(|entry| entry.2 != 0.0);
        // First entry of each column, by cumulative counts.
        let mut starts = vec![0; columns + 1];
        for &(_, column, _) in &merged {
            starts[column + 1] += 1;
        }
        for column in 0..columns {
            starts[column + 1] += starts[column];
        }
        Ok(Self {
            rows,
            starts,
            indices: merged.iter().map(|entry| entry.0).collect(),
            values: merged.iter().map(|entry| entry.2).collect(),
        })
    }

    /// Creates a matrix from all entries of a dense matrix in row-major order.
    ///
    /// # Errors
    /// If the number of entries is not `rows` × `columns`, or if an entry is not finite.
    pub fn from_rows(rows: usize, columns: usize, entries: &[f64]) -> Result<Self, ProblemError> {
        if rows.checked_mul(columns) != Some(entries.len()) {
            let what = "entries of a dense matrix";
            return Err(ProblemError::Length {
                what,
                given: entries.len(),
                wanted: rows.saturating_mul(columns),
            });
        }
        let entry = |place: usize| (place / columns, place % columns, entries[place]);
        Self::from_triplets(rows, columns, (0..entries.len()).map(entry))
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of nonzero entries.
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// Entries (row, value) of a column with ascending rows; empty for a column that does not
    /// exist.
    pub fn column(&self, column: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = match self.starts.get(column..column + 2) {
            Some(ends) => ends[0]..ends[1],
            None => 0..0,
        };
        range.map(|at| (self.indices[at], self.values[at]))
    }

    /// All entries (row, column, value), column by column.
    pub fn triplets(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        (0..self.columns())
            .flat_map(|column| self.column(column).map(move |(row, value)| (row, column, value)))
    }

    /// Entry at (`row`, `column`).
    pub fn at(&self, row: usize, column: usize) -> f64 {
        let Some(ends) = self.starts.get(column..column + 2) else { return 0.0 };
        let rows = &self.indices[ends[0]..ends[1]];
        rows.binary_search(&row).map_or(0.0, |at| self.values[ends[0] + at])
    }

    /// Adds the product of the matrix and `x` to `to`.
    pub(crate) fn add_product(&self, x: &[f64], to: &mut [f64]) {
        for (column, factor) in x.iter().enumerate().filter(|(_, factor)| **factor != 0.0) {
            for (row, value) in self.column(column) {
                to[row] += value * factor;
            }
        }
    }

    /// Adds the product of the transposed matrix and `x` to `to`.
    pub(crate) fn add_transposed_product(&self, x: &[f64], to: &mut [f64]) {
        for (column, sum) in to.iter_mut().enumerate() {
            *sum += self.column(column).map(|(row, value)| value * x[row]).sum::<f64>();
        }
    }

    /// Largest |A_ij|; 0 for an empty matrix.
    pub(super) fn largest(&self) -> f64 {
        self.values.iter().fold(0.0, |most, value| most.max(value.abs()))
    }

    /// Largest |A_ij − A_ji| divided by the largest |A_ij|, and its row and column.
    pub(crate) fn asymmetry(&self) -> (f64, usize, usize) {
        let largest = self.largest();
        let mut worst = (0.0, 0, 0);
        for (row, column, value) in self.triplets() {
            let apart = (value - self.at(column, row)).abs() / largest;
            if apart > worst.0 {
                worst = (apart, row, column);
            }
        }
        worst
    }
}

#[cfg(test)]
#[path = "tests/matrix.rs"]
mod tests;
