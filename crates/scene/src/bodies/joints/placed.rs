//! Frames of a joint in its bodies at the start.

use crate::bodies::entries::{AttitudeEntry, BodyEntry};
use crate::bodies::place::Place;
use nalgebra::{Vector3, Vector4};
use tumble_core::joint::JointFrame;
use tumble_core::mechanics::State;
use tumble_core::mechanics::quaternion::{left, rotation};
use tumble_model::fields::Numbers;

/// Frame of a joint in the world at the start.
#[derive(Clone, Copy)]
pub struct JointStartFrame {
    pub anchor: Vector3<f64>,
    pub(super) attitude: Vector4<f64>,
}

/// Initial state of one side of a joint: a body or the world.
pub struct JointSide<'a> {
    /// Centre of mass in the shape's frame (m).
    centre: Vector3<f64>,
    start: State,
    /// Name for error messages.
    pub(super) name: &'a str,
}

impl<'a> JointSide<'a> {
    pub fn new(body: Option<&'a BodyEntry>) -> Self {
        match body {
            Some(body) => Self { centre: body.centre(), start: body.start(), name: body.name() },
            None => {
                let [position, velocity, spin] = [Vector3::zeros(); 3];
                let attitude = Place::ORIGIN.attitude.into();
                let start = State { position, attitude, velocity, spin };
                Self { centre: Vector3::zeros(), start, name: "the world" }
            }
        }
    }

    /// Converts a frame from the shape's frame to the world.
    pub fn placed(&self, anchor: &Vector3<f64>, attitude: &Vector4<f64>) -> JointStartFrame {
        let arm = rotation(&self.start.attitude) * (anchor - self.centre);
        let anchor = self.start.position + arm;
        JointStartFrame { anchor, attitude: left(&self.start.attitude) * attitude }
    }

    /// Converts a point from the shape's frame to a position relative to the centre of mass (m).
    pub fn relative_to_centre(&self, place: &[f64; 3]) -> [f64; 3] {
        (Vector3::from(*place) - self.centre).into()
    }

    /// Converts a frame from the world to the body frame.
    pub fn to_local(&self, placed: &JointStartFrame) -> Place {
        let position =
            rotation(&self.start.attitude).tr_mul(&(placed.anchor - self.start.position));
        let attitude = left(&conjugated(&self.start.attitude)) * placed.attitude;
        Place { position: position.into(), attitude: attitude.into() }
    }
}

fn conjugated(q: &Vector4<f64>) -> Vector4<f64> {
    Vector4::new(q[0], -q[1], -q[2], -q[3])
}

/// Attitude given by `axis` or `attitude`; `ending` is the suffix of the fields (`_a`, …).
pub(super) fn turned(
    ending: &str,
    axis: Option<&Numbers<3>>,
    attitude: Option<&AttitudeEntry>,
) -> Result<Option<Vector4<f64>>, String> {
    match (axis, attitude) {
        (None, None) => Ok(None),
        (Some(_), Some(_)) => Err(format!(
            "axis{ending}: only one of `axis{ending}` and `attitude{ending}` can be given"
        )),
        (Some(axis), None) => {
            let along = JointFrame::along(Vector3::zeros(), axis.0.into());
            let along = along.map_err(|error| format!("axis{ending}: {error}"))?;
            Ok(Some(along.attitude))
        }
        (None, Some(turned)) => match turned.quaternion() {
            Ok(Some(quaternion)) => Ok(Some(quaternion.into())),
            Ok(None) => Err(format!("attitude{ending}: only bodies can have a random one")),
            Err(why) => Err(format!("attitude{ending}: {why}")),
        },
    }
}

pub fn anchor_in_range(field: &str, anchor: Option<&Numbers<3>>) -> Result<(), String> {
    let fits = anchor.is_none_or(|anchor| anchor.0.iter().all(|x| x.abs() <= 1e4));
    if fits { Ok(()) } else { Err(format!("{field}: coordinates from -1e4 to 1e4 m are needed")) }
}
