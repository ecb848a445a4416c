//! Solvers from any valid state: no panic, finite numbers, and a status consistent with the
//! certificate.

use super::each;
use super::steps::{Seen, check_run, native};
use crate::common::{any_rotation, any_world, quaternion, tutorial_world, vector};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use tumble::solver::ipopt::{IpoptSolver, LADDER_RESIDUAL, Ladder, Rung};
use tumble_core::contact::Plane;
use tumble_core::mechanics::quaternion::rotation;
use tumble_core::mechanics::{RigidBody, State};
use tumble_core::world::{Parameters, World};

/// Steps per run.
const STEPS: usize = 4;

/// Strategy for valid states at ordinary or extreme speeds, from far above the ground to deep below
/// it.
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

/// Strategy for log-uniform numbers from `low` to `high`.
fn spread(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

/// Strategy for valid worlds with extreme constants: a box of 1e-9 to 1e9 kg with any admissible
/// moments of inertia.
fn absurd_world() -> impl Strategy<Value = World> {
    // Moments of inertia in units of mass times length².
    let moments = (spread(1e-6, 1e6), spread(1.0, 1e6), spread(1.0, 1e6));
    let inertia = (moments, quaternion()).prop_map(|((least, second, third), q)| {
        let axes = rotation(&q.normalize());
        let moments = Vector3::new(1.0, second, third) * (0.99 * least);
        let full = axes * Matrix3::from_diagonal(&moments) * axes.transpose();
        0.5 * (full + full.transpose())
    });
    let sides = (spread(1e-6, 1e4), spread(1e-6, 1e4), spread(1e-6, 1e4));
    let body = (spread(1e-9, 1e9), inertia, sides).prop_filter_map(
        "an inertia that fits",
        |(mass, inertia, (x, y, z))| {
            let half_sides = Vector3::new(x, y, z);
            let unit = mass * half_sides.norm_squared();
            RigidBody::with_box_corners(mass, inertia * unit, half_sides).ok()
        },
    );
    let gravity = (vector(1.0), spread(1e-3, 1e3)).prop_map(|(g, size)| g * size);
    (body, gravity, 0.0..10.0, spread(1e-6, 0.1), any_rotation()).prop_map(
        |(body, gravity, friction, time_step, rotation)| {
            let (bodies, ground) = (vec![body], Plane::level());
            // The exponential may exceed its range by rounding.
            let time_step = f64::clamp(time_step, 1e-6, 0.1);
            let constants =
                Parameters { bodies, ground: Some(ground), gravity, friction, time_step, rotation };
            World::new(constants).unwrap()
        },
    )
}

#[test]
#[ignore = "slow"]
fn the_native_solver_takes_any_valid_state() {
    let seen = Seen::default();
    let cube = tutorial_world();
    each(400, start(), |start| check_run(&cube, start, native(&cube), STEPS, &seen));
    each(300, (any_world(), start()), |(world, start)| {
        check_run(&world, start, native(&world), STEPS, &seen)
    });
    // The steps of a start are excused together, so their count scatters: the seeds 71 to 76 have 365, 358, 291, 306,
    // 309 and 316 of 1250. The bound is their mean and three deviations. 930 to 954 steps are solved; exp and ln round
    // differently between platforms.
    seen.assert_counts(914, 414, 0);
}

#[test]
#[ignore = "slow"]
fn the_native_solver_takes_any_valid_world() {
    let seen = Seen::default();
    each(60, (absurd_world(), start()), |(world, start)| {
        check_run(&world, start, native(&world), STEPS, &seen)
    });
    // A small margin around the deterministic counts.
    seen.assert_counts(11, 125, 0);
}

#[test]
fn ladder_accepts_any_valid_state() {
    let seen = Seen::default();
    let check = |world: &World, start| {
        // Fewer iterations than the default of 300 keep unsolvable steps short.
        let options = IpoptSolver::options(1e-6, 60);
        let ipopt = IpoptSolver::new(world, options).unwrap();
        let ladder = Box::new(Ladder::new(world, ipopt, &Rung::ALL));
        let accepted = LADDER_RESIDUAL * world.speed_scale();
        check_run(world, start, (ladder, accepted), STEPS, &seen)
    };
    let cube = tutorial_world();
    each(16, start(), |start| check(&cube, start));
    each(16, (any_world(), start()), |(world, start)| check(&world, start));
    each(16, (absurd_world(), start()), |(world, start)| check(&world, start));
    // A few steps around the deterministic counts. One step of an extreme body is solved by neither
    // Ipopt nor the native solver.
    seen.assert_counts(47, 13, 1);
}
