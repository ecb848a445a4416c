//! Geometric features of contacts.

use super::Curved;
use super::curved::{EllipsoidPoint, turn_from};
use crate::geometry::Ellipsoid;
use crate::kinematics::StepMap;
use crate::mechanics::State;
use crate::mechanics::quaternion::rotation;
use nalgebra::{Matrix3, Vector3};

/// Geometric features of a contact, the input of [`Contact::new`](super::Contact::new).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Features {
    /// a: point (m, frame of A).
    pub point: Vector3<f64>,
    /// ρ: rounding radius about a (m).
    pub radius: f64,
    /// (t₁, t₂, n) as columns (unit, right-handed, frame of B); n points away from B.
    pub frame: Matrix3<f64>,
    /// d: offset of the plane n·x = d (m, frame of B).
    pub offset: f64,
    /// Features with a gap of their own. For two round features, point, frame and offset are
    /// recomputed from the closest points at k, and the given ones are ignored. The point of an
    /// ellipsoid follows from [its direction](EllipsoidPoint::toward).
    pub curved: Option<Curved>,
}

impl Features {
    /// Features of a point, rounded by a radius, against a plane. See the fields.
    pub fn from_plane(point: Vector3<f64>, radius: f64, frame: Matrix3<f64>, offset: f64) -> Self {
        Self { point, radius, frame, offset, curved: None }
    }

    /// Replaces the point by an ellipsoid against the plane, in a step of `time_step` (s) from the
    /// states `at` of A and B; `None` for a plane that does not move. The point is in the direction
    /// `toward`. With `toward` = 0 it follows from the [lever](EllipsoidPoint::lever).
    #[inline(never)]
    pub fn roll(
        &mut self,
        shape: Ellipsoid,
        toward: Vector3<f64>,
        at: (&State, Option<&State>),
        map: &StepMap,
    ) {
        let mut one = EllipsoidPoint { shape, toward };
        if toward != Vector3::zeros() {
            self.point = shape.centre - shape.axes * toward;
        } else {
            let normal = self.frame.column(2).into_owned();
            let turn = turn_from(&rotation(&at.0.attitude), at.1.map(|b| rotation(&b.attitude)));
            one.toward = shape.direction(&turn.tr_mul(&normal));
            self.point = shape.centre + turn.tr_mul(&one.lever(&normal, at, map));
        }
        self.curved = Some(Curved::Ellipsoid(one));
    }
}
