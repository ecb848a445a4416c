//! Derivatives of the rows of all joint types, compared with central differences.

use super::*;
use crate::derivative::StateChange;
use crate::joint::{Drive, JointFrame, Middle};
use crate::kinematics::Rotation;
use nalgebra::Vector4;

const STEP: f64 = 0.01;
const LENGTH: f64 = 0.3;

/// Pseudo-random number between −1 and 1.
fn draw(twister: &mut rand_mt::Mt) -> f64 {
    f64::from(twister.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0
}

fn vector(twister: &mut rand_mt::Mt) -> Vector3<f64> {
    Vector3::from_fn(|_, _| draw(twister))
}

fn attitude(near: f64, twister: &mut rand_mt::Mt) -> Vector4<f64> {
    let v = vector(twister) * near;
    Vector4::new(1.0, v[0], v[1], v[2]).normalize()
}

/// Joints of every type, between two bodies and between a body and the world, all with an armature.
fn joints(twister: &mut rand_mt::Mt) -> Vec<Joint> {
    let drive = Drive { armature: 0.2, ..Drive::NONE };
    let free = Axis::Free(drive);
    let mut all = Vec::new();
    for other in [Some(1), None] {
        let mut frame = || JointFrame { anchor: vector(twister), attitude: attitude(0.3, twister) };
        let frames = [frame(), frame()];
        all.push(Joint::revolute(0, other, frames, drive));
        all.push(Joint::prismatic(0, other, frames, drive));
        all.push(Joint::cylindrical(0, other, frames, [drive, drive]));
        all.push(Joint::fixed(0, other, frames));
        all.push(Joint::planar(0, other, frames));
        all.push(Joint::ball(0, other, frames, 1.0, drive));
        all.push(Joint::universal(0, other, frames));
        all.push(Joint::gimbal(0, other, frames, [drive; 3]));
        let middle = Middle { backwards: true, zero: 0.3 };
        all.push(Joint::gimbal(0, other, frames, [drive; 3]).with_middle(middle));
        let axes = [free, Axis::Locked, free];
        all.push(Joint::revolute(0, other, frames, drive).with_axes(axes, [Axis::Locked; 3]));
    }
    all
}

/// Step of `h` (s).
fn step(h: f64) -> StepMap {
    StepMap { form: Rotation::Momentum, time_step: h }
}

/// Closed forms of the differentiated quantities as functions of the states and h: u, the
/// coordinates, their rates, the impulse and its torques.
fn rows(
    joint: &Joint,
    states: &[State],
    ends: &[State],
    h: f64,
    about: bool,
    angles: &Vector3<f64>,
    impulse: &Vector3<f64>,
) -> [Vector3<f64>; 6] {
    let at = joint.coordinates(states).unwrap();
    let counted = joint.counted(&at, angles);
    let after: Vec<State> = states
        .iter()
        .zip(ends)
        .map(|(state, end)| State { velocity: end.velocity, spin: end.spin, ..*state })
        .map(|state| step(h).coasted(&state))
        .collect();
    let [a, b] = joint.frames();
    let pose = |body: Option<usize>| body.map_or_else(still, |body| states[body].pose());
    let (of_a, of_b) = (pose(Some(0)), pose(joint.other()));
    let starts = joint.starts(states, &at, &counted, &step(h));
    let has_other = if joint.other().is_some() { 1.0 } else { 0.0 };
    let rates = |starts: &[crate::joint::AxisStart; 3]| Vector3::from_fn(|k, _| starts[k].rate);
    if about {
        let before = joint.other().map(|other| &states[other].spin);
        let turn =
            Turn::new(joint, &at, angles, &step(h), LENGTH).with_stop(&states[0].spin, before);
        let other = joint.other().map(|other| &ends[other].spin);
        let torque = turn.torque_map() * impulse;
        let on_b = of_b.rotation.tr_mul(&(of_a.rotation * torque)) * has_other;
        let u = turn.u(&ends[0].spin, other);
        return [u, counted, rates(&starts[1]), Vector3::zeros(), torque, on_b];
    }
    let end = joint.coordinates(&after).unwrap();
    let is_free = |k: usize| joint.linear()[k] != Axis::Locked;
    let u =
        Vector3::from_fn(|k, _| (end.place[k] - if is_free(k) { at.place[k] } else { 0.0 }) / h);
    let along = of_b.rotation * (b.rotation() * impulse);
    let anchor = of_a.position + of_a.rotation * a.anchor;
    let torque = |pose: &Pose| pose.rotation.tr_mul(&(anchor - pose.position).cross(&along));
    [u, at.place, rates(&starts[0]), along, torque(&of_a), torque(&of_b) * has_other]
}

/// Fourth-order central differences for all joint types; they agree to about 1e-10.
#[test]
fn the_rows_of_every_joint_change_as_their_closed_forms() {
    const BY: f64 = 2e-4;
    let twister = &mut rand_mt::Mt::new(11);
    for joint in joints(twister) {
        for _ in 0..4 {
            let mut state = |near: f64| State {
                position: vector(twister),
                attitude: attitude(near, twister),
                velocity: vector(twister),
                spin: vector(twister) * 5.0,
            };
            let (states, ends) = ([state(0.3), state(0.3)], [state(0.0), state(0.0)]);
            let impulse = vector(twister);
            let at = joint.coordinates(&states).unwrap();
            let angles = joint.counted(&at, &Vector3::zeros());
            let velocities =
                [Some(0), joint.other()].map(|b| b.map(|b| (ends[b].velocity, ends[b].spin)));
            let tangent = JointTangent::new(&joint, &states, &step(STEP), velocities);
            for about in [false, true] {
                let found = if about {
                    tangent.turn_rows(&angles, LENGTH, &impulse).unwrap()
                } else {
                    tangent.place_rows(&impulse)
                };
                let rates = found.rates.clone().map_or_else(
                    || Rates {
                        by_poses: ByPoses::zeros(),
                        by_velocities: ByPoses::zeros(),
                        by_time_step: Vector3::zeros(),
                    },
                    |rates| *rates,
                );
                let here = |by: f64, k: usize| {
                    let mut moved = states;
                    let mut h = STEP;
                    if k == 24 {
                        h += by * STEP;
                    } else {
                        let mut change = [0.0; 12];
                        change[k % 12] = by;
                        let change = StateChange::from_array(&change);
                        moved[k / 12] = change.applied(&states[k / 12]);
                    }
                    rows(&joint, &moved, &ends, h, about, &angles, &impulse)
                };
                let both = if joint.other().is_some() { 24 } else { 12 };
                for k in (0..both).chain([24]) {
                    let all = [BY, -BY, 2.0 * BY, -2.0 * BY].map(|by| here(by, k));
                    let scale = if k == 24 { STEP } else { 1.0 };
                    // Only rows with an armature have rates.
                    for of in (0..6).filter(|of| *of != 2 || found.rates.is_some()) {
                        let [a, b, c, d] = all.each_ref().map(|rows| rows[of]);
                        let expected = ((a - b) * 8.0 - (c - d)) / (12.0 * BY * scale);
                        // Columns of poses hold both sides one after another.
                        let (side, number) = (k / 12, k % 12);
                        let column = 6 * side + number % 6;
                        let is_pose = number < 6;
                        let stop = |of: usize| {
                            let stop = found.stop.as_ref()?;
                            let row = 3 * (of - 4);
                            Some(match k {
                                24 => stop.by_time_step.fixed_rows::<3>(row).into_owned(),
                                _ => stop.by_velocities.fixed_view::<3, 1>(row, column).into(),
                            })
                        };
                        let slope = match (of, k) {
                            (4.., _) if !is_pose || k == 24 => stop(of).unwrap_or_default(),
                            (0, 24) => found.by_time_step,
                            (2, 24) => rates.by_time_step,
                            (_, 24) => Vector3::zeros(),
                            (0, _) if is_pose => found.motion.column(column).into(),
                            (1, _) if is_pose => found.coordinates.column(column).into(),
                            (2, _) if is_pose => rates.by_poses.column(column).into(),
                            (2, _) => rates.by_velocities.column(column).into(),
                            (3.., _) if is_pose => {
                                found.load.fixed_view::<3, 1>(3 * (of - 3), column).into()
                            }
                            _ => Vector3::zeros(),
                        };
                        // Torques do not include the change of the impulse.
                        let turned = match of {
                            4.. if is_pose && k < 24 && !about => {
                                let of = of - 4;
                                let pushed = found.load.fixed_view::<3, 1>(0, column);
                                let pose = tangent.pose(of, START);
                                let a = tangent.pose(0, START);
                                let anchor = a.position + a.rotation * joint.frames()[0].anchor;
                                let has = f64::from(u8::from(tangent.sides[of].is_some()));
                                let arm = (anchor - pose.position) * has;
                                pose.rotation.tr_mul(&arm.cross(&pushed))
                            }
                            _ => Vector3::zeros(),
                        };
                        let mut slope = slope + turned;
                        let mut expected: Vector3<f64> = expected;
                        // Coordinates of locked axes have no law.
                        let axes = if about { joint.angular() } else { joint.linear() };
                        let locked = |k: &usize| axes[*k] == Axis::Locked;
                        for k in (0..3).filter(locked).filter(|_| of == 1 || of == 2) {
                            (slope[k], expected[k]) = (0.0, 0.0);
                        }
                        let size = 1.0 + expected.amax();
                        let off = (slope - expected).amax() / size;
                        // Differences with respect to h use a step of BY h, and rates have rounding
                        // errors of 1e-16/h.
                        let exact = if k == 24 { 1e-6 } else { 1e-8 };
                        assert!(off < exact, "{joint:?} {about} {of} {k}: {slope} {expected}");
                    }
                }
            }
        }
    }
}
