//! Joint tables as deserialised.

use crate::bodies::entries::AttitudeEntry;
use crate::bodies::place::Place;
use serde::{Deserialize, Serialize};
use tumble_core::joint::{Drive, FrictionCurve, Middle};
use tumble_model::fields::{Exactly, Numbers};
use tumble_model::joint::JointKind;

/// Defines a table that has the fields of a drive and others.
macro_rules! with_drive {
    ($(#[$meta:meta])* $name:ident {
        $($(#[$attribute:meta])* $field:ident: $type:ty,)*
    }) => {
        $(#[$meta])*
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($(#[$attribute])* pub $field: $type,)*
            /// Coordinate at the start (m or rad).
            pub start: Option<f64>,
            /// Hard stops (m or rad).
            pub limits: Option<Numbers<2>>,
            /// Coefficient of restitution of the stops.
            pub restitution: Option<f64>,
            /// Dry friction (N or N m).
            pub friction: Option<f64>,
            /// Static friction (N or N m).
            pub static_friction: Option<f64>,
            /// Factor of the friction over the speed: points of a speed (m/s or rad/s) and a factor.
            #[cfg_attr(feature = "schema", schemars(with = "Option<Vec<[f64; 2]>>"))]
            pub friction_curve: Option<FrictionCurve>,
            /// Stiffness of a spring (N/m or N m/rad).
            pub stiffness: Option<f64>,
            /// Rest coordinate of the spring (m or rad).
            pub rest: Option<f64>,
            /// Damping (N s/m or N m s/rad).
            pub damping: Option<f64>,
            /// Constant force or torque (N or N m).
            pub force: Option<f64>,
            /// Inertia of the rotor at the axis (kg or kg m²).
            pub armature: Option<f64>,
        }
    };
}

with_drive!(
    /// Fields of a drive.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    #[serde(expecting = "{ limits = [low, high], friction = …, … }")]
    DriveEntry {}
);

with_drive!(
    #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
    #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
    #[serde(expecting = "a table [[joints]]")]
    JointEntry {
        /// Name.
        name: Option<String>,
        /// Type.
        #[serde(rename = "type")]
        kind: JointKind,
        /// Names of both bodies, or of one that the world holds.
        bodies: BodyNames,
        /// Frames in both bodies, from their centres of mass, as a run has them.
        frames: Option<Exactly<Place, 2>>,
        /// Position (m) at the start, world frame.
        anchor: Option<Numbers<3>>,
        /// Direction of the axis at the start, world frame.
        axis: Option<Numbers<3>>,
        /// Attitude, instead of an axis, at the start, world frame.
        attitude: Option<AttitudeEntry>,
        /// Position (m), in the frame of the first body's shape.
        anchor_a: Option<Numbers<3>>,
        /// Direction of the axis, in the frame of the first body's shape.
        axis_a: Option<Numbers<3>>,
        /// Attitude, instead of an axis, in the frame of the first body's shape.
        attitude_a: Option<AttitudeEntry>,
        /// Position (m), in the frame of the second body's shape, or in the world.
        anchor_b: Option<Numbers<3>>,
        /// Direction of the axis, in the frame of the second body's shape, or in the world.
        axis_b: Option<Numbers<3>>,
        /// Attitude, instead of an axis, in the frame of the second body's shape, or in the world.
        attitude_b: Option<AttitudeEntry>,
        /// Half the width of the bearing (m).
        length: Option<f64>,
        /// Largest angle between the axes of a ball joint (rad).
        cone: Option<f64>,
        /// Angle about the middle axis of a gimbal.
        middle: Option<Middle>,
        /// True if the two bodies touch each other.
        collide: Option<bool>,
        /// Drive along the axis.
        slide: Option<DriveEntry>,
        /// Drive about the axis.
        turn: Option<DriveEntry>,
        /// Drive along x.
        x: Option<DriveEntry>,
        /// Drive along y.
        y: Option<DriveEntry>,
        /// Drive along z.
        z: Option<DriveEntry>,
        /// Drive about x.
        turn_x: Option<DriveEntry>,
        /// Drive about y.
        turn_y: Option<DriveEntry>,
        /// Drive about z.
        turn_z: Option<DriveEntry>,
    }
);

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "one name of a body or two, [\"…\", \"…\"], are needed")]
pub enum BodyNames {
    One(String),
    List(Vec<String>),
}

impl Default for BodyNames {
    fn default() -> Self {
        Self::List(Vec::new())
    }
}

impl BodyNames {
    /// The names.
    pub fn list(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::List(names) => names,
        }
    }
}

impl JointEntry {
    /// Drive of the only axis.
    pub(super) fn drive(&self) -> DriveEntry {
        let Self { start, limits, restitution, friction, static_friction, .. } = *self;
        let Self { friction_curve, stiffness, rest, damping, force, armature, .. } = *self;
        DriveEntry {
            start,
            limits,
            restitution,
            friction,
            static_friction,
            friction_curve,
            stiffness,
            rest,
            damping,
            force,
            armature,
        }
    }
}

impl From<&Drive> for DriveEntry {
    fn from(drive: &Drive) -> Self {
        let some = |number: f64| Some(number).filter(|number| *number != 0.0);
        Self {
            start: None,
            limits: drive.limits.map(Exactly),
            restitution: some(drive.restitution).filter(|_| drive.limits.is_some()),
            friction: some(drive.friction).or(drive.friction_curve.map(|_| 0.0)),
            static_friction: drive.static_friction,
            friction_curve: drive.friction_curve,
            stiffness: some(drive.stiffness),
            rest: some(drive.rest),
            damping: some(drive.damping),
            force: some(drive.force),
            armature: some(drive.armature),
        }
    }
}

impl DriveEntry {
    /// Name of the first given field.
    pub(super) fn first(&self) -> Option<&'static str> {
        let given = [
            ("start", self.start.is_some()),
            ("limits", self.limits.is_some()),
            ("restitution", self.restitution.is_some()),
            ("friction", self.friction.is_some()),
            ("static_friction", self.static_friction.is_some()),
            ("friction_curve", self.friction_curve.is_some()),
            ("stiffness", self.stiffness.is_some()),
            ("rest", self.rest.is_some()),
            ("damping", self.damping.is_some()),
            ("force", self.force.is_some()),
            ("armature", self.armature.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(field, _)| field)
    }

    /// Field without effect, and the one that it needs.
    pub(super) fn idle_field(&self) -> Option<(&'static str, &'static str)> {
        if self.restitution.is_some() && self.limits.is_none() {
            Some(("restitution", "limits"))
        } else if self.friction_curve.is_some() && self.friction.is_none() {
            Some(("friction_curve", "friction"))
        } else {
            None
        }
    }

    pub fn drive(&self) -> Drive {
        let or_none = |value: Option<f64>| value.unwrap_or(0.0);
        Drive {
            limits: self.limits.map(|limits| limits.0),
            restitution: or_none(self.restitution),
            friction: or_none(self.friction),
            static_friction: self.static_friction,
            friction_curve: self.friction_curve,
            stiffness: or_none(self.stiffness),
            rest: or_none(self.rest),
            damping: or_none(self.damping),
            force: or_none(self.force),
            armature: or_none(self.armature),
            motor: None,
        }
    }
}
