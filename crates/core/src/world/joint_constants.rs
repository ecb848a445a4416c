//! Constants of joints: drive parameters and anchors.

use super::{Constant, World};
use crate::error::Error;
use crate::joint::{Axis, Drive, Gear, Joint, JointAxis, Motor};
use nalgebra::Vector3;

impl World {
    /// The D joint axes that accept a drive, each with the index of its joint. They are ordered by
    /// joint, linear axes first.
    pub fn driven_axes(&self) -> Vec<(usize, JointAxis)> {
        let joints = self.joints().iter().enumerate();
        joints.flat_map(|(joint, of)| of.driven_axes().map(move |axis| (joint, axis))).collect()
    }

    /// The L joint axes with limits, each with the index of its joint, in the order of
    /// [`World::driven_axes`]. The cone of a ball joint is the limit of its x axis, from 0 to the
    /// cone angle.
    pub fn limited_axes(&self) -> Vec<(usize, JointAxis)> {
        let joints = self.joints().iter().enumerate();
        joints.flat_map(|(joint, of)| of.limited_axes().map(move |axis| (joint, axis))).collect()
    }

    /// The M [driven axes](World::driven_axes) with a motor.
    pub fn motors(&self) -> Vec<(usize, JointAxis)> {
        let has_motor = |(joint, axis): &(usize, JointAxis)| {
            self.joints()[*joint].drive(*axis).is_some_and(|drive| drive.motor.is_some())
        };
        self.driven_axes().into_iter().filter(has_motor).collect()
    }

    /// Indices of the gears with a motor.
    pub fn gear_motors(&self) -> Vec<usize> {
        let has_motor = |gear: &Gear| gear.drive().is_some_and(|drive| drive.motor.is_some());
        let gears = self.gears().iter().enumerate();
        gears.filter(|(_, gear)| has_motor(gear)).map(|(gear, _)| gear).collect()
    }

    /// Returns this world with the joint constants in `given`.
    pub(super) fn with_joint_constants<'a>(
        mut self,
        given: impl Fn(Constant) -> Option<&'a [f64]>,
    ) -> Result<Self, Error> {
        let axes = self.driven_axes();
        let motors = self.motors();
        let bodies = self.bodies().len();
        let limited = self.limited_axes();
        for constant in Constant::ALL.into_iter().filter(|constant| constant.is_of_joints()) {
            let Some(numbers) = given(constant) else { continue };
            if constant == Constant::Anchor {
                let anchors = self.joints.iter_mut().flat_map(|joint| &mut joint.frames);
                for (frame, anchor) in anchors.zip(numbers.chunks_exact(3)) {
                    frame.anchor = Vector3::from_column_slice(anchor);
                }
                continue;
            }
            if constant.is_of_gears() {
                for (gear, number) in self.gears.iter_mut().zip(numbers) {
                    match constant {
                        Constant::GearRatio => gear.ratio = *number,
                        _ => gear.offset = *number,
                    }
                }
                continue;
            }
            if constant == Constant::JointLimits {
                for (&(joint, axis), number) in limited.iter().zip(numbers.chunks_exact(2)) {
                    self.joints[joint].drive_mut(axis)?.limits = Some([number[0], number[1]]);
                }
                continue;
            }
            // One number for each driven axis, or for each motor.
            let slots = if constant.is_of_motors() { &motors } else { &axes };
            for (&(joint, axis), number) in slots.iter().zip(numbers) {
                let drive = self.joints[joint].drive_mut(axis)?;
                constant.set(drive, *number)?;
            }
        }
        // The constructors check the new values.
        self.joints =
            self.joints.into_iter().map(|joint| joint.checked(bodies)).collect::<Result<_, _>>()?;
        let gears = self.gears.into_iter().map(|gear| gear.checked(&self.joints));
        self.gears = gears.collect::<Result<_, _>>()?;
        Ok(self)
    }
}

impl Constant {
    /// True for constants of joints and gears.
    pub fn is_of_joints(self) -> bool {
        self == Self::Anchor || self.is_of_gears() || self.is_of_drives()
    }

    /// True for constants of gears.
    pub(crate) fn is_of_gears(self) -> bool {
        matches!(self, Self::GearRatio | Self::GearOffset)
    }

    /// True for constants of drives: one value per axis or motor, or two per range.
    pub(crate) fn is_of_drives(self) -> bool {
        self.is_of_motors()
            || matches!(
                self,
                Self::JointFriction
                    | Self::JointStiffness
                    | Self::JointRest
                    | Self::JointDamping
                    | Self::JointForce
                    | Self::Armature
                    | Self::JointRestitution
                    | Self::JointLimits
            )
    }

    pub(crate) fn is_of_motors(self) -> bool {
        matches!(
            self,
            Self::MotorTarget | Self::MotorStiffness | Self::MotorDamping | Self::MotorMaxForce
        )
    }

    /// Array shape of a joint constant.
    pub(super) fn joint_shape(self, world: &World) -> Vec<usize> {
        match self {
            Self::Anchor => vec![world.joints().len(), 2, 3],
            Self::JointLimits => vec![world.limited_axes().len(), 2],
            of if of.is_of_gears() => vec![world.gears().len()],
            of if of.is_of_motors() => vec![world.motors().len()],
            _ => vec![world.driven_axes().len()],
        }
    }

    /// Values of a joint constant.
    pub(super) fn joint_values(self, world: &World) -> Vec<f64> {
        if self == Self::Anchor {
            let frames = world.joints().iter().flat_map(Joint::frames);
            return frames.flat_map(|frame| <[f64; 3]>::from(frame.anchor)).collect();
        }
        if self.is_of_gears() {
            return world.gears().iter().map(|gear| gear.get(self)).collect();
        }
        let slots = match self {
            Self::JointLimits => world.limited_axes(),
            of if of.is_of_motors() => world.motors(),
            _ => world.driven_axes(),
        };
        let drive = |(joint, axis): (usize, JointAxis)| world.joints()[joint].drive(axis);
        let drives = slots.into_iter().filter_map(drive);
        if self == Self::JointLimits {
            return drives.filter_map(|drive| drive.limits).flatten().collect();
        }
        drives.map(|drive| self.get(drive)).collect()
    }

    fn get(self, drive: &Drive) -> f64 {
        let (target, stiffness, damping, max_force) = match drive.motor {
            Some(Motor::Speed { target, max_force }) => (target, 0.0, 0.0, max_force),
            Some(Motor::Damper { target, damping, max_force }) => (target, 0.0, damping, max_force),
            Some(Motor::Position { target, stiffness, damping, max_force }) => {
                (target, stiffness, damping, max_force)
            }
            None => (0.0, 0.0, 0.0, 0.0),
        };
        match self {
            Self::JointFriction => drive.friction,
            Self::JointStiffness => drive.stiffness,
            Self::JointRest => drive.rest,
            Self::JointDamping => drive.damping,
            Self::JointForce => drive.force,
            Self::Armature => drive.armature,
            Self::JointRestitution => drive.restitution,
            Self::MotorTarget => target,
            Self::MotorStiffness => stiffness,
            Self::MotorDamping => damping,
            Self::MotorMaxForce => max_force,
            _ => 0.0,
        }
    }

    fn set(self, drive: &mut Drive, number: f64) -> Result<(), Error> {
        match (self, &mut drive.motor) {
            (Self::JointFriction, _) => drive.friction = number,
            (Self::JointStiffness, _) => drive.stiffness = number,
            (Self::JointRest, _) => drive.rest = number,
            (Self::JointDamping, _) => drive.damping = number,
            (Self::JointForce, _) => drive.force = number,
            (Self::Armature, _) => drive.armature = number,
            (Self::JointRestitution, _) => drive.restitution = number,
            (
                Self::MotorTarget,
                Some(
                    Motor::Speed { target, .. }
                    | Motor::Position { target, .. }
                    | Motor::Damper { target, .. },
                ),
            ) => *target = number,
            (
                Self::MotorMaxForce,
                Some(
                    Motor::Speed { max_force, .. }
                    | Motor::Position { max_force, .. }
                    | Motor::Damper { max_force, .. },
                ),
            ) => {
                *max_force = number;
            }
            (Self::MotorStiffness, Some(Motor::Position { stiffness, .. })) => *stiffness = number,
            (
                Self::MotorDamping,
                Some(Motor::Position { damping, .. } | Motor::Damper { damping, .. }),
            ) => *damping = number,
            // A constant that the motor does not have may be set to 0 only.
            (Self::MotorStiffness, Some(Motor::Damper { .. })) if number != 0.0 => {
                return Err(Error::Unsupported {
                    what: "stiffness of a motor with a target speed and damping",
                    why: "only motors with a target position have one; use 0 for others",
                });
            }
            (Self::MotorStiffness | Self::MotorDamping, Some(Motor::Speed { .. }))
                if number != 0.0 =>
            {
                return Err(Error::Unsupported {
                    what: "stiffness or damping of a motor with a fixed speed",
                    why: "only motors with a target position have them; use 0 for others",
                });
            }
            _ => {}
        }
        Ok(())
    }
}

impl Gear {
    fn get(&self, constant: Constant) -> f64 {
        if constant == Constant::GearRatio { self.ratio() } else { self.offset() }
    }
}

impl Joint {
    /// Axes that accept a drive.
    pub(crate) fn driven_axes(&self) -> impl Iterator<Item = JointAxis> {
        let [along, about] = self.bears();
        let along = (0..3).filter(move |k| along[*k]).map(JointAxis::Linear);
        along.chain((0..3).filter(move |k| about[*k]).map(JointAxis::Angular))
    }

    pub(crate) fn limited_axes(&self) -> impl Iterator<Item = JointAxis> {
        let all = (0..3).map(JointAxis::Linear).chain((0..3).map(JointAxis::Angular));
        all.filter(|axis| self.drive(*axis).is_some_and(|drive| drive.limits.is_some()))
    }

    /// Drive of `axis`, if the axis is free.
    pub fn drive(&self, axis: JointAxis) -> Option<&Drive> {
        let of = match axis {
            JointAxis::Linear(k) => self.linear().get(k),
            JointAxis::Angular(k) => self.angular().get(k),
        };
        match of {
            Some(Axis::Free(drive)) => Some(drive),
            _ => None,
        }
    }
}
