//! A Stewart platform: six legs carry it, lift it and turn it.

use super::pendulum::TOO_EXACT;
use super::prelude::*;
use crate::joint::{Drive, Joint, JointFrame, Motor};
use crate::mechanics::body::solid_box_inertia;

/// Of the feet and of the joints of the platform from the axis, m; half the angle between their places, rad.
const FEET: f64 = 0.6;
const PLATFORM: f64 = 0.3;
const SKEW: f64 = 0.45;
/// Of the platform above the feet at the start, and of these above the ground, m.
const ABOVE: f64 = 0.8;
const GROUND: f64 = 1.0;
/// Half the sides of the platform and of both rods of a leg, m, and a rod's share of its mass.
const HALF_SIDES: Vector3<f64> = Vector3::new(0.3, 0.3, 0.03);
const ROD: Vector3<f64> = Vector3::new(0.02, 0.02, 0.25);
const LIGHTER: f64 = 0.1;
/// How fast the legs grow, one and the next, m/s; how long, s.
const GROWTH: [f64; 2] = [0.2, 0.1];
const DURATION: f64 = 0.4;

/// The platform.
pub static STEWART: Posed = Posed {
    name: "stewart",
    about: "Six legs that grow at two speeds lift a platform and turn it: L² = R² + r² + z² − 2 R r cos(ψ ± φ) at \
            every step. Held, each bears ∂V/∂L of the potential, by virtual work.",
    time_step: 0.004,
    inputs: &[(Input::Mass, 10.0), EARTH],
    bodies: 13,
    beyond_ipopt: TOO_EXACT,
    ..Posed::by(stewart)
};

/// R² + r², m².
const SQUARES: f64 = FEET * FEET + PLATFORM * PLATFORM;
/// 2 R r, m².
const PRODUCT: f64 = 2.0 * FEET * PLATFORM;

/// Bodies and joints of a platform whose legs are under these drives, one and the next: first the platform, then the lower and the
/// upper rod of each leg.
fn platform(mass: f64, drives: [Drive; 2]) -> Result<(Vec<Subject>, Vec<Joint>), Unsuitable> {
    let body = |mass: f64, half: Vector3<f64>, start: State| {
        let corner = |k: usize| {
            let sign = |axis: usize| if k >> axis & 1 == 1 { 1.0 } else { -1.0 };
            Vector3::from_fn(|axis, _| sign(axis) * half[axis])
        };
        let points: [Vector3<f64>; 8] = std::array::from_fn(corner);
        let body = RigidBody::new(mass, solid_box_inertia(mass, &half), &points)?;
        Ok::<_, Unsuitable>(Subject::new(body, start))
    };
    let mut bodies = vec![body(mass, HALF_SIDES, resting(GROUND + ABOVE))?];
    let mut joints = Vec::new();
    for leg in 0..6 {
        let on_platform = std::f64::consts::FRAC_PI_3 * leg as f64;
        let aside = if leg % 2 == 0 { SKEW } else { -SKEW };
        let around = |radius: f64, angle: f64| radius * Vector3::new(angle.cos(), angle.sin(), 0.0);
        let foot = around(FEET, on_platform + aside) + Vector3::z() * GROUND;
        let held = around(PLATFORM, on_platform);
        let way = held + Vector3::z() * (GROUND + ABOVE) - foot;
        let (length, along) = (way.norm(), way.normalize());
        let standing = JointFrame::along(foot, along)?;
        let rod = |from: f64| State {
            position: foot + along * from,
            attitude: standing.attitude,
            ..resting(GROUND)
        };
        let (lower, upper) = (bodies.len(), bodies.len() + 1);
        bodies.push(body(LIGHTER * mass, ROD, rod(ROD[2]))?);
        bodies.push(body(LIGHTER * mass, ROD, rod(length - ROD[2]))?);
        let z = |z: f64| JointFrame::at(Vector3::z() * z);
        joints.push(Joint::universal(lower, None, [z(-ROD[2]), standing]));
        joints.push(Joint::prismatic(
            upper,
            Some(lower),
            [z(0.0), z(length - 2.0 * ROD[2])],
            drives[leg % 2],
        ));
        joints.push(Joint::spherical(upper, Some(0), [z(ROD[2]), JointFrame::at(held)]));
    }
    Ok((bodies, joints))
}

/// The legs are as long as their motors have it at the end of every step, so that of one and the next, turned by ∓ψ + φ against the
/// platform,
///
/// ```text
/// L₁² = R² + r² + z² − 2 R r cos(φ − ψ),   L₂² = R² + r² + z² − 2 R r cos(φ + ψ),
/// sin φ = (L₂² − L₁²)/(4 R r sin ψ)
/// ```
///
/// and of the step's too. Held at the length L by friction, each leg has the force f with 6 f = dV/dL, z = √(L² − c²):
///
/// ```text
/// 6 f = M g L/z + 6 m g (s c²/(z L²) + z/L + (L − s) c²/(z L²))
/// ```
///
/// m being the mass of a rod and s from its joint to its middle.
fn stewart(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let [mass, gravity] = inputs.all([Input::Mass, Input::Gravity])?;
    let h = laboratory.time_step();
    let beside = SQUARES - PRODUCT * SKEW.cos();
    let length = (beside + ABOVE * ABOVE).sqrt();
    let aslant = beside / (ABOVE * length * length);
    let of_legs = LIGHTER * mass * gravity * (length * aslant + ABOVE / length);
    let bears = mass * gravity * length / (6.0 * ABOVE) + of_legs;

    let held = Drive { friction: 100.0 * bears, ..Drive::NONE };
    let (bodies, joints) = platform(mass, [held; 2])?;
    let setup = Setup { joints, ..Setup::new(bodies, gravity, 0.5, 10.0 * h) };
    let (still, forces) = laboratory.watch(&setup, |step| {
        [0, 1, 2, 3, 4, 5].map(|leg: usize| step.joints[3 * leg + 1].force[2])
    })?;
    let worst = forces[forces.len() - 1].map(|force| force - bears);
    let worst = worst.into_iter().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
    let lacked = |run: &Run| run.largest(|residual| residual.momentum + residual.joint);
    let of_forces = bears * (32.0 * lacked(&still) / (gravity * h) + 1024.0 * f64::EPSILON);
    let way = (still.end(0).position - still.states(0)[0].position).norm();

    let motor = |target: f64| Drive {
        motor: Some(Motor::Speed { target, most: 1e6 * mass }),
        ..Drive::NONE
    };
    let (bodies, joints) = platform(mass, GROWTH.map(motor))?;
    let setup = Setup { joints, ..Setup::new(bodies, gravity, 0.5, DURATION) };
    let run = laboratory.run(&setup)?;
    let wanted = |t: f64| {
        let [one, next] = GROWTH.map(|growth| (length + growth * t).powi(2));
        let turn = ((next - one) / (2.0 * PRODUCT * SKEW.sin())).asin();
        let above = (one - SQUARES + PRODUCT * (turn - SKEW).cos()).sqrt();
        (above, turn)
    };
    let (above, turn) = wanted(run.time(run.steps()));
    let lifted = |state: &State| state.position[2] - GROUND;
    let turned = |state: &State| 2.0 * state.attitude[3].atan2(state.attitude[0]);
    let aside = |state: &State| {
        let tilt = 2.0 * state.attitude[1].hypot(state.attitude[2]);
        state.position[0].hypot(state.position[1]).max(tilt)
    };
    // The motors hold speeds: what each of their steps is off by adds up.
    let slack = 32.0 * h * run.sum(|residual| residual.joint) + run.rounding(32.0 * GROUND);
    let farthest = run.states(0).iter().map(aside).fold(0.0, f64::max);
    Ok(Findings {
        quantities: vec![
            exactly(("height of the platform", "m"), lifted(run.end(0)), above, slack),
            exactly(("angle that it has turned", "rad"), turned(run.end(0)), turn, slack),
            at_most_zero(("way across and tilt, the larger one", "m"), farthest, slack),
            exactly(("force of a held leg, the worst", "N"), bears + worst, bears, of_forces),
            at_most_zero(
                ("way of the held platform", "m"),
                way,
                10.0 * h * lacked(&still) + still.rounding(32.0 * GROUND),
            ),
        ],
        curve: run.curve(("height of the platform", "m"), 0, lifted).beside(|t| wanted(t).0),
    })
}
