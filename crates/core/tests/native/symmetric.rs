//! Symmetries of the native solver: rotated and mirrored scenes, and scenes without friction.

use crate::common::prelude::*;
use crate::common::symmetry::mirrored;
use crate::toss::*;

const SEEDS: [u32; 7] = [0, 1, 2, 3, 6, 8, 42];

/// Compares `other`, step by step, with `run` transformed by `symmetry`.
///
/// A change of the start grows up to 370 times over a run, and rounding is 1e-13 of a step: 4e-11.
/// A larger error comes from the motion of a sliding face. Newton's method ends at a residual of
/// 1e-11 m/s with a compliance of 1e-6. The impulses that the laws leave open then have an error of
/// up to 1e-5 m/s, the motion of up to 1e-7 m/s. The tolerances are 1e-7 for poses and 2e-6 m/s for
/// motions.
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

/// Checks that momentum is conserved exactly: no friction is added, so nothing is rounded.
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
                assert!(step.first().solution.forces().all(|force| force.xy() == start * 0.0));
            }
        }
    }
}
