//! Contact problems with rolling and torsional resistance.

use nalgebra::{DMatrix, DVector};
use tumble_core::problem::{ContactProblem, Law, ProblemError, SolveOptions, SparseMatrix};

/// A contact and its moment by themselves: W = E, so that each law acts on its own rows. The limits are 0.2 and
/// 0.1 of a normal impulse of 2.
#[test]
fn moments_of_a_contact_problem() {
    let laws = |moment: Law| vec![Law::contact(3, 0.5).unwrap(), moment];
    let pose = |moment| {
        let response = SparseMatrix::from_triplets(6, 6, (0..6).map(|k| (k, k, 1.0))).unwrap();
        ContactProblem::local(response, vec![-2.0, 0.3, 0.0, 0.3, 0.4, -0.15], laws(moment))
    };
    let solution =
        pose(Law::moment(0, 0.2, 0.1).unwrap()).unwrap().solve(&SolveOptions::default()).unwrap();
    // Sliding stops, rolling keeps 0.5 − 0.4 along its direction, and spinning stops.
    let expected = [2.0, -0.3, 0.0, -0.24, -0.32, 0.15];
    assert!(solution.is_solved(), "{}", solution.residual);
    for (found, expected) in solution.impulses.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-9, "{:?}", solution.impulses);
    }
    // A moment of the wrong size has a residual.
    let wrong = pose(Law::moment(0, 0.2, 0.07).unwrap()).unwrap().evaluate(&expected);
    assert!((wrong.residual - 0.01).abs() < 1e-12, "{wrong:?}");
    assert!(matches!(
        pose(Law::moment(1, 0.2, 0.1).unwrap()),
        Err(ProblemError::OutOfRange { .. })
    ));
    assert!(Law::moment(0, -0.2, 0.1).is_err() && Law::moment(0, 0.2, f64::NAN).is_err());
}

/// Random contact problems with moments, W = A Aᵀ: all are solved, also those whose W is singular.
#[test]
fn random_contact_problems_with_moments() {
    let mut seed = 5_u64;
    let mut draw = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as f64 / f64::from(u32::MAX >> 1) - 0.5
    };
    for case in 0..500 {
        let contacts = 1 + case % 3;
        let (rows, columns) = (6 * contacts, 6 * contacts - case % 5);
        let by = DMatrix::from_fn(rows, columns, |_, _| draw());
        let response = &by * by.transpose();
        let places = (0..rows * rows).map(|k| (k % rows, k / rows));
        let entries = places.map(|(row, column)| (row, column, response[(row, column)]));
        let response = SparseMatrix::from_triplets(rows, rows, entries).unwrap();
        let mut laws: Vec<_> =
            (0..contacts).map(|_| Law::contact(3, 0.5 + 0.5 * draw()).unwrap()).collect();
        laws.extend(
            (0..contacts).map(|of| {
                Law::moment(of, (0.5 * draw()).max(0.0), (0.5 * draw()).max(0.0)).unwrap()
            }),
        );
        // In the range of W, so that there is a solution.
        let free = &by * DVector::from_fn(columns, |_, _| 2.0 * draw());
        let problem = ContactProblem::local(response, free.as_slice().to_vec(), laws).unwrap();
        let solution = problem.solve(&SolveOptions::default()).unwrap();
        assert!(solution.is_solved(), "{case} {}", solution.residual);
    }
}
