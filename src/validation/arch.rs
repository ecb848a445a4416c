//! An arch of three voussoirs on the ground: it stands if friction holds its thrust.
//!
//! Half a ring is cut into three equal stones of the weight W. The joints between the keystone
//! and the springers are inclined by φ = 30° to the vertical, the springers stand on the ground.
//! Half of the keystone's weight and the thrust H go through each joint; its normal is inclined by φ
//! to the horizontal, and with the angle of friction λ, tan λ = μ, the force stays within λ of it:
//!
//! ```text
//! φ − λ ≤ atan(½ W/H) ≤ φ + λ,   so that H ≥ ½ W cot(φ + λ)
//! ```
//!
//! A springer slides outwards unless H ≤ μ (W + ½ W). Both hold for some H if
//!
//! ```text
//! ½ (1 − μ T) ≤ ³⁄₂ μ (T + μ),   T = tan φ:   μ ≥ (√(4 T² + 3) − 2 T)/3
//! ```
//!
//! The stones are thick enough for the thrust line: about the middle of a springer's foot it passes
//! by a tenth of its thickness. Where an unsymmetric H or line would do, the mean of it and its mirror
//! image does, for cones and joints are convex.

use super::prelude::*;
use std::f64::consts::PI;

/// Stones.
const STONES: usize = 3;
/// Of the half ring, and half its width, m.
const INNER: f64 = 0.7;
const OUTER: f64 = 1.3;
const HALF_WIDTH: f64 = 0.3;
/// s.
const DURATION: f64 = 0.3;
/// Thresholds are looked for to this share of them.
const RESOLUTION: f64 = 1e-6;
/// It falls if a stone is this fast, as a share of g times the time.
const FALLING: f64 = 1e-8;
/// Corners that press: of two feet and two joints.
const POINTS: f64 = 16.0;
/// The arch that is looked at stands with this many times the friction that it takes.
const STANDS: f64 = 1.3;

/// T = tan φ.
const INCLINED: f64 = 0.577_350_269_189_625_8;

/// (√(4 T² + 3) − 2 T)/3: the friction that it takes.
fn needed() -> f64 {
    ((4.0 * INCLINED * INCLINED + 3.0).sqrt() - 2.0 * INCLINED) / 3.0
}

/// Stone `index`, from the right: the body, and where its centre is.
fn stone(mass: f64, index: usize) -> Result<Subject, Unsuitable> {
    let mut corners = Vec::new();
    for joint in [index, index + 1] {
        let (sin, cos) = (PI * joint as f64 / STONES as f64).sin_cos();
        // The feet stand on the ground to the last bit.
        let sin = if joint % STONES == 0 { 0.0 } else { sin };
        for radius in [INNER, OUTER] {
            let corner = |y: f64| Vector3::new(radius * cos, y, radius * sin);
            corners.extend([corner(-HALF_WIDTH), corner(HALF_WIDTH)]);
        }
    }
    let (body, centre) = RigidBody::solid(mass, &[Piece::hull(&corners, 0.0)?])?;
    let mut start = resting(0.0);
    start.position = centre;
    Ok(Subject::new(body, start))
}

/// What the residuals allow the force of a step at rest, as a share of the weight of a stone: each
/// point's law, what velocities lack, and the change of a velocity that positions make.
fn force_slack(run: &Run, gravity: f64) -> f64 {
    let lacked = run.largest(|r| r.momentum) + 2.0 * run.largest(|r| r.kinematics);
    let missed = run.largest(|r| r.normal) + run.largest(|r| r.friction);
    (6.0 * lacked + 2.0 * POINTS * missed) / (gravity * run.time_step) + 64.0 * f64::EPSILON
}

/// Three voussoirs.
pub static ARCH: Posed = Posed {
    name: "arch",
    about: "Half a ring of three equal voussoirs stands on the ground if friction in its joints \
            and under its feet is at least (√(4T² + 3) − 2T)/3, T = tan 30°: then its thrust is \
            held.",
    time_step: 0.005,
    inputs: &[(Input::Mass, 20.0), EARTH],
    bodies: STONES,
    ..Posed::by(arch)
};

/// With 1.3 times the friction that it takes: half of all weight under each foot, ³⁄₂ W, half of
/// the keystone's in each joint, and a thrust between the two bounds; and the threshold. All are
/// those of a step at rest, whatever h is.
fn arch(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (mass, gravity) = (inputs.get(Input::Mass)?, inputs.get(Input::Gravity)?);
    let (weight, needed) = (mass * gravity, needed());
    let setup = |friction: f64| {
        let stones = (0..STONES).map(|index| stone(mass, index)).collect::<Result<_, _>>()?;
        Ok::<_, Unsuitable>(Setup::new(stones, gravity, friction, DURATION))
    };
    let friction = STANDS * needed;
    let (run, forces) = laboratory.watch(&setup(friction)?, |step| {
        let sum = |body: usize, partner: Partner| -> Vector3<f64> {
            step.between(body, partner).map(|contact| contact.force).sum()
        };
        (sum(0, Partner::Ground), sum(0, Partner::Body(1)))
    })?;
    let (foot, joint) = forces[forces.len() - 1];
    let thrust = joint[0].abs() / weight;
    let slack = force_slack(&run, gravity);
    let least = 0.5 * (1.0 - friction * INCLINED) / (friction + INCLINED);
    let way = |index: usize| {
        let states = run.states(index);
        (states[run.steps()].position - states[0].position).norm()
    };
    let longest = (0..STONES).map(way).fold(0.0, f64::max);
    let found = Threshold::near(needed, RESOLUTION * needed, |friction| {
        let run = laboratory.run(&setup(friction)?)?;
        Ok((run.fastest_at_end() <= FALLING * gravity * DURATION, 2.0 * force_slack(&run, gravity)))
    })?;
    Ok(Findings {
        quantities: vec![
            exactly(("force under a foot", "W"), foot[2] / weight, 1.5, slack),
            exactly(("vertical force in a joint", "W"), joint[2].abs() / weight, 0.5, slack),
            at_most_zero(("thrust above the most, 3/2 μ", "W"), thrust - 1.5 * friction, slack),
            at_most_zero(("thrust below the least, ½ cot(φ + λ)", "W"), least - thrust, slack),
            at_most_zero(
                ("longest way of a stone", "m"),
                longest,
                8.0 * run.seat() + 2.0 * run.creep(),
            ),
            found.beside(("threshold of friction", "1"), needed),
        ],
        curve: run
            .curve_of_steps(("force under a foot", "W"), |k| forces[k].0[2] / weight)
            .beside(|_| 1.5),
    })
}
