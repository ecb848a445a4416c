//! Scaled copies of a scene are the same program for Ipopt: equal iterations, and equal motion in
//! the scene's own units.

use crate::common::prelude::*;
use crate::common::tutorial_parameters;
use tumble::solver::ipopt::{IpoptSolver, Ladder, MOST_ITERATIONS, Rung, TOLERANCE};
use tumble_core::simulation::random::random_attitude;

/// Factors for masses, lengths and gravity. Times scale with the square root of length over
/// gravity.
#[derive(Debug, Clone, Copy)]
struct Scale {
    mass: f64,
    length: f64,
    gravity: f64,
}

/// Scale of the tutorial's scene.
const ORIGINAL: Scale = Scale { mass: 1.0, length: 1.0, gravity: 1.0 };

/// Result of a step in the units of the original.
struct Taken {
    status: StepStatus,
    iterations: u32,
    next: State,
}

/// Runs a scaled solid cube of 2 m and 10 kg, thrown so that it touches the ground soon. `push` is
/// a force [N].
fn run(scale: Scale, friction: f64, push: f64, steps: usize) -> Vec<Taken> {
    let Scale { mass, length, gravity } = scale;
    let time = (length / gravity).sqrt();
    let speed = length / time;
    let inertia = Matrix3::from_diagonal(&Vector3::new(4.0, 5.0, 6.0)) * (mass * length * length);
    let half_sides = Vector3::repeat(length);
    let body = RigidBody::with_box_corners(10.0 * mass, inertia, half_sides).unwrap();
    let original = tutorial_parameters();
    let parameters = Parameters {
        bodies: vec![body],
        gravity: original.gravity * gravity,
        friction,
        time_step: original.time_step * time,
        ..original
    };
    let world = World::new(parameters).unwrap();
    let start = State {
        position: Vector3::new(0.0, 0.0, 1.75) * length,
        attitude: random_attitude(42),
        velocity: Vector3::new(0.0, 4.0, -1.0) * speed,
        spin: Vector3::new(0.0, -2.0, 1.0) / time,
    };
    let options = IpoptSolver::options(TOLERANCE, MOST_ITERATIONS);
    let ipopt = IpoptSolver::new(&world, options).unwrap();
    let motion = Motion::contact(Ladder::new(&world, ipopt, &Rung::ALL));
    let mut simulation = Simulation::new(world, [start], motion).unwrap();
    let force = Vector3::new(0.1 * push, 0.0, -push) * (mass * gravity);
    simulation.set_wrench(0, Wrench { force, torque: Vector3::zeros() }).unwrap();
    let mut record = StepRecord::new();
    let taken = (0..steps).map(|_| {
        simulation.step(&mut record).unwrap();
        let next = record.next();
        Taken {
            status: record.status(),
            iterations: record.report().iterations,
            next: State {
                position: next.position / length,
                attitude: next.attitude,
                velocity: next.velocity / speed,
                spin: next.spin * time,
            },
        }
    });
    taken.collect()
}

/// Masses over nine decades, sizes over five, gravity over two, separately and together. The
/// factors are not powers of two, so that every number is rounded differently.
const COPIES: [Scale; 11] = [
    Scale { mass: 1e-4, ..ORIGINAL },
    Scale { mass: 0.03, ..ORIGINAL },
    Scale { mass: 1e2, ..ORIGINAL },
    Scale { mass: 1e5, ..ORIGINAL },
    Scale { length: 0.0005, ..ORIGINAL },
    Scale { length: 0.0071, ..ORIGINAL },
    Scale { length: 0.3, ..ORIGINAL },
    Scale { length: 50.0, ..ORIGINAL },
    Scale { gravity: 0.165, ..ORIGINAL },
    Scale { gravity: 9.7, ..ORIGINAL },
    Scale { mass: 7e-4, length: 0.011, gravity: 3.1 },
];

/// Number of steps. Every impact amplifies rounding, which in longer runs decides whether an end is
/// within the tolerance.
const STEPS: usize = 100;

/// Compares the copies with the original. Rounding differs by some 10⁻¹⁶ per step, and Ipopt's
/// steps and the impacts amplify it. Ends that differ by less than Ipopt's tolerance, 10⁻⁶, are
/// equivalent for it.
fn check(friction: f64, push: f64) {
    let original = run(ORIGINAL, friction, push, STEPS);
    let iterations: u32 = original.iter().map(|step| step.iterations).sum();
    let contact = original.iter().filter(|step| step.status != StepStatus::Free).count();
    assert!(contact > 30 && iterations > 60, "{contact} contact steps, {iterations} iterations");
    for scale in COPIES {
        for (k, (a, b)) in original.iter().zip(run(scale, friction, push, STEPS)).enumerate() {
            assert_eq!(a.status, b.status, "{scale:?}, {friction}, step {k}");
            assert_eq!(a.iterations, b.iterations, "{scale:?}, {friction}, step {k}");
            let apart = (a.next.to_vector() - b.next.to_vector()).amax();
            assert!(apart < 1e-6, "{scale:?}, {friction}, step {k}: {apart:e}");
        }
    }
}

#[test]
#[ignore = "slow"]
fn scaled_copies_take_the_same_iterations() {
    check(0.3, 0.0);
}

#[test]
#[ignore = "slow"]
fn scaled_copies_without_friction_take_the_same_iterations() {
    check(0.0, 0.0);
}
