//! Selected solution where the laws allow several. It is the limit of an equal, vanishing
//! compliance at every corner, for any initial point of the iteration.

use crate::common::draw::Draw;
use crate::common::prelude::*;
use crate::common::{points, state};
use crate::toss::*;
use std::f64::consts::FRAC_1_SQRT_2;

/// Number of starts of each step: one without forces, the others random.
const STARTS: u32 = 4;

/// Quarter of the weight of the tutorial's cube [N].
const QUARTER_WEIGHT: f64 = 10.0 * 9.81 / 4.0;

/// Solves every contact step of a run again, from no forces and from random ones, and compares the
/// motions.
fn check_starts(world: &World, seed: u32) {
    let mut solver = NativeSolver::new(world);
    let mut random = Draw::new(seed);
    let contacts = points(world);
    let run = thrown_run(world, seed);
    for step in run.iter().filter(|step| step.status() != StepStatus::Free) {
        for number in 0..STARTS {
            let none = vec![Vector3::zeros(); contacts];
            let forces = if number == 0 { none } else { random.forces(contacts) };
            let start = with_forces(world, step.state(), &forces);
            let again = solve_step(&mut solver, world, step.state(), &start);
            let apart = motion_apart(world, &again.solution.states[0], step.next());
            let name = format!("seed {seed}, step {}, start {number}", step.index);
            assert_ne!(again.report.status, StepStatus::Failed, "{name}");
            assert!(apart < 1e-7, "{name}: the motion differs by {apart:e} m/s");
        }
    }
}

/// Checks that all starts lead to the same motion.
///
/// Newton's method ends at a residual of 1e-11 m/s with a compliance of 1e-6. In the worst case the
/// undetermined part of the impulses has an error of 1e-5 m/s. The motion of a sliding face has a
/// hundredth of it: 1e-7 m/s.
#[test]
fn every_start_leads_a_light_cube_to_the_same_motion() {
    for seed in [0, 1, 2, 3, 6, 8, 42] {
        check_starts(&cube_world(LIGHT), seed);
    }
}

/// Checks the same for a solid cube.
#[test]
fn every_start_leads_a_solid_cube_to_the_same_motion() {
    for seed in [0, 1, 2, 3, 4, 6, 42] {
        check_starts(&cube_world(SOLID), seed);
    }
}

/// Checks the same for a cube whose principal axes are rotated against its sides.
#[test]
fn every_start_leads_a_cube_with_askew_axes_to_the_same_motion() {
    let world = World::new(parameters(cubes().remove(2))).unwrap();
    for seed in [0, 1, 2, 42] {
        check_starts(&world, seed);
    }
}

/// States of the cube at rest on each of its faces, at twelve angles about the vertical.
fn cubes_at_rest() -> impl Iterator<Item = State> {
    let half = FRAC_1_SQRT_2;
    let faces = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [half, half, 0.0, 0.0],
        [half, -half, 0.0, 0.0],
        [half, 0.0, half, 0.0],
        [half, 0.0, -half, 0.0],
    ];
    faces.into_iter().flat_map(|[w, x, y, z]| {
        let flat = state(&[0.3, -2.0, 1.0, w, x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        (0..12).map(move |turn| {
            let mut start = turned(&flat, 0.7 * f64::from(turn));
            start.attitude.normalize_mut();
            start
        })
    })
}

/// Checks the steps that were accepted without an iteration, because their impulses had settled and
/// obey the law. They must be the solutions that the selection rule requires. A solver without
/// history solves each step again, from no forces. The motion agrees to 1e-10 m/s, the residual of
/// a solved step. The forces agree to 1e-9 of a quarter of the weight.
#[test]
fn a_step_accepted_as_it_is_has_the_selected_forces() {
    let mut accepted = 0;
    for body in cubes() {
        let world = World::new(parameters(body)).unwrap();
        let mut solver = NativeSolver::new(&world);
        for seed in [0, 1, 2, 3, 4, 6, 8, 42] {
            let run = native_run(&world, thrown(seed), 1500);
            let presses = |step: &&StepRecord| {
                step.first().solution.contacts.iter().any(|contact| contact.carries_force())
            };
            for step in run.iter().filter(presses).filter(|step| step.report().iterations == 0) {
                let none = with_forces(&world, step.state(), &[Vector3::zeros(); 8]);
                let again = solve_step(&mut solver, &world, step.state(), &none);
                let motion = motion_apart(&world, &again.solution.states[0], step.next());
                let pairs = again.solution.forces().zip(step.first().solution.forces());
                let force = pairs.map(|(a, b)| (a - b).amax() / QUARTER_WEIGHT).fold(0.0, largest);
                let name = format!("seed {seed}, step {}", step.index);
                assert!(again.report.iterations > 0, "{name}");
                assert_eq!(
                    again.solution.contacts.len(),
                    step.first().solution.contacts.len(),
                    "{name}"
                );
                assert!(motion < 1e-10, "{name}: the motion differs by {motion:e} m/s");
                assert!(force < 1e-9, "{name}: a force differs by {force:e}");
                accepted += 1;
            }
        }
    }
    assert!(accepted > 10_000, "{accepted}");
}

/// Difference of a force from an upward quarter of the weight, relative to a quarter of the weight.
fn unequal(force: &Vector3<f64>) -> f64 {
    (force / QUARTER_WEIGHT - Vector3::z()).amax()
}

/// Checks that a cube at rest has four equal forces, to 1e-9 of a quarter of the weight.
///
/// A corner's height is a difference of numbers of 1 m with a rounding error of 2e-16 m. At the
/// shortest step that is 2e-12 m/s. With a compliance of 1e-6 it would be a hundredth of the
/// impulse of 2.5e-4 m/s. The solver treats such heights as zero, so that only the rounding of a
/// small linear system remains.
#[test]
fn a_cube_at_rest_presses_with_four_equal_forces() {
    for (inertia, h) in [LIGHT, SOLID].into_iter().flat_map(|i| [1e-4, 2e-3, 1e-2].map(|h| (i, h)))
    {
        let body = cube(Matrix3::from_diagonal_element(inertia));
        let world = World::new(Parameters { time_step: h, ..parameters(body) }).unwrap();
        for start in cubes_at_rest() {
            for step in native_run(&world, start, 20) {
                let carrying: Vec<_> =
                    step.first().solution.forces().filter(|f| f[2] > 0.0).collect();
                let worst = carrying.iter().map(unequal).fold(0.0, largest);
                assert_eq!(carrying.len(), 4, "h = {h}, step {}", step.index);
                assert!(worst < 1e-9, "h = {h}, step {}: {worst:e}", step.index);
            }
        }
    }
}

/// Checks that the friction that stopped the cube leaves no trace in the forces. Two seconds after
/// the stop they equal the forces of a cube placed at rest.
#[test]
fn a_thrown_cube_ends_on_four_equal_forces() {
    for (inertia, seed) in [LIGHT, SOLID].into_iter().flat_map(|i| (0..6).map(move |s| (i, s))) {
        let run = native_run(&cube_world(inertia), thrown(seed), 2000);
        let end = run.last().unwrap();
        let carrying: Vec<_> = end.first().solution.forces().filter(|f| f[2] > 0.0).collect();
        let worst = carrying.iter().map(unequal).fold(0.0, largest);
        assert_eq!(carrying.len(), 4, "inertia {inertia}, seed {seed}");
        assert!(worst < 1e-9, "inertia {inertia}, seed {seed}: {worst:e}");
    }
}
