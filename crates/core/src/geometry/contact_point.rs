//! Points of a body that can touch something.

use super::Ellipsoid;
use nalgebra::{Matrix3, Vector3};

/// Point of a body that can touch something.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactPoint {
    /// Position c (m), body frame.
    pub position: Vector3<f64>,
    /// Rounding radius ρ of the body at this point (m).
    pub radius: f64,
    /// Half axes S of the [ellipsoid](Ellipsoid) about the position, as columns (m, body frame). It
    /// touches a plane at its nearest point. `None` for a point of the body.
    pub ellipsoid: Option<Box<Matrix3<f64>>>,
    /// True for the second point of the ellipsoid before it. A step takes it if the ellipsoid also
    /// comes down elsewhere.
    pub is_second: bool,
}

impl ContactPoint {
    /// Point with a rounding radius (m).
    pub fn rounded(position: Vector3<f64>, radius: f64) -> Self {
        Self { position, radius, ellipsoid: None, is_second: false }
    }

    /// Both contact points of an ellipsoid.
    pub fn from_ellipsoid(one: &Ellipsoid) -> [Self; 2] {
        let point = |is_second| Self {
            position: one.centre,
            radius: 0.0,
            ellipsoid: Some(Box::new(one.axes)),
            is_second,
        };
        [point(false), point(true)]
    }

    /// The ellipsoid, if the point has one.
    pub fn smooth(&self) -> Option<Ellipsoid> {
        let axes = self.ellipsoid.as_ref()?;
        Some(Ellipsoid { centre: self.position, axes: **axes })
    }

    /// Largest coordinates of the point's surface relative to the position (m).
    pub fn half_extents(&self) -> Vector3<f64> {
        let own = self.smooth().map_or(Vector3::zeros(), |one| one.half_extents());
        own.add_scalar(self.radius)
    }

    /// Bound on the distance of the point's surface from the position (m).
    pub fn size(&self) -> f64 {
        self.radius + self.smooth().map_or(0.0, |one| one.size())
    }
}
