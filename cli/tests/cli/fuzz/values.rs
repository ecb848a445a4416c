//! Random constants, states, options and points: refused by name or good for a step.

use super::steps::{Seen, check_run, native};
use super::{any_bits, each, finite, wild};
use crate::common::{any_world, state, tutorial_parameters, tutorial_world};
use nalgebra::{Matrix3, Vector3};
use proptest::array::uniform8;
use proptest::collection::vec;
use proptest::prelude::*;
use tumble::ipopt::{BarrierStrategy, MultiplierStep, Options, Scaling};
use tumble::solver::ipopt::{ACCEPTED_RESIDUAL, IpoptSolver};
use tumble::step_nlp::{SMOOTHING, StepNlp};
use tumble_core::mechanics::{RigidBody, Wrench};
use tumble_core::step::StepSolver;
use tumble_core::world::{Parameters, World};

/// State of the tutorial's cube on the ground, with velocity down and sideways.
fn ordinary() -> [f64; 13] {
    [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.5, -1.0, 0.3, -0.2, 0.1]
}

/// Steps per run.
const STEPS: usize = 2;

/// Asserts a short one-line error that names `field`.
fn assert_names(error: &dyn std::fmt::Display, field: &str) {
    let text = error.to_string();
    assert!(text.contains(field) && text.len() < 200 && !text.contains('\n'), "{field}: {text}");
}

/// One of mass, inertia and contact points is unusual.
#[test]
#[ignore = "slow"]
fn a_body_of_any_numbers_is_refused_by_name_or_can_be_simulated() {
    let seen = Seen::default();
    let numbers = (0..3_usize, vec(wild(), 1 + 9 + 24), any::<bool>());
    each(10_000, numbers, |(invalid, numbers, diagonal)| {
        let mass = if invalid == 0 { numbers[0] } else { 10.0 };
        let full = Matrix3::from_row_slice(&numbers[1..10]);
        let inertia = match (invalid, diagonal) {
            (1, true) => Matrix3::from_diagonal(&full.diagonal()),
            (1, false) => full + full.transpose(),
            _ => Matrix3::from_diagonal_element(0.01),
        };
        let points: Vec<_> = if invalid == 2 {
            numbers[10..].chunks(3).map(Vector3::from_column_slice).collect()
        } else {
            tutorial_parameters().bodies[0].contact_points().iter().map(|c| c.position).collect()
        };
        match RigidBody::new(mass, inertia, &points) {
            Err(error) => assert_names(&error, ["mass", "inertia", "contact point"][invalid]),
            Ok(body) => {
                let parameters = Parameters { bodies: vec![body], ..tutorial_parameters() };
                let world = World::new(parameters).unwrap();
                check_run(&world, state(&ordinary()), native(&world), STEPS, &seen)?;
            }
        }
        Ok(())
    });
    // A few percent below the deterministic count.
    seen.assert_counts(607, 0, 0);
}

#[test]
fn a_box_of_any_sides_is_refused_by_name_or_can_be_simulated() {
    let seen = Seen::default();
    each(5000, (0..3_usize, wild()), |(axis, half_side)| {
        let mut half_sides = Vector3::repeat(1.0);
        half_sides[axis] = half_side;
        match RigidBody::with_box_corners(10.0, Matrix3::identity(), half_sides) {
            Err(error) => {
                let fits = (1e-6..=1e4).contains(&half_side);
                assert_names(&error, if fits { "moment of inertia" } else { "half side" });
            }
            Ok(body) => {
                let parameters = Parameters { bodies: vec![body], ..tutorial_parameters() };
                let world = World::new(parameters).unwrap();
                check_run(&world, state(&ordinary()), native(&world), STEPS, &seen)?;
            }
        }
        Ok(())
    });
    // The excused step is a needle of kilometres with the inertia of a ball.
    seen.assert_counts(618, 4, 0);
}

#[test]
fn constants_of_any_numbers_are_refused_by_name_or_can_be_simulated() {
    let seen = Seen::default();
    let fields = ["time step", "friction", "gravity", "gravity", "gravity"];
    each(10_000, (0..5_usize, wild()), |(invalid, number)| {
        let mut parameters = tutorial_parameters();
        match invalid {
            0 => parameters.time_step = number,
            1 => parameters.friction = number,
            axis => parameters.gravity[axis - 2] = number,
        }
        match World::new(parameters) {
            Err(error) => assert_names(&error, fields[invalid]),
            Ok(world) => check_run(&world, state(&ordinary()), native(&world), STEPS, &seen)?,
        }
        Ok(())
    });
    // A few percent below the deterministic count.
    seen.assert_counts(8150, 0, 0);
}

#[test]
#[ignore = "slow"]
fn a_state_of_any_numbers_is_refused_by_name_or_can_be_simulated() {
    let seen = Seen::default();
    let world = tutorial_world();
    each(10_000, (0..13_usize, wild()), |(invalid, number)| {
        let mut numbers = ordinary();
        numbers[invalid] = number;
        let field = match invalid {
            0..=2 => "position",
            3..=6 => "quaternion",
            7..=9 => "velocity",
            _ => "spin",
        };
        let start = state(&numbers);
        match start.checked() {
            Err(error) => assert_names(&error, field),
            Ok(_) => check_run(&world, start, native(&world), STEPS, &seen)?,
        }
        Ok(())
    });
    each(1000, vec(any_bits(), 13), |numbers| {
        if state(&numbers).checked().is_ok() {
            check_run(&world, state(&numbers), native(&world), STEPS, &seen)?;
        }
        Ok(())
    });
    // A few percent around the deterministic counts.
    seen.assert_counts(10_000, 51, 0);
}

/// Strategy for options with one unusual value and its Ipopt name.
fn odd_options() -> impl Strategy<Value = (Options, &'static str)> {
    let integer = prop_oneof![0..12_u32, any::<u32>()];
    (0..6_usize, wild(), integer, any::<[bool; 3]>()).prop_map(
        |(invalid, number, integer, [barrier, multipliers, scaling])| {
            let mut options = Options { max_iterations: 200, ..Options::default() };
            if barrier {
                options.barrier = BarrierStrategy::Adaptive;
            }
            if multipliers {
                options.multiplier_step = MultiplierStep::MinDualInfeasibility;
            }
            if scaling {
                options.scaling = Scaling::None;
            }
            let (real, whole) = match invalid {
                0 => (Some(&mut options.tolerance), None),
                1 => (Some(&mut options.initial_barrier), None),
                2 => (Some(&mut options.bound_push), None),
                3 => (None, Some(&mut options.mumps_pivot_order)),
                4 => (None, Some(&mut options.mumps_memory_percent)),
                _ => (None, Some(&mut options.min_refinement_steps)),
            };
            if let Some(real) = real {
                *real = number;
            }
            if let Some(whole) = whole {
                *whole = integer;
            }
            let names = ["tol", "mu_init", "bound_push", "mumps_pivot_order"];
            let more = ["mumps_mem_percent", "min_refinement_steps"];
            (options, names.into_iter().chain(more).nth(invalid).unwrap())
        },
    )
}

/// Ipopt with unusual options converges in most cases.
#[test]
fn options_of_any_numbers_are_refused_by_name_or_ipopt_takes_them() {
    let seen = Seen::default();
    let world = tutorial_world();
    each(120, odd_options(), |(options, name)| {
        match options.validate() {
            Err(error) => assert_names(&error, name),
            Ok(()) => {
                let solver = IpoptSolver::new(&world, options).unwrap();
                let accepted = ACCEPTED_RESIDUAL * world.speed_scale();
                let solver = (Box::new(solver) as Box<dyn StepSolver>, accepted);
                check_run(&world, state(&ordinary()), solver, STEPS, &seen)?;
            }
        }
        Ok(())
    });
    each(2000, any::<u32>(), |max_iterations| {
        let options = Options { max_iterations, ..Options::default() };
        prop_assert_eq!(options.validate().is_ok(), max_iterations <= 1_000_000);
        Ok(())
    });
    // Some valid options do not converge in 200 iterations or to their tolerance.
    seen.assert_counts(49, 0, 14);
}

#[test]
fn a_smoothing_of_any_size_is_refused_by_name_or_taken() {
    each(2000, wild(), |smoothing| {
        let taken = StepNlp::new(tutorial_world(), smoothing);
        prop_assert_eq!(taken.is_ok(), (1e-12..=1.0).contains(&smoothing));
        if let Err(error) = taken {
            assert_names(&error, "smoothing");
        }
        Ok(())
    });
}

/// Evaluation at any finite point must not panic. Overflow is allowed.
#[test]
fn the_program_can_be_evaluated_at_any_finite_point() {
    let steps = (any_world(), vec(finite(), 13), uniform8(finite()));
    let points = steps.prop_flat_map(|(world, old, alpha)| {
        let nlp = StepNlp::new(world, SMOOTHING).unwrap();
        let (x, rows) = (nlp.layout().variables(), nlp.layout().constraints());
        (Just((nlp, old, alpha)), vec(finite(), x), vec(finite(), rows), finite())
    });
    each(5000, points, |((mut nlp, old, alpha), x, multipliers, factor)| {
        let push = Wrench {
            force: Vector3::from_column_slice(&alpha[..3]),
            torque: Vector3::from_column_slice(&alpha[3..6]),
        };
        nlp.set_step(&state(&old), &push, alpha);
        let layout = nlp.layout();
        let mut jacobian = vec![0.0; nlp.jacobian_pattern().len()];
        let mut hessian = vec![0.0; nlp.hessian_pattern().len()];
        nlp.gradient(&x, &mut vec![0.0; layout.variables()]);
        nlp.constraints(&x, &mut vec![0.0; layout.constraints()]);
        nlp.jacobian(&x, &mut jacobian);
        nlp.hessian(&x, factor, &multipliers, &mut hessian);
        prop_assert!(!nlp.objective(&x).is_nan());
        Ok(())
    });
}
