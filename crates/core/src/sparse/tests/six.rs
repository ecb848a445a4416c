//! Unit tests of `six.rs`.

use super::*;

/// Equality of bits with `nalgebra` for matrices with all pivots. The transposed system is
/// tested by its residual.
#[test]
fn six_by_six_factorisation_agrees_with_nalgebra() {
    let mut twister = rand_mt::Mt::new(7);
    let mut number = || f64::from(twister.next_u32()) / f64::from(u32::MAX) - 0.5;
    for round in 0..1000 {
        let mut matrix = Matrix6::from_fn(|_, _| number());
        if round % 3 == 0 {
            // Exact zeros, ties and infinite products.
            matrix.row_mut(round % 6).fill(0.25);
            matrix[(round % 5, round % 6)] = 0.0;
        }
        let b = Vector6::from_fn(|_, _| number());
        let library = matrix.lu();
        let Some(factors) = SixFactors::new(&matrix) else {
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
        // Condition numbers reach 1e5 with entries of order 1.
        assert!((matrix.tr_mul(&x) - b).amax() < 1e-13 * (1.0 + x.amax()));
    }
    assert!(SixFactors::new(&Matrix6::zeros()).is_none());
}
