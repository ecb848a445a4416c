//! The solvers from any valid state: no panic, finite numbers, and a status that the
//! certificate bears out.

use super::each;
use super::steps::{Seen, check_run, native};
use crate::common::{any_model, quaternion, tutorial_model, vector};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use tumble::contact::plane::Plane;
use tumble::mechanics::body::RigidBody;
use tumble::mechanics::quaternion::rotation;
use tumble::mechanics::state::State;
use tumble::solver::ipopt::{Formulation, IpoptSolver, LADDER_CERTIFICATE, Ladder, Rung};
use tumble::world::{ContactModel, Parameters};

/// Steps of each run.
const STEPS: usize = 4;

/// A valid state: at an ordinary or an absurd speed, high above the ground, near it, or deep
/// below.
fn start() -> impl Strategy<Value = State> {
    let size = || prop_oneof![4 => 0.0..5.0, 1 => (0.0..5.0).prop_map(|x| 10_f64.powf(x))];
    let moving = || {
        (vector(1.0), size())
            .prop_map(|(direction, size): (Vector3<f64>, f64)| direction * size.min(99_999.0))
    };
    let height = prop_oneof![4 => -3.0..3.0, 1 => -1e6..1e6];
    (height, quaternion(), moving(), moving()).prop_map(|(z, q, velocity, spin)| State {
        position: Vector3::new(0.0, 0.0, z),
        attitude: q.normalize(),
        velocity,
        spin,
    })
}

/// A number from `low` to `high`, each factor of ten as likely as any other.
fn spread(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

/// Any model that is valid, possible or not: a box of 1e-9 to 1e9 kg, moments of 1e-12 to
/// 1e12 kg m².
fn absurd_model() -> impl Strategy<Value = ContactModel> {
    let moments = (spread(1e-12, 1e6), spread(1.0, 1e6), spread(1.0, 1e6));
    let inertia = (moments, quaternion()).prop_map(|((least, second, third), q)| {
        let axes = rotation(&q.normalize());
        let moments = Vector3::new(1.0, second, third) * (0.99 * least);
        let full = axes * Matrix3::from_diagonal(&moments) * axes.transpose();
        0.5 * (full + full.transpose())
    });
    let sides = (spread(1e-6, 1e4), spread(1e-6, 1e4), spread(1e-6, 1e4));
    let body = (spread(1e-9, 1e9), inertia, sides).prop_filter_map(
        "an inertia that rounding leaves positive definite",
        |(mass, inertia, (x, y, z))| {
            RigidBody::with_box_corners(mass, inertia, Vector3::new(x, y, z)).ok()
        },
    );
    let gravity = (vector(1.0), spread(1e-3, 1e3)).prop_map(|(g, size)| g * size);
    (body, gravity, 0.0..10.0, spread(1e-6, 0.1), spread(1e-12, 1.0)).prop_map(
        |(body, gravity, friction, time_step, smoothing)| {
            let plane = Plane::level();
            let parameters = Parameters { body, plane, gravity, friction, time_step, smoothing };
            ContactModel::new(parameters).unwrap()
        },
    )
}

#[test]
fn the_native_solver_takes_any_valid_state() {
    let seen = Seen::default();
    let cube = tutorial_model();
    each(400, start(), |start| check_run(&cube, start, native(&cube), STEPS, &seen));
    each(300, (any_model(), start()), |(model, start)| {
        check_run(&model, start, native(&model), STEPS, &seen)
    });
    // Measured: 798, 212.
    seen.assert_counts(775, 225, 0);
}

#[test]
fn the_native_solver_takes_any_valid_model() {
    let seen = Seen::default();
    each(60, (absurd_model(), start()), |(model, start)| {
        check_run(&model, start, native(&model), STEPS, &seen)
    });
    // Measured: 12, 89.
    seen.assert_counts(10, 93, 0);
}

#[test]
fn the_ladder_takes_any_valid_state() {
    let seen = Seen::default();
    let check = |model: &ContactModel, start| {
        // A limit far below the 300 of the command line keeps hopeless steps short.
        let options = IpoptSolver::options(model, 1e-6, 60);
        let ipopt = IpoptSolver::new(model, Formulation::default(), options).unwrap();
        let ladder = Box::new(Ladder::new(model, ipopt, &Rung::ALL));
        check_run(model, start, (ladder, LADDER_CERTIFICATE), STEPS, &seen)
    };
    let cube = tutorial_model();
    each(16, start(), |start| check(&cube, start));
    each(16, (any_model(), start()), |(model, start)| check(&model, start));
    each(16, (absurd_model(), start()), |(model, start)| check(&model, start));
    // Measured: 42, 22.
    seen.assert_counts(40, 25, 0);
}
