//! The problems with the native solver, with usual and with other inputs, and with defective solvers.

use crate::campaign::size;
use crate::inputs::{Input, TestInputs};
use crate::problems::PROBLEMS;
use crate::quantity::{Convergence, QuantityClaim, TestQuantity};
use crate::runner::{MakeSolver, Runner};
use crate::{Refusal, TestProblem, find, planted};
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};
use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering};
use tumble_core::error::Error;
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::StepSolver;
use tumble_core::world::World;

fn native(world: &World) -> Result<Box<dyn StepSolver>, Error> {
    Ok(Box::new(NativeSolver::new(world)))
}

fn assert_holds(problem: &TestProblem, inputs: &TestInputs, findings: &[TestQuantity]) {
    for quantity in findings {
        assert!(quantity.holds(), "{}: {quantity:?} with {inputs:?}", problem.name);
    }
}

/// Quantities for which the theory says an order, and which.
const ORDERS: [(&str, &str, i32); 28] = [
    ("free-fall", "height fallen", 1),
    ("sliding-stop", "stopping distance", 1),
    ("slope-slide", "way down the slope", 1),
    ("fast-plate", "stopping distance", 1),
    ("spinning-box", "stopping time", 2),
    ("spinning-box", "angle turned", 1),
    ("compass", "longest slide", 1),
    ("dragged-cube", "way", 1),
    ("rocking", "peak tilt", 1),
    ("pushed-over", "spin that topples", 1),
    ("rolling-ball", "way down the slope", 1),
    ("sliding-ball", "way while it slides", 1),
    ("blocks-on-slope", "way of the upper block", 1),
    ("blocks-on-slope", "way of the lower block", 1),
    ("blocks-on-slope", "way of both, smooth below", 1),
    ("pulled-block", "way as one", 1),
    ("pulled-block", "way of the upper block", 1),
    ("pulled-block", "way of the lower block", 1),
    ("turntable", "acceleration of the block", 2),
    ("turntable", "threshold of the spin", 2),
    ("dominoes", "time until they meet", 1),
    ("dominoes", "spin then", 1),
    ("pendulum", "period", 2),
    ("four-bar-windows", "time of a turn", 2),
    ("squeezer", "β at 0.03 s", 2),
    ("squeezer", "Θ at 0.03 s", 2),
    ("squeezer", "γ at 0.03 s", 2),
    ("squeezer", "Φ at 0.03 s", 2),
];

/// Every quantity holds with the default inputs at h and h/2 and shows its declared order.
#[test]
fn native_solver_passes_all_validation_problems() {
    let mut orders = Vec::new();
    for problem in &PROBLEMS {
        let inputs = problem.inputs();
        let [coarse, fine] = [1.0, 0.5].map(|part| {
            let mut runner = Runner::new(&native, part * inputs.time_step);
            let findings = problem.solve(&inputs, &mut runner).unwrap();
            assert_eq!((runner.counts.failed, runner.counts.fallback), (0, 0), "{}", problem.name);
            assert!(runner.counts.worst_residual < 1e-9, "{}", problem.name);
            assert_holds(problem, &inputs, &findings);
            findings
        });
        for (coarse, fine) in coarse.iter().zip(&fine) {
            assert_little_is_allowed(problem, coarse);
            assert!(coarse.converges(fine), "{coarse:?}, {fine:?}");
            if let Convergence::Order(p) = coarse.convergence {
                let order = coarse.order(fine).unwrap();
                assert!((order - f64::from(p)).abs() < 0.1, "{coarse:?}: {order}");
                orders.push((problem.name, coarse.name, p));
            }
        }
    }
    assert_eq!(orders, ORDERS);
}

/// The native solver is held to some thousand roundings, not to what Ipopt needs.
fn assert_little_is_allowed(problem: &TestProblem, quantity: &TestQuantity) {
    // Thresholds are looked for to a millionth; about an edge all errors grow, and a force is an impulse over h.
    let most = match problem.name {
        "pushed-over" | "slope-topple" => 2e-6,
        _ if quantity.name.starts_with("threshold") => 2e-6 * quantity.exact,
        "rocking" => 1e-9,
        _ if ["N", "N m"].contains(&quantity.unit) => 1e-8,
        _ => 1e-9,
    };
    assert!(quantity.tolerance < most, "{}: {quantity:?}", problem.name);
}

/// A quantity that stops within a step, or a few.
#[test]
fn a_box_that_stops_within_a_step_has_its_answer() {
    let problem = find("spinning-box").unwrap();
    for speed in [0.01, 0.02, 0.05, 0.1, 0.15, 0.3] {
        for h in [0.002, 0.001, 0.0003, 0.02] {
            let mut inputs = problem.inputs();
            inputs.set(Input::Speed, speed);
            let found = problem.solve(&inputs, &mut Runner::new(&native, h)).unwrap();
            assert_converges(problem, &inputs, h, &found);
        }
    }
    let problem = find("sliding-stop").unwrap();
    for speed in [0.01, 0.02, 0.05] {
        let mut inputs = problem.inputs();
        inputs.set(Input::Speed, speed);
        let found = problem.solve(&inputs, &mut Runner::new(&native, 0.01)).unwrap();
        assert_converges(problem, &inputs, 0.01, &found);
    }
}

/// Asserts that `problem` holds with h (result `coarse`) and h/2 and converges to the exact value
/// as declared.
fn assert_converges(problem: &TestProblem, inputs: &TestInputs, h: f64, coarse: &[TestQuantity]) {
    let fine = problem.solve(inputs, &mut Runner::new(&native, 0.5 * h)).unwrap();
    for findings in [coarse, &fine] {
        assert_holds(problem, inputs, findings);
    }
    for (coarse, fine) in coarse.iter().zip(&fine) {
        assert!(coarse.converges(fine), "{}: {coarse:?}, {fine:?}, {inputs:?}", problem.name);
    }
}

/// Other masses, friction coefficients, gravities, slopes and speeds, on all cores. Inputs with a
/// motion that differs from the closed form are refused. Most inputs must be accepted.
#[test]
#[ignore = "slow"]
fn random_inputs_pass_validation() {
    let (of_one, of_several) = (size(16, 60) as u32, size(8, 24) as u32);
    let (next, threads) = (AtomicUsize::new(0), std::thread::available_parallelism().unwrap());
    std::thread::scope(|scope| {
        for _ in 0..threads.get() {
            scope.spawn(|| {
                while let Some(problem) = PROBLEMS.get(next.fetch_add(1, Ordering::Relaxed)) {
                    other_numbers_have_the_answers_of(problem, (of_one, of_several));
                }
            });
        }
    });
}

fn other_numbers_have_the_answers_of(problem: &TestProblem, (of_one, of_several): (u32, u32)) {
    let numbers =
        (0.01..1e3_f64, 0.05..1.2_f64, 1.0..25.0_f64, 0.0..50.0_f64, 0.2..12.0_f64, 1e-3..4e-3_f64);
    // Steps of several bodies take longer; and there may be nothing to vary.
    let cases = match problem.bodies {
        _ if problem.inputs().values().is_empty() => 1,
        1 => of_one,
        2..=30 => of_several,
        _ => of_several / 8,
    };
    let config = ProptestConfig { rng_seed: RngSeed::Fixed(6), cases, ..Default::default() };
    let solved = Cell::new(0);
    TestRunner::new(config)
        .run(&numbers, |(mass, friction, gravity, slope, speed, h)| {
            let mut inputs = problem.inputs();
            // What the problem can be posed with at all, for most of the draws.
            let name = problem.name;
            let speed = if name == "rocking" { 0.3 + speed / 18.0 } else { speed };
            let mass = if name == "dragged-cube" { mass / 500.0 } else { mass };
            inputs.set(Input::Mass, mass);
            inputs.set(Input::Friction, friction);
            inputs.set(Input::Gravity, gravity);
            inputs.set(Input::Slope, slope);
            inputs.set(Input::Speed, speed);
            let h = h.min(inputs.time_step);
            match problem.solve(&inputs, &mut Runner::new(&native, h)) {
                Ok(found) => {
                    assert_converges(problem, &inputs, h, &found);
                    solved.set(solved.get() + 1);
                }
                Err(Refusal::Motion(why)) => assert!(!why.is_empty()),
                Err(error) => panic!("{}: {error}", problem.name),
            }
            Ok(())
        })
        .unwrap();
    assert!(solved.get() >= cases / 3, "{}: {} of {cases}", problem.name, solved.get());
}

/// A planted defect, and a quantity that it must be seen in.
type Case = (&'static str, &'static MakeSolver<'static>, &'static [(&'static str, &'static str)]);

#[test]
fn solvers_with_planted_defects_fail_validation() {
    let cases: [Case; 11] = [
        (
            "explicit",
            &planted::explicit,
            &[
                ("sliding-stop", "stopping distance"),
                ("slope-slide", "way down the slope"),
                ("fast-plate", "stopping distance"),
                ("spinning-box", "angle turned"),
                ("compass", "longest slide"),
                ("dragged-cube", "way"),
                ("rolling-ball", "way down the slope"),
                ("blocks-on-slope", "way of the lower block"),
            ],
        ),
        (
            "trapezoidal",
            &planted::trapezoidal,
            &[("slope-slide", "way down the slope"), ("rolling-ball", "way down the slope")],
        ),
        ("short turn", &planted::short_turn, &[("spinning-box", "angle turned")]),
        (
            "slippery",
            &planted::slippery,
            &[
                ("sliding-stop", "stopping time"),
                ("slope-slide", "speed down the slope"),
                ("spinning-box", "stopping time"),
                ("compass", "longest slide"),
                ("dragged-cube", "friction while it slides"),
                ("sliding-ball", "way while it slides"),
            ],
        ),
        ("pyramid", &planted::pyramid, &[("compass", "longest less shortest")]),
        ("creeping", &planted::creeping, &[("slope-stick", "way down the slope")]),
        ("slowly creeping", &planted::slowly_creeping, &[("slope-stick", "way down the slope")]),
        (
            "energetic",
            &planted::energetic,
            &[
                ("tumble", "largest gap in the balance"),
                ("sliding-stop", "stopping time"),
                ("pushed-over", "spin that topples"),
                ("collision", "momentum"),
                ("ball-chain", "momentum"),
                ("pair-in-flight", "change of the momentum"),
            ],
        ),
        (
            "bouncing",
            &planted::bouncing,
            &[
                ("rocking", "spin kept at impact"),
                ("tumble", "largest gap in the balance"),
                ("collision", "speed of the first box"),
            ],
        ),
        ("floating", &planted::floating, &[("fast-plate", "lift-off")]),
        (
            "sinking",
            &planted::sinking,
            &[("fast-plate", "penetration"), ("mass-ratio", "longest way of a box")],
        ),
    ];
    for (defect, make, seen_in) in cases {
        for (name, quantity) in seen_in {
            let problem = find(name).unwrap();
            let inputs = problem.inputs();
            let mut runner = Runner::new(make, inputs.time_step);
            let findings = problem.solve(&inputs, &mut runner).unwrap();
            let found = findings.iter().find(|found| found.name == *quantity).unwrap();
            assert!(!found.holds(), "{defect}: {name}, {found:?}");
            // The certificate knows it as well: it does not believe the solver.
            assert!(runner.counts.worst_residual > 1e-5, "{defect}: {name}");
        }
    }
}

/// Free flight needs no solver. The sum of explicit Euler's steps is known.
#[test]
fn explicit_euler_falls_another_height() {
    let problem = find("free-fall").unwrap();
    let inputs = problem.inputs();
    let h = inputs.time_step;
    let findings = problem.solve(&inputs, &mut Runner::new(&native, h)).unwrap();
    let fallen = findings[0];
    let steps = (1.0 / h).round();
    let measured = 0.5 * 9.81 * h * h * steps * (steps - 1.0);
    assert!(fallen.holds() && !TestQuantity { measured, ..fallen }.holds(), "{fallen:?}");
}

/// The check of orders covers declared orders in the discrete and in the measured value, as far as
/// the tolerance allows.
#[test]
fn an_order_that_is_not_the_declared_one_is_found_out() {
    let quantity = |exact: f64, off: f64, tolerance: f64, convergence: Convergence| TestQuantity {
        name: "way",
        unit: "m",
        measured: exact + off,
        discrete: exact + off,
        exact,
        tolerance,
        claim: QuantityClaim::Equal,
        convergence,
    };
    let pair = |off: [f64; 2], tolerance: f64, convergence: Convergence| {
        let [whole, half] = off.map(|off| quantity(3.0, off, tolerance, convergence));
        (whole.converges(&half), whole.order(&half).map(|order| (10.0 * order).round() / 10.0))
    };
    let (first, second) = (Convergence::Order(1), Convergence::Order(2));
    assert_eq!(pair([0.02, 0.01], 1e-9, first), (true, Some(1.0)));
    assert_eq!(pair([0.02, 0.005], 1e-9, second), (true, Some(2.0)));
    assert_eq!(pair([0.02, 0.005], 1e-9, first), (false, Some(2.0)));
    assert_eq!(pair([0.02, 0.02], 1e-9, first), (false, Some(0.0)));
    assert!(!pair([0.0, 0.0], 1e-9, first).0);
    // Slack hides the measured order; the discrete one is checked all the same.
    assert_eq!(pair([0.02, 0.01], 0.01, first), (true, None));
    assert_eq!(pair([0.02, 0.005], 0.01, first), (false, None));
    assert_eq!(pair([0.02, 0.01], 1e-9, Convergence::Exact), (false, None));
    assert_eq!(pair([1e-10, 0.0], 1e-9, Convergence::Exact), (true, None));
    assert_eq!(pair([0.02, 0.001], 1e-9, Convergence::Within(0.021)), (true, None));
    assert_eq!(pair([0.02, 0.001], 1e-9, Convergence::Within(0.019)), (false, None));
    // A measured value with another convergence than the discrete one.
    let (whole, half) = (quantity(3.0, 0.02, 1e-6, first), quantity(3.0, 0.01, 1e-6, first));
    assert!(!whole.converges(&TestQuantity { measured: 3.005, ..half }));
}

#[test]
fn numbers_out_of_range_are_refused() {
    for problem in &PROBLEMS {
        for (input, _) in problem.inputs().values() {
            for bad in [f64::NAN, -1.0, 1e9, f64::INFINITY] {
                let mut inputs = problem.inputs();
                inputs.set(*input, bad);
                let found = problem.solve(&inputs, &mut Runner::new(&native, inputs.time_step));
                assert!(found.is_err(), "{} {input:?} {bad}", problem.name);
            }
        }
    }
}
