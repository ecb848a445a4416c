//! LU factors of 6 × 6 blocks and operations on them.
//!
//! The results equal `nalgebra`'s LU bit by bit, with less than half of the instructions.

use nalgebra::{Matrix6, SMatrix, Vector6};

type SixColumn = [f64; 6];

/// P A = L U of a block, with column pivoting by magnitude.
#[derive(Debug, Clone)]
pub(crate) struct SixFactors {
    /// Columns of U, and L below its unit diagonal.
    columns: [SixColumn; 6],
    /// Row exchanged with each row, in sequence.
    rows: [usize; 6],
}

/// y + a x.
#[inline(always)]
fn add(y: &mut SixColumn, a: f64, x: &SixColumn) {
    for k in 0..6 {
        y[k] += a * x[k];
    }
}

impl SixFactors {
    /// Factors of `block`. `None` if it is singular.
    #[inline]
    pub(crate) fn new(block: &Matrix6<f64>) -> Option<Self> {
        let mut of = Self { columns: block.data.0, rows: [0; 6] };
        let invertible = of.eliminate::<0>()
            && of.eliminate::<1>()
            && of.eliminate::<2>()
            && of.eliminate::<3>()
            && of.eliminate::<4>()
            && of.eliminate::<5>();
        invertible.then_some(of)
    }

    /// Eliminates column `I`, with the largest entry on or below the diagonal as pivot. Returns
    /// false if it is zero. Loop lengths are known at compile time.
    #[inline(always)]
    fn eliminate<const I: usize>(&mut self) -> bool {
        let mut pivot = I;
        for k in I + 1..6 {
            if self.columns[I][k].abs() > self.columns[I][pivot].abs() {
                pivot = k;
            }
        }
        self.rows[I] = pivot;
        if pivot != I {
            self.columns.iter_mut().for_each(|column| column.swap(I, pivot));
        }
        let diagonal = self.columns[I][I];
        if diagonal == 0.0 {
            return false;
        }
        let inverse = 1.0 / diagonal;
        for k in I + 1..6 {
            self.columns[I][k] *= inverse;
        }
        let lower = self.columns[I];
        for column in &mut self.columns[I + 1..] {
            for k in I + 1..6 {
                column[k] -= lower[k] * column[I];
            }
        }
        true
    }

    /// Solves A x = b in the memory of b.
    #[inline(always)]
    pub(crate) fn solve(&self, b: &mut SixColumn) {
        for (k, &row) in self.rows.iter().enumerate() {
            b.swap(k, row);
        }
        for i in 0..6 {
            for k in i + 1..6 {
                b[k] -= self.columns[i][k] * b[i];
            }
        }
        for i in (0..6).rev() {
            b[i] /= self.columns[i][i];
            for k in 0..i {
                b[k] -= self.columns[i][k] * b[i];
            }
        }
    }

    /// Solves for all columns of a block at once.
    #[inline]
    pub(super) fn solve_block<const C: usize>(&self, block: &mut SMatrix<f64, 6, C>) {
        let mut places = [0, 1, 2, 3, 4, 5];
        for (k, &row) in self.rows.iter().enumerate() {
            places.swap(k, row);
        }
        let columns = &mut block.data.0;
        let mut rows = places.map(|place| columns.each_ref().map(|column| column[place]));
        for i in 0..6 {
            let known = rows[i];
            (i + 1..6).for_each(|k| {
                (0..C).for_each(|c| rows[k][c] -= self.columns[i][k] * known[c]);
            });
        }
        for i in (0..6).rev() {
            rows[i].iter_mut().for_each(|entry| *entry /= self.columns[i][i]);
            let known = rows[i];
            (0..i).for_each(|k| {
                (0..C).for_each(|c| rows[k][c] -= self.columns[i][k] * known[c]);
            });
        }
        for (c, column) in columns.iter_mut().enumerate() {
            *column = rows.each_ref().map(|row| row[c]);
        }
    }

    /// Solves Aᵀ x = b: Uᵀ, then Lᵀ, then Pᵀ.
    pub(super) fn solve_transposed(&self, b: &mut Vector6<f64>) {
        let b = &mut b.data.0[0];
        for i in 0..6 {
            let known: f64 = (0..i).map(|k| self.columns[i][k] * b[k]).sum();
            b[i] = (b[i] - known) / self.columns[i][i];
        }
        for i in (0..6).rev() {
            b[i] -= (i + 1..6).map(|k| self.columns[i][k] * b[k]).sum::<f64>();
        }
        for (k, &row) in self.rows.iter().enumerate().rev() {
            b.swap(k, row);
        }
    }
}

/// Computes A − B C in the memory of A.
#[inline]
pub(super) fn subtract_product<const C: usize>(
    a: &mut SMatrix<f64, 6, C>,
    b: &Matrix6<f64>,
    c: &SMatrix<f64, 6, C>,
) {
    let b = &b.data.0;
    for (column, along) in a.data.0.iter_mut().zip(&c.data.0) {
        let mut product = b[0].map(|entry| entry * along[0]);
        add(&mut product, along[1], &b[1]);
        add(&mut product, along[2], &b[2]);
        add(&mut product, along[3], &b[3]);
        add(&mut product, along[4], &b[4]);
        add(&mut product, along[5], &b[5]);
        for k in 0..6 {
            column[k] -= product[k];
        }
    }
}

#[cfg(test)]
#[path = "tests/six.rs"]
mod tests;
