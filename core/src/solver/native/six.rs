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
    /// The row of A that each row of P A is.
    order: [usize; 6],
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
        let nothing = [[0.0; 6]; 6];
        let order = [0, 1, 2, 3, 4, 5];
        let mut of = Self { lower: nothing, upper: nothing, diagonal: [1.0; 6], order };
        let is_regular = of.eliminate::<0>(&mut a)
            && of.eliminate::<1>(&mut a)
            && of.eliminate::<2>(&mut a)
            && of.eliminate::<3>(&mut a)
            && of.eliminate::<4>(&mut a)
            && of.eliminate::<5>(&mut a);
        is_regular.then_some(of)
    }

    /// Takes column I out of those behind it; `false` where there is no pivot.
    #[inline(always)]
    fn eliminate<const I: usize>(&mut self, a: &mut [Column; 6]) -> bool {
        let mut pivot = I;
        for k in I + 1..6 {
            if a[I][k].abs() > a[I][pivot].abs() {
                pivot = k;
            }
        }
        if pivot != I {
            a[I..].iter_mut().for_each(|column| column.swap(I, pivot));
            self.lower[..I].iter_mut().for_each(|column| column.swap(I, pivot));
            self.order.swap(I, pivot);
        }
        let diagonal = a[I][I];
        self.diagonal[I] = diagonal;
        let inverse = 1.0 / diagonal;
        let mut below = [0.0; 6];
        for k in I + 1..6 {
            below[k] = a[I][k] * inverse;
        }
        for column in &mut a[I + 1..] {
            let along = -column[I];
            add(column, along, &below);
        }
        self.lower[I] = below;
        self.upper[I][..I].copy_from_slice(&a[I][..I]);
        diagonal != 0.0
    }

    /// A x = b, in the memory of b.
    #[inline(always)]
    pub(super) fn solve(&self, b: &mut Column) {
        let mut x = self.order.map(|row| b[row]);
        let down = |k: usize, x: &mut Column| add(x, -x[k], &self.lower[k]);
        let up = |k: usize, x: &mut Column| {
            x[k] /= self.diagonal[k];
            add(x, -x[k], &self.upper[k]);
        };
        // One by one, so that they stay in registers.
        down(0, &mut x);
        down(1, &mut x);
        down(2, &mut x);
        down(3, &mut x);
        down(4, &mut x);
        up(5, &mut x);
        up(4, &mut x);
        up(3, &mut x);
        up(2, &mut x);
        up(1, &mut x);
        up(0, &mut x);
        *b = x;
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
        let turned = *b;
        for (&row, x) in self.order.iter().zip(turned) {
            b[row] = x;
        }
    }
}

/// A − B C, in the memory of A.
#[inline]
pub(super) fn subtract_product(a: &mut Matrix6<f64>, b: &Matrix6<f64>, c: &Matrix6<f64>) {
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
