//! The native solver takes the symmetries of the scene: turned, mirrored, and without
//! friction.

use crate::common::symmetry::mirrored;
use crate::toss::*;
use nalgebra::{Matrix3, Vector3};
use tumble_core::mechanics::State;
use tumble_core::simulation::StepRecord;
use tumble_core::world::{Parameters, World};

const SEEDS: [u32; 7] = [0, 1, 2, 3, 6, 8, 42];

/// Compares `other`, step by step, with `run` moved by `symmetry`.
///
/// A change of the start grows up to 370 times over a run, and rounding is 1e-13 of a step:
/// 4e-11. More comes from the choice of the motion where a face slides: Newton's method ends
/// at a residual of 1e-11 m/s with a compliance of 1e-6, so that the share of impulses that
/// the laws leave open is known to 1e-5 m/s and better, the motion to 1e-7. Measured: poses
/// to 2.6e-8, motions to 4.0e-7 m/s; allowed 1e-7 and 2e-6.
fn check_same(
    name: &str,
    world: &World,
    run: &[StepRecord],
    other: &[StepRecord],
    symmetry: impl Fn(&State) -> State,
) {
    for (step, other) in run.iter().zip(other) {
        let (expected, found) = (symmetry(step.next()), other.next());
        let pose = pose_apart(&expected, found);
        let motion = motion_apart(world, &expected, found);
        assert!(pose < 1e-7, "{name}, step {}: pose by {pose:e}", step.index);
        assert!(motion < 2e-6, "{name}, step {}: motion by {motion:e} m/s", step.index);
    }
}

#[test]
fn turning_the_scene_about_the_vertical_turns_the_run() {
    for body in cubes() {
        let world = World::new(parameters(body)).unwrap();
        for seed in SEEDS {
            let run = thrown_run(&world, seed);
            for angle in [0.5, 2.0, 4.0] {
                let other = native_run(&world, turned(&thrown(seed), angle), run.len());
                let name = format!("seed {seed} by {angle}");
                check_same(&name, &world, &run, &other, |state| turned(state, angle));
            }
        }
    }
}

#[test]
fn a_mirrored_scene_gives_the_mirrored_run() {
    let mirror = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
    for body in cubes() {
        let other_body = cube(mirror * body.inertia() * mirror);
        let world = World::new(parameters(body)).unwrap();
        let other_world = World::new(parameters(other_body)).unwrap();
        for seed in SEEDS {
            let run = thrown_run(&world, seed);
            let other = native_run(&other_world, mirrored(&thrown(seed)), run.len());
            check_same(&format!("seed {seed}"), &world, &run, &other, mirrored);
        }
    }
}

/// Exactly: no friction is added, so nothing is rounded.
#[test]
fn without_friction_the_horizontal_momentum_does_not_change() {
    for body in cubes() {
        let world = World::new(Parameters { friction: 0.0, ..parameters(body) }).unwrap();
        for seed in SEEDS {
            let run = thrown_run(&world, seed);
            assert!(worst_residual(&run) < 1e-10, "seed {seed}");
            let start = thrown(seed).velocity.xy();
            for step in run {
                assert_eq!(step.next().velocity.xy(), start, "seed {seed}");
                assert!(step.solution.forces().all(|force| force.xy() == start * 0.0));
            }
        }
    }
}
