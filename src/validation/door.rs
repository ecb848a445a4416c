//! A door on two hinges, each of which could hold it alone.

use super::pendulum::TOO_EXACT;
use super::prelude::*;
use super::quantity::at_most;
use crate::joint::{Drive, Joint, JointFrame};

/// Width, thickness and height, m.
const SIDES: Vector3<f64> = Vector3::new(0.9, 0.04, 2.0);
/// Between the hinges, m.
const APART: f64 = 1.4;
/// ℓ of the hinges, m: half the width of a bearing.
const BEARINGS: [f64; 2] = [0.05, 0.67];
/// Of the door's middle, m: nothing comes near the ground.
const HEIGHT: f64 = 3.0;
/// What the limit of vanishing compliance leaves of a share that the motion does not tell, of the force that is shared.
const LEFT_BY_THE_LIMIT: f64 = 1e-8;
/// s.
const DURATION: f64 = 0.1;

/// A door.
pub static DOOR: Posed = Posed {
    name: "door",
    about: "A door hangs on two hinges, of which one would do: they share its moment m g ½b by \
            forces F and moments M with F d + 2 M = m g ½b and M/F = 2 ℓ²/d, each with half of the \
            weight.",
    time_step: 0.004,
    inputs: &[(Input::Mass, 20.0), EARTH],
    beyond_ipopt: TOO_EXACT,
    ..Posed::by(door)
};

/// Of all forces F and moments M of the two hinges that hold the door, F d + 2 M = T with T = ½ m g b, the selection rule has those
/// with the least Σ F² + (M/ℓ)²:
///
/// ```text
/// F = T d/(d² + 4 ℓ²),   M = 2 T ℓ²/(d² + 4 ℓ²)
/// ```
///
/// At rest so is the step's, whatever h is.
fn door(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let [mass, gravity] = inputs.all([Input::Mass, Input::Gravity])?;
    let h = laboratory.time_step();
    let weight = mass * gravity;
    let moment = 0.5 * weight * SIDES[0];
    let mut quantities = Vec::new();
    let mut curve = Curve::default();
    let names = [
        [
            "narrow bearings: force across",
            "moment of a hinge",
            "weight on both",
            "how unlike the weights on them are",
            "way of the door",
        ],
        [
            "wide bearings: force across",
            "moment of a hinge, too",
            "weight on both, too",
            "how unlike these are",
            "way of the door, too",
        ],
    ];
    for (length, names) in BEARINGS.into_iter().zip(names) {
        let start = resting(HEIGHT);
        let door = Subject::solid_box(mass, 0.5 * SIDES, start)?;
        let hinge = |above: f64| {
            let post = Vector3::new(-0.5 * SIDES[0], 0.0, above);
            let frames = [
                JointFrame::along(post, Vector3::z())?,
                JointFrame::along(post + start.position, Vector3::z())?,
            ];
            Ok::<_, Unsuitable>(Joint::revolute(0, None, frames, Drive::NONE).with_length(length))
        };
        let joints = vec![hinge(0.5 * APART)?, hinge(-0.5 * APART)?];
        let setup = Setup { joints, ..Setup::new(vec![door], gravity, 0.5, DURATION) };
        let (run, forces) =
            laboratory.watch(&setup, |step| [0, 1].map(|hinge| step.joints[hinge]))?;
        let [upper, lower] = forces[forces.len() - 1];
        let shared = APART * APART + 4.0 * length * length;
        let (across, about) = (moment * APART / shared, 2.0 * moment * length * length / shared);
        // A speed that is missed is that much of g h, of what the longest lever has.
        let lacked = run.largest(|residual| residual.momentum + residual.joint);
        let slack = weight * (16.0 * lacked / (gravity * h) + 256.0 * f64::EPSILON * HEIGHT);
        let way = (run.end(0).position - start.position).norm();
        let still = DURATION * run.largest(|r| r.joint + r.momentum) + run.rounding(HEIGHT);
        quantities.extend([
            exactly((names[0], "N"), 0.5 * (lower.force[0] - upper.force[0]), across, slack),
            exactly(
                (names[1], "N m"),
                0.5 * (upper.torque[1] + lower.torque[1]).abs(),
                about,
                slack,
            ),
            exactly((names[2], "N"), upper.force[2] + lower.force[2], weight, slack),
            at_most(
                (names[3], "N"),
                (upper.force[2] - lower.force[2]).abs(),
                LEFT_BY_THE_LIMIT * weight,
            ),
            at_most_zero((names[4], "m"), way, still),
        ]);
        curve = run.curve_of_steps((names[0], "N"), |k| forces[k][1].force[0]).beside(|_| across);
    }
    Ok(Findings { quantities, curve })
}
