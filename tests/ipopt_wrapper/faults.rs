//! Callbacks that return invalid numbers, panic, or start another solve. The jobs run in a child
//! process, so that a crash or a deadlock fails the test and does not stop the test run.

use super::probe::{CALLBACKS, Call, Callback, Probe, solve, solve_with, solver};
use super::problems::{Problem, hs006, hs035, hs071, linear, rosenbrock};
use super::process::in_child;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::thread;
use tumble::ipopt::{IpoptError, Options, RawSolver, ReturnStatus, SolveOutcome, StartPoint};

/// Callbacks that return numbers.
const EVALUATIONS: [Callback; 5] = [
    Callback::Objective,
    Callback::Gradient,
    Callback::Constraints,
    Callback::Jacobian,
    Callback::Hessian,
];

/// Number of calls of each callback in an undisturbed solve, by [`Callback`]. Callbacks without
/// numbers to disturb count as 0.
fn undisturbed_counts(problem: &Problem) -> [usize; 6] {
    let mut counts = [0; 6];
    let mut probe = Probe::new(problem, |call: Call<'_>| {
        let disturbable = !call.values.is_empty() || call.callback == Callback::KeepGoing;
        counts[call.callback as usize] += usize::from(disturbable);
        true
    });
    let start = StartPoint::Cold { x: &problem.start };
    solver(problem).solve(&mut probe, &problem.bounds, &start).unwrap();
    counts
}

/// Checks that a point, if there is one, is finite.
fn assert_finite(outcome: &SolveOutcome<'_>, what: &str) {
    let Some(point) = outcome.point else { return };
    let arrays =
        [point.x, point.constraints, point.lower_multipliers, point.constraint_multipliers];
    let finite = arrays.iter().all(|array| array.iter().all(|value| value.is_finite()));
    assert!(finite && point.objective.is_finite(), "{what}: {outcome:?}");
}

/// Solves with `callback` returning `value` in one entry or everywhere, in `count` calls after the
/// first `earlier`.
fn disturbed<'s>(
    solver: &'s mut RawSolver,
    problem: &Problem,
    (callback, earlier, count): (Callback, usize, usize),
    value: f64,
) -> SolveOutcome<'s> {
    let mut probe = Probe::new(problem, |call: Call<'_>| {
        let due = earlier <= call.earlier && call.earlier - earlier < count;
        if call.callback == callback && due {
            let last = call.values.len() - 1;
            call.values[if earlier % 2 == 0 { last } else { 0 }..].fill(value);
        }
        true
    });
    let start = StartPoint::Cold { x: &problem.start };
    solver.solve(&mut probe, &problem.bounds, &start).unwrap()
}

/// Runs `job` for every problem, callback and time of the first fault, with a description.
fn for_every_fault(mut job: impl FnMut(&Problem, Callback, usize, &str)) {
    for problem in [hs071(), hs035(), hs006(), rosenbrock(), linear()] {
        let counts = undisturbed_counts(&problem);
        for callback in EVALUATIONS {
            let calls = counts[callback as usize];
            for earlier in [0, 1, 2, 4, calls.saturating_sub(1)] {
                if earlier < calls {
                    let what = format!("{} {callback:?} after {earlier} calls", problem.name);
                    job(&problem, callback, earlier, &what);
                }
            }
        }
    }
}

/// The wrapper treats magnitudes from 1e100 on as the result of a breakdown.
const NO_NUMBERS: [f64; 4] = [f64::NAN, f64::NEG_INFINITY, 1e200, 1e100];

#[test]
#[ignore = "slow"]
fn a_callback_that_returns_no_number_from_some_call_on_never_succeeds_and_never_crashes() {
    let name = "faults::a_callback_that_returns_no_number_from_some_call_on_never_succeeds_and_\
                never_crashes";
    in_child(name, || {
        for_every_fault(|problem, callback, earlier, what| {
            let healthy = solve(problem).bits();
            let mut solver = solver(problem);
            for value in NO_NUMBERS {
                let fault = (callback, earlier, usize::MAX);
                let outcome = disturbed(&mut solver, problem, fault, value);
                assert!(!outcome.status.is_success(), "{what}, {value}: {outcome:?}");
                assert_finite(&outcome, what);
                if earlier == 0 {
                    // There was no iteration, or only the first iterate exists.
                    assert_eq!(outcome.iterations, 0, "{what}: {outcome:?}");
                }
                assert_eq!(solve_with(&mut solver, problem).bits(), healthy, "{what}, {value}");
            }
        });
    });
}

#[test]
fn a_single_call_that_returns_no_number_is_survived_or_reported() {
    in_child("faults::a_single_call_that_returns_no_number_is_survived_or_reported", || {
        for_every_fault(|problem, callback, earlier, what| {
            let mut solver = solver(problem);
            for value in NO_NUMBERS {
                let outcome = disturbed(&mut solver, problem, (callback, earlier, 1), value);
                assert_finite(&outcome, what);
                if outcome.status.is_success() {
                    // The tolerance of the undisturbed optima.
                    let objective = outcome.point.unwrap().objective;
                    assert!((objective - problem.optimum).abs() < 1e-6, "{what}: {outcome:?}");
                }
            }
        });
    });
}

/// Solver with a limit of 30 iterations. The undisturbed problems need at most 25, and disturbed
/// ones may need many.
fn brief_solver(problem: &Problem) -> RawSolver {
    RawSolver::new(problem, Options { max_iterations: 30, ..Options::default() }).unwrap()
}

#[test]
#[ignore = "slow"]
fn huge_and_tiny_numbers_that_are_numbers_crash_nothing() {
    in_child("faults::huge_and_tiny_numbers_that_are_numbers_crash_nothing", || {
        for_every_fault(|problem, callback, earlier, what| {
            let mut solver = brief_solver(problem);
            for value in [9e99, -1e50, 5e-324] {
                let fault = (callback, earlier, usize::MAX);
                assert_finite(&disturbed(&mut solver, problem, fault, value), what);
            }
        });
    });
}

#[test]
fn invalid_starts_and_multipliers_do_not_crash() {
    in_child("faults::invalid_starts_and_multipliers_do_not_crash", || {
        let hostile = [1e308, -1e308, 1e150, 1e19, -1e19, 5e-324, -1.0, 0.0];
        for problem in [hs071(), hs035(), hs006(), rosenbrock(), linear()] {
            let (n, m) = (problem.start.len(), problem.bounds.constraint_lower.len());
            let mut solver = brief_solver(&problem);
            for (x, multiplier) in hostile.iter().flat_map(|x| hostile.map(|y| (*x, y))) {
                let (mut start, y) = (problem.start.clone(), vec![multiplier; m]);
                start[n - 1] = x;
                let (low, high) = (vec![multiplier.abs(); n], vec![multiplier; n]);
                let warm = StartPoint::Warm {
                    x: &start,
                    constraint_multipliers: &y,
                    lower_multipliers: &low,
                    upper_multipliers: &high,
                };
                for start in [StartPoint::Cold { x: &start }, warm] {
                    let mut program = problem.clone();
                    let outcome = solver.solve(&mut program, &problem.bounds, &start).unwrap();
                    assert_finite(&outcome, problem.name);
                }
            }
            let healthy = solve(&problem);
            assert_eq!(solve_with(&mut solver, &problem).bits(), healthy.bits());
        }
    });
}

/// Panic payload that nothing else uses.
#[derive(Debug, PartialEq)]
struct OnPurpose(usize);

#[test]
fn a_panic_in_any_callback_reaches_the_caller_and_leaves_solver_and_lock_usable() {
    let name =
        "faults::a_panic_in_any_callback_reaches_the_caller_and_leaves_solver_and_lock_usable";
    in_child(name, || {
        for problem in [hs071(), hs035(), hs006()] {
            let healthy = solve(&problem).bits();
            let counts = undisturbed_counts(&problem);
            let mut solver = solver(&problem);
            for callback in CALLBACKS {
                for earlier in (0..counts[callback as usize]).filter(|k| k % 3 != 1) {
                    let payload = panic_in(&mut solver, &problem, callback, earlier);
                    let payload = payload.downcast::<OnPurpose>().unwrap();
                    assert_eq!(*payload, OnPurpose(earlier), "{callback:?}");
                    // This thread and any other can solve again.
                    assert_eq!(solve_with(&mut solver, &problem).bits(), healthy);
                    let elsewhere = thread::scope(|scope| {
                        scope.spawn(|| solve(&problem).bits()).join().unwrap()
                    });
                    assert_eq!(elsewhere, healthy);
                }
            }
        }
    });
}

/// Solves with one call that panics, without the message that `panic!` prints. Returns the payload
/// that arrives. No callback may run after it.
fn panic_in(
    solver: &mut RawSolver,
    problem: &Problem,
    callback: Callback,
    earlier: usize,
) -> Box<dyn Any + Send> {
    let mut panicked = false;
    let mut probe = Probe::new(problem, |call: Call<'_>| {
        assert!(!panicked, "{:?} runs after the panic", call.callback);
        if call.callback == callback && call.earlier == earlier {
            panicked = true;
            resume_unwind(Box::new(OnPurpose(earlier)));
        }
        true
    });
    let start = StartPoint::Cold { x: &problem.start };
    catch_unwind(AssertUnwindSafe(|| {
        solver.solve(&mut probe, &problem.bounds, &start).map(|outcome| outcome.status)
    }))
    .expect_err("the panic arrives")
}

#[test]
fn a_solve_inside_any_callback_is_refused_and_the_outer_one_ends_as_ever() {
    in_child(
        "faults::a_solve_inside_any_callback_is_refused_and_the_outer_one_ends_as_ever",
        || {
            let (outer, inner) = (hs071(), hs035());
            let alone = solve(&outer);
            for callback in CALLBACKS {
                let mut inner_solver = solver(&inner);
                let mut refused = 0;
                let mut probe = Probe::new(&outer, |call: Call<'_>| {
                    if call.callback == callback {
                        let start = StartPoint::Cold { x: &inner.start };
                        let result = inner_solver.solve(&mut inner.clone(), &inner.bounds, &start);
                        assert_eq!(result.unwrap_err(), IpoptError::Reentrant);
                        refused += 1;
                    }
                    true
                });
                let mut outer_solver = solver(&outer);
                let start = StartPoint::Cold { x: &outer.start };
                let outcome = outer_solver.solve(&mut probe, &outer.bounds, &start).unwrap();
                assert_eq!(outcome.status, ReturnStatus::SolveSucceeded);
                assert_eq!(outcome.point.unwrap().x, alone.arrays[0], "{callback:?}");
                assert!(refused > 0, "{callback:?}");
                // Afterwards the inner solver works again.
                assert!(solve_with(&mut inner_solver, &inner).status.is_success());
            }
        },
    );
}
