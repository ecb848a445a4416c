//! Gears: linear constraints between coordinates of two joints, or drives on their deviation.

use super::{Axis, AxisStart, Drive, Joint, JointAxis, JointForce, TurnKind};
use crate::error::{Error, in_range};
use crate::mechanics::{RigidBody, State};
use nalgebra::Vector3;

/// Axis of a joint of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct GearAxis {
    /// Index of the joint.
    pub joint: usize,
    /// Axis of the joint; it must be free and have a counted coordinate.
    pub axis: JointAxis,
}

impl GearAxis {
    /// Axis of a joint: 0, 1, 2 are translations along x, y, z; 3, 4, 5 are rotations about them.
    pub fn new(joint: usize, axis: usize) -> Self {
        let axis = match axis {
            0..3 => JointAxis::Linear(axis),
            _ => JointAxis::Angular(axis - 3),
        };
        Self { joint, axis }
    }

    /// Coordinate q at `states` (m or rad). Angles are the nearest to the joint angles `near`.
    ///
    /// # Panics
    /// If the joint or axis does not exist.
    pub fn coordinate(&self, joints: &[Joint], states: &[State], near: &Vector3<f64>) -> f64 {
        let of = &joints[self.joint];
        of.coordinates(states).map_or(f64::NAN, |at| match self.axis {
            JointAxis::Linear(k) => at.place[k],
            JointAxis::Angular(k) => of.counted(&at, near)[k],
        })
    }
}

/// Gear, rack and pinion, screw or mimic joint: a constraint between two coordinates (m, or rad
/// with full turns counted). At the end of every step,
///
/// ```text
/// q₁ = r q₂ + q₀                                                           (J15)
/// ```
///
/// enforced by a force on the first coordinate and −r times that force on the second. Drives of the
/// joints act in addition. With a [drive](Gear::with_drive), there is no constraint. The drive then
/// acts on the sum
///
/// ```text
/// s = q₁ − r q₂ − q₀                                                        (J17)
/// ```
///
/// like a drive on the coordinate of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Gear {
    pub(super) axes: [GearAxis; 2],
    pub(crate) ratio: f64,
    pub(crate) offset: f64,
    pub(super) law: Axis,
    /// Time over which the drive acts in a step, in lengths of the step (eq. 37).
    pub(crate) kick: f64,
}

/// Largest initial gear error, or excess over the limits of its drive, in units of the first
/// coordinate (m or rad).
pub const GEAR_AT_THE_START: f64 = 1e-6;

impl Gear {
    /// Creates the constraint `first` = `ratio` · `second` + `offset`, in units of the first
    /// coordinate.
    pub fn new(first: GearAxis, second: GearAxis, ratio: f64, offset: f64) -> Self {
        Self { axes: [first, second], ratio, offset, law: Axis::Locked, kick: 1.0 }
    }

    /// Returns this gear with `drive` acting on s (J17) instead of the constraint s = 0, in units
    /// of the first coordinate. Limits, dry friction, spring, damper, force and motor are allowed,
    /// but nothing that depends on the rate before the step.
    #[must_use]
    pub fn with_drive(self, drive: Drive) -> Self {
        Self { law: Axis::Free(drive), ..self }
    }

    /// Drive on s; `None` if s is constrained to zero.
    pub fn drive(&self) -> Option<&Drive> {
        match &self.law {
            Axis::Locked => None,
            Axis::Free(drive) => Some(drive),
        }
    }

    /// Its drive, to be changed.
    pub(crate) fn drive_mut(&mut self) -> Option<&mut Drive> {
        match &mut self.law {
            Axis::Locked => None,
            Axis::Free(drive) => Some(drive),
        }
    }

    /// Law of s: locked, or free under a drive.
    pub(crate) fn law(&self) -> &Axis {
        &self.law
    }

    /// Axes of the first and the second coordinate.
    pub fn axes(&self) -> &[GearAxis; 2] {
        &self.axes
    }

    /// Ratio r.
    pub fn ratio(&self) -> f64 {
        self.ratio
    }

    /// Offset q₀ (m or rad).
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Checks the gear against the joints of its world.
    pub(crate) fn checked(self, joints: &[Joint]) -> Result<Self, Error> {
        let unsupported = |what| {
            let why = "a gear connects two free axes with a coordinate: slides, angles of hinges, \
                       universal joints and gimbals, or the twist of a ball joint";
            Error::Unsupported { what, why }
        };
        for GearAxis { joint, axis } in self.axes {
            let allowed = "an index of a joint";
            let count = Error::Count { field: "joint of a gear", count: joint, allowed };
            let of = joints.get(joint).ok_or(count)?;
            let [along, about] = of.bears();
            let bears = match axis {
                JointAxis::Linear(k) => along.get(k).copied().filter(|_| of.holds_place()),
                JointAxis::Angular(k) => {
                    about.get(k).copied().filter(|_| of.turning() != TurnKind::Driven)
                }
            };
            if bears != Some(true) {
                return Err(unsupported("a gear on an axis without a coordinate"));
            }
        }
        if self.axes[0] == self.axes[1] {
            return Err(unsupported("a gear between an axis and itself"));
        }
        in_range("ratio of a gear", self.ratio, -1e6, 1e6, "-1e6 to 1e6")?;
        in_range("offset of a gear", self.offset, -1e6, 1e6, "-1e6 to 1e6")?;
        self.check_law()?;
        Ok(self)
    }

    fn check_law(&self) -> Result<(), Error> {
        self.law.check()?;
        if self.law.needs_rate() {
            let what = "armature, static friction, friction curve or restitution of a gear's drive";
            return Err(Error::Unsupported { what, why: "set that of its joints instead" });
        }
        Ok(())
    }

    /// Replaces the drive of a gear that has one. A rejected drive leaves the present one.
    pub(crate) fn set_drive(&mut self, drive: Drive) -> Result<(), Error> {
        if self.law == Axis::Locked {
            let why = "only a gear that is made with a drive can change it";
            return Err(Error::Unsupported { what: "drive of a gear without one", why });
        }
        let set = self.with_drive(drive);
        set.check_law()?;
        *self = set;
        Ok(())
    }

    /// Copy without the part that a simulation can change: the drive.
    #[cfg(feature = "save")]
    pub(crate) fn lasting(&self) -> Self {
        let bare = Self { kick: 1.0, ..*self };
        match self.law {
            Axis::Locked => bare,
            Axis::Free(_) => bare.with_drive(Drive::NONE),
        }
    }

    /// Copy with renumbered joints after the removal of joints, where `stays` has a flag per joint;
    /// `None` if a joint of the gear is removed.
    pub(crate) fn keeping(&self, stays: &[bool]) -> Option<Self> {
        let kept = |at: GearAxis| {
            let number = stays[..at.joint].iter().filter(|stays| **stays).count();
            stays[at.joint].then_some(GearAxis { joint: number, ..at })
        };
        Some(Self { axes: [kept(self.axes[0])?, kept(self.axes[1])?], ..*self })
    }

    /// Deviation q₁ − r q₂ − q₀ (m or rad).
    pub(crate) fn missed(&self, coordinates: [f64; 2]) -> f64 {
        coordinates[0] - self.ratio * coordinates[1] - self.offset
    }

    /// Sum s (J17) at `states`, with the joint angles nearest to `angles` (m or rad).
    pub fn coordinate(&self, joints: &[Joint], states: &[State], angles: &[Vector3<f64>]) -> f64 {
        let at = |of: GearAxis| {
            let near = angles.get(of.joint).copied().unwrap_or_default();
            of.coordinate(joints, states, &near)
        };
        self.missed(self.axes.map(at))
    }

    /// Error at `states`, with the joint angles nearest to `angles`: s, or the excess of s over the
    /// limits of its drive. The unit is that of the first coordinate (m or rad).
    pub fn error(&self, joints: &[Joint], states: &[State], angles: &[Vector3<f64>]) -> f64 {
        let sum = self.coordinate(joints, states, angles);
        match self.law {
            Axis::Locked => sum,
            Axis::Free(Drive { limits: Some([low, high]), .. }) => sum - sum.clamp(low, high),
            Axis::Free(_) if sum.is_nan() => sum,
            Axis::Free(_) => 0.0,
        }
    }

    /// Length that scales rates of the first coordinate to speeds: the [length](Joint::length) of
    /// the first joint for an angle, 1 for a slide.
    pub fn length(&self, joints: &[Joint], bodies: &[RigidBody]) -> f64 {
        let GearAxis { joint, axis } = self.axes[0];
        match axis {
            JointAxis::Linear(_) => 1.0,
            JointAxis::Angular(_) => joints[joint].length(bodies),
        }
    }

    /// Joint forces of the gear `force` (N or N m, along the first coordinate): index of the joint
    /// and force on it. Angles are taken from `of_joints`.
    pub(crate) fn loads(&self, force: f64, of_joints: &[JointForce]) -> [(usize, JointForce); 2] {
        let load = |GearAxis { joint, axis }: GearAxis, size: f64| {
            let mut load = JointForce::none(of_joints[joint].angles);
            match axis {
                JointAxis::Linear(k) => load.force[k] = size,
                JointAxis::Angular(k) => load.torque[k] = size,
            }
            (joint, load)
        };
        [load(self.axes[0], force), load(self.axes[1], -self.ratio * force)]
    }

    /// Copy without a force of its drive, whose limits stay.
    pub(crate) fn without_drive(&self) -> Self {
        Self { law: self.law.without_drive(), ..*self }
    }

    /// Axis state at s. Its rate is zero because gears have no armature.
    pub(crate) fn start(&self, coordinate: f64) -> AxisStart {
        AxisStart { coordinate, kick: self.kick, ..AxisStart::default() }
    }
}

/// See [`World::angles_near`].
pub(crate) fn angles_near(
    joints: &[Joint],
    gears: &[Gear],
    states: &[State],
    near: &[Vector3<f64>],
) -> Vec<Vector3<f64>> {
    let counted = |joint: usize, near: Vector3<f64>| {
        let at = joints[joint].coordinates(states);
        at.map_or(Vector3::zeros(), |at| joints[joint].counted(&at, &near))
    };
    let near = |joint: usize| near.get(joint).copied().unwrap_or_default();
    let mut angles: Vec<_> = (0..joints.len()).map(|joint| counted(joint, near(joint))).collect();
    for gear in gears.iter().filter(|gear| gear.law == Axis::Locked) {
        let off = gear.error(joints, states, &angles);
        let turns = match gear.axes {
            [GearAxis { joint, axis: JointAxis::Angular(k) }, _] => Some((joint, k, -off)),
            [_, GearAxis { joint, axis: JointAxis::Angular(k) }] if gear.ratio != 0.0 => {
                Some((joint, k, off / gear.ratio))
            }
            _ => None,
        };
        if let Some((joint, k, turned)) = turns.filter(|(.., turned)| turned.is_finite()) {
            let mut near = angles[joint];
            near[k] += turned;
            angles[joint] = counted(joint, near);
        }
    }
    angles
}
