//! Types of joints and their axes.

use serde::{Deserialize, Serialize};
use tumble_core::joint::{Axis, Drive};

/// Type of a joint: the set of its free axes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
    #[default]
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
    pub fn axes(self, drives: &[Drive], cone: Option<f64>) -> [Axis; 6] {
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

    /// Index into the drives of `joint`, its name, of the axis `axis_name`; without a name, of the only
    /// axis.
    ///
    /// # Errors
    /// An unknown name, or no name for a joint with several driven axes.
    pub fn driven_place(self, joint: &str, axis_name: Option<&str>) -> Result<usize, String> {
        let driven = self.driven();
        let names: Vec<_> = driven.iter().map(|(name, _)| format!("`{name}`")).collect();
        match axis_name {
            None if driven.len() == 1 => Ok(0),
            None => {
                Err(format!("{joint:?} has several axes; one of {} is needed", names.join(", ")))
            }
            Some(axis_name) => {
                driven.iter().position(|(name, _)| *name == axis_name).ok_or_else(|| {
                    format!(
                        "{axis_name:?} is not an axis of {joint:?}; it has {}",
                        names.join(", ")
                    )
                })
            }
        }
    }

    /// Index from 0 to 5 of the driven axis `axis_name`.
    ///
    /// # Errors
    /// The errors of [`JointKind::driven_place`], and a joint without driven axes.
    pub fn driven_axis(self, joint: &str, axis_name: Option<&str>) -> Result<usize, String> {
        let driven = self.driven();
        if driven.is_empty() {
            return Err(format!("{joint:?} is {}", self.name()));
        }
        self.driven_place(joint, axis_name).map(|place| driven[place].1)
    }
}
