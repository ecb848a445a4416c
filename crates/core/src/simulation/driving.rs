//! What a program sets from step to step, or over time, at the joints of a simulation.

use super::Simulation;
use super::start::JOINT_AT_THE_START;
use crate::error::Error;
use crate::joint::{Axis, Course, Drive, Joint, JointAxis, JointLoad, Motor};
use crate::mechanics::State;
use crate::world::{Partner, World};
use nalgebra::Vector3;

/// What drives joints over time, by their indices.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Driving {
    loads: Vec<(usize, JointLoad)>,
    courses: Vec<(usize, Course)>,
}

impl Driving {
    /// Sets the joints of `world` for the step `index` from `states`.
    #[inline]
    pub(super) fn set(&self, world: &mut World, states: &[State], index: u64) {
        if !self.is_idle() {
            self.set_some(world, states, index);
        }
    }

    /// Whether it drives nothing.
    pub(super) fn is_idle(&self) -> bool {
        self.loads.is_empty() && self.courses.is_empty()
    }

    #[inline(never)]
    fn set_some(&self, world: &mut World, states: &[State], index: u64) {
        let h = world.time_step();
        let (from, to) = (index as f64 * h, (index + 1) as f64 * h);
        for (joint, load) in &self.loads {
            world.joints_mut()[*joint].set_push(load.mean(from, to));
        }
        for (joint, course) in &self.courses {
            let joint = &mut world.joints_mut()[*joint];
            let now = joint.frames()[0].placed(&states[joint.body()]);
            joint.move_to(course.end(&now, to, h));
        }
    }
}

impl Driving {
    /// Makes this that of the joints that stay, where some are taken out.
    pub(super) fn keep(&mut self, stays: &[bool]) {
        let number = |joint: usize| stays[..joint].iter().filter(|stays| **stays).count();
        self.loads.retain(|(joint, _)| stays[*joint]);
        self.courses.retain(|(joint, _)| stays[*joint]);
        let loads = self.loads.iter_mut().map(|(joint, _)| joint);
        for joint in loads.chain(self.courses.iter_mut().map(|(joint, _)| joint)) {
            *joint = number(*joint);
        }
    }

    /// Whether it can drive these joints.
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

/// Puts `value` in place of that of `joint`.
fn put<T>(list: &mut Vec<(usize, T)>, joint: usize, value: T) {
    match list.iter_mut().find(|(known, _)| *known == joint) {
        Some((_, known)) => *known = value,
        None => list.push((joint, value)),
    }
}

impl Simulation<'_> {
    fn joint(&self, joint: usize) -> Result<&Joint, Error> {
        let allowed = "an index of a joint";
        self.world.joints().get(joint).ok_or(Error::Count { field: "joint", count: joint, allowed })
    }

    /// Sets the drive of a free axis of joint `joint` in the steps to come, in place of the one before: for a
    /// program that decides it from step to step. [`Simulation::world`] has the joint as it is set, and a step is
    /// certified by the drives that it was taken with.
    ///
    /// # Errors
    /// A joint that is not there; an axis that is locked, or of a ball joint's turn; a drive out of
    /// range. The drive before it stays.
    pub fn set_drive(&mut self, joint: usize, axis: JointAxis, drive: Drive) -> Result<(), Error> {
        self.joint(joint)?;
        self.world.joints_mut()[joint].set_drive(axis, drive)?;
        self.scratch.rest.end();
        Ok(())
    }

    /// Sets the motor of a free axis of joint `joint` in the steps to come, or takes it away; what else
    /// drives the axis stays.
    ///
    /// # Errors
    /// As [`Simulation::set_drive`].
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

    /// Sets what acts on the sum of a gear with a [drive](crate::joint::Gear::with_drive) in the steps to come, in place of the
    /// drive before, as [`Simulation::set_drive`] does of an axis.
    ///
    /// # Errors
    /// A gear that is not there, or whose sum is held; a drive out of range, or with an armature. The drive before it stays.
    pub fn set_gear_drive(&mut self, gear: usize, drive: Drive) -> Result<(), Error> {
        let allowed = "an index of a gear";
        let count = Error::Count { field: "gear", count: gear, allowed };
        self.world.gears_mut().get_mut(gear).ok_or(count)?.set_drive(drive)?;
        self.scratch.rest.end();
        Ok(())
    }

    /// Sets forces along the axes of joint `joint` over time, counted from step 0, besides those of its
    /// drives. A step has their mean, as of a [load](Simulation::set_load).
    ///
    /// # Errors
    /// A joint that is not there; a force along an axis that is locked, or a torque about one of a ball
    /// joint.
    pub fn set_joint_load(&mut self, joint: usize, load: JointLoad) -> Result<(), Error> {
        if !self.joint(joint)?.takes(&load) {
            return Err(Error::Unsupported {
                what: "a load of a joint along an axis that bears none",
                why: "an axis that is locked, or of a ball joint's turn, takes up no force of a drive",
            });
        }
        put(&mut self.driving.loads, joint, load);
        self.scratch.rest.end();
        Ok(())
    }

    /// Sets the velocity of a surface in the steps to come, as
    /// [`World::with_surface`](crate::world::World::with_surface) does.
    ///
    /// # Errors
    /// As there. The velocity before it stays.
    pub fn set_surface(&mut self, of: Partner, velocity: Vector3<f64>) -> Result<(), Error> {
        self.scratch.rest.end();
        self.world.set_surface(of, velocity)
    }

    /// Has the frame in the world of joint `joint` move, and with it the body that the joint holds there in all its axes:
    /// a tray, a pusher, a turntable. At the end of every step the body is where the course has it, to
    /// rounding, whatever is in its way, and [`StepSolution::joints`](crate::step::StepSolution::joints) has the force
    /// that this took. Its velocities are those of the step, as those of any body.
    ///
    /// # Errors
    /// A joint that is not there, or that leaves an axis free or ties two bodies; a course out of range, or
    /// through knots that are not where the frame is at the present step.
    pub fn set_course(&mut self, joint: usize, course: Course) -> Result<(), Error> {
        let of = self.joint(joint)?;
        if !of.holds_in_world() {
            return Err(Error::Unsupported {
                what: "a course of a joint that is not fixed to the world",
                why: "fix the body to the world in all six axes to drive it",
            });
        }
        let course = course.checked()?;
        if let Course::Through(knots) = &course {
            let mut there = of.clone();
            there.move_to(knots.at(self.index as f64 * self.world.time_step()));
            let (place, turn) = there.error(self.states()).unwrap_or((f64::NAN, f64::NAN));
            let fits = place.max(turn) <= JOINT_AT_THE_START;
            if !fits {
                return Err(Error::JointApart { joint, place, turn, allowed: JOINT_AT_THE_START });
            }
        }
        put(&mut self.driving.courses, joint, course);
        self.scratch.rest.end();
        Ok(())
    }
}
