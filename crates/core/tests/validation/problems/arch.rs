//! An arch of three voussoirs on the ground.

use crate::prelude::*;
use std::f64::consts::PI;

const STONES: usize = 3; // Stones
/// Radii of the half ring, and half its width, m.
const INNER: f64 = 0.7;
const OUTER: f64 = 1.3;
const HALF_WIDTH: f64 = 0.3;
const DURATION: f64 = 0.3; // s
const POINTS: f64 = 16.0; // Corners of two feet and two joints
const STANDS: f64 = 1.3; // The friction of the arch at rest, as a multiple of the threshold
const INCLINED: f64 = 0.577_350_269_189_625_8; // T = tan φ

/// Stone `index`, from the right.
fn stone(mass: f64, index: usize) -> Result<Subject, Refusal> {
    let mut corners = Vec::new();
    for joint in [index, index + 1] {
        let (sin, cos) = (PI * joint as f64 / STONES as f64).sin_cos();
        // The feet stand on the ground to the last bit.
        let sin = if joint % STONES == 0 { 0.0 } else { sin };
        for radius in [INNER, OUTER] {
            corners.extend([-HALF_WIDTH, HALF_WIDTH].map(|y| v3(radius * cos, y, radius * sin)));
        }
    }
    let (body, centre) = RigidBody::solid(mass, &[Piece::hull(&corners, 0.0)?])?;
    Ok(Subject::new(body, at_rest(centre)))
}

/// The tolerance of the force of a step at rest, as a share of the weight of a stone. It covers the
/// contact law of each point, the residual of velocities and the velocity change due to positions.
fn force_tolerance(run: &TestRun, gravity: f64) -> f64 {
    let lacked = run.largest(|r| r.momentum) + 2.0 * run.largest(|r| r.kinematics);
    let missed = run.largest(|r| r.normal) + run.largest(|r| r.friction);
    (6.0 * lacked + 2.0 * POINTS * missed) / (gravity * run.time_step) + 64.0 * f64::EPSILON
}

/// Half a ring of three equal voussoirs stands on the ground if friction in its joints and under
/// its feet is at least (√(4T² + 3) − 2T)/3, T = tan 30°: then its thrust is held.
pub(crate) const ARCH: TestProblem = TestProblem {
    name: "arch",
    time_step: 0.005,
    inputs: &[(Mass, 20.0), EARTH],
    bodies: STONES,
    ..TestProblem::solved_by(arch)
};

/// ³⁄₂ W under a foot, ½ W in a joint, and a thrust H between its bounds:
///
/// ```text
/// ½ cot(φ + λ) ≤ H/W ≤ ³⁄₂ μ for some H if μ ≥ (√(4 T² + 3) − 2 T)/3,   tan λ = μ
/// ```
fn arch(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, gravity] = inputs.all([Mass, Gravity])?;
    let weight = mass * gravity;
    let needed = ((4.0 * INCLINED * INCLINED + 3.0).sqrt() - 2.0 * INCLINED) / 3.0;
    let setup = |friction: f64| {
        let stones = (0..STONES).map(|index| stone(mass, index)).collect::<Result<_, _>>()?;
        Ok::<_, Refusal>(Setup::new(stones, gravity, friction, DURATION))
    };
    let friction = STANDS * needed;
    let (run, forces) = runner.watch(&setup(friction)?, |step| {
        let sum = |partner: Partner| -> Vector3<f64> {
            step.between(0, partner).map(|contact| contact.force).sum()
        };
        (sum(Partner::Ground), sum(Partner::Body(1)))
    })?;
    let (foot, joint) = *last(&forces);
    let (thrust, carried) = (joint[0].abs() / weight, joint[2].abs() / weight);
    let allowed = force_tolerance(&run, gravity);
    let least = 0.5 * (1.0 - friction * INCLINED) / (friction + INCLINED);
    let longest = largest((0..STONES).map(|index| run.moved(index)));
    let still = 8.0 * run.seat() + 2.0 * run.creep();
    let twice = |run: &TestRun| 2.0 * force_tolerance(run, gravity);
    let found = Threshold::at_rest(runner, needed, setup, twice)?;
    Ok(vec![
        equal(("force under a foot", "W"), foot[2] / weight, 1.5, allowed),
        equal(("vertical force in a joint", "W"), carried, 0.5, allowed),
        at_most_zero(("thrust above the most, 3/2 μ", "W"), thrust - 1.5 * friction, allowed),
        at_most_zero(("thrust below the least, ½ cot(φ + λ)", "W"), least - thrust, allowed),
        at_most_zero(("longest way of a stone", "m"), longest, still),
        found.equals(("threshold of friction", "1"), needed),
    ])
}
