//! A slider-crank whose slider is pressed on a stop.

use crate::prelude::*;

/// Crank r and rod l (m), crank angle θ (rad) and torque on the crank (N m).
const CRANK: f64 = 0.2;
const ROD: f64 = 0.5;
const ANGLE: f64 = 1.0;
const TORQUE: f64 = 50.0;
const HEIGHT: f64 = 2.0; // The crank's axis above the ground, m
const DURATION: f64 = 0.1; // s

/// A torque on the crank of a slider-crank presses its slider on a stop with the force M dθ/dx, by
/// virtual work: M/(r sin θ + r² sin θ cos θ/√(l² − r² sin² θ)).
pub(crate) const SLIDER_CRANK: TestProblem = TestProblem {
    name: "slider-crank",
    time_step: 0.005,
    inputs: &[(Mass, 2.0)],
    bodies: 3,
    ..TestProblem::solved_by(slider_crank)
};

/// M δθ + N δx = 0, dx/dθ = −r sin θ − r² sin θ cos θ/√(l² − r² sin² θ).
fn slider_crank(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let ([mass], h) = (inputs.all([Mass])?, runner.time_step);
    let (sin, cos) = ANGLE.sin_cos();
    let along = (ROD * ROD - (CRANK * sin).powi(2)).sqrt();
    let pressed = TORQUE / (CRANK * sin + CRANK * CRANK * sin * cos / along);
    let middle = v3(0.0, 0.0, HEIGHT);
    let elbow = middle + CRANK * v3(cos, 0.0, -sin);
    let end = middle + Vector3::x() * (CRANK * cos + along);
    let bar = |half: f64, place: Vector3<f64>, angle: f64| {
        let start = State { attitude: about_y(angle), ..at_rest(place) };
        Subject::solid_box(mass, v3(half, 0.01, 0.01), start)
    };
    let lean = -(CRANK * sin).atan2(along);
    let bodies = vec![
        bar(0.5 * CRANK, 0.5 * (middle + elbow), ANGLE)?,
        bar(0.5 * ROD, 0.5 * (elbow + end), lean)?,
        bar(0.02, end, 0.0)?,
    ];
    let x = |x: f64| v3(x, 0.0, 0.0);
    let slide = |at: Vector3<f64>| JointFrame::along(at, Vector3::x());
    let torque = Drive { force: TORQUE, ..Drive::NONE };
    let stop = Drive { limits: Some([0.0, 1.0]), ..Drive::NONE };
    let joints = vec![
        hinge(0, None, [x(-0.5 * CRANK), middle], Vector3::y(), torque)?,
        hinge(1, Some(0), [x(-0.5 * ROD), x(0.5 * CRANK)], Vector3::y(), Drive::NONE)?,
        Joint::spherical(2, Some(1), [JointFrame::at(x(0.0)), JointFrame::at(x(0.5 * ROD))]),
        Joint::prismatic(2, None, [slide(x(0.0))?, slide(end)?], stop),
    ];
    let setup = Setup { joints, ..Setup::new(bodies, 0.0, 0.5, DURATION) };
    let (run, forces) = runner.watch(&setup, |step| step.joints[3].force[2])?;
    let lacked = run.largest(|r| r.momentum + r.joint);
    let rounding = 256.0 * f64::EPSILON * HEIGHT / CRANK * pressed;
    let off = 16.0 * mass * lacked / h + rounding;
    let still = 4.0 * DURATION * lacked + 64.0 * f64::EPSILON * HEIGHT;
    let way = largest((0..3).map(|body| run.moved(body)));
    Ok(vec![
        equal(("force on the stop", "N"), *last(&forces), pressed, off),
        at_most_zero(("longest way of a body", "m"), way, still),
    ])
}
