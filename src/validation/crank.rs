//! A slider-crank whose slider is pressed on a stop.

use super::pendulum::TOO_EXACT;
use super::prelude::*;
use crate::joint::{Drive, Joint, JointFrame};

/// The crank r and the rod l, m; the crank's angle θ, rad; the torque on it, N m.
const CRANK: f64 = 0.2;
const ROD: f64 = 0.5;
const ANGLE: f64 = 1.0;
const TORQUE: f64 = 50.0;
/// Nothing comes near the ground, m.
const HEIGHT: f64 = 2.0;
/// s.
const DURATION: f64 = 0.1;

/// A crank, a rod and a slider.
pub static SLIDER_CRANK: Posed = Posed {
    name: "slider-crank",
    about: "A torque on the crank of a slider-crank presses its slider on a stop with the force \
            M dθ/dx, by virtual work: M/(r sin θ + r² sin θ cos θ/√(l² − r² sin² θ)).",
    time_step: 0.005,
    inputs: &[(Input::Mass, 2.0)],
    bodies: 3,
    beyond_ipopt: TOO_EXACT,
    ..Posed::by(slider_crank)
};

/// The crank points from the origin along (cos θ, 0, −sin θ), its joint at r, the slider at
/// x = r cos θ + √(l² − r² sin² θ) on the x axis. The virtual work of the torque and of the stop's force N is
/// nothing:
///
/// ```text
/// M δθ + N δx = 0,   dx/dθ = −r sin θ − r² sin θ cos θ/√(l² − r² sin² θ)
/// ```
///
/// At rest so is the step's, whatever h is: its reactions act where the joints are.
fn slider_crank(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (mass, h) = (inputs.get(Input::Mass)?, laboratory.time_step());
    let (sin, cos) = ANGLE.sin_cos();
    let along = (ROD * ROD - (CRANK * sin).powi(2)).sqrt();
    let pressed = TORQUE / (CRANK * sin + CRANK * CRANK * sin * cos / along);
    let middle = Vector3::new(0.0, 0.0, HEIGHT);
    let elbow = middle + CRANK * Vector3::new(cos, 0.0, -sin);
    let end = middle + Vector3::x() * (CRANK * cos + along);
    // A bar of this half length whose middle is at `place`, turned by `angle` about y.
    let bar = |half: f64, place: Vector3<f64>, angle: f64| {
        let (sin, cos) = (0.5 * angle).sin_cos();
        let attitude = Vector4::new(cos, 0.0, sin, 0.0);
        let start = State { position: place, attitude, ..resting(HEIGHT) };
        Subject::solid_box(mass, Vector3::new(half, 0.01, 0.01), start)
    };
    let lean = -(CRANK * sin).atan2(along);
    let bodies = vec![
        bar(0.5 * CRANK, 0.5 * (middle + elbow), ANGLE)?,
        bar(0.5 * ROD, 0.5 * (elbow + end), lean)?,
        bar(0.02, end, 0.0)?,
    ];
    let x = |x: f64| Vector3::new(x, 0.0, 0.0);
    let hinge = |at: Vector3<f64>| JointFrame::along(at, Vector3::y());
    let slide = |at: Vector3<f64>| JointFrame::along(at, Vector3::x());
    let torque = Drive { force: TORQUE, ..Drive::NONE };
    let stop = Drive { limits: Some([0.0, 1.0]), ..Drive::NONE };
    let joints = vec![
        Joint::revolute(0, None, [hinge(x(-0.5 * CRANK))?, hinge(middle)?], torque),
        Joint::revolute(1, Some(0), [hinge(x(-0.5 * ROD))?, hinge(x(0.5 * CRANK))?], Drive::NONE),
        Joint::spherical(
            2,
            Some(1),
            [JointFrame::at(Vector3::zeros()), JointFrame::at(x(0.5 * ROD))],
        ),
        Joint::prismatic(2, None, [slide(Vector3::zeros())?, slide(end)?], stop),
    ];
    let setup = Setup { joints, ..Setup::new(bodies, 0.0, 0.5, DURATION) };
    let (run, forces) = laboratory.watch(&setup, |step| step.joints[3].force[2])?;
    let found = forces[forces.len() - 1];
    let lacked = run.largest(|residual| residual.momentum + residual.joint);
    let rounding = 256.0 * f64::EPSILON * HEIGHT / CRANK * pressed;
    let ways = (0..3).map(|body| (run.end(body).position - run.states(body)[0].position).norm());
    Ok(Findings {
        quantities: vec![
            exactly(
                ("force on the stop", "N"),
                found,
                pressed,
                16.0 * mass * lacked / h + rounding,
            ),
            at_most_zero(
                ("longest way of a body", "m"),
                ways.fold(0.0, f64::max),
                4.0 * DURATION * lacked + 64.0 * f64::EPSILON * HEIGHT,
            ),
        ],
        curve: run.curve_of_steps(("force on the stop", "N"), |k| forces[k]).beside(|_| pressed),
    })
}
