//! Joint tables as deserialised.

use crate::bodies::entries::AttitudeEntry;
use serde::Deserialize;
use tumble_core::joint::{Drive, Middle};
use tumble_model::fields::{Exactly, Numbers};
use tumble_model::joint::JointKind;
use tumble_model::shape::ModelPlace;

/// Defines a table that has the fields of a drive and others.
macro_rules! with_drive {
    ($(#[$meta:meta])* $name:ident {
        $($(#[$attribute:meta])* $field:ident: $type:ty,)*
    }) => {
        $(#[$meta])*
        #[serde(deny_unknown_fields)]
        pub struct $name {
            pub start: Option<f64>,
            pub(super) limits: Option<Numbers<2>>,
            pub(super) friction: Option<f64>,
            pub(super) static_friction: Option<f64>,
            pub(super) stiffness: Option<f64>,
            pub(super) rest: Option<f64>,
            pub(super) damping: Option<f64>,
            pub(super) force: Option<f64>,
            pub(super) armature: Option<f64>,
            $($(#[$attribute])* pub(super) $field: $type,)*
        }
    };
}

with_drive!(
    /// Fields of a drive.
    #[derive(Clone, Copy, Default, Deserialize)]
    #[serde(expecting = "{ limits = [low, high], friction = …, … }")]
    DriveEntry {}
);

with_drive!(
    #[derive(Deserialize)]
    #[serde(expecting = "a table [[joints]]")]
    JointEntry {
        name: Option<String>,
        #[serde(rename = "type")]
        kind: JointKind,
        bodies: BodyNames,
        frames: Option<Exactly<ModelPlace, 2>>,
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

#[derive(Deserialize)]
#[serde(untagged, expecting = "one name of a body or two, [\"…\", \"…\"], are needed")]
pub(super) enum BodyNames {
    One(String),
    List(Vec<String>),
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
