//! A Stewart platform on six legs.

use crate::prelude::*;
use std::f64::consts::FRAC_PI_3;
use tumble_core::joint::Motor;
use tumble_core::mechanics::body::solid_box_inertia;

/// Radii R of the feet and r of the platform's joints (m), and half the angle φ between them (rad).
const FEET: f64 = 0.6;
const PLATFORM: f64 = 0.3;
const SKEW: f64 = 0.45;
/// The platform above the feet at the start, and these above the ground, m.
const ABOVE: f64 = 0.8;
const GROUND: f64 = 1.0;
/// Half the sides of the platform and of both rods of a leg, m; a rod's share of the platform's mass.
const HALF_SIDES: Vector3<f64> = Vector3::new(0.3, 0.3, 0.03);
const ROD: Vector3<f64> = Vector3::new(0.02, 0.02, 0.25);
const LIGHTER: f64 = 0.1;
/// Speeds of odd and even legs (m/s), and simulated time (s).
const GROWTH: [f64; 2] = [0.2, 0.1];
const DURATION: f64 = 0.4;
/// R² + r² and 2 R r, m².
const SQUARES: f64 = FEET * FEET + PLATFORM * PLATFORM;
const PRODUCT: f64 = 2.0 * FEET * PLATFORM;

/// Six legs that grow at two speeds lift a platform and turn it: L² = R² + r² + z² − 2 R r cos(ψ ±
/// φ) at every step. Held, each bears ∂V/∂L of the potential, by virtual work.
pub(crate) const STEWART: TestProblem = TestProblem {
    name: "stewart",
    time_step: 0.004,
    inputs: &[(Mass, 10.0), EARTH],
    bodies: 13,
    ..TestProblem::solved_by(stewart)
};

/// A body with the corners of a box as contact points, and without pieces: rods may cross.
fn body(mass: f64, half: Vector3<f64>, start: State) -> Result<Subject, Error> {
    let corner = |k: usize| {
        half.map_with_location(|axis, _, side| if k >> axis & 1 == 1 { side } else { -side })
    };
    let points: [Vector3<f64>; 8] = std::array::from_fn(corner);
    Ok(Subject::new(RigidBody::new(mass, solid_box_inertia(mass, &half), &points)?, start))
}

/// The platform, then the lower and the upper rod of each leg, with these drives of odd and even legs.
fn setup([mass, gravity]: [f64; 2], drives: [Drive; 2], duration: f64) -> Result<Setup, Refusal> {
    let mut bodies = vec![body(mass, HALF_SIDES, resting(GROUND + ABOVE))?];
    let mut joints = Vec::new();
    for leg in 0..6 {
        let on_platform = FRAC_PI_3 * leg as f64;
        let aside = if leg % 2 == 0 { SKEW } else { -SKEW };
        let around = |radius: f64, angle: f64| radius * v3(angle.cos(), angle.sin(), 0.0);
        let foot = around(FEET, on_platform + aside) + Vector3::z() * GROUND;
        let held = around(PLATFORM, on_platform);
        let way = held + Vector3::z() * (GROUND + ABOVE) - foot;
        let (length, along) = (way.norm(), way.normalize());
        let standing = JointFrame::along(foot, along)?;
        let rod = |from: f64| {
            let start = State { attitude: standing.attitude, ..at_rest(foot + along * from) };
            body(LIGHTER * mass, ROD, start)
        };
        let (lower, upper) = (bodies.len(), bodies.len() + 1);
        bodies.extend([rod(ROD[2])?, rod(length - ROD[2])?]);
        let z = |z: f64| JointFrame::at(Vector3::z() * z);
        let sliding = [z(0.0), z(length - 2.0 * ROD[2])];
        joints.extend([
            Joint::universal(lower, None, [z(-ROD[2]), standing]),
            Joint::prismatic(upper, Some(lower), sliding, drives[leg % 2]),
            Joint::spherical(upper, Some(0), [z(ROD[2]), JointFrame::at(held)]),
        ]);
    }
    Ok(Setup { joints, ..Setup::new(bodies, gravity, 0.5, duration) })
}

/// The platform is at height z and turned by ψ. Each leg rests with the length L = √(z² + c²) and
/// carries the force f:
///
/// ```text
/// L₁² = R² + r² + z² − 2 R r cos(φ − ψ),   sin ψ = (L₂² − L₁²)/(4 R r sin φ)
/// 6 f = M g L/z + 6 m g (s c²/(z L²) + z/L + (L − s) c²/(z L²))
/// ```
fn stewart(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let (values, h) = (inputs.all([Mass, Gravity])?, runner.time_step);
    let [mass, gravity] = values;
    let beside = SQUARES - PRODUCT * SKEW.cos();
    let length = (beside + ABOVE * ABOVE).sqrt();
    let aslant = beside / (ABOVE * length * length);
    let of_legs = LIGHTER * mass * gravity * (length * aslant + ABOVE / length);
    let bears = mass * gravity * length / (6.0 * ABOVE) + of_legs;

    let held = Drive { friction: 100.0 * bears, ..Drive::NONE };
    let (still, forces) = runner.watch(&setup(values, [held; 2], 10.0 * h)?, |step| {
        [0, 1, 2, 3, 4, 5].map(|leg: usize| step.joints[3 * leg + 1].force[2])
    })?;
    let worst = last(&forces).map(|force| force - bears);
    let worst = worst.into_iter().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
    let lacked = still.largest(|r| r.momentum + r.joint);
    let force_off = bears * (32.0 * lacked / (gravity * h) + 1024.0 * f64::EPSILON);
    let still_off = 10.0 * h * lacked + still.rounding(32.0 * GROUND);

    let motors = GROWTH.map(|target| Drive {
        motor: Some(Motor::Speed { target, max_force: 1e6 * mass }),
        ..Drive::NONE
    });
    let run = runner.run(&setup(values, motors, DURATION)?)?;
    let exact = |t: f64| {
        let [one, next] = GROWTH.map(|growth| (length + growth * t).powi(2));
        let turn = ((next - one) / (2.0 * PRODUCT * SKEW.sin())).asin();
        ((one - SQUARES + PRODUCT * (turn - SKEW).cos()).sqrt(), turn)
    };
    let (above, turn) = exact(run.end_time());
    let lifted = |state: &State| state.position[2] - GROUND;
    let astray = run.most(0, |state| {
        let tilt = 2.0 * state.attitude[1].hypot(state.attitude[2]);
        state.position[0].hypot(state.position[1]).max(tilt)
    });
    // The motors hold speeds: the errors of steps add up.
    let off = 32.0 * h * run.sum(|r| r.joint) + run.rounding(32.0 * GROUND);
    let end = run.end(0);
    Ok(vec![
        equal(("height of the platform", "m"), lifted(end), above, off),
        equal(("angle that it has turned", "rad"), angle_about(2, end), turn, off),
        at_most_zero(("way across and tilt, the larger one", "m"), astray, off),
        equal(("force of a held leg, the worst", "N"), bears + worst, bears, force_off),
        at_most_zero(("way of the held platform", "m"), still.moved(0), still_off),
    ])
}
