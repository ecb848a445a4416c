//! Bricard's mechanism: five rods and six hinges with one redundant constraint.

use crate::prelude::*;
use tumble_core::mechanics::body::solid_box_inertia;
use tumble_core::mechanics::quaternion::left;

/// Number of rods. Mass (kg) and half sides (m) of each.
const RODS: usize = 5;
const MASS: f64 = 1.0;
const HALF_SIDES: Vector3<f64> = Vector3::new(0.5, 0.05, 0.05);
const GRAVITY: f64 = 9.81;
/// The initial corners (m), with the first and the last one fixed in the world, and the initial
/// axes of the hinges.
const CORNERS: [[f64; 3]; RODS + 1] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, -1.0, 1.0],
    [0.0, -1.0, 1.0],
    [0.0, 0.0, 1.0],
];
const AXES: [usize; RODS + 1] = [1, 2, 0, 1, 2, 0];
/// The published position of the corner P₃ after [`DURATION`], m, and half a unit of its last digit.
const END: Vector3<f64> = Vector3::new(0.510_501, -1.649_168, 0.140_123);
const DIGITS: f64 = 1e-6;
const DURATION: f64 = 1.0; // s
const HEIGHT: f64 = 4.0; // The origin above the ground, m

/// Bricard's mechanism, five rods between six hinges with one equation too many, falls from rest:
/// after 1 s its corner P₃ is where the published benchmark has it, and no hinge is off.
pub(crate) const BRICARD: TestProblem = TestProblem {
    name: "bricard",
    time_step: 0.002,
    bodies: RODS,
    ..TestProblem::solved_by(bricard)
};

/// P₃ as published by González and others (2006). State k of the scheme from rest is at the time
/// (k + ½) h to second order.
fn bricard(_: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let h = runner.time_step;
    Refusal::when(
        h > 0.01,
        format!("a time step of {h} s is too long for second order; use a smaller one"),
    )?;
    // The benchmark's axes x, y, z are x, z and −y of the world.
    let up = JointFrame::along(Vector3::zeros(), -Vector3::y())?;
    let upright = rotation(&up.attitude);
    let corner = |k: usize| upright * Vector3::from(CORNERS[k]) + Vector3::z() * HEIGHT;
    let axis = |k: usize| upright.column(AXES[k]).into_owned();
    let starts: Vec<_> = (0..RODS)
        .map(|rod| {
            let way = Vector3::from(CORNERS[rod + 1]) - Vector3::from(CORNERS[rod]);
            let turn = Vector4::new(1.0 + way[0], 0.0, -way[2], way[1]);
            let half_turn = Vector4::new(0.0, 0.0, 0.0, 1.0);
            let turn = if turn.norm() > 0.1 { turn.normalize() } else { half_turn };
            let attitude = left(&up.attitude) * turn;
            State { attitude, ..at_rest(0.5 * (corner(rod) + corner(rod + 1))) }
        })
        .collect();
    let ends = [-1.0, 1.0].map(|end| Vector3::x() * (end * HALF_SIDES[0]));
    let inertia = solid_box_inertia(MASS, &HALF_SIDES);
    let bodies =
        starts.iter().map(|start| Ok(Subject::new(RigidBody::new(MASS, inertia, &ends)?, *start)));
    let bodies = bodies.collect::<Result<_, Error>>()?;
    let own = |rod: usize, k: usize| {
        let end = if k == rod { ends[0] } else { ends[1] };
        JointFrame::along(end, rotation(&starts[rod].attitude).tr_mul(&axis(k)))
    };
    // The two frames of a hinge differ by a turn about its axis alone.
    let joints = (0..=RODS).map(|k| {
        let (a, b) = (k.min(RODS - 1), (1..RODS).contains(&k).then(|| k - 1));
        let other = b.map_or_else(|| JointFrame::along(corner(k), axis(k)), |b| own(b, k))?;
        Ok(Joint::revolute(a, b, [own(a, k)?, other], Drive::NONE))
    });
    let joints = joints.collect::<Result<Vec<_>, Error>>()?;
    let setup = Setup { joints, ..Setup::new(bodies, GRAVITY, 0.5, DURATION) };
    let run = runner.run(&setup)?;
    let third = |k: usize| {
        let state = &run.states(2)[k];
        let place = state.position + rotation(&state.attitude) * ends[1];
        upright.tr_mul(&(place - Vector3::z() * HEIGHT))
    };
    let steps = run.steps();
    let astray = (0.5 * (third(steps - 1) + third(steps)) - END).norm();
    let mut worst = (0.0_f64, 0.0_f64);
    for k in 0..=steps {
        let states: Vec<_> = (0..RODS).map(|rod| run.states(rod)[k]).collect();
        for joint in &setup.joints {
            let (place, turn) = joint.error(&states).unwrap_or((f64::NAN, f64::NAN));
            worst = (worst.0.max(place), worst.1.max(turn));
        }
    }
    // The mean kinetic energy of two velocities, and the position between them.
    let energy = |k: usize| -> f64 {
        let each = (0..RODS).map(|rod| {
            let kinetic = |state: &State| {
                let spin = &state.spin;
                0.5 * (MASS * state.velocity.norm_squared() + spin.dot(&(inertia * spin)))
            };
            let (now, next) = (&run.states(rod)[k], &run.states(rod)[k + 1]);
            0.5 * (kinetic(now) + kinetic(next)) + MASS * GRAVITY * now.position[2]
        });
        each.sum()
    };
    let strayed = largest((0..steps).map(|k| (energy(k) - energy(0)).abs()));
    Ok(vec![
        at_most(("way of P₃ from its published place", "m"), astray, DIGITS + h * h),
        at_most(("largest way of a hinge from its place", "m"), worst.0, 1e-12),
        at_most(("largest angle of a hinge from its axis", "rad"), worst.1, 1e-12),
        at_most(("energy, its largest change", "J"), strayed, 10.0 * h * h),
    ])
}
