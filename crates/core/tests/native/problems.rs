//! Stand-alone contact problems with extreme numbers: sizes, sums, small and large units, wide
//! bounds.

use tumble_core::problem::{
    ContactProblem, Law, ProblemError, RowLaw, Solution, SolveOptions, SparseMatrix,
};

fn times_unit(size: usize, factor: f64) -> SparseMatrix {
    SparseMatrix::from_triplets(size, size, (0..size).map(|k| (k, k, factor))).unwrap()
}

fn solved(problem: &ContactProblem) -> Solution {
    problem.solve(&SolveOptions::default()).unwrap()
}

/// Rows, columns, entries, and words of the error message.
type Refused<'a> = (usize, usize, &'a [(usize, usize, f64)], &'a str);

#[test]
fn oversized_matrices_are_rejected() {
    let large = 1.7e308;
    let cases: [Refused<'_>; 6] = [
        (3, 1 << 62, &[(0, 0, 1.0)], "columns"),
        (3, usize::MAX, &[], "columns"),
        (usize::MAX, 3, &[(0, 0, 1.0)], "rows"),
        (3, 3, &[(0, 0, large), (0, 0, large)], "inf"),
        (3, 3, &[(0, 0, large), (0, 0, large), (0, 0, -large)], "inf"),
        (3, 3, &[(1, 1, 1e101)], "1e100"),
    ];
    for (rows, columns, entries, words) in cases {
        let refused = SparseMatrix::from_triplets(rows, columns, entries.iter().copied());
        let refused = refused.unwrap_err().to_string();
        assert!(refused.contains(words), "{rows} {columns} {entries:?}: {refused}");
    }
    // Summands may be larger than the sum, and small entries besides others are accepted.
    let sum = [(0, 0, 1.0), (0, 0, 2e99), (0, 0, -2e99), (1, 1, 1e-170)];
    assert!(SparseMatrix::from_triplets(2, 2, sum).is_ok());
}

/// A mass in other units: W = w E, q = s (−1, 0.3, 0) with μ = 0.5 has p = −q/w. Units beyond the
/// range are rejected.
#[test]
fn problems_in_extreme_units_are_solved_or_rejected() {
    let posed = |w: f64, s: f64| {
        let q = vec![-s, 0.3 * s, 0.0];
        ContactProblem::local(times_unit(3, w), q, vec![Law::contact(3, 0.5).unwrap()])
    };
    for (w, s) in [(1e-90, 1.0), (1e90, 1.0), (1e-60, 1e-60), (1.0, 1e-12), (1e60, 1e20)] {
        let problem = posed(w, s).unwrap();
        let asked = SolveOptions { residual: 1e-9 * s, ..SolveOptions::default() };
        let found = problem.solve(&asked).unwrap();
        assert!(found.is_solved(), "{w} {s}: {found:?}");
        for (p, q) in found.impulses.iter().zip([-1.0, 0.3, 0.0]) {
            assert!((p * w / s + q).abs() < 1e-8, "{w} {s}: {found:?}");
        }
    }
    for (w, s, words) in [(1e-170, 1.0, "W"), (1.0, 1e200, "q"), (1e-101, 1e-300, "W")] {
        let refused = posed(w, s).unwrap_err().to_string();
        assert!(refused.contains(words) && refused.contains("1e100"), "{w} {s}: {refused}");
    }
    let tiny = times_unit(3, 1e-170);
    let law = || vec![Law::contact(3, 0.5).unwrap()];
    let global = |m, h| ContactProblem::global(m, h, vec![-1.0, 0.0, 0.0], vec![0.0; 3], law());
    let refused = global(tiny, times_unit(3, 1.0)).unwrap_err();
    assert!(matches!(refused, ProblemError::OutOfRange { .. }), "{refused}");
    // Zero is valid: these rows do not respond to impulses.
    assert!(ContactProblem::local(times_unit(3, 0.0), vec![1.0, 0.0, 0.0], law()).is_ok());
}

/// A row held by an impulse between bounds is solved equally well for any distant bounds. W = E and
/// q = (−1, 2, 3) have p = (1, 0, −3), and the number of iterations is that of narrow bounds.
#[test]
fn wide_bounds_hold_as_narrow_ones_do() {
    let bounded = |least: f64, most: f64| {
        let rows = vec![RowLaw::Box { least, most }, RowLaw::Limit, RowLaw::Locked];
        let laws = vec![Law::rows_of(rows).unwrap()];
        let problem =
            ContactProblem::local(times_unit(3, 1.0), vec![-1.0, 2.0, 3.0], laws).unwrap();
        solved(&problem)
    };
    let narrow = bounded(-10.0, 10.0);
    for (least, most) in
        [(-1e3, 1e3), (-1e6, 1e6), (-1e9, 1e9), (-1e12, 1e12), (-1e100, 1e100), (-1.0, 1e15)]
    {
        let found = bounded(least, most);
        assert!(found.is_solved(), "{least} {most}: {found:?}");
        assert!(found.iterations <= narrow.iterations + 3, "{least} {most}: {found:?}");
        for (p, expected) in found.impulses.iter().zip([1.0, 0.0, -3.0]) {
            assert!((p - expected).abs() < 1e-9, "{least} {most}: {found:?}");
        }
    }
    // An active bound far from the other one is met exactly.
    let brake = bounded(-1e12, 0.5);
    assert!((brake.impulses[0] - 0.5).abs() < 1e-12 && (brake.velocities[0] + 0.5).abs() < 1e-12);
    assert!(Law::rows_of(vec![RowLaw::Box { least: -1e101, most: 0.0 }]).is_err());
}

/// A problem that did not converge is not marked as selected: two masses on each other with large
/// ratios.
#[test]
fn unsolved_problem_is_not_marked_selected() {
    let mut unsolved = 0;
    for ratio in [1e6, 1e8, 1e9, 1e10, 1e11, 1e12] {
        for (low, high) in [(1.0, ratio), (ratio, 1.0), (1.0 / ratio, 1.0)] {
            let mass = (0..6).map(|k| (k, k, if k < 3 { low } else { high }));
            let mass = SparseMatrix::from_triplets(6, 6, mass).unwrap();
            let own = (0..3).flat_map(|k| [(k, k, 1.0), (k, k + 3, -1.0), (k + 3, k + 3, 1.0)]);
            let directions = SparseMatrix::from_triplets(6, 6, own).unwrap();
            let f = [low, high].map(|m| [-0.1 * m, 0.02 * m, 0.0]).concat();
            let laws = Law::contacts(3, &[0.5, 0.5]).unwrap();
            let problem = ContactProblem::global(mass, directions, f, vec![0.0; 6], laws).unwrap();
            let found = solved(&problem);
            unsolved += usize::from(!found.is_solved());
            assert!(found.is_solved() || !found.selected, "{low} {high}: {found:?}");
        }
    }
    assert!((1..=8).contains(&unsolved), "{unsolved} of 18 unsolved");
}
