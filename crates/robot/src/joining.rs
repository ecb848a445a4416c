//! Mapping of the joints of a link to one joint of a scene, with drives on its axes.

use super::frame::{attitude_from_matrix, from_z};
use super::model::{Actuator, Moves, Robot, RobotJoint, TieForces};
use nalgebra::{Matrix3, Vector3, Vector4};
use tumble_core::joint::{Drive, Hinges, JointFrame, Middle, Motor};
use tumble_model::joint::JointKind;
use tumble_model::shown;

/// Tolerance for parallel and perpendicular directions.
const ALIGNED: f64 = 1e-9;

/// Scene joint that represents all joints of a link.
#[derive(Debug, Clone)]
pub struct Joined {
    /// Type of the joint.
    pub kind: JointKind,
    /// Anchor (m), in the frame of the link. `None` if any point is valid.
    pub anchor: Option<Vector3<f64>>,
    /// Attitude of the joint frame in the link, and attitude of the parent's joint frame in the
    /// link at zero angles.
    pub attitudes: [Vector4<f64>; 2],
    /// Middle frame of a gimbal.
    pub middle: Option<Middle>,
    /// Index of the joint for each axis with a drive, among the joints of the link.
    pub axes: Vec<usize>,
}

/// Scene joint for `joints`. `None` for a free joint without damping, friction, armature or
/// stiffness.
///
/// # Errors
/// Joints that form no scene joint; a ball joint with a range.
pub fn joined(joints: &[RobotJoint]) -> Result<Option<Joined>, String> {
    let along = |axis: &Vector3<f64>| from_z(axis);
    let made = |kind, anchor, attitude, axes: &[usize]| Joined {
        kind,
        anchor,
        attitudes: [attitude; 2],
        middle: None,
        axes: axes.to_vec(),
    };
    let still = Vector4::new(1.0, 0.0, 0.0, 0.0);
    Ok(Some(match joints {
        [joint] => match joint.moves {
            Moves::Free if !joint.resists() => return Ok(None),
            Moves::Free => {
                if joint.stiffness > 0.0 && joint.friction > 0.0 {
                    return Err(format!(
                        "{}: a free joint with both stiffness and frictionloss is not supported",
                        joint.at
                    ));
                }
                made(JointKind::Free, Some(Vector3::zeros()), still, &[0; 6])
            }
            Moves::Ball if joint.range.is_some() => {
                return Err(format!("{}: a ball with a range is not supported", joint.at));
            }
            Moves::Ball => made(JointKind::Spherical, Some(joint.anchor), still, &[0; 3]),
            Moves::Hinge => made(JointKind::Revolute, Some(joint.anchor), along(&joint.axis), &[0]),
            Moves::Slide => made(JointKind::Prismatic, None, along(&joint.axis), &[0]),
        },
        // A slide along the axis of a hinge
        [slide, hinge]
            if (slide.moves, hinge.moves) == (Moves::Slide, Moves::Hinge)
                && slide.axis.dot(&hinge.axis) > 1.0 - ALIGNED =>
        {
            made(JointKind::Cylindrical, Some(hinge.anchor), along(&hinge.axis), &[0, 1])
        }
        // Two or three slides across each other
        [first, second] if crossed(first, second) => {
            made(JointKind::Sliding, None, attitude_from_axes(&first.axis, &second.axis), &[0, 1])
        }
        [first, second, third]
            if crossed(first, second) && crossed(first, third) && crossed(second, third) =>
        {
            // Ordered such that the axes form a right-handed frame x, y, z.
            let is_right = first.axis.cross(&second.axis).dot(&third.axis) > 0.0;
            let (x, y, axes) =
                if is_right { (first, second, [0, 1, 2]) } else { (second, first, [1, 0, 2]) };
            made(JointKind::Gantry, None, attitude_from_axes(&x.axis, &y.axis), &axes)
        }
        [first, second, hinge]
            if crossed(first, second)
                && hinge.moves == Moves::Hinge
                && [first, second]
                    .iter()
                    .all(|slide| slide.axis.dot(&hinge.axis).abs() < ALIGNED) =>
        {
            // Ordered such that z points along the hinge.
            let is_right = first.axis.cross(&second.axis).dot(&hinge.axis) > 0.0;
            let (x, y, axes) =
                if is_right { (first, second, [0, 1, 2]) } else { (second, first, [1, 0, 2]) };
            made(JointKind::Planar, Some(hinge.anchor), attitude_from_axes(&x.axis, &y.axis), &axes)
        }
        [first, second] if turn_in_one_place(joints).is_some() && is_square(first, second) => {
            // The first hinge turns about y of the parent's frame, the second about x of the link's
            // frame.
            let attitude = attitude_from_axes(&second.axis, &first.axis);
            made(JointKind::Universal, turn_in_one_place(joints), attitude, &[1, 0])
        }
        [first, second, third]
            if turn_in_one_place(joints).is_some()
                && is_square(first, second)
                && is_square(second, third) =>
        {
            let frames = [JointFrame::at(Vector3::zeros()); 2];
            let hinges = Hinges::new(frames, [first.axis, second.axis, third.axis]);
            let hinges = hinges.map_err(|error| format!("{}: {error}", first.at))?;
            let attitudes = hinges.frames.map(|frame| frame.attitude);
            // Scene axes: x is the third hinge, y the first, z the second.
            let joined = made(JointKind::Gimbal, turn_in_one_place(joints), still, &[2, 0, 1]);
            Joined { attitudes, middle: Some(hinges.middle), ..joined }
        }
        [first, ..] => {
            let names: Vec<_> = joints.iter().map(|joint| joint.name.as_str()).collect();
            return Err(format!(
                "{}: {} act on one body and do not form a supported joint; put a body with mass \
                 between them",
                first.at,
                names.join(", ")
            ));
        }
        [] => made(JointKind::Fixed, None, still, &[]),
    }))
}

/// Intersection of the axes of hinges. `None` if they do not meet or a joint is not a hinge.
fn turn_in_one_place(joints: &[RobotJoint]) -> Option<Vector3<f64>> {
    let [first, second, rest @ ..] = joints else { return None };
    if joints.iter().any(|joint| joint.moves != Moves::Hinge) {
        return None;
    }
    // Point of the first axis closest to the second.
    let u = first.axis;
    let v = second.axis;
    let between = second.anchor - first.anchor;
    let across = u.cross(&v);
    let along = between.cross(&v).dot(&across) / across.norm_squared();
    let place = first.anchor + u * along;
    let off = |joint: &RobotJoint| (place - joint.anchor).cross(&joint.axis).norm();
    let meets = |joint: &RobotJoint| off(joint) <= ALIGNED * (1.0 + joint.anchor.norm());
    (along.is_finite() && meets(second) && rest.iter().all(meets)).then_some(place)
}

fn is_square(first: &RobotJoint, second: &RobotJoint) -> bool {
    first.axis.dot(&second.axis).abs() < ALIGNED
}

fn crossed(first: &RobotJoint, second: &RobotJoint) -> bool {
    let slide = |joint: &RobotJoint| joint.moves == Moves::Slide;
    slide(first) && slide(second) && first.axis.dot(&second.axis).abs() < ALIGNED
}

/// Attitude of the frame with these perpendicular x and y axes.
fn attitude_from_axes(x: &Vector3<f64>, y: &Vector3<f64>) -> Vector4<f64> {
    let y = (y - x * x.dot(y)).normalize();
    attitude_from_matrix(&Matrix3::from_columns(&[*x, y, x.cross(&y)]))
}

/// Drive on the axis of a slide or hinge, or on each axis of a ball or free joint, under the
/// `controls` of all actuators. Scene coordinates count from the reference.
///
/// # Errors
/// Motors that cannot act on one axis, or with negative stiffness or damping.
pub fn drive(robot: &Robot, index: usize, controls: &[f64]) -> Result<Drive, String> {
    let joint = &robot.joints[index];
    let from_reference = |coordinate: f64| coordinate - joint.reference;
    let mut drive = Drive {
        limits: joint.range.map(|range| range.map(from_reference)),
        friction: joint.friction,
        stiffness: joint.stiffness,
        rest: from_reference(joint.rest),
        damping: joint.damping,
        armature: joint.armature,
        ..Drive::NONE
    };
    let at = ActuatedCoordinate { reference: joint.reference, effort: joint.effort };
    for (actuator, control) in controlled(robot, controls).filter(|(of, _)| of.sum.is_none()) {
        for (_, share) in actuator.joints.iter().filter(|(of, _)| *of == index) {
            add_actuator(actuator, share * actuator.gear, control, at, &mut drive)?;
        }
    }
    if let (Some([low, high]), None) = (joint.effort, &drive.motor) {
        drive.force = drive.force.clamp(low, high);
    }
    Ok(drive)
}

/// Drive on a combination of coordinates under the `controls` of all actuators.
///
/// # Errors
/// The errors of [`drive`]; a joint of the combination with limits on its total actuator force.
pub fn sum_drive(robot: &Robot, index: usize, controls: &[f64]) -> Result<Drive, String> {
    let TieForces { of, mut drive } = robot.sums[index].clone();
    let at = ActuatedCoordinate { reference: 0.0, effort: None };
    let bounded = of.joints.into_iter().find(|joint| robot.joints[*joint].effort.is_some());
    for (actuator, control) in controlled(robot, controls) {
        if let Some((_, by)) = actuator.sum.filter(|(of, _)| *of == index) {
            if let Some(joint) = bounded {
                let name = shown::line(&robot.joints[joint].name);
                return Err(format!(
                    "{}: tendon: {name:?} limits the sum of its actuators, but this actuator \
                     depends on two joints; remove the limit",
                    actuator.at
                ));
            }
            add_actuator(actuator, by * actuator.gear, control, at, &mut drive)?;
        }
    }
    Ok(drive)
}

/// Actuators with their controls. Missing controls are 0.
fn controlled<'a>(
    robot: &'a Robot,
    controls: &'a [f64],
) -> impl Iterator<Item = (&'a Actuator, f64)> {
    robot.actuators.iter().zip(controls.iter().copied().chain(std::iter::repeat(0.0)))
}

/// Coordinate with actuators: its value at zero scene coordinate, and limits of their total force.
#[derive(Clone, Copy)]
struct ActuatedCoordinate {
    reference: f64,
    effort: Option<[f64; 2]>,
}

fn add_actuator(
    actuator: &Actuator,
    gear: f64,
    control: f64,
    at: ActuatedCoordinate,
    drive: &mut Drive,
) -> Result<(), String> {
    let wrong = |why: &str| Err(format!("{}: {why}", actuator.at));
    let control = match actuator.control_range {
        Some([low, high]) => control.clamp(low, high),
        None => control,
    };
    // f = g (gain u + b₀) + g² (b₁ q + b₂ q̇) along the coordinate
    let constant = gear * (actuator.gain * control + actuator.bias[0]);
    let [stiffness, damping] = [1, 2].map(|k| -actuator.bias[k] * gear * gear);
    let bounds = actuator.force_range.map(|[low, high]| {
        let (a, b) = (gear * low, gear * high);
        [a.min(b), a.max(b)]
    });
    if stiffness < 0.0 || damping < 0.0 {
        return wrong("biasprm: a motor force that grows with distance or speed is not supported");
    }
    if stiffness == 0.0 && damping == 0.0 {
        drive.force += bounds.map_or(constant, |[low, high]| constant.clamp(low, high));
        return Ok(());
    }
    // The joint's own bounds limit the sum of all motors.
    let within = |[low, high]: [f64; 2], [a, b]: [f64; 2]| [low.max(a), high.min(b)];
    let bounds = match (bounds, at.effort) {
        (Some(own), Some(all)) => Some(within(own, all)),
        (own, all) => own.or(all),
    };
    let Some([low, high]) = bounds else {
        drive.damping += damping;
        if stiffness == 0.0 {
            drive.force += constant;
            return Ok(());
        }
        // Combines springs: k (x − a) + l (x − b) = (k + l) (x − (k a + l b)/(k + l)).
        let target = constant / stiffness - at.reference;
        let both = drive.stiffness + stiffness;
        drive.rest = (drive.stiffness * drive.rest + stiffness * target) / both;
        drive.stiffness = both;
        return Ok(());
    };
    if drive.motor.is_some() {
        return wrong("joint: it already has a motor with bounds; only one is supported");
    }
    // Asymmetric bounds are centred at their midpoint.
    let middle = 0.5 * (low + high);
    let max_force = (0.5 * (high - low)).max(0.0);
    drive.force += middle;
    drive.motor = Some(if stiffness == 0.0 {
        Motor::Damper { target: (constant - middle) / damping, damping, max_force }
    } else {
        let target = constant / stiffness - at.reference - middle / stiffness;
        Motor::Position { target, stiffness, damping, max_force }
    });
    Ok(())
}
