//! Inputs at the joints of a simulation that a program sets per step or over time.

use super::Simulation;
use super::start::JOINT_AT_THE_START;
use crate::error::Error;
use crate::joint::{Axis, Course, Drive, Joint, JointAxis, JointLoad, Motor};
use crate::mechanics::State;
use crate::world::{Partner, SurfaceMotion, World};
use nalgebra::Vector3;

/// Time-dependent inputs of joints, with the joint indices.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Driving {
    loads: Vec<(usize, JointLoad)>,
    courses: Vec<(usize, Course)>,
}

impl Driving {
    /// Sets the inputs of the joints of `world` for step `index` from `states`: loads with their mean
    /// over the time in which they act, motions with their pose at the time `end` (s).
    #[inline(never)]
    pub(super) fn set(&self, world: &mut World, states: &[State], index: u64, end: f64) {
        let h = world.time_step();
        for (joint, load) in &self.loads {
            let [from, to] = world.load_interval(index, world.joints()[*joint].body());
            world.joints_mut()[*joint].push = load.mean(from, to);
        }
        for (joint, course) in &self.courses {
            let joint = &mut world.joints_mut()[*joint];
            let now = joint.frames()[0].placed(&states[joint.body()]);
            joint.move_to(course.end(&now, end, h));
        }
    }

    /// Isolated jumps of forces and of velocities of motions, each the first within the times `within` (s), with
    /// the joint.
    pub(super) fn jumps(&self, within: [f64; 2], apart: f64) -> impl Iterator<Item = (usize, f64)> {
        let loads = self.loads.iter();
        let loads = loads.map(move |(joint, load)| (*joint, load.jump_in(within, apart)));
        let courses = self.courses.iter().map(move |(joint, course)| match course {
            Course::Through(knots) => (*joint, knots.jump_in(within, apart)),
            Course::To(_) | Course::Steady { .. } => (*joint, None),
        });
        loads.chain(courses).filter_map(|(joint, time)| Some((joint, time?)))
    }

    /// True if there are no inputs.
    pub(super) fn is_idle(&self) -> bool {
        self.loads.is_empty() && self.courses.is_empty()
    }

    /// Drops the inputs of removed joints and renumbers the others. `stays` has a flag per joint.
    pub(super) fn keep(&mut self, stays: &[bool]) {
        let number = |joint: usize| stays[..joint].iter().filter(|stays| **stays).count();
        self.loads.retain(|(joint, _)| stays[*joint]);
        self.courses.retain(|(joint, _)| stays[*joint]);
        let loads = self.loads.iter_mut().map(|(joint, _)| joint);
        for joint in loads.chain(self.courses.iter_mut().map(|(joint, _)| joint)) {
            *joint = number(*joint);
        }
    }

    /// True if the inputs are valid for `joints`.
    #[cfg(feature = "save")]
    pub(super) fn fits(&self, joints: &[Joint]) -> bool {
        let loads = self.loads.iter().all(|(joint, load)| {
            joints.get(*joint).is_some_and(|joint| joint.takes(load)) && load.is_possible()
        });
        let courses = self.courses.iter().all(|(joint, course)| {
            joints.get(*joint).is_some_and(Joint::holds_in_world)
                && course.clone().checked().is_ok()
        });
        loads && courses
    }
}

/// Sets the entry of `joint` to `value`.
fn put<T>(list: &mut Vec<(usize, T)>, joint: usize, value: T) {
    match list.iter_mut().find(|(known, _)| *known == joint) {
        Some((_, known)) => *known = value,
        None => list.push((joint, value)),
    }
}

/// Drive of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct AxisDrive {
    /// The axis.
    pub axis: DrivenAxis,
    /// The drive.
    pub drive: Drive,
}

/// Axis with a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum DrivenAxis {
    /// Axis of the joint with this index.
    Joint(usize, JointAxis),
    /// Sum (J17) of the gear with this index.
    Gear(usize),
}

impl DrivenAxis {
    /// Its drive in `world`, and the time over which the drive acts, in lengths of the step.
    fn drive(self, world: &World) -> Option<(&Drive, f64)> {
        match self {
            Self::Joint(joint, axis) => {
                let joint = world.joints().get(joint)?;
                Some((joint.drive(axis)?, joint.kick()))
            }
            Self::Gear(gear) => {
                let gear = world.gears().get(gear)?;
                Some((gear.drive()?, gear.kick))
            }
        }
    }

    /// Its drive in `world`, to be changed.
    fn drive_mut(self, world: &mut World) -> Option<&mut Drive> {
        match self {
            Self::Joint(joint, axis) => world.joints_mut().get_mut(joint)?.drive_mut(axis).ok(),
            Self::Gear(gear) => world.gears_mut().get_mut(gear)?.drive_mut(),
        }
    }
}

/// Exchanges the drives of `world` with these.
pub(super) fn exchange_drives(world: &mut World, drives: &mut [AxisDrive]) {
    for AxisDrive { axis, drive } in drives {
        if let Some(present) = axis.drive_mut(world) {
            std::mem::swap(present, drive);
        }
    }
}

/// Drives of the problem set in `world` at the axes whose drives `before` it were others (eq. 37).
pub(super) fn held_drives(world: &World, before: &[AxisDrive]) -> Vec<AxisDrive> {
    let held = |past: &AxisDrive| {
        let (drive, kick) = past.axis.drive(world)?;
        Some(AxisDrive { drive: drive.after(&past.drive, 0.5 / kick), ..*past })
    };
    before.iter().filter_map(held).collect()
}

impl Simulation<'_> {
    fn joint(&self, joint: usize) -> Result<&Joint, Error> {
        let allowed = "an index of a joint";
        self.world.joints().get(joint).ok_or(Error::Count { field: "joint", count: joint, allowed })
    }

    /// Replaces the drive of a free axis of joint `joint` for the next steps. Controllers call it
    /// every step. Force, target position and force limit are held during each step, like
    /// [wrenches](Simulation::set_wrench). [`Simulation::world`] shows the present drive, and each step is certified with
    /// the drives it was taken with.
    ///
    /// # Errors
    /// If the joint does not exist, if the axis is locked or a rotation axis of a ball joint, or if
    /// the drive is out of range. The present drive then stays.
    pub fn set_drive(&mut self, joint: usize, axis: JointAxis, drive: Drive) -> Result<(), Error> {
        let before = self.joint(joint)?.drive(axis).copied();
        self.world.joints_mut()[joint].set_drive(axis, drive)?;
        if let Some(before) = before.filter(|before| *before != drive) {
            let axis = DrivenAxis::Joint(joint, axis);
            self.moment.note_drive(AxisDrive { axis, drive: before });
        }
        self.workspace.rest.end();
        Ok(())
    }

    /// Replaces or removes the motor of a free axis of joint `joint` for the next steps. The other
    /// parts of the drive stay.
    ///
    /// # Errors
    /// Same as [`Simulation::set_drive`].
    pub fn set_motor(
        &mut self,
        joint: usize,
        axis: JointAxis,
        motor: Option<Motor>,
    ) -> Result<(), Error> {
        let of = self.joint(joint)?;
        let (axes, k) = match axis {
            JointAxis::Linear(k) => (of.linear(), k),
            JointAxis::Angular(k) => (of.angular(), k),
        };
        let drive = match axes.get(k) {
            Some(Axis::Free(drive)) => Drive { motor, ..*drive },
            _ => Drive { motor, ..Drive::NONE },
        };
        self.set_drive(joint, axis, drive)
    }

    /// Replaces the drive of a gear with a [drive](crate::joint::Gear::with_drive) for the next
    /// steps; compare [`Simulation::set_drive`].
    ///
    /// # Errors
    /// If the gear does not exist or is a constraint without a drive, or if the drive is out of
    /// range or has an armature. The present drive then stays.
    pub fn set_gear_drive(&mut self, gear: usize, drive: Drive) -> Result<(), Error> {
        let allowed = "an index of a gear";
        let count = Error::Count { field: "gear", count: gear, allowed };
        let of = self.world.gears_mut().get_mut(gear).ok_or(count)?;
        let before = of.drive().copied();
        of.set_drive(drive)?;
        if let Some(before) = before.filter(|before| *before != drive) {
            let axis = DrivenAxis::Gear(gear);
            self.moment.note_drive(AxisDrive { axis, drive: before });
        }
        self.workspace.rest.end();
        Ok(())
    }

    /// Sets forces along the axes of joint `joint` as functions of the time since step 0. They add
    /// to the drives. A step uses their mean, as for a [load](Simulation::set_load).
    ///
    /// # Errors
    /// If the joint does not exist, for a force along a locked axis, or for a torque about an axis
    /// of a ball joint.
    pub fn set_joint_load(&mut self, joint: usize, load: JointLoad) -> Result<(), Error> {
        if !self.joint(joint)?.takes(&load) {
            return Err(Error::Unsupported {
                what: "load of a joint along an axis without a force",
                why: "locked axes and the rotation axes of a ball joint take no load",
            });
        }
        put(&mut self.inputs.driving.loads, joint, load);
        self.workspace.rest.end();
        Ok(())
    }

    /// Sets a surface velocity for the next steps; see
    /// [`World::with_surface`](crate::world::World::with_surface). A spin of the surface stays.
    ///
    /// # Errors
    /// Same as there. The present velocity then stays.
    pub fn set_surface(&mut self, of: Partner, velocity: Vector3<f64>) -> Result<(), Error> {
        self.workspace.rest.end();
        let motion = SurfaceMotion { velocity, ..self.world.surface_of(of) };
        self.world.set_surface(of, motion)
    }

    /// Prescribes the motion of the world frame of joint `joint`, and of the body that it fixes in
    /// all axes: a tray, a pusher, a turntable. The body ends every step at the prescribed pose to
    /// rounding, whatever is in its path.
    /// [`StepSolution::joints`](crate::step::StepSolution::joints) holds the required force. The
    /// body's velocities are those of the step.
    ///
    /// # Errors
    /// If the joint does not exist, has a free axis or connects two bodies; if the motion is out of
    /// range, or if its knots do not match the frame at the present step.
    pub fn set_course(&mut self, joint: usize, course: Course) -> Result<(), Error> {
        let of = self.joint(joint)?;
        if !of.holds_in_world() {
            return Err(Error::Unsupported {
                what: "prescribed motion of a joint that is not fixed to the world",
                why: "lock all six axes of a joint between the body and the world",
            });
        }
        let course = course.checked()?;
        if let Course::Through(knots) = &course {
            let mut there = of.clone();
            there.move_to(knots.at(self.moment.index as f64 * self.world.time_step()));
            let (place, turn) = there.error(self.states()).unwrap_or((f64::NAN, f64::NAN));
            let fits = place.max(turn) <= JOINT_AT_THE_START;
            if !fits {
                return Err(Error::JointApart { joint, place, turn, allowed: JOINT_AT_THE_START });
            }
        }
        put(&mut self.inputs.driving.courses, joint, course);
        self.workspace.rest.end();
        Ok(())
    }
}
