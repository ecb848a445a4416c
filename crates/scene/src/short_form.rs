//! Short form of a document of one body: the tables `[body]` and `[start]`.

use crate::bodies::entries::{AttitudeEntry, BodyEntry};
use crate::choices::StartFrame;
use crate::tables::{InertiaValue, LoadTable, Random, Sides, SolidInertia};
use serde::{Deserialize, Serialize};
use tumble_model::fields::{Numbers, numbers};

/// Name of the body, and its place in error messages.
pub const BODY: &str = "body";

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(expecting = "a table [body]")]
#[serde(deny_unknown_fields)]
pub struct BodyTable {
    /// Sides of a box (m): one number, a cube, or three.
    #[serde(rename = "box")]
    sides: Option<Sides>,
    /// Points that can touch (m), body frame.
    points: Option<Vec<Numbers<3>>>,
    /// True for one point in the centre of mass.
    point_mass: Option<bool>,
    /// Mass (kg).
    mass: f64,
    /// Inertia (kg m²), body frame.
    inertia: Option<InertiaValue>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(expecting = "a table [start]")]
#[serde(deny_unknown_fields)]
pub struct StartTable {
    /// Position of the centre of mass (m).
    position: Numbers<3>,
    /// Attitude.
    attitude: Option<AttitudeEntry>,
    /// Velocity of the centre of mass (m/s).
    velocity: Option<Numbers<3>>,
    /// Angular velocity (rad/s), body frame.
    spin: Option<Numbers<3>>,
    /// Frame of position, attitude and velocity.
    frame: Option<StartFrame>,
}

impl BodyTable {
    /// Entry of `[[bodies]]` with the content of these tables.
    pub fn entry(self, start: StartTable, load: Option<LoadTable>) -> BodyEntry {
        let sides = self.sides.as_ref().map(Sides::vector);
        let inertia = match &sides {
            Some(sides) => {
                let given = self.inertia.unwrap_or(InertiaValue::Word(SolidInertia::Solid));
                Some(given.for_box(self.mass, sides))
            }
            None => self.inertia,
        };
        BodyEntry {
            name: Some(BODY.to_owned()),
            cuboid: sides.map(|sides| Sides::Box(numbers(&sides))),
            points: self.points,
            point_mass: self.point_mass,
            mass: Some(self.mass),
            inertia,
            load,
            position: start.position,
            attitude: start.attitude.map(|attitude| match attitude {
                AttitudeEntry::Word(_) => AttitudeEntry::Word(Random::Tutorial),
                given => given,
            }),
            velocity: start.velocity,
            spin: start.spin,
            frame: start.frame,
            ..BodyEntry::default()
        }
    }
}
