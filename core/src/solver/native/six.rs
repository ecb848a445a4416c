//! Blocks of six: their factors, and what is done with them.
//!
//! Everything goes down whole columns, so that it is done two numbers at a time; what lies beyond the triangle is zero
//! in the factors and changes nothing.

use nalgebra::{Matrix6, SMatrix, Vector6};

type Column = [f64; 6];

/// P A = L U of a block, with the largest number of each column as pivot.
#[derive(Debug, Clone)]
pub(super) struct Factors {
    /// The columns of L below its diagonal of ones, and of U above its own.
    lower: [Column; 6],
    upper: [Column; 6],
    diagonal: Column,
    /// The row that each row was exchanged with, one after the other.
    rows: [usize; 6],
}

/// y + a x.
#[inline(always)]
fn add(y: &mut Column, a: f64, x: &Column) {
    for k in 0..6 {
        y[k] += a * x[k];
    }
}

impl Factors {
    /// Those of `block`; `None` where it is singular.
    #[inline]
    pub(super) fn new(block: &Matrix6<f64>) -> Option<Self> {
        let mut a: [Column; 6] = block.data.0;
        let mut of =
            Self { lower: [[0.0; 6]; 6], upper: [[0.0; 6]; 6], diagonal: [0.0; 6], rows: [0; 6] };
        for i in 0..6 {
            let mut pivot = i;
            for k in i + 1..6 {
                if a[i][k].abs() > a[i][pivot].abs() {
                    pivot = k;
                }
            }
            of.rows[i] = pivot;
            if pivot != i {
                a[i..].iter_mut().for_each(|column| column.swap(i, pivot));
                of.lower[..i].iter_mut().for_each(|column| column.swap(i, pivot));
            }
            let diagonal = a[i][i];
            if diagonal == 0.0 {
                return None;
            }
            of.diagonal[i] = diagonal;
            let inverse = 1.0 / diagonal;
            let mut below = [0.0; 6];
            for k in i + 1..6 {
                below[k] = a[i][k] * inverse;
            }
            for column in &mut a[i + 1..] {
                let along = -column[i];
                add(column, along, &below);
            }
            of.lower[i] = below;
            of.upper[i][..i].copy_from_slice(&a[i][..i]);
        }
        Some(of)
    }

    /// A x = b, in the memory of b.
    #[inline(always)]
    pub(super) fn solve(&self, b: &mut Column) {
        for (k, &row) in self.rows.iter().enumerate() {
            b.swap(k, row);
        }
        for k in 0..5 {
            let along = -b[k];
            add(b, along, &self.lower[k]);
        }
        for k in (0..6).rev() {
            let x = b[k] / self.diagonal[k];
            b[k] = x;
            add(b, -x, &self.upper[k]);
        }
    }

    /// The same for every column of a block.
    #[inline]
    pub(super) fn solve_block<const C: usize>(&self, block: &mut SMatrix<f64, 6, C>) {
        block.data.0.iter_mut().for_each(|column| self.solve(column));
    }

    /// Aᵀ x = b: Uᵀ, then Lᵀ, then Pᵀ.
    pub(super) fn solve_transposed(&self, b: &mut Vector6<f64>) {
        let b = &mut b.data.0[0];
        let dot = |column: &Column, b: &Column| -> f64 { (0..6).map(|k| column[k] * b[k]).sum() };
        for k in 0..6 {
            b[k] = (b[k] - dot(&self.upper[k], b)) / self.diagonal[k];
        }
        for k in (0..6).rev() {
            b[k] -= dot(&self.lower[k], b);
        }
        for (k, &row) in self.rows.iter().enumerate().rev() {
            b.swap(k, row);
        }
    }
}

/// A − B C, in the memory of A.
#[inline]
pub(super) fn subtract_product(a: &mut Matrix6<f64>, b: &Matrix6<f64>, c: &Matrix6<f64>) {
    let b = &b.data.0;
    for (column, along) in a.data.0.iter_mut().zip(&c.data.0) {
        let mut product = [0.0; 6];
        for k in 0..6 {
            product[k] = b[0][k] * along[0];
        }
        for j in 1..6 {
            add(&mut product, along[j], &b[j]);
        }
        for k in 0..6 {
            column[k] -= product[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bits of `nalgebra`'s for matrices of all pivots; the transposed system by its residual.
    #[test]
    fn numbers_are_those_of_the_library() {
        let mut twister = rand_mt::Mt::new(7);
        let mut number = || f64::from(twister.next_u32()) / f64::from(u32::MAX) - 0.5;
        for round in 0..1000 {
            let mut matrix = Matrix6::from_fn(|_, _| number());
            if round % 3 == 0 {
                // Exact zeros, ties and infinities of products.
                matrix.row_mut(round % 6).fill(0.25);
                matrix[(round % 5, round % 6)] = 0.0;
            }
            let b = Vector6::from_fn(|_, _| number());
            let library = matrix.lu();
            let Some(factors) = Factors::new(&matrix) else {
                assert!(!library.is_invertible());
                continue;
            };
            let (mut mine, mut theirs) = (b, b);
            factors.solve(&mut mine.data.0[0]);
            assert!(library.solve_mut(&mut theirs));
            assert_eq!(mine.map(f64::to_bits), theirs.map(f64::to_bits));
            let mut block = matrix * 2.0;
            factors.solve_block(&mut block);
            let twice: Matrix6<f64> = block - Matrix6::identity() * 2.0;
            assert!(twice.amax() < 1e-9);
            let mut x = b;
            factors.solve_transposed(&mut x);
            // Of condition numbers up to 1e5 with numbers of 1.
            assert!((matrix.tr_mul(&x) - b).amax() < 1e-13 * (1.0 + x.amax()));
        }
        assert!(Factors::new(&Matrix6::zeros()).is_none());
    }
}
