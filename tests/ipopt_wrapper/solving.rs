//! Results of a solve: optima, statuses, warm starts, reproducibility.

use super::probe::{Answer, Call, Callback, Probe, solve, solve_with, solver};
use super::problems::{Problem, all, hs006, hs035, hs071, linear, rosenbrock};
use std::thread;
use tumble::ipopt::{BarrierStrategy, Options, RawSolver, ReturnStatus, Scaling, StartPoint};

/// Tolerance of the objective. With Ipopt's tolerance 1e-8 each bound leaves an error of about
/// 1e-8. Ipopt also relaxes bounds by 1e-8 of their size, which a multiplier of at most 20 turns
/// into 2e-7.
const OBJECTIVE_TOLERANCE: f64 = 1e-6;

/// Tolerance of the point. The solutions are known to at least seven digits. With curvature 2 or
/// more, an objective error of 1e-8 means 1e-4 in x. But Newton's last step is quadratic and leaves
/// less than 1e-6.
const POINT_TOLERANCE: f64 = 1e-6;

#[test]
fn the_published_optima_are_reached_from_the_published_starts() {
    for problem in all() {
        let answer = solve(&problem);
        let name = problem.name;
        assert_eq!(answer.status, ReturnStatus::SolveSucceeded, "{name}");
        let [x, constraints, ..] = &answer.arrays;
        assert!((answer.objective - problem.optimum).abs() < OBJECTIVE_TOLERANCE, "{name}");
        for (x, known) in x.iter().zip(&problem.solution) {
            assert!((x - known).abs() < POINT_TOLERANCE, "{name}: {x} is not {known}");
        }
        // The variables satisfy their bounds exactly. f and g are reported from before the last
        // projection onto the bounds, and agree to the tolerance of the optimum.
        for (k, x) in x.iter().enumerate() {
            assert!(problem.bounds.lower[k] <= *x && *x <= problem.bounds.upper[k], "{name}: {x}");
        }
        assert!((answer.objective - (problem.objective)(x)).abs() < OBJECTIVE_TOLERANCE, "{name}");
        let mut expected = vec![0.0; constraints.len()];
        (problem.constraints)(x, &mut expected);
        for (found, expected) in constraints.iter().zip(&expected) {
            assert!((found - expected).abs() < OBJECTIVE_TOLERANCE, "{name}: {found} {expected}");
        }
    }
}

#[test]
fn the_multipliers_make_the_lagrangian_stationary() {
    for problem in all() {
        let answer = solve(&problem);
        let [x, _, y, lower, upper] = &answer.arrays;
        let mut stationarity = vec![0.0; x.len()];
        (problem.gradient)(x, &mut stationarity);
        let mut jacobian = vec![0.0; problem.jacobian.len()];
        (problem.jacobian_values)(x, &mut jacobian);
        for ((row, col), value) in problem.jacobian.positions().zip(&jacobian) {
            stationarity[col] += y[row] * value;
        }
        for (k, residual) in stationarity.iter_mut().enumerate() {
            *residual += upper[k] - lower[k];
            assert!(lower[k] >= 0.0 && upper[k] >= 0.0, "{}", problem.name);
        }
        // The tolerance 1e-8, times the scaling that Ipopt allows for multipliers of this size.
        assert!(stationarity.iter().all(|r| r.abs() < 1e-6), "{}: {stationarity:?}", problem.name);
    }
}

#[test]
fn a_warm_start_with_multipliers_takes_fewer_iterations_than_a_cold_one() {
    for problem in [hs071(), hs035(), hs006(), linear()] {
        let cold = solve(&problem);
        // The same problem, with the start at the solution.
        let options = Options { initial_barrier: 1e-7, ..Options::default() };
        let mut solver = RawSolver::new(&problem, options).unwrap();
        let mut program = problem.clone();
        let outcome = solver.solve(&mut program, &problem.bounds, &cold.as_start()).unwrap();
        let warm = Answer::from_outcome(&outcome);
        assert_eq!(warm.status, ReturnStatus::SolveSucceeded, "{}", problem.name);
        assert!(warm.iterations < cold.iterations, "{}: {warm:?}", problem.name);
        assert!((warm.objective - problem.optimum).abs() < OBJECTIVE_TOLERANCE, "{warm:?}");
    }
}

#[test]
fn the_same_solve_gives_the_same_bits_whatever_the_solver_did_before() {
    let problem = hs071();
    let first = solve(&problem);
    let mut used = solver(&problem);
    for scale in [1.5, 2.0, 3.0] {
        let start: Vec<f64> = problem.start.iter().map(|x| (x * scale).min(5.0)).collect();
        solve_with(&mut used, &Problem { start, ..problem.clone() });
    }
    assert_eq!(solve_with(&mut used, &problem).bits(), first.bits());
}

#[test]
fn four_threads_with_fifty_solves_each_get_what_one_thread_gets() {
    let problems = all();
    let alone: Vec<_> = problems.iter().map(|problem| solve(problem).bits()).collect();
    thread::scope(|scope| {
        for thread in 0..4 {
            let (problems, alone) = (&problems, &alone);
            scope.spawn(move || {
                let mut solvers: Vec<_> = problems.iter().map(solver).collect();
                for round in 0..50 {
                    let which = (round + thread) % problems.len();
                    let answer = solve_with(&mut solvers[which], &problems[which]);
                    assert_eq!(answer.bits(), alone[which], "{}", problems[which].name);
                }
            });
        }
    });
}

/// A solver owns plain data. Thread-bound data lives only during a solve.
const _: () = {
    const fn is_send<T: Send>() {}
    is_send::<RawSolver>();
};

#[test]
fn a_solver_may_be_made_on_one_thread_and_used_on_another() {
    let problem = hs035();
    let mut made_here = solver(&problem);
    let there = thread::scope(|scope| {
        scope.spawn(|| solve_with(&mut made_here, &problem).bits()).join().unwrap()
    });
    assert_eq!(there, solve(&problem).bits());
}

#[test]
fn keep_going_can_stop_the_solve_at_every_iteration() {
    let problem = hs071();
    let whole = solve(&problem);
    for last in 0..whole.iterations {
        let mut probe = Probe::new(&problem, |call: Call<'_>| {
            call.progress.is_none_or(|progress| progress.iteration < last)
        });
        let mut solver = solver(&problem);
        let start = StartPoint::Cold { x: &problem.start };
        let outcome = solver.solve(&mut probe, &problem.bounds, &start).unwrap();
        assert_eq!(outcome.status, ReturnStatus::UserRequestedStop);
        assert!(!outcome.status.is_success());
        assert_eq!(outcome.iterations, last);
        assert!(outcome.point.is_some(), "the last iterate is there to be used");
        assert_eq!(solve_with(&mut solver, &problem).bits(), whole.bits());
    }
}

#[test]
fn progress_counts_iterations_and_shows_the_convergence() {
    let problem = hs071();
    let mut seen = Vec::new();
    let mut probe = Probe::new(&problem, |call: Call<'_>| {
        assert_eq!(call.progress.is_some(), call.callback == Callback::KeepGoing);
        seen.extend(call.progress.copied());
        true
    });
    let start = StartPoint::Cold { x: &problem.start };
    let iterations =
        solver(&problem).solve(&mut probe, &problem.bounds, &start).unwrap().iterations;
    let counts: Vec<_> = seen.iter().map(|progress| progress.iteration).collect();
    assert_eq!(counts, (0..=iterations).collect::<Vec<_>>());
    let last = seen.last().unwrap();
    assert!((last.objective - problem.optimum).abs() < OBJECTIVE_TOLERANCE);
    // Ipopt's own tolerance, scaled by multipliers of order 1.
    assert!(last.primal_infeasibility < 1e-7 && last.dual_infeasibility < 1e-7, "{last:?}");
    assert!(last.barrier > 0.0 && last.barrier < seen[0].barrier && !last.in_restoration);
}

#[test]
fn the_iteration_limit_is_a_status_with_the_last_iterate() {
    for max_iterations in 0..4 {
        let problem = rosenbrock();
        let options = Options { max_iterations, ..Options::default() };
        let answer = solve_with(&mut RawSolver::new(&problem, options).unwrap(), &problem);
        assert_eq!(answer.status, ReturnStatus::MaximumIterationsExceeded);
        assert_eq!(answer.iterations, max_iterations);
        assert!(answer.objective > problem.optimum + 1e-3);
    }
}

#[test]
fn hopeless_problems_end_with_a_status_and_leave_the_solver_usable() {
    // x² = −1, then x₀ x₁ x₂ x₃ ≥ 25 with every x ≤ 1, then min −x without a bound.
    let no_root = Problem {
        constraints: |x, out| out[0] = 10.0 * (x[0] * x[0] + 1.0),
        jacobian_values: |x, out| out.copy_from_slice(&[20.0 * x[0], 0.0]),
        hessian_values: |_, factor, y, out| out[0] = 2.0 * factor + 20.0 * y[0],
        ..hs006()
    };
    let mut too_tight = hs071();
    too_tight.bounds.lower.fill(0.0);
    too_tight.bounds.upper.fill(1.0);
    let mut unbounded = linear();
    unbounded.bounds.upper.fill(f64::INFINITY);
    unbounded.bounds.constraint_upper.fill(f64::INFINITY);
    for (problem, healthy) in [(no_root, hs006()), (too_tight, hs071()), (unbounded, linear())] {
        let mut solver = solver(&problem);
        let mut program = problem.clone();
        let start = StartPoint::Cold { x: &problem.start };
        let outcome = solver.solve(&mut program, &problem.bounds, &start).unwrap();
        assert!(!outcome.status.is_success(), "{}: {}", problem.name, outcome.status);
        assert!(!outcome.status.name().contains("Unknown"), "{}", outcome.status);
        assert_eq!(solve_with(&mut solver, &healthy).bits(), solve(&healthy).bits());
    }
}

#[test]
fn with_all_variables_fixed_a_feasible_point_succeeds_and_an_infeasible_one_fails() {
    // HS006 and HS035 at their solutions, which are feasible to the last bit, and HS006 at its
    // start, which is not.
    for (problem, at, feasible) in [
        (hs035(), hs035().solution, true),
        (hs006(), hs006().solution, true),
        (rosenbrock(), rosenbrock().start, true),
        (hs006(), hs006().start, false),
    ] {
        let mut fixed = Problem { start: at.clone(), ..problem };
        fixed.bounds.lower = at.clone();
        fixed.bounds.upper = at.clone();
        let answer = solve(&fixed);
        assert_eq!(answer.status.is_success(), feasible, "{}: {}", fixed.name, answer.status);
        assert_eq!(answer.arrays[0], at, "{}", fixed.name);
    }
}

#[test]
fn every_setting_that_is_accepted_solves_or_says_why_not() {
    let d = Options::default;
    let mut settings = vec![
        Options { barrier: BarrierStrategy::Adaptive, ..d() },
        Options { scaling: Scaling::None, ..d() },
        Options { bound_push: 5e-324, ..d() },
        Options { bound_push: 0.5, ..d() },
        Options { initial_barrier: 1e6, ..d() },
        Options { mumps_memory_percent: 0, ..d() },
        Options { mumps_memory_percent: 10_000, ..d() },
        Options { min_refinement_steps: 10, ..d() },
    ];
    let orders = (0..=7).map(|mumps_pivot_order| Options { mumps_pivot_order, ..d() });
    settings.extend(orders.filter(|options| options.validate().is_ok()));
    for options in settings {
        for problem in all() {
            let answer =
                solve_with(&mut RawSolver::new(&problem, options.clone()).unwrap(), &problem);
            let near = (answer.objective - problem.optimum).abs() < OBJECTIVE_TOLERANCE;
            assert!(answer.status.is_success() && near, "{options:?}: {answer:?}");
        }
    }
    // In range, but beyond double precision: success is not required, but it must not crash.
    for options in [
        Options { tolerance: 5e-324, max_iterations: 100, ..d() },
        Options { initial_barrier: 5e-324, max_iterations: 100, ..d() },
        Options { max_iterations: 0, ..d() },
    ] {
        for problem in all() {
            let mut solver = RawSolver::new(&problem, options.clone()).unwrap();
            let mut program = problem.clone();
            let start = StartPoint::Cold { x: &problem.start };
            let outcome = solver.solve(&mut program, &problem.bounds, &start).unwrap();
            assert_eq!(ReturnStatus::from_code(outcome.status.code()), outcome.status);
        }
    }
}
