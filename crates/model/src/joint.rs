//! Joints of a model, and the core's joints made of them.

use super::shape::ModelPlace;
use serde::{Deserialize, Serialize};
use tumble_core::error::Error;
use tumble_core::joint::{Axis, Drive, Joint, Knots, Middle};

/// Type of a joint: the set of its free axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointKind {
    /// Rotation about the axis.
    Revolute,
    /// Translation along the axis.
    Prismatic,
    /// Translation along the axis and rotation about it.
    Cylindrical,
    /// Translation across the axis and rotation about it.
    Planar,
    /// Translation across the axis, no rotation.
    Sliding,
    /// Translation along three axes, no rotation.
    Gantry,
    /// All six degrees of freedom.
    ///
    /// Drives act along the axes of the second body's frame and on the components of the rotation
    /// vector.
    Free,
    /// Any rotation about the anchor. Drives act on the components of the rotation vector along the
    /// axes of the first body's frame.
    Spherical,
    /// Any rotation about the anchor within a cone, with a drive of the twist.
    Ball,
    /// Rotations about x of the first body's frame and y of the second body's.
    Universal,
    /// Rotations about the axes of a universal joint and about a third axis perpendicular to both.
    Gimbal,
    /// No motion.
    Fixed,
}

/// Axis that a drive can act on: its name and its index (0–2 translations x, y, z; 3–5 rotations).
pub type DrivenAxis = (&'static str, usize);

/// Driven axes of a prismatic and of a revolute joint.
const SLIDE: DrivenAxis = ("slide", 2);
const TURN: DrivenAxis = ("turn", 5);
/// Driven axes of a gimbal.
const TURN_X: DrivenAxis = ("turn_x", 3);
const TURN_Y: DrivenAxis = ("turn_y", 4);
const TURN_Z: DrivenAxis = ("turn_z", 5);

impl JointKind {
    /// Axes that drives can act on, in the order of the joint's drives.
    pub fn driven(self) -> &'static [DrivenAxis] {
        match self {
            Self::Revolute | Self::Ball => &[TURN],
            Self::Prismatic => &[SLIDE],
            Self::Cylindrical => &[SLIDE, TURN],
            Self::Planar => &[("x", 0), ("y", 1), TURN],
            Self::Sliding => &[("x", 0), ("y", 1)],
            Self::Gantry => &[("x", 0), ("y", 1), ("z", 2)],
            Self::Free => &[("x", 0), ("y", 1), ("z", 2), TURN_X, TURN_Y, TURN_Z],
            Self::Universal => &[TURN_X, TURN_Y],
            Self::Gimbal | Self::Spherical => &[TURN_X, TURN_Y, TURN_Z],
            Self::Fixed => &[],
        }
    }

    /// Name of the type in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Revolute => "revolute",
            Self::Prismatic => "prismatic",
            Self::Cylindrical => "cylindrical",
            Self::Planar => "planar",
            Self::Sliding => "sliding",
            Self::Gantry => "gantry",
            Self::Free => "free",
            Self::Spherical => "spherical",
            Self::Ball => "ball",
            Self::Universal => "universal",
            Self::Gimbal => "gimbal",
            Self::Fixed => "fixed",
        }
    }

    /// True if the type has a distinguished axis, so that the attitudes of its frames matter.
    pub fn has_axis(self) -> bool {
        !matches!(self, Self::Free | Self::Spherical | Self::Fixed)
    }

    /// True if the rotation is unrestricted and the type has no joint angles.
    pub fn turns_freely(self) -> bool {
        matches!(self, Self::Free | Self::Spherical)
    }

    /// Six axes of a joint with these drives. `cone` limits a ball joint (rad).
    fn axes(self, drives: &[Drive], cone: Option<f64>) -> [Axis; 6] {
        let mut axes = [Axis::Locked; 6];
        if self == Self::Ball {
            axes[3..6].fill(Axis::Free(Drive::NONE));
        }
        if let (Self::Ball, Some(cone)) = (self, cone) {
            axes[3] = Axis::Free(Drive { limits: Some([0.0, cone]), ..Drive::NONE });
        }
        for (index, (_, axis)) in self.driven().iter().enumerate() {
            axes[*axis] = Axis::Free(drives.get(index).copied().unwrap_or_default());
        }
        axes
    }
}

/// Joint of a [`Model`](crate::Model).
#[derive(Debug, Clone, PartialEq)]
pub struct JointModel {
    /// Name of the joint.
    pub name: String,
    /// Type of the joint.
    pub kind: JointKind,
    /// First body A, an index into `bodies`.
    pub body: usize,
    /// Second body B, an index into `bodies`; null for the world.
    pub other: Option<usize>,
    /// Frame of the joint in A and in B or the world: position from the centre of mass (m) and
    /// rotation joint → body. Its z axis is the joint's axis.
    pub frames: [ModelPlace; 2],
    /// Characteristic length of the rotational rows (m), see (J2); null for the value computed from
    /// the bodies.
    pub length: Option<f64>,
    /// True if the two bodies can touch each other.
    pub collide: bool,
    /// Maximum angle between the z axes of a ball joint (rad).
    pub cone: Option<f64>,
    /// Zero and sign of the middle angle of a gimbal, see (J13); null for `STRAIGHT` of [`Middle`].
    pub middle: Option<Middle>,
    /// Drive of each driven axis: m and N for translations, rad and N m for rotations.
    pub drives: Vec<Drive>,
    /// Prescribed motion of the joint's frame in the world. The second body must be null.
    pub course: Option<CourseModel>,
}

/// Prescribed motion of a frame in the world: piecewise linear, then with constant velocity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CourseModel {
    /// Times of the knots (s).
    pub times: Vec<f64>,
    /// Place at each time.
    pub places: Vec<ModelPlace>,
    /// Velocity after the last time (m/s).
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Angular velocity after the last time (rad/s), world frame.
    #[serde(default)]
    pub spin: [f64; 3],
}

impl CourseModel {
    /// Prescribed motion in the form of the core.
    ///
    /// # Errors
    /// Invalid knots or velocities; the sentence begins with the name of the field.
    pub fn knots(&self) -> Result<Knots, String> {
        if self.times.len() != self.places.len() {
            let (times, places) = (self.times.len(), self.places.len());
            return Err(format!(
                "times: {times} times and {places} places; as many of both are needed"
            ));
        }
        let frames = self.places.iter().map(ModelPlace::frame);
        let knots = Knots::new(self.times.iter().copied().zip(frames).collect());
        let knots = knots.map_err(|error| format!("times: {error}"))?;
        let steady = knots.going_on(self.velocity.into(), self.spin.into());
        steady.map_err(|error| match error {
            Error::OutOfRange { field, .. } if field.starts_with("spin") => {
                format!("spin: {error}")
            }
            other => format!("velocity: {other}"),
        })
    }
}

impl JointModel {
    /// Joint in the form of the core.
    pub fn joint(&self) -> Joint {
        let [x, y, z, rx, ry, rz] = self.kind.axes(&self.drives, self.cone);
        let joint =
            Joint::between(self.body, self.other, self.frames.each_ref().map(ModelPlace::frame))
                .with_axes([x, y, z], [rx, ry, rz]);
        let joint = match self.kind {
            JointKind::Gimbal => joint.with_middle(self.middle.unwrap_or(Middle::STRAIGHT)),
            _ => joint,
        };
        let joint = match self.length {
            Some(length) => joint.with_length(length),
            None => joint,
        };
        if self.collide { joint.colliding() } else { joint }
    }

    /// Index into the joint's drives of the axis `axis_name`; without a name, of the only axis.
    ///
    /// # Errors
    /// An unknown name, or no name for a joint with several driven axes.
    pub fn driven_place(&self, axis_name: Option<&str>) -> Result<usize, String> {
        let driven = self.kind.driven();
        let names: Vec<_> = driven.iter().map(|(name, _)| format!("`{name}`")).collect();
        match axis_name {
            None if driven.len() == 1 => Ok(0),
            None => Err(format!(
                "{:?} has several axes; one of {} is needed",
                self.name,
                names.join(", ")
            )),
            Some(axis_name) => {
                driven.iter().position(|(name, _)| *name == axis_name).ok_or_else(|| {
                    format!(
                        "{axis_name:?} is not an axis of {:?}; it has {}",
                        self.name,
                        names.join(", ")
                    )
                })
            }
        }
    }

    /// Index from 0 to 5 of the driven axis `axis_name`.
    ///
    /// # Errors
    /// The errors of [`JointModel::driven_place`], and a joint without driven axes.
    pub fn driven_axis(&self, axis_name: Option<&str>) -> Result<usize, String> {
        let driven = self.kind.driven();
        if driven.is_empty() {
            return Err(format!("{:?} is {}", self.name, self.kind.name()));
        }
        self.driven_place(axis_name).map(|place| driven[place].1)
    }
}
