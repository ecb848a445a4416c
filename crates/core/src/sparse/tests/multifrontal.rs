//! Unit tests of `multifrontal.rs`.

use super::*;
use nalgebra::{DMatrix, DVector};

/// Random patterns of nodes with one to six values, against a dense factorisation. Some columns
/// belong to an identity matrix.
#[test]
fn the_solution_is_that_of_a_dense_system() {
    let mut twister = rand_mt::Mt::new(7);
    let mut uniform = || f64::from(twister.next_u32()) / f64::from(u32::MAX);
    let mut fronts = Fronts::default();
    for (nodes, odds) in [(1, 0.0), (5, 0.5), (12, 0.2), (30, 0.1), (60, 0.05), (40, 1.0)] {
        let sizes: Vec<usize> = (0..nodes).map(|_| 1 + (6.0 * uniform()) as usize).collect();
        let mut pairs = Vec::new();
        for i in 0..nodes {
            for j in 0..i {
                if uniform() < odds {
                    pairs.push((i, j));
                }
            }
        }
        let plan = SymbolicFactorisation::new(&sizes, pairs.iter().copied());
        let size = plan.size();
        assert_eq!(size, sizes.iter().sum::<usize>());
        fronts.begin_unit(&plan);
        let mut dense = DMatrix::identity(size, size);
        let is_unit: Vec<bool> = (0..nodes).map(|_| uniform() < 0.3).collect();
        let both = pairs.iter().flat_map(|&(i, j)| [(i, j), (j, i)]);
        for (i, j) in (0..nodes).map(|i| (i, i)).chain(both).filter(|(_, j)| !is_unit[*j]) {
            let block: Vec<f64> = (0..sizes[i] * sizes[j]).map(|_| uniform() - 0.5).collect();
            let at = (plan.place(i), plan.place(j));
            fronts.add(&plan, at.0, at.1, sizes[i], &block);
            let mut view = dense.view_mut(at, (sizes[i], sizes[j]));
            view += DMatrix::from_column_slice(sizes[i], sizes[j], &block);
        }
        // A dominant diagonal makes pivots inside a front sufficient.
        for k in 0..size {
            let more = 0.5 * size as f64;
            fronts.add(&plan, k, k, 1, &[more]);
            dense[(k, k)] += more;
        }
        assert!(fronts.factorise(&plan));
        let rhs = DVector::from_fn(size, |_, _| uniform() - 0.5);
        let mut values = rhs.as_slice().to_vec();
        fronts.solve(&plan, &mut values, &mut Vec::new());
        let mut transposed = rhs.as_slice().to_vec();
        fronts.solve_transposed(&plan, &mut transposed);
        for (found, matrix) in [(values, dense.clone()), (transposed, dense.transpose())] {
            let expected = matrix.lu().solve(&rhs).unwrap();
            let apart = (DVector::from_vec(found) - expected).amax();
            assert!(apart < 1e-12, "{nodes} nodes: {apart}");
        }
    }
}

#[test]
fn singular_system_is_rejected() {
    let plan = SymbolicFactorisation::new(&[2, 2], [(0, 1)].into_iter());
    let mut fronts = Fronts::default();
    fronts.begin(&plan);
    assert!(!fronts.factorise(&plan));
}
