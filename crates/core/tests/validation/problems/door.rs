//! A door on two hinges. Each hinge could hold it alone.

use crate::prelude::*;

const SIDES: Vector3<f64> = Vector3::new(0.9, 0.04, 2.0); // Width, thickness and height, m
const APART: f64 = 1.4; // The distance of the hinges, m
const BEARINGS: [f64; 2] = [0.05, 0.67]; // ℓ of the hinges, m: half the width of a bearing
const HEIGHT: f64 = 3.0; // The door's centre above the ground, m
/// The error of the minimum-compliance limit in a share that the motion leaves open, of the shared force.
const LIMIT_ERROR: f64 = 1e-8;
const DURATION: f64 = 0.1; // s

/// A door hangs on two hinges, of which one would do: they share its moment m g ½b by forces F and
/// moments M with F d + 2 M = m g ½b and M/F = 2 ℓ²/d, each with half of the weight.
pub(crate) const DOOR: TestProblem = TestProblem {
    name: "door",
    time_step: 0.004,
    inputs: &[(Mass, 20.0), EARTH],
    ..TestProblem::solved_by(door)
};

/// Each hinge has the smallest Σ F² + (M/ℓ)² with F d + 2 M = T = ½ m g b:
///
/// ```text
/// F = T d/(d² + 4 ℓ²),   M = 2 T ℓ²/(d² + 4 ℓ²)
/// ```
fn door(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let ([mass, gravity], h) = (inputs.all([Mass, Gravity])?, runner.time_step);
    let weight = mass * gravity;
    let moment = 0.5 * weight * SIDES[0];
    let mut quantities = Vec::new();
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
        let joints = [0.5 * APART, -0.5 * APART].map(|above| {
            let post = v3(-0.5 * SIDES[0], 0.0, above);
            let hinge = hinge(0, None, [post, post + start.position], Vector3::z(), Drive::NONE);
            Ok(hinge?.with_length(length))
        });
        let joints = joints.into_iter().collect::<Result<_, Error>>()?;
        let setup = Setup { joints, ..Setup::new(vec![door], gravity, 0.5, DURATION) };
        let (run, forces) = runner.watch(&setup, |step| [0, 1].map(|hinge| step.joints[hinge]))?;
        let [upper, lower] = *last(&forces);
        let shared = APART * APART + 4.0 * length * length;
        let (across, about) = (moment * APART / shared, 2.0 * moment * length * length / shared);
        // A missed speed is a share of g h, with the longest lever.
        let lacked = run.largest(|r| r.momentum + r.joint);
        let off = weight * (16.0 * lacked / (gravity * h) + 256.0 * f64::EPSILON * HEIGHT);
        let still = DURATION * run.largest(|r| r.joint + r.momentum) + run.rounding(HEIGHT);
        let force = 0.5 * (lower.force[0] - upper.force[0]);
        let torque = 0.5 * (upper.torque[1] + lower.torque[1]).abs();
        let weights = [upper.force[2], lower.force[2]];
        let unlike = (weights[0] - weights[1]).abs();
        quantities.extend([
            equal((names[0], "N"), force, across, off),
            equal((names[1], "N m"), torque, about, off),
            equal((names[2], "N"), weights[0] + weights[1], weight, off),
            at_most((names[3], "N"), unlike, LIMIT_ERROR * weight),
            at_most_zero((names[4], "m"), run.moved(0), still),
        ]);
    }
    Ok(quantities)
}
