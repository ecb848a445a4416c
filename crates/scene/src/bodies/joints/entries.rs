//! Joint tables as deserialised.

use crate::bodies::entries::AttitudeEntry;
use crate::bodies::place::Place;
use serde::{Deserialize, Serialize};
use tumble_core::joint::{Drive, Middle};
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
            pub start: Option<f64>,
            pub limits: Option<Numbers<2>>,
            pub friction: Option<f64>,
            pub static_friction: Option<f64>,
            pub stiffness: Option<f64>,
            pub rest: Option<f64>,
            pub damping: Option<f64>,
            pub force: Option<f64>,
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
        name: Option<String>,
        #[serde(rename = "type")]
        kind: JointKind,
        bodies: BodyNames,
        frames: Option<Exactly<Place, 2>>,
        anchor: Option<Numbers<3>>,
        axis: Option<Numbers<3>>,
        attitude: Option<AttitudeEntry>,
        anchor_a: Option<Numbers<3>>,
        axis_a: Option<Numbers<3>>,
        attitude_a: Option<AttitudeEntry>,
        anchor_b: Option<Numbers<3>>,
        axis_b: Option<Numbers<3>>,
        attitude_b: Option<AttitudeEntry>,
        length: Option<f64>,
        cone: Option<f64>,
        middle: Option<Middle>,
        collide: Option<bool>,
        slide: Option<DriveEntry>,
        turn: Option<DriveEntry>,
        x: Option<DriveEntry>,
        y: Option<DriveEntry>,
        z: Option<DriveEntry>,
        turn_x: Option<DriveEntry>,
        turn_y: Option<DriveEntry>,
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
        let Self { start, limits, friction, static_friction, stiffness, .. } = *self;
        let Self { rest, damping, force, armature, .. } = *self;
        DriveEntry {
            start,
            limits,
            friction,
            static_friction,
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
            friction: some(drive.friction),
            static_friction: drive.static_friction,
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
            ("friction", self.friction.is_some()),
            ("static_friction", self.static_friction.is_some()),
            ("stiffness", self.stiffness.is_some()),
            ("rest", self.rest.is_some()),
            ("damping", self.damping.is_some()),
            ("force", self.force.is_some()),
            ("armature", self.armature.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(field, _)| field)
    }

    pub fn drive(&self) -> Drive {
        let or_none = |value: Option<f64>| value.unwrap_or(0.0);
        Drive {
            limits: self.limits.map(|limits| limits.0),
            friction: or_none(self.friction),
            static_friction: self.static_friction,
            stiffness: or_none(self.stiffness),
            rest: or_none(self.rest),
            damping: or_none(self.damping),
            force: or_none(self.force),
            armature: or_none(self.armature),
            motor: None,
        }
    }
}
