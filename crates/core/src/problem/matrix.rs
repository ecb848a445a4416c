//! Sparse matrices as a problem gives them: columns of entries.

use super::ProblemError;

/// The most rows, and the most columns: what a column takes is there before its first entry.
const MOST: usize = 1 << 27;
/// The largest entry: three of them in a row, as in Hᵀ M⁻¹ H, are still numbers.
pub(super) const LARGEST: f64 = 1e100;

/// A matrix by its entries, column after column, rows rising within a column. No entry comes twice and
/// none is zero.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseMatrix {
    rows: usize,
    /// Where each column begins; one more at the end.
    starts: Vec<usize>,
    indices: Vec<usize>,
    values: Vec<f64>,
}

impl SparseMatrix {
    /// From entries (row, column, value) in any order; of entries at one place the sum counts.
    ///
    /// # Errors
    /// More than 2²⁷ rows or columns; an entry outside of the matrix; one that is not finite, or, added up, larger than 1e100.
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
        // Stable: a sum is taken in the order in which its parts were given.
        entries.sort_by_key(|&(row, column, _)| (column, row));
        let mut merged: Vec<(usize, usize, f64)> = Vec::with_capacity(entries.len());
        for entry in entries {
            match merged.last_mut() {
                Some(last) if (last.0, last.1) == (entry.0, entry.1) => last.2 += entry.2,
                _ => merged.push(entry),
            }
        }
        for &(.., value) in &merged {
            if value.is_nan() || value.abs() > LARGEST {
                let (what, allowed) = ("an entry of a matrix", "up to 1e100 in size");
                return Err(ProblemError::OutOfRange { what, value, allowed });
            }
        }
        merged.retain(|entry| entry.2 != 0.0);
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

    /// From all entries of a dense matrix, row after row.
    ///
    /// # Errors
    /// Not `rows` × `columns` of them, or one that is not finite.
    pub fn from_rows(rows: usize, columns: usize, entries: &[f64]) -> Result<Self, ProblemError> {
        if rows.checked_mul(columns) != Some(entries.len()) {
            let what = "entries of a dense matrix";
            return Err(ProblemError::Length {
                what,
                given: entries.len(),
                wanted: rows.saturating_mul(columns),
            });
        }
        let of = |place: usize| (place / columns, place % columns, entries[place]);
        Self::from_triplets(rows, columns, (0..entries.len()).map(of))
    }

    /// How many rows it has.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// How many columns it has.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.starts.len() - 1
    }

    /// How many entries are not zero.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// The entries (row, value) of a column, rows rising; none of a column that is not there.
    pub fn column(&self, column: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = match self.starts.get(column..column + 2) {
            Some(ends) => ends[0]..ends[1],
            None => 0..0,
        };
        range.map(|at| (self.indices[at], self.values[at]))
    }

    /// All entries (row, column, value), column after column.
    pub fn triplets(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        (0..self.columns())
            .flat_map(|column| self.column(column).map(move |(row, value)| (row, column, value)))
    }

    /// The entry at a place.
    #[must_use]
    pub fn at(&self, row: usize, column: usize) -> f64 {
        let Some(ends) = self.starts.get(column..column + 2) else { return 0.0 };
        let rows = &self.indices[ends[0]..ends[1]];
        rows.binary_search(&row).map_or(0.0, |at| self.values[ends[0] + at])
    }

    /// Adds the matrix times `x` to `to`.
    pub(crate) fn add_product(&self, x: &[f64], to: &mut [f64]) {
        for (column, factor) in x.iter().enumerate().filter(|(_, factor)| **factor != 0.0) {
            for (row, value) in self.column(column) {
                to[row] += value * factor;
            }
        }
    }

    /// Adds the transposed matrix times `x` to `to`.
    pub(crate) fn add_transposed_product(&self, x: &[f64], to: &mut [f64]) {
        for (column, sum) in to.iter_mut().enumerate() {
            *sum += self.column(column).map(|(row, value)| value * x[row]).sum::<f64>();
        }
    }

    /// The largest |A_ij|; 0 of none.
    pub(super) fn largest(&self) -> f64 {
        self.values.iter().fold(0.0, |most, value| most.max(value.abs()))
    }

    /// The largest |A_ij − A_ji| over the largest |A_ij|, and where it is.
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
mod tests {
    use super::*;

    #[test]
    fn entries_are_sorted_and_summed() {
        let entries = [(1, 1, 4.0), (0, 0, 1.0), (1, 0, 2.0), (1, 1, -1.0), (0, 1, 0.0)];
        let matrix = SparseMatrix::from_triplets(2, 2, entries).unwrap();
        assert_eq!(matrix, SparseMatrix::from_rows(2, 2, &[1.0, 0.0, 2.0, 3.0]).unwrap());
        assert_eq!(matrix.entries(), 3);
        assert_eq!(matrix.at(1, 0), 2.0);
        assert_eq!(matrix.at(7, 9), 0.0);
        let mut product = [0.0; 2];
        matrix.add_product(&[1.0, 2.0], &mut product);
        assert_eq!(product, [1.0, 8.0]);
        let mut product = [0.0; 2];
        matrix.add_transposed_product(&[1.0, 2.0], &mut product);
        assert_eq!(product, [5.0, 6.0]);
        assert_eq!(matrix.asymmetry(), (2.0 / 3.0, 1, 0));
    }

    #[test]
    fn what_is_outside_or_not_finite_is_refused() {
        assert!(SparseMatrix::from_triplets(2, 2, [(2, 0, 1.0)]).is_err());
        assert!(SparseMatrix::from_triplets(2, 2, [(0, 0, f64::NAN)]).is_err());
        assert!(SparseMatrix::from_rows(2, 2, &[1.0; 3]).is_err());
    }
}
