//! The 6 × 6 systems of one body: P A = L U by rows' largest entries.
//!
//! The same operations in the same order as `nalgebra`'s LU, whose numbers it has to the last bit, in half of
//! its instructions: the length of every loop is known where it is compiled.

use nalgebra::{Matrix6, Vector6};

const N: usize = 6;

/// An invertible matrix, factorised.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lu {
    /// By columns: U, and L below its diagonal of ones.
    columns: [[f64; N]; N],
    /// The row that each row was exchanged with in its turn: itself or a later one.
    exchanged: [usize; N],
}

impl Lu {
    /// `None` for a matrix with a pivot of exactly zero.
    #[inline]
    pub(super) fn new(matrix: &Matrix6<f64>) -> Option<Self> {
        let mut lu = Self { columns: matrix.data.0, exchanged: [0; N] };
        let invertible = lu.eliminate::<0>()
            && lu.eliminate::<1>()
            && lu.eliminate::<2>()
            && lu.eliminate::<3>()
            && lu.eliminate::<4>()
            && lu.eliminate::<5>();
        invertible.then_some(lu)
    }

    /// Column `I`, with the largest entry at or below its diagonal as the pivot; `false` where that is zero.
    #[inline(always)]
    fn eliminate<const I: usize>(&mut self) -> bool {
        let mut pivot = I;
        for row in I + 1..N {
            if self.columns[I][row].abs() > self.columns[I][pivot].abs() {
                pivot = row;
            }
        }
        self.exchanged[I] = pivot;
        if pivot != I {
            self.columns.iter_mut().for_each(|column| column.swap(I, pivot));
        }
        let diagonal = self.columns[I][I];
        if diagonal == 0.0 {
            return false;
        }
        let inverse = 1.0 / diagonal;
        for row in I + 1..N {
            self.columns[I][row] *= inverse;
        }
        let lower = self.columns[I];
        for column in &mut self.columns[I + 1..] {
            for row in I + 1..N {
                column[row] -= lower[row] * column[I];
            }
        }
        true
    }

    /// A x = b, in the memory of b.
    #[inline]
    pub(super) fn solve(&self, b: &mut [f64; N]) {
        for (row, &other) in self.exchanged.iter().enumerate() {
            b.swap(row, other);
        }
        for i in 0..N {
            for row in i + 1..N {
                b[row] -= self.columns[i][row] * b[i];
            }
        }
        for i in (0..N).rev() {
            b[i] /= self.columns[i][i];
            for row in 0..i {
                b[row] -= self.columns[i][row] * b[i];
            }
        }
    }

    /// A X = B, in the memory of B.
    #[inline]
    pub(super) fn solve_block(&self, block: &mut Matrix6<f64>) {
        block.data.0.iter_mut().for_each(|column| self.solve(column));
    }

    /// Aᵀ x = b: Uᵀ, then Lᵀ, then Pᵀ.
    pub(super) fn solve_transposed(&self, b: &mut Vector6<f64>) {
        for i in 0..N {
            let known: f64 = (0..i).map(|row| self.columns[i][row] * b[row]).sum();
            b[i] = (b[i] - known) / self.columns[i][i];
        }
        for i in (0..N).rev() {
            let known: f64 = (i + 1..N).map(|row| self.columns[i][row] * b[row]).sum();
            b[i] -= known;
        }
        for (row, &other) in self.exchanged.iter().enumerate().rev() {
            b.swap_rows(row, other);
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
            let Some(lu) = Lu::new(&matrix) else {
                assert!(!library.is_invertible());
                continue;
            };
            let (mut mine, mut theirs) = (b, b);
            lu.solve(&mut mine.data.0[0]);
            assert!(library.solve_mut(&mut theirs));
            assert_eq!(mine.map(f64::to_bits), theirs.map(f64::to_bits));
            let mut block = matrix * 2.0;
            lu.solve_block(&mut block);
            let twice: Matrix6<f64> = block - Matrix6::identity() * 2.0;
            assert!(twice.amax() < 1e-9);
            let mut x = b;
            lu.solve_transposed(&mut x);
            // Of condition numbers up to 1e5 with numbers of 1.
            assert!((matrix.tr_mul(&x) - b).amax() < 1e-13 * (1.0 + x.amax()));
        }
        assert!(Lu::new(&Matrix6::zeros()).is_none());
    }
}
