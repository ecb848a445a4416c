//! Unit tests of `blocks.rs`.

use super::*;
use nalgebra::{DMatrix, DVector};

/// Several patterns with fixed random values, against a dense factorisation.
#[test]
fn the_solution_is_that_of_a_dense_system() {
    let patterns: [(usize, &[(usize, usize)]); 4] = [
        (1, &[]),
        (4, &[(0, 1), (2, 1), (3, 2), (1, 0)]),
        (5, &[(0, 1), (0, 2), (0, 3), (0, 4)]),
        (6, &[(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 0), (1, 4)]),
    ];
    let (mut pattern, mut system) = (Pattern::default(), BlockSystem::default());
    let mut twister = rand_mt::Mt::new(5);
    let mut number = || f64::from(twister.next_u32()) / f64::from(u32::MAX) - 0.5;
    for (bodies, pairs) in patterns {
        let mut dense = DMatrix::zeros(6 * bodies, 6 * bodies);
        pattern.set(bodies, pairs.iter().copied());
        system.begin(&pattern);
        let both = pairs.iter().flat_map(|&(i, j)| [(i, j), (j, i)]);
        for (i, j) in (0..bodies).map(|i| (i, i)).chain(both) {
            let mut block = Matrix6::from_fn(|_, _| number());
            if i == j {
                block += 4.0 * Matrix6::identity();
            }
            system.add(&pattern, i, j, &block);
            let mut view = dense.fixed_view_mut::<6, 6>(6 * i, 6 * j);
            view += block;
        }
        assert!(system.factorise(&pattern));
        let of_transposed = dense.transpose().lu();
        let factors = dense.lu();
        // Same factors for several right-hand sides in turn.
        for transposed in [false, true, false] {
            let mut values = vec![Vector6::zeros(); bodies];
            let mut rhs = DVector::zeros(6 * bodies);
            for i in 0..bodies {
                let part = Vector6::from_fn(|_, _| number());
                values[pattern.order.place(i)] = part;
                rhs.fixed_rows_mut::<6>(6 * i).copy_from(&part);
            }
            let expected = if transposed {
                system.solve::<true>(&pattern, &mut values);
                of_transposed.solve(&rhs).unwrap()
            } else {
                system.solve::<false>(&pattern, &mut values);
                factors.solve(&rhs).unwrap()
            };
            for i in 0..bodies {
                // Condition numbers are below 100.
                let apart = expected.fixed_rows::<6>(6 * i) - values[pattern.order.place(i)];
                assert!(apart.amax() < 1e-13, "{bodies} {i} {transposed}");
            }
        }
    }
}
