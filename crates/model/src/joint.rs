//! Joints as run.json has them: complete, and the joint that they make.

use super::shape::ModelPlace;
use serde::{Deserialize, Serialize};
use tumble_core::error::Error;
use tumble_core::joint::{Axis, Drive, Joint, Knots, Middle};

/// Which of its axes a joint leaves free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointKind {
    /// Turns about its axis.
    Revolute,
    /// Slides along its axis.
    Prismatic,
    /// Slides along its axis and turns about it.
    Cylindrical,
    /// Slides across its axis and turns about it.
    Planar,
    /// Slides across its axis, without a turn.
    Sliding,
    /// Slides along three axes, without a turn.
    Gantry,
    /// Moves in any way; drives act along the axes of the second body's frame, and along the parts of its turn.
    Free,
    /// Turns about its anchor in any way, under drives of the parts of its turn about the axes of the first body's frame.
    Spherical,
    /// The same within a cone, and under a drive of the twist.
    Ball,
    /// Turns about x of the first body's frame and y of the second's.
    Universal,
    /// Turns about these, and about a third axis that is square to both.
    Gimbal,
    /// Does not move.
    Fixed,
}

/// An axis that a drive can act on: its name, and which of the six it is, x, y, z of the place and of
/// the turn.
pub type DrivenAxis = (&'static str, usize);

/// The axis of a slide, and that of a turn.
const SLIDE: DrivenAxis = ("slide", 2);
const TURN: DrivenAxis = ("turn", 5);
/// The axes of a gimbal.
const TURN_X: DrivenAxis = ("turn_x", 3);
const TURN_Y: DrivenAxis = ("turn_y", 4);
const TURN_Z: DrivenAxis = ("turn_z", 5);

impl JointKind {
    /// The axes that drives can act on, in the order of their drives.
    #[must_use]
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

    /// The word of a file.
    #[must_use]
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

    /// Whether it has an axis, or more: whether its frames are more than their anchors.
    #[must_use]
    pub fn has_axis(self) -> bool {
        !matches!(self, Self::Free | Self::Spherical | Self::Fixed)
    }

    /// Whether it turns in any way, without angles of its own.
    #[must_use]
    pub fn turns_in_any_way(self) -> bool {
        matches!(self, Self::Free | Self::Spherical)
    }

    /// The six axes under these drives, of a ball joint within the cone (rad).
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

/// A joint of the model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointModel {
    /// What it is called.
    pub name: String,
    /// Its type.
    #[serde(rename = "type")]
    pub kind: JointKind,
    /// A: an index of `bodies`.
    pub body: usize,
    /// B: another one; null for the world.
    pub other: Option<usize>,
    /// Its frame in A and in B or the world: m, from the centre of mass, and joint → body. Its z is the axis.
    pub frames: [ModelPlace; 2],
    /// m; null for that of its bodies.
    pub length: Option<f64>,
    /// Whether its bodies touch each other.
    pub collide: bool,
    /// rad, of a ball joint: how far its z axes may be from each other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cone: Option<f64>,
    /// Of a gimbal: its middle axis; null for one square to the others, counted from where it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub middle: Option<Middle>,
    /// What acts on each axis that its type leaves to drives: m and N along, rad and N m about.
    pub drives: Vec<Drive>,
    /// How its frame in the world moves, of one that is fixed there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub course: Option<CourseModel>,
}

/// The way of a frame in the world: straight and evenly from place to place, and steadily on from the last.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CourseModel {
    /// s.
    pub times: Vec<f64>,
    /// One a time.
    pub places: Vec<ModelPlace>,
    /// After the last time, m/s.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// rad/s, world.
    #[serde(default)]
    pub spin: [f64; 3],
}

impl CourseModel {
    /// The knots.
    ///
    /// # Errors
    /// What is wrong with them, beginning with the field's name.
    pub fn knots(&self) -> Result<Knots, String> {
        if self.times.len() != self.places.len() {
            let (times, places) = (self.times.len(), self.places.len());
            return Err(format!("times: there are {times}, and {places} places"));
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
    /// The joint.
    #[must_use]
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
}

impl JointModel {
    /// Which of the axes that drives act on is that of the name; the only one without.
    ///
    /// # Errors
    /// A name that it does not have, and none where it has several.
    pub fn driven_place(&self, wanted: Option<&str>) -> Result<usize, String> {
        let driven = self.kind.driven();
        let names: Vec<_> = driven.iter().map(|(name, _)| format!("`{name}`")).collect();
        match wanted {
            None if driven.len() == 1 => Ok(0),
            None => {
                Err(format!("{:?} has several; one of {} is needed", self.name, names.join(", ")))
            }
            Some(wanted) => driven.iter().position(|(name, _)| *name == wanted).ok_or_else(|| {
                format!("{wanted:?} is none of {:?}; it has {}", self.name, names.join(", "))
            }),
        }
    }

    /// The axis of that name, of all six.
    ///
    /// # Errors
    /// As [`JointModel::driven_place`]; and a joint without drives.
    pub fn driven_axis(&self, wanted: Option<&str>) -> Result<usize, String> {
        let driven = self.kind.driven();
        if driven.is_empty() {
            return Err(format!("{:?} is {}", self.name, self.kind.name()));
        }
        self.driven_place(wanted).map(|place| driven[place].1)
    }
}
