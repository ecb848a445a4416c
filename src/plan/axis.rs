//! What the drives of joints' axes do in a step, part by part.

use crate::joint::{Axis, Drive, Joint, JointAxis, Motor};
use crate::mechanics::State;
use crate::simulation::StepRecord;
use crate::world::World;
use nalgebra::Vector3;

/// A part of a drive that is no straight line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DrivePart {
    /// Its stops: the coordinate is bounded, and their force is what keeps it so.
    Limits,
    /// Its dry friction: the force is bounded.
    Friction,
    /// Its motor: the force is bounded.
    Motor,
}

/// Where between its bounds what is bounded of a part is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Side {
    /// At the lower one: at the lower stop, or with the whole force backwards.
    Least,
    /// At neither: off both stops, held by friction, followed by a motor.
    Between,
    /// At the upper one.
    Most,
}

/// A part of the drive of an axis with what it does in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisMode {
    /// An index of the world's joints.
    pub joint: usize,
    /// Which axis of it.
    pub axis: JointAxis,
    /// Which part of its drive.
    pub part: DrivePart,
    /// What it does.
    pub side: Side,
    /// Its force, N or N m.
    pub force: f64,
}

/// The axes of a joint, of its place and then of its turn.
pub(super) const AXES: [JointAxis; 6] = [
    JointAxis::Linear(0),
    JointAxis::Linear(1),
    JointAxis::Linear(2),
    JointAxis::Angular(0),
    JointAxis::Angular(1),
    JointAxis::Angular(2),
];

/// That axis of a joint.
pub(super) fn axis_of(joint: &Joint, axis: JointAxis) -> &Axis {
    match axis {
        JointAxis::Linear(k) => &joint.linear()[k],
        JointAxis::Angular(k) => &joint.angular()[k],
    }
}

/// The modes of the drives of all joints in a step. The force of an axis is that of straight lines (springs, damping, armature)
/// and what is left is shared out: what a motor pulls to a place with is known, stops have what friction and motors of a speed
/// do not where these slip, and otherwise all where it is more than they could, and of these the one that is nearer to its speed has the rest. With the axis' response ρ, the speed that a force
/// makes in the step, what is bounded is
///
/// ```text
/// a coordinate x:  at its least where (x⁺ − x_least)/h ≤ ρ f
/// a force f:       between where |u − u₀| ≤ ρ (f_most − |f|), else at its least where u > u₀      (P27)
/// ```
#[must_use]
pub fn axis_modes_of(world: &World, record: &StepRecord, before: &[Vector3<f64>]) -> Vec<AxisMode> {
    let mut modes = Vec::new();
    for (index, joint) in world.joints().iter().enumerate() {
        let bounded = |axis: &JointAxis| matches!(axis_of(joint, *axis), Axis::Free(drive) if is_bounded(drive));
        let axes: Vec<_> = AXES.into_iter().filter(bounded).collect();
        let Some(force) = record.solution.joints.get(index).filter(|_| !axes.is_empty()) else {
            continue;
        };
        let near = before.get(index).copied().unwrap_or_default();
        let ends =
            [&record.states, &record.solution.states].map(|states| joint.coordinates(states));
        let [Some(start), Some(end)] = ends else { continue };
        let h = world.time_step();
        let angles = joint.counted(&start, &near);
        let coasted = coasted(joint, &record.states, h, &angles);
        for axis in axes {
            let Axis::Free(drive) = axis_of(joint, axis) else { continue };
            let (x, at, total, rate) = match axis {
                JointAxis::Linear(k) => {
                    (start.place[k], end.place[k], force.force[k], coasted.0[k])
                }
                JointAxis::Angular(k) => {
                    (angles[k], force.angles[k], force.torque[k], coasted.1[k])
                }
            };
            let motion = AxisMotion { end: at, speed: (at - x) / h, rate, time_step: h };
            let shares = shares(drive, total, &motion, response(world, joint, axis));
            let mode = |(part, side, force)| AxisMode { joint: index, axis, part, side, force };
            modes.extend(shares.into_iter().flatten().map(mode));
        }
    }
    modes
}

/// Whether anything of a drive is no straight line.
fn is_bounded(drive: &Drive) -> bool {
    drive.limits.is_some() || drive.friction > 0.0 || drive.motor.is_some()
}

/// The rates with which the coordinates of the place and the turns come to a step.
pub(super) fn coasted(
    joint: &Joint,
    states: &[State],
    time_step: f64,
    angles: &Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let before: Vec<_> = states.iter().map(|state| state.coasted(-time_step)).collect();
    match (joint.coordinates(&before), joint.coordinates(states)) {
        (Some(before), Some(at)) => {
            let (place, turn) = joint.rates((&before, &at), angles, time_step);
            (place, turn)
        }
        _ => <_>::default(),
    }
}

/// What an axis does in a step.
struct AxisMotion {
    /// x⁺, m or rad.
    end: f64,
    /// u, m/s or rad/s.
    speed: f64,
    /// That of the step before.
    rate: f64,
    time_step: f64,
}

type Share = Option<(DrivePart, Side, f64)>;

/// Speeds below this part of what a force makes are rounding.
const NOISE: f64 = 1e-6;

/// How the force of an axis is shared.
fn shares(drive: &Drive, total: f64, motion: &AxisMotion, response: f64) -> [Share; 3] {
    let &AxisMotion { end, speed, rate, time_step } = motion;
    let line = drive.stiffness * (drive.rest - end) - drive.damping * speed + drive.force
        - drive.armature * (speed - rate) / time_step;
    let mut rest = total - line;
    let mut shares = [None; 3];
    let side = |value: f64, most: f64| match value {
        value if value <= -most => Side::Least,
        value if value >= most => Side::Most,
        _ => Side::Between,
    };
    // What holds a speed: the part, the speed over its own, and its most.
    let mut holds = [None; 2];
    if drive.friction > 0.0 {
        holds[0] = Some((DrivePart::Friction, speed, drive.friction));
    }
    match drive.motor {
        None => {}
        Some(Motor::Speed { target, most }) => {
            holds[1] = Some((DrivePart::Motor, speed - target, most));
        }
        Some(Motor::Position { target, stiffness, damping, most }) => {
            let pull = stiffness * (target - end) - damping * speed;
            let force = pull.clamp(-most, most);
            shares[2] = Some((DrivePart::Motor, side(pull, most), force));
            rest -= force;
        }
        Some(Motor::Damper { target, damping, most }) => {
            let pull = damping * (target - speed);
            let force = pull.clamp(-most, most);
            shares[2] = Some((DrivePart::Motor, side(pull, most), force));
            rest -= force;
        }
    }
    if let Some([low, high]) = drive.limits {
        // What holds a speed has its whole force where it slips; where it rests, any up to that.
        let slips = |over: f64, most: f64| {
            over.abs() > response * rest.abs() && over.abs() > NOISE * response * most
        };
        let known = holds.iter().flatten().filter(|(_, over, most)| slips(*over, *most));
        let open = holds.iter().flatten().filter(|(_, over, most)| !slips(*over, *most));
        let beside: f64 = known.map(|(_, over, most)| -most.copysign(*over)).sum();
        let held: f64 = open.map(|(.., most)| most).sum();
        let left = rest - beside;
        let (up, down) = ((left - held).max(0.0), (left + held).min(0.0));
        let side = if up > 0.0 && (end - low) / time_step <= response * up {
            Side::Least
        } else if down < 0.0 && (high - end) / time_step <= -response * down {
            Side::Most
        } else {
            Side::Between
        };
        // At a stop what rests has no force.
        let force = if side == Side::Between { 0.0 } else { left };
        shares[0] = Some((DrivePart::Limits, side, force));
        rest -= force;
    }
    let away = |hold: &Option<(DrivePart, f64, f64)>| hold.map_or(f64::INFINITY, |of| of.1.abs());
    let nearer = usize::from(away(&holds[1]) < away(&holds[0]));
    for index in [1 - nearer, nearer] {
        let Some((part, over, most)) = holds[index] else { continue };
        let follows = index == nearer && over.abs() <= response * (most - rest.abs());
        let (side, force) = match () {
            () if follows => (Side::Between, rest),
            () if over > 0.0 => (Side::Least, -most),
            () => (Side::Most, most),
        };
        shares[1 + index] = Some((part, side, force));
        rest -= force;
    }
    shares
}

/// The speed that a force along an axis, or a torque about it, makes in a step where nothing else holds the bodies.
fn response(world: &World, joint: &Joint, axis: JointAxis) -> f64 {
    let sides = [Some(joint.body()), joint.other()].into_iter().zip(joint.frames());
    let each = sides.filter_map(|(body, frame)| Some((&world.bodies()[body?], frame)));
    let of = each.map(|(body, frame)| match axis {
        JointAxis::Linear(_) => 1.0 / body.mass(),
        JointAxis::Angular(k) => {
            let along = frame.rotation().column(k).into_owned();
            along.dot(&(body.inertia_inverse() * along))
        }
    });
    of.sum::<f64>() * world.time_step()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A motor that presses an axis onto its lower stop with all that it has: the stop bears it, and what else pulls.
    #[test]
    fn a_stop_bears_the_motor_that_presses_onto_it() {
        let motor = Some(Motor::Speed { target: -1.0, most: 10.0 });
        let drive = Drive { limits: Some([0.0, 1.0]), motor, ..Drive::default() };
        let motion = AxisMotion { end: 0.0, speed: 0.0, rate: 0.0, time_step: 0.01 };
        for load in [0.0, 2.0, -2.0, 30.0] {
            let [stop, friction, motor] = shares(&drive, load, &motion, 0.01);
            assert_eq!(stop, Some((DrivePart::Limits, Side::Least, load + 10.0)), "{load}");
            assert_eq!(motor, Some((DrivePart::Motor, Side::Least, -10.0)), "{load}");
            assert_eq!(friction, None);
        }
        // Off the stop it follows.
        let motion = AxisMotion { end: 0.5, speed: -1.0, rate: -1.0, time_step: 0.01 };
        let [stop, _, motor] = shares(&drive, 3.0, &motion, 0.01);
        assert_eq!(stop, Some((DrivePart::Limits, Side::Between, 0.0)));
        assert_eq!(motor, Some((DrivePart::Motor, Side::Between, 3.0)));
    }
}
