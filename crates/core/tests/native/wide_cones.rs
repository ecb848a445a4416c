//! Contact problems with such large friction coefficients that a cone is almost a half-space.
//!
//! The problems are u = W p + q with Coulomb's law (`docs/contact-problem.md`). W maps impulses to
//! velocities, and q are the velocities without impulses. A contact has the rows n, t₁, t₂.

use nalgebra::{DMatrix, DVector};
use tumble_core::problem::{ContactProblem, Law, Solution, SolveOptions, SparseMatrix};
use tumble_core::simulation::random::Draws;

/// Random positive definite W and random q. Such a problem has a solution for any coefficients.
fn drawn(seed: u32, count: usize) -> (DMatrix<f64>, DVector<f64>) {
    let mut draws = Draws::new(seed);
    let mut signed = || 2.0 * draws.unit() - 1.0;
    let size = 3 * count;
    let root = DMatrix::from_fn(size, size, |_, _| signed());
    let response = &root * root.transpose() + DMatrix::identity(size, size) * 0.01;
    (response, DVector::from_fn(size, |_, _| 10.0 * signed()))
}

fn solve((response, free): &(DMatrix<f64>, DVector<f64>), friction: &[f64]) -> Solution {
    let size = free.len();
    let entries = (0..size).flat_map(|i| (0..size).map(move |j| (i, j)));
    let entries = entries.map(|(i, j)| (i, j, response[(i, j)]));
    let matrix = SparseMatrix::from_triplets(size, size, entries).unwrap();
    let laws = Law::contacts(3, friction).unwrap();
    let problem = ContactProblem::local(matrix, free.as_slice().to_vec(), laws).unwrap();
    problem.solve(&SolveOptions::default()).unwrap()
}

/// Largest violation of the law (m/s), computed without the solver.
///
/// It is the natural map of each contact, with the diagonal entries w of W as scales:
///
/// ```text
/// min(w_n p_n, u_n),   w_t p_t − proj(w_t p_t − u_t),   onto the disk of radius μ w_t p_n
/// ```
fn missed(
    (response, free): &(DMatrix<f64>, DVector<f64>),
    friction: &[f64],
    impulses: &[f64],
) -> f64 {
    let p = DVector::from_column_slice(impulses);
    let u = response * &p + free;
    let of = |contact: usize, mu: &f64| {
        let (p, u) = (p.fixed_rows::<3>(3 * contact), u.fixed_rows::<3>(3 * contact));
        let weight = |k: usize| response[(3 * contact + k, 3 * contact + k)];
        let (normal, across) = (weight(0), 0.5 * (weight(1) + weight(2)));
        let (along, slip) = (p.fixed_rows::<2>(1) * across, u.fixed_rows::<2>(1));
        let (wanted, most) = (along - slip, mu * across * p[0].max(0.0));
        let held = if wanted.norm() <= most { wanted } else { wanted.normalize() * most };
        (normal * p[0]).min(u[0]).abs().max((along - held).norm())
    };
    friction.iter().enumerate().map(|(contact, mu)| of(contact, mu)).fold(0.0, f64::max)
}

/// Checks friction coefficients up to 10⁵, as people write them where nothing should slip.
///
/// [`missed`] must confirm every result, solved or not. At most 3 problems with coefficients from
/// 10⁴ on may stay unsolved.
#[test]
fn wide_cones_are_solved() {
    let mut unsolved = 0;
    for seed in 0..80 {
        let count = 1 + seed as usize % 10;
        let problem = drawn(seed, count);
        let mixed = |contact: usize| [1e5, 0.3, 5.0, 0.0][(contact + seed as usize) % 4];
        let alike = [1.0, 10.0, 100.0, 1e3, 1e4, 1e5].map(|friction| vec![friction; count]);
        let mixed = (0..count).map(mixed).collect();
        for friction in alike.into_iter().chain([mixed]) {
            let found = solve(&problem, &friction);
            let missed = missed(&problem, &friction, &found.impulses);
            if friction[0] >= 1e4 && friction[count - 1] >= 1e4 && found.residual > 1e-9 {
                assert!(missed > 1e-9, "{seed} {friction:?}: {missed}");
                unsolved += 1;
                continue;
            }
            assert!(found.is_solved(), "{seed} {friction:?}: {}", found.residual);
            assert!(missed < 1e-8, "{seed} {friction:?}: {missed}");
        }
    }
    assert!(unsolved <= 3, "{unsolved}");
}

/// Checks coefficients of 10⁸: at least four of five problems are solved. The others are reported
/// as not converged, and their impulses violate the law at most as much as zero impulses do.
#[test]
fn widest_cones_are_solved_or_reported() {
    let mut solved = 0;
    for seed in 0..80 {
        let count = 1 + seed as usize % 10;
        let problem = drawn(seed, count);
        let friction = vec![1e8; count];
        let found = solve(&problem, &friction);
        let missed_by = missed(&problem, &friction, &found.impulses);
        assert_eq!(found.is_solved(), missed_by < 1e-8, "{seed}: {} {missed_by}", found.residual);
        let none = missed(&problem, &friction, &vec![0.0; 3 * count]);
        assert!(missed_by <= none, "{seed}: {missed_by} {none}");
        solved += usize::from(found.is_solved());
    }
    assert!(solved >= 64, "{solved} of 80");
}

/// Checks problems of which most have no solution: the reported residual is at most that of zero
/// impulses, and a point that is called solved obeys the law.
#[test]
#[ignore = "slow"]
fn best_point_is_at_least_as_good_as_zero_impulses() {
    let mut unsolved = 0;
    for seed in 0..20 {
        let (response, free) = drawn(seed, 4);
        // Impulses change only one row. The other contacts approach or slide for any impulses.
        let mut singular = response * 0.0;
        singular[(0, 0)] = 1.0;
        let friction = [1e6; 4];
        let problem = (singular, free);
        let found = solve(&problem, &friction);
        let none = missed(&problem, &friction, &[0.0; 12]);
        let missed_by = missed(&problem, &friction, &found.impulses);
        assert_eq!(found.is_solved(), missed_by < 1e-8, "{seed}: {missed_by}");
        assert!(found.residual <= none.max(1e-9), "{seed}: {} {none}", found.residual);
        unsolved += usize::from(!found.is_solved());
    }
    assert!(unsolved > 10, "{unsolved}");
}
