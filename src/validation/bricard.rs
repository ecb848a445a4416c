//! Bricard's mechanism: five rods and six hinges that are one too many to move, and move.

use super::pendulum::TOO_EXACT;
use super::prelude::*;
use super::quantity::at_most;
use crate::joint::{Drive, Joint, JointFrame};
use crate::mechanics::quaternion::{left, rotation};

/// Of every rod: kg, and half the sides, m.
const MASS: f64 = 1.0;
const HALF_SIDES: Vector3<f64> = Vector3::new(0.5, 0.05, 0.05);
const GRAVITY: f64 = 9.81;
/// The corners at the start, the ends in the world, m; and the axes of the hinges there.
const CORNERS: [[f64; 3]; 6] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, -1.0, 1.0],
    [0.0, -1.0, 1.0],
    [0.0, 0.0, 1.0],
];
const AXES: [usize; 6] = [1, 2, 0, 1, 2, 0];
/// Where the corner P₃ is after [`DURATION`], m.
const END: Vector3<f64> = Vector3::new(0.510_501, -1.649_168, 0.140_123);
/// s.
const DURATION: f64 = 1.0;
/// Of the origin above the ground, m, so that nothing comes near it.
const HEIGHT: f64 = 4.0;
/// Half a unit of the last digit of [`END`] in each axis, m.
const DIGITS: f64 = 1e-6;

/// Bricard's mechanism.
pub static BRICARD: Posed = Posed {
    name: "bricard",
    about: "Bricard's mechanism, five rods between six hinges with one equation too many, falls from rest: after 1 s \
            its corner P₃ is where the published benchmark has it, and no hinge is off.",
    time_step: 0.002,
    bodies: 5,
    beyond_ipopt: TOO_EXACT,
    ..Posed::by(bricard)
};

/// The benchmark of M. González, D. Dopico, U. Lugrís and J. Cuadrado, "A benchmarking system for MBS simulation
/// software", Multibody System Dynamics 16, 2006; its gravity is along −y. From rest a state k of the step is that of the time
/// (k + ½) h to second order, and the mean of two states that of the time between them.
fn bricard(_: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let h = laboratory.time_step();
    Unsuitable::when(h > 0.01, || format!("a step of {h} s is too long for its second order"))?;
    // The benchmark's y is up: its axes x, y, z are x, z and −y of the world.
    let up = JointFrame::along(Vector3::zeros(), -Vector3::y())?;
    let upright = rotation(&up.attitude);
    let corner = |k: usize| upright * Vector3::from(CORNERS[k]) + Vector3::z() * HEIGHT;
    let axis = |k: usize| upright.column(AXES[k]).into_owned();
    let laid = |rod: usize| {
        let (from, to) = (Vector3::from(CORNERS[rod]), Vector3::from(CORNERS[rod + 1]));
        let way = to - from;
        let turn = Vector4::new(1.0 + way[0], 0.0, -way[2], way[1]);
        let turn =
            if turn.norm() > 0.1 { turn.normalize() } else { Vector4::new(0.0, 0.0, 0.0, 1.0) };
        let position = 0.5 * (corner(rod) + corner(rod + 1));
        State { position, attitude: left(&up.attitude) * turn, ..resting(HEIGHT) }
    };
    let starts: Vec<_> = (0..5).map(laid).collect();
    let points: Vec<_> = [-1.0, 1.0].map(|end| Vector3::x() * (end * HALF_SIDES[0])).to_vec();
    let inertia = crate::mechanics::body::solid_box_inertia(MASS, &HALF_SIDES);
    let bodies = starts
        .iter()
        .map(|start| Ok(Subject::new(RigidBody::new(MASS, inertia, &points)?, *start)));
    let bodies = bodies.collect::<Result<Vec<_>, Unsuitable>>()?;
    let own = |rod: usize, k: usize| {
        let (start, end) = (&starts[rod], if k == rod { points[0] } else { points[1] });
        let about = rotation(&start.attitude).tr_mul(&axis(k));
        JointFrame::along(end, about)
    };
    // The two frames of a hinge differ by a turn about its axis alone.
    let joints = (0..6).map(|k| {
        let (a, other) = match k {
            0 => (0, JointFrame::along(corner(0), axis(0))?),
            5 => (4, JointFrame::along(corner(5), axis(5))?),
            k => (k, own(k - 1, k)?),
        };
        let b = (1..5).contains(&k).then(|| k - 1);
        Ok(Joint::revolute(a, b, [own(a, k)?, other], Drive::NONE))
    });
    let joints = joints.collect::<Result<Vec<_>, crate::error::Error>>()?;
    let setup = Setup { joints: joints.clone(), ..Setup::new(bodies, GRAVITY, 0.5, DURATION) };
    let run = laboratory.run(&setup)?;
    let third = |k: usize| {
        let state = &run.states(2)[k];
        let place = state.position + rotation(&state.attitude) * points[1];
        upright.tr_mul(&(place - Vector3::z() * HEIGHT))
    };
    let steps = run.steps();
    let found = 0.5 * (third(steps - 1) + third(steps));
    let mut worst = (0.0_f64, 0.0_f64);
    for k in 0..=steps {
        let states: Vec<_> = (0..5).map(|rod| run.states(rod)[k]).collect();
        for joint in &joints {
            let (place, turn) = joint.error(&states).unwrap_or((f64::NAN, f64::NAN));
            worst = (worst.0.max(place), worst.1.max(turn));
        }
    }
    // Of the middle of two velocities, at the place between them.
    let energy = |k: usize| -> f64 {
        let each = (0..5).map(|rod| {
            let kinetic = |state: &State| {
                let spin = &state.spin;
                0.5 * (MASS * state.velocity.norm_squared() + spin.dot(&(inertia * spin)))
            };
            let (now, next) = (&run.states(rod)[k], &run.states(rod)[k + 1]);
            0.5 * (kinetic(now) + kinetic(next)) + MASS * GRAVITY * now.position[2]
        });
        each.sum()
    };
    let strayed = (0..steps).map(|k| (energy(k) - energy(0)).abs()).fold(0.0, f64::max);
    Ok(Findings {
        quantities: vec![
            at_most(
                ("way of P₃ from its published place", "m"),
                (found - END).norm(),
                DIGITS + h * h,
            ),
            at_most(("largest way of a hinge from its place", "m"), worst.0, 1e-12),
            at_most(("largest angle of a hinge from its axis", "rad"), worst.1, 1e-12),
            at_most(("energy, its largest change", "J"), strayed, 10.0 * h * h),
        ],
        curve: Curve::of(("height of P₃", "m"), &run, |k| third(k)[1]).beside(|_| f64::NAN),
    })
}
