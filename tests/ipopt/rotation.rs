//! Both solvers in the two forms of free rotation.

use crate::common::prelude::*;
use crate::common::{certify, flagged_contacts, point_forces, solve, tutorial_parameters};
use tumble::ipopt::Options;
use tumble::solver::ipopt::IpoptSolver;

/// Checks a spinning box that lands on a corner, with both solvers. Only steps with a single
/// contact point are compared, where the laws determine the motion. The forms differ by h (G −
/// G′), 0.02 rad/s and more, in such a step. Ipopt's solutions differ from the native ones by
/// at most a hundredth of that. Its residual of hard contact is at most 1e-4 m/s.
#[test]
fn both_solvers_land_a_skew_box_alike() {
    for form in Rotation::ALL {
        let (world, start) = in_form(&askew_box(), form);
        let options = Options { tolerance: 1e-9, ..IpoptSolver::options(1e-9, 300) };
        let mut ipopt = IpoptSolver::new(&world, options).unwrap();
        let mut run = Simulation::new(world.clone(), [start], Motion::native(&world)).unwrap();
        let (mut record, mut before) = (StepRecord::new(), StepSolution::free(&[start]));
        let mut compared = 0;
        for _ in 0..300 {
            run.step(&mut record).unwrap();
            let pressed: Vec<bool> = (0..8)
                .map(|point| {
                    let mut found = record.first().solution.contacts.iter();
                    found.any(|c| c.key.point == point && c.carries_force())
                })
                .collect();
            let (state, next) = (record.state(), record.next());
            if pressed.iter().filter(|pressed| **pressed).count() == 1 {
                let (none, contacts) = (Wrench::zero(), flagged_contacts(&world, state, &pressed));
                let (report, theirs) =
                    solve(&mut ipopt, &world, (state, &none), &contacts, &before);
                assert_eq!(report.status, StepStatus::Converged);
                let other = &theirs.states[0];
                let forces: Vec<Vector3<f64>> = point_forces(&world, &theirs);
                let certificate = certify(&world, (state, other), &forces, &none);
                let apart = (other.spin - next.spin).amax();
                assert!(apart < 2e-4, "{form:?} {}: {apart:e} rad/s", record.index);
                assert!(certificate.residual() < 1e-4, "{form:?} {certificate:?}");
                compared += 1;
            }
            before.clone_from(&record.first().solution);
        }
        assert!(compared >= 3, "{form:?}: {compared}");
    }
}

/// Box of 3 kg above the ground in the tutorial's form, thrown so that a corner lands first.
fn askew_box() -> (World, State) {
    let body = RigidBody::solid_box(3.0, Vector3::new(0.5, 0.3, 0.2)).unwrap();
    let given = Parameters { bodies: vec![body], ..tutorial_parameters() };
    let axes = rotation(&Vector4::new(0.7, 0.3, -0.5, 0.4).normalize());
    let start = State {
        position: Vector3::new(0.0, 0.0, 0.9),
        attitude: Vector4::new(0.5, -0.5, 0.1, 0.7).normalize(),
        velocity: Vector3::new(0.5, 0.0, -1.0),
        spin: 6.0 * (axes * Vector3::new(0.3, 1.0, 0.2)).normalize(),
    };
    (euler(given), start)
}

/// The same scene in another form.
fn in_form((world, start): &(World, State), rotation: Rotation) -> (World, State) {
    let given = Parameters { rotation, ..world.parameters().clone() };
    (euler(given), *start)
}
