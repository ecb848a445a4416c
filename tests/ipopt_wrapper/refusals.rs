//! Input that is refused before Ipopt runs, with errors that name the fault.

use super::probe::{solve, solve_with, solver};
use super::problems::{Problem, hs006, hs035, hs071, pattern};
use tumble::ipopt::{Bounds, IpoptError, Options, RawSolver, StartPoint};
use tumble::sparsity::SparsityPattern;

const NAN: f64 = f64::NAN;
const INF: f64 = f64::INFINITY;

#[test]
fn options_out_of_range_are_refused_by_ipopts_name() {
    let d = Options::default;
    let mut table = Vec::new();
    for tolerance in [0.0, -0.0, -1.0, 1.0, 2.0, NAN, INF, -INF] {
        table.push(("tol", Options { tolerance, ..d() }));
    }
    for initial_barrier in [0.0, -0.1, 1.1e6, NAN, INF] {
        table.push(("mu_init", Options { initial_barrier, ..d() }));
    }
    for bound_push in [0.0, -0.1, 0.6, NAN, INF] {
        table.push(("bound_push", Options { bound_push, ..d() }));
    }
    for max_iterations in [1_000_001, u32::MAX] {
        table.push(("max_iter", Options { max_iterations, ..d() }));
    }
    // 1 is an order given by the user, which nobody sets, so that every solve fails. 4 is PORD,
    // which ends the process on small problems.
    for mumps_pivot_order in [1, 4, 8, u32::MAX] {
        table.push(("mumps_pivot_order", Options { mumps_pivot_order, ..d() }));
    }
    for mumps_memory_percent in [10_001, u32::MAX] {
        table.push(("mumps_mem_percent", Options { mumps_memory_percent, ..d() }));
    }
    for min_refinement_steps in [11, u32::MAX] {
        table.push(("min_refinement_steps", Options { min_refinement_steps, ..d() }));
    }
    for (expected, options) in table {
        let validated = options.validate();
        let Err(refusal) = RawSolver::new(&hs071(), options.clone()).map(|_| ()) else {
            panic!("{options:?} is accepted");
        };
        assert!(matches!(&refusal, IpoptError::Option { name, .. } if *name == expected));
        assert!(refusal.to_string().starts_with(&format!("Ipopt option {expected} is ")));
        // Compared as text, because NaN differs from itself.
        assert_eq!(validated.unwrap_err().to_string(), refusal.to_string());
    }
    assert_eq!(d().validate(), Ok(()));
}

#[test]
fn empty_bounds_are_rejected_with_their_index() {
    let problem = hs071();
    let mut solver = solver(&problem);
    let healthy = solve(&problem).bits();
    // Crossed, NaN on either side or both, infinite on the wrong side.
    let empty = [
        (2.0, 1.0),
        (1.0, 1.0 - 1e-15),
        (NAN, 1.0),
        (1.0, NAN),
        (NAN, NAN),
        (INF, INF),
        (-INF, -INF),
        (INF, -INF),
    ];
    for (low, high) in empty {
        let mut bounds = problem.bounds.clone();
        (bounds.lower[2], bounds.upper[2]) = (low, high);
        assert_bounds_refused(&mut solver, &problem, &bounds, "variable bounds", 2);
        let mut bounds = problem.bounds.clone();
        (bounds.constraint_lower[1], bounds.constraint_upper[1]) = (low, high);
        assert_bounds_refused(&mut solver, &problem, &bounds, "constraint bounds", 1);
    }
    assert_eq!(solve_with(&mut solver, &problem).bits(), healthy);
}

fn assert_bounds_refused(
    solver: &mut RawSolver,
    problem: &Problem,
    bounds: &Bounds,
    expected: &str,
    at: usize,
) {
    let start = StartPoint::Cold { x: &problem.start };
    let refusal = solver.solve(&mut problem.clone(), bounds, &start).unwrap_err();
    assert!(
        matches!(&refusal, IpoptError::Bounds { what, index, .. } if *what == expected && *index == at),
        "{refusal}"
    );
    assert!(refusal.to_string().starts_with(&format!("{expected}: entry {at} ")), "{refusal}");
}

#[test]
fn arrays_of_the_wrong_length_are_refused_by_name() {
    let problem = hs071();
    let mut solver = solver(&problem);
    let mut refusal_of = |bounds: &Bounds, start: &StartPoint<'_>| {
        solver.solve(&mut problem.clone(), bounds, start).unwrap_err()
    };
    let good = StartPoint::Cold { x: &problem.start };
    type Field = fn(&mut Bounds) -> &mut Vec<f64>;
    let fields: [(&'static str, usize, Field); 4] = [
        ("variable bounds", 4, |bounds| &mut bounds.lower),
        ("variable bounds", 4, |bounds| &mut bounds.upper),
        ("constraint bounds", 2, |bounds| &mut bounds.constraint_lower),
        ("constraint bounds", 2, |bounds| &mut bounds.constraint_upper),
    ];
    for (what, expected, field) in fields {
        for found in [0, expected - 1, expected + 1] {
            let mut bounds = problem.bounds.clone();
            field(&mut bounds).resize(found, 1.0);
            let refusal = refusal_of(&bounds, &good);
            assert_eq!(refusal, IpoptError::Length { what, expected, found });
        }
    }
    for found in [0, 3, 5] {
        let x = vec![1.0; found];
        let refusal = refusal_of(&problem.bounds, &StartPoint::Cold { x: &x });
        assert_eq!(refusal, IpoptError::Length { what: "start point", expected: 4, found });
    }
    let names = ["start point", "constraint multipliers", "lower bound multipliers"];
    for (which, what) in names.into_iter().chain(["upper bound multipliers"]).enumerate() {
        let expected = [4, 2, 4, 4][which];
        for found in [0, expected - 1, expected + 1] {
            let mut arrays = [vec![1.0; 4], vec![1.0; 2], vec![1.0; 4], vec![1.0; 4]];
            arrays[which].resize(found, 1.0);
            let refusal = refusal_of(&problem.bounds, &warm(&arrays));
            assert_eq!(refusal, IpoptError::Length { what, expected, found });
        }
    }
}

fn warm(arrays: &[Vec<f64>; 4]) -> StartPoint<'_> {
    let [x, constraint_multipliers, lower_multipliers, upper_multipliers] = arrays;
    StartPoint::Warm { x, constraint_multipliers, lower_multipliers, upper_multipliers }
}

#[test]
fn starts_that_are_not_finite_are_refused_with_their_index() {
    let problem = hs071();
    let mut solver = solver(&problem);
    let names = [
        "start point",
        "constraint multipliers",
        "lower bound multipliers",
        "upper bound multipliers",
    ];
    for value in [NAN, INF, -INF] {
        for (which, name) in names.into_iter().enumerate() {
            let mut arrays = [vec![1.0; 4], vec![1.0; 2], vec![1.0; 4], vec![1.0; 4]];
            arrays[which][1] = value;
            let mut starts = vec![warm(&arrays)];
            if which == 0 {
                starts.push(StartPoint::Cold { x: &arrays[0] });
            }
            for start in starts {
                let result = solver.solve(&mut problem.clone(), &problem.bounds, &start);
                let refusal = result.unwrap_err();
                assert!(
                    matches!(&refusal, IpoptError::NotFinite { what, index: 1, .. } if *what == name),
                    "{refusal}"
                );
            }
        }
    }
    assert_eq!(solve_with(&mut solver, &problem).bits(), solve(&problem).bits());
}

#[test]
fn a_pattern_with_an_impossible_entry_is_refused_with_its_position() {
    let (outside, above, twice) =
        ("is outside the matrix", "is above the diagonal", "is listed twice");
    // HS035 has three variables and one constraint.
    type Positions = &'static [(usize, usize)];
    let table: [(&str, Positions, usize, &str); 10] = [
        ("Jacobian", &[(0, 0), (1, 0)], 1, outside),
        ("Jacobian", &[(0, 3)], 0, outside),
        ("Jacobian", &[(0, usize::MAX)], 0, outside),
        ("Jacobian", &[(0, 1), (0, 2), (0, 1)], 2, twice),
        ("Hessian", &[(3, 0)], 0, outside),
        ("Hessian", &[(0, 0), (0, 3)], 1, outside),
        ("Hessian", &[(1 << 32, 0)], 0, outside),
        ("Hessian", &[(0, 0), (1, 1), (0, 1)], 2, above),
        ("Hessian", &[(1, 0), (0, 1)], 1, above),
        ("Hessian", &[(2, 1), (2, 1)], 1, twice),
    ];
    for (matrix, positions, at, reason) in table {
        let mut problem = hs035();
        let broken = pattern(positions);
        *(if matrix == "Jacobian" { &mut problem.jacobian } else { &mut problem.hessian }) = broken;
        let Err(refusal) = RawSolver::new(&problem, Options::default()).map(|_| ()) else {
            panic!("{matrix} {positions:?} is accepted");
        };
        let IpoptError::Structure { what, index, row, col, why } = refusal else {
            panic!("{matrix} {positions:?}: {refusal}");
        };
        assert_eq!((what, index, (row, col)), (matrix, at, positions[at]));
        assert!(why.starts_with(reason), "{why}");
    }
}

#[test]
fn a_problem_without_variables_is_refused() {
    let mut problem = hs006();
    problem.bounds = Bounds {
        lower: Vec::new(),
        upper: Vec::new(),
        constraint_lower: Vec::new(),
        constraint_upper: Vec::new(),
    };
    (problem.jacobian, problem.hessian) = (SparsityPattern::new(), SparsityPattern::new());
    let refusal = RawSolver::new(&problem, Options::default()).map(|_| ()).unwrap_err();
    assert_eq!(refusal, IpoptError::Size { variables: 0, constraints: 0 });
}

#[test]
fn a_solver_refuses_a_problem_of_another_structure() {
    let mut solver = solver(&hs071());
    let other = hs035();
    let start = StartPoint::Cold { x: &other.start };
    let refusal = solver.solve(&mut other.clone(), &other.bounds, &start).unwrap_err();
    assert_eq!(refusal, IpoptError::Length { what: "variables", expected: 4, found: 3 });

    let mut sparser = hs071();
    sparser.jacobian = pattern(&[(0, 0)]);
    let start = StartPoint::Cold { x: &sparser.start };
    let refusal = solver.solve(&mut sparser.clone(), &sparser.bounds, &start).unwrap_err();
    assert_eq!(refusal, IpoptError::Length { what: "Jacobian entries", expected: 8, found: 1 });

    let mut sparser = hs071();
    sparser.hessian.push(0, 0);
    let refusal = solver.solve(&mut sparser.clone(), &sparser.bounds, &start).unwrap_err();
    assert_eq!(refusal, IpoptError::Length { what: "Hessian entries", expected: 10, found: 11 });
    assert_eq!(solve_with(&mut solver, &hs071()).bits(), solve(&hs071()).bits());
}
